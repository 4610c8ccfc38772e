# SPDX-License-Identifier: BSD-3-Clause
"""Findings about single values: missing ones, overload words, ends of the range, nonsense."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.quantities.distributions import normal_quantile
from allanite.recording.health.catalogue.samples import BY_SAMPLES
from allanite.recording.health.finding import Finding, Severity, finding, percent, plural
from allanite.recording.health.survey import ChannelSurvey, lattice_among
from allanite.recording.health.tallies import Extreme, Runs
from allanite.recording.records import BLOCK, OVERLOAD

__all__ = [
    "MINIMUM",
    "TOLERATED",
    "clipping",
    "every",
    "implausible_exponents",
    "missing",
    "no_samples",
    "only_grows",
    "overload",
    "saturated",
    "scattered",
    "spans_equal",
    "too_short",
]

Spans = NDArray[np.int64]

#: Samples below which no noise model makes sense: five octaves of lags.
MINIMUM = 32
#: Share of unusable samples beyond which the rest is not trusted either.
TOLERATED = 1e-3
#: The longest average is this part of the record, at least, unless gaps shorten it much.
SHORT = 16
#: Gaps from which on a pattern can be told from none; and the standard deviation over the mean of their lengths, or of
#: the lengths between them: the larger is 0.7 to 1 at random.
FEWEST_GAPS, SCATTERED = 8, 0.5
#: Share of the steps that have one sign, or are one and the same, in what only grows; and of those that are not 0.
ONE_WAY, COUNTS_ON, MOVES = 0.98, 0.9, 0.5
#: Distinct values from which on the end of a range can be told from the step of the values.
LEVELS = 8
#: Places at which the step around an outermost value is looked for, samples on each side, and how far off a step is on.
_PLACES, _AROUND, _OFF_STEPS = 16, 128, 0.1
#: Largest and smallest codes of 16-, 24- and 32-bit words.
_TOPS = frozenset({32767.0, 65535.0, 8388607.0, 16777215.0, 2147483647.0, 4294967295.0})
_BOTTOMS = frozenset({-32768.0, -8388608.0, -2147483648.0})


# -- missing ----------------------------------------------------------------------------------------------


def no_samples(survey: ChannelSurvey) -> Iterator[Finding]:
    """Nothing but gaps (battery B3)."""
    if survey.present == 0:
        yield finding(
            "no_samples",
            f"all {survey.n_samples} samples are missing (at least {MINIMUM} are needed)",
            severity=Severity.FATAL,
            channel=survey.name,
            count=survey.n_samples,
        )


def too_short(survey: ChannelSurvey) -> Iterator[Finding]:
    """Fewer samples than a noise model needs (battery B3)."""
    if 0 < survey.present < MINIMUM:
        yield finding(
            "too_short",
            f"{plural(survey.present, 'sample')}; at least {MINIMUM} are needed",
            severity=Severity.FATAL,
            channel=survey.name,
            count=survey.present,
        )


def missing(survey: ChannelSurvey) -> Iterator[Finding]:
    """Gaps, and whether anything unbroken is left between them (battery B1, B15; classes 3 and 14)."""
    if survey.present == 0:
        return
    if survey.unbroken < MINIMUM <= survey.present:
        yield _broken_up(survey)
        return
    if survey.missing:
        share = survey.missing / survey.n_samples
        short = survey.unbroken * SHORT < survey.present and scattered(survey.missing_spans)
        yield finding(
            "missing",
            f"{survey.missing} of {plural(survey.n_samples, 'sample')} missing ({percent(share)}) "
            f"in {plural(survey.missing_runs, 'stretch')}; "
            f"the longest unbroken stretch is {survey.unbroken * survey.dt:.6g} s",
            severity=Severity.INFO if share <= TOLERATED else Severity.WARNING,
            channel=survey.name,
            spans=survey.missing_spans,
            count=survey.missing,
            advice=BY_SAMPLES if short else None,
        )


def _broken_up(survey: ChannelSurvey) -> Finding:
    spacing, at_random, pattern = every(survey), scattered(survey.missing_spans), ""
    advice = BY_SAMPLES if at_random else None
    if spacing:
        pattern = f": there is a value every {spacing} rows"
        advice = f"keep the rows with a value and pass their rate, {survey.recording.rate / spacing:.6g} Hz"
    return finding(
        "broken_up",
        f"the longest unbroken stretch is {plural(survey.unbroken, 'sample')} of {survey.present}{pattern}",
        severity=Severity.FATAL,
        channel=survey.name,
        spans=survey.missing_spans,
        count=survey.missing,
        advice=advice,
        repaired=not at_random,
    )


def scattered(missing: ArrayLike) -> bool:
    """Missing at random: lengths of runs scatter as much as their mean.

    Rows that several sensors share, or a slower one, miss values at distances that differ little.
    """
    starts, stops = np.asarray(missing).reshape(-1, 2).T
    runs = (stops - starts, starts[1:] - stops[:-1])
    return len(starts) > FEWEST_GAPS and any(float(r.std()) > SCATTERED * float(r.mean()) for r in runs)


def every(survey: ChannelSurvey) -> int | None:
    """Spacing of the values, if they come every k-th row."""
    for _, values in survey.probes:
        place = np.flatnonzero(~np.isnan(values))
        if len(place) > 8 and np.ptp(np.diff(place)) == 0:
            return int(place[1] - place[0]) if place[1] - place[0] > 1 else None
    return None


# -- ends of the range ------------------------------------------------------------------------------------


def overload(survey: ChannelSurvey) -> Iterator[Finding]:
    """Overload words and infinities (battery B2, Q8): never numbers."""
    if survey.overload:
        share = survey.overload / survey.n_samples
        yield finding(
            "overload",
            f"{plural(survey.overload, 'overload word')} among {survey.n_samples} samples ({percent(share)}) "
            f"in {plural(survey.overload_runs, 'stretch')}",
            severity=Severity.FATAL if share > TOLERATED else Severity.WARNING,
            channel=survey.name,
            spans=survey.overload_spans,
            count=survey.overload,
            excludes=True,
        )


def saturated(survey: ChannelSurvey) -> Iterator[Finding]:
    """The extreme code of an integer word, repeated or far from the rest (battery B2)."""
    codes = [code for code in _rails(survey) if _is_rail(survey, *code)]
    if codes:
        values = [float(extreme.values[0]) for extreme, _ in codes]
        count = sum(int(extreme.samples[0]) for extreme, _ in codes)
        share = count / survey.n_samples
        yield finding(
            "saturated",
            f"{plural(count, 'sample')} at the end of the integer range ("
            + ", ".join(f"{v + survey.origin:.0f}" for v in values)
            + f"; {percent(share)})",
            severity=Severity.FATAL if share > TOLERATED else Severity.WARNING,
            channel=survey.name,
            spans=spans_equal(survey, values, within=max(float(e.spread[0]) for e, _ in codes)),
            excludes=True,
        )


def _rails(survey: ChannelSurvey) -> list[tuple[Extreme, frozenset[float]]]:
    tops, bottoms = _TOPS, _BOTTOMS
    if survey.dtype.kind in "iu":
        limits = np.iinfo(survey.dtype)
        tops, bottoms = tops | {float(limits.max)}, bottoms | {float(limits.min)} - {0.0}
    return [(survey.high, tops), (survey.low, bottoms)]


def _is_rail(survey: ChannelSurvey, extreme: Extreme, rails: frozenset[float]) -> bool:
    if len(extreme.values) == 0 or float(extreme.values[0]) + survey.origin not in rails:
        return False
    repeats = bool(extreme.runs[0] < extreme.samples[0])
    far = abs(float(extreme.values[0]) + survey.origin - survey.mean) > 6.0 * survey.sigma
    return (repeats or far) and not survey.constant


def clipping(survey: ChannelSurvey) -> Iterator[Finding]:
    """The range ends inside the noise (battery B6).

    In the tail of a noise the density falls outwards, so of the samples at and near the outermost value at most
    a part ``step/(step + width)`` stands at the outermost value itself (2.5 times that for a strong vibration,
    whose density rises towards its ends). Where the counts fall outwards, as of noise, none at the end may exceed the
    next one. Runs of equal samples count once, so that a frozen reading is no clip.
    False alarms: below 1e-6 per side (Chernoff bound), Gaussian or sinusoidal.
    """
    if survey.channel.kind.integrated or survey.constant:
        return
    if 0 < survey.lattice.codes <= LEVELS:  # a log of few levels has all of them often: see quantisation
        return
    ends = (("largest", survey.high), ("smallest", survey.low))
    sides = [(end, e) for end, e in ends if _is_clipped(survey, e) and not _explained(survey, e)]
    if not sides:
        return
    share = max(int(e.samples[0]) for _, e in sides) / survey.present
    level = -normal_quantile(min(share, 0.5))
    fatal = level <= 3.25
    text = " and ".join(
        f"the {end} value {e.values[0] + survey.origin:.6g}{survey.unit} {e.samples[0]} times"
        for end, e in sides
    )
    yield finding(
        "clipping",
        f"{text}, as in Gaussian noise clipped at {level:.1f} standard deviations",
        severity=Severity.FATAL if fatal else Severity.WARNING,
        channel=survey.name,
        spans=spans_equal(
            survey,
            [float(e.values[0]) for _, e in sides],
            within=max(float(e.spread[0]) for _, e in sides),
        ),
        count=sum(int(e.samples[0]) for _, e in sides),
    )


def _explained(survey: ChannelSurvey, extreme: Extreme) -> bool:
    """Another finding speaks of that value: an integer's end, or exact zeros."""
    value = float(extreme.values[0]) + survey.origin
    if value == 0.0 and abs(survey.mean) > 6.0 * survey.sigma:
        return True
    return any(_is_rail(survey, e, r) and e is extreme for e, r in _rails(survey))


