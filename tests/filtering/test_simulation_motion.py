# SPDX-License-Identifier: BSD-3-Clause
"""Turned sensors against closed forms: no noise, so that every bound is rounding; fixed seeds where there is chance."""

from __future__ import annotations

import json
import math
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.filtering.simulation import Motion, Temperature, course, record
from allanite.noise import NoiseModel, RandomWalk, White
from allanite.quantities.earth import EARTH_RATE
from allanite_seed_paper import twin as seed_paper

DEGREE = math.pi / 180
LATITUDE = -23.31 * DEGREE
LEVEL = EARTH_RATE * math.cos(LATITUDE)
SILENT = NoiseModel.of()
FULL: dict[str, Any] = {
    "pointing_offset": 0.01,
    "pointing_sd": 0.02,
    "settling_angle": (3e-4, 5e-3),
    "settling_time": (1.0, 10.0),
    "coherent_bias": 2e-5,
    "dwell_sd": 1.0,
    "missed": (3,),
    "knocks": (44.0,),
    "knocks_per_hour": 60.0,
    "elevation": 0.01,
    "table_tilt": 0.02,
    "table_tilt_heading": 1.0,
}


def silent(
    motion: Motion | None, *, rate: float = 32.0, duration: float = 300.0, seed: int = 1, **options: Any
) -> al.Recording:
    if motion is not None:
        options.setdefault("latitude", LATITUDE)
    options.setdefault("model", SILENT)
    return al.simulate(
        options.pop("model"), rate=rate, duration=duration, seed=seed, motion=motion, **options
    )


def truth(rec: al.Recording) -> dict[str, Any]:
    motion: dict[str, Any] = rec.history[-1]["motion"]
    return motion


def samples_within(rec: al.Recording, span: dict[str, Any]) -> np.ndarray:
    """The samples that lie in a stretch altogether."""
    first, last = math.ceil(span["start"] * rec.rate - 1e-9), math.floor(span["stop"] * rec.rate + 1e-9)
    return rec.values(rec.names[0])[first:last]


def integral(rec: al.Recording, start: float, stop: float) -> float:
    """Of a record of means, between instants of its grid [rad]."""
    return float(rec.values("gyro")[round(start * rec.rate) : round(stop * rec.rate)].sum() / rec.rate)


# -- the Earth on a turned axis ---------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("first", ["north", "south"])
def test_dwells_read_plus_and_minus_the_level_earth_rate(first: str, sampling: str) -> None:
    rec = silent(Motion.reversals(30.0, first=first), sampling=sampling)
    positions = truth(rec)["positions"]
    assert len(positions) == 10
    sign = 1.0 if first == "north" else -1.0
    for i, position in enumerate(positions):
        y = samples_within(rec, position)
        assert len(y) > 26 * 32
        np.testing.assert_allclose(y, sign * (-1) ** i * LEVEL, rtol=1e-12)


def test_e1_twelve_headings_at_latitude_45() -> None:
    headings = np.arange(12) * 30 * DEGREE
    rec = silent(Motion.positions(headings, 10.0), duration=120.0, latitude=math.pi / 4)
    level = []
    for heading, position in zip(headings, truth(rec)["positions"], strict=True):
        assert position["heading"] == pytest.approx(heading, abs=1e-12)
        level.append(samples_within(rec, position).mean())
    north, east = 2 / 12 * np.cos(headings) @ level, 2 / 12 * np.sin(headings) @ level
    assert math.degrees(north) * 3600 == pytest.approx(10.635640598320, rel=1e-12)
    assert abs(math.degrees(math.atan2(east, north))) < 1e-9


def test_rotation_follows_the_cosine() -> None:
    spin, start, rate = 12 * DEGREE, 0.3, 4.0
    rec = silent(Motion.rotation(spin, start), rate=rate)
    edges = np.arange(rec.n_samples + 1) / rate
    expected = LEVEL * np.diff(np.sin(start + spin * edges)) / (spin / rate)
    np.testing.assert_allclose(rec.values("gyro"), expected, atol=1e-12 * LEVEL)
    point = silent(Motion.rotation(spin, start), rate=rate, sampling="point").values("gyro")
    np.testing.assert_allclose(point, LEVEL * np.cos(start + spin * edges[:-1]), atol=1e-12 * LEVEL)


