# SPDX-License-Identifier: BSD-3-Clause
"""Quantiles and tails of the normal, chi-square, Student and F laws.

Those of the normal and chi-square laws come from a kernel: the import of SciPy's takes 0.2 s of processor time, as much
as the whole study of an hour.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = [
    "chi_square_quantile",
    "chi_square_quantiles",
    "chi_square_tail",
    "chi_square_tails",
    "f_quantile",
    "f_tail",
    "normal_quantile",
    "normal_quantiles",
    "student_quantile",
]


def chi_square_tail(x: float, dof: float) -> float:
    """Probability of more than x."""
    import numpy as np

    from allanite._kernels import gamma_tails

    return float(gamma_tails(np.array([dof / 2]), np.array([x / 2]))[1, 0])


def chi_square_tails(x: ArrayLike, dof: ArrayLike) -> Array:
    """Probabilities of less and of more than x, shape (2, ...)."""
    import numpy as np

    from allanite._kernels import gamma_tails

    x, dof = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(dof, dtype=np.float64))
    return gamma_tails(dof.ravel() / 2, x.ravel() / 2).reshape(2, *x.shape)


def chi_square_quantile(p: float, dof: float) -> float:
    """Value that is exceeded with probability 1 - p."""
    p, upper = float(p), bool(p >= 0.5)  # also of a whole number, or of NumPy's
    return 2 * _gamma_quantile(1 - p if upper else p, dof / 2, upper=upper)


def chi_square_quantiles(tail: ArrayLike, dof: ArrayLike, *, upper: bool = False) -> Array:
    """Values below which, or with `upper` above which, the law has the probability `tail`."""
    import numpy as np

    from allanite._kernels import gamma_quantiles

    tail, dof = np.broadcast_arrays(np.asarray(tail, dtype=np.float64), np.asarray(dof, dtype=np.float64))
    return 2 * gamma_quantiles(dof.ravel() / 2, tail.flatten(), upper).reshape(tail.shape)


def normal_quantile(p: float) -> float:
    """Value that is exceeded with probability 1 - p."""
    return math.copysign(math.sqrt(2 * _gamma_quantile(2.0 * min(p, 1 - p), 0.5, upper=True)), p - 0.5)


def normal_quantiles(p: ArrayLike) -> Array:
    """Values that are exceeded with probability 1 - p."""
    import numpy as np

    p = np.asarray(p, dtype=np.float64)
    size = np.sqrt(chi_square_quantiles(2 * np.minimum(p, 1 - p), 1.0, upper=True))
    return np.copysign(size, p - 0.5)


def _gamma_quantile(tail: float, shape: float, *, upper: bool) -> float:
    import numpy as np

    from allanite._kernels import gamma_quantiles

    return float(gamma_quantiles(np.array([shape]), np.array([tail]), upper)[0])


def student_quantile(p: float, dof: float) -> float:
    """Value that is exceeded with probability 1 - p."""
    from scipy.special import stdtrit

    return float(stdtrit(dof, p))


def f_quantile(p: float, dof: float, dof_below: float) -> float:
    """Value that a ratio of chi-squares, each over its degrees of freedom, exceeds with probability 1 - p."""
    from scipy.special import fdtri

    return float(fdtri(dof, dof_below, p))


def f_tail(x: float, dof: float, dof_below: float) -> float:
    """Probability of a ratio of more than x."""
    from scipy.special import fdtrc

    return float(fdtrc(dof, dof_below, x))
