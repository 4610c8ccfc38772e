# SPDX-License-Identifier: BSD-3-Clause
"""How a unit of three axes is moved: set to attitudes one after the other, or turned about its vertical axis.

A `UnitMotion` says what is meant and how badly; `UnitMotion.draw` gives the `UnitCourse` that it becomes in one record.
Attitudes take forward, right, down to north, east, down: `allanite.quantities.attitude`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.filtering.simulation.given import Span, numbers, span
from allanite.filtering.simulation.unit_course import (
    REST,
    SETTLE,
    SPIN,
    SWAP,
    TURN,
    Pieces,
    UnitCourse,
    Waves,
)
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import attitude_of, rotation, rotation_vector

__all__ = ["UnitMotion"]

Array = NDArray[np.float64]

QUARTER = math.pi / 2
#: Frequencies of a hand [Hz], and how many of them make its tremor in each direction.
HAND, WAVES = (2.0, 8.0), 4
#: The scheme of nineteen positions: axes of the unit, and quarter turns about them one after the other.
_NINETEEN = ((1, (1, 1, 1, -1, -1, -1)), (2, (1,)), (0, (1, 1, 1, -1, -1, -1)), (2, (1, 1, -1, -1, -1)))
#: Roll and pitch that put each face down, in the order in which one is a quarter turn from the next.
_FACES = ((0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (0, -1))
#: Farther than this from a rotation matrix is no rounding.
_ROTATION = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnitMotion:
    """How a unit is moved. Made by `still`, `positions`, `two`, `faces`, `nineteen`, `icosahedron`, `many`, `rotation`.

    Everything random is drawn anew for each record.

    Attributes
    ----------
    attitudes : ndarray, shape (n, 3, 3)
        Attitudes meant by the operator, in order. Given as matrices, or as roll, pitch, heading [rad], shape (n, 3).
    dwells : tuple of float, n long [s]
        Time at each attitude.
    turn_time : float or (float, float) [s]
        Time of a turn, along the shortest way; or the ends of a range from which each turn draws its own.
    pointing_sd : float [rad]
        Standard deviation of the attitudes about each of three axes.
    settling_angle : float or (float, float) [rad]
        Part of a turn that is missing at its end; it is made up during the dwell, in the sense of the turn.
    settling_time : float or (float, float) [s]
        Time constant of the settling.
    tremor : float [rad]
        Rms of a hand's tremor halfway through a turn, about each axis.
    sway : float [m]
        Sway of the place of the unit, likewise; at 4 Hz one millimeter is 0.6 m/s^2.
    spin : float [rad/s]
        Continuous rotation about the down axis of the unit, instead of turns; positive from north over east.
    swap_time : float [s]
        Change the sense of the rotation after each revolution, within this time; 0: never.
    """

    attitudes: Array
    dwells: tuple[float, ...]
    turn_time: Span = 2.0
    pointing_sd: float = 0.0
    settling_angle: Span = 0.0
    settling_time: Span = 3.0
    tremor: float = 0.0
    sway: float = 0.0
    spin: float = 0.0
    swap_time: float = 0.0

    def __post_init__(self) -> None:
        _check(self)

    # -- making one ---------------------------------------------------------------------------------------

    @classmethod
    def still(cls, attitude: ArrayLike = (0.0, 0.0, 0.0), *, duration: float, **options: Any) -> UnitMotion:
        """A unit that keeps its attitude (roll, pitch, heading [rad], or a matrix) for `duration` [s].

        Options are the attributes.
        """
        return _made(attitudes=[attitude], dwells=(duration,), **options)

    @classmethod
    def positions(
        cls,
        attitudes: ArrayLike,
        *,
        dwell: float | Sequence[float],
        turn: Span = 2.0,
        **options: Any,
    ) -> UnitMotion:
        """A unit set to attitudes one after the other.

        Parameters
        ----------
        attitudes : array_like, shape (n, 3) [rad] or (n, 3, 3)
            Roll, pitch, heading, or matrices.
        dwell : float or sequence of n float [s]
            Time at rest in each position.
        turn : float or (float, float) [s]
            Time of a turn, or its smallest and largest.
        **options
            The attributes of `UnitMotion`.

        Examples
        --------
        >>> UnitMotion.positions([[0, 0, 0], [0, 0, 3.0]], dwell=60.0, turn=1.0).dwells
        (60.0, 60.0)
        """
        matrices = _attitudes(attitudes)
        dwells = (dwell,) * len(matrices) if np.ndim(dwell) == 0 else dwell
        return _made(attitudes=matrices, dwells=dwells, turn_time=turn, **options)

    @classmethod
    def two(
        cls,
        attitude: ArrayLike = (0.0, 0.0, 0.0),
        *,
        dwell: float | Sequence[float],
        turned: str = "heading",
        turn: Span = 2.0,
        **options: Any,
    ) -> UnitMotion:
        """Two attitudes: half a turn about the vertical (`turned` = "heading"), or upside down ("over")."""
        first = _matrix(attitude)
        halves = {"heading": rotation([0, 0, math.pi]) @ first, "over": first @ rotation([math.pi, 0, 0])}
        if turned not in halves:
            raise InputError(f"two positions differ by half a turn: 'heading' or 'over', not {turned!r}")
        return cls.positions(np.stack([first, halves[turned]]), dwell=dwell, turn=turn, **options)

    @classmethod
    def faces(
        cls,
        *,
        dwell: float | Sequence[float],
        turn: Span = 2.0,
        heading: float = 0.0,
        **options: Any,
    ) -> UnitMotion:
        """The six faces of a box on a level table, each axis down and up; the first with the down axis down."""
        angles = [(QUARTER * roll, QUARTER * pitch, heading) for roll, pitch in _FACES]
        return cls.positions(angles, dwell=dwell, turn=turn, **options)

    @classmethod
    def nineteen(
        cls,
        *,
        dwell: float | Sequence[float],
        turn: Span = 9.0,
        heading: float = 0.0,
        **options: Any,
    ) -> UnitMotion:
        """Nineteen positions joined by eighteen quarter turns about the axes of the unit.

        Three turns about y forth and back, one about z, three about x forth and back, two about z forth and three back:
        every axis turns both ways, with the two others level and upright.
        """
        attitudes = [_matrix((0.0, 0.0, heading))]
        for axis, senses in _NINETEEN:
            for sense in senses:
                attitudes.append(attitudes[-1] @ rotation(sense * QUARTER * np.eye(3)[axis]))
        return cls.positions(np.stack(attitudes), dwell=dwell, turn=turn, **options)

    @classmethod
    def icosahedron(
        cls,
        poses: int = 20,
        *,
        dwell: float | Sequence[float],
        turn: Span = (1.0, 2.0),
        **options: Any,
    ) -> UnitMotion:
        """Every direction of the unit down in turn: the 12 corners, 20 faces or 30 edges of an icosahedron.

        Headings follow from turning by the shortest way from each to the nearest that is left.
        """
        return cls.positions(_downs(_icosahedron(poses)), dwell=dwell, turn=turn, **options)

    @classmethod
    def many(
        cls,
        count: int,
        *,
        seed: int | np.random.Generator = 0,
        dwell: float | Sequence[float],
        turn: Span = (1.0, 2.0),
        **options: Any,
    ) -> UnitMotion:
        """Random attitudes, all equally likely."""
        q = np.random.default_rng(seed).standard_normal((count, 4))
        length = np.linalg.norm(q[:, 1:], axis=1)
        vectors = (2 * np.arctan2(length, q[:, 0]) / length)[:, None] * q[:, 1:]
        return cls.positions(rotation(vectors), dwell=dwell, turn=turn, **options)

    @classmethod
    def rotation(
        cls,
        rate: float,
        duration: float,
        *,
        tilt: tuple[float, float] = (0.0, 0.0),
        heading: float = 0.0,
        swap_time: float = 0.0,
        **options: Any,
    ) -> UnitMotion:
        """A unit that turns about its down axis at a constant rate [rad/s] for `duration` [s].

        Parameters
        ----------
        rate : float [rad/s]
            Positive from north over east.
        duration : float [s]
            Length of the record.
        tilt : (float, float) [rad]
            Roll and pitch at the start: the axis keeps the lean that they give it.
        heading : float [rad]
            Heading at the start.
        swap_time : float [s]
            Go back after each revolution, and forth again, changing the sense within this time; 0: always onward.
        """
        attitude = (*tilt, heading)
        return _made(attitudes=[attitude], dwells=(duration,), spin=rate, swap_time=swap_time, **options)

    # -- what it becomes ----------------------------------------------------------------------------------

    def draw(self, stream: np.random.SeedSequence) -> UnitCourse:
        """The course of one record."""
        chance = [np.random.Generator(np.random.SFC64(s)) for s in stream.spawn(5)]
        missed = self.pointing_sd * chance[0].standard_normal((len(self.attitudes), 3))
        attitudes = self.attitudes @ rotation(missed)
        if self.spin:
            return UnitCourse(pieces=self._rotating(attitudes[0]))
        pieces = self._turned(attitudes, chance[1], chance[2])
        turning = pieces.kind == TURN
        return UnitCourse(
            pieces=pieces,
            tremor=_waves(self.tremor, turning, chance[3]),
            sway=_waves(self.sway, turning, chance[4]),
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data: the arguments of `UnitMotion`."""
        out = {f.name: getattr(self, f.name) for f in fields(self)}
        return {k: v.tolist() if isinstance(v, np.ndarray) else _listed(v) for k, v in out.items()}

    def _turned(self, attitudes: Array, pace: np.random.Generator, creep: np.random.Generator) -> Pieces:
        """Dwell, turn, dwell, ...; a turn begins where the dwell before it really ended."""
        count = len(attitudes)
        times = _drawn(self.turn_time, pace, count)
        angles, constants = (
            _drawn(self.settling_angle, creep, count),
            _drawn(self.settling_time, creep, count),
        )
        rows, at = _MotionPieces(), attitudes[0]
        axis, left = np.array([0.0, 0.0, 1.0]), 0.0
        for k, dwell in enumerate(self.dwells):
            rows.add(SETTLE if left else REST, dwell, at, axis, left, constants[k])
            if k + 1 == count:
                break
            at = at @ rotation(axis * left * -math.expm1(-dwell / constants[k]))
            turn = rotation_vector(at.T @ attitudes[k + 1])
            angle = float(np.linalg.norm(turn))
            axis = turn / angle if angle > 0 else axis
            left = min(angles[k + 1], angle / 2)
            rows.add(TURN, times[k], at, axis, angle - left, 1.0)
            at = at @ rotation(axis * (angle - left))
        return rows.pieces()

    def _rotating(self, at: Array) -> Pieces:
        """Revolution after revolution; between two of different sense the attitude goes on a little and comes back."""
        rows, axis, rate, left = _MotionPieces(), np.array([0.0, 0.0, 1.0]), self.spin, self.dwells[0]
        revolution = 2 * math.pi / abs(self.spin)
        while left > 1e-9:
            part = min(revolution, left)
            rows.add(SPIN, part, at, axis, rate, 1.0)
            at, left = at @ rotation(axis * math.remainder(rate * part, 2 * math.pi)), left - part
            if self.swap_time and left > 1e-9:
                part = min(self.swap_time, left)
                rows.add(SWAP, self.swap_time, at, axis, rate, 1.0)
                rate, left = -rate, left - part
        return rows.pieces(self.dwells[0])


