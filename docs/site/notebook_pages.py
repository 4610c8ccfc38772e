# SPDX-License-Identifier: BSD-3-Clause
"""A notebook as a page of the site: its text, and its cells as Python blocks."""

from __future__ import annotations

import json

__all__ = ["markdown_of"]


def markdown_of(notebook: str) -> str:
    """The Markdown of a notebook (nbformat 4); outputs are left out."""
    parts = []
    for cell in json.loads(notebook)["cells"]:
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
    return "\n\n".join(parts) + "\n"