def test_still_sensor_keeps_its_heading() -> None:
    rec = silent(Motion.still(60 * DEGREE), duration=10.0)
    np.testing.assert_allclose(rec.values("gyro"), LEVEL / 2, rtol=1e-12)
    assert truth(rec)["turns"] == []


def test_without_latitude_the_earth_stands_still() -> None:
    rec = silent(Motion.reversals(30.0, coupling=0.0), latitude=None)
    assert not rec.values("gyro").any()


def test_two_axes_at_right_angles() -> None:
    motion = Motion.positions([0.4, 2.0, 5.0], 20.0, axes={"x": 0.0, "y": math.pi / 2})
    rec = silent(motion, model={"x": SILENT, "y": SILENT}, duration=60.0)
    for heading, position in zip((0.4, 2.0, 5.0), truth(rec)["positions"], strict=True):
        both = [samples_within(rec.select(name), position).mean() for name in "xy"]
        assert both == pytest.approx([LEVEL * math.cos(heading), -LEVEL * math.sin(heading)], rel=1e-12)


def reversal_rate(rec: al.Recording) -> float:
    """Half the difference of the first two dwells."""
    north, south = (samples_within(rec, p).mean() for p in truth(rec)["positions"][:2])
    return float(north - south) / 2


def test_e7_elevation_of_the_axis_cancels_but_for_its_cosine() -> None:
    up = 2 * DEGREE
    rec = silent(Motion.reversals(30.0, elevation=up))
    assert reversal_rate(rec) == pytest.approx(LEVEL * math.cos(up), rel=1e-12)
    mean = np.mean([samples_within(rec, p).mean() for p in truth(rec)["positions"][:2]])
    assert mean == pytest.approx(EARTH_RATE * math.sin(LATITUDE) * math.sin(up), rel=1e-9)


@pytest.mark.parametrize(
    ("towards", "expected"),
    [
        (0.0, math.cos(LATITUDE + 0.01)),
        (math.pi, math.cos(LATITUDE - 0.01)),
        (math.pi / 2, math.cos(LATITUDE)),
    ],
)
def test_e7_lean_of_the_table_does_not_cancel(towards: float, expected: float) -> None:
    rec = silent(Motion.reversals(30.0, table_tilt=0.01, table_tilt_heading=towards))
    assert reversal_rate(rec) == pytest.approx(EARTH_RATE * expected, rel=1e-12)


def test_leaning_table_against_rotation_matrices() -> None:
    tilt, towards, up, heading = 0.3, 2.2, 0.2, 1.1
    b = np.array([math.cos(towards), math.sin(towards), 0.0])
    k = np.cross([0.0, 0.0, 1.0], b)  # north, east, up is left-handed: the sense is set by what up becomes
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    R = np.eye(3) + math.sin(tilt) * K + (1 - math.cos(tilt)) * K @ K
    np.testing.assert_allclose(R @ [0, 0, 1], math.sin(tilt) * b + [0, 0, math.cos(tilt)], atol=1e-15)
    axis = R @ [math.cos(up) * math.cos(heading), math.cos(up) * math.sin(heading), math.sin(up)]
    expected = EARTH_RATE * axis @ [math.cos(LATITUDE), 0.0, math.sin(LATITUDE)]
    motion = Motion.still(heading, elevation=up, table_tilt=tilt, table_tilt_heading=towards)
    assert silent(motion, duration=1.0).values("gyro")[0] == pytest.approx(expected, rel=1e-12)


# -- turning ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [32.0, 2.0, 0.1])
def test_a_turn_integrates_to_half_a_turn(rate: float) -> None:
    rec = silent(Motion.reversals(30.0, unsteadiness=0.1), rate=rate, latitude=None)
    for i, turn in enumerate(truth(rec)["turns"]):
        assert turn["angle"] == pytest.approx((-1) ** i * math.pi, rel=1e-12)
        assert 1.0 <= turn["stop"] - turn["start"] <= 3.0
        assert turn["start"] == pytest.approx(30.0 * (i + 1))
        assert integral(rec, turn["start"], turn["start"] + 10) == pytest.approx(turn["angle"], rel=1e-11)
    onward = silent(Motion.reversals(30.0, onward=True), rate=rate, latitude=None)
    assert integral(onward, 0.0, 300.0) == pytest.approx(9 * math.pi, rel=1e-11)