class _MotionPieces:
    """Pieces as they come."""

    def __init__(self) -> None:
        self.rows: list[tuple[Any, ...]] = []

    def add(self, kind: int, length: float, at: Array, axis: Array, size: float, time: float) -> None:
        self.rows.append((kind, length, at, axis, size, time))

    def pieces(self, duration: float | None = None) -> Pieces:
        kind, length, first, axis, size, time = (np.array(x) for x in zip(*self.rows, strict=True))
        joints = np.concatenate([[0.0], np.cumsum(length)])
        if duration is not None:
            joints[-1] = duration
        return Pieces(
            start=joints[:-1], stop=joints[1:], kind=kind, first=first, axis=axis, size=size, time=time
        )


def _waves(size: float, turning: NDArray[np.bool_], chance: np.random.Generator) -> Waves | None:
    """Of a hand while it turns the unit: some sines in each direction, of random frequency and phase."""
    if not size:
        return None
    low, high = HAND
    shape = (len(turning), 3, WAVES)
    return Waves(
        size=np.where(turning[:, None, None], np.full(shape, size * math.sqrt(2 / WAVES)), 0.0),
        omega=2 * math.pi * low * (high / low) ** chance.uniform(size=shape),
        phase=chance.uniform(0, 2 * math.pi, size=shape),
    )


