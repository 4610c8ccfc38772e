# SPDX-License-Identifier: BSD-3-Clause
"""Which spectral lines pay their price: what each gains."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.selection.search import Letters

__all__ = ["gains_of"]


def gains_of(problem: LikelihoodProblem, letters: Letters, frequencies: Sequence[float]) -> list[float]:
    """What the removal of each line alone would cost in 2 ln L, among all of them and these terms.

    Parameters
    ----------
    problem : LikelihoodProblem
        With all lines.
    frequencies : sequence of float [Hz]
        Of its lines.
    """
    whole = problem.maximum(letters).log_likelihood
    gains = []
    for i in range(len(frequencies)):
        less = problem.with_lines([f for j, f in enumerate(frequencies) if j != i])
        gains.append(2 * (whole - less.maximum(letters).log_likelihood))
    return gains
