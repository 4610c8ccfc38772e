# SPDX-License-Identifier: BSD-3-Clause
"""A simulated unit against closed forms; no noise but where it is asked for, so that bounds are rounding or coning."""

from __future__ import annotations

import json
import math
import tracemalloc
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.filtering.simulation import (
    Temperature,
    UnitMotion,
    simulate_unit,
    true_attitudes,
    unit,
    unit_course,
)
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.quantities.attitude import (
    accumulated,
    angles_of,
    attitude_of,
    axes_matrix,
    rotation,
    rotation_vector,
)
from allanite.quantities.earth import EARTH_RATE, earth_rate_vector, normal_gravity
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, parameter_names

DEGREE = math.pi / 180
LATITUDE = -23.31 * DEGREE
SILENT = {GYRO: NoiseModel.of(), ACCELEROMETER: NoiseModel.of()}
GYROS, ACCELEROMETERS = unit.CHANNELS[GYRO], unit.CHANNELS[ACCELEROMETER]


def silent(motion: UnitMotion, *, rate: float = 50.0, seed: int = 1, **options: Any) -> al.Recording:
    options.setdefault("latitude", LATITUDE)
    return simulate_unit(options.pop("models", SILENT), rate=rate, motion=motion, seed=seed, **options)


def samples(record: al.Recording, sensor: str) -> np.ndarray:
    return np.stack([record.values(n) for n in unit.CHANNELS[sensor]], axis=1)


def truth(record: al.Recording) -> dict[str, Any]:
    motion: dict[str, Any] = record.history[-1]["motion"]
    return motion


def within(record: al.Recording, span: dict[str, Any], sensor: str) -> np.ndarray:
    """The samples that lie in a stretch altogether."""
    first, last = math.ceil(span["start"] * record.rate - 1e-9), math.floor(span["stop"] * record.rate + 1e-9)
    return samples(record, sensor)[first:last]


def drift(record: al.Recording, axes: str = "FRD") -> np.ndarray:
    """Between the attitude that the gyros give when integrated and the true one, at each sample [rad]."""
    t = np.arange(record.n_samples + 1) / record.rate
    turned = accumulated(samples(record, GYRO) / record.rate)
    earth = earth_rate_vector(record.history[-1]["latitude"])
    true = rotation(earth * t[:, None]) @ true_attitudes(record, t) @ axes_matrix(axes)
    return np.asarray(np.linalg.norm(rotation_vector(np.swapaxes(true[0] @ turned, 1, 2) @ true), axis=1))


# -- at rest ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("degrees", [-90, -60, -23.31, 0, 45, 90])
def test_a_level_unit_reads_gravity_and_the_earth(degrees: float, sampling: Any) -> None:
    """Forward, right, down at heading h: w = (W cos L cos h, -W cos L sin h, -W sin L), f = (0, 0, -g)."""
    latitude, heading = math.radians(degrees), 35 * DEGREE
    record = silent(
        UnitMotion.still((0, 0, heading), duration=2.0), latitude=latitude, sampling=sampling, height=100.0
    )
    level, up = EARTH_RATE * math.cos(latitude), EARTH_RATE * math.sin(latitude)
    rate = [level * math.cos(heading), -level * math.sin(heading), -up]
    np.testing.assert_allclose(samples(record, GYRO), np.tile(rate, (100, 1)), atol=1e-12 * EARTH_RATE)
    g = normal_gravity(latitude, 100.0)
    np.testing.assert_allclose(samples(record, ACCELEROMETER), np.tile([0, 0, -g], (100, 1)), atol=1e-12 * g)
    assert record.names == (*GYROS, *ACCELEROMETERS)
    assert {c.unit for c in record.channels} == {"rad/s", "m/s²"}


