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

__all__ = ["UNIT_KEYS", "Packing", "as_stored", "packing_of"]

UNIT_KEYS: Final = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")

_COUNTS: Final = "LSB"

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


def as_stored(
    name: str,
    kind: np.dtype[Any],
    attributes: Mapping[str, Any],
    unit: str,
    applied: Collection[str] = _PACKING,
) -> tuple[str, list[str]]:
    """Unit of values as they are read, and what is said of a scaling that nobody applies.

    Loggers state the scaling of integers in words of their own. Their unit is then that of scaled values, and the
    integers are counts.

    Parameters
    ----------
    unit : str
        The one that is stated, or "".
    applied : collection of str
        Attributes that were applied; with one of them the values are in the unit that is stated.
    """
    scaling = _unapplied(kind, attributes, applied)
    if not scaling:
        return unit, []
    factors = [value for key, value in scaling.items() if not _is_offset(key)]
    counts = bool(factors) and unit not in ("", _COUNTS) and not any(key in attributes for key in applied)
    note = _said_of(name, scaling, factors, unit if counts else "")
    return (_COUNTS if counts else unit), [note]


def _unapplied(
    kind: np.dtype[Any], attributes: Mapping[str, Any], applied: Collection[str]
) -> dict[str, float]:
    if kind.kind not in "iu":
        return {}
    numbers = {str(key): _numbers(attributes.get(key)) for key in attributes if key not in applied}
    return {
        key: value[0]
        for key, value in numbers.items()
        if len(value) == 1 and _SCALING.fullmatch(key) and value[0] != _CHANGES_NOTHING[_is_offset(key)]
    }


def _is_offset(key: str) -> bool:
    return bool(_OFFSET.search(key))


def _said_of(name: str, scaling: Mapping[str, float], factors: list[float], unit: str) -> str:
    """`unit` is the one that the counts do not have, or ""."""
    sentence = f"{name}: {' and '.join(f'{key} {value:g}' for key, value in scaling.items())} not applied"
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
