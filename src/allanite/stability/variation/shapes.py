# SPDX-License-Identifier: BSD-3-Clause
"""How one term of the noise may change: it steps at a time, or drifts over the whole record.

A term's amplitude becomes exp(beta x(t)) times as large: x is 0 before and 1 after a step, and rises from 0 to 1 over
the record for a drift. A window feels the mean of exp(2 beta x) over it, in proportion to the share of the term in the
Allan variance at its lag. A difference d_m(i) of white noise weighs its 2 m samples alike, so that of the steps of a
large factor a window feels those too that lie within m samples beyond its ends.

The differences of a window that a step divides do not have one variance. With g that of each over that before the
step, s the share of the term, x the part of the samples after the step and R = exp(2 beta),

    g = 1 + s (R - 1) x,      edf = edf_0 (mean g)^2 / mean(g^2),                                                  (1)

for differences that are independent (Satterthwaite [1]): the louder part alone counts in the end.

The shares are those of a fitted model, and no better known than it is. Where a term shrinks they matter: at a lag of
which half is white noise, how much of it the others are is all that is left. `doubts_of` says how far they may be off.

References
----------
.. [1] F. Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bull. 2 (1946)
   110.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Ramp, Sinusoid
from allanite.noise.allan.cells import AllanCells
from allanite.noise.parameters import holder_of, with_factor

__all__ = ["EVERYTHING", "ChangeShape", "doubt_of_effect", "doubts_of", "effect_of", "shares_of", "spread_of"]

Array = NDArray[np.float64]

#: The noise as a whole: every lag alike.
EVERYTHING = "all"
#: A term with a smaller share than this at every lag cannot be seen to change.
_SEEN = 0.02
_POINTS = 8  # at which a drift is taken within a window
_STEP = 0.01  # of the logarithm of a parameter, for derivatives


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeShape:
    """One way to change.

    Attributes
    ----------
    symbol : str
        Of the term, or `EVERYTHING`.
    time : float or None [samples]
        Of a step; None for a drift.
    """

    symbol: str
    time: float | None

    def after(self, cells: AllanCells) -> Array:
        """Mean of x over the differences of each window; for a drift where its middle lies, 0 to 1."""
        if self.time is None:
            return np.asarray((cells.start + cells.stop) / 2.0 / cells.stop.max())
        return _mean_after(cells, self.time, 1)

    def reaches(self, cells: AllanCells, lower: float, upper: float) -> NDArray[np.bool_]:
        """Windows with a difference that holds samples of both sides of a step between two times."""
        return np.asarray((cells.first < upper) & (cells.last - 1 + 2 * cells.lag > lower))

    def growth(self, cells: AllanCells, beta: float) -> Array:
        """Mean of exp(2 beta x) over each window."""
        x = self.after(cells)
        if self.time is None:
            width = (cells.stop - cells.start) / cells.stop.max()
            inner = (np.arange(_POINTS) + 0.5) / _POINTS - 0.5
            return np.asarray(np.exp(2 * beta * (x[:, None] + width[:, None] * inner)).mean(axis=1))
        return np.asarray(1.0 + x * np.expm1(2 * beta))

    def spread(self, cells: AllanCells, beta: float, shares: Mapping[str, Array]) -> Array:
        """Relative variance of each window over that under constant noise, edf_0/edf of equation (1)."""
        if self.time is None:
            return np.ones(len(cells))
        more = shares[self.symbol][cells.row] * np.expm1(2 * beta)
        first, second = (_mean_after(cells, self.time, power) for power in (1, 2))
        square = 1.0 + 2.0 * more * first + more**2 * second
        return np.asarray(np.maximum(square / (1.0 + more * first) ** 2, 1.0))

    def column(self, cells: AllanCells, shares: Mapping[str, Array]) -> Array:
        """First-order change of ln v of every cell with 2 beta."""
        return np.asarray(shares[self.symbol][cells.row] * self.after(cells))


def shares_of(model: NoiseModel, lags: NDArray[np.int64], dt: float, sampling: str) -> dict[str, Array]:
    """Share of each term in the Allan variance at every lag, shape (n_lags,), by symbol; terms that can be seen.

    `EVERYTHING` stands last, where there is more than one.
    """
    visible = {s: part for s, part in _shares(model, lags, dt, sampling).items() if part.max() > _SEEN}
    if len(visible) == 1:
        return visible
    return {**visible, EVERYTHING: np.ones(len(lags))}


def _shares(model: NoiseModel, lags: NDArray[np.int64], dt: float, sampling: str) -> dict[str, Array]:
    """Of every term but a ramp, which cannot change."""
    m = lags.astype(np.float64)
    total = model.avar_sampled(m, dt, sampling)
    shares: dict[str, Array] = {}
    for term in model.terms:
        symbol = term.symbols[0] if term.type != "gauss_markov" else "sigma"
        if not isinstance(term, Ramp):
            shares[symbol] = shares.get(symbol, 0.0) + term.avar_sampled(m, dt, sampling) / total
    return shares


def doubts_of(model: NoiseModel, lags: NDArray[np.int64], dt: float, sampling: str) -> dict[str, Array]:
    """How far the fit leaves the shares open: they are off by these columns times independent standard normal numbers.

    Shape (n_lags, n_parameters) by symbol, to first order, from the covariance of the fitted logarithms; a model that
    was given without one is taken at its word.
    """
    symbols, matrix = model.covariance.get("symbols", []), np.asarray(model.covariance.get("matrix", []))
    holders = [holder_of(symbol, model.terms) for symbol in symbols]
    movable = [i for i, holder in enumerate(holders) if holder and not isinstance(holder, Sinusoid)]
    if not movable:
        return {symbol: np.zeros((len(lags), 0)) for symbol in _shares(model, lags, dt, sampling)}
    values, vectors = np.linalg.eigh(matrix[np.ix_(movable, movable)])
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    ends = [
        [
            _shares(
                replace(model, terms=with_factor(model.terms, symbols[i], math.exp(step))), lags, dt, sampling
            )
            for step in (_STEP, -_STEP)
        ]
        for i in movable
    ]
    return {
        symbol: np.stack([(up[symbol] - down[symbol]) / (2 * _STEP) for up, down in ends], axis=1) @ root
        for symbol in ends[0][0]
    }


def effect_of(
    shapes: Sequence[ChangeShape], beta: Array, cells: AllanCells, shares: Mapping[str, Array]
) -> Array:
    """Variance of every cell under these changes, over that of the whole record, shape (n_cells,)."""
    rest = 1.0 - sum(
        (shares[s] for s in {h.symbol for h in shapes} - {EVERYTHING}), np.zeros(len(cells.lags))
    )
    total = np.maximum(rest, 0.0)[cells.row]
    for symbol in dict.fromkeys(h.symbol for h in shapes if h.symbol != EVERYTHING):
        total = total + shares[symbol][cells.row] * _growth(shapes, beta, cells, symbol)
    return np.asarray(total * _growth(shapes, beta, cells, EVERYTHING))


def doubt_of_effect(
    shapes: Sequence[ChangeShape],
    beta: Array,
    cells: AllanCells,
    shares: Mapping[str, Array],
    doubts: Mapping[str, Array],
) -> Array:
    """What the doubt of the shares makes of the logarithm of every cell's effect, shape (n_cells, n_parameters)."""
    total = effect_of(shapes, beta, cells, shares) / _growth(shapes, beta, cells, EVERYTHING)
    out = np.zeros((len(cells), next(iter(doubts.values())).shape[1]))
    for symbol in dict.fromkeys(h.symbol for h in shapes if h.symbol != EVERYTHING):
        grown = (_growth(shapes, beta, cells, symbol) - 1.0) / total
        out += grown[:, None] * doubts[symbol][cells.row]
    return out


