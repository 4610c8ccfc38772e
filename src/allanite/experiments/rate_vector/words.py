# SPDX-License-Identifier: BSD-3-Clause
"""What a rate vector says, in sentences."""

from __future__ import annotations

from allanite.experiments.rate_vector.verdict import LeftOut, VectorRemark
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN

__all__ = [
    "LEFT_OUT",
    "REMARKS",
    "STATEMENT",
    "all_moves",
    "excluded",
    "in_poses",
    "no_rest",
    "resolved",
    "too_small",
]

_EARTH = EARTH_RATE / DEG_H

STATEMENT = (
    "the magnitude is |bias + Earth|: it includes the biases of the three gyros, and only turning the sensor separates "
    "them from the Earth's rotation. A sensor measures that rotation this way only if its biases are well below "
    f"{_EARTH:.0f} deg/h"
)
LEFT_OUT = {
    LeftOut.MOVING: "moves more than the quiet parts",
    LeftOut.BESIDE: "next to a disturbance",
    LeftOut.OFF: "its mean differs from that of the other quiet parts: a slow rotation, or a drift of the bias",
    LeftOut.MISSING: "samples missing",
    LeftOut.SHORT: "too short between two turns of the sensor",
    LeftOut.REST: "too short for a cell, at the end of the record",
}
REMARKS = {
    VectorRemark.UNDISTURBED: "record longer, with nobody near the sensor and engines off",
    VectorRemark.LONGER: "record longer, or use a sensor with less noise",
    VectorRemark.TURN: "turn the sensor about a known axis to separate its biases from the Earth's rotation",
    VectorRemark.HALF_TURN: (
        "turn the sensor by half a turn about a level axis, and record both poses for as long as the longest"
    ),
}


def in_poses(count: int) -> str:
    """That the vector is that of one pose only."""
    return f"the sensor had {plural(count, 'pose')}: all of them give the magnitude, the longest gives the vector"


def no_rest(quiet: float, duration: float, cell: float) -> str:
    """Why nothing is measured: too little of the record is at rest."""
    return f"no quiet stretch: only {quiet:.0f} s of {duration:.0f} s are at rest, in cells of {cell:.1f} s"


def all_moves(restlessness: float) -> str:
    """Why nothing is measured: there is no rest to compare with."""
    return (
        f"no quiet stretch: even at its quietest the sensor moves {restlessness:.1f} times as much over seconds as "
        "over fractions of a second, which noise at rest does not do"
    )


def too_small(length: float, sd: float, high: float) -> str:
    """Why the length is not resolved."""
    return (
        f"the magnitude, |bias + Earth|, is {length / sd:.1f} standard deviations from zero; {SEEN:g} are required. "
        f"It is below {_text(high)} deg/h"
    )


def excluded(low: float, high: float) -> str:
    """Why the length is not that of the Earth."""
    least = max(low / DEG_H - _EARTH, _EARTH - high / DEG_H) * DEG_H
    return (
        f"the magnitude is |bias + Earth|: its interval {_text(low)} to {_text(high)} deg/h excludes the known "
        f"{_EARTH:.3f} deg/h, so the biases together are at least {_text(least)} deg/h (or the scale factors are "
        "wrong). This does not measure the Earth's rotation"
    )


def resolved(length: float, low: float, high: float, *, backed: bool) -> str:
    """Why the length may be the Earth's rotation."""
    length, low, high = (x / DEG_H for x in (length, low, high))
    support = "its direction agrees with the latitude" if backed else "nothing in this record bounds them"
    return (
        f"{length:.3f} deg/h, and the interval {low:.3f} to {high:.3f} deg/h includes the known {_EARTH:.3f}; this is "
        f"the Earth's rotation if the biases are well below it ({support})"
    )


def _text(rate: float) -> str:
    """In deg/h: four digits, and none of them an exponent."""
    value = rate / DEG_H
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
