# SPDX-License-Identifier: BSD-3-Clause
"""The head of a JSON file, which has no comments: a list of its lines under a key that no program asks for."""

from __future__ import annotations

import json
from collections.abc import Sequence

__all__ = ["json_comments"]


def json_comments(lines: Sequence[str], indent: int) -> list[str]:
    """Lines of the file, without the comma that may follow; empty lines are left out."""
    blank = " " * indent
    entries = [f"{blank} {json.dumps(line.strip())}" for line in lines if line.strip()]
    return [f'{blank}"Comments": [', ",\n".join(entries), f"{blank}]"]