def test_what_the_axis_sees_of_a_turn() -> None:
    level = silent(Motion.reversals(30.0, coupling=0.0), latitude=None)
    assert not level.values("gyro").any()
    # Over east is clockwise from above: an axis that looks up by e sees -sin(e) of it.
    up = silent(Motion.reversals(30.0, coupling=0.0, elevation=0.1), latitude=None)
    assert integral(up, 30.0, 40.0) == pytest.approx(-math.pi * math.sin(0.1), rel=1e-11)
    part = silent(Motion.reversals(30.0, coupling=0.25), latitude=None)
    assert integral(part, 30.0, 40.0) == pytest.approx(math.pi / 4, rel=1e-11)


def test_turns_begin_and_end_at_rest_and_are_smooth() -> None:
    y = silent(Motion.reversals(30.0), rate=1000.0, duration=40.0, latitude=None).values("gyro")
    peak = np.abs(y).max()
    assert 1.5 * math.pi / 3 < peak < 2.5 * math.pi / 1
    assert np.abs(np.diff(y)).max() < 0.01 * peak


def test_overload_is_written_as_asked() -> None:
    full = 110 * DEGREE
    free = silent(Motion.reversals(30.0), unit="deg/s").values("gyro")
    over = np.abs(free) > 110
    assert 100 < over.sum() < 0.1 * len(free)
    clipped = silent(Motion.reversals(30.0, full_scale=full), unit="deg/s").values("gyro")
    np.testing.assert_allclose(clipped, np.clip(free, -110, 110), rtol=1e-12)
    missing = silent(Motion.reversals(30.0, full_scale=full, overload="nan"), unit="deg/s").values("gyro")
    np.testing.assert_array_equal(np.isnan(missing), over)
    meter = silent(Motion.reversals(30.0, full_scale=full, overload="1e38"), unit="deg/s")
    np.testing.assert_array_equal(meter.raw("gyro")[over], np.copysign(1e38, free[over]))
    np.testing.assert_array_equal(np.isnan(meter.values("gyro")), over)
    np.testing.assert_array_equal(meter.values("gyro")[~over], free[~over])


def test_settling_rotation_has_the_angle_and_the_sense_of_its_turn() -> None:
    options: dict[str, Any] = {"settling_angle": 0.12 * DEGREE, "settling_time": 5.0, "coupling": 0.0}
    for onward in (False, True):
        rec = silent(Motion.reversals(30.0, onward=onward, **options), latitude=None)
        for i, turn in enumerate(truth(rec)["turns"]):
            sign = 1.0 if onward else (-1.0) ** i
            stays = 30.0 * (i + 2) - turn["stop"]
            expected = sign * 0.12 * DEGREE * -math.expm1(-stays / 5.0)
            assert integral(rec, turn["start"], turn["start"] + 30) == pytest.approx(expected, rel=1e-11)
            assert turn["settling_angle"] == pytest.approx(sign * 0.12 * DEGREE)
    y = silent(Motion.reversals(30.0, **options), latitude=None, sampling="point").values("gyro")
    turn = truth(rec)["turns"][0]
    k = math.ceil(turn["stop"] * 32)
    assert y[k] == pytest.approx(0.12 * DEGREE / 5 * math.exp(-(k / 32 - turn["stop"]) / 5), rel=1e-11)


def test_settling_is_drawn_within_its_ranges() -> None:
    motion = Motion.reversals(10.0, settling_angle=(0.02 * DEGREE, 0.3 * DEGREE), settling_time=(1.0, 10.0))
    turns = truth(silent(motion, rate=1.0, duration=6000.0))["turns"]
    angle, constant = (np.abs([t[k] for t in turns]) for k in ("settling_angle", "settling_time"))
    for x, low, high in ((angle, 0.02 * DEGREE, 0.3 * DEGREE), (constant, 1.0, 10.0)):
        assert low <= x.min() and x.max() <= high
        spread = (high - low) / math.sqrt(12)
        assert x.mean() == pytest.approx((low + high) / 2, abs=4 * spread / math.sqrt(len(x)))
        assert x.std() == pytest.approx(spread, rel=0.1)


def test_coherent_bias_turns_with_the_sensor_and_knows_no_scale_error() -> None:
    rec = silent(Motion.reversals(30.0, coherent_bias=3e-5), scale_error=0.1)
    assert reversal_rate(rec) == pytest.approx(1.1 * LEVEL + 3e-5, rel=1e-12)
    east = Motion.reversals(30.0, coherent_bias=3e-5, coherent_heading=math.pi / 2)
    assert reversal_rate(silent(east)) == pytest.approx(LEVEL, rel=1e-12)


