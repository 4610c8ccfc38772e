# SPDX-License-Identifier: BSD-3-Clause
"""The exact likelihood: all samples through the Kalman filter, and its maximum near that of the composite.

The constant level is a state of which nothing is known, a ramp a regressor: with the innovations v of samples, of ones
and of the ramp under one covariance recursion, generalised least squares gives both. Flicker stands there as its sum of
Gauss-Markov states, whose Allan variance is flat to 0.01 %.

The composite differs from the exact likelihood by little, and by a function that is smooth over the width of the
maximum. So the difference of the gradients is computed at the maximum, added to the composite as a linear term, and the
maximum of that sum found; twice or thrice until it stands. The same sum serves for the profiles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import LimitError
from allanite.filtering.kalman.contrasts import contrast_likelihood
from allanite.fitting.likelihood.maximum import LikelihoodSearch, Peak
from allanite.fitting.likelihood.objective import LikelihoodValue, Objective, Point
from allanite.noise import NoiseModel
from allanite.noise.parameters import louder

__all__ = ["MOST_SAMPLES", "exact_log_likelihood", "sharpened", "shifted"]

Array = NDArray[np.float64]

#: More samples would take hours.
MOST_SAMPLES = 4_000_000
_ROUNDS = 4
_STANDS = 1e-3  # standard deviations
_RATIO = math.sqrt(10)


def exact_log_likelihood(samples: Array, at: Point, sampling: str) -> float:
    """Logarithm of the density of the contrasts of samples (in units of the scale).

    Parameters
    ----------
    samples : ndarray, shape (n,)
        NaN where missing.
    at : Point
        With a slope in units of the scale, or None.
    """
    terms = tuple(louder(k.unit(), math.sqrt(c)) for k, c in zip(at.components, at.c, strict=True) if c > 0)
    space = NoiseModel(terms=terms).state_space(
        1.0, sampling=sampling, record=float(len(samples)), ratio=_RATIO
    )
    return contrast_likelihood(space, samples, slope=at.slope, averaged=at.averaged)


def sharpened(
    search: LikelihoodSearch, objective: Objective, peak: Peak, samples: Callable[[], Array], sampling: str
) -> Peak:
    """The exact maximum near that of the composite; its information is the composite's.

    Raises
    ------
    LimitError
        Too many samples.
    """
    n = objective.pyramid.present
    if n > MOST_SAMPLES:
        raise LimitError(
            f"{n} samples are too many for the exact engine (at most {MOST_SAMPLES}); use "
            "engine='composite', with almost no loss of precision"
        )
    y = samples() / objective.scale

    def exact(at: Point) -> float:
        slope = None if at.slope is None else at.slope / objective.scale
        return exact_log_likelihood(y, replace(at, slope=slope), sampling) - n_contrasts * math.log(
            objective.scale
        )

    n_contrasts = int(np.isfinite(y).sum()) - (2 if peak.at.averaged else 1)
    for _ in range(_ROUNDS):
        pull = _gradient(exact, peak) - peak.value.gradient
        moved = replace(search, evaluate=shifted(search.evaluate, peak, pull)).climb(peak.at)
        away = _distance(peak, moved)
        peak = moved
        if away < _STANDS:
            break
    return Peak(peak.at, replace(peak.value, log_likelihood=exact(peak.at)))


def shifted(
    evaluate: Callable[[Point], LikelihoodValue], at: Peak, pull: Array
) -> Callable[[Point], LikelihoodValue]:
    """The composite plus a linear function of coefficients and ln T; a term that is left out has none of it."""
    known, origin = _keys(at.at), _parameters(at.at)

    def sum_of_both(p: Point) -> LikelihoodValue:
        value, parameters = evaluate(p), dict(zip(_keys(p), _parameters(p), strict=True))
        away = (
            np.array([parameters.get(k, 0.0 if k[2] else o) for k, o in zip(known, origin, strict=True)])
            - origin
        )
        pulled = dict(zip(known, pull, strict=True))
        gradient = value.gradient + [pulled.get(k, 0.0) for k in parameters]
        return replace(value, log_likelihood=value.log_likelihood + float(pull @ away), gradient=gradient)

    return sum_of_both


def _keys(at: Point) -> list[tuple[str, int, bool]]:
    """Names of the parameters: the letter, which of that letter, and whether it is the coefficient or ln T."""
    letters = [k.symbol for k in at.components]
    which = [(s, letters[:i].count(s)) for i, s in enumerate(letters)]
    timed = [w for w, k in zip(which, at.components, strict=True) if k.T is not None]
    return [*((*w, True) for w in which), *((*w, False) for w in timed)]


def _parameters(at: Point) -> Array:
    return np.array([*at.c, *(math.log(k.T) for k in at.components if k.T is not None)])


def _at(start: Point, parameters: Array) -> Point:
    n = len(start.c)
    times = iter(np.exp(parameters[n:]))
    components = tuple(k if k.T is None else replace(k, T=float(next(times))) for k in start.components)
    return replace(start, components=components, c=parameters[:n].copy())


def _gradient(exact: Callable[[Point], float], peak: Peak) -> Array:
    """Differences over a tenth of a standard deviation; forward for what stands at zero."""
    here = _parameters(peak.at)
    information = np.diag(peak.value.information)
    slopes = np.zeros(len(here))
    n = len(peak.at.c)
    for i in range(len(here)):
        if not information[i] > 0:
            continue
        step = 0.1 / math.sqrt(information[i])
        if i < n and peak.at.c[i] > 0:
            step = min(step, peak.at.c[i] / 2)
        low = here.copy()
        if i >= n or here[i] >= step:
            low[i] -= step
        high = here.copy()
        high[i] += step
        slopes[i] = (exact(_at(peak.at, high)) - exact(_at(peak.at, low))) / (high[i] - low[i])
    return slopes


def _distance(a: Peak, b: Peak) -> float:
    """In standard deviations."""
    d = _parameters(a.at) - _parameters(b.at)
    return math.sqrt(max(float(d @ a.value.information @ d), 0.0))
