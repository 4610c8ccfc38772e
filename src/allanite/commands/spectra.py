# SPDX-License-Identifier: BSD-3-Clause
"""Spectra of a log with a model over them, and everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.commands.measurement import MeasurementResult, origin_of
from allanite.commands.recordings import has_gaps, models_from, noise_channels, read_part
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.fitting.spectral.spectra import ChannelSpectrum
    from allanite.noise import NoiseModel
    from allanite.noise.spectrum.results import Spectrum
    from allanite.recording.records import Recording

__all__ = ["spectra_of"]

Advance = Callable[[float, str], None]

#: Choices of `power_spectrum`.
_CHOICES = ("method", "segment", "window", "overlap", "confidence")


def spectra_of(
    log: str | os.PathLike[str],
    *,
    model: str | os.PathLike[str] | None = None,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Spectra of all channels of a log that carry noise.

    Parameters
    ----------
    model : path, optional
        Models by channel, or one for all.
    **options
        Choices of `power_spectrum`, and those of `read`.

    Raises
    ------
    InputError
        No channel that carries noise, no model for one, or what `power_spectrum` refuses.
    """
    from allanite.fitting.spectral.spectra import Spectra
    from allanite.noise.spectrum.estimation import power_spectrum
    from allanite.recording.health.examination import check
    from allanite.study.result_document import ResultDocument

    advance = progress or (lambda fraction, what: None)
    choices = {name: options.pop(name) for name in _CHOICES if name in options}
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    advance(0.05, "checking the record for faults")
    names = noise_channels(recording)
    models = {} if model is None else models_from(model, names)
    missing = [name for name in names if models and name not in models]
    if missing:
        raise InputError(f"no model for {', '.join(missing)} in {model}; it has {', '.join(models)}")
    findings = check(recording.select(*names))
    unresolved = {f.channel for f in findings if f.code == "no_noise_resolved"}
    channels = []
    for i, name in enumerate(names):
        advance(0.1 + 0.8 * i / len(names), f"spectrum of {name}")
        spectrum = power_spectrum(recording, name, **choices)
        silent = name in unresolved
        channels.append(
            _channel(
                recording, _empty(spectrum) if silent else spectrum, None if silent else models.get(name)
            )
        )
    result = Spectra(channels=tuple(channels))
    return MeasurementResult(
        result=result,
        document=ResultDocument(
            result=result,
            model_name="" if model is None else str(model),
            **origin_of(recording, findings, log, command),
        ),
        name="spectrum",
        tables={},
        lossy=has_gaps(recording),
    )


def _channel(recording: Recording, spectrum: Spectrum, model: NoiseModel | None) -> ChannelSpectrum:
    """A channel; of a model, whether it agrees, steady lines being no matter of its density."""
    from allanite.errors import DataQualityError
    from allanite.fitting.spectral.agreement import disagreement
    from allanite.fitting.spectral.estimation import spectral_ordinates
    from allanite.fitting.spectral.spectra import ChannelSpectrum

    facts = recording[spectrum.channel]
    channel = ChannelSpectrum(
        name=spectrum.channel, kind=facts.kind.value, unit=facts.unit, spectrum=spectrum, model=model
    )
    if model is None or spectrum.method != "log":
        return channel
    try:
        data, _ = spectral_ordinates(recording, spectrum.channel, spectrum=spectrum)
    except DataQualityError:
        return channel
    return replace(channel, compared=True, disagreement=disagreement(model, data))


def _empty(spectrum: Spectrum) -> Spectrum:
    """Of a channel whose samples are all equal: without points, for a density of zero is not the sensor's."""
    none = np.zeros(0)
    return replace(
        spectrum, frequency=none, density=none, lower=none, upper=none, edf=none, background=none,
        resolution=none, bins=np.zeros((0, 2), dtype=np.int64), lines=(), band_limit=None,
    )  # fmt: skip
