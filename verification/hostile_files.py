# SPDX-License-Identifier: BSD-3-Clause
"""Row F4 of the test battery: thousands of damaged files of each binary format, and what becomes of each.

Every file has one to five bytes changed, every tenth is cut as well. Each is read in a process of its own with the
limits of a reader's child; what ends that process by a signal is a `FormatError` for the caller. The parent lives, or
this run does not end.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from tests import flight_log_writers as logs
from tests import ros_writers as ros
from tests import spreadsheet_writers as sheets
from tests.hostile_files import mutations, outcomes, tally

Json = dict[str, Any]

_N = 60
_BATCH = 200  # files on the disk at once


def _samples() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    return rng.normal(size=(_N, 3)), rng.normal(size=(_N, 3))


def _npy(path: Path) -> None:
    np.save(path, np.column_stack(_samples()))


def _matlab5(path: Path) -> None:
    from scipy.io import savemat

    gyro, acc = _samples()
    savemat(path, {"gyro": gyro, "acc": acc, "fs": 100.0}, do_compression=True)


def _matlab73(path: Path) -> None:
    import h5py

    gyro, acc = _samples()
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("gyro", gyro.T), ("acc", acc.T), ("fs", [[100.0]])):
            file.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")


def _hdf5(path: Path) -> None:
    import h5py

    gyro, acc = _samples()
    with h5py.File(path, "w") as file:
        group = file.create_group("imu")
        group.attrs["fs"] = 100.0
        group.create_dataset("gyro", data=gyro, chunks=(20, 3), compression="gzip").attrs["units"] = "deg/s"
        group.create_dataset("acc", data=acc, chunks=(20, 3), fletcher32=True)


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for part in np.array_split(np.column_stack(_samples()), 3):
            channels = [
                ChannelObject("IMU", f"c{i}", c, {"wf_increment": 0.01}) for i, c in enumerate(part.T)
            ]
            writer.write_segment(channels)


def _ardupilot(path: Path) -> None:
    gyro, acc = _samples()
    pieces = [logs.FMT_ITSELF, logs.fmt(*logs.IMU), logs.fmt(*logs.ISBH), logs.fmt(*logs.ISBD)]
    pieces += [logs.imu(10_000 * k, k % 2, gyro[k], acc[k]) for k in range(_N)]
    pieces.append(logs.record(logs.ISBH[0], logs.ISBH[2], [1, 0, 1, 0, 900, 32, 5, 1000.0]))
    pieces.append(logs.record(logs.ISBD[0], logs.ISBD[2], [1, 0, 0, *([list(range(32))] * 3)]))
    path.write_bytes(b"".join(pieces))


def _ulog(path: Path) -> None:
    gyro, acc = _samples()
    head = [logs.ulog_header(), logs.definition("sensor_combined", logs.SENSOR_COMBINED)]
    rows = [logs.combined(1, 10**7 + 4000 * k, gyro[k], acc[k]) for k in range(_N)]
    path.write_bytes(b"".join([*head, logs.subscription(1, "sensor_combined"), *rows, logs.dropout(20)]))


def _raw(path: Path) -> None:
    path.write_bytes(
        b"".join(b"\xa5\x5a" + row.astype("<f4").tobytes() for row in np.column_stack(_samples()))
    )


def _ros(two: bool, packed: str = "") -> Callable[[Path], None]:
    """An Imu, its temperature, and messages of another kind."""

    def written(path: Path) -> None:
        types, (gyro, acc) = ros.Types(two), _samples()
        rows = []
        for k in range(_N):
            at = 1_700_000_000 * 10**9 + 10_000_000 * k
            rows.append(("/imu/data", ros.IMU, at, types.imu(at, gyro[k], acc[k])))
            rows.append(("/imu/temperature", ros.TEMPERATURE, at, types.temperature(at, 20.0)))
            text = types.make("std_msgs/msg/String", data="hello")
            rows.append(("/chatter", "std_msgs/msg/String", at, text))
        ros.write(types, path, rows, packed)

    return written


def _sheet(path: Path) -> None:
    gyro, acc = _samples()
    head = ["t (s)", *(f"{g} {a}" for g in ("gyro", "acc") for a in "xyz")]
    rows = [[0.01 * k, *map(float, row)] for k, row in enumerate(np.column_stack((gyro, acc)))]
    sheets.xlsx(path, {"log": [head, *rows]})


_FIELDS = [{"name": f"gyro_{i}", "type": "f32"} for i in range(6)]
FORMATS: dict[str, tuple[str, Callable[[Path], None], Json]] = {
    "NumPy": ("a.npy", _npy, {"rate": 100.0}),
    "MATLAB 5": ("a5.mat", _matlab5, {}),
    "MATLAB 7.3": ("a73.mat", _matlab73, {}),
    "HDF5": ("a.h5", _hdf5, {}),
    "LabVIEW TDMS": ("a.tdms", _tdms, {}),
    "ArduPilot": ("a.BIN", _ardupilot, {}),
    "PX4 ULog": ("a.ulg", _ulog, {}),
    "ROS 1 bag": ("a1.bag", _ros(False), {}),
    "ROS 1 bag, lz4": ("a2.bag", _ros(False, "lz4"), {}),
    "ROS 2 SQLite": ("a.db3", _ros(True), {}),
    "MCAP": ("a1.mcap", _ros(True), {}),
    "MCAP, zstd": ("a2.mcap", _ros(True, "storage"), {}),
    "spreadsheet": ("a.xlsx", _sheet, {}),
    "raw binary": ("a.raw", _raw, {"layout": {"rate": 100, "frame": {"header": "A5 5A", "fields": _FIELDS}}}),
}


def _batches(contents: list[bytes], folder: Path, suffix: str) -> Iterator[list[Path]]:
    for start in range(0, len(contents), _BATCH):
        files = []
        for i, content in enumerate(contents[start : start + _BATCH]):
            files.append(folder / f"{i}{suffix}")
            files[-1].write_bytes(content)
        yield files


def run_mutations(
    records: int = 2000, seed: int = 20261122, say: Callable[[str], None] = print
) -> list[Json]:
    """Damaged files of every format, and how many were read, refused, or ended their process.

    Parameters
    ----------
    records : int
        Files of each format.

    Returns
    -------
    list of dict
        One per format: format, files, read, refused, by_signal, other_errors (0, or the run stops), passes.
    """
    rows: list[Json] = []
    for name, (file, write, options) in FORMATS.items():
        with tempfile.TemporaryDirectory(prefix="allanite-") as place:
            folder = Path(place)
            sound = folder / file
            write(sound)
            found: list[int] = []
            contents = mutations(sound.read_bytes(), records, seed)
            for files in _batches(contents, folder, sound.suffix):
                found += outcomes(sound, files, options)
        told = tally(found)
        row = {
            "format": name,
            "files": records,
            "read": told.get("read", 0),
            "refused": told.get("refused", 0),
        }
        row["by_signal"] = sum(n for what, n in told.items() if what.startswith("signal"))
        row["other_errors"] = told.get("another error", 0)
        row["passes"] = not (row["by_signal"] or row["other_errors"])
        rows.append(row)
        say(str(row))
    return rows
