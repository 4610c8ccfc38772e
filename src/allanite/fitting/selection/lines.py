# SPDX-License-Identifier: BSD-3-Clause
"""Which spectral lines pay their price: what each gains, and which lines of the spectrum are worth a try."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.lines import FEWEST_PERIODS
from allanite.fitting.selection.results import LineLeftIn
from allanite.fitting.selection.search import Letters

__all__ = ["gains_of", "steady_lines"]


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


def steady_lines(problem: LikelihoodProblem) -> tuple[list[float], tuple[LineLeftIn, ...]]:
    """Frequencies [Hz] of the lines of the spectrum whose phase is steady, and the others."""
    from allanite.noise.spectrum.estimation import power_spectrum

    lines = power_spectrum(problem.recording, problem.channel.name).lines
    lowest = FEWEST_PERIODS / (problem.n_samples * problem.dt)
    steady = [line for line in lines if line.stable]
    left_in = [LineLeftIn(frequency=line.frequency, note=line.note) for line in lines if not line.stable]
    left_in += [LineLeftIn(frequency=line.frequency, note="") for line in steady if line.frequency < lowest]
    return [line.frequency for line in steady if line.frequency >= lowest], tuple(left_in)