def _drawn(span: Span, chance: np.random.Generator, count: int) -> Array:
    low, high = span if isinstance(span, tuple) else (span, span)
    return np.asarray(low + (high - low) * chance.uniform(size=count))


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


# -- attitudes --------------------------------------------------------------------------------------------


def _icosahedron(poses: int) -> Array:
    """Directions, shape (poses, 3), from each to the nearest that is left."""
    golden = (1 + math.sqrt(5)) / 2
    signs = [(a, b) for a in (1, -1) for b in (1, -1)]
    corners = np.array([np.roll([0, a, b * golden], shift) for shift in range(3) for a, b in signs])
    faces = [np.roll([0, a / golden, b * golden], shift) for shift in range(3) for a, b in signs]
    faces += [np.array([a, b, c]) for a, b in signs for c in (1, -1)]
    near = [(i, j) for i in range(12) for j in range(i) if np.linalg.norm(corners[i] - corners[j]) < 2.1]
    known = {12: corners, 20: np.array(faces), 30: np.array([corners[i] + corners[j] for i, j in near])}
    if poses not in known:
        raise InputError(
            f"an icosahedron has 12 corners, 20 faces and 30 edges, not {poses!r}; UnitMotion.many(n) takes any number"
        )
    left = known[poses] / np.linalg.norm(known[poses], axis=1, keepdims=True)
    ordered = [left[0]]
    left = left[1:]
    while len(left):
        k = int(np.argmax(left @ ordered[-1]))
        ordered.append(left[k])
        left = np.delete(left, k, axis=0)
    return np.array(ordered)


