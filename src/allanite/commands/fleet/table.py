# SPDX-License-Identifier: BSD-3-Clause
"""The columns of the table of a fleet, and rows as an Arrow table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["COLUMNS", "LABEL_END", "TableColumn", "arrow_table", "arrow_type"]


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column.

    Attributes
    ----------
    name : str
    type : str
        "string", "float64", "float32", "int64", "timestamp" (microseconds, UTC), "strings" or "levels" (nine float32).
    meaning : str
        With its unit.
    """

    name: str
    type: str
    meaning: str


COLUMNS = (
    TableColumn("log", "string", "Path or address of the log, as given"),
    TableColumn("sha256", "string", "SHA-256 of the log; null for a folder, and where it was not read"),
    TableColumn("unit", "string", "Device, from the pattern or the metadata; else the file name without its suffix"),
    TableColumn("lot", "string", "From the pattern or the metadata"),
    TableColumn("date", "timestamp", "From the pattern or the metadata; else the start of the record, UTC"),
    TableColumn("temperature", "float64", "From the pattern or the metadata; else mean of a temperature channel [°C]"),
    TableColumn("channel", "string", "Name; null where the log failed"),
    TableColumn("kind", "string", "What the channel measures: `rate`, `acceleration`, ..."),
    TableColumn("family", "string", "Family of the model that the estimate is of: `flicker` or `gauss-markov`"),
    TableColumn("term", "string", "Q, N, B, K, R; sigma, T, B_equiv of a Gauss-Markov term; null without a model"),
    TableColumn("status", "string", "`resolved`, `upper_limit`, `not_resolved`, or `error`"),
    TableColumn("estimate", "float64", "Of the study, SI; null unless resolved"),
    TableColumn("lower", "float64", "Lower end of its interval, SI; 0 for an upper limit"),
    TableColumn("upper", "float64", "Upper end of its interval, SI; null where there is none"),
    TableColumn("unit_of_measure", "string", "SI unit of the coefficient; for counts and unknown units the channel's"),
    TableColumn("confidence", "float64", "Of the interval"),
    TableColumn("p", "float64", "Probability of a misfit as large as that of the model"),
    TableColumn(
        "profile", "levels", "ln of the coefficient (SI) where the signed root of its profile loss is −4, −2.5, −1.5, "
        "−0.75, 0, 0.75, 1.5, 2.5 and 4; −inf where it never gets so low, +inf where it never gets so high",
    ),
    TableColumn(
        "root_at_zero", "float32", "Signed root of the loss at a coefficient of zero; −inf beyond all levels"
    ),
    TableColumn("findings", "strings", "Codes of the findings of the log and of the channel"),
    TableColumn("rate", "float64", "Sample rate of the channel [Hz]"),
    TableColumn("span", "float64", "Length of the record [s]"),
    TableColumn("samples", "int64", "Samples that are not missing"),
    TableColumn("error", "string", "Class and message, where the log or the channel failed"),
    TableColumn("version", "string", "Of allanite"),
    TableColumn("seconds", "float64", "Processor time that the log took [s]"),
)  # fmt: skip
"""In their order; further labels of the pattern and the metadata follow `temperature`."""

LABEL_END = "temperature"


def arrow_type(name: str) -> pa.DataType:
    """The Arrow type behind the name that a `TableColumn` has for it."""
    import pyarrow as pa

    return {
        "string": pa.string(),
        "float64": pa.float64(),
        "float32": pa.float32(),
        "int64": pa.int64(),
        "timestamp": pa.timestamp("us"),
        "strings": pa.list_(pa.string()),
        "levels": pa.list_(pa.float32(), 9),
    }[name]


def arrow_table(rows: Sequence[Mapping[str, Any]], columns: Iterable[TableColumn]) -> pa.Table:
    """Rows, of which any may lack a column, as a table."""
    import pyarrow as pa

    columns = tuple(columns)
    arrays = [pa.array([row.get(c.name) for row in rows], arrow_type(c.type)) for c in columns]
    return pa.table(arrays, names=[c.name for c in columns])
