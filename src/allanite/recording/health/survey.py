# SPDX-License-Identifier: BSD-3-Clause
"""The facts of one channel, gathered in one pass: what every detector reads.

The samples are streamed in blocks, so a recording may be larger than memory; nothing here judges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.recording.health.impulses import Impulses, Spikes
from allanite.recording.health.tallies import (
    BlockDifferences,
    Energies,
    EqualRuns,
    Extreme,
    Extremes,
    MissingRuns,
    PartSums,
)
from allanite.recording.records import BLOCK, OVERLOAD, Channel, Recording

__all__ = ["ChannelSurvey", "Lattice", "Probes", "lattice_among", "lattice_of", "probes", "survey"]

Samples = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]

#: Probes: stretches of consecutive samples, spread evenly, that are kept for questions about the whole record.
PROBES, PROBE = 64, 4096
#: Stretches of missing or overload samples that are kept by place; more are counted only.
KEEP = 100_000
#: How far values may lie off a lattice [steps], and where hardly one of them occurs twice.
_OFF, _ONCE = 0.1, 1e-4
#: Values further from the middle than so many times the range of nine tenths of them do not tell the step.
WILD = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class Lattice:
    """Samples that lie on steps: value = anchor + step * integer.

    Attributes
    ----------
    step : float
        0.0 where no step was found: the samples are as good as continuous.
    codes : int
        Distinct values in the probes.
    """

    step: float
    codes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSurvey:
    """Facts of one channel. Values are in the channel's own unit, less `origin`; the mean is as written.

    Attributes
    ----------
    recording : Recording
    channel : Channel
    n_samples, present, missing, overload : int
        All positions; with a value; without one (overload words apart); overload words and infinities.
    missing_spans, overload_spans : ndarray of int64, shape (n, 2)
        The first `KEEP` of them.
    missing_runs, overload_runs : int
        How many stretches there are.
    unbroken : int
        Longest stretch without a missing or overload sample.
    mean : float
        Of the samples present; of their first differences for an angle or a velocity.
    parts : ndarray, shape (16,)
        Means of as many equal parts of the record, less `origin`; NaN where less than half of the part is there.
    sigma : float
        Standard deviation of the sample-to-sample noise: median over windows of half the mean square difference.
        For an angle or a velocity it is that of the increments.
    high, low : Extreme
        Outermost values (of the increments, for an angle or a velocity).
    probes : tuple of (int, ndarray)
        Stretches of consecutive samples (NaN where missing or overload), each with its first position.
    lattice : Lattice
    equal_histogram : ndarray of int64
        Bin L: runs of L equal consecutive samples (the last bin: that many or more).
    equal_spans, equal_shortest
        Runs of at least `equal_shortest` samples, by place.
    impulses : Impulses
    scales : tuple of BlockDifferences
        Energy of the differences, per lag and window.
    """

    recording: Recording = field(repr=False)
    channel: Channel
    n_samples: int
    present: int
    missing: int
    overload: int
    missing_spans: Index = field(repr=False)
    overload_spans: Index = field(repr=False)
    missing_runs: int
    overload_runs: int
    unbroken: int
    mean: float
    parts: Samples = field(repr=False)
    sigma: float
    high: Extreme = field(repr=False)
    low: Extreme = field(repr=False)
    probes: tuple[tuple[int, Samples], ...] = field(repr=False)
    lattice: Lattice
    equal_histogram: Index = field(repr=False)
    equal_spans: Index = field(repr=False)
    equal_shortest: int
    impulses: Impulses = field(repr=False)
    scales: tuple[BlockDifferences, ...] = field(repr=False)

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.channel.name

    @property
    def unit(self) -> str:
        """Unit of the samples as it is written after a number."""
        return f" {self.channel.unit}" if self.channel.unit else ""

    @property
    def dt(self) -> float:
        """Sample interval [s]."""
        return self.recording.dt

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type in which the samples were written."""
        return self.recording.columns[self.recording.index(self.name)].dtype

    @property
    def origin(self) -> float:
        """Value that was subtracted from 64-bit integers far from zero; all values here are less that."""
        return self.recording.origin(self.name)

    @property
    def constant(self) -> bool:
        """True when all samples present are equal (all increments, for an angle or a velocity)."""
        return len(self.high.values) == 1

    def at(self, position: int) -> float:
        """The sample at a position, as written."""
        return float(self.recording.raw(self.name, position, position + 1)[0]) + self.origin

    def seconds(self, position: int) -> str:
        """Time of a position, for a message."""
        return f"{position * self.dt:.6g} s"

    def without(self, spans: Index) -> ChannelSurvey:
        """The facts of what is left when these spans are left out of the analysis: one more pass over the channel.

        What is left out must not speak for another finding: a frozen tail is no held sample, a wild value no step.
        """
        return (
            survey(self.recording.excluding({self.name: spans}, "left out"), self.name)
            if len(spans)
            else self
        )


