# SPDX-License-Identifier: BSD-3-Clause
"""Motion: where the sensitive axis points over time, and everything that turning it brings.

A `Motion` says what the operator means to do and how badly; `Motion.draw` gives the `Course` that it becomes in one
record. Headings are those of the sensitive axis, from north over east.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, field, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.filtering.simulation.course import Course, Turns
from allanite.filtering.simulation.given import Span, numbers, span
from allanite.lazy_dataclasses import dataclass

__all__ = ["Motion", "Span"]

Array = NDArray[np.float64]

DEGREE = math.pi / 180
#: How far a bell may be missed, as a part of the room between the shortest dwell and the longest turn.
_ROOM = 0.45
_FIRST = {"north": (0.0, math.pi), "south": (math.pi, 0.0)}
_OVERLOADS = ("clip", "nan", "1e38")


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """How the sensitive axis is turned. Made by `still`, `reversals`, `positions` or `rotation`.

    The sensor stands on a table: the table turns about its own axis, which is vertical but for `table_tilt`, and the
    sensitive axis lies in the plane of the table but for `elevation`. Everything random is drawn anew for each
    record.

    Attributes
    ----------
    headings : tuple of float [rad]
        Nominal headings, gone through again and again.
    dwells : tuple of float [s]
        Times from the start of one turn to the start of the next (the turn takes its time from the dwell that
        follows it), gone through again and again; empty for a sensor that is never turned.
    spin : float [rad/s]
        Continuous rotation, positive from north over east.
    onward : bool
        Turn ever onward, from north over east, instead of forth and back.
    turn_time : tuple of float [s]
        Shortest and longest duration of a turn.
    unsteadiness : float
        Relative size of the departures of the hand from the smoothest turn; the angle turned does not depend on it.
    coupling : float
        Part of the turn that the sensitive axis itself sees. A level axis on a level table does not see a turn about
        the vertical; a box in the hand rolls and tilts on the way. 1 is the whole angle.
    dwell_sd : float [s]
        Standard deviation of the start of a turn; a clock keeps the errors from adding up.
    missed : tuple of int
        Turns, counted from 0, that the operator forgets.
    pointing_offset, pointing_sd : float [rad]
        Error of every position's heading: its constant and its random part.
    settling_angle : float or (float, float) [rad]
        Rotation that is left after a turn and creeps back into the sensitive axis, in the sense of the turn. It ends
        at the next turn.
    settling_time : float or (float, float) [s]
        Time constant of the settling.
    coherent_bias, coherent_heading : float [rad/s], [rad]
        A bias b cos(heading - coherent_heading) that turns with the sensor (magnetic field, gravity on a leaning
        table): +b pointing north, -b pointing south.
    knocks : tuple of float [s]
        Times of knocks: short spikes, one period of a sine, without net rotation.
    knocks_per_hour : float [1/h]
        More of them, at random times.
    knock_size, knock_length : float [rad/s], [s]
        Size and length of a knock.
    elevation : float [rad]
        Elevation of the sensitive axis above the plane of the table. It adds a constant, which turning cancels.
    table_tilt, table_tilt_heading : float [rad]
        By how much the table's axis leans, and towards which heading. That tilt turns with the sensor and nothing
        cancels it: leaning north, Omega cos(latitude) becomes Omega cos(latitude + tilt). A table that lies on its
        side, by pi/2 towards pi, turns the axis over instead: heading 0 points up, heading pi down.
    full_scale : float or None [rad/s]
        Range of sensor or converter; a sample beyond it is an overload.
    overload : "clip", "nan" or "1e38"
        Value written for an overload: the full scale, a missing sample, or the 1E38 of a bench multimeter.
    axes : mapping of channel name to float [rad]
        Heading of each sensitive axis relative to the heading of the table, for sensors with several axes. A single
        axis needs none.
    """

    headings: tuple[float, ...] = (0.0,)
    dwells: tuple[float, ...] = ()
    spin: float = 0.0
    onward: bool = False
    turn_time: tuple[float, float] = (1.0, 3.0)
    unsteadiness: float = 0.03
    coupling: float = 1.0
    dwell_sd: float = 0.0
    missed: tuple[int, ...] = ()
    pointing_offset: float = 0.0
    pointing_sd: float = 0.0
    settling_angle: Span = 0.0
    settling_time: Span = 3.0
    coherent_bias: float = 0.0
    coherent_heading: float = 0.0
    knocks: tuple[float, ...] = ()
    knocks_per_hour: float = 0.0
    knock_size: float = 5 * DEGREE
    knock_length: float = 0.1
    elevation: float = 0.0
    table_tilt: float = 0.0
    table_tilt_heading: float = 0.0
    full_scale: float | None = None
    overload: Literal["clip", "nan", "1e38"] = "clip"
    axes: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(self)

    # -- making one ---------------------------------------------------------------------------------------

    @classmethod
    def still(cls, heading: float = 0.0, **options: Any) -> Motion:
        """A sensor that keeps its heading [rad]. Options are the attributes."""
        return _made(headings=(heading,), **options)

    @classmethod
    def reversals(
        cls,
        dwell: float | ArrayLike = 30.0,
        *,
        first: Literal["north", "south"] = "north",
        onward: bool = False,
        **options: Any,
    ) -> Motion:
        """A sensor turned by hand between north and south.

        Parameters
        ----------
        dwell : float or array_like [s]
            One length, or several that repeat in order.
        first : "north" or "south"
            Direction of the axis at the start.
        onward : bool
            Turn ever onward instead of forth and back.
        **options
            The attributes of `Motion`.

        Raises
        ------
        InputError
            A direction, a length or an option that makes no sense.

        Examples
        --------
        >>> Motion.reversals(30.0, pointing_sd=0.02, settling_angle=(0.0003, 0.005)).dwells
        (30.0,)
        """
        if first not in _FIRST:
            raise InputError(f"the first heading of reversals is 'north' or 'south', not {first!r}")
        return _made(headings=_FIRST[first], dwells=dwell, onward=onward, **options)

    @classmethod
    def positions(
        cls,
        headings: ArrayLike,
        dwell: float | ArrayLike = 30.0,
        *,
        onward: bool = False,
        **options: Any,
    ) -> Motion:
        """A sensor set to n headings [rad] one after the other, again and again.

        From the last heading it turns straight back to the first, or ever `onward`. Other parameters are those of
        `reversals`.
        """
        return _made(headings=headings, dwells=dwell, onward=onward, **options)

    @classmethod
    def rotation(cls, rate: float, heading: float = 0.0, **options: Any) -> Motion:
        """A table that turns at a constant rate [rad/s], from north over east where positive.

        The axis lies in the plane of the table and sees nothing of that rate but what `elevation` or a `coupling`
        (0 unless given) let through.
        """
        return _made(headings=(heading,), spin=rate, **{"coupling": 0.0, **options})

    # -- what it becomes ----------------------------------------------------------------------------------

    def draw(self, duration: float, stream: np.random.SeedSequence) -> Course:
        """The course of one record of `duration` seconds; a longer record begins with the same course.

        A turn that the record would cut is not begun.
        """
        chance = [np.random.Generator(np.random.SFC64(s)) for s in stream.spawn(6)]
        turns = self._turns(duration, *chance[:5])
        return Course(
            duration=duration,
            spin=self.spin,
            coupling=self.coupling
            - math.sin(self.elevation),  # over east is clockwise, negative about the vertical
            turns=turns,
            knocks=self._knocks(duration, turns, chance[5]),
            knock_size=self.knock_size,
            knock_length=self.knock_length,
        )

    def axis(self, channel: str, count: int) -> float:
        """Heading of a channel's axis relative to the table [rad], in a record of `count` channels.

        Raises
        ------
        InputError
            Several channels, and nobody says where this one points.
        """
        if channel in self.axes or (count == 1 and not self.axes):
            return self.axes.get(channel, 0.0)
        raise InputError(
            f"the motion does not say where the axis of channel {channel!r} points: "
            f"give its heading relative to the table, e.g. axes={{{channel!r}: 0.0, ...}} [rad]"
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}

    # -- drawing ------------------------------------------------------------------------------------------

    def _turns(
        self,
        duration: float,
        clock: np.random.Generator,
        pace: np.random.Generator,
        hand: np.random.Generator,
        pointing: np.random.Generator,
        settling: np.random.Generator,
    ) -> Turns:
        rounds = math.ceil(duration / math.fsum(self.dwells)) if self.dwells else 0
        bells = np.cumsum(np.tile(self.dwells, rounds))
        room = _ROOM * (min(self.dwells, default=math.inf) - self.turn_time[1])
        start = bells + np.clip(self.dwell_sd * clock.standard_normal(len(bells)), -room, room)
        stop = start + pace.uniform(*self.turn_time, size=len(bells))
        count = int(np.searchsorted(stop, duration))
        done = ~np.isin(np.arange(count), self.missed)
        error = self.pointing_offset + self.pointing_sd * pointing.standard_normal(count + 1)
        moved = np.concatenate(
            [[0], np.maximum.accumulate(np.where(done, np.arange(1, count + 1), 0))]
        ).astype(int)
        nominal = self._nominal(count)
        sizes = settling.uniform(size=(count + 1, 2))
        return Turns(
            start=start[:count],
            stop=np.where(done, stop[:count], start[:count]),
            heading=nominal[np.concatenate([[0], np.cumsum(done)]).astype(int)] + error[moved],
            nominal=nominal,
            hand=self.unsteadiness * hand.standard_normal((len(bells), 3))[:count] / (1, 2, 3),
            settling_angle=_within(self.settling_angle, sizes[:, 0]),
            settling_time=_within(self.settling_time, sizes[:, 1]),
            last=moved,
        )

    def _nominal(self, turns: int) -> Array:
        """Headings that the operator means to have after 0, 1, ... turns, without the jumps of 2 pi."""
        around = np.asarray(self.headings)
        steps = np.roll(around, -1) - around
        if self.onward:
            steps = 2 * math.pi - np.mod(-steps, 2 * math.pi)
        repeated = np.resize(steps, turns) if turns else np.zeros(0)
        return np.asarray(around[0] + np.concatenate([[0.0], np.cumsum(repeated)]))

    def _knocks(self, duration: float, turns: Turns, chance: np.random.Generator) -> Array:
        """Start times: those asked for, and random ones outside the turns."""
        drawn, t = list(self.knocks), 0.0
        while self.knocks_per_hour > 0:
            t += chance.exponential(3600 / self.knocks_per_hour)
            if t > duration:
                break
            begun = np.searchsorted(turns.start, t + self.knock_length)  # turns begun by then
            if begun == 0 or t >= turns.stop[begun - 1]:
                drawn.append(t)
        return np.sort(drawn)


# -- checks -----------------------------------------------------------------------------------------------

_FINITE = ("spin", "coupling", "pointing_offset", "coherent_bias", "coherent_heading", "knock_size")
_TILTS = ("elevation", "table_tilt", "table_tilt_heading")
_NOT_NEGATIVE = ("unsteadiness", "dwell_sd", "pointing_sd", "knocks_per_hour", "table_tilt")
_TUPLES = ("headings", "dwells", "knocks", "turn_time")


def _made(**options: Any) -> Motion:
    known = [f.name for f in fields(Motion)]
    strange = sorted(set(options) - set(known))
    if strange:
        raise InputError(f"a motion has no option {strange[0]!r}; there are: {', '.join(known)}")
    return Motion(**options)


def _number(name: str, given: object) -> float:
    number = (*numbers(f"motion: {name}", given), math.nan)
    if len(number) != 2:
        raise InputError(f"motion: {name} must be one number, not {given!r}")
    return number[0]


def _check(motion: Motion) -> None:
    """Numbers become float, sequences tuples; what cannot be turned that way is refused."""
    put = object.__setattr__
    for name in _TUPLES:
        put(motion, name, numbers(f"motion: {name}", getattr(motion, name)))
    for name in (*_FINITE, *_TILTS, *_NOT_NEGATIVE, "knock_length"):
        put(motion, name, _number(name, getattr(motion, name)))
    for name in ("settling_angle", "settling_time"):
        put(motion, name, span(f"motion: {name}", getattr(motion, name)))
    for name in _NOT_NEGATIVE:
        if getattr(motion, name) < 0:
            raise InputError(f"motion: {name} must not be negative, not {getattr(motion, name)!r}")
    _check_turning(motion)
    if motion.knock_length <= 0 or np.min(motion.settling_time) <= 0:
        raise InputError("motion: knock_length and settling_time must be positive seconds")
    if abs(motion.elevation) >= math.pi / 2 or motion.table_tilt > math.pi / 2:
        raise InputError(
            "motion: elevation is an angle from the level below pi/2 [rad], table_tilt one up to pi/2"
        )
    if motion.overload not in _OVERLOADS:
        raise InputError(f"motion: overload is one of {', '.join(_OVERLOADS)}, not {motion.overload!r}")
    if motion.full_scale is not None:
        put(motion, "full_scale", _number("full_scale", motion.full_scale))
        if not motion.full_scale > 0:
            raise InputError(f"motion: full_scale must be positive [rad/s], not {motion.full_scale!r}")
    put(motion, "axes", {str(k): _number(f"axes[{k!r}]", v) for k, v in dict(motion.axes).items()})


def _check_turning(motion: Motion) -> None:
    if not motion.headings:
        raise InputError("motion: headings are missing: give at least one [rad]")
    if len(motion.turn_time) != 2 or not 0 < motion.turn_time[0] <= motion.turn_time[1]:
        raise InputError(
            f"motion: turn_time is the shortest and the longest turn, positive seconds, not {motion.turn_time!r}"
        )
    if motion.dwells and not min(motion.dwells) > motion.turn_time[1]:
        raise InputError(
            f"motion: a dwell of {min(motion.dwells):g} s holds no turn of up to {motion.turn_time[1]:g} s: "
            "dwells are counted from the start of one turn to the start of the next"
        )
    if motion.dwells and motion.spin:
        raise InputError(
            "motion: a table either turns at a constant rate (spin) or stops at headings (dwells)"
        )
    if not all(
        isinstance(k, (int, np.integer)) and not isinstance(k, bool) and k >= 0 for k in motion.missed
    ):
        raise InputError(f"motion: missed are numbers of turns counted from 0, not {motion.missed!r}")
    object.__setattr__(motion, "missed", tuple(int(k) for k in motion.missed))


def _within(span: Span, part: Array) -> Array:
    low, high = span if isinstance(span, tuple) else (span, span)
    return np.asarray(low + (high - low) * part)
