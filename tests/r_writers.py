# SPDX-License-Identifier: BSD-3-Clause
"""R objects byte by byte (XDR, version 2), from R Internals: the inverse of what the reader does."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

_HEADER = b"X\n" + struct.pack(">iii", 2, 0x00030602, 0x00020300)
_NIL = struct.pack(">i", 254)
_OBJECT, _ATTRIBUTES, _TAG = 0x100, 0x200, 0x400
_MISSING = -(1 << 31)


class Classed:
    """A value with attributes (class, dim, freq, ...)."""

    def __init__(self, value: Any, **attributes: Any) -> None:
        self.value, self.attributes = value, attributes


def frame(columns: Mapping[str, Any], *classes: str) -> Classed:
    """A data frame."""
    first = next(iter(columns.values()))
    rows = len(first.value if isinstance(first, Classed) else first)
    names = np.array([_MISSING, -rows], dtype=np.int32)
    return Classed(
        dict(columns), names=list(columns), **{"class": [*classes, "data.frame"], "row.names": names}
    )


def rds(value: Any) -> bytes:
    """What saveRDS(value, compress = FALSE) writes."""
    return _HEADER + _item(value, {})


def rda(objects: Mapping[str, Any]) -> bytes:
    """What save(..., compress = FALSE) writes."""
    return b"RDX2\n" + _HEADER + _pairs(objects, {})


def _pairs(entries: Mapping[str, Any], symbols: dict[str, int]) -> bytes:
    body = b""
    for name, value in entries.items():
        body += struct.pack(">i", 2 | _TAG) + _symbol(name, symbols) + _item(value, symbols)
    return body + _NIL


def _symbol(name: str, symbols: dict[str, int]) -> bytes:
    if name in symbols:
        return struct.pack(">i", symbols[name] << 8 | 255)
    symbols[name] = len(symbols) + 1
    return struct.pack(">i", 1) + _text(name)


def _text(text: str) -> bytes:
    raw = text.encode()
    return struct.pack(">ii", 0x40009, len(raw)) + raw


def _item(value: Any, symbols: dict[str, int]) -> bytes:
    attributes: Mapping[str, Any] = {}
    if isinstance(value, Classed):
        value, attributes = value.value, value.attributes
    flags = (_ATTRIBUTES if attributes else 0) | (_OBJECT if "class" in attributes else 0)
    if isinstance(value, dict):
        items = b"".join(_item(v, symbols) for v in value.values())
        body = struct.pack(">ii", 19 | flags, len(value)) + items
    elif isinstance(value, list):
        body = struct.pack(">ii", 16 | flags, len(value)) + b"".join(map(_text, value))
    else:
        array = np.atleast_1d(value)
        code, dtype = (13, ">i4") if array.dtype.kind == "i" else (14, ">f8")
        body = (
            struct.pack(">ii", code | flags, array.size)
            + array.reshape(-1, order="F").astype(dtype).tobytes()
        )
    return body + (_pairs(attributes, symbols) if attributes else b"")
