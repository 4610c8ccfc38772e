# SPDX-License-Identifier: BSD-3-Clause
"""The errors of the likelihood fit and of the moment fit over the Cramer-Rao bound, for the seed's sensor.

The terms are given (N, a Gauss-Markov term, K), as they are for the bound. Long records are shortened: see
`verification.short_chain`, which `run_chain` compares with whole records.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

import allanite as al
from allanite.fitting.design import TIME_POWER
from allanite.fitting.families import GAUSS_MARKOV, Family
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.pyramid import BLOCK
from allanite.fitting.misfit import best_explained
from allanite.fitting.moments import lags_used
from allanite.noise import GaussMarkov
from allanite.recording.records import Recording
from verification.scenarios import SCENARIOS, Scenario
from verification.short_chain import chained, short_chain
from verification.spread import Say, place_of, spread

__all__ = ["run_chain", "run_errors"]

Json = dict[str, Any]

LENGTHS = {"24 h": "seed's sensor, 24 h", "7 days": "seed's sensor, 7 days"}
NAMES = ("N", "B_equiv", "T", "K")
#: Bars: root-mean-square error over the bound.
BY_LIKELIHOOD, BY_MOMENTS = 1.10, 1.25


def scenario_of(length: str) -> Scenario:
    """The seed's sensor for so long."""
    return next(s for s in SCENARIOS if s.name == LENGTHS[length])


def _estimates(problem: LikelihoodProblem) -> dict[str, float]:
    found = problem.maximum(("N", "G", "K")).parameters
    return {
        "N": found["N"],
        "B_equiv": GaussMarkov.from_sigma(found["sigma"], 1.0).B_equiv,
        "T": found["T"],
        "K": found["K"],
    }


def _short(task: tuple[str, int]) -> Json:
    length, seed = task
    return _estimates(short_chain(scenario_of(length), seed))


def _both(task: tuple[str, int]) -> Json:
    """A full record: by both chains."""
    length, seed = task
    scenario = scenario_of(length)
    record = scenario.record(seed)
    y = record.values(record.names[0])
    means = Recording.from_rate(y.reshape(-1, BLOCK).mean(axis=1), rate=scenario.rate / BLOCK, unit="rad/s")
    return {
        "whole": _estimates(LikelihoodProblem.of(record)),
        "short": _estimates(chained(scenario.model, means, seed)),
    }


def _full(task: tuple[str, int]) -> Json:
    length, seed = task
    return _by_moments(scenario_of(length).record(seed))


def _by_moments(record: Recording) -> Json:
    curve = al.allan_curve(record, threads=1)
    chosen = best_explained(curve, lags_used(curve))
    at = Family(chosen.data, GAUSS_MARKOV)({"Q": 0.0, "R": 0.0})

    def amplitude(symbol: str) -> float:
        return float(math.sqrt(at.coefficient(symbol) * chosen.scale) * curve.dt ** TIME_POWER[symbol])

    slow = GaussMarkov.from_sigma(amplitude("G"), (at.T or 1.0) * curve.dt)
    return {"N": amplitude("N"), "B_equiv": slow.B_equiv, "T": slow.T, "K": amplitude("K")}


# -- tables -----------------------------------------------------------------------------------------------


def run_errors(records: int, seed: int, say: Say, workers: int, cache: Path | None = None) -> list[Json]:
    """Root-mean-square error of each parameter over the bound."""
    rows = []
    for method, work, bar in (("likelihood", _short, BY_LIKELIHOOD), ("moments", _full, BY_MOMENTS)):
        for length in LENGTHS:
            tasks, place = [(length, seed + i) for i in range(records)], place_of(cache, method, length)
            found = spread(work, tasks, workers=workers, say=say, place=place)
            rows += _errors(method, length, found, bar)
            say(str(rows[-len(NAMES) :]))
    return rows


def _errors(method: str, length: str, found: list[Json], bar: float) -> list[Json]:
    scenario, rows = scenario_of(length), []
    limits, truth = scenario.bounds(), scenario.truth()
    for name in NAMES:
        error = np.array([r[name] / truth[name] - 1 for r in found])
        square = float(np.mean(error**2))
        ratio = math.sqrt(square) / limits[name]
        spread = float(np.std(error**2)) / square / 2 / math.sqrt(len(error)) if len(error) > 1 else math.nan
        rows.append(
            {
                "method": method,
                "record": length,
                "parameter": name,
                "records": len(error),
                "bound": limits[name],
                "bias": float(error.mean()),
                "rms": math.sqrt(square),
                "rms_over_bound": ratio,
                "sd_of_that": ratio * spread,
                "bar": bar,
                "met": bool(ratio <= bar),
            }
        )
    return rows


def run_chain(records: int, seed: int, say: Say, workers: int, cache: Path | None = None) -> list[Json]:
    """What the short chain changes against the whole one, of the same records."""
    chain = []
    for length in LENGTHS:
        tasks, place = [(length, seed + i) for i in range(records)], place_of(cache, "chains", length)
        found = spread(_both, tasks, workers=workers, say=say, place=place, chunk=1)
        limits = scenario_of(length).bounds()
        for name in NAMES:
            away = np.array([math.log(r["short"][name] / r["whole"][name]) for r in found]) / limits[name]
            # N is drawn anew: two independent values of one law; the others come from the same means
            expected = math.sqrt(2.0) if name == "N" else 0.0
            chain.append(
                {
                    "record": length,
                    "parameter": name,
                    "records": records,
                    "rms_difference_over_bound": float(np.sqrt(np.mean(away**2))),
                    "expected": expected,
                    "mean_difference_over_bound": float(away.mean()),
                }
            )
        say(str(chain[-len(NAMES) :]))
    return chain