def _downs(directions: Array) -> Array:
    """Attitudes with each direction of the unit down, each reached from the one before by the shortest way."""
    at = np.eye(3)
    out = []
    for direction in directions:
        turned = at @ direction
        turn = np.cross(turned, [0.0, 0.0, 1.0])
        length = float(np.linalg.norm(turn))
        angle = math.atan2(length, turned[2])
        at = rotation(turn / length * angle if length > 0 else [angle, 0.0, 0.0]) @ at
        out.append(at)
    return np.array(out)


def _matrix(attitude: ArrayLike) -> Array:
    given = np.asarray(attitude, dtype=np.float64)
    return given if given.shape == (3, 3) else attitude_of(*given.tolist())


# -- checks -----------------------------------------------------------------------------------------------


def _made(**options: Any) -> UnitMotion:
    known = [f.name for f in fields(UnitMotion)]
    strange = sorted(set(options) - set(known))
    if strange:
        raise InputError(f"a motion of a unit has no option {strange[0]!r}; there are: {', '.join(known)}")
    return UnitMotion(**options)


def _check(motion: UnitMotion) -> None:
    put = object.__setattr__
    put(motion, "attitudes", _attitudes(motion.attitudes))
    dwells = numbers("motion of a unit: dwells", motion.dwells)
    if len(dwells) != len(motion.attitudes) or min(dwells) <= 0:
        raise InputError(
            f"motion of a unit: {len(motion.attitudes)} attitudes need as many dwells of positive seconds, not "
            f"{motion.dwells!r}"
        )
    put(motion, "dwells", dwells)
    for name in ("turn_time", "settling_angle", "settling_time"):
        put(motion, name, span(f"motion of a unit: {name}", getattr(motion, name)))
    for name in ("pointing_sd", "tremor", "sway", "spin", "swap_time"):
        number = numbers(f"motion of a unit: {name}", getattr(motion, name))
        if len(number) != 1 or (name != "spin" and number[0] < 0):
            raise InputError(f"motion of a unit: {name} must be one number, not negative")
        put(motion, name, number[0])
    if np.min(motion.turn_time) <= 0 or np.min(motion.settling_time) <= 0:
        raise InputError("motion of a unit: turn_time and settling_time must be positive seconds")
    if np.min(motion.settling_angle) < 0:
        raise InputError("motion of a unit: settling_angle must not be negative")
    if motion.spin and len(dwells) > 1:
        raise InputError("motion of a unit: it either turns at a constant rate (spin) or stops at attitudes")


def _attitudes(given: ArrayLike) -> Array:
    """Matrices, read-only; from roll, pitch, heading where they come as such."""
    try:
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"attitudes must be numbers, not {given!r}") from None
    if array.ndim == 2 and array.shape[1] == 3:
        array = np.array([attitude_of(*row) for row in array.tolist()])
    if array.ndim != 3 or array.shape[1:] != (3, 3) or not len(array):
        raise InputError(
            "attitudes are rows of roll, pitch, heading [rad], shape (n, 3), or matrices, shape (n, 3, 3); "
            f"this has shape {array.shape}"
        )
    off = np.abs(array @ np.swapaxes(array, 1, 2) - np.eye(3)).max()
    if not (off < _ROTATION and (np.linalg.det(array) > 0).all()):
        raise InputError("attitudes must be rotation matrices: orthogonal, with determinant 1")
    array = array.copy()
    array.flags.writeable = False
    return array
