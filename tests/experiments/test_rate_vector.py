# SPDX-License-Identifier: BSD-3-Clause
"""The rate vector of three gyros at rest: disturbed stretches, the length and its interval, the verdict."""

from __future__ import annotations

import importlib.util
import json
import math
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom

from allanite.errors import DataQualityError, InputError
from allanite.experiments.earth_rate import SetupUncertainty
from allanite.experiments.rate_vector import RateVector, measure_rate_vector
from allanite.experiments.rate_vector.checks import latitude_check
from allanite.experiments.rate_vector.stretches import MOVING, cut, rest
from allanite.experiments.rate_vector.vectors import Vectors, _bent_interval
from allanite.experiments.rate_vector.verdict import LeftOut
from allanite.noise import Flicker, NoiseModel, White
from allanite.quantities.attitude import attitude_of
from allanite.quantities.earth import EARTH_RATE, earth_rate_vector
from allanite.recording.records import Recording

Locate = Callable[[str], Path]
Array = NDArray[np.float64]

DEG_H = math.pi / 180 / 3600
DEG_RT_H = math.pi / 180 / 60
RATE = 20.0
DIRECTION = np.array([0.6, 0.0, 0.8])


def still(
    rng: np.random.Generator, *, minutes: float = 20.0, white: float = 0.005, earth: float = EARTH_RATE
) -> Array:
    """Rates of three gyros at rest, shape (n, 3) [rad/s]; white noise in deg/rt-h."""
    n = round(minutes * 60 * RATE)
    return earth * DIRECTION + white * DEG_RT_H * math.sqrt(RATE) * rng.standard_normal((n, 3))


def measured(rates: Array, **options: object) -> RateVector:
    record = Recording.from_rate(rates, rate=RATE, unit="rad/s")
    return measure_rate_vector(record, **options)  # type: ignore[arg-type]


def clock(rates: Array) -> Array:
    return np.arange(len(rates)) / RATE


def with_gravity(rates: Array, latitude: float, rng: np.random.Generator) -> Recording:
    """The record with accelerometers whose gravity lies 90 deg less the latitude from DIRECTION."""
    across = np.array([0.0, 1.0, 0.0])
    up = math.sin(latitude) * DIRECTION + math.cos(latitude) * across
    force = 9.81 * up + 1e-3 * rng.standard_normal(rates.shape)
    gyros = Recording.from_rate(rates, rate=RATE, unit="rad/s", names=["gx", "gy", "gz"])
    accelerometers = Recording.from_rate(force, rate=RATE, unit="m/s²", names=["ax", "ay", "az"])
    return replace(
        gyros,
        channels=gyros.channels + accelerometers.channels,
        columns=gyros.columns + accelerometers.columns,
    )


@pytest.fixture(scope="module")
def vehicle() -> Callable[..., tuple[Recording, dict[str, float]]]:
    """The records of the verification script."""
    script = Path(__file__).resolve().parents[2] / "verification" / "rate_vector.py"
    if not script.exists():
        pytest.skip("the verification scripts are not in the source package")
    spec = importlib.util.spec_from_file_location("rate_vector_records", script)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.vehicle  # type: ignore[no-any-return]


# -- at rest ----------------------------------------------------------------------------------------------


def test_a_clean_record_is_used_whole_and_resolved(rng: np.random.Generator) -> None:
    found = measured(still(rng))
    assert found.resolved and found.share > 0.97
    assert found.interval[0] < EARTH_RATE < found.interval[1]
    # white noise over 20 minutes is 0.0087 deg/h; the interval may be wider for the flicker it cannot exclude
    assert 0.8 * 0.0087 < found.sd / DEG_H < 6 * 0.0087
    assert np.allclose(found.vector / EARTH_RATE, DIRECTION, atol=5 * found.sd / EARTH_RATE)
    assert "|bias + Earth|" in found.statement


def test_the_unit_of_the_samples_changes_nothing(rng: np.random.Generator) -> None:
    rates = still(rng, minutes=10)
    a = measured(rates)
    b = measure_rate_vector(Recording.from_rate(rates / DEG_H, rate=RATE, unit="deg/h"))
    assert b.length == pytest.approx(a.length, rel=1e-9)
    assert b.interval == pytest.approx(a.interval, rel=1e-9)
    assert b.used == a.used


