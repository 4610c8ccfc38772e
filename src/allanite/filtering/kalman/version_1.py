# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held a verdict and notes in words, and all long series in one overview."""

from __future__ import annotations

import re
from collections.abc import Mapping

from allanite.quantities.earlier_documents import first_match, texts

__all__ = ["upgraded"]

_SERIES = ("measured", "corrected", "drift", "drift_sd")
_LAG = re.compile(r"not white: correlation \S+ at lag (\d+) \(.*?\); (.*)")
_CAUSES = {
    "the sensor drifts": "drift",
    "samples share": "shared noise",
    "samples compensate": "compensation",
}
_FLICKER = re.compile(r"flicker is filtered as (?:a sum of (\d+) states|one Gauss-Markov)")
_FAMILIES = re.compile(
    r"could not decide between (\S+) and (\S+); this is the filter of \S+?(, which drifts more|$)"
)
_BROKE = re.compile(r"(\d+) rows broke the covariance")
_LEFT_OUT = re.compile(r"(\d+) rows were left out")


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A filtered channel, version 1, as one of version 2; what is damaged stays so."""
    overview, tests = data.get("overview"), data.get("consistency")
    series = overview if isinstance(overview, Mapping) else {}
    rest = {name: value for name, value in data.items() if name != "overview"}
    return {
        **rest,
        "version": 2,
        **{name: series.get(name) for name in _SERIES},
        "consistency": _tests(tests) if isinstance(tests, Mapping) else tests,
        "conditions": _conditions(texts(data.get("notes"))),
    }


def _tests(tests: Mapping[str, object]) -> dict[str, object]:
    match = _LAG.search(str(tests.get("verdict")))
    if match is None:
        return dict(tests)
    cause = next((code for words, code in _CAUSES.items() if match[2].startswith(words)), match[2])
    return {**tests, "lag": int(match[1]), "cause": cause}


def _conditions(notes: list[str]) -> dict[str, object]:
    flicker, families = first_match(_FLICKER, notes), first_match(_FAMILIES, notes)
    broke, left_out = first_match(_BROKE, notes), first_match(_LEFT_OUT, notes)
    return {
        "drifting": not any(note.startswith("the model holds no drift") for note in notes),
        "flicker_states": None if flicker is None else int(flicker[1] or 1),
        "families": None if families is None else [families[1], families[2]],
        "cautious": families is None or bool(families[3]),
        "broke": 0 if broke is None else int(broke[1]),
        "left_out": 0 if left_out is None else int(left_out[1]),
    }
