# SPDX-License-Identifier: BSD-3-Clause
"""Budgets of dead reckoning against simulation: simulated units at rest through a plain strapdown integration.

The integration is the usual one on the rotating ellipsoid, with no approximation of small errors: attitude as a matrix,
velocity and place from it. Each row compares the root mean square of its errors over many units, at one time, with the
standard deviation of the budget; 4000 units know a standard deviation to 1.1 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.experiments.dead_reckoning import InitialErrors, dead_reckon
from allanite.experiments.dead_reckoning.dynamics import radii
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, White
from allanite.quantities.earth import (
    EARTH_RATE,
    ECCENTRICITY2,
    FLATTENING,
    GRAVITY_EQUATOR,
    GRAVITY_K,
    GRAVITY_M,
    SEMI_MAJOR,
    normal_gravity,
)

__all__ = ["CASES", "GATE", "Case", "run_dead_reckoning", "strapdown_errors"]

Json = dict[str, Any]
Array = NDArray[np.float64]
DEG = math.pi / 180
GATE = (0.95, 1.05)
UNITS = 4000
#: Units simulated at once.
BATCH = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A unit, how it starts, and when its errors are looked at."""

    models: Mapping[str, NoiseModel]
    latitude: float
    times: tuple[float, ...]
    rate: float
    initial: InitialErrors | None = None
    rest: float | None = None
    vertical: bool = False
    held: bool = False


def _unit(rate: float, N: float, B: float, K: float, n: float, b: float, k: float) -> dict[str, NoiseModel]:
    """Gyros in deg/sqrt(h), deg/h, deg/h/sqrt(h); accelerometers in ug/sqrt(Hz), ug, ug/sqrt(h)."""
    ug = 9.80665e-6
    return {
        "gyro": NoiseModel.of(
            White(N=N * DEG / 60), Flicker(B=B * DEG / 3600), RandomWalk(K=K * DEG / 216000),
            Quantisation(Q=1e-6, dt=1 / rate),
        ),
        "accelerometer": NoiseModel.of(
            White(N=n * ug), Flicker(B=b * ug), RandomWalk(K=k * ug / 60), Quantisation(Q=1e-3, dt=1 / rate),
            kind="acceleration",
        ),
    }  # fmt: skip


_WANDERING = {
    "gyro": NoiseModel.of(White(N=2e-5), GaussMarkov.from_sigma(2e-6, 600.0)),
    "accelerometer": NoiseModel.of(White(N=2e-4), GaussMarkov.from_sigma(2e-4, 300.0), kind="acceleration"),
}
_ALL = InitialErrors(
    position=5.0, velocity=0.1, tilt=1e-3, heading=1e-2, gyro_bias=5e-5, accelerometer_bias=5e-3, gyro_scale=0.05,
    accelerometer_scale=1e-3, gyro_misalignment=0.02, accelerometer_misalignment=1e-3,
)  # fmt: skip
CASES: Mapping[str, Case] = {
    "MEMS, its noise": Case(
        models=_unit(4.0, 0.3, 5, 5, 100, 20, 20), latitude=0.84, times=(10.0, 60.0, 300.0), rate=4.0
    ),
    "MEMS, after 60 s at rest": Case(
        models=_unit(2.0, 0.3, 5, 5, 100, 20, 20), latitude=-0.41, times=(10.0, 60.0, 300.0), rate=2.0, rest=60.0,
        initial=InitialErrors(gyro_bias=2e-4, accelerometer_bias=2e-3, heading=0.02),
    ),
    "MEMS, after 60 s at rest, vertical bias removed": Case(
        models=_unit(2.0, 0.3, 5, 5, 100, 20, 20), latitude=-0.41, times=(10.0, 60.0, 300.0), rate=2.0, rest=60.0,
        vertical=True, initial=InitialErrors(gyro_bias=2e-4, accelerometer_bias=2e-3, heading=0.02),
    ),
    "tactical, all initial errors": Case(
        models=_unit(1.0, 0.02, 0.5, 0.5, 30, 10, 5), latitude=0.2, times=(10.0, 100.0, 600.0), rate=1.0, initial=_ALL
    ),
    "navigation, two periods of Schuler": Case(
        models=_WANDERING, latitude=0.84, times=(600.0, 2532.0, 5064.0, 10128.0), rate=0.25,
        initial=InitialErrors(tilt=1e-5, heading=1e-4, gyro_bias=1e-7, accelerometer_bias=1e-4), held=True,
    ),
}  # fmt: skip
#: Part of the height's standard deviation that the second order of the tilt may make where it is still compared.
SECOND = 0.05
#: The states that are compared; not the height where something else holds it.
STATES = {
    "position_north": 0, "position_east": 1, "position_down": 2, "velocity_north": 3, "velocity_east": 4,
    "velocity_down": 5, "tilt_north": 6, "tilt_east": 7, "heading": 8,
}  # fmt: skip


