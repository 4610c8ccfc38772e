# SPDX-License-Identifier: BSD-3-Clause
"""A report that is made again from its document, elsewhere: the same but for links to files that are not beside it."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["without_links"]


def without_links(report: Path) -> str:
    """The report without its list of files, and with their names in place of links to them."""
    page = report.read_text(encoding="utf-8")
    page = re.sub(r'\s*<div class="files">.*?</div>', "", page)
    return re.sub(r'<a href="[^"#:/]+">([^<]*)</a>', r"\1", page)
