# SPDX-License-Identifier: BSD-3-Clause
"""Sets of the parameters by likelihood ratio, with the other terms as non-negative nuisances.

A set holds every value at which the best of the other parameters comes within the critical distance of the maximum.
A term is supported when its set excludes zero. The critical distance is that of the moment fit's sets: chi-square where
the nuisances are known, larger where several of them sit at zero and may only grow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FitError
from allanite.fitting.inversion import CERTAIN, cone_point, crossing, end_of_set, end_of_time
from allanite.fitting.joined_sets import joined_sets
from allanite.fitting.spectral.whittle import WhittleProblem, WhittleSolution
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile, student_quantile

__all__ = ["WhittleFit", "covariance", "deviations", "fitted", "ramp_point"]

Array = NDArray[np.float64]

_FIRST_TIME = 0.1  # standard deviation of the logarithm of a correlation time, about
_WIDEST = 1e6  # standard deviations of a slope
_NEEDED = 6.0  # loss by leaving out all unsupported terms (95 % point for two) that calls one of them back


@dataclass(frozen=True, slots=True, kw_only=True)
class WhittleFit:
    """A sum of terms with the set of every parameter.

    Attributes
    ----------
    problem : WhittleProblem
    full : WhittleSolution
        With every candidate term.
    chosen : WhittleSolution
        With the supported terms alone, and as many more as the spectrum needs: the point estimates.
    supported : frozenset of int
        Places of the supported letters.
    sets : dict of int to (float, float)
        Variance coefficients by place (a ramp: its squared slope); correlation times [s] by place + number of letters.
        Each holds the point estimate.
    """

    problem: WhittleProblem
    full: WhittleSolution
    chosen: WhittleSolution
    supported: frozenset[int]
    sets: dict[int, tuple[float, float]]


def fitted(
    problem: WhittleProblem, full: WhittleSolution, confidence: float, *, keep: bool = False
) -> WhittleFit:
    """Sets, support and point estimates; with `keep` every term is taken as given and stays in the estimate."""
    plain = chi_square_quantile(confidence, 1)
    sd = deviations(problem, full)
    rough = frozenset(
        i
        for i in range(len(problem.letters))
        if _size(problem, full, i) > 0 and (sd.get(i, 1.0) < CERTAIN or _loss(problem, full, i, 0.0) > plain)
    )
    sets: dict[int, tuple[float, float]] = {}
    for i, letter in enumerate(problem.letters):
        ramp = letter == "R"
        critical = (
            ramp_point(problem, full, confidence) if ramp else _critical(problem, full, i, rough, confidence)
        )
        sets[i] = (
            _ramp_set(problem, full, critical) if letter == "R" else _set(problem, full, i, critical, sd)
        )
    supported = frozenset(i for i in range(len(problem.letters)) if sets[i][0] > 0)
    for k, g in enumerate(problem.markov):
        if g in supported:
            critical = _critical(problem, full, g + len(problem.letters), supported, confidence)
            sets[g + len(problem.letters)] = _time_set(problem, full, k, critical)
    chosen = full if keep else _chosen(problem, full, supported)
    if not keep:
        sets = _joined(problem, chosen, sets, confidence)
    return WhittleFit(problem=problem, full=full, chosen=chosen, supported=supported, sets=sets)


def deviations(problem: WhittleProblem, at: WhittleSolution) -> dict[int, float]:
    """Relative standard deviation of each positive coefficient and of each correlation time, by place."""
    J, places = _whitened(problem, at)
    if not places:
        return {}
    inverse = np.linalg.pinv(J.T @ J, rcond=1e-12)
    return {p: math.sqrt(max(float(inverse[k, k]), 0.0)) for k, p in enumerate(places)}


def covariance(problem: WhittleProblem, at: WhittleSolution) -> tuple[Array, tuple[int, ...]]:
    """Covariance of the logarithms of the positive coefficients and of the correlation times, and their places."""
    J, places = _whitened(problem, at)
    return np.asarray(np.linalg.pinv(J.T @ J, rcond=1e-12), dtype=np.float64), places


def _whitened(problem: WhittleProblem, at: WhittleSolution) -> tuple[Array, tuple[int, ...]]:
    slopes, places = problem.slopes(at)
    return problem.whitened(slopes, np.ones(len(slopes))), places


def _size(problem: WhittleProblem, at: WhittleSolution, i: int) -> float:
    return at.ramp**2 if problem.letters[i] == "R" else float(at.c[i])


def _loss(
    problem: WhittleProblem, full: WhittleSolution, i: int, value: float, near: WhittleSolution | None = None
) -> float:
    """How much worse the best fit is with a coefficient held."""
    if problem.letters[i] == "R":
        return problem.best(ramp=math.sqrt(value), near=near or full).value - full.value
    cold = near is None and problem.letters[i] != "G"
    start = None if cold else near or full
    try:
        return problem.best(fixed={i: value}, near=start).value - full.value
    except FitError:  # it is the only term with a density: without it there is no model
        return math.inf


def _critical(
    problem: WhittleProblem, full: WhittleSolution, place: int, supported: frozenset[int], confidence: float
) -> float:
    """Critical distance of a parameter: terms that are not supported sit at zero, where they may only grow."""
    n = len(problem.letters)
    A = problem.columns(full.times)
    named = {i: A[:, i] for i in range(n) if problem.letters[i] != "R"}
    for g, T in zip(problem.markov, full.times, strict=True):
        if full.c[g] > 0:
            named[g + n] = full.c[g] * problem.data.slope(T)
    named = {p: problem.whitened(part[:, None], full.mean)[:, 0] for p, part in named.items()}
    if place not in named:
        return chi_square_quantile(confidence, 1)
    order = [place, *(p for p in named if p != place)]
    kinds = ["free", *("free" if p in supported or p >= n else "one-sided" for p in order[1:])]
    norms = [float(np.linalg.norm(named[p])) for p in order]
    kept = [k for k, size in enumerate(norms) if size > 1e-300 or k == 0]
    columns = [named[order[k]] / max(norms[k], 1e-300) for k in kept]
    return cone_point(columns, tuple(kinds[k] for k in kept), confidence)


def ramp_point(problem: WhittleProblem, at: WhittleSolution, confidence: float) -> float:
    """Critical distance of a ramp: that of Student's law, for the density about it is itself estimated.

    A slope is told by the lowest contrasts alone, whose common level mu is known to var(ln mu) = 2/nu; the distance is
    then (nu + 1) ln(1 + t^2/nu).
    """
    n = len(problem.data.ramp)
    density = problem.data.ramp**2 / at.mean[:n]
    if not density.sum() > 0:
        return chi_square_quantile(confidence, 1)
    columns = problem.columns(at.times) / at.mean[:, None]
    columns = columns[:, columns.any(axis=0)]
    scaled = columns / np.linalg.norm(columns, axis=0)
    whitened = problem.whitened(scaled, np.ones(len(scaled)))
    known = np.linalg.pinv(whitened.T @ whitened, rcond=1e-10)
    level = density @ scaled[:n] / density.sum()
    nu = min(max(2 / float(level @ known @ level), 2.0), 1e6)
    return (nu + 1) * math.log1p(student_quantile((1 + confidence) / 2, nu) ** 2 / nu)


def _set(
    problem: WhittleProblem, full: WhittleSolution, i: int, critical: float, sd: dict[int, float]
) -> tuple[float, float]:
    """Ends of a coefficient's set."""
    near = full

    def loss(value: float) -> float:
        nonlocal near
        near = problem.best(fixed={i: value}, near=near)
        return near.value - full.value

    here, spread = float(full.c[i]), sd.get(i, 1.0)
    lower = 0.0
    if here > 0 and (spread < CERTAIN or _loss(problem, full, i, 0.0) > critical):
        lower = end_of_set(loss, critical, here, -1, spread)
        near = full
    start = here if here > 0 else _first_guess(problem, full, i)
    return lower, end_of_set(loss, critical, start, +1, spread)


