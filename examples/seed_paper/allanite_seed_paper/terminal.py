# SPDX-License-Identifier: BSD-3-Clause
"""The demonstration in a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.text import Text

from allanite.quantities.number_words import number
from allanite.views.terminal.console import console, table_of
from allanite.views.terminal.parts import TONES
from allanite.views.wording.rates import DEG_H, capitalised, estimate_of
from allanite_seed_paper.words import TONE_OF, take_name, week_lines

__all__ = ["show_demonstration"]

Json = Mapping[str, Any]


def show_demonstration(document: Json, files: Sequence[object] = ()) -> None:
    """The week beside the truth; of the whole experiment the takes as well."""
    out = console()
    _week(out, document["week"])
    if "takes" in document:
        _takes(out, [*document["takes"], *document["faulty"]])
    for file in files:
        out.print(f"wrote {file}", soft_wrap=True)


def _week(out: Console, week: Json) -> None:
    table = table_of(("", "Unit", "Estimate", "95 % interval", "Published, true here", "By slope"))
    for line in week_lines(week):
        answer = Text(line.published.removesuffix(f" {line.unit}"))
        answer.append("" if line.inside else "  outside", "bold red")
        table.add_row(line.symbol, line.unit, Text(line.value, "bold"), line.range, answer, line.slope)
    out.print(table)
    out.print()
    low = week["minimum_of_model"]
    out.print(
        f"T_b is not read off the minimum of the curve: white noise and random walk shift that minimum, here to "
        f"{low:.0f} s, so minimum/1.89 would say {low / 1.89:.0f} s. The fit uses the whole curve with its covariance."
    )
    out.print()


def _takes(out: Console, rows: Sequence[Json]) -> None:
    table = table_of(("Earth rate [deg/h]", "published", "pairs", "regression", "95 % interval", "verdict"))
    for row in rows:
        line = estimate_of(row["rate"], *row["interval"])
        pair = next((r["rate"] for r in row["readings"] if r["name"] == "pairs"), None)
        table.add_row(
            capitalised(take_name(row)),
            number(row["published"] / DEG_H, 3),
            number(None if pair is None else pair / DEG_H, 3),
            Text(line.value, "bold"),
            line.range,
            Text(row["verdict"], TONES[TONE_OF[row["verdict"]]]),
        )
    out.print(table)
    out.print("Known: 15.041 deg/h. The published takes were other records; these are simulated.")
    out.print()
