# SPDX-License-Identifier: BSD-3-Clause
"""A run on a rate table as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console, table_of
from allanite.views.terminal.parts import (
    say_advice,
    say_checks,
    say_end,
    say_facts,
    say_indented,
    say_verdict,
)
from allanite.views.wording import (
    DEG,
    NOISE_ALONE,
    duration,
    model_words,
    number,
    response_budget,
    response_lines,
    sentence,
    shape_words,
    table_words,
)

__all__ = ["show_rate_table"]

Json = Mapping[str, Any]


def show_rate_table(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, numbers of the response, budget, bandwidth, checks and advice of a `RateTableEstimate`'s document."""
    from rich.text import Text

    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    table = table_of(("Response", "", f"{100 * document['confidence']:g} % interval", "", ""))
    for line in response_lines(document):
        table.add_row(
            line.name, Text(line.value, "bold" if line.kept else ""), line.range, line.unit, line.answer
        )
    out.print(table)
    out.print()
    budget = table_of(("Standard uncertainty of the scale factor", "ppm"))
    rows = response_budget(document)
    for row in rows:
        budget.add_row(*row)
    out.print(budget if len(rows) > 1 else NOISE_ALONE)
    out.print()
    _frequencies(document)
    say_checks(out, document["checks"])
    for words in document["notes"]:
        say_indented(out, sentence(words))
    if document["notes"]:
        out.print()
    say_advice(out, document["advice"])
    say_facts(
        out,
        ("table", table_words(document)),
        ("fitted", shape_words(document)),
        ("length", f"{duration(document['duration'])}, in means over {duration(document['block'])}"),
        (
            "noise",
            f"{document.get('model_name', document['model_source'])}: {model_words(document['model'])}",
        ),
    )
    say_end(out, document, files)


def _frequencies(document: Json) -> None:
    rows = document["frequencies"]
    if not rows:
        return
    out = console()
    lowest = min(rows, key=lambda r: float(r["frequency"]))
    table = table_of(("Frequency [Hz]", "Gain", "± sd", "Phase [deg]", "± sd"))
    for r in rows:
        table.add_row(
            f"{r['frequency']:g}",
            f"{r['gain'] / lowest['gain']:.6f}",
            number(r["gain_sd"] / lowest["gain"], 2),
            f"{r['phase'] / DEG:.3f}",
            number(r["phase_sd"] / DEG, 2),
        )
    out.print(table)
    out.print(f"Gain over that at {lowest['frequency']:g} Hz.")
    out.print()
