# SPDX-License-Identifier: BSD-3-Clause
"""An alignment as text: the verdict, the angles with their intervals, then what speaks for and against them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_checks, say_end, say_facts, say_rows, say_verdict
from allanite.views.wording import (
    alignment_budget,
    angle,
    attitude_lines,
    axes_words,
    bias_words,
    coarse_lines,
    horizontal_line,
    latitude_line,
    model_words,
    naive_words,
    sentence,
    standing_words,
)

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["show_alignment"]

Json = Mapping[str, Any]


def show_alignment(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, angles, budget, biases, checks, advice and facts of an `AlignmentEstimate`'s document."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    _angles(out, document)
    _tables(out, document)
    say_checks(out, document["checks"])
    say_advice(out, document["advice"])
    coarse = ", ".join(
        f"{name} {heading}" for name, heading, _, _ in coarse_lines(document) if heading != "–"
    )
    models = document["models"]
    same = {model_words(model) for model in models.values()}
    noise = (
        [f"{name}: {model_words(model)}" for name, model in models.items()] if len(same) > 1 else list(same)
    )
    say_facts(
        out,
        ("stood", standing_words(document)),
        *(("coarse", coarse) for _ in [0] if coarse),
        *(("plain mean", words) for words in [naive_words(document)] if words),
        ("axes", axes_words(document)),
        ("latitude", angle(document["latitude"])),
        ("noise", "; ".join(noise) or "from the record"),
    )
    if document["statement"]:
        out.print(sentence(document["statement"]))
        out.print()
    say_end(out, document, files)


def _angles(out: Console, document: Json) -> None:
    extra = [line for line in [latitude_line(document)] if line]
    lines = [*attitude_lines(document), horizontal_line(document), *extra]
    heads = ("", "Found", f"{100 * document['confidence']:g} % interval", "Expected")
    say_rows(out, heads, [(line.name, line.value, line.range, line.expected) for line in lines])


def _tables(out: Console, document: Json) -> None:
    """Where the uncertainty comes from, and the biases."""
    say_rows(out, ("Standard uncertainty of the heading", "deg"), alignment_budget(document))
    heads = ("Bias of the gyros", "deg/h", "sd", "known before to", "told")
    say_rows(out, heads, [(name, *bias_words(bias)) for name, bias in document["biases"].items()])
