# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a fleet: its table, and what is done, kept through whatever ends a run.

A log that is done is a part, a small file that is on the medium before the next log is taken. Many parts become one now
and then, and at the end of a run the table takes their rows. A part is newer than the table, and later parts than
earlier ones, so that a run may end at any moment: what is there is whole.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.fleet.labels import LABELS, LogLabels
from allanite.commands.fleet.partitions import FleetTable
from allanite.commands.fleet.table import COLUMNS, TableColumn, arrow_table
from allanite.errors import FormatError, InputError, StorageError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.atomic_file import fresh, make_folder
from allanite.plain_files.file_lock import try_lock
from allanite.plain_files.json_values import load_plain
from allanite.stability.fleet.table_files import TABLE

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["FleetFolder", "LogState"]

_STATE, _FORMAT, _VERSION = ".fleet", "allanite-fleet", 1
_MERGE = 200  # parts that become one
_MERGED = ".merged.parquet"
_AT_ONCE = 10_000  # rows that are turned into Python at a time
#: What a part holds of a log beside its rows.
_OF_LOG = (
    TableColumn("_stamp", "string", ""),
    TableColumn("_key", "string", ""),
    TableColumn("_temperature", "float64", ""),
    TableColumn("_start", "string", ""),
)
_FACTS = ["log", "sha256", "status", "channel", *(c.name for c in _OF_LOG)]
_OF_PART = (*(c for c in COLUMNS if c.name not in LABELS), *_OF_LOG)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogState:
    """What is known of a log that is done.

    Attributes
    ----------
    sha256 : str or None
    stamp : str
        Size and time of the file when it was read.
    key : str
        Of the options and the version; "" for one that is to be tried again.
    temperature : float or None [°C]
    start : str or None
        UTC.
    failed : bool
    """

    sha256: str | None
    stamp: str
    key: str
    temperature: float | None
    start: str | None
    failed: bool


