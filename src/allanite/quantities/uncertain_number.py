# SPDX-License-Identifier: BSD-3-Clause
"""Numbers with their standard uncertainty as people write them: 24.0(2), 24.0(0.2), 24.0 ± 0.2, 24.0 ± 0.8 %.

The forms are those of the GUM (JCGM 100:2008, 7.2.2, forms 2 to 4): digits in parentheses count in the last places of
the number; with a point they are a number of their own. What stands behind ± is taken as the standard uncertainty too,
although the GUM would rather keep that sign for a wider interval.
"""

from __future__ import annotations

import math
import re
from typing import Final

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

__all__ = ["UncertainNumber", "parse_leading_number"]

_PLAIN: Final = r"(?:\d+\.?\d*|\.\d+)"
_EXPONENT: Final = r"(?:[eE][+-]?\d+)"
_NUMBER: Final = re.compile(
    rf"\s*(?P<open>\()?\s*(?P<mantissa>[+-]?{_PLAIN})(?:\((?P<digits>{_PLAIN})\))?(?P<exponent>{_EXPONENT})?"
    rf"(?:\s*(?:±|\+/-|\+-)\s*(?P<sd>{_PLAIN}{_EXPONENT}?)\s*(?P<percent>%)?)?"
    r"\s*(?(open)\)\s*)[*·]?\s*(?P<rest>.*)",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class UncertainNumber:
    """A number.

    Attributes
    ----------
    value : float
    sd : float or None
        Standard uncertainty; None where none is stated.
    """

    value: float
    sd: float | None = None


def parse_leading_number(text: str) -> tuple[UncertainNumber, str] | None:
    """The number at the beginning of a text, and what follows it; None where there is none.

    Raises
    ------
    InputError
        Two uncertainties for one number, or one that is not positive.

    Examples
    --------
    >>> parse_leading_number("24.0(2) mV/(deg/s)")
    (UncertainNumber(value=24.0, sd=0.2), 'mV/(deg/s)')
    >>> parse_leading_number("(24.0 ± 0.5 %) mV/(deg/s)")
    (UncertainNumber(value=24.0, sd=0.12), 'mV/(deg/s)')
    """
    match = _NUMBER.fullmatch(text)
    if match is None:
        return None
    exponent = match["exponent"] or ""
    value = float(match["mantissa"] + exponent)
    if match["digits"] and match["sd"]:
        raise InputError(
            f"{text.strip()!r} states two uncertainties: write one of them, 24.0(2) or 24.0 ± 0.2"
        )
    sd = None
    if match["digits"]:
        sd = _of_digits(match["mantissa"], match["digits"]) * float("1" + exponent)
    elif match["sd"]:
        sd = float(match["sd"]) * (abs(value) / 100 if match["percent"] else 1.0)
    if sd is not None and not (math.isfinite(sd) and sd > 0):
        raise InputError(
            f"{text.strip()!r}: a standard uncertainty is a positive number; leave it out if it is unknown"
        )
    return UncertainNumber(value, sd), match["rest"].strip()


def _of_digits(mantissa: str, digits: str) -> float:
    """Digits in parentheses count in the last places; with a point they are the uncertainty itself."""
    if "." in digits:
        return float(digits)
    places = len(mantissa.partition(".")[2])
    return float(f"{digits}e-{places}")
