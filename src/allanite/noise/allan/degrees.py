# SPDX-License-Identifier: BSD-3-Clause
"""Degrees of freedom and intervals of a curve on its own, from the power law it follows locally.

A curve alone does not know its noise; its local slope tells the power law nearest to it. For the overlapping
Allan deviation the degrees of freedom of that law are exact for sampled noise (`covariance.edf`); the other
statistics use the combined algorithm of Greenhall and Riley [1], as Stable32 does. `AllanCurve.with_model`
replaces all this by the fitted model.

References
----------
.. [1] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
.. [2] W. Riley, NIST SP 1065 (2008), section 5.4 and table 5.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.quantities.distributions import chi_square_quantiles
from allanite.quantities.probabilities import require_probabilities

__all__ = ["chi_square_factors", "edf_greenhall", "edf_total", "local_power_law", "shifted_factors"]

Array = NDArray[np.float64]

_DIRECT = 100  # terms of a sum taken one by one [1, J_max]; longer sums become integrals


def chi_square_factors(edf: Array, confidence: float) -> tuple[Array, Array]:
    """Factors on the deviation that give its equal-tailed interval: sqrt(edf/quantile).

    Parameters
    ----------
    edf : ndarray
        Positive; NaN gives NaN.
    confidence : float
        Between 0 and 1.

    Raises
    ------
    InputError
        A confidence outside (0, 1).
    DataQualityError
        Degrees of freedom that are zero or negative.
    """
    require_probabilities(confidence=confidence)
    edf = np.asarray(edf, dtype=np.float64)
    if np.any(edf <= 0):
        raise DataQualityError(
            f"an estimate has {edf[edf <= 0].ravel()[0]:g} degrees of freedom: "
            "the lag is too long for the record; shorten it"
        )
    tail = (1 - confidence) / 2
    with np.errstate(invalid="ignore"):
        low = np.sqrt(edf / chi_square_quantiles(tail, edf, upper=True))
        high = np.sqrt(edf / chi_square_quantiles(tail, edf))
    return low, high


def shifted_factors(edf: Array, shape: Array, confidence: float) -> tuple[Array, Array]:
    """As `chi_square_factors`, for a variance whose skewness is that of a chi-square law of `shape` degrees of freedom.

    Over its mean the variance is taken as 1 + (X - shape)/sqrt(edf shape), X chi-square of `shape` degrees of freedom:
    its first three moments are right (Imhof, Biometrika 48, 1961). shape = edf is the chi-square law.
    """
    tail = (1 - confidence) / 2
    with np.errstate(invalid="ignore"):
        low, high = (
            1 / np.sqrt(1 + (chi_square_quantiles(tail, shape, upper=upper) - shape) / np.sqrt(edf * shape))
            for upper in (True, False)
        )
    return low, high


def local_power_law(
    lags: NDArray[np.int64] | Array, variance: Array, count: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The exponent mu in {-2, -1, 0, 1} of AVAR ~ tau^mu nearest to the curve at each lag.

    The slope is taken over a factor of about four in lag, where at least 30 independent windows stand behind it;
    longer lags keep the last trusted value, because their own slope is noise.
    """
    ok = np.isfinite(variance) & (variance > 0)
    if ok.sum() < 2:
        return np.full(len(lags), -1)
    x, y = np.log(lags[ok].astype(np.float64)), np.log(variance[ok])
    slope = np.empty(ok.sum())
    for i in range(len(x)):
        near = np.abs(x - x[i]) <= math.log(2.0) + 1e-9
        if near.sum() < 2:
            near = np.argsort(np.abs(x - x[i]))[:2]
        slope[i] = np.polyfit(x[near], y[near], 1)[0]
    windows = count[ok] / lags[ok] / 2
    trusted = windows >= 15
    if not trusted.any():
        trusted[0] = True
    keep = np.maximum.accumulate(np.where(trusted, np.arange(len(x)), 0))
    out = np.full(len(lags), -1)
    out[ok] = np.clip(np.round(slope[keep]), -2, 1).astype(np.int64)
    return out


