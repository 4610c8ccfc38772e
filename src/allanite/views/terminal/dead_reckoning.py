# SPDX-License-Identifier: BSD-3-Clause
"""A budget of dead reckoning as text: errors over time, and the horizontal position by source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_facts, say_files, say_rows
from allanite.views.wording import budget_facts, growth_rows, sentence, source_rows

__all__ = ["show_dead_reckoning"]

Json = Mapping[str, Any]


def show_dead_reckoning(document: Json, files: Sequence[object] = ()) -> None:
    """The end in a sentence, errors over time, the position by source, notes and facts."""
    out = console()
    out.print(sentence(document["says"]))
    out.print()
    for heads, rows in (growth_rows(document), source_rows(document, "position_horizontal")):
        say_rows(out, heads, rows)
    say_advice(out, document["notes"])
    say_facts(out, *budget_facts(document))
    say_files(out, files)
