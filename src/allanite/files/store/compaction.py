# SPDX-License-Identifier: BSD-3-Clause
"""A finished run in one Parquet file: the same rows, header and manifest included, in half the space at 32 Hz."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import AllaniteError, DataQualityError, FormatError, StorageError
from allanite.files.store.batch import Batch
from allanite.files.store.header import Header
from allanite.files.store.manifest import is_sound
from allanite.files.store.run import Run, open_run
from allanite.files.store.survey import Piece, RunSurvey
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.arrow_numbers import arrow_of, numbers_of
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.limits import FOOTER_BYTES, PIECES, refuse_more
from allanite.plain_files.regular_file import open_regular
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

__all__ = ["KEY", "compact", "is_compact", "manifest_of", "parquet_place", "survey_of"]

#: Of the metadata of the file.
KEY: Final = b"allanite.run"

_ROWS: Final = 1 << 20  # of a row group
_MARKS: Final = 256  # batches of a row group whose clocks are looked at


def compact(
    folder: str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    part: int | None = None,
    force: bool = False,
) -> Path:
    """Write a finished run as one Parquet file, and read it back; the run itself is left as it is.

    Parameters
    ----------
    folder, path : path
    part : int, optional
        Where the settings changed in mid-run.
    force : bool
        Replace a file that is there.

    Raises
    ------
    StorageError
        The run is still going, the file exists, what was read back is not what was written, or the disk refuses.
    DataQualityError
        The run is damaged, without samples, or its settings change and no part is named.
    """
    import pyarrow.parquet as pq

    run = open_run(folder)
    if run.status == "recording":
        raise StorageError(f"{run.folder} is still being recorded: compact it when it is finished")
    survey = run.survey(part)
    if survey.faults:
        faults = "; ".join(f"{name}: {why}" for name, why in survey.faults.items())
        raise DataQualityError(
            f"{run.folder} is damaged ({faults}): recover it first, with `{_recovery(run)}`"
        )
    _refuse_altered(run)
    schema = _schema(survey.header, run, survey.end)
    with fresh(path, force=force) as place:
        with pq.ParquetWriter(place, schema, compression="zstd", write_page_checksum=True) as writer:
            for group in _groups(run, part, schema):
                writer.write_table(group)
        back = pq.ParquetFile(place, page_checksum_verification=True)
        for k, group in enumerate(_groups(run, part, schema)):
            if not _same(back.read_row_group(k), group):
                raise StorageError(
                    f"{path}: the file read back differs from what was written; write it to another disk"
                )
    return Path(path)


def _refuse_altered(run: Run) -> None:
    """Raise if a closed segment is not, byte by byte, the one whose SHA-256 was noted."""
    for event in run.manifest:
        path = run.folder / str(event.get("segment"))
        if event["kind"] != "closed" or not path.exists():
            continue
        with open_regular(path) as file:
            digest = hashlib.sha256(file.read(int(event["bytes"]))).hexdigest()
        if digest != event["sha256"]:
            raise DataQualityError(
                f"{path} has changed since it was closed (its SHA-256 differs): recover the run first, "
                f"with `{_recovery(run)}`"
            )


def _recovery(run: Run) -> str:
    return f"allanite recover {for_shell(str(run.folder))}"


def parquet_place(path: str | os.PathLike[str]) -> Path:
    """A path, for the library that opens it: a regular file whose metadata, at its end, are not too many.

    Raises
    ------
    LimitError
        They would take hundreds of megabytes of memory before a row is read.
    """
    with open_regular(path) as file:
        end = file.seek(0, os.SEEK_END)
        file.seek(max(end - 8, 0))
        size = int.from_bytes(file.read(4), "little")
    if size <= end:  # else it is cut, and the library says so
        advice = "Write it in fewer columns and in groups of a million rows"
        refuse_more(size, FOOTER_BYTES, "bytes of metadata", Path(path).name, advice)
    return Path(path)


def is_compact(path: Path) -> bool:
    """True for a file that `compact` wrote."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return KEY in (pq.read_schema(parquet_place(path)).metadata or {})
    except (pa.ArrowException, OSError, ValueError):
        return False


