# SPDX-License-Identifier: BSD-3-Clause
"""Samples in memory as a Recording: arrays, dictionaries of them, and tables of pandas, polars, xarray and Arrow.

They go the way of a file, from the columns on: time is found or stated, gaps keep their place, and findings are the
same. Tables are taken by what they offer (`__arrow_c_stream__`), so that no library is loaded that is not there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.arrays import chosen_table, table_of
from allanite.files.readers.assembly import assemble
from allanite.files.readers.packed_values import as_stored
from allanite.files.readers.table import Options, Table
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import ArrayColumn, Recording

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["recording_of"]

_TIME = "time"
_TIME_UNITS = ("s", "ms", "us", "ns")
_FROM_INDEX = "__index_level_0__"  # what pandas calls an index without a name


def recording_of(
    data: object, *, time: object, time_unit: str | None, names: Sequence[str] | None, **given: Any
) -> Recording:
    """See `Recording.from_samples`; what is given beside the time are `Options`."""
    what, options = _what(data), Options(**given)
    if options.carrier is not None and options.kind is None:
        raise InputError("carrier= goes with kind='phase' or kind='frequency'")
    if isinstance(time, str) or time is None:
        if time_unit is not None:
            raise InputError("time_unit= goes with stamps in time=; for a column write time='t:ms'")
        options = replace(options, time=time)
        table = _table(data, names, options, what)
    else:
        table = _with_time(_table(data, names, options, what), time, time_unit, what)
        options = replace(options, time=str(table.numbers[-1] if table.numbers else len(table.columns)))
    return replace(assemble(table, options, what), source="")


def _what(data: object) -> str:
    """What the data are called in messages: pandas DataFrame, dict."""
    package = type(data).__module__.partition(".")[0]
    name = type(data).__name__
    return name if package in ("builtins", "numpy") else f"{package} {name}"


# -- tables ------------------------------------------------------------------------------------------------


def _table(data: Any, names: Sequence[str] | None, options: Options, what: str) -> Table:
    if names is not None and (
        isinstance(data, Mapping) or hasattr(data, "__arrow_c_stream__") or hasattr(data, "columns")
    ):
        raise InputError(f"{what}: names= goes with an array; its columns have names: rename them there")
    if _is_of(data, "xarray"):
        return _of_xarray(data, what)
    if _is_of(data, "pandas"):
        return _of_pandas(data, what)
    if hasattr(data, "__arrow_c_stream__"):
        return _of_arrow(data, what)
    if isinstance(data, Mapping):
        arrays = {str(name): _values(values, what) for name, values in data.items()}
        return chosen_table(arrays, options, what, what)
    table = table_of({"": _array(data, what)}, {}, what, what)
    if names is None:
        return table
    if len(names) != len(table.columns):
        raise InputError(f"{what}: {len(names)} names for {len(table.columns)} columns")
    return replace(table, headings=tuple(names))


def _is_of(data: object, package: str) -> bool:
    return type(data).__module__.partition(".")[0] == package


def _values(values: object, what: str) -> NDArray[Any]:
    """A column of a mapping, or a number or text that describes the others."""
    alone = np.ndim(values) == 0 and isinstance(values, (str, int, float, np.generic))  # type: ignore[arg-type]
    return np.asarray(values) if alone else _array(values, what)


def _array(values: object, what: str) -> NDArray[Any]:
    if isinstance(values, (str, bytes)) or hasattr(values, "read"):
        raise InputError(f"from_samples needs samples, not a {what}; al.read reads files")
    if hasattr(values, "collect"):
        raise InputError(f"{what}: its rows are not computed yet; pass data.collect()")
    array = values if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    if array.ndim == 0:
        raise InputError(f"from_samples needs an array, a mapping of columns or a table, not a {what}")
    return _moments(values) if array.dtype.kind == "O" and array.ndim == 1 else array


def _of_arrow(data: Any, what: str) -> Table:
    """A table of Arrow, or of any library that gives one; a single column (Series) as well."""
    import pyarrow as pa

    from allanite.files.readers.arrow_columns import brief, table_of_arrow

    alone = hasattr(data, "to_frame") and hasattr(data, "name")  # a Series
    try:
        table: pa.Table = pa.table(data.to_frame() if alone else data)
    except (pa.ArrowException, ValueError, TypeError) as error:
        raise InputError(f"{what}: it gives no table ({brief(error)})") from None
    return table_of_arrow(
        table.schema,
        [table.num_rows],
        lambda _, name: table.column(name),
        form=what,
        name=what,
        source={},
    )


def _of_pandas(data: Any, what: str) -> Table:
    """Columns of numbers and times, and the index unless it only counts the rows."""
    import pyarrow as pa

    from allanite.files.readers.arrow_columns import brief

    frame = data if hasattr(data, "columns") else data.to_frame(_name_of(data))
    if frame.columns.nlevels > 1:
        frame = frame.set_axis(["_".join(map(str, one)).strip("_") for one in frame.columns], axis=1)
    used = frame.select_dtypes(include=["number", "datetime", "datetimetz", "timedelta"])
    left_out = [str(name) for name in frame.columns if name not in used.columns]
    try:
        table = pa.Table.from_pandas(used)
    except (pa.ArrowException, ValueError, TypeError) as error:
        raise InputError(f"{what}: its columns cannot be read ({brief(error)})") from None
    names = [_index_name(table) if n == _FROM_INDEX else n for n in table.column_names]
    result = _of_arrow(table.rename_columns(names), what)
    if not left_out:
        return result
    return replace(
        result,
        guesses=(*result.guesses, f"columns without numbers left out: {', '.join(left_out)}"),
        left_out=tuple(left_out),
        words=tuple(
            _FrameWords(str(name), frame[name])
            for name in frame.columns
            if name not in used.columns and list(frame.columns).count(name) == 1
        ),
    )


@dataclass(frozen=True, slots=True)
class _FrameWords:
    """A column of pandas that holds no numbers."""

    name: str
    series: Any

    def read(self, start: int, stop: int) -> NDArray[np.str_]:
        return np.array([str(word) for word in self.series.iloc[start:stop]], dtype=np.str_)


def _index_name(table: pa.Table) -> str:
    """What an index without a name is called: whole numbers are those of the rows that are left."""
    import pyarrow as pa

    counts = pa.types.is_integer(table.schema.field(_FROM_INDEX).type)
    return "index" if counts or _TIME in table.column_names else _TIME


def _name_of(series: Any) -> str:
    return "signal" if series.name is None else str(series.name)


def _of_xarray(data: Any, what: str) -> Table:
    """Variables along one dimension, with the coordinate of it and the units of their attributes."""
    if hasattr(data, "data_vars"):
        dataset = data
    elif data.ndim == 2:
        dataset = data.to_dataset(dim=min(data.dims, key=lambda d: data.sizes[d]))
    else:
        dataset = data.to_dataset(name=_name_of(data))
    if len(dataset.sizes) != 1:
        raise InputError(
            f"{what}: samples lie along one dimension, not along {', '.join(map(str, dataset.sizes))}; select the "
            "others, as in data.isel(sensor=0)"
        )
    units = {str(name): variable.attrs.get("units", "") for name, variable in dataset.variables.items()}
    units |= {str(name): units[str(name)] or data.attrs.get("units", "") for name in dataset.data_vars}
    unapplied: list[str] = []
    for (
        name,
        variable,
    ) in dataset.data_vars.items():  # what xarray itself has applied is no attribute any more
        key = str(name)
        units[key], notes = as_stored(key, variable.dtype, variable.attrs, str(units[key]), applied=())
        unapplied += notes
    table = _of_pandas(dataset.reset_coords(drop=True).to_dataframe(), what)
    of_columns = tuple(
        "" if i in table.time_units else str(units.get(h, "")) for i, h in enumerate(table.headings)
    )
    return replace(
        table,
        units=of_columns,
        units_from="metadata" if any(of_columns) else "none",
        guesses=(*table.guesses, *unapplied),
    )


# -- time --------------------------------------------------------------------------------------------------


def _with_time(table: Table, time: object, unit: str | None, what: str) -> Table:
    """The table with stamps that were given apart as its last column."""
    array = _array(time, what) if np.ndim(time) else np.asarray(time)  # type: ignore[arg-type]
    if array.ndim != 1 or array.dtype.kind not in "iufmM":
        raise InputError(
            "time= needs a column of seconds or of dates and times, or the name of a column, not "
            f"{array.dtype} of shape {array.shape}"
        )
    if table.columns and len(array) != len(table.columns[0]):
        raise InputError(f"{what}: {len(table.columns[0])} samples, but time= has {len(array)} stamps")
    if unit not in (None, *_TIME_UNITS):
        raise InputError(f"time_unit={unit!r}: it is one of {', '.join(_TIME_UNITS)}")
    dated = array.dtype.kind == "M"
    if array.dtype.kind in "mM":
        if unit is not None:
            raise InputError(f"time_unit={unit!r}: the stamps are {array.dtype}, which has a unit")
        array, unit = array.astype(f"{array.dtype.kind}8[ns]").view(np.int64), "ns"
    elif unit is None and array.dtype.kind in "iu":
        raise InputError(
            "time= holds whole numbers: state what one of them is, time_unit='ns' ('us', 'ms' or 's')"
        )
    heading = _TIME if dated else f"{_TIME} [{unit or 's'}]"
    return replace(
        table,
        headings=(*table.headings, heading),
        columns=(*table.columns, ArrayColumn(array)),
        units=(*table.units, "") if table.units else (),
        numbers=(*table.numbers, max(table.numbers) + 1) if table.numbers else (),
        time_units={**table.time_units, len(table.columns): "iso8601"} if dated else table.time_units,
    )


def _moments(values: Any) -> NDArray[Any]:
    """Dates and times of Python or of a table, in UTC; NaT where there is none.

    Raises
    ------
    InputError
        Something else is among them.
    """
    try:
        if hasattr(values, "to_numpy"):
            array = np.asarray(values.to_numpy())
            return array if array.dtype.kind == "M" else np.asarray(values.to_numpy(dtype="datetime64[ns]"))
        return np.array([_utc(one) for one in values], dtype="datetime64[ns]")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"a column holds neither numbers nor dates and times ({error})") from None


def _utc(moment: Any) -> Any:
    """A moment without its zone, which NumPy does not know."""
    if getattr(moment, "tzinfo", None) is None:
        return moment
    return moment.astimezone(UTC).replace(tzinfo=None)
