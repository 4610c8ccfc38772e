# SPDX-License-Identifier: BSD-3-Clause
"""Records of arrays with three dimensions, and objects of MATLAB classes."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.files.readers import hdf5, matlab
from hostile_files import inline

DEEP = np.random.default_rng(3).standard_normal((4, 120, 3))  # records, samples, axes


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    for reader in (hdf5, matlab):
        monkeypatch.setattr(reader, "run", inline)


def npz(path: Path) -> None:
    np.savez(path.open("wb"), data=DEEP, fs=np.array(50.0))


def mat(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"data": DEEP, "fs": 50.0})


def mat73(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file["data"] = DEEP.T  # MATLAB counts its dimensions the other way round
        file["data"].attrs["MATLAB_class"] = np.bytes_("double")
        file["fs"] = np.array([[50.0]])
        file["fs"].attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def h5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["bench/data"] = DEEP
        file["bench/data"].attrs["fs"] = 50.0


WRITERS: dict[str, tuple[Callable[[Path], None], str]] = {
    "a.npz": (npz, "data"), "a.mat": (mat, "data"), "b.mat": (mat73, "data"), "a.h5": (h5, "bench/data"),
}  # fmt: skip


@pytest.mark.parametrize("file", [*WRITERS, "a.npy"])
def test_a_record_is_chosen_in_numpy_and_in_matlab_words(file: str, tmp_path: Path) -> None:
    path, name, options = tmp_path / file, "", {"rate": 50.0}
    if file == "a.npy":
        np.save(path, DEEP)
    else:
        write, name = WRITERS[file]
        write(path)
        options = {}
    for index, wanted in (
        ("[2]", DEEP[2]),
        ("(3, :, :)", DEEP[2]),
        ("[2,:,:]", DEEP[2]),
        ("[1,:,0]", DEEP[1, :, 0]),
    ):
        recording = al.read(path, unit="deg/s", variable=name + index, **options)  # type: ignore[arg-type]
        found = np.stack([recording.values(n) for n in recording.names], axis=1)
        np.testing.assert_array_equal(found, wanted.reshape(len(wanted), -1))
        assert recording.rate == 50.0
    for index in ("[9]", "[:]", "[x]", "(0)", "[1,1,1]"):
        with pytest.raises(InputError):
            al.read(path, unit="deg/s", variable=name + index, **options)  # type: ignore[arg-type]
    if file != "a.h5":
        with pytest.raises((InputError, FormatError), match=r"\[0\]"):
            al.read(path, unit="deg/s", **options)  # type: ignore[arg-type]


def _element(kind: int, body: bytes) -> bytes:
    return struct.pack("<II", kind, len(body)) + body + bytes(-len(body) % 8)


def version5(name: str, kind: str) -> bytes:
    """A file of version 5 with one object of a class, as far as the format is documented."""
    words = b"".join(_element(1, word.encode()) for word in (name, "MCOS", kind))
    flags, shape = _element(6, struct.pack("<II", 13, 0)), _element(5, struct.pack("<ii", 6, 1))
    pointer = _element(
        14, flags + shape + _element(1, b"") + _element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    )
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    return head + _element(14, _element(6, struct.pack("<II", 17, 0)) + words + pointer)


def version73(path: Path, name: str, kind: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file[name] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype=np.uint32)
        file[name].attrs["MATLAB_class"] = np.bytes_(kind)
        file[name].attrs["MATLAB_object_decode"] = np.int32(3)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("kind", ["timetable", "table", "timeseries", "iddata", "datetime", "MyLogger"])
def test_objects_are_named_with_the_way_out(kind: str, tmp_path: Path) -> None:
    lines = {"timetable": r"writetimetable\(imu, 'log.csv'\)", "table": r"writetable\(imu",
             "timeseries": r"imu\.Time, imu\.Data", "iddata": r"imu\.OutputData"}  # fmt: skip
    path = tmp_path / "log.mat"
    for write in (lambda: path.write_bytes(version5("imu", kind)), lambda: version73(path, "imu", kind)):
        write()
        with pytest.raises(FormatError, match=f"imu is a {kind}, .*{lines.get(kind, 'save')}"):
            al.read(path, unit="deg/s", rate=1.0)


def test_an_object_beside_matrices_is_told(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "log.mat"
    savemat(path, {"gyro": DEEP[0], "fs": 50.0})
    path.write_bytes(path.read_bytes() + version5("note", "table")[128:])
    recording = al.read(path, unit="deg/s")
    assert recording.n_samples == 120
    assert any("note is a table" in g for g in recording.notes["source"]["guesses"])
