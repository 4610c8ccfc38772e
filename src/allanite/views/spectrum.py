# SPDX-License-Identifier: BSD-3-Clause
"""What spectra say: root densities in the unit of N, lines in the unit of the samples, and whether a model agrees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from allanite.fitting.spectral.spectra import ChannelSpectrum, Spectra
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number
from allanite.quantities.quantity import interval_words
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Banner,
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.result_page import findings_of, result_page
from allanite.views.wording.rates import model_words, sentence

__all__ = ["LINE_HEADS", "line_rows", "rows", "view"]

LINE_HEADS = ("Channel", "Line", "Amplitude", "Chance", "Through the record")
_PER_DECADE = 2  # rows of the table for each decade of frequency
_CERTAIN = 1e-300
_METHODS = {"log": "log-binned, from a cascade of decimated records", "welch": "Welch"}
_REFERENCES = (
    (
        "P. D. Welch, “The use of fast Fourier transform for the estimation of power spectra”, IEEE Trans. Audio "
        "Electroacoust. 15 (1967) 70."
    ),
    (
        "F. J. Harris, “On the use of windows for harmonic analysis with the discrete Fourier transform”, Proc. IEEE "
        "66 (1978) 51."
    ),
    "A. Sykulski et al., “The debiased Whittle likelihood”, Biometrika 106 (2019) 251.",
)
_METHOD = (
    "Its interval is chi-square, with the degrees of freedom for window and overlap. A model is drawn as "
    "these segments would show it: its density aliased by sampling and averaged over the window. Isolated "
    "missing samples are replaced by their expected value, and the density of the error is added: the "
    "chi-square distribution applies to the rest, and the interval includes the error of the addition. "
    "Segments with longer gaps are left out. A line is steady if the noise around it explains the scatter "
    "of its amplitude and phase between parts of the record; it is then a sinusoid and can be removed."
)


def view(document: ResultDocument[Spectra]) -> Page:
    """The page of the spectra of a log."""
    channels, record, made = document.result.channels, document.recording, document.provenance
    return result_page(
        document,
        title=(made.source if made else "") or "Spectra",
        kicker="Power spectral density",
        facts=[
            ("Channels", ", ".join(c.name for c in channels)),
            ("Length", duration(record.duration) if record else ""),
            ("Rate", f"{record.rate:.7g} Hz" if record else ""),
        ],
        sections={
            "spectra": ("Spectra", [*_spectra(document.result)]),
            "lines": ("Lines", [*_lines(channels)]),
            "densities": ("Densities", [block for c in channels for block in _density(c, document)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


def _spectra(result: Spectra) -> Iterator[PageBlock]:
    for i, channel in enumerate(result.channels):
        model = "; dashed, the model as these segments would show it" if channel.model else ""
        caption = f"{channel.name}: root of the two-sided density with its interval{model}."
        if channel.agreement is not None:
            words = f"{channel.agreement.words}{': ' if channel.reason else ''}{channel.reason}"
            yield Banner(channel.agreement.tone, channel.name, sentence(words))
        yield from drawn(f"spectrum-{i}", result, caption, caption, channel=channel.name)


def _lines(channels: Iterable[ChannelSpectrum]) -> list[PageBlock]:
    lines = [row for c in channels for row in line_rows(c.name, c.kind, c.unit, c.spectrum.lines)]
    caption = "Lines with 95 % intervals. Chance: the probability of such a peak from noise alone."
    return table(LINE_HEADS, lines, caption=caption)


def line_rows(
    name: str, kind: str, unit: str, lines: Iterable[SpectralLine]
) -> Iterator[tuple[str, str, str, str, str]]:
    """Channel, frequency, amplitude, chance and nature of each line, with 95 % intervals."""
    words, factor = display_unit(kind, "mean", unit)
    for line in lines:
        yield (
            name,
            _with_interval(line.frequency, (line.frequency_lower, line.frequency_upper), 1.0, "Hz"),
            _with_interval(line.amplitude, (line.amplitude_lower, line.amplitude_upper), factor, words),
            f"1 in 10^{line.significance:.0f}",
            "steady: a sinusoid" if line.stable else line.note or "not examined",
        )


def _with_interval(value: float, ends: tuple[float, float], factor: float, unit: str) -> str:
    if not all(map(math.isfinite, ends)):
        return f"{number(value / factor, 4)} {unit}"
    return f"{interval_words(value, *ends, factor)} {unit}"


# -- densities --------------------------------------------------------------------------------------------


def _density(channel: ChannelSpectrum, document: ResultDocument[Spectra]) -> Iterator[PageBlock]:
    spectrum, expected = channel.spectrum, channel.expected
    unit, factor = display_unit(channel.kind, "N", channel.unit)
    heads = ("Frequency", f"Root density, {100 * spectrum.confidence:g} % interval", "Model")
    lines = [
        (
            f"{number(float(spectrum.frequency[i]))} Hz",
            f"{_root(spectrum, i, factor)} {unit}",
            *([] if expected is None else [f"{number(math.sqrt(expected[i]) / factor)} {unit}"]),
        )
        for i in _shown(spectrum.frequency)
    ]
    yield Subheading(channel.name, brief=True)
    yield from table(heads if channel.model else heads[:2], lines)
    yield pairs([*_facts(channel, document), ("Model", model_words(channel.model) if channel.model else "")])


def _shown(frequency: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[int]:
    """Points of a table: two for each decade, and the last."""
    if not len(frequency):
        return []
    wanted = 10 ** (np.arange(math.ceil(_PER_DECADE * math.log10(frequency[0])), 99) / _PER_DECADE)
    near = {int(np.argmin(np.abs(np.log(frequency / w)))) for w in wanted[wanted < frequency[-1]]}
    return sorted(near | {len(frequency) - 1})


def _root(spectrum: Spectrum, i: int, factor: float) -> str:
    value, low, high = (
        math.sqrt(max(part[i], _CERTAIN)) for part in (spectrum.density, spectrum.lower, spectrum.upper)
    )
    return interval_words(value, low, high, factor)


def _facts(channel: ChannelSpectrum, document: ResultDocument[Spectra]) -> Iterator[tuple[str, str]]:
    """How a spectrum was made, and what it says of the sensor's filter."""
    spectrum, points = channel.spectrum, len(channel.spectrum.frequency)
    if not points:
        reasons = [
            f.message
            for f in document.findings or ()
            if f.code == "no_noise_resolved" and f.channel == channel.name
        ]
        yield "Points", f"none: {(*reasons, 'the record, or the longest part without gaps, is too short')[0]}"
        return
    how = _METHODS[spectrum.method]
    if spectrum.method == "welch":
        length = 1 / spectrum.resolution[0]
        how += f", segments of {number(length)} s, window {spectrum.window}, overlap {100 * spectrum.overlap:g} %"
    skipped = f" used, {spectrum.skipped} left out for missing samples" if spectrum.skipped else ""
    freedom = f"{spectrum.edf.min():.3g} to {spectrum.edf.max():.3g} degrees of freedom"
    yield "Density", "two-sided; a one-sided root density is √2 times as large"
    yield "Method", how
    yield "Segments", f"{spectrum.segments}{skipped}"
    yield "Points", f"{points}, with {freedom}"
    if spectrum.corner:
        yield "Filter", f"the density falls to half at {number(spectrum.corner)} Hz"


def _method() -> list[PageBlock]:
    return [
        Text("Each point is the mean of periodograms of overlapping, windowed segments:"),
        *equation("periodogram"),
        Text(_METHOD),
        References(_REFERENCES),
    ]


def rows(result: Spectra) -> Iterator[dict[str, object]]:
    """One row of a table for each point, in SI."""
    for channel in result.channels:
        spectrum, expected = channel.spectrum, channel.expected
        for i, f in enumerate(spectrum.frequency):
            yield {
                "channel": channel.name,
                "frequency_hz": f"{f:.9g}",
                **{key: f"{getattr(spectrum, key)[i]:.9g}" for key in ("density", "lower", "upper")},
                "edf": f"{spectrum.edf[i]:.6g}",
                "model": "" if expected is None else f"{expected[i]:.9g}",
            }
