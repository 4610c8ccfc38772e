# SPDX-License-Identifier: BSD-3-Clause
"""Self-alignment: geometry, formulas, coverage, refusals. Battery rows E as they apply to a unit of three axes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from allanite.errors import DataQualityError, InputError
from allanite.experiments.alignment import AlignmentPlan, align, predict_alignment
from allanite.experiments.alignment.directions import direction_of
from allanite.experiments.alignment.results import AlignmentEstimate
from allanite.experiments.alignment.turns import turn_of
from allanite.filtering.simulation import Temperature, UnitMotion, simulate_unit
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.attitude import attitude_of, rotation, rotation_vector
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import Calibration, parameter_names
from allanite.recording.records import ArrayColumn, Recording

DEG = math.pi / 180
GYRO = NoiseModel.of(White(N=0.01 * DEG / 60))
ACC = NoiseModel.of(White(N=1e-4), kind="acceleration")
MODEL = {"gyro": GYRO, "accelerometer": ACC}
#: A sensor without noise, for geometry.
SILENT = {
    "gyro": NoiseModel.of(White(N=1e-18)),
    "accelerometer": NoiseModel.of(White(N=1e-18), kind="acceleration"),
}
CHANNELS = {"gyro": ("gyro_x", "gyro_y", "gyro_z"), "accelerometer": ("acc_x", "acc_y", "acc_z")}
RATE = 2.0


def degrees(*values: float) -> tuple[float, ...]:
    return tuple(v * DEG for v in values)


def calibration(sds: Mapping[str, float], values: Mapping[str, float] | None = None) -> Calibration:
    """Of both triads; standard deviations by kind, as "gyro.bias"."""
    names = parameter_names("accelerometer") + parameter_names("gyro")
    sd = np.array([sds.get(n.rsplit("_", 1)[0], 0.0) for n in names])
    nominal = [1.0 if ".scale_" in n else 0.0 for n in names]
    return Calibration(
        names=names,
        values=np.array(nominal) + np.array([(values or {}).get(n, 0.0) for n in names]),
        covariance=np.diag(sd**2),
        status=("estimated",) * len(names),
        channels=CHANNELS,
        units={"gyro": "rad/s", "accelerometer": "m/s²"},
    )


def twin(
    motion: UnitMotion,
    *,
    latitude: float = 45 * DEG,
    noise: Mapping[str, NoiseModel] = SILENT,
    seed: int = 1,
    rate: float = RATE,
    **options: Any,
) -> tuple[Recording, np.ndarray, tuple[tuple[float, float, float], ...]]:
    """A record, its stretches at rest, and the true attitudes."""
    settings = {"axes": "FLU", "rate": rate, "latitude": latitude, "seed": seed, **options}
    record = simulate_unit(noise, motion=motion, **settings)  # type: ignore[arg-type]
    positions = record.history[-1]["motion"]["positions"]
    spans = np.array([(math.ceil(p["start"] * rate), math.floor(p["stop"] * rate)) for p in positions])
    return record, spans, tuple((p["roll"], p["pitch"], p["heading"]) for p in positions)


def aligned(motion: UnitMotion, **options: Any) -> tuple[AlignmentEstimate, tuple[tuple[float, ...], ...]]:
    """The alignment of a twin whose stretches at rest are known; options of `align` start with "by_"."""
    own = {k.removeprefix("by_"): v for k, v in options.items() if k.startswith("by_")}
    rest = {k: v for k, v in options.items() if not k.startswith("by_")}
    record, spans, truth = twin(motion, **rest)
    settings = {
        "model": MODEL,
        "latitude": rest.get("latitude", 45 * DEG),
        "checkpoints": 4,
        "spans": spans,
        **own,
    }
    return align(record, **settings), truth


def away(found: float, true: float) -> float:
    """Difference of two directions [rad]."""
    return math.remainder(found - true, 2 * math.pi)


# -- geometry -----------------------------------------------------------------------------------------------


def test_e1_heading_of_a_silent_unit_is_exact() -> None:
    for heading in range(0, 360, 45):
        still = UnitMotion.still(degrees(0, 0, heading), duration=40.0)
        found, _ = aligned(still, by_bias_repeatability=(0.0, 0.0))
        assert abs(away(found.heading, heading * DEG)) < 1e-9 * DEG, heading
        assert found.horizontal_rate / DEG_H == pytest.approx(10.635640598320, rel=1e-11)
        assert found.latitude_found == pytest.approx(45 * DEG, abs=1e-11)
    south, _ = aligned(still, latitude=-30 * DEG, by_bias_repeatability=(0.0, 0.0))
    assert south.naive is not None
    assert south.naive.latitude == pytest.approx(-30 * DEG, abs=1e-9)


@pytest.mark.parametrize("axes", ["FLU", "FRD", "RFU"])
@pytest.mark.parametrize("latitude", [-60.0, 0.0, 34.0])
def test_tilted_two_positions_are_exact_on_both_hemispheres(axes: str, latitude: float) -> None:
    motion = UnitMotion.positions([degrees(3, -8, 100), degrees(-5, 6, 265)], dwell=40.0, turn=4.0)
    found, truth = aligned(motion, axes=axes, by_axes=axes, latitude=latitude * DEG, by_model=MODEL)
    for got, true in ((found.first, truth[0]), (found.last, truth[1])):
        assert got.roll == pytest.approx(true[0], abs=1e-9)
        assert got.pitch == pytest.approx(true[1], abs=1e-9)
        # the gyros are means over half a second: the turn is not followed better than its coning
        assert abs(away(got.heading, true[2])) < 2e-4 * DEG
    assert found.mode == "positions"
    assert abs(found.horizontal_rate - EARTH_RATE * math.cos(latitude * DEG)) < 1e-5 * EARTH_RATE


def test_a_nose_straight_up_gives_the_heading_of_another_axis() -> None:
    for pitch, axis in ((90.0, "down"), (-90.0, "up"), (82.0, "down"), (70.0, "forward")):
        still = UnitMotion.still(attitude_of(0.0, pitch * DEG, 50 * DEG), duration=40.0)
        found, _ = aligned(still, by_bias_repeatability=(0.0, 0.0))
        assert found.last.heading_axis == axis
        assert abs(away(found.heading, 50 * DEG)) < 1e-8
        assert math.isinf(found.last.roll_sd) == (axis != "forward")


def test_a_nose_straight_up_leans_as_far_as_the_noise() -> None:
    """The pitch has no derivative there, which made its interval a thousand times too narrow."""
    still = UnitMotion.still(attitude_of(0.0, 90 * DEG, 50 * DEG), duration=40.0)
    found, _ = aligned(still, noise=MODEL, by_bias_repeatability=(0.0, 0.0))
    level, _ = aligned(UnitMotion.still(duration=40.0), noise=MODEL, by_bias_repeatability=(0.0, 0.0))
    assert abs(found.last.pitch - 90 * DEG) < 4 * found.last.pitch_sd
    assert found.last.pitch_sd == pytest.approx(level.last.pitch_sd, rel=0.05)


def test_a_turn_is_integrated_with_its_derivatives() -> None:
    rng = np.random.default_rng(3)
    rate = 0.5 * rng.standard_normal(3) + 0.2 * np.sin(np.linspace(0, 3, 400))[:, None]
    turn = turn_of(rate, 0.01)
    change, shift = 1e-4 * rng.standard_normal((3, 3)), 1e-4 * rng.standard_normal(3)
    exact = turn_of(rate @ (np.eye(3) + change).T + shift, 0.01).matrix
    assert np.abs(turn.under(change, shift) - exact).max() < 1e-6  # of the square of 1e-3 rad
    assert np.allclose(turn.matrix @ turn.matrix.T, np.eye(3), atol=1e-12)
    assert np.einsum("iab,a,b->", turn.shares, [0, 0, 1], [0, 0, 1]) == pytest.approx(1.0, abs=1e-12)
    plain = turn_of(np.tile([0.0, 0.0, 0.3], (100, 1)), 0.05)
    assert rotation_vector(plain.matrix) == pytest.approx([0, 0, 1.5])
    assert plain.size == pytest.approx(1.5)


# -- formulas -----------------------------------------------------------------------------------------------


def test_e2_white_noise_over_an_hour() -> None:
    noise = NoiseModel.of(White(N=0.001 * DEG / 60))
    plan = AlignmentPlan.static(3600.0, heading=1.0)
    found = predict_alignment(model=noise, plan=plan, latitude=45 * DEG, bias_repeatability=(0.0, 0.0))
    assert math.degrees(found.heading_sd) * 3600 == pytest.approx(19.3937, rel=1e-5)
    assert found.resolves


@pytest.mark.parametrize(
    ("latitude", "wanted"), [(0, 0.0038093), (60, 0.0076186), (80, 0.021937), (89, 0.21827), (89.99, 21.826)]
)
def test_e3_a_bias_near_the_pole(latitude: float, wanted: float) -> None:
    quiet = NoiseModel.of(White(N=1e-14))
    found = predict_alignment(
        model=quiet,
        plan=AlignmentPlan.static(3600.0),
        latitude=latitude * DEG,
        bias_repeatability=(0.001 * DEG_H, 0.0),
    )
    assert math.degrees(found.heading_sd) == pytest.approx(wanted, rel=1e-4)


def test_e3_the_pole_is_refused() -> None:
    record, spans, _ = twin(UnitMotion.still(duration=20.0))
    with pytest.raises(InputError, match="undefined"):
        align(record, model=MODEL, latitude=math.pi / 2, spans=spans)
    with pytest.raises(InputError, match="undefined"):
        predict_alignment(model=GYRO, plan=AlignmentPlan.static(10.0), latitude=-math.pi / 2)


@pytest.mark.long
def test_e4_the_interval_holds_the_heading_at_every_signal_to_noise(rng: np.random.Generator) -> None:
    """From 0.94 on, less three standard deviations of 3000 runs at 0.95: 0.0040."""
    spread = np.array([[1.0, 0.3], [0.3, 0.5]])
    factor = np.linalg.cholesky(spread)
    for signal in (0.3, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0):
        headings, held = rng.uniform(0, 2 * math.pi, 3000), 0
        for heading, noise in zip(headings, rng.standard_normal((3000, 2)), strict=True):
            true = np.array([math.cos(heading), -math.sin(heading)])
            true *= signal / math.sqrt(true @ np.linalg.solve(spread, true))
            held += direction_of(true + factor @ noise, spread, 0.95).arc.contains(heading)
        assert held / 3000 > 0.94 - 3 * 0.0040, signal


def test_e5_the_interval_wraps() -> None:
    still = UnitMotion.still(degrees(0, 0, 359.95), duration=120.0)
    found, _ = aligned(still, noise=MODEL, by_bias_repeatability=(0.02 * DEG_H, 0.0))
    assert found.interval.start > found.interval.stop
    assert found.interval.contains(0.0)
    assert found.interval.contains(2 * math.pi - 1e-9)
    assert found.interval.width < 20 * DEG


@pytest.mark.parametrize("headings", [(20, 200), (20, 110, 200, 290)])
def test_e6_a_large_bias_does_not_move_the_heading(headings: tuple[float, ...]) -> None:
    motion = UnitMotion.positions([degrees(0, 0, h) for h in headings], dwell=40.0, turn=4.0)
    record, spans, _ = twin(motion)
    found = align(record, model=MODEL, latitude=45 * DEG, spans=spans, checkpoints=2)
    shifted = record
    for name, bias in zip(CHANNELS["gyro"], (1000.0, -700.0, 400.0), strict=True):
        columns = list(shifted.columns)
        i = shifted.index(name)
        columns[i] = ArrayColumn(record.values(name) + bias * DEG_H)
        shifted = Recording(channels=shifted.channels, columns=tuple(columns), rate=shifted.rate)
    again = align(shifted, model=MODEL, latitude=45 * DEG, spans=spans, checkpoints=2)
    assert abs(away(again.heading, found.heading)) < 1e-9 * DEG
    moved = [again.biases[n].value - found.biases[n].value for n in CHANNELS["gyro"]]
    assert np.array(moved) / DEG_H == pytest.approx([1000.0, -700.0, 400.0], rel=1e-9)
    assert all(b.separable for b in again.biases.values())


@pytest.mark.parametrize(
    ("kind", "size", "source"),
    [
        ("gyro.scale", 1e-3, "gyro scale and misalignment"),
        ("gyro.misalignment", 1e-3, "gyro scale and misalignment"),
        ("accelerometer.bias", 9.806 * 1e-3, "accelerometer calibration"),
        ("gyro.bias", 0.1 * DEG_H, "gyro bias"),
    ],
)
def test_e7_each_term_of_the_budget_is_what_the_error_does(kind: str, size: float, source: str) -> None:
    """Each parameter is off by one standard deviation in turn: the root of the sum of squares is the budget."""
    motion = UnitMotion.positions([degrees(2, -3, 20), degrees(1, 4, 140)], dwell=40.0, turn=8.0)
    known = calibration({kind: size})
    names = [n for n in known.names if n.rsplit("_", 1)[0] == kind]
    record, spans, _ = twin(motion, rate=5.0)
    settings = {"model": MODEL, "latitude": 45 * DEG, "spans": spans, "checkpoints": 1}
    base = align(record, calibration=known, **settings)
    shifts = []
    for name in names:
        wrong, _, _ = twin(motion, rate=5.0, calibration=calibration({}, {name: size}))
        shifts.append(away(align(wrong, calibration=known, **settings).heading, base.heading))
    assert base.budget[source] == pytest.approx(math.sqrt(sum(s**2 for s in shifts)), rel=0.05)


def test_e7_tilt_latitude_and_mounting() -> None:
    still = UnitMotion.still(degrees(0, 0, 30), duration=40.0)
    stated = SetupUncertainty(tilt=0.1 * DEG, latitude=0.1 * DEG, heading=0.2 * DEG)
    found, _ = aligned(still, by_bias_repeatability=(1e-4 * DEG_H, 0.0), by_stated=stated, latitude=60 * DEG)
    assert found.budget["tilt"] / DEG == pytest.approx(0.1 * math.tan(60 * DEG), rel=1e-3)
    assert found.budget["heading"] / DEG == pytest.approx(0.2)
    # an error of the latitude lengthens the vector and does not turn it
    assert found.budget["latitude"] < 1e-6 * DEG
    reference = EARTH_RATE * math.sin(60 * DEG) * 0.1 * DEG
    assert found.horizontal_interval[1] - found.horizontal_interval[0] > 2 * 1.95 * reference


def test_e8_no_rotation_is_no_north() -> None:
    record, spans, _ = twin(UnitMotion.two(dwell=100.0, turn=4.0), noise=MODEL)
    columns = list(record.columns)
    rng = np.random.default_rng(5)
    for name in CHANNELS["gyro"]:
        sd = 0.01 * DEG / 60 * math.sqrt(RATE)
        columns[record.index(name)] = ArrayColumn(sd * rng.standard_normal(record.n_samples))
    dead = Recording(channels=record.channels, columns=tuple(columns), rate=RATE)
    found = align(dead, model=MODEL, latitude=45 * DEG, spans=spans)
    assert found.verdict == "no north"
    assert found.interval.full
    assert math.isnan(found.heading)


@pytest.mark.long
@pytest.mark.parametrize(
    "slow",
    [GaussMarkov.from_sigma(0.03 * DEG_H, 60.0), RandomWalk(K=0.1 * DEG_H / 60), Flicker(B=0.03 * DEG_H)],
)
def test_e9_the_interval_holds_under_slow_noise(slow: Any) -> None:
    """Of 16 runs at 0.95 fewer than 12 hold with probability 0.0009."""
    noise = {**MODEL, "gyro": GYRO + slow}
    motion = UnitMotion.positions([degrees(0, 0, h) for h in (10, 100, 190, 280)], dwell=60.0, turn=3.0)
    held = 0
    for seed in range(16):
        found, truth = aligned(
            motion, noise=noise, by_model=noise, by_checkpoints=1, seed=100 + seed, rate=1.0
        )
        held += found.interval.contains(truth[-1][2])
    assert held >= 12


# -- prediction ---------------------------------------------------------------------------------------------

KNOWN = {"gyro.bias": 0.05 * DEG_H, "gyro.scale": 5e-4, "gyro.misalignment": 3e-4, "accelerometer.bias": 1e-3}


@pytest.mark.parametrize("known", [None, calibration(KNOWN)], ids=["nominal", "calibrated"])
def test_the_prediction_is_what_the_alignment_states(known: Calibration | None) -> None:
    attitudes = (degrees(2, -3, 20), degrees(0, 5, 140), degrees(-3, 0, 260))
    noise = {**MODEL, "gyro": GYRO + Flicker(B=0.02 * DEG_H)}
    plan = AlignmentPlan(attitudes=attitudes, dwell=60.0, turn=4.0)
    wanted = predict_alignment(model=noise, plan=plan, latitude=-35 * DEG, rate=RATE, calibration=known)
    motion = UnitMotion.positions(attitudes, dwell=60.0, turn=4.0)
    found, _ = aligned(motion, latitude=-35 * DEG, by_model=noise, by_calibration=known)
    assert found.heading_sd == pytest.approx(wanted.heading_sd, rel=0.02)
    assert found.last.roll_sd == pytest.approx(wanted.roll_sd, rel=0.02)
    assert [b.sd for b in found.biases.values()] == pytest.approx(wanted.bias_sds.tolist(), rel=0.02)
    assert wanted.duration == pytest.approx(188.0)
    json.dumps(wanted.to_json(), allow_nan=False)


def test_one_position_without_any_knowledge_is_predicted_to_fail() -> None:
    found = predict_alignment(model=GYRO, plan=AlignmentPlan.static(600.0), latitude=45 * DEG)
    assert math.isinf(found.heading_sd)
    assert not found.resolves
    assert np.isinf(found.bias_sds[:2]).all()
    turned = predict_alignment(model=GYRO, plan=AlignmentPlan.two(600.0), latitude=45 * DEG)
    assert turned.resolves
    # half of the time for each position, and both are needed: as if the biases were known
    known = predict_alignment(
        model=GYRO, plan=AlignmentPlan.static(595.0), latitude=45 * DEG, bias_repeatability=(0.0, 0.0)
    )
    assert turned.heading_sd == pytest.approx(known.heading_sd, rel=2e-3)


def test_errors_are_as_large_as_stated() -> None:
    """Root mean square of 24 standardised errors: within 3.3 of its standard deviations, 1/sqrt(48)."""
    noise, known = {**MODEL, "gyro": GYRO + Flicker(B=0.01 * DEG_H)}, calibration(KNOWN)
    rng = np.random.default_rng(8)
    sds = np.sqrt(np.diag(known.covariance))
    motion = UnitMotion.positions([degrees(0, 3, 50), degrees(2, 0, 230)], dwell=60.0, turn=3.0)
    errors = []
    for seed in range(24):
        true = known.with_values(known.values + sds * rng.standard_normal(len(sds)))
        found, truth = aligned(
            motion,
            noise=noise,
            calibration=true,
            by_model=noise,
            by_calibration=known,
            by_checkpoints=1,
            seed=seed,
        )
        errors.append(away(found.heading, truth[-1][2]) / found.heading_sd)
    assert math.sqrt(np.mean(np.square(errors))) == pytest.approx(1.0, abs=3.3 / math.sqrt(48))


# -- what may be said ---------------------------------------------------------------------------------------


def test_one_position_with_unknown_biases_is_no_north() -> None:
    biased = calibration({}, {"gyro.bias_x": 6 * DEG_H, "gyro.bias_y": -2 * DEG_H})
    still = UnitMotion.still(duration=60.0)
    found, _ = aligned(still, noise=MODEL, calibration=biased)
    assert found.verdict == "no north"
    assert math.isnan(found.heading)
    assert "180 deg" in found.advice[0]
    assert all(math.isnan(c.heading) for c in found.coarse)
    # the vertical part of the Earth's rotation is known: the bias of z is seen, the others are not
    assert [b.separable for b in found.biases.values()] == [False, False, True]
    known, _ = aligned(still, noise=MODEL, calibration=biased, by_bias_repeatability=(1.0 * DEG_H, 0.0))
    assert known.verdict == "inconsistent with Earth"  # the length is off by six standard deviations


@pytest.mark.long
def test_small_biases_give_a_heading_with_what_they_show() -> None:
    """Student's interval with two degrees of freedom: of 20 runs at 0.95 fewer than 15 hold with p = 0.0003."""
    rng, held, verdicts = np.random.default_rng(4), 0, set()
    for seed in range(20):
        drawn = {f"gyro.bias_{a}": 0.05 * DEG_H * rng.standard_normal() for a in "xyz"}
        still = UnitMotion.still(degrees(0, 0, 37 * seed), duration=60.0)
        found, truth = aligned(
            still, noise=MODEL, calibration=calibration({}, drawn), seed=seed, by_checkpoints=1
        )
        held += found.interval.contains(truth[-1][2])
        verdicts.add(found.verdict)
    assert held >= 15
    assert "bias not known" in verdicts
    assert "resolved" not in verdicts


