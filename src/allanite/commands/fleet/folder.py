# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a fleet: its table, and what is done, kept through whatever ends a run.

A log that is done is a part, a small file that is on the medium before the next log is taken. Parts are merged now and
then, and at the end of a run they become `fleet.parquet`. A part is newer than the table, and later parts than earlier
ones, so that a run may end at any moment: what is there is whole.
"""

from __future__ import annotations

import fcntl
import itertools
import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.fleet.labels import LABELS, LogLabels
from allanite.commands.fleet.table import COLUMNS, LABEL_END, TableColumn, arrow_table, arrow_type
from allanite.errors import FormatError, StorageError
from allanite.plain_files.atomic_file import fresh, make_folder
from allanite.plain_files.json_values import load_plain

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["TABLE", "FleetFolder", "LogState"]

TABLE = "fleet.parquet"
_STATE, _FORMAT, _VERSION = ".fleet", "allanite-fleet", 1
_MERGE = 200  # parts that become one
_ROWS = 200_000  # of a row group
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
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise StorageError(
                    f"another run writes {self.path}; wait for its end, or choose another"
                ) from None
            self._clear()
            self.load()
            yield

    def commit(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Keep the rows of logs that are done; they are on the medium when this returns."""
        part = arrow_table(rows, _OF_PART)
        self._forgotten -= {str(row["log"]) for row in rows}
        self._write([part], self._parts / f"{self._next:09d}.parquet")
        self._next += 1
        self._learn(part)
        if len(parts := self._listed()) > _MERGE:
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
        older = [self.table] if self.table.exists() else []
        columns = [c.name for c in _OF_PART if c not in _OF_LOG]
        rows = _in_one_piece(_newest([*older, *parts], columns, self._forgotten))
        self._write(_labeled(rows, labels, self.logs), self.table)
        self._write([_states(self.logs)], self._state / "logs.parquet")
        for part in parts:
            part.unlink()

    # -- inside -----------------------------------------------------------------------------------------

    def _listed(self) -> list[Path]:
        return sorted(self._parts.glob("[0-9]*.parquet"))

    def _clear(self) -> None:
        """Remove what a process that was killed was about to write."""
        for place in (*self._parts.glob(".*"), *self._state.glob(".*"), *self.path.glob(f".{TABLE}.*")):
            with suppress(OSError):
                place.unlink()

    def load(self) -> None:
        """Know what is done."""
        parts = self._listed()
        self._next = int(parts[-1].stem) + 1 if parts else 0
        known = self._state / "logs.parquet"
        self.logs = {row.pop("log"): LogState(**row) for row in _rows_of(known)}
        for part in parts:
            self._learn(_facts_of(part))

    def _learn(self, part: pa.Table) -> None:
        for row in part.select(_FACTS).to_pylist():
            if row["log"] in self._forgotten:
                continue
            self.logs[row["log"]] = LogState(
                sha256=row["sha256"],
                stamp=row["_stamp"],
                key=row["_key"],
                temperature=row["_temperature"],
                start=row["_start"],
                failed=row["status"] == "error" and row["channel"] is None,
            )

    def _merge(self, parts: Sequence[Path]) -> None:
        """Make one part of many; its number is that of the last, which it replaces."""
        self._write([_newest(parts, [c.name for c in _OF_PART])], parts[-1])
        for part in parts[:-1]:
            part.unlink()

    @staticmethod
    def _write(tables: Iterable[pa.Table], place: Path) -> None:
        """Write tables of one schema, one below the other."""
        import pyarrow.parquet as pq

        coming = iter(tables)
        first = next(coming)
        with (
            fresh(place, force=True, durable=True) as new,
            pq.ParquetWriter(new, first.schema, compression="zstd") as writer,
        ):
            for table in itertools.chain([first], coming):
                writer.write_table(table, row_group_size=_ROWS)


def _newest(places: Sequence[Path], columns: Sequence[str], dropped: Collection[str] = ()) -> pa.Table:
    """Rows of all logs, each log from the last place that has it, without those that are dropped."""
    import pyarrow as pa

    kept = list[pa.Table]()
    known = pa.array(sorted(dropped), pa.string())
    for place in reversed(places):
        rows = pa.concat_tables(_rows_without(place, columns, known))
        kept.append(rows)
        known = pa.concat_arrays([known, rows["log"].unique()])
    return pa.concat_tables(kept[::-1]) if kept else arrow_table([], _OF_PART).select(columns)


