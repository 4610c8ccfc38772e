# SPDX-License-Identifier: BSD-3-Clause
"""Readings of the 3458A: bytes in -> values out. Pure; keeps what is not yet whole for the next bytes.

A line of ASCII counts only when it is a whole reading of 15 characters: `+1.23` is the start of some reading, and
`1.23456789E+00` may have lost its minus sign. What is rejected is counted and shown, never guessed; so is a whole
reading that the meter cannot give on its range, in every format by the same rule (`beyond_scale`).
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import Flag
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import OVERLOAD

__all__ = ["ParsedReadings", "beyond_scale", "parse_dint", "parse_lines"]

#: Sign or blank, one digit, point, eight digits, exponent: 15 characters.
_READING = re.compile(rb"[ +-]\d\.\d{8}E[+-]\d\d")
_ANY_NUMBER = re.compile(rb"[ +-]?\d+(?:\.\d*)?E[+-]?\d+", re.IGNORECASE)
_OVERLOAD_WORDS = (b"OVLD", b"OL", b"OVERLOAD")
#: Full scale over range, by the manual; that of 1000 V is less.
FULL_SCALE, LARGEST_RANGE, ITS_FULL_SCALE = 1.2, 1000.0, 1.05
#: A line that grows beyond this has lost its end.
LONGEST_LINE = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class ParsedReadings:
    """Readings found in a stretch of bytes.

    Attributes
    ----------
    values : ndarray, shape (n,) [V]
        NaN at overload.
    flags : ndarray of uint8, shape (n,)
    breaks : tuple of int
        Before which sample something was rejected, once for each rejected line; n stands for the end.
    rejected : tuple of bytes
        Those lines.
    rest : bytes
        The start of a line whose end has not come.
    """

    values: NDArray[np.float64]
    flags: NDArray[np.uint8]
    breaks: tuple[int, ...]
    rejected: tuple[bytes, ...]
    rest: bytes


def beyond_scale(size: Any, range_volts: float) -> Any:
    """Where readings of this size [V] are no reading of the range, and no overload either.

    Examples
    --------
    >>> [beyond_scale(size, 10.0) for size in (12.0, 12.001, 1e20, 1e38)]
    [False, True, True, False]
    """
    part = ITS_FULL_SCALE if range_volts >= LARGEST_RANGE else FULL_SCALE
    return (size > part * range_volts) & (size < OVERLOAD)


def parse_lines(data: bytes, range_volts: float) -> ParsedReadings:
    """Whole ASCII readings of `data`; what is none on this range is set aside with its place."""
    values: list[float] = []
    flags: list[int] = []
    breaks: list[int] = []
    rejected: list[bytes] = []
    *lines, rest = data.split(b"\n")
    if len(rest) > LONGEST_LINE:
        lines, rest = [*lines, rest], b""
    for line in lines:
        body = line[:-1] if line.endswith(b"\r") else line
        value = _value_of(body)
        if value is None or beyond_scale(abs(value), range_volts):
            breaks.append(len(values))
            rejected.append(body)
            continue
        overload = not abs(value) < OVERLOAD
        values.append(np.nan if overload else value)
        flags.append(Flag.OVERLOAD if overload else 0)
    return ParsedReadings(
        values=np.array(values, dtype=np.float64),
        flags=np.array(flags, dtype=np.uint8),
        breaks=tuple(breaks),
        rejected=tuple(rejected),
        rest=rest,
    )


def _value_of(body: bytes) -> float | None:
    if _READING.fullmatch(body):
        return float(body)
    # Overload is written in several ways; none of them can be the remains of another reading.
    if body.strip(b" +-").upper() in _OVERLOAD_WORDS:
        return float("inf")
    if _ANY_NUMBER.fullmatch(body) and abs(float(body)) >= OVERLOAD:
        return float("inf")
    return None


def parse_dint(
    data: bytes, scale: float, range_volts: float
) -> tuple[NDArray[np.float64], NDArray[np.uint8], int | None]:
    """Whole DINT readings of `data`; up to three bytes at its end may belong to the next one.

    Returns
    -------
    values : ndarray, shape (n,) [V]
        NaN at overload, which is an end of the scale.
    flags : ndarray of uint8, shape (n,)
    wrong : int or None
        The first reading that is beyond the scale (`beyond_scale`) and no end of the integer: bytes were lost or
        added some readings before it.

    Notes
    -----
    1. The overload value in DINT is not known (to be tried on hardware); both ends of the integer are taken for it,
       and values of 9.9E37 and above once scaled.
    2. This finds bytes out of step where they make values too large; `ByteStep` finds the others.
    """
    raw = np.frombuffer(data, dtype=">i4", count=len(data) // 4).astype(np.int64)
    values: NDArray[np.float64] = (raw * scale).astype(np.float64)
    overload = (np.abs(raw) >= 2**31 - 1) | ~(np.abs(values) < OVERLOAD)
    wrong = np.flatnonzero(beyond_scale(np.abs(values), range_volts) & ~overload)
    values[overload] = np.nan
    flags = np.where(overload, Flag.OVERLOAD, 0).astype(np.uint8)
    return values, flags, int(wrong[0]) if len(wrong) else None
