# SPDX-License-Identifier: BSD-3-Clause
"""Data sheets beside measurements, and bounds above noise models, as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_end, say_facts, say_files, say_rows, say_verdict
from allanite.views.wording import bound_lines, bound_words, inflation_words, model_words, statement_lines

__all__ = ["show_bounds", "show_datasheet"]

Json = Mapping[str, Any]


def show_datasheet(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, and each statement beside what was measured; the model of each section where nothing was."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    for channel in document["channels"]:
        lines = statement_lines(channel)
        heads = (channel["name"], "data sheet", "measured, 95 % interval", "ratio", "")
        say_rows(out, heads, ((s.name, s.stated, s.measured, s.ratio, s.verdict) for s in lines))
        say_advice(out, [f"{s.name}: {s.note}" for s in lines if s.note])
    if not document["channels"]:
        sections = document["sections"].items()
        say_facts(out, *((name, model_words(section["model"])) for name, section in sections))
        for _, section in sections:
            out.print(section["model"]["verdict"])
    say_end(out, document, files)


def show_bounds(document: Json, files: Sequence[object] = ()) -> None:
    """Terms of each bound beside the fitted ones, what it promises, and how much it is inflated."""
    out = console()
    for channel in document["channels"]:
        facts = channel["bound"]["overbound"]
        say_rows(out, (channel["name"], "fitted", "bound", "inflation"), bound_lines(channel))
        out.print(f"{bound_words(facts)}; {inflation_words(facts)}")
        out.print()
    say_files(out, files)
