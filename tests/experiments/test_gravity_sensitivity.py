# SPDX-License-Identifier: BSD-3-Clause
"""Gyros whose biases follow gravity, from the record of many positions to the heading: calibrate, then align."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest

from allanite.experiments.alignment import AlignmentPlan, align, predict_alignment
from allanite.experiments.alignment.results import AlignmentEstimate
from allanite.experiments.alignment.turns import turn_of
from allanite.experiments.calibration import calibrate
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.noise import NoiseModel, White
from allanite.quantities.attitude import rotation
from allanite.quantities.earth import DEG_H, earth_rate_vector
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, parameter_names
from allanite.recording.records import Recording

DEG, G = math.pi / 180, 9.80665
LATITUDE = 48.1 * DEG
NOISE = {
    "gyro": NoiseModel.of(White(N=0.01 * DEG / 60)),
    "accelerometer": NoiseModel.of(White(N=1e-4), kind="acceleration"),
}
QUIET = {s: NoiseModel.of(White(N=1e-8), kind=m.kind) for s, m in NOISE.items()}
NAMES = parameter_names(ACCELEROMETER, frame="z") + parameter_names(GYRO, gravity_sensitivity=True)
FOLLOWS = NAMES[-9:]


def errors() -> Calibration:
    """Gyros that gain up to 30 deg/h in 1 g: three times what points north."""
    rng = np.random.default_rng(5)
    sizes = {"bias": 1e-3, "scale": 1e-3, "misalignment": 2e-3, "gravity_sensitivity": 30 * DEG_H / G}
    values = [(".scale_" in n) + sizes[n.split(".")[1].rsplit("_", 1)[0]] * rng.uniform(-1, 1) for n in NAMES]
    k = len(NAMES)
    return Calibration(
        names=NAMES,
        values=np.array(values),
        covariance=np.zeros((k, k)),
        status=("held",) * k,
        channels={
            GYRO: ("gyro_x", "gyro_y", "gyro_z"),
            ACCELEROMETER: ("acc_x", "acc_y", "acc_z"),
        },
    )


def record(motion: UnitMotion, *, seed: int, rate: float = 50.0) -> Recording:
    """In forward, right, down."""
    return simulate_unit(
        NOISE, rate=rate, motion=motion, latitude=LATITUDE, calibration=errors(), axes="FRD", seed=seed
    )


def spans_of(log: Recording) -> np.ndarray:
    positions = log.history[-1]["motion"]["positions"]
    return np.array([(math.ceil(p["start"] * log.rate), math.floor(p["stop"] * log.rate)) for p in positions])


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    """Of a record of twenty positions."""
    log = record(UnitMotion.icosahedron(20, dwell=60.0, turn=(1.5, 2.5)), seed=1, rate=20.0)
    found = calibrate(log, spans=spans_of(log), model=_by_channel(log), latitude=LATITUDE)
    assert found.verdict == "calibrated" and FOLLOWS[0] in found.calibration.names
    for p in found.parameters:
        assert abs(p.value - errors()[p.name][0]) < 4.5 * p.sd, p.name
    return Calibration.from_json(found.to_json())


def knowing(sd: float, off: Mapping[str, float], sds: Mapping[str, float] | None = None) -> Calibration:
    """A perfect unit whose gravity sensitivity is known with this standard deviation, and off by something."""
    own = np.array([(sds or {}).get(n, sd if n in FOLLOWS else 0.0) for n in NAMES])
    return Calibration(
        names=NAMES,
        values=np.array([1.0 if ".scale_" in n else off.get(n, 0.0) for n in NAMES]),
        covariance=np.diag(own**2),
        status=("held",) * len(NAMES),
    )


def _by_channel(log: Recording) -> dict[str, NoiseModel]:
    return {n: NOISE["gyro" if n.startswith("gyro") else "accelerometer"] for n in log.names}


def without(calibration: Calibration) -> Calibration:
    """The same as if nobody knew that the gyros follow gravity."""
    keep = [i for i, n in enumerate(calibration.names) if n not in FOLLOWS]
    return Calibration.from_json(
        {
            **calibration.to_json(),
            "names": [calibration.names[i] for i in keep],
            "values": calibration.values[keep].tolist(),
            "covariance": calibration.covariance[np.ix_(keep, keep)].tolist(),
            "status": [calibration.status[i] for i in keep],
        }
    )


def aligned(motion: UnitMotion, known: Calibration, seed: int, **options: object) -> AlignmentEstimate:
    log = record(motion, seed=seed, rate=5.0)
    spans = None if "rotation" in options else spans_of(log)
    return align(
        log, latitude=LATITUDE, model=NOISE, calibration=known, axes="FRD", spans=spans,
        bias_repeatability=(0.0, 0.0), checkpoints=2, **options,
    )  # fmt: skip


def attitudes(*found: tuple[float, float, float]) -> list[tuple[float, float, float]]:
    return [(a * DEG, b * DEG, c * DEG) for a, b, c in found]


@pytest.mark.long
def test_one_attitude_has_its_heading_back(calibration: Calibration) -> None:
    """Tilted, so that all three axes of the force matter; without the sensitivity the heading is far off."""
    motion = UnitMotion.still(attitudes((20.0, -35.0, 70.0))[0], duration=400.0)
    found = aligned(motion, calibration, 2)
    assert found.interval.contains(70 * DEG)
    assert found.heading_sd < 5 * DEG
    assert abs(math.remainder(found.heading - 70 * DEG, math.tau)) < 4 * found.heading_sd
    naive = aligned(motion, without(calibration), 2)
    assert naive.verdict != "resolved" or not naive.interval.contains(70 * DEG)


def test_several_attitudes_with_turns_between_them(calibration: Calibration) -> None:
    """The turns are integrated without what gravity adds on the way."""
    where = attitudes((0.0, 0.0, 40.0), (90.0, 0.0, 40.0), (0.0, 60.0, 130.0))
    found = aligned(UnitMotion.positions(where, dwell=150.0, turn=20.0), calibration, 3)
    assert found.interval.contains(130 * DEG) and found.heading_sd < 4 * DEG
    assert found.inflation == 1.0


@pytest.mark.long
def test_a_rotation_modulates_what_follows_gravity(calibration: Calibration) -> None:
    """About an axis that leans, force turns in the unit and makes a rate that does, too: a false north."""
    motion = UnitMotion.rotation(6 * DEG, 300.0, tilt=(30 * DEG, 0.0), heading=70 * DEG)
    found = aligned(motion, calibration, 4, rotation=True)
    assert abs(math.remainder(found.first.heading - 70 * DEG, math.tau)) < 4 * found.first.heading_sd
    assert found.first.heading_sd < 5 * DEG
    naive = aligned(motion, without(calibration), 4, rotation=True)
    assert naive.verdict != "resolved" or not naive.first.interval.contains(70 * DEG)


@pytest.mark.long
def test_a_rotation_is_as_sure_as_the_sensitivity() -> None:
    """What its covariance adds to the variance of the heading is what small errors of it do to the heading."""
    motion = UnitMotion.rotation(6 * DEG, 150.0, tilt=(30 * DEG, 0.0), heading=70 * DEG)
    log = simulate_unit(NOISE, rate=5.0, motion=motion, latitude=LATITUDE, axes="FRD", seed=1)

    def found(known: Calibration) -> AlignmentEstimate:
        return align(
            log, latitude=LATITUDE, model=NOISE, calibration=known, axes="FRD", rotation=True, checkpoints=2,
            bias_repeatability=(0.0, 0.0),
        )  # fmt: skip

    sd, small = 0.3 * DEG_H / G, 0.01 * DEG_H / G
    exact, vague = found(knowing(0.0, {})).first, found(knowing(sd, {})).first
    slopes = [(found(knowing(0.0, {n: small})).first.heading - exact.heading) / small for n in FOLLOWS]
    assert vague.heading_sd > 2 * exact.heading_sd
    expected = math.hypot(exact.heading_sd, sd * float(np.linalg.norm(slopes)))
    assert vague.heading_sd == pytest.approx(expected, rel=0.02)


def test_the_sd_of_the_sensitivity_is_in_that_of_the_heading() -> None:
    """Level and pointing north: what follows the force along z adds a rate along y, and over the Earth's a heading."""
    sd = 0.2 * DEG_H
    known = knowing(0.0, {}, {"gyro.gravity_sensitivity_yz": sd / G})
    found = predict_alignment(
        plan=AlignmentPlan.static(100.0), model=QUIET, latitude=LATITUDE, calibration=known, axes="FRD"
    )
    level = float(np.hypot(*earth_rate_vector(LATITUDE)[:2]))
    assert found.heading_sd == pytest.approx(sd / level, rel=2e-3)  # g is that of the latitude
    assert found.budget["gyro bias"] == pytest.approx(found.heading_sd, rel=1e-6)


def test_a_turn_knows_what_the_force_adds(rng: np.random.Generator) -> None:
    rate, force = np.cumsum(rng.standard_normal((2, 400, 3)), axis=1) * [[[0.01]], [[0.1]]]
    follows = 1e-4 * rng.standard_normal((3, 3))
    turn = turn_of(rate, 0.01, force)
    exact = turn_of(rate - force @ follows.T, 0.01).matrix
    near = rotation(-np.einsum("ilm,lm->i", turn.force, follows)) @ turn.matrix
    assert np.abs(near - exact).max() < 1e-6
    assert np.abs(turn.matrix - exact).max() > 1e-4
