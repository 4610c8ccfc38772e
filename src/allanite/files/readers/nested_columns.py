# SPDX-License-Identifier: BSD-3-Clause
"""Columns of Arrow and Parquet files that hold structures or lists of numbers, taken apart into columns of numbers.

A structure gives a column per member, called after both (``angular_velocity_x``); a list of the same length in all
rows gives one per place, an axis where there are three. What is taken apart is checked first: the offsets of a damaged
list may point anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from allanite.errors import FormatError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["NumberColumn", "number_columns"]

_DEEPEST = 4  # structures in structures
_WIDEST = 64  # places of a list: a longer one is a block of samples, not a vector

#: The chunks of a row group, by its number and the name of a column.
Decode = Callable[[int, str], "pa.ChunkedArray"]


@dataclass(frozen=True, slots=True)
class NumberColumn:
    """A column of numbers: where it stands in the file, and the steps from there to its numbers.

    Attributes
    ----------
    name, source : str
        What it is called, and the column of the file that holds it.
    type : pyarrow.DataType
        Of its numbers.
    steps : tuple of (str or int)
        Member of a structure, or place in a list, from outside to inside; and how long that list is.
    """

    name: str
    source: str
    type: Any
    metadata: dict[bytes, bytes]
    steps: tuple[tuple[str | int, int], ...] = ()

    def decoded(self, decode: Decode, group: int) -> pa.ChunkedArray:
        """The numbers of a row group.

        Raises
        ------
        FormatError
            A list is longer or shorter than the first one.
        """
        import pyarrow.compute as pc

        array = decode(group, self.source)
        if self.steps:
            array.validate(full=True)
        for step, length in self.steps:
            if isinstance(step, str):
                array = pc.struct_field(array, step)
                continue
            lengths = pc.unique(pc.list_value_length(array).drop_null())
            if lengths.to_pylist() not in ([], [length]):
                raise FormatError(
                    f"column {self.source}: lists of different lengths in row group {group}; write their "
                    "numbers to separate columns"
                )
            array = pc.list_element(array, step)
        return array


def number_columns(
    schema: pa.Schema, groups: int, decode: Decode, numeric: Callable[[Any], bool]
) -> list[NumberColumn]:
    """All columns of numbers, those inside structures and lists among them."""
    made: list[NumberColumn] = []
    for field in schema:
        if schema.names.count(field.name) > 1 and not numeric(field.type):
            continue  # columns are decoded by their name
        made += _inside(
            NumberColumn(field.name, field.name, field.type, field.metadata or {}), groups, decode, numeric
        )
    return made


def _inside(
    column: NumberColumn, groups: int, decode: Decode, numeric: Callable[[Any], bool]
) -> Iterator[NumberColumn]:
    import pyarrow as pa

    kind = column.type
    if numeric(kind):
        yield column
    elif len(column.steps) >= _DEEPEST:
        return
    elif pa.types.is_struct(kind):
        for member in kind:
            step = (member.name, 0)
            inner = NumberColumn(
                f"{column.name}_{member.name}",
                column.source,
                member.type,
                member.metadata or {},
                (*column.steps, step),
            )
            yield from _inside(inner, groups, decode, numeric)
    elif _is_list(kind) and numeric(kind.value_type):
        length = (
            kind.list_size if pa.types.is_fixed_size_list(kind) else _first_length(column, groups, decode)
        )
        places = range(length if length <= _WIDEST else 0)
        for k, end in zip(places, "xyz" if length == 3 else map(str, places), strict=True):
            steps = (*column.steps, (k, length))
            yield NumberColumn(f"{column.name}_{end}", column.source, kind.value_type, column.metadata, steps)


def _is_list(kind: Any) -> bool:
    import pyarrow as pa

    t = pa.types
    return bool(t.is_list(kind) or t.is_large_list(kind) or t.is_fixed_size_list(kind))


def _first_length(column: NumberColumn, groups: int, decode: Decode) -> int:
    """How long the first list is that there is; 0 where there is none."""
    import pyarrow.compute as pc

    for group in range(groups):
        array = column.decoded(decode, group)
        array.validate(full=True)
        lengths = pc.list_value_length(array).drop_null()
        if len(lengths):
            return int(lengths[0].as_py())
    return 0
