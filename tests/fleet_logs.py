# SPDX-License-Identifier: BSD-3-Clause
"""Short logs of a fleet, and its table in a form that is compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

PATTERN = "{lot}/{unit}_{date}_{temperature}C.csv"
SAMPLES = 1200


def write_log(path: Path, seed: int, samples: int = SAMPLES) -> Path:
    """White noise of two axes at 100 Hz, and a thermometer."""
    rng = np.random.default_rng(seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = np.column_stack(
        (np.arange(samples) / 100, rng.normal(size=(samples, 2)) * 0.01, 25 + 0.01 * rng.normal(size=samples))
    )
    head = "time [s],gyro_x [rad/s],gyro_y [rad/s],temp [°C]"
    np.savetxt(path, columns, fmt="%.8g", delimiter=",", header=head, comments="", encoding="utf-8")
    return path


def write_fleet(folder: Path, count: int) -> list[Path]:
    """Logs of two lots, at -20 °C and 40 °C."""
    return [
        write_log(folder / f"L{k % 2}" / f"u{k:03d}_2026-10-{k % 28 + 1:02d}_{(-20, 40)[k % 2]}C.csv", seed=k)
        for k in range(count)
    ]


def rows_without_times(table: Path | pa.Table) -> list[dict[str, Any]]:
    """Rows by log, channel and term, without the processor time."""
    whole = table if isinstance(table, pa.Table) else pq.read_table(table)
    rows = whole.drop_columns(["seconds"]).to_pylist()
    return sorted(rows, key=lambda row: (row["log"], row["channel"] or "", row["term"] or ""))


def column(table: Path, name: str, **where: object) -> list[Any]:
    """The values of a column in the rows that match."""
    rows: Sequence[dict[str, Any]] = pq.read_table(table).to_pylist()
    return [row[name] for row in rows if all(row[k] == v for k, v in where.items())]
