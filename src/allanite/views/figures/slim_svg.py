# SPDX-License-Identifier: BSD-3-Clause
"""Matplotlib's SVG at half its size and with the same look: a report carries a dozen of them.

Left out are the metadata, the numbered names that nothing refers to, and groups that group nothing; coordinates keep
two decimals of a point; the font is named once.
"""

from __future__ import annotations

import re
from xml.etree import ElementTree  # what it parses is our own

__all__ = ["slim"]

_SVG = "http://www.w3.org/2000/svg"
_LINK = "http://www.w3.org/1999/xlink"
_COUNTER = re.compile(r"[A-Za-z0-9.]+_\d+$")  # "xtick_3"; names that are referred to are hashes
_DIGITS = re.compile(r"(?<=\.\d\d)\d+")
_FONT = re.compile(r" ?font-family: ([^;]*);| ?font: ([\d.]+px) ([^;]*);?")
_COORDINATES = ("d", "x", "y", "x1", "y1", "x2", "y2", "points", "transform", "width", "height")


def slim(text: str) -> str:
    """A shorter SVG that looks the same."""
    ElementTree.register_namespace("", _SVG)
    ElementTree.register_namespace("xlink", _LINK)
    root = ElementTree.fromstring(text)  # noqa: S314 - Matplotlib wrote it a moment ago
    for metadata in root.findall(f"{{{_SVG}}}metadata"):
        root.remove(metadata)
    family = _FONT.search(text)
    if family is not None:
        root.set("font-family", (family[1] or family[3]).replace("&quot;", "'"))
    _simplify(root)
    return ElementTree.tostring(root, encoding="unicode")


def _simplify(element: ElementTree.Element) -> None:
    if _COUNTER.match(element.get("id", "")):
        del element.attrib["id"]
    for name in _COORDINATES:
        value = element.get(name)
        if value is not None:
            element.set(name, " ".join(_DIGITS.sub("", value).split()))
    style = element.get("style")
    if style is not None:
        element.set("style", _FONT.sub(lambda m: f" font-size: {m[2]};" if m[2] else "", style).strip(" ;"))
    children: list[ElementTree.Element] = []
    for child in element:
        _simplify(child)
        bare = child.tag == f"{{{_SVG}}}g" and not child.attrib
        children += list(child) if bare else [child]
    element[:] = children
    if not (element.text or "").strip():
        element.text = None
    for child in children:
        child.tail = None
