# SPDX-License-Identifier: BSD-3-Clause
"""What the steps of a converter do to means and to integrals, where no noise smooths them.

Rounding errors of samples that vary by a step and more are independent, and part of the white noise. A value that
stands still is rounded alike each time, and its error does not average out.

References
----------
.. [1] B. Widrow, I. Kollar, "Quantization Noise" (2008), chapter 4: the characteristic function of the rounding error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["RoundingSteps", "of_integrals", "of_means"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Values to either side of one in which the step is looked for.
BESIDE = 16
#: Multiples of a step are whole to this part of it; more values than this were never rounded.
UNEVEN, MANY = 0.05, 200_000
#: Means that differ by less than this part of a step are rounded alike.
SAME = 0.05
_SQUARES = np.arange(1, 40, dtype=np.float64) ** 2


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundingSteps:
    """The steps of a channel: those of floating-point numbers grow with the number.

    Attributes
    ----------
    levels : ndarray, shape (n,)
        All values that occur.
    step : ndarray, shape (n,)
        Least difference between values near each, of which all others are multiples; 0: none.
    """

    levels: Array
    step: Array

    @classmethod
    def of(cls, channel: Array) -> RoundingSteps:
        """From all samples of a channel; the step is 0 where values near are no multiples of one."""
        levels = np.unique(channel[np.isfinite(channel)])
        if not 2 <= len(levels) <= MANY:
            return cls(levels=levels, step=np.zeros(len(levels)))
        gaps = np.pad(np.diff(levels), BESIDE, constant_values=np.inf)
        near = np.lib.stride_tricks.sliding_window_view(gaps, 2 * BESIDE)
        step = near.min(axis=1)
        times = np.where(np.isfinite(near), near / step[:, None], 1.0)
        whole = np.abs(times - np.round(times)).max(axis=1) < UNEVEN
        return cls(levels=levels, step=np.where(whole, step, 0.0))

    def at(self, values: Array) -> Array:
        """The step at values."""
        if len(self.levels) == 0:
            return np.zeros_like(values)
        place = np.minimum(np.searchsorted(self.levels, values), len(self.levels) - 1)
        return np.asarray(self.step[place])


def of_means(steps: RoundingSteps, spans: Sequence[Array]) -> Array:
    """Covariance of the means of spans, shape (n, n).

    Notes
    -----
    A value that varies with the standard deviation s, in steps, is rounded with a mean error of the variance
    sum over n of exp(-4 pi^2 n^2 s^2)/(2 pi^2 n^2), in steps^2 [1]: 1/12 where nothing varies, nothing from s = 0.5 on.
    Two values alone do not tell s, and it is taken for nothing. Spans with the same mean have the same error.
    """
    n = len(spans)
    level, step, error = np.zeros(n), np.zeros(n), np.zeros(n)
    for k, samples in enumerate(spans):
        good = samples[np.isfinite(samples)]
        if len(good) == 0:
            continue
        level[k] = good.mean()
        step[k] = float(steps.at(level[k : k + 1])[0])
        if step[k] == 0:
            continue
        s2 = max(float(np.var(good)) / step[k] ** 2 - 1 / 12, 0.0) if len(np.unique(good)) > 2 else 0.0
        share = np.exp(-4 * math.pi**2 * _SQUARES * s2) / (2 * math.pi**2 * _SQUARES)
        error[k] = step[k] * math.sqrt(float(share.sum()))
    same = np.abs(level[:, None] - level[None]) < SAME * np.minimum(step[:, None], step[None])
    np.fill_diagonal(same, True)
    return np.asarray(same * np.outer(error, error) * (1 - 1e-9 * (1 - np.eye(n))))


def of_integrals(steps: RoundingSteps, samples: Array, edges: Index, dt: float) -> Array:
    """Variance of the integrals over stretches, shape (m,): that of every run of equal samples as one error.

    Parameters
    ----------
    steps : RoundingSteps
    samples : ndarray, shape (n,)
        Of all stretches, one after the other.
    edges : ndarray of int64, shape (m + 1,)
        Where each begins.
    dt : float [s]
    """
    begins = np.flatnonzero(np.diff(samples, prepend=np.nan) != 0)
    begins = np.union1d(begins, edges[:-1])
    lengths = np.diff(np.append(begins, len(samples)))
    part = (lengths * dt * steps.at(samples[begins])) ** 2 / 12 * (lengths > 1)
    return np.asarray(np.add.reduceat(part, np.searchsorted(begins, edges[:-1])))