def survey_of(path: str | os.PathLike[str]) -> tuple[RunSurvey, str]:
    """What `Run.survey` says, of a file that `compact` wrote; and how the run ended.

    Raises
    ------
    FormatError
        The file is damaged.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    place = Path(path)
    try:
        with pq.ParquetFile(parquet_place(place), page_checksum_verification=True) as file:
            refuse_more(file.num_row_groups, PIECES, "row groups", place.name, "Make it again from the run")
            facts = parse_plain(file.schema_arrow.metadata[KEY])
            header = Header.from_json(facts["header"])
            pieces = [_piece(place, file, k) for k in range(file.num_row_groups)]
            end, status = int(facts["end"]), str(facts["status"])
    except AllaniteError:
        raise
    except (pa.ArrowException, OSError, ValueError, KeyError, TypeError) as error:
        raise FormatError(
            f"{place.name}: damaged ({type(error).__name__}); make it once more from the run"
        ) from None
    return RunSurvey.of(header, pieces, {}, torn=False, end=end), status


def manifest_of(path: str | os.PathLike[str]) -> tuple[Mapping[str, Any], ...]:
    """The lines of the manifest that a file which `compact` wrote holds."""
    import pyarrow.parquet as pq

    try:
        lines = parse_plain(pq.read_schema(parquet_place(path)).metadata[KEY])["manifest"]
        return tuple(line for line in lines if is_sound(line))
    except (ValueError, KeyError, TypeError) as error:
        raise FormatError(
            f"{Path(path).name}: damaged ({type(error).__name__}); make it once more from the run"
        ) from None


@dataclass(frozen=True, slots=True, kw_only=True)
class _GroupRows:
    """The rows of one row group; see `allanite.files.store.rows`."""

    path: Path
    group: int
    count: int

    def read(self, name: str) -> NDArray[np.float64]:
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            with pq.ParquetFile(parquet_place(self.path), page_checksum_verification=True) as file:
                column = file.read_row_group(self.group, columns=[name], use_threads=False).column(0)
                if len(column) != self.count:
                    raise ValueError(f"{name} has {len(column)} of {self.count} rows")
                return numbers_of(column).astype(np.float64, copy=False)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise FormatError(f"{self.path.name}: row group {self.group} is damaged ({error})") from None


def _piece(path: Path, file: pq.ParquetFile, k: int) -> Piece:
    group = file.read_row_group(k, columns=["counter", "monotonic_ns", "utc_ns", "flags"])
    counter, monotonic, utc, flags = map(numbers_of, group.columns)
    ends = np.flatnonzero(np.append(np.diff(utc) != 0, True))  # of batches
    some = ends[np.unique(np.linspace(0, ends.size - 1, _MARKS).round().astype(int))]
    clocks = np.stack([counter, monotonic, utc], axis=1)[some]
    return Piece.of(_GroupRows(path=path, group=k, count=counter.size), counter, flags, clocks)


def _schema(header: Header, run: Run, end: int) -> pa.Schema:
    import pyarrow as pa

    facts = {
        "header": header.to_json(),
        "status": run.status,
        "reason": run.reason,
        "end": end,
        "manifest": list(run.manifest),
    }
    return pa.schema(
        [
            pa.field("counter", pa.int64(), nullable=False),
            pa.field("monotonic_ns", pa.int64(), nullable=False),
            pa.field("utc_ns", pa.int64(), nullable=False),
            pa.field("flags", pa.uint8(), nullable=False),
            *(
                pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit})
                for c in header.channels
            ),
        ],
        metadata={KEY: json.dumps(facts, ensure_ascii=False)},
    )


def _groups(run: Run, part: int | None, schema: pa.Schema) -> Iterator[pa.Table]:
    """The rows of a run in tables of about a million; each of them one row group."""
    waiting: list[Batch] = []
    for batch in run.batches(part):
        waiting.append(batch)
        if sum(map(len, waiting)) >= _ROWS:
            yield _table(waiting, schema)
            waiting = []
    if waiting:
        yield _table(waiting, schema)


def _same(one: pa.Table, other: pa.Table) -> bool:
    """The same columns with the same values; a value that is missing (NaN) is equal to one that is."""
    return bool(one.schema.equals(other.schema)) and all(
        np.array_equal(numbers_of(one.column(n)), numbers_of(other.column(n)), equal_nan=True)
        for n in one.schema.names
    )


def _table(batches: list[Batch], schema: pa.Schema) -> pa.Table:
    import pyarrow as pa

    columns: list[NDArray[Any]] = [
        np.concatenate([b.counter for b in batches]),
        np.concatenate([b.monotonic_ns for b in batches]),
        np.repeat(np.array([b.utc_ns for b in batches], dtype=np.int64), [len(b) for b in batches]),
        np.concatenate([b.flags for b in batches]),
        *np.concatenate([b.values for b in batches]).T,
    ]
    return pa.table([arrow_of(c) for c in columns], schema=schema)
