# SPDX-License-Identifier: BSD-3-Clause
"""Logs that are one JSON document: every shape gives the samples that were written, or a refusal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import AllaniteError, FormatError, LimitError
from allanite.files.readers import read

CASES = 100  # a fault of 2.3 % of them is found with 90 %


def shaped(shape: str, columns: dict[str, list[Any]]) -> Any:
    """Columns as programs write them."""
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    if shape == "split":
        return {"columns": list(columns), "data": [list(row.values()) for row in rows]}
    if shape == "index":
        return {name: {str(k): v for k, v in enumerate(values)} for name, values in columns.items()}
    return {
        "records": rows,
        "columns": columns,
        "inside": {"meta": {"device": "an IMU"}, "samples": rows},
        "inside columns": {"version": 2, "log": columns},
    }[shape]


@pytest.mark.long
@pytest.mark.parametrize("block", range(4))
def test_samples_of_a_document_are_those_that_were_written(tmp_path: Path, block: int) -> None:
    for seed in range(block, CASES, 4):
        rng = np.random.default_rng([20261126, seed])
        n = int(rng.integers(8, 200))
        rate = float(rng.choice([1.0, 25.0, 100.0, 400.0]))
        kept = np.sort(rng.choice(n, size=n - int(rng.integers(0, n // 8 + 1)), replace=False))
        kept = np.unique(np.concatenate(([0, 1, 2, n - 1], kept)))
        values = np.round(rng.normal(size=(len(kept), 2)), 5)
        columns = {
            "time_s": (kept / rate).tolist(),
            "gyro_x_dps": values[:, 0].tolist(),
            "gyro_y_dps": values[:, 1].tolist(),
        }
        shape = str(rng.choice(["records", "columns", "split", "index", "inside", "inside columns"]))
        path = tmp_path / "log.json"
        indent = None if rng.random() < 0.5 else int(rng.integers(0, 3))
        path.write_text(json.dumps(shaped(shape, columns), indent=indent))
        got = read(path)
        prefix = "log_" if shape == "inside columns" else ""
        assert got.names == (f"{prefix}gyro_x", f"{prefix}gyro_y"), (seed, shape)
        assert (got.rate, got.n_samples) == (pytest.approx(rate, rel=1e-9), n), (seed, shape)
        assert {c.unit for c in got.channels} == {"deg/s"}, (seed, shape)
        whole = np.full((n, 2), np.nan)
        whole[kept] = values
        read_back = np.column_stack([got.values(name) for name in got.names])
        np.testing.assert_allclose(read_back, whole, rtol=1e-12, err_msg=f"{seed} {shape}")


def test_several_values_under_one_name_and_a_rate_beside_them(tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    values = np.random.default_rng(1).normal(size=(50, 3)).tolist()
    path.write_text(json.dumps({"fs": 100, "payload": {"values": [{"gyro": row} for row in values]}}))
    recording = read(path)
    assert (recording.rate, recording.names) == (100.0, ("gyro_x", "gyro_y", "gyro_z"))


@pytest.mark.parametrize(
    ("text", "error", "match"),
    [
        ('{"name": "a setting", "list": [1, 2]}', FormatError, "not a log of samples"),
        ('[{"t": 0.0, "g": 1.5}, {"t": 0.1, "g": 1.', FormatError, "damaged JSON"),
        ("[" * 100_000, FormatError, "damaged JSON"),
        ("[" + "{}," * 1_000_001 + "{}]", LimitError, "objects and lists"),
        ('{"a": [' + "1," * 9_000_000 + "1]}", LimitError, "one JSON document of 17 MiB"),
        ("[[1, 2], [3, 4]]", FormatError, "not a log of samples"),
    ],
    ids=["settings", "cut", "deep", "many", "large", "numbers alone"],
)
def test_other_documents_are_refused(
    tmp_path: Path, text: str, error: type[AllaniteError], match: str
) -> None:
    path = tmp_path / "log.json"
    path.write_text(text)
    with pytest.raises(error, match=match):
        read(path)


@pytest.mark.long
def test_lines_of_one_object_each_may_be_long(tmp_path: Path) -> None:
    """Longer than what a format is told from."""
    path = tmp_path / "log.json"
    lines = [{f"c{k}": k + row / 7 for k in range(600)} for row in range(20)]
    path.write_text("\n".join(map(json.dumps, lines)) + "\n")
    recording = read(path, rate=10.0)
    assert (recording.n_samples, len(recording.names)) == (20, 600)
