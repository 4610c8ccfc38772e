# SPDX-License-Identifier: BSD-3-Clause
"""A number of the field: its value, its interval, its unit, and what the record says of it."""

from __future__ import annotations

import math
from enum import StrEnum

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.number_words import duration, interval, number, upper_limit
from allanite.quantities.result import Result

__all__ = ["Quantity", "QuantityStatus", "interval_words"]


class QuantityStatus(StrEnum):
    """What the record says of a number."""

    RESOLVED = "resolved"
    UPPER_LIMIT = "upper limit"
    NOT_RESOLVED = "not resolved"
    GIVEN = "given"


def interval_words(value: float | None, lower: float, upper: float, factor: float = 1.0) -> str:
    """A number with its interval, an upper limit where there is no number, an en dash where there is neither.

    >>> interval_words(1.3304, 1.2801, 1.3822), interval_words(None, 0.0, 0.02), interval_words(None, 0.0, math.inf)
    ('1.330 [1.280, 1.382]', '< 0.020', '–')
    """
    if value is None or math.isnan(value):
        return upper_limit(upper / factor) if math.isfinite(upper) else "–"
    middle, low, high = interval(value / factor, lower / factor, upper / factor)
    return f"{middle} [{low}, {high}]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity(Result):
    """A number with its interval, unit and status.

    Attributes
    ----------
    value : float
        NaN where the record gives none.
    lower, upper : float
        Ends of the interval; NaN where the record sets none.
    unit : str
        SI unit; "1" for a ratio.
    status : QuantityStatus
        "resolved", "upper limit", "not resolved", or "given" by the user.
    """

    value: float
    lower: float
    upper: float
    unit: str
    status: QuantityStatus = QuantityStatus.RESOLVED

    @classmethod
    def of(cls, value: float, ends: tuple[float, float], unit: str) -> Quantity:
        """A number with its interval, not resolved where that has an infinite end."""
        if all(map(math.isfinite, ends)):
            return cls(value=value, lower=ends[0], upper=ends[1], unit=unit)
        return cls(value=value, lower=math.nan, upper=math.nan, unit=unit, status=QuantityStatus.NOT_RESOLVED)

    @property
    def resolved(self) -> bool:
        """The record gives the number and its interval."""
        return self.status is QuantityStatus.RESOLVED

    def shown(self, factor: float = 1.0) -> str:
        """In a unit of which one is `factor` in SI, without its name.

        >>> Quantity.of(0.0013304, (0.0012801, 0.0013822), "V").shown(1e-3)
        '1.330 [1.280, 1.382]'
        >>> limit = Quantity(value=math.nan, lower=0.0, upper=0.02, unit="V", status=QuantityStatus.UPPER_LIMIT)
        >>> limit.shown(1e-3), Quantity.of(math.nan, (0.0, math.inf), "V").shown()
        ('< 20', '–')
        """
        return interval_words(self.value, self.lower, self.upper, factor)

    def __str__(self) -> str:
        """With the digits that the interval allows.

        >>> print(Quantity.of(1.3304, (1.2801, 1.3822), "1"), Quantity.of(721.0, (716.0, 725.0), "s"), sep=" after ")
        1.330 [1.280, 1.382] after 12 min [11.9 min, 12.1 min]
        """
        if not self.resolved:
            return f"{number(self.value)} ({self.status})"
        if self.unit == "s":
            return f"{duration(self.value)} [{duration(self.lower)}, {duration(self.upper)}]"
        return self.shown() + ("" if self.unit == "1" else f" {self.unit}")