def test_pointing_error_is_of_second_order() -> None:
    motion = Motion.reversals(10.0, pointing_offset=0.05, pointing_sd=0.03)
    rec = silent(motion, duration=8000.0, rate=4.0)
    positions = truth(rec)["positions"]
    off = np.array([(p["heading"] - p["nominal"] + math.pi) % (2 * math.pi) - math.pi for p in positions])
    assert off.mean() == pytest.approx(0.05, abs=4 * 0.03 / math.sqrt(len(off)))
    assert off.std() == pytest.approx(0.03, rel=4 / math.sqrt(2 * len(off)))
    for i, position in enumerate(positions[:20]):
        expected = (-1) ** i * LEVEL * math.cos(off[i])
        assert samples_within(rec, position).mean() == pytest.approx(expected, rel=1e-11)


def test_missed_turn_leaves_the_sensor_where_it_is() -> None:
    rec = silent(Motion.reversals(30.0, missed=(2,)))
    found = truth(rec)
    assert found["missed"] == [90.0]
    assert len(found["turns"]) == 8 and len(found["positions"]) == 10
    signs = [math.cos(p["heading"]) for p in found["positions"]]
    assert signs == pytest.approx([1, -1, 1, 1, -1, 1, -1, 1, -1, 1])
    nominal = [math.cos(p["nominal"]) for p in found["positions"]]
    assert nominal == pytest.approx([1, -1] * 5)
    np.testing.assert_allclose(rec.values("gyro")[(64 * 32) : 120 * 32], LEVEL, rtol=1e-12)


def test_unequal_dwells_and_a_late_operator() -> None:
    starts = [t["start"] for t in truth(silent(Motion.reversals([30.0, 40.0, 20.0])))["turns"]]
    assert starts == pytest.approx([30, 70, 90, 120, 160, 180, 210, 250, 270])
    motion = Motion.reversals(30.0, dwell_sd=2.0)
    late = np.array([t["start"] for t in truth(silent(motion, rate=1.0, duration=30_000.0))["turns"]])
    error = late - 30.0 * np.arange(1, len(late) + 1)
    assert error.mean() == pytest.approx(0.0, abs=4 * 2 / math.sqrt(len(late)))
    assert error.std() == pytest.approx(2.0, rel=4 / math.sqrt(2 * len(late)))  # it does not add up
    wild = silent(Motion.reversals(4.0, dwell_sd=50.0), rate=1.0, duration=3000.0)
    spans = [(t["start"], t["stop"]) for t in truth(wild)["turns"]]
    assert all(stop < start for (_, stop), (start, _) in zip(spans, spans[1:], strict=False))


def test_positions_go_back_or_onward() -> None:
    quarters = np.arange(4) * math.pi / 2
    back = truth(silent(Motion.positions(quarters, 20.0), duration=120.0))
    assert [t["angle"] / DEGREE for t in back["turns"]] == pytest.approx([90, 90, 90, -270, 90])
    onward = truth(silent(Motion.positions(quarters, 20.0, onward=True), duration=120.0))
    assert [t["angle"] / DEGREE for t in onward["turns"]] == pytest.approx([90] * 5)
    assert [p["heading"] / DEGREE for p in onward["positions"]] == pytest.approx([0, 90, 180, 270, 0, 90])


def test_knocks_are_short_and_rotate_nothing() -> None:
    rec = silent(Motion.still(0.0, knocks=(10.01,), knock_size=0.1, knock_length=0.2), latitude=None)
    y = rec.values("gyro")
    assert integral(rec, 9.0, 11.0) == pytest.approx(0.0, abs=1e-15)
    assert not y[: 10 * 32].any() and not y[math.ceil(10.21 * 32) :].any()
    assert 0.08 < y.max() < 0.1 and -0.1 < y.min() < -0.08  # means over 1/32 s of a sine of 0.2 s
    point = silent(
        Motion.still(0.0, knocks=(10.0,), knock_length=0.2), rate=100.0, sampling="point", latitude=None
    )
    np.testing.assert_allclose(
        point.values("gyro")[1000:1020], 5 * DEGREE * np.sin(2 * np.pi * np.arange(20) / 20), atol=1e-13
    )
    assert np.count_nonzero(point.values("gyro") > 1e-12) == 9


