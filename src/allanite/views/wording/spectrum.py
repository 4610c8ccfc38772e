# SPDX-License-Identifier: BSD-3-Clause
"""A spectrum in people's words: root densities in the unit of N, lines in the unit of the samples."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from allanite.noise.spectrum.lines import SpectralLine
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import interval, number

__all__ = ["density_lines", "density_unit", "line_lines", "spectral_agreement", "spectrum_facts"]

Json = Mapping[str, Any]

_PER_DECADE = 2  # rows of the table for each decade of frequency
_CERTAIN = 1e-300


def density_unit(kind: str, unit: str = "") -> tuple[str, float]:
    """Unit of a root density and its size in SI: that of N, so that the flat part of a spectrum is N itself."""
    return display_unit(kind, "N", unit)


def line_lines(kind: str, unit: str, lines: Iterable[SpectralLine]) -> list[tuple[str, str, str, str]]:
    """Frequency, amplitude, chance and nature of each line of a channel, with 95 % intervals."""
    name, factor = display_unit(kind, "mean", unit)
    return [
        (
            _with_interval(line.frequency, (line.frequency_lower, line.frequency_upper), 1.0, "Hz"),
            _with_interval(line.amplitude, (line.amplitude_lower, line.amplitude_upper), factor, name),
            f"1 in 10^{line.significance:.0f}",
            "steady: a sinusoid" if line.stable else line.note or "not examined",
        )
        for line in lines
    ]


def _with_interval(value: float, ends: tuple[float, float], factor: float, unit: str) -> str:
    if not all(map(math.isfinite, ends)):
        return f"{number(value / factor, 4)} {unit}"
    middle, below, above = interval(value / factor, ends[0] / factor, ends[1] / factor)
    return f"{middle} [{below}, {above}] {unit}"


def density_lines(channel: Json) -> list[tuple[str, str, str]]:
    """Frequency, root density with its interval, and the model's, two for each decade and the last."""
    spectrum, (name, factor) = channel["spectrum"], density_unit(channel["kind"], channel.get("unit") or "")
    f = np.asarray(spectrum["frequency"], dtype=np.float64)
    if not len(f):
        return []
    wanted = 10 ** (np.arange(math.ceil(_PER_DECADE * math.log10(f[0])), 99) / _PER_DECADE)
    near = {int(np.argmin(np.abs(np.log(f / w)))) for w in wanted[wanted < f[-1]]} | {len(f) - 1}
    expected = channel.get("expected")
    return [
        (
            f"{number(float(f[i]))} Hz",
            _root(spectrum, i, factor, name),
            "" if expected is None else f"{number(math.sqrt(expected[i]) / factor)} {name}",
        )
        for i in sorted(near)
    ]


def _root(spectrum: Json, i: int, factor: float, unit: str) -> str:
    roots = [math.sqrt(max(spectrum[key][i], _CERTAIN)) / factor for key in ("density", "lower", "upper")]
    middle, below, above = interval(*roots)
    return f"{middle} [{below}, {above}] {unit}"


def spectrum_facts(channel: Json) -> list[tuple[str, str]]:
    """How a spectrum was made, and what it says of the sensor's filter."""
    spectrum = channel["spectrum"]
    points = len(spectrum["frequency"])
    if not points:
        too_short = "the record, or what gaps leave of it, is too short"
        return [("points", f"none: {channel.get('unresolved') or too_short}")]
    how = {"log": "log-binned, from a cascade of decimated records", "welch": "Welch"}[spectrum["method"]]
    if spectrum["method"] == "welch":
        length = 1 / spectrum["resolution"][0]
        how += f", segments of {number(length)} s, window {spectrum['window']}, overlap {100 * spectrum['overlap']:g} %"
    segments = f"{spectrum['segments']}"
    if spectrum["skipped"]:
        segments += f" used, {spectrum['skipped']} left out for missing samples"
    facts = [
        ("density", "two-sided; a one-sided root density is √2 times as large"),
        ("method", how),
        ("segments", segments),
        (
            "points",
            f"{points}, with {min(spectrum['edf']):.3g} to {max(spectrum['edf']):.3g} degrees of freedom",
        ),
    ]
    if spectrum["corner"]:
        facts.append(("filter", f"the density falls to half at {number(spectrum['corner'])} Hz"))
    return facts


def spectral_agreement(channel: Json) -> str:
    """Whether the model and the spectrum agree, in one sentence; "" without a model."""
    if channel.get("expected") is None:
        return ""
    disagreement = channel.get("disagreement")
    if channel.get("compared") is False:
        return "Model and spectrum are not compared: that is done for the log-binned spectrum."
    return (
        "Model and spectrum agree."
        if not disagreement
        else f"Model and spectrum do not agree: {disagreement}."
    )
