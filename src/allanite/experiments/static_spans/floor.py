# SPDX-License-Identifier: BSD-3-Clause
"""How much a sensor at rest moves, from a record most of which may be disturbed."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.distributions import chi_square_quantile

__all__ = ["chi_square", "lowest_level", "ratio_quantile"]

Array = NDArray[np.float64]


def chi_square(dof: float, p: float) -> float:
    """Quantile of chi-square over its degrees of freedom."""
    return chi_square_quantile(p, dof) / dof


def ratio_quantile(dof: float, floor_dof: float, tail: float) -> float:
    """Energy of `dof` degrees over a floor known by `floor_dof` that comes with this small probability, or more.

    Fisher's law; chi-square where the floor is known without error.
    """
    from scipy.special import betaincinv, chdtri

    if math.isinf(floor_dof):
        return float(chdtri(dof, tail)) / dof
    # by the lower tail of the beta law, which keeps its digits where 1 - tail would lose them
    x = float(betaincinv(0.5 * floor_dof, 0.5 * dof, tail))
    return math.inf if x == 0.0 else floor_dof * (1.0 - x) / (dof * x)


def lowest_level(energy: Array, dof: float, high: float, start: float = 0.05) -> float:
    """The lowest level that is the mean of the windows below `high` times it; infinite where samples hardly vary.

    Parameters
    ----------
    energy : ndarray, shape (n,)
        Of windows, each chi-square over `dof` at rest; NaN: missing.
    dof : float
    high : float
        Quantile over the level, above which a window is disturbed.
    start : float
        Share of the windows that is taken for quiet to begin with; with fewer quiet ones the floor is too high.
    """
    known = np.sort(energy[~np.isnan(energy)])
    varied = known[known > 0]
    if len(varied) == 0 or 2 * len(varied) < len(known):
        return math.inf
    level = float(np.quantile(varied, start)) / max(chi_square(dof, start), 0.1)
    sums = np.concatenate(([0.0], np.cumsum(varied)))
    for _ in range(100):
        count = max(int(np.searchsorted(varied, high * level)), 1)
        new = float(sums[count]) / count
        if abs(new - level) <= 1e-6 * level:
            break
        level = new
    return level
