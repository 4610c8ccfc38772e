# SPDX-License-Identifier: BSD-3-Clause
"""The rotation between static spans by the gyros, and what it owes to each of their parameters and to their noise.

The rates between two spans are integrated to the rotation D from the body after the turn to the body before it,
against inertial space (`allanite.quantities.attitude.with_coning`). A small error dw(t) of the rates adds the rotation
vector

    integral of R(t) dw(t) dt,                                                                            (1)

in the axes of the body before the turn, R(t) taking the body at t there. So few moments of a turn hold everything:
the integrals of R, of R_ab x_c, of R_ab (T - T_0) and, of gyros that follow gravity, of R_ab f_c.
"""

from __future__ import annotations

from dataclasses import field, fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import accumulated, with_coning
from allanite.recording.calibration import TriadErrors

__all__ = ["Moments", "Turning", "TurningSamples", "constant_rate_turns"]

Array = NDArray[np.float64]

#: Steps of a turn that is not measured but planned.
PLANNED_STEPS = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Moments:
    """Integrals over m turns.

    Attributes
    ----------
    rotation : ndarray, shape (m, 3, 3)
        D.
    first : ndarray, shape (m, 3, 3) [s]
        Integral of R.
    rate : ndarray, shape (m, 3, 3, 3) [rad]
        Integral of R_ab x_c.
    warm : ndarray, shape (m, 3, 3) [K s]
        Integral of R (T - T_0).
    force : ndarray, shape (m, 3, 3, 3) [m/s]
        Integral of R_ab f_c, f being the specific force; without columns c where it is not asked for.
    """

    rotation: Array
    first: Array
    rate: Array
    warm: Array
    force: Array


