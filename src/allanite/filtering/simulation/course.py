# SPDX-License-Identifier: BSD-3-Clause
"""The course that a motion takes in one record: headings and rotation as functions of time, and their means.

Notes
-----
Where a sample is the mean over its interval, so is what is made here. Between turns everything has a closed form:
the cosine of a heading that changes at a constant rate, the exponential of a settling box, a knock. During a turn
the heading is a smooth curve, and its cosine is averaged by Gauss-Legendre quadrature on each piece of a sample that
lies within the turn, of 6 points where that piece is less than a sixteenth of the turn and of 40 else: exact to
rounding (1e-14) at either.

A turn from u = 0 to 1 is the one of least jerk [1], 10 u^3 - 15 u^4 + 6 u^5, and the hand's departures from it, sums
of sin^2(pi k u): the angle turned and the standstill at both ends do not depend on them.

References
----------
.. [1] T. Flash, N. Hogan, "The coordination of arm movements", J. Neuroscience 5 (1985) 1688.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["FEW", "MANY", "SHORT", "Course", "Felt", "Turns", "mean_decay", "quadrature", "split"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Points of quadrature in a piece of a turn of less than this part of it, and in a longer one.
SHORT, FEW, MANY = 1 / 16, 6, 40


class Felt(NamedTuple):
    """What a stretch of the course gives to an axis, each of shape (n,)."""

    cos: Array  # of the table's heading
    sin: Array
    rate: Array  # rotation about the sensitive axis, without the Earth's [rad/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class Turns:
    """n turns and the n + 1 positions around them.

    Attributes
    ----------
    start, stop : ndarray, shape (n,) [s]
        Equal for a turn that was missed.
    heading, nominal : ndarray, shape (n + 1,) [rad]
        Where the table really points, and where the operator means it to; without the jumps of 2 pi.
    hand : ndarray, shape (n, 3)
        Departures from the smoothest turn, as parts of its angle.
    settling_angle, settling_time : ndarray, shape (n + 1,) [rad], [s]
    last : ndarray of int, shape (n + 1,)
        Number of the last turn, counted from 1, that was not missed; 0 before the first.
    """

    start: Array
    stop: Array
    heading: Array
    nominal: Array
    hand: Array
    settling_angle: Array
    settling_time: Array
    last: Indices

    @property
    def joints(self) -> Array:
        """Starts and stops in order: position, turn, position, ..."""
        return np.stack([self.start, self.stop], axis=1).ravel()

    @property
    def angle(self) -> Array:
        """True angle of each turn [rad]."""
        return np.diff(self.heading)

    @property
    def settling(self) -> tuple[Array, Array, Array]:
        """Angle with its sign, time constant, start, of each position."""
        sign = np.concatenate([[0.0], np.sign(self.angle)])[self.last]
        since = np.concatenate([[0.0], self.stop])[self.last]
        return sign * self.settling_angle[self.last], self.settling_time[self.last], since


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """What a motion became in one record.

    Attributes
    ----------
    duration : float [s]
    spin : float [rad/s]
    coupling : float
        Rate about the sensitive axis over rate of the heading.
    turns : Turns
    knocks : ndarray, shape (m,) [s]
        Their starts.
    knock_size, knock_length : float [rad/s], [s]
    """

    duration: float
    spin: float
    coupling: float
    turns: Turns
    knocks: Array
    knock_size: float
    knock_length: float

    def means(self, edges: Array) -> Felt:
        """Means over the intervals between successive instants [s]."""
        points, first = split(edges, self.turns.joints)
        pieces = self._pieces(points[:-1], points[1:])
        if len(points) > len(edges):
            length = np.diff(points)
            whole = np.add.reduceat(length, first)
            pieces = Felt(*(np.add.reduceat(x * length, first) / whole for x in pieces))
        self._knock(pieces.rate, edges[:-1], edges[1:])
        return pieces

    def values(self, t: Array) -> Felt:
        """Values at instants [s]."""
        felt = self._pieces(t, t)
        self._knock(felt.rate, t, t)
        return felt

    def to_json(self) -> dict[str, Any]:
        """Plain data: turns, positions, missed turns and knocks [s, rad]."""
        turns = self.turns
        done = np.flatnonzero(turns.stop > turns.start)
        angle, (settling, settling_time, _) = turns.angle, turns.settling
        return {
            "turns": [
                {
                    "start": float(turns.start[i]),
                    "stop": float(turns.stop[i]),
                    "angle": float(angle[i]),
                    "settling_angle": float(settling[i + 1]),
                    "settling_time": float(settling_time[i + 1]),
                }
                for i in done
            ],
            "positions": [
                {"start": start, "stop": stop, "heading": heading, "nominal": nominal}
                for start, stop, heading, nominal in zip(
                    [0.0, *turns.stop.tolist()],
                    [*turns.start.tolist(), self.duration],
                    np.mod(turns.heading, 2 * math.pi).tolist(),
                    np.mod(turns.nominal, 2 * math.pi).tolist(),
                    strict=True,
                )
            ],
            "missed": turns.start[turns.stop == turns.start].tolist(),
            "knocks": [{"start": t, "stop": t + self.knock_length} for t in self.knocks.tolist()],
        }

    # -- pieces, each within one position or one turn -----------------------------------------------------

    def _pieces(self, a: Array, b: Array) -> Felt:
        """Means from a to b, both within the position or turn that holds a; values where they are equal."""
        place = np.searchsorted(self.turns.joints, a, side="right")
        felt = self._resting(place // 2, a, b)
        turning = np.flatnonzero(place % 2)
        turn = place[turning] // 2
        short = (b - a)[turning] < SHORT * (self.turns.stop - self.turns.start)[turn]
        for some, nodes in ((short, FEW), (~short, MANY)):
            at = turning[some]
            if len(at):
                for whole, part in zip(felt, self._turning(turn[some], a[at], b[at], nodes), strict=True):
                    whole[at] = part
        return felt

    def _resting(self, position: Indices, a: Array, b: Array) -> Felt:
        turns = self.turns
        if self.spin:
            heading = turns.heading[position] + self.spin * (a + b) / 2
            shrunk = np.sinc(self.spin * (b - a) / (2 * math.pi))
            cos, sin = shrunk * np.cos(heading), shrunk * np.sin(heading)
        else:
            cos, sin = np.cos(turns.heading)[position], np.sin(turns.heading)[position]
        rate = np.full(len(a), self.coupling * self.spin)
        if turns.settling_angle.any():
            size, constant, since = (x[position] for x in turns.settling)
            rate += size / constant * np.exp((since - a) / constant) * mean_decay((b - a) / constant)
        return Felt(cos, sin, rate)

    def _turning(self, turn: Indices, a: Array, b: Array, count: int) -> Felt:
        nodes, weights = quadrature(count)
        start, span = self.turns.start[turn], (self.turns.stop - self.turns.start)[turn]
        angle, hand = self.turns.angle[turn], self.turns.hand[turn]
        u = ((a - start)[:, None] + (b - a)[:, None] * nodes) / span[:, None]
        heading = self.turns.heading[turn][:, None] + angle[:, None] * _progress(u, hand)
        rate = (self.coupling * angle / span)[:, None] * _speed(u, hand)
        return Felt(np.cos(heading) @ weights, np.sin(heading) @ weights, rate @ weights)

    def _knock(self, rate: Array, a: Array, b: Array) -> None:
        """Add the knocks: size sin(2 pi u) from u = 0 to 1."""
        for t in self.knocks:
            near = slice(int(np.searchsorted(b, t)), int(np.searchsorted(a, t + self.knock_length)))
            u, v = ((x[near] - t) / self.knock_length for x in (a, b))
            rate[near] += self.knock_size * _mean_of_period(np.clip(u, 0, 1), np.clip(v, 0, 1), v - u)


def split(edges: Array, joints: Array) -> tuple[Array, Indices]:
    """Edges and the joints between them; where in that the samples begin."""
    low, high = np.searchsorted(joints, edges[[0, -1]])
    inside = np.unique(joints[low:high])
    at = np.searchsorted(edges, inside)
    new = edges[at] != inside
    at, inside = at[new], inside[new]
    before = np.searchsorted(inside, edges[:-1])
    return np.insert(edges, at, inside), np.arange(len(edges) - 1) + before


def mean_decay(x: Array) -> Array:
    """Mean of exp(-s) for s from 0 to x."""
    safe = np.where(x > 0, x, 1.0)
    return np.where(x > 0, -np.expm1(-safe) / safe, 1.0)


def _mean_of_period(u: Array, v: Array, whole: Array) -> Array:
    """Integral of sin(2 pi s) for s from u to v, over `whole`; its value at u where that is nothing."""
    safe = np.where(whole > 0, whole, 1.0)
    mean = np.sin(np.pi * (u + v)) * np.sin(np.pi * (v - u)) / (np.pi * safe)
    return np.where(whole > 0, mean, np.sin(2 * np.pi * u))


def _progress(u: Array, hand: Array) -> Array:
    """Part of the turn done; u of shape (n, nodes), hand of shape (n, 3)."""
    smooth = u**3 * (10 - u * (15 - 6 * u))
    return smooth + _sum(lambda k: np.sin(np.pi * k * u) ** 2, hand)


def _speed(u: Array, hand: Array) -> Array:
    """Its derivative."""
    smooth = 30 * (u * (1 - u)) ** 2
    return smooth + _sum(lambda k: np.pi * k * np.sin(2 * np.pi * k * u), hand)


def _sum(shape: Callable[[int], Array], hand: Array) -> Array:
    parts = [size[:, None] * shape(k) for k, size in enumerate(hand.T, start=1)]
    return np.asarray(sum(parts), dtype=np.float64)


@cache
def quadrature(count: int) -> tuple[Array, Array]:
    """Nodes on [0, 1] and weights of sum 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2
