# SPDX-License-Identifier: BSD-3-Clause
"""A run that has ended, as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.terminal.console import console
from allanite.terminal.parts import TONES, say_facts

__all__ = ["show_captured"]


def show_captured(document: Mapping[str, Any]) -> None:
    """What was recorded, what is missing, and where it is."""
    from rich.text import Text

    out = console()
    whole = not document["missing"]
    ended = "" if document["status"] == "success" else f" Stopped by {document['reason']}."
    verdict = "Nothing is missing." if whole else f"{document['missing']} samples are missing."
    out.print(Text(verdict, TONES["good" if whole else "warning"]) + Text(ended))
    named = (document["instrument"][part] for part in ("maker", "model", "serial"))
    say_facts(
        out,
        ("instrument", " ".join(part for part in named if part)),
        ("recorded", f"{document['samples']} samples"),
        ("gaps", _gaps(document)),
        ("run", document["folder"]),
    )


def _gaps(document: Mapping[str, Any]) -> str:
    if not document["gaps"]:
        return "none"
    slow = f", {document['dropped']} samples because the host was too slow" if document["dropped"] else ""
    return f"{document['gaps']}{slow}"
