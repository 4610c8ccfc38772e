# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for values: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

__all__ = ["upgraded"]

_LINE = re.compile(
    r"the line at (?P<frequency>\S+) Hz (?:is no sinusoid and stays in the record: (?P<note>.*)|has too few)"
)
_FEW = "it has too few periods to be told from slow noise"


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """The document of a selection, version 1, as one of version 2; what is damaged stays so."""
    channels = data.get("channels")
    entries = channels if isinstance(channels, Sequence) and not isinstance(channels, str) else ()
    return {
        **data,
        "version": 2,
        "channels": [
            {"slow": {}, **c, "left_in": [*_left_in(c.get("remarks"))]} if isinstance(c, Mapping) else c
            for c in entries
        ],
    }


def _left_in(remarks: object) -> Iterator[dict[str, object]]:
    for words in remarks if isinstance(remarks, Sequence) else ():
        if match := _LINE.match(str(words)):
            yield {"frequency": float(match["frequency"]), "note": match["note"] or _FEW}
