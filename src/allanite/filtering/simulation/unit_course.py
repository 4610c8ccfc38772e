# SPDX-License-Identifier: BSD-3-Clause
"""The course that a unit takes in one record: its attitude over time, and the exact means of what its triads see.

The course is a row of pieces, in each of which the unit turns about one axis that is fixed in it and, as the Earth
sees it, in space:

    C(t) = C_0 R(a theta(t)) R(d(t)),                                                                     (1)

C_0 being the attitude at the start of the piece, a the axis, R(v) the rotation about v by its length and d the tremor
of a hand. It sees the rotation and the specific force

    w = R(d)^T (R(a theta)^T C_0^T w_E + a theta') + J(d) d',     f = R(d)^T R(a theta)^T C_0^T (f_N + p''),    (2)

with the Earth's rotation w_E, the force f_N = -g of standing on it and the acceleration p'' of a hand that sways; J is
the right Jacobian of the rotation group [1, eq. 10.86].

Notes
-----
Where a sample is the mean over its interval, so is what is made here: the means of w and of f, not the turn over the
interval divided by its length, which differs by coning. Pieces at rest are constants; else each part of a sample that
lies within one piece is averaged by Gauss-Legendre quadrature, of 6 points where the piece changes little in that time
and of 40 else. A turn is the one of least jerk, with rate and acceleration zero at both ends.

References
----------
.. [1] G. S. Chirikjian, "Stochastic Models, Information Theory, and Lie Groups", vol. 2 (2012), section 10.6.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.simulation.course import FEW, MANY, SHORT, quadrature, split
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import angles_of, rotation

__all__ = ["REST", "SETTLE", "SPIN", "SWAP", "TURN", "Pieces", "Sensed", "UnitCourse", "Waves"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Kinds of pieces: at rest; creeping the last of a turn; turning; at a constant rate; from one sense to the other.
REST, SETTLE, TURN, SPIN, SWAP = range(5)
#: Quadrature of few points is good for so many seconds of a hand's tremor, times `SHORT`.
HAND_PACE = 0.8


class Sensed(NamedTuple):
    """What the two triads see, along forward, right and down, each of shape (n, 3)."""

    rate: Array  # [rad/s]
    force: Array  # [m/s^2]


class Waves(NamedTuple):
    """Sines of a hand in three directions: each of shape (n, 3, waves), for n pieces."""

    size: Array
    omega: Array  # [rad/s]
    phase: Array

    def values(self, i: Indices, s: Array, u: Array, span: Array) -> tuple[Array, Array, Array]:
        """The motion, its rate and its acceleration, each (m, nodes, 3); s [s] and u = s/span of shape (m, nodes).

        The sines are within (4 u (1 - u))^3, whose first two derivatives are zero at both ends.
        """
        angle = self.omega[i][:, None] * s[..., None, None] + self.phase[i][:, None]
        sine, cosine = self.size[i][:, None] * np.sin(angle), self.size[i][:, None] * np.cos(angle)
        omega = self.omega[i][:, None]
        x, v, a = sine.sum(axis=-1), (omega * cosine).sum(axis=-1), -(omega**2 * sine).sum(axis=-1)
        bump, slope = 4 * u * (1 - u), 4 * (1 - 2 * u)
        w = (bump**3)[..., None]
        w1 = (3 * bump**2 * slope / span)[..., None]
        w2 = ((6 * bump * slope**2 - 24 * bump**2) / span**2)[..., None]
        return w * x, w * v + w1 * x, w * a + 2 * w1 * v + w2 * x


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """n pieces one after the other, the last without end.

    Attributes
    ----------
    start, stop : ndarray, shape (n,) [s]
    kind : ndarray of int, shape (n,)
        REST, SETTLE, TURN, SPIN or SWAP.
    first : ndarray, shape (n, 3, 3)
        Attitude at the start: forward, right, down to north, east, down.
    axis : ndarray, shape (n, 3)
        Forward, right, down; of length one.
    size : ndarray, shape (n,)
        Angle of a turn, angle that settles [rad]; rate of a rotation, and before it swaps its sense [rad/s].
    time : ndarray, shape (n,) [s]
        Constant of the settling.
    """

    start: Array
    stop: Array
    kind: Indices
    first: Array
    axis: Array
    size: Array
    time: Array

    def angle(self, i: Indices, s: Array) -> tuple[Array, Array]:
        """theta and theta' of the pieces i, (m,), at the times s since their start, (m, nodes)."""
        theta, speed = np.zeros_like(s), np.zeros_like(s)
        for kind, law in _LAWS.items():
            at = np.flatnonzero(self.kind[i] == kind)
            if len(at):
                j = i[at]
                span, size, time = (x[j][:, None] for x in (self.stop - self.start, self.size, self.time))
                theta[at], speed[at] = law(s[at], span, size, time)
        return theta, speed

    @property
    def pace(self) -> Array:
        """Time in which a piece changes a lot [s]."""
        out = np.where(self.kind == SETTLE, self.time, self.stop - self.start)
        return np.where(self.kind == SPIN, 8 / np.maximum(np.abs(self.size), 1e-300), out)


