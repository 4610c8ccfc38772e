# SPDX-License-Identifier: BSD-3-Clause
"""Units that do not belong to the population, at a stated rate of false discoveries.

A unit lies d from what its lot and conditions let expect; its own uncertainty S, that of the expectation and the spread
of the units make that z = d / sqrt(S + V + tau_unit^2). The probability of a larger |z| is averaged over all scales
that the fleet allows. The spread is that of the narrow part: a unit of the wide part is what is looked for. Where half
of all |z| lie beyond 0.674, the wide part took too much of the narrow one, and z is scaled back.

A unit's smallest probability, adjusted for its coefficients [1], goes into the step-up procedure for all units [2]; the
coefficients of those that stand out are then told at the rate that is left [3].

References
----------
.. [1] R. Simes, "An improved Bonferroni procedure for multiple tests of significance", Biometrika 73 (1986) 751.
.. [2] Y. Benjamini, Y. Hochberg, "Controlling the false discovery rate", J. R. Stat. Soc. B 57 (1995) 289.
.. [3] Y. Benjamini, M. Bogomolov, "Selective inference on multiple families of hypotheses", J. R. Stat. Soc. B 76
   (2014) 297.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.stability.fleet.evidence import Design, Factors, Scales
from allanite.stability.fleet.posterior import Posterior

__all__ = ["RESOLVED", "Departures", "departures", "discoveries", "simes"]

Array = NDArray[np.float64]

#: Root of the loss at zero from which on a log resolves a coefficient.
RESOLVED = 1.96
_DRAWS = 32
_HALF = 0.674  # half of normal numbers lie within


@dataclass(frozen=True, slots=True)
class Departures:
    """How far the units of one coefficient lie off.

    Attributes
    ----------
    ratio : ndarray, shape (n_units,)
        Of the coefficient over what is expected; NaN where the unit gives a limit only.
    deviations : ndarray, shape (n_units,)
        z, at the most likely scales.
    p : ndarray, shape (n_units,)
        Two-sided probability.
    """

    ratio: Array
    deviations: Array
    p: Array


def departures(design: Design, posterior: Posterior) -> Departures:
    """Of all units, from what is expected of them."""
    from scipy.special import ndtr

    order = np.argsort(-posterior.weight)
    chosen = order[:_DRAWS] if np.ptp(posterior.weight) > 0 else order[:1]
    weight = posterior.weight[chosen] / posterior.weight[chosen].sum()
    factors = _factors(design, posterior)
    known = design.per_unit((design.profiles.root_at_zero < -RESOLVED).astype(float)) > 0
    d, variance = _apart(design, factors, posterior, 0)
    z = d / np.sqrt(variance)
    scale = max(1.0, float(np.median(np.abs(z[known]))) / _HALF) if known.any() else 1.0
    p = np.zeros(design.units)
    for i, w in zip(chosen, weight, strict=True):
        d_of_draw, variance = _apart(design, factors, posterior, int(i))
        p += w * 2 * ndtr(-np.abs(d_of_draw) / np.sqrt(variance) / scale)
    ratio = np.where(known, np.exp(np.clip(d, -50.0, 50.0)), np.nan)
    return Departures(ratio, z / scale, np.clip(p, 0.0, 1.0))


def _factors(design: Design, posterior: Posterior) -> Factors:
    """Of a log that resolves the coefficient, its best value: what it says beside an expectation far off is little."""
    best, met = Factors.near(design.profiles), _met(design, posterior)
    resolved = design.profiles.root_at_zero < -RESOLVED
    return Factors(*(np.where(resolved, getattr(best, n), getattr(met, n)) for n in ("k", "h", "t")))


def _met(design: Design, posterior: Posterior) -> Factors:
    """Factors with the loss and the slope of each log where it meets its expectation.

    So z^2 of a unit with one log is the least root^2 + (x - m)^2 / tau^2: zero for a limit far above the expectation,
    whose matched factor may have no precision, or less than none.
    """
    scales = posterior.scales[0]
    expected = design.covariates @ posterior.location[0] + posterior.lots[0][design.lot[design.unit]]
    variance = np.full(len(expected), max(scales.unit**2 + scales.repeat**2, 1e-12))
    x = design.profiles.nearest(expected, variance)
    loss = design.profiles.root(x) ** 2
    pull = (expected - x) / variance
    t = np.divide(pull**2, loss, out=np.zeros_like(loss), where=loss > 0)
    return Factors(np.zeros((1, len(x))), (t * x - pull)[None], t[None])


def _apart(design: Design, factors: Factors, posterior: Posterior, draw: int) -> tuple[Array, Array]:
    """Distance of each unit from its expectation, and the variance of that."""
    scales: Scales = posterior.scales[draw]
    t = factors.t[0] / (1.0 + factors.t[0] * scales.repeat**2)
    h = factors.h[0] / (1.0 + factors.t[0] * scales.repeat**2)
    z, root = design.covariates, posterior.root[draw]
    weight = np.maximum(design.per_unit(t), 1e-12)
    expected = z @ posterior.location[draw] + posterior.lots[draw][design.lot[design.unit]]
    d = design.per_unit(h - t * expected) / weight
    mean_z = design.per_unit(t[:, None] * z, 0) / weight[:, None]
    lean = mean_z - posterior.lot_lean[draw][design.lot]
    of_location = ((lean @ root) ** 2).sum(axis=1) + posterior.lot_sd[draw][design.lot] ** 2
    return d, 1.0 / weight + scales.unit**2 + of_location


def simes(p: Array) -> Array:
    """One probability for each row of several, NaN for none, shape (n,)."""
    ranked = np.sort(np.where(np.isnan(p), np.inf, p), axis=1)
    count = np.isfinite(ranked).sum(axis=1)
    with np.errstate(invalid="ignore"):
        adjusted = ranked * count[:, None] / np.arange(1, p.shape[1] + 1)
    return np.asarray(np.minimum(np.where(np.isfinite(ranked), adjusted, np.inf).min(axis=1), 1.0))


def discoveries(p: Sequence[float] | Array, rate: float) -> NDArray[np.bool_]:
    """Which of these the step-up procedure rejects."""
    values = np.asarray(p, dtype=float)
    order = np.argsort(values)
    passing = np.flatnonzero(values[order] <= rate * np.arange(1, len(values) + 1) / len(values))
    chosen = np.zeros(len(values), dtype=bool)
    if len(passing):
        chosen[order[: passing[-1] + 1]] = True
    return chosen
