# SPDX-License-Identifier: BSD-3-Clause
"""The published reading rules of the tools of the Robot Operating System, as functions of one record.

Written anew from what the programs do, one axis at a time; their own code is C++ and MATLAB, and only their rules are
compared here, not their speed. Where a program leaves a conversion to its user, the user of this table knows it: a
"bias instability" that is the minimum of the curve is divided by 0.664 to be compared with B.

References
----------
.. [1] allan_variance_ros 1d54b60 (ori-drs): bins of 0.1 to 999.9 s without overlap; lines of fixed slope.
.. [2] imu_utils 2cdda91 (gaowenliang) and its corrected fork afd5cae (mintar): sum of five terms through the curve.
.. [3] kalibr_allan 9d38ea9 (rpng): mean intercepts left and right of the minimum.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.noise import FLICKER_FLOOR

__all__ = ["allan_variance_ros", "imu_utils", "kalibr_allan"]

Array = NDArray[np.float64]


def allan_variance_ros(y: Array, rate: float) -> dict[str, float]:
    """N, B, K and T_b by the rule of [1].

    N is the line of slope -1/2 through all bins below 10 s, at 1 s; K the line of slope +1/2 through *all* bins, at
    3 s; B the minimum of the curve and T_b its place.
    """
    tau = 0.1 * np.arange(1, 10_000, dtype=np.float64)
    bins = np.maximum((tau * rate).astype(np.int64), 1)
    sigma = _bin_deviation(y, bins)
    ok = np.isfinite(sigma) & (sigma > 0)
    tau, sigma = tau[ok], sigma[ok]
    lowest = int(np.argmin(sigma))
    early = tau < 10.0 - 1e-9
    return {
        "N": _line(tau[early], sigma[early], -0.5, 1.0),
        "B": float(sigma[lowest]) / FLICKER_FLOOR,
        "K": _line(tau, sigma, 0.5, 3.0),
        "T": float(tau[lowest]),
    }


def _line(tau: Array, sigma: Array, slope: float, at: float) -> float:
    """Least squares in logarithms, the slope held within 0.001 of the wanted one."""
    x, y = np.log(tau), np.log(sigma)
    free = float(np.cov(x, y, bias=True)[0, 1] / np.var(x))
    held = min(max(free, slope), slope + 0.001)
    return math.exp(float(np.mean(y - held * x)) + held * math.log(at))


def kalibr_allan(axes: Array, rate: float) -> dict[str, float]:
    """N and K by the rule of [3]: mean intercepts of slope -1/2 and +1/2, from fifty lags off the minimum on.

    The curve is the mean of three axes, shape (3, n): the only rule here that sees all of them. Its 2000 lags begin
    at the square of the sample interval; those below one sample are empty.
    """
    longest = math.floor((axes.shape[1] - 1) / 2)
    lags = np.floor(np.geomspace(1 / rate, longest, 2000)).astype(np.int64)
    lags = lags[lags >= 1]
    each, back = np.unique(lags, return_inverse=True)
    sigma = np.mean([_bin_deviation(y, each) for y in axes], axis=0)[back]
    tau = lags / rate
    lowest = int(np.nanargmin(sigma))
    return {
        "N": _mean_intercept(tau[: max(lowest - 49, 0)], sigma[: max(lowest - 49, 0)], -0.5),
        "K": _mean_intercept(tau[lowest + 50 :], sigma[lowest + 50 :], 0.5) * math.sqrt(3.0),
    }


def _mean_intercept(tau: Array, sigma: Array, slope: float) -> float:
    """NaN where no lag is left on that side."""
    ok = np.isfinite(sigma) & (sigma > 0)
    if not ok.any():
        return math.nan
    return math.exp(float(np.mean(np.log(sigma[ok]) - slope * np.log(tau[ok]))))


def imu_utils(y: Array, rate: float) -> dict[str, float]:
    """N, B and K by the corrected fork of [2]: squares of the logarithms of measured over modelled variance.

    Five terms Q, N, B, K, R, every lag with the same weight, at most 1000 steps from a linear fit of the deviation.
    """
    from scipy.optimize import least_squares

    n = len(y)
    longest = 1 << (max(n // 2, 1).bit_length() - 1)
    lags = np.unique(np.ceil(np.geomspace(1, longest, 100) - 1e-9).astype(np.int64))
    tau, variance = lags / rate, _overlapping_variance(y, lags)
    keep = _falling_below_one_second(tau, variance)
    tau, variance = tau[keep], variance[keep]
    scale = math.sqrt(float(variance.min()))  # the program works in deg/h, where a deviation is near one
    powers = tau[:, None] ** np.arange(-2.0, 3.0)
    start = np.linalg.lstsq(np.sqrt(powers), np.sqrt(variance) / scale, rcond=None)[0]

    def misfit(p: Array) -> Array:
        return np.asarray(np.log10(powers @ p**2) - np.log10(variance / scale**2))

    def slope(p: Array) -> Array:
        return np.asarray(powers * 2 * p / (powers @ p**2)[:, None] / math.log(10))

    p = scale * np.abs(least_squares(misfit, np.abs(start), slope, method="lm", max_nfev=1000).x)
    return {"N": float(p[1]), "B": float(p[2]) / FLICKER_FLOOR, "K": float(p[3]) * math.sqrt(3.0)}


def _falling_below_one_second(tau: Array, variance: Array) -> NDArray[np.bool_]:
    """Below 1 s the program drops each point that rises above all dropped before; the first one always."""
    keep, highest = np.ones(len(tau), dtype=bool), 0.0
    for i in np.flatnonzero(tau < 1):
        if variance[i] > highest:
            highest, keep[i] = float(variance[i]), False
    return keep


def _overlapping_variance(y: Array, lags: NDArray[np.int64]) -> Array:
    x = np.cumsum(y - y.mean())
    return np.array(
        [float(np.mean((x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]) ** 2)) / (2 * m * m) for m in lags]
    )


def _bin_deviation(y: Array, bins: NDArray[np.int64]) -> Array:
    """Allan deviation without overlap of bins of so many samples; NaN where there are fewer than two."""
    x = np.concatenate([[0.0], np.cumsum(y - y.mean())])
    sigma = np.full(len(bins), np.nan)
    for i, m in enumerate(bins.tolist()):
        steps = np.diff(x[::m], 2)
        if len(steps):
            sigma[i] = math.sqrt(float(np.mean(steps * steps)) / 2) / m
    return sigma
