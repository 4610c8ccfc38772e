# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes, and bare ends of intervals: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

__all__ = ["upgraded"]

_CODES = {
    "the noise changes": "changes",
    "the noise fluctuates": "fluctuates",
    "constant within its intervals": "constant",
}
_SILENT = re.compile(
    r"(\d+) windows? holds? one and the same value throughout, the first from (\S+ \w+) to (\S+ \w+):"
)
_SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a variation, version 1, as one of version 2."""
    return {**data, "version": 2, "channels": [_channel(c) for c in _objects(data.get("channels"))]}


def _objects(value: object) -> list[Mapping[str, object]]:
    return [v for v in value if isinstance(v, Mapping)] if isinstance(value, Sequence) else []


def _channel(data: Mapping[str, object]) -> dict[str, object]:
    remarks = data.get("remarks")
    rough = isinstance(remarks, Sequence) and any("rests on a rough one" in str(r) for r in remarks)
    return {
        **data,
        "verdict": _CODES.get(str(data.get("verdict")), data.get("verdict")),
        "changes": [_change(c) for c in _objects(data.get("changes"))],
        "silent": _silent(str(data.get("reason"))),
        "model_source": "rough" if rough else "fitted",
    }


def _change(data: Mapping[str, object]) -> dict[str, object]:
    time = _quantity(data.get("time"), data.get("time_lower"), data.get("time_upper"), "s")
    return {
        **data,
        "time": None if data.get("time") is None else time,
        "ratio": _quantity(data.get("ratio"), data.get("lower"), data.get("upper"), "1"),
    }


def _quantity(value: object, lower: object, upper: object, unit: str) -> dict[str, object]:
    known = upper is not None
    return {
        "value": value,
        "lower": lower if known else None,
        "upper": upper,
        "unit": unit,
        "status": "resolved" if known else "not resolved",
    }


def _silent(reason: str) -> list[list[float | None]]:
    """Of these windows the sentence kept their number and the first."""
    match = _SILENT.match(reason)
    if match is None:
        return []
    first: list[float | None] = [float(n) * _SECONDS[u] for n, u in (match[2].split(), match[3].split())]
    others: list[list[float | None]] = [[None, None] for _ in range(int(match[1]) - 1)]
    return [first, *others]
