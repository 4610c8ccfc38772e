# SPDX-License-Identifier: BSD-3-Clause
"""The vectors of all poses, their covariance, their common length and its interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_vector.levels import LevelRows, Levels, levels, levels_of_record, size_check
from allanite.experiments.rate_vector.stretches import QUIET, AxisCells
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.distributions import normal_quantile, student_quantile
from allanite.quantities.residual_tests import CheckResult

__all__ = ["Vectors", "interval_of"]

Array = NDArray[np.float64]
States = NDArray[np.int64]

#: Batches of quiet cells whose scatter is asked, as far as there are two cells in each.
BATCHES = (8, 16, 32)
#: Length over its largest standard deviation below which the noise bends the length of the mean.
BENT = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Vectors:
    """Vectors of all poses.

    Attributes
    ----------
    level : ndarray, shape (n_poses, 3)
    covariance : ndarray, shape (3, n_poses, n_poses)
        The axes are independent.
    share : ndarray, shape (n_poses,)
        Of the quiet time.
    rows : int
    size : tuple of (str, CheckResult)
        Does an axis scatter as its model says? By channel.
    stretch : float
        Student's quantile over the normal one.
    """

    level: Array
    covariance: Array
    share: Array
    rows: int
    size: tuple[tuple[str, CheckResult], ...]
    stretch: float = 1.0

    @classmethod
    def of(cls, rows: LevelRows, names: Sequence[str], models: Sequence[NoiseModel | None]) -> Vectors:
        """By regression, axis by axis, in the noise of the model unless the record contradicts it."""
        axis_levels, checks = [], []
        for axis, (name, model) in enumerate(zip(names, models, strict=True)):
            given = None if model is None else levels(rows, axis, model)
            if given is not None:
                checks.append((name, size_check(given)))
                if checks[-1][1].passed:
                    axis_levels.append(given)
                    continue
            axis_levels.append(_wider(levels_of_record(rows, axis, name), given))
        time = np.bincount(rows.pose[rows.pose >= 0], rows.part.mean(axis=1)[rows.pose >= 0])
        return cls(
            level=np.stack([f.level for f in axis_levels], axis=1),
            covariance=np.stack([f.covariance for f in axis_levels]),
            share=time / time.sum(),
            rows=int((rows.part > 0).all(axis=1).sum()),
            size=tuple(checks),
        )

    @property
    def longest(self) -> int:
        """The pose with the most quiet time."""
        return int(np.argmax(self.share))

    def covariance_of(self, pose: int) -> Array:
        """Covariance of the vector of a pose, shape (3, 3)."""
        return np.diag(self.covariance[:, pose, pose])

    @property
    def directions(self) -> Array:
        """Unit vectors, shape (n_poses, 3)."""
        size = np.linalg.norm(self.level, axis=1, keepdims=True)
        return np.asarray(self.level / np.where(size > 0, size, 1.0))

    @property
    def length(self) -> float:
        """Without the second-order part that noise adds."""
        noise = np.einsum("aii->i", self.covariance)
        square = float(self.share @ ((self.level**2).sum(axis=1) - noise))
        return math.sqrt(max(square, 0.0))

    @property
    def projected(self) -> float:
        """Standard deviation along the vectors."""
        weights = self.share[:, None] * self.directions
        return math.sqrt(float(np.einsum("ia,aij,ja->", weights, self.covariance, weights)))

    @property
    def largest(self) -> float:
        """Standard deviation in the noisiest direction."""
        return math.sqrt(float(np.einsum("i,aij,j->a", self.share, self.covariance, self.share).max()))

    @property
    def sd(self) -> float:
        """Of the length."""
        return self.largest if self.bent else self.projected

    @property
    def bent(self) -> bool:
        """True where the length is not a linear function of the vector within its noise."""
        return self.length < BENT * self.largest

    def widened(self, cells: AxisCells, state: States, pose: States, confidence: float) -> Vectors:
        """With Student's law, and wide enough for the scatter of batches of quiet cells."""
        p = (1 + confidence) / 2
        quantile = student_quantile(p, max(self.rows - len(self.share), 1))
        quiet = state == QUIET
        along = (cells.mean[quiet] * self.directions[pose[quiet]]).sum(axis=1)
        along -= (self.level * self.directions).sum(axis=1)[pose[quiet]]
        half = quantile * self.projected
        for count in BATCHES:
            if len(along) >= 2 * count:
                means = np.array([part.mean() for part in np.array_split(along, count)])
                error = float(means.std(ddof=1)) / math.sqrt(count)
                half = max(half, student_quantile(p, count - 1) * error)
        factor = half / (quantile * self.projected) if self.projected > 0 else 1.0
        return replace(self, covariance=self.covariance * factor**2, stretch=quantile / normal_quantile(p))


def _wider(record_levels: Levels, given: Levels | None) -> Levels:
    """Levels of the record's own noise, with no less than the standard deviations of the model."""
    if given is None:
        return record_levels
    grow = np.sqrt(np.maximum(np.diag(given.covariance) / np.diag(record_levels.covariance), 1.0))
    return Levels(
        level=record_levels.level,
        covariance=record_levels.covariance * np.outer(grow, grow),
        chi2=record_levels.chi2,
        dof=record_levels.dof,
    )


def interval_of(vectors: Vectors, total: float, confidence: float) -> tuple[float, float]:
    """Of the length."""
    p = (1 + confidence) / 2
    if not vectors.bent:
        half = vectors.stretch * normal_quantile(p) * total
        return vectors.length - half, vectors.length + half
    return _bent_interval(vectors.length, total * vectors.stretch, 1 - p)


def _bent_interval(length: float, sd: float, tail: float) -> tuple[float, float]:
    """Lengths w for which |m|^2/sd^2, non-central chi-square with three degrees, is not in either tail."""
    from scipy.optimize import brentq
    from scipy.stats import ncx2

    statistic = (length / sd) ** 2 + 3

    def root(p: float) -> float:
        if float(ncx2.cdf(statistic, 3, 1e-12)) <= p:
            return 0.0
        top = (math.sqrt(statistic) + 10) ** 2
        return sd * math.sqrt(float(brentq(lambda x: float(ncx2.cdf(statistic, 3, x)) - p, 1e-12, top)))

    return root(1 - tail), root(tail)