class Turning(Protocol):
    """Turns whose rates can be integrated under any errors of the gyros."""

    def integrate(self, errors: TriadErrors, *, force: bool = False) -> Moments:
        """Moments of every turn; that of the specific force where it is asked for."""
        ...

    def white(self, errors: TriadErrors, density: Array) -> Array:
        """Covariance of (1) for white noise of y with densities N^2, shape (3,): shape (3 m, 3 m) [rad^2]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningSamples:
    """Samples of the gyros between the spans.

    Attributes
    ----------
    y : ndarray, shape (n, 3)
        The samples of all turns, one turn after the other.
    warmer : ndarray, shape (n,) [K]
    edges : ndarray of int64, shape (m + 1,)
        Where each turn begins in y.
    dt : ndarray, shape (m,) [s]
        Sample interval of each turn.
    force : ndarray, shape (n, 3) [m/s^2], or None
        True specific force on the unit, for gyros that follow it; None where there are no accelerometers.
    weight : ndarray, shape (n,), or None
        Of each sample in the integral; None: all count whole. Where the turns go from the mean attitude of one span to
        that of the next, it rises from 0 to 1 over the first and falls over the second: to first order in the
        wandering within a span, that is the rotation between the two means.
    shared : ndarray of int64, shape (m,), or None
        First samples of each turn that are the last of the turn before it as well; None: no turn shares any.
    last : list
        The errors that were asked for last, as bytes, with what they give: moments and noise are asked for together.
    """

    y: Array
    warmer: Array
    edges: NDArray[np.int64]
    dt: Array
    force: Array | None = None
    weight: Array | None = None
    shared: NDArray[np.int64] | None = None
    last: list[tuple[bytes, tuple[Array, Array, Array]]] = field(
        init=False, repr=False, compare=False, default_factory=list
    )

    @property
    def _seconds(self) -> Array:
        """Of each sample in the integral, shape (n,)."""
        length = np.repeat(self.dt, np.diff(self.edges))
        return np.asarray(length if self.weight is None else length * self.weight)

    def _rotations(self, errors: TriadErrors) -> tuple[Array, Array, Array]:
        """D of each turn, R at the middle of each sample, and the rates."""
        key = b"".join(np.asarray(getattr(errors, f.name)).tobytes() for f in fields(errors))
        if not self.last or self.last[0][0] != key:
            self.last[:] = [(key, self._integrated(errors))]
        return self.last[0][1]

    def _integrated(self, errors: TriadErrors) -> tuple[Array, Array, Array]:
        x = errors.true(self.y, self.warmer, self.force)
        turned = with_coning(x * self._seconds[:, None], self.edges)
        ends, middle = np.empty((len(self.dt), 3, 3)), np.empty((len(x), 3, 3))
        for k, (a, b) in enumerate(zip(self.edges[:-1], self.edges[1:], strict=True)):
            running = accumulated(turned[a:b])
            ends[k] = running[-1]
            middle[a:b] = (running[1:] + running[:-1]) / 2
        return ends, middle, x

    def _sums(self, values: Array) -> Array:
        """Integrals over each turn, of shape (m, ...)."""
        if len(self.dt) == 0:
            return np.zeros((0, *values.shape[1:]))
        if self.weight is not None:
            values = values * self.weight.reshape(-1, *[1] * (values.ndim - 1))
        total = np.add.reduceat(values, self.edges[:-1], axis=0)
        total[np.diff(self.edges) == 0] = 0.0
        return np.asarray(total * self.dt.reshape(-1, *[1] * (values.ndim - 1)))

    def integrate(self, errors: TriadErrors, *, force: bool = False) -> Moments:
        ends, r, x = self._rotations(errors)
        flat, m = r.reshape(-1, 9), len(ends)
        columns = [flat, *(flat * x[:, c : c + 1] for c in range(3))]
        columns += [flat * self.warmer[:, None]] * bool(self.warmer.any())
        if force and self.force is not None:
            columns += [flat * self.force[:, c : c + 1] for c in range(3)]
        sums = [self._sums(c).reshape(m, 3, 3) for c in columns]
        first, rate, rest = sums[0], np.stack(sums[1:4], axis=-1), sums[4:]
        warm = rest.pop(0) if self.warmer.any() else np.zeros_like(first)
        along = np.stack(rest, axis=-1) if rest else np.zeros((m, 3, 3, 0))
        return Moments(rotation=ends, first=first, rate=rate, warm=warm, force=along)

    def white(self, errors: TriadErrors, density: Array) -> Array:
        _, r, _ = self._rotations(errors)
        half = r @ (np.linalg.inv(errors.matrix) * np.sqrt(density))
        half *= (self._seconds / np.sqrt(np.repeat(self.dt, np.diff(self.edges))))[:, None, None]
        m, begin = len(self.dt), self.edges
        out = np.zeros((m, 3, m, 3))
        for k in range(m):
            factors = half[begin[k] : begin[k + 1]]
            out[k, :, k] = np.einsum("nij,nkj->ik", factors, factors)
            if self.shared is not None and self.shared[k]:
                count = self.shared[k]
                out[k, :, k - 1] = np.einsum(
                    "nij,nkj->ik", factors[:count], half[begin[k] - count : begin[k]]
                )
                out[k - 1, :, k] = out[k, :, k - 1].T
        return out.reshape(3 * m, 3 * m)


def constant_rate_turns(vectors: Array, seconds: Array) -> TurningSamples:
    """Turns about fixed axes of the body at a constant rate, for planning.

    Parameters
    ----------
    vectors : ndarray, shape (m, 3) [rad]
        Rotation vectors.
    seconds : ndarray, shape (m,) [s]
    """
    rates = vectors / seconds[:, None]
    count = len(vectors) * PLANNED_STEPS
    return TurningSamples(
        y=np.repeat(rates, PLANNED_STEPS, axis=0),
        warmer=np.zeros(count),
        edges=np.arange(0, count + 1, PLANNED_STEPS, dtype=np.int64),
        dt=seconds / PLANNED_STEPS,
    )