def test_any_attitude_reads_the_same_lengths_and_angle_between_them() -> None:
    motion = UnitMotion.many(30, seed=4, dwell=1.0)
    record = silent(motion, gravity=9.8)
    assert len(truth(record)["positions"]) == 30
    for position in truth(record)["positions"]:
        c = attitude_of(position["roll"], position["pitch"], position["heading"])
        np.testing.assert_allclose(c, position["attitude"], atol=1e-12)
        w, f = within(record, position, GYRO), within(record, position, ACCELEROMETER)
        assert len(w) >= 48
        np.testing.assert_allclose(w, np.tile(c.T @ earth_rate_vector(LATITUDE), (len(w), 1)), atol=1e-16)
        np.testing.assert_allclose(f, np.tile(c.T @ [0, 0, -9.8], (len(f), 1)), atol=1e-11)
        np.testing.assert_allclose((w * f).sum(axis=1), 9.8 * EARTH_RATE * math.sin(LATITUDE), rtol=1e-11)


@pytest.mark.parametrize(
    ("axes", "up"), [("FLU", "acc_z"), ("RFU", "acc_z"), ("URF", "acc_x"), ("FUR", "acc_y")]
)
def test_an_axis_that_points_up_reads_plus_g(axes: str, up: str) -> None:
    record = silent(UnitMotion.still(duration=0.1), axes=axes, gravity=9.8)
    for name in ACCELEROMETERS:
        assert record.values(name)[0] == pytest.approx(9.8 if name == up else 0.0, abs=1e-14)
    forward = GYROS[axes.index("F")]
    assert record.values(forward)[0] == pytest.approx(EARTH_RATE * math.cos(LATITUDE), rel=1e-14)
    assert record.history[-1]["axes"] == axes


def test_one_triad_alone() -> None:
    still = UnitMotion.still(duration=1.0)
    assert silent(still, models={GYRO: NoiseModel.of()}).names == GYROS
    one_by_one = dict.fromkeys(reversed(ACCELEROMETERS), NoiseModel.of())
    assert silent(still, models=one_by_one).names == ACCELEROMETERS


# -- turning ----------------------------------------------------------------------------------------------


def coning(angle: float, time: float, dt: float) -> float:
    """Most that a turn among the Earth's rotation W brings: dt^2/12 of the integral of |w x w'|.

    Of least jerk it has an integral of the squared rate of 10/7 angle^2/time and a largest rate of 15/8 angle/time.
    """
    return EARTH_RATE * dt**2 / 12 * (10 / 7 * angle**2 + 15 / 4 * angle) / time


@pytest.mark.parametrize("axes", ["FRD", "FLU"])
@pytest.mark.parametrize("rate", [20.0, 100.0, 1000.0])
def test_the_gyros_integrate_to_the_attitude_but_for_coning(rate: float, axes: str) -> None:
    one = drift(silent(UnitMotion.two(dwell=1.0, turn=2.0), rate=rate, axes=axes), axes)
    assert 0.1 < one.max() / coning(math.pi, 2.0, 1 / rate) < 1.0  # 4e-9 at 100 Hz
    many = drift(silent(UnitMotion.nineteen(dwell=1.0, turn=2.0), rate=rate, axes=axes), axes)
    assert many.max() < 18 * coning(math.pi / 2, 2.0, 1 / rate)


@pytest.mark.parametrize(("rate", "bound"), [(100.0, 3e-4), (400.0, 3e-4 / 14)])
def test_a_hand_trembles_and_its_coning_falls_with_the_square_of_the_interval(
    rate: float, bound: float
) -> None:
    motion = UnitMotion.icosahedron(20, dwell=0.5, turn=(0.7, 1.4), tremor=0.5 * DEGREE)
    error = drift(silent(motion, rate=rate, seed=3))
    steady = UnitMotion.icosahedron(20, dwell=0.5, turn=(0.7, 1.4))
    assert 1e-3 * bound < error.max() < bound
    assert drift(silent(steady, rate=rate, seed=3)).max() < 1e-2 * error.max()


def test_truth_of_the_turns() -> None:
    record = silent(UnitMotion.faces(dwell=[3.0, 4, 5, 6, 7, 8], turn=1.0))
    positions, turns = truth(record)["positions"], truth(record)["turns"]
    assert [p["stop"] - p["start"] for p in positions] == pytest.approx([3, 4, 5, 6, 7, 8])
    assert record.duration == pytest.approx(38.0)
    for before, turn, after in zip(positions[:-1], turns, positions[1:], strict=True):
        assert (before["stop"], after["start"]) == (turn["start"], turn["stop"])
        c = np.array(before["attitude"]) @ rotation(turn["turn"])
        np.testing.assert_allclose(c, after["attitude"], atol=1e-14)


