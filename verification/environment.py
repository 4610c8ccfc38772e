# SPDX-License-Identifier: BSD-3-Clause
"""Do the intervals of a temperature coefficient hold, and how often is noise called a warm-up?

Whole estimates, over and over, on records whose noise is fitted to the same record. Where the record shows the slow
noise the intervals have to cover 95 %; where there is hardly any the record cannot exclude it, and the intervals that
allow for it cover more: there only the lower end is asked for.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.simulation import Temperature, simulate
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording
from allanite.stability.environment.estimation import regress_environment
from verification.gates import at_least, at_most, within
from verification.spread import Say, place_of, spread

__all__ = ["SCENARIOS", "WARM_UPS", "run_coverage", "run_warm_up", "twin"]

Json = dict[str, Any]
Array = NDArray[np.float64]

#: Largest share of records without a warm-up in which one is found.
SIZE = 0.05
DT, ROWS = 5.0, 800
LENGTH = DT * ROWS
COEFFICIENT = 0.03
WARMING = 900.0

WHITE = NoiseModel.of(White(N=1.0))
FLICKER = NoiseModel.of(White(N=1.0), Flicker(B=0.15))
WALK = NoiseModel.of(White(N=1.0), RandomWalk(K=3e-3))
ALL = NoiseModel.of(White(N=1.0), Flicker(B=0.08), RandomWalk(K=1.5e-3))
SEED = NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(0.15, 60.0), RandomWalk(K=1e-3))
CYCLES = Temperature(swing=5.0, period=LENGTH / 5, channel="temperature", coefficient=COEFFICIENT, noise=0.02)
RISE = Temperature(
    rise=8.0, time_constant=LENGTH / 5, channel="temperature", coefficient=COEFFICIENT, noise=0.02
)
DAYS = Temperature(
    swing=5.0, period=LENGTH / 2, drift=3 / LENGTH, channel="temperature", coefficient=COEFFICIENT, noise=0.02
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A noise, a temperature, and what is done about a warm-up; `exact`: the upper end of the gate counts, too."""

    noise: NoiseModel
    temperature: Temperature
    warm_up: tuple[float, float] | None = None
    gaps: float = 0.0
    exact: bool = True


SCENARIOS = {
    "flicker, five cycles": Scenario(noise=FLICKER, temperature=CYCLES),
    "random walk, five cycles": Scenario(noise=WALK, temperature=CYCLES),
    "all terms, five cycles": Scenario(noise=ALL, temperature=CYCLES),
    "seed's sensor, five cycles": Scenario(noise=SEED, temperature=CYCLES),
    "all terms, five cycles, a tenth missing": Scenario(noise=ALL, temperature=CYCLES, gaps=0.1),
    "all terms and a warm-up, five cycles": Scenario(
        noise=ALL, temperature=CYCLES, warm_up=(2.0, LENGTH / 12)
    ),
    "random walk, two cycles and a drift": Scenario(noise=WALK, temperature=DAYS, exact=False),
    "all terms, one rise": Scenario(noise=ALL, temperature=RISE, exact=False),
    "white noise alone, five cycles": Scenario(noise=WHITE, temperature=CYCLES, exact=False),
}
WARM_UPS = {
    "white": WHITE,
    "flicker": FLICKER,
    "random walk": WALK,
    "strong random walk": NoiseModel.of(White(N=1.0), RandomWalk(K=1e-2)),
    "all terms": ALL,
    "seed's sensor": SEED,
}


def record(scenario: Scenario, seed: int, number: int) -> Recording:
    """One twin."""
    made = simulate(
        scenario.noise,
        rate=1 / DT,
        duration=LENGTH,
        seed=seed * 100_000 + number,
        unit="LSB",
        name="sensor",
        warm_up=scenario.warm_up,
        temperature=scenario.temperature,
    )
    if scenario.gaps:
        rng = np.random.default_rng([seed, number])
        start = rng.integers(0, ROWS, round(scenario.gaps * ROWS / 8))
        made = made.excluding({"sensor": np.column_stack([start, np.minimum(start + 8, ROWS)])}, "gaps")
    return made