def survey(recording: Recording, name: str, advance: Callable[[int], None] | None = None) -> ChannelSurvey:
    """Gather the facts of a channel in one pass.

    Parameters
    ----------
    advance : callable, optional
        Called with the number of samples of each block that is done.
    """
    return _SurveyPass(recording, name).run(advance)


class _SurveyPass:
    """One pass over a channel: the tallies and what must be carried from block to block."""

    def __init__(self, recording: Recording, name: str) -> None:
        self.recording, self.channel = recording, recording[name]
        self.n = n = recording.n_samples
        self.integrated = self.channel.kind.integrated
        self.last = np.nan
        self.missing, self.overload, self.broken = MissingRuns(KEEP), MissingRuns(KEEP), MissingRuns(0)
        self.high, self.low = Extremes(+1), Extremes(-1)
        self.equal = EqualRuns()
        self.spikes = Spikes(n, self.integrated)
        self.energies = Energies(n, BLOCK)
        self.starts = _probe_starts(n)
        self.probes: list[tuple[int, Samples]] = []
        self.sums = PartSums(n)

    def run(self, advance: Callable[[int], None] | None) -> ChannelSurvey:
        for start in range(0, self.n, BLOCK):
            stop = min(start + BLOCK, self.n)
            self._block(self.recording.raw(self.channel.name, start, stop), start)
            if advance is not None:
                advance(stop - start)
        for tally in (self.missing, self.overload, self.broken, self.equal):
            tally.close(self.n)
        return self._facts()

    def _block(self, raw: Samples, start: int) -> None:
        block, complete = self._without_missing(raw, start)
        self._take_probes(block, start)
        step = np.empty(len(block))
        step[0] = block[0] - self.last
        np.subtract(block[1:], block[:-1], out=step[1:])
        self.last = block[-1]
        equal = step == 0.0
        signal = step if self.integrated else block
        complete = complete and not (self.integrated and bool(np.isnan(step[0])))
        self.equal.add(equal, start)
        self._take_values(signal, ~equal, complete)
        spikes = self.spikes.add(block, step, start)
        if len(spikes):
            signal = np.array(signal)
            signal[spikes] = np.nan
            if self.integrated:
                signal[np.minimum(spikes + 1, len(signal) - 1)] = np.nan
            complete = False
        self.energies.add(signal, complete)

    def _without_missing(self, raw: Samples, start: int) -> tuple[Samples, bool]:
        if max(float(raw.max()), -float(raw.min())) < OVERLOAD:  # False for NaN
            for tally in (self.missing, self.overload, self.broken):
                tally.add(None, start)
            return raw, True
        missing = np.isnan(raw)
        overload = np.abs(raw) >= OVERLOAD
        self.missing.add(missing, start)
        self.overload.add(overload if overload.any() else None, start)
        self.broken.add(missing | overload, start)
        return np.where(overload, np.nan, raw), False

    def _take_probes(self, block: Samples, start: int) -> None:
        while self.starts and self.starts[0] < start + len(block):
            at = max(min(self.starts.pop(0) - start, len(block) - PROBE), 0)
            self.probes.append((start + at, np.array(block[at : at + PROBE])))

    def _take_values(self, signal: Samples, fresh: Mask, complete: bool) -> None:
        self.high.add(signal, fresh)
        self.low.add(signal, fresh)
        self.sums.add(signal, complete)

    def _mean(self) -> float:
        terms = int(self.sums.count.sum())
        if terms == 0:
            return np.nan
        origin = 0.0 if self.integrated else self.recording.origin(self.channel.name)
        return float(self.sums.total.sum()) / terms + origin

    def _facts(self) -> ChannelSurvey:
        high, low = self.high.result(), self.low.result()
        scales = self.energies.result()
        return ChannelSurvey(
            recording=self.recording,
            channel=self.channel,
            n_samples=self.n,
            present=self.n - self.missing.count - self.overload.count,
            missing=self.missing.count,
            overload=self.overload.count,
            missing_spans=self.missing.spans,
            overload_spans=self.overload.spans,
            missing_runs=self.missing.n_runs,
            overload_runs=self.overload.n_runs,
            unbroken=self.broken.longest,
            mean=self._mean(),
            parts=self.sums.means(),
            sigma=_sigma(scales, self.probes, self.integrated),
            high=high,
            low=low,
            probes=tuple(self.probes),
            lattice=lattice_of([values for _, values in self.probes], high, low),
            equal_histogram=self.equal.histogram,
            equal_spans=self.equal.spans,
            equal_shortest=self.equal.shortest,
            impulses=self.spikes.result(),
            scales=scales,
        )


