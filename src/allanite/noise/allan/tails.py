# SPDX-License-Identifier: BSD-3-Clause
"""Do the samples behind a curve have heavy tails? A few stretches of the phase tell.

A second difference of the phase is the difference of two neighboring samples, and has half their excess kurtosis if
they are independent. Each stretch has a kurtosis of its own; the mean without the largest is taken, so that a level of
noise that steps does not look like tails.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

__all__ = ["kurtosis_of", "phase_kurtosis"]

_STRETCHES, _LENGTH = 32, 2048
_FEWEST, _SHORTEST = 8, 64  # stretches without a missing sample, and samples of each
_CERTAIN = 4.0  # standard errors
#: Excess kurtosis that widens the interval of N by some percent.
_SLIGHT = 0.3


def phase_kurtosis(x: NDArray[np.float64], missing: NDArray[np.int64]) -> float:
    """Excess kurtosis of the samples; 0.0 where it is slight or may be chance.

    Parameters
    ----------
    x : ndarray, shape (n_samples + 1,)
        Phase: the running sum of the samples.
    missing : ndarray of int64, shape (n_runs, 2)
        Runs of missing samples, sorted.
    """
    n = len(x) - 1
    length = min(_LENGTH, n // (2 * _FEWEST))
    if length < _SHORTEST:
        return 0.0
    count = min(_STRETCHES, n // length)
    starts = np.linspace(0, n - length, count).astype(np.int64)
    if len(missing):  # the first run that ends behind the start begins behind the end
        k = np.minimum(np.searchsorted(missing[:, 1], starts, side="right"), len(missing) - 1)
        clear = (missing[k, 1] <= starts) | (missing[k, 0] >= starts + length)
        starts = starts[clear]
    if len(starts) < _FEWEST:
        return 0.0
    d = np.diff(x[starts[:, None] + np.arange(length + 1)], n=2, axis=1)
    d = d - d.mean(axis=1, keepdims=True)
    kurtosis = kurtosis_of(d, without=1)
    return kurtosis if kurtosis > _SLIGHT else 0.0


def kurtosis_of(stretches: Iterable[NDArray[np.float64]], without: int = 0) -> float:
    """Excess kurtosis of independent samples from stretches of their differences; 0.0 where it may be chance.

    Parameters
    ----------
    stretches : iterable of ndarray
        Second differences of the phase; a stretch in which nothing moves does not count.
    without : int
        Stretches of the largest kurtosis that are left out.
    """
    excesses, used = [], 0
    for d in stretches:
        largest = float(np.abs(d).max(initial=0.0))
        if largest > 0:
            square = (d / largest) ** 2  # the fourth power of a small number is zero
            excesses.append(float((square * square).mean()) / float(square.mean()) ** 2 - 3.0)
            used += len(d)
    kept = sorted(excesses)[: len(excesses) - without]
    if not kept:
        return 0.0
    kurtosis = 2.0 * float(np.mean(kept))
    # of the kurtosis of n normal numbers the variance is 24/n; neighbors share a sample
    chance = 2.0 * math.sqrt(24.0 * 2.0 / used)
    return kurtosis if kurtosis > _CERTAIN * chance else 0.0
