# SPDX-License-Identifier: BSD-3-Clause
"""Spectral lines: narrow peaks that noise alone would show in fewer than one record of a thousand.

The background is a running median in frequency. A bin of the averaged periodogram over its background follows, for
noise alone, the law of a weighted sum of exponential variables; the threshold is taken from the far tail of that
law, for all bins tested together. A peak is a line when it is as narrow as the window allows and stands out of its
own neighbourhood too. Bins are tested one by one, and in groups of eight for lines that drift; a broad hump is not a
line at either resolution.

At half the sample rate a spectrum is its own mirror image. The bin there is real, with one degree of freedom for each
segment; the window mixes some of it into the bin below. Both have laws of their own, and a line within a few bins
overlaps its image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.periodogram import Periodogram

__all__ = ["FALSE_ALARM", "SpectralLine", "find_lines", "without_lines"]

Array = NDArray[np.float64]

#: Probability that a record of pure noise shows any line.
FALSE_ALARM = 1e-3
#: Bins next to the ends of a stream have no background on one side.
EDGE = 32
#: Half-width of the running median: so many bins, or this share of the frequency.
HALF_BINS, HALF_SHARE = 28, 0.08
#: Bins at these distances on both sides are the neighbourhood that a line must stand out of.
RING = (4, 17)
#: Widest line at half its height [bins]; the Hann window alone gives 2 or 3.
WIDEST = 3
#: Bins that are merged to look for drifting lines.
MERGED = 8
#: Power of the weakest credible line over the strongest: the decimation filters are 80 dB deep.
DYNAMIC_RANGE = 1e-7
#: A harmonic is looked for up to this multiple of its line.
HARMONICS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class SpectralLine:
    """A narrow peak of the spectrum.

    Attributes
    ----------
    frequency : float [Hz]
        Frequency of the line.
    amplitude : float
        Amplitude of the sinusoid in the samples, in SI: half the peak-to-peak value.
    significance : float
        -log10 of the probability of such a peak from noise alone, anywhere in the record: 3 and more. For a harmonic,
        anywhere among the multiples of its line.
    width : float [Hz]
        Resolution of the spectrum there: the line is no wider.
    amplitude_lower, amplitude_upper : float
        95 % interval of the amplitude; NaN if the record was not examined for it.
    frequency_lower, frequency_upper : float [Hz]
        95 % interval of the frequency. A line that is not stable is somewhere within its width.
    stable : bool
        Amplitude and phase stay the same through the record: the line is a sinusoid.
    coherence : float
        Probability that a sinusoid in this noise scatters more from part to part of the record; NaN: not examined.
    phase : float [rad]
        Phase of the sine of a stable line at the first sample.
    note : str
        Remark on the line.
    """

    frequency: float
    amplitude: float
    significance: float
    width: float
    amplitude_lower: float = math.nan
    amplitude_upper: float = math.nan
    frequency_lower: float = math.nan
    frequency_upper: float = math.nan
    stable: bool = False
    coherence: float = math.nan
    phase: float = math.nan
    note: str = ""


def find_lines(streams: Sequence[Periodogram]) -> tuple[SpectralLine, ...]:
    """Lines in the periodograms of one channel, by frequency. Amplitudes are in the periodograms' unit."""
    searches = [_LineSearch.of(p) for p in (*streams, *(p.merge(MERGED) for p in streams))]
    tested = sum(s.tested for s in searches)
    if not tested:
        return ()
    lines = _distinct([line for s in searches for line in s.peaks(tested)])
    return _distinct([*lines, *_harmonics(searches, lines)])


def _distinct(peaks: Sequence[SpectralLine]) -> tuple[SpectralLine, ...]:
    """One line for each peak, by frequency: the sharpest view of it, if it is no ghost of a far stronger line."""
    weakest = math.sqrt(DYNAMIC_RANGE) * max((line.amplitude for line in peaks), default=0.0)
    kept: list[SpectralLine] = []
    for line in sorted(peaks, key=lambda line: (line.width, -line.significance)):
        if line.amplitude > weakest and all(_apart(line, other) for other in kept):
            kept.append(line)
    return tuple(sorted(kept, key=lambda line: line.frequency))


def _apart(line: SpectralLine, other: SpectralLine) -> bool:
    return abs(line.frequency - other.frequency) > 2 * max(line.width, other.width)


def _harmonics(searches: Iterable[_LineSearch], lines: Sequence[SpectralLine]) -> list[SpectralLine]:
    """Peaks at multiples of known lines: so few places are looked at that weaker peaks count."""
    targets = [(h * line.frequency, h * line.width / 2) for line in lines for h in range(2, HARMONICS + 1)]
    peaks: list[SpectralLine] = []
    for search in searches:
        near = [search.near(f, spread) for f, spread in targets]
        places = np.unique(np.concatenate([*near, np.zeros(0, dtype=np.int64)]))
        if len(places):
            tests = len(places) * len(lines)
            peaks += search.peaks(tests, places)
    return peaks


