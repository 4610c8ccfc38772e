# SPDX-License-Identifier: BSD-3-Clause
"""Columns of the time since the row before (``dt``, ``delta_t``, ``dt_ms``, ``period``): neither stamps nor signals.

Their running sum is time. Beside a column of time they repeat it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.headings import read_heading
from allanite.lazy_dataclasses import dataclass
from allanite.recording.increment_names import names_increments
from allanite.recording.records import Column
from allanite.recording.sample_columns import Calculated

__all__ = ["RunningSum", "holds_increments", "interval_unit", "is_period", "running_sum"]

_UNIT = r"(?:_?(?P<unit>s|[munµ]s|[mun]?secs?|seconds?|millis|micros|nanos|(?:milli|micro|nano)seconds?))?"
_STRICT = re.compile(
    rf"(?:\w+_)?(?:d_?t|delta_?t|dtime|d_time|delta_?time|t_delta|time_?(?:diff|delta|step)|step_?time){_UNIT}"
)
_PERIOD = re.compile(rf"(?:(?:sample|sampling|update|loop|frame)_?)?(?:period|interval){_UNIT}")
_SIZES: Final = {"s": "s", "m": "ms", "u": "us", "µ": "us", "n": "ns"}
_ROWS: Final = 1 << 16


def interval_unit(raw: str) -> str | None:
    """The unit of a column of intervals by its heading, "" where it names none; None for a column of another name."""
    heading = read_heading(re.sub(r"^\W*[Δ∆]\s*", "d", raw))
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", heading.name)
    match = _matched(re.sub(r"[^0-9a-zµ]+", "_", plain.lower()).strip("_"))
    if match is None or "integral" in plain.lower():
        return None
    word = match["unit"] or ""
    return heading.unit or (_SIZES["s" if word[0] == "s" else word[0]] if word else "")


def _matched(plain: str) -> re.Match[str] | None:
    return _STRICT.fullmatch(plain) or _PERIOD.fullmatch(plain)


def is_period(raw: str) -> bool:
    """The name may be that of a signal, too: a meter measures periods."""
    return "period" in raw.lower()


def holds_increments(raw: Sequence[str]) -> bool:
    """A table of increments, whose intervals are needed to divide them by."""
    return any(names_increments(read_heading(text).name) and interval_unit(text) is None for text in raw)


@dataclass(frozen=True, slots=True)
class RunningSum(Calculated):
    """The sum of intervals up to each row, 0 in the first."""

    of: Column
    sums: NDArray[np.float64]  # before each block of rows

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        stop = min(stop, len(self))
        block = start // _ROWS
        steps = self.of.read(block * _ROWS, stop) + self.of.origin
        if block == 0 and len(steps):
            steps[0] = 0.0
        stamps: NDArray[np.float64] = self.sums[block] + np.cumsum(steps)
        return stamps[start - block * _ROWS :]


def running_sum(column: Column, label: str, file: str) -> RunningSum:
    """Time by a column of intervals.

    Raises
    ------
    InputError
        An interval that is missing or negative: when all later rows were taken is not known.
    """
    sums = [0.0]
    for start in range(0, len(column), _ROWS):
        steps = column.read(start, min(start + _ROWS, len(column))) + column.origin
        if start == 0 and len(steps):
            steps[0] = 0.0  # since a row that is not in the file
        bad = ~(np.isfinite(steps) & (steps >= 0))
        if bad.any():
            raise InputError(
                f"{file}: column {label} is the interval since the previous row, and is invalid in row "
                f"{start + int(bad.argmax())}: the time after it is unknown. Pass the rate, --rate RATE, or name "
                "another column, --time COLUMN[:UNIT]"
            )
        sums.append(sums[-1] + float(steps.sum()))
    return RunningSum(column, np.array(sums))
