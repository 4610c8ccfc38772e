# SPDX-License-Identifier: BSD-3-Clause
"""The Allan family as sums of squares over the phase of one channel.

With the phase x (running sum of the samples, in units of sample times rate), n samples and lag m:

========  =============================================  ===============  =======================
name      term                                           window           variance
========  =============================================  ===============  =======================
adev      x[i] - 2x[i+m] + x[i+2m], i = 0, m, 2m, ...     2m samples       sum/(2 m^2 M)
oadev     the same, every i                              2m               sum/(2 m^2 M)
hdev      x[i+3m] - 3x[i+2m] + 3x[i+m] - x[i], i = 0, m.. 3m               sum/(6 m^2 M)
ohdev     the same, every i                              3m               sum/(6 m^2 M)
mdev      mean of m adjacent second differences          3m - 1           sum/(2 m^2 M)
tdev      tau/sqrt(3) times mdev                         3m - 1
totdev    second difference of the reflected phase       the record       sum/(2 m^2 (n - 1))
haar      half of oadev's: the Haar wavelet variance     2m               sum/(4 m^2 M)
========  =============================================  ===============  =======================

haar is the unbiased estimate by the maximal overlap (MODWT) wavelet transform [2]; m need not be a power of two. Two
kinds are more than one sum: `robust` (an M-estimate in place of the mean) and `theo` (all inner differences).

A term counts only if its whole window is present; M counts the terms.

References
----------
.. [1] W. Riley, "Handbook of Frequency Stability Analysis", NIST SP 1065 (2008), eqs 10-25.
.. [2] D. Percival, "On estimation of the wavelet variance", Biometrika 82 (1995).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.errors import DataQualityError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.covariance import complete_starts, touching_starts
from allanite.plain_files.counted import plural
from allanite.quantities.sums import sum_of_products
from allanite.recording.block_series import BlockSeries
from allanite.recording.records import BLOCK, OVERLOAD, Recording, merge_spans
from allanite.recording.sample_columns import ArrayColumn, let_go

__all__ = [
    "STATISTICS",
    "Phase",
    "Statistic",
    "block_sums",
    "complete_runs",
    "first_level",
    "in_threads",
    "inside",
    "longest_lag",
    "merge_touching",
    "phase_of",
    "processors",
    "rounding_variance",
    "sums_of_squares",
    "total_length",
]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]
Progress = Callable[[float], None]

_BLOCK = (
    1 << 15
)  # starts summed as one partial sum: fixed, so that any number of threads gives the same digits
_TASK, _MAPPED_TASK = 64, 8  # blocks per task; of a phase in a file, whose pages are given back after each
_RUNS = 150_000  # runs of complete windows held at once (2 MiB): scattered gaps make many
_ROUNDED = 8.0  # roundings in a second difference of the phase, at most


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistic:
    """One member of the family.

    Attributes
    ----------
    order : int
        Order of the phase difference: 2 (Allan) or 3 (Hadamard).
    overlapping, modified, total, time : bool
    halved : bool
        Half of the Allan variance: the Haar wavelet variance.
    robust : bool
        An M-estimate of the Allan variance (`robust`).
    theo : bool
        Sums over all inner differences of a window (`theo`); lag m is the window, the averaging time 0.75 m.
    unbiased : bool
        Theo1 times the record's own ratio of the Allan variance to it.
    hybrid : bool
        The Allan deviation up to a fifth of the record, Theo1 without bias beyond.
    """

    name: str
    order: int
    overlapping: bool = True
    modified: bool = False
    total: bool = False
    time: bool = False
    halved: bool = False
    robust: bool = False
    theo: bool = False
    unbiased: bool = False
    hybrid: bool = False

    def window(self, m: int) -> int:
        """Samples that one term covers."""
        if self.theo:
            return m
        return 3 * m - 1 if self.modified else self.order * m

    @property
    def norm(self) -> int:
        """Variance = sum/(norm m^2 M)."""
        if self.halved:
            return 4
        return 2 if self.order == 2 else 6

    @property
    def by_points(self) -> bool:
        """Does a term touch a few phase points only, so that a missing angle spoils no others?"""
        return not (self.modified or self.theo)

    @property
    def has_exact_degrees(self) -> bool:
        """Do its degrees of freedom follow from a model, not from a published formula?"""
        return self.overlapping and self.order == 2 and not (self.modified or self.total)

    def at(self, m: int, n_samples: int) -> Statistic:
        """What the statistic is at this lag: itself, but for the hybrid one."""
        return STATISTICS["oadev"] if self.hybrid and m <= n_samples // 5 else self

    def averaging(self, lags: NDArray[np.int64], n_samples: int) -> Array:
        """Averaging time of each lag in samples."""
        part = [0.75 if self.at(int(m), n_samples).theo else 1.0 for m in lags]
        return np.asarray(lags * np.array(part))


STATISTICS = {
    s.name: s
    for s in (
        Statistic(name="adev", order=2, overlapping=False),
        Statistic(name="oadev", order=2),
        Statistic(name="hdev", order=3, overlapping=False),
        Statistic(name="ohdev", order=3),
        Statistic(name="mdev", order=2, modified=True),
        Statistic(name="tdev", order=2, modified=True, time=True),
        Statistic(name="totdev", order=2, total=True),
        Statistic(name="haar", order=2, halved=True),
        Statistic(name="robust", order=2, robust=True),
        Statistic(name="theo1", order=2, theo=True),
        Statistic(name="theobr", order=2, theo=True, unbiased=True),
        Statistic(name="theoh", order=2, theo=True, unbiased=True, hybrid=True),
    )
}


def longest_lag(statistic: Statistic, n_samples: int) -> int:
    """The longest lag with one term [samples]; a total deviation ends at half the record too."""
    return (n_samples + 1) // 3 if statistic.modified else n_samples // statistic.order


def complete_runs(statistic: Statistic, m: int, missing: Spans, n_samples: int, pointwise: bool) -> Spans:
    """Runs of positions at which a term of the statistic is complete.

    Parameters
    ----------
    missing : ndarray of int64, shape (n_runs, 2)
        Runs of missing samples; of missing phase points when `pointwise`.
    """
    part = statistic.at(m, n_samples)
    if pointwise and part.by_points:
        return touching_starts(missing, n_samples + 1, m, part.order)
    if pointwise:
        missing = merge_spans(np.clip(missing + [-1, 0], 0, n_samples))
    return complete_starts(missing, n_samples, part.window(m))


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """Running sum of one channel, less a constant rate.

    Attributes
    ----------
    x : ndarray, shape (n_samples + 1,)
        In the channel's own unit times samples; finite everywhere.
    missing : ndarray of int64, shape (n_runs, 2)
        Runs of missing samples; of missing phase points when `pointwise`.
    pointwise : bool
        The samples were angles: a missing one spoils only the terms that touch it.
    """

    x: Array
    missing: Spans
    pointwise: bool = False

    @property
    def n_samples(self) -> int:
        return len(self.x) - 1

    def starts(self, statistic: Statistic, m: int) -> Spans:
        """Runs of positions at which a term of the statistic is complete."""
        return complete_runs(statistic, m, self.missing, self.n_samples, self.pointwise)


def phase_of(
    recording: Recording, name: str, progress: Progress | None = None, *, factor: float = 1.0
) -> Phase:
    """The phase of one channel, streamed block by block: the only full-length series that is made.

    The first block's mean is removed before summing: 2.5 V with 1 uV of noise would otherwise be 1 % wrong
    after 1e9 samples.

    Parameters
    ----------
    factor : float
        Of the running sum: the scale of the channel, for one in SI.

    Raises
    ------
    DataQualityError
        Fewer than three samples, or none present.
    """
    n = recording.n_samples
    if n < 3:
        raise DataQualityError(
            f"channel {name!r} has {plural(n, 'sample')}; an Allan variance needs at least 3"
        )
    if recording[name].kind.integrated:
        return _recorded_phase(recording, name, factor)
    x, part = BlockSeries(n + 1), np.zeros(min(n, BLOCK))
    x.put(0, part[:1])
    runs, offset, level = [], first_level(recording, name), 0.0
    for start, block in recording.blocks(name):
        block = np.ascontiguousarray(block)
        runs.append(_kernels.missing_runs(block, start))
        level = _kernels.integrate(block, offset, level, part[: len(block)])
        summed = part[: len(block)]
        x.put(1 + start, summed if factor == 1.0 else summed * factor)
        if progress is not None:
            progress((start + len(block)) / n)
    missing = merge_touching(np.concatenate(runs))
    if len(missing) and int((missing[:, 1] - missing[:, 0]).sum()) == n:
        raise DataQualityError(f"channel {name!r}: all {n} samples are missing")
    return Phase(x=x.finish(), missing=missing)


def rounding_variance(x: Array, m: NDArray[np.int64]) -> Array:
    """Allan variance at lags m that rounding of a phase x alone makes of samples that are all the same, shape of m."""
    column = ArrayColumn(x)  # its pages are not kept in memory
    largest = max(float(np.abs(column.read(k, k + BLOCK)).max()) for k in range(0, len(x), BLOCK))
    error = _ROUNDED * np.finfo(np.float64).eps * largest
    return np.asarray((error / m) ** 2)


def first_level(recording: Recording, name: str) -> float:
    """Mean of the first block that holds a sample; 0 where none does."""
    for _, block in recording.blocks(name):
        present = block[np.abs(block) < OVERLOAD]
        if len(present):
            return float(present.mean())
    return 0.0


def _recorded_phase(recording: Recording, name: str, factor: float) -> Phase:
    """Angles as phase: theta/Ts, with the missing points bridged by a line (they enter no term)."""
    theta = recording.values(name) * recording.rate
    bad = ~np.isfinite(theta)
    if bad.all():
        raise DataQualityError(f"channel {name!r}: all {len(theta)} samples are missing")
    position = np.arange(len(theta))
    missing = np.zeros((0, 2), dtype=np.int64)
    if bad.any():
        missing = _kernels.missing_runs(np.ascontiguousarray(theta), 0)
        theta = np.interp(position, position[~bad], theta[~bad])
    slope = (theta[-1] - theta[0]) / (len(theta) - 1)
    return Phase(x=(theta - theta[0] - slope * position) * factor, missing=missing, pointwise=True)


def merge_touching(runs: Spans) -> Spans:
    """Runs that a block border has cut in two, joined."""
    if len(runs) < 2:
        return runs
    new = np.concatenate(([True], runs[1:, 0] > runs[:-1, 1]))
    last = np.concatenate((np.flatnonzero(new)[1:] - 1, [len(runs) - 1]))
    return np.ascontiguousarray(np.stack([runs[new, 0], runs[last, 1]], axis=1))


def sums_of_squares(
    phase: Phase,
    statistic: Statistic,
    lags: NDArray[np.int64],
    threads: int | None = None,
    progress: Progress | None = None,
) -> tuple[Array, NDArray[np.int64]]:
    """Variance of the statistic at each lag, in the channel's own unit squared, and the number of terms.

    Parameters
    ----------
    lags : ndarray of int64, shape (n_lags,)
    threads : int, optional
        Default: the processors this process may use. The digits do not depend on it.

    Returns
    -------
    variance : ndarray, shape (n_lags,)
        NaN where no term is complete.
    count : ndarray of int64, shape (n_lags,)
    """
    workers = processors(threads)
    if statistic.total:
        sums, count = _total(phase, lags, workers)
    elif statistic.modified:
        sums, count = _modified(phase, statistic, lags, workers)
    elif not statistic.overlapping:
        sums, count = _strided(phase, statistic, lags)
    else:
        sums, count = _overlapping(phase, statistic, lags, workers, progress)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = sums / (statistic.norm * lags.astype(np.float64) ** 2 * count)
    return np.where(count > 0, variance, np.nan), count


def processors(threads: int | None) -> int:
    """Threads to work with: as many as were asked for, or the processors this process may use.

    Raises
    ------
    InputError
        Fewer than one.
    """
    if threads is not None:
        if threads < 1:
            raise InputError(f"threads must be at least 1, not {threads!r}")
        return threads
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


def _overlapping(
    phase: Phase, statistic: Statistic, lags: NDArray[np.int64], workers: int, progress: Progress | None
) -> tuple[Array, NDArray[np.int64]]:
    sums, count = np.empty(len(lags)), np.empty(len(lags), dtype=np.int64)
    for first, runs in _groups(phase, statistic, lags):
        part = slice(first, first + len(runs))
        share = None if progress is None else _within(progress, first / len(lags), len(runs) / len(lags))
        sums[part] = _sums(phase, statistic, lags[part], runs, workers, share)
        count[part] = [total_length(r) for r in runs]
    return sums, count


def _groups(phase: Phase, statistic: Statistic, lags: NDArray[np.int64]) -> Iterator[tuple[int, list[Spans]]]:
    """Lags to be summed together: as many as possible share the phase in cache, but their runs must stay small."""
    group: list[Spans] = []
    for i, m in enumerate(lags):
        group.append(phase.starts(statistic, int(m)))
        if sum(len(r) for r in group) > _RUNS or i == len(lags) - 1:
            yield i + 1 - len(group), group
            group = []


def _within(progress: Progress, start: float, share: float) -> Progress:
    return lambda fraction: progress(start + share * fraction)


def _sums(
    phase: Phase,
    statistic: Statistic,
    lags: NDArray[np.int64],
    runs: list[Spans],
    workers: int,
    progress: Progress | None,
) -> Array:
    return block_sums(phase.x, statistic.order, lags, runs, workers, progress)


def block_sums(
    x: Array,
    order: int,
    lags: NDArray[np.int64],
    runs: Sequence[Spans],
    workers: int,
    progress: Progress | None = None,
) -> Array:
    """Sums of squared differences of a phase at each lag over its runs, in memory of some blocks, shape (n_lags,).

    Parameters
    ----------
    x : ndarray, shape (n_samples + 1,)
    order : int
        2 (Allan) or 3 (Hadamard).
    lags : ndarray of int64, shape (n_lags,)
    runs : sequence of ndarray of int64, shape (n_runs, 2)
        Complete starts of each lag.
    """
    offsets = np.concatenate(([0], np.cumsum([len(r) for r in runs]))).astype(np.int64)
    flat = np.ascontiguousarray(np.concatenate(runs))
    blocks = -(-(len(x) - 1) // _BLOCK)
    partial = np.empty((blocks, len(lags)))
    size = _MAPPED_TASK if isinstance(x, np.memmap) else _TASK
    done = 0

    def task(first: int) -> None:
        nonlocal done
        last = min(first + size, blocks)
        partial[first:last] = _kernels.difference_squares(x, order, lags, flat, offsets, first, last, _BLOCK)
        let_go(x, len(x))
        done += last - first
        if progress is not None:
            progress(done / blocks)

    in_threads(task, range(0, blocks, size), workers)
    return np.asarray(partial.sum(axis=0))


def _modified(
    phase: Phase, statistic: Statistic, lags: NDArray[np.int64], workers: int
) -> tuple[Array, NDArray[np.int64]]:
    runs = [phase.starts(statistic, int(m)) for m in lags]
    sums = np.empty(len(lags))

    def task(i: int) -> None:
        sums[i] = _kernels.modified_squares(phase.x, int(lags[i]), runs[i])

    in_threads(task, range(len(lags)), workers)
    return sums, np.array([total_length(r) for r in runs], dtype=np.int64)


def _total(phase: Phase, lags: NDArray[np.int64], workers: int) -> tuple[Array, NDArray[np.int64]]:
    if len(phase.missing):
        raise InputError(
            "the total deviation reflects the whole record and cannot leave out missing samples; use oadev"
        )
    sums = np.empty(len(lags))

    def task(i: int) -> None:
        sums[i] = _kernels.total_squares(phase.x, int(lags[i]))

    in_threads(task, range(len(lags)), workers)
    return sums, np.full(len(lags), phase.n_samples - 1, dtype=np.int64)


def _strided(phase: Phase, statistic: Statistic, lags: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Adjacent, not overlapping: every m-th start. Cheap, so plain NumPy."""
    sums, count = np.empty(len(lags)), np.empty(len(lags), dtype=np.int64)
    for i, m in enumerate(lags):
        difference = np.diff(phase.x[:: int(m)], n=statistic.order)
        if len(phase.missing):
            starts = np.arange(len(difference)) * int(m)
            difference = difference[inside(starts, phase.starts(statistic, int(m)))]
        sums[i], count[i] = sum_of_products(difference, difference), len(difference)
    return sums, count


def inside(positions: NDArray[np.int64], runs: Spans) -> NDArray[np.bool_]:
    """Which positions lie in one of the runs, which are sorted."""
    if len(runs) == 0:
        return np.zeros(len(positions), dtype=bool)
    run = np.searchsorted(runs[:, 0], positions, side="right") - 1
    return np.asarray((run >= 0) & (positions < runs[np.maximum(run, 0), 1]))


def total_length(runs: Spans) -> int:
    """Positions in all runs."""
    return int((runs[:, 1] - runs[:, 0]).sum())


def in_threads(task: Callable[[int], None], items: Sequence[int], workers: int) -> None:
    """Do the task for each item, in several threads at once."""
    if workers == 1 or len(items) < 2:
        for item in items:
            task(item)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(workers) as pool:
        for future in [pool.submit(task, item) for item in items]:
            future.result()
