# SPDX-License-Identifier: BSD-3-Clause
"""Combined sensors as text: what contradicts what, the gain, and the weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_end, say_facts, say_rows, say_verdict
from allanite.views.wording import combination_facts, fault_lines, gain_lines, shared_lines, weight_lines

__all__ = ["show_combination"]

Json = Mapping[str, Any]


def show_combination(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, faults, gain, shared noise and weights of a `Combination`'s document."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    percent = f"{100 * document['confidence']:g} % interval"
    heads, weights = weight_lines(document)
    for title, rows in (
        (("Fault", "sensor", "from", "to", "size"), fault_lines(document)),
        (
            ("Averaging", "axis", "Allan deviation", f"gain, {percent}", "predicted", "lost"),
            gain_lines(document),
        ),
        (("Shared noise", "correlation", "of means over"), shared_lines(document)),
        (heads, weights),
    ):
        say_rows(out, tuple(title), rows)
    say_advice(out, document["remarks"])
    say_facts(out, *combination_facts(document))
    say_end(out, document, files)
