# SPDX-License-Identifier: BSD-3-Clause
"""Which spectral lines pay their price.

A sinusoid whose frequency is known gains a chi-square(2) in 2 ln L where there is none. Its frequency is looked for
over w widths of a line, 1/record, and the largest gain x over them exceeds a level as often as the envelope of a
Gaussian process crosses it [1]; with the mean square slope of a record of that length, pi^2/3 per squared width,

    P(gain > x) = w sqrt(pi x/6) exp(-x/2),                                                                (1)

which is 1 % at the price of a line: 30 for the n/2 frequencies of 16 384 samples, 15 for one line whose place is given.

References
----------
.. [1] R. B. Davies, "Hypothesis testing when a nuisance parameter is present only under the alternative",
   Biometrika 74 (1987) 33, section 3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.selection.search import Letters

__all__ = ["FALSE_ALARM", "GIVEN_WIDTHS", "gains_of", "line_price", "steady_lines"]

#: Chance that noise alone pays the price.
FALSE_ALARM = 0.01
#: Widths over which a line is looked for whose frequency is given: three on either side.
GIVEN_WIDTHS = 6.0


def line_price(widths: float) -> float:
    """What a line must gain in 2 ln L that was looked for over so many widths: equation (1).

    >>> round(line_price(8192), 1), round(line_price(6), 1)
    (30.0, 14.8)
    """
    x = 2 * math.log(widths / FALSE_ALARM)
    for _ in range(50):  # a contraction: its slope is 1/x
        x = 2 * math.log(widths / FALSE_ALARM) + math.log(math.pi * x / 6)
    return x


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


def steady_lines(problem: LikelihoodProblem) -> tuple[list[float], tuple[str, ...]]:
    """Frequencies [Hz] of the lines of the spectrum whose phase is steady, and what is said of the others."""
    from allanite.spectrum import power_spectrum

    found = power_spectrum(problem.recording, problem.channel.name).lines
    unsteady = tuple(
        f"the line at {line.frequency:.4g} Hz is no sinusoid and stays in the record: {line.note}"
        for line in found
        if not line.stable
    )
    return [line.frequency for line in found if line.stable], unsteady