def test_a_turn_begins_and_ends_at_rest_and_is_smooth() -> None:
    record = silent(UnitMotion.two(dwell=1.0, turn=2.0), rate=1000.0)
    rate = samples(record, GYRO)[:, 2] + EARTH_RATE * math.sin(LATITUDE)
    assert rate.max() == pytest.approx(15 / 8 * math.pi / 2.0, rel=1e-5)
    assert np.abs(np.diff(rate)).max() == pytest.approx(math.pi / 4 * 10 / math.sqrt(3) / 1000, rel=1e-3)
    assert np.abs(rate[[999, 3000]]).max() < 1e-12


def test_residual_of_a_turn_creeps_away_in_its_sense() -> None:
    motion = UnitMotion.two(dwell=10.0, turn=2.0, settling_angle=1e-3, settling_time=2.0)
    record = silent(motion, sampling="point")
    z = samples(record, GYRO)[:, 2] + EARTH_RATE * math.sin(LATITUDE)
    k = round(12 * record.rate)
    t = np.arange(len(z) - k) / record.rate
    sense = math.copysign(1.0, truth(record)["turns"][0]["turn"][2])
    np.testing.assert_allclose(z[k:], sense * 1e-3 / 2 * np.exp(-t / 2), atol=1e-12)
    last = truth(record)["positions"][-1]
    assert last["heading"] == pytest.approx(math.pi, abs=1e-12)  # where it settles
    gap = angles_of(true_attitudes(record, 22.0)[0])[2] - math.pi
    assert abs(gap) == pytest.approx(1e-3 * math.exp(-5.0), rel=1e-6)
    assert drift(silent(motion)).max() < coning(math.pi, 2.0, 1 / 50)


def test_sway_shakes_the_accelerometers_during_turns_only() -> None:
    motion = UnitMotion.faces(dwell=2.0, turn=2.0, sway=0.002)
    record = silent(motion, rate=200.0, gravity=9.8)
    for position in truth(record)["positions"]:
        size = np.linalg.norm(within(record, position, ACCELEROMETER), axis=1)
        np.testing.assert_allclose(size, 9.8, rtol=1e-12)
    shaken = [np.linalg.norm(within(record, t, ACCELEROMETER), axis=1).std() for t in truth(record)["turns"]]
    assert 0.1 < min(shaken) and max(shaken) < 10.0
    np.testing.assert_allclose(samples(silent(motion, rate=200.0), GYRO), samples(record, GYRO), atol=0)


# -- continuous rotation ----------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [50.0, 0.3])
@pytest.mark.parametrize("spin", [6 * DEGREE, -30 * DEGREE])
def test_rotation_modulates_the_earth(spin: float, rate: float) -> None:
    record = silent(UnitMotion.rotation(spin, 150.0, heading=0.2), rate=rate)
    t = np.arange(record.n_samples + 1) / rate
    level = EARTH_RATE * math.cos(LATITUDE)
    x = level * np.diff(np.sin(0.2 + spin * t)) / (spin / rate)
    np.testing.assert_allclose(record.values("gyro_x"), x, atol=1e-11 * level)
    np.testing.assert_allclose(record.values("gyro_z"), spin - EARTH_RATE * math.sin(LATITUDE), rtol=1e-12)
    # By the table of truth, and as a function of time.
    first = truth(record)["rotations"][0]
    assert (first["heading"], first["rate"]) == (pytest.approx(0.2), pytest.approx([0, 0, spin]))
    heading = [angles_of(c)[2] for c in true_attitudes(record, t)]
    np.testing.assert_allclose(np.unwrap(heading), 0.2 + spin * t, atol=1e-10)


