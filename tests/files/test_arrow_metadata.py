# SPDX-License-Identifier: BSD-3-Clause
"""What the metadata of the fields of Parquet, Arrow and Feather files say of units and scalings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al

pa = pytest.importorskip("pyarrow")

COUNTS = np.random.default_rng(5).integers(-2000, 2000, 500).astype(np.int16)
FORMS = ["parquet", "feather", "arrow"]


def written(folder: Path, form: str, metadata: dict[str, str], data: Any = COUNTS) -> Path:
    field = pa.field("gyro_x", pa.from_numpy_dtype(data.dtype), metadata=metadata)
    table = pa.table([pa.array(data)], schema=pa.schema([field], metadata={"rate": "100"}))
    path = folder / f"log.{form}"
    if form == "parquet":
        import pyarrow.parquet

        pyarrow.parquet.write_table(table, path)
    elif form == "feather":
        import pyarrow.feather

        pyarrow.feather.write_feather(table, path)
    else:
        with pa.ipc.new_stream(path, table.schema) as stream:
            stream.write_table(table)
    return path


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("key", "value", "counts"), [("scale_factor", "0.004", 250), ("Gain", "0.004", 250), ("LSB", "131", 131)]
)
def test_an_unapplied_scaling_leaves_counts_and_its_advice_scales_them(
    tmp_path: Path, form: str, key: str, value: str, counts: float
) -> None:
    path = written(tmp_path, form, {"units": "deg/s", key: value})
    recording = al.read(path)
    assert recording.channels[0].unit == "LSB"
    (said,) = recording.notes["source"]["guesses"]
    factor = said.partition('--scale-factor "')[2].rstrip('"')
    assert factor == f"{counts:g} LSB/(deg/s)"
    scaled = al.read(path, scale_factor=factor)
    assert np.allclose(scaled.scaled("gyro_x"), np.radians(COUNTS / counts))


@pytest.mark.parametrize(
    ("metadata", "data"),
    [({"scale": "1"}, COUNTS), ({"scale": "0.1"}, COUNTS * 0.1), ({"scale": "see the data sheet"}, COUNTS)],
)
@pytest.mark.parametrize("unit_key", ["unit", "Units"])
def test_a_scaling_that_changes_nothing_is_not_mentioned(
    tmp_path: Path, metadata: dict[str, str], data: Any, unit_key: str
) -> None:
    recording = al.read(written(tmp_path, "parquet", {unit_key: "deg/s", **metadata}, data))
    assert recording.channels[0].unit == "deg/s"
    assert recording.notes["source"]["guesses"] == []
