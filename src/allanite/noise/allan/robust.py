# SPDX-License-Identifier: BSD-3-Clause
"""The robust Allan variance: an M-estimate that a few disturbed windows cannot carry away.

With d_i the second differences of the phase at lag m, scaled so that E d^2 = AVAR, the estimate s solves

    mean over i of psi(d_i^2/s) = a,    psi(u) = u (1 - u/c^2)^4 for u < c^2, else 0,       (1)

each square with the squared weight of Tukey's biweight [1, 2]. a = E psi(Z^2), Z standard normal, makes s consistent:
for Gaussian noise it estimates AVAR itself. Expanding psi(Z^2) in Hermite polynomials, h_q = E psi(Z^2) He_q(Z),

    var(s)/AVAR^2 = 1/(M^2 D^2) sum_k n_k sum_{q = 2, 4, ...} h_q^2/q! rho(k)^q,   D = E[Z^2 psi'(Z^2)] = h_2/2,  (2)

exact to first order in 1/edf: rho is the correlation of windows at distance k under the model (`covariance`). The
term q = 2 is the variance of OAVAR; c gives 80 % of its efficiency for independent windows. There the influence of a
single outlier is near its least: a smaller c bounds it no better and costs efficiency (the default in [2] is 60 %).

One disturbed sample enters 2 m windows: at lags where a large share of all windows is touched, no robust average helps,
and the sample is better marked as missing.

References
----------
.. [1] D. Mondal, D. Percival, "M-estimation of wavelet variance", Ann. Inst. Stat. Math. 64 (2012).
.. [2] S. Guerrier, R. Molinari, M.-P. Victoria-Feser, H. Xu, "Robust two-step wavelet-based inference for time
   series models", J. Am. Stat. Assoc. 117 (2022).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Ramp
from allanite.noise.allan.covariance import in_samples, lag_pairs
from allanite.noise.allan.statistics import STATISTICS, Phase, in_threads, processors, total_length

__all__ = ["CUTOFF", "Biweight", "biweight", "edf", "m_estimates"]

Array = NDArray[np.float64]
Lags = NDArray[np.int64]
Spans = NDArray[np.int64]

#: c of (1): 80 % efficiency for independent windows.
CUTOFF = 5.448855122649434
_MEDIAN = 0.454936423119572  # of the square of a standard normal variable
_SAMPLED = 20_001  # windows that the first guess looks at
_STEPS = 60
_TOLERANCE = 1e-12
_TERMS = 10  # of the Hermite series: what is left out is below 1e-12 of the sum


@dataclass(frozen=True, slots=True, kw_only=True)
class Biweight:
    """What (1) and (2) need of psi.

    Attributes
    ----------
    level : float
        a.
    slope : float
        D.
    series : ndarray, shape (n_terms,)
        h_q^2/q!, q = 2, 4, ...; its sum is the variance of psi(Z^2).
    """

    level: float
    slope: float
    series: Array

    @property
    def efficiency(self) -> float:
        """Of independent windows: the variance of their mean square over that of the estimate."""
        return 2 * self.slope**2 / float(self.series.sum())


@lru_cache(maxsize=8)
def biweight(cutoff: float = CUTOFF) -> Biweight:
    """The constants of a cutoff c, by Gauss-Legendre quadrature over |Z| < c."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    z = cutoff * nodes
    density = cutoff * weights * np.exp(-(z**2) / 2) / math.sqrt(2 * math.pi)
    u, t = z**2, 1 - nodes**2
    psi = u * t**4
    hermite = [np.ones_like(z), z]
    for q in range(1, 2 * _TERMS):
        hermite.append(z * hermite[-1] - q * hermite[-2])
    h = [float(density @ (psi * hermite[q])) for q in range(2, 2 * _TERMS + 1, 2)]
    series = [v**2 / math.factorial(q) for v, q in zip(h, range(2, 2 * _TERMS + 1, 2), strict=True)]
    return Biweight(level=float(density @ psi), slope=h[0] / 2, series=np.array(series))


# -- estimate -----------------------------------------------------------------------------------------------------


