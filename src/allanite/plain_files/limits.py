# SPDX-License-Identifier: BSD-3-Clause
"""How wide, deep and long a file may be that is read: every limit on the shape of a file, in one place.

Limits of size and time are where what they guard is: bombs in `allanite.files.readers.spool`, memory and processor time
of a child process in `allanite.files.readers.sandbox`. These here keep a small file from costing much by its shape.
Logs of sensors have tens of columns and hundreds of groups.
"""

from __future__ import annotations

from typing import Final

from allanite.errors import LimitError

__all__ = [
    "COLUMNS",
    "DEPTH",
    "DIGITS",
    "DOCUMENT_BYTES",
    "ENTRIES",
    "FOOTER_BYTES",
    "GROUPS",
    "LINES",
    "MISSING",
    "MISSING_EACH",
    "PARTS",
    "PIECES",
    "SEGMENTS",
    "SHEETS",
    "TYPE_CHARACTERS",
    "refuse_more",
]

#: Columns, fields or channels of a table.
COLUMNS: Final = 4096
#: Tables that a file holds, whatever its format calls them: arrays, variables, groups, channels, topics, messages.
PARTS: Final = 4096
#: Groups and datasets of an HDF5 file, links counted.
GROUPS: Final = 4096
#: Sheets of a workbook.
SHEETS: Final = 256
#: Pieces that a file is divided into: row groups, record batches, chunks, segments of a TDMS file.
PIECES: Final = 65_536
#: Characters of all definitions of messages of a recording of ROS: one of an Imu has 4000.
TYPE_CHARACTERS: Final = 1 << 18

#: Depth of lists and mappings in a document (JSON, YAML).
DEPTH: Final = 64
#: Digits of a whole number in a document: the largest of 64 bits has 20.
DIGITS: Final = 40
#: Bytes of a YAML document that a person writes.
DOCUMENT_BYTES: Final = 1 << 18
#: Of a log that is one JSON document, and objects and lists in it: they are in memory at once.
JSON_BYTES: Final = 1 << 24
JSON_OBJECTS: Final = 1_000_000
#: Entries of a YAML document, keys and values, those behind aliases counted each time.
ENTRIES: Final = 40_000

#: Samples that may be missing from a run, and how many more for each that is there.
MISSING: Final = 10_000_000
MISSING_EACH: Final = 1000
#: Bytes of the metadata of a Parquet file: the library needs twelve times as much to understand them.
FOOTER_BYTES: Final = 1 << 25
#: Segments of a run: a year of hourly ones is 8766, and empty ones cost half a millisecond each.
SEGMENTS: Final = 20_000
#: Lines of a manifest of a run.
LINES: Final = 1_000_000


def refuse_more(count: int, most: int, what: str, where: str, advice: str) -> None:
    """Raise if there is more of something than is read.

    Parameters
    ----------
    count, most : int
        How many there are, and the limit.
    what : str
        What is counted, in the plural: "columns".
    where : str
        The file.
    advice : str
        What to do, a sentence without its full stop.

    Raises
    ------
    LimitError
    """
    if count > most:
        raise LimitError(f"{where} has {count} {what}; at most {most} are read. {advice}")
