# SPDX-License-Identifier: BSD-3-Clause
"""Selection of terms: how often the right set comes first, absent terms called present, and what a weight is worth.

What can be told apart is known before a record is made: with the expected second moments in place of those of a
record, the maximum of the likelihood over a set s gives the noncentrality

    lambda_s = 2 E[ln L(truth)] - max 2 E[ln L(s)]

of the gain of the right set over s. Its signed root is nearly normal with a standard deviation of 1, so that the right
set, whose terms cost D more than those of s, scores higher in 95 % of records when

    sqrt(lambda_s) >= sign(D) sqrt(|D|) + 1.645.

A scenario is distinguishable when that holds for every set that lacks one of its terms.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.bands import bands
from allanite.fitting.likelihood.objective import Objective
from allanite.fitting.likelihood.pyramid import build
from allanite.fitting.selection import PRICE, Selection, select
from allanite.fitting.selection.search import MOST_MARKOV, ORDER, Letters, all_sets, ordered
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.recording.records import Channel, Kind, Recording
from verification.gates import at_least, at_most
from verification.scenarios import SCENARIOS, SEED
from verification.short_chain import chained, coefficient, component
from verification.spread import Say, place_of, spread

__all__ = ["run_lines", "run_population", "run_scenarios"]

Json = dict[str, Any]
Array = NDArray[np.float64]

_HOUR = 3600.0
#: Bars: right set where it is distinguishable, an absent term called present.
RIGHT, WRONG = 0.90, 0.05
SLOW = NoiseModel.of(White(N=1e-4), Flicker(B=3e-5))
TWO = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(6e-5, 10.0), GaussMarkov.from_sigma(6e-5, 400.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A truth, and what is done to its records."""

    name: str
    model: NoiseModel
    rate: float
    duration: float
    line: Sinusoid | None = None
    step: float = 0.0  # samples are rounded to multiples of it

    @property
    def n_samples(self) -> int:
        return round(self.rate * self.duration)

    @property
    def letters(self) -> Letters:
        return ordered(tuple(_letter(t) for t in self.model.terms))


CASES = (
    *(Case(name=s.name, model=s.model, rate=s.rate, duration=s.duration) for s in SCENARIOS),
    Case(name="two Gauss-Markov terms", model=TWO, rate=8.0, duration=12 * _HOUR),
    # the rounding of a rate is white noise: no term is added
    Case(name="white + flicker, rounded to 2 sd", model=SLOW, rate=32.0, duration=3 * _HOUR, step=1e-3),
    Case(
        name="white + flicker and a line",
        model=SLOW,
        rate=32.0,
        duration=3 * _HOUR,
        line=Sinusoid(amplitude=1e-4, frequency=7.31),
    ),
)


def _letter(term: TermType) -> str:
    return "G" if isinstance(term, GaussMarkov) else term.symbols[0]


# -- what can be told apart -------------------------------------------------------------------------------


def expected_problem(model: NoiseModel, *, n_samples: int, dt: float) -> LikelihoodProblem:
    """The problem of a record whose second moments are exactly those that the model makes one expect."""
    chunk = 1 << 16
    zeros = (np.zeros(min(chunk, n_samples - i)) for i in range(0, n_samples, chunk))
    shape = build(zeros, n_samples)
    one = Objective(shape, "mean", 1.0)
    parts = [(component(t, dt), coefficient(t, dt)) for t in model.terms]
    pools = tuple(
        replace(
            pool,
            mean=np.zeros(pool.size),
            second=np.asarray(sum(c * one.matrices(k)[i][0] for k, c in parts)),
        )
        for i, pool in enumerate(shape.pools)
    )
    modes = shape.modes
    assert modes is not None
    variances = np.asarray(sum(c * one.variances(k)[0] for k, c in parts))
    whole = replace(shape, pools=pools, modes=replace(modes, value=np.sqrt(variances)))
    objective = Objective.of(whole, "mean")
    low = np.asarray(sum(c * one.matrices(k)[-1][0] for k, c in parts))
    moments = objective._vectors.moments.copy()
    moments[-low.size :] = low.ravel() / objective.scale**2  # those of the slowest modes stand last
    objective._vectors = replace(objective._vectors, moments=moments)
    nothing = Recording.from_rate(np.ones(8), rate=1 / dt, unit="rad/s")
    return LikelihoodProblem(
        channel=Channel(name="expected", kind=Kind.RATE, unit="rad/s", scale=1.0, sampling="mean"),
        dt=dt,
        n_samples=n_samples,
        block=1,
        engine="composite",
        objective=objective,
        octaves=tuple(bands(objective)),
        lines=(),
        recording=nothing,
    )