def test_random_knocks_come_at_their_rate_and_spare_the_turns() -> None:
    found = truth(silent(Motion.reversals(30.0, knocks_per_hour=100.0), rate=1.0, duration=36_000.0))
    free = 1 - 2 / 30
    assert len(found["knocks"]) == pytest.approx(1000 * free, abs=4 * math.sqrt(1000))
    turns = np.array([(t["start"], t["stop"]) for t in found["turns"]])
    for knock in found["knocks"]:
        assert not ((turns[:, 0] < knock["stop"]) & (knock["start"] < turns[:, 1])).any()


# -- sampling ---------------------------------------------------------------------------------------------


def test_means_over_long_samples_are_means_of_short_ones() -> None:
    motion = Motion.reversals(30.0, **FULL)
    fine = silent(motion, rate=64.0, duration=1200.0).values("gyro")
    for rate in (8.0, 1.0, 0.1, 1 / 60):
        long = silent(motion, rate=rate, duration=1200.0).values("gyro")
        np.testing.assert_allclose(long, fine.reshape(len(long), -1).mean(axis=1), atol=3e-13)


def test_means_are_means_of_the_values() -> None:
    motion = Motion.reversals(30.0, unsteadiness=0.1, knocks=(13.0,))
    mean = silent(motion, rate=4.0, duration=90.0).values("gyro")
    y = silent(motion, rate=4000.0, duration=90.0, sampling="point").values("gyro")
    trapezoid = (y[:-1] + y[1:])[: len(mean) * 1000 - 1].sum() / 8000
    assert mean.sum() / 4.0 == pytest.approx(trapezoid, abs=1e-7)
    within = np.append(y, y[-1])
    blocks = np.array([np.trapezoid(within[i * 1000 : i * 1000 + 1001]) / 1000 for i in range(len(mean))])
    np.testing.assert_allclose(mean, blocks, atol=1e-6)  # h^2/12 of the largest second derivative


def test_accuracy_of_the_quadrature(monkeypatch: pytest.MonkeyPatch) -> None:
    turned = Motion.reversals(30.0, unsteadiness=0.1).draw(600.0, np.random.SeedSequence(1))
    for dt in (1 / 32, 0.06, 0.07, 1.0, 4.0):
        edges = np.arange(round(600 / dt) + 1) * dt
        usual = turned.means(edges)
        with monkeypatch.context() as patched:
            patched.setattr(course, "SHORT", 0.0)
            patched.setattr(course, "MANY", 64)
            for ours, best in zip(usual, turned.means(edges), strict=True):
                np.testing.assert_allclose(ours, best, atol=1e-12)


def test_m10_block_size_leaves_no_trace_in_a_turned_record(monkeypatch: pytest.MonkeyPatch) -> None:
    warm = Temperature(rise=5.0, drift=1e-3, coefficient=1e-6, noise=0.01)
    noise = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6))

    def run() -> list[np.ndarray]:
        rec = silent(
            Motion.reversals(30.0, full_scale=1.0, **FULL),
            model=noise,
            warm_up=(1e-3, 100.0),
            temperature=warm,
        )
        return [rec.values(name) for name in rec.names]

    whole = run()
    for normals in (1000, 1001, 1 << 20):
        monkeypatch.setattr(record, "NORMALS", normals)
        for got, expected in zip(run(), whole, strict=True):
            np.testing.assert_array_equal(got, expected)


# -- biases -----------------------------------------------------------------------------------------------


def test_scale_error_and_turn_on_bias() -> None:
    rec = silent(Motion.reversals(30.0), scale_error=0.01, turn_on_bias=1e-3)
    north, south = (samples_within(rec, p).mean() for p in truth(rec)["positions"][:2])
    assert (north, south) == pytest.approx((1e-3 + 1.01 * LEVEL, 1e-3 - 1.01 * LEVEL), rel=1e-12)
    assert integral(rec, 30.0, 40.0) == pytest.approx(
        1.01 * math.pi + 10 * 1e-3 - 8 * 1.01 * LEVEL, abs=2 * 1.01 * LEVEL
    )
    still = silent(None, model={"x": SILENT, "y": SILENT}, turn_on_bias={"x": 1e-3, "y": 2e-3}, duration=1.0)
    assert (still.values("x")[0], still.values("y")[0]) == (1e-3, 2e-3)
    assert still.history[-1]["turn_on_bias"] == {"x": 1e-3, "y": 2e-3}


