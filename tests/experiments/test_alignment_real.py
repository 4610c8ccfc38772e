# SPDX-License-Identifier: BSD-3-Clause
"""Self-alignment of real recordings: a laser unit of known heading, and consumer units that must not get one."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from allanite.experiments.alignment import AlignmentEstimate, align
from allanite.quantities.earth import DEG_H
from allanite.recording.records import ArrayColumn, Channel, Recording

DEG = math.pi / 180
LATITUDE = 34.246048 * DEG
#: Heading of the y axis, which points forward.
HEADING = 90.6 * DEG


def unit(gyro: np.ndarray, acc: np.ndarray, units: tuple[str, str], rate: float) -> Recording:
    """A recording of three gyros and three accelerometers."""
    names = [f"gyro_{a}" for a in "xyz"] + [f"acc_{a}" for a in "xyz"]
    kinds = [units[0]] * 3 + [units[1]] * 3
    return Recording(
        channels=tuple(Channel.of(n, u) for n, u in zip(names, kinds, strict=True)),
        columns=tuple(ArrayColumn(np.ascontiguousarray(c)) for c in (*gyro.T, *acc.T)),
        rate=rate,
    )


@pytest.fixture
def laser(real_data: Callable[[str], Path]) -> Recording:
    """Ring-laser unit in a parked vehicle, people entering; 31 min."""
    with np.load(real_data("psins_lasergyro/lasergyro.npz")) as file:
        return unit(file["gyro_deg_per_h"], file["acc_m_s2"], ("deg/h", "m/s^2"), float(file["fs"]))


def _is_that_of_the_reference(found: AlignmentEstimate) -> None:
    assert abs(found.heading - HEADING) < 1 * DEG
    assert found.interval.contains(HEADING)
    assert found.interval.width < 6 * DEG
    assert abs(found.latitude_found - LATITUDE) < 0.5 * DEG
    assert found.latitude_interval[0] < LATITUDE < found.latitude_interval[1]
    assert found.mode == "static"
    assert found.gravity == pytest.approx(9.7958, abs=5e-4)
    assert found.naive is not None
    assert found.naive.flagged
    assert found.naive.heading / DEG == pytest.approx(83.2, abs=0.1)
    assert found.naive.rate / DEG_H == pytest.approx(16.03, abs=0.01)
    assert any("do not use" in words and "83.2 deg" in words for words in found.advice)


def test_a_laser_unit_finds_its_heading(laser: Recording) -> None:
    found = align(laser, latitude=LATITUDE, height=380.0, axes="RFU", bias_repeatability=(0.01 * DEG_H, 1e-3))
    assert found.verdict == "resolved"
    _is_that_of_the_reference(found)
    assert found.running.heading[-1] == pytest.approx(found.heading, abs=0.5 * DEG)


def test_a_laser_unit_whose_biases_nobody_stated(laser: Recording) -> None:
    found = align(laser, latitude=LATITUDE, height=380.0, axes="RFU", checkpoints=4)
    assert found.verdict == "bias not known"
    _is_that_of_the_reference(found)
    assert "biases" in found.statement


def test_a_consumer_unit_gets_no_north(real_data: Callable[[str], Path]) -> None:
    """MPU-9150, turned by hand: rests of some seconds, biases of a degree per second."""
    rows = np.loadtxt(real_data("mikoff_mpu9150") / "imu3.log")
    record = unit(rows[:, 3:6], rows[:, :3], ("rad/s", "m/s^2"), 100.0)
    found = align(record, latitude=55 * DEG, checkpoints=2)
    assert found.verdict == "no north"
    _is_refused(found)


def test_a_consumer_unit_at_rest_gets_no_north(real_data: Callable[[str], Path]) -> None:
    """MPU-6050 in counts, 100 s at rest: 131 LSB/(deg/s) and 16384 LSB/g by the data sheet."""
    rows = np.loadtxt(real_data("tomisuarez_mpu6050/imu_static_test.csv"), delimiter=",", skiprows=5)
    record = unit(rows[:, 3:] / 131.0, rows[:, :3] / 16384.0, ("deg/s", "g"), 100.0)
    found = align(record, latitude=-34 * DEG, checkpoints=2)
    assert found.verdict == "no north"
    _is_refused(found)


def _is_refused(found: AlignmentEstimate) -> None:
    assert math.isnan(found.heading)
    assert found.interval.full
    assert found.reason
    assert found.advice
