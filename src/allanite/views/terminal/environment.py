# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.stability.environment import EnvironmentFacts
from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_end, say_facts, say_rows, say_verdict
from allanite.views.wording import coefficient_lines, effect_lines, environment_facts

__all__ = ["show_environment"]

Json = Mapping[str, Any]


def show_environment(document: Json, files: Sequence[object] = ()) -> None:
    """Coefficients, facts and what was removed, channel by channel."""
    out = console()
    percent = f"{100 * document['confidence']:g} % interval"
    for estimate in map(EnvironmentFacts.from_json, document["channels"]):
        say_verdict(out, estimate.verdict, f"{estimate.channel}: {estimate.reason}")
        say_rows(out, ("Bias by", percent, "", ""), coefficient_lines(estimate))
        say_rows(
            out,
            ("Averaging", "before", "removed", "share of the curve", "noise left"),
            effect_lines(estimate),
        )
        say_advice(out, estimate.advice)
        say_facts(out, *environment_facts(estimate))
    say_end(out, document, files)
