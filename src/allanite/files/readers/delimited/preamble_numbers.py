# SPDX-License-Identifier: BSD-3-Clause
"""Numbers in the lines before a table, where a point or a comma may separate thousands."""

from __future__ import annotations

import re
from typing import Final

from allanite.files.readers.stated_rate import FASTEST_SENSOR
from allanite.lazy_dataclasses import dataclass

__all__ = ["NUMBER", "NumberReadings", "number_readings"]

_BLANK = "[ \u00a0\u202f\u2009]"
#: A number that is not the beginning of a date or a time of day; blanks separate thousands before a unit only.
NUMBER: Final = (
    rf"(?P<value>[1-9]\d{{0,2}}(?:{_BLANK}\d{{3}}(?!\d))+(?:[.,]\d+)?(?=\s*[a-zµμ])"
    r"|[+-]?\d+(?:[.,'’]\d+)*(?:e[+-]?\d+)?"
    rf"(?!\d|[.,'’]\d|\s?[:/-]\s?\d|e[+-]?\d|{_BLANK}\d{{3}}(?!\d)))"
)
_THOUSANDS = re.compile(r"\d{1,3}(?:[ '’]\d{3})+(?:[.,]\d+)?")
_NAMES: Final = {",": "comma", ".": "point"}


@dataclass(frozen=True, slots=True)
class NumberReadings:
    """What a number may be: one value, two where its sign is ambiguous, none where it is no number."""

    values: tuple[float, ...]
    remark: str = ""


def number_readings(match: re.Match[str], decimal: str | None) -> NumberReadings:
    """The values of a number in a line.

    Parameters
    ----------
    match : re.Match
        Of a pattern that contains NUMBER, with what stands before it as the group "gap".
    decimal : str or None
        Decimal sign of the table, where its numbers show it.
    """
    text = re.sub(_BLANK, " ", match["value"]).replace("’", "'").lower()
    in_a_row = match["gap"].strip(" \t").endswith(",")  # a comma is the end of a cell, too
    if _THOUSANDS.fullmatch(text):
        return NumberReadings((float(re.sub(r"[ ']", "", text).replace(",", ".")),))
    mantissa, _, exponent = text.partition("e")
    power = f"e{exponent}" if exponent else ""
    signs = [sign for sign in mantissa if sign in ".,"]
    if "'" in mantissa or " " in mantissa:
        return NumberReadings(())
    if len(signs) == 1:
        return _of_one_sign(mantissa, signs[0], power, decimal, in_a_row)
    last = signs[-1] if len(set(signs)) == 2 and signs.count(signs[-1]) == 1 else ""
    whole, _, fraction = mantissa.partition(last) if last else (mantissa, "", "")
    if signs and not re.fullmatch(r"[+-]?\d{1,3}(?:[.,]\d{3})+", whole):
        return NumberReadings(())
    return NumberReadings((float(f"{re.sub('[.,]', '', whole)}.{fraction or 0}{power}"),))


def _of_one_sign(mantissa: str, sign: str, power: str, decimal: str | None, in_a_row: bool) -> NumberReadings:
    """A comma or a point before three digits separates thousands or a fraction; before others, a fraction."""
    fraction = float(mantissa.replace(",", ".") + power)
    if power or not re.fullmatch(r"[1-9]\d{0,2}[.,]\d{3}", mantissa):
        return NumberReadings((fraction,))
    thousands = float(mantissa.replace(sign, ""))
    if sign == decimal or (sign == "." and decimal is None and thousands > FASTEST_SENSOR):
        return NumberReadings((fraction,))
    if decimal is None or thousands > FASTEST_SENSOR or (in_a_row and sign == ","):
        return NumberReadings((fraction, thousands))
    return NumberReadings(
        (thousands,),
        f"{mantissa} before the table is read as {thousands:g}: the decimal sign of the table is a {_NAMES[decimal]}",
    )
