# SPDX-License-Identifier: BSD-3-Clause
"""The horizontal rate of the Earth and the biases, with everything that is known beforehand, in one least squares.

What is known beforehand (calibration, means of the accelerometers, noise of the turns) comes as further rows: with
the covariance P = L L' of the parameters, these are p_0 + L z and the rows say z = 0, each with the variance one. A
covariance that is singular, or zero for what was held, needs no care then. What nothing is known of is free. The
error of any result is a sum over the rows, whose noise is independent: its budget by source is one by rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.alignment.geometry import Geometry, derivative
from allanite.lazy_dataclasses import dataclass

__all__ = ["AlignmentSolution", "Knowledge", "solve"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Columns of unit length whose combination is shorter than this cannot be told apart in float64.
RANK = 1e-9
#: Part of a parameter in such a combination from which it is unbounded.
TOUCHED = 1e-6
#: Steps with the same derivatives, at the most: all is nearly linear.
MOST_STEPS = 12
#: Derivatives taken anew, at the most.
MOST_SLOPES = 6
#: A step so small that another would change nothing [standard deviations of the whitened rows].
CLOSE = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Knowledge:
    """What is known before the fit.

    Attributes
    ----------
    free : ndarray of int64
        Parameters without any prior.
    known : ndarray of int64, shape (k,)
        Parameters with a prior.
    factor : ndarray, shape (k, r)
        L of their covariance.
    sources : mapping of str to ndarray of int64
        Entries of `known` that make a source of the budget.
    """

    free: Index
    known: Index
    factor: Array = field(repr=False)
    sources: Mapping[str, Index] = field(default_factory=dict)

    @classmethod
    def of(cls, free: Index, covariance: Array, sources: Mapping[str, Index]) -> Knowledge:
        """From the covariance of all parameters; those without variance are held.

        Parameters
        ----------
        sources : mapping of str to ndarray of int64
            Parameters, by their places in the vector of all.
        """
        known = np.setdiff1d(np.flatnonzero(np.diag(covariance) > 0), free)
        known_covariance = covariance[np.ix_(known, known)]
        size = np.sqrt(np.diag(known_covariance))
        values, vectors = (
            np.linalg.eigh(known_covariance / np.outer(size, size))
            if len(known)
            else (np.zeros(0), known_covariance)
        )
        if len(values) and values[0] < -1e-9 * len(values):
            raise InputError("the covariance of the calibration is not positive semidefinite")
        keep = values > 1e-14 * max(len(values), 1)
        factor = size[:, None] * vectors[:, keep] * np.sqrt(values[keep])
        where = {name: np.flatnonzero(np.isin(known, places)) for name, places in sources.items()}
        return cls(free=free, known=known, factor=factor, sources={n: w for n, w in where.items() if len(w)})

    @property
    def size(self) -> int:
        """Unknown numbers: the free ones, and those that carry the prior."""
        return len(self.free) + int(self.factor.shape[1])

    def spread(self, jacobian: Array) -> Array:
        """Derivatives by the active parameters (free, then known) as those by the unknown numbers."""
        n = len(self.free)
        return np.concatenate([jacobian[:, :n], jacobian[:, n:] @ self.factor], axis=1)

    def moved(self, start: Array, unknown: Array) -> Array:
        """All parameters, from the unknown numbers."""
        n, p = len(self.free), start.copy()
        p[self.free] += unknown[:n]
        p[self.known] += self.factor @ unknown[n:]
        return p


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentSolution:
    """Least squares.

    Attributes
    ----------
    parameters : ndarray
        All of them.
    slopes : ndarray, shape (n_stands, 3, n_unknown)
        Derivatives of the gyros.
    rows : ndarray, shape (n, n_unknown)
        Whitened derivatives: the gyros, then the prior.
    n_data : int
        Rows of the gyros.
    residual : ndarray, shape (n,)
        Whitened.
    inverse : ndarray, shape (n_unknown, n_unknown)
        Covariance of the unknown numbers, in the directions that are seen.
    unseen : ndarray, shape (m, n_unknown)
        Directions that the rows leave open, in unknown numbers of comparable size.
    scale : ndarray, shape (n_unknown,)
        An unknown number times this is of comparable size.
    rank : int
    taken : list
        `answers`, once they were asked for.
    """

    geometry: Geometry = field(repr=False)
    knowledge: Knowledge = field(repr=False)
    parameters: Array = field(repr=False)
    slopes: Array = field(repr=False)
    rows: Array = field(repr=False)
    n_data: int
    residual: Array = field(repr=False)
    inverse: Array = field(repr=False)
    unseen: Array = field(repr=False)
    scale: Array = field(repr=False)
    rank: int
    taken: list[tuple[Array, Array]] = field(init=False, repr=False, default_factory=list)

    @property
    def chi2(self) -> float:
        """Of all rows."""
        return float(self.residual @ self.residual)

    @property
    def dof(self) -> int:
        """Its expectation."""
        return len(self.residual) - self.rank

    @property
    def answers(self) -> tuple[Array, Array]:
        """`Geometry.answers` and their derivatives by the unknown numbers, shape (n,) and (n, n_unknown)."""
        if not self.taken:  # asked for in several places
            values = self.geometry.answers(self.parameters)
            rolls = [2, 6]

            def smooth(q: Array) -> Array:
                out = self.geometry.answers(q)
                away = np.remainder(out[..., rolls] - values[rolls] + np.pi, 2 * np.pi) - np.pi
                out[..., rolls] = values[rolls] + away
                return out

            self.taken.append((values, self.gradient(smooth)))
        return self.taken[0]

    def gradient(self, call: Callable[[Array], Array]) -> Array:
        """Derivatives of a function of the parameters by the unknown numbers, shape (n, n_unknown)."""
        active = np.concatenate([self.knowledge.free, self.knowledge.known])
        steps = self.geometry.layout.steps
        return self.knowledge.spread(derivative(call, self.parameters, steps, active))

    def covariance(self, gradient: Array) -> Array:
        """Of results with this gradient; infinite on the diagonal where one cannot be told."""
        out = gradient @ self.inverse @ gradient.T
        hidden = self.hidden(gradient)
        out[hidden] = out[:, hidden] = np.nan
        out[hidden, hidden] = np.inf
        return np.asarray(out)

    def hidden(self, gradient: Array) -> NDArray[np.bool_]:
        """Results that depend on what the rows leave open, shape (n,)."""
        sized = gradient / self.scale
        whole = np.linalg.norm(sized, axis=1)
        part = np.linalg.norm(sized @ self.unseen.T, axis=1)
        return np.asarray(part > TOUCHED * np.where(whole > 0, whole, 1.0))

    def budget(self, gradient: Array) -> dict[str, float]:
        """Standard deviation of one result by source; gradient of shape (n_unknown,)."""
        if self.hidden(gradient[None])[0]:
            return {}
        through = gradient @ self.inverse @ self.rows.T
        out = {"gyro noise": float(np.linalg.norm(through[: self.n_data]))}
        factor = self.knowledge.factor
        if factor.shape[1]:
            share = through[self.n_data :] @ np.linalg.pinv(factor)
            for name, places in self.knowledge.sources.items():
                out[name] = float(np.linalg.norm(share[places] @ factor[places]))
        return out


def whitened(covariance: Array, values: Array) -> Array:
    """Rows of three axes, each in its own noise; covariance (3, k, k), values (k, 3, ...) -> (3 k, ...)."""
    parts = [np.linalg.solve(np.linalg.cholesky(covariance[i]), values[:, i]) for i in range(3)]
    return np.concatenate(parts)


def solve(
    geometry: Geometry,
    knowledge: Knowledge,
    level: Array,
    covariance: Array,
    start: Array,
    near: Array | None = None,
) -> AlignmentSolution:
    """By Gauss and Newton.

    Parameters
    ----------
    level : ndarray, shape (n_stands, 3)
        Means of the gyros.
    covariance : ndarray, shape (3, n_stands, n_stands)
    start : ndarray
        All parameters beforehand.
    near : ndarray, optional
        Parameters close to the solution: derivatives are taken there and nowhere else.
    """
    task = _Task(geometry=geometry, knowledge=knowledge, level=level, covariance=covariance, start=start)
    if near is not None:
        slopes = task.slopes(near)
        return task.ended(task.settled(np.zeros(knowledge.size), slopes)[0], slopes)
    unknown, before = task.first(), np.inf
    slopes = task.slopes(knowledge.moved(start, unknown))
    for _ in range(MOST_SLOPES):
        unknown, way = task.settled(unknown, slopes)
        slopes = task.slopes(knowledge.moved(start, unknown))
        if way < CLOSE or way >= before:
            break
        before = way
    return task.ended(unknown, slopes)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    """What `solve` was given, and its steps."""

    geometry: Geometry
    knowledge: Knowledge
    level: Array
    covariance: Array
    start: Array

    def first(self) -> Array:
        """The unknown numbers with all that is known held.

        What is known enters the gyros multiplied by the rate of the Earth: at a rate of zero there is no derivative.
        """
        known = self.knowledge
        held = replace(known, known=known.known[:0], factor=np.zeros((0, 0)))
        alone = replace(self, knowledge=held)
        free, _ = alone.settled(np.zeros(held.size), alone.slopes(self.start))
        return np.concatenate([free, np.zeros(known.size - held.size)])

    def slopes(self, p: Array) -> Array:
        """Derivatives of the gyros by the unknown numbers, shape (n_stands, 3, n_unknown)."""
        active = np.concatenate([self.knowledge.free, self.knowledge.known])
        derivatives = derivative(self.geometry.gyros, p, self.geometry.layout.steps, active)
        return self.knowledge.spread(derivatives).reshape(self.geometry.n_stands, 3, -1)

    def settled(self, unknown: Array, slopes: Array) -> tuple[Array, float]:
        """Steps with the same derivatives, until they no longer get smaller; and the way they went in all."""
        whole, before = np.zeros(len(unknown)), np.inf
        scale = whole
        for _ in range(MOST_STEPS):
            change, solution = self.linear(unknown + whole, slopes)
            scale, step = solution.scale, float(np.abs(change * solution.scale).max(initial=0.0))
            if step >= before:
                break
            whole, before = whole + change, step
            if step < CLOSE:
                break
        return unknown + whole, float(np.abs(whole * scale).max(initial=0.0))

    def ended(self, unknown: Array, slopes: Array) -> AlignmentSolution:
        """One step more, and the least squares behind it."""
        change, _ = self.linear(unknown, slopes)
        return self.linear(unknown + change, slopes)[1]

    def linear(self, unknown: Array, slopes: Array) -> tuple[Array, AlignmentSolution]:
        """The linear least squares at these unknown numbers, and how they have to change."""
        known, p = self.knowledge, self.knowledge.moved(self.start, unknown)
        n_prior = known.factor.shape[1]
        data = whitened(self.covariance, slopes)
        prior = np.concatenate([np.zeros((n_prior, len(known.free))), np.eye(n_prior)], axis=1)
        rows = np.concatenate([data, prior])
        off = whitened(self.covariance, self.level - self.geometry.gyros(p))
        residual = np.concatenate([off, -unknown[len(known.free) :]])
        lengths = np.linalg.norm(rows, axis=0)
        scale = np.where(lengths > 0, lengths, 1.0)
        left, values, right = np.linalg.svd(rows / scale, full_matrices=len(rows) < len(scale))
        values = np.concatenate([values, np.zeros(len(scale) - len(values))])
        keep = values > RANK
        count = int(keep.sum())
        half = right[keep].T / values[keep] / scale[:, None]
        change = half @ (left[:, :count].T @ residual)
        return change, AlignmentSolution(
            geometry=self.geometry,
            knowledge=known,
            parameters=p,
            slopes=slopes,
            rows=rows,
            n_data=len(data),
            residual=residual - rows @ change,
            inverse=half @ half.T,
            unseen=right[~keep],
            scale=scale,
            rank=count,
        )