def twin(job: tuple[int, str, int]) -> Json:
    """One estimate."""
    seed, name, number = job
    scenario = SCENARIOS[name]
    begun = time.process_time()
    found = regress_environment(
        record(scenario, seed, number),
        channel="sensor",
        temperature="temperature",
        warm_up="model" if scenario.warm_up else None,
    )
    c = found["temperature"]
    low, high = (math.nan if x is None else x for x in (c.lower, c.upper))
    return {
        "error": None if c.value is None else c.value - COEFFICIENT,
        "sd": c.sd,
        "inside": bool(low <= COEFFICIENT <= high),
        "status": c.status,
        "warm_up": found.warm_up.found,
        "hysteresis": found.hysteresis is not None and found.hysteresis.status == "found",
        "lag": found.lag is not None and found.lag.status == "resolved",
        "seconds": time.process_time() - begun,
    }


def warm_twin(job: tuple[int, str, int]) -> Json:
    """Is a warm-up found where there is none, and where there is one?"""
    seed, name, number = job
    noise, _, size = name.partition(" + ")
    own = Scenario(
        noise=WARM_UPS[noise],
        temperature=Temperature(channel=None),
        warm_up=(float(size), WARMING) if size else None,
    )
    found = regress_environment(record(own, seed, number)).warm_up
    return {"found": found.found, "p": found.p, "T": [w.T for w in found.terms]}


def run_coverage(count: int, seed: int, say: Say, workers: int = 1, cache: Path | None = None) -> list[Json]:
    """Coverage of the 95 % interval of the coefficient, by scenario."""
    rows = []
    for name, scenario in SCENARIOS.items():
        found = _of_all(twin, count, seed, name, say, workers, cache)
        known = [f for f in found if f["sd"]]
        coverage = float(np.mean([f["inside"] for f in found]))
        gate = (within if scenario.exact else at_least)(count)
        rows.append(
            {
                "scenario": name,
                "records": count,
                "coverage": coverage,
                "rms_over_sd": float(np.sqrt(np.mean([(f["error"] / f["sd"]) ** 2 for f in known]))),
                "mean_over_sd": float(np.mean([f["error"] / f["sd"] for f in known])),
                "resolved": float(np.mean([f["status"] == "resolved" for f in found])),
                "warm_up_found": float(np.mean([f["warm_up"] for f in found])),
                "hysteresis_found": float(np.mean([f["hysteresis"] for f in found])),
                "lag_found": float(np.mean([f["lag"] for f in found])),
                "seconds_each": round(float(np.median([f["seconds"] for f in found])), 3),
                **gate.columns(),
                "passes": gate.holds(coverage),
            }
        )
        say(f"{rows[-1]}")
    return rows


def run_warm_up(count: int, seed: int, say: Say, workers: int = 1, cache: Path | None = None) -> list[Json]:
    """How often noise alone is called a warm-up, stated at most 5 %; and how often one is found."""
    rows = []
    for name in (*WARM_UPS, *(f"{n} + {a}" for n in ("flicker", "random walk", "all terms") for a in (1, 3))):
        found = _of_all(warm_twin, count, seed, name, say, workers, cache)
        share, real = float(np.mean([f["found"] for f in found])), " + " in name
        gate = at_most(count, SIZE)
        rows.append(
            {
                "noise": name,
                "records": count,
                "found": share,
                "time_constant": float(np.median([f["T"][-1] for f in found if f["T"]]))
                if real and share
                else None,
                **({} if real else gate.columns()),
                "passes": None if real else gate.holds(share),
            }
        )
        say(f"{rows[-1]}")
    return rows


def _of_all(
    work: Callable[[tuple[int, str, int]], Json],
    count: int,
    seed: int,
    name: str,
    say: Say,
    workers: int,
    cache: Path | None,
) -> list[Json]:
    tasks = [(seed, name, k) for k in range(count)]
    return spread(work, tasks, workers=workers, say=say, place=place_of(cache, "environment", name))
