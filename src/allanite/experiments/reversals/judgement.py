# SPDX-License-Identifier: BSD-3-Clause
"""Which excursions are turns, and what the dropouts hide.

How the turns of a record show is decided once, for the record as a whole (`TurnScale`):

* *angle*: excursions integrate to half turns, 180 deg. Each is then weighed by its own angle; a clipped one, whose
  angle is a lower bound, by the time it spends at the limit.
* *size*: the unit is unknown, or the axis sees only a part of the turn (an axis that is reversed is at right angles
  to the turn: what it senses is cross-coupling and the tilt of the hand). Excursions of one direction whose areas
  agree are half turns of that area.
* *rhythm*: neither, but excursions as long as turns come at even intervals.

Without any of the three there are no turns, only disturbances: a knock is short, or goes back and forth and leaves
no angle.

What the dropouts hide is settled from the turns in sight (`allanite.experiments.reversals.dropouts`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from allanite.experiments.reversals.dropouts import (
    LONGEST,
    Beat,
    beat_of,
    goes_back_and_forth,
    in_time,
    senses,
    settle,
)
from allanite.experiments.reversals.excursions import Dropout, Excursion, SurveyedSignal
from allanite.experiments.reversals.turns import Disturbance, Position, Turn, sign_of
from allanite.lazy_dataclasses import dataclass

__all__ = ["TurnJudgement", "TurnScale", "judge", "positions_of"]

#: A turn by hand is no narrower than this [s].
NARROWEST = 0.25
#: A dropout shorter than this hides no turn [s].
HIDING = 0.6
#: Time at the limit from which an excursion counts as clipped, and the share of its length [s, 1].
FLAT, FLAT_SHARE = 0.2, 0.12
#: Net over gross angle from which a motion went one way.
ONE_WAY = 0.7
#: Relative scatter up to which areas agree.
AGREE = 0.3

Mode = Literal["angle", "size", "rhythm", "none"]
Event = Turn | Disturbance


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnScale:
    """How turns show in this record; `half` is the area of a half turn (NaN for rhythm and none)."""

    mode: Mode
    half: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnJudgement:
    """What the excursions and dropouts of a signal are.

    Attributes
    ----------
    scale : TurnScale
    turns : tuple of Turn
    disturbed : tuple of Disturbance
    beat : Beat or None
        None with fewer than three turns.
    hidden : tuple of Turn
        Those of `turns` that no signal shows.
    settled : tuple of Dropout
        Dropouts as long as a turn or longer that were found to hide none.
    returning : bool
        The turns go back and forth, so that the sense of each tells the direction.
    """

    scale: TurnScale
    turns: tuple[Turn, ...]
    disturbed: tuple[Disturbance, ...]
    beat: Beat | None
    hidden: tuple[Turn, ...] = ()
    settled: tuple[Dropout, ...] = ()
    returning: bool = False


def judge(surveyed: SurveyedSignal) -> TurnJudgement:
    """Turns, disturbances and unsettled stretches of a surveyed signal."""
    limits = _limits(surveyed)
    scale = _scale(surveyed, limits)
    doubtful = [_doubted(s) for s in surveyed.excursions if _is_doubtful(surveyed, s, scale, limits)]
    sure = [s for s in surveyed.excursions if not _is_doubtful(surveyed, s, scale, limits)]
    events = [_weighed(surveyed, s, scale, limits) for s in sure]
    visible_turns = tuple(e for e in events if isinstance(e, Turn))
    disturbed = [e for e in events if isinstance(e, Disturbance)]
    long = [d for d in surveyed.dropouts if d.stop - d.start >= HIDING * surveyed.rate]
    dropouts = sorted([*long, *doubtful], key=lambda d: d.start)
    hidden, empty, unsettled = settle(surveyed, visible_turns, disturbed, dropouts)
    disturbed += [Disturbance(start=d.start, stop=d.stop, kind="knock") for d in empty if d in doubtful]
    disturbed += [Disturbance(start=d.start, stop=d.stop, kind=_name(d), hides=True) for d in unsettled]
    disturbed += [
        Disturbance(start=d.start, stop=d.stop, kind="stuck")
        for d in surveyed.dropouts
        if d.kind == "stuck" and d not in unsettled
    ]
    turns = tuple(sorted((*visible_turns, *hidden), key=lambda t: t.start))
    return TurnJudgement(
        scale=scale,
        turns=turns,
        disturbed=tuple(sorted(disturbed, key=lambda d: d.start)),
        beat=beat_of(turns),
        hidden=hidden,
        settled=tuple(d for d in empty if d not in doubtful),
        returning=goes_back_and_forth(senses(visible_turns, disturbed, dropouts)),
    )


def positions_of(
    turns: Sequence[Turn], disturbed: Sequence[Disturbance], n_samples: int, *, first: float, returning: bool
) -> tuple[Position, ...]:
    """Positions between turns, with their headings.

    Parameters
    ----------
    first : float [rad]
        Heading of the first position.
    returning : bool
        Turns go back and forth: segments of unknown direction are settled by the sense of their turns.
    """
    events: list[Event] = [*turns, *(d for d in disturbed if d.hides)]
    events.sort(key=lambda e: e.start)
    out: list[Position] = []
    start, relative, segment = 0, 0.0, 0
    for e in [*events, None]:
        stop = n_samples if e is None else e.start
        out.append(
            Position(
                start=start, stop=max(stop, start), heading=0.0, sign=0, segment=segment, relative=relative
            )
        )
        if e is None:
            break
        start = max(e.stop, start)
        if isinstance(e, Turn) and not math.isnan(e.change):
            relative = _wrapped(relative + e.change)
        else:
            relative, segment = 0.0, segment + 1
    offsets = _offsets(out, turns, first, returning)
    return tuple(_pointed(p, offsets.get(p.segment, math.nan)) for p in out if p.stop > p.start)


def _name(dropout: Dropout) -> str:
    return "stuck" if dropout.kind == "stuck" else "missing"


# -- excursions -----------------------------------------------------------------------------------------------


def _length(surveyed: SurveyedSignal, excursion: Excursion) -> float:
    return (excursion.stop - excursion.start) / surveyed.rate


def _width(excursion: Excursion) -> float:
    """Length of the movement itself [s]: a rectangle of its peak and path. A knock that rings on stays narrow."""
    return excursion.missing + (excursion.path / excursion.peak if excursion.peak > 0.0 else 0.0)


def _limits(surveyed: SurveyedSignal) -> tuple[float, float]:
    """Upper and lower limit of the converter, where several excursions end at the very same value; else infinite."""
    high = [s.high for s in surveyed.excursions]
    low = [s.low for s in surveyed.excursions]
    top, bottom = max(high, default=math.inf), min(low, default=-math.inf)
    return (top if high.count(top) > 1 else math.inf, bottom if low.count(bottom) > 1 else -math.inf)


def _is_clipped(surveyed: SurveyedSignal, excursion: Excursion, limits: tuple[float, float]) -> bool:
    """At the limit for a while, or for as long as it is shown to be one by other excursions."""
    enough = max(FLAT, FLAT_SHARE * _length(surveyed, excursion))
    flat = (excursion.flat_high if excursion.flat_high >= enough else 0.0) + (
        excursion.flat_low if excursion.flat_low >= enough else 0.0
    )
    shared = excursion.high >= limits[0] or excursion.low <= limits[1]
    return flat > 0.0 or shared or excursion.missing >= FLAT


def _one_way(excursion: Excursion) -> bool:
    return abs(excursion.area) >= ONE_WAY * excursion.path


def _scale(surveyed: SurveyedSignal, limits: tuple[float, float]) -> TurnScale:
    """How turns show in this record."""
    long = [s for s in surveyed.excursions if _width(s) >= NARROWEST and _length(surveyed, s) <= LONGEST]
    if surveyed.physical:
        whole = [
            s for s in long if abs(s.area) >= 0.75 * math.pi or _clipped_turn(surveyed, s, limits, math.pi)
        ]
        if whole and 4 * len(whole) >= len(long):
            return TurnScale(mode="angle", half=math.pi)
    steady = [s for s in long if _one_way(s)]
    free = [s for s in steady if not _is_clipped(surveyed, s, limits)]
    chosen = free if len(free) >= 3 else steady
    if chosen and (len(chosen) >= 3 or not surveyed.physical):
        areas = np.abs([s.area for s in chosen])
        half = float(np.median(areas))
        if len(chosen) < 3 or 1.4826 * float(np.median(np.abs(areas - half))) <= AGREE * half:
            return TurnScale(mode="size", half=half)
    return _by_rhythm(long)


def _by_rhythm(long: Sequence[Excursion]) -> TurnScale:
    """Excursions that leave no angle, but are as long as turns and come at even intervals."""
    even = in_time([0.5 * (s.start + s.stop) for s in long])
    return TurnScale(mode="rhythm" if even else "none")


def _clipped_turn(
    surveyed: SurveyedSignal, excursion: Excursion, limits: tuple[float, float], half: float
) -> bool:
    """As long as a turn and going one way to the limit, or fast and then without samples.

    A knock does not stay at the limit. Of a turn without its middle nothing may be seen but the flanks, which an
    unsteady hand moves both ways; they are faster than the mean of the slowest turn, which a knock beside a gap
    need not be.
    """
    if _width(excursion) < NARROWEST or not _is_clipped(surveyed, excursion, limits):
        return False
    at_limit = excursion.flat_high + excursion.flat_low + excursion.missing >= FLAT and _one_way(excursion)
    fast = excursion.missing >= FLAT and (excursion.overload or excursion.peak >= half / LONGEST)
    return fast or (at_limit and excursion.missing < FLAT)


def _is_doubtful(
    surveyed: SurveyedSignal, excursion: Excursion, scale: TurnScale, limits: tuple[float, float]
) -> bool:
    """Long enough for a turn, and clipped, but both ways or beside a gap: what is seen of the angle bounds nothing."""
    return (
        _width(excursion) >= NARROWEST
        and _length(surveyed, excursion) <= LONGEST
        and _is_clipped(surveyed, excursion, limits)
        and not _clipped_turn(surveyed, excursion, limits, scale.half)
        and (scale.mode == "none" or abs(excursion.area) < 0.75 * scale.half)
    )


def _doubted(excursion: Excursion) -> Dropout:
    return Dropout(
        start=excursion.start, stop=excursion.stop, kind="missing" if excursion.missing >= FLAT else "clipped"
    )


def _weighed(
    surveyed: SurveyedSignal, excursion: Excursion, scale: TurnScale, limits: tuple[float, float]
) -> Event:
    """An excursion as a turn or as a disturbance."""
    length = _length(surveyed, excursion)
    if length > LONGEST:  # handled, not turned: nobody knows how it stood afterwards
        return Disturbance(
            start=excursion.start, stop=excursion.stop, kind="handling", hides=scale.mode != "none"
        )
    knock = Disturbance(start=excursion.start, stop=excursion.stop, kind="knock")
    if scale.mode == "none" or _width(excursion) < NARROWEST:
        return knock
    clipped = _is_clipped(surveyed, excursion, limits)
    angle = excursion.area if surveyed.physical else math.nan
    if scale.mode == "rhythm":
        return _turn(
            excursion, math.nan, math.pi, clipped, "as long as a turn, at the record's even intervals"
        )
    quarters = round(abs(excursion.area) / (0.5 * scale.half))
    if clipped and quarters < 2 and _clipped_turn(surveyed, excursion, limits, scale.half):
        why = (
            "samples missing in mid-turn"
            if excursion.missing >= FLAT
            else "clipped; the angle is a lower bound"
        )
        return _turn(excursion, angle, math.pi, True, why)
    if clipped and quarters % 2:  # a lower bound: the next whole number of half turns that it allows
        quarters += 1
    if quarters == 0:
        return knock
    change = _wrapped(0.5 * math.pi * quarters * math.copysign(1.0, excursion.area))
    if scale.mode == "angle":
        return _turn(excursion, angle, change, clipped, f"{math.degrees(excursion.area):+.0f} deg")
    return _turn(
        excursion, angle, change, clipped, f"{abs(excursion.area) / scale.half:.2f} of the usual size"
    )


def _turn(excursion: Excursion, angle: float, change: float, clipped: bool, why: str) -> Turn:
    return Turn(
        start=excursion.start, stop=excursion.stop, angle=angle, change=change, clipped=clipped, evidence=why
    )


def _wrapped(angle: float) -> float:
    """Into (-pi, pi], and exactly 0 or pi where it is meant: sums of quarter turns."""
    quarters = round(angle / (0.5 * math.pi)) % 4
    return (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi)[quarters]


# -- headings -------------------------------------------------------------------------------------------


def _offsets(
    positions: Sequence[Position], turns: Sequence[Turn], first: float, returning: bool
) -> dict[int, float]:
    """Heading of the beginning of each segment, where it is known."""
    known = {0: first}
    if not returning:
        return known
    starts = {t.stop: t for t in turns if t.change == math.pi and not math.isnan(t.angle)}
    after: dict[float, float] = {}  # sense of a turn -> heading after it, learnt in segment 0
    for p in positions:
        t = starts.get(p.start)
        if t is None:
            continue
        sense = math.copysign(1.0, t.angle)
        if p.segment == 0:
            heading = _wrapped(first + p.relative)
            after.setdefault(sense, heading)
            after.setdefault(-sense, _wrapped(heading + math.pi))
        elif p.segment not in known and sense in after:
            known[p.segment] = _wrapped(after[sense] - p.relative)
    return known


def _pointed(position: Position, offset: float) -> Position:
    if math.isnan(offset):
        return replace(position, heading=math.nan)
    heading = _wrapped(offset + position.relative)
    if abs(heading) == 0.5 * math.pi:  # east or west: which of them, the sense of the axis would have to tell
        return replace(position, heading=math.nan)
    return replace(position, heading=heading, sign=sign_of(heading))