@pytest.mark.long
def test_a_consumer_unit_never_gets_a_heading() -> None:
    """Noise of 0.3 deg/sqrt(h) and 10 deg/h of flicker, biases of half a degree per second."""
    noise = {**MODEL, "gyro": NoiseModel.of(White(N=0.3 * DEG / 60), Flicker(B=10 * DEG_H))}
    rng = np.random.default_rng(6)
    for seed in range(8):
        drawn = {f"gyro.bias_{a}": 0.5 * DEG * rng.standard_normal() for a in "xyz"}
        motion = UnitMotion.two(dwell=100.0, turn=4.0) if seed % 2 else UnitMotion.still(duration=100.0)
        found, _ = aligned(motion, noise=noise, calibration=calibration({}, drawn), seed=seed, by_model=noise)
        assert found.verdict == "no north", seed
        assert math.isnan(found.heading)
        assert found.interval.full
        assert np.isnan(found.running.heading).all()
        assert found.reason


@pytest.mark.parametrize("known", [1e-3, 0.1, 10.0])
@pytest.mark.parametrize("positions", [1, 2])
def test_a_consumer_unit_gets_no_heading_by_what_was_said_of_it(known: float, positions: int) -> None:
    """Biases of degrees per second, stated to be small, and a unit so quiet that its noise hides nothing."""
    biases = calibration({}, {"gyro.bias_x": 0.4 * DEG, "gyro.bias_y": -0.3 * DEG, "gyro.bias_z": 0.5 * DEG})
    # the bias follows the attitude by gravity as that of consumer gyros does: as much as the Earth's rate and more
    motion = UnitMotion.still(degrees(0, 0, 30), duration=100.0)
    if positions == 2:
        motion = UnitMotion.positions([degrees(0, 0, 30), degrees(0, 0, 210)], dwell=100.0, turn=4.0)
    record, spans, _ = twin(motion, noise=MODEL, calibration=biases)
    if positions == 2:
        columns = list(record.columns)
        leap = np.where(np.arange(record.n_samples) < spans[0, 1], 60 * DEG_H, 0.0)
        columns[record.index("gyro_x")] = ArrayColumn(record.values("gyro_x") + leap)
        record = Recording(channels=record.channels, columns=tuple(columns), rate=record.rate)
    found = align(
        record, model=MODEL, latitude=45 * DEG, spans=spans, bias_repeatability=(known * DEG_H, None)
    )
    assert found.verdict == "no north", found.reason
    assert found.reason
    text = json.dumps(found.to_json(), allow_nan=False)
    assert math.isnan(found.heading)
    assert '"heading": null' in text
    assert found.interval.full
    assert found.budget == {}


