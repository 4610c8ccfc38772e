# SPDX-License-Identifier: BSD-3-Clause
"""The consumers of exported files as text."""

from __future__ import annotations

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_facts

__all__ = ["consumer_rows", "show_consumers"]

_TAKES = {"study": "study", "calibration": "calibration", "either": "study, calibration"}


def show_consumers() -> None:
    """Name, what it takes, and what it makes of that."""
    say_facts(console(), *((name, f"{takes} → {summary}") for name, takes, summary in consumer_rows()))


def consumer_rows() -> list[tuple[str, str, str]]:
    """Of every consumer its name, what it takes, and what it gets."""
    from allanite.exporters import EXPORTERS, exporter

    modules = [exporter(name) for name in EXPORTERS]
    return [(m.NAME.replace("_", "-"), _TAKES[m.TAKES], m.SUMMARY) for m in modules]
