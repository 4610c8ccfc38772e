# SPDX-License-Identifier: BSD-3-Clause
"""The consumers of exported files as text."""

from __future__ import annotations

from allanite.terminal.console import console
from allanite.terminal.parts import say_facts

__all__ = ["show_consumers"]

_TAKES = {"study": "study", "calibration": "calibration", "either": "study, calibration"}


def show_consumers() -> None:
    """Name, what it takes, and what it makes of that."""
    from allanite.exporters import EXPORTERS, exporter

    found = [exporter(name) for name in EXPORTERS]
    lines = [(m.NAME.replace("_", "-"), f"{_TAKES[m.TAKES]} → {m.SUMMARY}") for m in found]
    say_facts(console(), *lines)