def test_a_bias_of_degrees_per_second_is_no_rotation() -> None:
    """Found rests: what the gyros show in all attitudes alike is a bias, in one attitude it may be a rotation."""
    biased = calibration({}, {"gyro.bias_z": 7 * DEG, "gyro.bias_x": -2 * DEG})
    noise = {**MODEL, "gyro": NoiseModel.of(White(N=1.0 * DEG / 60))}
    record, _, _ = twin(UnitMotion.faces(dwell=12.0, turn=3.0), noise=noise, calibration=biased, rate=50.0)
    found = align(record, model=noise, latitude=45 * DEG, checkpoints=2)
    assert found.verdict == "no north"
    assert found.mode == "positions"
    assert [b.value for b in found.biases.values()] == pytest.approx([-2 * DEG, 0, 7 * DEG], abs=0.1 * DEG)


def test_stands_that_contradict_each_other_are_not_called_noise() -> None:
    """A calibration of another sensor: misalignments leave 60 times the noise, which is no reason to record longer."""
    other = {f"gyro.bias_{a}": v * DEG_H for a, v in zip("xyz", (6.0, -9.0, 4.0), strict=True)}
    wrong = calibration({"gyro.bias": 0.02 * DEG_H, "gyro.misalignment": 1e-4, "gyro.scale": 1e-4}, other)
    motion = UnitMotion.positions([degrees(0, 0, 30), degrees(0, 0, 210)], dwell=60.0, turn=4.0)
    found, _ = aligned(motion, noise=MODEL, by_calibration=wrong)
    assert found.verdict in ("inconsistent", "no north")
    assert "the stands scatter" in found.reason
    assert "longer" not in " ".join(found.advice)
    still, _ = aligned(UnitMotion.still(duration=60.0), noise=MODEL, by_calibration=wrong)
    assert still.verdict in ("inconsistent", "inconsistent with Earth", "no north")
    assert math.isnan(still.heading)  # one attitude, and what was known of the biases is refuted