def _settle(s: Array, span: Array, size: Array, time: Array) -> tuple[Array, Array]:
    return -size * np.expm1(-s / time), size / time * np.exp(-s / time)


def _turn(s: Array, span: Array, size: Array, time: Array) -> tuple[Array, Array]:
    u = s / span
    return size * u**3 * (10 - u * (15 - 6 * u)), size / span * 30 * (u * (1 - u)) ** 2


def _spin(s: Array, span: Array, size: Array, time: Array) -> tuple[Array, Array]:
    return size * s, size + 0 * s


def _swap(s: Array, span: Array, size: Array, time: Array) -> tuple[Array, Array]:
    u = np.pi * s / span
    return size * span / np.pi * np.sin(u), size * np.cos(u)


_LAWS = {SETTLE: _settle, TURN: _turn, SPIN: _spin, SWAP: _swap}


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitCourse:
    """What a motion of a unit became in one record.

    Attributes
    ----------
    pieces : Pieces
    tremor : Waves or None [rad]
    sway : Waves or None [m]
        North, east, down.
    """

    pieces: Pieces
    tremor: Waves | None = None
    sway: Waves | None = None

    @property
    def duration(self) -> float:
        """Length of the course [s]."""
        return float(self.pieces.stop[-1])

    def means(self, edges: Array, earth: Array, force: Array) -> Sensed:
        """Means over the intervals between successive instants [s]; `earth` and `force` in north, east, down."""
        points, first = split(edges, self.pieces.start[1:])
        sensed = self._sensed(points[:-1], points[1:], earth, force)
        if len(points) > len(edges):
            length = np.diff(points)[:, None]
            whole = np.add.reduceat(length, first)
            sensed = Sensed(*(np.add.reduceat(x * length, first) / whole for x in sensed))
        return sensed

    def values(self, t: Array, earth: Array, force: Array) -> Sensed:
        """Values at instants [s]."""
        return self._sensed(t, t, earth, force)

    def attitudes(self, t: Array) -> Array:
        """Attitudes at instants [s], shape (n, 3, 3): forward, right, down to north, east, down."""
        i = self._place(t)
        s = (t - self.pieces.start[i])[:, None]
        theta, _ = self.pieces.angle(i, s)
        out = self.pieces.first[i] @ rotation(self.pieces.axis[i] * theta)
        if self.tremor is not None:
            span = (self.pieces.stop - self.pieces.start)[i][:, None]
            out = out @ rotation(self.tremor.values(i, s, s / span, span)[0][:, 0])
        return np.asarray(out)

    def to_json(self) -> dict[str, Any]:
        """Plain data: the positions at rest with their attitude, and the turns [s, rad]."""
        p = self.pieces
        return {
            "positions": [
                {**self._span(k), **_attitude(p.first[k] @ rotation(p.axis[k] * p.size[k]))}
                for k in np.flatnonzero((p.kind == REST) | (p.kind == SETTLE)).tolist()
            ],
            "turns": [
                {**self._span(k), "turn": (p.axis[k] * p.size[k]).tolist()}
                for k in np.flatnonzero(p.kind == TURN).tolist()
            ],
            "rotations": [
                {**self._span(k), "rate": (p.axis[k] * p.size[k]).tolist(), **_attitude(p.first[k])}
                for k in np.flatnonzero(p.kind == SPIN).tolist()
            ],
        }

    def _span(self, k: int) -> dict[str, float]:
        return {"start": float(self.pieces.start[k]), "stop": float(self.pieces.stop[k])}

    # -- parts of a sample, each within one piece -----------------------------------------------------------

    def _place(self, t: Array) -> Indices:
        return np.maximum(np.searchsorted(self.pieces.start, t, side="right") - 1, 0)

    def _sensed(self, a: Array, b: Array, earth: Array, force: Array) -> Sensed:
        """Means from a to b, both within the piece that holds a; values where they are equal."""
        p = self.pieces
        i = self._place(a)
        still = Sensed(np.swapaxes(p.first, 1, 2) @ earth, np.swapaxes(p.first, 1, 2) @ force)
        out = Sensed(still.rate[i], still.force[i])
        short = b - a <= SHORT * self._pace()[i]
        for some, nodes in ((short, FEW), (~short, MANY)):
            at = np.flatnonzero((p.kind[i] != REST) & some)
            shaken = (p.kind[i[at]] == TURN) & (self.tremor is not None or self.sway is not None)
            for chosen, way in ((at[~shaken], self._turning), (at[shaken], self._in_hand)):
                if len(chosen):
                    parts = way(
                        i[chosen], a[chosen], b[chosen], nodes, out.rate[chosen], (out.force[chosen], force)
                    )
                    out.rate[chosen], out.force[chosen] = parts
        return out

    def _pace(self) -> Array:
        if self.tremor is None and self.sway is None:
            return self.pieces.pace
        return np.where(self.pieces.kind == TURN, np.minimum(self.pieces.pace, HAND_PACE), self.pieces.pace)

    def _nodes(self, i: Indices, a: Array, b: Array, count: int) -> tuple[Array, Array]:
        nodes, weights = quadrature(count)
        return (a - self.pieces.start[i])[:, None] + (b - a)[:, None] * nodes, weights

    def _turning(
        self, i: Indices, a: Array, b: Array, count: int, earth: Array, forces: tuple[Array, Array]
    ) -> Sensed:
        """About one axis: only the cosine, the sine and the speed have to be averaged."""
        s, weights = self._nodes(i, a, b, count)
        theta, speed = self.pieces.angle(i, s)
        axis, cos, sin = self.pieces.axis[i], np.cos(theta) @ weights, np.sin(theta) @ weights
        rate = _back(earth, axis, cos, sin) + axis * (speed @ weights)[:, None]
        return Sensed(rate, _back(forces[0], axis, cos, sin))

    def _in_hand(
        self, i: Indices, a: Array, b: Array, count: int, earth: Array, forces: tuple[Array, Array]
    ) -> Sensed:
        """Equation (2) at every node."""
        s, weights = self._nodes(i, a, b, count)
        span = (self.pieces.stop - self.pieces.start)[i][:, None]
        theta, speed = self.pieces.angle(i, s)
        axis, cos, sin = self.pieces.axis[i][:, None], np.cos(theta), np.sin(theta)
        force = np.broadcast_to(forces[0][:, None], (*s.shape, 3))
        if self.sway is not None:
            moved = self.sway.values(i, s, s / span, span)[2]
            force = force + np.einsum("kji,kqj->kqi", self.pieces.first[i], moved)
        rate = _back(np.broadcast_to(earth[:, None], (*s.shape, 3)), axis, cos, sin) + axis * speed[..., None]
        force = _back(force, axis, cos, sin)
        if self.tremor is not None:
            d, d1, _ = self.tremor.values(i, s, s / span, span)
            rate, force = _turned_back(rate, d) + _jacobian(d, d1), _turned_back(force, d)
        return Sensed(np.einsum("kqi,q->ki", rate, weights), np.einsum("kqi,q->ki", force, weights))


