# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from allanite.quantities.verdict import WordedCode
from allanite.stability.environment.verdict import CoefficientCause, HysteresisStatus, LagStatus

__all__ = ["upgraded", "upgraded_facts"]

Entry = Mapping[str, object]

_SETTLED = re.compile(r"the bias settles as after power-on, for some (\S+) s")


def upgraded(data: Entry) -> dict[str, object]:
    """The document of `environment`, version 1, as one of version 2; its channels are upgraded as they are read."""
    channels = data.get("channels")
    first = channels[0] if isinstance(channels, Sequence) and channels else None
    confidence = first.get("confidence") if isinstance(first, Mapping) else None
    return {"confidence": confidence, **data, "version": 2}


def upgraded_facts(data: Entry) -> Entry:
    """A channel of a document of `environment`, or of a study; it is of version 1 where it has a reason."""
    if "reason" not in data:
        return data
    coefficients = data.get("coefficients")
    return {
        **data,
        "coefficients": [
            {**c, "cause": _code(CoefficientCause, c.get("note"))}
            for c in (coefficients if isinstance(coefficients, Sequence) else ())
            if isinstance(c, Mapping)
        ],
        "lag": _status(data.get("lag"), LagStatus),
        "hysteresis": _status(data.get("hysteresis"), HysteresisStatus),
        "warm_up": _warm_up(data.get("warm_up")),
    }


def _code(codes: Iterable[WordedCode], words: object) -> str | None:
    return next((code.value for code in codes if code.words == words), None)


def _status(data: object, codes: Iterable[WordedCode]) -> object:
    if not isinstance(data, Mapping):
        return data
    return {**data, "status": _code(codes, data.get("says")) or data.get("status")}


def _warm_up(data: object) -> object:
    if not isinstance(data, Mapping):
        return data
    match = _SETTLED.match(str(data.get("says")))
    return {"settled": None if match is None else float(match[1]), **data}
