# SPDX-License-Identifier: BSD-3-Clause
"""A record on a rate table as means over equal blocks: samples and the table's columns, averaged alike.

The columns are made sample by sample, for the mean of a square is not the square of a mean, and averaged over the very
samples of the block that are used: the regression stays exact where a block holds part of a transition.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.rate_table.motion import RateSteps, RateTable, Sampled, Sinusoids, TableClock
from allanite.filtering.block_means import longest_block
from allanite.filtering.regression import RANK, Regression, regress
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.recording.records import BLOCK, Recording, Sampling

__all__ = [
    "DIRECTION",
    "LAG",
    "LATE",
    "LOOP",
    "RATE",
    "TEMPERATURE",
    "WARM_RATE",
    "RegressionRows",
    "SampleSelection",
    "power",
]

Array = NDArray[np.float64]

RATE = "rate"
#: Derivative of the rate: what a clock that is late adds; and times time, for one that runs slow.
LAG, LATE = "lag", "lag that grows"
DIRECTION = "direction"
#: A loop that is widest at rest and closed at full scale.
LOOP = "loop"
TEMPERATURE, WARM_RATE = "temperature", "temperature x rate"
CONSTANCY = "rate x time"
ABSOLUTE = "absolute rate"

#: Highest power of the rate that is averaged: two above the highest that is fitted look for what is missing.
POWERS = 7
#: Most blocks: beyond them the blocks grow.
MOST_BLOCKS = 300_000
#: Of a sample, by which it may seem to go beyond the end of a step.
ROUNDING = 1e-6
#: Blocks in a period of the fastest sinusoid.
PER_PERIOD = 24


def power(k: int) -> str:
    """Name of the column of a power of the rate."""
    return RATE if k == 1 else f"rate^{k}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleSelection:
    """Which samples are used: those whose rate is known and settled.

    Attributes
    ----------
    clock : TableClock
    dead_time : float [s]
        Left out at the beginning of each stretch of the table.
    guard : float [s]
        Left out at its end.
    chosen : ndarray of bool, shape (n_spans,), or None
        Stretches that take part.
    below, above : float [rad/s]
        Rates beyond these are left out: the sensor clips there.
    """

    clock: TableClock = field(default_factory=TableClock)
    dead_time: float = 0.0
    guard: float = 0.0
    chosen: NDArray[np.bool_] | None = None
    below: float = -math.inf
    above: float = math.inf

    def spans(self, table: RateTable) -> tuple[Array, NDArray[np.int64]]:
        """Used stretches in times of the record, shape (n, 2) [s], and their numbers in the table."""
        whole = self.clock.record_time(table.spans)
        trimmed_spans = np.column_stack([whole[:, 0] + self.dead_time, whole[:, 1] - self.guard])
        keep = trimmed_spans[:, 1] > trimmed_spans[:, 0]
        if self.chosen is not None:
            keep &= self.chosen
        return trimmed_spans[keep], np.flatnonzero(keep)


@dataclass(frozen=True, slots=True, kw_only=True)
class RegressionRows:
    """Block means of one channel and of the columns of its regression.

    Attributes
    ----------
    dt : float [s]
        Length of a block.
    part : ndarray, shape (n,)
        Used samples over all samples of a block, 0 to 1.
    trust : ndarray, shape (n,)
        Variance of the model's white noise over that of the record, 1 unless the noise depends on the rate.
    time : ndarray, shape (n,) [s]
    mean : ndarray, shape (n,) [SI of the channel]
        NaN where nothing is used.
    span : ndarray of int64, shape (n,)
        Number of the table's stretch; -1 where nothing is used or a block touches two.
    columns : dict of str to ndarray, shape (n,)
        By name; rates over `full_scale`.
    full_scale : float [rad/s]
        Largest rate that is used.
    sampling : "mean" or "point"
    steps : ndarray, shape (n_spans, 4)
        Of each stretch: used samples, mean of the samples, first and last used sample (half-open).
    averages : dict of str to ndarray, shape (n_spans,)
        Means of the columns over the used samples of each stretch.
    """

    dt: float
    part: Array
    trust: Array
    time: Array
    mean: Array
    span: NDArray[np.int64]
    columns: Mapping[str, Array]
    full_scale: float
    sampling: Sampling
    steps: Array
    averages: Mapping[str, Array]

    @classmethod
    def of(
        cls,
        recording: Recording,
        channel: str,
        table: RateTable,
        window: SampleSelection,
        *,
        model: NoiseModel | None = None,
        temperature: str | None = None,
        size: int | None = None,
    ) -> RegressionRows:
        """Blocks so short that nothing is lost in noise of this model.

        Raises
        ------
        InputError
            No sample is used: times of table and record do not overlap.
        """
        size = size or block_size(recording, table, window, model)
        spans, numbers = window.spans(table)
        if not len(spans):
            raise InputError(
                f"every stretch of the table is shorter than the dead time, {window.dead_time + window.guard:.3g} s: "
                "give a shorter one if the sensor settles"
            )
        made = _Maker(
            recording=recording,
            channel=channel,
            table=table,
            window=window,
            temperature=temperature,
            size=size,
            edges=spans,
            numbers=numbers,
            full_scale=_full_scale(table, window),
        )
        return made.rows()

    @property
    def used(self) -> NDArray[np.bool_]:
        """Blocks with samples."""
        return np.asarray(self.part > 0)

    def column(self, name: str) -> Array:
        """One column; zero where nothing is used."""
        return self.columns[name]

    def straight(self, name: str) -> Array:
        """A column less its best straight line over the rate, weighted by time.

        Zero where it is a straight line itself: what rounding leaves of one looks like a column of its own.
        """
        line = self.line(name)
        left = np.where(self.used, self.columns[name] - line[0] - line[1] * self.columns[RATE], 0.0)
        whole = np.where(self.used, self.columns[name], 0.0)
        return left if np.linalg.norm(left) > RANK * np.linalg.norm(whole) else np.zeros_like(left)

    def line(self, name: str) -> Array:
        """Level and slope of the best straight line of a column over the rate, weighted by time."""
        weight = np.sqrt(self.part[self.used])
        table = np.column_stack([weight, weight * self.columns[RATE][self.used]])
        return np.asarray(np.linalg.lstsq(table, weight * self.columns[name][self.used], rcond=None)[0])

    def regress(self, table: Array, names: tuple[str, ...], model: NoiseModel) -> Regression:
        """Any columns on these blocks."""
        return regress(
            np.nan_to_num(self.mean),
            table,
            model,
            dt=self.dt,
            names=names,
            counts=self.part * self.trust,
            sampling=self.sampling,
        )

    def trusting(self, trust: Array) -> RegressionRows:
        """The same rows, their white noise 1/trust times as large."""
        return replace(self, trust=trust)


def block_size(
    recording: Recording, table: RateTable, window: SampleSelection, model: NoiseModel | None
) -> int:
    """Samples in a block."""
    least = -(-recording.n_samples // MOST_BLOCKS)
    if isinstance(table, Sinusoids):
        chosen = slice(None) if window.chosen is None else window.chosen
        length = 1 / (PER_PERIOD * float(table.frequency[chosen].max()))
        return max(int(length * recording.rate), least, 1)
    if isinstance(table, RateSteps):
        spans, _ = window.spans(table)
        dwell = float(np.quantile(spans[:, 1] - spans[:, 0], 0.2)) if len(spans) else recording.duration
    else:
        dwell = 6 * _turnover(table)
    return max(int(longest_block(model or NoiseModel.of(White(N=1.0)), dwell) * recording.rate), least, 1)


def _turnover(table: Sampled) -> float:
    """Time in which the rate goes from zero to full scale where it changes fast [s]."""
    grid = np.linspace(table.time[0], table.time[-1], 4001)
    rate = table.means(grid[:-1], float(grid[1] - grid[0]))
    slope = np.abs(np.diff(rate)) / (grid[1] - grid[0])
    return float(np.abs(rate).max() / max(np.quantile(slope, 0.95), 1e-12))


def _full_scale(table: RateTable, window: SampleSelection) -> float:
    """Largest rate among the stretches that take part."""
    if isinstance(table, Sampled):
        full_scale = table.full_scale
    else:
        sizes = np.abs(table.rate if isinstance(table, RateSteps) else table.amplitude)
        full_scale = float((sizes if window.chosen is None else sizes[window.chosen]).max(initial=0.0))
    full_scale = min(full_scale, max(window.above, -window.below))
    if full_scale <= 0:
        raise InputError("the table never turns: all of its rates are zero")
    return full_scale


@dataclass(frozen=True, slots=True, kw_only=True)
class _Maker:
    """What the loop over the samples needs."""

    recording: Recording
    channel: str
    table: RateTable
    window: SampleSelection
    temperature: str | None
    size: int
    edges: Array
    numbers: NDArray[np.int64]
    full_scale: float

    def rows(self) -> RegressionRows:
        facts, n_spans = self.recording[self.channel], len(self.table.spans)
        warmth = self._warmth()
        totals: dict[str, Array] = {}
        ends = np.column_stack([np.full(n_spans, math.inf), np.full(n_spans, -math.inf)])
        chunks = []
        for start, samples in self.recording.blocks(self.channel, self.size * max(BLOCK // self.size, 1)):
            values = (samples + self.recording.origin(self.channel)) * facts.scale
            columns, span = self._columns(start, len(values), warmth)
            middle: Array = start + 0.5 + np.arange(len(values), dtype=np.float64)
            columns |= {"mean": values, "time": middle / self.recording.rate}
            span = self._whole(np.where(np.isfinite(values), span, -1))
            used = span >= 0
            for name, column in {**columns, "count": np.ones(len(values))}.items():
                sums = np.bincount(span[used], column[used], n_spans)
                totals[name] = totals.get(name, np.zeros(n_spans)) + sums
            at: Array = np.flatnonzero(used).astype(np.float64) + start
            np.minimum.at(ends[:, 0], span[used], at)
            np.maximum.at(ends[:, 1], span[used], at + 1)
            chunks.append(self._blocks(columns, span))
        part, span, time, mean, columns = _joined(chunks)
        if not (part > 0).any():
            raise InputError(
                f"no sample of channel {self.channel!r} remains: times of table "
                f"({self.table.spans[0, 0]:g} s to {self.table.spans[-1, 1]:g} s) and record (0 to "
                f"{self.recording.duration:g} s) do not overlap, or every stretch is shorter than the dead time"
            )
        with np.errstate(invalid="ignore"):
            averages = {name: total / totals["count"] for name, total in totals.items()}
        return RegressionRows(
            dt=self.size / self.recording.rate,
            part=part,
            trust=np.ones_like(part),
            time=time,
            mean=np.where(part > 0, mean, math.nan),
            span=span,
            columns=columns,
            full_scale=self.full_scale,
            sampling=facts.sampling if self.size == 1 else "mean",
            steps=np.column_stack([totals["count"], averages["mean"], ends]),
            averages=averages,
        )

    def _warmth(self) -> Array:
        """Temperature less its mean [K], by straight lines between the samples that are there; empty without one."""
        if self.temperature is None:
            return np.zeros(0)
        values = self.recording.values(self.temperature)
        there = np.flatnonzero(np.isfinite(values))
        if not len(there):
            raise InputError(
                f"channel {self.temperature!r} holds no temperature: all of its samples are missing"
            )
        temperatures = np.interp(np.arange(len(values)), there, values[there])
        return np.asarray((temperatures - temperatures.mean()) * self.recording[self.temperature].scale)

    def _columns(self, start: int, count: int, warmth: Array) -> tuple[dict[str, Array], NDArray[np.int64]]:
        """Columns of the samples [start, start + count), and the stretch of each; -1 where it is not used."""
        dt, mean = self.recording.dt, self.recording[self.channel].sampling == "mean"
        clock, wide = self.window.clock, self.recording.dt if mean else 0.0
        t: Array = (start + np.arange(count, dtype=np.float64)) * dt
        after = np.searchsorted(self.edges.ravel(), t, side="right")
        ends = self.edges.ravel()[np.minimum(after, 2 * len(self.edges) - 1)]
        inside = (after % 2 == 1) & (t + wide <= ends + ROUNDING * dt)
        span = np.where(inside, self.numbers[np.minimum(after // 2, len(self.numbers) - 1)], -1)
        table_time = clock.table_time(t)
        rate = self._rates(table_time, wide)
        span = np.where((rate >= self.window.below) & (rate <= self.window.above), span, -1)
        u = rate / self.full_scale
        columns = {RATE: u, ABSOLUTE: np.abs(u), CONSTANCY: u * (t / self.recording.duration - 0.5)}
        for k in range(2, POWERS + 1):
            columns[power(k)] = columns[power(k - 1)] * u
        if isinstance(self.table, RateSteps):
            columns[DIRECTION] = self.table.direction[np.maximum(span, 0)]
        else:
            step = max(dt, self.table.interval if isinstance(self.table, Sampled) else dt)
            lag = (self._rates(table_time + step / 2, wide) - self._rates(table_time - step / 2, wide)) / (
                step * self.full_scale
            )
            columns |= {LAG: lag, LATE: lag * t, DIRECTION: np.sign(lag)}
        columns[LOOP] = columns[DIRECTION] * (1 - u**2)
        if len(warmth):
            warm = warmth[start : start + count]
            columns |= {TEMPERATURE: warm, WARM_RATE: warm * u}
        return columns, span

    def _rates(self, table_time: Array, wide: float) -> Array:
        """Rates of the table over samples; of an encoder, whose angles are rounded, over whole blocks."""
        if self._coarse:
            first = table_time[:: self.size]
            means = self.table.means(first, self.size * self.recording.dt)
            return np.repeat(means, self.size)[: len(table_time)]
        return self.table.means(table_time, wide)

    @property
    def _coarse(self) -> bool:
        """An encoder, whose rounded angles give rates over blocks."""
        return isinstance(self.table, Sampled) and self.table.rate is None and self.size > 1

    def _whole(self, span: NDArray[np.int64]) -> NDArray[np.int64]:
        """Where the rate is known over blocks, a block is used whole or not at all."""
        if not self._coarse:
            return span
        owner = np.pad(span, (0, -len(span) % self.size), constant_values=-1).reshape(-1, self.size)
        keep = np.repeat((owner >= 0).all(axis=1), self.size)[: len(span)]
        return np.where(keep, span, -1)

    def _blocks(self, columns: Mapping[str, Array], span: NDArray[np.int64]) -> dict[str, Array]:
        n_blocks = -(-len(span) // self.size)
        shape, room = (n_blocks, self.size), n_blocks * self.size - len(span)
        owner = np.pad(span, (0, room), constant_values=-1).reshape(shape)
        use = owner >= 0
        count = use.sum(axis=1)
        out = {"part": count / self.size}
        last = owner.max(axis=1)
        one = np.where(use, owner, last[:, None]).min(axis=1) == last
        out["span"] = np.where(one, last, -1).astype(np.float64)
        divisor = np.maximum(count, 1)
        for name, column in columns.items():
            samples = np.pad(column, (0, room)).reshape(shape)
            out[name] = np.where(use, samples, 0.0).sum(axis=1) / divisor
        return out


def _joined(
    chunks: list[dict[str, Array]],
) -> tuple[Array, NDArray[np.int64], Array, Array, dict[str, Array]]:
    whole = {name: np.concatenate([c[name] for c in chunks]) for name in chunks[0]}
    part, span, time, mean = (whole.pop(name) for name in ("part", "span", "time", "mean"))
    return part, span.astype(np.int64), time, mean, whole
