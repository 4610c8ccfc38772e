# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients that vary together from unit to unit.

The estimates of the units, each over what its lot and conditions let expect, are replaced by normal scores of their
ranks, so that neither tails nor scales matter. Their correlation r has atanh(r) normal with variance 1/(n - 3) [1].
Pairs whose correlation differs from zero are chosen by Holm's procedure [2]: the chance that any of them is false is at
most the stated one. Units that give an upper limit in one of two coefficients do not take part in that pair.

References
----------
.. [1] R. Fisher, "On the 'probable error' of a coefficient of correlation deduced from a small sample", Metron 1
   (1921) 3.
.. [2] S. Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Stat. 6 (1979) 65.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.quantity import Quantity
from allanite.stability.fleet.results import UnitCorrelation

__all__ = ["correlated_pairs"]

Array = NDArray[np.float64]

_FEWEST = 10  # units of a pair


def correlated_pairs(
    names: Sequence[tuple[str, str]], values: Array, confidence: float
) -> tuple[tuple[UnitCorrelation, ...], int]:
    """Pairs whose correlation over units differs from zero, the strongest first, and how many pairs were tested.

    Parameters
    ----------
    names : sequence of (str, str)
        Channel and symbol of each coefficient.
    values : ndarray, shape (n_units, n_coefficients)
        Estimates; NaN where a unit gives a limit only.
    confidence : float
        Of each interval; the chance that any pair is false is at most one less this.
    """
    from scipy.special import ndtr, ndtri

    tested: list[tuple[float, UnitCorrelation]] = []
    for i, j in combinations(range(len(names)), 2):
        pair = values[:, [i, j]]
        known = np.isfinite(pair).all(axis=1)
        n = int(known.sum())
        if n < _FEWEST:
            continue
        r = _correlation(pair[known])
        width = float(ndtri(0.5 + confidence / 2)) / math.sqrt(n - 3)
        z = math.atanh(r)
        p = 2 * float(ndtr(-abs(z) * math.sqrt(n - 3)))
        made = UnitCorrelation(
            first=f"{names[i][1]} of {names[i][0]}",
            second=f"{names[j][1]} of {names[j][0]}",
            correlation=Quantity.of(r, (math.tanh(z - width), math.tanh(z + width)), "1"),
            units=n,
            left_out=int(np.isfinite(pair).any(axis=1).sum()) - n,
        )
        tested.append((p, made))
    tested.sort(key=lambda item: item[0])
    chosen = []
    for rank, (p, made) in enumerate(tested):
        if p * (len(tested) - rank) > 1 - confidence:
            break
        chosen.append(made)
    return tuple(sorted(chosen, key=lambda c: -abs(c.correlation.value))), len(tested)


def _correlation(pair: Array) -> float:
    """Of normal scores."""
    from scipy.special import ndtri
    from scipy.stats import rankdata

    a, b = ndtri((rankdata(pair, axis=0) - 0.5) / len(pair)).T  # of mean 0, by symmetry
    r = float(a @ b) / math.sqrt(float(a @ a) * float(b @ b))
    return min(max(r, -0.999999), 0.999999)
