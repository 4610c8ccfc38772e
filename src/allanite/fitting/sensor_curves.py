# SPDX-License-Identifier: BSD-3-Clause
"""Curves of a sensor without its instrument, as `allanite.fitting.instrument_floor` makes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan import AllanCurve
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.csv_cells import heading_cell

__all__ = ["OverFloor"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class OverFloor:
    """Curves of a sensor without its instrument.

    Attributes
    ----------
    measured, floor : AllanCurve
        Of sensor and instrument together, and of the instrument alone, at the same lags.
    deviation : ndarray, shape (n_lags, n_channels) [SI unit of the rate or acceleration]
        NaN where the sensor is not resolved, or the floor is not known.
    lower, upper : ndarray, shape (n_lags, n_channels)
        Interval; where the sensor is not resolved 0 and an upper limit.
    """

    measured: AllanCurve
    floor: AllanCurve
    deviation: Array
    lower: Array
    upper: Array

    @property
    def tau(self) -> Array:
        """Averaging times [s], shape (n_lags,)."""
        return self.measured.tau

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return self.measured.names

    @property
    def resolved(self) -> NDArray[np.bool_]:
        """Lags at which the sensor stands out from its instrument, shape (n_lags, n_channels)."""
        return np.isfinite(self.deviation)

    def share(self) -> Array:
        """Of the measured variance, the instrument's, shape (n_lags, n_channels)."""
        return self.floor.variance / self.measured.variance

    def to_json(self, name: str) -> dict[str, Any]:
        """Plain data of one channel; numbers that do not exist are null."""
        i = self.names.index(name)
        columns = {
            k: [float(x) if np.isfinite(x) else None for x in getattr(self, k)[:, i]]
            for k in ("deviation", "lower", "upper")
        }
        return {"tau": self.tau.tolist(), **columns}

    def to_csv(self, path: str | Path, *, force: bool = False) -> Path:
        """Write measured, instrument and sensor. It is for people: a fit takes the two logs (``fit --floor``).

        Raises
        ------
        StorageError
            The file exists and `force` is not set.
        """
        parts = ("measured", "instrument", "sensor", "lower", "upper")
        lines = [
            "# format: allanite-over-floor 1",
            f"# confidence: {self.measured.confidence:g}",
            "# units: tau in s, deviations in SI (or the channel's own unit where it has none)",
            "# sensor: empty where the noise of the instrument hides it; upper is then a limit",
            ",".join(["m", "tau", *(heading_cell(f"{n}.{p}") for n in self.names for p in parts)]),
        ]
        for j, m in enumerate(self.measured.lags):
            row = [str(int(m)), repr(float(self.tau[j]))]
            for i in range(len(self.names)):
                cells = (
                    self.measured.deviation,
                    self.floor.deviation,
                    self.deviation,
                    self.lower,
                    self.upper,
                )
                row += [repr(float(c[j, i])) if np.isfinite(c[j, i]) else "" for c in cells]
            lines.append(",".join(row))
        with fresh(path, force=force) as place:
            place.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return Path(path)
