# SPDX-License-Identifier: BSD-3-Clause
"""Tables that are no logs: an Allan curve has averaging times where a log has time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from allanite.errors import InputError
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    from allanite.files.readers.table import Table

__all__ = ["grows_geometrically", "names_averaging_times", "refuse_curve"]

_MOST_ROWS = 2000
_FEWEST_ROWS = 5
_AVERAGING = re.compile(r"^\W*(taus?|τ|averaging[ _]?times?|cluster[ _]?times?)(?![a-z])", re.IGNORECASE)


def names_averaging_times(heading: str) -> bool:
    """True of tau, averaging time, cluster time, with or without a unit."""
    return _AVERAGING.match(heading) is not None


def grows_geometrically(values: Sequence[float] | np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> bool:
    """True of numbers that grow by about the same factor from each to the next, as averaging times do.

    Whole multiples of one interval round the first of them: the later half decides.
    """
    t = np.asarray(values, dtype=np.float64)
    if len(t) < _FEWEST_ROWS or not (np.all(np.isfinite(t)) and t[0] > 0 and np.all(np.diff(t) > 0)):
        return False
    steps, ratios = np.diff(t), np.diff(np.log(t))[len(t) // 2 - 1 :]
    return bool(steps[-1] > 4 * steps[0] and t[-1] > 8 * t[0] and np.ptp(ratios) < 0.75 * ratios.max())


def refuse_curve(table: Table, path: Path) -> None:
    """Raise if the table, which was read from this file, is an Allan curve.

    Raises
    ------
    InputError
        The first column grows geometrically, or averaging times say by their name that they are that.
    """
    if not table.columns or not _FEWEST_ROWS <= len(table.columns[0]) <= _MOST_ROWS:
        return
    if any(names_averaging_times(text) for text in table.headings):
        why = "it has a column of averaging times"
    elif len(table.columns) > 1 and grows_geometrically(table.columns[0].read(0, _MOST_ROWS)):
        first, last = table.columns[0].read(0, _MOST_ROWS)[[0, -1]]
        why = f"its first column grows from {first:g} to {last:g} by about the same factor in each row"
    else:
        return
    raise InputError(
        f"{path.name} looks like an Allan curve, not a log: {why}. Fit it with `allanite fit {for_shell(str(path))} "
        "--curve --samples N --rate HZ --unit UNIT`, with the length, rate and unit of its record"
    )
