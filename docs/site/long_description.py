# SPDX-License-Identifier: BSD-3-Clause
"""README.md as the description of the package, read where its relative links lead nowhere: on a package index.

Called by the build (`tool.scikit-build.metadata.readme`). Where `repository` in pyproject.toml states an address,
links lead to the files of this version there; else their text stays and the link goes, and a picture goes with it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from project_urls import repository

__all__ = ["absolute", "dynamic_metadata"]

ROOT = Path(__file__).resolve().parent.parent.parent
_LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?!\w+:|#)(?P<target>[^)\s]+)\)")
_COMMENT = re.compile(r"^<!--.*?-->\n", re.M | re.S)


def dynamic_metadata(field: str, settings: Mapping[str, object]) -> dict[str, str]:
    """The readme of the package, for scikit-build-core."""
    if field != "readme" or settings:
        raise ValueError(f"{Path(__file__).name} makes the readme and takes no settings")
    code = (ROOT / "src/allanite/__init__.py").read_text(encoding="utf-8")
    (version,) = re.findall(r'^__version__ = "(.*)"$', code, re.M)
    text = absolute((ROOT / "README.md").read_text(encoding="utf-8"), repository(), f"v{version}")
    return {"content-type": "text/markdown", "text": text}


def absolute(text: str, source: str, tag: str) -> str:
    """A page of the top folder with absolute links into a repository, or without links where there is none."""

    def link(old: re.Match[str]) -> str:
        if not source:
            return "" if old["picture"] else old["text"]
        kind = "raw" if old["picture"] else "blob"
        return f"{old['picture']}[{old['text']}]({source.rstrip('/')}/{kind}/{tag}/{old['target']})"

    return re.sub(r"\n{3,}", "\n\n", _LINK.sub(link, _COMMENT.sub("", text)))
