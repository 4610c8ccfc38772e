# SPDX-License-Identifier: BSD-3-Clause
"""Records of a unit that a person holds in the hand: rests that tremble and drift, turns between them, lost samples.

The body turns by the rates that the hand gives it, and stands on the Earth; the place that it holds moves as well:

    C' = C [w],    gyro = seen(w + C^T e),    accelerometer = seen(C^T (p'' - g)).

In a rest w is the derivative of a slow wander (0.1 to 1.2 Hz) and of a physiological tremor (8 to 12 Hz) [1], p that of
the place; between rests a turn of least jerk and a thrust come to it. How steady a hand is differs from record to
record and from rest to rest; some rests are held badly. Each rest has waves of its own, since a turned wrist is another
pendulum, and passes on to those of the next in the turn between.

References
----------
.. [1] R. N. Stiles, "Frequency and displacement amplitude relations for normal hand tremor", J. Appl. Physiol. 40
   (1976) 44: 8 to 12 Hz, displacements of the order of 0.01 to 0.1 mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.attitude import accumulated, rotation, rotation_vector
from allanite.quantities.earth import earth_rate_vector
from allanite.recording.calibration import ACCELEROMETER, GYRO, errors_of, parameter_names
from allanite.recording.records import Recording

__all__ = ["LATITUDE", "NAMES", "G", "Hand", "HeldRecord", "held_record", "unit_of"]

Array = NDArray[np.float64]

DEG, G, LATITUDE, RATE = math.pi / 180, 9.80665, 0.8, 50.0
NAMES = parameter_names(ACCELEROMETER, frame="z") + parameter_names(GYRO, gravity_sensitivity=True)
#: Sizes of the true parameters: a consumer unit.
SIZES = {
    "accelerometer.bias": 0.2, "accelerometer.scale": 0.01, "accelerometer.misalignment": 0.01,
    "gyro.bias": 0.5 * DEG, "gyro.scale": 0.01, "gyro.misalignment": 0.01, "gyro.gravity_sensitivity": 3e-3 * DEG,
}  # fmt: skip
#: White noise: rad/s/sqrt(Hz), m/s^2/sqrt(Hz).
GYRO_N, ACCEL_N = 0.007 * DEG, 120e-6 * G
#: Steps of the motion in a sample.
FINE = 4
#: Frequencies of the slow wander and of the tremor [Hz], and sines of each.
SLOW, FAST, WAVES = (0.1, 1.2), (8.0, 12.0), 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Hand:
    """How a unit is held.

    Attributes
    ----------
    wander, tremor : float [rad]
        Rms of the attitude about each axis in a rest.
    sway, shake : float [m]
        Rms of the place along each axis: slow, and of the tremor.
    unsteady : float
        Share of rests held badly, with `worse` times as much of all.
    worse : float
    rests : (int, int)
        Number of rests, drawn between.
    length : (float, float) [s]
        Of a rest.
    drops : int
        Stretches of lost samples.
    covered : tuple of (float, float, float), optional
        Directions that no rest comes near, in the axes of the body: "up" stays 60 deg away from each.
    """

    wander: float = 0.3 * DEG
    tremor: float = 0.02 * DEG
    sway: float = 3e-4
    shake: float = 2e-5
    unsteady: float = 0.08
    worse: float = 8.0
    rests: tuple[int, int] = (12, 24)
    length: tuple[float, float] = (1.2, 6.0)
    drops: int = 4
    avoided: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldRecord:
    """A record and what is true of it.

    Attributes
    ----------
    recording : Recording
    rests : ndarray of int, shape (n, 2) [samples]
    steady : ndarray of bool, shape (n,)
    up : ndarray, shape (n, 3)
        Direction that was up.
    values : dict of str to float
    """

    recording: Recording
    rests: NDArray[np.int64]
    steady: NDArray[np.bool_]
    up: Array
    values: dict[str, float] = field(repr=False)


def unit_of(seed: int) -> dict[str, float]:
    """The true parameters of a unit."""
    rng = np.random.default_rng([seed, 1])
    sizes = [SIZES[n.rpartition("_")[0]] for n in NAMES]
    return {n: (".scale_" in n) + s * float(rng.standard_normal()) for n, s in zip(NAMES, sizes, strict=True)}


def held_record(seed: int, hand: Hand | None = None, *, unit: int | None = None) -> HeldRecord:
    """One record of the unit `unit` (of the number `seed` by default), all else drawn from `seed`."""
    hand = hand or Hand()
    rng = np.random.default_rng([seed, 2])
    values = unit_of(seed if unit is None else unit)
    ups = _directions(hand, rng)
    pieces = _pieces(ups, hand, rng)
    rate, place, rests, steady = _motion(pieces, hand, rng)
    dt = 1 / (RATE * FINE)
    first = _attitude_up(ups[0], float(rng.uniform(0, 2 * math.pi)))
    turns = accumulated(rate * dt)
    middle = first @ (turns[1:] + turns[:-1]) / 2
    back = np.swapaxes(middle, 1, 2)
    force = np.einsum("nij,nj->ni", back, place - [0.0, 0.0, G])
    seen = rate + back @ earth_rate_vector(LATITUDE)
    force, seen = (v.reshape(-1, FINE, 3).mean(axis=1) for v in (force, seen))
    acc = errors_of(values, ACCELEROMETER).seen(force, np.zeros(len(force)), force)
    gyro = errors_of(values, GYRO).seen(seen, np.zeros(len(force)), force)
    acc = acc + ACCEL_N * math.sqrt(RATE) * rng.standard_normal(acc.shape)
    gyro = gyro + GYRO_N * math.sqrt(RATE) * rng.standard_normal(gyro.shape)
    for _ in range(hand.drops):
        at, length = int(rng.integers(len(acc))), int(rng.integers(1, 6))
        acc[at : at + length] = gyro[at : at + length] = np.nan
    up = -np.array([(first @ turns[FINE * a : FINE * b : 8])[:, 2].mean(axis=0) for a, b in rests])
    return HeldRecord(
        recording=_recording(gyro, acc),
        rests=np.array(rests),
        steady=np.array(steady),
        up=up / np.linalg.norm(up, axis=1, keepdims=True),
        values=values,
    )


def _recording(gyro: Array, acc: Array) -> Recording:
    a = Recording.from_rate(gyro, rate=RATE, unit="rad/s", names=[f"gyro_{x}" for x in "xyz"])
    b = Recording.from_rate(acc, rate=RATE, unit="m/s²", names=[f"acc_{x}" for x in "xyz"])
    return replace(a, channels=a.channels + b.channels, columns=a.columns + b.columns)


def _directions(hand: Hand, rng: np.random.Generator) -> Array:
    """Near the faces and anywhere, in any order; some twice."""
    count = int(rng.integers(hand.rests[0], hand.rests[1] + 1))
    faces = np.concatenate([np.eye(3), -np.eye(3)])
    near = faces + 0.25 * rng.standard_normal((6, 3))
    found = np.concatenate([near, rng.standard_normal((8 * count, 3))])
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    for axis in hand.avoided:
        found = found[found @ (np.array(axis) / np.linalg.norm(axis)) < 0.5]
    chosen = found[: count - 2]
    chosen = np.concatenate([chosen, chosen[rng.integers(len(chosen), size=2)]])
    return np.asarray(chosen[rng.permutation(count)])


def _pieces(ups: Array, hand: Hand, rng: np.random.Generator) -> list[tuple[float, Any]]:
    """Lengths [s] with None for a rest, or the rotation vector of a turn."""
    out: list[tuple[float, Any]] = []
    at = ups[0]
    for k, up in enumerate(ups):
        if k:
            out.append((float(rng.uniform(0.8, 2.5)), _between(at, up, rng)))
        out.append((float(rng.uniform(*hand.length)), None))
        at = up
    return out


def _between(before: Array, after: Array, rng: np.random.Generator) -> Array:
    """Rotation of the body that brings another direction up, and turns about it as well."""
    a, b = _attitude_up(before, 0.0), _attitude_up(after, float(rng.uniform(-2.0, 2.0)))
    return np.asarray(rotation_vector(a.T @ b))


def _attitude_up(up: Array, heading: float) -> Array:
    v = -up / np.linalg.norm(up)
    axis = np.cross(v, [0.0, 0.0, 1.0])
    s = float(np.linalg.norm(axis))
    c = rotation(axis / s * math.atan2(s, v[2])) if s > 1e-9 else np.diag([1.0, v[2], v[2]])
    return np.asarray(rotation([0.0, 0.0, heading]) @ c)


def _motion(
    pieces: list[tuple[float, Any]], hand: Hand, rng: np.random.Generator
) -> tuple[Array, Array, list[tuple[int, int]], list[bool]]:
    """Rates of the body and accelerations of its place in fine steps; where it rests, and whether steadily."""
    fine, dt = RATE * FINE, 1 / (RATE * FINE)
    sizes = [round(length * RATE) * FINE for length, _ in pieces]
    n = sum(sizes)
    t = np.arange(n, dtype=np.float64) * dt
    amount, turn, push = np.empty(n), np.zeros((n, 3)), np.zeros((n, 3))
    own = math.exp(0.3 * rng.standard_normal())
    rests, steady, at = [], [], 0
    for size, (_, vector) in zip(sizes, pieces, strict=True):
        part = slice(at, at + size)
        if vector is None:
            bad = rng.random() < hand.unsteady
            amount[part] = own * math.exp(0.25 * rng.standard_normal()) * (hand.worse if bad else 1.0)
            rests.append((at // FINE, (at + size) // FINE))
            steady.append(not bad)
        else:
            u = ((np.arange(size) + 0.5) / size)[:, None]
            amount[part] = 5 * own
            turn[part] = 30 * (u * (1 - u)) ** 2 * vector * fine / size
            push[part] = rng.uniform(0.3, 2.0) * np.sin(2 * np.pi * u) * rng.standard_normal(3)
        at += size
    eased = _eased(amount, round(0.15 * fine))[:, None]
    parts = _passed_on(sizes)
    wander = hand.wander * _waves(t, SLOW, parts, rng) + hand.tremor * _waves(t, FAST, parts, rng)
    place = hand.sway * _waves(t, SLOW, parts, rng) + hand.shake * _waves(t, FAST, parts, rng)
    rate = turn + np.gradient(wander * eased, dt, axis=0)
    return rate, push + np.gradient(np.gradient(place * eased, dt, axis=0), dt, axis=0), rests, steady


def _eased(values: Array, width: int) -> Array:
    """Steps smoothed over a time, twice."""
    window = np.ones(width) / width
    for _ in range(3):
        values = np.convolve(np.pad(values, (width, width), mode="edge"), window, mode="same")[width:-width]
    return values


def _passed_on(sizes: list[int]) -> list[tuple[slice, Array]]:
    """Of each rest: where its waves are, and their size, which passes on to the next in the turn, shape (n, 1)."""
    edges = np.concatenate([[0], np.cumsum(sizes)]).tolist()
    found = []
    for k in range(0, len(sizes), 2):
        parts = [np.ones(sizes[k])]
        if k:
            parts.insert(0, np.sin(np.linspace(0, math.pi / 2, sizes[k - 1])))
        if k + 1 < len(sizes):
            parts.append(np.cos(np.linspace(0, math.pi / 2, sizes[k + 1])))
        place = slice(edges[max(k - 1, 0)], edges[min(k + 2, len(sizes))])
        found.append((place, np.concatenate(parts)[:, None]))
    return found


def _waves(
    t: Array, band: tuple[float, float], parts: list[tuple[slice, Array]], rng: np.random.Generator
) -> Array:
    """Sines along three axes, of rms one, those of each rest anew, shape (n, 3)."""
    out = np.zeros((len(t), 3))
    for place, size in parts:
        out[place] += size * _sines(t[place], band, rng)
    return out


def _sines(t: Array, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Sines of random frequency and phase along three axes, of rms one, shape (n, 3)."""
    shape = (3, WAVES)
    f = band[0] * (band[1] / band[0]) ** rng.uniform(size=shape)
    size = np.sqrt(rng.uniform(0.3, 1.7, size=shape))
    size *= np.sqrt(2 / (size**2).sum(axis=1, keepdims=True))
    phase = rng.uniform(0, 2 * math.pi, size=shape)
    return np.asarray(
        np.stack(
            [(size[k] * np.sin(2 * np.pi * t[:, None] * f[k] + phase[k])).sum(axis=1) for k in range(3)],
            axis=1,
        )
    )
