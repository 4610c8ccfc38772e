# SPDX-License-Identifier: BSD-3-Clause
"""Findings about rows that hold no reading: zeros, words for "no value", and what all channels show there at once.

A reading differs from a word in its place. The density of noise falls outwards, so a value that noise reaches has
others beside it; a word stands alone, far from everything else. Where a channel lies at zero itself, only the row
tells: that all channels are exactly 0 at the same time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from allanite.plain_files.counted import listed
from allanite.recording.health.finding import Finding, Severity, finding, percent, plural
from allanite.recording.health.survey import ChannelSurvey, lattice_among
from allanite.recording.health.tallies import Extreme
from allanite.recording.health.values import MINIMUM, spans_equal
from allanite.recording.records import merge_spans

__all__ = ["MOSTLY", "fill_value", "shared_stretches", "shared_zeros", "zero_filled", "zero_rows"]

Samples = NDArray[np.float64]
Index = NDArray[np.int64]

#: Share left out beyond which the rest is not trusted either.
MOSTLY = 0.5
#: Distance of a word from the level, in units of the noise.
FAR = 8.0
#: The nearest readings (all but so many) keep this part of that distance, and so many steps, from the word.
STRAYS, APART, STEPS_APART = 0.002, 0.3, 2.5
#: How often a value other than 0 stands there before it is a word.
WORDS = 3
#: Rows of zeros in all channels are padding from so many times the number that chance makes, and so many.
BEYOND_CHANCE, ROWS = 10.0, 3
#: Share of the padded rows in which another channel must be 0 for them to be padding there as well.
ALSO = 0.9
#: Stretches of such rows that are read to see it.
ROWS_READ = 10_000


class _Word(NamedTuple):
    """A value that is no reading, and how far from the level it is [sigma]."""

    value: float
    distance: float


# -- one channel ------------------------------------------------------------------------------------------


def zero_filled(survey: ChannelSurvey) -> Iterator[Finding]:
    """Exact zeros far from the level: one, some here and there, the beginning, the tail (battery B16; class 4)."""
    word = _word(survey, -survey.origin)
    if word is not None:
        yield _of_word(survey, "zero_filled", word)


def fill_value(survey: ChannelSurvey) -> Iterator[Finding]:
    """One value far from all others, again and again: a word for "no value" such as -999 (class 4)."""
    for extreme in (survey.high, survey.low):
        if _stands_alone(extreme) and extreme.values[0] != -survey.origin:
            word = _word(survey, float(extreme.values[0]))
            if word is not None:
                yield _of_word(survey, "fill_value", word)


def _stands_alone(extreme: Extreme) -> bool:
    return bool(len(extreme.values) > 1 and extreme.samples[0] >= WORDS)


def _of_word(survey: ChannelSurvey, code: str, word: _Word) -> Finding:
    spans = spans_equal(survey, [word.value])
    count = int(np.diff(spans, axis=1).sum())
    share = count / survey.present
    level = float(np.median(_readings(survey, word.value))) + survey.origin
    return finding(
        code,
        f"{plural(count, 'sample')} ({percent(share)}) exactly {word.value + survey.origin:.9g}, {word.distance:.2g} "
        f"sigma from the level of {level:.4g}{survey.unit}: {', '.join(_where(survey, spans))}",
        severity=Severity.FATAL if share > MOSTLY else Severity.WARNING,
        channel=survey.name,
        spans=spans,
        weight=np.diff(spans, axis=1)[:, 0],
        excludes=True,
    )


def _where(survey: ChannelSurvey, spans: Index) -> list[str]:
    where = []
    if spans[0, 0] == 0:
        where.append(_end("first", int(spans[0, 1])))
    if spans[-1, 1] == survey.n_samples:
        where.append(_end("last", int(spans[-1, 1] - spans[-1, 0])))
    inner = len(spans) - len(where)
    return [*where, plural(inner, "stretch") + " within"] if inner else where


def _end(which: str, count: int) -> str:
    return f"the {which} sample" if count == 1 else f"the {which} {count} samples"


def _word(survey: ChannelSurvey, value: float) -> _Word | None:
    """The value as a word for "no value"; None where it may be a reading."""
    if survey.channel.kind.integrated or survey.constant or not _occurs(survey, value):
        return None
    rest = _readings(survey, value)
    if len(rest) < MINIMUM or len(np.unique(rest)) < 3:  # of two values neither is the odd one out
        return None
    low, level, high = np.quantile(rest, [0.16, 0.5, 0.84])
    step = lattice_among(np.unique(rest), rest, survey.high.tolerance).step
    spread = max(0.5 * float(high - low), _noise(survey, value), 0.5 * step)
    away = abs(float(level) - value)
    near = float(np.quantile(np.abs(rest - value), STRAYS))
    if spread == 0.0 or away < FAR * spread or near < max(APART * away, STEPS_APART * step):
        return None
    return _Word(value, away / spread)


def _occurs(survey: ChannelSurvey, value: float) -> bool:
    outer = np.concatenate([survey.high.values, survey.low.values])
    return bool((outer == value).any()) or any(bool((values == value).any()) for _, values in survey.probes)


def _readings(survey: ChannelSurvey, value: float) -> Samples:
    """The samples looked at that are there and are not this value."""
    values = np.concatenate([values for _, values in survey.probes])
    readings: Samples = values[(values != value) & np.isfinite(values)]
    return readings


def _noise(survey: ChannelSurvey, value: float) -> float:
    """Noise from sample to sample of the readings alone, deaf to outliers."""
    steps = np.concatenate([np.diff(values[values != value]) for _, values in survey.probes])
    size = np.abs(steps[np.isfinite(steps)])
    return float(np.median(size)) / (math.sqrt(2.0) * 0.6745) if len(size) else 0.0


# -- several channels -------------------------------------------------------------------------------------


def zero_rows(surveys: Sequence[ChannelSurvey], findings: Sequence[Finding]) -> Iterator[Finding]:
    """Rows in which every channel is exactly 0, oftener than the channels' own zeros meet by chance (class 4).

    Where a channel's own zeros were found, the others are looked at by `shared_zeros`.
    """
    if any(f.code == "zero_filled" for f in findings):
        return
    usable = [s for s in surveys if not s.channel.kind.integrated and not s.constant]
    if len(usable) < 2 or not any(z.all(axis=0).any() for z in _zeros_looked_at(usable)):
        return
    spans = [spans_equal(s, [-s.origin]) for s in usable]
    rows = spans[0]
    for other in spans[1:]:
        rows = _overlap(rows, other)
    n, count = usable[0].n_samples, _length(rows)
    alone = [max(_length(zeros) - count, 0) / n for zeros in spans]
    if count < max(ROWS, BEYOND_CHANCE * n * math.prod(alone)):
        return
    for s in usable:
        yield _together(
            s, "zero_filled", rows, f"exactly 0 in the rows where {listed([u.name for u in usable])} all are"
        )


def _zeros_looked_at(surveys: Sequence[ChannelSurvey]) -> Iterator[NDArray[np.bool_]]:
    for probes in zip(*(s.probes for s in surveys), strict=True):
        yield np.stack([values == -s.origin for (_, values), s in zip(probes, surveys, strict=True)])


def shared_zeros(surveys: Sequence[ChannelSurvey], findings: Sequence[Finding]) -> Iterator[Finding]:
    """Zeros of one channel that others show in the same rows, where their own values tell nothing."""
    rows, where = _rows_of("zero_filled", findings)
    for s in surveys:
        if not s.constant and not s.channel.kind.integrated:
            zeros = _zeros_in(s, rows)
            if len(zeros):
                yield _together(s, "zero_filled", zeros, f"exactly 0 in the rows where {where} also 0")


def shared_stretches(surveys: Sequence[ChannelSurvey], findings: Sequence[Finding]) -> Iterator[Finding]:
    """Readings that froze in one channel while others stood still as well."""
    rows, where = _rows_of("stuck", findings)
    for s in surveys:
        still = (
            [] if s.constant else [(a, b) for a, b in rows.tolist() if b - a > 1 and _stands_still(s, a, b)]
        )
        if still:
            yield _together(
                s, "stuck", np.array(still, dtype=np.int64), f"unchanged in the rows where {where} stuck"
            )


def _rows_of(code: str, findings: Sequence[Finding]) -> tuple[Index, str]:
    """The rows that findings of this code leave out, and their channels with a verb."""
    of_code = [f for f in findings if f.code == code]
    rows = merge_spans(np.concatenate([np.zeros((0, 2), dtype=np.int64), *(f.spans for f in of_code)]))
    names = sorted({str(f.channel) for f in of_code})
    return rows, f"{listed(names)} {'is' if len(names) == 1 else 'are'}"


def _together(survey: ChannelSurvey, code: str, spans: Index, what: str) -> Finding:
    count = _length(spans)
    share = count / survey.present
    verb, these = ("is", "this row holds") if count == 1 else ("are", "these rows hold")
    return finding(
        code,
        f"{plural(count, 'sample')} ({percent(share)}) {verb} {what}: {these} no reading",
        severity=Severity.FATAL if share > MOSTLY else Severity.WARNING,
        channel=survey.name,
        spans=spans,
        weight=np.diff(spans, axis=1)[:, 0],
        excludes=True,
    )


def _zeros_in(survey: ChannelSurvey, rows: Index) -> Index:
    """The rows in which the channel is 0, if it is in nearly all of those in which it has a value."""
    if len(rows) == 0:
        return rows
    there = sum(
        int(np.isfinite(survey.recording.raw(survey.name, a, b)).sum()) for a, b in rows[:ROWS_READ].tolist()
    )
    zeros = _overlap(rows, spans_equal(survey, [-survey.origin]))
    looked_at = zeros[zeros[:, 0] < rows[:ROWS_READ][-1, 1]]
    return zeros if there and _length(looked_at) >= ALSO * there else rows[:0]


def _stands_still(survey: ChannelSurvey, start: int, stop: int) -> bool:
    return not np.diff(survey.recording.raw(survey.name, start, stop)).any()  # NaN counts as a change


def _length(spans: Index) -> int:
    return int(np.diff(spans, axis=1).sum())


def _overlap(one: Index, other: Index) -> Index:
    """What two sets of sorted, disjoint spans have in common."""
    edges = np.unique(np.concatenate([one.ravel(), other.ravel()]))
    if len(edges) < 2:
        return edges.reshape(-1, 2)[:0]
    cells = np.stack([edges[:-1], edges[1:]], axis=1)
    return merge_spans(cells[_inside(cells[:, 0], one) & _inside(cells[:, 0], other)])


def _inside(position: Index, spans: Index) -> NDArray[np.bool_]:
    at = np.searchsorted(spans[:, 0], position, side="right") - 1
    return (
        (at >= 0) & (position < spans[np.maximum(at, 0), 1])
        if len(spans)
        else np.zeros(len(position), np.bool_)
    )