def edf_total(alpha: int, n_samples: int, m: int) -> float:
    """Degrees of freedom of the total deviation: b n/m - c [2, table 7], alpha = 0, -1, -2."""
    b, c = {0: (1.50, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}[max(min(alpha, 0), -2)]
    return b * n_samples / m - c


def edf_greenhall(
    alpha: int, order: int, m: int, n_points: int, *, overlapping: bool, modified: bool
) -> float:
    """Degrees of freedom by the combined algorithm of [1].

    Parameters
    ----------
    alpha : int
        Power of frequency in the rate density: 2 (quantisation), 1, 0 (white), -1 (flicker), -2 (random walk).
    order : int
        2 for Allan, 3 for Hadamard.
    m : int
        Lag in samples.
    n_points : int
        Phase points: samples + 1.
    overlapping, modified : bool

    Raises
    ------
    DataQualityError
        The lag leaves no term.
    """
    filter_ = 1 if modified else m
    stride = m if overlapping else 1
    length = m // filter_ + m * order
    if n_points < length:
        raise DataQualityError(
            f"lag of {m} samples: the record of {n_points - 1} samples has no complete window"
        )
    terms = 1 + stride * (n_points - length) // m
    reach = min(terms, (order + 1) * stride)
    ratio = terms / stride
    F: float = filter_
    if not modified and alpha <= 0 and m * (order + 1) > _DIRECT:
        F = math.inf
    if reach <= _DIRECT or alpha > 0:
        return float(
            _sz(0.0, F, alpha, order) ** 2 * terms / _basic_sum(reach, terms, stride, F, alpha, order)
        )
    if ratio >= order + 1:  # the sums become integrals over the span of the covariance
        a0, a1 = _integrals(F, alpha, order)
        return ratio / (a0 - a1 / ratio)
    coarse = _DIRECT / ratio  # a grid of _DIRECT positions over the same span stands for the finer one
    F = 1.0 if modified else math.inf
    return float(
        _sz(0.0, F, alpha, order) ** 2 * _DIRECT / _basic_sum(_DIRECT, _DIRECT, coarse, F, alpha, order)
    )


@lru_cache(maxsize=64)
def _integrals(F: float, alpha: int, order: int) -> tuple[float, float]:
    """2 int rho^2 dt and 2 int t rho^2 dt over 0 to order + 1, rho = sz(t)/sz(0): a0 and a1 of [1, eq. 8]."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = np.linspace(0, order + 1, 64 * (order + 1) + 1)  # the function breaks at whole numbers
    half = np.diff(edges)[:, None] / 2
    t = edges[:-1, None] + half * (1 + nodes)
    rho2 = (_sz(t, F, alpha, order) / _sz(0.0, F, alpha, order)) ** 2
    return float(2 * np.sum(half * weights * rho2)), float(2 * np.sum(half * weights * t * rho2))


def _sw(t: Array, alpha: int) -> Array:
    """Generalised autocovariance of the phase's generating process, up to a constant factor [1, table]."""
    t = np.abs(t)
    log = np.log(np.where(t == 0, 1.0, t))
    return {2: -t, 1: t**2 * log, 0: t**3, -1: -(t**4) * log, -2: -(t**5), -3: t**6 * log, -4: t**7}[alpha]


def _sx(t: Array, F: float, alpha: int) -> Array:
    if math.isinf(F):
        return _sw(t, alpha + 2)
    return F**2 * (2 * _sw(t, alpha) - _sw(t - 1 / F, alpha) - _sw(t + 1 / F, alpha))


def _sz(t: Array | float, F: float, alpha: int, order: int) -> Array:
    t = np.asarray(t, dtype=np.float64)
    total = np.zeros_like(t)
    for k in range(-order, order + 1):
        total = total + (-1) ** k * math.comb(2 * order, order + k) * _sx(t + k, F, alpha)
    return total


def _basic_sum(reach: int, terms: float, stride: float, F: float, alpha: int, order: int) -> float:
    j = np.arange(reach + 1)
    z2 = _sz(j / stride, F, alpha, order) ** 2
    weight = 2 * (1 - j / terms)
    weight[0] = 1.0
    weight[-1] = 1 - reach / terms
    return float(np.dot(weight, z2))