def _ramp_set(problem: WhittleProblem, full: WhittleSolution, critical: float) -> tuple[float, float]:
    """Ends of the set of the squared slope. L is a parabola in it, but for the other terms that give way."""
    n = len(problem.data.ramp)
    size = float(problem.data.weight[:n] / full.mean[:n] @ problem.data.ramp**2)
    if size <= 0:
        return 0.0, math.inf
    sd = 1 / math.sqrt(size)

    def end(side: float) -> float:
        def loss(x: float) -> float:
            return problem.best(ramp=full.ramp + side * x, near=full).value - full.value

        return full.ramp + side * crossing(loss, critical, math.sqrt(critical) * sd, _WIDEST * sd)

    ends = end(-1.0), end(1.0)
    sizes = sorted(abs(e) for e in ends)
    return (0.0 if ends[0] < 0 < ends[1] else sizes[0] ** 2), sizes[1] ** 2


def _time_set(problem: WhittleProblem, full: WhittleSolution, k: int, critical: float) -> tuple[float, float]:
    """Ends of the set of a correlation time; the ends of what is tried where the record sets none."""
    g, ends = problem.markov[k], []
    for limit in problem.data.times:
        near = full

        def loss(T: float) -> float:
            nonlocal near
            near = problem.best(times={g: T}, near=near)
            return near.value - full.value

        ends.append(end_of_time(loss, critical, full.times[k], _FIRST_TIME, limit))
    return ends[0], ends[1]


