# SPDX-License-Identifier: BSD-3-Clause
"""The latitude that an alignment measures: its set at every signal to noise, its check, and biases that rest on it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from allanite.experiments.alignment import align
from allanite.experiments.alignment.latitude import latitude_distance, measured_latitude
from allanite.experiments.alignment.results import AlignmentEstimate
from allanite.experiments.alignment.verdict import AlignmentCheckKind, AlignmentRemark, AlignmentVerdict
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.noise import NoiseModel, White
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.calibration import Calibration, parameter_names

DEG = math.pi / 180
MODEL = {
    "gyro": NoiseModel.of(White(N=0.005 * DEG / 60)),
    "accelerometer": NoiseModel.of(White(N=1e-4), kind="acceleration"),
}
TRIES = 600
#: Less than 0.94 in so many tries by chance once in a thousand: three standard deviations of a count.
LEAST = 0.94 - 3.1 * math.sqrt(0.94 * 0.06 / TRIES)


def covariance(north: float, east: float, down: float, correlation: float = 0.0) -> np.ndarray:
    """Of parts of the Earth's rate."""
    sds = np.array([north, east, down]) * EARTH_RATE
    together = np.eye(3)
    together[0, 2] = together[2, 0] = correlation
    return together * np.outer(sds, sds)


def true_rate(latitude: float, azimuth: float) -> np.ndarray:
    level = math.cos(latitude)
    return EARTH_RATE * np.array([level * math.cos(azimuth), level * math.sin(azimuth), -math.sin(latitude)])


@pytest.mark.long
@pytest.mark.parametrize("latitude", [0.0, 20.0, 48.1, 70.0, 85.0, 89.0, 90.0, -60.0])
@pytest.mark.parametrize(
    "spread",
    [
        covariance(0.01, 0.01, 0.01),
        covariance(0.2, 0.2, 0.2),
        covariance(0.33, 0.33, 0.33),
        covariance(0.01, 0.01, 0.33),
        covariance(0.3, 0.05, 0.2),
        covariance(0.1, 0.1, 0.3, 0.5),
    ],
)
def test_the_set_holds_the_latitude_at_every_signal_to_noise(
    rng: np.random.Generator, latitude: float, spread: np.ndarray
) -> None:
    factor, held, alarms = np.linalg.cholesky(spread), 0, 0
    for azimuth in rng.uniform(0, 2 * math.pi, TRIES):
        rate = true_rate(latitude * DEG, azimuth) + factor @ rng.standard_normal(3)
        found, sd = measured_latitude(rate, spread, 0.95)
        assert found.resolved
        assert math.isfinite(sd)
        assert found.lower <= found.value <= found.upper
        held += found.lower - 1e-12 <= latitude * DEG <= found.upper + 1e-12
        alarms += chi_square_tail(latitude_distance(rate, spread, latitude * DEG, 0.0), 1) < 0.01
    assert held / TRIES > LEAST
    assert alarms / TRIES < 0.06 if abs(latitude) > 80 else alarms / TRIES < 0.03


@pytest.mark.parametrize("down", [0.34, 1.0, 30.0, 1e4])
def test_a_vertical_rate_that_is_hardly_seen_gives_no_latitude_however_the_noise_fell(
    rng: np.random.Generator, down: float
) -> None:
    spread = covariance(0.001, 0.001, down)
    factor = np.linalg.cholesky(spread)
    for _ in range(50):
        rate = true_rate(0.8, 1.0) + factor @ rng.standard_normal(3)
        found, sd = measured_latitude(rate, spread, 0.95)
        assert not found.resolved
        assert math.isnan(found.value)
        assert math.isinf(sd)


