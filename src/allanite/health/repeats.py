# SPDX-License-Identifier: BSD-3-Clause
"""Findings about samples that repeat: frozen readings, zeros in place of samples, two sensors in one column."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from allanite.health.finding import Finding, Severity, finding, percent, plural
from allanite.health.resolution import is_unresolved
from allanite.health.survey import Survey
from allanite.health.values import MINIMUM, spans_equal

__all__ = [
    "Alternation",
    "alternation",
    "duplicate_channels",
    "hold_factor",
    "interleaved",
    "repeated",
    "stuck",
    "zero_filled",
]

Samples = NDArray[np.float64]
Index = NDArray[np.int64]

#: Chance that one record of noise has a run as long as those called stuck.
ALARM = 1e-4
#: Share left out beyond which the rest is not trusted either.
MOSTLY = 0.5


# -- frozen readings --------------------------------------------------------------------------------------


def stuck(survey: Survey) -> Iterator[Finding]:
    """A value that repeats longer than chance allows (battery B16; class 4)."""
    if survey.constant or is_unresolved(survey):
        return
    longest = longest_by_chance(survey)
    spans = survey.equal_spans
    spans = spans[spans[:, 1] - spans[:, 0] > longest]
    zeros = _zero_spans(survey)
    if len(zeros):
        spans = spans[~np.isin(spans[:, 0], zeros[:, 0])]
    if len(spans) == 0:
        return
    count = int(np.diff(spans, axis=1).sum())
    first, last = spans[0], spans[-1]
    end = "; the readings are frozen to the end" if last[1] == survey.n_samples else ""
    share = count / survey.present
    yield finding(
        "stuck",
        f"{plural(len(spans), 'stretch')} of one repeated value, {count} samples ({percent(share)}); the first repeats "
        f"{survey.at(int(first[0])):.6g}{survey.unit} {first[1] - first[0]} times at {survey.seconds(int(first[0]))}, "
        f"where chance makes at most {longest}{end}",
        severity=Severity.FATAL if share > MOSTLY else Severity.WARNING,
        channel=survey.name,
        spans=spans,
        weight=np.diff(spans, axis=1)[:, 0],
        excludes=True,
    )


def longest_by_chance(survey: Survey) -> int:
    """Length of equal runs that noise on these steps exceeds in one record of 10 000.

    The number of runs of at least L falls geometrically. The chance of going on by one more is measured at the
    longest length that still has 100 runs, three standard errors are added, and the fall is extrapolated; half
    as much again covers a level that drifts between the steps.
    """
    histogram = survey.equal_histogram.astype(np.float64)
    lengths = np.arange(len(histogram))
    histogram[1] = max(survey.present - float(lengths @ histogram), 0.0)
    survivors = np.cumsum(histogram[::-1])[::-1]  # [L]: runs of at least L
    common = np.flatnonzero(survivors[1:-1] >= 100) + 1
    last = int(common[-1]) if len(common) else 1
    runs = max(float(survivors[last]), 1.0)
    hazard = float(survivors[last + 1]) / runs
    hazard = min(hazard + 3.0 * math.sqrt(hazard * (1.0 - hazard) / runs) + 3.0 / runs, 0.98)
    held = max(hold_factor(survey), 1)
    more = 1.5 * held * math.log(runs / ALARM) / -math.log(hazard)
    return max(4, 2 * last, last + math.ceil(more), survey.equal_shortest - 1)


# -- zeros ------------------------------------------------------------------------------------------------


def zero_filled(survey: Survey) -> Iterator[Finding]:
    """Exact zeros far from the level: one sample, a stretch, the beginning, the tail (battery B16; class 4)."""
    spans = _zero_spans(survey)
    if len(spans) == 0:
        return
    count = int(np.diff(spans, axis=1).sum())
    share = count / survey.present
    where = []
    if spans[0, 0] == 0:
        where.append(f"the first {plural(int(spans[0, 1]), 'sample')}")
    if spans[-1, 1] == survey.n_samples:
        where.append(f"the last {plural(int(spans[-1, 1] - spans[-1, 0]), 'sample')}")
    inner = len(spans) - len(where)
    if inner:
        where.append(plural(inner, "stretch") + " within")
    yield finding(
        "zero_filled",
        f"{plural(count, 'sample')} ({percent(share)}) exactly 0 while the level is {survey.mean:.4g}{survey.unit}, "
        f"{_distance_of_zero(survey):.2g} sigma away: {', '.join(where)}",
        severity=Severity.FATAL if share > MOSTLY else Severity.WARNING,
        channel=survey.name,
        spans=spans,
        weight=np.diff(spans, axis=1)[:, 0],
        excludes=True,
    )


def _zero_spans(survey: Survey) -> Index:
    """Runs of exact zeros, if zero is not among the values that the noise reaches."""
    none = np.zeros((0, 2), dtype=np.int64)
    if survey.channel.kind.integrated or survey.constant or survey.sigma == 0.0:
        return none
    outer = np.concatenate([survey.high.values, survey.low.values]) + survey.origin
    if 0.0 not in outer or _distance_of_zero(survey) < 8.0:
        return none
    return spans_equal(survey, [-survey.origin])


def _distance_of_zero(survey: Survey) -> float:
    """Distance of 0 from the level, in units of the noise about it."""
    values = np.concatenate([values for _, values in survey.probes]) + survey.origin
    values = values[(values != 0.0) & np.isfinite(values)]
    if len(values) < MINIMUM:
        return 0.0
    low, middle, high = np.quantile(values, [0.16, 0.5, 0.84])
    spread = max(0.5 * (high - low), survey.sigma)
    return abs(float(middle)) / float(spread)


# -- samples held -----------------------------------------------------------------------------------------


def hold_factor(survey: Survey) -> int:
    """How many times each value stands in a row, the same all along; 1 if it does not."""
    equal = [np.diff(values) == 0.0 for _, values in survey.probes]
    equal = [e for e in equal if len(e) >= 256 and 0.4 < e.mean() < 0.995]
    if not equal or len(equal) < 0.5 * len(survey.probes):
        return 1
    for factor in range(32, 1, -1):
        if np.mean([_is_held(e, factor) for e in equal]) >= 0.9:
            return factor
    return 1


def _is_held(equal: NDArray[np.bool_], factor: int) -> bool:
    """Changes come in one phase of the period only."""
    share = np.sort(equal[: len(equal) // factor * factor].reshape(-1, factor).mean(axis=0))
    return bool(share[0] < 0.9 and share[1] > 0.99)


def repeated(survey: Survey) -> float:
    """Share of repeats beyond what the steps of the values allow.

    Differences of rounded Gaussian samples have log-concave chances, so those of 0, 1 and 2 steps obey
    p(0) <= p(1)^2/p(2); and p(0) <= 1.1 p(1) for steps below 0.3 sigma, also when sigma changes. What exceeds the
    larger bound by four standard errors is repetition. Only for such steps are few repeats expected at all.
    Values at the ends of the range do not count: they repeat when it clips.
    """
    step = survey.lattice.step
    if step > 0.3 * _quietest(survey) or survey.sigma == 0.0:
        return 0.0
    ends = [survey.high.values[0], survey.low.values[0]]
    shares = []
    for _, values in survey.probes:
        jump = np.abs(np.diff(values))
        jump = jump[np.isfinite(jump) & ~np.isin(values[1:], ends)]
        if len(jump) >= 256 and np.mean(jump == 0.0) < 0.9:  # more is a frozen stretch
            shares.append(float(np.mean(jump == 0.0)) - (_allowed(jump, step) if step > 0.0 else 0.0))
    return max(float(np.median(shares)), 0.0) if shares else 0.0


def _allowed(jump: Samples, step: float) -> float:
    """Largest share of repeats that steps of the values explain."""
    one, two = (0.5 * float(np.mean(np.abs(jump - k * step) < 0.5 * step)) for k in (1, 2))
    if two == 0.0:
        return 1.0
    return max(one * one / two, 1.1 * one) + 4.0 * math.sqrt(one / len(jump))


def _quietest(survey: Survey) -> float:
    """Noise from sample to sample in the quietest twentieth of the record."""
    energy = survey.scales[0].energy if survey.scales else np.zeros(0)
    energy = energy[~np.isnan(energy)]
    return math.sqrt(0.5 * float(np.quantile(energy, 0.05))) if len(energy) else survey.sigma


# -- two sensors in one column ----------------------------------------------------------------------------


class Alternation(NamedTuple):
    """Rows that alternate: with which period, how far apart in level [sigma], and in which ratio of noise powers."""

    period: int
    level: float
    noise: float


def alternation(survey: Survey) -> Alternation | None:
    """How the rows alternate; None where they do not."""
    if survey.channel.kind.integrated or survey.constant:
        return None
    stretches = [values for _, values in survey.probes]
    two = _alternates(stretches, 2)
    if two is not None and not any(_alternates([v[k::2] for v in stretches], 2) for k in (0, 1)):
        return two
    return _alternates(stretches, 3) or _alternates(stretches, 4) or two  # four phases make two as well


def _alternates(stretches: Sequence[Samples], period: int) -> Alternation | None:
    """The alternation with this period, if nine stretches in ten show it."""
    apart = [a for values in stretches if (a := _phases(values, period)) is not None]
    if len(apart) < max(1, 0.5 * len(stretches)):
        return None
    level, noise = np.quantile(np.array(apart), 0.1, axis=0)
    if level > (1.0 if period == 2 else 3.0) or noise > 3.0:
        return Alternation(period, float(level), float(noise))
    return None


def interleaved(survey: Survey) -> Iterator[Finding]:
    """Levels or noises that alternate from row to row (class 3)."""
    found = alternation(survey)
    if found is None:
        return
    what = f"levels {found.level:.2g} sigma apart"
    if found.level <= 1.0:
        what = f"noises in the ratio {math.sqrt(found.noise):.2g} or more"
    yield finding(
        "interleaved",
        f"rows alternate with period {found.period}: {what}",
        severity=Severity.FATAL if found.level > 3.0 else Severity.WARNING,
        channel=survey.name,
        count=survey.present,
        advice=f"split the rows into {found.period} channels at {survey.recording.rate / found.period:.6g} Hz",
    )


def _phases(values: Samples, period: int) -> tuple[float, float] | None:
    """How far the phases of a period lie apart: level (in sigma within a phase) and ratio of noise powers.

    The power of a phase is half the mean square of its differences from row to row: a mean, since the median of
    samples on steps jumps from one square of a step to the next. The largest fortieth of the differences of all phases
    counts as no larger than its least, which keeps it deaf to outliers and makes a ratio of powers of 9 up to 17 %
    smaller. The ratio counts where its logarithm exceeds five standard errors.
    """
    rows = values[: len(values) // period * period].reshape(-1, period)
    rows = rows[np.isfinite(rows).all(axis=1)]
    if len(rows) < 256:
        return None
    squares = np.diff(rows, axis=0) ** 2
    largest = float(np.quantile(squares, 0.975))
    if largest > 0.0:  # else the values rarely change
        squares = np.minimum(squares, largest)
    power = 0.5 * np.mean(squares, axis=0)
    if power.min() == 0.0:
        return None
    sigma = float(np.sqrt(np.median(power)))
    level = rows.mean(axis=0)
    noise = 8.0 * sigma / math.sqrt(len(rows))  # what chance makes of the levels, generously
    return max(float(np.ptp(level)) - noise, 0.0) / sigma, _ratio_of_powers(squares)


def _ratio_of_powers(squares: Samples) -> float:
    """Largest ratio of the mean squares of two phases; 1.0 where chance explains it.

    Differences that share a row of white noise have correlation -1/2, their squares 1/4: the variance of a mean
    square is 1.5 times that of as many independent ones (Isserlis). Chance exceeds five standard errors in 6e-7, for
    the six pairs of four phases in less than 4e-6 of the stretches looked at, of which nine in ten must agree.
    """
    power = squares.mean(axis=0)
    high, low = int(np.argmax(power)), int(np.argmin(power))
    spread = 1.5 * squares.var(axis=0) / (len(squares) * power**2)
    ratio = float(power[high] / power[low])
    return ratio if math.log(ratio) > 5.0 * math.sqrt(spread[high] + spread[low]) else 1.0


# -- two names for one sensor -----------------------------------------------------------------------------


def duplicate_channels(surveys: Sequence[Survey]) -> Iterator[Finding]:
    """Two channels with the same samples, or one a fixed multiple of the other."""
    for i, one in enumerate(surveys):
        for other in surveys[:i]:
            ratio = _ratio(one, other)
            if ratio is not None:
                same = "the same samples as" if ratio == 1.0 else f"{ratio:.6g} times the samples of"
                yield finding(
                    "duplicate_channels",
                    f"holds {same} {other.name!r}",
                    severity=Severity.WARNING,
                    channel=one.name,
                    count=one.present,
                )


def _ratio(one: Survey, other: Survey) -> float | None:
    """The constant ratio of two channels; None if there is none."""
    if one.constant or other.constant or not one.probes:
        return None
    ratio: float | None = None
    for (_, a), (_, b) in zip(one.probes, other.probes, strict=True):
        ok = np.isfinite(a) & np.isfinite(b)
        if not np.array_equal(np.isnan(a), np.isnan(b)) or not ok.any():
            return None
        if ratio is None:
            size = np.abs(b[ok])
            k = int(np.argmax(size))
            if size[k] == 0.0:
                continue
            ratio = float(a[ok][k] / b[ok][k])
        if not np.allclose(a[ok], ratio * b[ok], rtol=1e-9, atol=0.0):
            return None
    return ratio if ratio else None
