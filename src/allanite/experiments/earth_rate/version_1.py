# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes and facts: what they say in the present version."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence

from allanite.quantities.earth import DEG_H

__all__ = ["upgraded"]

_KINDS = {
    "size of the noise": "size",
    "warm-up": "warm-up",
    "settling": "settling",
    "scatter of the dwells": "scatter",
    "constancy of the rate": "constancy",
    "order of the turns": "order",
}
_NUMBER = r"([-+]?[\d.]+(?:e[-+]?\d+)?)"
_AT = re.compile(rf"from {_NUMBER} s on the alternation is another")
_OVER = re.compile(
    rf"(?P<channel>.+) goes from {_NUMBER} to {_NUMBER} m/s² and back with the turns: .* --first (?P<first>up|down)"
)
_UP = re.compile(rf"with --first up it is {_NUMBER} deg/h")
_SETTLING = re.compile(
    rf"fitted beside, with {_NUMBER} s, it makes the rate {_NUMBER} deg/h \(standard deviation {_NUMBER}\)"
)
_UNDECIDED = re.compile(
    r"does not decide between (\S+) and (\S+); the interval is that of .* it would be (-?\d+) % narrower"
)


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of an Earth rate, version 1, as one of version 2."""
    advice = _texts(data.get("advice"))
    return {
        **data,
        "version": 2,
        "rotation": _rotation(data),
        "checks": [_check(c) for c in _objects(data.get("checks"))],
        "turned_over": _over(advice),
        "rate_if_up": _if_up(data, advice),
        "settling": _settling(advice),
        "undecided": _undecided(advice),
    }


def _items(value: object) -> Sequence[object]:
    return value if isinstance(value, Sequence) and not isinstance(value, str) else []


def _objects(value: object) -> list[Mapping[str, object]]:
    return [v for v in _items(value) if isinstance(v, Mapping)]


def _texts(value: object) -> list[str]:
    return [str(v) for v in _items(value)]


def _rotation(data: Mapping[str, object]) -> dict[str, object]:
    ends = _items(data.get("interval"))
    lower, upper = ends if len(ends) == 2 else (None, None)
    unseen = data.get("verdict") in ("not resolved", "not separable")
    return {
        "value": data.get("rate"),
        "lower": lower,
        "upper": upper,
        "unit": "rad/s",
        "status": "not resolved" if unseen else "resolved",
    }


def _check(data: Mapping[str, object]) -> dict[str, object]:
    name = str(data.get("name"))
    at = _AT.search(str(data.get("says")))
    kind = _KINDS.get(name, "temperature")
    return {
        **data,
        "kind": kind,
        "channel": name if kind == "temperature" else "",
        "at": None if at is None else float(at[1]),
    }


def _first(pattern: re.Pattern[str], advice: Iterable[str]) -> re.Match[str] | None:
    return next((match for words in advice if (match := pattern.search(words))), None)


def _over(advice: Iterable[str]) -> dict[str, object] | None:
    match = _first(_OVER, advice)
    if match is None:
        return None
    means = [float(match[2]), float(match[3])]
    return {"channel": match["channel"], "along": True, "first": match["first"], "means": means}


def _if_up(data: Mapping[str, object], advice: Iterable[str]) -> float | None:
    """Its sign from the sentence, its size from the rate."""
    match, rate, latitude = _first(_UP, advice), data.get("rate"), data.get("latitude")
    if match is None or not isinstance(rate, float) or not isinstance(latitude, float):
        return None
    return math.copysign(rate / math.tan(latitude), float(match[1]))


def _settling(advice: Iterable[str]) -> dict[str, object] | None:
    match = _first(_SETTLING, advice)
    if match is None:
        return None
    return {"T": float(match[1]), "rate": float(match[2]) * DEG_H, "sd": float(match[3]) * DEG_H}


def _undecided(advice: Iterable[str]) -> dict[str, object] | None:
    match = _first(_UNDECIDED, advice)
    if match is None:
        return None
    return {"family": match[1], "other": match[2], "narrower": float(match[3]) / 100}