@pytest.mark.long
def test_a_bias_beyond_what_was_said_widens_the_interval_to_what_it_shows() -> None:
    """Refuted, but small: the heading stands with Student's interval, and the verdict says what is wrong."""
    rng, held = np.random.default_rng(5), 0
    for seed in range(14):
        drawn = {f"gyro.bias_{a}": 0.2 * DEG_H * rng.standard_normal() for a in "xyz"}
        found, truth = aligned(
            UnitMotion.still(degrees(0, 0, 37 * seed), duration=60.0), noise=MODEL, seed=seed, by_checkpoints=1,
            calibration=calibration({}, drawn), by_bias_repeatability=(0.01 * DEG_H, 0.0),
        )  # fmt: skip
        held += found.interval.contains(truth[-1][2]) if found.verdict != "resolved" else 1
    assert held >= 10  # of 14 runs at 0.95 fewer than 10 hold with p = 0.0004


def test_accelerometers_that_do_not_show_gravity_are_told() -> None:
    wrong = calibration({"accelerometer.bias": 1e-3}, {"accelerometer.bias_z": 0.05})
    motion = UnitMotion.positions([degrees(0, 0, 30), degrees(0, 0, 210)], dwell=60.0, turn=4.0)
    found, _ = aligned(motion, noise=MODEL, by_calibration=wrong)
    check = next(c for c in found.checks if c.name == "gravity")
    assert not check.passed
    assert found.verdict == "inconsistent"
    right, _ = aligned(motion, noise=MODEL, by_calibration=calibration({"accelerometer.bias": 1e-3}))
    assert next(c for c in right.checks if c.name == "gravity").passed
    nominal, _ = aligned(motion, noise=MODEL)
    assert "gravity" not in [c.name for c in nominal.checks]


