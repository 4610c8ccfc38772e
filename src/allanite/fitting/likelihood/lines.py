# SPDX-License-Identifier: BSD-3-Clause
"""Spectral lines in a record: frequency, amplitude and phase by least squares, and the record without them.

Noise is nearly white over the width of a line, 1/record, so least squares on sine and cosine is as good as the
likelihood [1]. Two passes: the record is demodulated near each line, which gives the frequency; then sines and cosines
of all lines are fitted at once. The mean of each stretch of some periods is removed beforehand, and with it
what slow noise would leak.

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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["GIVEN_WIDTHS", "Line", "fit_lines", "line_price", "without"]

Array = NDArray[np.float64]
Chunks = Callable[[], Iterator[Array]]

_STRETCHES = 4096
_PERIODS = 8.0  # in a stretch, at least
_REACH = 3.0  # in units of 1/record: how far from the given frequency a line is looked for
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
    """cosine cos(2 pi f k) + sine sin(2 pi f k) in sample k; f in cycles per sample."""

    frequency: float
    cosine: float
    sine: float

    @property
    def amplitude(self) -> float:
        return math.hypot(self.cosine, self.sine)

    def samples(self, first: int, count: int) -> Array:
        """What the line adds to samples [first, first + count)."""
        angle = 2 * np.pi * self.frequency * np.arange(first, first + count)
        return np.asarray(self.cosine * np.cos(angle) + self.sine * np.sin(angle))


def without(chunks: Iterator[Array], lines: Sequence[Line]) -> Iterator[Array]:
    """The record less its lines."""
    first = 0
    for chunk in chunks:
        rest = chunk
        for line in lines:
            rest = rest - line.samples(first, len(chunk))
        first += len(chunk)
        yield rest


def fit_lines(chunks: Chunks, n_samples: int, frequencies: Sequence[float]) -> tuple[Line, ...]:
    """The lines near these frequencies [cycles per sample].

    Parameters
    ----------
    chunks : callable
        Gives the record from its beginning, NaN where missing.
    """
    size = max(n_samples // _STRETCHES, math.ceil(_PERIODS / min(frequencies)), 16)
    exact = [_refined(chunks, n_samples, size, f) for f in frequencies]
    columns = 2 * len(exact)
    normal, right = np.zeros((columns, columns)), np.zeros(columns)
    for first, block, here in _stretches(chunks(), size):
        angle = 2 * np.pi * np.outer(exact, np.arange(first, first + block.size))
        waves = np.concatenate([np.cos(angle), np.sin(angle)]) * here.ravel()
        means = waves.reshape(columns, -1, size).sum(axis=2) / np.maximum(here.sum(axis=1), 1)
        waves -= np.repeat(means, size, axis=1) * here.ravel()
        normal += waves @ waves.T
        right += waves @ block.ravel()
    found = np.linalg.lstsq(normal, right, rcond=1e-12)[0]
    n = len(exact)
    return tuple(
        Line(frequency=f, cosine=float(found[i]), sine=float(found[n + i])) for i, f in enumerate(exact)
    )


def _stretches(chunks: Iterator[Array], size: int) -> Iterator[tuple[int, Array, NDArray[np.bool_]]]:
    """Whole stretches less their means, zero where samples are missing: first sample, samples, which are there."""
    rest, first = np.zeros(0), 0
    for chunk in chunks:
        rest = np.concatenate([rest, chunk])
        whole = len(rest) // size * size
        if whole:
            block = rest[:whole].reshape(-1, size)
            here = np.isfinite(block)
            filled = np.where(here, block, 0.0)
            mean = filled.sum(axis=1, keepdims=True) / np.maximum(here.sum(axis=1, keepdims=True), 1)
            yield first, np.where(here, filled - mean, 0.0), here
            rest, first = rest[whole:], first + whole


def _refined(chunks: Chunks, n_samples: int, size: int, near: float) -> float:
    """Where the power of the demodulated record is greatest."""
    turned = []
    for first, block, _ in _stretches(chunks(), size):
        wave = np.exp(-2j * np.pi * near * np.arange(first, first + block.size))
        turned.append((block.ravel() * wave).reshape(-1, size).sum(axis=1))
    z = np.concatenate([*turned, np.zeros(1)])
    at = (np.arange(len(z)) + 0.5) * size / n_samples

    def power(shift: float) -> float:
        return float(abs(np.sum(z * np.exp(-2j * np.pi * shift * at))))

    grid = np.linspace(-_REACH, _REACH, int(16 * _REACH) + 1)
    best = float(grid[int(np.argmax([power(s) for s in grid]))])
    step = float(grid[1] - grid[0])
    for _ in range(20):  # golden enough: the step halves until 1e-6 of the width of a line
        best = max((best - step, best, best + step), key=power)
        step /= 2
    return near + best / n_samples
