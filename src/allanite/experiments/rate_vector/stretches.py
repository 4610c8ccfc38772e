# SPDX-License-Identifier: BSD-3-Clause
"""Which parts of a record of three gyros are at rest, from the rates alone.

The record is cut into cells of some seconds. In each cell and axis the mean squared difference of adjacent sub-means
is taken, for sub-means of several lengths: sways of a vehicle, steps, vibration and engines raise it at one length or
another, while white noise, quantised angles, flicker and a drift of the bias do not move it from cell to cell. The
floor is the lowest level that is the mean of the cells it calls quiet, so that most of a record may be disturbed. A
cell is disturbed when it exceeds the chi-square quantile over the floor that one clean record in a hundred exceeds
anywhere; the disturbance then grows over its neighbours down to the quantile of one clean cell in a hundred
(hysteresis), and one cell more on both sides.

A rotation slower than a cell leaves no spread. It shows in the mean: see `settled`. Where everything moves alike there
is no floor to tell: see `restless`. A steady sway faster than a cell cannot be told from the dither of the sensor; its
angle comes back, and what it does to the mean is in the scatter of the cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_vector.verdict import LeftOut
from allanite.experiments.static_spans.floor import chi_square, lowest_level
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import normal_quantile
from allanite.recording.records import BLOCK, Recording

__all__ = ["MOVING", "QUIET", "RISE", "SHORT", "WHY", "AxisCells", "cut", "rest", "restless", "settled"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: A cell lasts the record over this, but from 5 to 20 s: several periods of a vehicle on its springs (0.5 to 2 Hz).
CELLS, SHORTEST, LONGEST = 2000, 5.0, 20.0
#: Sub-means in a cell, at most, and in the coarsest partition.
FINEST, COARSEST = 64, 8
#: Clean records with a cell above the threshold; clean cells above that of the hysteresis.
ALARM, GROW = 0.01, 0.01
#: The thresholds are raised by this for the error of the floor.
MARGIN = 1.2
#: Shortest sub-means [s], and fewest pairs of cells, whose energies are compared; and the rise that is motion.
FILTERED, PAIRS, RISE = 0.3, 20, 3.0

#: What a cell is.
QUIET, MOVING, BESIDE, OFF, MISSING, SHORT = range(6)
#: Why a cell is left out.
WHY = {
    MOVING: LeftOut.MOVING,
    BESIDE: LeftOut.BESIDE,
    OFF: LeftOut.OFF,
    MISSING: LeftOut.MISSING,
    SHORT: LeftOut.SHORT,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisCells:
    """A record of several axes, cell by cell.

    Attributes
    ----------
    size : int
        Samples in a cell.
    dt : float [s]
        Length of a cell.
    mean : ndarray, shape (n, axes) [SI]
        NaN without samples.
    part : ndarray, shape (n, axes)
        Samples present, 0 to 1.
    energy : ndarray, shape (scales, n, axes) [SI^2]
        Mean squared difference of adjacent sub-means; NaN where samples are missing.
    details : tuple of int
        Differences in a cell at each scale.
    """

    size: int
    dt: float
    mean: Array
    part: Array
    energy: Array
    details: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.mean)

    @property
    def whole(self) -> Mask:
        """Cells with at least half of their samples in every axis, shape (n,)."""
        return np.asarray((self.part >= 0.5).all(axis=1))


def cut(recording: Recording, channels: Sequence[str], advance: Callable[[float], None]) -> AxisCells:
    """The cells of some channels, read block by block."""
    length = min(max(recording.duration / CELLS, SHORTEST), LONGEST)
    subs = next((s for s in (FINEST, 32) if s <= length * recording.rate), 16)
    size = subs * max(1, round(length * recording.rate / subs))
    parts = []
    for i, name in enumerate(channels):
        parts.append(_axis(recording, name, size, subs))
        advance((i + 1) / len(channels))
    mean, part, energy = (np.stack(column, axis=-1) for column in zip(*parts, strict=True))
    details = tuple(subs // 2**k - 1 for k in range(energy.shape[0]))
    return AxisCells(
        size=size, dt=size / recording.rate, mean=mean, part=part, energy=energy, details=details
    )


def _axis(recording: Recording, name: str, size: int, subs: int) -> tuple[Array, Array, Array]:
    """Means, parts present and energies of one axis; an incomplete cell at the end is left out."""
    scales = int(math.log2(subs // COARSEST)) + 1
    rows = [(np.zeros(0), np.zeros(0), np.zeros((scales, 0)))]
    for _, samples in recording.blocks(name, size * max(BLOCK // size, 1)):
        cells = samples[: len(samples) // size * size].reshape(-1, subs, size // subs)
        if len(cells):
            rows.append(_chunk(cells, scales))
    mean, part, energy = (np.concatenate(column, axis=-1) for column in zip(*rows, strict=True))
    scale = recording[name].scale
    return (mean + recording.origin(name)) * scale, part, energy * scale**2


def _chunk(cells: Array, scales: int) -> tuple[Array, Array, Array]:
    there = ~np.isnan(cells)
    count = there.sum(axis=2)
    total = np.where(there, cells, 0.0).sum(axis=2)
    with np.errstate(invalid="ignore"):
        mean = total.sum(axis=1) / count.sum(axis=1)
        level = np.where(2 * count >= cells.shape[2], total / count, np.nan)
    level = level - mean[:, None]  # large offsets would eat the digits of the differences
    energies = []
    for _ in range(scales):
        squares = np.diff(level, axis=1) ** 2
        present = ~np.isnan(squares)
        enough = 2 * present.sum(axis=1) >= squares.shape[1]
        sums = np.where(present, squares, 0.0).sum(axis=1)
        energies.append(np.where(enough, sums / np.maximum(present.sum(axis=1), 1), np.nan))
        level = level.reshape(len(level), -1, 2).mean(axis=2)
    return mean, count.sum(axis=1) / (cells.shape[1] * cells.shape[2]), np.array(energies)


def rest(cells: AxisCells) -> NDArray[np.int64]:
    """QUIET, MOVING, BESIDE or MISSING for each cell, shape (n,)."""
    over = np.zeros(cells.count, dtype=bool)
    near = np.zeros(cells.count, dtype=bool)
    tests = cells.energy.shape[0] * cells.energy.shape[2] * max(cells.count, 1)
    for energy, details in zip(cells.energy, cells.details, strict=True):
        # differences of adjacent means are correlated: k of them are worth 2k/3 for white noise, k/2 for noise of
        # the angle
        dof = details / 2
        high = MARGIN * chi_square(dof, 1 - ALARM / tests)
        low = MARGIN * chi_square(dof, 1 - GROW)
        for axis in energy.T:
            ratio = axis / lowest_level(axis, dof, high)
            with np.errstate(invalid="ignore"):
                over |= ratio > high
                near |= ratio > low
    moving = _grown(over, near)
    missing = ~cells.whole
    state = np.where(moving, MOVING, np.where(_widened(moving), BESIDE, QUIET))
    return np.asarray(np.where(missing, MISSING, state), dtype=np.int64)


def _gap(mean: Array) -> Array:
    """Usual distance from one mean to the next larger one: counted angles give means in steps, shape (axes,)."""
    gaps = np.diff(np.sort(mean, axis=0), axis=0)
    rounding = 1e-9 * np.abs(mean).max(axis=0)
    return np.array(
        [float(np.median(g[g > r])) if (g > r).any() else 0.0 for g, r in zip(gaps.T, rounding, strict=True)]
    )


def restless(cells: AxisCells, state: NDArray[np.int64]) -> float:
    """How many times the energy of the quiet cells rises above that of all shorter sub-means, at the most.

    The noise of a sensor at rest falls with the time it is averaged over, or stays (flicker), over seconds; only what
    moves rises. Sub-means shorter than 0.3 s may have the smaller energy, for filters of sensors make them alike; the
    largest of them counts, for the dither of a sensor is large there and beats with the longer ones.
    """
    quiet = state == QUIET
    pairs = quiet[1:] & quiet[:-1]
    with np.errstate(invalid="ignore"):
        energy = [np.nanmean(e[quiet], axis=0) for e in cells.energy]
    if pairs.sum() >= PAIRS:
        # the median of chi-square with one degree of freedom is 0.4549
        energy.append(np.median(np.diff(cells.mean, axis=0)[pairs] ** 2, axis=0) / 0.4549)
    lengths = cells.dt / np.array([*(d + 1 for d in cells.details), 1])
    rise = 0.0
    for k in range(1, len(energy)):
        if lengths[k - 1] >= FILTERED:
            shorter = np.max(energy[:k], axis=0)
            rise = max(rise, float(np.max(np.divide(energy[k], shorter, out=np.zeros(3), where=shorter > 0))))
    return rise


def _grown(over: Mask, near: Mask) -> Mask:
    """Runs of `near` that hold an `over`, and `over` itself."""
    either = over | near
    edges = np.flatnonzero(np.diff(np.concatenate(([False], either, [False])).astype(np.int8))).reshape(-1, 2)
    grown = np.zeros(len(over), dtype=bool)
    for a, b in edges:
        grown[a:b] = over[a:b].any()
    return grown


def _widened(mask: Mask) -> Mask:
    """The mask and one cell on both sides."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide


def settled(cells: AxisCells, state: NDArray[np.int64], pose: NDArray[np.int64]) -> NDArray[np.int64]:
    """The states with OFF for quiet cells whose mean is far from that of the others of their pose.

    Far: farther from the median than a normal law lets one of all clean cells come in one record of a hundred, by the
    median of the absolute deviations of the pose. Drifts and flicker widen that and are no reason to leave cells out.
    """
    quiet = state == QUIET
    if not quiet.any():
        return state
    bar = normal_quantile(1 - ALARM / (2 * quiet.sum() * cells.mean.shape[1]))
    off = np.zeros(cells.count, dtype=bool)
    for p in np.unique(pose[quiet]):
        member = quiet & (pose == p)
        deviation = np.abs(cells.mean - np.median(cells.mean[member], axis=0))
        usual = np.maximum(np.median(deviation[member], axis=0) / 0.6745, _gap(cells.mean[member]))
        # few cells give a poor median: Student's law would have the longer tail
        wide = bar * (1 + 5 / member.sum())
        off |= member & ((deviation > wide * usual) & (usual > 0)).any(axis=1)
    state = np.where(off, OFF, state)
    return np.asarray(np.where(_widened(off) & (state == QUIET), BESIDE, state), dtype=np.int64)