def test_a_leaning_axis_keeps_its_lean() -> None:
    record = silent(UnitMotion.rotation(0.1, 100.0, tilt=(0.02, -0.03)), gravity=9.8)
    z = record.values("acc_z")
    np.testing.assert_allclose(z, -9.8 * math.cos(0.02) * math.cos(0.03), rtol=1e-12)
    across = np.hypot(record.values("acc_x"), record.values("acc_y"))
    np.testing.assert_allclose(across, 9.8 * math.sin(math.acos(-z[0] / 9.8)), rtol=1e-6)


def test_rotation_that_changes_its_sense_after_each_revolution() -> None:
    record = silent(UnitMotion.rotation(0.5, 60.0, swap_time=1.0))
    spin = samples(record, GYRO)[:, 2] + EARTH_RATE * math.sin(LATITUDE)
    revolution = 2 * math.pi / 0.5
    for k in range(4):
        a, b = (math.ceil((k * (revolution + 1) + s) * 50) for s in (0.05, revolution - 0.05))
        np.testing.assert_allclose(spin[a:b], 0.5 * (-1) ** k, rtol=1e-12)
    assert np.abs(np.diff(spin)).max() < 0.5 * math.pi / 50 * 1.01
    headings = [angles_of(true_attitudes(record, k * (revolution + 1))[0])[2] for k in range(5)]
    np.testing.assert_allclose(np.cos(headings), 1.0, atol=1e-12)
    assert drift(record).max() < 1e-7


# -- sensors ----------------------------------------------------------------------------------------------


def drawn_errors(rng: np.random.Generator, **options: Any) -> Calibration:
    names = parameter_names(ACCELEROMETER, frame="z", quadratic=True) + parameter_names(GYRO, **options)
    size = {"bias": 0.1, "scale": 0.02, "misalignment": 0.02, "quadratic": 1e-4, "bias_temperature": 1e-3}
    sds = np.array([size[n.split(".")[1].rpartition("_")[0]] for n in names])
    return Calibration(
        names=names,
        values=sds * rng.standard_normal(len(names)) + [1.0 if ".scale_" in n else 0.0 for n in names],
        covariance=np.zeros((len(names),) * 2),
        status=("held",) * len(names),
        channels=unit.CHANNELS,
        temperature=20.0,
    )


def test_errors_of_the_sensors_can_be_taken_off_again(rng: np.random.Generator) -> None:
    motion = UnitMotion.faces(dwell=2.0)
    errors = drawn_errors(rng)
    perfect, real = silent(motion), silent(motion, calibration=errors)
    for sensor in (GYRO, ACCELEROMETER):
        assert np.abs(samples(real, sensor) - samples(perfect, sensor)).max() > 0.05
        np.testing.assert_allclose(samples(errors.apply(real), sensor), samples(perfect, sensor), atol=1e-13)
    again = Calibration.from_json(real.history[-1]["calibration"])
    np.testing.assert_array_equal(again.values, errors.values)


def test_counts(rng: np.random.Generator) -> None:
    errors = Calibration.nominal(ACCELEROMETER)
    counts = Calibration(
        names=errors.names,
        values=np.where(np.char.find(errors.names, "scale") > 0, 400.0, 0.0),
        covariance=errors.covariance,
        status=errors.status,
        units={ACCELEROMETER: "LSB"},
    )
    record = silent(UnitMotion.still(duration=60.0), calibration=counts, gravity=9.8,
                    models={ACCELEROMETER: NoiseModel.of(White(N=2.0), kind="counts")})  # fmt: skip
    z = record.values("acc_z")
    assert record["acc_z"].kind == "counts"
    assert z.mean() == pytest.approx(-3920.0, abs=4 * 2.0 / math.sqrt(60))
    assert z.std() == pytest.approx(2.0 * math.sqrt(50), rel=4 / math.sqrt(2 * len(z)))


