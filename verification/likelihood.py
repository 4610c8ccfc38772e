# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood fit against the Cramer-Rao bound, and the coverage of its sets, for the seed's sensor.

A record of a week at 32 Hz takes seconds to simulate, and all that the fit keeps of what happens within one second is
one matrix of second moments of 600 000 blocks of 32 samples. So the means over one second are simulated, exactly, and
that matrix is drawn from its Wishart law: `run_chain` compares this short chain with the whole one on full records.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import Pool as Processes
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.fitting.likelihood import LikelihoodProblem, fit_problem
from allanite.fitting.likelihood.bands import bands
from allanite.fitting.likelihood.objective import Component, Objective
from allanite.fitting.likelihood.pool import Pool
from allanite.fitting.likelihood.pyramid import BLOCK, TOP, Pyramid, build
from allanite.noise import GaussMarkov, NoiseModel, RandomWalk, White
from allanite.recording import Recording
from allanite.spectrum import sampled_psd
from verification.scenarios import SCENARIOS, SEED, Scenario

__all__ = ["bound", "run_chain", "run_coverage", "run_errors"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Say = Callable[[str], None]

RATE = 32.0
LENGTHS = {"24 h": 86_400.0, "7 days": 604_800.0}
NAMES = ("N", "B_equiv", "T", "K")
#: Bars: root-mean-square error over the bound, by likelihood and by moments; coverage of 95 % sets.
BY_LIKELIHOOD, BY_MOMENTS = 1.10, 1.25
COVERAGE = (0.9335, 0.9655)


def truth() -> dict[str, float]:
    """Parameters of the seed's sensor."""
    white, slow, walk = SEED.terms
    assert isinstance(white, White) and isinstance(slow, GaussMarkov) and isinstance(walk, RandomWalk)
    return {"N": white.N, "B_equiv": slow.B_equiv, "T": slow.T, "K": walk.K}


def bound(duration: float) -> dict[str, float]:
    """Cramer-Rao bound of each parameter's logarithm (Whittle: sum over the Fourier frequencies of the record)."""
    step, n = 1e-4, round(duration * RATE)
    # every low frequency by itself, the many high ones by an integral
    f = np.arange(1, 4097) / duration
    high = np.geomspace(4096.5 / duration, RATE / 2, 4000)
    weight = np.concatenate([np.ones(len(f)), np.gradient(high) * duration])
    f = np.concatenate([f, high])
    weight *= (n / 2 - 1) / weight.sum() if abs(weight.sum() / (n / 2) - 1) < 0.01 else math.nan
    slopes = []
    for name in NAMES:
        up, down = (_sensor({name: math.exp(s)}) for s in (step, -step))
        slopes.append(np.log(_density(up, f) / _density(down, f)) / (2 * step))
    J = np.array(slopes)
    return dict(zip(NAMES, np.sqrt(np.diag(np.linalg.inv((J * weight) @ J.T))).tolist(), strict=True))


def _sensor(factors: dict[str, float]) -> NoiseModel:
    value = {k: v * factors.get(k, 1.0) for k, v in truth().items()}
    sigma = SEED.terms[1].sigma * factors.get("B_equiv", 1.0)  # type: ignore[union-attr]
    return NoiseModel.of(
        White(N=value["N"]), GaussMarkov.from_sigma(sigma, value["T"]), RandomWalk(K=value["K"])
    )


def _density(model: NoiseModel, f: Array) -> Array:
    return sampled_psd(model, f, 1 / RATE, "mean")


# -- the short chain --------------------------------------------------------------------------------------


def short_chain(seconds: Recording, seed: int) -> LikelihoodProblem:
    """The problem of a record of the seed's sensor whose means over one second are these."""
    y = seconds.values(seconds.names[0])
    upper = build([y], len(y), BLOCK)
    quick = _drawn(len(y) - 2, np.random.default_rng([seed, 32]))
    pyramid = replace(upper, pools=(quick, *upper.pools), present=len(y) * BLOCK)
    objective = Objective.of(pyramid, "mean")
    return LikelihoodProblem(
        channel=seconds[seconds.names[0]],
        dt=1 / RATE,
        n_samples=len(y) * BLOCK,
        block=1,
        engine="composite",
        objective=objective,
        octaves=tuple(bands(objective)),
        lines=(),
        recording=seconds,
    )


def _drawn(count: int, rng: np.random.Generator) -> Pool:
    """Second moments of the inside of so many blocks of the seed's sensor: Wishart, by Bartlett's decomposition."""
    shape = build([np.zeros(BLOCK * TOP)], BLOCK * TOP).pools[0]
    one = Objective(
        Pyramid(pools=(shape,), modes=None, present=0, log_volume=0.0, gap_shape=np.zeros(1), gap_walk=0.0),
        "mean",
        1.0,
    )
    V = np.zeros((shape.size, shape.size))
    for term in SEED.terms:
        if isinstance(term, White):
            V += term.N**2 * RATE * one.matrices(Component("N"))[0][0]
        elif isinstance(term, GaussMarkov):
            V += term.sigma**2 * one.matrices(Component("G", term.T * RATE))[0][0]
        elif isinstance(term, RandomWalk):
            V += term.K**2 / RATE * one.matrices(Component("K"))[0][0]
    A = np.tril(rng.standard_normal(V.shape), -1)
    np.fill_diagonal(A, np.sqrt(rng.chisquare(count - np.arange(len(V)))))
    root = np.linalg.cholesky(V) @ A
    return replace(shape, count=count, mean=np.zeros(len(V)), second=root @ root.T / count)


def _estimates(problem: LikelihoodProblem) -> dict[str, float]:
    found = problem.maximum(("N", "G", "K")).parameters
    return {
        "N": found["N"],
        "B_equiv": GaussMarkov.from_sigma(found["sigma"], 1.0).B_equiv,
        "T": found["T"],
        "K": found["K"],
    }


def _short(task: tuple[float, int]) -> Json:
    duration, seed = task
    problem = short_chain(al.simulate(SEED, rate=1.0, duration=duration, seed=seed), seed)
    return _estimates(problem)


def _sets(task: tuple[float, int]) -> Json:
    duration, seed = task
    problem = short_chain(al.simulate(SEED, rate=1.0, duration=duration, seed=seed), seed)
    return _of_family(fit_problem(problem), "gauss-markov")


def _of_family(model: NoiseModel, family: str) -> Json:
    chosen = next((m for m in model.families if m.family == family), None)
    return {} if chosen is None else {e.symbol: [e.lower, e.upper, e.supported] for e in chosen.estimates}


def _both(task: tuple[float, int]) -> Json:
    """A full record: by both chains, and by moments."""
    duration, seed = task
    record = al.simulate(SEED, rate=RATE, duration=duration, seed=seed)
    y = record.values(record.names[0])
    seconds = Recording.from_rate(y.reshape(-1, BLOCK).mean(axis=1), rate=1.0, unit="rad/s")
    found: Json = {
        "whole": _estimates(LikelihoodProblem.of(record)),
        "short": _estimates(short_chain(seconds, seed)),
    }
    model = next((m for m in al.fit(al.allan_curve(record)).families if m.family == "gauss-markov"), None)
    found["moments"] = (
        {} if model is None else {e.symbol: e.value for e in model.estimates if e.value is not None}
    )
    return found


# -- tables -----------------------------------------------------------------------------------------------


def run_errors(records: int, seed: int, say: Say, workers: int) -> list[Json]:
    """Root-mean-square error of each parameter over the bound, by likelihood."""
    rows = []
    with Processes(workers) as pool:
        for length, duration in LENGTHS.items():
            tasks = [(duration, seed + i) for i in range(records)]
            rows += _errors("likelihood", length, pool.map(_short, tasks, chunksize=4), BY_LIKELIHOOD)
            say(str(rows[-4:]))
    return rows


def _errors(method: str, length: str, found: list[Json], bar: float) -> list[Json]:
    limits, rows = bound(LENGTHS[length]), []
    for name, value in truth().items():
        error = np.array([r[name] / value - 1 for r in found if name in r])
        if not len(error):
            continue
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


def run_chain(records: int, seed: int, say: Say, workers: int) -> tuple[list[Json], list[Json]]:
    """Full records: the moment fit over the bound, and what the short chain changes."""
    errors, chain = [], []
    with Processes(workers) as pool:
        for length, duration in LENGTHS.items():
            count = records if length == "24 h" else max(records // 10, 2)
            found = pool.map(_both, [(duration, seed + i) for i in range(count)], chunksize=1)
            errors += _errors("likelihood, whole chain", length, [r["whole"] for r in found], BY_LIKELIHOOD)
            errors += _errors("moments", length, [r["moments"] for r in found], BY_MOMENTS)
            limits = bound(duration)
            for name in NAMES:
                away = np.array([math.log(r["short"][name] / r["whole"][name]) for r in found]) / limits[name]
                # N is drawn anew: two independent values of one law; the others come from the same means
                expected = math.sqrt(2.0) if name == "N" else 0.0
                chain.append(
                    {
                        "record": length,
                        "parameter": name,
                        "records": count,
                        "rms_difference_over_bound": float(np.sqrt(np.mean(away**2))),
                        "expected": expected,
                        "mean_difference_over_bound": float(away.mean()),
                    }
                )
            say(str(errors[-8:]))
    return errors, chain


def _small(task: tuple[str, int]) -> Json:
    name, seed = task
    scenario = next(s for s in SCENARIOS if s.name == name)
    record = al.simulate(scenario.model, rate=scenario.rate, duration=scenario.duration, seed=seed)
    return _of_family(al.fit(record), scenario.family)


def run_coverage(records: int, seed: int, say: Say, workers: int) -> list[Json]:
    """Coverage of the 95 % sets: all records count in which the family of the truth is shown."""
    rows = []
    with Processes(workers) as pool:
        for scenario in SCENARIOS:
            length = next((k for k in LENGTHS if scenario.name.endswith(k)), None)
            if length is None:
                found = pool.map(_small, [(scenario.name, seed + i) for i in range(records)], chunksize=2)
            else:
                tasks = [(LENGTHS[length], seed + i) for i in range(records)]
                found = pool.map(_sets, tasks, chunksize=2)
            rows += _covered(scenario, found)
            say(str(rows[-6:]))
    return rows


def _covered(scenario: Scenario, found: list[Json]) -> list[Json]:
    rows = []
    for name, value in scenario.truth().items():
        ends = [r[name] for r in found if name in r]
        if not ends:
            continue
        inside = float(np.mean([low <= value * (1 + 1e-9) and value <= high for low, high, _ in ends]))
        slack = 3 * math.sqrt(0.95 * 0.05 / len(ends))  # of chance
        low, high = COVERAGE[0] - slack, COVERAGE[1] + slack if value > 0 else 1.0
        rows.append(
            {
                "record": scenario.name,
                "parameter": name,
                "truth": value,
                "records": len(ends),
                "other_family": len(found) - len(ends),
                "coverage": inside,
                "supported": float(np.mean([s for _, _, s in ends])),
                "met_within_chance": bool(low <= inside <= high),
            }
        )
    return rows
