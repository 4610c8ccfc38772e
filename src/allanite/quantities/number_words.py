# SPDX-License-Identifier: BSD-3-Clause
"""Numbers with the digits their interval allows, probabilities and time spans as people write them."""

from __future__ import annotations

import math

from allanite.lazy_dataclasses import dataclass

__all__ = ["duration", "interval", "number", "probability", "upper_limit", "with_parentheses", "with_sd"]


_WIDE = 30.0


def number(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits; an exponent only where zeros would hide the digits.

    >>> number(0.01234), number(1.234e-7), number(86400.0), number(None)
    ('0.0123', '1.23e-07', '86400', '–')
    """
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    return _NumberLayout.of(abs(value), digits).write(value)


def upper_limit(value: float) -> str:
    """An upper limit, to two digits: what it is the limit of is not known to more.

    >>> upper_limit(116048.0), upper_limit(0.3594), upper_limit(63.25)
    ('< 120000', '< 0.36', '< 63')
    """
    return f"< {number(float(f'{value:.1e}'), 2)}"


def interval(value: float, lower: float | None, upper: float | None) -> tuple[str, str, str]:
    """A value and the ends of its interval, all to the same decimal: the second digit of the half width.

    Over a factor of 30 and more, each has two digits of its own: the decimal of the upper end leaves 0 of the lower.

    >>> interval(0.30012, 0.2994, 0.3009), interval(0.002, 3.1e-6, 0.81)
    (('0.30012', '0.29940', '0.30090'), ('0.0020', '3.1e-06', '0.81'))
    >>> interval(7e-05, -25e-05, 40e-05)
    ('0.7e-04', '-2.5e-04', '4.0e-04')
    """
    if lower and upper and math.isfinite(upper) and 0 < _WIDE * lower < upper and value > 0:
        return number(value, 2), number(lower, 2), number(upper, 2)
    ends = [e for e in (lower, upper) if e is not None and math.isfinite(e)]
    size = max((abs(v) for v in (value, *ends)), default=0.0)
    width = max((abs(e - value) for e in ends), default=0.0)
    digits = (
        3
        if not (width > 0 and size > 0)
        else 2 + math.floor(math.log10(size)) - math.floor(math.log10(width))
    )
    layout = _NumberLayout.of(size, min(max(digits, 2), 7))
    low, high = (layout.write(e) if e is not None and math.isfinite(e) else number(e) for e in (lower, upper))
    return layout.write(value), low, high


def with_sd(value: float | None, sd: float | None, unit: str, factor: float = 1.0) -> str:
    """A value with its standard deviation, both to the second digit of that.

    >>> with_sd(-19.8634, 8.0412, "deg/h"), with_sd(1.25, None, "deg/h")
    ('-19.9 ± 8.0 deg/h (1 sd)', 'not determined')
    """
    if value is None or sd is None or not (math.isfinite(value) and math.isfinite(sd)):
        return "not determined"
    middle, _, _ = interval(value / factor, (value - sd) / factor, (value + sd) / factor)
    return f"{middle} ± {number(sd / factor, 2)} {unit} (1 sd)"


def with_parentheses(value: float, sd: float) -> str:
    """A value with its standard uncertainty in units of the last digits, as the GUM writes it (7.2.2).

    >>> with_parentheses(31.9999043, 0.0000132), with_parentheses(24.0, 0.2), with_parentheses(1520.0, 130.0)
    ('31.999904(13)', '24.00(20)', '1520(130)')
    """
    if not (math.isfinite(sd) and sd > 1e-12 * abs(value)):  # below what the value itself is held to
        return number(value, 9)
    power = _power(sd, 2)
    decimals = max(1 - power, 0)
    size = 10.0 ** max(power - 1, 0)
    shown = round(value / size) * size if size > 1 else value
    return f"{shown:.{decimals}f}({round(sd * 10.0**decimals / size) * size:.0f})"


@dataclass(frozen=True, slots=True)
class _NumberLayout:
    """Decimals and, where one is needed, the power of ten before which they stand."""

    decimals: int
    power: int | None

    @classmethod
    def of(cls, size: float, digits: int) -> _NumberLayout:
        """So many significant digits of `size`; an exponent that leaves it one digit before the point."""
        if size == 0.0:
            return cls(0, None)
        power = _power(size, digits)
        if -3 <= power < 6:
            return cls(max(digits - 1 - power, 0), None)
        return cls(digits - 1, power)

    def write(self, value: float) -> str:
        if self.power is None:
            return f"{value:z.{self.decimals}f}"  # z: no minus zero
        return f"{value / 10.0**self.power:z.{self.decimals}f}e{self.power:+03d}"


def _power(size: float, digits: int) -> int:
    """Power of ten of a number as it will be printed: 9.996 to three digits is 10.0."""
    return math.floor(math.log10(float(f"{size:.{digits - 1}e}")))


def probability(p: float | None) -> str:
    """The p value of a test.

    >>> probability(0.0004), probability(0.583)
    ('p < 0.001', 'p = 0.58')
    """
    if p is None or math.isnan(p):
        return "p unknown"
    return "p < 0.001" if p < 0.001 else f"p = {number(p, 2)}"


def duration(seconds: float) -> str:
    """A time span in the largest unit that leaves a number people can picture.

    >>> duration(604800.0), duration(5400.0), duration(0.032)
    ('7 d', '1.5 h', '0.032 s')
    """
    for unit, size, least in (("d", 86400.0, 2.0), ("h", 3600.0, 1.0), ("min", 60.0, 2.0)):
        if seconds >= least * size:
            return f"{float(f'{seconds / size:.3g}'):g} {unit}"
    return f"{float(f'{seconds:.3g}'):g} s"
