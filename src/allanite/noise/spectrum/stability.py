# SPDX-License-Identifier: BSD-3-Clause
"""Is a spectral line a sinusoid? Its amplitude and phase, part by part of the record.

The record is demodulated at the frequency of the line in half-overlapping segments under a Hann window. The frequency
is refined until the phase stands still; then the record is cut into parts, each with one complex amplitude. A
sinusoid in noise of density S has the same in all of them, but for noise of known size,

    variance of each quadrature = 2 S sum(v^2)/(sum v)^2/dt,                                            (1)

v being the weights of the part: the sum of squares about the mean is chi-square with two degrees of freedom for each
part, less one for the amplitude, the phase and the frequency. A line that fails is a line still, with a mean power
and no phase. A stable line can be taken out of the samples: it costs three numbers, and leaves no lag bent. A line so
near half the sample rate that it overlaps its image is left to `near_nyquist`.

References
----------
.. [1] D. Rife, R. Boorstyn, "Single-tone parameter estimation from discrete-time observations", IEEE Trans. Inf.
   Theory 20 (1974) 591: the bounds that the intervals of amplitude and frequency reach.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import Sinusoid
from allanite.noise.sinusoid_sum import SinusoidSum
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.near_nyquist import NearNyquist, NyquistFit, near_nyquist
from allanite.noise.spectrum.periodogram import rate_blocks
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.distributions import chi_square_quantile, chi_square_tail, normal_quantile
from allanite.recording.records import Recording
from allanite.recording.sample_columns import Column

__all__ = ["examined", "sinusoids", "without_sinusoids", "without_stable_lines"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: A stable line is called unstable once in a hundred.
_REFUSED = 0.01
#: Parts of the record that are compared: at most so many, each of several segments.
_MOST_PARTS, _FEWEST_PARTS = 24, 4
#: A segment may miss this share of its weight.
_MISSING = 0.5
_TOO_FEW = "too few parts of the record are complete enough to test its phase"
_FINE = 8  # points of the frequency search for each resolved one


def examined(recording: Recording, spectrum: Spectrum) -> tuple[SpectralLine, ...]:
    """The lines of a spectrum with their intervals, each tested for being a sinusoid."""
    names = [
        NearNyquist(line, recording.rate)
        if near_nyquist(line, recording.rate)
        else _Demodulator(line, recording.rate)
        for line in spectrum.lines
    ]
    for done, block in rate_blocks(recording, spectrum.channel):
        for one in names:
            one.feed(done - len(block), block)
    scale = recording[spectrum.channel].scale  # its sign turns the phase
    return tuple(
        _alternating(line, one.fitted(_density(line, spectrum) / scale**2), scale)
        if isinstance(one, NearNyquist)
        else _judged(line, one.segments() * scale, one, spectrum)
        for line, one in zip(spectrum.lines, names, strict=True)
    )


def _density(line: SpectralLine, spectrum: Spectrum) -> float:
    """Of the noise around a line."""
    return float(np.interp(line.frequency, spectrum.frequency, spectrum.background))


def sinusoids(spectrum: Spectrum) -> tuple[Sinusoid, ...]:
    """The stable lines of a spectrum as terms of a noise model."""
    return tuple(_sinusoid(line, spectrum) for line in spectrum.lines if line.stable)


def _sinusoid(line: SpectralLine, spectrum: Spectrum) -> Sinusoid:
    """The line before it was averaged over the samples; the phase belongs to the instant, not to the mean."""
    turn = 2 * math.pi * line.frequency * spectrum.dt
    if spectrum.sampling == "point":
        return Sinusoid(amplitude=line.amplitude, frequency=line.frequency, phase=line.phase)
    size = line.amplitude / float(np.sinc(line.frequency * spectrum.dt))
    return Sinusoid(amplitude=size, frequency=line.frequency, phase=line.phase - turn / 2)


def without_stable_lines(recording: Recording, spectrum: Spectrum) -> Recording:
    """The recording of the spectrum's channel alone, without its stable lines.

    Parameters
    ----------
    recording : Recording
        Recording that the spectrum was computed from.
    spectrum : Spectrum
        Spectrum of one of its channels, by `power_spectrum`.
    """
    lines = [line for line in spectrum.lines if line.stable]
    if not lines:
        return recording.select(spectrum.channel)
    frequency, amplitude, phase = np.array([(x.frequency, x.amplitude, x.phase) for x in lines]).T
    size = amplitude / recording[spectrum.channel].scale
    return without_sinusoids(recording, spectrum.channel, frequency / recording.rate, size, phase)


def without_sinusoids(
    recording: Recording, name: str, frequency: Array, size: Array, phase: Array
) -> Recording:
    """The recording of one channel alone, without sinusoids in its samples, or in its rates where it is integrated.

    Parameters
    ----------
    frequency : ndarray, shape (n,) [cycles per sample]
    size : ndarray, shape (n,)
        Amplitudes in the channel's own unit, negative where the scale factor is.
    phase : ndarray, shape (n,) [rad]
        Of the sines at the first sample.
    """
    alone = recording.select(name)
    if alone.channels[0].kind.integrated:  # the running sum of A sin(2 pi f k + phase)/rate, less a constant
        size = size / recording.rate / (2 * np.sin(np.pi * frequency))
        phase = phase + np.pi * frequency - np.pi / 2
    waves = SinusoidSum(frequencies=frequency, cosines=size * np.sin(phase), sines=size * np.cos(phase))
    return replace(alone, columns=(_WithoutWaves(alone.columns[0], waves),))


@dataclass(frozen=True, slots=True)
class _WithoutWaves:
    """A column without some sinusoids, in its own unit."""

    of: Column
    waves: SinusoidSum

    @property
    def origin(self) -> float:
        return self.of.origin

    @property
    def dtype(self) -> np.dtype[np.float64]:
        return np.dtype(np.float64)

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> Array:
        samples = self.of.read(start, stop)
        return np.asarray(samples - self.waves.samples(start, len(samples)))


# -- amplitudes, segment by segment ------------------------------------------------------------------------


class _Demodulator:
    """Complex amplitudes of one line in half-overlapping Hann segments, from a stream fed in blocks."""

    def __init__(self, line: SpectralLine, rate: float) -> None:
        self.cycles = line.frequency / rate  # per sample
        # a segment is half as long as those of the spectrum: the frequency may be off by a bin, and is refined
        self.hop = max(round(rate / line.width / 2), 4)
        self._rest = np.zeros(0)
        self._sums: list[Complex] = []
        self._weights: list[Array] = []
        wave = np.exp(-2j * np.pi * (self.cycles * np.arange(self.hop) % 1.0))
        rise = np.sin(np.pi * (np.arange(self.hop) + 0.5) / (2 * self.hop)) ** 2
        self._halves = np.stack([rise, 1 - rise], axis=1)
        self._waves = np.concatenate(
            [(wave[:, None] * self._halves).real, (wave[:, None] * self._halves).imag], axis=1
        )

    def feed(self, _: int, block: Array) -> None:
        stream = np.concatenate([self._rest, block])
        rows = len(stream) // self.hop
        table = stream[: rows * self.hop].reshape(rows, self.hop)
        self._rest = stream[rows * self.hop :]
        if not rows:
            return
        weight = np.tile(self._halves.sum(axis=0), (rows, 1))
        if math.isnan(float(table.sum())):
            present = ~np.isnan(table)
            level = np.where(present, table, 0.0).sum(axis=1) / np.maximum(present.sum(axis=1), 1)
            table = np.where(present, table - level[:, None], 0.0)
            weight = present.astype(np.float64) @ self._halves
        parts = table @ self._waves
        self._sums.append(parts[:, :2] + 1j * parts[:, 2:])
        self._weights.append(weight)

    def segments(self) -> Complex:
        """Amplitude of A sin(2 pi f t + phase) as A exp(i phase), segment by segment; NaN where too much is missing."""
        if not self._sums:
            return np.zeros(0, dtype=np.complex128)
        sums, weights = np.concatenate(self._sums), np.concatenate(self._weights)
        # a level that is the same through a segment is not seen: the window and the line's cycles cancel it
        whole = sums[:-1, 0] + np.exp(-2j * np.pi * (self.cycles * self.hop % 1.0)) * sums[1:, 1]
        weight = weights[:-1, 0] + weights[1:, 1]
        start = np.exp(-2j * np.pi * (self.cycles * self.hop * np.arange(len(whole)) % 1.0))
        kept = weight > (1 - _MISSING) * self.hop
        return np.where(kept, 2j * start * whole / np.where(kept, weight, 1.0), np.nan)


# -- the test ----------------------------------------------------------------------------------------------


def _judged(line: SpectralLine, a: Complex, how: _Demodulator, spectrum: Spectrum) -> SpectralLine:
    """The line with intervals and the verdict of the test."""
    good = np.flatnonzero(np.isfinite(a.real))
    if len(good) < 2 * _FEWEST_PARTS:
        return _unstable(line, len(good), _TOO_FEW)
    shift = _frequency_shift(a, good)  # cycles per hop
    still = a * np.exp(-2j * np.pi * shift * np.arange(len(a)))
    density = _density(line, spectrum)
    means, sizes = _parts(still, good)
    one = 2 * density / (spectrum.dt * how.hop)
    spread = one * (sizes - 0.25) / sizes**2  # eq. (1): half-overlapping Hann windows add up to a flat top
    mean = np.sum(means / spread) / np.sum(1 / spread)
    chi2 = float(np.sum(np.abs(means - mean) ** 2 / spread))
    p = chi_square_tail(chi2, 2 * len(means) - 3)
    if p < _REFUSED:
        excess = max(chi2 / (2 * len(means) - 3) - 1, 0.0) * 2 * float(np.mean(spread))
        return _unstable(line, len(good), _wandering(excess, abs(mean)), p)
    # so far the phase is that of the middle of the first segment, a hop after the first sample
    frequency = (how.cycles + shift / how.hop) / spectrum.dt
    phase = float(np.angle(mean * np.exp(-2j * np.pi * shift * (1 - 0.5 / how.hop))))
    amplitude, sd = float(abs(mean)), math.sqrt(one / len(good))
    length = len(good) * how.hop * spectrum.dt
    drift = math.sqrt(12) * sd / (amplitude * 2 * math.pi * length)  # [1]: the slope of a phase known to sd/A
    z = normal_quantile(0.975)
    return replace(
        line,
        frequency=frequency,
        amplitude=amplitude,
        amplitude_lower=max(amplitude - z * sd, 0.0),
        amplitude_upper=amplitude + z * sd,
        frequency_lower=frequency - z * drift,
        frequency_upper=frequency + z * drift,
        stable=True,
        coherence=p,
        phase=phase,
    )


def _frequency_shift(a: Complex, good: NDArray[np.int64]) -> float:
    """Frequency that is left in the amplitudes [cycles per hop]: the top of their periodogram."""
    filled = np.zeros(len(a), dtype=np.complex128)
    filled[good] = a[good]
    size = _FINE << (len(a) - 1).bit_length()
    power = np.abs(np.fft.fft(filled, size)) ** 2
    top = int(np.argmax(power))
    left, here, right = (math.log(max(float(power[(top + d) % size]), 1e-300)) for d in (-1, 0, 1))
    bend = left - 2 * here + right
    place = top + (0.5 * (left - right) / bend if bend < 0 else 0.0)
    return (place / size + 0.5) % 1.0 - 0.5


def _parts(a: Complex, good: NDArray[np.int64]) -> tuple[Complex, Array]:
    """Mean amplitude of each part of the record, and the segments in it."""
    count = min(max(len(good) // 3, _FEWEST_PARTS), _MOST_PARTS)
    groups = np.array_split(good, count)
    return np.array([a[g].mean() for g in groups]), np.array([float(len(g)) for g in groups])


def _alternating(line: SpectralLine, fit: NyquistFit | None, scale: float) -> SpectralLine:
    """The line with what least squares beside its image gives, from samples in the channel's own unit."""
    if fit is None:
        return _unstable(line, 2, _TOO_FEW)
    if fit.p < _REFUSED:
        return _unstable(line, fit.segments, _wandering(fit.excess, fit.amplitude), fit.p)
    z, size = normal_quantile(0.975), abs(scale)
    return replace(
        line,
        frequency=fit.frequency,
        amplitude=fit.amplitude * size,
        amplitude_lower=max(fit.amplitude - z * fit.amplitude_sd, 0.0) * size,
        amplitude_upper=(fit.amplitude + z * fit.amplitude_sd) * size,
        frequency_lower=fit.frequency_lower,
        frequency_upper=fit.frequency_upper,
        stable=True,
        coherence=fit.p,
        phase=fit.phase if scale > 0 else fit.phase - math.copysign(math.pi, fit.phase),
        note=fit.note,
    )


def _wandering(excess: float, amplitude: float) -> str:
    share = math.sqrt(excess) / max(amplitude, 1e-300)
    if share > 1:
        return "amplitude and phase change through the record: no sinusoid"
    return f"amplitude and phase wander by {share:.1%} of the line through the record: no sinusoid"


def _unstable(line: SpectralLine, segments: int, note: str, p: float = math.nan) -> SpectralLine:
    """Mean power of a line without a phase: its segments are taken as independent complex normal amplitudes."""
    dof = max(segments, 2)
    return replace(
        line,
        amplitude_lower=line.amplitude * math.sqrt(dof / chi_square_quantile(0.975, dof)),
        amplitude_upper=line.amplitude * math.sqrt(dof / chi_square_quantile(0.025, dof)),
        frequency_lower=line.frequency - line.width / 2,
        frequency_upper=line.frequency + line.width / 2,
        stable=False,
        coherence=p,
        note=note,
    )
