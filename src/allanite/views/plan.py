# SPDX-License-Identifier: BSD-3-Clause
"""What a plan says: whether its goal is reached, and the standard deviation by dwell and length of record."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from allanite.experiments.planning import Plan
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.number_words import duration, number
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Banner, Cell, Hero, Page, PageBlock, Text, drawn, equation, pairs, table
from allanite.views.result_page import result_page, verdict_banner
from allanite.views.wording.rates import DEG, angle, model_words, sentence

__all__ = ["rows", "view"]


def view(document: ResultDocument[Plan]) -> Page:
    """The page of a plan."""
    result = document.result
    what = "Earth rate" if result.what == "rate" else "North"
    return result_page(
        document,
        title=f"{what}: how long, which dwell",
        kicker="Plan",
        facts=[
            ("Goal", result.amount(result.goal)),
            ("Latitude", angle(result.latitude)),
            ("Time lost per turn", f"{result.dead_time:g} s"),
            ("Positions", str(result.positions)),
            ("Axes", str(result.axes)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(document)]),
            "pictures": ("Pictures", _pictures(result)),
            "method": ("Method", _method(document)),
        },
    )


def _verdict(document: ResultDocument[Plan]) -> Iterator[PageBlock]:
    result = document.result
    goal = result.amount(result.goal)
    yield verdict_banner(result.verdict, result.says)
    for note in result.notes:
        yield Banner("warning", "Doubtful.", sentence(note))
    if result.duration is not None and result.dwell is not None:
        yield Hero(
            duration(result.duration),
            f"for {goal}",
            f"with dwells of {duration(result.dwell)}",
            "standard deviation, one record, this sensor",
            result.verdict.tone,
        )
    unit = "% of the Earth rate" if result.what == "rate" else "deg"
    yield from table(
        ("Dwell", *map(duration, result.durations.tolist()), f"{goal} after"),
        [*_lines(result)],
    )
    yield Text(
        f"Standard deviation in {unit}, by dwell and length of record; the best dwell for each length is marked.",
        note=True,
        brief=True,
    )
    if result.budget:
        yield Text("Uncertainties that a longer record does not reduce:")
        yield pairs([(name, _stated(result, value)) for name, value in result.budget.items()], brief=False)
    yield pairs(
        [
            ("Time lost per turn", f"{result.dead_time:g} s"),
            ("Latitude", angle(result.latitude)),
            ("Noise", f"{document.model_name or 'given'}: {model_words(result.model)}"),
        ]
    )


def _stated(result: Plan, value: float) -> str:
    rate = result.what == "rate"
    return f"{number(100 * value if rate else value / DEG, 3)} {'%' if rate else 'deg'}"


def _lines(result: Plan) -> Iterator[tuple[str | Cell, ...]]:
    """A row for each dwell: what to expect of each length, and when the goal is reached."""
    factor = EARTH_RATE / 100 if result.what == "rate" else DEG
    known = np.where(np.isfinite(result.total), result.total, np.inf)
    best = np.where(np.isfinite(known).any(axis=0), known.argmin(axis=0), -1)
    for i, (dwell, reached) in enumerate(zip(result.dwells.tolist(), result.reached.tolist(), strict=True)):
        yield (
            duration(dwell),
            *(
                Cell(
                    text=number(v / factor, 2) if math.isfinite(v) else "–",
                    look="value best" if best[j] == i else "value",
                )
                for j, v in enumerate(known[i].tolist())
            ),
            duration(reached) if math.isfinite(reached) else "not reached",
        )


def _pictures(result: Plan) -> list[PageBlock]:
    caption = "Standard deviation against dwell, and against the length of the record."
    return drawn("plan", result, caption, sentence(result.says))


def _method(document: ResultDocument[Plan]) -> list[PageBlock]:
    return [
        Text(
            "The covariance of a regression depends on the noise, the turns and the sampling, not on the "
            "data. So it is computed from the columns alone, with the whitening filter; no samples are needed:"
        ),
        *equation("least_squares"),
        pairs(
            [("Noise model", document.model_name), ("Its terms", model_words(document.result.model))],
            brief=False,
        ),
    ]


def rows(result: Plan) -> Iterator[dict[str, object]]:
    """One row of a table for each dwell and length, over the rate of the Earth or in rad."""
    for row in result.table():
        yield {
            "dwell_s": f"{row['dwell']:g}",
            "duration_s": f"{row['duration']:g}",
            "sd": f"{row['sd'] / result.unit:.6g}",
            "total": f"{row['total'] / result.unit:.6g}",
        }
