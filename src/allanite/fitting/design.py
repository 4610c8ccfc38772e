# SPDX-License-Identifier: BSD-3-Clause
"""The linear side of a fit: unit columns of every term, and the covariance of the curve as a quadratic form.

All in sample units (interval 1), with variance coefficients c = Q^2, N^2, B^2, K^2, R^2 and, for a Gauss-Markov
term of correlation time T, G = sigma^2:

    mean(c)       = sum_t c_t a_t,
    covariance(c) = sum_tu c_t c_u C_tu + c_R sum_t c_t D_t.

C and D depend only on the lags and the length of the record: they are computed once, then any covariance
matrix costs a few microseconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.noise import Flicker, GaussMarkov, Quantisation, Ramp, RandomWalk, TermType, White
from allanite.noise.allan.covariance import LagPairs, lag_pairs
from allanite.noise.power_law import PowerLaw

__all__ = [
    "LINEAR",
    "TIME_POWER",
    "CurveDesign",
    "design_of",
    "nearest_time",
    "power_law_symbol",
    "slow_symbol",
    "without_shortest",
]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]

#: Terms that enter linearly, as unit processes.
LINEAR: dict[str, TermType] = {
    "Q": Quantisation(Q=1.0),
    "N": White(N=1.0),
    "B": Flicker(B=1.0),
    "K": RandomWalk(K=1.0),
    "R": Ramp(R=1.0),
}
_POWER_LAW, _SLOW = "P", "H"  # of symbols that carry their shape
#: SI amplitude = amplitude in sample units * (sample interval)^power.
TIME_POWER = {"Q": 1.0, "N": 0.5, "B": 0.0, "G": 0.0, "K": -0.5, "R": -1.0}
#: Grid of correlation times on which covariances are computed: the covariance needs T to some percent only.
_TIMES_PER_OCTAVE = 2


def nearest_time(T: float) -> float:
    """The correlation time of the covariance grid nearest to T (samples)."""
    return float(2 ** (round(np.log2(T) * _TIMES_PER_OCTAVE) / _TIMES_PER_OCTAVE))


def power_law_symbol(slope: float) -> str:
    """The symbol of noise of density f^-slope."""
    return f"{_POWER_LAW}{slope!r}"


def slow_symbol(T: float) -> str:
    """The symbol of a Gauss-Markov term of this correlation time [samples], which stands in for a random walk.

    Its coefficient is the variance q^2 of its drive, as K^2 is that of the walk.
    """
    return f"{_SLOW}{T!r}"


def _unit(symbol: str) -> TermType | PowerLaw:
    if symbol in LINEAR:
        return LINEAR[symbol]
    shape = float(symbol[1:])
    return PowerLaw(slope=shape) if symbol[0] == _POWER_LAW else GaussMarkov(q=1.0, T=shape)


@dataclass(slots=True)
class CurveDesign:
    """Columns and covariance parts of one set of lags of one record.

    Attributes
    ----------
    lags : ndarray of int64, shape (n_lags,)
    n_samples : int
    sampling : "mean" or "point"
    """

    lags: NDArray[np.int64]
    n_samples: int
    sampling: str
    pairs: LagPairs
    _columns: dict[str, Array] = field(default_factory=dict)
    _cross: dict[str, Array] = field(default_factory=dict)
    _parts: dict[tuple[str, str], Array] = field(default_factory=dict)
    _slopes: dict[str, Array] = field(default_factory=dict)

    def column(self, symbol: str, T: float | None = None) -> Array:
        """AVAR of the unit process at the lags, shape (n_lags,)."""
        if symbol == "G":
            unit = GaussMarkov.from_sigma(1.0, _known(T))
            return unit.avar_sampled(self.lags.astype(np.float64), 1.0, self.sampling)
        if symbol not in self._columns:
            self._columns[symbol] = _unit(symbol).avar_sampled(
                self.lags.astype(np.float64), 1.0, self.sampling
            )
        return self._columns[symbol]

    def columns(self, symbols: Sequence[str], T: float | None = None) -> Array:
        """The columns of several symbols, shape (n_lags, n_symbols)."""
        return np.stack([self.column(s, T) for s in symbols], axis=1)

    def covariance(self, symbols: Sequence[str], c: Array, T: float | None = None) -> Array:
        """Covariance matrix of the curve for these coefficients, shape (n_lags, n_lags)."""
        time = None if T is None else nearest_time(T)
        total = np.zeros((len(self.lags),) * 2)
        ramp = c[symbols.index("R")] if "R" in symbols else 0.0
        active = [(s, v) for s, v in zip(symbols, c, strict=True) if v > 0 and s != "R"]
        for i, (s, a) in enumerate(active):
            for t, b in active[i:]:
                total += (1 if s == t else 2) * a * b * self._part(s, t, time)
            if ramp > 0:
                total += ramp * a * self._slope(s, time)
        return total

    def _key(self, symbol: str, time: float | None) -> str:
        return symbol if symbol != "G" else f"G{time!r}"

    def _r12(self, symbol: str, time: float | None) -> Array:
        key = self._key(symbol, time)
        if key not in self._cross:
            term = _unit(symbol) if symbol != "G" else GaussMarkov.from_sigma(1.0, _known(time))
            self._cross[key] = self.pairs.cross(term, self.sampling)
        return self._cross[key]

    def _part(self, s: str, t: str, time: float | None) -> Array:
        key = (self._key(s, time), self._key(t, time))
        if key not in self._parts:
            self._parts[key] = 2 * self.pairs.sum(self._r12(s, time) * self._r12(t, time))
            self._parts[key[::-1]] = self._parts[key]
        return self._parts[key]

    def _slope(self, s: str, time: float | None) -> Array:
        key = self._key(s, time)
        if key not in self._slopes:
            m = self.lags.astype(np.float64)
            self._slopes[key] = 2 * np.outer(m, m) * self.pairs.sum(self._r12(s, time))
        return self._slopes[key]


@dataclass(slots=True, kw_only=True)
class _Longer(CurveDesign):
    """A design less its `left_out` shortest lags, which computes nothing anew."""

    whole: CurveDesign
    left_out: int

    def column(self, symbol: str, T: float | None = None) -> Array:
        """As of the whole."""
        return self.whole.column(symbol, T)[self.left_out :]

    def covariance(self, symbols: Sequence[str], c: Array, T: float | None = None) -> Array:
        """As of the whole."""
        return self.whole.covariance(symbols, c, T)[self.left_out :, self.left_out :]


def without_shortest(design: CurveDesign, left_out: int) -> CurveDesign:
    """The design of the same record less so many of its shortest lags."""
    if not left_out:
        return design
    return _Longer(
        lags=design.lags[left_out:],
        n_samples=design.n_samples,
        sampling=design.sampling,
        pairs=design.pairs,
        whole=design,
        left_out=left_out,
    )


def _known(T: float | None) -> float:
    if T is None:
        raise ValueError("a Gauss-Markov column needs its correlation time")
    return T


def design_of(
    lags: NDArray[np.int64], n_samples: int, sampling: str, starts: Sequence[Spans] | None = None
) -> CurveDesign:
    """The design of a record; kept in memory for records without gaps, because channels and runs share it."""
    key = tuple(int(m) for m in lags)
    if starts is None:
        return _kept(key, n_samples, sampling)
    return CurveDesign(np.array(key), n_samples, sampling, lag_pairs(key, n_samples, starts))


@lru_cache(maxsize=8)
def _kept(lags: tuple[int, ...], n_samples: int, sampling: str) -> CurveDesign:
    return CurveDesign(np.array(lags), n_samples, sampling, lag_pairs(lags, n_samples))