def probes(recording: Recording, name: str) -> list[Samples]:
    """The same stretches that a survey keeps, without the rest of it; NaN where missing."""
    kept = Probes(recording.n_samples)
    for start in kept.starts:
        values = recording.raw(name, start, start + PROBE)
        kept.add(start, np.where(np.abs(values) < OVERLOAD, values, np.nan))
    return kept.stretches


class Probes:
    """The stretches that a survey keeps, from any blocks that hold them.

    Attributes
    ----------
    starts : list of int
    stretches : list of ndarray
        NaN where missing.
    """

    __slots__ = ("starts", "stretches")

    def __init__(self, n_samples: int) -> None:
        self.starts = _probe_starts(n_samples)
        self.stretches = [np.full(min(PROBE, n_samples - start), np.nan) for start in self.starts]

    def add(self, first: int, block: Samples) -> None:
        """Take what a block of the record, whose first sample has this position, holds of them."""
        for start, stretch in zip(self.starts, self.stretches, strict=True):
            low, high = max(start, first), min(start + len(stretch), first + len(block))
            if low < high:
                stretch[low - start : high - start] = block[low - first : high - first]


def _probe_starts(n: int) -> list[int]:
    if n <= PROBES * PROBE:
        return list(range(0, n, PROBE))
    return [int(start) for start in np.linspace(0, n - PROBE, PROBES)]


def _sigma(
    scales: tuple[BlockDifferences, ...], probes: list[tuple[int, Samples]], integrated: bool
) -> float:
    """Noise from sample to sample; a median over windows, so that a disturbance does not count."""
    energy = scales[0].energy if scales else np.zeros(0)
    energy = energy[~np.isnan(energy)]
    if len(energy) and energy.max() > 0.0:  # values held twice have no difference within the pairs
        g = scales[0].details
        middle = float(np.median(energy)) / (1.0 - 2.0 / (9.0 * g)) ** 3  # median of chi-square over its mean
        return float(np.sqrt(0.5 * (middle if middle > 0.0 else float(np.mean(energy)))))
    steps = [np.diff(values, n=2 if integrated else 1) for _, values in probes]
    step = np.concatenate(steps) if steps else np.zeros(0)
    step = step[np.isfinite(step)]
    return float(np.sqrt(0.5 * np.mean(step * step))) if len(step) else 0.0


