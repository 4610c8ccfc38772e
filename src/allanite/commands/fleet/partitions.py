# SPDX-License-Identifier: BSD-3-Clause
"""The table as a folder of Parquet files, of which a run writes those whose logs changed.

A log belongs to one file, by a checksum of its name, so that a file that is replaced never leaves a log half old. Rows
that come are spilled file by file first; then each file is made of its rows on disk and of those that came. No more
than one file is in memory at a time.
"""

from __future__ import annotations

import os
import shutil
import zlib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from allanite.commands.fleet.labels import LABELS
from allanite.commands.fleet.table import COLUMNS, LABEL_END, arrow_table, arrow_type
from allanite.plain_files.durable import synced
from allanite.stability.fleet.table_files import table_files

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["FleetTable", "LabelSource"]

_LOGS = 500  # of a file, about
_MOST = 256  # files
_ROWS = 40_000  # that are spilled in one go
_KEY = b"allanite-labels"
_RESULTS = tuple(c for c in COLUMNS if c.name not in LABELS)
_NAMES = [c.name for c in _RESULTS]


class LabelSource(Protocol):
    """What is known of logs beside their samples."""

    further: tuple[str, ...]
    key: str

    def of(self, log: str) -> Mapping[str, Any]:
        """Labels of a log."""


class FleetTable:
    """A table on disk.

    Parameters
    ----------
    place : Path
        The folder of its files; an older allanite wrote one file.
    scratch : Path
        A folder beside it, for what is not done yet.
    """

    def __init__(self, place: Path, scratch: Path) -> None:
        self.place = place
        self._new, self._old, self._spill = (scratch / name for name in ("table", "replaced", "spill"))

    def clear(self) -> None:
        """Remove what a process that was killed left, and bring back a table that was about to be replaced."""
        if self._old.exists() and not self.place.exists():
            self._old.rename(self.place)
        for place in (self._new, self._old, self._spill):
            _remove(place)

    def update(
        self, parts: Sequence[Path], gone: Collection[str], logs: Collection[str], labels: LabelSource
    ) -> None:
        """Take the rows of parts.

        Parameters
        ----------
        parts : sequence of Path
            Parquet files; of a log that several have, the last one counts.
        gone : collection of str
            Logs that are no longer in the table.
        logs : collection of str
            All logs that will be.
        labels : LabelSource
        """
        self.clear()
        count = _partitions(len(logs))
        kinds = _kinds(logs, labels)
        key = f"{labels.key} {kinds}".encode()
        files = table_files(self.place)
        fits = [file.name for file in files] == [_name(i, count) for i in range(count)]
        self._new.mkdir(parents=True)
        known = set(gone)
        changed = {_partition(log, count) for log in gone}
        with _Spill(self._spill, count) as spill:
            for place in reversed(parts):
                spill.add(_unknown(place, known))
            if not fits:
                for place in files:
                    spill.add(_unknown(place, known, whole=False))
        for i in range(count):
            older = self.place / _name(i, count) if fits else None
            if older is None or i in spill.used | changed or _key_of(older) != key:
                rows = [*spill.rows(i), *([] if older is None else _pieces(older, known))]
                _write(_labeled(rows, labels, kinds), self._new / _name(i, count), key)
        self._settle(whole=not fits)
        self.clear()

    def _settle(self, *, whole: bool) -> None:
        """Put what was made in its place; on the medium when this returns."""
        synced(self._new)
        if whole:
            if self.place.exists():
                self.place.rename(self._old)
            self._new.rename(self.place)
        else:
            for file in self._new.iterdir():
                file.replace(self.place / file.name)
            synced(self.place)
        synced(self.place.parent)


def _remove(place: Path) -> None:
    if place.is_dir():
        shutil.rmtree(place)
    else:
        place.unlink(missing_ok=True)


# -- which file ---------------------------------------------------------------------------------------------


def _partitions(logs: int) -> int:
    """Files of a table: a power of two."""
    count = 1
    while count * _LOGS < logs and count < _MOST:
        count *= 2
    return count


def _partition(log: str, count: int) -> int:
    return zlib.crc32(log.encode("utf-8", "surrogatepass")) % count


def _name(i: int, count: int) -> str:
    return f"{i:03d}-of-{count:03d}.parquet"


# -- rows ---------------------------------------------------------------------------------------------------


