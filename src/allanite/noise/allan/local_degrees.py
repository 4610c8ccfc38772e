# SPDX-License-Identifier: BSD-3-Clause
"""Degrees of freedom of a curve on its own: at each lag, those of the power law that it follows there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, NoiseModel, Quantisation, RandomWalk, TermType, White
from allanite.noise.allan import covariance, degrees, robust, theo_covariance
from allanite.noise.allan.statistics import Statistic

__all__ = ["Degrees", "RecordOfCurve", "degrees_by_local_law", "degrees_under"]

Array = NDArray[np.float64]
Lags = NDArray[np.int64]
Spans = NDArray[np.int64]

#: Local slope of AVAR -> power of frequency of the rate density, and the term that has it.
_ALPHA = {-2: 2, -1: 0, 0: -1, 1: -2}
_TERM: dict[int, TermType] = {
    -2: Quantisation(Q=1.0),
    -1: White(N=1.0),
    0: Flicker(B=1.0),
    1: RandomWalk(K=1.0),
}
#: The published edf of the total deviation is that of long lags. At short ones it falls as that of oadev does, by
#: m^2/(m^2 + this): 5/4 for white noise [SP 1065, table 5]; for flicker and random walk by simulation.
_SHORT = {-2: 1.25, -1: 1.25, 0: 0.4, 1: 0.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordOfCurve:
    """What the degrees of freedom of one channel's curve depend on, beside its noise.

    Attributes
    ----------
    statistic : Statistic
    lags : ndarray of int64, shape (n_lags,)
    count : ndarray of int64, shape (n_lags,)
        Terms in the sum.
    n_samples : int
    sampling : str
        "mean" or "point".
    starts : sequence of ndarray of int64, shape (n_runs, 2), or None
        Runs of complete windows of each lag where samples are missing.
    """

    statistic: Statistic
    lags: Lags
    count: Lags
    n_samples: int
    sampling: str
    starts: Sequence[Spans] | None

    def at(self, j: int) -> tuple[Statistic, int, list[Spans] | None]:
        """The statistic at one lag, the lag, and its runs of complete windows."""
        m = int(self.lags[j])
        here = None if self.starts is None else [self.starts[j]]
        return self.statistic.at(m, self.n_samples), m, here

    def share(self, j: int) -> float:
        """Of the windows at one lag, those that are complete."""
        part, m, _ = self.at(j)
        whole = (self.n_samples + 1 - part.window(m)) / (1 if part.overlapping else m)
        return min(1.0, float(self.count[j]) / max(whole, 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Degrees:
    """Law of the variance at each lag.

    Attributes
    ----------
    edf : ndarray, shape (n_lags,)
        Equivalent degrees of freedom; NaN where there is no estimate.
    shape : ndarray, shape (n_lags,)
        Degrees of freedom of the chi-square law of the same skewness (`degrees.shifted_factors`).
    """

    edf: Array
    shape: Array


def degrees_by_local_law(record: RecordOfCurve, variance: Array) -> Degrees:
    """Degrees of freedom from the power law that the curve follows at each lag."""
    lags = record.lags
    law = degrees.local_power_law(record.statistic.averaging(lags, record.n_samples), variance, record.count)
    out = np.full((len(lags), 2), np.nan)
    grid, x = _thinned(len(lags)), np.log(lags.astype(np.float64))
    for mu in np.unique(law):
        part = np.array([_of_law(record, int(mu), int(j)) for j in grid])
        ok = np.isfinite(part[:, 0]) & (part[:, 0] > 0)
        if ok.any():
            here = law == mu
            for column in (0, 1):
                out[here, column] = np.exp(np.interp(x[here], x[grid[ok]], np.log(part[ok, column])))
    out[(record.count == 0) | ~np.isfinite(variance)] = np.nan
    return Degrees(edf=out[:, 0], shape=out[:, 1])


def degrees_under(record: RecordOfCurve, model: NoiseModel, dt: float) -> Degrees:
    """Degrees of freedom under a model at each lag: oadev, haar, robust and the forms of Theo1.

    Exact for oadev and haar, to 1 % for theo1, to first order in their inverse for robust and TheoBR.
    """
    out = np.full((len(record.lags), 2), np.nan)
    for j in np.flatnonzero(record.count > 0):
        out[j] = _of_model(record, model, int(j), dt)
    return Degrees(edf=out[:, 0], shape=out[:, 1])


def _thinned(n: int, most: int = 150) -> Lags:
    """Positions at which degrees of freedom are computed; a smooth function of lag is interpolated between."""
    if n <= most:
        return np.arange(n)
    return np.unique(np.concatenate((np.round(np.geomspace(1, n, most)) - 1, np.arange(n - 10, n)))).astype(
        np.int64
    )


def _of_law(record: RecordOfCurve, mu: int, j: int) -> tuple[float, float]:
    part, m, _ = record.at(j)
    if record.count[j] == 0:
        return float("nan"), float("nan")
    if part.has_exact_degrees:
        return _of_model(record, NoiseModel.of(_TERM[mu]), j, 1.0)
    n = record.n_samples
    if part.total:
        edf = degrees.edf_total(_ALPHA[mu], n, m) * m**2 / (m**2 + _SHORT[mu])
        return edf, edf
    full = degrees.edf_greenhall(
        _ALPHA[mu], part.order, m, n + 1, overlapping=part.overlapping, modified=part.modified
    )
    edf = full if record.starts is None else max(1.0, full * record.share(j))
    return edf, edf


def _of_model(record: RecordOfCurve, model: NoiseModel, j: int, dt: float) -> tuple[float, float]:
    part, m, here = record.at(j)
    of = (model, [m], record.n_samples, dt, record.sampling)
    if not part.theo:
        way = robust.edf if part.robust else covariance.edf
        edf = float(way(*of, here)[0])
        return edf, edf
    if part.unbiased:
        edf = float(theo_covariance.edf_theobr(*of)[0])
        edf = edf if here is None else max(1.0, edf * record.share(j))
    else:
        edf = float(theo_covariance.edf_theo1(*of, here)[0])
    return edf, edf * float(theo_covariance.shapes(*of)[0])
