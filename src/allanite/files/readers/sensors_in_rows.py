# SPDX-License-Identifier: BSD-3-Clause
"""Tables that are no text and hold the rows of several sensors: asked about, never merged without a word."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.column_look import looked_at
from allanite.files.readers.headings import Heading, read_heading
from allanite.files.readers.row_identity import RowLabels, find_identity, is_called_identity
from allanite.files.readers.stamp_table import TimeChoice
from allanite.files.readers.table import Table, WordColumn
from allanite.recording.records import Column

__all__ = ["refuse_several_sensors"]

_SHARED: Final = 0.25  # of the rows have the stamp of the row before
_WHOLE: Final = 1 << 13  # rows of a short table, all of which are looked at
_STAMPS: Final = -1  # the place of the stamps among the labels


def refuse_several_sensors(
    table: Table, headings: Sequence[Heading], time: TimeChoice | None, name: str
) -> None:
    """Ask for the rows of one sensor where a column tells several apart.

    Raises
    ------
    InputError
        With the column and its values.
    """
    n = len(table.columns[0])
    rows = [(0, n)] if n <= _WHOLE else looked_at(n)
    stamps = [] if time is None else [time.stamps.read(a, b) for a, b in rows]
    shared = any((np.diff(part) == 0).mean() >= _SHARED for part in stamps if len(part) > 1)
    used = () if time is None else time.used
    all_headings = [*headings, *(read_heading(words.name) for words in table.words)]
    columns: list[Column | WordColumn] = [*table.columns, *table.words]
    values: dict[int, NDArray[np.generic]] = {
        i: np.concatenate([columns[i].read(a, b) for a, b in rows])
        for i, heading in enumerate(all_headings)
        if i not in used and (shared or is_called_identity(heading))
    }
    if not values:
        return
    labels = {i: RowLabels.of(all_headings[i], column) for i, column in values.items()}
    if stamps:
        labels[_STAMPS] = RowLabels.of(read_heading("time"), np.concatenate(stamps), clock=True)
    places = find_identity(labels)
    if places:
        raw = [*table.headings, *(words.name for words in table.words)]
        column = " with ".join(repr(raw[i]) for i in places)
        sensors = dict.fromkeys(values[places[0]].tolist())
        listing = ", ".join(f"{one:g}" if isinstance(one, float) else one for one in sensors)
        raise InputError(
            f"{name}: column {column} distinguishes several sensors or records: {listing}; pass the rows of one, in "
            f"Python al.Recording.from_samples(table[table[{raw[places[0]]!r}] == {_literal(next(iter(sensors)))}])"
        )


def _literal(value: float | str) -> str:
    return f"{value:g}" if isinstance(value, float) else repr(value)