def test_a_rotation_that_is_not_the_earths_is_told() -> None:
    wrong, _ = aligned(UnitMotion.two(dwell=60.0, turn=3.0), noise=MODEL, latitude=10 * DEG)
    assert wrong.verdict == "resolved"
    record, spans, _ = twin(UnitMotion.two(dwell=60.0, turn=3.0), noise=MODEL, latitude=10 * DEG)
    found = align(record, model=MODEL, latitude=60 * DEG, spans=spans)
    assert found.verdict == "inconsistent with Earth"
    assert "latitude" in found.reason


def test_gyros_that_see_the_turn_askew_are_found_out() -> None:
    skewed = calibration({}, {"gyro.misalignment_xz": 0.01})
    motion = UnitMotion.positions([degrees(0, 0, 0), degrees(0, 0, 90)], dwell=60.0, turn=4.0)
    found, truth = aligned(motion, noise=MODEL, calibration=skewed)
    check = next(c for c in found.checks if c.name == "turns against gravity")
    assert not check.passed
    assert found.budget["turns"] > 0.1 * DEG
    assert found.interval.contains(truth[-1][2])
    assert any("gravity is" in words for words in found.advice)


def test_motion_at_the_beginning_is_flagged_in_the_naive_mean() -> None:
    motion = UnitMotion.positions([degrees(0, 0, 0), degrees(0, 0, 60)], dwell=[30.0, 300.0], turn=3.0)
    record, _, truth = twin(motion, noise=MODEL)
    late = np.array([(round(40 * RATE), record.n_samples)])
    found = align(record, model=MODEL, latitude=45 * DEG, spans=late, bias_repeatability=(0.01 * DEG_H, 0.0))
    assert found.naive is not None
    assert found.naive.flagged
    assert found.naive.moving == pytest.approx(40.0)
    assert abs(away(found.naive.heading, truth[-1][2])) > 1 * DEG
    assert any("do not use the plain mean" in words for words in found.advice)
    assert [c.name for c in found.coarse] == ["TRIAD", "QUEST"]
    assert abs(away(found.coarse[0].heading, found.heading)) < 0.1 * DEG


