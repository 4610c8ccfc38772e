# SPDX-License-Identifier: BSD-3-Clause
"""The simulated records that benchmarks read, from fixed seeds.

    python -m benchmarks.records FOLDER NAME...

Each file is written by a process of its own, so that the one that measures stays small. The sensor is the gyro of the
seed paper: N = 0.73 deg/√h, B = 15 deg/h, K = 15 deg/h/√h, sampled at 32 Hz.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from allanite import allan_curve, simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White

from .processes import spent

RATE, HOUR, WEEK = 32.0, 115_200, 19_353_600
N_ROWS = 20_000_000
WHITE, WALK, FLICKER = White(N=2.129e-4), RandomWalk(K=1.192e-6), Flicker(B=4.712e-5)
GYRO = NoiseModel.of(WHITE, FLICKER, WALK)
ACCELEROMETER = NoiseModel.of(White(N=1e-3), Flicker(B=2e-4), RandomWalk(K=1e-5), kind="acceleration")
Array = NDArray[np.float64]


def samples(n: int, seed: int, model: NoiseModel = GYRO) -> Array:
    record = simulate(model, rate=RATE, duration=n / RATE, seed=seed)
    return np.asarray(record.values(record.names[0]))


def _table(columns: Mapping[str, Array], rate: float = RATE) -> pa.Table:
    n = len(next(iter(columns.values())))
    return pa.table({"t [s]": np.arange(n) / rate, **columns})


def _hour_csv(path: Path) -> None:
    pa.csv.write_csv(_table({"gyro [deg/s]": np.rad2deg(samples(HOUR, 1))}), path)


def _week_npy(path: Path) -> None:
    np.save(path, samples(WEEK, 1))


def _week_parquet(path: Path) -> None:
    pq.write_table(_table({"gyro [rad/s]": samples(WEEK, 1)}), path, row_group_size=1 << 20)


def _week_csv(path: Path) -> None:
    pa.csv.write_csv(_table({"gyro [rad/s]": samples(WEEK, 1)}), path)


def _six_axes(path: Path) -> None:
    of = {f"gyro_{axis} [rad/s]": samples(WEEK, i, GYRO) for i, axis in enumerate("xyz")}
    of |= {f"acc_{axis} [m/s^2]": samples(WEEK, 3 + i, ACCELEROMETER) for i, axis in enumerate("xyz")}
    pq.write_table(_table(of), path, row_group_size=1 << 20)


def _hours(folder: Path) -> None:
    folder.mkdir()
    for i in range(20):
        np.save(folder / f"{i:03d}.npy", samples(HOUR, 100 + i))


def _curves(folder: Path) -> None:
    folder.mkdir()
    for i in range(200):
        record = simulate(GYRO, rate=RATE, duration=HOUR / RATE, seed=100 + i)
        allan_curve(record).to_csv(folder / f"{i:03d}.csv")


def _rows() -> pa.Table:
    return _table({"rate (deg/s)": np.random.default_rng(2).normal(size=N_ROWS) * 0.01}, rate=200.0)


def _rows_csv(path: Path) -> None:
    pa.csv.write_csv(_rows(), path)


def _rows_parquet(path: Path) -> None:
    pq.write_table(_rows(), path, compression="zstd")


def _study(path: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "hour.csv", Path(folder) / "out"
        _hour_csv(log)
        spent([sys.executable, "-m", "allanite", "characterize", str(log), "--out", str(out)])
        path.write_bytes((out / "study.json").read_bytes())


RECORDS: Mapping[str, Callable[[Path], None]] = {
    "hour.csv": _hour_csv,
    "week.npy": _week_npy,
    "week.parquet": _week_parquet,
    "week.csv": _week_csv,
    "six.parquet": _six_axes,
    "hours": _hours,
    "curves": _curves,
    "rows.csv": _rows_csv,
    "rows.parquet": _rows_parquet,
    "study.json": _study,
}


# ---- records of any length, of float32 ------------------------------------------------------------------------------


def _columns(path: Path, n: int, channels: int) -> None:
    """Channels of a NumPy file: one record, of which each channel begins at another place."""
    first, table = samples(n, 1), np.lib.format.open_memmap(path, "w+", np.float32, (n, channels))
    for i in range(channels):
        table[:, i] = np.roll(first, i * n // channels)


def _units(folder: Path, n: int, units: int) -> None:
    """One NumPy file for each of several sensors of one type."""
    folder.mkdir()
    for i in range(units):
        np.save(folder / f"{i:03d}.npy", samples(n, 100 + i).astype(np.float32))


def _thermometer(path: Path, n: int) -> None:
    temperature = 25 + 5 * np.sin(2 * np.pi * 3 * np.arange(n) / n)
    _float32(path, {"gyro [rad/s]": samples(n, 1) + 1e-5 * temperature, "temp [degC]": temperature})


def _rest(path: Path, n: int) -> None:
    """Six axes at rest, level, at 48.1 deg north, without bias."""
    rates = {"x": 4.87e-5, "y": 0.0, "z": 5.43e-5}
    columns = {f"gyro_{a} [rad/s]": samples(n, i) + rate for i, (a, rate) in enumerate(rates.items())}
    for i, axis in enumerate("xyz"):
        columns[f"acc_{axis} [m/s^2]"] = samples(n, 3 + i, ACCELEROMETER) + 9.81 * (axis == "z")
    _float32(path, columns)


def _float32(path: Path, columns: Mapping[str, Array]) -> None:
    table = pa.table({name: values.astype(np.float32) for name, values in columns.items()})
    pq.write_table(table, path, row_group_size=1 << 20)


SIZED: Mapping[str, Callable[..., None]] = {
    "columns": _columns,
    "units": _units,
    "thermometer": _thermometer,
    "rest": _rest,
}


def write(path: Path) -> None:
    """Write a record by its name; columns-1000-3.npy has 1000 samples of three channels."""
    kind, *sizes = path.stem.split("-")
    if kind in SIZED:
        SIZED[kind](path, *map(int, sizes))
    else:
        RECORDS[path.name](path)


if __name__ == "__main__":
    for name in sys.argv[2:]:
        write(Path(sys.argv[1], name))
