# SPDX-License-Identifier: BSD-3-Clause
"""Do the lags and the frequencies tell the same model?

A model fitted to an Allan curve is held against the spectrum of the same record, in three ways:

* all ordinates together: the sum of their squared normal scores is chi-square;
* band by band, an octave and an eighth of the spectrum wide: the mean of the scores is normal;
* its own terms fitted again, to the frequencies: a parameter disagrees when each of the two estimates lies outside
  the interval of the other.

Both fits see one record, so that estimates agree better than independent ones would: the levels are conservative, and
the rate of false alarms is measured (``python -m verification spectrum``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FitError
from allanite.fitting.spectral.disagreements import Disagreement, Parted
from allanite.fitting.spectral.ordinates import Ordinates
from allanite.fitting.spectral.profile import deviations
from allanite.fitting.spectral.whittle import WhittleProblem, WhittleSolution
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, TermType, White
from allanite.noise.parameters import amplitude_of, estimate_of
from allanite.quantities.distributions import chi_square_tail, normal_quantile

__all__ = ["disagreement"]

Array = NDArray[np.float64]

#: Probability that chance makes all ordinates, or any band, this unlike the model.
_LEVEL = 1e-3
_BANDS = (2.0, 8.0)  # ratio of the ends of a band; the second: this part of the whole spectrum
_FEWEST = 4  # ordinates of a band
_LETTER: dict[type[TermType], str] = {
    Quantisation: "Q",
    White: "N",
    Flicker: "B",
    GaussMarkov: "G",
    RandomWalk: "K",
    Ramp: "R",
}


def disagreement(model: NoiseModel, data: Ordinates) -> Disagreement | None:
    """Where a fitted model of the Allan curve and the ordinates of the same channel part; None where they agree.

    Where the record cannot decide between two families, one that agrees is enough.
    """
    disagreements = [_of(family, _seen(family, data)) for family in model.families if family.terms]
    return None if not disagreements or any(f is None for f in disagreements) else disagreements[0]


def _seen(model: NoiseModel, data: Ordinates) -> Ordinates:
    """The ordinates that the curve was fitted to as well, with the error that its fit admits."""
    from dataclasses import replace

    facts = model.goodness
    if facts.get("left_out"):
        data = data.below(0.5 / float(facts["shortest_tau"]))
    return replace(data, discrepancy=float(facts.get("discrepancy") or 0.0))


def _of(model: NoiseModel, data: Ordinates) -> Disagreement | None:
    terms = [t for t in model.terms if type(t) in _LETTER]
    problem = WhittleProblem(data=data, letters=tuple(_LETTER[type(t)] for t in terms))
    at = _placed(problem, terms)
    if at is None:
        return None
    z = problem.scores(at)
    together = chi_square_tail(float(z @ z), len(z))
    place, worst = _worst_band(data.frequency, z)
    whole = min(together, worst) < _LEVEL
    parted = tuple(_parted(problem, at, model, terms))
    if not whole and not parted:
        return None
    ratio = float(
        data.weight[place] @ (problem.values(at.ramp)[place] / at.mean[place]) / data.weight[place].sum()
    )
    f = data.frequency[place]
    return Disagreement(
        p=min(together, worst),
        band=(float(f.min()), float(f.max())),
        ratio=ratio,
        parameters=parted,
        whole=whole,
    )


def _placed(problem: WhittleProblem, terms: list[TermType]) -> WhittleSolution | None:
    """The model as it is, without any fitting (but for the sign of a ramp)."""
    c = np.array([_coefficient(t) for t in terms])
    times = tuple(t.T for t in terms if isinstance(t, GaussMarkov))
    low, high = problem.data.times
    if any(not low <= T <= high for T in times):
        return None
    slope = next((t.R for t in terms if isinstance(t, Ramp)), 0.0)
    fixed = {i: float(v) for i, v in enumerate(c)}
    held = dict(zip(problem.markov, times, strict=True))
    near = WhittleSolution(
        c=c, times=times, ramp=slope, value=math.inf, mean=np.ones(len(problem.data.value))
    )
    try:
        solutions = [problem.best(fixed=fixed, times=held, ramp=s, near=near) for s in {slope, -slope}]
    except FitError:
        return None
    best = min(solutions, key=lambda s: s.value)
    return best if math.isfinite(best.value) else None


def _coefficient(term: TermType) -> float:
    return 0.0 if isinstance(term, Ramp) else amplitude_of(term) ** 2


def _worst_band(frequency: Array, z: Array) -> tuple[NDArray[np.int64], float]:
    """The band whose mean score is least likely, and the probability that any band is as unlikely."""
    order = np.argsort(frequency)
    x, total = np.log(frequency[order]), np.concatenate([[0.0], np.cumsum(z[order])])
    bands = list(_bands(x))
    if not bands:
        return order, 1.0
    first, last = np.array(bands).T
    score = np.abs(total[last] - total[first]) / np.sqrt(last - first)
    worst = int(np.argmax(score))
    chance = chi_square_tail(float(score[worst]) ** 2, 1) * len(bands)
    return order[first[worst] : last[worst]], min(chance, 1.0)


def _bands(x: Array) -> Iterator[tuple[int, int]]:
    """[first, last) of bands of one width each, shifted by half of it."""
    span = float(x[-1] - x[0])
    for width in (math.log(_BANDS[0]), span / _BANDS[1]):
        for start in np.arange(x[0], x[-1], width / 2):
            first, last = np.searchsorted(x, [start, start + width])
            if last - first >= _FEWEST:
                yield int(first), int(last)


def _parted(
    problem: WhittleProblem, at: WhittleSolution, model: NoiseModel, terms: list[TermType]
) -> Iterator[Parted]:
    """Parameters whose two estimates each lie outside the interval of the other."""
    again = problem.best(near=at)
    spread = deviations(problem, again)
    z = normal_quantile(0.975)
    for i, (letter, term) in enumerate(zip(problem.letters, terms, strict=True)):
        estimate = estimate_of(term, model)
        if letter == "R" or estimate is None or not estimate.supported or estimate.value is None:
            continue
        here, there = math.sqrt(_coefficient(term)), math.sqrt(again.c[i])
        if estimate.lower <= there <= estimate.upper:
            continue
        sd = math.hypot(spread.get(i, math.inf) / 2, problem.data.discrepancy / 2)
        if there == 0 or abs(math.log(there / here)) > z * sd:
            yield Parted(symbol=estimate.symbol, lags=here, frequencies=there)
