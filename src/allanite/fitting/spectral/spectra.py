# SPDX-License-Identifier: BSD-3-Clause
"""Spectra of the channels of a record, each with a model over it and whether the two agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.spectral.disagreements import Disagreement
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict
from allanite.recording.channel_names import channel_called

__all__ = ["ChannelSpectrum", "ModelAgreement", "Spectra"]


class ModelAgreement(Verdict):
    """Do a model and a spectrum agree?"""

    DISAGREE = "disagree", "Model and spectrum do not agree", Tone.WARNING
    NOT_COMPARED = "not compared", "Model and spectrum are not compared", Tone.GOOD
    AGREE = "agree", "Model and spectrum agree", Tone.GOOD


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSpectrum(Result):
    """The spectrum of one channel.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    expected : ndarray, shape (n,), or None [SI^2/Hz]
        What the model would show at each frequency: folded by sampling, seen through the window.
    agreement : ModelAgreement or None
        "agree", "disagree" or "not compared"; None without a model.
    spectrum : Spectrum
        Without points where the channel shows no noise.
    model : NoiseModel or None
        That was given.
    compared : bool
        The model was compared with the spectrum, which must be log-binned and long enough.
    disagreement : Disagreement or None
        Where the two part.
    """

    STATED: ClassVar[tuple[str, ...]] = ("expected", "agreement")

    name: str
    kind: str
    unit: str
    spectrum: Spectrum = field(repr=False)
    model: NoiseModel | None = None
    compared: bool = False
    disagreement: Disagreement | None = None

    @property
    def expected(self) -> NDArray[np.float64] | None:
        """What the model would show at each frequency."""
        return None if self.model is None else self.spectrum.expected(self.model)

    @property
    def agreement(self) -> ModelAgreement | None:
        """Whether the two agree; None without a model."""
        if self.model is None:
            return None
        if not self.compared:
            return ModelAgreement.NOT_COMPARED
        return ModelAgreement.AGREE if self.disagreement is None else ModelAgreement.DISAGREE

    @property
    def reason(self) -> str:
        """What the agreement rests on, in a sentence; "" where there is nothing to say."""
        match self.agreement:
            case ModelAgreement.DISAGREE if self.disagreement is not None:
                return self.disagreement.words
            case ModelAgreement.NOT_COMPARED if self.spectrum.method != "log":
                return "that is done for the log-binned spectrum"
            case ModelAgreement.NOT_COMPARED:
                return "the record is too short"
            case _:
                return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectra(Result):
    """The spectra of the channels of a record.

    Attributes
    ----------
    channels : tuple of ChannelSpectrum
        Those that bear noise.
    """

    FORMAT: ClassVar[str] = "allanite-spectrum"
    VERSION: ClassVar[int] = 2

    channels: tuple[ChannelSpectrum, ...]

    def __getitem__(self, name: str) -> ChannelSpectrum:
        """One channel.

        Raises
        ------
        InputError
            No such channel.
        """
        return channel_called(name, self.channels)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.fitting.spectral.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