def run_dead_reckoning(seed: int, say: Callable[[str], None], units: int = UNITS) -> list[Json]:
    """One row for each case, time and state."""
    rows: list[Json] = []
    for number, (name, case) in enumerate(CASES.items()):
        budget = dead_reckon(
            case.models, latitude=case.latitude, duration=case.times[-1], times=case.times, initial=case.initial,
            rest=case.rest, vertical=case.vertical, held=case.held, rate=case.rate,
        )  # fmt: skip
        batches = [min(BATCH, units - done) for done in range(0, units, BATCH)]
        parts = [
            strapdown_errors(case, np.random.SeedSequence([seed, number, i]), n)
            for i, n in enumerate(batches)
        ]
        rms = np.sqrt(np.mean(np.concatenate(parts, axis=1) ** 2, axis=1))
        for i, time in enumerate(case.times):
            at = int(np.argmin(np.abs(budget.times - time)))
            for state, column in STATES.items():
                if state.endswith("down") and (
                    case.held or budget.sinking[at] > SECOND * budget["position_down"][at]
                ):
                    continue
                sd = float(budget[state][at])
                ratio = float(rms[i, column] / sd)
                rows.append(
                    {
                        "case": name, "time": time, "state": state, "units": units, "sd": sd,
                        "rms_over_sd": round(ratio, 4), "passes": GATE[0] <= ratio <= GATE[1],
                    }
                )  # fmt: skip
        ratios: list[float] = [r["rms_over_sd"] for r in rows if r["case"] == name]
        say(f"{name}: rms/sd {min(ratios):.3f} to {max(ratios):.3f}")
    return rows


# -- simulated units, integrated ------------------------------------------------------------------------------------


def strapdown_errors(case: Case, seed: np.random.SeedSequence, units: int) -> Array:
    """Errors of position [m], velocity [m/s] and attitude [rad], north, east, down, shape (times, units, 9)."""
    draw = np.random.default_rng(seed)
    gyro, force = _readings(case, seed, units, draw)
    begun = case.initial or InitialErrors()
    place = _Place(case.latitude, units)
    position, velocity = (
        size * draw.standard_normal((units, 3)) for size in (begun.position, begun.velocity)
    )
    angles = np.array([begun.tilt, begun.tilt, begun.heading]) * draw.standard_normal((units, 3))
    skipped = 0 if case.rest is None else round(case.rest * case.rate)
    if skipped:
        mean = force[:skipped].mean(axis=0)
        angles[:, 0] += mean[:, 1] / normal_gravity(case.latitude)
        angles[:, 1] -= mean[:, 0] / normal_gravity(case.latitude)
    attitude = _rotation(-angles)
    place.move(position)
    if skipped:
        turning = np.einsum("nji,nj->ni", attitude, place.earth())
        gyro = gyro - (gyro[:skipped].mean(axis=0) - turning)
    if skipped and case.vertical:
        force = force.copy()
        force[..., 2] -= force[:skipped, :, 2].mean(axis=0) + place.gravity()
    return _integrated(case, gyro[skipped:], force[skipped:], attitude, velocity, place)


def _readings(
    case: Case, seed: np.random.SeedSequence, units: int, draw: np.random.Generator
) -> tuple[Array, Array]:
    """Of gyros and accelerometers of level units whose x points north, shape (samples, units, 3)."""
    duration = case.times[-1] + (case.rest or 0.0)
    ideal = {
        "gyro": EARTH_RATE * np.array([math.cos(case.latitude), 0.0, -math.sin(case.latitude)]),
        "accelerometer": np.array([0.0, 0.0, -normal_gravity(case.latitude)]),
    }
    found = []
    for sensor, own in zip(("gyro", "accelerometer"), seed.spawn(2), strict=True):
        names = [f"{n}{axis}" for n in range(units) for axis in "xyz"]
        record = al.simulate(
            dict.fromkeys(names, case.models[sensor]), rate=case.rate, duration=duration,
            seed=int(own.generate_state(1)[0]),
        )  # fmt: skip
        noise = np.stack([record.values(name) for name in names], axis=1).reshape(-1, units, 3)
        sizes = [
            getattr(case.initial or InitialErrors(), f"{sensor}_{key}")
            for key in ("bias", "scale", "misalignment")
        ]
        skew = sizes[2] * draw.standard_normal((units, 3, 3)) * (1 - np.eye(3))
        gain = np.eye(3) * (1 + sizes[1] * draw.standard_normal((units, 3, 1))) + skew
        found.append(gain @ ideal[sensor] + sizes[0] * draw.standard_normal((units, 3)) + noise)
    return found[0], found[1]


