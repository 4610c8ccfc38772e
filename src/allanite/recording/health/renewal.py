# SPDX-License-Identifier: BSD-3-Clause
"""Renewal of held values: the rate at which a sensor renews what a faster log repeats, and when it does.

A free-running sensor of r values per row (r < 1) renews its value at the first row after the instants (k + a)/r, k
whole. Rows that differ from the row before, the *fresh* rows, then have a spectral line at r cycles per row. The ratio
may be any, and the rows may jitter by less than the interval between values. Rows that repeat at random, or by the step
of the values, have no line. It is searched near the share of fresh rows, which differs from r by the values that no row
caught and by neighbors that are equal by chance.

The phase a of the line, block by block, follows the clock of the sensor along the record. It places every fresh row on
the grid of the values: k = round(r i - a). Two passes over the flags; the work is linear in the rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.sums import sum_of_products
from allanite.recording.records import BLOCK, Recording

__all__ = ["ALARM", "Renewal", "fresh_rows", "renewal_of"]

Samples = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Chance that rows which repeat at random show a line.
ALARM = 1e-6
#: Rows whose phase is taken together: short against the wander of two clocks, long against the holds.
PHASED = 512
#: Stretches, and rows in each, that are searched for the line.
STRETCHES, LENGTH = 16, 4096
#: Largest ratio of the rate to the share of fresh rows: with jitter, some values are caught by no row.
CAUGHT = 1.25
#: Intervals of the sensor, and rows, that a hold may last.
LONGEST = 3.0
#: Repeats beyond those by chance, as a share of these, that are worth a look: the step is known no better.
BEYOND = 0.2
#: Beat of sensor and log [cycles per row], absolute and as a share of the repeats, below which it may be a slow change
#: of the chance that neighbors are equal.
SLOWEST, CREDIBLE = 0.005, 0.25
#: Share of fresh rows that may stand beside the even grid of the values.
ASTRAY = 0.15


@dataclass(frozen=True, slots=True, kw_only=True)
class Renewal:
    """How some channels, all at the same rows, renew their values.

    Attributes
    ----------
    channels : tuple of str
    ratio : float
        Values per row, 0 to 1: the mean over the record.
    sd : float
        Standard uncertainty of `ratio`: the scatter of the renewals about an even clock at either end.
    line : float
        Values per row of the clock that `phase` refers to.
    at, phase : ndarray, shape (n_blocks,) [rows], [cycles]
        Phase of the sensor's clock about `line` there.
    earliest, latest : float [cycles]
        Fresh rows come within these bounds of the even clock.
    fresh, rows : int
        Fresh rows, and rows with a row before them.
    """

    channels: tuple[str, ...]
    ratio: float
    sd: float
    line: float
    at: Samples
    phase: Samples
    earliest: float
    latest: float
    fresh: int
    rows: int

    def cycles(self, row: Samples) -> Samples:
        """Count of the sensor's clock at rows, without its whole numbers' origin, shape (n,)."""
        return np.asarray(self.line * row - np.interp(row, self.at, self.phase))


def fresh_rows(recording: Recording, channels: Sequence[str]) -> Iterator[tuple[int, Mask, Mask]]:
    """Block by block: the first row, which rows differ from the row before in any channel, and which can be told.

    A row can be told where it and the row before hold a value in every channel.
    """
    last = np.full(len(channels), np.nan)
    for start in range(0, recording.n_samples, BLOCK):
        blocks = [recording.raw(name, start, start + BLOCK) for name in channels]
        fresh = np.zeros(len(blocks[0]), dtype=np.bool_)
        known = np.ones(len(blocks[0]), dtype=np.bool_)
        for i, block in enumerate(blocks):
            step = np.diff(block, prepend=last[i])
            fresh |= step != 0.0
            known &= ~np.isnan(step)
            last[i] = block[-1]
        known &= ~_frozen(fresh | ~known)
        yield start, fresh & known, known


def _frozen(fresh: Mask) -> Mask:
    """Rows in runs of repeats longer than holds are: frozen readings, which are no sensor's clock."""
    share = max(float(fresh.mean()), 1e-3)
    at = np.flatnonzero(fresh)
    edges = np.concatenate(([-1], at, [len(fresh)]))
    long = np.diff(edges) - 1 > LONGEST * (1.0 / share + 1.0)
    return np.repeat(long, np.diff(edges))[: len(fresh)] & ~fresh


