# Specification: none: the records are what a layout (`raw_layout`) says they are.
# SPDX-License-Identifier: BSD-3-Clause
"""Raw binary files: records of a fixed length that a small YAML file describes; see `raw_layout` and `raw_records`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from allanite.errors import InputError
from allanite.files.readers.table import Options, Table

NAME: Final = "raw binary"
OPTIONS: Final = frozenset({"layout"})


def sniff(head: bytes, path: Path) -> bool:
    """False: such a file shows nothing by itself; it is read with ``layout``."""
    return False


def read(path: Path, options: Options) -> Table:
    """Read the records that the layout describes.

    Raises
    ------
    InputError
        No layout.
    FormatError
        The layout has faults.
    DataQualityError
        There is no whole record.
    """
    from allanite.files.readers.raw_layout import read_layout
    from allanite.files.readers.raw_records import table_of_records

    if options.layout is None:
        raise InputError(
            f"{path.name}: raw binary files need layout= (--layout), the YAML file that describes them"
        )
    return table_of_records(path, read_layout(options.layout), NAME, options.sampling)