class FleetFolder:
    """A fleet on disk; one process at a time writes it.

    Parameters
    ----------
    path : path

    Raises
    ------
    StorageError
        The folder holds a fleet.parquet of something else, or cannot be made.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._state, self._parts = self.path / _STATE, self.path / _STATE / "parts"
        if (self.path / TABLE).exists() and not self._state.is_dir():
            raise StorageError(f"{self.path / TABLE} is not of a fleet run; choose another folder")
        self.logs: dict[str, LogState] = {}
        self._forgotten: set[str] = set()
        self._next = 0
        self._table = FleetTable(self.table, self._state)

    @property
    def table(self) -> Path:
        return self.path / TABLE

    # -- settings ---------------------------------------------------------------------------------------

    def save_settings(self, settings: Mapping[str, Any]) -> None:
        """Keep what the run was asked for, for those that go on with it."""
        with fresh(self._state / "run.json", force=True, durable=True) as place:
            head = {"format": _FORMAT, "version": _VERSION}
            place.write_text(json.dumps({**head, **settings}, indent=1) + "\n", encoding="utf-8")

    def settings(self) -> dict[str, Any]:
        """What the last run was asked for.

        Raises
        ------
        FormatError
            No fleet, or one of a later version.
        """
        place = self._state / "run.json"
        if not place.is_file():
            raise FormatError(
                f"{self.path} is no fleet; make one: allanite fleet run 'logs/*' --out {self.path}"
            )
        settings: dict[str, Any] = load_plain(place, "the settings of a fleet")
        if settings.get("format") != _FORMAT or settings.get("version") != _VERSION:
            raise FormatError(f"{place}: not the settings of a fleet that this allanite reads")
        return settings

    # -- what is done -----------------------------------------------------------------------------------

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Be the one that writes, and know what is done.

        Raises
        ------
        StorageError
            Another run writes the folder.
        """
        make_folder(self._parts)
        with (self._state / "lock").open("w") as lock:
            if not try_lock(lock.fileno()):
                raise StorageError(f"another run writes {self.path}; wait for its end, or choose another")
            self._clear()
            self.load()
            yield

    def commit(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Keep the rows of logs that are done; they are on the medium when this returns."""
        part = arrow_table(rows, _OF_PART)
        self._forgotten -= {str(row["log"]) for row in rows}
        self._write(part, self._parts / f"{self._next:09d}.parquet")
        self._next += 1
        self._learn(part)
        if len(parts := [p for p in self._listed() if not p.name.endswith(_MERGED)]) > _MERGE:
            self._merge(parts)

    def touch(self, log: str, stamp: str) -> None:
        """Know a log by another stamp; kept with the next table."""
        self.logs[log] = replace(self.logs[log], stamp=stamp)

    def forget_failed(self, present: Collection[str]) -> None:
        """Forget logs that failed and are gone, from the next table on."""
        here = frozenset(present)
        self._forgotten = {name for name, state in self.logs.items() if state.failed and name not in here}
        for name in self._forgotten:
            del self.logs[name]

    def compact(self, labels: LogLabels) -> None:
        """Make the table of all that is done, and forget the parts."""
        parts = self._listed()
        for part in parts:  # the run may have been interrupted before it knew what it had just kept
            self._learn(_facts_of(part))
        self._table.update(parts, self._forgotten, self.logs, _LabelsOfStates(labels, self.logs))
        self._write(_states(self.logs), self._state / "logs.parquet")
        for part in parts:
            part.unlink()

    # -- inside -----------------------------------------------------------------------------------------

    def _listed(self) -> list[Path]:
        return sorted(self._parts.glob("[0-9]*.parquet"))

    def _clear(self) -> None:
        """Remove what a process that was killed was about to write."""
        self._table.clear()
        for place in (*self._parts.glob(".*"), *self._state.glob(".*"), *self.path.glob(f".{TABLE}.*")):
            with suppress(OSError):
                place.unlink()

    def load(self) -> None:
        """Know what is done."""
        parts = self._listed()
        self._next = int(parts[-1].name.partition(".")[0]) + 1 if parts else 0
        known = self._state / "logs.parquet"
        self.logs = {
            row.pop("log"): LogState(**{**row, "key": sys.intern(row["key"])}) for row in _rows_of(known)
        }
        for part in parts:
            self._learn(_facts_of(part))

    def _learn(self, part: pa.Table) -> None:
        for row in _first_of_each_log(part.select(_FACTS)).to_pylist():
            if row["log"] in self._forgotten:
                continue
            self.logs[row["log"]] = LogState(
                sha256=row["sha256"],
                stamp=row["_stamp"],
                key=sys.intern(row["_key"]),
                temperature=row["_temperature"],
                start=row["_start"],
                failed=row["status"] == "error" and row["channel"] is None,
            )

    def _merge(self, parts: Sequence[Path]) -> None:
        """Make one part of many. By its name it comes right before the last of them, whose rows it has."""
        self._write(_newest(parts), parts[-1].with_suffix(_MERGED))
        for part in parts:
            part.unlink()

    @staticmethod
    def _write(table: pa.Table, place: Path) -> None:
        import pyarrow.parquet as pq

        with fresh(place, force=True, durable=True) as new:
            pq.write_table(table, new, compression="zstd")


def _newest(places: Sequence[Path]) -> pa.Table:
    """Rows of all logs, each log from the last place that has it."""
    import pyarrow as pa
    import pyarrow.compute as pc

    kept = list[pa.Table]()
    known = pa.array([], pa.string())
    for place in reversed(places):
        rows = _read(place)
        kept.append(rows.filter(pc.invert(pc.is_in(rows["log"], value_set=known))))
        known = pa.concat_arrays([known, rows["log"].unique()])
    return pa.concat_tables(kept[::-1])


def _first_of_each_log(rows: pa.Table) -> pa.Table:
    import numpy as np
    import pyarrow as pa

    codes = rows["log"].combine_chunks().dictionary_encode().indices.to_numpy()
    return rows.take(pa.array(np.unique(codes, return_index=True)[1]))


def _facts_of(part: Path) -> pa.Table:
    return _read(part, _FACTS)


def _read(place: Path, columns: list[str] | None = None) -> pa.Table:
    """A file; `pyarrow.parquet.read_table` would load the code for folders of them, of 30 MB."""
    import pyarrow.parquet as pq

    with pq.ParquetFile(place) as file:
        return file.read(columns=columns)


def _rows_of(place: Path) -> Iterator[dict[str, Any]]:
    import pyarrow.parquet as pq

    if place.exists():
        with pq.ParquetFile(place) as file:
            for batch in file.iter_batches(_AT_ONCE):
                yield from batch.to_pylist()


def _states(logs: Mapping[str, LogState]) -> pa.Table:
    names = ("sha256", "stamp", "key", "temperature", "start", "failed")
    types = ("string", "string", "string", "float64", "string", "bool_")
    import pyarrow as pa

    columns = {"log": pa.array(list(logs), pa.string())}
    for name, kind in zip(names, types, strict=True):
        columns[name] = pa.array([getattr(s, name) for s in logs.values()], getattr(pa, kind)())
    return pa.table(columns)


class _LabelsOfStates:
    """Labels of logs by their names, and by what is known of them where those do not say it."""

    def __init__(self, labels: LogLabels, logs: Mapping[str, LogState]) -> None:
        self._labels, self._logs = labels, logs
        self.further, self.key = labels.further, labels.key

    def of(self, log: str) -> Mapping[str, Any]:
        """Labels of a log; none of one that the pattern refuses."""
        from allanite.commands.fleet.pattern import date_of

        try:
            made = self._labels.of(log)
        except InputError:
            made = {}
        state = self._logs.get(log)
        if state is not None:
            if made.get("temperature") is None:
                made["temperature"] = state.temperature
            if made.get("date") is None and state.start is not None:
                made["date"] = date_of(state.start)
        return made