@pytest.mark.long
def test_rest_is_not_denied_to_clean_records(rng: np.random.Generator) -> None:
    """One clean record in a hundred may have a cell that stands out: at most 5 of 60 at 99.9 %."""
    alarms = 0
    for _ in range(60):
        record = Recording.from_rate(still(rng, minutes=20), rate=RATE, unit="rad/s")
        alarms += bool((rest(cut(record, record.names, lambda part: None)) == MOVING).any())
    assert alarms <= binom.ppf(0.999, 60, 0.01)


def test_a_noise_model_that_holds_gives_its_own_interval(rng: np.random.Generator) -> None:
    rates = still(rng)
    model = NoiseModel.of(White(N=0.005 * DEG_RT_H), Flicker(B=1e-4 * DEG_H))
    found = measured(rates, model={"x": model, "y": model, "z": model})
    assert all(c.passed for c in found.checks) and found.model_source == "given"
    # batches of 8 to 32 may widen it: Student's quantile for 7 degrees and chi-square at 99.9 %
    assert 1.0 < found.sd / DEG_H / 0.00866 < 2.365 / 1.96 * math.sqrt(24.3 / 7)
    assert abs(found.length - EARTH_RATE) < 4 * found.sd


def test_a_noise_model_that_the_record_contradicts_does_not_narrow_the_interval(
    rng: np.random.Generator,
) -> None:
    rates = still(rng)
    found = measured(rates, model=NoiseModel.of(White(N=0.001 * DEG_RT_H)))
    assert [c.passed for c in found.checks] == [False] * 3
    assert found.sd / DEG_H > 0.8 * 0.00866
    assert any("times as much as the model" in text for text in found.advice)


# -- disturbances -----------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("kind", ["sways", "sways and turns"])
def test_the_interval_holds_the_earth_in_disturbed_records(
    kind: str, vehicle: Callable[..., tuple[Recording, dict[str, float]]]
) -> None:
    """95 % at least: of 8 records no fewer than the 0.1 % quantile; `verification` has a thousand of each."""
    inside = 0
    for seed in range(8):
        record, _ = vehicle(kind, 500 + seed, duration=600.0)
        found = measure_rate_vector(record)
        inside += found.interval[0] <= EARTH_RATE <= found.interval[1]
        assert abs(found.length - EARTH_RATE) < 4 * found.sd
    assert inside >= binom.ppf(0.001, 8, 0.95)


def test_a_sway_is_found_where_it_is(rng: np.random.Generator) -> None:
    rates = still(rng)
    time = clock(rates)
    since = np.maximum(time - 600, 0)
    rates[:, 0] += np.where(time >= 600, 1e-3 * 4 * np.cos(4 * since) * np.exp(-since / 5), 0.0)
    found = measured(rates)
    moving = [s for s in found.left_out if s.why is LeftOut.MOVING]
    assert len(moving) == 1
    assert 590 < moving[0].start <= 600 and 610 < moving[0].stop < 680
    assert found.resolved


def test_a_slow_rotation_without_spread_is_left_out(rng: np.random.Generator) -> None:
    rates = still(rng)
    time = clock(rates)
    rates[:, 1] += np.where((time > 500) & (time < 560), 2 * DEG_H, 0.0)
    found = measured(rates)
    slow = [s for s in found.left_out if s.why is LeftOut.OFF]
    assert slow and 495 < slow[0].start < 515 and 545 < slow[-1].stop < 570
    assert found.interval[0] < EARTH_RATE < found.interval[1]


def test_the_length_survives_a_turn_and_the_vector_is_said_not_to(rng: np.random.Generator) -> None:
    rates = still(rng)
    time = clock(rates)
    rates[time > 500] += EARTH_RATE * (np.array([0.0, 1.0, 0.0]) - DIRECTION)
    turning = (time > 500) & (time < 510)
    rates[turning] += math.pi / 2 / 10 * np.array([0.8, 0.0, -0.6])
    found = measured(rates)
    assert found.turned and np.degrees(found.turns[1:]) == pytest.approx([90], abs=1)
    assert found.interval[0] < EARTH_RATE < found.interval[1]
    assert found.vector / EARTH_RATE == pytest.approx([0, 1, 0], abs=0.01)  # the second pose lasts longer
    assert any("poses" in text for text in found.advice)
    naive = float(np.linalg.norm(rates[~turning].mean(axis=0)))
    assert naive < 0.8 * EARTH_RATE