def _is_clipped(survey: ChannelSurvey, extreme: Extreme) -> bool:
    value, spread = float(extreme.values[0]), float(extreme.spread[0])
    step = max(survey.lattice.step or _float_spacing(survey, value), spread)
    if not _piled_up(extreme.values, extreme.runs, step):
        return False
    coarse = _step_around(survey, extreme)
    if coarse < 1.5 * step:
        return True
    code = np.abs(extreme.values - value) / coarse
    on = np.abs(code - np.rint(code)) < _OFF_STEPS
    return _piled_up(extreme.values[on], extreme.runs[on], coarse)


def _piled_up(values: NDArray[np.float64], runs: NDArray[np.int64], step: float) -> bool:
    """More runs stand at the outermost of these values than a falling density puts there."""
    if len(values) < 2 or runs[0] < 2:
        return False
    if _jumps(runs):
        return True
    for k in range(1, len(values)):
        width = abs(float(values[0] - values[k]))
        inside = 2.5 * step / (2.5 * step + width)
        if _tail(int(runs[0]) - 1, int(runs[: k + 1].sum()) - 1, inside) < 1e-6 / 7.0:
            return True
    return False


def _step_around(survey: ChannelSurvey, extreme: Extreme) -> float:
    """Step of the samples where the outermost value is reached: another range of a meter has another one."""
    spans = spans_equal(survey, [float(extreme.values[0])], within=float(extreme.spread[0]))
    steps: list[float] = []
    for place in spans[:: len(spans) // _PLACES + 1, 0]:
        near = survey.recording.raw(survey.name, max(place - _AROUND, 0), place + _AROUND)
        near = near[np.isfinite(near)]
        steps.append(lattice_among(np.unique(near), near, extreme.tolerance).step)
    return float(np.median(steps)) if steps else 0.0


def _jumps(runs: NDArray[np.int64]) -> bool:
    """The counts fall outwards and jump at the end, by six standard errors: of a vibration they rise all along."""
    if len(runs) < 3 or not runs[1] <= runs[2]:
        return False
    return bool(runs[0] - runs[1] > 6.0 * math.sqrt(float(runs[0] + runs[1])))


def _float_spacing(survey: ChannelSurvey, value: float) -> float:
    kind = survey.dtype if survey.dtype.kind == "f" else np.dtype(np.float64)
    return float(np.spacing(np.abs(kind.type(value))))


def _tail(hits: int, trials: int, p: float) -> float:
    """Chernoff's bound on the chance of so many hits or more in so many trials."""
    share = hits / trials
    if share <= p:
        return 1.0
    if p == 0.0:
        return 0.0
    divergence = share * math.log(share / p)
    if share < 1.0:
        divergence += (1.0 - share) * math.log((1.0 - share) / (1.0 - p))
    return math.exp(-trials * divergence)


def spans_equal(survey: ChannelSurvey, values: list[float], *, within: float = 0.0) -> Spans:
    """All runs of samples that have one of these values, or lie so close to it: one more pass over the channel."""
    runs = Runs()
    pairs: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    for start in range(0, survey.n_samples, BLOCK):
        block = survey.recording.raw(survey.name, start, start + BLOCK)
        mask = np.zeros(len(block), dtype=np.bool_)
        for value in values:
            mask |= np.abs(block - value) <= within if within > 0.0 else block == value
        pairs.append(runs.add(mask if mask.any() else None, start))
    pairs.append(runs.close(survey.n_samples))
    return np.concatenate([np.stack(pair, axis=1) for pair in pairs])


# -- nonsense ---------------------------------------------------------------------------------------------


def implausible_exponents(survey: ChannelSurvey) -> Iterator[Finding]:
    """Powers of two from one end to the other: the bytes are in the wrong order (battery B19).

    The middle 90 % of a Gaussian's magnitudes span 5 powers of two; 60 is far beyond any sensor.
    """
    values = np.abs(np.concatenate([values for _, values in survey.probes])) if survey.probes else np.zeros(0)
    values = values[(values > 0.0) & np.isfinite(values)]
    if len(values) < MINIMUM:
        return
    low, high = np.quantile(np.frexp(values)[1], [0.05, 0.95])
    if high - low > 60:
        wild = int(np.count_nonzero((values < 2.0**-100) | (values > OVERLOAD)))
        yield finding(
            "implausible_exponents",
            f"magnitudes from 2^{low:.0f} to 2^{high:.0f}; {wild} of {len(values)} tested samples are "
            "implausible for a sensor",
            severity=Severity.FATAL,
            channel=survey.name,
            count=survey.present,
        )


def only_grows(survey: ChannelSurvey) -> Iterator[Finding]:
    """Values that only grow, or fall: a time, a counter, an accumulated angle; no noise does that (class 1).

    Of noise one difference in two is negative; 2 % are where it drifts by three standard deviations from each sample to
    the next. A counter that wraps moves on by one and the same step.
    """
    if survey.channel.kind.integrated or survey.constant:
        return
    steps = np.concatenate([np.diff(values) for _, values in survey.probes]) if survey.probes else np.zeros(0)
    steps = steps[np.isfinite(steps)]
    if len(steps) < MINIMUM - 1 or np.count_nonzero(steps) < MOVES * len(steps):
        return
    sign = float(np.sign(np.median(steps)))
    usual = float(np.median(steps))
    alike = float(np.mean(np.abs(steps - usual) <= 1e-6 * abs(usual))) if usual else 0.0
    if float(np.mean(steps * sign > 0.0)) < ONE_WAY and alike < COUNTS_ON:
        return
    how = "grow" if sign > 0 else "fall"
    yield finding(
        "only_grows",
        f"the values only {how}, by {abs(usual):.4g}{survey.unit} from row to row: this is a time, a "
        "counter or an accumulated quantity, not a sensor at rest",
        severity=Severity.FATAL,
        channel=survey.name,
        count=survey.present,
    )
