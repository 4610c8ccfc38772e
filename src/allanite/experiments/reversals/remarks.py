# SPDX-License-Identifier: BSD-3-Clause
"""What is worth knowing about the turns that were found: findings, with the times at which to look."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.reversals.excursions import SurveyedSignal
from allanite.experiments.reversals.judgement import TurnJudgement
from allanite.experiments.reversals.turned_over import TurnedOver
from allanite.experiments.reversals.turns import Disturbance, Position, Turn
from allanite.recording.health.finding import PLACES, Finding, Severity, plural
from allanite.recording.records import merge_spans

__all__ = ["off_schedule", "remarks", "times"]

Part = Turn | Disturbance | Position

#: Positions so many times longer or shorter than the usual one are named, where the intervals are even.
MISSED, DOUBLED = 1.6, 0.5
#: A turn so far from a whole number of half turns is named.
UNLIKE = math.radians(30.0)

#: A shift of a list is looked for where this share of its turns, of so many at least, is not in the signal, and is told
#: where this share would be: each of the first few is tried against all visible ones up to [s], and agrees within [s].
_UNSEEN, _FEWEST, _AGREED, _FIRST, _FURTHEST, _NEAR = 0.5, 4, 0.9, 8, 120.0, 1.0

_GIVE_TURNS = "give the turns: --turns FILE, or --dwell SECONDS"


def remarks(
    surveyed: SurveyedSignal,
    judgement: TurnJudgement,
    positions: Sequence[Position],
    over: TurnedOver | None = None,
) -> tuple[Finding, ...]:
    """All findings about turns read off the signal; `over` is what accelerometers say of them."""
    made = (
        *_of_mode(surveyed, judgement, over),
        *_of_angle(surveyed, judgement),
        *_of_rhythm(surveyed, judgement, positions),
        *_of_dropouts(surveyed, judgement, positions),
        *_of_disturbances(surveyed, judgement),
    )
    return tuple(sorted(made, key=lambda f: f.severity.rank))


def _of_mode(
    surveyed: SurveyedSignal, judgement: TurnJudgement, over: TurnedOver | None
) -> Iterator[Finding]:
    turns = judgement.turns
    if judgement.scale.mode == "size":
        why = "without a physical unit their angle is unknown"
        if surveyed.physical:
            half = math.degrees(judgement.scale.half)
            why = f"they agree with each other at {half:.3g} deg, not with half turns of 180 deg"
        advice = (
            "none needed if the gyro was turned about an axis across its own, which it hardly senses. Otherwise check "
            "unit, scale factor and channel, or " + _give_turns(surveyed, judgement)
        )
        if over is not None:
            why += f"; {over.says}: the sensor was turned over, which a gyro across that turn hardly senses"
            upright = "" if over.along else "if the gyro axis was vertical, "
            ways = f"--first {over.first}" if over.along else "--first up or --first down"
            advice = f"none needed for the turns; {upright}state where it pointed first: {ways}"
        yield _finding(
            surveyed,
            "turns_by_size",
            f"{plural(len(turns), 'turn')} identified by size: {why}",
            Severity.WARNING if surveyed.physical and over is None else Severity.INFO,
            turns[:1],
            len(turns),
            advice,
            "if these excursions are not half turns, the directions are wrong",
        )
    elif judgement.scale.mode == "rhythm":
        yield _finding(
            surveyed,
            "turns_by_rhythm",
            f"{plural(len(turns), 'turn')} identified by even intervals alone: the excursions give no angle",
            Severity.WARNING,
            turns[:1],
            len(turns),
            _give_turns(surveyed, judgement),
            "a knock in time with the turns would be counted as one and reverse the direction",
        )


def _give_turns(surveyed: SurveyedSignal, judgement: TurnJudgement) -> str:
    """Where the turns are even, their interval is that of the signal."""
    beat = judgement.beat
    if beat is None or not beat.even:
        return _GIVE_TURNS
    return f"give the turns: --turns FILE, or --dwell {beat.interval / surveyed.rate:.3g} for even ones"


def _of_angle(surveyed: SurveyedSignal, judgement: TurnJudgement) -> Iterator[Finding]:
    odd = [
        t
        for t in judgement.turns
        if not math.isnan(t.angle)
        and not t.clipped
        and judgement.scale.mode == "angle"
        and (t.change != math.pi or abs(abs(t.angle) - math.pi) > UNLIKE)
    ]
    if odd:
        named = ", ".join(f"{math.degrees(t.angle):+.0f} deg at {_second(surveyed, t)}" for t in odd[:PLACES])
        yield _finding(
            surveyed,
            "turn_unlike",
            f"{plural(len(odd), 'turn')} of other than 180 deg: {named}{_and_more(odd)}",
            Severity.WARNING,
            odd,
            len(odd),
            "after a quarter turn the direction is unknown until the turn is undone or completed",
            "an incomplete turn misaligns the axis: the rate reads too small",
        )
    clipped = [t for t in judgement.turns if t.clipped and t not in judgement.hidden]
    if clipped:
        yield _finding(
            surveyed,
            "turns_clipped",
            f"{len(clipped)} of {plural(len(judgement.turns), 'turn')} beyond the range of the converter: "
            "their angle is a lower bound",
            Severity.INFO,
            clipped,
            len(clipped),
            "none needed; turn more slowly or choose a wider range to have the angles checked",
            "",
        )


def _of_rhythm(
    surveyed: SurveyedSignal, judgement: TurnJudgement, positions: Sequence[Position]
) -> Iterator[Finding]:
    beat = judgement.beat
    if beat is None or not beat.even or len(positions) < 4:
        return
    turned = judgement.turns[0].stop - judgement.turns[0].start
    inner = [p for p in positions[1:-1] if p.segment == positions[0].segment]
    long = [p for p in inner if p.stop - p.start + turned > MISSED * beat.interval]
    short = [p for p in inner if p.stop - p.start + turned < DOUBLED * beat.interval]
    usual = f"{beat.interval / surveyed.rate:.3g} s"
    if long:
        yield _finding(
            surveyed,
            "turn_missed",
            f"{plural(len(long), 'dwell')} much longer than the usual {usual}, at {times(surveyed.rate, long)}: the "
            "operator may have missed a turn",
            Severity.INFO,
            long,
            len(long),
            "none needed: the direction is counted by the turns that were made",
            "a turn that left no trace in the signal would reverse the direction from there on",
        )
    if short:
        yield _finding(
            surveyed,
            "turn_doubled",
            f"{plural(len(short), 'dwell')} much shorter than the usual {usual}, at {times(surveyed.rate, short)}: "
            "turned twice, or one of them is not a turn",
            Severity.WARNING,
            short,
            len(short),
            "compare with your notes; " + _give_turns(surveyed, judgement),
            "if one of the two was no half turn, the direction is reversed from there on",
        )


def _of_dropouts(
    surveyed: SurveyedSignal, judgement: TurnJudgement, positions: Sequence[Position]
) -> Iterator[Finding]:
    hidden = judgement.hidden
    if hidden:
        yield _finding(
            surveyed,
            "turn_hidden",
            f"{plural(len(hidden), 'turn')} not visible but inferred from the others, at "
            f"{times(surveyed.rate, hidden)}: {hidden[0].evidence}",
            Severity.WARNING,
            hidden,
            len(hidden),
            "compare with your notes; " + _give_turns(surveyed, judgement),
            "if it was no turn, the direction is reversed from there on",
        )
    hiding = [d for d in judgement.disturbed if d.hides]
    lost = [p for p in positions if p.sign == 0 and p.segment > 0]
    if hiding:
        span = sum(p.stop - p.start for p in lost) / surveyed.rate
        after = (
            f"the direction of {span:.0f} s after it is unknown"
            if lost
            else "the sense of later turns gives the direction"
        )
        yield _finding(
            surveyed,
            "direction_unknown",
            f"{plural(len(hiding), 'stretch')} may hide a turn, at {times(surveyed.rate, hiding)} "
            f"({hiding[0].kind}, {(hiding[0].stop - hiding[0].start) / surveyed.rate:.3g} s): {after}",
            Severity.WARNING if lost else Severity.INFO,
            hiding,
            len(hiding),
            _give_turns(surveyed, judgement),
            "a wrong guess of the direction would cancel one half of the record against the other",
        )
    if judgement.settled and judgement.turns:
        yield _finding(
            surveyed,
            "gap_without_turn",
            f"{plural(len(judgement.settled), 'stretch')} without readings, assumed to hide no turn, at "
            f"{', '.join(f'{d.start / surveyed.rate:.1f} s' for d in judgement.settled[:PLACES])}"
            f"{_and_more(judgement.settled)}",
            Severity.INFO,
            [Disturbance(start=d.start, stop=d.stop, kind=d.kind) for d in judgement.settled],
            len(judgement.settled),
            "compare with your notes",
            "if a turn was made there, the direction is reversed from there on",
        )


def _of_disturbances(surveyed: SurveyedSignal, judgement: TurnJudgement) -> Iterator[Finding]:
    knocks = [d for d in judgement.disturbed if d.kind in ("knock", "handling") and not d.hides]
    if knocks:
        longest = max((d.stop - d.start) / surveyed.rate for d in knocks)
        yield _finding(
            surveyed,
            "dwell_disturbed",
            f"{plural(len(knocks), 'disturbance')}, no turn, at {times(surveyed.rate, knocks)}, the longest "
            f"{longest:.2g} s: cut out of the dwells",
            Severity.INFO,
            knocks,
            len(knocks),
            "none needed; with --turns the file decides what they are",
            "",
        )
    stuck = [d for d in judgement.disturbed if d.kind == "stuck"]
    if stuck:
        yield _finding(
            surveyed,
            "dwell_stuck",
            f"{plural(len(stuck), 'stretch')} of one repeated value, at {times(surveyed.rate, stuck)}: left out of "
            "the dwells",
            Severity.WARNING,
            stuck,
            len(stuck),
            "find out why the reading froze",
            "a frozen reading pulls the mean of its dwell toward one sample",
        )


def off_schedule(
    surveyed: SurveyedSignal, turns: Sequence[Turn], visible_turns: Sequence[Turn]
) -> Iterator[Finding]:
    """Turns that a file or a period gives and the signal contradicts, and the other way round."""
    given = merge_spans(np.array([(t.start, t.stop) for t in turns], dtype=np.int64).reshape(-1, 2))
    visible_spans = merge_spans(
        np.array([(t.start, t.stop) for t in visible_turns], dtype=np.int64).reshape(-1, 2)
    )
    extra = [t for t in visible_turns if not _touches(t, given)]
    if extra:
        yield _finding(
            surveyed,
            "turn_not_listed",
            f"{plural(len(extra), 'turn')} in the signal but not in the list, at "
            f"{times(surveyed.rate, extra)}: cut out, without a change of direction",
            Severity.WARNING,
            extra,
            len(extra),
            "compare list and signal: is a turn missing, is the period right, does the time start with the record?",
            "if these were turns, the direction is reversed from there on",
        )
    unseen = [t for t in turns if not _touches(t, visible_spans)]
    if unseen and len(visible_turns) > 0:
        yield _finding(
            surveyed,
            "turn_not_seen",
            f"{len(unseen)} of {plural(len(turns), 'turn')} in the list but not in the signal, at "
            f"{times(surveyed.rate, unseen)}{_if_shifted(surveyed.rate, unseen, visible_turns, len(turns))}",
            Severity.WARNING,
            unseen,
            len(unseen),
            "compare list and signal; without a list the turns come from the signal",
            "if the sensor was not turned there, the direction is reversed from there on",
        )


def _if_shifted(rate: float, unseen: Sequence[Turn], visible_turns: Sequence[Turn], listed: int) -> str:
    """Whether the list agrees once all its times are shifted: it was kept by another clock, or from another zero."""
    if len(unseen) < max(_UNSEEN * listed, _FEWEST):
        return ""
    given = np.array([t.start + t.stop for t in unseen]) / (2 * rate)
    visible = np.sort([t.start + t.stop for t in visible_turns]) / (2 * rate)
    apart = visible - given[:_FIRST, None]
    shifts = apart[np.abs(apart) <= _FURTHEST]
    agree = [_agreeing(given + shift, visible) for shift in shifts]
    if not agree or max(agree) < _AGREED * len(unseen):
        return ""
    # Turns at even intervals agree at many shifts: the smallest is the most likely.
    shift = min((s for s, n in zip(shifts, agree, strict=True) if n == max(agree)), key=abs)
    direction = "earlier" if shift < 0 else "later"
    return f"; if all its times were {abs(shift):.1f} s {direction}, {max(agree)} of these {len(unseen)} would agree"


def _agreeing(given: NDArray[np.float64], visible: NDArray[np.float64]) -> int:
    after = np.clip(np.searchsorted(visible, given), 1, max(len(visible) - 1, 1))
    nearest = np.minimum(
        np.abs(visible[after - 1] - given), np.abs(visible[np.minimum(after, len(visible) - 1)] - given)
    )
    return int(np.sum(nearest < _NEAR))


def times(rate: float, parts: Sequence[Part]) -> str:
    """When the first few of them were: "12.5 s, 44.0 s and 3 more"."""
    return ", ".join(f"{p.start / rate:.1f} s" for p in parts[:PLACES]) + _and_more(parts)


def _touches(turn: Turn, spans: NDArray[np.int64]) -> bool:
    near = int(np.searchsorted(spans[:, 1], turn.start, side="right"))
    return near < len(spans) and bool(spans[near, 0] < turn.stop)


def _second(surveyed: SurveyedSignal, part: Part) -> str:
    return f"{part.start / surveyed.rate:.1f} s"


def _and_more(parts: Sequence[object]) -> str:
    return f" and {len(parts) - PLACES} more" if len(parts) > PLACES else ""


def _finding(
    surveyed: SurveyedSignal,
    code: str,
    message: str,
    severity: Severity,
    parts: Sequence[Part],
    count: int,
    advice: str,
    risk: str,
) -> Finding:
    return Finding(
        code=code,
        severity=severity,
        channel=surveyed.channel,
        message=message,
        advice=advice,
        risk=risk,
        count=count,
        places=tuple((p.start, p.stop) for p in parts[:PLACES]),
        spans=merge_spans(np.array([(p.start, p.stop) for p in parts], dtype=np.int64).reshape(-1, 2)),
    )
