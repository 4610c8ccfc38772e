# SPDX-License-Identifier: BSD-3-Clause
"""Sets of terms as text: their weights as bars, and how sure every term is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_end, say_facts, say_rows, say_verdict
from allanite.views.wording import (
    candidate_lines,
    chosen_line_lines,
    selection_facts,
    term_lines,
    weight_words,
)

__all__ = ["show_selection"]

Json = Mapping[str, Any]

_LONGEST = 20


def show_selection(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, candidates, terms and lines of every channel."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    for channel in document["channels"]:
        name = channel["name"]
        rows = [
            (words, f"{_bar(weight)} {weight_words(weight)}", score, parameters, p)
            for words, weight, score, parameters, p in candidate_lines(channel)
        ]
        say_rows(out, (name, "weight", "score", "parameters", "goodness"), rows)
        say_rows(out, ("Term", "in sets of weight", "95 % interval over all sets"), term_lines(channel))
        say_rows(out, ("Line", "amplitude", "gain and price", ""), chosen_line_lines(channel))
        if len(document["channels"]) > 1:
            say_advice(out, [f"{name}: {channel['verdict']}"], [name])
        say_advice(out, [f"{name}: {remark}" for remark in channel["remarks"]], [name])
        say_facts(out, *((fact, words) for fact, words in selection_facts(channel) if words))
    say_end(out, document, files)


def _bar(weight: float) -> str:
    """A bar as long as the weight, padded."""
    return ("█" * max(round(_LONGEST * weight), 0) or "▏").ljust(_LONGEST)
