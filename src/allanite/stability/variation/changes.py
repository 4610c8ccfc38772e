# SPDX-License-Identifier: BSD-3-Clause
"""When the noise changed, and by how much: a scan of steps and drifts of every term, with the level of chance.

The score of a shape (a term, a time) is its normalised projection on the whitened residuals. Without a change all
scores together are normal with a covariance that is known exactly, so that the law of the largest is simulated, once
for the record at hand: the threshold allows for every time and term that was tried. A change that is accepted enters
the model, and the scan goes on with what is left: without the windows that a step divides, whose scatter is not that of
constant noise, so that the remainder of one step is not taken for another.

References
----------
.. [1] D. W. K. Andrews, "Tests for parameter instability and structural change with unknown change point",
   Econometrica 61 (1993) 821.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.cells import AllanCells
from allanite.stability.variation.constancy import Whitened, WindowScatter, together
from allanite.stability.variation.shapes import EVERYTHING, ChangeShape
from allanite.stability.variation.sizes import FoundChange, Misfit, joint_effect, placed, sized

__all__ = ["ChangeScan", "find_changes", "undivided"]

Array = NDArray[np.float64]

#: More changes than these are no changes but noise that never is the same.
MOST = 4
#: Standard deviation of a term's logarithm beyond which a shape says nothing: not even a factor of ten would show.
_BLIND = 1.2
_DRAWS = 8000
_NEAR = 0.7  # logarithm of a factor that is found from none
_SIMPLER = 6.0  # twice the log-likelihood by which the noise as a whole must be the better explanation
_SEED = 20090219
_KEPT = 1e-5  # of the scores' variance may be lost in their simulation


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeScan:
    """Result of the search.

    Attributes
    ----------
    changes : tuple of FoundChange
        In the order of time; drifts first.
    p : float
        Chance of the largest score in a record whose noise is constant.
    left : (float, float)
        Chi-square and degrees of freedom of the windows after the changes, of those that no step divides.
    visible : mapping of str to float
        Factor on the amplitude of each term at which a step in the middle would just be accepted.
    """

    changes: tuple[FoundChange, ...]
    p: float
    left: tuple[float, float]
    visible: Mapping[str, float]


def find_changes(
    cells: AllanCells,
    scatter: WindowScatter,
    shares: Mapping[str, Array],
    doubts: Mapping[str, Array],
    *,
    level: float,
    confidence: float,
) -> ChangeScan:
    """Look for steps and drifts of the terms until what is left may be chance.

    Parameters
    ----------
    shares : mapping of str to ndarray, shape (n_lags,)
        Share of every term in the variance at each lag.
    doubts : mapping of str to ndarray, shape (n_lags, n_parameters)
        How far each is open: see `shapes.doubts_of`.
    level : float
        Probability of any change in a record whose noise is constant.
    """
    accepted: list[FoundChange] = []
    every, misfit = _shapes(cells, shares), Misfit.of(cells, scatter, shares, doubts)
    first, visible = 1.0, dict[str, float]()
    while True:
        whole = undivided(accepted, cells)
        if not whole.any():  # steps divide every window: nothing is left to look at
            left_over = (0.0, 0.0)
            break
        rest, part = cells.where(whole), _of_lags(shares, cells, whole)
        effect = joint_effect(accepted, cells, shares)
        calm, its_scatter = rest.variance / effect[whole], scatter.of_cells(np.flatnonzero(whole))
        left, left_over = Whitened.of(calm, rest.row, its_scatter), together(calm, rest.row, its_scatter)
        tried, p, needed = _largest(every, [c.shape for c in accepted], rest, part, left, level)
        if not accepted:
            first, visible = p, _visible(needed, cells, shares, left)
        # beyond a change whose size is not known nothing can be told of what is left
        known = all(math.isfinite(c.sd) for c in accepted)
        if not tried or p > level or len(accepted) == MOST or not known:
            break
        accepted = placed(_likeliest(tried, accepted, p, misfit), misfit, confidence)
    ordered = sorted(accepted, key=lambda c: -1.0 if c.shape.time is None else c.shape.time)
    return ChangeScan(changes=tuple(ordered), p=first, left=left_over, visible=visible)


def undivided(changes: Sequence[FoundChange], cells: AllanCells) -> NDArray[np.bool_]:
    """Windows that lie on one side of every step, wherever its time may be if that is known to a window or two."""
    keep = np.ones(len(cells), dtype=np.bool_)
    near = 2.0 * float((cells.stop - cells.start).min())
    for change in changes:
        time, lower, upper = change.shape.time, change.lower, change.upper
        if time is None or lower is None or upper is None:
            continue
        ends = (lower, upper) if upper - lower <= near else (time, time)
        keep &= ~change.shape.reaches(cells, *ends)
    return keep


def _of_lags(shares: Mapping[str, Array], cells: AllanCells, keep: NDArray[np.bool_]) -> dict[str, Array]:
    """Shares at the lags of the cells that are kept."""
    rows = np.unique(cells.row[keep])
    return {symbol: share[rows] for symbol, share in shares.items()}


def _shapes(cells: AllanCells, shares: Mapping[str, Array]) -> list[ChangeShape]:
    """Steps at every border of the shortest windows, and a drift, of every term."""
    borders = np.unique(cells.start[cells.row == 0])[1:]
    times: list[float | None] = [None, *map(float, borders)]
    return [ChangeShape(symbol=s, time=t) for s in shares for t in times]


# -- the largest score -------------------------------------------------------------------------------------------


def _largest(
    shapes: Sequence[ChangeShape],
    known: Sequence[ChangeShape],
    cells: AllanCells,
    shares: Mapping[str, Array],
    left: Whitened,
    level: float,
) -> tuple[list[ChangeShape], float, float]:
    """The shapes with the largest scores, the probability that chance makes one as large, and the score needed.

    One step and one drift of each term: scores are of first order, and do not tell terms that change by much apart.
    """
    made, sizes = _free(shapes, known, cells, shares, left)
    able = sizes > 1.5 / _BLIND  # ln amplitude = 3/2 of the cube root
    if not able.any():
        return [], 1.0, math.inf
    unit = made[:, able] / sizes[able]
    tried = [s for s, use in zip(shapes, able, strict=True) if use]
    scores = np.abs(unit.T @ left.residual)
    p, needed = _chance(unit, float(scores.max()), level)
    best = dict[tuple[str, bool], ChangeShape]()
    for i in np.argsort(-scores):
        best.setdefault((tried[i].symbol, tried[i].time is None), tried[i])
    return list(best.values()), p, needed


def _likeliest(
    shapes: Sequence[ChangeShape], known: Sequence[FoundChange], p: float, misfit: Misfit
) -> list[FoundChange]:
    """The known changes with the one of the shapes that explains the most; one term rather than all of them, unless
    that explains clearly less."""
    cells, shares = misfit.cells, misfit.shares
    borders = np.unique(cells.start[cells.row == 0])[1:].astype(np.float64)
    ratio = cells.variance / joint_effect(known, cells, shares)
    candidates = []
    for shape in shapes:
        more = _SIMPLER if shape.symbol == EVERYTHING else 0.0
        # the window that a step divides looks like its louder side: the border that leaves it there may be the next
        i = 0 if shape.time is None else int(np.searchsorted(borders, shape.time))
        times = [None] if shape.time is None else borders[max(i - 1, 0) : i + 2].tolist()
        for at in (ChangeShape(symbol=shape.symbol, time=time) for time in times):
            for beta in _starts(at, ratio, cells, shares):
                new = FoundChange(shape=at, lower=None, upper=None, beta=beta, sd=0.0, p=p)
                changes, loss = sized([*known, new], misfit)
                candidates.append((loss + more, changes))
    return min(candidates, key=lambda one: one[0])[1]


def _starts(shape: ChangeShape, ratio: Array, cells: AllanCells, shares: Mapping[str, Array]) -> list[float]:
    """Where to look for the size: at none, and of a step of a large factor where the windows of one lag say."""
    if shape.time is None:
        return [0.0]
    here = cells.row == int(np.argmax(shares[shape.symbol]))
    before, after = ratio[here & (cells.stop <= shape.time)], ratio[here & (cells.start >= shape.time)]
    if not (len(before) and len(after)):
        return [0.0]
    beta = 0.5 * math.log(float(np.median(after) / np.median(before)))
    return [0.0] if abs(beta) < _NEAR else [0.0, beta]


def _visible(
    needed: float, cells: AllanCells, shares: Mapping[str, Array], left: Whitened
) -> dict[str, float]:
    middle = [ChangeShape(symbol=s, time=float(cells.stop.max()) / 2) for s in shares]
    _, sizes = _free(middle, (), cells, shares, left)
    return {s.symbol: math.exp(min(1.5 * needed / size, 99.0)) for s, size in zip(middle, sizes, strict=True)}


def _free(
    shapes: Sequence[ChangeShape],
    known: Sequence[ChangeShape],
    cells: AllanCells,
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