@pytest.mark.parametrize("rate", [32.0, 0.01])
def test_warm_up_is_the_mean_of_its_exponential(rate: float) -> None:
    rec = silent(None, rate=rate, duration=2000.0, warm_up=(0.01, 250.0))
    edges = np.arange(rec.n_samples + 1) / rate
    expected = -0.01 * 250 * rate * np.diff(np.exp(-edges / 250))
    np.testing.assert_allclose(rec.values("gyro"), expected, rtol=1e-9)
    point = silent(None, rate=rate, duration=2000.0, warm_up=(0.01, 250.0), sampling="point")
    np.testing.assert_allclose(point.values("gyro"), 0.01 * np.exp(-edges[:-1] / 250), rtol=1e-12)
    assert rec.history[-1]["warm_up"] == [0.01, 250.0]


@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_temperature_is_written_and_moves_the_bias(sampling: str) -> None:
    warm = Temperature(start=20.0, drift=2 / 3600, rise=8.0, time_constant=600.0, coefficient=1e-5)
    rec = silent(None, rate=1.0, duration=3600.0, temperature=warm, sampling=sampling)
    channel = rec["temperature"]
    assert (channel.kind, channel.unit, channel.sampling) == ("temperature", "°C", sampling)
    t = np.arange(3600.0)
    edges = np.arange(3601.0)
    if sampling == "mean":
        expected = 20 + 2 / 3600 * (t + 0.5) + 8 * (1 + 600 * np.diff(np.exp(-edges / 600)))
    else:
        expected = 20 + 2 / 3600 * t + 8 * (1 - np.exp(-t / 600))
    np.testing.assert_allclose(rec.values("temperature"), expected, rtol=1e-12)
    np.testing.assert_allclose(rec.values("gyro"), 1e-5 * (expected - 20), atol=1e-16)
    hidden = Temperature(start=20.0, reference=30.0, coefficient=1e-5, channel=None)
    alone = silent(None, duration=1.0, temperature=hidden)
    assert alone.names == ("gyro",)
    assert alone.values("gyro")[0] == pytest.approx(-1e-4)


def test_temperature_of_a_sample_is_its_mean_over_it() -> None:
    heat = Temperature(start=20.0, drift=0.01, rise=3.0, time_constant=30.0, swing=5.0, period=80.0)
    t, nodes = np.array([0.0, 7.0, 33.0]), (np.arange(4000) + 0.5) / 4000
    plain = np.array([heat.over(x + 12.0 * nodes, 0.0).mean() for x in t])
    np.testing.assert_allclose(heat.over(t, 12.0), plain, rtol=1e-7)


def test_thermometer_has_noise_of_its_own() -> None:
    rec = silent(None, duration=1000.0, temperature=Temperature(start=20.0, coefficient=1e-5, noise=0.1))
    readings = rec.values("temperature")
    assert readings.std() == pytest.approx(0.1, rel=4 / math.sqrt(2 * len(readings)))
    assert not rec.values("gyro").any()


# -- streams and truth ------------------------------------------------------------------------------------


def test_noise_of_a_seed_is_the_same_with_and_without_motion() -> None:
    noise = {"x": NoiseModel.of(White(N=1e-4)), "y": NoiseModel.of(RandomWalk(K=1e-5))}
    motion = Motion.reversals(30.0, axes={"x": 0.0, "y": 1.0}, **FULL)
    still = al.simulate(noise, rate=32.0, duration=300.0, seed=7)
    turned = silent(motion, model=noise, seed=7, temperature=Temperature(noise=1.0))
    signal = silent(motion, model=dict.fromkeys(noise, SILENT), seed=7)
    for name in noise:
        difference = turned.values(name) - signal.values(name)
        np.testing.assert_allclose(difference, still.values(name), atol=1e-14)
    other = silent(motion, model=dict.fromkeys(noise, SILENT), seed=8)
    assert truth(other)["turns"] != truth(signal)["turns"]
    assert truth(turned) == truth(signal)


def test_a_longer_record_begins_with_the_same_course() -> None:
    motion = Motion.reversals([30.0, 20.0], **FULL)
    short, long = (truth(silent(motion, rate=1.0, duration=d)) for d in (400.0, 900.0))
    for key in ("turns", "missed", "knocks"):
        assert short[key] == long[key][: len(short[key])]
    assert short["positions"][:-1] == long["positions"][: len(short["positions"]) - 1]


