# SPDX-License-Identifier: BSD-3-Clause
"""MAVLink telemetry logs: packets made by the library of the protocol, in the file format of ground stations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import AllaniteError, InputError
from allanite.files.readers import mavlink
from hostile_files import inline
from mavlink_writer import RAW, N, telemetry

pytest.importorskip("pymavlink")


@pytest.fixture(autouse=True)
def _in_this_process(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the child, but for one test."""
    if "child" not in request.node.name:
        monkeypatch.setattr(mavlink, "run", inline)


@pytest.mark.parametrize("version", [1, 2])
def test_messages_come_back_in_si(version: int, tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(telemetry(version))
    scaled = al.read(path, topic="SCALED_IMU2")
    assert scaled.n_samples == N and scaled.rate == pytest.approx(20.0)
    si = {c.name: scaled.values(c.name) * c.scale for c in scaled.channels}
    np.testing.assert_allclose(si["gyro_z"], RAW[:, 2] * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(si["acc_x"], RAW[:, 3] * 1e-3 * 9.80665, rtol=1e-12)
    best = al.read(path)  # HIGHRES_IMU, if the version has it beside the others
    np.testing.assert_allclose(best.values("gyro_x"), np.float32(RAW[:, 0] * 1e-3), rtol=1e-6)
    assert best["acc_y"].unit == "m/s²" and best.notes["source"]["topic"] == "HIGHRES_IMU"
    raw = al.read(path, topic="RAW_IMU")
    assert any("some autopilots send counts" in g for g in raw.notes["source"]["guesses"])


def test_damaged_packets_are_left_out_and_counted_by_the_child(tmp_path: Path) -> None:
    content = bytearray(telemetry(2))
    content[len(content) // 2] ^= 0xFF
    content[:0] = telemetry(2)[:200]  # another beginning, broken off
    path = tmp_path / "flight.tlog"
    path.write_bytes(bytes(content))
    recording = al.read(path, topic="SCALED_IMU2")
    assert recording.n_samples >= N - 2
    assert any("left out" in g for g in recording.notes["source"]["guesses"])


def test_damage_anywhere_is_our_own_error_or_a_recording(tmp_path: Path) -> None:
    whole, rng, refused = telemetry(2), np.random.default_rng(1), 0
    path = tmp_path / "flight.tlog"
    for _ in range(60):
        content = bytearray(whole[: int(rng.integers(60, len(whole)))])
        for at in rng.integers(60, len(content), int(rng.integers(1, 40))):
            content[at] = int(rng.integers(256))
        path.write_bytes(bytes(content))
        try:
            al.read(path, rate=20.0)
        except AllaniteError:
            refused += 1
    assert refused < 60, "some of so little damage leave a recording"


def test_a_log_without_inertial_sensor_says_what_is_read(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(telemetry(2, inertial=False))
    with pytest.raises(InputError, match="HIGHRES_IMU"):
        al.read(path)
