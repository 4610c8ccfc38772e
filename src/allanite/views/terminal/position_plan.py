# SPDX-License-Identifier: BSD-3-Clause
"""A plan of positions as text: the positions in order, what they will tell, and other schemes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_facts, say_files, say_rows
from allanite.views.wording import plan_facts, planned_lines, position_rows, scheme_lines, sentence

__all__ = ["show_position_plan"]

Json = Mapping[str, Any]


def show_position_plan(document: Json, files: Sequence[object] = ()) -> None:
    """The plan in a sentence, its positions, standard deviations, schemes and facts."""
    out = console()
    out.print(sentence(document["says"]))
    out.print()
    say_advice(out, document["notes"])
    for heads, rows in (
        (("", "Position", "rest"), position_rows(document)),
        (("Parameter", "unit", "sd", "goal"), planned_lines(document)),
        (
            ("Scheme", "reaches the goals after", "sd/goal in this time", "not determined"),
            scheme_lines(document),
        ),
    ):
        say_rows(out, heads, rows)
    say_facts(out, *plan_facts(document))
    say_files(out, files)