def spread_of(
    shapes: Sequence[ChangeShape], beta: Array, cells: AllanCells, shares: Mapping[str, Array]
) -> Array:
    """Relative variance of every cell under these changes, over that of constant noise, shape (n_cells,)."""
    out = np.ones(len(cells))
    for shape, size in zip(shapes, beta, strict=True):
        out = out * shape.spread(cells, float(size), shares)
    return out


def _mean_after(cells: AllanCells, time: float, power: int) -> Array:
    """Mean of x or x^2 over the differences of each window, x being the part of the 2 m samples after a step."""
    lag = cells.lag.astype(np.float64)

    def total(start: NDArray[np.int64]) -> Array:
        """Sum over the differences before a start: x = k/(2 m) for k = 1, 2, ... 2 m, then 1."""
        k = start - 1 + 2 * lag - time
        part = np.clip(k, 0.0, 2 * lag)
        rising = part * (part + 1) / (4 * lag)
        if power == 2:
            rising = rising * (2 * part + 1) / (6 * lag)
        return np.asarray(rising + np.maximum(k - 2 * lag, 0.0))

    return np.asarray((total(cells.last) - total(cells.first)) / (cells.last - cells.first))


def _growth(shapes: Sequence[ChangeShape], beta: Array, cells: AllanCells, symbol: str) -> Array:
    """Growth of one term in every window over its mean over the record (the levels of the lags are free)."""
    out = np.ones(len(cells))
    for shape, size in zip(shapes, beta, strict=True):
        if shape.symbol == symbol:
            out = out * shape.growth(cells, float(size))
    weight = (cells.stop - cells.start).astype(np.float64)
    n = len(cells.lags)
    mean = np.bincount(cells.row, weight * out, n) / np.bincount(cells.row, weight, n)
    return np.asarray(out / mean[cells.row])
