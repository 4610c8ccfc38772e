# SPDX-License-Identifier: BSD-3-Clause
"""Sensors taken apart as text: what each has alone, and what they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_end, say_facts, say_rows, say_verdict
from allanite.views.wording import channel_names, part_lines, part_term_lines, separation_facts

__all__ = ["show_separation"]

Json = Mapping[str, Any]


def show_separation(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, deviations and terms of every part of a `Separation`'s document."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    for heads, rows in (part_lines(document), part_term_lines(document)):
        say_rows(out, heads, rows)
    say_advice(out, document["remarks"], channel_names(document))
    say_facts(out, *((name, words) for name, words in separation_facts(document) if words))
    say_end(out, document, files)
