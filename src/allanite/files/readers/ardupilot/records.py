# SPDX-License-Identifier: BSD-3-Clause
"""The records of a dataflash log: where they are, of which type, and their fields as arrays.

A record is ``A3 95``, a type, and a body whose length and fields a ``FMT`` record (type 128) tells. The bytes ``A3 95``
also occur inside bodies, and records can be torn: a record counts only if the next one begins where it ends, or the
file does. What lies between is passed over and counted.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.readers.record_chain import follow_chain
from allanite.files.readers.spool import GrowingColumn
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import open_regular

__all__ = ["FMT_TYPE", "MAGIC", "Format", "Records", "find_formats", "find_records"]

MAGIC: Final = b"\xa3\x95"
FMT_TYPE: Final = 128
_FMT = struct.Struct("<BB4s16s64s")
_WINDOW = 32 << 20  # bytes looked at at once
_GATHERED = 16 << 20  # bytes of records taken out at once
_LONGEST = 256  # the length of a record is one byte

#: Format letter -> type in the record and factor that its letter promises.
_LETTERS: Final[dict[str, tuple[str, float]]] = {
    "b": ("i1", 1.0), "B": ("u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0), "i": ("<i4", 1.0), "I": ("<u4", 1.0),
    "q": ("<i8", 1.0), "Q": ("<u8", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0), "g": ("<f2", 1.0),
    "c": ("<i2", 1e-2), "C": ("<u2", 1e-2), "e": ("<i4", 1e-2), "E": ("<u4", 1e-2), "L": ("<i4", 1e-7),
    "M": ("u1", 1.0), "n": ("S4", 1.0), "N": ("S16", 1.0), "Z": ("S64", 1.0), "a": ("(32,)<i2", 1.0),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Format:
    """One type of record, as its FMT record has it.

    Attributes
    ----------
    kind : int
        The byte behind ``A3 95``.
    length : int [bytes]
        Of the whole record.
    name : str
    letters : str
        One for each column.
    columns : tuple of str
    """

    kind: int
    length: int
    name: str
    letters: str
    columns: tuple[str, ...]

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of a whole record."""
        offsets, at = [], 3
        for letter in self.letters:
            offsets.append(at)
            at += np.dtype(_LETTERS[letter][0]).itemsize
        kinds = [_LETTERS[letter][0] for letter in self.letters]
        return np.dtype(
            {"names": list(self.columns), "formats": kinds, "offsets": offsets, "itemsize": self.length}
        )

    def factor(self, column: str) -> float:
        """What the letter of a column is to be multiplied by."""
        return _LETTERS[self.letters[self.columns.index(column)]][1]

    @property
    def numbers(self) -> tuple[str, ...]:
        """Columns that hold one number."""
        pairs = zip(self.letters, self.columns, strict=True)
        return tuple(column for letter, column in pairs if letter not in "nNZa")


def find_formats(data: NDArray[np.uint8]) -> tuple[dict[int, Format], list[str]]:
    """The types of records that a log defines, and what is odd about them, in words.

    Raises
    ------
    FormatError
        It defines none.
    """
    formats: dict[int, Format] = {}
    odd: dict[str, None] = {}
    needle = MAGIC + bytes([FMT_TYPE])
    for start in range(0, len(data), _WINDOW):
        window = data[start : start + _WINDOW + 3 + _FMT.size].tobytes()
        at = window.find(needle)
        while 0 <= at < _WINDOW:
            one = _format_at(window, at + 3)
            if one is not None and formats.setdefault(one.kind, one) != one:
                odd[f"the log defines records of type {one.kind} twice; {formats[one.kind].name} is used"] = (
                    None
                )
            at = window.find(needle, at + 1)
    if not formats:
        raise FormatError("no complete FMT record, which defines the others: the start of the log is lost")
    return formats, list(odd)


def _format_at(window: bytes, at: int) -> Format | None:
    """The format that a FMT record tells, or None for bytes that only look like one."""
    if at + _FMT.size > len(window):
        return None
    kind, length, *texts = _FMT.unpack_from(window, at)
    try:
        name, letters, labels = (t.split(b"\0", 1)[0].decode("ascii") for t in texts)
    except UnicodeDecodeError:
        return None
    columns = tuple(labels.split(",")) if labels else ()
    if not name.isprintable() or not set(letters) <= set(_LETTERS) or len(set(columns)) != len(columns):
        return None
    if len(columns) != len(letters) or not all(c.isprintable() and c for c in columns):
        return None
    size = 3 + sum(np.dtype(_LETTERS[letter][0]).itemsize for letter in letters)
    return Format(kind, length, name, letters, columns) if size == length and name else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Records:
    """The records of a log.

    Attributes
    ----------
    data : ndarray of uint8
        The file, mapped.
    formats : dict of type to Format
    places : dict of type to ndarray of int64 [bytes]
        Where the records of a type begin.
    skipped : int [bytes]
        What belongs to no record.
    breaks : int
        Places at which something was passed over.
    odd : list of str
        What else there is to say.
    """

    data: NDArray[np.uint8]
    formats: dict[int, Format]
    places: dict[int, NDArray[Any]]
    skipped: int
    breaks: int
    odd: list[str]

    def blocks(self, kind: int) -> Iterator[NDArray[Any]]:
        """The records of a type as structured arrays, in their order."""
        form, places = self.formats[kind], self.places.get(kind, np.zeros(0, dtype=np.int64))
        if len(places) == 0:
            return
        windows = sliding_window_view(self.data, form.length)
        many = max(_GATHERED // form.length, 1)
        for start in range(0, len(places), many):
            yield windows[places[start : start + many]].view(form.dtype)[:, 0]


def find_records(path: Path) -> Records:
    """All records of a log, in two passes over the file.

    Raises
    ------
    FormatError
        It defines no types of records.
    """
    with open_regular(path) as file:
        data = np.memmap(file, dtype=np.uint8, mode="r")
    formats, odd = find_formats(data)
    lengths = np.zeros(_LONGEST, dtype=np.int64)
    for kind, form in formats.items():
        lengths[kind] = form.length
    growing = {kind: GrowingColumn() for kind in formats}
    at, skipped, breaks = 0, 0, 0
    while at < len(data):
        window = np.asarray(data[at : at + _WINDOW + 2 * _LONGEST])
        last = at + len(window) >= len(data)
        marks, kinds = _marks(window, lengths)
        chain = follow_chain(
            marks, marks + lengths[kinds], reach=len(window) if last else _WINDOW, size=len(window), last=last
        )
        taken, kinds = marks[chain.keep], kinds[chain.keep]
        for kind in np.unique(kinds).tolist():
            growing[kind].append(taken[kinds == kind] + at)
        skipped, breaks, at = skipped + chain.skipped, breaks + chain.breaks, at + chain.end
    places = {kind: column.finish_array() for kind, column in growing.items()}
    return Records(data=data, formats=formats, places=places, skipped=skipped, breaks=breaks, odd=odd)


def _marks(
    window: NDArray[np.uint8], lengths: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places that look like the beginning of a record of a known type, and these types."""
    marks = np.flatnonzero(window[: max(len(window) - 2, 0)] == MAGIC[0])
    marks = marks[window[marks + 1] == MAGIC[1]]
    kinds = window[marks + 2].astype(np.int64)
    known = lengths[kinds] > 0
    return marks[known], kinds[known]