def _first_guess(problem: WhittleProblem, full: WhittleSolution, i: int) -> float:
    """A value of an absent coefficient that is surely not seen: a thousandth of what would fill the spectrum."""
    times = full.times
    return float(np.min(full.mean / problem.columns(times)[:, i])) * 1e-3


def _chosen(problem: WhittleProblem, full: WhittleSolution, supported: frozenset[int]) -> WhittleSolution:
    """The supported terms, and as many more as the spectrum needs though none of them is resolved by itself."""
    taken = set(supported)
    at = _only(problem, full, taken)
    while at.value - full.value > _NEEDED:
        rest = [i for i in range(len(problem.letters)) if i not in taken and _size(problem, full, i) > 0]
        if not rest:
            break
        tried = {i: _only(problem, full, taken | {i}) for i in rest}
        best = min(rest, key=lambda i: tried[i].value)
        taken.add(best)
        at = tried[best]
    return at


def _joined(
    problem: WhittleProblem,
    chosen: WhittleSolution,
    sets: Mapping[int, tuple[float, float]],
    confidence: float,
) -> dict[int, tuple[float, float]]:
    """The sets, each joined with that of the chosen terms where it leaves out their value."""
    n = len(problem.letters)
    values = {i: size for i in range(n) if (size := _size(problem, chosen, i)) > 0}
    places = list(values)
    fewer = replace(problem, letters=tuple(problem.letters[i] for i in places))
    times = {g: T for g, T in zip(problem.markov, chosen.times, strict=True) if g in values}
    alone = replace(chosen, c=chosen.c[places], times=tuple(times.values()))
    plain = chi_square_quantile(confidence, 1)

    def of_chosen(place: int) -> tuple[float, float]:
        if place >= n:
            return _time_set(fewer, alone, list(times).index(place - n), plain)
        if problem.letters[place] == "R":
            return _ramp_set(fewer, alone, ramp_point(fewer, alone, confidence))
        return _set(fewer, alone, places.index(place), plain, deviations(fewer, alone))

    return joined_sets(sets, values | {g + n: T for g, T in times.items()}, of_chosen)


def _only(problem: WhittleProblem, full: WhittleSolution, taken: set[int]) -> WhittleSolution:
    absent = {i: 0.0 for i, s in enumerate(problem.letters) if i not in taken and s != "R"}
    noise = [i for i, s in enumerate(problem.letters) if s != "R"]
    if all(i in absent for i in noise):
        return replace(full, value=math.inf)
    flat = "R" in problem.letters and problem.letters.index("R") not in taken
    return problem.best(fixed=absent, ramp=0.0 if flat else None, near=full)