def test_truth_goes_through_json() -> None:
    motion = Motion.reversals(30.0, full_scale=2.0, overload="nan", axes={"gyro": 0.1}, **FULL)
    rec = silent(motion, scale_error=0.01, warm_up=(1e-3, 60.0), temperature=Temperature())
    step = json.loads(json.dumps(rec.history[-1], allow_nan=False))
    assert step == rec.history[-1]
    assert Motion(**step["motion"]["parameters"]) == motion
    assert (step["latitude"], step["scale_error"]) == (LATITUDE, 0.01)
    positions, turns = step["motion"]["positions"], step["motion"]["turns"]
    assert positions[0]["start"] == 0.0 and positions[-1]["stop"] == 300.0
    assert len(positions) == len(turns) + 1 + len(step["motion"]["missed"])
    assert set(silent(None).history[-1]) == {"step", "seed", "sampling", "models"}


@pytest.mark.long
def test_long_record_needs_little_memory_beside_its_samples() -> None:
    samples = 8 * 43_200 * 32
    tracemalloc.start()
    silent(Motion.reversals(30.0), duration=43_200.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak - samples < 60e6


# -- refusals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Motion.reversals(30.0, first="east"), "'north' or 'south'"),
        (lambda: Motion.reversals(3.0), "holds no turn"),
        (lambda: Motion.reversals("30 s"), "dwells must be numbers"),
        (lambda: Motion.reversals([30.0, math.nan]), "finite"),
        (lambda: Motion.reversals(30.0, speed=1.0), "no option 'speed'"),
        (lambda: Motion.reversals(30.0, turn_time=(3.0, 1.0)), "turn_time"),
        (lambda: Motion.reversals(30.0, pointing_sd=-1.0), "pointing_sd must not be negative"),
        (lambda: Motion.reversals(30.0, settling_time=0.0), "positive"),
        (lambda: Motion.reversals(30.0, settling_angle=(2.0, 1.0)), "ends of a range"),
        (lambda: Motion.reversals(30.0, full_scale=0.0), "full_scale"),
        (lambda: Motion.reversals(30.0, overload="zero"), "overload"),
        (lambda: Motion.reversals(30.0, missed=(-1,)), "missed"),
        (lambda: Motion.reversals(30.0, elevation=2.0), "below pi/2"),
        (lambda: Motion.positions([], 30.0), "headings are missing"),
        (lambda: Motion.positions([[0.0, 1.0]], 30.0), "one row"),
        (lambda: Motion.rotation(0.1, dwells=(30.0,)), "constant rate"),
        (lambda: Motion.rotation((0.1, 0.2)), "one number"),
        (lambda: Temperature(time_constant=0.0), "time_constant"),
        (lambda: Temperature(start=math.inf), "finite"),
    ],
)
def test_b11_motions_that_make_no_sense_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"latitude": -23.31}, "it would be -0.406836 rad"),
        ({"latitude": math.nan}, "latitude must be a finite number"),
        ({"motion": None}, "depends on its heading"),
        ({"motion": 30.0}, "Motion.reversals"),
        ({"model": {"x": SILENT, "y": SILENT}}, "axes="),
        ({"motion": Motion.still(axes={"z": 0.0})}, "'gyro' points"),
        ({"unit": "m/s²"}, "turns gyros only"),
        ({"warm_up": 0.1}, "pair"),
        ({"warm_up": (0.1, 0.0)}, "positive"),
        ({"temperature": 25.0}, "Temperature"),
        ({"scale_error": {"x": 0.1}}, "no value for channel 'gyro'"),
        ({"turn_on_bias": "big"}, "turn_on_bias must be a finite number"),
        ({"temperature": Temperature(channel="gyro")}, "must differ"),
    ],
)
def test_b11_scenes_that_make_no_sense_are_refused(change: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"motion": Motion.reversals(30.0), "latitude": LATITUDE, **change}
    with pytest.raises(InputError, match=message):
        silent(given.pop("motion"), **given)


# -- the seed paper ---------------------------------------------------------------------------------------


