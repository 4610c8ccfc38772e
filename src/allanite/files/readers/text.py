# Specification: RFC 4180 for comma-separated values, and what loggers in the wild make of it.
# SPDX-License-Identifier: BSD-3-Clause
"""Text tables of any dialect, also packed with gzip, xz or bzip2.

The content decides, not the suffix: a text table called .mat or .imu is read here. What was understood stands in
the recording's notes: delimiter, decimal sign, encoding, header, and how many rows and cells were not numbers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from allanite.files.readers.delimited import json_document, read_stream, yaml_documents
from allanite.files.readers.delimited.streams import is_text, opened
from allanite.files.readers.table import Options, Table

__all__ = ["NAME", "OPTIONS", "read", "sniff"]

NAME: Final = "text"
OPTIONS: Final = frozenset({"delimiter", "decimal", "variable"})


def sniff(head: bytes, path: Path) -> bool:
    """True for text, whatever the name, and for packed files."""
    return is_text(head)


def read(path: Path, options: Options) -> Table:
    """Read a text table.

    Raises
    ------
    FormatError
        No table of numbers, or a cell that is neither a number nor a known word; line and column are named.
    InputError
        Several kinds of records, or a whole number beyond 64 bits.
    LimitError
        A line of more than a megabyte, more than 4096 columns, or a decompression bomb.
    """
    stream = yaml_documents.as_lines(json_document.as_lines(opened(path), path.name), path.name)
    return read_stream(stream, path, options)
