# SPDX-License-Identifier: BSD-3-Clause
"""Does a bound lie above the truth everywhere as often as it says, and what does that cost?

The scenarios of the coverage run. Each record is fitted and bounded twice: as by default, up to the longest lag that
the fit used; and by N and K alone up to four times the length of the record, as for an exported file that knows no
other term. A bound covers when its Allan deviation is at least the true one at every one of 200 averaging times.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

import allanite as al
from allanite.fitting.overbound import overbound
from allanite.noise import NoiseModel
from verification.gates import at_least
from verification.scenarios import SCENARIOS, Scenario
from verification.spread import Say, spread

__all__ = ["run_overbound"]

Json = dict[str, Any]

_PROBABILITY = 0.95
_TIMES = 200
#: Seed stream of this run, apart from that of the coverage run.
_STREAM = 8


def _kinds(scenario: Scenario) -> dict[str, Json]:
    return {
        "as by default": {},
        "N and K alone, to four records": {"terms": ("N", "K"), "horizon": 4 * scenario.duration},
    }


def one(task: tuple[int, int, int]) -> Json:
    """Simulate one record of a scenario, fit and bound it."""
    root, number, index = task
    scenario = SCENARIOS[number]
    seed = int(np.random.SeedSequence([root, _STREAM, number, index]).generate_state(1, np.uint64)[0])
    record = al.simulate(scenario.model, rate=scenario.rate, duration=scenario.duration, seed=seed)
    curve = al.allan_curve(record, threads=1)
    model = al.fit(curve)
    found = {
        kind: _against(overbound(curve, model, probability=_PROBABILITY, **options), scenario)
        for kind, options in _kinds(scenario).items()
    }
    return {"index": index, **found}


def _against(bound: NoiseModel, scenario: Scenario) -> Json:
    """How the bound stands to the truth over its range."""
    inflation, dt = bound.overbound, 1 / scenario.rate
    assert inflation is not None
    m = np.geomspace(inflation.shortest, inflation.horizon, _TIMES) / dt
    ratio = np.sqrt(bound.avar_sampled(m, dt) / scenario.model.avar_sampled(m, dt))
    return {
        "least": float(ratio.min()),
        "mean": float(np.exp(np.log(ratio).mean())),
        "greatest": float(ratio.max()),
        "over_fit": inflation.mean,
    }


def run_overbound(records: int, seed: int, say: Say, workers: int, folder: Path) -> dict[str, list[Json]]:
    """Tables by kind of bound; records already in `folder` are not simulated again.

    `covers`: share of records whose bound is above the truth everywhere, with the least share that 95 % allows.
    `inflation`: mean over records of the bound over the truth, itself a mean over the logarithm of time; `most`: of
    the greatest ratio; `below`: the worst ratio of a bound that does not cover.
    """
    tables: dict[str, list[Json]] = {}
    for number, scenario in enumerate(SCENARIOS):
        tasks = [(seed, number, i) for i in range(scenario.count(records))]
        place = folder / f"overbound-{number}.jsonl"
        results = spread(one, tasks, workers=workers, say=say, place=place, chunk=1)
        for kind in _kinds(scenario):
            row = _row(scenario, [r[kind] for r in results])
            say(f"{kind}: {json.dumps(row)}")
            tables.setdefault(f"Bounds at 95 %, {kind}", []).append(row)
    return tables


def _row(scenario: Scenario, results: list[Json]) -> Json:
    least = np.array([r["least"] for r in results])
    share, gate = float(np.mean(least >= 1)), at_least(len(results))
    missed = least[least < 1]
    return {
        "scenario": scenario.name,
        "records": len(results),
        "covers": share,
        **gate.columns(),
        "passes": gate.holds(share),
        "inflation": float(np.mean([r["mean"] for r in results])),
        "most": float(np.mean([r["greatest"] for r in results])),
        "over_fit": float(np.mean([r["over_fit"] for r in results])),
        "below": float(missed.min()) if len(missed) else None,
    }