def test_the_running_heading_ends_at_the_result() -> None:
    found, _ = aligned(UnitMotion.two(dwell=100.0, turn=3.0), noise=MODEL, by_checkpoints=40)
    assert len(found.running.time) == 40
    assert np.isnan(found.running.heading[:10]).all()  # one position cannot tell
    assert found.running.heading[-1] == pytest.approx(found.heading, abs=1e-3 * DEG)
    assert found.running.sd[-1] == pytest.approx(found.heading_sd, rel=1e-3)
    told = np.isfinite(found.running.sd)
    assert (np.diff(found.running.sd[told]) < 1e-12).all()
    json.dumps(found.to_json(), allow_nan=False)


def test_samples_that_are_missing_in_a_turn_break_the_chain() -> None:
    motion = UnitMotion.positions([degrees(0, 0, h) for h in (0, 90, 180, 270)], dwell=60.0, turn=4.0)
    record, spans, truth = twin(motion, noise=MODEL)
    hole = record.excluding({"gyro_z": [(spans[0, 1] + 1, spans[0, 1] + 4)]}, "test")
    found = align(hole, model=MODEL, latitude=45 * DEG, spans=spans)
    assert len(found.stands) == 3
    assert any("left out" in words for words in found.advice)
    assert found.interval.contains(truth[-1][2])


@pytest.mark.parametrize("model", [MODEL, None], ids=["model", "record"])
@pytest.mark.parametrize("turned", [10.0, 180.0])
def test_a_turn_that_a_hole_hides_is_no_rest(model: Any, turned: float) -> None:
    """Nothing was recorded while it turned: the means on both sides tell that it did."""
    motion = UnitMotion.positions([degrees(0, 0, 30), degrees(0, 0, 30 + turned)], dwell=100.0, turn=4.0)
    record, spans, truth = twin(motion, noise=MODEL)
    hole = record.excluding({n: [(spans[0, 1] - 4, spans[1, 0] + 4)] for n in record.names}, "test")
    given = {"model": model, "latitude": 45 * DEG, "spans": spans, "checkpoints": 2}
    found = align(hole, bias_repeatability=(0.02 * DEG_H, 0.0), **given)
    assert found.interval.contains(truth[-1][2])
    assert found.spans == ((spans[1, 0] / RATE, spans[1, 1] / RATE),)
    assert any("one stretch at rest at the beginning was left out" in words for words in found.advice)


