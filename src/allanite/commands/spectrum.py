# SPDX-License-Identifier: BSD-3-Clause
"""Spectra of a log with a model over them, and everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import has_gaps, models_from, noise_channels, read_part
from allanite.errors import InputError
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.noise import NoiseModel
    from allanite.noise.spectrum import Spectrum
    from allanite.recording.records import Recording

__all__ = ["spectra_of"]

Advance = Callable[[float, str], None]
Json = dict[str, Any]


def spectra_of(
    log: str | os.PathLike[str],
    *,
    model: str | os.PathLike[str] | None = None,
    command: str | None = None,
    source: str | None = None,
    estimate: Mapping[str, Any] | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Spectra of all channels of a log that carry noise; see `power_spectrum`, whose choices `estimate` holds.

    Parameters
    ----------
    model : path, optional
        Models by channel, or one for all.
    **options
        Those of `read`.

    Raises
    ------
    InputError
        No channel that carries noise, no model for one, or what `power_spectrum` refuses.
    """
    from allanite.noise.spectrum import power_spectrum
    from allanite.recording.health import check

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    advance(0.05, "looking for faults of the record")
    names = noise_channels(recording)
    models = {} if model is None else models_from(model, names)
    missing = [name for name in names if models and name not in models]
    if missing:
        raise InputError(f"no model for {', '.join(missing)} in {model}; it has {', '.join(models)}")
    findings = check(recording.select(*names))
    unresolved = {f.channel: f.message for f in findings if f.code == "no_noise_resolved"}
    channels = []
    for i, name in enumerate(names):
        advance(0.1 + 0.8 * i / len(names), f"spectrum of {name}")
        spectrum = power_spectrum(recording, name, **(estimate or {}))
        if name in unresolved:
            channels.append(_without_noise(recording, spectrum, unresolved[name]))
        else:
            channels.append(_channel(recording, spectrum, models.get(name)))
    document = {
        "format": "allanite-spectrum",
        "version": 1,
        "channels": channels,
        **beside(recording, None, findings, file_sha256(log), command),
        **({} if model is None else {"model_name": str(model)}),
    }
    return MeasurementResult(
        result=_plain(document),
        document=_plain(document),
        name="spectrum",
        tables={"spectrum.csv": [row for channel in channels for row in _rows(channel)]},
        lossy=has_gaps(recording),
    )


def _channel(recording: Recording, spectrum: Spectrum, model: NoiseModel | None) -> Json:
    facts = recording[spectrum.channel]
    entry: Json = {
        "name": spectrum.channel,
        "kind": facts.kind.value,
        "unit": facts.unit,
        "spectrum": spectrum.to_json(),
        "model": None,
        "expected": None,
    }
    if model is None:
        return entry
    parted = _disagreement(recording, spectrum, model) if spectrum.method == "log" else None
    return {
        **entry,
        "model": model.to_json(),
        "expected": spectrum.expected(model).tolist(),
        "compared": spectrum.method == "log",
        "disagreement": parted,
    }


def _without_noise(recording: Recording, spectrum: Spectrum, why: str) -> Json:
    """A channel whose samples are all equal: without points, for a density of zero is not the sensor's."""
    none = np.zeros(0)
    empty = replace(
        spectrum, frequency=none, density=none, lower=none, upper=none, edf=none, background=none,
        resolution=none, bins=np.zeros((0, 2), dtype=np.int64), lines=(), band_limit=None,
    )  # fmt: skip
    return {**_channel(recording, empty, None), "unresolved": why}


def _disagreement(recording: Recording, spectrum: Spectrum, model: NoiseModel) -> str | None:
    """Where model and spectrum part, in words; steady lines are no matter of the model's density."""
    from allanite.errors import DataQualityError
    from allanite.fitting.spectral import spectral_ordinates
    from allanite.fitting.spectral.agreement import disagreement

    try:
        data, _ = spectral_ordinates(recording, spectrum.channel, spectrum=spectrum)
    except DataQualityError:
        return None
    difference = disagreement(model, data)
    return None if difference is None else difference.words


def _rows(channel: Json) -> list[Json]:
    spectrum, expected = channel["spectrum"], channel["expected"]
    return [
        {
            "channel": channel["name"],
            "frequency_hz": f"{f:.9g}",
            **{key: f"{spectrum[key][i]:.9g}" for key in ("density", "lower", "upper")},
            "edf": f"{spectrum['edf'][i]:.6g}",
            "model": "" if expected is None else f"{expected[i]:.9g}",
        }
        for i, f in enumerate(spectrum["frequency"])
    ]


def _plain(value: Any) -> Any:
    """Numbers that JSON does not have as null."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
