# SPDX-License-Identifier: BSD-3-Clause
"""Which cells of a record are at rest: windows from short to long, each tested where all shorter ones found nothing.

Three kinds of energy are compared with what the noise gives, in every axis:

* the mean squared difference of neighbouring samples, over windows of 1, 4 and 16 cells: vibration, tremor, turns;
* the squared difference of two neighbouring means over m cells each, m = 1, 2, 4, ...: turns, tilts, steps;
* the mean of eight of these in a row: sways.

A window is disturbed when its energy exceeds the quantile that one clean record in a hundred exceeds anywhere (all
windows, axes and lengths counted as if they were independent, which they are not: fewer than one). Windows that hold
a cell already found moving are not tested: long windows would spread a strong motion over the rest beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.static_spans.cells import ChannelCells, runs
from allanite.experiments.static_spans.floor import chi_square, lowest_level, ratio_quantile
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.recording.records import Sampling

__all__ = ["ALARM", "RestScan", "scan"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Clean records in which anything is found moving, at the most.
ALARM = 0.01
#: Cells in a window of sample differences.
FINE = (1, 4, 16)
#: Longest mean whose difference to the next is tested [s]. Slower than that a drift of the bias and a rotation look
#: alike.
LONGEST = 8.0
#: Degrees of freedom of a squared difference of neighbours in white noise by the variance of their mean. Its far tail
#: is that of fewer: the largest eigenvalue of their covariance is twice the usual one, which makes it a half.
WORTH, TAIL = 2.0 / 3.0, 0.75
#: Differences of means in a row, for sways; and what they are worth (half of them in the tail, as above).
ROW, ROW_DOF = 8, 4.0
#: Sub-means shorter than this [s] may vary less than longer ones, for sensors filter. Beyond it the noise of a sensor
#: at rest falls or stays over seconds, and a floor that rises by more is motion.
FILTERED, RISE = 0.3, 3.0
#: The thresholds under a model are raised by this for the error of the model.
MARGIN = 1.2
#: No sensor resolves less than this part of its range (24 bits): what moves less is rounding of simulated samples.
RANGE = 2.0**-23
#: A difference of two means that stands out takes those beside it along down to this part of the threshold (3.4
#: standard deviations in a record of minutes): a slow motion is found whole.
NEAR = 0.35
#: Lengths of means [s] between which the noise of a sensor at rest falls.
FALL = (0.05, 0.8)
#: Share of the windows that are quiet so far, taken for rest to begin with: many are slow motion still.
SHARE = 0.12
#: Cells that are looked at together.
_PART = 1 << 17
#: Windows that a floor of its own needs; with fewer, that of the next shorter means is taken.
LEAST = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class RestScan:
    """What the windows show.

    Attributes
    ----------
    quiet : ndarray of bool, shape (n,)
    ratio : ndarray, shape (n,)
        Largest root of energy over threshold, of all windows around each cell; NaN where samples are missing.
    floor : ndarray, shape (axes,)
        Variance of the difference of neighbouring samples at rest.
    white : ndarray, shape (axes,)
        White noise by the means over about a third of a second [SI / sqrt(Hz)].
    tolerance : ndarray, shape (axes,)
        Differences up to this mean nothing.
    counted : ndarray of bool, shape (axes,)
        The noise is below one count.
    fall : ndarray, shape (axes,)
        Variance of differences of means over 0.8 s, over that of 0.05 s: white noise falls to a sixteenth. Where cells
        are longer than 0.05 s, by the power of the length that they show. NaN where the record is too short, its cells
        are too long, or a model gave the floor.
    over_model : ndarray, shape (axes,)
        Noise from sample to sample in the quietest parts, over that of the model; NaN without one.
    """

    quiet: Mask
    ratio: Array
    floor: Array
    white: Array
    tolerance: Array
    counted: Mask
    fall: Array
    over_model: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class _Window:
    """One kind of window: sample differences (m = 0) over `cells`, or `row` differences of means over m cells."""

    m: int
    row: int
    cells: int


def scan(cells: ChannelCells, models: Sequence[NoiseModel | None], sampling: Sequence[Sampling]) -> RestScan:
    """Find the cells at rest.

    Parameters
    ----------
    cells : ChannelCells
    models : sequence of NoiseModel or None
        One for each axis, in the unit of the cells; without one the floor comes from the record.
    sampling : sequence of "mean" or "point"
        Of each axis.
    """
    return _Scanner(cells, models, sampling).run()


class _Scanner:
    """One scan: the cells that are still quiet, and the floors found so far."""

    def __init__(
        self, cells: ChannelCells, models: Sequence[NoiseModel | None], sampling: Sequence[Sampling]
    ) -> None:
        self.cells, self.models, self.sampling = cells, models, sampling
        self.given = np.array([model is not None for model in models])
        self.axes = cells.total.shape[1]
        self.quiet = cells.whole.copy()
        self.ratio = np.where(self.quiet, 0.0, np.nan)
        self.sums, self.counts = (_running_where(self.quiet, values) for values in (cells.total, cells.count))
        self.windows = list(_windows(cells))
        self.tail = ALARM / max(len(self.windows) * self.axes * cells.n, 1)
        self.floors: dict[int, tuple[Array, Array]] = {}
        self.tolerance = self._tolerances() if self.quiet.any() else np.zeros(self.axes)

    def run(self) -> RestScan:
        for window in self.windows:
            self._test(window)
        return RestScan(
            quiet=self.quiet,
            ratio=self.ratio,
            floor=self._fine(),
            white=self._white(),
            tolerance=self.tolerance,
            counted=self.tolerance > RANGE * self.cells.largest,
            fall=self._fall(),
            over_model=self._over_model(),
        )

    # -- one kind of window -----------------------------------------------------------------------------------

    def _test(self, window: _Window) -> None:
        open_ = self._open(window.cells)
        if not open_.any():
            return
        energy = self._energy(window)
        level, level_dof = self._floor(window, energy, open_)
        dof = self._dof(window, energy, open_)
        bar = np.array([ratio_quantile(d, n, self.tail) for d, n in zip(dof, level_dof, strict=True)])
        # rounding to counts may show noise in three of them
        least = np.maximum(bar * level, ((1 if window.m else 2) * self.tolerance) ** 2)
        worst = np.zeros(len(energy))
        for part in _parts(len(energy)):
            with np.errstate(invalid="ignore", divide="ignore"):
                over = np.nan_to_num(energy[part] / least).max(axis=1)
            worst[part] = np.where(open_[part], over, 0.0)
        self._mark(window, worst, open_)

    def _open(self, length: int, quiet: Mask | None = None) -> Mask:
        """Whether the window of this length that begins at each cell is quiet so far."""
        n = max(self.cells.n - length + 1, 0)
        broken = _running(~(self.quiet if quiet is None else quiet))
        return np.asarray(broken[length : length + n] == broken[:n])

    def _energy(self, window: _Window) -> Array:
        """Energy of the window that begins at each cell, shape (n, axes)."""
        n = max(self.cells.n - window.cells + 1, 0)
        energy = np.empty((n, self.axes))
        if window.m == 0:
            for i in range(self.axes):  # a missing difference counts as none: no alarm comes from few
                square = _running(self.cells.square[:, i])
                energy[:, i] = (square[window.cells :] - square[:n]) / (window.cells * self.cells.size)
            return energy
        for part in _parts(n):
            energy[part] = self._apart(window, part)
        return energy

    def _apart(self, window: _Window, part: slice) -> Array:
        """Energy of differences of means in the windows that begin at some cells in a row."""
        m, n, last = window.m, part.stop - part.start, part.stop + window.row * window.m
        early, late = slice(part.start, last), slice(part.start + m, last + m)
        with np.errstate(invalid="ignore", divide="ignore"):
            count = self.counts[late] - self.counts[early]
            mean = (self.sums[late] - self.sums[early]) / count
            share = 2.0 / (1.0 / count[m:] + 1.0 / count[:-m]) / (m * self.cells.size)
        square = (
            share * (mean[m:] - mean[:-m]) ** 2
        )  # as if it were of whole means, whose white noise is less
        return np.asarray(sum(square[j * m : j * m + n] for j in range(window.row)) / window.row)

    def _mark(self, window: _Window, worst: Array, open_: Mask) -> None:
        """Cells of windows that stand out are moving: of a difference of two means the half around its middle."""
        single = window.m > 0 and window.row == 1
        near = [(a, b) for a, b in runs(worst > (NEAR if single else 1.0)) if (worst[a:b] > 1.0).any()]
        starts = np.concatenate([np.arange(a, b) for a, b in near] or [np.zeros(0, dtype=np.int64)])
        cut = window.m // 2 if single else 0
        first, stop = starts + cut, starts + window.cells - cut
        # a window at the edge of what is quiet: what moves there may reach up to the edge
        before = ~np.concatenate(([False], open_))[starts]
        after = ~np.concatenate((open_, [False]))[starts + 1]
        first, stop = np.where(before, starts, first), np.where(after, starts + window.cells, stop)
        change = np.zeros(self.cells.n + 1)
        np.add.at(change, first, 1)
        np.add.at(change, stop, -1)
        self.quiet &= ~(np.cumsum(change[:-1]) > 0)
        middle = np.arange(len(worst)) + window.cells // 2
        self.ratio[middle] = np.maximum(self.ratio[middle], np.sqrt(worst))

    # -- what the noise gives -----------------------------------------------------------------------------------

    def _dof(self, window: _Window, energy: Array, open_: Mask) -> Array:
        """Degrees of freedom of a window's energy in each axis."""
        if window.m:
            return np.full(self.axes, 1.0 if window.row == 1 else ROW_DOF)
        nominal = WORTH * window.cells * self.cells.size
        near = 2 * chi_square(nominal, 1 - 1e-4) * self.floors[0][0]
        below = (e[open_ & (e < most)] for e, most in zip(energy.T, near, strict=True))
        return np.array([max(TAIL * _scatter_dof(e, nominal, window.cells), 1.0) for e in below])

    def _floor(self, window: _Window, energy: Array, open_: Mask) -> tuple[Array, Array]:
        """Energy at rest, and the degrees of freedom by which it is known, each of shape (axes,)."""
        if window.m not in self.floors:
            if self.given.all():
                level = dof = np.zeros(self.axes)
            elif window.m == 0:
                level, dof = self._fine_floor()
            else:
                level, dof = self._mean_floor(window, energy, open_)
            modelled = np.where(self.given, self._modelled(window.m), level)
            self.floors[window.m] = modelled, np.where(self.given, np.inf, dof)
        return self.floors[window.m]

    def _modelled(self, m: int) -> Array:
        """By the models; NaN in an axis without one."""
        samples, dt = max(m * self.cells.size, 1), self.cells.dt
        pairs = zip(self.models, self.sampling, strict=True)
        variance = [np.nan if one is None else float(one.avar_sampled(samples, dt, s)) for one, s in pairs]
        return 2 * MARGIN * np.array(variance)

    def _fine_floor(self, quiet: Mask | None = None) -> tuple[Array, Array]:
        """From windows of eight cells all over the record."""
        width = min(8, self.cells.n)
        open_ = self._open(width, quiet)
        energy = self._energy(_Window(m=0, row=1, cells=width))
        nominal = WORTH * width * self.cells.size
        level, known = np.zeros(self.axes), np.ones(self.axes)
        for i in range(self.axes):
            axis = energy[open_, i]
            dof = _scatter_dof(axis, nominal, width)
            high = chi_square(dof, 1 - 1e-4)
            lowest = lowest_level(axis, dof, high)
            level[i] = lowest if math.isfinite(lowest) else 0.0
            known[i] = max(np.count_nonzero(axis < high * level[i]) / width * dof, 1.0)
        return level, known

    def _mean_floor(self, window: _Window, energy: Array, open_: Mask) -> tuple[Array, Array]:
        """From the windows that are quiet so far; not far above that of shorter means, for a sensor at rest is not."""
        count = np.count_nonzero(open_) / window.cells
        shorter = [m for m in self.floors if m]
        if count < LEAST and shorter:
            return self.floors[max(shorter)]
        high = chi_square(1.0, 1 - 0.1 / max(count, 10.0))
        level = np.array([lowest_level(axis[open_], 1.0, high, start=SHARE) for axis in energy.T])
        level = np.where(np.isfinite(level), level, 0.0)
        # noise of a counted angle falls fastest, with the square of the length: means of few counts are often equal
        least = (
            self.floors[max(shorter)][0] / 4 if shorter else self.floors[0][0] / (2 * self.cells.size) ** 2
        )
        level = np.maximum(level, least)
        finer = [self.floors[m][0] for m in shorter]
        if finer and window.m * self.cells.length > FILTERED:
            level = np.minimum(level, RISE * np.max(finer, axis=0))
        return level, np.full(self.axes, max(count, 1.0))

    def _tolerances(self) -> Array:
        """Differences that mean nothing: one count where the noise is below it, or the rounding of the samples."""
        steps, equal = self.cells.steps[self.quiet], self.cells.equal[self.quiet]
        calm = self._calm()
        steps, equal = steps[calm], equal[calm]
        with np.errstate(invalid="ignore"):
            share = equal.sum(axis=0) / steps.sum(axis=0)
        counted = np.where(share > 0.5, self.cells.step, 0.0)
        counted = np.where(np.isfinite(counted), counted, 0.0)
        return np.asarray(np.maximum(counted, RANGE * self.cells.largest))

    def _calm(self) -> Mask:
        """The tenth of the whole cells that moves least, by its highest rank among the axes."""
        rank = np.zeros(np.count_nonzero(self.quiet), dtype=np.intp)
        for i in range(self.axes):
            order = np.argsort(self.cells.square[self.quiet, i])
            rank[order] = np.maximum(rank[order], np.arange(len(order)))
        return np.asarray(rank <= np.quantile(rank, 0.1))

    def _fine(self) -> Array:
        return self.floors[0][0] if 0 in self.floors else np.full(self.axes, np.nan)

    def _fall(self) -> Array:
        short, long = (max(round(t / self.cells.length), 1) for t in FALL)
        long = 1 << max(long.bit_length() - 1, 0)
        if not {short, long} <= set(self.floors) or short == long:
            return np.full(self.axes, np.nan)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = self.floors[long][0] / self.floors[short][0]
            # cells of slow or very long records leave less than the sixteenfold: by the same power of the length
            return np.where(
                self.given, np.nan, ratio ** (math.log(FALL[1] / FALL[0]) / math.log(long / short))
            )

    def _over_model(self) -> Array:
        if not (self.given.any() and self.cells.whole.any()):
            return np.full(self.axes, np.nan)
        return np.asarray(np.sqrt(self._fine_floor(self.cells.whole)[0] * MARGIN / self._modelled(0)))

    def _white(self) -> Array:
        near = [m for m in self.floors if m and m * self.cells.length <= FILTERED]
        if not near:
            return np.full(self.axes, np.nan)
        m = max(near)
        return np.asarray(np.sqrt(self.floors[m][0] / 2 * m * self.cells.length))


