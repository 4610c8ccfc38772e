# Specification: CF Metadata Conventions 1.11, section 8.1 (packed data) and 2.5.1 (missing data).
# SPDX-License-Identifier: BSD-3-Clause
"""Values that are stored as integers: value = stored scale_factor + add_offset, as netCDF and xarray write them."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["COUNTS", "Packing", "is_offset", "packing_of", "said_of_unapplied", "unapplied_scaling"]

COUNTS: Final = "LSB"

_PACKING = ("scale_factor", "add_offset")
_MISSING = ("_FillValue", "missing_value")
#: Words by which loggers state a scaling in a way of their own: none says whether to multiply or to divide.
_SCALING = re.compile(
    r"scale|scaling|scale_?factor|gain|slope|lsb|resolution|sensitivity|multiplier|factor|offset|add_?offset|intercept"
    r"|(?:calibration|cal|conversion|conv)_?(?:factor|scale|gain|coeff?)",
    re.IGNORECASE,
)
_OFFSET = re.compile(r"offset|intercept", re.IGNORECASE)
_CHANGES_NOTHING = {True: 0.0, False: 1.0}  # of an offset, and of a factor


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
    """The packing that the attributes of a dataset state, numbers that mean no value included; None without any."""
    scale, offset = (_numbers(dataset.attrs.get(key)) for key in _PACKING)
    missing = [n for key in _MISSING for n in _numbers(dataset.attrs.get(key)) if not math.isnan(n)]
    if len(scale) != 1 and len(offset) != 1:
        # Whole numbers of 64 bits may be stamps, which float64 does not hold.
        whole = dataset.dtype.kind in "iu" and dataset.dtype.itemsize > 4
        if not missing or whole:
            return None
    return Packing(
        scale=scale[0] if len(scale) == 1 else 1.0,
        offset=offset[0] if len(offset) == 1 else 0.0,
        missing=tuple(missing),
    )


def unapplied_scaling(
    kind: np.dtype[Any], attributes: Mapping[str, Any], applied: Collection[str] = _PACKING
) -> dict[str, float]:
    """Attributes of integers that state a scaling in words of their own, which nobody applies."""
    if kind.kind not in "iu":
        return {}
    numbers = {str(key): _numbers(attributes.get(key)) for key in attributes if key not in applied}
    return {
        key: value[0]
        for key, value in numbers.items()
        if len(value) == 1 and _SCALING.fullmatch(key) and value[0] != _CHANGES_NOTHING[is_offset(key)]
    }


def is_offset(key: str) -> bool:
    return bool(_OFFSET.search(key))


def said_of_unapplied(
    name: str, unapplied: Mapping[str, float], unit: str, applied: str = "scale_factor and add_offset"
) -> str:
    """What is said of integers whose scaling is not applied; `unit` is the one that their counts do not have, or ""."""
    listed = " and ".join(f"{key} {value:g}" for key, value in unapplied.items())
    sentence = f"{name}: {listed} not applied (only {applied} are defined)"
    factors = [value for key, value in unapplied.items() if not is_offset(key)]
    if not unit:
        return sentence
    sentence += f": read as counts, not in {unit}"
    if len(factors) != 1 or factors[0] <= 0:
        return sentence
    counts = factors[0] if factors[0] > 1 else 1.0 / factors[0]
    return f'{sentence}; if {counts:.9g} counts are 1 {unit}, --scale-factor "{counts:.9g} LSB/({unit})"'


def _numbers(value: Any) -> list[float]:
    array = np.asarray(value)
    return [float(n) for n in array.reshape(-1)] if array.dtype.kind in "iuf" else []
