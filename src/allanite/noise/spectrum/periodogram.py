# SPDX-License-Identifier: BSD-3-Clause
"""Averaged periodograms of a stream of samples: one pass, bounded memory, high and low frequencies alike.

The record is cut into half-overlapping segments under a Hann window (Welch 1967). For the low frequencies it is
decimated by eight, again and again, and each decimated stream gets segments of its own: so every frequency is seen
by long segments while no transform is longer than 16 384 points. `welch` gives the periodogram of one kind of segment
at the full rate alone.

Short runs of missing samples are bridged (see `holes`); longer ones have weight zero, and segments and decimated
samples that miss more than a small part of their weight are skipped and counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.holes import Bridge, Bridged
from allanite.noise.spectrum.windows import HANN, Window
from allanite.recording.records import Recording

__all__ = [
    "FEWEST_SEGMENTS",
    "SEGMENT",
    "SHORTEST_SEGMENT",
    "Cascade",
    "Periodogram",
    "Rates",
    "additive_dof",
    "equivalent_dof",
    "periodograms",
    "rate_blocks",
    "welch",
]

Array = NDArray[np.float64]

#: Samples per segment of a long record.
SEGMENT = 1 << 14
#: A stream has at least so many segments, overlaps not counted.
FEWEST_SEGMENTS = 4
#: Shortest segment that is worth a transform.
SHORTEST_SEGMENT = 16
#: Bins 0 to 2 hold the mean and its leakage through the Hann window.
FIRST_BIN = 3
#: A segment may miss this share of its weight: what lies under the ends of its window.
SEGMENT_MISSING = 1e-3
#: Shorter segments are tried where gaps leave less than this share of the segments.
ENOUGH = 0.5

DECIMATION = 8
#: Usable band of a decimated stream over its rate: aliases are 80 dB down there.
USABLE = 0.25
#: A decimated sample may miss this share of its weight.
FILTER_MISSING = 0.12


@dataclass(frozen=True, slots=True, kw_only=True)
class Periodogram:
    """Averaged periodogram of one stream.

    Attributes
    ----------
    frequency, density : ndarray, shape (segment // 2 + 1,) [Hz], [unit^2/Hz]
        All bins; two-sided density, the decimation filter taken out.
    first, last : int
        Bins [first, last) are this stream's share of the spectrum.
    segment : int
        Samples per segment.
    segments, pairs, skipped : int
        Segments averaged, neighbouring pairs of them, segments skipped for missing samples.
    merged : int
        Bins of the transform in each bin.
    edf : float
        Equivalent degrees of freedom of one bin, for white noise without bridged samples.
    bridged : Bridged
        What the density holds for bridged samples.
    """

    frequency: Array
    density: Array
    first: int
    last: int
    segment: int
    segments: int
    pairs: int
    skipped: int
    merged: int = 1
    edf: float = math.nan
    bridged: Bridged = field(default_factory=Bridged)

    @property
    def resolution(self) -> float:
        """Distance of two bins [Hz]."""
        return float(self.frequency[1] - self.frequency[0])

    def merge(self, bins: int) -> Periodogram:
        """The same at a resolution coarser by a factor: means over adjacent bins."""
        whole = len(self.frequency) // bins * bins
        return replace(
            self,
            frequency=self.frequency[:whole].reshape(-1, bins).mean(axis=1),
            density=self.density[:whole].reshape(-1, bins).mean(axis=1),
            first=-(-self.first // bins),
            last=self.last // bins,
            merged=self.merged * bins,
        )


def periodograms(
    recording: Recording,
    name: str,
    progress: Callable[[float], None] | None = None,
    least: int = FEWEST_SEGMENTS,
    first: Cascade | None = None,
) -> list[Periodogram]:
    """Periodograms of a channel in its own unit, the full rate first, that share the frequencies among them.

    Parameters
    ----------
    recording : Recording
    name : str
        A channel; angles and velocities are differenced to rates.
    progress : callable, optional
        Called with the fraction done.
    least : int
        Segments of each stream at least, overlaps not counted.
    first : Cascade, optional
        With long segments, that another pass has fed.

    Returns
    -------
    list of Periodogram
        Empty where no segment is complete enough. Segments are shortened when gaps leave no room for long ones.
    """
    longest, best, kept = SEGMENT, 0.0, list[Periodogram]()
    while longest >= SHORTEST_SEGMENT and best < ENOUGH:
        cascade = first or _fed(Cascade(recording, longest, least), recording, name, progress)
        streams, first = cascade.periodograms(), None
        share = min((p.segments / (p.segments + p.skipped) for p in streams), default=0.0)
        if share > best:
            best, kept = share, streams
        longest //= 8
    return kept


class Cascade:
    """Decimated streams of a record that comes in blocks, each with its sum of periodograms.

    Parameters
    ----------
    recording : Recording
    longest : int
        Samples per segment at most.
    least : int
        Segments of each stream at least, overlaps not counted.
    """

    __slots__ = ("_bridge", "_dt", "_least", "_streams")

    def __init__(self, recording: Recording, longest: int = SEGMENT, least: int = FEWEST_SEGMENTS) -> None:
        self._dt, self._least = 1 / recording.rate, least
        self._streams = _plan(recording.n_samples, self._dt, longest, least)
        self._bridge = Bridge()

    def feed(self, rates: Array) -> None:
        """Take the next block, as `rate_blocks` gives it."""
        if not self._streams:
            return
        block = self._bridge(rates)
        for stream in self._streams:
            stream.welch.feed(block)
            if stream is not self._streams[-1]:
                block = stream.decimator.feed(block)

    def periodograms(self) -> list[Periodogram]:
        """Of what was fed, the full rate first; empty where no segment is complete enough."""
        kept = [s for s in self._streams if s.welch.segments >= self._least]
        if not kept:
            return []
        bridged = self._bridge.account(self._dt, kept[0].welch.seen)
        return [
            replace(p, density=p.density + bridged.put_back(p.frequency), bridged=bridged)
            for p in _shares(kept)
        ]


def _fed(
    cascade: Cascade, recording: Recording, name: str, progress: Callable[[float], None] | None
) -> Cascade:
    for done, block in rate_blocks(recording, name):
        cascade.feed(block)
        if progress is not None:
            progress(done / recording.n_samples)
    return cascade


def _plan(n_samples: int, dt: float, longest: int, least: int) -> list[_Stream]:
    """A stream for each decade or so; the last one's segments are a quarter of it, or as `least` says."""
    streams: list[_Stream] = []
    gain: tuple[float, ...] = ()
    while (room := n_samples // least) >= SHORTEST_SEGMENT:
        power = 1 << (room.bit_length() - 1)
        length = min(longest, power + power // 2 if power + power // 2 <= room else power)
        streams.append(_Stream(welch=_Welch(length), decimator=_Decimator(), dt=dt, stages=gain))
        if length < longest:
            break
        gain, n_samples, dt = (*gain, dt), n_samples // DECIMATION, dt * DECIMATION
    return streams


def welch(
    recording: Recording,
    name: str,
    length: int,
    *,
    window: Window = HANN,
    overlap: float = 0.5,
    progress: Callable[[float], None] | None = None,
) -> Periodogram:
    """Averaged periodogram of segments of `length` samples at the full rate, in the channel's own unit.

    Parameters
    ----------
    recording : Recording
    name : str
    length : int
    window : Window
    overlap : float
        Part of a segment that it shares with the next.
    progress : callable, optional

    Returns
    -------
    Periodogram
        Without segments where gaps leave none whole enough.
    """
    dt, whole = 1 / recording.rate, _Welch(length, window, max(round(length * (1 - overlap)), 1))
    bridge = Bridge()
    for done, block in rate_blocks(recording, name):
        whole.feed(bridge(block))
        if progress is not None:
            progress(done / recording.n_samples)
    bridged = bridge.account(dt, whole.seen)
    frequency = np.arange(length // 2 + 1) / (length * dt)
    return Periodogram(
        frequency=frequency,
        density=whole.density() * dt + bridged.put_back(frequency),
        first=window.order + 2,
        last=length // 2 - window.order,
        segment=length,
        segments=whole.segments,
        pairs=whole.pairs,
        skipped=whole.skipped,
        edf=whole.edf(),
        bridged=bridged,
    )


def rate_blocks(recording: Recording, name: str) -> Iterator[tuple[int, Array]]:
    """Blocks of the channel as rates less a constant, with the number of samples read, in the channel's own unit."""
    rates = Rates(recording, name)
    for start, samples in recording.blocks(name):
        yield start + len(samples), rates(samples)


class Rates:
    """Makes successive blocks of a channel to rates less a constant, in the channel's own unit."""

    __slots__ = ("_integrated", "_last", "_origin", "_rate")

    def __init__(self, recording: Recording, name: str) -> None:
        self._integrated, self._rate = recording[name].kind.integrated, recording.rate
        self._origin, self._last = math.nan, np.full(1, np.nan)

    def __call__(self, samples: Array) -> Array:
        block = samples
        if self._integrated:
            block = np.diff(samples, prepend=self._last) * self._rate
            self._last = samples[-1:]
        if math.isnan(self._origin) and not np.isnan(block).all():
            self._origin = float(np.nanmean(block))
        return block if math.isnan(self._origin) else block - self._origin


def _shares(streams: list[_Stream]) -> list[Periodogram]:
    shares: list[Periodogram] = []
    for stream, slower in zip(streams, [*streams[1:], None], strict=True):
        frequency = np.arange(stream.welch.length // 2 + 1) / (stream.welch.length * stream.dt)
        gain = np.ones_like(frequency)
        for dt in stream.stages:
            gain *= _response(frequency * dt)
        below = USABLE / slower.dt if slower else 0.0
        top = int(USABLE * stream.welch.length) if stream.stages else len(frequency)
        shares.append(
            Periodogram(
                frequency=frequency,
                density=stream.welch.density() * stream.dt / gain,
                first=max(FIRST_BIN, int(np.searchsorted(frequency, below))),
                last=top,
                segment=stream.welch.length,
                segments=stream.welch.segments,
                pairs=stream.welch.pairs,
                skipped=stream.welch.skipped,
                edf=stream.welch.edf(),
            )
        )
    return shares


# -- segments ---------------------------------------------------------------------------------------------


class _Welch:
    """Sum of |windowed transform|^2 over overlapping segments of a stream fed in blocks."""

    __slots__ = (
        "_before",
        "_hop",
        "_lags",
        "_rest",
        "_shape",
        "_sum",
        "_window",
        "length",
        "segments",
        "skipped",
    )

    def __init__(self, length: int, window: Window = HANN, hop: int | None = None) -> None:
        self.length = length
        self.segments = self.skipped = 0
        self._shape = window
        self._window = window.samples(length)
        self._hop = length // 2 if hop is None else hop
        self._sum = np.zeros(length // 2 + 1)
        self._rest = np.zeros(0)
        reach = -(-length // self._hop) - 1  # segments ahead that share samples with one
        self._before = np.zeros(reach, dtype=bool)
        self._lags = np.zeros(reach, dtype=np.int64)

    @property
    def pairs(self) -> int:
        """Neighbouring segments that were both used."""
        return int(self._lags[0]) if len(self._lags) else 0

    @property
    def seen(self) -> int:
        """Samples under the segments that were used, about."""
        return self.segments * self.length - self.pairs * max(self.length - self._hop, 0)

    def feed(self, block: Array) -> None:
        stream = np.concatenate([self._rest, block])
        count = max((len(stream) - self.length) // self._hop + 1, 0)
        if count:
            segments = np.lib.stride_tricks.sliding_window_view(stream, self.length)[:: self._hop]
            batch = max((1 << 17) // self.length, 1)
            complete = not math.isnan(float(stream.sum()))
            for first in range(0, count, batch):
                self._add(segments[first : first + batch], complete)
        self._rest = stream[count * self._hop :]

    def _add(self, segments: Array, complete: bool) -> None:
        if complete or not math.isnan(float(segments.sum())):
            used, weighted = np.ones(len(segments), dtype=bool), segments * self._window
        else:
            used, weighted = _weighted(segments, self._window)
        line = np.concatenate([self._before, used])
        for lag in range(1, len(self._lags) + 1):
            self._lags[lag - 1] += int(np.sum(line[len(self._before) - lag : -lag] & used))
        self._before = line[len(used) :]
        self.segments += int(used.sum())
        self.skipped += int(np.sum(~used))
        self._sum += _power(weighted)

    def density(self) -> Array:
        """Mean |transform|^2 over the energy of the window: the two-sided density at dt = 1."""
        return self._sum / (max(self.segments, 1) * float(np.sum(self._window**2)))

    def edf(self) -> float:
        """Equivalent degrees of freedom of a bin: 2 segments/(1 + 2 sum of the correlations of those that overlap).

        The correlation of two powers is the squared correlation of the windows that they share [Welch 1967, eq. 6].
        """
        shared = self._shape.overlap(self.length, self._hop)[1:]
        both = float(shared @ self._lags) / max(self.segments, 1)
        return 2 * self.segments / (1 + 2 * both)


def _power(segments: Array) -> Array:
    parts = np.fft.rfft(segments, axis=1).view(np.float64)  # real and imaginary parts by turns
    squares: Array = np.einsum("ij,ij->j", parts, parts)
    return np.asarray(squares[::2] + squares[1::2])


def _weighted(segments: Array, window: Array) -> tuple[NDArray[np.bool_], Array]:
    """Segments with missing samples: those used, and their windowed values, missing samples at weight zero."""
    missing = np.isnan(segments)
    used = missing @ window**2 <= SEGMENT_MISSING * np.sum(window**2)
    segments, present = segments[used], ~missing[used]
    mean = np.zeros((len(segments), 1))
    holed = ~present.all(axis=1)  # elsewhere the window keeps the mean to bins that are not used
    if holed.any():
        mean[holed] = np.nanmean(segments[holed], axis=1, keepdims=True)
    energy = np.sum(window**2) / np.maximum(present @ window**2, 1e-300)
    return used, np.where(present, segments - mean, 0.0) * window * np.sqrt(energy)[:, None]


def equivalent_dof(bins: int, segments: int, pairs: int) -> float:
    """Equivalent degrees of freedom of the mean of adjacent bins of an averaged Hann periodogram.

    Counts the correlation of neighbouring bins (4/9, 1/36) and of overlapping segments (1/36, ...), exactly so for
    white noise (Welch 1967, eq. 6, extended to bands of bins).
    """
    within, between = _crowding(bins)
    return float(2 * bins * segments / (within + 2 * pairs / segments * between))


def additive_dof(edf: Array, bins: NDArray[np.int64]) -> Array:
    """Degrees of freedom of neighbouring means that may be added up: what each knows that the others do not.

    Two narrow means side by side share bins that are correlated; a sum of their `equivalent_dof` counts those twice.
    """

    def crowd(n: int) -> float:
        within, between = _crowding(n)
        return within + 2 * between

    return np.array([e * crowd(int(n)) / crowd(1 << 20) for e, n in zip(edf, bins, strict=True)])


def _crowding(bins: int) -> tuple[float, float]:
    """Sum of the correlations of a bin with all bins of its band: within a segment, and with the next one."""
    same, overlapping = _hann_correlations()
    taper = np.maximum(1 - np.arange(len(same)) / bins, 0)
    within = taper[0] * same[0] + 2 * float(taper[1:] @ same[1:])
    between = taper[0] * overlapping[0] + 2 * float(taper[1:] @ overlapping[1:])
    return within, between


@lru_cache(maxsize=1)
def _hann_correlations() -> tuple[Array, Array]:
    """Correlation of the powers of bins d apart, d = 0...7: in one segment, and in two that overlap by half."""
    return HANN.neighbours(64, 32, 7)


# -- decimation -------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _filter() -> Array:
    """Low-pass of 80 taps: flat to a quarter of the new rate, 80 dB down from three quarters of it on."""
    taps = 10 * DECIMATION
    time = np.arange(taps) - (taps - 1) / 2
    kernel = np.sinc(time / DECIMATION) * np.kaiser(taps, 7.86)
    return np.asarray(kernel / kernel.sum(), dtype=np.float64)


def _response(frequency: Array) -> Array:
    """Power gain of the filter at `frequency`, in cycles per input sample."""
    taps = _filter()
    time = np.arange(len(taps)) - (len(taps) - 1) / 2
    half = len(taps) // 2
    return np.asarray((2 * np.cos(2 * np.pi * np.outer(frequency, time[half:])) @ taps[half:]) ** 2)


class _Decimator:
    """Low-pass and decimation by eight of a stream fed in blocks: one matrix product for each block."""

    __slots__ = ("_rest",)

    def __init__(self) -> None:
        self._rest = np.zeros(0)

    def feed(self, block: Array) -> Array:
        stream = np.concatenate([self._rest, block])
        rows = len(stream) // DECIMATION
        outputs = max(rows - len(_filter()) // DECIMATION + 1, 0)
        self._rest = stream[outputs * DECIMATION :]
        table = stream[: rows * DECIMATION].reshape(rows, DECIMATION)
        if not outputs or not math.isnan(float(table.sum())):
            return _filtered(table, _filter(), outputs)
        present = ~np.isnan(table)
        weight = _filtered(present.astype(np.float64), _filter(), outputs)
        lost = _filtered((~present).astype(np.float64), np.abs(_filter()), outputs) / np.abs(_filter()).sum()
        kept = lost <= FILTER_MISSING
        return np.where(
            kept,
            _filtered(np.where(present, table, 0.0), _filter(), outputs) / np.where(kept, weight, 1.0),
            np.nan,
        )


def _filtered(table: Array, taps: Array, outputs: int) -> Array:
    rows = taps.reshape(-1, DECIMATION)
    parts = np.empty(
        (len(rows), len(table))
    )  # a row for each part of the taps: what is added up lies side by side
    for first in range(0, len(table), 3072):  # so small that no linear algebra library starts threads for it
        np.matmul(rows, table[first : first + 3072].T, out=parts[:, first : first + 3072])
    out = np.zeros(outputs)
    for j, part in enumerate(parts):
        out += part[j : j + outputs]
    return out


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stream:
    """One rate of the cascade; `stages` are the sample intervals of the decimators before it."""

    welch: _Welch
    decimator: _Decimator
    dt: float
    stages: tuple[float, ...]
