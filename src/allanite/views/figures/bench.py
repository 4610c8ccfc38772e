# SPDX-License-Identifier: BSD-3-Clause
"""The bench of the seed paper as a line drawing: sensor on a turntable, supply, multimeter, GPIB, computer."""

from __future__ import annotations

import math

from allanite.views.figures.drawing import Drawing, DrawnShape, Words, arc, arrow, box, circle, line

__all__ = ["bench"]

_WIDTH, _HEIGHT = 100.0, 48.5
_TOP = 8.0  # of the bench, on which everything stands
_AXLE = 21.0  # where the turntable's axis stands
_Parts = list[DrawnShape | Words]


def bench() -> Drawing:
    """The set-up, on a sheet of 100 by 48.5."""
    parts: _Parts = [*_table(), *_turntable(), *_supply(), *_multimeter(), *_computer(), *_cables()]
    parts += [*_captions(), *_from_above()]
    return Drawing(width=_WIDTH, height=_HEIGHT, parts=tuple(parts))


def _table() -> _Parts:
    return [box(1.0, _TOP - 1.4, 98.0, 1.4, colour="guide", fill="gap", opacity=0.35, name="bench")]


def _turntable() -> _Parts:
    """Plate on its bearing, sensor on the plate, and the hand that turns it."""
    plate = _TOP + 4.6
    return [
        box(_AXLE - 3.2, _TOP, 6.4, 4.6, fill="paper", name="bearing"),
        line((_AXLE, _TOP + 0.8), (_AXLE, 33.4), colour="guide", dashed=True, name="axis of the turntable"),
        box(_AXLE - 11.5, plate, 23.0, 1.8, round_=0.9, fill="gap", opacity=0.5, name="turntable"),
        box(_AXLE - 6.5, plate + 1.8, 13.0, 6.6, round_=0.6, fill="paper", colour=None),
        box(
            _AXLE - 6.5,
            plate + 1.8,
            13.0,
            6.6,
            round_=0.6,
            colour="z",
            fill="z",
            opacity=0.14,
            line_width=1.3,
            name="sensor",
        ),
        Words(x=_AXLE, y=plate + 5.9, text="SiRRS01-03", bold=True, size=0.95),
        Words(x=_AXLE, y=plate + 3.7, text="gyroscope", size=0.9),
        *arrow((_AXLE + 6.5, 16.6), (37.2, 16.6), colour="x", width=1.8, name="sensitive axis"),
        Words(x=_AXLE + 7.2, y=18.2, text="sensitive axis", colour="x", across="left", size=0.95),
        *arrow(
            *arc((_AXLE, 31.6), 5.0, math.radians(-235), math.radians(60), flat=0.32),
            colour="purple",
            width=1.4,
            name="turn",
        ),
        Words(
            x=_AXLE + 6.4,
            y=31.6,
            text="turned by hand, 180 deg every 30 s",
            colour="purple",
            across="left",
            size=0.95,
        ),
        *_hand(plate),
    ]


def _hand(plate: float) -> _Parts:
    """A fist around the rim of the plate, with its sleeve."""
    left = _AXLE - 14.3
    fingers = [
        line((left + 2.6, plate + y), (left + 4.7, plate + y), width=0.8, name="finger")
        for y in (-0.1, 1.0, 2.1)
    ]
    sleeve = (
        (left + 0.4, plate + 2.2),
        (left + 2.9, plate + 3.6),
        (left - 1.3, plate + 9.6),
        (left - 5.4, plate + 7.0),
    )
    cuff = (
        (left - 0.2, plate + 2.9),
        (left + 2.7, plate + 4.6),
        (left + 2.0, plate + 5.7),
        (left - 1.0, plate + 3.9),
    )
    return [
        DrawnShape(points=sleeve, closed=True, fill="paper", name="sleeve"),
        DrawnShape(points=sleeve, closed=True, fill="purple", opacity=0.22, colour=None),
        DrawnShape(points=cuff, closed=True, fill="paper", name="cuff"),
        box(left, plate - 1.3, 4.9, 4.6, round_=1.5, fill="paper", name="hand"),
        *fingers,
    ]


def _supply() -> _Parts:
    left, width = 41.0, 13.0
    return [
        box(left, _TOP, width, 9.0, round_=0.6, fill="paper", name="supply"),
        box(left + 1.4, _TOP + 4.6, 6.0, 3.0, colour="guide", fill="y", opacity=0.15),
        Words(x=left + 4.4, y=_TOP + 6.1, text="V  A", size=0.85),
        *[circle((left + 9.6, _TOP + y), 1.0, fill="paper", colour="guide") for y in (2.4, 6.2)],
        *[line((left + 9.6, _TOP + y), (left + 10.3, _TOP + y + 0.7), colour="guide") for y in (2.4, 6.2)],
        circle((left + 2.8, _TOP + 2.2), 0.6, colour="x", fill="x"),
        circle((left + 5.8, _TOP + 2.2), 0.6, fill="ink"),
    ]