def without_lines(stream: Periodogram, lines: Iterable[SpectralLine]) -> Periodogram:
    """The periodogram with the background put in the place of the lines."""
    near = [np.flatnonzero(np.abs(stream.frequency - line.frequency) < 6 * line.width) for line in lines]
    bins = np.unique(np.concatenate([*near, np.zeros(0, dtype=np.int64)]))
    if not len(bins):
        return stream
    density = stream.density.copy()
    density[bins] = np.minimum(_LineSearch.of(stream).background[bins], density[bins])
    return replace(stream, density=density)


@dataclass(frozen=True, slots=True, kw_only=True)
class _LineSearch:
    """A periodogram with its background; bins [first, last) may hold lines."""

    stream: Periodogram
    background: Array
    uncertainty: float
    first: int
    last: int

    @classmethod
    def of(cls, stream: Periodogram) -> _LineSearch:
        if len(stream.density) < 4 * EDGE:  # no room for a background
            return cls(stream=stream, background=stream.density, uncertainty=0.0, first=0, last=0)
        background, uncertainty = _background(stream)
        edge = EDGE if stream.last < len(stream.frequency) else 0
        return cls(
            stream=stream,
            background=background,
            uncertainty=uncertainty,
            first=max(stream.first, EDGE),
            last=min(stream.last, len(stream.frequency) - edge),
        )

    @property
    def tested(self) -> int:
        return max(self.last - self.first, 0)

    def near(self, frequency: float, spread: float) -> NDArray[np.int64]:
        """Tested bins within `spread` and one bin of a frequency."""
        middle, reach = frequency / self.stream.resolution, spread / self.stream.resolution + 1
        bins = np.arange(
            max(math.floor(middle - reach), self.first), min(math.ceil(middle + reach) + 1, self.last)
        )
        return bins.astype(np.int64)

    def peaks(self, tests: int, places: NDArray[np.int64] | None = None) -> list[SpectralLine]:
        """Lines among `places` (all tested bins), each significant among so many tests."""
        if not self.tested or not np.any(self.background > 0):
            return []
        places = np.arange(self.first, self.last) if places is None else places
        mirrored = np.concatenate([self.stream.density, self._image()])
        lines: list[SpectralLine] = []
        for law, bins in self._laws(places):
            threshold = law.quantile(math.log(FALSE_ALARM / tests)) * (1 + 2 * self.uncertainty)
            high = bins[mirrored[bins] > threshold * self.background[bins]]
            tops = [int(b) for b in high if mirrored[b] == mirrored[b - 2 : b + 3].max()]
            peaks = (self._line(top, mirrored, threshold, law, tests) for top in tops)
            lines += [line for line in peaks if line]
        return lines

    @property
    def _nyquist(self) -> int:
        """Bin at half the sample rate, or the one that would follow the last merged bin."""
        return len(self.stream.density) - (self.stream.merged == 1)

    def _image(self) -> Array:
        """What the neighborhood of the last bin continues as: half the sample rate is a mirror."""
        image: Array = self.stream.density[self._nyquist - RING[1] - 1 : self._nyquist][::-1]
        return image

    def _laws(self, places: NDArray[np.int64]) -> Iterator[tuple[_Law, NDArray[np.int64]]]:
        """Laws, and the bins that follow them."""
        below = np.full(len(places), 2)
        if self.stream.merged == 1:  # of merged bins the last holds one part in eight of this
            below = np.minimum(self._nyquist - places, 2)
        for distance in np.unique(below):
            yield _Law(self.stream, int(distance)), places[below == distance]

    def _line(
        self, top: int, mirrored: Array, threshold: float, law: _Law, tests: int
    ) -> SpectralLine | None:
        step = self.stream.resolution
        near = [
            mirrored[max(top - RING[1], 1) : top - RING[0]],
            mirrored[top + RING[0] + 1 : top + RING[1] + 1],
        ]
        base = max(float(np.median(np.concatenate(near))), float(self.background[top]))
        excess = mirrored[top - 5 : top + 6] - base
        unmirrored = (
            excess if top == self._nyquist else excess[: self._nyquist - top + 6]
        )  # the rest is its image
        if mirrored[top] <= threshold * base or np.sum(unmirrored > excess[5] / 2) > WIDEST:
            return None
        core = np.maximum(excess[3:8], 0.0)
        log_tail = law.log_tail(mirrored[top] / (base * (1 + 2 * self.uncertainty)))
        frequency = float(self.stream.frequency[top] + step * (core @ np.arange(-2, 3)) / core.sum())
        return SpectralLine(
            frequency=min(frequency, float(self.stream.frequency[-1])),
            amplitude=math.sqrt(2 * step * self._power(top, core)),
            significance=min(-(log_tail + math.log(tests)) / math.log(10), 300.0),
            width=2 * step,
        )

    def _power(self, top: int, core: Array) -> float:
        """Sum of bins at positive and negative frequencies; the one at half the sample rate is both."""
        away = self._nyquist - (top + np.arange(-2, 3))
        return float(core @ np.select([away > 0, away == 0], [2.0, 1.0], 0.0))


