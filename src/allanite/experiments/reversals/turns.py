# SPDX-License-Identifier: BSD-3-Clause
"""Turns, positions and dwells of a recording, and how the dwells are cut out of the positions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.reversals.sides import First, checked_first, direction_of, sign_at_first
from allanite.lazy_dataclasses import dataclass
from allanite.recording.health.finding import Finding
from allanite.recording.records import merge_spans

__all__ = [
    "DEAD_TIME",
    "GUARD",
    "Disturbance",
    "Dwell",
    "Position",
    "Reversals",
    "Turn",
    "checked_dead_time",
    "sign_of",
]

Json = dict[str, Any]
Signs = NDArray[np.int8]
Stretch = TypeVar("Stretch", "Turn", "Position", "Disturbance")
Source = Literal["detected", "file", "period", "none"]

#: Time after a turn that is not used unless the user says otherwise [s]: hand off, table at rest.
DEAD_TIME = 2.0
#: Time before a turn, and on both sides of a disturbance, that is not used [s]. The first of a hand's movement lies
#: below the noise: 0.1 deg/s over 30 ms is already 3 % of the Earth's rotation in a dwell of 30 s.
GUARD = 0.5
#: A dwell shorter than this is no dwell [s].
SHORTEST_DWELL = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """A stretch in which the sensor was turned.

    Attributes
    ----------
    start, stop : int [samples]
        The disturbed stretch, half-open.
    angle : float [rad]
        Integral of the rate over it, less the level around it; NaN where it is not known (missing samples, no
        physical unit). A lower bound where `clipped`.
    change : float [rad]
        What the turn is taken to do to the heading: pi, 0 (a full turn), pi/2 or -pi/2.
    clipped : bool
        The converter reached its limit, or samples are missing: the angle is a lower bound.
    evidence : str
        Why it counts as a turn, in words.
    """

    start: int
    stop: int
    angle: float = math.nan
    change: float = math.pi
    clipped: bool = False
    evidence: str = ""

    @property
    def centre(self) -> float:
        """Middle of the stretch [samples]."""
        return 0.5 * (self.start + self.stop)


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Where the sensor stood from one turn to the next.

    Attributes
    ----------
    start, stop : int [samples]
        From the end of one turn to the beginning of the next; nothing is cut yet.
    heading : float [rad]
        Of the sensitive axis, from north over east, or from up where it is turned over; NaN where it is not known.
    sign : int
        +1 north or up, -1 south or down, 0 unknown or neither.
    segment : int
        0 to begin with; a stretch that may hide turns begins a new one. Within a segment the headings are known
        relative to each other even where they are not known at all.
    relative : float [rad]
        Heading less that of the first position of the segment; NaN where it is not known.
    name : str
        From the file of positions; else "".
    """

    start: int
    stop: int
    heading: float
    sign: int
    segment: int = 0
    relative: float = math.nan
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Dwell:
    """A usable piece of a position: dead time, guard and disturbances are cut.

    Attributes
    ----------
    start, stop : int [samples]
        Half-open. Missing samples in it are NaN in the data.
    heading : float [rad]
        Of the sensitive axis, from north over east, or from up where it is turned over; NaN where it is not known.
    sign : int
        +1 north or up, -1 south or down, 0 unknown or neither.
    position : int
        Which of `Reversals.positions` it is a piece of: a knock makes two dwells of one position.
    """

    start: int
    stop: int
    heading: float
    sign: int
    position: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """A stretch that is no turn and is not used.

    Attributes
    ----------
    start, stop : int [samples]
    kind : str
        "knock", "handling" (too long for a turn), "stuck" (one repeated value) or "missing".
    hides : bool
        It may hide turns, and nothing settles how many: the direction after it is not known by itself.
    """

    start: int
    stop: int
    kind: str
    hides: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Reversals:
    """When the sensor was turned, and where its axis pointed in between.

    Attributes
    ----------
    rate : float [Hz]
    n_samples : int
    turns : tuple of Turn
    positions : tuple of Position
    dwells : tuple of Dwell
    disturbed : tuple of Disturbance
    source : str
        "detected", "file", "period", or "none" for a signal without turns.
    first : str
        "north", "south", "up", "down" or "unknown": where the axis pointed at first. One axis cannot tell;
        where it is unknown, signs and headings are given as if it had been north.
    dead_time : float [s]
        Counted from the end of each turn.
    guard : float [s]
        Not used before each turn and on both sides of a disturbance.
    findings : tuple of Finding
    """

    rate: float
    n_samples: int
    turns: tuple[Turn, ...]
    positions: tuple[Position, ...]
    dwells: tuple[Dwell, ...]
    disturbed: tuple[Disturbance, ...] = ()
    source: Source
    first: First
    dead_time: float
    guard: float = GUARD
    findings: tuple[Finding, ...] = ()

    def __repr__(self) -> str:
        known = sum(d.sign != 0 for d in self.dwells)
        return (
            f"<Reversals {self.source}: {len(self.turns)} turns, {len(self.dwells)} dwells ({known} of known "
            f"direction), first {self.first}, dead time {self.dead_time:g} s>"
        )

    @classmethod
    def cut(
        cls,
        *,
        rate: float,
        n_samples: int,
        turns: tuple[Turn, ...],
        positions: tuple[Position, ...],
        disturbed: tuple[Disturbance, ...] = (),
        source: Source,
        first: First,
        dead_time: float = DEAD_TIME,
        guard: float = GUARD,
        findings: tuple[Finding, ...] = (),
    ) -> Reversals:
        """Reversals whose dwells are cut out of the positions."""
        whole = cls(
            rate=rate,
            n_samples=n_samples,
            turns=turns,
            positions=positions,
            dwells=(),
            disturbed=disturbed,
            source=source,
            first=first,
            dead_time=checked_dead_time(dead_time),
            guard=guard,
            findings=findings,
        )
        return replace(whole, dwells=_dwells(whole))

    @property
    def static(self) -> bool:
        """True when no turn was found."""
        return not self.turns

    def with_dead_time(self, seconds: float) -> Reversals:
        """The same turns with the dwells cut anew.

        Raises
        ------
        InputError
            A time that is negative or not finite.
        """
        whole = replace(self, dead_time=checked_dead_time(seconds))
        return replace(whole, dwells=_dwells(whole))

    def beginning(self, first: str | None) -> Reversals:
        """The same turns with the first position that there is pointing this way.

        Raises
        ------
        InputError
            No direction; see `checked_first`.
        """
        start = checked_first(first)
        wanted = sign_at_first(start)
        if not self.positions or self.positions[0].sign in (0, wanted):
            return replace(self, first=start)
        around = tuple(
            replace(p, heading=math.remainder(p.heading + math.pi, 2 * math.pi), sign=-p.sign)
            for p in self.positions
        )
        whole = replace(self, positions=around, first=start)
        return replace(whole, dwells=_dwells(whole))

    def window(self, offset: int, n_samples: int) -> Reversals:
        """Those of the part of the record that begins at sample `offset` and holds `n_samples`.

        Raises
        ------
        InputError
            No position lies in that part.
        """
        positions = _inside(self.positions, offset, n_samples)
        if not positions:
            raise InputError("none of the listed positions lies in the part of the log that is used")
        whole = replace(
            self,
            n_samples=n_samples,
            turns=_inside(self.turns, offset, n_samples),
            positions=positions,
            disturbed=_inside(self.disturbed, offset, n_samples),
        )
        return replace(whole, dwells=_dwells(whole))

    def signs(self) -> Signs:
        """+1 or -1 for each sample of a dwell of known direction, 0 elsewhere; int8, shape (n_samples,)."""
        out = np.zeros(self.n_samples, dtype=np.int8)
        for d in self.dwells:
            out[d.start : d.stop] = d.sign
        return out

    def table(self) -> list[Json]:
        """One row for each dwell: number, position, start_s, stop_s, duration_s, heading_deg, direction."""
        return [
            {
                "number": number,
                "position": d.position,
                "name": self.positions[d.position].name,
                "start_s": d.start / self.rate,
                "stop_s": d.stop / self.rate,
                "duration_s": (d.stop - d.start) / self.rate,
                "heading_deg": math.degrees(d.heading),
                "direction": direction_of(self.first, d.sign, _other(d.heading)),
            }
            for number, d in enumerate(self.dwells, 1)
        ]

    def to_json(self) -> Json:
        """Plain data; an unknown angle is None."""
        return {
            "rate": self.rate,
            "samples": self.n_samples,
            "turns": [_plain(t) for t in self.turns],
            "positions": [_plain(p) for p in self.positions],
            "disturbed": [_plain(d) for d in self.disturbed],
            "dwells": [_plain(d) for d in self.dwells],
            "source": self.source,
            "first": self.first,
            "dead_time": self.dead_time,
            "guard": self.guard,
            "findings": [f.to_json() for f in self.findings],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Reversals:
        """Inverse of `to_json`.

        Raises
        ------
        InputError
            A field is missing or of the wrong form.
        """
        try:
            return cls.cut(
                rate=float(data["rate"]),
                n_samples=int(data["samples"]),
                turns=tuple(Turn(**_numbers(t)) for t in data["turns"]),
                positions=tuple(Position(**_numbers(p)) for p in data["positions"]),
                disturbed=tuple(Disturbance(**d) for d in data["disturbed"]),
                source=data["source"],
                first=data["first"],
                dead_time=float(data["dead_time"]),
                guard=float(data["guard"]),
                findings=tuple(Finding.from_json(f) for f in data["findings"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"not a list of turns: {error!r}") from None


def _inside(spans: tuple[Stretch, ...], offset: int, n_samples: int) -> tuple[Stretch, ...]:
    """Stretches counted from `offset`, cut at the ends of the part."""
    moved = (replace(s, start=max(s.start - offset, 0), stop=min(s.stop - offset, n_samples)) for s in spans)
    return tuple(s for s in moved if s.stop > s.start)


def _dwells(whole: Reversals) -> tuple[Dwell, ...]:
    """Pieces of the positions that are left after dead time, guard and disturbances."""
    dead, guard, least = (math.ceil(t * whole.rate) for t in (whole.dead_time, whole.guard, SHORTEST_DWELL))
    spans = np.array([(d.start, d.stop) for d in whole.disturbed], dtype=np.int64).reshape(-1, 2)
    lost = merge_spans(spans + np.array([-guard, guard]))
    starts, stops = (lost[:, i].tolist() for i in (0, 1))
    out = []
    near = 0
    for number, p in enumerate(whole.positions):
        a = p.start + dead if p.start > 0 else p.start
        b = p.stop - guard if p.stop < whole.n_samples else p.stop
        while near < len(stops) and stops[near] <= a:
            near += 1
        k = near
        while a < b:
            inside = k < len(starts) and starts[k] < b
            end = starts[k] if inside else b
            if end - a >= least:
                out.append(Dwell(start=a, stop=end, heading=p.heading, sign=p.sign, position=number))
            a = stops[k] if inside else b
            k += 1
    return tuple(out)


def sign_of(heading: float) -> int:
    """+1 within 10 deg of heading 0, -1 within 10 deg of the opposite (the cosine is 1 within 1.6 %), else 0."""
    c = math.cos(heading)
    return 0 if math.isnan(c) or abs(c) < math.cos(math.radians(10.0)) else (1 if c > 0 else -1)


def checked_dead_time(seconds: float) -> float:
    """A dead time [s].

    Raises
    ------
    InputError
        Negative, not finite, or not a number.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, (int, float, np.integer, np.floating)):
        raise InputError(f"dead time must be a number of seconds, not {seconds!r}")
    if not (math.isfinite(seconds) and seconds >= 0.0):
        raise InputError(f"dead time must be finite and not negative [s], not {seconds!r}")
    return float(seconds)


def _other(heading: float) -> str:
    return "unknown" if math.isnan(heading) else f"{math.degrees(heading) % 360.0:g} deg"


def _plain(part: Turn | Position | Dwell | Disturbance) -> Json:
    return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in asdict(part).items()}


def _numbers(row: Mapping[str, Any]) -> Json:
    return {k: math.nan if v is None else v for k, v in row.items()}