# -- steps ------------------------------------------------------------------------------------------------


def lattice_of(probes: list[Samples], high: Extreme, low: Extreme) -> Lattice:
    """The step of a channel whose samples are multiples of one, from the distinct values of its probes.

    Neighbouring codes are counted, the step and the anchor follow by least squares, and every value must lie
    within a tenth of a step of the lattice. A few distinct values out of as few samples fit some lattice by
    chance (each with probability 1/5), so then there must be twenty of them. Where hardly a value occurs twice, an even
    rise with a little noise looks like a lattice: then the values must lie on it to a ten-thousandth of a step.
    """
    values = np.concatenate(probes) if probes else np.zeros(0)
    values = values[~np.isnan(values)]
    distinct = np.unique(values)
    if len(distinct) <= 8:  # a rare second code may have escaped the probes
        distinct = np.unique(np.concatenate([distinct, high.values, low.values]))
    return lattice_among(distinct, values, high.tolerance)


def lattice_among(distinct: Samples, values: Samples, tolerance: float) -> Lattice:
    """The step of these distinct values, which were seen among so many; values closer than the tolerance are one.

    A wild value says nothing of the step: what lies beyond a thousand spreads of the values is set aside.
    """
    if len(values):
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        if high > low:
            distinct = distinct[np.abs(distinct - middle) <= WILD * (high - low)]
    if len(distinct) < 2 or (len(distinct) < 20 and 2 * len(distinct) > len(values)):
        return Lattice(step=0.0, codes=len(distinct))
    spacing = np.diff(distinct)
    rounding = max(8.0 * float(np.spacing(np.abs(distinct).max())), tolerance)
    off = _ONCE if len(distinct) > 0.9 * len(values) else _OFF
    for floor in (rounding, _rounding_of(spacing)):
        step = _step_of(distinct[np.concatenate(([True], spacing > floor))], off)
        if step > 0.0:
            return Lattice(step=step, codes=len(distinct))
    return Lattice(step=0.0, codes=len(distinct))


def _rounding_of(spacing: Samples) -> float:
    """Spacing that parts several roundings of one code (a scaled float32, decimal text) from codes; 0.0 if none does.

    It lies in the widest jump of the spacings, on a logarithmic scale, among the smaller half of them.
    """
    ordered = np.sort(spacing)[: len(spacing) // 2 + 1]
    ratio = ordered[1:] / ordered[:-1]
    if len(ratio) == 0 or ratio.max() < 30.0:
        return 0.0
    k = int(np.argmax(ratio))
    return float(np.sqrt(ordered[k] * ordered[k + 1]))


def _step_of(distinct: Samples, tolerance: float) -> float:
    """The step on which all values lie to within this part of it; 0.0 if there is none."""
    spacing = np.diff(distinct)
    if len(spacing) == 0:
        return 0.0
    unit = float(np.median(spacing[spacing < 1.5 * float(spacing.min())]))
    near = spacing < 5.5 * unit  # counted without error, however the unit was rounded
    unit = float(spacing[near].sum() / np.rint(spacing[near] / unit).sum())
    code = np.concatenate(([0.0], np.cumsum(np.rint(spacing / unit))))
    slope, anchor = _line(code, distinct)
    off = np.abs(distinct - anchor - slope * code)
    return slope if float(off.max()) < tolerance * slope else 0.0


def _line(x: Samples, y: Samples) -> tuple[float, float]:
    dx = x - x.mean()  # sums, not products of vectors: those would start threads for a short row
    slope = float((dx * (y - y.mean())).sum() / (dx * dx).sum())
    return slope, float(y.mean() - slope * x.mean())
