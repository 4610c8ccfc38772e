# Specification: CF Metadata Conventions 1.11, section 8.1 (packed data) and 2.5.1 (missing data).
# SPDX-License-Identifier: BSD-3-Clause
"""Values that are stored as integers: value = stored scale_factor + add_offset, as netCDF and xarray write them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["Packing", "packing_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Packing:
    """How stored numbers become values.

    Attributes
    ----------
    scale, offset : float
    missing : tuple of float
        Stored numbers that mean no value.
    """

    scale: float
    offset: float
    missing: tuple[float, ...]

    def unpacked(self, stored: NDArray[Any]) -> NDArray[np.float64]:
        """The values, shape of `stored`; NaN where there is none."""
        values: NDArray[np.float64] = stored.astype(np.float64)
        without = np.isin(values, self.missing) if self.missing else None
        values *= self.scale
        values += self.offset
        if without is not None:
            values[without] = np.nan
        return values


def packing_of(dataset: Any) -> Packing | None:
    """The packing that the attributes of a dataset state; None where they state none."""
    scale, offset = (_numbers(dataset.attrs.get(key)) for key in ("scale_factor", "add_offset"))
    if len(scale) != 1 and len(offset) != 1:
        return None
    missing = [n for key in ("_FillValue", "missing_value") for n in _numbers(dataset.attrs.get(key))]
    return Packing(
        scale=scale[0] if len(scale) == 1 else 1.0,
        offset=offset[0] if len(offset) == 1 else 0.0,
        missing=tuple(missing),
    )


def _numbers(value: Any) -> list[float]:
    array = np.asarray(value)
    return [float(n) for n in array.reshape(-1)] if array.dtype.kind in "iuf" else []