@pytest.mark.parametrize("model", [MODEL, None], ids=["model", "record"])
def test_holes_at_rest_leave_one_attitude(model: Any) -> None:
    record, _, truth = twin(UnitMotion.still(degrees(1, 0, 30), duration=400.0), noise=MODEL)
    edges = np.arange(0, 801, 40)
    gone = [(int(e) - 6, int(e)) for e in edges[1:-1]]
    hole = record.excluding(dict.fromkeys(record.names, gone), "test")
    spans = np.stack([edges[:-1], np.append(edges[1:-1] - 6, 800)], axis=1)
    given = {"model": model, "latitude": 45 * DEG, "spans": spans, "checkpoints": 2}
    found = align(hole, bias_repeatability=(0.02 * DEG_H, 0.0), **given)
    assert len(found.spans) == len(spans)
    assert len(found.stands) == 1
    assert found.interval.contains(truth[-1][2])


def test_counts_with_a_calibration_are_as_good_as_si() -> None:
    gains = {"gyro": 2e5, "accelerometer": 1e3}
    scaled = {f"{sensor}.scale_{a}": gain - 1 for sensor, gain in gains.items() for a in "xyz"}
    made = calibration({}, scaled)
    counts = Calibration(
        names=made.names, values=made.values, covariance=made.covariance, status=made.status, channels=CHANNELS,
        units={"gyro": "LSB", "accelerometer": "LSB"},
    )  # fmt: skip
    noise = {
        "gyro": NoiseModel.of(White(N=2e5 * 0.01 * DEG / 60), kind="counts"),
        "accelerometer": NoiseModel.of(White(N=1e-1), kind="counts"),
    }
    motion = UnitMotion.positions([degrees(1, 2, 40), degrees(0, 0, 200)], dwell=60.0, turn=3.0)
    known = {"by_calibration": counts, "by_model": noise, "by_bias_repeatability": (1.0 * DEG_H, 0.0)}
    found, truth = aligned(motion, noise=noise, calibration=counts, **known)
    assert found.interval.contains(truth[-1][2])
    assert found.resolved
    assert found.heading_sd < 2 * DEG
    assert found.gravity == pytest.approx(found.expected_gravity, abs=1e-3)


def test_slopes_with_temperature_are_taken_off() -> None:
    names = (*parameter_names("accelerometer"), *parameter_names("gyro", temperature=True))
    slopes = {"gyro.bias_temperature_x": 2 * DEG_H, "gyro.bias_temperature_y": -3 * DEG_H}
    nominal = [1.0 if ".scale_" in n else 0.0 for n in names]
    warm = Calibration(
        names=names,
        values=np.array([v + slopes.get(n, 0.0) for n, v in zip(names, nominal, strict=True)]),
        covariance=np.zeros((len(names), len(names))),
        status=("estimated",) * len(names),
        channels=CHANNELS,
        temperature=25.0,
    )
    motion = UnitMotion.positions([degrees(0, 0, 40), degrees(0, 0, 220)], dwell=60.0, turn=3.0)
    warming = {"noise": MODEL, "calibration": warm, "temperature": Temperature(start=25.0, drift=0.05)}
    found, truth = aligned(motion, by_calibration=warm, by_bias_repeatability=(1.0 * DEG_H, 0.0), **warming)
    assert found.interval.contains(truth[-1][2])
    assert found.resolved
    plain, _ = aligned(motion, **warming)  # the drift passes for a part of the Earth's rotation
    assert abs(away(plain.heading, truth[-1][2])) > 5 * plain.heading_sd
    with pytest.raises(InputError, match="depend on temperature"):
        aligned(motion, noise=MODEL, by_calibration=warm)


# -- turning all the time -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tilt", "rate", "latitude", "axes"),
    [((0.0, 0.0), 6.0, 45.0, "FLU"), ((3.0, -4.0), -10.0, -30.0, "FRD"), ((25.0, 0.0), 8.0, 60.0, "RFU")],
)
def test_a_rotation_gives_the_heading_at_both_ends(
    tilt: tuple[float, float], rate: float, latitude: float, axes: str
) -> None:
    spin = UnitMotion.rotation(rate * DEG, 200.0, tilt=degrees(*tilt), heading=70 * DEG)
    record, _, _ = twin(spin, noise=MODEL, latitude=latitude * DEG, axes=axes, rate=20.0)
    found = align(record, model=MODEL, latitude=latitude * DEG, axes=axes, checkpoints=5)
    assert found.mode == "rotation"
    assert found.verdict == "resolved"
    assert abs(away(found.first.heading, 70 * DEG)) < 4 * found.first.heading_sd
    assert found.first.roll == pytest.approx(tilt[0] * DEG, abs=4 * found.first.roll_sd)
    assert found.first.pitch == pytest.approx(tilt[1] * DEG, abs=4 * found.first.pitch_sd)
    assert found.revolutions == pytest.approx(abs(rate) * 200 / 360, rel=1e-3)
    lean = math.acos(math.cos(tilt[0] * DEG) * math.cos(tilt[1] * DEG))
    assert found.tilt == pytest.approx(lean, abs=1e-3)
    assert found.gravity == pytest.approx(found.expected_gravity, abs=1e-3)
    assert found.running.heading[-1] == pytest.approx(found.heading, abs=2 * found.heading_sd)
    json.dumps(found.to_json(), allow_nan=False)


