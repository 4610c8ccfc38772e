# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes and facts: what they say in the present version."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Mapping, Sequence

from allanite.experiments.calibration.verdict import ParameterNeed
from allanite.experiments.reversals.apart import apart_of_sentences
from allanite.quantities.earlier_documents import entries, first_match, texts

__all__ = ["upgraded"]

_ASTRAY = re.compile(r"^the turns by the gyros miss those of gravity by (\S+) deg")
_ORDER = re.compile(r"they go together(?: with --gyro (.+?))?(?: when the sign of (.+?) is turned|$)")
_ALONE = re.compile(r"most of all their (.+?): a rest that was none")
_FOLLOWS = re.compile(r"^the biases of the gyros follow gravity, by up to (\S+) deg/s")
_IN_HAND = re.compile(r"^the unit was held in the hand")
_SD = re.compile(
    r"^columns (.+) are taken for standard deviations of the (?:means|readings, .+ \((.+)\), as of)"
)
#: Words by which version 1 knew a need.
_NEEDS = {
    "gyros alone see nothing": ParameterNeed.FORCE,
    "no turn between the positions was recorded": ParameterNeed.TURNS,
    "record more positions": ParameterNeed.POSITIONS,
}
#: Remarks that the present version makes itself; what else stands there was found of the rests.
_MADE = re.compile(
    r"^(columns .+ are taken for|gravity was taken as|without a latitude|no turn tells how|the biases of the gyros "
    r"follow|(turn .+|all turns|position .+): not used|nothing but the scatter|the unit was held in the hand|the (rows|"
    r"files) do not say|the time between the files|the noise is that of the model)"
)


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a self-calibration, version 1, as one of version 2."""
    reason, remarks = str(data.get("reason")), texts(data.get("remarks"))
    follows = first_match(_FOLLOWS, remarks)
    rests = data.get("static_spans")
    present = rests if isinstance(rests, Mapping) else _rests(data, remarks)
    return {
        **data,
        "version": 2,
        "parameters": [_parameter(p) for p in entries(data.get("parameters"))],
        "checks": [_check(c, data.get("earth")) for c in entries(data.get("checks"))],
        "astray": _astray(reason),
        "follows_gravity": None if follows is None else math.radians(float(follows[1])),
        "in_hand": first_match(_IN_HAND, remarks) is not None,
        "sd_columns": _sd_columns(remarks),
        "apart": apart_of_sentences(remarks),
        "static_spans": present,
        **({} if present is None or "overviews" not in present else {"overviews": present["overviews"]}),
    }


def _parameter(data: Mapping[str, object]) -> dict[str, object]:
    advice = texts(data.get("advice"))
    need = next((need for words, need in _NEEDS.items() for text in advice if text.startswith(words)), None)
    return {**data, "add": [] if need else advice, "need": need}


def _check(data: Mapping[str, object], earth: object) -> dict[str, object]:
    most = _ALONE.search(str(data.get("says")))
    entry = {**data, "kind": data.get("name"), "parameter": most[1].replace(" ", "_") if most else ""}
    if data.get("name") == "rate of the Earth" and isinstance(earth, Mapping):
        return {**entry, "value": earth.get("length"), "expected": earth.get("expected")}
    return entry


def _astray(reason: str) -> dict[str, object] | None:
    miss, order = _ASTRAY.search(reason), _ORDER.search(reason)
    if miss is None:
        return None
    return {
        "miss": math.radians(float(miss[1])),
        "order": None
        if order is None
        else "".join(shlex.split(order[1] or "")).split(",")
        if order[1]
        else [],
        "turned": order[2].split(", ") if order and order[2] else [],
    }


def _sd_columns(remarks: Sequence[str]) -> dict[str, object] | None:
    columns = first_match(_SD, remarks)
    return None if columns is None else {"names": columns[1].split(", "), "count": columns[2] or ""}


def _rests(data: Mapping[str, object], remarks: Sequence[str]) -> dict[str, object] | None:
    """The rests of a document that says what was found of them, and holds them as positions alone."""
    found_of_them = [words for words in remarks if not _MADE.search(words)]
    rate, duration = data.get("rate"), data.get("duration")
    if not (found_of_them and isinstance(rate, float) and isinstance(duration, float)):
        return None
    positions = entries(data.get("positions"))
    spans = [
        {"start": _sample(p.get("start"), rate), "stop": _sample(p.get("stop"), rate), "label": ""}
        for p in positions
    ]
    return {
        "format": "allanite-static-spans",
        "version": 1,
        "spans": spans,
        "rate": rate,
        "n_samples": round(duration * rate),
        "moving": [],
        "gyro": [],
        "accelerometer": [],
        "source": "detected" if data.get("spans_source") == "found" else "given",
        "noise": "",
        "alarm": 0.0,
        "shortest": 0.0,
        "floor": {},
        "held": first_match(_IN_HAND, remarks) is not None,
        "level": None,
        "findings": found_of_them,
    }


def _sample(time: object, rate: float) -> int:
    return round(time * rate) if isinstance(time, (int, float)) else 0
