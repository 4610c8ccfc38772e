# SPDX-License-Identifier: BSD-3-Clause
"""The Allan curve of a residual, and how to read the noise from it.

A regression takes off not only the effect but also the part of the noise that looks like it: a random walk of which a
line was removed has half its Allan variance left at a quarter of the record. How much is known. Let X be the columns
with covariance C of their coefficients by generalised least squares under noise of covariance V, and X_s those that are
removed. Then Cov(noise, error of the coefficients) = X C, the residual has the covariance

    V - X C_s X_s' - X_s C_s' X' + X_s C_ss X_s',                                                       (1)

and its expected Allan variance at a lag is that of the noise less 2 sum(C_s A) - sum(C_ss A_ss), A being the Allan
covariances of the columns at that lag. It is more than that of the noise where columns that stay make the error of
those that go larger. The curve is divided by the part that is left. Lags at which that is not within 1 - `LEAST` of one
are not fitted: there the regression speaks, not the sensor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan import AllanCurve
from allanite.quantities.result import Result

__all__ = ["LEAST", "Correction", "allan_products", "correction_of"]

Array = NDArray[np.float64]

#: Part of the noise's Allan variance that has to be left at a lag that is fitted; and as much more it may be.
LEAST = 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction(Result):
    """What was removed, by averaging time.

    Attributes
    ----------
    tau : ndarray, shape (n,) [s]
        Octaves of the block length, up to half of the record.
    left : ndarray, shape (n,)
        Part of the Allan variance of the noise that is left in the residual.
    share : ndarray, shape (n,)
        Part of the Allan variance of the record that the effect made up.
    deviation : ndarray, shape (n,) [SI]
        Allan deviation of the removed effects.
    error : ndarray, shape (n,) [SI]
        Allan deviation of the error of the removed effects, one standard deviation.
    before, after : ndarray, shape (n,) [SI]
        Allan deviation of the block means of the record, and of the residual, corrected.
    longest : float [s]
        Averaging time from which the correction exceeds 1 - `LEAST`.
    """

    tau: Array
    left: Array
    share: Array
    deviation: Array
    error: Array
    before: Array
    after: Array
    longest: float

    def part_left(self, tau: ArrayLike) -> Array:
        """`left` at other averaging times; columns are smooth: below the first octave they matter ever less."""
        t = np.asarray(tau, dtype=np.float64)
        inside = np.interp(np.log(t), np.log(self.tau), self.left)
        below = 1 - (1 - self.left[0]) * (t / self.tau[0]) ** 2
        return np.asarray(np.where(t < self.tau[0], below, inside))

    def applied(self, curve: AllanCurve) -> AllanCurve:
        """A one-channel curve of the residual as that of the noise, lags out of reach marked as not to be fitted."""
        left = self.part_left(curve.tau)
        factor = 1 / np.sqrt(np.clip(left, 1 - LEAST, None))[:, None]
        return replace(
            curve,
            deviation=curve.deviation * factor,
            lower=curve.lower * factor,
            upper=curve.upper * factor,
            excluded=curve.excluded | (np.abs(1 - left) > 1 - LEAST)[:, None],
        )


def correction_of(
    columns: Array,
    covariance: Array,
    taken: NDArray[np.int64],
    values: Array,
    model: NoiseModel,
    signal: Array,
    dt: float,
) -> Correction:
    """What taking some columns off does to the Allan variance.

    Parameters
    ----------
    columns : ndarray, shape (n, k)
        All columns of the regression but the level, on blocks.
    covariance : ndarray, shape (k, k)
        Of their coefficients.
    taken : ndarray of int, shape (s,)
        Which are removed.
    values : ndarray, shape (s,)
        Their coefficients.
    model : NoiseModel
    signal : ndarray, shape (n,) [SI]
        Means of the blocks before; NaN where missing.
    dt : float [s]
        Length of a block.
    """
    n = len(columns)
    lags = 2 ** np.arange(int(np.log2(n // 2)) + 1)
    left, share, deviation, error, before, after = (np.empty(len(lags)) for _ in range(6))
    residual = signal - (columns[:, taken] - columns[:, taken].mean(axis=0)) @ values
    of_taken = covariance[np.ix_(taken, taken)]
    for i, m in enumerate(lags.tolist()):
        products = allan_products(columns, m)
        among = products[np.ix_(taken, taken)]
        missing = 2 * float((covariance[taken] * products[taken]).sum()) - float((of_taken * among).sum())
        noise = float(model.avar(m * dt))
        left[i] = 1 - missing / noise
        effect = float(values @ among @ values)
        whole = _allan_variance(signal, m)
        share[i] = min(effect / whole, 1.0) if whole > 0 else np.nan
        deviation[i] = np.sqrt(max(effect, 0.0))
        error[i] = np.sqrt(max(float((of_taken * among).sum()), 0.0))
        before[i] = np.sqrt(whole)
        after[i] = np.sqrt(_allan_variance(residual, m) / max(left[i], 1 - LEAST))
    beyond = np.flatnonzero(np.abs(1 - left) > 1 - LEAST)
    longest = float(lags[beyond[0]] * dt) if len(beyond) else n * dt
    return Correction(
        tau=np.asarray(lags * dt, dtype=np.float64),
        left=left,
        share=share,
        deviation=deviation,
        error=error,
        before=before,
        after=after,
        longest=longest,
    )


def allan_products(columns: Array, m: int) -> Array:
    """Allan covariances of columns at a lag of m rows, overlapping, shape (k, k)."""
    phase = np.concatenate(
        [np.zeros((1, columns.shape[1])), np.cumsum(columns - columns.mean(axis=0), axis=0)]
    )
    steps = (phase[2 * m :] - 2 * phase[m:-m] + phase[: -2 * m]) / m
    return np.asarray(steps.T @ steps / (2 * len(steps)))


def _allan_variance(signal: Array, m: int) -> float:
    """Of block means with gaps: terms whose whole window is present; all terms where there is none such."""
    present = np.isfinite(signal)
    filled = np.where(present, signal, np.nanmean(signal))
    phase = np.concatenate([[0.0], np.cumsum(filled - filled.mean())])
    steps = (phase[2 * m :] - 2 * phase[m:-m] + phase[: -2 * m]) / m
    missing = np.concatenate([[0], np.cumsum(~present)])
    whole = missing[2 * m :] == missing[: -2 * m]
    return float(np.mean(steps[whole] ** 2) / 2) if whole.any() else float(np.mean(steps**2) / 2)
