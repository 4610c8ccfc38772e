# SPDX-License-Identifier: BSD-3-Clause
"""How fast logs are read: the same samples in every format, from the call to the last value of every channel.

    python -m benchmarks.read_speed

Six channels at 200 Hz, each reading in a fresh process that has imported nothing but `allanite.read`. Processor seconds
are those of the reader and of the child in which it parses, all threads together; on a machine that is busy with
something else they say more than the clock does. Memory is the largest that one of the two processes held. The file
was just written, so it comes from the cache of the system: what is measured is the reading, not the disk.

A release has to read a million messages of an IMU in each container of ROS within a bar. `benchmarks.jobs` reads 20
million rows of text and Parquet.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests import flight_log_writers as logs
from tests import ros_writers as ros
from tests import spreadsheet_writers as sheets

from allanite.recording.records import Recording

from .machine import describe, save

ROWS = 1_000_000
NAMES = [f"{g}_{a}" for g in ("gyro", "acc") for a in "xyz"]


def _columns() -> NDArray[np.float64]:
    return np.random.default_rng(1).normal(size=(ROWS, 6))


def _csv(path: Path, y: NDArray[np.float64]) -> None:
    import pyarrow as pa
    import pyarrow.csv

    table = {"t (s)": np.arange(ROWS) * 0.005, **dict(zip(NAMES, y.T, strict=True))}
    pa.csv.write_csv(pa.table({k: np.ascontiguousarray(v) for k, v in table.items()}), path)


def _parquet(path: Path, y: NDArray[np.float64]) -> None:
    from allanite.files.recording_file import write_recording

    write_recording(Recording.from_rate(y, rate=200.0, unit="deg/s"), path)


def _matlab5(path: Path, y: NDArray[np.float64]) -> None:
    from scipy.io import savemat

    savemat(path, {"fs": 200.0, "gyro": y[:, :3], "acc": y[:, 3:]})


def _matlab73(path: Path, y: NDArray[np.float64]) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("fs", [[200.0]]), ("gyro", y[:, :3].T), ("acc", y[:, 3:].T)):
            variable = file.create_dataset(
                name, data=values, chunks=None if name == "fs" else (3, 4096), compression=None
            )
            variable.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")


def _hdf5(path: Path, y: NDArray[np.float64]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["sample_rate"] = 200.0
        file.create_dataset("gyro", data=y[:, :3])
        file.create_dataset("acc", data=y[:, 3:])


def _hdf5_packed(path: Path, y: NDArray[np.float64]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["sample_rate"] = 200.0
        for name, values in (("gyro", y[:, :3]), ("acc", y[:, 3:])):
            file.create_dataset(
                name, data=values.astype("f4"), chunks=(20_000, 3), compression="gzip", compression_opts=1
            )


def _tdms(path: Path, y: NDArray[np.float64]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for part in np.array_split(y, 20):
            channels = [
                ChannelObject("IMU", n, c, {"wf_increment": 0.005})
                for n, c in zip(NAMES, part.T, strict=True)
            ]
            writer.write_segment(channels)


def _repeated(one: bytes, stamps_at: int, fields_at: int, y: NDArray[np.float64]) -> bytes:
    """One record again and again, with its own stamp and six float32."""
    table = np.tile(np.frombuffer(one, dtype=np.uint8), (len(y), 1))
    stamps = (10**7 + 5000 * np.arange(len(y))).astype("<u8")
    table[:, stamps_at : stamps_at + 8] = stamps.view(np.uint8).reshape(-1, 8)
    table[:, fields_at : fields_at + 24] = np.ascontiguousarray(y, dtype="<f4").view(np.uint8).reshape(-1, 24)
    return table.tobytes()


def _ardupilot(path: Path, y: NDArray[np.float64]) -> None:
    one = logs.imu(0, 0, [0.0] * 3, [0.0] * 3)
    path.write_bytes(logs.FMT_ITSELF + logs.fmt(*logs.IMU) + _repeated(one, 3, 12, y))


def _ulog(path: Path, y: NDArray[np.float64]) -> None:
    fields = "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;"
    head = (
        logs.ulog_header()
        + logs.definition("sensor_combined", fields)
        + logs.subscription(1, "sensor_combined")
    )
    path.write_bytes(head + _repeated(logs.data(1, "Q6f", 0, *[0.0] * 6), 5, 13, y))


def _raw(path: Path, y: NDArray[np.float64]) -> None:
    path.write_bytes(y.astype("<f4").tobytes())


def _ros(two: bool) -> Callable[[Path, NDArray[np.float64]], None]:
    """One message again and again, with its own stamp and vectors; written by rosbags."""

    def written(path: Path, y: NDArray[np.float64]) -> None:
        types = ros.Types(two)
        one = types.bytes_of(types.imu(0, [0.0] * 3, [0.0] * 3), ros.IMU)
        stamps = 1_700_000_000 * 10**9 + 5_000_000 * np.arange(len(y))
        table = np.tile(np.frombuffer(one, dtype=np.uint8), (len(y), 1))
        size = len(one)
        parts = np.stack([stamps // 10**9, stamps % 10**9], axis=1).astype("<u4")
        table[:, 4:12] = parts.view(np.uint8).reshape(-1, 8)
        table[:, size - 192 : size - 168] = np.ascontiguousarray(y[:, :3]).view(np.uint8).reshape(-1, 24)
        table[:, size - 96 : size - 72] = np.ascontiguousarray(y[:, 3:]).view(np.uint8).reshape(-1, 24)
        rows = (("/imu/data", ros.IMU, int(s), row.tobytes()) for s, row in zip(stamps, table, strict=True))
        ros.write(types, path, rows, chunk_bytes=768 << 10)  # as rosbag writes them

    return written


def _sheet(path: Path, y: NDArray[np.float64]) -> None:
    rows = ([k * 0.005, *row] for k, row in enumerate(y.tolist()))
    sheets.xlsx(path, {"log": _after(["t (s)", *NAMES], rows)})


def _after(head: list[str], rows: Any) -> Any:
    yield head
    yield from rows


LAYOUT = {"rate": 200, "frame": {"fields": [{"name": n, "type": "f32"} for n in NAMES]}}
Case = tuple[str, Callable[[Path, Any], None], dict[str, Any]]
FORMATS: dict[str, Case] = {
    "text (CSV)": ("log.csv", _csv, {}),
    "spreadsheet (.xlsx)": ("log.xlsx", _sheet, {}),
    "NumPy": ("log.npy", np.save, {"rate": 200.0}),
    "Parquet": ("log.parquet", _parquet, {}),
    "MATLAB 5": ("log5.mat", _matlab5, {}),
    "MATLAB 7.3": ("log73.mat", _matlab73, {}),
    "HDF5": ("log.h5", _hdf5, {}),
    "HDF5, gzip, float32": ("packed.h5", _hdf5_packed, {}),
    "LabVIEW TDMS": ("log.tdms", _tdms, {}),
    "ROS 1 bag": ("log.bag", _ros(False), {}),
    "ROS 2 SQLite": ("log2.db3", _ros(True), {}),
    "ROS 2 MCAP": ("log3.mcap", _ros(True), {}),
    "ArduPilot": ("log.BIN", _ardupilot, {}),
    "PX4 ULog": ("log.ulg", _ulog, {}),
    "raw binary": ("log.raw", _raw, {"layout": LAYOUT}),
}
ROS_BAR = 8.0  # seconds

_READ = """
import json, resource, sys, time
import allanite as al
al.read
path, options = json.loads(sys.argv[1])
clock, cpu = time.perf_counter(), time.process_time()
recording = al.read(path, **options)
for channel in recording.names:
    for _, _block in recording.blocks(channel):
        pass
