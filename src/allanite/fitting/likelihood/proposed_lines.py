# SPDX-License-Identifier: BSD-3-Clause
"""Which spectral lines may be terms: those that a user names, or the steady ones of the spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from allanite.fitting.likelihood.lines import FEWEST_PERIODS, GIVEN_WIDTHS, checked_lines
from allanite.fitting.likelihood.problem import LikelihoodProblem
from allanite.fitting.lines_left_in import LineLeftIn, spectral_lines, unsteady
from allanite.lazy_dataclasses import dataclass

__all__ = ["AskedLines", "ProposedLines", "proposed_lines"]

#: Frequencies [Hz], or those that the spectrum shows.
AskedLines = Sequence[float] | Literal["auto"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProposedLines:
    """Lines that may be terms.

    Attributes
    ----------
    frequencies : tuple of float [Hz]
    left_in : tuple of LineLeftIn
        Lines of the spectrum that cannot be terms; none where the frequencies were named.
    widths : float
        Over how many widths of a line, 1/record, each was looked for.
    """

    frequencies: tuple[float, ...]
    left_in: tuple[LineLeftIn, ...]
    widths: float


def proposed_lines(problem: LikelihoodProblem, lines: AskedLines) -> ProposedLines:
    """Lines that may be terms.

    Raises
    ------
    InputError
        Neither "auto" nor frequencies.
    """
    if not (isinstance(lines, str) and lines == "auto"):
        return ProposedLines(frequencies=tuple(checked_lines(lines)), left_in=(), widths=GIVEN_WIDTHS)
    lowest = FEWEST_PERIODS / (problem.n_samples * problem.dt)
    lines_seen = spectral_lines(problem.recording, problem.channel.name)
    steady = [line for line in lines_seen if line.stable]
    short = [LineLeftIn(frequency=line.frequency, note="") for line in steady if line.frequency < lowest]
    return ProposedLines(
        frequencies=tuple(line.frequency for line in steady if line.frequency >= lowest),
        left_in=(*unsteady(lines_seen), *short),
        widths=problem.n_samples / 2,
    )