def _windows(cells: ChannelCells) -> Iterator[_Window]:
    """All kinds of windows, the shortest first."""
    windows = [_Window(m=0, row=1, cells=w) for w in FINE]
    m = 1
    while m == 1 or m * cells.length <= LONGEST:
        windows += [_Window(m=m, row=1, cells=2 * m), _Window(m=m, row=ROW, cells=(ROW + 1) * m)]
        m *= 2
    return iter(sorted((w for w in windows if w.cells <= cells.n), key=lambda w: (w.cells, w.m)))


def _parts(n: int) -> Iterator[slice]:
    """Rows 0 to n in parts whose arrays stay small beside those of all cells."""
    for start in range(0, n, _PART):
        yield slice(start, min(start + _PART, n))


def _running(values: Array | Mask) -> Array:
    """Sums of all rows before each, shape (n + 1, ...)."""
    out = np.zeros((len(values) + 1, *values.shape[1:]))
    np.cumsum(values, axis=0, out=out[1:])
    return out


def _running_where(there: Mask, values: NDArray[Any]) -> Array:
    """Sums of the rows before each that are there."""
    out = np.zeros((len(values) + 1, *values.shape[1:]))
    for part in _parts(len(values)):
        rows = np.where(there[part, None], values[part], 0.0)
        rows[0] += out[part.start]
        np.cumsum(rows, axis=0, out=out[part.start + 1 : part.stop + 1])
    return out


def _scatter_dof(energy: Array, nominal: float, apart: int) -> float:
    """Degrees of freedom of energies by the ratio of neighbours that share no sample.

    The logarithm of chi-square over nu has variance psi'(nu/2), about 1/(nu/2 - 1/2). Filters of sensors make
    differences of neighbouring samples alike, which leaves fewer degrees than differences.
    """
    known = energy[~np.isnan(energy)][:: max(apart, 1)]
    known = np.log(known[known > 0])
    if len(known) < 16:
        return nominal
    scatter = 0.5 * (float(np.median(np.abs(np.diff(known)))) / 0.6745) ** 2
    return min(nominal, 1.0 + 2.0 / scatter) if scatter > 0 else nominal