def test_a_bias_shows_when_the_sensor_is_turned(rng: np.random.Generator) -> None:
    rates = still(rng)
    time = clock(rates)
    rates[time > 600] += EARTH_RATE * (np.array([0.0, 1.0, 0.0]) - DIRECTION)
    rates[(time > 600) & (time < 610)] += math.pi / 2 / 10 * np.array([0.8, 0.0, -0.6])
    found = measured(rates + 1 * DEG_H * np.array([1.0, -1.0, 0.0]))
    check = next(c for c in found.checks if c.name == "length in each pose")
    assert not check.passed and not found.resolved


def test_a_record_that_never_rests_gives_no_number(rng: np.random.Generator) -> None:
    rates = still(rng)
    time = clock(rates)
    rates += 1e-3 * 0.3 * np.cos(0.3 * time)[:, None]
    found = measured(rates)
    assert found.verdict == "not resolved" and "no quiet stretch" in found.reason
    assert math.isnan(found.length) and found.interval == (0.0, math.inf)
    assert json.loads(json.dumps(found.to_json()))["magnitude"]["value"] is None


@pytest.mark.parametrize("n", [3, 300, 900])
def test_a_short_record_gives_no_number(rng: np.random.Generator, n: int) -> None:
    found = measured(still(rng)[:n])
    assert found.verdict == "not resolved" and "no quiet stretch" in found.reason


def test_missing_samples_are_left_out_and_change_little(rng: np.random.Generator) -> None:
    rates = still(rng)
    whole = measured(rates)
    rates[rng.random(len(rates)) < 0.1] = np.nan
    rates[0] = np.nan
    rates[4000:6000, 1] = np.nan
    found = measured(rates)
    assert found.interval[0] < EARTH_RATE < found.interval[1]
    assert [s.why for s in found.left_out if s.start < 1100] == ["samples missing"]
    assert found.length == pytest.approx(whole.length, abs=0.02 * DEG_H)


# -- what the length means --------------------------------------------------------------------------------


def test_a_bias_beyond_the_interval_is_inconsistent_with_earth(rng: np.random.Generator) -> None:
    found = measured(still(rng) + 30 * DEG_H * np.array([1.0, 0.0, 0.0]))
    assert found.verdict == "inconsistent with Earth"
    assert "|bias + Earth|" in found.reason and "at least" in found.reason
    assert "turn the sensor" in " ".join(found.advice)


def test_noise_beyond_the_earth_is_not_resolved(rng: np.random.Generator) -> None:
    found = measured(still(rng, white=3.0, minutes=10))
    assert found.verdict == "not resolved" and "standard deviations from zero" in found.reason
    assert found.interval[0] <= EARTH_RATE <= found.interval[1]


def test_the_interval_of_a_short_vector_covers(rng: np.random.Generator) -> None:
    """Lengths of half and three standard deviations: of 200 intervals no fewer than the 0.1 % quantile of 95 %."""
    for truth in (0.5, 3.0):
        inside = 0
        for m in np.array([0.0, 0.0, truth]) + rng.standard_normal((200, 3)):
            low, high = _bent_interval(math.sqrt(max(float(m @ m) - 3, 0.0)), 1.0, 0.025)
            inside += low <= truth <= high
        assert inside >= binom.ppf(0.001, 200, 0.95)


@pytest.mark.long
def test_the_second_order_bias_of_a_mean_is_taken_off(rng: np.random.Generator) -> None:
    """With a deviation of 2 deg/h in each axis the length of the mean is 0.27 deg/h too long; 60 records see it."""
    model = NoiseModel.of(White(N=0.667 * DEG_RT_H))
    rates = [still(rng, white=0.667, minutes=200 / 30) for _ in range(60)]
    lengths = np.array([measured(r, model=model).length for r in rates]) / DEG_H
    assert lengths.mean() == pytest.approx(15.041, abs=3.3 * 2 / math.sqrt(60))


