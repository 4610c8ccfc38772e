# SPDX-License-Identifier: BSD-3-Clause
"""The table of a fleet that nobody recorded: coefficients drawn from a known population."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

from allanite.stability.fleet.levels import LEVELS

__all__ = ["fleet_table"]

MIDDLE = 1e-4


def fleet_table(
    *, units: int = 40, lots: int = 4, repeats: int = 1, spread: float = 0.1, factors: dict[str, float] | None = None,
    symbols: tuple[str, ...] = ("N", "B"), sd: float = 0.03, seed: int = 7, **columns: Any,
) -> pa.Table:  # fmt: skip
    """Units u00, u01, ... with normal profiles about MIDDLE; `factors` multiplies the coefficients of some of them."""
    rng = np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    for symbol in symbols:
        for u in range(units):
            true = np.log(MIDDLE * (factors or {}).get(f"u{u:02}", 1.0)) + spread * rng.standard_normal()
            for r in range(repeats):
                best = true + sd * rng.standard_normal()
                rows.append(
                    {
                        "log": f"u{u:02}_{r}.csv", "unit": f"u{u:02}", "lot": f"lot{u * lots // units}",
                        "temperature": 20.0 + (u % 5), "channel": "gyro_x", "kind": "rate", "term": symbol,
                        "unit_of_measure": {"N": "rad/s/√Hz", "K": "rad/s/√s"}.get(symbol, "rad/s"),
                        "profile": (best + sd * np.array(LEVELS)).astype(np.float32), "root_at_zero": -np.inf,
                        "status": "resolved", "estimate": float(np.exp(best)),
                        "lower": float(np.exp(best - 1.96 * sd)), "upper": float(np.exp(best + 1.96 * sd)), **columns,
                    }
                )  # fmt: skip
    types = {"profile": pa.list_(pa.float32(), 9), "root_at_zero": pa.float32()}
    return pa.table({name: pa.array([row[name] for row in rows], types.get(name)) for name in rows[0]})