def _multimeter() -> _Parts:
    left, width = 58.0, 20.0
    keys = [
        box(left + 1.4 + 1.8 * i, _TOP + y, 1.2, 0.9, colour="guide", fill="paper")
        for i in range(7)
        for y in (1.2, 2.8)
    ]
    return [
        box(left, _TOP, width, 10.0, round_=0.6, fill="paper", name="multimeter"),
        box(left + 1.4, _TOP + 5.0, 12.4, 3.6, colour="guide", fill="y", opacity=0.15),
        Words(x=left + 7.6, y=_TOP + 6.8, text="−0.0012346 V", size=0.9),
        *keys,
        circle((left + 16.9, _TOP + 7.2), 0.7, colour="x", fill="x"),
        circle((left + 16.9, _TOP + 4.8), 0.7, fill="ink"),
    ]


def _computer() -> _Parts:
    left = 84.0
    trace = [(0.0, 0.0), (2.2, 0.3), (2.5, 2.4), (2.8, 0.1), (5.0, -0.2), (5.3, -2.3), (5.6, 0.0), (8.2, 0.2)]
    return [
        box(left, _TOP, 14.0, 3.4, round_=0.4, fill="paper", name="computer"),
        circle((left + 12.2, _TOP + 1.7), 0.5, colour="guide", fill="y", opacity=0.8),
        line((left + 1.5, _TOP + 1.7), (left + 7.0, _TOP + 1.7), colour="guide"),
        box(left + 5.6, _TOP + 3.4, 2.8, 1.4, fill="paper"),
        box(left + 1.0, _TOP + 4.8, 12.0, 9.0, round_=0.5, fill="paper"),
        box(left + 1.9, _TOP + 5.7, 10.2, 7.2, colour="guide", fill="z", opacity=0.08),
        line(*((left + 2.9 + x, _TOP + 9.2 + y) for x, y in trace), colour="z"),
    ]


def _cables() -> _Parts:
    """From supply to sensor, from sensor to multimeter, and the bus from there to the computer."""
    out, feed = _AXLE + 2.2, _AXLE + 4.8
    return [
        *arrow(
            (47.5, 17.0),
            (47.5, 23.2),
            (feed, 23.2),
            (feed, 21.0),
            colour="orange",
            width=1.2,
            name="supply cable",
        ),
        Words(x=36.5, y=21.6, text="d.c. supply", colour="orange", size=0.95),
        *arrow(
            (out, 21.0), (out, 27.0), (68.0, 27.0), (68.0, 18.0), colour="z", width=1.2, name="signal cable"
        ),
        Words(x=50.5, y=25.4, text="analog output [V], follows the rate", colour="z", size=0.95),
        *arrow((78.0, 9.7), (84.0, 9.7), width=2.4, both=True, head=1.7, name="GPIB"),
        Words(x=81.0, y=11.6, text="GPIB", size=0.9),
    ]


def _captions() -> _Parts:
    captions = (
        (_AXLE, "turntable on a level bench,\naxis of rotation vertical"),
        (47.5, "power supply"),
        (68.0, "Agilent 3458A multimeter,\n32 readings per second"),
        (91.0, "computer,\nwrites the log"),
    )
    return [Words(x=x, y=_TOP - 2.6, text=text, up="top") for x, text in captions]


def _from_above() -> _Parts:
    """The turntable from above, and what either direction shows."""
    centre, r = (12.0, 41.5), 4.4
    rows = (
        ("Seen from above", True),
        ("axis to the north:  bias + Ω cos φ", False),
        ("axis to the south:  bias − Ω cos φ", False),
        ("half the difference is Ω cos φ: the Earth, at the latitude φ", False),
    )
    return [
        circle(centre, r, fill="gap", opacity=0.3, name="turntable from above"),
        box(centre[0] - 1.5, centre[1] - 1.2, 3.0, 2.4, colour="z", fill="paper", line_width=1.2),
        *arrow((centre[0], centre[1] - 3.9), (centre[0], centre[1] + 3.9), colour="x", width=1.6, both=True),
        Words(x=centre[0], y=centre[1] + r + 1.3, text="N", bold=True),
        Words(x=centre[0], y=centre[1] - r - 1.3, text="S", bold=True),
        *[
            Words(x=20.5, y=45.7 - 2.7 * i, text=text, bold=bold, across="left")
            for i, (text, bold) in enumerate(rows)
        ],
    ]
