# SPDX-License-Identifier: BSD-3-Clause
"""Every noise term of every axis, and every initial error, as one scalar process that enters the error model.

Notes
-----
The error of a sensor along the unit vector c (of north, east, down) enters the navigation through b: -c in the rows of
the attitude for a gyro, +c in those of the velocity for an accelerometer. It is white noise of density w^2, or a state

    s' = -s/T + d + q n,    d' = -o^2 s,                                                                   (1)

in continuous time, which is what the Markov forms of `allanite.noise` are exact samples of: a walk has 1/T = 0, a
Gauss-Markov term starts stationary, a ramp is a constant d of known size, a sinusoid an oscillation of random phase,
a bias a constant s. Flicker is the sum of Gauss-Markov states that filter and simulation use, a ratio sqrt(10) apart,
from a tenth of a sample to five times the whole length; slower ones are one walk, which starts at zero: a constant
level that 1/f noise has besides belongs to the turn-on bias. States faster than a tenth of a sample are white.

Quantisation is the difference of white errors e of the angle (or the velocity). With x = x* + b e the state x* is
driven by A b e, e white of density Q^2 dt, and starts at -b e(0).

At rest before the start, for a time T_0, the mean m of each sensor is taken (m' = s/T_0). The gyros' means, less the
rotation of the Earth as the attitude of the start says it, are removed; the accelerometers' means level the unit,
phi_E = -m_N/g, phi_N = m_E/g. That along the vertical differs from gravity by the bias there; it is removed only on
request (`StartingPoint.vertical`), for few navigators do so and it decides what the height is worth.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.dead_reckoning.dynamics import (
    ATTITUDE,
    HEIGHT,
    NAVIGATION,
    POSITION,
    VELOCITY,
    error_dynamics,
)
from allanite.experiments.dead_reckoning.propagation import covariances
from allanite.experiments.dead_reckoning.results import InitialErrors
from allanite.lazy_dataclasses import dataclass
from allanite.noise import (
    Flicker,
    GaussMarkov,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.noise.terms import FORGETFUL, SLOW_RECORDS
from allanite.quantities.earth import earth_rate_vector, normal_gravity

__all__ = ["AxisProcess", "StartingPoint", "initial_processes", "term_processes", "variances"]

Array = NDArray[np.float64]

_RATIO = math.sqrt(10)
_S, _D, _M = NAVIGATION, NAVIGATION + 1, NAVIGATION + 2
_SIZE = NAVIGATION + 3
_NONE = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisProcess:
    """One scalar process of one axis.

    Attributes
    ----------
    gyro : bool
        Of a gyro, not of an accelerometer.
    along : ndarray, shape (3,)
        c.
    white : float
        w^2.
    decay, frequency : float [1/s], [rad/s]
        1/T and o of eq. (1).
    drive : float
        q^2.
    start : (float, float)
        Variances of s and d.
    quantum, interval : float
        Q, and the interval of its samples [s].
    begins : ndarray, shape (9,), or None
        An initial error of the navigation in place of a sensor's.
    """

    gyro: bool = True
    along: Array
    white: float = 0.0
    decay: float = 0.0
    frequency: float = 0.0
    drive: float = 0.0
    start: tuple[float, float] = _NONE
    quantum: float = 0.0
    interval: float = 0.0
    begins: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StartingPoint:
    """Where and how the dead reckoning begins.

    Attributes
    ----------
    latitude : float [rad]
    rest : float or None [s]
    held : bool
        The height is known.
    vertical : bool
        The mean of the vertical accelerometer at rest, less gravity, is removed.
    """

    latitude: float
    rest: float | None
    held: bool = False
    vertical: bool = False

    @property
    def earth(self) -> Array:
        """Rotation of the Earth in north, east, down [rad/s]."""
        return earth_rate_vector(self.latitude)

    @property
    def gravity(self) -> float:
        """Normal gravity [m/s^2]."""
        return normal_gravity(self.latitude)


# -- noise ------------------------------------------------------------------------------------------------------


def term_processes(term: TermType, *, gyro: bool, along: Array, dt: float, span: float) -> list[AxisProcess]:
    """The processes of one term on one axis; `dt` [s] is the sample interval, `span` [s] the whole length."""
    base = AxisProcess(gyro=gyro, along=along)
    match term:
        case White():
            return [replace(base, white=term.N**2)]
        case RandomWalk():
            return [replace(base, drive=term.K**2)]
        case GaussMarkov():
            return [_gauss_markov(base, term)]
        case Flicker():
            return _flicker(base, term, dt, span)
        case Ramp():
            return [replace(base, start=(0.0, term.R**2))]
        case Quantisation():
            return [replace(base, quantum=term.Q, interval=term.dt)]
        case Sinusoid():
            turn, size = 2 * math.pi * term.frequency, term.amplitude**2 / 2
            return [replace(base, frequency=turn, start=(size, size * turn**2))]


def _gauss_markov(base: AxisProcess, term: GaussMarkov) -> AxisProcess:
    return replace(base, decay=1 / term.T, drive=term.q**2, start=(term.sigma**2, 0.0))


def _flicker(base: AxisProcess, term: Flicker, dt: float, span: float) -> list[AxisProcess]:
    """The band of `Flicker.markov`, in continuous time."""
    longest = SLOW_RECORDS * max(span, dt)
    steps = math.ceil(math.log(longest / dt * FORGETFUL**10) / math.log(_RATIO))
    parts = term.gauss_markov_sum(longest * _RATIO ** (0.5 - steps), longest * FORGETFUL**10, _RATIO)
    fast = sum((g.q * g.T) ** 2 for g in parts if dt / FORGETFUL >= g.T)
    slow = sum(g.q**2 for g in parts if longest < g.T)
    middle = [_gauss_markov(base, g) for g in parts if dt / FORGETFUL < g.T <= longest]
    return [replace(base, white=fast), *middle, replace(base, drive=slow)]


# -- initial errors -----------------------------------------------------------------------------------------------


def initial_processes(
    initial: InitialErrors, axes: Array, place: StartingPoint, sensors: Sequence[str]
) -> Iterator[tuple[str, str, list[AxisProcess]]]:
    """Name, sensor and processes of each initial error that is not zero.

    Parameters
    ----------
    axes : ndarray, shape (3, 3)
        Of the sensors, as rows, along north, east, down.
    """
    for name, size, rows in (
        ("position", initial.position, POSITION),
        ("velocity", initial.velocity, VELOCITY),
        ("tilt", initial.tilt, slice(6, 8)),
        ("heading", initial.heading, slice(8, 9)),
    ):
        vectors = size * np.eye(NAVIGATION)[rows]
        if place.held:
            vectors[:, HEIGHT] = 0.0
        if size > 0:
            yield f"initial {name}", "", [AxisProcess(along=np.zeros(3), begins=v) for v in vectors]
    felt = {"gyro": place.earth, "accelerometer": np.array([0.0, 0.0, -place.gravity])}
    for sensor in sensors:
        inputs = axes @ felt[sensor]
        across = np.sqrt(np.maximum((inputs**2).sum() - inputs**2, 0.0))
        kinds = (("bias", "turn-on bias", np.ones(3)), ("scale", "scale factor", inputs))
        for key, words, per in (*kinds, ("misalignment", "misalignment", across)):
            size = getattr(initial, f"{sensor}_{key}")
            left = 0.0 if sensor == "gyro" and place.rest is not None else size  # a mean takes a constant off
            if size > 0:
                made = [
                    AxisProcess(gyro=sensor == "gyro", along=c, start=((left * p) ** 2, 0.0))
                    for c, p in zip(axes, per, strict=True)
                ]
                yield f"{sensor} {words}", sensor, made


# -- into the navigation --------------------------------------------------------------------------------------------


def variances(groups: Sequence[Sequence[AxisProcess]], place: StartingPoint, times: Array) -> list[Array]:
    """Variances of the nine states over time, shape (m, 9), summed over the processes of each group."""
    processes = [p for group in groups for p in group]
    if not processes:
        return [np.zeros((len(times), NAVIGATION)) for _ in groups]
    a = error_dynamics(place.latitude, held=place.held)
    systems = [_system(p, a, place) for p in processes]
    dynamics, drive, start = (np.stack(part) for part in zip(*systems, strict=True))
    joint_covariances = covariances(dynamics, drive, start, times)
    process_variances = np.diagonal(joint_covariances, axis1=-2, axis2=-1)[..., :NAVIGATION] + np.stack(
        [(p.quantum * _entry(p, place.held)) ** 2 for p in processes]
    )
    # what a rest takes off leaves rounding, of either sign
    process_variances = np.maximum(process_variances, 0.0)
    ends = np.cumsum([len(group) for group in groups])
    return [
        process_variances[:, end - len(group) : end].sum(axis=1)
        for group, end in zip(groups, ends.tolist(), strict=True)
    ]


def _entry(p: AxisProcess, held: bool) -> Array:
    """b: how the error of a sensor enters the navigation."""
    b = np.zeros(NAVIGATION)
    b[ATTITUDE if p.gyro else VELOCITY] = -p.along if p.gyro else p.along
    if held:
        b[HEIGHT] = 0.0
    return b


def _system(p: AxisProcess, a: Array, place: StartingPoint) -> tuple[Array, Array, Array]:
    """Dynamics, drive and start of navigation, s, d and m."""
    b, j = _entry(p, place.held), np.zeros(NAVIGATION)
    f, w = np.zeros((_SIZE, _SIZE)), np.zeros((_SIZE, _SIZE))
    f[:NAVIGATION, :NAVIGATION], f[:NAVIGATION, _S] = a, b
    f[_S, _S], f[_S, _D], f[_D, _S] = -p.decay, 1.0, -(p.frequency**2)
    w[_S, _S] = p.drive
    noisy = math.sqrt(p.white) * b + p.quantum * math.sqrt(p.interval) * (a @ b)
    w[:NAVIGATION, :NAVIGATION] = np.outer(noisy, noisy)
    begins = _rested(p, place.rest)
    if place.rest is not None:
        j, f[:NAVIGATION, _M] = _corrected(p, a, b, place)
    if p.begins is not None:  # a constant of size 1 holds it, for what a rest makes of it
        j, begins[_M, _M] = p.begins, 1.0
    carry = np.eye(_SIZE)
    carry[:NAVIGATION, _M] = j
    start = carry @ begins @ carry.T
    if p.quantum > 0:
        start += _quantised(p, b, j, place.rest)
    return f, w, start


def _corrected(p: AxisProcess, a: Array, b: Array, place: StartingPoint) -> tuple[Array, Array]:
    """What a mean of 1 at rest makes of the navigation at the start, and what it adds to its drift from then on."""
    begun, drift = np.zeros(NAVIGATION), np.zeros(NAVIGATION)
    if p.begins is not None:
        begun = p.begins
    elif p.gyro:
        drift = -b
    else:
        begun[6:8] = p.along[1] / place.gravity, -p.along[0] / place.gravity
        drift[5] = -b[5] if place.vertical else 0.0
    # rotation of the Earth and gravity are removed as the wrong place and attitude say them: these do not drift yet
    at_rest = np.delete(begun, VELOCITY)
    drift[5:] -= np.delete(a, VELOCITY, axis=1)[5:] @ at_rest
    return begun, drift


def _rested(p: AxisProcess, rest: float | None) -> Array:
    """Covariance of s, d and m at the start, shape (12, 12)."""
    sensor_states, begins = slice(_S, None), np.zeros((_SIZE, _SIZE))
    begins[_S, _S], begins[_D, _D] = p.start
    if rest is not None and p.begins is None:
        f, w = np.zeros((3, 3)), np.zeros((3, 3))
        f[0, 0], f[0, 1], f[1, 0], f[2, 0] = -p.decay, 1.0, -(p.frequency**2), 1 / rest
        w[0, 0], w[2, 2] = p.drive, p.white / rest**2
        rested_covariance = covariances(
            f[None], w[None], begins[sensor_states, sensor_states][None], np.array([rest])
        )
        begins[sensor_states, sensor_states] = rested_covariance[0, 0]
    return begins


def _quantised(p: AxisProcess, b: Array, j: Array, rest: float | None) -> Array:
    """Covariance at the start by the errors e of the angle at both ends of the rest."""
    now, before = np.zeros(_SIZE), np.zeros(_SIZE)
    now[:NAVIGATION] = -b
    if rest is not None:
        for vector, sign in ((now, 1.0), (before, -1.0)):
            vector[_M] = sign / rest
            vector[:NAVIGATION] += sign / rest * j
    return np.asarray(p.quantum**2 * (np.outer(now, now) + np.outer(before, before)))
