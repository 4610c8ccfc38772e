# SPDX-License-Identifier: BSD-3-Clause
"""Deviation over time as text: what changed, when, and how constant the lags are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_end, say_facts, say_rows, say_verdict
from allanite.views.wording import change_lines, channel_names, constancy_lines, variation_facts

__all__ = ["show_variation"]

Json = Mapping[str, Any]


def show_variation(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, changes and the constancy of the lags of a `Variation`'s document."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    say_rows(out, ("Channel", "what", "when", "after over before", "chance"), change_lines(document))
    heads = (
        "Channel",
        "averaging",
        "windows",
        "least to largest",
        "whole record",
        "beyond chance",
        "constant",
    )
    say_rows(out, heads, constancy_lines(document))
    remarks = [f"{c['name']}: {remark}" for c in document["channels"] for remark in c["remarks"]]
    say_advice(out, remarks, channel_names(document))
    say_facts(out, *((name, words) for name, words in variation_facts(document) if words))
    say_end(out, document, files)
