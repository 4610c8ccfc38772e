# SPDX-License-Identifier: BSD-3-Clause
"""Lines of text: whole or not, and what they hold.

A line without a checksum that lost a character may still read as numbers: nobody can tell. Give the device a checksum,
or as many decimals as it has, so that two lines run into one have too many points.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments.serial_imu.checksums import SIZES, checksum
from allanite.acquisition.instruments.serial_imu.description import Description
from allanite.acquisition.instruments.serial_imu.frames import apply_bits, flag_numbers
from allanite.acquisition.instruments.serial_imu.layout import TextLines
from allanite.acquisition.instruments.serial_imu.tally import Tally
from allanite.lazy_dataclasses import dataclass

__all__ = ["LineSplitter", "ParsedLine", "with_line_checksum"]

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_MISSING = {"", "nan", "+nan", "-nan", "undefined", "null", "none", "--"}
_OVERLOAD = {"ovld", "ol", "+ol", "-ol", "inf", "+inf", "-inf", "infinity", "+infinity", "-infinity"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ParsedLine:
    """One line: its text for comparison, values, counter and status words."""

    text: bytes
    values: tuple[float, ...]
    counter: int
    words: tuple[int, ...]


class LineSplitter:
    """The lines of a stream. One piece is a `ParsedLine`."""

    def __init__(self, described: Description) -> None:
        lines = described.lines
        assert lines is not None  # noqa: S101 - the description was checked
        self._lines: TextLines = lines
        self._buffer = bytearray()
        # the first line may have begun before we listened; a mark or a checksum tells, else it is dropped
        self._is_certain = lines.begins is not None or lines.checksum is not None
        self._dropping = not self._is_certain
        # what the search for the beginning of a line goes by: "G" alone would find one in the middle of a word
        begins = lines.begins or ""
        searched = lines.checksum is not None or not begins[:1].isalnum()
        self._mark = begins.encode("utf-8") if searched else b""
        self._sum = None if lines.checksum is None else checksum(lines.checksum.kind)

    def take(self, arrived: bytes, tally: Tally) -> list[tuple[ParsedLine, int]]:
        """The lines that are whole now, each with all bytes skipped up to it."""
        self._buffer += arrived
        *whole, rest = self._buffer.split(b"\n")
        lines = []
        for line in whole:
            if self._dropping or len(line) > self._lines.longest:
                tally.skipped += len(line) + 1
                self._dropping = False
                continue
            parsed = self._parse(bytes(line), tally)
            if parsed is not None:
                lines.append((parsed, tally.skipped))
        if self._dropping or len(rest) > self._lines.longest:
            tally.skipped += len(rest)
            self._dropping, rest = True, bytearray()
        self._buffer = bytearray(rest)
        return lines

    def cut(self, tally: Tally) -> None:
        """The stream was interrupted: what is there of a line will not be continued."""
        tally.skipped += len(self._buffer)
        self._buffer.clear()
        self._dropping = not self._is_certain

    @property
    def pending(self) -> int:
        """Bytes that may still become a line."""
        return len(self._buffer)

    def counter_of(self, line: ParsedLine) -> int:
        """What the counter of a line says."""
        return line.counter

    def decode(self, lines: Sequence[ParsedLine]) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        """Samples of some lines: values, shape (n_lines, n_channels) [unit of each column], and flags, (n_lines,)."""
        columns = self._lines.columns
        values = np.array([line.values for line in lines], dtype=np.float64).reshape(-1, len(columns))
        flags = np.zeros(len(lines), dtype=np.uint8)
        flag_numbers(values, flags)
        values *= [cell.scale for cell in columns]
        values += [cell.offset for cell in columns]
        names = [cell.name for cell in columns]
        for i, status in enumerate(self._lines.status):
            words = np.array([line.words[i] for line in lines], dtype=np.uint64)
            apply_bits(status.bits, words, names, values, flags)
        return values, flags

    # -- one line -----------------------------------------------------------------------------------------

    def _parse(self, line: bytes, tally: Tally) -> ParsedLine | None:
        """The line, or None and a count of what is wrong with it.

        Garbage, or a line without an end, may stand before a whole one: where that is certain, it is found.
        """
        bare = line.strip(b" \t\r")
        if not bare:
            return None
        parsed = self._attempt(bare)
        start = line.rfind(self._mark) if self._mark and isinstance(parsed, str) else 0
        if start > 0:
            behind = self._attempt(line[start:].strip(b" \t\r"))
            if isinstance(behind, ParsedLine):
                tally.skipped += start
                return behind
        if isinstance(parsed, ParsedLine):
            return parsed
        setattr(tally, parsed, getattr(tally, parsed) + 1)
        tally.skipped += 0 if parsed == "others" else len(line) + 1
        return None

    def _attempt(self, bare: bytes) -> ParsedLine | Literal["failed", "others", "unreadable", "uneven"]:
        """The line, or which count of the tally it belongs to."""
        text = bare.decode("ascii", "replace")
        if not text.isascii() or not text.isprintable():
            return "unreadable"
        body = self._body(text)
        if body is None:
            return "failed"
        cells = self._cells(body)
        begins = self._lines.begins
        if begins is not None and cells[:1] != [begins]:
            return "others"
        if len(cells) != self._lines.n_cells:
            return "uneven"
        try:
            return self._read(bare, cells)
        except ValueError:
            return "unreadable"

    def _body(self, text: str) -> str | None:
        """The line without its checksum, if that is right."""
        entry = self._lines.checksum
        if entry is None or self._sum is None:
            return text
        body, mark, digits = text.rpartition(entry.mark)
        try:
            stated = int(digits, 16) if len(digits) == 2 * SIZES[entry.kind] else -1
        except ValueError:
            stated = -1
        is_right = bool(mark) and self._sum(body.removeprefix(entry.skip).encode("ascii")) == stated
        return body if is_right else None

    def _cells(self, body: str) -> list[str]:
        separator = self._lines.separator
        return body.split() if separator == "blank" else [cell.strip() for cell in body.split(separator)]

    def _read(self, bare: bytes, cells: list[str]) -> ParsedLine:
        """Raises ValueError where a cell is not what it should be."""
        lines = self._lines
        counter = lines.counter
        return ParsedLine(
            text=bare,
            values=tuple(self._number(cells[column.column]) for column in lines.columns),
            counter=0
            if counter is None
            else _whole(cells[counter.column], counter.numbers) % counter.modulus,
            words=tuple(_whole(cells[word.column], word.numbers) for word in lines.status),
        )

    def _number(self, cell: str) -> float:
        text = cell.replace(",", ".") if self._lines.decimal == "," else cell
        if _NUMBER.fullmatch(text):
            return float(text)
        word = text.lower()
        if word in _MISSING:
            return math.nan
        if word in _OVERLOAD:
            return math.inf
        raise ValueError


def _whole(cell: str, numbers: str) -> int:
    if not re.fullmatch(
        r"\d{1,19}" if numbers == "decimal" else r"(?:0[xX])?[0-9a-fA-F]{1,16}", cell, re.ASCII
    ):
        raise ValueError
    return int(cell, 10 if numbers == "decimal" else 16)


def with_line_checksum(lines: TextLines, body: str) -> str:
    """The text of a line with the checksum that it should have."""
    entry = lines.checksum
    if entry is None:
        return body
    checksum_of_body = checksum(entry.kind)(body.removeprefix(entry.skip).encode("ascii"))
    return f"{body}{entry.mark}{checksum_of_body:0{2 * SIZES[entry.kind]}X}"