def hardest_rival(case: Case) -> tuple[Letters, float, float]:
    """The set without one of the terms that is hardest to tell from the truth, its noncentrality, and the margin.

    The margin is sqrt(lambda) - sign(D) sqrt(|D|) - 1.645: distinguishable from 0 on.
    """
    problem = expected_problem(case.model, n_samples=case.n_samples, dt=1 / case.rate)
    best, price = problem.maximum(case.letters).log_likelihood, _price(case.letters)
    found = []
    for rival in all_sets():
        if Counter(case.letters) - Counter(rival) and "R" not in rival:
            noncentrality = max(2 * (best - problem.maximum(rival).log_likelihood), 0.0)
            dearer = price - _price(rival)
            margin = math.sqrt(noncentrality) - math.copysign(math.sqrt(abs(dearer)), dearer) - 1.645
            found.append((margin, noncentrality, rival))
    margin, noncentrality, rival = min(found)
    return rival, noncentrality, margin


def _price(letters: Letters) -> float:
    return sum(PRICE[s] for s in letters)


# -- records ----------------------------------------------------------------------------------------------


def _record(case: Case, seed: int) -> Recording:
    made = al.simulate(case.model, rate=case.rate, duration=case.duration, seed=seed)
    y = made.values(made.names[0]).copy()
    if case.line is not None:
        phase = np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi)
        turn = 2 * np.pi * case.line.frequency / case.rate
        y += case.line.amplitude * np.sin(turn * np.arange(len(y)) + phase)
    if case.step:
        y = case.step * np.round(y / case.step)
    return Recording.from_rate(y, rate=case.rate, unit="rad/s", names=["gyro"])


def _selected(case: Case, seed: int) -> Selection:
    if case.model is SEED:  # a week at 32 Hz: what the fit keeps of each second is drawn from its law
        seconds = al.simulate(SEED, rate=1.0, duration=case.duration, seed=seed)
        return select(chained(SEED, seconds, seed))
    return select(_record(case, seed), lines="auto" if case.line else ())


def _outcome(index: int, root: int, i: int) -> Json:
    case = CASES[index]
    found = _selected(case, _seed(root, index, i))
    kept = [line.frequency for line in found.lines if line.kept]
    return {
        "letters": "".join(found.best.letters),
        "weight": found.best.weight,
        "presence": found.presence(),
        "line": case.line is None or (len(kept) == 1 and abs(kept[0] - case.line.frequency) < 0.01),
    }


def _seed(*parts: int) -> int:
    return int(np.random.SeedSequence(parts).generate_state(1)[0])


def run_scenarios(
    seed: int, say: Say, runs: int = 1000, workers: int = 1, cache: Path | None = None
) -> list[Json]:
    """Every scenario: right set first, and absent terms called present."""
    rows = []
    for index, case in enumerate(CASES):
        found = spread(
            partial(_outcome, index, seed),
            range(runs),
            workers=workers,
            say=say,
            place=place_of(cache, "selection", case.name),
            chunk=2,
        )
        rows.append(_row(case, found))
        say(str(rows[-1]))
    return rows


def _row(case: Case, found: Sequence[Json]) -> Json:
    rival, noncentrality, margin = hardest_rival(case)
    n, truth = len(found), "".join(case.letters)
    right = sum(r["letters"] == truth and r["line"] for r in found)
    # a term besides the truth; where something else stands in the place of a term of the truth, it was mistaken
    beside = sum(_beside(r["letters"], truth) for r in found)
    absent = {s: sum(s in r["letters"] for r in found) / n for s in ORDER if s not in truth}
    weights = [r["weight"] for r in found]
    apart, first, false = margin >= 0, at_least(n, RIGHT), at_most(n, WRONG)
    return {
        "scenario": case.name,
        "right": truth,
        "hardest_rival": "".join(rival),
        "noncentrality": noncentrality,
        "distinguishable": "yes" if apart else "not",
        "records": n,
        "right_first": right / n,
        "absent_besides": beside / n,
        "absent_called_present": absent,
        "line_found": "" if case.line is None else sum(r["line"] for r in found) / n,
        "mean_weight_of_first": float(np.mean(weights)),
        "gate": [first.low if apart else None, false.high],
        "rejects": ", ".join(g.columns()["rejects"] for g in (first, false) if apart or g is false),
        "passes": (not apart or first.holds(right / n)) and false.holds(beside / n, *absent.values()),
    }


