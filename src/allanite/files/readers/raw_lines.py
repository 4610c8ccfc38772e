# SPDX-License-Identifier: BSD-3-Clause
"""Records that stand in a text as hexadecimal words, one record a line: ``0.01,FFE5,FFF4,0000`` or ``A55A3F800000``.

The words of a line, joined, are the bytes of a record as a layout describes them. A word may be shorter than its field
where each field has a word of its own (``A`` for ``000A``).
"""

from __future__ import annotations

import re
from dataclasses import field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.files.readers.delimited.streams import opened, pieces
from allanite.files.readers.raw_layout import RecordLayout
from allanite.files.readers.spool import GrowingColumn
from allanite.lazy_dataclasses import dataclass

__all__ = ["WrittenRecords", "written_records"]

_SEPARATORS = re.compile(r"[,;\s]+")
_WORD = re.compile(r"(?:0[xX])?([0-9A-Fa-f]+)[hH]?")
_COMMENT = ("#", "%", "//", "!")


@dataclass(frozen=True, slots=True)
class WrittenRecords:
    """Records out of a text.

    Attributes
    ----------
    data : ndarray of uint8
        Their bytes, one record behind the other.
    stamps : ndarray or None
        The decimal time of each, in its own unit.
    damaged : ndarray of bool or None
        Records that stand for lines that could not be read; None where there are none.
    guesses : list of str
    """

    data: NDArray[np.uint8]
    stamps: NDArray[np.float64] | None
    damaged: NDArray[np.bool_] | None
    guesses: list[str]


@dataclass(slots=True)
class _Gathered:
    layout: RecordLayout
    rows: list[bytes] = field(default_factory=list)
    stamps: list[float] = field(default_factory=list)
    damaged: list[bool] = field(default_factory=list)
    bad: int = 0
    first_bad: int = 0
    begun: bool = False

    def take(self, line: str, number: int) -> None:
        if not line.strip() or line.lstrip().startswith(_COMMENT):
            return
        record = _record(line, self.layout)
        if record is not None:
            self.begun = True
            self.rows.append(record[0])
            self.stamps.append(record[1])
            self.damaged.append(False)
        elif self.begun:
            self.bad += 1
            self.first_bad = self.first_bad or number
            if not self.placed_otherwise():
                self.rows.append(bytes(self.layout.frame.size))
                self.stamps.append(np.nan)
                self.damaged.append(True)

    def placed_otherwise(self) -> bool:
        """A counter or a time tells where records are missing."""
        frame, lines = self.layout.frame, self.layout.lines
        return (
            frame.counter is not None
            or frame.time is not None
            or (lines is not None and lines.time is not None)
        )


def written_records(path: Path, layout: RecordLayout) -> WrittenRecords:
    """The records in the lines of a text; lines before the first one are a header.

    Raises
    ------
    DataQualityError
        No line holds a record.
    """
    size, sample = layout.frame.size, ""
    data, stamps = GrowingColumn(np.dtype(np.uint8)), GrowingColumn(np.dtype(np.float64))
    gathered, damaged = _Gathered(layout), list[NDArray[np.bool_]]()
    stream = opened(path)
    with stream.file:
        for piece, number in pieces(stream, layout.skip, path.name):
            lines = piece.decode(stream.codec, "replace").splitlines()
            sample = sample or next((line.strip() for line in lines if line.strip()), "")
            for k, line in enumerate(lines):
                gathered.take(line, number + k)
            data.append(np.frombuffer(b"".join(gathered.rows), dtype=np.uint8))
            stamps.append(np.array(gathered.stamps, dtype=np.float64))
            damaged.append(np.array(gathered.damaged, dtype=bool))
            for part in (gathered.rows, gathered.stamps, gathered.damaged):
                part.clear()
    if not gathered.begun:
        raise DataQualityError(
            f"{path.name}: no line contains a record of {size} bytes, {2 * size} hexadecimal digits (it begins "
            f"{sample[:60]!r}). Check the fields of the layout and 'columns' of its 'lines'"
        )
    mask = np.concatenate(damaged)
    done = "they are passed over" if gathered.placed_otherwise() else "their samples are missing"
    guesses = (
        [f"{gathered.bad} line(s), first {gathered.first_bad}, without a record: {done}"]
        if gathered.bad
        else []
    )
    timed = layout.lines is not None and layout.lines.time is not None
    return WrittenRecords(
        data.finish_array(), stamps.finish_array() if timed else None, mask if mask.any() else None, guesses
    )


def _record(line: str, layout: RecordLayout) -> tuple[bytes, float] | None:
    """Bytes and time of a line, or None if it holds no record."""
    cells = [cell.strip("\"'[](){}<>") for cell in _SEPARATORS.split(line.strip()) if cell]
    lines, stamp = layout.lines, float("nan")
    assert lines is not None  # noqa: S101 - asked for by the caller
    try:
        if lines.time is not None:
            stamp = float(cells[lines.time.column])
        chosen = lines.columns
        if chosen is None:
            skipped = -1 if lines.time is None else lines.time.column
            words = [cell for k, cell in enumerate(cells) if k != skipped]
        else:
            words = [cells[k] for k in chosen]
    except (IndexError, ValueError):
        return None
    matches = [_WORD.fullmatch(word) for word in words]
    if not all(matches):
        return None
    digits = _padded([match[1] for match in matches if match], layout)
    record = bytes.fromhex(digits) if len(digits) == 2 * layout.frame.size else b""
    return (record, stamp) if record and record.startswith(layout.frame.header) else None


def _padded(words: list[str], layout: RecordLayout) -> str:
    """The digits of a record; words that are a field each are filled up from the left."""
    frame = layout.frame
    spans = sorted((start, stop) for _, start, stop in frame.spans())
    whole = sum(stop - start for start, stop in spans) == frame.size
    if whole and len(spans) == len(words):
        words = [word.zfill(2 * (stop - start)) for word, (start, stop) in zip(words, spans, strict=True)]
    return "".join(words)
