# SPDX-License-Identifier: BSD-3-Clause
"""Which spectral lines pay their price: what each gains."""

from __future__ import annotations

from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.selection.search import Letters

__all__ = ["gains_of"]


def gains_of(problem: LikelihoodProblem, letters: Letters) -> list[float]:
    """What the removal of each line alone would cost in 2 ln L, among all of them and these terms.

    Parameters
    ----------
    problem : LikelihoodProblem
        With all lines.
    """
    whole = problem.maximum(letters).log_likelihood
    less = (problem.with_line_left_in(i).maximum(letters) for i in range(len(problem.lines)))
    return [2 * (whole - maximum.log_likelihood) for maximum in less]