def renewal_of(recording: Recording, channels: Sequence[str], by_chance: float = 0.0) -> Renewal | None:
    """The clock by which channels renew their values together; None where their repeats follow none.

    Parameters
    ----------
    by_chance : float
        Share of fresh values that equal the one before in every channel, from the step of the values.
    """
    located = _line(recording, channels, by_chance)
    if located is None:
        return None
    line, mirrored = located
    at, phase, fresh, rows = _phases(recording, channels, line)
    if len(at) < 2:
        return None
    scatter = _scatter(recording, channels, line, at, phase)
    if scatter is None:
        return None
    earliest, latest, sd, first, last = scatter
    span = max(last - first, 1.0)
    turned = float(np.interp(last, at, phase) - np.interp(first, at, phase))
    return Renewal(
        channels=tuple(channels),
        ratio=line - turned / span,
        sd=math.hypot(math.sqrt(2.0) * sd / span, mirrored),
        line=line,
        at=at,
        phase=phase,
        earliest=earliest,
        latest=latest,
        fresh=fresh,
        rows=rows,
    )


# -- the line ---------------------------------------------------------------------------------------------


def _line(recording: Recording, channels: Sequence[str], by_chance: float) -> tuple[float, float] | None:
    """Frequency of the line of the fresh rows, and how far its mirror image is if it may be that [cycles per row].

    None where there is no line.

    Of independent rows, the power of each frequency over the power of the rows has an exponential law, and the sum over
    the stretches a gamma law. The false-alarm probability of the strongest one follows from it.
    """
    length = min(LENGTH, recording.n_samples)
    starts = np.unique(np.linspace(0, recording.n_samples - length, STRETCHES).astype(np.int64))
    if recording.n_samples < STRETCHES * length:
        starts = np.arange(0, recording.n_samples - length + 1, length)
    padded = 4 * length
    power, fresh, all_known, used = np.zeros(padded // 2 + 1), 0, 0, 0
    for start in starts.tolist():
        flags, known = _flags(recording, channels, start, start + length)
        n_known = int(known.sum())
        if n_known < 64 or n_known < 0.25 * length:
            continue
        share = flags.sum() / n_known
        fresh, all_known = fresh + int(flags.sum()), all_known + n_known
        centered = np.where(known, flags - share, 0.0)
        total = float((centered**2).sum())
        if total > 0.0:
            power += np.abs(np.fft.rfft(centered, padded)) ** 2 / total
            used += 1
    if used == 0:
        return None
    expected = fresh / all_known / (1.0 - by_chance)
    if 1.0 - expected < max(0.005, BEYOND * by_chance):
        return None
    low = 0.98 * fresh / all_known - 2.0 / length
    high = min(CAUGHT * expected, 1.0 - max(SLOWEST, CREDIBLE * (1.0 - expected)))
    frequency = np.arange(padded // 2 + 1) / padded
    ratios = np.concatenate([frequency, 1.0 - frequency])
    near = np.flatnonzero((ratios >= low) & (ratios <= high) & (ratios >= 2.0 / length))
    if len(near) == 0:
        return None
    folded = near % len(frequency)
    best = power[folded].max()
    if _gamma_tail(used, float(best)) * max(len(near) / 2.0, 1.0) > ALARM:
        return None
    # a frequency and its mirror image are one line, and harmonics may be as strong: the count of fresh rows decides
    beside = power[np.maximum(folded - 1, 0)], power[np.minimum(folded + 1, len(frequency) - 1)]
    tops = near[(power[folded] > 0.4 * best) & (power[folded] >= np.maximum(*beside))]
    peak = (
        int(tops[np.argmin(np.abs(ratios[tops] - expected))])
        if len(tops)
        else int(near[power[folded].argmax()])
    )
    beat = 1.0 - ratios  # below the rate of the rows: a sensor nearly as fast shows its harmonics there
    for t in sorted(tops.tolist(), key=lambda t: float(beat[t])):
        if any(abs(m * beat[t] - beat[peak]) < 2.0 * m / padded for m in (2, 3, 4)):
            peak = t
            break
    k = peak % len(frequency)
    exact = (k + _vertex(power, k)) / padded
    exact = float(exact if peak < len(frequency) else 1.0 - exact)
    unsure = by_chance * (4.0 * math.sqrt(fresh / max(by_chance, 1e-12)) + 0.05 * fresh) / all_known
    apart = abs(1.0 - 2.0 * exact)
    return exact, apart if apart < unsure else 0.0


def _flags(recording: Recording, channels: Sequence[str], start: int, stop: int) -> tuple[Mask, Mask]:
    fresh = np.zeros(stop - start, dtype=np.bool_)
    known = np.ones(stop - start, dtype=np.bool_)
    known[0] = False
    for name in channels:
        step = np.diff(recording.raw(name, start, stop))
        fresh[1:] |= step != 0.0
        known[1:] &= ~np.isnan(step)
    known &= ~_frozen(fresh | ~known)
    return fresh & known, known


def _vertex(power: Samples, k: int) -> float:
    """Offset of the vertex of the parabola through a peak and its neighbors."""
    if not 0 < k < len(power) - 1:
        return 0.0
    before, here, after = power[k - 1 : k + 2]
    bend = before - 2.0 * here + after
    return float(0.5 * (before - after) / bend) if bend < 0.0 else 0.0


def _gamma_tail(shape: int, x: float) -> float:
    """Chance that the sum of so many standard exponential numbers exceeds x."""
    terms = np.arange(shape) * math.log(max(x, 1e-300)) - np.array(
        [math.lgamma(k + 1.0) for k in range(shape)]
    )
    top = float(terms.max())
    return math.exp(min(top - x + math.log(float(np.exp(terms - top).sum())), 0.0))


# -- the phase --------------------------------------------------------------------------------------------


def _phases(recording: Recording, channels: Sequence[str], line: float) -> tuple[Samples, Samples, int, int]:
    """Rows and unwrapped phases of blocks of `PHASED` rows; number of fresh rows, and of rows that can be told."""
    at, sums, fresh, all_known = [], [], 0, 0
    for start, flags, known in fresh_rows(recording, channels):
        fresh, all_known = fresh + int(flags.sum()), all_known + int(known.sum())
        n = len(flags)
        edges = np.arange(0, n, PHASED)
        row = start + np.arange(n)
        count = np.add.reduceat(known.astype(np.float64), edges)
        share = np.add.reduceat(flags.astype(np.float64), edges) / np.maximum(count, 1.0)
        centered = np.where(known, flags - np.repeat(share, np.diff(np.append(edges, n))), 0.0)
        turn = np.exp(-2j * np.pi * ((line * row) % 1.0))
        total = np.add.reduceat(centered * turn, edges)
        enough = (count >= 0.25 * PHASED) & (np.abs(total) > 0.0)
        at.append((start + edges + 0.5 * np.minimum(PHASED, n - edges) - 0.5)[enough])
        sums.append(total[enough])
    joined = np.concatenate(sums) if sums else np.zeros(0, dtype=np.complex128)
    # fresh rows stand where line * row - phase is whole
    phase = np.unwrap(-np.angle(joined)) / (2.0 * np.pi)
    return np.concatenate(at) if at else np.zeros(0), np.asarray(phase), fresh, all_known


def _scatter(
    recording: Recording, channels: Sequence[str], line: float, at: Samples, phase: Samples
) -> tuple[float, float, float, float, float] | None:
    """Bounds and standard deviation of the fresh rows about the even clock [cycles], first and last of them.

    None where more of them than `ASTRAY` stand on the place of another.
    """
    low, high, square, count, shared = 0.0, 0.0, 0.0, 0, 0
    first: float | None = None
    before = last = 0.0
    for start, flags, _ in fresh_rows(recording, channels):
        rows = start + np.flatnonzero(flags).astype(np.float64)
        if len(rows) == 0:
            continue
        cycles = line * rows - np.interp(rows, at, phase)
        place = np.rint(cycles)
        off = cycles - place
        low, high = min(low, float(off.min())), max(high, float(off.max()))
        square, count = square + sum_of_products(off, off), count + len(rows)
        shared += int(np.count_nonzero(np.diff(place) < 1))
        shared += 0 if first is None else int(place[0] <= before)
        first = float(rows[0]) if first is None else first
        before, last = float(place[-1]), float(rows[-1])
    if first is None or count < 16 or shared > ASTRAY * count:
        return None
    return low, high, math.sqrt(square / count), first, last
