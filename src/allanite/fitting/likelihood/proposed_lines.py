# SPDX-License-Identifier: BSD-3-Clause
"""Which spectral lines may be terms: those that a user names, or the steady ones of the spectrum."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Literal

from allanite.fitting.likelihood.lines import GIVEN_WIDTHS, checked_lines
from allanite.fitting.likelihood.problem import LikelihoodProblem
from allanite.fitting.lines_left_in import LineLeftIn, spectral_lines, unsteady
from allanite.lazy_dataclasses import dataclass

__all__ = ["AskedLines", "ProposedLines", "is_automatic", "proposed_lines"]

#: Frequencies [Hz], or those that the spectrum shows.
AskedLines = Sequence[float] | Literal["auto"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProposedLines:
    """Lines that may be terms.

    Attributes
    ----------
    frequencies : tuple of float [Hz]
    automatic : bool
        Found in the spectrum, rather than named by the user.
    left_in : tuple of LineLeftIn
        Lines of the spectrum that are no sinusoids.
    widths : float
        Over how many widths of a line, 1/record, each was looked for.
    """

    frequencies: tuple[float, ...]
    automatic: bool
    left_in: tuple[LineLeftIn, ...]
    widths: float

    def without(self, weak: Collection[float]) -> ProposedLines:
        """The same without lines that noise alone explains."""
        rest = tuple(f for f in self.frequencies if f not in weak)
        left_in = (LineLeftIn(frequency=f, note="the model explains it as noise") for f in weak)
        return replace(self, frequencies=rest, left_in=(*self.left_in, *left_in))


def is_automatic(lines: AskedLines) -> bool:
    """Whether the lines are those of the spectrum."""
    return isinstance(lines, str) and lines == "auto"


def proposed_lines(problem: LikelihoodProblem, lines: AskedLines) -> ProposedLines:
    """Lines that may be terms.

    Raises
    ------
    InputError
        Neither "auto" nor frequencies.
    """
    if not is_automatic(lines):
        named = tuple(checked_lines(lines))
        return ProposedLines(frequencies=named, automatic=False, left_in=(), widths=GIVEN_WIDTHS)
    shown = spectral_lines(problem.recording, problem.channel.name)
    return ProposedLines(
        frequencies=tuple(line.frequency for line in shown if line.stable),
        automatic=True,
        left_in=unsteady(shown),
        widths=problem.n_samples / 2,
    )