class _Place:
    """Latitude, longitude and height that the navigators believe."""

    def __init__(self, latitude: float, units: int) -> None:
        self.start = latitude
        self.latitude, self.east, self.height = np.full(units, latitude), np.zeros(units), np.zeros(units)

    def move(self, by: Array) -> None:
        meridian, across = self.radii()
        self.latitude = self.latitude + by[:, 0] / (meridian + self.height)
        self.east = self.east + by[:, 1] / ((across + self.height) * np.cos(self.latitude))
        self.height = self.height - by[:, 2]

    def radii(self) -> tuple[Array, Array]:
        root = np.sqrt(1 - ECCENTRICITY2 * np.sin(self.latitude) ** 2)
        return SEMI_MAJOR * (1 - ECCENTRICITY2) / root**3, SEMI_MAJOR / root

    def gravity(self) -> Array:
        """As `normal_gravity`, for all at once."""
        s2, part = np.sin(self.latitude) ** 2, self.height / SEMI_MAJOR
        surface = GRAVITY_EQUATOR * (1 + GRAVITY_K * s2) / np.sqrt(1 - ECCENTRICITY2 * s2)
        return np.asarray(
            surface * (1 - 2 * (1 + FLATTENING + GRAVITY_M - 2 * FLATTENING * s2) * part + 3 * part**2)
        )

    def earth(self) -> Array:
        zero = np.zeros_like(self.latitude)
        return EARTH_RATE * np.stack([np.cos(self.latitude), zero, -np.sin(self.latitude)], axis=1)

    def errors(self) -> Array:
        meridian, across = radii(self.start)
        return np.stack(
            [
                meridian * (self.latitude - self.start),
                across * math.cos(self.start) * self.east,
                -self.height,
            ],
            axis=1,
        )


def _integrated(
    case: Case, gyro: Array, force: Array, attitude: Array, velocity: Array, place: _Place
) -> Array:
    dt, wanted, out = 1 / case.rate, [round(t * case.rate) for t in case.times], []
    for k in range(len(gyro)):
        meridian, across = place.radii()
        earth = place.earth()
        north, east = velocity[:, 0] / (meridian + place.height), velocity[:, 1] / (across + place.height)
        carried = np.stack([east, -north, -east * np.tan(place.latitude)], axis=1)
        after = _rotation(-(earth + carried) * dt) @ attitude @ _rotation(gyro[k] * dt)
        felt = np.einsum("nij,nj->ni", 0.5 * (attitude + after), force[k])
        felt[:, 2] += place.gravity()
        turned = np.cross(2 * earth + carried, velocity)
        faster = velocity + dt * (felt - turned)
        if case.held:
            faster[:, 2] = 0.0
        place.move(0.5 * dt * (velocity + faster))
        velocity, attitude = faster, after
        if k + 1 in wanted:
            wrong = 0.5 * (attitude - attitude.swapaxes(1, 2))  # C' = I - phi x, C = I
            phi = -np.stack([wrong[:, 2, 1], wrong[:, 0, 2], wrong[:, 1, 0]], axis=1)
            out.append(np.concatenate([place.errors(), velocity, phi], axis=1))
    return np.array(out)


def _rotation(angles: Array) -> Array:
    """The rotation matrices of vectors of rotation, shape (n, 3, 3), by the formula of Rodrigues."""
    size = np.sqrt((angles**2).sum(axis=1))[:, None, None]
    x, y, z = angles.T
    zero = np.zeros_like(x)
    k = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    return np.asarray(
        np.eye(3) + np.sinc(size / np.pi) * k + 0.5 * np.sinc(size / (2 * np.pi)) ** 2 * (k @ k)
    )