def _rows_without(place: Path, columns: Sequence[str], known: pa.Array) -> Iterator[pa.Table]:
    """Rows of a place in pieces, without those of logs that are known: a filter of all would double the memory."""
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    with pq.ParquetFile(place) as file:
        yield file.schema_arrow.empty_table().select(columns)
        for group in range(file.num_row_groups):
            rows = file.read_row_group(group, columns=columns).select(columns)
            yield rows.filter(pc.invert(pc.is_in(rows["log"], value_set=known))) if len(known) else rows


def _facts_of(part: Path) -> pa.Table:
    import pyarrow.parquet as pq

    return pq.read_table(part, columns=_FACTS)


def _rows_of(place: Path) -> list[dict[str, Any]]:
    import pyarrow.parquet as pq

    return list(pq.read_table(place).to_pylist()) if place.exists() else []


def _states(logs: Mapping[str, LogState]) -> pa.Table:
    names = ("sha256", "stamp", "key", "temperature", "start", "failed")
    types = ("string", "string", "string", "float64", "string", "bool_")
    import pyarrow as pa

    columns = {"log": pa.array(list(logs), pa.string())}
    for name, kind in zip(names, types, strict=True):
        columns[name] = pa.array([getattr(s, name) for s in logs.values()], getattr(pa, kind)())
    return pa.table(columns)


def _labeled(rows: pa.Table, labels: LogLabels, logs: Mapping[str, LogState]) -> Iterator[pa.Table]:
    """Rows with the labels of their logs, sorted by log, some at a time: a copy of all would double the memory."""
    coded = rows["log"].combine_chunks().dictionary_encode()
    of_logs = [_labels_of(log, labels, logs.get(log)) for log in coded.dictionary.to_pylist()]
    arrays = {name: _label_array(name, of_logs) for name in (*LABELS, *labels.further)}
    names = [c.name for c in COLUMNS]
    place = names.index(LABEL_END) + 1
    names[place:place] = labels.further
    order = _order(rows)
    for start in range(0, max(len(order), 1), _ROWS):
        chosen = order.slice(start, _ROWS)
        part, which = rows.take(chosen), coded.indices.take(chosen)
        for name, array in arrays.items():
            part = part.append_column(name, array.take(which))
        yield part.select(names)


def _in_one_piece(rows: pa.Table) -> pa.Table:
    """Each column as one array, from which rows are taken quickly; one column after the other, to save memory."""
    import pyarrow as pa

    columns = {}
    for name in rows.column_names:
        columns[name] = rows[name].combine_chunks()
        rows = rows.drop_columns([name])
    return pa.table(columns)


def _order(rows: pa.Table) -> pa.Array:
    """By log; inside a log as they are."""
    import numpy as np
    import pyarrow as pa
    import pyarrow.compute as pc

    ordered = rows.select(["log"]).append_column("at", pa.array(np.arange(len(rows))))
    return pc.sort_indices(ordered, sort_keys=[("log", "ascending"), ("at", "ascending")])


def _labels_of(log: str, labels: LogLabels, state: LogState | None) -> Mapping[str, Any]:
    from allanite.commands.fleet.pattern import date_of

    made: dict[str, Any] = {} if labels.refusal(log) else labels.of(log)
    if state is not None:
        if made.get("temperature") is None:
            made["temperature"] = state.temperature
        if made.get("date") is None and state.start is not None:
            made["date"] = date_of(state.start)
    return made


def _label_array(name: str, of_logs: Sequence[Mapping[str, Any]]) -> pa.Array:
    """Of the type that the schema states; of any other label numbers where all are, else text."""
    import pyarrow as pa

    values = [labels.get(name) for labels in of_logs]
    stated = next((c.type for c in COLUMNS if c.name == name), None)
    texts = stated == "string" or (stated is None and any(isinstance(v, str) for v in values))
    if texts:
        return pa.array([None if v is None else str(v) for v in values], pa.string())
    return pa.array(values, arrow_type(stated or "float64"))
