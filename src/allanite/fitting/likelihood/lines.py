# SPDX-License-Identifier: BSD-3-Clause
"""Spectral lines in a record: frequency, amplitude and phase by least squares, and the record without them.

Noise is nearly white over the width of a line, 1/record, so least squares on sine and cosine is as good as the
likelihood [1]. The record is cut into some thousand blocks, of which sums remain: of the samples, of the waves at the
given frequency, of their products. A line a few widths away turns against that wave by little within a block, so that
normal equations for any frequency nearby follow from the sums, with gaps, with the image at the negative frequency, and
for a line of few periods as for one of a million. Slowly turning waves are sums of some dozen Legendre polynomials, for
which the equations are set up once. The best of a grid is refined by Gauss-Newton steps.

A polynomial of degree five in every stretch of some eight periods is fitted with the line, and with it goes what slow
noise would leak: the ends of a random walk would double its power at every frequency, those of its rest add a tenth. A
line of fewer than four periods is hardly more than such a curve.

A line at half the sample rate is an alternation, cos(pi k): its sine is zero in every sample, and with it goes what
amplitude and phase would tell of each other. One closer to that than a fiftieth of a width is the same in the record,
and is fitted there.

Lines within eight widths of each other are fitted together. Others disturb each other by their tails alone: each is
fitted to the record less the others, until nothing moves.

A sinusoid whose frequency is known gains a chi-square(2) in 2 ln L where there is none. Its frequency is looked for
over w widths of a line, 1/record, and the largest gain x over them exceeds a level as often as the envelope of a
Gaussian process crosses it [2]; with the mean square slope of a record of that length, pi^2/3 per squared width,

    P(gain > x) = w sqrt(pi x/6) exp(-x/2),                                                                (1)

which is 1 % at the price of a line: 30 for the n/2 frequencies of 16 384 samples, 15 for one line whose place is given.

References
----------
.. [1] U. Grenander, M. Rosenblatt, "Statistical Analysis of Stationary Time Series", Wiley 1957, section 7.
.. [2] R. B. Davies, "Hypothesis testing when a nuisance parameter is present only under the alternative",
   Biometrika 74 (1987) 33, section 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.sinusoid_sum import SinusoidSum

__all__ = [
    "FEWEST_PERIODS",
    "GIVEN_WIDTHS",
    "Line",
    "checked_lines",
    "fit_lines",
    "line_price",
    "near",
    "without",
]

Array = NDArray[np.float64]
Chunks = Callable[[], Iterator[Array]]

#: Periods of a line in the record, below which it is not told from slow noise.
FEWEST_PERIODS = 4.0
_BLOCKS = 1024  # or up to twice as many
_PERIODS, _LEAST_BLOCKS, _DEGREE = 8.0, 32, 5  # of a stretch, and of the curve that is fitted in it
_REACH = 3.0  # in units of 1/record: how far from the given frequency a line is looked for
_PER_WIDTH = 8  # points of the grid
_NEAR = 8.0  # widths: lines that are fitted together
_NYQUIST = 0.5  # cycles per sample
_UNRESOLVED = 0.02  # widths: a line so close to half the sample rate is fitted there
_SAME = 0.5  # widths: two lines are looked for no closer than that
_ROUNDS, _STEPS = 8, 30
_MORE_TERMS = 16  # polynomials beyond pi for each turn, after which nothing is left of a wave
_WAVES = 6  # of a group: columns of its sums
#: Chance that noise alone pays the price.
_FALSE_ALARM = 0.01
#: Widths over which a line is looked for whose frequency is given: three on either side.
GIVEN_WIDTHS = 2 * _REACH


def line_price(widths: float) -> float:
    """What a line must gain in 2 ln L that was looked for over so many widths: equation (1).

    >>> round(line_price(8192), 1), round(line_price(6), 1)
    (30.0, 14.8)
    """
    x = 2 * math.log(widths / _FALSE_ALARM)
    for _ in range(50):  # a contraction: its slope is 1/x
        x = 2 * math.log(widths / _FALSE_ALARM) + math.log(math.pi * x / 6)
    return x


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """cosine cos(2 pi f k) + sine sin(2 pi f k) in sample k; f in cycles per sample.

    `variances` are those of amplitude and frequency where the noise is white with variance one: in long records without
    gaps 2/n and 6/(pi^2 A^2 n^3) (Rife and Boorstyn 1974). At half the sample rate, f = 0.5, the sine is zero, and the
    record does not tell the frequency from its neighbors: the first is 1/n, the second infinite. `gain` is what the
    line takes off the sum of squares.
    """

    frequency: float
    cosine: float
    sine: float
    variances: tuple[float, float]
    gain: float

    @property
    def amplitude(self) -> float:
        return math.hypot(self.cosine, self.sine)

    @property
    def alternates(self) -> bool:
        """Whether it lies at half the sample rate."""
        return self.frequency == _NYQUIST


def without(chunks: Iterator[Array], lines: Sequence[Line]) -> Iterator[Array]:
    """The record less its lines."""
    if not lines:
        yield from chunks
        return
    waves = SinusoidSum(
        frequencies=np.array([line.frequency for line in lines]),
        cosines=np.array([line.cosine for line in lines]),
        sines=np.array([line.sine for line in lines]),
    )
    first = 0
    for chunk in chunks:
        yield chunk - waves.samples(first, len(chunk))
        first += len(chunk)


def checked_lines(lines: Iterable[float | str]) -> list[float]:
    """Frequencies of lines as numbers.

    Raises
    ------
    InputError
        No list, or something in it that is no number.
    """
    try:
        return [float(f) for f in lines]
    except (TypeError, ValueError):
        raise InputError(
            f"lines must be a list of frequencies in Hz, as in lines=[12.3], or 'auto', not {lines!r}"
        ) from None


def fit_lines(chunks: Chunks, n_samples: int, frequencies: Sequence[float]) -> tuple[Line, ...]:
    """The lines near these frequencies [cycles per sample].

    Parameters
    ----------
    chunks : callable
        Gives the record from its beginning, NaN where missing.
    n_samples : int
    frequencies : sequence of float
        Each with at least `FEWEST_PERIODS` in the record.
    """
    frequencies = [_NYQUIST if (_NYQUIST - f) * n_samples < _UNRESOLVED else f for f in frequencies]
    groups = [_Group(n_samples, *zip(*near, strict=True)) for near in _neighbours(frequencies, n_samples)]
    fitted: dict[int, Line] = {}
    for i in range(_ROUNDS):
        _read(chunks, groups, list(fitted.values()))
        before, fitted = fitted, {}
        for group in groups:
            fitted |= group.fitted(before, search=i < 2)
        if len(groups) == 1 or all(k in before and _stands(before[k], fitted[k], n_samples) for k in fitted):
            break
    return tuple(fitted[k] for k in range(len(frequencies)))


def near(line: Line, others: Iterable[Line], n_samples: int) -> bool:
    """Whether a line is fitted together with one of the others."""
    return any(abs(line.frequency - other.frequency) * n_samples < _NEAR for other in others)


def _neighbours(frequencies: Sequence[float], n_samples: int) -> list[list[tuple[float, int]]]:
    """Frequencies, and which they are, in groups that are fitted together."""
    groups: list[list[tuple[float, int]]] = []
    for f, i in sorted(zip(frequencies, range(len(frequencies)), strict=True)):
        if groups and (f - groups[-1][-1][0]) * n_samples < _NEAR:
            groups[-1].append((f, i))
        else:
            groups.append([(f, i)])
    return groups


def _stands(before: Line, now: Line, n_samples: int) -> bool:
    away = math.hypot(now.cosine - before.cosine, now.sine - before.sine)
    turned = 2 * math.pi * abs(now.frequency - before.frequency) * n_samples
    return away + turned * now.amplitude <= 1e-5 * now.amplitude


def _read(chunks: Chunks, groups: Sequence[_Group], lines: Sequence[Line]) -> None:
    """One pass: sums over blocks of the record less all lines that are known."""
    size = groups[0].size
    place = (np.arange(size) + 0.5) / size - 0.5
    waves = np.stack([np.ones(size), place, place**2, *(w for g in groups for w in g.waves(place))], axis=1)
    rest = np.zeros(0)
    sums, counts = [], []
    for chunk in _and_then(without(chunks(), lines), np.full(-groups[0].n_samples % size, np.nan)):
        joined = np.concatenate([rest, chunk])
        n = len(joined) // size * size
        rows, rest = joined[:n].reshape(-1, size), joined[n:]
        here = np.isfinite(rows)
        if here.all():
            sums.append(rows @ waves)
            counts.append(np.broadcast_to(waves.sum(axis=0), (len(rows), waves.shape[1])))
        else:
            sums.append(np.where(here, rows, 0.0) @ waves)
            counts.append(here @ waves)
    data, there = np.concatenate(sums), np.concatenate(counts)
    for i, group in enumerate(groups):
        of_line = slice(3 + _WAVES * i, 3 + _WAVES * (i + 1))
        group.take(data[:, :2], data[:, of_line][:, :2], there[:, :3], there[:, of_line])


def _and_then(chunks: Iterator[Array], last: Array) -> Iterator[Array]:
    yield from chunks
    yield last


@dataclass(slots=True)
class _Group:
    """Lines that are fitted together, and what is left of the record for that.

    A wave near `centre` is alpha cos + beta sin of that frequency, alpha and beta constant within a block and sums of
    Legendre polynomials over the record. A curve is a line within a block: were it constant there, the rest of a ramp
    would be a sawtooth, with lines of its own.

    Attributes
    ----------
    n_samples : int
    given : tuple of float [cycles per sample]
    which : tuple of int
        Their places among all lines.
    centre : float [cycles per sample]
    size : int
        Samples in a block.
    basis : ndarray, shape (blocks, degree + 1)
        The polynomials that waves are sums of.
    middle : ndarray [samples]
        Points at which a wave is evaluated for that, and
    change : ndarray
        what takes its values there to its coefficients.
    curves : ndarray, shape (blocks, 2, degree + 1)
        Legendre polynomials, each stretch its own: value in the middle of a block and slope.
    starts : ndarray of int
        First block of each stretch.
    normal, right : ndarray
        Normal equations of all waves beside a curve in every stretch.
    """

    n_samples: int
    given: tuple[float, ...]
    which: tuple[int, ...]
    centre: float = field(init=False)
    size: int = field(init=False)
    basis: Array = field(init=False)
    middle: Array = field(init=False)
    change: Array = field(init=False)
    curves: Array = field(init=False)
    starts: NDArray[np.int64] = field(init=False)
    normal: Array = field(init=False)
    right: Array = field(init=False)

    def __post_init__(self) -> None:
        self.centre = (self.given[0] + self.given[-1]) / 2
        self.size = max(self.n_samples // _BLOCKS, 1)
        blocks = -(-self.n_samples // self.size)
        whole = blocks * self.size
        farthest = (self.given[-1] - self.given[0]) / 2 + _REACH / self.n_samples
        terms = math.ceil(math.pi * farthest * whole) + _MORE_TERMS
        nodes, weights = np.polynomial.legendre.leggauss(terms + _MORE_TERMS)
        self.middle = (nodes + 1) / 2 * whole - 0.5
        self.change = np.polynomial.legendre.legvander(nodes, terms - 1).T * weights
        self.change *= np.arange(terms)[:, None] + 0.5
        x = _centres(np.full(blocks, blocks))
        self.basis = np.asarray(np.polynomial.legendre.legvander(x, terms - 1), dtype=np.float64)
        stretches = max(min(round(self.given[0] * self.n_samples / _PERIODS), blocks // _LEAST_BLOCKS), 1)
        self.starts = np.arange(stretches) * blocks // stretches
        lengths = np.diff(self.starts, append=blocks)
        lengths, starts = np.repeat(lengths, lengths), np.repeat(self.starts, lengths)
        x = _centres(lengths, starts)
        value = np.polynomial.legendre.legvander(x, _DEGREE)
        slope = np.polynomial.legendre.legval(x, np.polynomial.legendre.legder(np.eye(_DEGREE + 1))).T
        self.curves = np.stack([value, slope * (2 / lengths)[:, None]], axis=1, dtype=np.float64)

    def waves(self, place: Array) -> list[Array]:
        """What the samples of a block are multiplied by: see `take`."""
        angle = 2 * np.pi * self.centre * np.arange(self.size)
        c, s = np.cos(angle), np.sin(angle)
        return [c, s, place * c, place * s, np.cos(2 * angle), np.sin(2 * angle)]

    def take(self, samples: Array, turned: Array, there: Array, waves: Array) -> None:
        """The normal equations from sums over the blocks.

        Parameters
        ----------
        samples : ndarray, shape (blocks, 2)
            Sums of samples, and of samples times the place within the block.
        turned : ndarray, shape (blocks, 2)
            Sums of samples times cos and sin, which begin with each block anew, as all waves here.
        there : ndarray, shape (blocks, 3)
            Sums over the samples that are there of 1, the place, its square.
        waves : ndarray, shape (blocks, 6)
            Sums over them of the `waves`.
        """
        angle: Array = 2 * np.pi * self.centre * self.size * np.arange(len(there), dtype=np.float64)
        turned, double = _turned(turned, angle), _turned(waves[:, 4:], np.asarray(2 * angle))
        passing = np.stack([_turned(waves[:, :2], angle), _turned(waves[:, 2:4], angle)], axis=1)
        squares = np.stack([there[:, 0] + double[:, 0], double[:, 1], there[:, 0] - double[:, 0]]) / 2
        cc, cs, ss = (self.basis.T @ (q[:, None] * self.basis) for q in squares)
        self.normal = np.block([[cc, cs], [cs, ss]])
        self.right = (self.basis.T @ turned).T.ravel()

        places = there[:, [[0, 1], [1, 2]]]
        among = np.einsum("bpd,bpq,bqe->bde", self.curves, places, self.curves, optimize=True)
        inverse = np.linalg.pinv(np.add.reduceat(among, self.starts, axis=0), rcond=1e-10, hermitian=True)
        cross = np.einsum("bpj,bpd->bjd", passing, self.curves)
        along = np.concatenate(
            [
                np.add.reduceat(self.basis[:, :, None] * cross[:, None, j], self.starts, axis=0)
                for j in (0, 1)
            ],
            axis=1,
        )
        sums_of_samples = np.add.reduceat(np.einsum("bp,bpd->bd", samples, self.curves), self.starts, axis=0)
        bent = np.matmul(along, inverse)
        self.normal -= np.tensordot(bent, along, axes=([0, 2], [0, 2]))
        self.right -= np.tensordot(bent, sums_of_samples, axes=([0, 2], [0, 1]))

    # -- least squares ------------------------------------------------------------------------------------

    def columns(self, frequencies: Sequence[float]) -> Array:
        """Coefficients of cos and sin of each frequency, one after the other; shape (columns, coefficients)."""
        return self._coefficients(np.array(self._values(frequencies)))

    def _values(self, frequencies: Sequence[float]) -> list[Array]:
        """The same as alpha and beta in the points."""
        waves = []
        for f in frequencies:
            angle = 2 * np.pi * (f - self.centre) * self.middle
            c, s = np.cos(angle), np.sin(angle)
            sine = np.stack([s, c])
            waves += [np.stack([c, -s]), np.zeros_like(sine) if f == _NYQUIST else sine]
        return waves

    def _coefficients(self, values: Array) -> Array:
        return np.asarray((values @ self.change.T).reshape(len(values), -1))

    def equations(self, columns: Array) -> tuple[Array, Array]:
        """Normal equations of some waves: matrix and right side."""
        return columns @ self.normal @ columns.T, columns @ self.right

    def gain(self, frequencies: Sequence[float]) -> float:
        """By how much waves of these frequencies lessen the sum of squares."""
        normal, right = self.equations(self.columns(frequencies))
        return float(right @ _solved(normal, right))

    # -- the fit ------------------------------------------------------------------------------------------

    def fitted(self, before: dict[int, Line], *, search: bool) -> dict[int, Line]:
        """The lines by their places; what was known of them is in the sums no more, and is added."""
        known = [before[k] for k in self.which if k in before]
        if known:
            sizes = [size for line in known for size in (line.cosine, line.sine)]
            self.right += self.normal @ (np.array(sizes) @ self.columns([k.frequency for k in known]))
        starts = [[k.frequency for k in known] or list(self.given)]
        if search:
            starts.append(self._searched())
        best = [float(f) for f in self._climbed(max(starts, key=self.gain))]
        return dict(zip(self.which, self._lines(best), strict=True))

    def _window(self, given: float) -> tuple[float, float]:
        """Where a line is looked for: neither among slow noise nor beyond half of the rate."""
        if given == _NYQUIST:
            return given, given
        width = 1 / self.n_samples
        low = max(given - _REACH * width, min(given, FEWEST_PERIODS * width))
        return low, min(given + _REACH * width, max(given, _NYQUIST - width))

    def _searched(self) -> list[float]:
        """The best places on a grid, that of the strongest line first."""
        best_places: list[float] = []
        left = list(self.given)
        while left:
            tried = []
            for given in left:
                low, high = self._window(given)
                grid = np.linspace(low, high, int((high - low) * self.n_samples * _PER_WIDTH) + 2)
                free = [f for f in grid if all(abs(f - g) * self.n_samples >= _SAME for g in best_places)]
                tried += [(self.gain([*best_places, f]), f, given) for f in free or [given]]
            _, place, given = max(tried)
            best_places.append(float(place))
            left.remove(given)
        return sorted(best_places)

    def _climbed(self, frequencies: Sequence[float]) -> list[float]:
        """The maximum of the gain nearby, by Gauss-Newton steps that never go down."""
        windows = [self._window(f) for f in self.given]
        here, gain = list(frequencies), self.gain(frequencies)
        for _ in range(_STEPS):
            normal, right = self.equations(self._with_slopes(here))
            step = _solved(normal, right)[2::3]
            for _ in range(10):
                there = [min(max(f + d, a), b) for f, d, (a, b) in zip(here, step, windows, strict=True)]
                new = self.gain(there)
                if new >= gain:
                    break
                step = step / 2
            else:
                break
            moved = max(abs(a - b) for a, b in zip(here, there, strict=True))
            here, gain = there, new
            if moved * self.n_samples < 1e-9:
                break
        return here

    def _with_slopes(self, frequencies: Sequence[float]) -> Array:
        """Of each line cos, sin, and the derivative of what is fitted with the frequency."""
        size = _solved(*self.equations(self.columns(frequencies)))
        values, columns = self._values(frequencies), []
        # about the middle of the record: the phase at the beginning would be nearly the same thing as frequency
        k = self.middle - (self.n_samples - 1) / 2
        for i in range(0, len(values), 2):
            slope = (
                2 * np.pi * k * (size[i + 1] * values[i] - size[i] * values[i + 1])
            )  # zero at half the rate
            columns += [values[i], values[i + 1], slope]
        return self._coefficients(np.array(columns))

    def _lines(self, frequencies: Sequence[float]) -> list[Line]:
        waves, right = self.equations(self.columns(frequencies))
        size = _solved(waves, right)
        normal = self.equations(self._with_slopes(frequencies))[0]
        free = sum(1 if f == _NYQUIST else 3 for f in frequencies)
        determined = np.linalg.matrix_rank(_scaled(normal)[0], tol=1e-10, hermitian=True) == free
        spread = _inverse(normal)
        fitted = []
        for i, f in enumerate(frequencies):
            a, b = float(size[2 * i]), float(size[2 * i + 1])
            along = np.array([a, b]) / (math.hypot(a, b) or 1.0)
            of_line = spread[3 * i : 3 * i + 2, 3 * i : 3 * i + 2]
            of_frequency = math.inf if f == _NYQUIST else float(spread[3 * i + 2, 3 * i + 2])
            variances = (float(along @ of_line @ along), of_frequency)
            gain = (a**2 + b**2) / variances[0] if variances[0] > 0 else 0.0
            if (
                _NYQUIST - f
            ) * self.n_samples < 1:  # amplitude and phase are confounded, but the wave is there
                gain = float(np.array([a, b]) @ waves[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] @ [a, b])
            if not determined:
                variances, gain = (math.inf, math.inf), 0.0
            fitted.append(Line(frequency=f, cosine=a, sine=b, variances=variances, gain=gain))
        return fitted


def _centres(lengths: NDArray[np.int64], starts: NDArray[np.int64] | int = 0) -> Array:
    """Middle of each block in a row of so many, which begins with that one: from -1 to 1."""
    return np.asarray(2 * (np.arange(len(lengths)) - starts + 0.5) / lengths - 1)


def _turned(sums: Array, angle: Array) -> Array:
    """Sums with cos and sin of a wave whose phase is ahead by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * sums[:, 0] - s * sums[:, 1], s * sums[:, 0] + c * sums[:, 1]], axis=1)


def _scaled(normal: Array) -> tuple[Array, Array]:
    """Normal equations whose columns have length one, and their lengths."""
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    size[size == 0] = np.inf
    return normal / np.outer(size, size), size


def _inverse(normal: Array) -> Array:
    """Of normal equations; a direction without information counts in nothing."""
    scaled, size = _scaled(normal)
    return np.asarray(np.linalg.pinv(scaled, rcond=1e-12, hermitian=True) / np.outer(size, size))


def _solved(normal: Array, right: Array) -> Array:
    return np.asarray(_inverse(normal) @ right)