def pairs(rec: al.Recording, start: float = 0.0) -> float:
    """The paper's estimator: north dwells less the south dwells that follow, over 2 cos(latitude) [deg/s]."""
    means = [samples_within(rec, p).mean() for p in truth(rec)["positions"] if p["start"] >= start]
    n = len(means) // 2 * 2
    return float(np.mean(np.subtract(means[0:n:2], means[1:n:2]))) / (2 * math.cos(seed_paper.LATITUDE))


def test_seed_paper_sensor() -> None:
    model = seed_paper.sensor()
    floor = model.term("gauss_markov")
    assert floor is not None
    tau = np.geomspace(1, 1e5, 4001)
    assert np.sqrt(floor.avar(tau).max()) == pytest.approx(0.664283 * 0.0027 * DEGREE, rel=1e-4)
    assert seed_paper.sensor(flicker=True).adev(400.0) == pytest.approx(
        math.sqrt(0.0122**2 / 400 + (0.664283 * 0.0027) ** 2 + 6.8314e-5**2 * 400 / 3) * DEGREE, rel=1e-5
    )
    rec = seed_paper.week(3, duration=60.0)
    assert (rec.n_samples, rec.rate, rec["gyro"].unit) == (1920, 32.0, "deg/s")
    assert seed_paper.WEEK * seed_paper.RATE == 19_353_600


@pytest.mark.parametrize(
    ("number", "minutes", "turns"), [(1, 120, 239), (2, 12, 23), (3, 25, 49), (4, 60, 119)]
)
def test_seed_paper_takes(number: int, minutes: int, turns: int) -> None:
    rec = seed_paper.take(number, 5)
    found = truth(rec)
    assert rec.duration == 60.0 * minutes and len(found["turns"]) == turns
    assert found["positions"][0]["heading"] == 0.0  # north first
    assert ("warm_up" in rec.history[-1]) is (number == 4)
    assert np.abs(rec.values("gyro")).max() == pytest.approx(110.0)  # the turns overrun the converter
    again = seed_paper.take(number, 5)
    np.testing.assert_array_equal(again.values("gyro"), rec.values("gyro"))


def test_seed_paper_takes_and_week_of_a_seed_are_independent() -> None:
    n = 700
    one = [seed_paper.take(k, 1).values("gyro")[:n] for k in (1, 2, 3, 4)]
    one.append(seed_paper.week(1, duration=30.0).values("gyro")[:n])
    correlation = np.corrcoef([y - y.mean() for y in one])[np.triu_indices(5, 1)]
    assert np.abs(correlation).max() < 4 / math.sqrt(n)


def test_seed_paper_warm_up_explains_both_readings_of_take_4() -> None:
    def quiet(duration: float) -> al.Recording:
        return silent(
            seed_paper.take_motion(turn_time=(1e-3, 2e-3), coupling=0.0),
            duration=duration,
            latitude=seed_paper.LATITUDE,
            unit="deg/s",
            warm_up=seed_paper.take(4, 1).history[-1]["warm_up"],
        )

    rec = quiet(3600.0)
    assert pairs(rec) * DEGREE == pytest.approx(seed_paper.TAKES[4].published, abs=1e-5 * DEGREE)
    assert pairs(rec, 2819.0) * DEGREE == pytest.approx(seed_paper.TAKE_4_END.published, abs=1e-5 * DEGREE)


@pytest.mark.parametrize(
    ("fault", "shift"),
    [
        ("settling", -0.12 / 30 / 0.91838),
        ("coherent", -0.0034 / 0.91838),
        ("drift", -0.96 / 120 / 2 / 0.91838),
    ],
)
def test_seed_paper_faults_move_the_pairs_as_said(fault: str, shift: float) -> None:
    clean, wrong = (seed_paper.take(2, 9, faults=f) for f in ((), (fault,)))
    assert truth(clean)["positions"] == truth(wrong)["positions"]
    # The part of the settling within the turn-free dwell, of 27 to 29 s, against all of it in 30 s.
    assert pairs(wrong) - pairs(clean) == pytest.approx(shift, rel=0.15)


def test_seed_paper_refuses_other_takes_and_faults() -> None:
    with pytest.raises(InputError, match="takes 1, 2, 3 and 4"):
        seed_paper.take(5, 1)
    with pytest.raises(InputError, match="no fault 'ghost'"):
        seed_paper.take(1, 1, faults=["ghost"])
    with pytest.raises(InputError, match="seed must be"):
        seed_paper.take(1, -1)
