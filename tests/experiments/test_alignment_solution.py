# SPDX-License-Identifier: BSD-3-Clause
"""The least squares behind an alignment, against plain levelling and a minimiser that knows nothing of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from allanite.experiments.alignment.geometry import Geometry, ParameterLayout
from allanite.experiments.alignment.known import Sensors, knowledge_of
from allanite.experiments.alignment.solution import AlignmentSolution, Knowledge, solve, whitened
from allanite.quantities.attitude import attitude_of, axes_matrix
from allanite.quantities.earth import EARTH_RATE, earth_rate_vector, normal_gravity
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, parameter_names

DEG = math.pi / 180
MOUNTING = axes_matrix("FLU")


@dataclass(frozen=True)
class Still:
    """A unit at rest in one attitude whose gyros are off by what their calibration allows."""

    geometry: Geometry
    knowledge: Knowledge
    start: np.ndarray
    shown: np.ndarray
    noise: float = 1e-4 * EARTH_RATE

    @property
    def covariance(self) -> np.ndarray:
        return np.full((3, 1, 1), self.noise**2)

    def solved(self) -> AlignmentSolution:
        return solve(self.geometry, self.knowledge, self.shown, self.covariance, self.start)

    def residual(self, unknown: np.ndarray) -> np.ndarray:
        off = self.shown - self.geometry.gyros(self.knowledge.moved(self.start, unknown))
        return np.concatenate([whitened(self.covariance, off), unknown[len(self.knowledge.free) :]])


def still(sds: dict[str, float], attitude: tuple[float, float, float], latitude: float, seed: int) -> Still:
    names = parameter_names(ACCELEROMETER) + parameter_names(GYRO)
    sd = np.array([sds.get(n.rsplit("_", 1)[0], 0.0) for n in names])
    calibration = Calibration(
        names=names,
        values=np.array([1.0 if ".scale_" in n else 0.0 for n in names]),
        covariance=np.diag(sd**2),
        status=("estimated",) * len(names),
        channels={s: tuple(f"{s}_{a}" for a in "xyz") for s in (GYRO, ACCELEROMETER)},
        units={GYRO: "rad/s", ACCELEROMETER: "m/s²"},
    )
    sensor = attitude_of(*attitude) @ MOUNTING
    force = sensor.T @ np.array([0.0, 0.0, -normal_gravity(latitude)])
    layout, sensors = ParameterLayout.of(1, 0, 1.0, 1.0), Sensors.of(calibration, None, SetupUncertainty())
    geometry = Geometry(
        layout=layout, mounting=MOUNTING, reading=force[None], values=sensors.values, turns=(),
        leaving=np.zeros(1), entering=np.zeros(1),
    )  # fmt: skip
    none = np.zeros((3, 1, 1))
    start, knowledge = knowledge_of(layout, sensors, latitude, SetupUncertainty(), none, np.zeros(0))
    rng = np.random.default_rng(seed)
    spread = np.array([sds.get(n.rsplit("_", 1)[0], 0.0) for n in layout.names])
    truth = start + spread * rng.standard_normal(len(spread))
    shown = geometry.errors(truth, GYRO).seen(sensor.T @ earth_rate_vector(latitude), force=force)
    return Still(geometry=geometry, knowledge=knowledge, start=start, shown=shown[None])


def cases(rng: np.random.Generator, count: int) -> list[tuple[tuple[float, float, float], float]]:
    """Attitudes near level at latitudes where the vertical part of the Earth's rate is next to nothing."""
    return [
        (
            (*(0.05 * rng.standard_normal(2)), float(rng.uniform(0, 2 * math.pi))),
            float(rng.uniform(-12, 12)) * DEG,
        )
        for _ in range(count)
    ]


@pytest.mark.long
def test_a_low_latitude_is_levelled_like_any_other(rng: np.random.Generator) -> None:
    # the calibration knows no better than its values: what it lacks moves the interval, not the heading
    for seed, (attitude, latitude) in enumerate(cases(rng, 60)):
        unit = still({"gyro.misalignment": 1e-3}, attitude, latitude, seed)
        north = attitude_of(*attitude) @ MOUNTING @ unit.shown[0]
        plain = attitude[2] - math.atan2(north[1], north[0])
        found = replace(unit, noise=1e-8 * EARTH_RATE).solved().parameters
        heading = math.atan2(-found[1], found[0])
        error = math.remainder(heading - plain, 2 * math.pi)
        # misalignments of the vertical gyro that explain its residual tilt the rate: products of two small things
        assert abs(error) < 6e-3 * (abs(attitude[0]) + abs(attitude[1])) + 3e-5, (seed, latitude / DEG)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["gyro.misalignment", "gyro.scale", "gyro.bias"])
def test_no_other_parameters_fit_better(kind: str, rng: np.random.Generator) -> None:
    for seed, (attitude, latitude) in enumerate(cases(rng, 12)):
        unit = still({kind: 3e-3 * (EARTH_RATE if kind == "gyro.bias" else 1)}, attitude, latitude, seed)
        ours = unit.solved()
        size = np.where(np.arange(unit.knowledge.size) < len(unit.knowledge.free), EARTH_RATE, 1.0)
        begin = np.zeros(unit.knowledge.size)
        begin[: len(unit.knowledge.free)] = ours.parameters[unit.knowledge.free] * 1.01
        other = least_squares(
            unit.residual, begin, x_scale=size, method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14
        )
        theirs = unit.knowledge.moved(unit.start, other.x)
        assert ours.chi2 <= 2 * other.cost * (1 + 1e-6) + 1e-9
        sds = np.sqrt(np.diag(ours.covariance(np.eye(len(begin)))))[:2]
        assert np.abs(ours.parameters[:2] - theirs[:2]).max() < 1e-3 * sds.max()