def _back(v: Array, axis: Array, cos: Array, sin: Array) -> Array:
    """R(axis angle)^T v."""
    along = (axis * v).sum(axis=-1, keepdims=True) * axis
    return np.asarray(along + cos[..., None] * (v - along) - sin[..., None] * np.cross(axis, v))


def _turned_back(v: Array, d: Array) -> Array:
    """R(d)^T v."""
    angle = np.linalg.norm(d, axis=-1)
    axis = d / np.where(angle > 0, angle, 1.0)[..., None]
    return _back(v, axis, np.cos(angle), np.sin(angle))


def _jacobian(d: Array, d1: Array) -> Array:
    """J(d) d', the rate of R(d) in the axes that R(d) turns; to rounding for a tremor below 0.1 rad."""
    first = np.cross(d, d1)
    second = np.cross(d, first)
    square = (d**2).sum(axis=-1, keepdims=True)
    half = 0.5 - square / 24 * (1 - square / 30 * (1 - square / 56))
    sixth = 1 / 6 - square / 120 * (1 - square / 42 * (1 - square / 72))
    return np.asarray(d1 - half * first + sixth * second)


def _attitude(matrix: Array) -> dict[str, Any]:
    roll, pitch, heading = angles_of(matrix)
    return {"roll": roll, "pitch": pitch, "heading": heading % (2 * math.pi), "attitude": matrix.tolist()}
