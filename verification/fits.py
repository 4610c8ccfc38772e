# SPDX-License-Identifier: BSD-3-Clause
"""Fits of many simulated records of each scenario: of the curve, of the samples, and of the samples by given terms.

Every record is made sample by sample and fitted three times by public calls: its curve, after its steady spectral lines
were removed as `characterize` does, and its samples, both with defaults; and its samples with the terms and frequencies
of lines given. Coverage of the first two is `verification.coverage`. Errors stand over the Cramer-Rao bound, which
assumes the true terms, so the fit that is given them should reach it; what the others lose against it is the cost of
not knowing them. Where a record does not support a term, the estimate counts as zero, as if a user had left it out.

A row of errors holds if they are within 1.35 of the bound by samples and 1.6 by the curve, or those of the fit that is
given the terms are within 1.1: then the rest is the cost of not knowing them.

Two Gauss-Markov terms are fitted by given terms alone: finding them is for `select`, which tries more than `fit` does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

import allanite as al
from allanite.noise import NoiseModel, Sinusoid
from verification.coverage import printed, printed_set, relative_rms
from verification.gates import HOLDS
from verification.scenarios import HARDER, SCENARIOS, Scenario
from verification.spread import Say, place_of, spread

__all__ = ["ALL", "BY_CURVE", "BY_SAMPLES", "BY_TERMS", "errors_over_bound", "run_fits"]

Json = dict[str, Any]

ALL = (*SCENARIOS, *HARDER)
BY_CURVE, BY_SAMPLES, BY_TERMS = "curve", "samples", "terms given"
#: Error over the bound.
BARS = {BY_CURVE: 1.6, BY_SAMPLES: 1.35, BY_TERMS: 1.1}
_LETTERS = {"quantisation": "Q", "white": "N", "flicker": "B", "gauss_markov": "G", "random_walk": "K"}


def run_fits(
    scenarios: Iterable[Scenario], seed: int, say: Say, records: int, workers: int, cache: Path | None
) -> dict[str, list[Json]]:
    """By the name of the scenario: what each record's fits print, by method."""
    made = {}
    for scenario in scenarios:
        place = place_of(cache, "fits", scenario.name, seed)
        work, tasks = partial(_fitted, seed, ALL.index(scenario)), range(scenario.count(records))
        made[scenario.name] = spread(work, tasks, workers=workers, say=say, place=place, chunk=1)
    return made


def _fitted(root: int, number: int, index: int) -> Json:
    scenario = ALL[number]
    record = scenario.record(int(np.random.SeedSequence([root, 27, number, index]).generate_state(1)[0]))
    terms = "".join(_LETTERS[t.type] for t in scenario.model.terms if t.type in _LETTERS)
    told: dict[str, Any] = {
        "terms": scenario.terms or terms,
        "lines": _lines(scenario.model),
        "screen": False,
    }
    made = {BY_TERMS: al.fit(record, **told)}
    if not scenario.terms:
        made[BY_SAMPLES] = model = al.fit(record)
        if _lines(model):  # the same lines as in the spectrum
            record = al.without_stable_lines(record, al.power_spectrum(record, record.names[0]))
        made[BY_CURVE] = al.fit(al.allan_curve(record, threads=1))
    return {method: printed(model) for method, model in made.items()}


def _lines(model: NoiseModel) -> list[float]:
    return [t.frequency for t in model.terms if isinstance(t, Sinusoid)]


def errors_over_bound(made: dict[str, list[Json]]) -> list[Json]:
    """A row for each parameter that a record can show, of the scenarios that are fitted without terms."""
    return [
        _row(scenario, symbol, made[scenario.name])
        for scenario in ALL
        if scenario.name in made and not scenario.terms
        for symbol in scenario.truth()
        if scenario.shows(symbol)
    ]


def _row(scenario: Scenario, symbol: str, found: list[Json]) -> Json:
    truth, bound, n = scenario.truth()[symbol], scenario.bounds()[symbol], len(found)
    sets = {method: [printed_set(f[method], symbol) for f in found] for method in BARS}
    errors = {method: (relative_rms(of, truth) or 0.0) / bound for method, of in sets.items()}
    most = math.sqrt(chi2.ppf(HOLDS, n) / n)
    near = {method: errors[method] <= bar * most for method, bar in BARS.items()}
    return {
        "scenario": scenario.name,
        "parameter": symbol,
        "records": n,
        "bound": bound,
        **{f"{method}, rms over bound": error for method, error in errors.items()},
        **{f"{method}, supported": _share_supported(sets[method]) for method in (BY_CURVE, BY_SAMPLES)},
        "samples, rms over bound where supported": (relative_rms(_supported(sets[BY_SAMPLES]), truth) or 0.0)
        / bound,
        "not_knowing_costs": errors[BY_SAMPLES] / errors[BY_TERMS],
        "passes": (near[BY_CURVE] and near[BY_SAMPLES]) or near[BY_TERMS],
    }


def _supported(sets: list[list[Any] | None]) -> list[list[Any] | None]:
    return [e for e in sets if e is not None and e[3]]


def _share_supported(sets: list[list[Any] | None]) -> float:
    return len(_supported(sets)) / len(sets)
