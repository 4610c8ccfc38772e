# SPDX-License-Identifier: BSD-3-Clause
"""How large a test statistic becomes by chance where coefficients may not be negative.

Near the truth the curve of record r, whitened, is z_r = U_r theta_r + e, e standard normal, and no coefficient is
negative. The loss of making parameters equal is then the difference of two distances from a cone, which is
chi-square only where all coefficients are well away from zero. Elsewhere its law is a mixture [1]; it is drawn
here, and kept as a chi-square law with the mean of the draws as degrees of freedom, scaled to their 95 % point.

References
----------
.. [1] S. Self, K.-Y. Liang, "Asymptotic properties of maximum likelihood estimators and likelihood ratio tests under
   nonstandard conditions", JASA 82 (1987) 605.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile, chi_square_tail

__all__ = ["Directions", "EqualityLoss", "ScaledChiSquare"]

Array = NDArray[np.float64]

_DRAWS = 1000
_LEVEL = 0.95
_FEW = 5  # columns of a cone whose faces are tried one after the other
_STEPS, _SETTLED = 60, 1e-12  # of Newton's method, and what the next step may still gain
_CERTAIN = 4.0  # standard deviations from zero beyond which the border is out of reach


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaledChiSquare:
    """A scaled chi-square law."""

    dof: float
    scale: float = 1.0

    def tail(self, value: float) -> float:
        """Probability of more than `value`."""
        return chi_square_tail(max(value, 0.0) / self.scale, self.dof) if self.dof > 0 else 1.0

    def quantile(self, p: float) -> float:
        """Value that is exceeded with probability 1 - p."""
        return self.scale * chi_square_quantile(p, self.dof) if self.dof > 0 else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Directions:
    """How the whitened curve of one record changes with its parameters.

    Attributes
    ----------
    shared : ndarray, shape (n_lags, n_shared)
        With the parameters that are to be equal, in units common to all records.
    alone : ndarray, shape (n_lags, n_own)
        With parameters of this record alone.
    floor : ndarray, shape (n_own,)
        How far below its true value each of them may go (to zero); infinite: as far as it likes.
    """

    shared: Array
    alone: Array
    floor: Array

    @classmethod
    def of_shared(cls, shared: Array) -> Directions:
        """Of a record without parameters of its own."""
        return cls(shared=shared, alone=np.zeros((len(shared), 0)), floor=np.zeros(0))


@dataclass(frozen=True, slots=True)
class EqualityLoss:
    """The loss of making the shared parameters equal: of whitened curves, and of chance.

    Attributes
    ----------
    records : tuple of _Reduced
    bounded : ndarray of bool, shape (n_shared,)
        Shared parameters that may come so near to zero that it counts.
    offset : ndarray, shape (n_shared,)
        How far those are from zero.
    """

    records: tuple[_Reduced, ...]
    bounded: NDArray[np.bool_]
    offset: Array

    @classmethod
    def of(cls, records: Sequence[Directions], floor: Sequence[float]) -> EqualityLoss:
        """From the directions of each record.

        Parameters
        ----------
        records : sequence of Directions
        floor : sequence of float, length n_shared
            How far below its true value each shared parameter may go (to zero); infinite: as far as it likes.
        """
        reduced = tuple(_Reduced.of(r) for r in records)
        bounded = _bounded([r.shared for r in reduced], np.asarray(floor, dtype=np.float64))
        return cls(reduced, bounded, np.where(bounded, floor, 0.0))

    def loss(self, residuals: Sequence[Array]) -> float:
        """Of the whitened residuals of each record, shape (n_lags,), from the curve at the true values."""
        points = [(z @ r.basis)[None] for z, r in zip(residuals, self.records, strict=True)]
        return max(float(self._losses(points)[0]), 0.0)

    def law(self) -> ScaledChiSquare:
        """Of the loss where the residuals are nothing but noise."""
        shared = [r.shared for r in self.records]
        if not self.bounded.any() and all(r.alone.shape[1] == 0 for r in self.records):
            rank = sum(_rank(s) for s in shared) - _rank(np.concatenate(shared))
            return ScaledChiSquare(dof=float(rank))
        rng = np.random.default_rng(952)
        draws = self._losses([rng.standard_normal((_DRAWS, len(s))) for s in shared])
        mean = float(draws.mean())
        if mean < 1e-9:
            return ScaledChiSquare(dof=0.0)
        return ScaledChiSquare(
            dof=mean, scale=float(np.quantile(draws, _LEVEL)) / chi_square_quantile(_LEVEL, mean)
        )

    def _losses(self, points: Sequence[Array]) -> Array:
        """Of points of each record in its coordinates, shape (n_points, n)."""
        n = len(self.bounded)
        y = [p + r.shared @ self.offset + r.away for p, r in zip(points, self.records, strict=True)]
        apart = [
            _Cone(np.concatenate([r.shared, r.alone], axis=1), n, self.bounded)(point)
            for r, point in zip(self.records, y, strict=True)
        ]
        if n == 1 and not self.bounded.any():
            together = _with_one_shared([(r.shared[:, 0], r.alone) for r in self.records], y)
        else:
            stacked = _stacked([r.shared for r in self.records], [r.alone for r in self.records])
            together = _Cone(stacked, n, self.bounded)(np.concatenate(y, axis=1))
        return np.asarray(together - np.sum(apart, axis=0))


@dataclass(frozen=True, slots=True)
class _Reduced:
    """Directions without what the free own ones explain, in few coordinates.

    Attributes
    ----------
    basis : ndarray, shape (n_lags, n)
    shared, alone : ndarray, shape (n, n_shared) and (n, n_own)
        Of the own directions those whose border is within reach, of unit length.
    away : ndarray, shape (n,)
        How far the truth is from the borders of the own ones.
    """

    basis: Array
    shared: Array
    alone: Array
    away: Array

    @classmethod
    def of(cls, record: Directions) -> _Reduced:
        n = record.shared.shape[1]
        near = _near(record)
        columns = np.concatenate([record.shared, record.alone[:, near]], axis=1)
        if not near.all():
            q = np.linalg.qr(_unit(record.alone[:, ~near]))[0]
            columns = columns - q @ (q.T @ columns)
        basis, r = np.linalg.qr(columns)
        bounded = r[:, n:]
        norms = np.linalg.norm(bounded, axis=0)
        kept = norms > 1e-9 * np.linalg.norm(record.alone[:, near], axis=0)
        away = bounded[:, kept] @ record.floor[near][kept]
        return cls(basis, r[:, :n], bounded[:, kept] / norms[kept], away)


def _near(record: Directions) -> NDArray[np.bool_]:
    """Own parameters whose border is within reach, judged by what all other directions leave of theirs."""
    every = np.concatenate([record.shared, record.alone], axis=1)
    n = record.shared.shape[1]
    near = np.isfinite(record.floor)
    for j in np.flatnonzero(near):
        others = _unit(np.delete(every, n + j, axis=1))
        left = record.alone[:, j] - others @ np.linalg.lstsq(others, record.alone[:, j], rcond=1e-10)[0]
        near[j] = record.floor[j] * float(np.linalg.norm(left)) < _CERTAIN
    return near


def _unit(columns: Array) -> Array:
    norms = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(norms > 0, norms, 1.0))


def _rank(columns: Array) -> int:
    return int(np.linalg.matrix_rank(_unit(columns), tol=1e-9))


def _bounded(shared: Sequence[Array], floor: Array) -> NDArray[np.bool_]:
    """Shared parameters for which zero is within reach of the weakest record."""
    reach = np.zeros(len(floor))
    for s in shared:
        norms = np.linalg.norm(s, axis=0)
        with np.errstate(divide="ignore"):
            reach = np.maximum(reach, np.where(norms > 0, 1 / norms, 0.0))
    return np.asarray(np.isfinite(floor) & (floor < _CERTAIN * reach))


def _stacked(shared: Sequence[Array], sided: Sequence[Array]) -> Array:
    """All records below one another: shared columns first, then the own ones of each."""
    n = shared[0].shape[1]
    out = np.zeros((sum(map(len, shared)), n + sum(s.shape[1] for s in sided)))
    row, column = 0, n
    for a, b in zip(shared, sided, strict=True):
        out[row : row + len(a), :n] = a
        out[row : row + len(a), column : column + b.shape[1]] = b
        row, column = row + len(a), column + b.shape[1]
    return out


class _Cone:
    """Squared distance of a point from the cone of some columns; the first ones may be free of sign."""

    def __init__(self, columns: Array, n_shared: int, bounded: NDArray[np.bool_]) -> None:
        free = np.zeros(columns.shape[1], dtype=bool)
        free[:n_shared] = ~bounded
        self._q = np.linalg.qr(_unit(columns[:, free]))[0] if free.any() else np.zeros((len(columns), 0))
        rest = columns[:, ~free]
        self._rest = _unit(rest - self._q @ (self._q.T @ rest))

    def __call__(self, y: Array) -> Array:
        """For points of shape (n_points, n_coordinates)."""
        y = y - (y @ self._q) @ self._q.T
        if self._rest.shape[1] <= _FEW:
            return np.asarray((y**2).sum(axis=1) - self._explained(y))
        from scipy.optimize import nnls

        return np.array([nnls(self._rest, point)[1] ** 2 for point in y])

    def _explained(self, y: Array) -> Array:
        """Squared length of the projection: the longest of those on a face whose coefficients are not negative."""
        best = np.zeros(len(y))
        for _, length in _faces(self._rest, y):
            best = np.maximum(best, length)
        return best


def _faces(columns: Array, y: Array) -> Iterator[tuple[Array, Array]]:
    """Projections of points on every face of a cone, (n_coordinates, n_coordinates), and the squared length of each.

    The length is 0 where a coefficient is negative: that face is not the nearest part of the cone.
    """
    for size in range(1, columns.shape[1] + 1):
        for face in itertools.combinations(range(columns.shape[1]), size):
            of_face = columns[:, face]
            inverse = np.linalg.pinv(of_face, rcond=1e-10)
            x = y @ inverse.T
            length = ((x @ of_face.T) ** 2).sum(axis=1)
            yield of_face @ inverse, np.where(np.all(x >= 0, axis=1), length, 0.0)


def _with_one_shared(records: Sequence[tuple[Array, Array]], points: Sequence[Array]) -> Array:
    """Squared distance from the cone of the directions of each record and one parameter that all share, of any sign.

    At a value of the shared parameter each record is by itself, so the work grows with the number of records, not with
    its cube. The sum of their distances is convex: Newton's steps, halved between the ends that slopes of either sign
    have set, reach its least value.

    Parameters
    ----------
    records : sequence of (ndarray, shape (n,), ndarray, shape (n, n_own))
        Direction of the shared parameter, and those of the own ones, which are not negative.
    points : sequence of ndarray, shape (n_points, n)
    """
    x = np.zeros(len(points[0]))
    low, high = np.full_like(x, -np.inf), np.full_like(x, np.inf)
    for _ in range(_STEPS):
        distance, slope, bend = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
        for (along, alone), y in zip(records, points, strict=True):
            rest = y - x[:, None] * along
            left, curved, best = rest.copy(), np.full_like(x, along @ along), np.zeros_like(x)
            for projection, length in _faces(alone, rest):
                nearer = length > best
                best = np.where(nearer, length, best)
                left[nearer] = (rest - rest @ projection)[nearer]
                curved[nearer] = along @ along - along @ projection @ along
            distance += (left**2).sum(axis=1)
            slope -= left @ along
            bend += curved
        low, high = np.where(slope < 0, x, low), np.where(slope > 0, x, high)
        step = -slope / np.maximum(bend, 1e-300)
        if np.all(np.abs(slope * step) <= _SETTLED * np.maximum(distance, 1.0)):
            return np.asarray(distance + slope * step)
        with np.errstate(invalid="ignore"):  # an end that is not set yet is not crossed
            x = np.where((low <= x + step) & (x + step <= high), x + step, (low + high) / 2)
    return distance
