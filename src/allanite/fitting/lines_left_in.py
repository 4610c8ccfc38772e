# SPDX-License-Identifier: BSD-3-Clause
"""Spectral lines that stay in a record: none of the terms of its model is their sinusoid."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from allanite.errors import AllaniteError
from allanite.fitting.verdict import with_fact
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.spectrum.lines import SpectralLine
from allanite.plain_files.counted import listed
from allanite.quantities.result import Result
from allanite.recording.records import Recording

__all__ = ["LineLeftIn", "spectral_lines", "unsteady", "with_lines_left_in"]


_NAMED = 5  # lines in a sentence


@dataclass(frozen=True, slots=True, kw_only=True)
class LineLeftIn(Result):
    """A line of the spectrum that is no term, and stays in the record.

    Attributes
    ----------
    frequency : float [Hz]
        Of the line.
    note : str
        Why.
    """

    frequency: float
    note: str

    @property
    def words(self) -> str:
        """In a sentence."""
        return f"the line at {self.frequency:.4g} Hz stays in the record: {self.note}"


def spectral_lines(recording: Recording, name: str) -> tuple[SpectralLine, ...]:
    """Lines of the spectrum of a channel; none where the record is too short for one."""
    import numpy as np

    from allanite.noise.spectrum.estimation import power_spectrum

    try:
        with np.errstate(invalid="ignore", over="ignore"):  # squares of samples may be no numbers
            return power_spectrum(recording, name).lines
    except AllaniteError:
        return ()


def unsteady(lines: Iterable[SpectralLine]) -> tuple[LineLeftIn, ...]:
    """Those that are no sinusoids."""
    return tuple(LineLeftIn(frequency=line.frequency, note=line.note) for line in lines if not line.stable)


def with_lines_left_in(model: NoiseModel, left_in: Sequence[LineLeftIn]) -> NoiseModel:
    """The model, and what its record holds besides: "lines_left_in" of `goodness` [Hz], and the verdict."""
    if not left_in:
        return model
    return with_fact(model, {"lines_left_in": [line.frequency for line in left_in]}, f" {_sentence(left_in)}")


def _sentence(left_in: Sequence[LineLeftIn]) -> str:
    if len(left_in) == 1:
        return f"{left_in[0].words[0].upper()}{left_in[0].words[1:]}."
    places = [f"{line.frequency:.4g} Hz" for line in left_in[:_NAMED]]
    more = [f"{len(left_in) - _NAMED} more"] if len(left_in) > _NAMED else []
    return f"These lines stay in the record: {listed([*places, *more])}."