child = resource.getrusage(resource.RUSAGE_CHILDREN)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))  # ru_maxrss is that of the parent as well
print(json.dumps({
    "seconds": time.perf_counter() - clock,
    "cpu": time.process_time() - cpu + child.ru_utime + child.ru_stime,
    "memory": max(int(status["VmHWM"].split()[0]), child.ru_maxrss) * 1024,
    "rows": recording.n_samples,
    "channels": len(recording.names),
}))
"""


def measure(name: str, case: Case, y: NDArray[np.float64], folder: Path, runs: int = 3) -> dict[str, Any]:
    """Seconds, processor seconds and memory of one format, each the best of some runs."""
    file, write, options = case
    path = folder / file
    write(path, y)
    job = json.dumps([str(path), options])
    runs_measured = [
        json.loads(subprocess.run([sys.executable, "-c", _READ, job], capture_output=True, check=True).stdout)
        for _ in range(runs)
    ]
    width = 1 if y.ndim == 1 else y.shape[1]
    assert all((f["rows"], f["channels"] >= width) == (len(y), True) for f in runs_measured), name
    size = path.stat().st_size
    path.unlink()
    best = {key: min(f[key] for f in runs_measured) for key in ("seconds", "cpu", "memory")}
    return {"format": name, "bytes": size, "rows": len(y), **best}


def main() -> None:
    y, formats = _columns(), []
    with tempfile.TemporaryDirectory() as folder:
        for name, case in FORMATS.items():
            formats.append(measure(name, case, y, Path(folder)))
            if name.startswith("ROS"):
                formats[-1]["bar"] = ROS_BAR
    result = {
        "machine": describe("pyarrow", "scipy", "h5py", "npTDMS", "pyulog", "rosbags", "python-calamine"),
        "formats": formats,
        "notes": [
            f"{ROWS} rows of six channels; best of three, from the call to the last value",
            "processor time: of all threads and of the child process; rows/s by it",
        ],
    }
    rows = [
        [
            r["format"],
            f"{r['bytes'] / 1e6:.0f}",
            f"{r['seconds']:.2f}",
            f"{r['cpu']:.2f}",
            f"{r['bar']:g}" if "bar" in r else "",
            f"{r['rows'] / r['cpu'] / 1e6:.2f}",
            f"{r['memory'] / 1e6:.0f}",
        ]
        for r in formats
    ]
    header = ["format", "file [MB]", "seconds", "processor [s]", "bar [s]", "million rows/s", "memory [MB]"]
    print(save("read_speed", "Reading logs", result, header, rows))


if __name__ == "__main__":
    main()
