# SPDX-License-Identifier: BSD-3-Clause
"""The mean rate of an axis in each pose, in noise that is given or that the quiet stretches themselves show.

Without a model the noise of each axis is a sum of white noise, noise of the angle (a vehicle that comes back, dither,
quantised angles) and flicker. Their shares are not searched for but averaged over: every pair of shares of a grid is
weighted by its restricted likelihood (Harville 1977, see `allanite.filtering.regression`) with the size profiled, every
B being as likely as every other before. Half an hour does not determine the flicker, and a maximum that happens to lie
at none of it would state far too small an interval.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.rate_vector.stretches import QUIET, AxisCells
from allanite.filtering.regression import Regression, regress
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, NoiseModel, Quantisation, White
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.residual_tests import CheckResult

__all__ = ["LevelRows", "Levels", "levels", "levels_of_record", "size_check"]

Array = NDArray[np.float64]

#: Rows are joined until they are no more than so many.
MOST_ROWS = 1024
#: Deviations of the angle noise (over one row) and of the flicker (its floor), over that of the white noise in a row.
ANGLE = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0)
FLICKER = (0.0, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4)
#: The size of the noise, which is asked of three axes, fails at this probability.
SIZE_ALARM = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelRows:
    """The quiet cells as rows of a regression.

    Attributes
    ----------
    dt : float [s]
    mean, part : ndarray, shape (n, axes)
        NaN and 0 where nothing is quiet.
    pose : ndarray of int64, shape (n,)
    """

    dt: float
    mean: Array
    part: Array
    pose: NDArray[np.int64]

    @classmethod
    def of(cls, cells: AxisCells, state: NDArray[np.int64], pose: NDArray[np.int64]) -> LevelRows:
        """Cells joined to at most MOST_ROWS rows; a row that would hold two poses keeps the cells of its first."""
        join = -(-cells.count // MOST_ROWS)
        n = -(-cells.count // join)
        pad = n * join - cells.count
        quiet = np.pad(state == QUIET, (0, pad)).reshape(n, join)
        owner = np.pad(pose, (0, pad), constant_values=-1).reshape(n, join)
        first = owner[np.arange(n), quiet.argmax(axis=1)]
        use = quiet & (owner == first[:, None])
        part = np.where(use[..., None], np.pad(cells.part, ((0, pad), (0, 0))).reshape(n, join, -1), 0.0)
        mean = np.nan_to_num(np.pad(cells.mean, ((0, pad), (0, 0)))).reshape(n, join, -1)
        weight = part.sum(axis=1)
        with np.errstate(invalid="ignore"):
            total = (part * mean).sum(axis=1) / weight
        return cls(dt=join * cells.dt, mean=total, part=np.minimum(weight / join, 1.0), pose=first)

    def columns(self) -> Array:
        """One column of ones for each pose, shape (n, n_poses)."""
        return np.asarray(self.pose[:, None] == np.arange(int(self.pose.max()) + 1)[None], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """Mean rates of one axis.

    Attributes
    ----------
    level : ndarray, shape (n_poses,)
    covariance : ndarray, shape (n_poses, n_poses)
    chi2, dof : float
        Of the residuals under a given model; equal without one.
    """

    level: Array
    covariance: Array
    chi2: float
    dof: float


def levels(rows: LevelRows, axis: int, model: NoiseModel) -> Levels:
    """Under a model, in SI."""
    fit = _regress(rows, axis, rows.mean[:, axis], model)
    return Levels(level=fit.coefficients, covariance=fit.covariance, chi2=fit.chi2, dof=fit.dof)


def size_check(given: Levels) -> CheckResult:
    """Do the quiet stretches scatter as the model says?"""
    p = chi_square_tail(given.chi2, given.dof)
    return CheckResult(statistic=given.chi2, dof=given.dof, p=p, passed=p >= SIZE_ALARM)


def levels_of_record(rows: LevelRows, axis: int, channel: str) -> Levels:
    """Under the noise that the rows show.

    Raises
    ------
    DataQualityError
        The means do not vary at all.
    """
    y = rows.mean[:, axis]
    offset, unit = float(np.nanmedian(y)), float(np.nanstd(y))
    if not unit > 1e-12 * abs(offset):
        raise DataQualityError(
            f"channel {channel!r}: the means of its quiet stretches do not vary, so their error is unknown; the sensor "
            "is stuck, or its samples are too coarse"
        )
    fits = []
    for angle in ANGLE:
        for flicker in FLICKER:
            fits.append(_regress(rows, axis, (y - offset) / unit, _candidate(angle, flicker, rows.dt)))
    dof = fits[0].dof
    size = np.array([f.chi2 / dof for f in fits])
    # the likelihood with the size of the noise at its best
    weight = np.array([(f.log_likelihood or 0.0) + 0.5 * f.chi2 for f in fits]) - 0.5 * dof * np.log(size)
    weight = np.exp(weight - weight.max()) * np.tile(np.gradient(FLICKER), len(ANGLE))
    weight /= weight.sum()
    level = np.array([f.coefficients for f in fits])
    mean = weight @ level
    spread = level - mean
    covariance = np.einsum("i,ijk->jk", weight * size, np.array([f.covariance for f in fits]))
    covariance += np.einsum("i,ij,ik->jk", weight, spread, spread)
    return Levels(level=mean * unit + offset, covariance=covariance * unit**2, chi2=dof, dof=dof)


def _candidate(angle: float, flicker: float, dt: float) -> NoiseModel:
    """Noise whose white part has the variance one in a row."""
    terms = [White(N=math.sqrt(dt))]
    extra = ([Quantisation(Q=angle * dt / math.sqrt(3))] if angle else []) + (
        [Flicker(B=flicker / math.sqrt(2 * math.log(2) / math.pi))] if flicker else []
    )
    return NoiseModel.of(*terms, *extra)


def _regress(rows: LevelRows, axis: int, y: Array, model: NoiseModel) -> Regression:
    table = rows.columns()
    return regress(
        y,
        table,
        model,
        dt=rows.dt,
        names=[str(i) for i in range(table.shape[1])],
        counts=rows.part[:, axis],
    )