def test_noise_is_that_of_the_models_and_of_the_seed() -> None:
    models = {
        GYRO: NoiseModel.of(White(N=1e-5), RandomWalk(K=1e-7)),
        ACCELEROMETER: NoiseModel.of(White(N=1e-3), Flicker(B=1e-4)),
    }
    motion = UnitMotion.faces(dwell=60.0, pointing_sd=0.01, tremor=0.01)
    noisy, quiet = (silent(motion, models=m, seed=7) for m in (models, SILENT))
    alone = al.simulate(
        {n: models[s] for s in (GYRO, ACCELEROMETER) for n in unit.CHANNELS[s]},
        rate=50.0,
        duration=noisy.duration,
        seed=7,
        unit=dict.fromkeys(GYROS, "rad/s") | dict.fromkeys(ACCELEROMETERS, "m/s²"),
    )
    assert truth(noisy) == truth(quiet)
    for name in noisy.names:
        np.testing.assert_allclose(noisy.values(name) - quiet.values(name), alone.values(name), atol=1e-14)
    step = np.diff(noisy.values("acc_y")[:2000])  # white noise is nearly all of it
    assert step.std() == pytest.approx(1e-3 * math.sqrt(2 * 50), rel=4 / math.sqrt(2 * 2000) * 1.3)
    again = silent(motion, models=models, seed=7)
    np.testing.assert_array_equal(samples(again, GYRO), samples(noisy, GYRO))
    other = silent(motion, seed=8)
    assert truth(other)["positions"] != truth(quiet)["positions"]


def test_temperature_moves_the_biases(rng: np.random.Generator) -> None:
    errors = drawn_errors(rng, temperature=True)
    warm = Temperature(start=23.0, rise=10.0, time_constant=20.0, noise=0.0)
    motion = UnitMotion.still(duration=60.0)
    record = silent(motion, calibration=errors, temperature=warm)
    cold = silent(motion, calibration=errors)
    slope = errors.errors(GYRO).temperature
    moved = samples(record, GYRO) - samples(cold, GYRO)
    np.testing.assert_allclose(moved, np.outer(record.values("temperature") - 20.0, slope), atol=1e-15)
    assert record["temperature"].kind == "temperature"
    np.testing.assert_array_equal(samples(record, ACCELEROMETER), samples(cold, ACCELEROMETER))
    hidden = silent(motion, calibration=errors, temperature=Temperature(start=23.0, channel=None))
    assert hidden.names == (*GYROS, *ACCELEROMETERS)
    np.testing.assert_allclose(
        samples(hidden, GYRO) - samples(cold, GYRO), np.tile(3 * slope, (3000, 1)), atol=1e-15
    )


# -- the ways of setting a unit ---------------------------------------------------------------------------


def downs(motion: UnitMotion) -> np.ndarray:
    """Directions of the unit that point down."""
    return motion.attitudes[:, 2]


def test_six_faces_are_the_six_faces() -> None:
    found = {tuple(np.round(d, 12).tolist()) for d in downs(UnitMotion.faces(dwell=1.0, heading=0.3)) + 0.0}
    assert found == {tuple((s * e).tolist()) for e in np.eye(3) for s in (1.0, -1.0)}


def test_nineteen_positions_are_quarter_turns_about_every_axis_both_ways() -> None:
    motion = UnitMotion.nineteen(dwell=1.0)
    assert len(motion.attitudes) == 19
    turns = rotation_vector(np.swapaxes(motion.attitudes[:-1], 1, 2) @ motion.attitudes[1:]) / (math.pi / 2)
    np.testing.assert_allclose(np.sort(np.abs(turns), axis=1), np.tile([0, 0, 1], (18, 1)), atol=1e-12)
    counts = np.round([(turns > 0.5).sum(axis=0), (turns < -0.5).sum(axis=0)])
    assert counts.tolist() == [[3, 3, 3], [3, 3, 3]]
    found = {tuple(np.round(d, 9).tolist()) for d in downs(motion) + 0.0}
    assert len({tuple(abs(x) for x in d) for d in found}) == 3


