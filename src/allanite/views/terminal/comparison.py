# SPDX-License-Identifier: BSD-3-Clause
"""Compared records as text: verdict, tests, and the parameters of each channel record by record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_advice, say_facts, say_files, say_rows, say_verdict
from allanite.views.wording import (
    channel_names,
    channel_table,
    comparison_facts,
    outlier_lines,
    record_lines,
    sameness_lines,
)

__all__ = ["show_comparison"]

Json = Mapping[str, Any]


def show_comparison(document: Json, files: Sequence[object] = ()) -> None:
    """Everything of a `Comparison`'s document but its curves."""
    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    say_rows(out, ("Record", "log", "rate", "length", "samples"), record_lines(document))
    for channel in document["channels"]:
        heads, rows = channel_table(document, channel)
        say_rows(out, heads, rows)
    say_rows(out, ("Same?", "Allan curves", "parameters", "lags that differ alone"), sameness_lines(document))
    say_rows(out, ("Stands out", "in", "record", "", "the others"), outlier_lines(document))
    say_advice(out, document["remarks"], channel_names(document))
    say_facts(out, *comparison_facts(document))
    say_files(out, files)
