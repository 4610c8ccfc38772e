# SPDX-License-Identifier: BSD-3-Clause
"""How one term of the noise may change: it steps at a time, or drifts over the whole record.

A term's amplitude becomes exp(beta x(t)) times as large: x is 0 before and 1 after a step, and rises from 0 to 1 over
the record for a drift. A window feels the mean of exp(2 beta x) over it, in proportion to the share of the term in the
Allan variance at its lag.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.allan.cells import Cells
from allanite.noise import NoiseModel, Ramp

__all__ = ["EVERYTHING", "Shape", "effect_of", "shares_of"]

Array = NDArray[np.float64]

#: The noise as a whole: every lag alike.
EVERYTHING = "all"
#: A term with a smaller share than this at every lag cannot be seen to change.
_SEEN = 0.02
_POINTS = 8  # at which a drift is taken within a window


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
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

    def after(self, cells: Cells) -> Array:
        """Share of each window that lies after a step; for a drift where its middle lies, 0 to 1."""
        if self.time is None:
            return np.asarray((cells.start + cells.stop) / 2.0 / cells.stop.max())
        return np.asarray(np.clip((cells.stop - self.time) / (cells.stop - cells.start), 0.0, 1.0))

    def growth(self, cells: Cells, beta: float) -> Array:
        """Mean of exp(2 beta x) over each window."""
        x = self.after(cells)
        if self.time is None:
            width = (cells.stop - cells.start) / cells.stop.max()
            inner = (np.arange(_POINTS) + 0.5) / _POINTS - 0.5
            return np.asarray(np.exp(2 * beta * (x[:, None] + width[:, None] * inner)).mean(axis=1))
        return np.asarray(1.0 + x * np.expm1(2 * beta))

    def column(self, cells: Cells, shares: Mapping[str, Array]) -> Array:
        """First-order change of ln v of every cell with 2 beta."""
        return np.asarray(shares[self.symbol][cells.row] * self.after(cells))


def shares_of(model: NoiseModel, lags: NDArray[np.int64], dt: float, sampling: str) -> dict[str, Array]:
    """Share of each term in the Allan variance at every lag, shape (n_lags,), by symbol; terms that can be seen.

    `EVERYTHING` stands last, where there is more than one.
    """
    total = model.avar_sampled(lags.astype(np.float64), dt, sampling)
    found: dict[str, Array] = {}
    for term in model.terms:
        part = term.avar_sampled(lags.astype(np.float64), dt, sampling) / total
        symbol = term.symbols[0] if term.type != "gauss_markov" else "sigma"
        if not isinstance(term, Ramp) and part.max() > _SEEN:
            found[symbol] = found.get(symbol, 0.0) + part
    if len(found) == 1:
        return found
    return {**found, EVERYTHING: np.ones(len(lags))}


def effect_of(shapes: Sequence[Shape], beta: Array, cells: Cells, shares: Mapping[str, Array]) -> Array:
    """Variance of every cell under these changes, over that of the whole record, shape (n_cells,)."""
    rest = 1.0 - sum(
        (shares[s] for s in {h.symbol for h in shapes} - {EVERYTHING}), np.zeros(len(cells.lags))
    )
    total = np.maximum(rest, 0.0)[cells.row]
    for symbol in dict.fromkeys(h.symbol for h in shapes if h.symbol != EVERYTHING):
        total = total + shares[symbol][cells.row] * _growth(shapes, beta, cells, symbol)
    return np.asarray(total * _growth(shapes, beta, cells, EVERYTHING))


def _growth(shapes: Sequence[Shape], beta: Array, cells: Cells, symbol: str) -> Array:
    """Growth of one term in every window over its mean over the record (the levels of the lags are free)."""
    out = np.ones(len(cells))
    for shape, size in zip(shapes, beta, strict=True):
        if shape.symbol == symbol:
            out = out * shape.growth(cells, float(size))
    weight = (cells.stop - cells.start).astype(np.float64)
    n = len(cells.lags)
    mean = np.bincount(cells.row, weight * out, n) / np.bincount(cells.row, weight, n)
    return np.asarray(out / mean[cells.row])
