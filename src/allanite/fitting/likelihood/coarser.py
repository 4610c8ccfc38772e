# SPDX-License-Identifier: BSD-3-Clause
"""The part of a record that a sum of terms explains: all of it, or its means over so many samples.

A sensor's own filter bends what happens within some samples, and no term is like that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from allanite.fitting.likelihood.problem import LikelihoodProblem

__all__ = ["EXPLAINED", "NOT_EXPLAINED", "explained_part"]

Found = TypeVar("Found")

#: Goodness below which the shortest means are left out, and that which is enough then.
NOT_EXPLAINED, EXPLAINED = 1e-4, 1e-2
_COARSER = (4, 16, 64, 256)  # samples
_FEWEST_ROWS = 1000


def explained_part(
    problem: LikelihoodProblem, judge: Callable[[LikelihoodProblem], tuple[Found, float]]
) -> Found:
    """Longer and longer means, until a sum of terms explains the rest; the whole record where none does.

    Parameters
    ----------
    problem : LikelihoodProblem
        Of the whole record.
    judge : callable
        What is found in a problem, and how well that explains it (the p value).
    """
    whole, p = judge(problem)
    if p >= NOT_EXPLAINED:
        return whole
    for block in _COARSER:
        if problem.n_samples // block < _FEWEST_ROWS:
            break
        judged, p = judge(problem.coarser(block))
        if p >= EXPLAINED:
            return judged
    return whole
