# SPDX-License-Identifier: BSD-3-Clause
"""Ticks of an axis: where they are, and what they say."""

from __future__ import annotations

import math

from allanite.lazy_dataclasses import dataclass
from allanite.views.figures.panel import Axis, decades
from allanite.views.wording.powers import raised

__all__ = ["APART", "Ticks", "ticks_of"]

APART = (44.0, 22.0)  # the least distance of two labels on paper [pt]: across, upwards

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_SMALLEST, _LARGEST = 1e-4, 1e5  # numbers that are written without a power of ten
_LEAST = 3.0  # points between the ticks of one decade, on average; closer ones would be a bar
#: Named digits of a decade: for fewer decades than so many, with the least distance of two of them in decades.
_NAMED = (
    (1.0, math.log10(10 / 9), tuple(range(1, 10))),
    (2.0, math.log10(2), (1, 2, 5)),
    (math.inf, math.inf, (1,)),
)
_CLOSE = 0.6  # of the least distance, that of two digits


@dataclass(frozen=True, slots=True)
class Ticks:
    """Ticks with their words, and those between them."""

    major: tuple[tuple[float, str], ...]
    minor: tuple[float, ...] = ()


def ticks_of(axis: Axis, limits: tuple[float, float], room: float, apart: float) -> Ticks:
    """Ticks of an axis; a part of a decade needs those of a linear one.

    Parameters
    ----------
    axis : Axis
    limits : (float, float)
        The ends of the axis.
    room, apart : float
        Length of the axis, and the least distance of two labels, in the same unit.
    """
    low, high = sorted(limits)
    if axis.names:
        return Ticks(tuple((at, name) for at, name in axis.names if low <= at <= high))
    made = _powers(low, high, room, apart) if axis.log and high >= 2 * low else Ticks(())
    return made if made.major else _numbers(low, high, max(1, int(room / apart)))


def _powers(low: float, high: float, room: float, apart: float) -> Ticks:
    span = decades((low, high))
    first, last = (math.floor(math.log10(low) - 1e-9), math.ceil(math.log10(high) + 1e-9))
    every = max(1, math.ceil(apart * span / room))
    named = next(digits for most, gap, digits in _NAMED if span < most and gap * room > _CLOSE * apart * span)
    major, minor = [], []
    for power in range(first, last + 1):
        for digit in range(1, 10):
            at = digit * 10.0**power
            if not low * (1 - 1e-9) <= at <= high * (1 + 1e-9):
                continue
            if digit in named and power % every == 0:
                major.append((at, power_of_ten(power) if digit == 1 else number(at)))
            elif digit == 1 or room / max(span, 1e-9) > 9 * _LEAST:
                minor.append(at)
    return Ticks(tuple(major), tuple(minor))


def _numbers(low: float, high: float, most: int) -> Ticks:
    raw = (high - low) / most
    if not raw > 0 or not math.isfinite(raw):
        return Ticks(((low, number(low)),))
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(s * power for s in _STEPS if s * power >= raw * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return Ticks(tuple((i * step, number(i * step, step)) for i in range(first, last + 1)))


def power_of_ten(power: int) -> str:
    """1000 and 0.001 as such; beyond, as a power."""
    return f"{10.0**power:g}" if -3 <= power <= 3 else f"10{raised(power)}"


def number(value: float, step: float = 0.0) -> str:
    """A number with as many digits as a step of its axis needs."""
    value = value if abs(value) > 1e-9 * step else 0.0
    size = max(abs(value), step)
    if not value or _SMALLEST <= size < _LARGEST:
        return f"{value:.10g}".replace("-", "−")
    power = math.floor(math.log10(size) + 1e-12)
    return f"{value / 10.0**power:.6g}×10{raised(power)}".replace("-", "−")
