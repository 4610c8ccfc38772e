# SPDX-License-Identifier: BSD-3-Clause
"""Errors of fits that are given nothing, over the Cramer-Rao bound, and of fits that are given the terms.

Every record is made sample by sample and fitted three times by `allanite.fit`: its curve and its samples with defaults,
and its samples with the terms, and the frequency of a line, given. The bound assumes the true terms, so the fit that is
given them should reach it; what the others lose against it is the cost of not knowing them. Two Gauss-Markov terms are
left out: finding them is for `select`, which tries more terms than `fit` does. Where a record does not support a term,
the estimate counts as zero, as if a user had left the term out.

A row holds if the 95 % set covers, and if the error is within 1.35 of the bound by samples and 1.6 by the curve, or
that of the fit that is given the terms is within 1.1: then the rest is the cost of not knowing them.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

import allanite as al
from allanite.noise import NoiseModel
from verification.coverage import printed, printed_set, relative_rms, share_covered
from verification.gates import HOLDS, within
from verification.scenarios import HARDER, SCENARIOS, Scenario
from verification.spread import Say, place_of, spread

__all__ = ["KNOWN", "run_default_fits"]

Json = dict[str, Any]

KNOWN = tuple(s for s in (*SCENARIOS, *HARDER) if not s.terms)
#: Error over the bound: by the curve, by samples, and by samples with the terms given.
BARS = {"curve": 1.6, "samples": 1.35, "terms given": 1.1}
_LETTERS = {"quantisation": "Q", "white": "N", "flicker": "B", "gauss_markov": "G", "random_walk": "K"}
_LONG = 10_000_000  # samples: of these records a part is enough
_OF_LONG = 0.5


def run_default_fits(seed: int, say: Say, records: int, workers: int, cache: Path | None) -> list[Json]:
    """A row for each parameter that a record can show."""
    rows = []
    for number, scenario in enumerate(KNOWN):
        count = max(round(records * (_OF_LONG if scenario.n_samples > _LONG else 1.0)), 2)
        place = place_of(cache, "default fits", scenario.name, seed)
        work = partial(_fitted, seed, number)
        found = spread(work, range(count), workers=workers, say=say, place=place, chunk=1)
        rows += [_row(scenario, symbol, found) for symbol in scenario.truth() if scenario.shows(symbol)]
    return rows


def _fitted(root: int, number: int, index: int) -> Json:
    scenario = KNOWN[number]
    record = scenario.record(int(np.random.SeedSequence([root, 27, number, index]).generate_state(1)[0]))
    terms = "".join(_LETTERS[t.type] for t in scenario.model.terms if t.type in _LETTERS)
    made: dict[str, NoiseModel] = {
        "curve": al.fit(al.allan_curve(record, threads=1)),
        "samples": al.fit(record),
        "terms given": al.fit(record, terms=terms, lines=scenario.lines),
    }
    return {method: printed(model) for method, model in made.items()}


def _row(scenario: Scenario, symbol: str, found: list[Json]) -> Json:
    truth, bound, n = scenario.truth()[symbol], scenario.bounds()[symbol], len(found)
    sets = {method: [printed_set(f[method], symbol) for f in found] for method in BARS}
    errors = {method: (relative_rms(of, truth) or 0.0) / bound for method, of in sets.items()}
    covered = share_covered(sets["samples"], truth)
    gate, most = within(n), math.sqrt(chi2.ppf(HOLDS, n) / n)
    near = {method: errors[method] <= bar * most for method, bar in BARS.items()}
    return {
        "scenario": scenario.name,
        "parameter": symbol,
        "records": n,
        "bound": bound,
        **{f"{method}, rms over bound": error for method, error in errors.items()},
        **{f"{method}, supported": _share_supported(sets[method]) for method in ("curve", "samples")},
        "samples, rms over bound where supported": (relative_rms(_supported(sets["samples"]), truth) or 0.0)
        / bound,
        "not_knowing_costs": errors["samples"] / errors["terms given"],
        "covered": covered,
        **gate.columns(),
        "passes": gate.holds(covered) and ((near["curve"] and near["samples"]) or near["terms given"]),
    }


def _supported(sets: list[list[Any] | None]) -> list[list[Any] | None]:
    return [e for e in sets if e is not None and e[3]]


def _share_supported(sets: list[list[Any] | None]) -> float:
    return len(_supported(sets)) / len(sets)
