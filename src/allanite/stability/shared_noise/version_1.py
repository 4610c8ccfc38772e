# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

__all__ = ["upgraded"]

_CODES = {
    "noise is shared": "shared",
    "no shared noise is seen": "not shared",
    "the sensors share noise of opposite sign": "opposite sign",
}
_DELAY = re.compile(
    r"(?P<late>.+) feels the common part about (?P<delay>\S+) s later than (?P<early>.+): at lags of"
)


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """The document of a separation, version 1, as one of version 2; what is damaged stays so."""
    remarks = data.get("remarks")
    matches = map(_DELAY.match, map(str, remarks if isinstance(remarks, Sequence) else ()))
    return {
        **data,
        "version": 2,
        "verdict": _CODES.get(str(data.get("verdict")), data.get("verdict")),
        "delays": [
            {"late": m["late"], "early": m["early"], "delay": float(m["delay"])}
            for m in matches
            if m is not None
        ],
    }
