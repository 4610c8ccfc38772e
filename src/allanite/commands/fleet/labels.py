# SPDX-License-Identifier: BSD-3-Clause
"""What is known of a log beside its samples: from its path, and from a table that the user keeps."""

from __future__ import annotations

import csv
import hashlib
import io
import re
from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Any

from allanite.commands.fleet.pattern import PathPattern, date_of
from allanite.commands.fleet.table import COLUMNS
from allanite.errors import InputError
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["LABELS", "LogLabels"]

#: LogLabels that every table has.
LABELS = ("unit", "lot", "date", "temperature")
_TAKEN = frozenset(c.name for c in COLUMNS) - {*LABELS, "log"}
_KEYS = ("log", "unit")
#: A number with no leading zero, of no more digits than a double keeps.
_QUANTITY = re.compile(r"[+-]?(?!0\d)(?!(?:\.?\d){16})(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


class LogLabels:
    """LogLabels of logs, by their paths.

    Parameters
    ----------
    pattern : str, optional
    metadata : str, optional
        A CSV file with a column "log" (path as given, or name of the file) or "unit". Its other columns are labels.

    Raises
    ------
    InputError
        A pattern or a table that names no log, or a label with the name of a column of results.
    """

    def __init__(self, pattern: str | None = None, metadata: str | None = None) -> None:
        self._pattern = None if pattern is None else PathPattern(pattern)
        self._key, self._table = ("", {}) if metadata is None else _metadata(metadata)
        columns = next(iter(self._table.values()), {})
        placed = () if self._pattern is None else self._pattern.names
        known = repr((pattern, self._key, self._table)).encode()
        self.key = hashlib.sha256(known).hexdigest()  # of labels of the same logs
        self.further = tuple(dict.fromkeys(name for name in (*placed, *columns) if name not in LABELS))
        if taken := _TAKEN.intersection(self.further):
            raise InputError(
                f"{', '.join(sorted(taken))}: the table of results has such a column; rename the label"
            )

    def refusal(self, log: str) -> str:
        """Why a log has no labels; "" where it has."""
        try:
            self.of(log)
        except InputError as reason:
            return str(reason)
        return ""

    def of(self, log: str) -> dict[str, Any]:
        """LogLabels of a log: text, float, datetime or None.

        Raises
        ------
        InputError
            The path does not match the pattern, or a date or a temperature is none.
        """
        labels: dict[str, Any] = dict.fromkeys((*LABELS, *self.further))
        labels["unit"] = PurePosixPath(log).stem
        if self._pattern is not None:
            fields = self._pattern.fields(log)
            if fields is None:
                raise InputError(f"the path does not match the pattern {self._pattern.text!r}")
            labels |= fields
        labels |= {k: v for k, v in self._row(log, labels["unit"]).items() if v is not None}
        return labels | _typed(labels)

    def _row(self, log: str, unit: str) -> Mapping[str, Any]:
        if self._key == "log":
            return self._table.get(log) or self._table.get(PurePosixPath(log).name) or {}
        return self._table.get(unit, {})


def _typed(labels: Mapping[str, Any]) -> dict[str, Any]:
    """Date and temperature as what they are."""
    made: dict[str, Any] = {}
    try:
        if isinstance(labels["date"], str):
            made["date"] = date_of(labels["date"])
        if isinstance(labels["temperature"], str):
            made["temperature"] = float(labels["temperature"].replace("−", "-"))
    except ValueError as fault:
        raise InputError(f"date or temperature: {fault}") from None
    return made


def _metadata(path: str) -> tuple[str, dict[str, dict[str, Any]]]:
    """The key of a metadata table, and its rows by that."""
    try:
        rows = list(csv.DictReader(io.StringIO(read_regular_text(path)), restkey=""))
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise InputError(f"the metadata {path} cannot be read: {fault}") from None
    names = [*(rows[0] if rows else ())]
    key = next((k for k in _KEYS if k in names), "")
    if not key or "" in names:
        raise InputError(
            f"the metadata {path} needs a column 'unit' or 'log', a heading for every column, and rows"
        )
    cells = {name: [(row[name] or "").strip() or None for row in rows] for name in names}
    columns = {
        name: _column(texts) if name not in LABELS else texts
        for name, texts in cells.items()
        if name != key or name == "unit"
    }
    table = {
        cells[key][i] or "": {name: values[i] for name, values in columns.items()} for i in range(len(rows))
    }
    if len(table) < len(rows):
        raise InputError(f"the metadata {path} has a {key} twice; keep one row for each")
    return key, table


def _column(texts: list[str | None]) -> list[Any]:
    """Numbers where every cell that is not empty is one and no name (0012, 1.10 beside 1.1) is lost; else text."""
    given = {text for text in texts if text is not None}
    if all(map(_QUANTITY.fullmatch, given)) and len(set(map(float, given))) == len(given):
        return [None if text is None else float(text) for text in texts]
    return list(texts)