def test_stated_uncertainties_enter_the_budget(rng: np.random.Generator) -> None:
    rates = still(rng, minutes=10)
    plain = measured(rates)
    found = measured(rates, stated=SetupUncertainty(scale=0.01), bias=0.2 * DEG_H)
    assert found.budget["scale factor"] == pytest.approx(0.01 * found.length)
    assert found.budget["bias"] == 0.2 * DEG_H
    expected = math.sqrt(plain.sd**2 + (0.01 * found.length) ** 2 + (0.2 * DEG_H) ** 2)
    assert found.total_sd == pytest.approx(expected)
    widths = [b - a for a, b in (plain.interval, found.interval)]
    assert widths[1] / widths[0] == pytest.approx(found.total_sd / plain.total_sd)


def test_samples_coarser_than_their_noise_widen_the_interval(rng: np.random.Generator) -> None:
    step = 2 * DEG_H
    rates = still(rng, white=0.0003) + 0.3 * DEG_H * rng.standard_normal((24000, 3))
    found = measured(np.round(rates / step) * step)
    assert found.budget["resolution"] > 0.3 * step / math.sqrt(12)


def test_the_latitude_is_checked_where_there_are_accelerometers(rng: np.random.Generator) -> None:
    record = with_gravity(still(rng), math.radians(40), rng)
    found = measure_rate_vector(record, latitude=math.radians(40))
    assert found.resolved and "agrees with the latitude" in found.reason
    assert found.latitude_found == pytest.approx(math.radians(40), abs=4 * found.sd / EARTH_RATE)
    wrong = measure_rate_vector(record, latitude=math.radians(43))
    assert wrong.verdict == "inconsistent" and "a latitude of 39.9" in wrong.reason
    assert measure_rate_vector(record, latitude=math.radians(43), stated=SetupUncertainty(tilt=0.05)).resolved


@pytest.mark.parametrize("latitude", [0.0, 40.0, 80.0, -60.0])
@pytest.mark.parametrize("signal", [0.5, 2.0, 5.0, 30.0, 1000.0])
@pytest.mark.parametrize("bias", [0.0, 3.0])
def test_the_latitude_is_blamed_as_seldom_as_stated_at_every_signal_to_noise(
    rng: np.random.Generator, latitude: float, signal: float, bias: float
) -> None:
    """One in a hundred of true latitudes; a bias of which the size was stated is no contradiction."""
    sd, blamed, tries = EARTH_RATE / signal, 0, 500
    covariance = np.broadcast_to(sd**2, (3, 1, 1))
    tilt = attitude_of(0.3, -0.2, 1.0)
    true = tilt.T @ earth_rate_vector(math.radians(latitude))
    for _ in range(tries):
        seen = true + math.hypot(sd, bias * sd) * rng.standard_normal(3)
        vectors = Vectors(level=seen[None], covariance=covariance, share=np.ones(1), rows=1, size=())
        check = latitude_check(
            vectors,
            tilt.T @ np.array([0.0, 0.0, -9.8]),
            math.radians(latitude),
            SetupUncertainty(),
            bias * sd,
        )
        blamed += not check.passed
    assert blamed / tries < 0.01 + 3.5 * math.sqrt(0.01 * 0.99 / tries)


# -- manners ----------------------------------------------------------------------------------------------


def test_what_makes_no_sense_is_refused(rng: np.random.Generator) -> None:
    rates = still(rng, minutes=2)
    with pytest.raises(InputError, match="three axes of rates"):
        measure_rate_vector(Recording.from_rate(rates[:, :2], rate=RATE, unit="rad/s"))
    with pytest.raises(InputError, match="three axes of rates"):
        measure_rate_vector(Recording.from_rate(rates, rate=RATE, unit="V"), channels=["x", "y", "z"])
    with pytest.raises(InputError, match="radians"):
        measured(rates, latitude=34.0)
    with pytest.raises(InputError, match="confidence"):
        measured(rates, confidence=95)
    with pytest.raises(InputError, match="bias"):
        measured(rates, bias=-1.0)
    with pytest.raises(InputError, match="no noise model for z"):
        measured(rates, model=dict.fromkeys("xy", NoiseModel.of(White(N=1.0))))
    rates[:, 2] = EARTH_RATE
    with pytest.raises(DataQualityError, match=r"'z'.*do not vary"):
        measured(rates)


