# SPDX-License-Identifier: BSD-3-Clause
"""Results as columns: for pandas, polars, Arrow, and the cells of a notebook.

One row for each number that has an uncertainty; a curve gives its points.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from itertools import islice
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError

__all__ = ["Columns", "Tabular"]

#: Columns of equal length by their names.
Columns = dict[str, "Sequence[object] | NDArray[Any]"]

_SHOWN = 20
_LABELS = ("name", "symbol", "channel", "parameter", "quantity")


class Tabular:
    """What can be shown, and handed to other libraries, as one table."""

    __slots__ = ()

    def to_columns(self) -> Columns:
        """The table as columns of equal length; SI units.

        A result gives one row for each number with an uncertainty: its place in the result (`name`), `value` (NaN where
        only a limit is known), `sd`, `lower`, `upper` (NaN where there is none), `unit`, `status`. One without such
        numbers, a curve or a spectrum, gives its arrays.
        """
        rows = [*_numbers(self, "")]
        return _by_column(rows) if rows else _arrays_of(self) or _by_column(rows)

    def to_frame(self) -> Any:
        """The table as a DataFrame of pandas, or of polars where pandas is not installed.

        Raises
        ------
        InputError
            Neither is installed.
        """
        for name in ("pandas", "polars"):
            try:
                library = import_module(name)
            except ImportError:
                continue
            return library.DataFrame(self.to_columns())
        raise InputError("to_frame needs pandas or polars: pip install pandas; to_columns() needs neither")

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """The table for any library that takes Arrow: ``polars.DataFrame(result)``, ``pyarrow.table(result)``."""
        import pyarrow as pa

        columns, units = self.to_columns(), self._units()
        table = pa.table({name: pa.array(np.asarray(values)) for name, values in columns.items()})
        marked = [f.with_metadata({"unit": units[f.name]}) if f.name in units else f for f in table.schema]
        return table.cast(pa.schema(marked)).__arrow_c_stream__(requested_schema)

    def _units(self) -> Mapping[str, str]:
        """Units of columns that have one, for the metadata of Arrow."""
        return {}

    def _repr_html_(self) -> str:
        from html import escape

        columns = self.to_columns()
        length = len(next(iter(columns.values()), ()))
        heads = "".join(f"<th>{escape(name)}</th>" for name in columns)
        rows = islice(zip(*columns.values(), strict=True), _SHOWN)
        body = "".join(f"<tr>{''.join(f'<td>{escape(_cell(one))}</td>' for one in row)}</tr>" for row in rows)
        more = f" ({length - _SHOWN} more rows)" if length > _SHOWN else ""
        return (
            f"<table><caption>{escape(_title(self))}{more}</caption>"
            f"<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        )

    def __array__(self, *_: object, **__: object) -> NoReturn:
        raise InputError(
            f"{type(self).__name__} is not an array: take its attributes, or to_columns() for its table"
        )


def _title(result: object) -> str:
    """The name of the class, and the verdict where there is one."""
    verdict = getattr(getattr(result, "verdict", ""), "words", getattr(result, "verdict", ""))
    return (
        f"{type(result).__name__}: {verdict}"
        if isinstance(verdict, str) and verdict
        else type(result).__name__
    )


def _cell(value: object) -> str:
    if isinstance(value, (float, np.floating)):
        return "–" if math.isnan(value) else f"{value:.6g}"
    return str(value)


def _arrays_of(result: object) -> Columns:
    """One-dimensional arrays of the length that most of them have; none where a single one has it."""
    if not is_dataclass(result):
        return {}
    values = {f.name: getattr(result, f.name) for f in fields(result)}
    arrays = {k: v for k, v in values.items() if isinstance(v, np.ndarray) and v.ndim == 1 and len(v)}
    lengths = Counter(map(len, arrays.values())).most_common(1)
    if not lengths or lengths[0][1] < 2:
        return {}
    return {name: array for name, array in arrays.items() if len(array) == lengths[0][0]}


def _numbers(part: object, place: str) -> Iterator[dict[str, object]]:
    """A row for each number with an interval or a standard uncertainty, by its place."""
    if (ends := _ends_of(part)) is not None:
        yield _row(place, part.value, getattr(part, "sd", None), ends, part)  # type: ignore[attr-defined]
    elif isinstance(part, Tabular) and type(part).to_columns is not Tabular.to_columns:
        yield from _rows_of(part.to_columns(), place)
    elif is_dataclass(part):
        for name in (*getattr(part, "STATED", ()), *(f.name for f in fields(part))):
            value, sd = getattr(part, name), getattr(part, f"{name}_sd", None)
            if sd is not None and _is_number(value) and _is_number(sd):
                yield _row(_joined(place, name), value, sd, (None, None))
            else:
                yield from _numbers(value, _joined(place, name))
    elif isinstance(part, Mapping):
        for key, inner in part.items():
            yield from _numbers(inner, _joined(place, str(key)))
    elif isinstance(part, (tuple, list)):
        for i, inner in enumerate(part):
            labels = (getattr(inner, label, None) for label in _LABELS)
            label = next((one for one in labels if isinstance(one, str) and one), str(i))
            yield from _numbers(inner, _joined(place, label))


def _ends_of(part: Any) -> tuple[object, object] | None:
    """The interval of a part that is a number with one."""
    if not _is_number(getattr(part, "value", "")):
        return None
    pair = getattr(part, "interval", None)
    lower, upper = (
        pair if isinstance(pair, tuple) else (getattr(part, "lower", ""), getattr(part, "upper", ""))
    )
    return (lower, upper) if _is_number(lower) and _is_number(upper) else None


def _row(
    place: str, value: object, sd: object, ends: tuple[object, object], of: object = None
) -> dict[str, object]:
    numbers = zip(("value", "sd", "lower", "upper"), (value, sd, *ends), strict=True)
    words = {key: str(getattr(of, key, "")) for key in ("unit", "status")}
    return {"name": place, **{key: _number(one) for key, one in numbers}, **words}


def _rows_of(columns: Columns, place: str) -> Iterator[dict[str, object]]:
    """The rows of a part that has a table of its own, such as a noise model, if they are numbers with intervals."""
    if "term" in columns:
        for i, term in enumerate(columns["term"]):
            row = {key: columns[key][i] for key in ("value", "lower", "upper", "unit", "status")}
            yield {"name": _joined(place, str(term)), "sd": math.nan, **row}


def _joined(place: str, name: str) -> str:
    return f"{place}.{name}" if place else name


def _is_number(value: object) -> bool:
    return value is None or (isinstance(value, (int, float, np.number)) and not isinstance(value, bool))


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _by_column(rows: Sequence[Mapping[str, object]]) -> Columns:
    names = ("name", "value", "sd", "lower", "upper", "unit", "status")
    return {name: [row[name] for row in rows] for name in names}
