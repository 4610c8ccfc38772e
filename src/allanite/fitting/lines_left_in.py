# SPDX-License-Identifier: BSD-3-Clause
"""Spectral lines that stay in a record: no term of the model is their sinusoid."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from allanite.errors import AllaniteError
from allanite.fitting.verdict import with_fact
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.spectrum.lines import SpectralLine
from allanite.quantities.result import Result
from allanite.recording.records import Recording

__all__ = ["LineLeftIn", "spectral_lines", "unsteady", "with_lines_left_in"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LineLeftIn(Result):
    """A line of the spectrum that cannot be a term, and stays in the record.

    Attributes
    ----------
    frequency : float [Hz]
        Of the line.
    note : str
        Why it is no sinusoid; "" where it has too few periods to be told from slow noise.
    """

    frequency: float
    note: str

    @property
    def words(self) -> str:
        """In a sentence."""
        line = f"the line at {self.frequency:.4g} Hz"
        if self.note:
            return f"{line} is no sinusoid and stays in the record: {self.note}"
        return f"{line} has too few periods to be told from slow noise and stays in the record"


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
    text = "".join(f" {line.words[0].upper()}{line.words[1:]}." for line in left_in)
    return with_fact(model, {"lines_left_in": [line.frequency for line in left_in]}, text)
