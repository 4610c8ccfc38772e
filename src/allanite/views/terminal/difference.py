# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_files, say_rows
from allanite.views.wording import drift_lines, pair_lines, rest_words

__all__ = ["show_difference"]


def show_difference(document: Mapping[str, Any], files: Sequence[object] = ()) -> None:
    """Parameters and drift of each sensor, of both, and their ratio."""
    out = console()
    first, second = document["names"]
    for channel in document["channels"]:
        say_rows(out, (channel["name"], first, second, "ratio"), pair_lines(channel))
        say_rows(out, ("drift after", first, second, "ratio"), drift_lines(channel))
    out.print(f"{rest_words(document)}.")
    if document["unpaired"]:
        out.print(f"Only in one of them: {', '.join(document['unpaired'])}.")
    say_files(out, files)