def stood(
    tilts: float, *, latitude: float = 48.0, given: float | None = None, inverted: bool = False, seed: int = 1
) -> AlignmentEstimate:
    """A unit in four positions on a table, each off the level by its part of `tilts` [deg]."""
    leans = ((1.0, 0.5), (-1.0, 1.0), (0.5, -1.0), (-0.5, -0.5))
    attitudes = [(tilts * r * DEG, tilts * p * DEG, (30.0 + 90 * k) * DEG) for k, (r, p) in enumerate(leans)]
    motion = UnitMotion.positions(attitudes, dwell=60.0, turn=6.0)
    names = parameter_names("accelerometer") + parameter_names("gyro")
    values = [1.0 if ".scale_" in n else 0.0 for n in names]
    if inverted:
        values[names.index("gyro.scale_z")] = -1.0
    unit = Calibration(
        names=names, values=np.array(values), covariance=np.zeros((len(names),) * 2),
        status=("estimated",) * len(names),
        channels={"gyro": ("gyro_x", "gyro_y", "gyro_z"), "accelerometer": ("acc_x", "acc_y", "acc_z")},
        units={"gyro": "rad/s", "accelerometer": "m/s²"},
    )  # fmt: skip
    record = simulate_unit(
        MODEL, motion=motion, axes="FLU", rate=2.0, latitude=latitude * DEG, seed=seed, calibration=unit
    )
    spans = [
        (math.ceil(p["start"] * 2.0), math.floor(p["stop"] * 2.0))
        for p in record.history[-1]["motion"]["positions"]
    ]
    wanted = (latitude if given is None else given) * DEG
    return align(record, model=MODEL, latitude=wanted, spans=spans, checkpoints=1)


@pytest.mark.parametrize("tilts", [0.0, 0.05, 10.0])
def test_positions_on_a_table_resolve_the_latitude_only_by_their_tilts(tilts: float) -> None:
    found = [stood(tilts, seed=seed) for seed in range(3)]
    resolved = [f.measured_latitude for f in found if f.measured_latitude.resolved]
    assert len(resolved) == (len(found) if tilts >= 10 else 0)
    for estimate in found:
        asked = [c for c in estimate.checks if c.kind is AlignmentCheckKind.LATITUDE]
        assert len(asked) == (1 if estimate.measured_latitude.resolved else 0)
        assert all(c.passed for c in asked)
        assert [b.by_latitude for b in estimate.biases.values()][:2] == [False, False]
        assert estimate.biases["gyro_z"].by_latitude or tilts > 1
        assert estimate.verdict is AlignmentVerdict.RESOLVED
    for latitude in resolved:
        assert latitude.upper - latitude.lower < 20 * DEG
        half = (latitude.upper - latitude.lower) / 2
        assert abs(latitude.value - 48 * DEG) < 2 * half


@pytest.mark.parametrize("given", [-48.0, 20.0, 75.0])
def test_a_latitude_that_the_rotation_excludes_does_not_pass(given: float) -> None:
    wrong = stood(10.0, given=given)
    check = next(c for c in wrong.checks if c.kind is AlignmentCheckKind.LATITUDE)
    assert not check.passed
    assert wrong.verdict in (AlignmentVerdict.INCONSISTENT, AlignmentVerdict.NO_NORTH)
    assert check.given == pytest.approx(given * DEG)
    assert f"not {given:.2f}: check the latitude" in " ".join((wrong.reason, *wrong.advice))
    assert wrong.measured_latitude.lower < 48 * DEG < wrong.measured_latitude.upper


@pytest.mark.parametrize("latitude", [48.0, -48.0])
@pytest.mark.parametrize(
    ("wrong_sign", "inverted"), [(False, False), (True, False), (False, True), (True, True)]
)
def test_a_bias_of_minus_twice_the_vertical_rate_is_a_hint(
    latitude: float, wrong_sign: bool, inverted: bool
) -> None:
    """Of an upright unit the wrong hemisphere is not seen, nor an inverted axis; both together is another matter."""
    found = stood(0.0, latitude=latitude, given=-latitude if wrong_sign else latitude, inverted=inverted)
    assert (AlignmentRemark.MIRRORED in found.remarks) is (wrong_sign is not inverted)
    assert any("minus twice" in words for words in found.advice) is (wrong_sign is not inverted)