class _Spill:
    """Rows on disk, sorted into the files that they are for."""

    def __init__(self, folder: Path, count: int) -> None:
        self._folder, self._count = folder, count
        self._files: dict[int, Any] = {}
        self._waiting: list[pa.Table] = []
        self._open = ExitStack()

    def __enter__(self) -> _Spill:
        self._folder.mkdir()
        return self

    def __exit__(self, *fault: object) -> None:
        try:
            if fault[0] is None:
                self._flush()
        finally:
            self._open.close()

    @property
    def used(self) -> set[int]:
        """The files that rows came for."""
        return set(self._files)

    def add(self, pieces: Iterable[pa.Table]) -> None:
        for rows in pieces:
            self._waiting.append(rows)
            if sum(map(len, self._waiting)) >= _ROWS:
                self._flush()

    def rows(self, i: int) -> Iterator[pa.Table]:
        """Those for one file."""
        import pyarrow as pa

        if i in self._files:
            with pa.ipc.open_stream(self._place(i)) as stream:
                yield stream.read_all()

    def _flush(self) -> None:
        import numpy as np
        import pyarrow as pa

        if not self._waiting:
            return
        rows, self._waiting = pa.concat_tables(self._waiting), []
        coded = rows["log"].combine_chunks().dictionary_encode()
        of_logs = np.array(
            [_partition(log, self._count) for log in coded.dictionary.to_pylist()], dtype=np.int64
        )
        of_rows = of_logs[coded.indices.to_numpy()]
        order = np.argsort(of_rows, kind="stable")
        ends = np.searchsorted(of_rows[order], np.arange(self._count + 1))
        rows = rows.take(pa.array(order))
        for i in np.flatnonzero(np.diff(ends)).tolist():
            self._file(i).write_table(rows.slice(ends[i], ends[i + 1] - ends[i]))

    def _file(self, i: int) -> Any:
        import pyarrow as pa

        if i not in self._files:
            options = pa.ipc.IpcWriteOptions(compression="lz4")
            schema = arrow_table([], _RESULTS).schema
            self._files[i] = self._open.enter_context(
                pa.ipc.new_stream(self._place(i), schema, options=options)
            )
        return self._files[i]

    def _place(self, i: int) -> str:
        return os.fspath(self._folder / f"{i}.arrows")


def _unknown(place: Path, known: set[str], *, whole: bool = True) -> Iterator[pa.Table]:
    """Rows of a file without those of known logs; its logs are known then, unless it is one of several."""
    mine = set[str]()
    for rows in _pieces(place, known):
        mine.update(rows["log"].unique().to_pylist())
        yield rows
    if whole:
        known |= mine


def _pieces(place: Path, known: Collection[str]) -> Iterator[pa.Table]:
    """The results of a file, without those of known logs."""
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    with pq.ParquetFile(place) as file:
        for group in range(file.num_row_groups):
            rows = file.read_row_group(group, columns=_NAMES).select(_NAMES).replace_schema_metadata()
            left_out = [log for log in rows["log"].unique().to_pylist() if log in known]
            if left_out:
                rows = rows.filter(
                    pc.invert(pc.is_in(rows["log"], value_set=pa.array(left_out, pa.string())))
                )
            yield rows


def _write(rows: pa.Table, place: Path, key: bytes) -> None:
    import pyarrow.parquet as pq

    pq.write_table(rows.replace_schema_metadata({_KEY: key}), place, compression="zstd")
    synced(place)


def _key_of(place: Path) -> bytes | None:
    """The key of the labels in a file."""
    import pyarrow.parquet as pq

    return (pq.read_metadata(place).metadata or {}).get(_KEY)


# -- labels -------------------------------------------------------------------------------------------------


def _kinds(logs: Iterable[str], labels: LabelSource) -> dict[str, str]:
    """The type of each label: as the schema states it; of any other "float64" where all logs have numbers."""
    kinds = {c.name: c.type for c in COLUMNS if c.name in LABELS} | dict.fromkeys(labels.further, "float64")
    if labels.further:
        for log in logs:
            of_log = labels.of(log)
            kinds |= {name: "string" for name in labels.further if isinstance(of_log.get(name), str)}
    return kinds


def _labeled(pieces: Sequence[pa.Table], labels: LabelSource, kinds: Mapping[str, str]) -> pa.Table:
    """Rows with the labels of their logs, sorted by log; inside a log as they are."""
    import numpy as np
    import pyarrow as pa
    import pyarrow.compute as pc

    rows = pa.concat_tables([arrow_table([], _RESULTS), *pieces])
    at = rows.select(["log"]).append_column("at", pa.array(np.arange(len(rows))))
    rows = rows.take(pc.sort_indices(at, sort_keys=[("log", "ascending"), ("at", "ascending")]))
    coded = rows["log"].combine_chunks().dictionary_encode()
    of_logs = [labels.of(log) for log in coded.dictionary.to_pylist()]
    for name, kind in kinds.items():
        rows = rows.append_column(
            name, _array([label.get(name) for label in of_logs], kind).take(coded.indices)
        )
    names = [c.name for c in COLUMNS]
    place = names.index(LABEL_END) + 1
    names[place:place] = labels.further
    return rows.select(names)


def _array(values: Sequence[Any], kind: str) -> pa.Array:
    import pyarrow as pa

    if kind == "string":
        values = [None if value is None else str(value) for value in values]
    return pa.array(values, arrow_type(kind))
