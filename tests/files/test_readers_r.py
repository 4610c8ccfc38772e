# SPDX-License-Identifier: BSD-3-Clause
"""R data: files written byte by byte, by the definition of the format."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import FormatError, InputError, LimitError
from allanite.files.readers import r_data
from hostile_files import inline
from r_writers import Classed, frame, rda, rds

pytest.importorskip("rdata")


@pytest.fixture(autouse=True)
def _in_this_process(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the child, whose interpreter takes seconds to start; one test keeps it."""
    if "child" not in request.node.name:
        monkeypatch.setattr(r_data, "run", inline)


N = 200
Y = np.random.default_rng(1).standard_normal((N, 3))
T = np.arange(N) / 100.0
COLUMNS = {"time": T, "gyro_x": Y[:, 0], "gyro_y": Y[:, 1], "gyro_z": Y[:, 2]}


@pytest.mark.parametrize("packed", [bytes, gzip.compress, bz2.compress, lzma.compress])
def test_a_data_frame_comes_back(packed: Callable[[bytes], bytes], tmp_path: Path) -> None:
    path = tmp_path / "log.rda"
    path.write_bytes(packed(rda({"log": frame(COLUMNS, "tbl_df", "tbl"), "note": ["bench 3"]})))
    recording = al.read(path, unit="deg/s")
    assert recording.names == ("gyro_x", "gyro_y", "gyro_z") and recording.rate == pytest.approx(100.0)
    for i, name in enumerate(recording.names):
        np.testing.assert_array_equal(recording.values(name), Y[:, i])


def test_other_shapes_of_r(tmp_path: Path) -> None:
    def read(content: bytes, **options: object) -> al.Recording:
        path = tmp_path / "x.rds"
        path.write_bytes(gzip.compress(content))
        return al.read(path, **options)  # type: ignore[arg-type]

    one = read(rds(Y[:, 0]), rate=10.0, unit="deg/s")
    np.testing.assert_array_equal(one.values(one.names[0]), Y[:, 0])
    matrix = read(rds(Classed(Y, dim=np.array([N, 3]))), rate=10.0, unit="deg/s")
    np.testing.assert_array_equal(matrix.values(matrix.names[2]), Y[:, 2])
    gaps = np.arange(N, dtype=np.int32)
    gaps[7] = -(1 << 31)
    holed = read(
        rds(frame({"gyro_x": gaps, "gyro_y": Y[:, 1]})), rate=10.0, unit="deg/s", channels=["gyro_x"]
    )
    assert np.flatnonzero(np.isnan(holed.values("gyro_x"))).tolist() == [7]
    start = 1.76e9
    stamped = {"when": Classed(start + T, **{"class": ["POSIXct", "POSIXt"]}), "gyro_x": Y[:, 0]}
    dated = read(rds(frame(stamped)), unit="deg/s")
    assert dated.rate == pytest.approx(100.0, rel=1e-6) and dated.start == pytest.approx(
        start * 1e9, rel=1e-12
    )
    imu = Classed(Y, dim=np.array([N, 3]), freq=np.array([250.0]), sensor=["Gyro"] * 3, axis=["X", "Y", "Z"],
                  **{"class": ["imu"]})  # fmt: skip
    found = read(rds(imu), unit="rad/s")
    assert found.rate == 250.0 and found.names == ("Gyro_X", "Gyro_Y", "Gyro_Z")


def test_an_object_is_chosen_by_name(tmp_path: Path) -> None:
    path = tmp_path / "two.RData"
    short = frame({"time": T[:50], "acc_x": Y[:50, 0]})
    path.write_bytes(gzip.compress(rda({"long": frame(COLUMNS), "short": short})))
    assert al.read(path, unit="g", variable="short").n_samples == 50
    with pytest.raises(InputError, match="no array 'other'"):
        al.read(path, unit="g", variable="other")


def test_a_record_of_three_dimensions_is_chosen_and_the_others_are_told(tmp_path: Path) -> None:
    poses = np.random.default_rng(2).standard_normal((4, N, 3))
    path = tmp_path / "poses.rda"
    path.write_bytes(gzip.compress(rda({"poses": Classed(poses, dim=np.array(poses.shape))})))
    found = al.read(path, rate=100.0, unit="g", variable="poses[2]")
    np.testing.assert_array_equal(found.values(found.names[1]), poses[2, :, 1])


def test_arrays_that_were_left_out_are_of_another_length_only_where_they_are(tmp_path: Path) -> None:
    path, table = tmp_path / "two.rda", Classed(Y, dim=np.array(Y.shape))
    path.write_bytes(
        gzip.compress(rda({"gyro": table, "accel": table, "single": Y[:, 0], "short": Y[:60, 0]}))
    )
    said = al.read(path, rate=100.0, unit="deg/s", variable="gyro").notes["source"]["guesses"]
    left = [g for g in said if "left out" in g]
    assert len(left) == 2 and left[0].startswith("arrays of another length left out")
    assert "short" in left[0] and "accel" not in left[0]
    assert left[1].startswith("arrays left out") and "accel" in left[1] and "single" in left[1]


@pytest.mark.long
def test_the_child_reads_and_survives_damage(tmp_path: Path) -> None:
    path = tmp_path / "x.rds"
    whole = rds(frame(COLUMNS))
    path.write_bytes(gzip.compress(whole))
    assert al.read(path, unit="deg/s").n_samples == N
    path.write_bytes(whole[:1000])
    with pytest.raises(FormatError):
        al.read(path, unit="deg/s")


def test_damaged_and_packed_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.rds"
    for content, words in (
        (gzip.compress(rds(frame(COLUMNS)))[:900], "damaged|ends"),
        (rds({"a": ["b"]}), "no vector"),
    ):
        path.write_bytes(content)
        with pytest.raises(FormatError, match=words):
            al.read(path, unit="deg/s")
    path.write_bytes(gzip.compress(b"X\n\0\0\0" + bytes(60 << 20)))
    with pytest.raises(LimitError):
        al.read(path)
