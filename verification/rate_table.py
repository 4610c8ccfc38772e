# SPDX-License-Identifier: BSD-3-Clause
"""Is the response of a sensor on a rate table as well known as it says? Runs on twins of a table, over and over.

Every twin has its own scale factor (of either sign), bias, curvature, misalignment, clocks and settling; its noise is
white, Gauss-Markov and a random walk, and its slow part moves the means of steps by more than their white noise does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from multiprocessing import Pool
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table import (
    RateSteps,
    RateTable,
    RateTableEstimate,
    Sampled,
    Sinusoids,
    measure_rate_table,
    simulate_on_table,
)
from allanite.noise import GaussMarkov, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording
from verification.gates import at_least, within

__all__ = ["DESIGNS", "NOISE", "run_rate_table", "table_of", "truth_of", "twin"]

Json = dict[str, Any]
Array = NDArray[np.float64]

DEG = math.pi / 180
RATE, FULL = 20.0, 100 * DEG
NOISE = NoiseModel.of(
    White(N=0.005 * DEG), GaussMarkov.from_sigma(0.003 * DEG, 100.0), RandomWalk(K=5e-5 * DEG)
)
#: Kind of table, what is fitted, and whether the noise model is known.
DESIGNS: tuple[tuple[str, int | str, bool], ...] = (
    ("steps", 3, True),
    ("steps", "sign", True),
    ("steps", 3, False),
    ("sweep", 3, True),
    ("sweep", "sign", True),
    ("sinusoid", 3, True),
    ("sinusoid", "sign", True),
)
_RATES = (0, 10, -10, 30, -30, 60, -60, 100, -100, 0, 100, -100, 60, -60, 30, -30, 10, -10, 0)


def table_of(kind: str) -> RateTable:
    """Steps of half a minute, twice each; a triangle of two minutes; or a sinusoid of ten seconds."""
    if kind == "steps":
        start = 30.0 * np.arange(len(_RATES), dtype=np.float64)
        return RateSteps(start=start, stop=start + 30.0, rate=np.array(_RATES) * DEG)
    if kind == "sweep":
        t = np.arange(0.0, 600.05, 0.1)
        return Sampled.of_rates(t, FULL * (1 - np.abs((t / 120 + 0.25) % 1 * 4 - 2)))
    one = np.array([1.0])
    return Sinusoids(start=0 * one, stop=600 * one, amplitude=FULL * one, frequency=0.1 * one, phase=0 * one)


def truth_of(kind: str, fitted: int | str, rng: np.random.Generator) -> Json:
    """What one sensor is."""
    curved = fitted == 3
    return {
        "scale": float(rng.choice([-1, 1]) * (1 + 0.01 * rng.standard_normal()))
        if kind == "steps"
        else 1.002,
        "bias": float(0.1 * DEG * rng.standard_normal()),
        "powers": (1e-4 * rng.standard_normal(2)).tolist() if curved else [],
        "asymmetry": 0.0 if curved else float(1e-4 * rng.standard_normal()),
        "misalignment": float(2e-3 * rng.standard_normal()),
        "offset": float(rng.uniform(0.0, 4.0)) if kind != "sinusoid" else float(rng.uniform(-2.0, 2.0)),
        "settling": float(rng.uniform(0.05, 0.3)) if kind == "steps" else 0.0,
    }


def twin(kind: str, truth: Json, seed: int) -> Recording:
    """The sensor on the axis, and one across it, on the same table."""
    table = table_of(kind)
    facts = {"rate": RATE, "duration": float(table.spans[-1, 1]) + 5.0, "offset": truth["offset"]}
    facts["settling"] = truth["settling"]
    own = {name: truth[name] for name in ("scale", "bias", "powers", "asymmetry")}
    along = simulate_on_table(NOISE, table, seed=seed, name="z", **own, **facts)
    across = simulate_on_table(NOISE, table, seed=seed + 1, name="x", scale=truth["misalignment"], **facts)
    return replace(
        along, channels=(*along.channels, *across.channels), columns=(*along.columns, *across.columns)
    )


def slopes_of(kind: str, fitted: int | str) -> dict[str, float]:
    """Slope of the best straight line of each curve over the rate, over the time that is used."""
    table = table_of(kind)
    u = np.array(_RATES) / 100 if kind == "steps" else table.means(np.arange(0.5, 599.5, 0.05), 0.05) / FULL
    if kind == "sinusoid":
        u = np.sin(2 * np.pi * np.arange(0.0, 1.0, 1e-4))
    curves = {"quadratic": u**2, "cubic": u**3} if fitted == 3 else {"asymmetry": np.abs(u)}
    return {name: float(np.polyfit(u, curve, 1)[0]) for name, curve in curves.items()}


def answers(kind: str, fitted: int | str, truth: Json) -> dict[str, float]:
    """The truth by the names of the parameters."""
    slopes = slopes_of(kind, fitted)
    shape = dict(zip(("quadratic", "cubic"), truth["powers"], strict=False))
    half = {"asymmetry": truth["asymmetry"] / 2} if fitted == "sign" else {}
    line = truth["scale"] * (1 + sum(slopes[name] * c for name, c in {**shape, **half}.items()))
    out = {"scale factor": line, "bias": truth["bias"], "misalignment of x": truth["misalignment"]}
    factor = truth["scale"] / line
    out |= {name: c * factor for name, c in shape.items()}
    if half:
        out["asymmetry"] = truth["asymmetry"] * factor
    if kind != "steps":
        out["clock offset"] = truth["offset"]
    return out


def measured(record: Recording, kind: str, fitted: int | str, known: bool) -> RateTableEstimate:
    """The estimate from one twin."""
    return measure_rate_table(
        record, table=table_of(kind), channel="z", model=NOISE if known else None, nonlinearity=fitted
    )


def _one(job: tuple[int, int, int]) -> Json:
    seed, design, number = job
    kind, fitted, known = DESIGNS[design]
    rng = np.random.default_rng([seed, design, number])
    truth = truth_of(kind, fitted, rng)
    record = twin(kind, truth, int(rng.integers(2**30)))
    found = measured(record, kind, fitted, known)
    rows: Json = {"verdict": found.verdict, "failed": [c.name for c in found.checks if not c.passed]}
    for name, value in answers(kind, fitted, truth).items():
        p = found[name]
        rows[name] = [(p.value - value) / p.total_sd, p.interval[0] <= value <= p.interval[1], p.total_sd]
    return rows


def run_rate_table(
    seed: int,
    say: Callable[[str], None],
    *,
    records: int = 1000,
    workers: int = 2,
    designs: Sequence[int] = range(len(DESIGNS)),
) -> list[Json]:
    """Coverage of the 95 % intervals, one row for each table and parameter; "rms" is of the errors over their sd."""
    out = []
    with Pool(workers) as pool:
        for design in designs:
            kind, fitted, known = DESIGNS[design]
            found = pool.map(_one, [(seed, design, k) for k in range(records)], chunksize=4)
            failed = sum(bool(row["failed"]) for row in found) / records
            gate = (within if known else at_least)(records)
            for name in [n for n in found[0] if n not in ("verdict", "failed")]:
                error, inside, sd = np.array([row[name] for row in found], dtype=np.float64).T
                coverage = float(inside.mean())
                out.append(
                    {
                        "table": kind,
                        "fitted": f"degree {fitted}" if fitted != "sign" else "asymmetry",
                        "noise": "known" if known else "of the record",
                        "parameter": name,
                        "records": records,
                        "coverage": coverage,
                        "rms": math.sqrt(float(np.mean(error**2))),
                        "sd": float(np.median(sd)),
                        "blamed": failed,
                        **gate.columns(),
                        "passes": gate.holds(coverage),
                    }
                )
            say(f"rate table: {kind}, {fitted}, {'known' if known else 'own'} noise: done")
    return out
