# SPDX-License-Identifier: BSD-3-Clause
"""Findings about samples that repeat: frozen readings, zeros in place of samples, two sensors in one column."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from allanite.recording.health.finding import Finding, Severity, finding, percent, plural
from allanite.recording.health.padding import MOSTLY
from allanite.recording.health.resolution import is_unresolved
from allanite.recording.health.survey import ChannelSurvey

__all__ = [
    "Alternation",
    "alternation",
    "duplicate_channels",
    "hold_factor",
    "interleaved",
    "repeated",
    "stuck",
]

Samples = NDArray[np.float64]
Index = NDArray[np.int64]

#: Chance that one record of noise has a run as long as those called stuck.
ALARM = 1e-4
#: Samples of the pieces that must agree on an alternation, and rows of a period in one at the least.
PIECE, FEWEST = 2048, 256
#: Parts of a piece whose levels must agree.
QUARTERS = 4


# -- frozen readings --------------------------------------------------------------------------------------


def stuck(survey: ChannelSurvey) -> Iterator[Finding]:
    """A value that repeats longer than chance allows (battery B16; class 4)."""
    if survey.constant or is_unresolved(survey):
        return
    longest = longest_by_chance(survey)
    spans = survey.equal_spans
    spans = spans[spans[:, 1] - spans[:, 0] > longest]
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
        f"by chance at most {longest}{end}",
        severity=Severity.FATAL if share > MOSTLY else Severity.WARNING,
        channel=survey.name,
        spans=spans,
        weight=np.diff(spans, axis=1)[:, 0],
        excludes=True,
    )


def longest_by_chance(survey: ChannelSurvey) -> int:
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


# -- samples held -----------------------------------------------------------------------------------------


def hold_factor(survey: ChannelSurvey) -> int:
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


def repeated(survey: ChannelSurvey) -> float:
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


def _quietest(survey: ChannelSurvey) -> float:
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


def alternation(survey: ChannelSurvey) -> Alternation | None:
    """How the rows alternate; None where they do not."""
    if survey.channel.kind.integrated or survey.constant:
        return None
    pieces = [piece for start, values in survey.probes for piece in _pieces(start, values)]
    two = _alternates(pieces, 2)
    if two is not None and not any(
        _alternates([((s + k) // 2, v[k::2]) for s, v in pieces], 2) for k in (0, 1)
    ):
        return two
    return _alternates(pieces, 3) or _alternates(pieces, 4) or two  # four phases make two as well


def _pieces(start: int, values: Samples) -> Iterator[tuple[int, Samples]]:
    """A stretch in parts of `PIECE` samples at least, each with the position of its first sample."""
    size = len(values) // max(1, len(values) // PIECE)
    for k in range(0, len(values) - size + 1, max(size, 1)):
        yield start + k, values[k : k + size]


def _alternates(pieces: Sequence[tuple[int, Samples]], period: int) -> Alternation | None:
    """The alternation with this period, if nine pieces in ten show the same one.

    One wild sample, or a disturbance, is in one piece; a line near half the rate turns over from piece to piece. Once
    more than one in ten show no more than chance in either, the others are not looked at.
    """
    phases, level_by_chance, noise_by_chance = list[_Phases](), 0, 0
    for start, values in pieces:
        if (p := _phases(values, period, start)) is None:
            continue
        phases.append(p)
        level_by_chance += int((np.ptp(p.level, axis=1) <= p.doubt).sum())
        noise_by_chance += bool(np.ptp(np.log(p.power)) <= p.spread)
        if level_by_chance > QUARTERS * len(pieces) // 10 and noise_by_chance > len(pieces) // 10:
            return None
    if len(phases) < max(1, 0.5 * len(pieces)):
        return None
    level = _agreed(np.concatenate([p.level for p in phases]), np.repeat([p.doubt for p in phases], QUARTERS))
    noise = _agreed(np.log([p.power for p in phases]), np.array([p.spread for p in phases]))
    if level > (1.0 if period == 2 else 3.0) or noise > math.log(3.0):
        return Alternation(period, level, math.exp(noise))
    return None


def _agreed(patterns: Samples, doubt: Samples) -> float:
    """How far two phases lie apart in most pieces; 0.0 unless they do so in nine of ten, in the same order.

    Parameters
    ----------
    patterns : ndarray, shape (n_pieces, period)
    doubt : ndarray, shape (n_pieces,)
        What chance makes of a difference, generously.
    """
    usual = np.median(patterns, axis=0)
    apart = patterns[:, int(np.argmax(usual))] - patterns[:, int(np.argmin(usual))]
    return float(np.median(apart)) if np.quantile(apart - doubt, 0.1, method="lower") > 0.0 else 0.0


def interleaved(survey: ChannelSurvey) -> Iterator[Finding]:
    """Levels or noises that alternate from row to row (class 3)."""
    pattern = alternation(survey)
    if pattern is None:
        return
    what = f"levels {pattern.level:.2g} sigma apart"
    if pattern.level <= 1.0:
        what = f"noises in the ratio {math.sqrt(pattern.noise):.2g} or more"
    yield finding(
        "interleaved",
        f"rows alternate with period {pattern.period}: {what}",
        severity=Severity.FATAL if pattern.level > 3.0 else Severity.WARNING,
        channel=survey.name,
        count=survey.present,
        advice=f"split the rows into {pattern.period} channels at {survey.recording.rate / pattern.period:.6g} Hz",
    )


class _Phases(NamedTuple):
    """What the phases of a period show: levels in each quarter [sigma within a phase], noise powers; and by chance."""

    level: Samples
    doubt: float
    power: Samples
    spread: float


def _phases(values: Samples, period: int, start: int) -> _Phases | None:
    """Levels and noise powers of the phases of a period, phase 0 being that of position 0; None where samples lack.

    The level of a phase is the mean of what its samples have over the moving mean of a period: no drift is in it. The
    power is half the mean square of the differences from row to row: a mean, since the median of samples on steps
    jumps from one square of a step to the next. The largest fortieth of either, of all phases together, counts as no
    larger than its least, which keeps them deaf to outliers and makes a ratio of powers of 9 up to 17 % smaller.
    """
    rows = values[: len(values) // period * period].reshape(-1, period)
    rows = rows[np.isfinite(rows).all(axis=1)]
    if len(rows) < FEWEST:
        return None
    squares = _winsorized(np.diff(rows, axis=0)[None] ** 2, 0.0, 0.975)[0]
    power = 0.5 * np.mean(squares, axis=0)
    if power.min() == 0.0:
        return None
    sigma = float(np.sqrt(np.median(power)))
    turn = start % period
    quarter = len(rows) // QUARTERS
    levels = _levels(rows[: QUARTERS * quarter].reshape(QUARTERS, quarter, period))
    return _Phases(
        level=np.roll(levels / sigma, turn, axis=1),
        doubt=8.0 / math.sqrt(quarter),
        power=np.roll(power, turn),
        spread=_doubt_of_powers(squares),
    )


def _levels(parts: Samples) -> Samples:
    """Mean of each phase over the moving mean of a period, which takes drift out.

    Parameters
    ----------
    parts : ndarray, shape (n_parts, n_rows, period)

    Returns
    -------
    ndarray, shape (n_parts, period)
    """
    n, _, period = parts.shape
    reach = period // 2
    flat = parts.reshape(n, -1)
    share = flat / period
    after = [share[:, k : k - 2 * reach or None] for k in range(2 * reach + 1)]
    if period % 2 == 0:  # the ends count half
        after[0], after[-1] = 0.5 * after[0], 0.5 * after[-1]
    above = flat[:, reach:-reach] - sum(after)
    above = above[:, (-reach) % period :]  # from phase 0 on
    above = above[:, : above.shape[1] // period * period].reshape(n, -1, period)
    return np.asarray(_winsorized(above, 0.0125, 0.9875).mean(axis=1))


def _winsorized(parts: Samples, low: float, high: float) -> Samples:
    """What lies beyond these quantiles of each part moved to them, unless hardly any value of it changes."""
    flat = parts.reshape(len(parts), -1)
    last = flat.shape[1] - 1
    places = [(int(last * q), min(int(last * q) + 1, last), last * q % 1.0) for q in (low, high)]
    ordered = np.partition(flat, sorted({k for *pair, _ in places for k in pair}), axis=1)
    least, most = (
        (ordered[:, k] + share * (ordered[:, after] - ordered[:, k]))[:, None] for k, after, share in places
    )
    return np.where(most > least, np.clip(flat, least, most), flat).reshape(parts.shape)


def _doubt_of_powers(squares: Samples) -> float:
    """What chance makes of the logarithm of a ratio of the mean squares of two phases: five standard errors.

    Differences that share a row of white noise have correlation -1/2, their squares 1/4: the variance of a mean
    square is 1.5 times that of as many independent ones (Isserlis). Chance exceeds five standard errors in 6e-7, for
    the six pairs of four phases in less than 4e-6 of the pieces looked at, of which nine in ten must agree.
    """
    power = squares.mean(axis=0)
    spread = np.sort(1.5 * squares.var(axis=0) / (len(squares) * power**2))
    return float(5.0 * np.sqrt(spread[-2:].sum()))


# -- two names for one sensor -----------------------------------------------------------------------------


def duplicate_channels(surveys: Sequence[ChannelSurvey]) -> Iterator[Finding]:
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


def _ratio(one: ChannelSurvey, other: ChannelSurvey) -> float | None:
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
