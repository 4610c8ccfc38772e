# SPDX-License-Identifier: BSD-3-Clause
"""Regression in noise that is fitted to the very same record, and what the record leaves open of that noise.

White noise N, flicker B and random walk K. For given ratios B/N and K/N the regression is
`allanite.filtering.regression`'s and N follows from the size of the residuals. The likelihood of the contrasts that no
coefficient enters [1] weighs the ratios: it sees the noise as it was before the coefficients were fitted, so that
taking an effect off does not make the noise look smaller. Slow noise that a record hardly determines is what makes the
interval of a coefficient too short when the best noise model is taken for the truth; here the answers are averaged over
a grid of noise models, with that likelihood and a weak prior on B and K [2].

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation", JASA 72 (1977) 320.
.. [2] A. Gelman, "Prior distributions for variance parameters in hierarchical models", Bayesian Analysis 1 (2006) 515.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.filtering.regression import LEVEL, Whitener
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.stability.environment.climate import Climate

__all__ = ["Noise", "RegressionFit", "Weighed"]

Array = NDArray[np.float64]

#: Where the grid of noise models lies, in standard deviations from the best one.
STEPS = (-2.0, -1.0, 0.0, 1.0, 2.2)
#: The prior falls with this power of B and of K. At 0, flat, white noise alone is taken for less than it is and its
#: intervals cover 99 %; near 1 a slow noise that the record hardly shows is forgotten.
PRIOR = 0.3
#: Least relative standard deviation of B and K that the grid is made for.
NARROWEST = 0.03
#: A column whose part outside of the columns before it is shorter than this cannot be told from them.
RANK = 1e-9
#: Nodes of less weight than this are left out.
LIGHT = 1e-5
#: Ratios of the first look, times those at which a term reaches the white noise at the end of the record.
FIRST_LOOK = (0.2, 2.0, 20.0)
#: Natural logarithms of the least and the largest such ratio.
RANGE = (-9.0, 14.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RegressionFit:
    """Least squares in noise of one model.

    Attributes
    ----------
    coefficients : ndarray, shape (k,)
    inverse : ndarray, shape (k, k)
        Covariance for noise of size one.
    chi2 : float
    dof : int
    log_likelihood : float
        With the best size of the noise.
    """

    coefficients: Array
    inverse: Array
    chi2: float
    dof: int
    log_likelihood: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """Products of the whitened columns, the signal last, under one noise model."""

    flicker: float
    walk: float
    logs: float
    products: Array

    def fit(self, picked: NDArray[np.int64], rows: int) -> RegressionFit:
        """Least squares of the signal on some of the columns."""
        a = self.products[np.ix_(picked, picked)]
        b, square = self.products[picked, -1], float(self.products[-1, -1])
        length = np.sqrt(np.diag(a))
        values, vectors = np.linalg.eigh(a / np.outer(length, length))
        keep = values > RANK
        half = vectors[:, keep] / np.sqrt(values[keep])
        inverse = half @ half.T / np.outer(length, length)
        coefficients = inverse @ b
        dof = rows - int(keep.sum())
        chi2 = max(square - float(b @ coefficients), 1e-14 * square)
        logs = float(np.log(values[keep]).sum()) + 2 * float(np.log(length).sum())
        likelihood = -0.5 * (self.logs + logs + dof * math.log(chi2))
        return RegressionFit(
            coefficients=coefficients, inverse=inverse, chi2=chi2, dof=dof, log_likelihood=likelihood
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """Coefficients, averaged over the noise models that the record leaves open.

    Attributes
    ----------
    names : tuple of str
    weights : ndarray, shape (n_nodes,)
    values, sds : ndarray, shape (n_nodes, k)
    covariance : ndarray, shape (k, k)
        Of the average.
    dof : int
    """

    names: tuple[str, ...]
    weights: Array
    values: Array
    sds: Array
    covariance: Array
    dof: int

    @property
    def mean(self) -> Array:
        """The coefficients, shape (k,)."""
        return np.asarray(self.weights @ self.values)

    def below(self, name: str, x: float) -> float:
        """Probability that a coefficient lies below x."""
        from scipy.special import stdtr

        i = self.names.index(name)
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(self.weights @ stdtr(self.dof, (x - self.values[:, i]) / self.sds[:, i]))

    def chance(self, name: str) -> float:
        """Two-sided probability of a coefficient so far from zero if it is zero."""
        low = self.below(name, 0.0)
        return min(2 * min(low, 1 - low), 1.0)

    def interval(self, name: str, confidence: float) -> tuple[float, float]:
        """Ends of the interval of a coefficient."""
        from scipy.optimize import brentq

        i = self.names.index(name)
        middle, sd = float(self.mean[i]), math.sqrt(self.covariance[i, i])
        far = 60 * sd + 1e-300

        def end(p: float) -> float:
            return float(
                brentq(lambda x: self.below(name, x) - p, middle - far, middle + far, xtol=1e-6 * sd)
            )

        return end((1 - confidence) / 2), end((1 + confidence) / 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Noise models of a record with the products of its columns under each.

    Attributes
    ----------
    names : tuple of str
        Of the columns, the level first.
    scales : ndarray, shape (k,)
        What each column was divided by.
    nodes : tuple of Node
        The best one first.
    cells : ndarray, shape (n_nodes,)
        Prior weight.
    rows : int
    given : bool
        The noise model was given: its size is known, too.
    best : NoiseModel
    """

    names: tuple[str, ...]
    scales: Array
    nodes: tuple[Node, ...]
    cells: Array
    rows: int
    given: bool
    best: NoiseModel

    @classmethod
    def of(
        cls,
        climate: Climate,
        columns: Array,
        names: Sequence[str],
        *,
        design: Sequence[str] | None = None,
        model: NoiseModel | None = None,
        near: NoiseModel | None = None,
    ) -> Noise:
        """Search the noise models under the columns of `design` (all by default), and grid around the best.

        Parameters
        ----------
        columns : ndarray, shape (n, k)
        names : sequence of str, k names
        model : NoiseModel, optional
            Known from elsewhere; nothing is left open then.
        near : NoiseModel, optional
            Where to begin.

        Raises
        ------
        DataQualityError
            Samples that do not vary.
        """
        rows = _ScaledTable.of(climate, columns)
        every = (LEVEL, *names)
        if model is not None:
            nodes: tuple[Node, ...] = (rows.node_of(model),)
            return cls(
                names=every, scales=rows.scales, nodes=nodes, cells=np.ones(1), rows=rows.count, given=True, best=model
            )  # fmt: skip
        picked = np.array([every.index(n) for n in (LEVEL, *(names if design is None else design))])
        search = _NoiseSearch(rows, picked)
        nodes, cells = search.grid(near)
        size = (
            math.sqrt(nodes[0].fit(picked, rows.count).chi2 / nodes[0].fit(picked, rows.count).dof)
            * rows.unit
        )
        terms = [White(N=size)]
        terms += [Flicker(B=size * nodes[0].flicker)] if nodes[0].flicker > 0 else []  # type: ignore[list-item]
        terms += [RandomWalk(K=size * nodes[0].walk)] if nodes[0].walk > 0 else []  # type: ignore[list-item]
        return cls(
            names=every,
            scales=rows.scales,
            nodes=nodes,
            cells=cells,
            rows=rows.count,
            given=False,
            best=NoiseModel.of(*terms),
        )

    def with_columns(self, matrix: Array) -> Noise:
        """Other columns in place of these: combinations of level, columns and nothing else, shape (k, k)."""
        change = np.eye(len(self.scales))
        change[:-1, :-1] = matrix * np.outer(self.scales[:-1], 1 / self.scales[:-1])
        nodes = tuple(replace(n, products=change.T @ n.products @ change) for n in self.nodes)
        return replace(self, nodes=nodes)

    def weights(self, design: Sequence[str]) -> Array:
        """Of the noise models, under the columns of a design."""
        logs = np.array([node.fit(self._picked(design), self.rows).log_likelihood for node in self.nodes])
        weights = self.cells * np.exp(logs - logs.max())
        return np.asarray(weights / weights.sum())

    def fit(
        self, design: Sequence[str], *, weights: Array | None = None, sizes: Array | None = None
    ) -> Weighed:
        """Coefficients of the columns of a design (without the level), in SI per unit of the columns.

        Parameters
        ----------
        weights, sizes : ndarray, shape (n_nodes,), optional
            Of the noise models, and variances of their noise, where another design determines them.
        """
        picked = self._picked(design)
        fits = [node.fit(picked, self.rows) for node in self.nodes]
        w = self.weights(design) if weights is None else weights
        if sizes is None:
            sizes = self.sizes(design)
        scale = self.scales[-1] / self.scales[picked]
        values = np.array([f.coefficients for f in fits]) * scale
        sds = np.sqrt(sizes[:, None] * np.array([np.diag(f.inverse) for f in fits])) * scale
        inner = sum(wk * s * f.inverse for wk, s, f in zip(w, sizes, fits, strict=True)) * np.outer(
            scale, scale
        )
        off = values - w @ values
        covariance = inner + (w[:, None] * off).T @ off
        keep = slice(1, None)
        return Weighed(
            names=tuple(design),
            weights=w,
            values=values[:, keep],
            sds=sds[:, keep],
            covariance=np.asarray(covariance)[keep, keep],
            dof=10**6 if self.given else fits[0].dof,
        )

    def sizes(self, design: Sequence[str]) -> Array:
        """Variance of the noise under each noise model, from the residuals of a design; 1 for a given model."""
        picked = self._picked(design)
        fits = [node.fit(picked, self.rows) for node in self.nodes]
        return np.array([1.0 if self.given else f.chi2 / f.dof for f in fits])

    def inflation(self, name: str, others: Sequence[str], more: str) -> float:
        """How many times longer the interval of a coefficient becomes by one column more, under the best model."""
        node = self.nodes[0]
        without = node.fit(self._picked([name, *others]), self.rows).inverse[1, 1]
        beside = node.fit(self._picked([name, *others, more]), self.rows).inverse[1, 1]
        return math.sqrt(beside / without)

    def separable(self, name: str, others: Sequence[str]) -> bool:
        """A column that is not a combination of others, under the best model."""
        node = self.nodes[0]
        i = self._picked([name])[1]
        power = float(node.products[i, i])
        rest = self._picked(others)
        a, b = node.products[np.ix_(rest, rest)], node.products[rest, i]
        left = power - float(b @ np.linalg.lstsq(a, b, rcond=RANK)[0])
        return power > 0 and left > 1e-6 * power

    def products(self, names: Sequence[str], others: Sequence[str]) -> Array:
        """Of whitened columns less their parts along others, under the best model, shape (k, k); columns unscaled."""
        node = self.nodes[0]
        i, rest = self._picked(names)[1:], self._picked(others)
        a = node.products[np.ix_(rest, rest)]
        b = node.products[np.ix_(rest, i)]
        inside = node.products[np.ix_(i, i)] - b.T @ np.linalg.lstsq(a, b, rcond=RANK)[0]
        return np.asarray(inside * np.outer(self.scales[i], self.scales[i]))

    def _picked(self, design: Sequence[str]) -> NDArray[np.int64]:
        return np.array([0, *(self.names.index(n) for n in design)], dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class _ScaledTable:
    """The table to whiten: level, columns and signal, each divided by its size."""

    table: Array
    scales: Array
    part: Array
    climate: Climate

    @classmethod
    def of(cls, climate: Climate, columns: Array) -> _ScaledTable:
        y = climate.blocks.mean
        present = climate.blocks.part > 0
        level = float(np.mean(y[present]))
        spread = float(np.std(y[present]))
        if not spread > 1e-14 * abs(level):
            raise DataQualityError("the samples do not vary: there is no noise to compare an effect with")
        table = np.column_stack([np.ones(len(y)), columns, np.nan_to_num(y - level)])
        sizes = np.sqrt((table[present] ** 2).mean(axis=0))
        scales = np.where(sizes > 0, sizes, 1.0)
        return cls(table=table / scales, scales=scales, part=climate.blocks.part, climate=climate)

    @property
    def unit(self) -> float:
        """What the signal was divided by [SI]."""
        return float(self.scales[-1])

    @property
    def count(self) -> int:
        """Rows with samples."""
        return int(np.count_nonzero(self.part))

    def node(self, flicker: float, walk: float) -> Node:
        """Under noise of N = 1 and these B and K, in units of the signal."""
        terms: list[White | Flicker | RandomWalk] = [White(N=1.0)]
        terms += [Flicker(B=flicker)] if flicker > 0 else []
        terms += [RandomWalk(K=walk)] if walk > 0 else []
        return self._whitened(NoiseModel.of(*terms), flicker, walk)

    def node_of(self, model: NoiseModel) -> Node:
        """Under a model in SI."""
        node = self._whitened(model, math.nan, math.nan)
        size = self.unit**2  # the signal is in units of `unit`: so is the noise
        return Node(flicker=math.nan, walk=math.nan, logs=node.logs, products=node.products * size)

    def _whitened(self, model: NoiseModel, flicker: float, walk: float) -> Node:
        whitener = Whitener.of(model, dt=self.climate.dt, counts=self.part, sampling=self.climate.sampling)
        white, logs = whitener(self.table)
        white = white[~np.isnan(white[:, 0])]
        return Node(flicker=flicker, walk=walk, logs=logs, products=white.T @ white)


class _NoiseSearch:
    """Finds the best B/N and K/N, and lays a grid around them."""

    def __init__(self, rows: _ScaledTable, picked: NDArray[np.int64]) -> None:
        self._rows, self._picked = rows, picked
        length = rows.climate.size * rows.climate.dt
        # B and K whose Allan variance is that of N = 1 at the end of the record
        self._unit = np.array([1.5 / math.sqrt(length), math.sqrt(3) / length])
        self._known: dict[tuple[float, float], Node] = {}

    def _node(self, ratios: Array) -> Node:
        key = (float(ratios[0]), float(ratios[1]))
        if key not in self._known:
            flicker, walk = np.array(key) * self._unit
            self._known[key] = self._rows.node(float(flicker), float(walk))
        return self._known[key]

    def _value(self, ratios: Array) -> float:
        return self._node(ratios).fit(self._picked, self._rows.count).log_likelihood

    def grid(self, near: NoiseModel | None) -> tuple[tuple[Node, ...], Array]:
        """Nodes, the best first, and their prior weights."""
        best = self._best(near)
        axes = [self._axis(best, i) for i in (0, 1)]
        widths = [_cells(axis) for axis in axes]
        nodes = [
            (self._node(np.array([b, k])), wb * wk)
            for b, wb in zip(axes[0], widths[0], strict=True)
            for k, wk in zip(axes[1], widths[1], strict=True)
        ]
        logs = [n.fit(self._picked, self._rows.count).log_likelihood for n, _ in nodes]
        top = max(logs)
        heavy = [(n, w) for (n, w), v in zip(nodes, logs, strict=True) if v > top + math.log(LIGHT)]
        first = self._node(best)
        rest = [(n, w) for n, w in heavy if n is not first]
        weight = next((w for n, w in heavy if n is first), 0.0)
        return (first, *(n for n, _ in rest)), np.array([weight, *(w for _, w in rest)])

    def _best(self, near: NoiseModel | None) -> Array:
        from scipy.optimize import minimize

        starts = [np.array([b, k]) for b in FIRST_LOOK for k in FIRST_LOOK]
        if near is not None:
            N, B, K = (
                getattr(near.term(t), s, 0.0)
                for t, s in (("white", "N"), ("flicker", "B"), ("random_walk", "K"))
            )
            starts = [np.maximum(np.array([B, K]) / N / self._unit, 1e-3)]
        start = max(starts, key=self._value)
        options: Any = {
            "xatol": 0.1,
            "fatol": 0.05,
            "maxfev": 60,
            "initial_simplex": _simplex(np.log(start)),
        }

        def cost(logs: Array) -> float:
            return -self._value(np.exp(np.clip(logs, *RANGE)))

        minimum = minimize(cost, np.log(start), method="Nelder-Mead", options=options)
        best = np.exp(np.clip(minimum.x, *RANGE))
        for i in (0, 1):  # a term that the record can do without is absent from the best model
            without = np.where(np.arange(2) == i, 0.0, best)
            if self._value(without) >= self._value(best) - 0.02:
                best = without
        return np.asarray(best)

    def _axis(self, best: Array, i: int) -> Array:
        """Values of one ratio around the best, in steps of its standard deviation; none below zero."""
        size = self._width(best, i)
        values = np.maximum(best[i] + np.array(STEPS) * size, 0.0)
        return np.unique(values)

    def _width(self, best: Array, i: int) -> float:
        """Distance upward over which the likelihood falls by 1/2, the other ratio following."""
        top, step = self._value(best), max(0.15 * best[i], 0.1)
        for _ in range(20):
            there = best.copy()
            there[i] += step
            lower = there.copy()
            lower[1 - i] = max(best[1 - i] - 0.7 * step * best[1 - i] / max(best[i], 0.3), 0.0)
            fall = top - max(self._value(there), self._value(lower))
            if fall > 0.5:
                step *= math.sqrt(0.5 / fall)  # as of a parabola
                break
            step *= 2.0
        return float(max(step, NARROWEST * best[i]))


def _simplex(start: Array) -> Array:
    return np.array([start, start + [1.0, 0.0], start + [0.0, 1.0]])


def _cells(axis: Array) -> Array:
    """Prior weight that each value of an axis stands for."""
    if len(axis) == 1:
        return np.ones(1)
    edges = np.concatenate([[axis[0]], (axis[1:] + axis[:-1]) / 2, [axis[-1]]])
    return np.asarray(np.diff(edges ** (1 - PRIOR)))
