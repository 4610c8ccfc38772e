# SPDX-License-Identifier: BSD-3-Clause
"""The table of a fleet for the page: one coefficient of all logs, as an Arrow stream.

Numbers are in the unit in which people read the coefficient, NaN where there is none; texts are dictionaries. The
stream has one batch and no compression, so that the page reads its buffers in place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.errors import InputError
from allanite.quantities.display_units import coefficient_unit
from allanite.stability.fleet.rows import UNIT_OF, one_unit, read_table
from allanite.stability.fleet.table_files import table_files

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["fleet_stream"]

Json = Mapping[str, Any]

_TEXTS = ("log", "unit", "lot", "status")
_SCALED = ("estimate", "lower", "upper")
_MOST = 1_000_000  # rows


def fleet_stream(task: Json) -> Json:
    """Write the rows of a coefficient to a file.

    Parameters
    ----------
    task : mapping
        "table", the path of fleet.parquet; "file", that of the stream; "channel" and "term", or None for the first.

    Returns
    -------
    dict
        "coefficients", all pairs of channel and term; "chosen", the pair of the stream; "unit"; "rows".

    Raises
    ------
    InputError
        No table of a fleet, no such coefficient, or too many rows.
    """
    import pyarrow as pa
    import pyarrow.ipc as ipc

    pairs = _coefficients(task["table"])
    asked = (task.get("channel"), task.get("term"))
    chosen = pairs[0] if None in asked else asked
    if chosen not in pairs:
        raise InputError(f"the fleet has no {chosen[1]} of {chosen[0]}")
    table, unit = _rows(task["table"], *chosen)
    if len(table) > _MOST:
        raise InputError(f"{len(table)} logs are too many for the page, which takes {_MOST}")
    with pa.OSFile(task["file"], "wb") as sink, ipc.new_stream(sink, table.schema) as stream:
        for batch in table.combine_chunks().to_batches():
            stream.write_batch(batch)
    return {"coefficients": pairs, "chosen": chosen, "unit": unit, "rows": len(table)}


def _coefficients(path: str) -> list[tuple[str, str]]:
    try:
        table = read_table(path, columns=["channel", "term"])
    except InputError:  # which names the whole path
        raise InputError(f"{Path(path).name}: no table of a fleet that can be read") from None
    distinct = table.group_by(["channel", "term"]).aggregate([([], "count_all")]).to_pylist()
    order = {symbol: i for i, symbol in enumerate("QNBKR")}
    pairs = [(r["channel"], r["term"]) for r in distinct if r["channel"] and r["term"] in order]
    if not pairs:
        raise InputError(f"{Path(path).name}: no log of this fleet has a coefficient")
    logs = {(r["channel"], r["term"]): r["count_all"] for r in distinct}
    return sorted(pairs, key=lambda p: (p[1] != "N", -logs[p] if p[1] == "N" else 0, p[0], order[p[1]]))


def _rows(path: str, channel: str, term: str) -> tuple[pa.Table, str]:
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    present = pq.read_schema(table_files(Path(path))[0]).names
    wanted = [*_TEXTS, *_SCALED, "temperature", "date", "kind", *UNIT_OF]
    table = read_table(
        path,
        columns=[name for name in wanted if name in present],
        filters=[("channel", "=", channel), ("term", "=", term)],
    )
    one_unit(table)
    unit, factor = coefficient_unit(str(table["kind"][0]), term, str(table["unit_of_measure"][0]))
    columns: dict[str, pa.Array] = {}
    for name in table.column_names:
        column = table[name].combine_chunks()
        if name in _TEXTS:
            plain = pc.fill_null(column.cast(pa.string()), "")
            columns[name] = pc.dictionary_encode(plain).cast(pa.dictionary(pa.int32(), pa.string()))
        elif name in _SCALED:
            columns[name] = pc.fill_null(pc.divide(column.cast(pa.float64()), factor), math.nan)
        elif name == "temperature":
            columns[name] = pc.fill_null(column.cast(pa.float64()), math.nan)
        elif name == "date":
            milliseconds = column.cast(pa.timestamp("ms"), safe=False).cast(pa.int64()).cast(pa.float64())
            columns[name] = pc.fill_null(milliseconds, math.nan)
    return pa.table(columns), unit
