# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes and facts: what they say in the present version."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from allanite.quantities.earlier_documents import entries, first_match, quantity_entry, texts

__all__ = ["upgraded"]

_KINDS = {
    "agreement with the table": "agreement",
    "size of the noise": "size",
    "constancy of the scale factor": "constancy",
}
_LEFT = re.compile(r"(\S+) % of the signal is left")
_BY_RATE = re.compile(r"at (\S+) deg/s it is (\S+) times that of the model")
_LOOP = re.compile(r"at rest by (\S+) ppm of full scale")
_CLIPPED = re.compile(r"the range ends at (.+?): (?:(\d+) steps? at|rates beyond) (.+) deg/s clip")
_OFFSETS = re.compile(r"by a clock offset of (.+?) s as well(, at some)?")
_WHOLE = re.compile(r"^(\d+) of \d+ steps? do(?:es)? not turn by whole revolutions")


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a run on a rate table, version 1, as one of version 2."""
    notes = texts(data.get("notes"))
    offsets, whole = first_match(_OFFSETS, notes), first_match(_WHOLE, notes)
    return {
        **data,
        "version": 2,
        "nonlinearity": str(data.get("nonlinearity")),
        "parameters": [_parameter(p) for p in entries(data.get("parameters"))],
        "checks": [_check(c) for c in entries(data.get("checks"))],
        "clipped": _clipping(notes, data.get("channel_scale")),
        "other_offsets": [] if offsets is None else [_number(x) for x in offsets[1].split(", ")],
        "either_sign": offsets is not None and bool(offsets[2]),
        "loop_alike": any("a hysteresis of a steady sweep would look the same" in n for n in notes),
        "settled": not any("has not settled within half of a step" in n for n in notes),
        "not_whole": 0 if whole is None else int(whole[1]),
    }


def _number(text: str) -> float | None:
    """One of a list that ends with an ellipsis, where there are more."""
    return None if text == "…" else float(text)


def _parameter(data: Mapping[str, object]) -> dict[str, object]:
    resolved = data.get("resolved") is True
    entry = {
        **data,
        **quantity_entry(data.get("value"), data.get("interval"), str(data.get("unit")), resolved=resolved),
    }
    return entry if data.get("limit") is None else {**entry, "status": "upper limit"}


def _check(data: Mapping[str, object]) -> dict[str, object]:
    name, says = str(data.get("name")), str(data.get("says"))
    kind = _KINDS.get(name, name)
    if kind == "shape of the response":
        kind = "higher powers" if "higher powers of the rate are in it" in says else "shape"
    values: dict[str, object] = {}
    if left := _LEFT.search(says):
        values = {"value": float(left[1]) / 100}
    elif by_rate := _BY_RATE.search(says):
        values = {"rate": math.radians(float(by_rate[1])), "value": float(by_rate[2])}
    elif loop := _LOOP.search(says):
        values = {"value": float(loop[1]) / 1e6}
    return {**data, "kind": kind, **values}


def _clipping(notes: list[str], scale: object) -> dict[str, object] | None:
    match = first_match(_CLIPPED, notes)
    if match is None or not isinstance(scale, float):
        return None
    return {
        "ends": [float(end.split()[0]) * scale for end in match[1].split(" and ")],
        "steps": int(match[2] or 0),
        "rates": [math.radians(float(x)) for x in re.split(", | and ", match[3])],
    }
