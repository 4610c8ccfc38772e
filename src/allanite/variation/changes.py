# SPDX-License-Identifier: BSD-3-Clause
"""When the noise changed, and by how much: a scan of steps and drifts of every term, with the level of chance.

The score of a shape (a term, a time) is its normalised projection on the whitened residuals. Without a change all
scores together are normal with a covariance that is known exactly, so that the law of the largest is simulated, once
for the record at hand: the threshold allows for every time and term that was tried. A change that is accepted enters
the model, and the scan goes on with what is left.

References
----------
.. [1] D. W. K. Andrews, "Tests for parameter instability and structural change with unknown change point",
   Econometrica 61 (1993) 821.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.allan.cells import Cells
from allanite.variation.constancy import Scatter, Whitened
from allanite.variation.shapes import EVERYTHING, Shape
from allanite.variation.sizes import FoundChange, Misfit, joint_effect, placed

__all__ = ["Scan", "find_changes"]

Array = NDArray[np.float64]

#: More changes than these are no changes but noise that never is the same.
MOST = 4
#: Standard deviation of a term's logarithm beyond which a shape says nothing: not even a factor of ten would show.
_BLIND = 1.2
_DRAWS = 8000
_SIMPLER = 6.0  # twice the log-likelihood by which the noise as a whole must be the better explanation
_SEED = 20090219
_KEPT = 1e-5  # of the scores' variance may be lost in their simulation


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """Result of the search.

    Attributes
    ----------
    changes : tuple of FoundChange
        In the order of time; drifts first.
    p : float
        Chance of the largest score in a record whose noise is constant.
    left : Whitened
        Residuals after the changes.
    effect : ndarray, shape (n_cells,)
        Variance of every cell under the changes over that of the whole record.
    visible : mapping of str to float
        Factor on the amplitude of each term at which a step in the middle would just be accepted.
    """

    changes: tuple[FoundChange, ...]
    p: float
    left: Whitened
    effect: Array
    visible: Mapping[str, float]


def find_changes(
    cells: Cells, scatter: Scatter, shares: Mapping[str, Array], *, level: float, confidence: float
) -> Scan:
    """Look for steps and drifts of the terms until what is left may be chance.

    Parameters
    ----------
    shares : mapping of str to ndarray, shape (n_lags,)
        Share of every term in the variance at each lag.
    level : float
        Probability of any change in a record whose noise is constant.
    """
    accepted: list[FoundChange] = []
    every, misfit = _shapes(cells, shares), Misfit.of(cells, scatter, shares)
    first, visible = 1.0, dict[str, float]()
    while True:
        effect = joint_effect(accepted, cells, shares)
        left = Whitened.of(cells.variance / effect, cells.row, scatter)
        best, p, needed = _largest(every, [c.shape for c in accepted], cells, shares, left, level)
        if not accepted:
            first, visible = p, _visible(needed, cells, shares, left)
        if best is None or p > level or len(accepted) == MOST:
            break
        accepted.append(FoundChange(shape=best, lower=None, upper=None, beta=0.0, sd=0.0, p=p))
        accepted = placed(accepted, misfit, confidence)
    ordered = sorted(accepted, key=lambda c: -1.0 if c.shape.time is None else c.shape.time)
    return Scan(changes=tuple(ordered), p=first, left=left, effect=effect, visible=visible)


def _shapes(cells: Cells, shares: Mapping[str, Array]) -> list[Shape]:
    """Steps at every border of the shortest windows, and a drift, of every term."""
    borders = np.unique(cells.start[cells.row == 0])[1:]
    times: list[float | None] = [None, *map(float, borders)]
    return [Shape(symbol=s, time=t) for s in shares for t in times]


# -- the largest score -------------------------------------------------------------------------------------------


def _largest(
    shapes: Sequence[Shape],
    known: Sequence[Shape],
    cells: Cells,
    shares: Mapping[str, Array],
    left: Whitened,
    level: float,
) -> tuple[Shape | None, float, float]:
    """The shape with the largest score, the probability that chance makes one as large, and the score needed."""
    made, sizes = _free(shapes, known, cells, shares, left)
    able = sizes > 1.5 / _BLIND  # ln amplitude = 3/2 of the cube root
    if not able.any():
        return None, 1.0, math.inf
    unit = made[:, able] / sizes[able]
    tried = [s for s, use in zip(shapes, able, strict=True) if use]
    scores = np.abs(unit.T @ left.residual)
    p, needed = _chance(unit, float(scores.max()), level)
    # one term rather than all of them, unless that explains clearly less
    named = np.array([0.0 if s.symbol == EVERYTHING else _SIMPLER for s in tried])
    return tried[int(np.argmax(scores**2 + named))], p, needed


def _visible(needed: float, cells: Cells, shares: Mapping[str, Array], left: Whitened) -> dict[str, float]:
    middle = [Shape(symbol=s, time=float(cells.stop.max()) / 2) for s in shares]
    _, sizes = _free(middle, (), cells, shares, left)
    return {s.symbol: math.exp(min(1.5 * needed / size, 99.0)) for s, size in zip(middle, sizes, strict=True)}


def _free(
    shapes: Sequence[Shape],
    known: Sequence[Shape],
    cells: Cells,
    shares: Mapping[str, Array],
    left: Whitened,
) -> tuple[Array, Array]:
    """Whitened columns of shapes, less what levels and known changes explain of them, and their lengths."""
    made = left.without_levels(np.stack([s.column(cells, shares) for s in shapes], axis=1))
    if known:
        basis, _ = np.linalg.qr(
            left.without_levels(np.stack([s.column(cells, shares) for s in known], axis=1))
        )
        made = made - basis @ (basis.T @ made)
    return made, np.linalg.norm(made, axis=0)


def _chance(unit: Array, largest: float, level: float) -> tuple[float, float]:
    """Law of the largest of all scores of pure noise, by simulation: chance of more than a value, and a quantile."""
    values, vectors = np.linalg.eigh(unit.T @ unit)
    kept = np.cumsum(values) > _KEPT * values.sum()
    root = vectors[:, kept] * np.sqrt(np.maximum(values[kept], 0.0))
    rng = np.random.default_rng(_SEED)
    tops = np.concatenate(
        [np.abs(rng.standard_normal((_DRAWS // 10, root.shape[1])) @ root.T).max(axis=1) for _ in range(10)]
    )
    bound = unit.shape[1] * math.erfc(largest / math.sqrt(2.0))  # of the union, for what no draw reaches
    p = min(max(float(np.mean(tops >= largest)), 1.0 / _DRAWS), max(bound, 1e-12), 1.0)
    return p, float(np.quantile(tops, 1.0 - level))
