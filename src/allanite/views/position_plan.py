# SPDX-License-Identifier: BSD-3-Clause
"""What a plan of positions says: the positions in order, what they will tell, and the usual schemes beside it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.experiments.position_planning import PositionPlan
from allanite.plain_files.counted import plural
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number
from allanite.recording.calibration import ACCELEROMETER
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Cell,
    Hero,
    Page,
    PageBlock,
    References,
    Text,
    equation,
    pairs,
    table,
)
from allanite.views.result_page import advice, pictures, result_page, verdict_banner
from allanite.views.wording.rates import DEG, angle, model_words

__all__ = ["parameter_unit", "rows", "view"]

FEDOROV = "V. V. Fedorov, “Theory of Optimal Experiments”, Academic Press (1972)."
_PICTURES = {
    "sphere": "What points up in each position.",
    "length": "Standard deviations over their goals, by length of the record.",
    "schemes": "This plan and common schemes.",
}


def view(document: ResultDocument[PositionPlan]) -> Page:
    """The page of a plan of positions."""
    result = document.result
    return result_page(
        document,
        title=f"{result.what.capitalize()}: which positions, how long",
        kicker="Plan",
        facts=[
            ("Positions", str(len(result.positions))),
            ("Length", duration(result.total)),
            ("From rest to rest", duration(result.turn)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "known": ("What will be known", [*_known(result)]),
            "method": ("Method", _method(result)),
        },
    )


def _verdict(result: PositionPlan) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.says)
    yield from advice(result.notes)
    yield Hero(
        duration(result.total),
        f"for {plural(len(result.positions), 'position')}",
        f"{duration(result.turn)} from rest to rest",
        "the goals are reached" if result.reached else "the goals are not reached",
        result.verdict.tone,
    )
    yield from table(
        ("Number", "Position", "Rest"),
        [(str(p.number), p.words, duration(p.dwell)) for p in result.positions],
        caption="In this order.",
    )
    yield from table(
        ("Scheme", "Reaches the goals after", "sd over goal in this time", "Not determined"),
        [*_schemes(result)],
        caption="Common schemes with equal rests, for comparison.",
    )


def _schemes(result: PositionPlan) -> Iterator[tuple[str, str, str, str]]:
    """When each reaches the goals, how near it comes in the time of the plan, and how much stays open."""
    here = f"this plan, {plural(len(result.positions), 'position')}"
    mine = (here, result.total if result.reached else None, result.worst, result.open)
    for name, total, worst, left in (mine, *((s.name, s.total, s.worst, s.open) for s in result.schemes)):
        yield (
            name,
            "never" if total is None else duration(total),
            "–" if worst is None else number(worst, 2),
            str(len(left) or ""),
        )


def _known(result: PositionPlan) -> Iterator[PageBlock]:
    yield from table(
        ("Parameter", "Unit", "Standard deviation", "Goal"),
        [_line(result, name, sd) for name, sd in zip(result.names, result.sd.tolist(), strict=True)],
        caption="Under the noise alone.",
    )
    yield pairs(
        [
            ("Whole record", duration(result.total)),
            ("From rest to rest", duration(result.turn)),
            ("Latitude", "not given" if result.latitude is None else angle(result.latitude)),
            *((f"Noise of {name}", model_words(model)) for name, model in result.models.items()),
        ]
    )


def _line(result: PositionPlan, name: str, sd: float) -> tuple[str | Cell, ...]:
    """Parameter, unit, predicted standard deviation, and what was wanted."""
    unit, factor = parameter_unit(name)
    goal, open_ = result.goal(name), name in result.open
    predicted = "not determined" if open_ or not math.isfinite(sd) else number(sd / factor, 3)
    look = "limit" if open_ else "value"
    return name, unit, Cell(text=predicted, look=look), "" if goal is None else number(goal / factor, 3)


def parameter_unit(name: str) -> tuple[str, float]:
    """People's unit of a parameter or a kind of parameter, and its size in SI."""
    sensor, _, rest = name.partition(".")
    if not rest:
        return "deg", DEG
    kind = rest.partition("_")[0]
    if kind == "bias":
        return ("mg", 9.80665e-3) if sensor == ACCELEROMETER else display_unit("rate", "mean")
    return ("ppm", 1e-6) if kind == "scale" else ("mrad", 1e-3)


def _method(result: PositionPlan) -> list[PageBlock]:
    words = "The covariance is the one that the alignment will state, computed without samples."
    if result.what == "calibration":
        words = (
            "The covariance depends on the positions, the turns and the noise models, not on the data: it "
            "is the one that the calibration will state. Positions are added one by one, always the most "
            "useful one. They are then exchanged, dropped or prolonged as long as this shortens the record."
        )
    return [Text(words), *equation("least_squares"), References([FEDOROV])]


def rows(result: PositionPlan) -> Iterator[dict[str, object]]:
    """One row of a table for each position."""
    for row in result.table():
        angles = {
            name: math.degrees(value)
            for name, value in (("roll", row["roll"]), ("pitch", row["pitch"]), ("heading", row["heading"]))
        }
        yield {
            "number": row["number"],
            "start_s": f"{row['start']:g}",
            "stop_s": f"{row['stop']:g}",
            "position": row["position"],
            **{f"{name}_deg": f"{value:.3f}" for name, value in angles.items()},
        }
