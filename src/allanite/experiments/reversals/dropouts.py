# SPDX-License-Identifier: BSD-3-Clause
"""What dropouts hide: samples missing, an overload, a frozen reading, an excursion clipped both ways.

Settled, in this order, by

1. itself: an overload as long as a turn is one;
2. the sense of the turns beside it: where turns go back and forth, as a cable forces them to, two of the same sense
   have one between them;
3. the beat: where intervals are even, turns that are due and not seen were made in a dropout;
4. its length: an excursion clipped both ways is a turn if it is as long as turns are, and a gap no longer than a turn
   hides none, for in such a gap a whole turn would rarely fit by chance.

What remains is not settled: the direction after it is not known, unless the sense of the next turn tells it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.reversals.excursions import Dropout, SurveyedSignal
from allanite.experiments.reversals.turns import Disturbance, Turn
from allanite.lazy_dataclasses import dataclass

__all__ = ["LONGEST", "Beat", "beat_of", "goes_back_and_forth", "in_time", "senses", "settle"]

#: A turn by hand is no longer than this [s].
LONGEST = 10.0
#: A gap no longer than this in a record whose turns are in sight hides none [s].
TURN_LIKE = 4.0
#: Relative scatter up to which intervals are even.
EVEN = 0.15
#: Over more than so many intervals the beat is not trusted to count hidden turns.
COUNTABLE = 4
#: So many pairs of turns tell that they go back and forth: by chance in one record of 128.
PAIRS = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class Beat:
    """Typical interval between turns and its robust deviation [samples], and whether the intervals are even."""

    interval: float
    scatter: float
    even: bool

    @property
    def margin(self) -> float:
        """How far from its time a turn may come [samples]."""
        return min(max(0.1 * self.interval, 3.0 * self.scatter), 0.4 * self.interval)


def beat_of(turns: Sequence[Turn]) -> Beat | None:
    """The interval between turns; None with fewer than three of them."""
    return _beat(np.array([t.centre for t in turns])) if len(turns) >= 3 else None


def _beat(centres: NDArray[np.float64]) -> Beat:
    gaps = np.diff(centres)
    interval = float(np.median(gaps))
    scatter = 1.4826 * float(np.median(np.abs(gaps - interval)))
    return Beat(interval=interval, scatter=scatter, even=len(gaps) >= 3 and scatter <= EVEN * interval)


def in_time(centres: Sequence[float]) -> bool:
    """At least six events a whole number of intervals apart, nearly all of them: knocks at random are not.

    Within 0.15 of a whole number lie 30 % of random intervals: five of them in a row happen in 0.2 % of records.
    """
    if len(centres) < 6:
        return False
    beat = _beat(np.sort(np.array(centres, dtype=np.float64)))
    beats = np.diff(np.sort(centres)) / beat.interval
    near = np.abs(beats - np.maximum(np.round(beats), 1.0)) <= EVEN
    return beat.even and float(near.mean()) >= 0.9


def senses(
    turns: Sequence[Turn], disturbed: Sequence[Disturbance], dropouts: Sequence[Dropout]
) -> list[list[float]]:
    """Senses (+1, -1) of the half turns that follow each other with no dropout in between."""
    breaks = sorted([d.start for d in dropouts] + [d.start for d in disturbed if d.hides])
    runs: list[list[float]] = [[]]
    last = 0
    for t in turns:
        interrupted = int(np.searchsorted(breaks, t.start)) != int(np.searchsorted(breaks, last))
        half = t.change == math.pi and not math.isnan(t.angle)
        if interrupted or not half:
            runs.append([])
        if half:
            runs[-1].append(math.copysign(1.0, t.angle))
        last = t.start
    return runs


def goes_back_and_forth(runs: Sequence[Sequence[float]]) -> bool:
    """The turns go back and forth, all of them, in at least seven pairs.

    An operator who turns either way at random does that in one record of 128 or fewer; one who always turns the
    same way is told apart by the first pair.
    """
    pairs = [a * b for run in runs for a, b in zip(run, run[1:], strict=False)]
    return len(pairs) >= PAIRS and max(pairs) < 0.0


def settle(
    surveyed: SurveyedSignal,
    visible_turns: Sequence[Turn],
    disturbed: Sequence[Disturbance],
    dropouts: Sequence[Dropout],
) -> tuple[tuple[Turn, ...], tuple[Dropout, ...], tuple[Dropout, ...]]:
    """Turns hidden in dropouts; stretches that hide none; stretches that nothing settles."""
    overloads = [d for d in dropouts if d.kind == "overload" and d.stop - d.start <= LONGEST * surveyed.rate]
    if not visible_turns and len(overloads) < 2:
        overloads = []  # a single one is as well a fault of the meter
    hidden = [_hidden(d, 1, "out of range for as long as a turn") for d in overloads]
    rest = [d for d in dropouts if d not in overloads]
    if not visible_turns and not hidden:
        in_beat = _in_beat(surveyed, rest)
        hidden = [_hidden(d, 1, "out of sight at even intervals") for d in in_beat]
        rest = [d for d in rest if d not in in_beat]
    if not visible_turns and not hidden:  # a sensor at rest: nothing is hidden
        return (), tuple(rest), ()
    turns = sorted([*visible_turns, *hidden], key=lambda t: t.start)
    night = _Night(
        surveyed=surveyed,
        turns=turns,
        rest=rest,
        beat=beat_of(turns),
        returning=goes_back_and_forth(senses(turns, disturbed, dropouts)),
    )
    counts = [night.count(d) for d in rest]
    hidden += [_hidden(d, n, _why(d, n)) for d, n in zip(rest, counts, strict=True) if n]
    none = tuple(d for d, n in zip(rest, counts, strict=True) if n == 0)
    return tuple(hidden), none, tuple(d for d, n in zip(rest, counts, strict=True) if n is None)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Night:
    """The dropouts of a record among its turns."""

    surveyed: SurveyedSignal
    turns: Sequence[Turn]
    rest: Sequence[Dropout]
    beat: Beat | None
    returning: bool

    def count(self, dropout: Dropout) -> int | None:
        """Turns hidden in a dropout, or None where nothing tells."""
        before, after = self._beside(dropout)
        clipped = dropout.kind == "clipped"
        if self.returning and before and after and not math.isnan(before.angle + after.angle):
            opposite = before.angle * after.angle < 0.0
            if self._short(dropout) and (self._alone(before, after) or (opposite and not clipped)):
                return int(not opposite)
            if not clipped:
                return None  # the sense of the next turn tells the direction after it
        if self.beat and self.beat.even:
            due = self._due(before, after, self.beat.interval)
            if due and not after and dropout.stop > self.surveyed.n_samples - 0.3 * self.beat.interval:
                return None  # the last dwell is often cut short: what little follows has no direction
            if due is not None:
                return self._made(dropout, due, self.beat.margin)
        if clipped:
            usual = float(np.median([t.stop - t.start for t in self.turns]))
            return int(dropout.stop - dropout.start >= 0.5 * usual)
        return 0 if self._short(dropout) and not self._often() else None

    def _beside(self, dropout: Dropout) -> tuple[Turn | None, Turn | None]:
        at = int(np.searchsorted([t.start for t in self.turns], dropout.start))
        return (self.turns[at - 1] if at else None), (self.turns[at] if at < len(self.turns) else None)

    def _short(self, dropout: Dropout) -> bool:
        return dropout.stop - dropout.start <= TURN_LIKE * self.surveyed.rate

    def _alone(self, before: Turn, after: Turn) -> bool:
        return sum(before.stop <= d.start < after.start for d in self.rest) == 1

    def _often(self) -> bool:
        """Gaps as long as turns are about as frequent as turns: some of them may be turns."""
        gaps = sum(d.kind != "clipped" and self._short(d) for d in self.rest)
        return gaps >= max(3, len(self.turns) // 4)

    def _due(self, before: Turn | None, after: Turn | None, interval: float) -> list[float] | None:
        """Times [samples] between two turns in sight at which turns are due; None where the beat does not tell.

        The first dwell of a record is rarely cut short: none is due within 0.3 intervals of the beginning.
        """
        if before and after:
            span = after.centre - before.centre
            steps = round(span / interval)
            if not 1 <= steps <= COUNTABLE or abs(span / interval - steps) > 0.3:
                return None
            return [before.centre + span * j / steps for j in range(1, steps)]
        room = self.surveyed.n_samples - before.centre if before else after.centre if after else math.inf
        if room > (COUNTABLE + 0.5) * interval:
            return None
        steps = math.ceil(room / interval)
        if before:
            return [before.centre + interval * j for j in range(1, steps)]
        times = [room - interval * j for j in range(1, steps)]
        return [t for t in times if t > 0.3 * interval]

    def _made(self, dropout: Dropout, due: Sequence[float], margin: float) -> int | None:
        """How many of the turns that are due were made in this dropout; None if it may as well be another."""
        rivals = [d for d in self.rest if d is not dropout]
        count = 0
        for time in due:
            if not _covers(dropout, time, margin):
                continue
            near = [d for d in rivals if _covers(d, time, margin)]
            if near and dropout.kind != "clipped":  # of a gap and an excursion, the excursion is the turn
                if any(d.kind == "clipped" for d in near):
                    continue
                return None
            count += 1
        return count


def _covers(dropout: Dropout, time: float, margin: float) -> bool:
    return dropout.start - margin <= time <= dropout.stop + margin


def _in_beat(surveyed: SurveyedSignal, dropouts: Sequence[Dropout]) -> list[Dropout]:
    """Dropouts as long as turns, at even intervals: all turns were out of range."""
    like = [
        d
        for d in dropouts
        if d.kind in ("missing", "clipped") and d.stop - d.start <= TURN_LIKE * surveyed.rate
    ]
    return like if in_time([0.5 * (d.start + d.stop) for d in like]) else []


def _hidden(dropout: Dropout, count: int, why: str) -> Turn:
    return Turn(
        start=dropout.start, stop=dropout.stop, change=math.pi * (count % 2), clipped=True, evidence=why
    )


def _why(dropout: Dropout, count: int) -> str:
    what = {"stuck": "the reading is frozen", "clipped": "the signal is clipped both ways"}.get(
        dropout.kind, "samples are missing"
    )
    return f"{what} where {'a turn' if count == 1 else f'{count} turns'} must have been"
