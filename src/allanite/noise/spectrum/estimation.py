# SPDX-License-Identifier: BSD-3-Clause
"""The power spectral density of a channel, from averaged periodograms."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.noise.spectrum.band_limit import find_band_limit
from allanite.noise.spectrum.holes import Bridged
from allanite.noise.spectrum.lines import SpectralLine, find_lines, without_lines
from allanite.noise.spectrum.periodogram import (
    FEWEST_SEGMENTS,
    SEGMENT,
    SHORTEST_SEGMENT,
    Cascade,
    Periodogram,
    equivalent_dof,
    periodograms,
    welch,
)
from allanite.noise.spectrum.results import METHODS, Method, Spectrum
from allanite.noise.spectrum.stability import examined
from allanite.noise.spectrum.windows import window_of
from allanite.quantities.distributions import chi_square_quantiles
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.records import Recording

__all__ = ["power_spectrum", "spectrum_of_pass"]

Array = NDArray[np.float64]
Progress = Callable[[float], None]

#: Points of a log-binned spectrum per decade of frequency.
PER_DECADE = 30
#: Segments of Welch's method that a record is cut into at least, where the length is not given (overlaps not counted).
_PARTS = 8
#: A bin is shown where the window moves the density of a random walk by less than this share of its deviation.
_MOVED = 0.3


def power_spectrum(
    recording: Recording,
    name: str,
    *,
    method: Method = "log",
    segment: float | None = None,
    window: str = "hann",
    overlap: float = 0.5,
    least: int = FEWEST_SEGMENTS,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> Spectrum:
    """Power spectral density of a channel, in one pass and bounded memory.

    Parameters
    ----------
    recording : Recording
        Recording to analyze.
    name : str
        Name of a channel. Angles and velocities are differenced: the spectrum is that of the rate.
    method : "log" or "welch"
        "log": points evenly spaced in the logarithm of the frequency, from a cascade of decimated records, each seen by
        segments as long as it allows. "welch": all bins of segments of one length at the full rate.
    segment : float, optional [s]
        Length of Welch's segments; an eighth of the record, and at most 16384 samples, by default.
    window : "hann", "blackman" or "blackman-harris"
        Window of Welch's segments.
    overlap : float
        Part of one of Welch's segments that it shares with the next, 0 to 0.9.
    least : int
        Segments at the lowest frequencies of a log-binned spectrum, at least 4: more of them are narrower intervals
        down to a higher frequency.
    confidence : float
        Level of the intervals.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Spectrum
        Empty where the record, or what its gaps leave of it, is too short (64 samples).

    Raises
    ------
    InputError
        No such channel or window, segments that the record has no room for, Welch's choices for another method, or
        what is no number where one is needed.

    Notes
    -----
    The interval is chi-square with the degrees of freedom that the window and the overlap leave [1]_. It covers the
    density seen through the window, which stands above a steep one: by n(n + 1)/(6 k^2) for S = 1/f^n at bin k of a
    Hann window. Bins where that would count for a random walk are left out; `Spectrum.expected` holds the rest.

    Isolated missing samples are bridged, and the density that this takes off is put back
    (`Spectrum.bridged`): the chi-square law holds for the density less that part, and the error of that part is in the
    interval.

    References
    ----------
    .. [1] P. D. Welch, "The use of fast Fourier transform for the estimation of power spectra", IEEE Trans. Audio
       Electroacoust. 15 (1967) 70.
    """
    if method not in METHODS:
        raise InputError(f"method must be {' or '.join(map(repr, METHODS))}, not {method!r}")
    require_probabilities(confidence=confidence)
    if not (_is_number(least) and least == int(least) and least >= FEWEST_SEGMENTS):
        raise InputError(
            f"a spectrum needs a whole number of segments, {FEWEST_SEGMENTS} at least, not {least!r}"
        )
    if method == "log" and (segment, window, overlap) != (None, "hann", 0.5):
        raise InputError("segment, window and overlap are choices of method 'welch'")
    streams = (
        periodograms(recording, name, progress, int(least))
        if method == "log"
        else _welch(recording, name, segment, window, overlap, progress)
    )
    return _of_streams(recording, name, streams, method, window, overlap, confidence)


def spectrum_of_pass(recording: Recording, name: str, cascade: Cascade) -> Spectrum:
    """`power_spectrum` of a channel, with nothing chosen, from a cascade that another pass over its samples has fed."""
    streams = periodograms(recording, name, first=cascade)
    return _of_streams(recording, name, streams, "log", "hann", 0.5, 0.95)


def _of_streams(
    recording: Recording,
    name: str,
    streams: Sequence[Periodogram],
    method: Method,
    window: str,
    overlap: float,
    confidence: float,
) -> Spectrum:
    streams = [_scaled(p, recording[name].scale ** 2) for p in streams]
    lines = (
        find_lines(streams) if (window, overlap) == ("hann", 0.5) else ()
    )  # their law is that of this window
    spectrum = _spectrum(recording, name, streams, lines, method, window, confidence)
    spectrum = replace(spectrum, overlap=overlap)
    return replace(spectrum, lines=examined(recording, spectrum)) if lines else spectrum


def _is_number(value: object) -> bool:
    """A finite real number (True is none)."""
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    return real and math.isfinite(value)  # type: ignore[arg-type]


def _spectrum(
    recording: Recording,
    name: str,
    streams: Sequence[Periodogram],
    lines: tuple[SpectralLine, ...],
    method: Method,
    window: str,
    confidence: float,
) -> Spectrum:
    spread = window_of(window).spread
    rows = [
        _means(
            p, without_lines(p, lines), _log_bins(p) if method == "log" else _single_bins(p, spread), method
        )
        for p in streams[::-1]
    ]
    columns = [np.concatenate(part) for part in zip(*rows, strict=True)] if rows else [np.zeros(0)] * 7
    frequency, density, background, edf, resolution = columns[:5]
    bridged = streams[0].bridged if streams else Bridged()
    bins = np.stack(columns[5:7], axis=1)
    shared = bridged.common(density, *((bins - 0.5) * resolution[:, None]).T)
    lower, upper = _interval(frequency, density, edf, confidence, bridged, shared)
    return Spectrum(
        channel=name,
        frequency=frequency,
        density=density,
        lower=lower,
        upper=upper,
        edf=edf,
        background=background,
        lines=lines,
        band_limit=find_band_limit(frequency, background, edf, recording.rate / 2),
        dt=1 / recording.rate,
        n_samples=recording.n_samples,
        sampling=recording[name].sampling,
        segments=sum(p.segments for p in streams),
        skipped=sum(p.skipped for p in streams),
        method=method,
        window=window,
        confidence=confidence,
        resolution=resolution,
        bins=bins,
        bridged=bridged,
    )


def _scaled(stream: Periodogram, factor: float) -> Periodogram:
    return replace(stream, density=stream.density * factor, bridged=stream.bridged.scaled(factor))


def _welch(
    recording: Recording,
    name: str,
    segment: float | None,
    window: str,
    overlap: float,
    progress: Progress | None,
) -> list[Periodogram]:
    shape = window_of(window)
    if not (_is_number(overlap) and 0 <= overlap <= 0.9):
        raise InputError(f"overlap must be a part of a segment, 0 to 0.9, not {overlap!r}")
    if segment is not None and not (_is_number(segment) and segment > 0):
        raise InputError(f"segment must be a length in seconds, finite and positive, not {segment!r}")
    length = _default_length(recording.n_samples) if segment is None else round(segment * recording.rate)
    length -= length % 2
    if segment is not None and not SHORTEST_SEGMENT <= length <= recording.n_samples / FEWEST_SEGMENTS:
        least, most = SHORTEST_SEGMENT / recording.rate, recording.duration / FEWEST_SEGMENTS
        raise InputError(
            f"segments of this record are from {least:.3g} to {most:.3g} s long, not {segment:g} s"
        )
    while length >= SHORTEST_SEGMENT:
        periodogram = welch(recording, name, length, window=shape, overlap=overlap, progress=progress)
        if periodogram.segments >= FEWEST_SEGMENTS or segment is not None:
            return [periodogram] if periodogram.segments else []
        length = length // 8 * 2 // 2 * 2  # gaps leave no room for segments of this length
    return []


def _default_length(n_samples: int) -> int:
    room = n_samples // _PARTS
    return min(SEGMENT, 1 << (room.bit_length() - 1)) if room else 0


# -- from periodogram bins to points -----------------------------------------------------------------------


def _log_bins(stream: Periodogram) -> NDArray[np.int64]:
    """Bins of equal log width, as [first, last) bins of the periodogram, without Nyquist's own, which is real."""
    end = min(stream.last, stream.segment // 2)
    f = stream.frequency[stream.first : end]
    if not len(f):
        return np.zeros((0, 2), dtype=np.int64)
    place = np.floor(PER_DECADE * np.log10(f))
    starts = stream.first + np.flatnonzero(np.diff(place, prepend=-np.inf))
    return np.stack([starts, np.append(starts[1:], end)], axis=1)


def _single_bins(stream: Periodogram, spread: float) -> NDArray[np.int64]:
    """Every bin from where on the window no longer moves a random walk, by 3 spread/bin^2, as far as can be seen."""
    visible = _MOVED * np.sqrt(2 / stream.edf)
    first = max(stream.first, int(np.ceil(np.sqrt(3 * spread / visible))))
    bins = np.arange(min(first, stream.last - 1), stream.last)
    return np.stack([bins, bins + 1], axis=1)


def _means(
    stream: Periodogram, clean: Periodogram, bins: NDArray[np.int64], method: Method
) -> tuple[Array, ...]:
    """Frequency, density, background, degrees of freedom, resolution, first and last bin of each point."""
    if not len(bins):
        return (np.zeros(0),) * 7
    starts, counts = bins[:, 0] - bins[0, 0], np.diff(bins, axis=1)[:, 0]
    used = slice(bins[0, 0], bins[-1, 1])
    dofs = np.full(len(bins), stream.edf)
    if method == "log":
        dofs = np.array([equivalent_dof(int(n), stream.segments, stream.pairs) for n in counts])
    return (
        np.exp(np.add.reduceat(np.log(stream.frequency[used]), starts) / counts),
        np.add.reduceat(stream.density[used], starts) / counts,
        np.add.reduceat(clean.density[used], starts) / counts,
        dofs,
        np.full(len(bins), stream.resolution),
        *bins.T,
    )


def _interval(
    frequency: Array, density: Array, edf: Array, confidence: float, bridged: Bridged, shared: Array
) -> tuple[Array, Array]:
    """Chi-square interval of what was seen, over what was put back; the error of that takes degrees of freedom off."""
    back = bridged.put_back(frequency)
    measured = np.maximum(density - back, 0.0)
    common = (density**2 * (shared**2).sum(axis=1) + bridged.white**2 * bridged.coupling) / 2
    dof = 1 / (1 / edf + np.divide(common, measured**2, out=np.zeros_like(measured), where=measured > 0))
    dof, tail = np.maximum(dof, 1.0), (1 - confidence) / 2
    ends = (measured * dof / chi_square_quantiles(tail, dof, upper=upper) for upper in (True, False))
    lower, upper = (back + end for end in ends)
    return lower, upper
