# SPDX-License-Identifier: BSD-3-Clause
"""A self-calibration as text: the verdict, every parameter with its interval, and what the positions leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.views.terminal.console import console, table_of
from allanite.views.terminal.parts import (
    say_advice,
    say_checks,
    say_end,
    say_facts,
    say_indented,
    say_rows,
    say_verdict,
)
from allanite.views.wording import (
    calibration_facts,
    parameter_groups,
    position_lines,
    rest_unit,
    scatter_lines,
    sensor_words,
    sentence,
    still_open,
)

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["show_calibration"]

Json = Mapping[str, Any]


def show_calibration(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, parameters, what is open, positions that stand out, scatter, checks and facts."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    say_advice(out, document["advice"])
    _parameters(out, document)
    _open(out, document)
    _odd(out, document)
    _scatter(out, document)
    say_checks(out, document["checks"])
    say_facts(out, *calibration_facts(document))
    for words in document["remarks"]:
        out.print(sentence(words))
    if document["remarks"]:
        out.print()
    say_end(out, document, files)


def _parameters(out: Console, document: Json) -> None:
    from rich.text import Text

    percent = f"{100 * document['confidence']:g} % interval"
    groups = parameter_groups(document)
    for sensor in dict.fromkeys(group.sensor for group in groups):
        table = table_of((sensor_words(sensor), "Unit", "Estimate", percent, ""))
        for group in (g for g in groups if g.sensor == sensor):
            for line in group.lines:
                look = "bold" if line.estimated else "dim"
                name = f"{group.name.lower()} {line.name}"
                table.add_row(
                    name, group.unit, Text(line.value, look), line.range, Text(line.status, "yellow")
                )
        out.print(table)
        out.print()


def _open(out: Console, document: Json) -> None:
    """What the positions leave open, and which to add."""
    rows = still_open(document)
    for names, advice in rows:
        say_indented(out, f"Not observable: {names}.", "bold")
        if advice:
            say_indented(out, f"→ {sentence(advice)}")
    if rows:
        out.print()


def _odd(out: Console, document: Json) -> None:
    """Positions that contradict the others, or were left out."""
    unit, _ = rest_unit(document)
    say_rows(
        out,
        ("Position", "up", "time", f"|f| − g [{unit}]", "rate [deg/h]", "misfit", ""),
        [row for row in position_lines(document) if row[-1]],
    )


def _scatter(out: Console, document: Json) -> None:
    say_rows(out, ("Scatter", "over noise", "added to the noise"), scatter_lines(document))
