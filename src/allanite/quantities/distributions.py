# SPDX-License-Identifier: BSD-3-Clause
"""Quantiles and tails of the normal, chi-square and Student laws, without the 0.8 s that SciPy's statistics cost."""

from __future__ import annotations

__all__ = ["chi_square_quantile", "chi_square_tail", "normal_quantile", "student_quantile"]


def chi_square_tail(x: float, dof: float) -> float:
    """Probability of more than x."""
    from scipy.special import chdtrc

    return float(chdtrc(dof, x))


def chi_square_quantile(p: float, dof: float) -> float:
    """Value that is exceeded with probability 1 - p."""
    from scipy.special import chdtri

    return float(chdtri(dof, 1 - p))


def normal_quantile(p: float) -> float:
    """Value that is exceeded with probability 1 - p."""
    from scipy.special import ndtri

    return float(ndtri(p))


def student_quantile(p: float, dof: float) -> float:
    """Value that is exceeded with probability 1 - p."""
    from scipy.special import stdtrit

    return float(stdtrit(dof, p))
