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

import math
import threading
from collections.abc import Sequence
from dataclasses import field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, GaussMarkov, Quantisation, Ramp, RandomWalk, TermType, White
from allanite.noise.allan.covariance import LagPairs, lag_pairs
from allanite.noise.power_law import PowerLaw
from allanite.noise.quick_terms import QUICK

__all__ = [
    "LINEAR",
    "MARKOV",
    "SHORTEST_TIME",
    "TIME_OF",
    "TIME_POWER",
    "CurveDesign",
    "Times",
    "design_of",
    "power_law_symbol",
    "slow_symbol",
    "without_shortest",
]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]
Times = tuple[float, ...]  # correlation times [samples] of the terms of MARKOV, in their order

#: Terms that enter linearly, as unit processes.
LINEAR: dict[str, TermType] = {
    "Q": Quantisation(Q=1.0),
    "N": White(N=1.0),
    "B": Flicker(B=1.0),
    "K": RandomWalk(K=1.0),
    "R": Ramp(R=1.0),
}
#: Gauss-Markov terms whose correlation times are given beside the symbols.
MARKOV = ("G", "G2")
#: Shortest correlation time [samples] that is tried at first: a bias that forgets itself earlier is a matter of the
#: sensor's bandwidth.
SHORTEST_TIME = QUICK
#: Their correlation times as parameters.
TIME_OF = {"G": "T", "G2": "T_2"}
_POWER_LAW, _SLOW = "P", "H"  # of symbols that carry their shape
#: SI amplitude = amplitude in sample units * (sample interval)^power.
TIME_POWER = {"Q": 1.0, "N": 0.5, "B": 0.0, "G": 0.0, "G2": 0.0, "K": -0.5, "R": -1.0}
#: Channels that are fitted at the same time share a design: none makes what another one is making.
_ONE_AT_A_TIME = threading.Lock()
#: Grid of correlation times on which covariances are computed: the covariance needs T to some percent only.
_TIMES_PER_OCTAVE = 2
#: Spacing in ln T of the columns between which others are interpolated: within 3e-8 of them.
_NODES = 1 / 32


def power_law_symbol(slope: float) -> str:
    """The symbol of noise of density f^-slope."""
    return f"{_POWER_LAW}{slope!r}"


def slow_symbol(T: float) -> str:
    """The symbol of a Gauss-Markov term of this correlation time [samples], which stands in for a random walk.

    Its coefficient is the variance q^2 of its drive, as K^2 is that of the walk.
    """
    return f"{_SLOW}{T!r}"


def _unit(symbol: str) -> TermType | PowerLaw:
    """The unit process of a symbol that names it whole."""
    if symbol in LINEAR:
        return LINEAR[symbol]
    kind, shape = symbol[0], float(symbol[1:])
    if kind == _POWER_LAW:
        return PowerLaw(slope=shape)
    return GaussMarkov(q=1.0, T=shape) if kind == _SLOW else GaussMarkov.from_sigma(1.0, shape)


def _processes(symbol: str, times: Times) -> list[tuple[str, float]]:
    """The processes whose covariance is that of a term, with their shares.

    Of a free correlation time the two nearest of the grid, so that the covariance moves smoothly with it.
    """
    if symbol not in MARKOV:
        return [(symbol, 1.0)]
    place = math.log2(times[MARKOV.index(symbol)]) * _TIMES_PER_OCTAVE
    share = place % 1
    shares = ((math.floor(place), 1 - share), (math.floor(place) + 1, share))
    return [(f"G{2 ** (k / _TIMES_PER_OCTAVE)!r}", part) for k, part in shares if part > 0]


def _cubic(t: float) -> Array:
    """Weights of the values at 0, 1, 2 and 3 in the cubic through them, at t, and those in its slope there."""
    a, b, c, d = t, t - 1, t - 2, t - 3
    return np.array(
        [
            [-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6],
            [
                -(c * d + b * d + b * c) / 6,
                (c * d + a * d + a * c) / 2,
                -(b * d + a * d + a * b) / 2,
                (b * c + a * c + a * b) / 6,
            ],
        ]
    )


