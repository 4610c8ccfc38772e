# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a log in motion: which are new, which are harmonics of one rotation, which may be aliases.

A motor makes lines at multiples of its rate. Each of n lines at random places lies at a multiple of a given frequency,
as far as both are known, with probability q, the share of the band that the multiples cover. So k of n are there with
the binomial tail P(k; n, q), times the frequencies tried: below `CHANCE` the lines are a comb. Multiples above half the
sample rate are folded into the band: an alias of a comb is a comb as well.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result

__all__ = ["CHANCE", "Comb", "MotionLine", "lines_in_motion"]

Array = NDArray[np.float64]

#: Probability that lines at random places are called a comb.
CHANCE = 1e-3
#: Multiples that are looked at, and multiples of the fundamental that may be its lowest line.
HARMONICS, LOWEST = 10, 3
#: Lines of a comb at least.
FEWEST = 3
#: Where the sensor's own filter takes half the power below this share of the Nyquist frequency, aliases are unlikely.
FILTERED = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLine(Result):
    """A spectral line of a log in motion.

    Attributes
    ----------
    frequency : float [Hz]
        Frequency in the samples.
    rms : Quantity
        Root mean square of the line in the samples, in the SI unit of the channel.
    at_rest : bool
        The log at rest has a line there as well.
    steady : bool
        Amplitude and phase stay the same: a sinusoid.
    comb : int or None
        Number of the comb that it belongs to, from 0.
    order : int or None
        Multiple of the comb's fundamental.
    folded : bool
        That multiple lies above half the sample rate, and is seen at its alias.
    aliases : tuple of float [Hz]
        Lowest frequencies above half the sample rate that would be seen here; none where the sensor's filter removes
        them.
    """

    frequency: float
    rms: Quantity
    at_rest: bool
    steady: bool
    comb: int | None = None
    order: int | None = None
    folded: bool = False
    aliases: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Comb(Result):
    """Lines at multiples of one frequency: a rotation, or its alias.

    Attributes
    ----------
    fundamental : float [Hz]
        Frequency whose multiples they are.
    orders : tuple of int
        Multiples that are there.
    p : float
        Chance of so many from lines at random places, for all frequencies tried.
    """

    fundamental: float
    orders: tuple[int, ...]
    p: float


@dataclass(frozen=True, slots=True)
class _Band:
    """Places of lines and how far off they may be [Hz], shape (n,), in samples at a rate [Hz]."""

    frequency: Array
    error: Array
    rate: float

    def multiples(self, fundamental: float) -> Array:
        """Where multiples 1, 2, ... are seen, shape (HARMONICS,)."""
        around = np.mod(fundamental * np.arange(1, HARMONICS + 1), self.rate)
        return np.asarray(np.minimum(around, self.rate - around))

    def reach(self, error: float) -> Array:
        """How far each line [rows] may be from each multiple [columns] of a frequency with this error."""
        return np.asarray(self.error[:, None] + error * np.arange(1, HARMONICS + 1))

    def orders(self, fundamental: float, error: float) -> NDArray[np.int64]:
        """Multiple that each line is, the nearest; 0 for none."""
        off = np.abs(self.frequency[:, None] - self.multiples(fundamental))
        near = off <= self.reach(error)
        best = np.argmin(np.where(near, off, np.inf), axis=1)
        return np.where(near.any(axis=1), best + 1, 0)

    def covered(self, error: float) -> float:
        """Share of the band in which a line would count as a multiple."""
        return min(2 * float(self.reach(error).mean(axis=0).sum()) / (self.rate / 2), 1.0)


def _tail(hits: int, n: int, q: float) -> float:
    """Probability of so many hits or more among n."""
    return math.fsum(math.comb(n, k) * q**k * (1 - q) ** (n - k) for k in range(hits, n + 1))


def _best(band: _Band, free: NDArray[np.bool_]) -> tuple[Comb, NDArray[np.int64]] | None:
    """The comb of the most lines among those that belong to none, of the lowest orders; and the order of each line."""
    combs: list[tuple[Comb, NDArray[np.int64]]] = []
    n = int(free.sum())
    for i, lowest in itertools.product(np.flatnonzero(free), range(1, LOWEST + 1)):
        fundamental, error = band.frequency[i] / lowest, band.error[i] / lowest
        orders = np.where(free, band.orders(fundamental, error), 0)
        distinct = sorted({int(order) for order in orders if order})
        if len(distinct) < FEWEST or math.gcd(*distinct) > 1:
            continue
        p = n * LOWEST * _tail(len(distinct) - 1, n - 1, band.covered(error))
        if p < CHANCE:
            combs.append((Comb(fundamental=float(fundamental), orders=tuple(distinct), p=p), orders))
    return max(combs, key=lambda each: (len(each[0].orders), -sum(each[0].orders)), default=None)


def lines_in_motion(
    motion: Spectrum, rest: Spectrum, unit: str
) -> tuple[tuple[MotionLine, ...], tuple[Comb, ...]]:
    """Lines of a spectrum in motion and their combs, the lines that are there at rest left out of these.

    Parameters
    ----------
    unit : str
        SI unit of the samples.
    """
    lines, rate = motion.lines, 1 / motion.dt
    at_rest = np.array([any(_same(line, other) for other in rest.lines) for line in lines], dtype=bool)
    band = _Band(np.array([line.frequency for line in lines]), np.array([*map(_error, lines)]), rate)
    free = ~at_rest
    combs: list[Comb] = []
    owner: list[tuple[int, int] | None] = [None] * len(lines)
    while (best := _best(band, free)) is not None:
        comb, orders = best
        for i in np.flatnonzero(orders):
            owner[i] = (len(combs), int(orders[i]))
        free = free & (orders == 0)
        combs.append(comb)
    made = [*_made(motion, unit, at_rest, owner, combs)]
    return tuple(made), tuple(combs)


def _made(
    motion: Spectrum,
    unit: str,
    at_rest: NDArray[np.bool_],
    owner: Sequence[tuple[int, int] | None],
    combs: Sequence[Comb],
) -> Iterator[MotionLine]:
    rate = 1 / motion.dt
    filtered = motion.corner is not None and motion.corner < FILTERED * rate / 2
    for line, quiet, owned in zip(motion.lines, at_rest, owner, strict=True):
        comb, order = owned or (None, None)
        folded = comb is not None and order is not None and order * combs[comb].fundamental > rate / 2
        root = math.sqrt(0.5)
        yield MotionLine(
            frequency=line.frequency,
            rms=Quantity(
                value=root * line.amplitude,
                lower=root * line.amplitude_lower,
                upper=root * line.amplitude_upper,
                unit=unit,
            ),
            at_rest=bool(quiet),
            steady=line.stable,
            comb=comb,
            order=order,
            folded=folded,
            aliases=() if filtered else (rate - line.frequency, rate + line.frequency),
        )


def _error(line: SpectralLine) -> float:
    """How far off the frequency of a line may be: twice its interval, or half a bin."""
    known = line.stable and math.isfinite(line.frequency_lower)
    return line.frequency_upper - line.frequency_lower if known else line.width / 4


def _same(line: SpectralLine, other: SpectralLine) -> bool:
    return abs(line.frequency - other.frequency) <= line.width + other.width