def test_the_result_is_plain_data(rng: np.random.Generator) -> None:
    said = []
    found = measured(still(rng, minutes=5), progress=lambda part, what: said.append(part))
    data = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert data["format"] == "allanite-rate-vector"
    assert np.shape(data["covariance"]) == (3, 3) and data["earth_rate"] == EARTH_RATE
    assert said == sorted(said)
    spans = sorted((*found.used, *found.left_out), key=lambda s: s.start)
    assert spans[0].start == 0 and spans[-1].stop == pytest.approx(found.duration)
    assert all(a.stop == pytest.approx(b.start) for a, b in zip(spans, spans[1:], strict=False))


@pytest.mark.long
def test_a_long_record_is_read_in_blocks() -> None:
    """2.4 million samples of three axes in 14 MB; read whole as float64 they would be 58 MB."""
    rng = np.random.default_rng(1)
    samples = rng.integers(-100, 100, (2_400_000, 3), dtype=np.int16)
    record = Recording.from_rate(samples, rate=1000.0, unit="deg/h")
    tracemalloc.start()
    measure_rate_vector(record)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 25e6


# -- real records -----------------------------------------------------------------------------------------


@pytest.fixture
def vehicle_at_rest(real_data: Locate) -> tuple[Recording, float]:
    with np.load(real_data("psins_lasergyro/lasergyro.npz")) as file:
        rate, latitude = float(file["fs"]), math.radians(float(file["lat_deg"]))
        gyros = Recording.from_rate(file["gyro_deg_per_h"], rate=rate, unit="deg/h", names=["gx", "gy", "gz"])
        force = Recording.from_rate(file["acc_m_s2"], rate=rate, unit="m/s²", names=["ax", "ay", "az"])
    both = replace(gyros, channels=gyros.channels + force.channels, columns=gyros.columns + force.columns)
    return both, latitude


def test_e_real_ring_laser_sees_the_earth(vehicle_at_rest: tuple[Recording, float]) -> None:
    record, latitude = vehicle_at_rest
    found = measure_rate_vector(record, latitude=latitude)
    assert abs(found.length / EARTH_RATE - 1) < 0.005
    assert found.interval[0] < EARTH_RATE < found.interval[1]
    assert found.interval[1] - found.interval[0] < 0.02 * EARTH_RATE
    assert found.resolved and not found.turned
    disturbed = sum(min(s.stop, 300) - s.start for s in found.left_out if s.start < 300)
    assert disturbed > 0.85 * 300
    naive = math.hypot(*(float(record.values(n).mean()) for n in ("gx", "gy", "gz"))) * DEG_H
    assert abs(naive / EARTH_RATE - 1) > 0.01  # 1.5 % and more, by people and engine
    heading = math.degrees(math.atan2(-found.vector[0], found.vector[1]))  # x right, y front, z up
    assert heading == pytest.approx(90.6, abs=1.0)
    assert found.latitude_found == pytest.approx(latitude, abs=math.radians(0.5))


def test_e_real_ring_laser_in_disturbance_alone_gives_no_confident_number(
    vehicle_at_rest: tuple[Recording, float],
) -> None:
    record, _ = vehicle_at_rest
    found = measure_rate_vector(record.window(0, 180))
    assert found.verdict == "not resolved" and math.isnan(found.length)


def test_e_real_mems_is_no_measurement_of_the_earth(real_data: Locate) -> None:
    with np.load(real_data("adis16405_calgary/adis_16405_imu4.npz")) as file:
        record = Recording.from_rate(file["data"][:60000, :3], rate=100.0, unit="deg/s")
    found = measure_rate_vector(record)
    assert found.verdict == "inconsistent with Earth" and "|bias + Earth|" in found.reason
    counts = np.loadtxt(
        real_data("tomisuarez_mpu6050/imu_static_test.csv"), delimiter=",", skiprows=5, usecols=(3, 4, 5)
    )
    found = measure_rate_vector(Recording.from_rate(counts / 131, rate=100.0, unit="deg/s"))
    assert found.verdict == "inconsistent with Earth"


def test_e_real_hand_held_mems_has_no_quiet_stretch(real_data: Locate) -> None:
    samples = np.loadtxt(real_data("mikoff_mpu9150/imu0.log"))[:, 3:]
    found = measure_rate_vector(Recording.from_rate(samples, rate=100.0, unit="rad/s"))
    assert found.verdict == "not resolved" and "no quiet stretch" in found.reason