def m_estimates(
    phase: Phase,
    lags: Lags,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Array, Lags]:
    """Robust variance at each lag, in the channel's own unit squared, and the number of windows.

    Returns
    -------
    variance : ndarray, shape (n_lags,)
        NaN where no window is complete, and where (1) has no solution: fewer than about three independent windows,
        or so many disturbed ones that no scale fits half of them.
    count : ndarray of int64, shape (n_lags,)
    """
    variance, count = np.empty(len(lags)), np.empty(len(lags), dtype=np.int64)
    done = 0

    def task(i: int) -> None:
        nonlocal done
        m = int(lags[i])
        runs = phase.starts(STATISTICS["robust"], m)
        count[i] = total_length(runs)
        variance[i] = _m_estimate(phase.x, m, runs) / (2 * m**2) if count[i] else np.nan
        done += 1
        if progress is not None:
            progress(done / len(lags))

    in_threads(task, range(len(lags)), processors(threads))
    return variance, count


def _m_estimate(x: Array, m: int, runs: Spans) -> float:
    """The mean squared second difference by (1): Newton's steps in ln s from the median on."""
    constants, scale, windows = biweight(), _first_guess(x, m, runs), total_length(runs)
    if scale == 0:
        return 0.0
    for _ in range(_STEPS):
        psi, slope = (v / windows for v in _kernels.biweight_sums(x, m, runs, scale, CUTOFF**2))
        # Far below the root nearly all windows are cut off, and the mean rises with the scale: upwards then.
        step = (psi - constants.level) / slope if slope > 0.2 * psi else 0.5
        step = min(max(step, -1.0), 1.0)
        scale *= math.exp(step)
        if abs(step) < _TOLERANCE:
            return scale
    return math.nan


def _first_guess(x: Array, m: int, runs: Spans) -> float:
    """From the median of some windows' squares; from their mean where more than half of them are zero."""
    below = np.concatenate(([0], np.cumsum(runs[:, 1] - runs[:, 0])))
    chosen = np.unique(np.linspace(0, below[-1] - 1, min(int(below[-1]), _SAMPLED)).astype(np.int64))
    run = np.searchsorted(below, chosen, side="right") - 1
    i = runs[run, 0] + chosen - below[run]
    squares = ((x[i + 2 * m] - x[i + m]) - (x[i + m] - x[i])) ** 2
    middle = float(np.median(squares)) / _MEDIAN
    return middle if middle > 0 else float(np.mean(squares))


# -- degrees of freedom -------------------------------------------------------------------------------------------


def edf(
    model: NoiseModel,
    lags: Sequence[int] | Lags,
    n_samples: int,
    dt: float,
    sampling: str,
    starts: Sequence[Spans] | None = None,
) -> Array:
    """Equivalent degrees of freedom 2 AVAR^2/var(s) by (2) at each lag, shape (n_lags,).

    Parameters
    ----------
    starts : sequence of ndarray of int64, shape (n_runs, 2), optional
        Runs of complete windows of each lag where samples are missing.

    Raises
    ------
    InputError
        A model with a ramp: the windows have a mean, and (1) does not estimate AVAR.
    """
    if any(isinstance(t, Ramp) and t.R != 0 for t in model.terms):
        raise InputError(
            "the robust variance is not available for a ramp: use oadev, or remove the ramp first"
        )
    constants = biweight()
    powers = np.concatenate(([0.0], constants.series))
    out = np.empty(len(lags))
    for i, m in enumerate(lags):
        pairs = lag_pairs([int(m)], n_samples, None if starts is None else [starts[i]])
        r = np.zeros_like(pairs.distance)
        for term in (in_samples(t, dt) for t in model.terms):
            r = r + pairs.cross(term, sampling)
        squared: Array = np.minimum((r / model.avar_sampled(float(m), dt, sampling)) ** 2, 1.0)
        total = pairs.sum(np.asarray(np.polynomial.polynomial.polyval(squared, powers)))[0, 0]
        out[i] = 2 * constants.slope**2 / total if total > 0 else np.nan
    return out