@dataclass(slots=True)
class CurveDesign:
    """Columns and covariance parts of one set of lags of one record.

    Attributes
    ----------
    lags : ndarray of int64, shape (n_lags,)
    n_samples : int
    sampling : "mean" or "point"
    kind : tuple or None
        Equal for designs that are equal in all; None where samples are missing.
    """

    lags: NDArray[np.int64]
    n_samples: int
    sampling: str
    pairs: LagPairs
    kind: tuple[object, ...] | None = None
    _columns: dict[str, Array] = field(default_factory=dict)
    _nodes: dict[int, Array] = field(default_factory=dict)
    _around: dict[int, Array] = field(default_factory=dict)  # four nodes, by the first of them
    _cross: dict[str, Array] = field(default_factory=dict)
    _parts: dict[tuple[str, str], Array] = field(default_factory=dict)
    _slopes: dict[str, Array] = field(default_factory=dict)

    def column(self, symbol: str, times: Times = ()) -> Array:
        """AVAR of the unit process at the lags, shape (n_lags,)."""
        if symbol in MARKOV:
            return self.markov(times[MARKOV.index(symbol)])[0]
        if symbol not in self._columns:
            self._columns[symbol] = _unit(symbol).avar_sampled(
                self.lags.astype(np.float64), 1.0, self.sampling
            )
        return self._columns[symbol]

    def markov(self, T: float) -> tuple[Array, Array]:
        """AVAR of unit Gauss-Markov noise at the lags, and its derivative by ln T, each of shape (n_lags,).

        Cubic between four columns that are kept: a search evaluates both at hundreds of times.
        """
        place = math.log(T) / _NODES
        first = math.floor(place) - 1
        if first not in self._around:
            self._around[first] = np.stack([self._node(first + i) for i in range(4)])
        value, slope = _cubic(place - first) @ self._around[first]
        return value, slope / _NODES

    def _node(self, i: int) -> Array:
        if i not in self._nodes:
            unit = GaussMarkov.from_sigma(1.0, math.exp(i * _NODES))
            self._nodes[i] = unit.avar_sampled(self.lags.astype(np.float64), 1.0, self.sampling)
        return self._nodes[i]

    def columns(self, symbols: Sequence[str], times: Times = ()) -> Array:
        """The columns of several symbols, shape (n_lags, n_symbols)."""
        # of arrays of one length np.array makes one in a fifth of the time of np.stack
        return np.ascontiguousarray(np.array([self.column(s, times) for s in symbols]).T)

    def covariance(self, symbols: Sequence[str], c: Array, times: Times = ()) -> Array:
        """Covariance matrix of the curve for these coefficients, shape (n_lags, n_lags)."""
        total = np.zeros((len(self.lags),) * 2)
        ramp = c[symbols.index("R")] if "R" in symbols else 0.0
        active = [
            (process, value * share)
            for s, value in zip(symbols, c, strict=True)
            if value > 0 and s != "R"
            for process, share in _processes(s, times)
        ]
        for i, (s, a) in enumerate(active):
            for j, (t, b) in enumerate(active[i:]):
                total += (2 if j else 1) * a * b * self._part(s, t)
            if ramp > 0:
                total += ramp * a * self._slope(s)
        return total

    def relative_covariances(
        self, symbols: Sequence[str], c: Array, times: Times, mean: Array
    ) -> list[Array]:
        """Covariance over the products of the means, a block for each independent record; here there is one.

        Parameters
        ----------
        mean : ndarray, shape (n_lags,)
            That of these coefficients.
        """
        return [self.covariance(symbols, c, times) / (mean[:, None] * mean)]

    def expect_power_laws(self, slopes: Sequence[float]) -> None:
        """Compute what the covariances of several power laws need, in one pass: they share their logarithms."""
        with _ONE_AT_A_TIME:
            new = [slope for slope in slopes if power_law_symbol(slope) not in self._cross]
            self._cross |= zip(map(power_law_symbol, new), self.pairs.power_laws(new), strict=True)

    def _r12(self, process: str) -> Array:
        if process not in self._cross:
            self._cross[process] = self.pairs.cross(_unit(process), self.sampling)
        return self._cross[process]

    def _part(self, s: str, t: str) -> Array:
        if (s, t) not in self._parts:
            self._parts[s, t] = self._parts[t, s] = 2 * self.pairs.sum(self._r12(s) * self._r12(t))
        return self._parts[s, t]

    def _slope(self, s: str) -> Array:
        if s not in self._slopes:
            m = self.lags.astype(np.float64)
            self._slopes[s] = 2 * np.outer(m, m) * self.pairs.sum(self._r12(s))
        return self._slopes[s]


@dataclass(slots=True, kw_only=True)
class _Longer(CurveDesign):
    """A design less its `left_out` shortest lags, which computes nothing anew."""

    whole: CurveDesign
    left_out: int

    def column(self, symbol: str, times: Times = ()) -> Array:
        """As of the whole."""
        return self.whole.column(symbol, times)[self.left_out :]

    def markov(self, T: float) -> tuple[Array, Array]:
        """As of the whole."""
        column, slope = self.whole.markov(T)
        return column[self.left_out :], slope[self.left_out :]

    def covariance(self, symbols: Sequence[str], c: Array, times: Times = ()) -> Array:
        """As of the whole."""
        return self.whole.covariance(symbols, c, times)[self.left_out :, self.left_out :]

    def expect_power_laws(self, slopes: Sequence[float]) -> None:
        """As of the whole."""
        self.whole.expect_power_laws(slopes)


def without_shortest(design: CurveDesign, left_out: int) -> CurveDesign:
    """The design of the same record less so many of its shortest lags."""
    if not left_out:
        return design
    return _Longer(
        lags=design.lags[left_out:],
        n_samples=design.n_samples,
        sampling=design.sampling,
        pairs=design.pairs,
        kind=None if design.kind is None else (*design.kind, left_out),
        whole=design,
        left_out=left_out,
    )


def design_of(
    lags: NDArray[np.int64], n_samples: int, sampling: str, starts: Sequence[Spans] | None = None
) -> CurveDesign:
    """The design of a record; kept in memory for records without gaps, because channels and runs share it."""
    key = tuple(int(m) for m in lags)
    if starts is None:
        with _ONE_AT_A_TIME:
            return _kept(key, n_samples, sampling)
    return CurveDesign(np.array(key), n_samples, sampling, lag_pairs(key, n_samples, starts))


@lru_cache(maxsize=8)
def _kept(lags: tuple[int, ...], n_samples: int, sampling: str) -> CurveDesign:
    kind = (lags, n_samples, sampling)
    return CurveDesign(np.array(lags), n_samples, sampling, lag_pairs(lags, n_samples), kind)