def _background(stream: Periodogram) -> tuple[Array, float]:
    """Running median over frequency as a mean level, and its relative standard deviation.

    A second pass over the ratio to the first takes out what slope and curvature leave.
    """
    bins = np.arange(1, len(stream.density))
    level = np.exp(_running_log_median(stream.density[1:], bins))
    ratio = np.divide(stream.density[1:], level, out=np.ones_like(level), where=level > 0)
    level = level * np.exp(_running_log_median(ratio, bins))
    law = _Law(stream)
    spread = 1.25 * law.deviation / math.sqrt(HALF_BINS)  # 2 HALF_BINS bins, about half of them independent
    return np.concatenate([level[:1], level]) / law.median, spread


def _running_log_median(values: Array, bins: NDArray[np.int64]) -> Array:
    """Log of the median around each bin, from knots 4 % apart, linear in log frequency and beyond the last knots."""
    count = int(25 * math.log(len(values) / HALF_BINS)) + 4
    middles = np.unique(np.geomspace(HALF_BINS + 3, len(values) - HALF_BINS // 2, count).astype(int))
    knot, level = np.empty(len(middles)), np.empty(len(middles))
    for i, middle in enumerate(middles):
        half = max(HALF_BINS, int(HALF_SHARE * middle))
        first, last = max(middle - half, 2), min(middle + half + 1, len(values))
        knot[i] = (bins[first] + bins[last - 1]) / 2
        level[i] = np.partition(values[first:last], (last - first) // 2)[(last - first) // 2]
    x, knot, level = np.log(bins), np.log(knot), np.log(np.maximum(level, 1e-300))
    result = np.interp(x, knot, level)
    for outside, ends in ((x < knot[0], slice(0, 5)), (x > knot[-1], slice(-5, None))):
        if outside.any():
            result[outside] = np.polyval(np.polyfit(knot[ends], level[ends], 1), x[outside])
    return np.asarray(result)


class _Law:
    """Distribution of an averaged Hann periodogram of noise over its mean: a sum of weighted exponentials.

    Segments that overlap by half are correlated with coherence 1/6, so that the weights are the eigenvalues
    1 + cos(t)/3 of a tridiagonal matrix, t spread over [0, pi]. Merged bins multiply them by the eigenvalues of the
    Hann window's coherences 1, 2/3, 1/6. Tails by saddle point (Lugannani and Rice 1980): a few per cent, however far
    out.

    Half the sample rate mirrors the spectrum, and real and imaginary part of a bin near it differ. Of the bin itself
    only the real part is left; one bin below, they are 7/12 and 5/12 of the power, with weights 7/12 + cos(t)/12 and
    5/12 + cos(t)/4. Each part is the square of a normal variable.

    Parameters
    ----------
    stream : Periodogram
    below : int
        Bins from half the sample rate; farther than one, the two parts are alike.
    """

    def __init__(self, stream: Periodogram, below: int = 2) -> None:
        nodes = min(stream.segments, 256 // stream.merged)  # more weights than that are a continuum
        link = np.cos(np.pi * np.arange(1, nodes + 1) / (nodes + 1)) / 3 * bool(stream.pairs)
        overlaps = 1 + link
        apart = np.abs(np.subtract.outer(range(stream.merged), range(stream.merged)))
        bins = np.linalg.eigvalsh(np.interp(apart, [0, 1, 2, 3], [1, 2 / 3, 1 / 6, 0])) / stream.merged
        if below == 1:
            overlaps = np.concatenate([7 / 6 + link / 2, 5 / 6 + 3 * link / 2])
        elif below == 0:
            overlaps = 2 * overlaps
        self._count = stream.segments / nodes / (1 if below > 1 else 2)
        self._weights = np.outer(np.maximum(bins, 0), overlaps).ravel() / stream.segments
        self.deviation = math.sqrt(self._count * float(np.sum(self._weights**2)))
        self.median = 1 - self.deviation**2 / 3

    def log_tail(self, x: float) -> float:
        """Natural logarithm of P(X > x); 0 at or below the mean."""
        return self._search(lambda place, _: place < x)[1] if x > 1 else 0.0

    def quantile(self, log_p: float) -> float:
        """x with P(X > x) = exp(log_p)."""
        return self._search(lambda _, log_tail: log_tail > log_p)[0]

    def _search(self, short_of: Callable[[float, float], bool]) -> tuple[float, float]:
        """x and log P(X > x) at the saddle point that parts those short of the aim from the others."""
        low, high = 0.0, (1 - 1e-12) / float(self._weights.max())
        for _ in range(60):
            s = (low + high) / 2
            low, high = (s, high) if short_of(*self._at(s)) else (low, s)
        return self._at(high)

    def _at(self, s: float) -> tuple[float, float]:
        t = 1 - s * self._weights
        place = self._count * float(np.sum(self._weights / t))
        curvature = self._count * float(np.sum((self._weights / t) ** 2))
        exponent = -self._count * float(np.sum(np.log(t))) - s * place
        return place, exponent - math.log(max(s * math.sqrt(2 * math.pi * curvature), 1.0))
