# SPDX-License-Identifier: BSD-3-Clause
"""A line near half the sample rate, by least squares beside its mirror image.

A sinusoid at half the rate less d cycles per sample overlaps its image at half the rate plus d: no window separates
them. The samples times (-1)^k are real, with a slow sinusoid of frequency d,

    y_k = B cos(2 pi d k) + C sin(2 pi d k),                                                            (1)

which is fitted to sums over short blocks, gaps included. At d = 0 the second column is zero: the samples alternate
by B, and amplitude and phase of the source are confounded. The line is taken for that unless a beat with the sample
rate is significant, or the samples do not alternate steadily.

Stability is tested as for other lines: each part of the record is fitted on its own, and the sum of squares that this
gains is chi-square, with one degree of freedom for each column that a part resolves, less those of the whole.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.lines import SpectralLine
from allanite.quantities.distributions import chi_square_tail, normal_quantile

__all__ = ["NearNyquist", "NyquistFit", "near_nyquist"]

Array = NDArray[np.float64]

#: Widths of a line from half the rate within which its image is fitted with it.
_REACH = 4.0
_PER_WIDTH = 32  # blocks per reciprocal width
#: Probability that a line at half the rate is taken for one beside it.
_BESIDE = 0.01
#: Cycles of the beat in the record below which it is no more than a level and a slope.
_FEWEST_CYCLES = 0.05
#: Alternations that scatter more are less probable than this, and tried as a beat.
_UNSTEADY = 0.05
_FINE = 8  # points of the search for each resolved frequency
_STEPS = 20
_PARTS = 16
#: Share of the larger eigenvalue below which a part does not resolve the second column.
_COLLINEAR = 1e-3
_FEWEST_BLOCKS = 4 * _PARTS


def near_nyquist(line: SpectralLine, rate: float) -> bool:
    """Whether a line overlaps its image."""
    return line.frequency > rate / 2 - _REACH * line.width


@dataclass(frozen=True, slots=True, kw_only=True)
class NyquistFit:
    """A line near half the rate, in the channel's own unit.

    Attributes
    ----------
    frequency, frequency_lower, frequency_upper : float [Hz]
    amplitude, amplitude_sd : float
    phase : float [rad]
        Of the sine at the first sample.
    p : float
        Probability that a sinusoid scatters more.
    excess : float
        Variance of the amplitude through the record beyond that of noise.
    segments : int
        Stretches of the record that the spectrum resolves.
    note : str
    """

    frequency: float
    frequency_lower: float
    frequency_upper: float
    amplitude: float
    amplitude_sd: float
    phase: float
    p: float
    excess: float
    segments: int
    note: str


class NearNyquist:
    """Alternating sums of a stream fed in blocks, and the line in them."""

    def __init__(self, line: SpectralLine, rate: float) -> None:
        self._rate = rate
        self._size = 2 * max(round(rate / line.width / _PER_WIDTH / 2), 1)  # even: a level cancels
        self._farthest = (rate / 2 - line.frequency + line.width) / rate
        self._signs = np.where(np.arange(self._size) % 2, -1.0, 1.0)
        self._rest = np.zeros(0)
        self._sums: list[Array] = []
        self._weights: list[Array] = []

    def feed(self, _: int, block: Array) -> None:
        """Take the next samples."""
        stream = np.concatenate([self._rest, block])
        rows = len(stream) // self._size
        table = stream[: rows * self._size].reshape(rows, self._size)
        self._rest = stream[rows * self._size :]
        present = np.isfinite(table)
        counts, signs = present.sum(axis=1), present @ self._signs
        table = np.where(present, table, 0.0)
        lean = signs / np.maximum(counts, 1)  # what gaps leave of a level
        self._sums.append(table @ self._signs - lean * table.sum(axis=1))
        self._weights.append(counts - lean * signs)

    def fitted(self, density: float) -> NyquistFit | None:
        """The line in noise of this two-sided density [own unit squared per Hz]; None where too little is there."""
        y, w = np.concatenate([np.zeros(0), *self._sums]), np.concatenate([np.zeros(0), *self._weights])
        if np.count_nonzero(w) < _FEWEST_BLOCKS:
            return None
        beat = _Beat(y=y, w=w, size=self._size, noise=density * self._rate)
        return self._stated(beat, beat.best(self._farthest))

    def _stated(self, beat: _Beat, d: float) -> NyquistFit:
        z, n = normal_quantile(0.975), len(beat.y) * self._size
        (b, c), amplitude_sd, d_sd = beat.at(d)
        p, excess = beat.scatter(d)
        half = self._rate / 2
        # B and C belong to the middle; (-1)^k cos(2 pi d k - a) is cos(2 pi (1/2 - d) k + a)
        at_start = math.atan2(c, b) + 2 * math.pi * d * beat.middle
        confounded = d * n < 1
        lower, upper = (0.0, 1 / n) if confounded else (max(d - z * d_sd, 0.0), d + z * d_sd)
        return NyquistFit(
            frequency=half - d * self._rate,
            frequency_lower=half - upper * self._rate,
            frequency_upper=half - lower * self._rate,
            amplitude=math.hypot(b, c),
            amplitude_sd=amplitude_sd,
            phase=(at_start + math.pi / 2 + math.pi) % (2 * math.pi) - math.pi,
            p=p,
            excess=excess,
            segments=len(beat.y) // _PER_WIDTH,
            note=_CONFOUNDED if confounded else "",
        )


_CONFOUNDED = (
    "not resolved from half the sample rate: the amplitude is that of the samples; amplitude and phase of its source "
    "are confounded"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Beat:
    """Alternating sums y of blocks, their weights w (variance over that of a sample), and equation (1) in them."""

    y: Array
    w: Array
    size: int
    noise: float

    @property
    def middle(self) -> float:
        """Of the record [samples], from the first."""
        return (len(self.y) * self.size - 1) / 2

    @property
    def _time(self) -> Array:
        return np.asarray((np.arange(len(self.y)) - (len(self.y) - 1) / 2) * self.size)

    def _columns(self, d: float) -> Array:
        """Means over blocks of cosine and sine; of the cosine alone at d = 0."""
        if d == 0:
            return np.ones((1, len(self.y)))
        shrunk = math.sin(math.pi * d * self.size) / (self.size * math.sin(math.pi * d))
        angle = 2 * np.pi * d * self._time
        return shrunk * np.stack([np.cos(angle), np.sin(angle)])

    def _solved(self, columns: Array) -> tuple[Array, Array, float]:
        """Sizes of the columns, their covariance for noise of variance one, and the gain in the sum of squares."""
        scale = np.sqrt(np.einsum("ij,j,ij->i", columns, self.w, columns))
        scaled = columns / scale[:, None]
        inverse = np.linalg.pinv((scaled * self.w) @ scaled.T, rcond=1e-12, hermitian=True)
        right = scaled @ self.y
        return inverse @ right / scale, inverse / np.outer(scale, scale), float(right @ inverse @ right)

    def _with_slope(self, d: float) -> Array:
        columns = self._columns(d)
        b, c = self._solved(columns)[0]
        slope = 2 * np.pi * self._time * (c * columns[0] - b * columns[1])
        return np.stack([*columns, slope])

    def best(self, farthest: float) -> float:
        """Distance from half the rate [cycles per sample]; zero unless a beat is significant."""
        n = len(self.y) * self.size
        d = max(self._climbed(self._searched(farthest), farthest), _FEWEST_CYCLES / n, key=self._gain)
        price = 2 * math.log(max(d * n, 1.0) / _BESIDE)
        price += math.log(
            math.pi * price / 6
        )  # the largest of a search: see fitting.likelihood.lines, eq. (1)
        beats = self._gain(d) - self._gain(0.0) > price * self.noise
        return d if beats or self.scatter(0.0)[0] < _UNSTEADY else 0.0

    def _gain(self, d: float) -> float:
        return self._solved(self._columns(d))[2]

    def _searched(self, farthest: float) -> float:
        """The best of a grid: equation (1) by transforms of y and of w."""
        count = _FINE << (len(self.y) - 1).bit_length()
        last = min(int(farthest * self.size * count), count // 4)
        k = np.arange(math.ceil(_FEWEST_CYCLES * count / len(self.y)), last + 1)
        y, w = np.fft.fft(self.y, count)[k], np.fft.fft(self.w, count)[2 * k]
        total = float(self.w.sum())
        cc, ss, cs = (total + w.real) / 2, (total - w.real) / 2, -w.imag / 2
        b, c = y.real, -y.imag
        gain = (ss * b**2 - 2 * cs * b * c + cc * c**2) / (cc * ss - cs**2)
        return float(k[np.argmax(gain)]) / count / self.size

    def _climbed(self, d: float, farthest: float) -> float:
        """The maximum nearby, by Gauss-Newton steps that never go down."""
        gain, least = self._gain(d), _FEWEST_CYCLES / (len(self.y) * self.size)
        for _ in range(_STEPS):
            step = float(self._solved(self._with_slope(d))[0][2])
            there = min(max(d + step, least), farthest)
            new = self._gain(there)
            if new <= gain:
                break
            d, gain = there, new
        return d

    def at(self, d: float) -> tuple[tuple[float, float], float, float]:
        """B and C, and the standard deviations of amplitude and d."""
        if d == 0:
            (b,), spread, _ = self._solved(self._columns(d))
            return (float(b), 0.0), math.sqrt(self.noise * float(spread[0, 0])), math.inf
        b, c = self._solved(self._columns(d))[0]
        spread = self._solved(self._with_slope(d))[1] * self.noise
        along = np.array([b, c]) / math.hypot(b, c)
        of_amplitude = math.sqrt(max(float(along @ spread[:2, :2] @ along), 0.0))
        return (float(b), float(c)), of_amplitude, math.sqrt(max(float(spread[2, 2]), 0.0))

    def scatter(self, d: float) -> tuple[float, float]:
        """Probability of a larger scatter from part to part, and its variance beyond that of noise."""
        columns = self._columns(d)
        rest = self.y - self.w * (self._solved(columns)[0] @ columns)
        gained, dof = 0.0, 0
        for part in np.array_split(np.arange(len(self.y)), _PARTS):
            near = columns[:, part]
            normal = (near * self.w[part]) @ near.T
            size, axes = np.linalg.eigh(normal)
            used = size > _COLLINEAR * max(float(size[-1]), 1e-300)
            gained += float(np.sum((axes.T @ (near @ rest[part]))[used] ** 2 / size[used]))
            dof += int(used.sum())
        dof -= 1 if d == 0 else 3
        excess = max(gained / self.noise / dof - 1, 0.0) * self.noise * _PARTS / float(self.w.sum())
        return chi_square_tail(gained / self.noise, dof), excess
