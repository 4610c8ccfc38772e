# SPDX-License-Identifier: BSD-3-Clause
"""Turns from a period or a file, held against the signal.

A clock and a notebook are right about how often and how often not, and wrong by a second about when. So a turn that
is listed takes in the excursion that it touches, an excursion that belongs to no turn of the list is cut out of its
dwell, and where list and signal contradict each other a finding says so. The direction follows the list alone.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from allanite.errors import InputError
from allanite.experiments.reversals.detection import channel_of, heading_of
from allanite.experiments.reversals.excursions import SurveyedSignal, survey
from allanite.experiments.reversals.judgement import TurnJudgement, judge, positions_of
from allanite.experiments.reversals.listing import read_listing
from allanite.experiments.reversals.remarks import off_schedule
from allanite.experiments.reversals.sides import checked_first, direction_of
from allanite.experiments.reversals.turns import (
    DEAD_TIME,
    GUARD,
    Disturbance,
    Position,
    Reversals,
    Turn,
    checked_dead_time,
    sign_of,
)
from allanite.recording.health.finding import Finding
from allanite.recording.records import Recording

__all__ = ["periodic_reversals", "placed", "read_positions", "read_turns"]

#: Length of a turn that nobody states [s].
TURN = 2.0
#: A turn by the clock and one in the signal belong together up to this distance [s].
SLACK = 2.0
#: The signal sets the period only within this share of what the user says.
TOLERANCE = 0.15


def periodic_reversals(
    recording: Recording,
    *,
    dwell: float,
    turn: float = TURN,
    phase: float | None = None,
    channel: str | None = None,
    first: str | None = "north",
    dead_time: float = DEAD_TIME,
) -> Reversals:
    """Turns at even times, for records whose signal does not show them (or not all).

    Parameters
    ----------
    dwell : float [s]
        From the beginning of one turn to the beginning of the next: "turned every 30 s".
    turn : float [s]
        Time that a turn takes.
    phase : float, optional [s]
        Beginning of the first turn after the first sample. By default it is taken from the turns that the signal
        shows, together with the true period where it is within 15 % of `dwell`; else the first turn comes one dwell
        after the start.
    channel, first, dead_time
        See `find_reversals`.

    Raises
    ------
    InputError
        A time that is not positive, a turn as long as the dwell, or no turn within the record.
    DataQualityError
        The channel holds no samples.

    Examples
    --------
    >>> periodic_reversals(recording, dwell=30.0, first="south")  # doctest: +SKIP
    """
    for what, value in (("dwell", dwell), ("turn", turn)):
        if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0):
            raise InputError(f"{what} must be positive seconds, not {value!r}")
    if turn >= dwell:
        raise InputError(f"a turn of {turn:g} s leaves nothing of a dwell of {dwell:g} s")
    if phase is not None and not (math.isfinite(phase) and phase >= 0.0):
        raise InputError(f"phase must be seconds after the first sample, not {phase!r}")
    surveyed = survey(recording, channel_of(recording, channel))
    judgement = judge(surveyed)
    period = dwell * recording.rate
    begin = period if phase is None else phase * recording.rate
    fitted = _fitted(judgement.turns, period) if phase is None else None
    begin, period = fitted or (begin, period)
    starts = np.arange(begin, recording.n_samples - GUARD * recording.rate, period)
    if len(starts) == 0:
        raise InputError(f"no turn every {dwell:g} s falls into a record of {recording.duration:g} s")
    length = turn * recording.rate
    why = "every {:.5g} s{}".format(period / recording.rate, ", in step with the signal" if fitted else "")
    turns = [
        Turn(start=round(a), stop=min(round(a + length), recording.n_samples), evidence=why)
        for a in starts.tolist()
    ]
    return _listed(
        recording,
        surveyed,
        judgement,
        turns,
        "period",
        first,
        dead_time,
        widen=bool(fitted) or phase is not None,
    )


def read_turns(
    path: str | os.PathLike[str],
    recording: Recording,
    *,
    channel: str | None = None,
    first: str | None = "north",
    dead_time: float = DEAD_TIME,
) -> Reversals:
    """Turns from a file.

    Parameters
    ----------
    path : path
        Text with a heading: ``start,stop`` or ``time`` in seconds since the first sample (``start [min]`` and such
        are understood). A turn without a stop takes 2 s, or as long as the signal shows.
    channel, first, dead_time
        See `find_reversals`.

    Raises
    ------
    FormatError
        A column is missing, a cell is no number; the message names the line.
    InputError
        Turns out of order, overlapping, or outside of the record.

    Examples
    --------
    >>> read_turns("turns.csv", recording, first="north")  # doctest: +SKIP
    """
    listing = read_listing(path, {"start": ("time", "t", "begin")}, {"stop": ("end",)})
    spans = listing.spans(recording, default=TURN)
    surveyed = survey(recording, channel_of(recording, channel))
    turns = [Turn(start=a, stop=b, evidence=f"line {line} of the file") for line, a, b in spans]
    return _listed(recording, surveyed, judge(surveyed), turns, "file", first, dead_time, widen=True)


def read_positions(
    path: str | os.PathLike[str],
    recording: Recording,
    *,
    channel: str | None = None,
    dead_time: float = DEAD_TIME,
) -> Reversals:
    """Positions with their headings from a file.

    Parameters
    ----------
    path : path
        Text with the columns ``start,stop`` [s since the first sample] and ``heading`` [deg from north over east],
        and ``name`` if wanted; ``heading [rad]`` is understood.
    channel : str, optional
        Whose signal is searched for knocks and frozen readings; without it and with several gyro channels, none.
    dead_time : float [s]
        Counted from the start of each position but one that begins with the record.

    Raises
    ------
    FormatError
        A column is missing, a cell is no number; the message names the line.
    InputError
        Positions out of order, overlapping, or outside of the record.

    Examples
    --------
    >>> read_positions("positions.csv", recording).table()  # doctest: +SKIP
    """
    listing = read_listing(
        path,
        {"start": ("begin",), "stop": ("end",), "heading": ("azimuth", "direction")},
        {},
        texts=("name",),
    )
    spans = [(a, b) for _, a, b in listing.spans(recording)]
    surveyed = _survey_if_clear(recording, channel)
    headings, names = listing.numbers("heading"), listing.texts("name")
    return placed(recording, spans, headings, names, dead_time=dead_time, surveyed=surveyed)


def placed(
    recording: Recording,
    spans: Sequence[tuple[int, int]],
    headings: Sequence[float],
    names: Sequence[str],
    *,
    dead_time: float = DEAD_TIME,
    guard: float = GUARD,
    surveyed: SurveyedSignal | None = None,
) -> Reversals:
    """Positions from their spans [samples] and headings [rad], held against the signal where that was surveyed."""
    relative = [_relative(h, 0.0) for h in headings]
    positions = tuple(
        Position(start=a, stop=b, heading=h, sign=sign_of(h), relative=_relative(h, relative[0]), name=name)
        for (a, b), h, name in zip(spans, relative, names, strict=True)
    )
    turns = tuple(
        Turn(
            start=p.stop,
            stop=q.start,
            change=_relative(q.heading, p.heading),
            evidence="between two positions",
        )
        for p, q in zip(positions, positions[1:], strict=False)
    )
    judgement = judge(surveyed) if surveyed else None
    return Reversals.cut(
        rate=recording.rate,
        n_samples=recording.n_samples,
        turns=turns,
        positions=positions,
        disturbed=_rest(judgement, turns) if judgement else (),
        source="file",
        first=checked_first(direction_of(None, positions[0].sign)),
        dead_time=checked_dead_time(dead_time),
        guard=guard,
        findings=_contradictions(surveyed, judgement, positions, turns) if surveyed and judgement else (),
    )


# -- list and signal --------------------------------------------------------------------------------------


def _listed(
    recording: Recording,
    surveyed: SurveyedSignal,
    judgement: TurnJudgement,
    given: Sequence[Turn],
    source: str,
    first: str | None,
    dead_time: float,
    *,
    widen: bool,
) -> Reversals:
    """Reversals whose directions follow a list, and whose edges follow the signal."""
    start = checked_first(first)
    turns = _widened(given, surveyed, judgement) if widen else tuple(given)
    disturbed = _rest(judgement, turns)
    positions = positions_of(turns, (), surveyed.n_samples, first=heading_of(start), returning=False)
    return Reversals.cut(
        rate=recording.rate,
        n_samples=recording.n_samples,
        turns=turns,
        positions=positions,
        disturbed=disturbed,
        source="period" if source == "period" else "file",
        first=start,
        dead_time=dead_time,
        findings=tuple(
            off_schedule(surveyed, turns, [t for t in judgement.turns if t not in judgement.hidden])
        ),
    )


def _fitted(turns: Sequence[Turn], period: float) -> tuple[float, float] | None:
    """Beginning and period [samples] of the even grid through the turns of the signal; None if there is none.

    A turn number is given to each by the interval to the one before, so that missed turns and hidden ones do no
    harm, and a line is put through them by its median slope.
    """
    if len(turns) < 3:
        return None
    starts = np.array([t.start for t in turns], dtype=np.float64)
    gaps = np.diff(starts)
    steps = np.maximum(np.round(gaps / period), 1.0)
    each = float(np.median(gaps / steps))
    if abs(each / period - 1.0) > TOLERANCE:
        return None
    numbers = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(gaps / each), 1.0))])
    each = float(np.polyfit(numbers, starts, 1)[0])
    begin = float(np.median(starts - numbers * each))
    if float(np.median(np.abs(starts - numbers * each - begin))) > 0.1 * period:
        return None
    return begin - each * math.floor(begin / each), each


def _widened(given: Sequence[Turn], surveyed: SurveyedSignal, judgement: TurnJudgement) -> tuple[Turn, ...]:
    """Each turn together with the excursion that it touches, or that is within two seconds; no excursion twice."""
    slack = SLACK * surveyed.rate
    excursions: list[Turn | Disturbance] = [
        *judgement.turns,
        *(d for d in judgement.disturbed if d.kind == "knock"),
    ]
    excursions.sort(key=lambda s: s.start)
    starts = np.array([s.start for s in excursions], dtype=np.int64)
    stops = np.array([s.stop for s in excursions], dtype=np.int64)
    out: list[Turn] = []
    for i, t in enumerate(given):
        after = given[i + 1].start if i + 1 < len(given) else surveyed.n_samples
        before = out[-1].stop if out else 0
        a, b = int(np.searchsorted(stops, t.start - slack)), int(np.searchsorted(starts, t.stop + slack))
        near = [s for s in excursions[a:b] if s.start >= before and s.stop <= after]
        turned = [s for s in near if isinstance(s, Turn)]
        closest = min(turned, key=lambda s: abs(s.centre - t.centre), default=None)
        touched = [s for s in near if s is closest or (s.start < t.stop and s.stop > t.start)]
        out.append(
            replace(
                t,
                start=min([t.start, *(s.start for s in touched)]),
                stop=max([t.stop, *(s.stop for s in touched)]),
                angle=closest.angle if closest else math.nan,
                clipped=closest.clipped if closest else False,
            )
        )
    return tuple(out)


def _rest(judgement: TurnJudgement, turns: Sequence[Turn]) -> tuple[Disturbance, ...]:
    """Everything in the signal that belongs to no turn of the list."""
    starts, stops = [t.start for t in turns], [t.stop for t in turns]
    out = []
    parts: list[Turn | Disturbance] = [
        *(t for t in judgement.turns if t not in judgement.hidden),
        *judgement.disturbed,
    ]
    for part in parts:
        i = int(np.searchsorted(stops, part.start, side="right"))
        inside = i < len(turns) and starts[i] <= part.start and part.stop <= stops[i]
        if not inside and not (isinstance(part, Disturbance) and part.kind == "missing"):
            kind = part.kind if isinstance(part, Disturbance) else "turn"
            out.append(Disturbance(start=part.start, stop=part.stop, kind=kind))
    return tuple(sorted(out, key=lambda d: d.start))


def _survey_if_clear(recording: Recording, channel: str | None) -> SurveyedSignal | None:
    if channel is None:
        try:
            channel = channel_of(recording, None)
        except InputError:  # several axes: their knocks are looked for when one is chosen
            return None
    return survey(recording, channel_of(recording, channel))


def _contradictions(
    surveyed: SurveyedSignal, judgement: TurnJudgement, positions: Sequence[Position], turns: Sequence[Turn]
) -> tuple[Finding, ...]:
    """What the signal shows between the first position and the last, and the list does not."""
    begin, end = positions[0].start, positions[-1].stop
    inside = [t for t in judgement.turns if begin <= t.start and t.stop <= end and t not in judgement.hidden]
    return tuple(off_schedule(surveyed, turns, inside))


def _relative(heading: float, origin: float) -> float:
    """Into (-pi, pi]."""
    angle = math.remainder(heading - origin, 2.0 * math.pi)
    return math.pi if angle <= -math.pi * (1.0 - 1e-12) else angle