@pytest.mark.long
def test_e6_rotation_drops_biases_and_predicts_itself() -> None:
    spin, big = UnitMotion.rotation(6 * DEG, 180.0), {f"gyro.bias_{a}": 30 * DEG_H for a in "xy"}
    found, _ = aligned(spin, rate=20.0, noise=MODEL, calibration=calibration({}, big), by_rotation=True)
    plain, _ = aligned(spin, rate=20.0, noise=MODEL, by_rotation=True)
    assert abs(away(found.heading, plain.heading)) < 1e-3 * DEG
    wanted = predict_alignment(model=MODEL, plan=AlignmentPlan.rotation(6 * DEG, 180.0), latitude=45 * DEG)
    assert found.heading_sd == pytest.approx(wanted.heading_sd, rel=0.03)


def test_tumbling_is_no_rotation() -> None:
    record, _, _ = twin(UnitMotion.faces(dwell=3.0, turn=3.0), noise=MODEL, rate=10.0)
    with pytest.raises(DataQualityError, match="neither at rest nor turning"):
        align(record, model=MODEL, latitude=45 * DEG, rotation=True)
    with pytest.raises(DataQualityError, match="revolutions"):
        align(
            twin(UnitMotion.rotation(6 * DEG, 60.0), rate=10.0)[0], model=MODEL, latitude=0.5, rotation=True
        )


# -- refusals -----------------------------------------------------------------------------------------------


def test_what_makes_no_sense_is_refused() -> None:
    record, spans, _ = twin(UnitMotion.still(duration=20.0), noise=MODEL)
    for wrong, words in (
        ({"axes": "FLL"}, "right-handed"),
        ({"spans": [(30, 20)]}, "in order"),
        ({"spans": [(0, 10_000)]}, "inside of the record"),
        ({"bias_repeatability": (-1.0, 0.0)}, "not negative"),
        ({"confidence": 1.5}, "confidence"),
        ({"model": {"gyro": ACC}}, "is of acceleration"),
        ({"model": {"wx": GYRO}}, "no noise model for gyro_x"),
    ):
        with pytest.raises(InputError, match=words):
            align(record, **{"model": MODEL, "latitude": 0.8, "spans": spans, **wrong})  # type: ignore[arg-type]
    counts = Recording.from_rate(
        np.stack([record.values(n) * 1e6 for n in record.names], axis=1), rate=RATE, unit="LSB"
    )
    roles = {"gyro": counts.names[:3], "accelerometer": counts.names[3:]}
    with pytest.raises(InputError, match="a scale is needed"):
        align(counts, latitude=0.8, spans=spans, **roles)
    with pytest.raises(InputError, match="is for samples in"):
        align(counts, latitude=0.8, spans=spans, calibration=calibration({}), **roles)
    with pytest.raises(InputError, match="three gyros and three accelerometers"):
        align(record.select(*CHANNELS["gyro"]), model=MODEL, latitude=0.8, spans=spans)
    with pytest.raises(DataQualityError, match="nowhere at rest"):
        align(record, model=MODEL, latitude=0.8, spans=np.zeros((0, 2)), rotation=False)


def test_a_calibration_of_other_channels_is_remarked() -> None:
    other = replace(calibration({"gyro.bias": 0.1 * DEG_H}), channels={"gyro": ("wx", "wy", "wz")})
    found, _ = aligned(UnitMotion.still(duration=60.0), noise=MODEL, by_calibration=other)
    assert any("wx, wy, wz" in words and "gyro_x, gyro_y, gyro_z" in words for words in found.advice)


def test_a_model_of_another_sensor_is_named_where_nothing_is_at_rest() -> None:
    small = {
        "gyro": NoiseModel.of(White(N=1e-3 * DEG / 60)),
        "accelerometer": NoiseModel.of(White(N=1e-5), kind="acceleration"),
    }
    record, _, _ = twin(UnitMotion.two(dwell=60.0, turn=4.0), noise=MODEL, rate=50.0)
    with pytest.raises(DataQualityError, match="is it the model of this sensor"):
        align(record, model=small, latitude=45 * DEG)


@pytest.mark.long
def test_the_record_alone_gives_its_noise() -> None:
    motion = UnitMotion.positions([degrees(0, 0, 0), degrees(0, 0, 180)], dwell=200.0, turn=3.0)
    found, truth = aligned(motion, noise=MODEL, by_model=None)
    assert found.interval.contains(truth[-1][2])
    assert found.models == {}
    known, _ = aligned(motion, noise=MODEL)
    assert known.heading_sd < found.heading_sd < 6 * known.heading_sd


def test_rests_are_found_when_nobody_says_them() -> None:
    motion = UnitMotion.positions([degrees(0, 0, 0), degrees(0, 0, 180)], dwell=60.0, turn=3.0)
    record, _, truth = twin(motion, noise=MODEL, rate=50.0)
    found = align(record, model=MODEL, latitude=45 * DEG, checkpoints=2)
    assert len(found.stands) == 2
    assert abs(away(found.heading, truth[-1][2])) < 4 * found.heading_sd
    assert np.array_equal(rotation(np.zeros(3)), np.eye(3))