@pytest.mark.parametrize("poses", [12, 20, 30])
def test_directions_of_an_icosahedron_are_even(poses: int) -> None:
    d = downs(UnitMotion.icosahedron(poses, dwell=1.0))
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(d.sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(d.T @ d, np.eye(3) * poses / 3, atol=1e-12)
    nearest = np.sort(d @ d.T, axis=1)[:, -2]
    np.testing.assert_allclose(nearest, nearest[0], atol=1e-12)
    assert np.sort(d @ d.T, axis=1)[:, 0] == pytest.approx(-1.0)


def test_two_positions() -> None:
    level = UnitMotion.two((0.01, -0.02, 1.0), dwell=5.0)
    np.testing.assert_allclose(downs(level)[0], downs(level)[1], atol=1e-15)
    headings = [angles_of(c)[2] for c in level.attitudes]
    assert headings == pytest.approx([1.0, 1.0 + math.pi])
    over = UnitMotion.two((0.01, -0.02, 1.0), dwell=5.0, turned="over")
    np.testing.assert_allclose(downs(over)[0] * [1, -1, -1], downs(over)[1], atol=1e-15)


def test_pointing_is_missed_about_three_axes() -> None:
    motion = UnitMotion.many(1000, dwell=1.0, turn=0.5, pointing_sd=0.01)
    course = motion.draw(np.random.SeedSequence(1))
    at_rest = course.pieces.first[course.pieces.kind == unit_course.REST]
    missed = rotation_vector(np.swapaxes(motion.attitudes, 1, 2) @ at_rest)
    np.testing.assert_allclose(missed.std(axis=0), 0.01, rtol=4 / math.sqrt(2000))


def test_random_attitudes_are_even() -> None:
    d = downs(UnitMotion.many(3000, seed=2, dwell=1.0))
    np.testing.assert_allclose(d.T @ d / 3000, np.eye(3) / 3, atol=4.5 * math.sqrt(4 / 45 / 3000))


# -- truth, blocks, refusals ------------------------------------------------------------------------------


def test_truth_goes_through_json() -> None:
    motion = UnitMotion.icosahedron(12, dwell=1.0, tremor=0.01, sway=0.001, settling_angle=(0.0, 0.01))
    record = silent(motion, calibration=drawn_errors(np.random.default_rng(1)), temperature=Temperature())
    step = json.loads(json.dumps(record.history[-1], allow_nan=False))
    assert step == record.history[-1]
    again = UnitMotion(**step["motion"]["parameters"])
    assert again.to_json() == motion.to_json()
    np.testing.assert_array_equal(samples(silent(again), GYRO), samples(silent(motion), GYRO))
    assert step["latitude"] == LATITUDE and step["gravity"] == normal_gravity(LATITUDE)
    with pytest.raises(InputError, match="true attitudes"):
        true_attitudes(al.simulate(NoiseModel.of(), rate=1.0, duration=9.0, seed=1), 0.0)


def test_m10_block_size_leaves_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = UnitMotion.icosahedron(12, dwell=1.0, tremor=0.01, settling_angle=0.01)
    whole = silent(motion, temperature=Temperature(drift=0.1))
    for size in (100, 101):
        monkeypatch.setattr(unit, "BLOCK", size)
        got = silent(motion, temperature=Temperature(drift=0.1))
        for name in whole.names:
            np.testing.assert_allclose(got.values(name), whole.values(name), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("rate", [100.0, 1.0, 0.13])
def test_means_are_the_means_of_the_values(rate: float) -> None:
    motion = UnitMotion.icosahedron(12, dwell=1.3, settling_angle=0.01, pointing_sd=0.1)
    record = silent(motion, rate=rate)
    fine = silent(motion, rate=rate * round(2000 / rate), sampling="point")
    part = round(2000 / rate)
    for sensor in (GYRO, ACCELEROMETER):
        y = samples(fine, sensor)[: len(samples(record, sensor)) * part]
        blocks = y[: len(y) // part * part].reshape(-1, part, 3).mean(axis=1)
        ends = samples(fine, sensor)[::part][: len(blocks) + 1]
        trapezoid = blocks[:-1] + (ends[1 : len(blocks)] - ends[: len(blocks) - 1]) / (2 * part)
        whole = samples(record, sensor)[: len(trapezoid)]
        np.testing.assert_allclose(whole, trapezoid, atol=3e-4)  # a corner of the settling inside a step


@pytest.mark.long
def test_accuracy_of_the_quadrature(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = UnitMotion.icosahedron(12, dwell=1.3, settling_angle=0.01, tremor=0.01, sway=0.001)
    course = motion.draw(np.random.SeedSequence(1))
    earth, force = earth_rate_vector(0.5), np.array([0, 0, -9.8])
    for dt in (0.01, 0.049, 0.06, 0.5):
        edges = np.arange(int(course.duration / dt)) * dt
        usual = course.means(edges, earth, force)
        with monkeypatch.context() as patched:
            patched.setattr(unit_course, "SHORT", 0.0)
            patched.setattr(unit_course, "MANY", 80)
            for ours, best in zip(usual, course.means(edges, earth, force), strict=True):
                np.testing.assert_allclose(ours, best, atol=1e-8)


@pytest.mark.long
def test_a_long_record_needs_little_memory_beside_its_samples() -> None:
    tracemalloc.start()
    record = silent(UnitMotion.rotation(0.1, 7200.0), rate=50.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak - 6 * 8 * record.n_samples < 40e6


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: UnitMotion.positions([0.0, 0.0, 0.0], dwell=1.0), "shape"),
        (lambda: UnitMotion.positions([[0.0, 0.0]], dwell=1.0), "roll, pitch, heading"),
        (lambda: UnitMotion.positions(np.ones((2, 3, 3)), dwell=1.0), "rotation matrices"),
        (lambda: UnitMotion.positions(-np.eye(3)[None], dwell=1.0), "rotation matrices"),
        (lambda: UnitMotion.positions([[0.0, math.nan, 0.0]], dwell=1.0), "rotation matrices"),
        (lambda: UnitMotion.positions("up", dwell=1.0), "numbers"),
        (lambda: UnitMotion.positions(np.zeros((2, 3)), dwell=[1.0]), "as many dwells"),
        (lambda: UnitMotion.positions(np.zeros((2, 3)), dwell=0.0), "positive seconds"),
        (lambda: UnitMotion.faces(dwell=1.0, turn=0.0), "turn_time"),
        (lambda: UnitMotion.faces(dwell=1.0, turn=(2.0, 1.0)), "range"),
        (lambda: UnitMotion.faces(dwell=1.0, tremor=-1.0), "tremor"),
        (lambda: UnitMotion.faces(dwell=1.0, settling_angle=-1.0), "settling_angle"),
        (lambda: UnitMotion.faces(dwell=1.0, wobble=1.0), "no option 'wobble'"),
        (lambda: UnitMotion.faces(dwell=1.0, spin=1.0), "either turns"),
        (lambda: UnitMotion.two(dwell=1.0, turned="left"), "'heading' or 'over'"),
        (lambda: UnitMotion.icosahedron(13, dwell=1.0), "12 corners"),
    ],
)
def test_b11_motions_that_make_no_sense_are_refused(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"latitude": 45.0}, "radians"),
        ({"latitude": math.nan}, "latitude"),
        ({"height": 1e6}, "height"),
        ({"gravity": -9.8}, "gravity must be positive"),
        ({"motion": al.filtering.simulation.Motion.still()}, "UnitMotion"),
        ({"axes": "FLD"}, "right-handed"),
        ({"seed": -1}, "seed"),
        ({"rate": 0.0}, "rate"),
        ({"models": {}}, "none"),
        ({"models": {"gyro_x": NoiseModel.of()}}, "one model for 'gyro'"),
        ({"models": {"gyro": NoiseModel.of(), "gyro_x": NoiseModel.of()}}, "one model for 'gyro'"),
        ({"models": {"magnetometer": NoiseModel.of()}}, "not of 'magnetometer'"),
        ({"temperature": 25.0}, "Temperature"),
        ({"temperature": Temperature(coefficient=1.0)}, "bias_temperature_x"),
        ({"sampling": "now"}, "sampling"),
    ],
)
def test_b11_scenes_that_make_no_sense_are_refused(change: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"motion": UnitMotion.still(duration=1.0), **change}
    with pytest.raises(InputError, match=message):
        silent(given.pop("motion"), **given)
