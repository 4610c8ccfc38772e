# SPDX-License-Identifier: BSD-3-Clause
"""The table of a fleet, as columns: one row for each log, channel and coefficient."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.stability.fleet.levels import LEVELS
from allanite.stability.fleet.table_files import table_files

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["UNIT_OF", "FleetRows", "at_rest", "one_unit", "read_rows", "read_table"]

Array = NDArray[np.float64]
Texts = NDArray[np.object_]
Filters = list[tuple[str, str, object]]

_NEEDED = ("log", "unit", "channel", "kind", "term", "profile", "root_at_zero", "unit_of_measure")
_KNOWN = frozenset(
    {*_NEEDED, "sha256", "lot", "date", "temperature", "family", "status", "estimate", "lower", "upper"}
    | {"confidence", "p", "findings", "rate", "span", "samples", "error", "version", "seconds"}
)
#: A coefficient, and the unit of its numbers.
UNIT_OF = ["channel", "term", "unit_of_measure"]
_YEAR = 365.25
_TURNED = "motion"  # of the findings


@dataclass(frozen=True, slots=True)
class FleetRows:
    """Rows that have a profile.

    Attributes
    ----------
    log, unit, lot, channel, kind, symbol, unit_of_measure : ndarray of str, shape (n,)
        `lot` is "" where none is given.
    knots : ndarray of float32, shape (n, 9)
        x at the levels.
    root_at_zero : ndarray, shape (n,)
        Signed root at zero.
    conditions : mapping of str to ndarray, shape (n,)
        "temperature" [degC], "date" [years], and every numeric column of the user; NaN where a log has none.
    logs, failed : int
        Logs of the table, and those that could not be studied.
    turned : tuple of str
        Logs in which the unit was turned; their rows are not here, for they describe the turn.
    """

    log: Texts
    unit: Texts
    lot: Texts
    channel: Texts
    kind: Texts
    symbol: Texts
    unit_of_measure: Texts
    knots: NDArray[np.float32]
    root_at_zero: Array
    conditions: Mapping[str, Array]
    logs: int
    failed: int
    turned: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.log)

    def where(self, channel: str, symbol: str) -> NDArray[np.intp]:
        """Rows of one coefficient, sorted by lot and unit."""
        rows = np.flatnonzero((self.channel == channel) & (self.symbol == symbol))
        return rows[np.lexsort((self.log[rows], self.unit[rows], self.lot[rows]))]


def read_rows(source: str | Path | pa.Table) -> FleetRows:
    """Read the table of a fleet.

    Parameters
    ----------
    source : path or pyarrow.Table
        ``fleet.parquet``, a folder or a file, the folder that holds it, or the table itself.

    Raises
    ------
    InputError
        No such table, one that lacks columns, or a coefficient that some logs state in another unit.
    """
    table = read_table(source)
    missing = [name for name in _NEEDED if name not in table.column_names]
    if missing:
        raise InputError(f"{source}: no table of a fleet; it lacks the columns {', '.join(missing)}")
    import pyarrow.compute as pc

    logs = pc.count_distinct(table["log"]).as_py()
    failed = pc.count_distinct(table.filter(pc.is_null(table["channel"]))["log"]).as_py()
    kept = table.filter(pc.and_(pc.is_valid(table["profile"]), pc.is_valid(table["term"]))).combine_chunks()
    kept, turned = at_rest(kept)
    one_unit(kept)
    texts = {
        name: _texts(kept[name]) for name in ("log", "unit", "channel", "kind", "term", "unit_of_measure")
    }
    knots = pc.list_flatten(kept["profile"]).to_numpy().reshape(len(kept), len(LEVELS))
    return FleetRows(
        log=texts["log"],
        unit=texts["unit"],
        lot=_texts(kept["lot"]) if "lot" in kept.column_names else np.full(len(kept), "", dtype=object),
        channel=texts["channel"],
        kind=texts["kind"],
        symbol=texts["term"],
        unit_of_measure=texts["unit_of_measure"],
        knots=knots,
        root_at_zero=np.asarray(kept["root_at_zero"].to_numpy(), dtype=np.float64),
        conditions=_conditions(kept),
        logs=logs,
        failed=failed,
        turned=turned,
    )


def at_rest(table: pa.Table) -> tuple[pa.Table, tuple[str, ...]]:
    """The rows without those of logs in which the unit was turned, and the names of these logs."""
    import pyarrow.compute as pc

    if "findings" not in table.column_names:
        return table, ()
    codes = table["findings"].combine_chunks()
    moving = pc.list_parent_indices(codes).filter(pc.equal(pc.list_flatten(codes), _TURNED))
    if len(moving) == 0:
        return table, ()
    names = pc.unique(table["log"].take(moving))
    others = table.filter(pc.invert(pc.is_in(table["log"], names)))
    return others.combine_chunks(), tuple(sorted(names.to_pylist()))


def one_unit(table: pa.Table) -> None:
    """Refuse a table in which logs state one coefficient in different units: their numbers are not comparable.

    Raises
    ------
    InputError
        With the logs of the rarer unit.
    """
    import pyarrow.compute as pc

    usual: dict[tuple[str, str], Mapping[str, Any]] = {}
    counted = table.group_by(UNIT_OF).aggregate([([], "count_all")]).sort_by([("count_all", "descending")])
    for row in counted.to_pylist():
        most = usual.setdefault((row["channel"], row["term"]), row)
        if most is not row:
            same = (pc.equal(table[name], row[name]) for name in UNIT_OF)
            log = table["log"].filter(functools.reduce(pc.and_, same))[0].as_py()
            raise InputError(
                f"{row['term']} of {row['channel']} is in {most['unit_of_measure']} in "
                f"{plural(most['count_all'], 'log')} and in {row['unit_of_measure']} in "
                f"{plural(row['count_all'], 'log')}, such as {log}. Run the logs of the wrong unit again, alone and "
                "into the same folder (allanite fleet run LOGS --unit UNIT), or all others into a new one"
            )


def read_table(
    source: str | Path | pa.Table, columns: Sequence[str] | None = None, filters: Filters | None = None
) -> pa.Table:
    """The table of a fleet, out of its folder, its file, or as it is.

    Parameters
    ----------
    source : path or pyarrow.Table
    columns : sequence of str, optional
        Of a table on disk: those to read.
    filters : list of tuple, optional
        Of a table on disk: rows to read, as pyarrow takes them.

    Raises
    ------
    InputError
        No such table.
    """
    if not isinstance(source, (str, Path)):
        return source
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        files = table_files(Path(source))
        if not files:
            raise InputError(f"{source}: no table of a fleet, as `fleet run` writes it")
        return pq.read_table(files, columns=columns, filters=filters)
    except (OSError, pa.ArrowInvalid) as error:
        raise InputError(f"{source}: no table of a fleet ({error})") from None


def _texts(column: pa.ChunkedArray) -> Texts:
    """Of each row; rows with one text share it, so that millions of rows take eight bytes each."""
    import pyarrow.compute as pc

    encoded = pc.fill_null(column.cast("string"), "").dictionary_encode().combine_chunks()
    names = np.asarray(encoded.dictionary.to_pylist(), dtype=object)
    return np.asarray(names[encoded.indices.to_numpy()], dtype=object)


def _conditions(table: pa.Table) -> dict[str, Array]:
    """Numbers that a log was recorded under."""
    import pyarrow as pa

    conditions: dict[str, Array] = {}
    names: Sequence[str] = table.column_names
    for name in names:
        column = table[name]
        if name == "date" and (pa.types.is_timestamp(column.type) or pa.types.is_date(column.type)):
            days = column.cast(pa.timestamp("s")).to_numpy().astype("datetime64[s]")
            seconds = np.where(np.isnat(days), np.nan, days.astype(np.float64))
            conditions[name] = 1970.0 + seconds / 86400 / _YEAR
        elif name == "temperature" or (name not in _KNOWN and pa.types.is_floating(column.type)):
            conditions[name] = np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64)
    return conditions