def _beside(letters: str, truth: str) -> bool:
    """The whole truth, and something more."""
    wanted, had = Counter(truth), Counter(letters)
    return not (wanted - had) and bool(had - wanted)


# -- what a weight is worth -------------------------------------------------------------------------------

_TERM_BINS = (0.0, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
_SET_BINS = (0.0, 0.3, 0.5, 0.7, 0.9, 1.0)
POPULATION_SAMPLES = 8192


def population(rng: np.random.Generator) -> NoiseModel:
    """A sensor out of a population whose terms go from far below to far above what the record shows."""

    def size(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))

    terms: list[TermType] = [White(N=1.0)]
    if rng.random() < 0.3:
        terms.append(Quantisation(Q=size(0.05, 1.0), dt=1.0))
    if rng.random() < 0.35:
        terms.append(Flicker(B=size(0.03, 0.6)))
    if rng.random() < 0.4:
        terms.append(RandomWalk(K=size(1e-4, 3e-2)))
    count = int(rng.random() < 0.45)
    count += int(count and rng.random() < 0.35)
    terms += [GaussMarkov.from_sigma(size(0.05, 1.0), size(16.0, 1200.0)) for _ in range(count)]
    return NoiseModel.of(*terms)


def _drawn(root: int, i: int) -> Json:
    model = population(np.random.default_rng([root, 8, i]))
    made = al.simulate(model, rate=1.0, duration=float(POPULATION_SAMPLES), seed=_seed(root, 9, i))
    found = select(LikelihoodProblem.of(made))
    truth = ordered(tuple(_letter(t) for t in model.terms))
    presence = found.presence()
    held = {s: s in truth for s in ORDER} | {"GG": truth.count("G") == MOST_MARKOV}
    return {
        "weight": found.best.weight,
        "right": found.best.letters == truth,
        "terms": [(presence[s], held[s]) for s in held],
    }


def run_population(
    seed: int, say: Say, runs: int = 3000, workers: int = 1, cache: Path | None = None
) -> tuple[list[Json], list[Json]]:
    """Weights of terms and of sets against how often they are right."""
    found = spread(
        partial(_drawn, seed),
        range(runs),
        workers=workers,
        say=say,
        place=place_of(cache, "selection", "population"),
    )
    terms = _binned([pair for r in found for pair in r["terms"]], _TERM_BINS)
    sets = _binned([(r["weight"], r["right"]) for r in found], _SET_BINS)
    for row in (*terms, *sets):
        say(str(row))
    return terms, sets


def _binned(pairs: Sequence[tuple[float, bool]], edges: Sequence[float]) -> list[Json]:
    rows = []
    for low, high in zip(edges, edges[1:], strict=False):
        inside = [(w, r) for w, r in pairs if low <= w < high or w == high == 1.0]
        if inside:
            share = float(np.mean([r for _, r in inside]))
            rows.append(
                {
                    "weight": [low, high],
                    "cases": len(inside),
                    "mean_weight": float(np.mean([w for w, _ in inside])),
                    "right": share,
                    "sd_of_that": math.sqrt(share * (1 - share) / len(inside)),
                }
            )
    return rows


# -- lines ------------------------------------------------------------------------------------------------


def _line(given: bool, root: int, i: int) -> Json:
    """White noise and flicker, no line: does one pay its price?"""
    seed = _seed(root, 10, i)
    made = al.simulate(NoiseModel.of(White(N=1.0), Flicker(B=0.3)), rate=1.0, duration=4096.0, seed=seed)
    asked = float(np.random.default_rng(seed).uniform(0.05, 0.45))
    found = select(made, lines=[asked] if given else "auto")
    return {
        "kept": any(line.kept for line in found.lines),
        "gain": max([*(g.gain for g in found.lines), 0.0]),
    }


def run_lines(
    seed: int, say: Say, runs: int = 1000, workers: int = 1, cache: Path | None = None
) -> list[Json]:
    """Records without a line: at most 1 % may be given one."""
    rows = []
    for given in (True, False):
        found = spread(
            partial(_line, given, seed),
            range(runs),
            workers=workers,
            say=say,
            place=place_of(cache, "selection", "line given" if given else "line searched"),
        )
        wrong, gate = sum(r["kept"] for r in found) / runs, at_most(runs, 0.01)
        rows.append(
            {
                "lines": "one frequency given" if given else "auto",
                "records": runs,
                "a_line_kept": wrong,
                **gate.columns(),
                "99_%_point_of_the_gain": float(np.quantile([r["gain"] for r in found], 0.99)),
                "passes": gate.holds(wrong),
            }
        )
        say(str(rows[-1]))
    return rows
