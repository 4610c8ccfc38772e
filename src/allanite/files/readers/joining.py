# SPDX-License-Identifier: BSD-3-Clause
"""Several files of one log joined by their time stamps; the order in which they are given does not matter.

Runs, which have no stamps but counters, are joined by `allanite.files.readers.joined_runs`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.assembly import time_of
from allanite.files.readers.stamp_table import TimeChoice
from allanite.files.readers.table import Options, Table
from allanite.files.readers.timebase import Stamps
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column

__all__ = ["join"]


@dataclass(frozen=True, slots=True)
class _Chain:
    """Columns, or stamps, one after another; `shifts` are added to the values of each part."""

    parts: tuple[Column, ...] | tuple[Stamps, ...]
    edges: tuple[int, ...]
    shifts: tuple[float, ...]
    origin: float
    dtype: np.dtype[Any]

    def __len__(self) -> int:
        return self.edges[-1]

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        pieces = [
            part.read(max(start - a, 0), min(stop, b) - a) + shift
            for part, a, b, shift in zip(self.parts, self.edges, self.edges[1:], self.shifts, strict=False)
            if start < b and stop > a
        ]
        return np.concatenate(pieces) if pieces else np.zeros(0)


def join(tables: Sequence[Table], names: Sequence[str], options: Options) -> Table:
    """One table from several, in the order of their first stamps.

    Parameters
    ----------
    tables : sequence of Table, at least 1
    names : sequence of str
        Their files, for messages.
    options : Options

    Raises
    ------
    InputError
        A file without time stamps, other columns than in the first one, or files that overlap in time.
    """
    if len(tables) == 1:
        return tables[0]
    if {t.format for t in tables} == {"run"}:
        from allanite.files.readers.joined_runs import join_runs

        return join_runs(tables, names, _chained)
    times = [time_of(t, options, name) for t, name in zip(tables, names, strict=True)]
    for time, name in zip(times, names, strict=True):
        if time is None:
            raise InputError(f"{name}: without time stamps it cannot be joined with other files")
    placed = sorted(
        (
            (time, table, name)
            for time, table, name in zip(times, tables, names, strict=True)
            if time is not None
        ),
        key=lambda p: p[0].first_ns,
    )
    first_time, first, first_name = placed[0]
    for _, table, name in placed[1:]:
        if sorted(table.headings) != sorted(first.headings):
            raise InputError(
                f"{name} has the columns {', '.join(table.headings)}, but {first_name} has {', '.join(first.headings)}"
            )
    edges = tuple(int(e) for e in np.cumsum([0, *(len(t.columns[0]) for _, t, _ in placed)]))
    columns = tuple(
        _chained([t.columns[t.headings.index(h) if h else i] for _, t, _ in placed], edges)
        for i, h in enumerate(first.headings)
    )
    return replace(
        first,
        columns=columns,
        stamps=_stamps([p[0] for p in placed], [p[2] for p in placed], edges),
        start=first_time.start,
        source={**first.source, "files": [name for _, _, name in placed]},
        guesses=tuple(dict.fromkeys(g for _, t, _ in placed for g in t.guesses)),
        history=(*first.history, {"step": "join", "files": [name for _, _, name in placed]}),
    )


def _chained(parts: list[Column], edges: tuple[int, ...]) -> Column:
    base = parts[0].origin
    dtype = np.result_type(*(p.dtype for p in parts))
    return _Chain(tuple(parts), edges, tuple(p.origin - base for p in parts), base, dtype)


def _stamps(times: list[TimeChoice], names: list[str], edges: tuple[int, ...]) -> TimeChoice:
    shifts = [(t.first_ns - times[0].first_ns) * 1e-9 for t in times]
    for k in range(1, len(times)):
        before = times[k - 1].stamps
        last = float(before.read(len(before) - 1, len(before))[0]) + shifts[k - 1]
        if last >= shifts[k]:
            raise InputError(
                f"{names[k - 1]} and {names[k]} overlap in time by {last - shifts[k]:g} s: they cannot be joined"
            )
    chain = _Chain(tuple(t.stamps for t in times), edges, tuple(shifts), 0.0, np.dtype(np.float64))
    return replace(times[0], stamps=chain)
