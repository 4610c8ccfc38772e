# SPDX-License-Identifier: BSD-3-Clause
"""Texts that loggers and instruments of other kinds write: every sample of them, at its place, under its name."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from numpy.typing import NDArray
from pyarrow import feather, parquet

from allanite.errors import FormatError
from allanite.files.readers import read
from allanite.recording.records import Recording

N = 300
RATE = 100.0
T = np.arange(N) / RATE


def drawn(seed: int, channels: int = 3) -> NDArray[np.float64]:
    return np.round(np.random.default_rng([71, seed]).normal(scale=0.1, size=(N, channels)), 5)


def written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def holds(record: Recording, values: NDArray[np.float64]) -> bool:
    read_values = np.stack([record.raw(name) for name in record.names], axis=1)
    return record.rate == pytest.approx(RATE) and np.array_equal(read_values, values)


@pytest.mark.parametrize("settings", range(7))
def test_settings_beside_the_first_rows_cost_no_sample(tmp_path: Path, settings: int) -> None:
    """An oscilloscope that names its settings in columns of their own, which are empty from there on."""
    names = [
        ("Record Length", "300", "Points"),
        ("Sample Interval", "0.01", "s"),
        ("Trigger Time", "0.0", "s"),
        ("", "", ""),
        ("Horizontal Offset", "-1.5", "s"),
        ("Yzero", "0", "V"),
    ][:settings]
    values = drawn(settings, 1)
    rows = [
        ",".join((*(names[i] if i < len(names) else ("", "", "")), f"{T[i]:.2f}", f"{values[i, 0]:.5f}"))
        for i in range(N)
    ]
    assert holds(read(written(tmp_path / "scope.csv", rows)), values)


@pytest.mark.long
@pytest.mark.parametrize("names", [("0", "1", "2"), ("3V3", "5V", "12V"), ("1st", "2nd", "3rd")])
@pytest.mark.parametrize(("mark", "end"), [(": ", ", "), (" = ", ";"), ("=", " "), (": ", "\t")])
def test_labels_may_begin_with_a_digit(tmp_path: Path, names: tuple[str, ...], mark: str, end: str) -> None:
    values = drawn(3)
    lines = [end.join(f"{n}{mark}{v:.5f}" for n, v in zip(names, row, strict=True)) for row in values]
    assert holds(read(written(tmp_path / "log.txt", lines), rate=RATE), values)


@pytest.mark.parametrize("tags", ["", ",host=a", ",site=lab-2,unit=12"])
def test_line_protocol_of_time_series(tmp_path: Path, tags: str) -> None:
    values = drawn(4)
    lines = [
        f"imu{tags} gx={x:.5f},gy={y:.5f},gz={z:.5f} {1_700_000_000_000_000_000 + i * 10_000_000}"
        for i, (x, y, z) in enumerate(values)
    ]
    record = read(written(tmp_path / "export.lp", lines))
    assert holds(record, values)
    assert record.names == ("gx", "gy", "gz")


@pytest.mark.parametrize("stacked", [True, False])
def test_one_value_a_row_is_read_by_kind(tmp_path: Path, stacked: bool) -> None:
    """Tables that hold the name of the signal in a column, one signal behind the other or in turn."""
    values = drawn(5)
    rows = [
        (i, k, f"{T[i]:.3f},{values[i, k]:.5f},{name}")
        for i in range(N)
        for k, name in enumerate(("gx", "gy", "gz"))
    ]
    rows = sorted(rows, key=lambda row: row[1]) if stacked else rows
    path = written(tmp_path / "long.csv", ["time,value,field", *(text for _, _, text in rows)])
    for k, name in enumerate(("gx", "gy", "gz")):
        assert holds(read(path, variable=name), values[:, k : k + 1])


@pytest.mark.parametrize(("heading", "unit"), [("Volt", "V"), ("dps", "deg/s"), ("m_s2", "m/s²")])
def test_a_heading_may_be_a_unit_alone(tmp_path: Path, heading: str, unit: str) -> None:
    values = drawn(6, 1)
    rows = [f"{t:.2f},{v:.5f}" for t, v in zip(T, values[:, 0], strict=True)]
    record = read(written(tmp_path / "meter.csv", [f"second,{heading}", *rows]))
    assert holds(record, values)
    assert record.channels[0].unit == unit


def test_frames_of_a_bus_are_read_the_way_the_refusal_says(tmp_path: Path) -> None:
    counts = np.random.default_rng(72).integers(-900, 900, size=(N, 3)).astype("<i2")
    lines = [
        f"({1.7e9 + t:.6f}) can0 {'320' if k else '110'}#{row.tobytes().hex().upper()}"
        for t, row in zip(T, counts, strict=True)
        for k in (0, 1)
    ]
    path = written(tmp_path / "candump.log", lines)
    with pytest.raises(FormatError) as refusal:
        read(path)
    command = re.search(r"in its folder: (sed .*? >frames\.txt)", str(refusal.value))
    assert command is not None
    subprocess.run(command[1].replace("110#", "320#"), shell=True, check=True, cwd=tmp_path)
    layout = {
        "lines": {"time": {"column": 0, "unit": "s"}},
        "frame": {"endian": "little", "fields": [{"name": axis, "type": "i16"} for axis in "xyz"]},
    }
    record = read(tmp_path / "frames.txt", layout=layout)
    assert record.rate == pytest.approx(RATE)
    np.testing.assert_array_equal(np.stack([record.raw(n) for n in record.names], axis=1), counts)


@pytest.mark.parametrize("form", ["matrix", "named matrix", "by row", "by time"])
def test_documents_of_rows(tmp_path: Path, form: str) -> None:
    values = drawn(7)
    document: Any = {"rate": RATE, "unit": "deg/s", "samples": values.tolist()}
    if form == "matrix":
        document = [[t, *row] for t, row in zip(T, values.tolist(), strict=True)]
    elif form.startswith("by"):
        keys = [str(k if form == "by row" else 1_700_000_000_000 + 10 * k) for k in range(N)]
        document = {
            k: dict(zip("xyz", row, strict=True)) for k, row in zip(keys, values.tolist(), strict=True)
        }
    path = tmp_path / "log.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    assert holds(read(path, **({"rate": RATE} if form == "by row" else {})), values)


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("kind", [pa.float32(), pa.float64(), pa.int32()])
@pytest.mark.parametrize("end", ["parquet", "arrow", "feather"])
def test_vectors_and_structures_in_columns(tmp_path: Path, fixed: bool, kind: pa.DataType, end: str) -> None:
    values = np.random.default_rng(8).integers(-900, 900, size=(N, 6))
    rows = pa.array(values[:, :3].tolist(), pa.list_(kind, 3) if fixed else pa.list_(kind))
    members = pa.StructArray.from_arrays([pa.array(c, kind) for c in values[:, 3:].T], names=["x", "y", "z"])
    table = pa.table({"t": T, "gyro": rows, "imu": pa.StructArray.from_arrays([members], names=["acc"])})
    path = tmp_path / f"log.{end}"
    if end == "parquet":
        parquet.write_table(table, path, row_group_size=70)
    else:
        feather.write_feather(table, path, compression="uncompressed", version=2)
    record = read(path)
    assert record.names == ("gyro_x", "gyro_y", "gyro_z", "imu_acc_x", "imu_acc_y", "imu_acc_z")
    assert holds(record, values)


def test_lists_of_different_lengths_are_refused(tmp_path: Path) -> None:
    rows = [[1.0, 2.0, 3.0]] * 50 + [[1.0, 2.0]] * 50
    path = tmp_path / "log.parquet"
    parquet.write_table(pa.table({"t": T[:100], "gyro": rows}), path, row_group_size=40)
    with pytest.raises(FormatError, match="gyro: lists of different lengths in row group 1"):
        read(path).raw("gyro_x")
