# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes and facts: what they say in the present version."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

from allanite.experiments.reversals.apart import apart_of_sentences
from allanite.quantities.earlier_documents import entries, first_match, quantity_entry, texts
from allanite.quantities.earth import DEG_H
from allanite.quantities.units import STANDARD_GRAVITY

__all__ = ["upgraded"]

_KINDS = {
    "size of the noise": "size",
    "scatter of the two directions across the axis": "scatter across the axis",
    "constancy of the Earth's rotation": "constancy",
}
_OFF_GRAVITY = re.compile(r"off gravity by (\S+) mg")
_TILTED = re.compile(r"after the turns gravity is (\S+) deg from")
_APPARENT = re.compile(r"what they show, (\S+) deg/h")
_BIAS = re.compile(r"(?:are off by|agree with the Earth to) (\S+) deg/h")
_LOST = re.compile(r"^(?:one|(\d+)) stretch(?:es)? at rest at the beginning")
_CHANNELS = re.compile(
    r"the calibration is of (.+), not of the channels that were taken: it stands for (.+), in this"
)
_AWAY = re.compile(r"deg is (\S+) deg from what the stretches at rest say")
#: What the reason of a verdict without a heading holds -> its code.
_CAUSES = (
    ("nothing is known of the biases of the gyros", "biases not told from the Earth"),
    ("do not tell the biases of the gyros from", "biases not told from the Earth"),
    ("are not what was said of them", "Earth is hidden"),
    ("is larger than the Earth's rotation", "Earth is hidden"),
    ("; that leaves ", "widened by a check"),
    ("where the Earth would be", "Earth not seen"),
)
_SOURCES = {
    "noise of the gyros": "gyro noise",
    "biases of the gyros": "gyro bias",
    "azimuth of the turns": "turns",
}
_SOURCE = re.compile(r"^the ([^;:]+?) leaves? \S+ deg/h")


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of an alignment, version 1, as one of version 2."""
    reason, advice = str(data.get("reason")), texts(data.get("advice"))
    lost, source = first_match(_LOST, advice), _SOURCE.search(reason)
    rate, latitude = data.get("horizontal_rate"), data.get("latitude_found")
    cause = next((code for words, code in _CAUSES if words in reason), "uncertainty too large")
    return {
        **data,
        "version": 2,
        "no_north": cause if data.get("verdict") == "no north" else None,
        "horizontal_length": quantity_entry(
            rate, data.get("horizontal_interval"), "rad/s", resolved=rate is not None
        ),
        "measured_latitude": quantity_entry(
            latitude, data.get("latitude_interval"), "rad", resolved=latitude is not None
        ),
        "apparent_rate": _in_si(_APPARENT, reason),
        "apparent_bias": _in_si(_BIAS, reason),
        "largest_source": "gyro noise" if source is None else _SOURCES.get(source[1], source[1]),
        "checks": [_check(c) for c in entries(data.get("checks"))],
        "lost": 0 if lost is None else int(lost[1] or 1),
        "other_channels": [*_other_channels(advice)],
        "apart": apart_of_sentences(advice),
        "naive": _naive(data.get("naive")),
    }


def _in_si(pattern: re.Pattern[str], words: str) -> float | None:
    match = pattern.search(words)
    return None if match is None else float(match[1]) * DEG_H


def _check(data: Mapping[str, object]) -> dict[str, object]:
    name, says = str(data.get("name")), str(data.get("says"))
    entry = {**data, "kind": _KINDS.get(name, name)}
    if off := _OFF_GRAVITY.search(says):
        return {**entry, "value": float(off[1]) * STANDARD_GRAVITY / 1e3}
    if tilted := _TILTED.search(says):
        return {**entry, "value": math.radians(float(tilted[1]))}
    return entry


def _other_channels(advice: Iterable[str]) -> Iterable[dict[str, object]]:
    for match in filter(None, map(_CHANNELS.search, advice)):
        yield {"calibrated": match[1].split(", "), "taken": match[2].split(", ")}


def _naive(data: object) -> dict[str, object] | None:
    if not isinstance(data, Mapping):
        return None
    away = _AWAY.search(str(data.get("says")))
    return {**data, "away": None if away is None else math.radians(float(away[1]))}
