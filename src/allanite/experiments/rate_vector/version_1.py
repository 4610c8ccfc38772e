# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes, and bare ends of intervals: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Mapping

from allanite.experiments.rate_vector.verdict import LeftOut
from allanite.experiments.rate_vector.words import LEFT_OUT
from allanite.quantities.earlier_documents import entries, quantity_entry

__all__ = ["upgraded"]

_SIZE = "size of the noise, "
_RESTLESS = re.compile(r"even where the sensor moves least, it moves (\S+) times as much")
#: As version 1 worded them.
_WORDS = {
    **LEFT_OUT,
    LeftOut.BESIDE: "beside a disturbance",
    LeftOut.OFF: "its mean is off that of the other quiet parts: a slow rotation, or a drift of the bias",
}
_WHY = {words: str(code) for code, words in _WORDS.items()}


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a rate vector, version 1, as one of version 2."""
    restless = _RESTLESS.search(str(data.get("reason")))
    length, resolved = data.get("length"), data.get("verdict") != "not resolved"
    return {
        **data,
        "version": 2,
        "magnitude": quantity_entry(length, data.get("interval"), "rad/s", resolved=resolved),
        "checks": [_check(check, data) for check in entries(data.get("checks"))],
        "restlessness": None if restless is None else float(restless[1]),
        "used": [_span(span) for span in entries(data.get("used"))],
        "left_out": [_span(span) for span in entries(data.get("left_out"))],
    }


def _check(check: Mapping[str, object], data: Mapping[str, object]) -> dict[str, object]:
    name = str(check.get("name"))
    if name.startswith(_SIZE):
        return {**check, "kind": "size", "channel": name.removeprefix(_SIZE)}
    if name != "latitude":
        return {**check, "kind": name}
    return {**check, "kind": name, "latitude": data.get("latitude_found"), "expected": data.get("latitude")}


def _span(span: Mapping[str, object]) -> dict[str, object]:
    why = span.get("why")
    return {**span, "why": _WHY.get(str(why), why) or None}
