# Specification: ECMA-376 (Office Open XML, .xlsx, .xlsb), OpenDocument 1.3 (.ods), [MS-XLS] (.xls).
# SPDX-License-Identifier: BSD-3-Clause
"""Spreadsheets, through python-calamine, in a child process.

One sheet is written out as text, cell by cell, and read by the rules of text tables: preamble, header, units, dates and
words for missing cells mean the same in both. Numbers are those that the file holds, not what its formats show.
"""

from __future__ import annotations

import datetime
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.readers import delimited
from allanite.files.readers.contents import FilePart, choose_part, listed
from allanite.files.readers.sandbox import run
from allanite.files.readers.spool import ZIP_ERRORS, refuse_bomb, to_file
from allanite.files.readers.table import Options, Table
from allanite.plain_files.extras import require
from allanite.plain_files.limits import COLUMNS, SHEETS, refuse_more
from allanite.plain_files.regular_file import regular

NAME: Final = "spreadsheet"
OPTIONS: Final = frozenset({"variable", "decimal"})

_ZIP, _OLD = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_SPARE_MEMORY = 1 << 30
_MEMORY_PER_BYTE = 40  # the library holds the cells of a sheet
_PIECE = 1 << 24
_BLANKS: Final = str.maketrans(dict.fromkeys("\t\r\n\v\f\x00", " "))


def sniff(head: bytes, path: Path) -> bool:
    """True for a zip that holds a workbook, and for the older container of Excel."""
    if head.startswith(_OLD):
        return True
    if not head.startswith(_ZIP):
        return False
    try:
        with zipfile.ZipFile(regular(path)) as archive:
            names = set(archive.namelist())
            if names & {"xl/workbook.xml", "xl/workbook.bin"}:
                return True
            with archive.open("mimetype") as member:
                return b"opendocument.spreadsheet" in member.read(100)
    except (*ZIP_ERRORS, KeyError):
        return path.suffix.lower() in (
            ".xlsx",
            ".xlsm",
            ".xlsb",
            ".ods",
        )  # a broken one: `read` says what is wrong


def read(path: Path, options: Options) -> Table:
    """Read one sheet; ``variable`` is its name.

    Raises
    ------
    InputError
        The extra `spreadsheet` is not installed; no sheet of numbers.
    FormatError
        A damaged file, one with a password, or a sheet that is no table of numbers.
    LimitError
        It unpacks to far more than its size, or needs more memory than it may.
    """
    require(
        "python_calamine",
        "spreadsheet",
        f"{path.name} is a spreadsheet; reading it",
        otherwise=", or save the sheet as .csv",
    )
    size = path.stat().st_size
    _refuse_bomb(path)
    facts, arrays = run(
        f"{__name__}:text_in",
        [str(path), options.variable],
        imports=["python_calamine"],
        memory=_SPARE_MEMORY + _MEMORY_PER_BYTE * size,
        seconds=30 + size / 2e5,
        name=path.name,
    )
    content = arrays["text"]
    pieces = (content[a : a + _PIECE].tobytes() for a in range(0, len(content), _PIECE))
    stream = delimited.TextStream(to_file(pieces), "utf-8", bom=False, packed="", size=len(content))
    understood = replace(options, delimiter="\t", variable=facts["variable"])
    table = delimited.read_stream(stream, path, understood)
    return replace(
        table,
        format=NAME,
        source={**table.source, "sheet": facts["sheet"], "contents": facts["contents"]},
        guesses=(*facts["guesses"], *table.guesses),
    )


def _refuse_bomb(path: Path) -> None:
    """What the archive says of itself; what it does not say meets the limits of the child."""
    try:
        with zipfile.ZipFile(regular(path)) as archive:
            for member in archive.infolist():
                refuse_bomb(member.compress_size, member.file_size, f"{path.name}:{member.filename}")
    except (*ZIP_ERRORS, KeyError):
        return  # no zip, or a broken one: the library says so


# -- in the child ------------------------------------------------------------------------------------------


def text_in(path: str, variable: str | None) -> tuple[dict[str, Any], dict[str, NDArray[np.uint8]]]:
    """The sheet that is asked for (or the longest one) as text between tabs.

    The arguments are those of `allanite.files.readers.read`.
    """
    from python_calamine import CalamineError, CalamineWorkbook, PasswordError, SheetTypeEnum

    name = Path(path).name
    try:
        book = CalamineWorkbook.from_path(regular(path))
        names = [s.name for s in book.sheets_metadata if s.typ == SheetTypeEnum.WorkSheet]
        refuse_more(len(names), SHEETS, "sheets", name, "Save only the needed ones in a separate workbook")
        sheets = {n: book.get_sheet_by_name(n) for n in names}
    except PasswordError:
        raise FormatError(f"{name}: the spreadsheet has a password; save it without one") from None
    except CalamineError as error:
        raise FormatError(f"{name}: damaged spreadsheet ({str(error)[:200]})") from None
    parts = [FilePart(name=n, rows=s.height, columns=_headings(s)) for n, s in sheets.items()]
    chosen = variable if variable in sheets else None
    part, guesses = choose_part(parts, chosen, None, file=name, option="variable", what="sheet")
    sheet = sheets[part.name]
    refuse_more(sheet.width, COLUMNS, "columns", name, "Save only the needed ones in a separate sheet")
    content = "\n".join([*[""] * (sheet.start or (0, 0))[0], *_lines(sheet.iter_rows())]) + "\n"
    facts = {
        "sheet": part.name,
        "variable": None if chosen else variable,
        "guesses": guesses,
        "contents": listed(parts),
    }
    return facts, {"text": np.frombuffer(content.encode(), dtype=np.uint8)}


def _headings(sheet: Any) -> tuple[str, ...]:
    """The first row of words, for the list of what is in the file."""
    for row, _ in zip(sheet.iter_rows(), range(20), strict=False):
        words = [c for c in row if isinstance(c, str) and c.strip()]
        if len(words) > 1 or (words and len(row) == 1):
            return tuple(_cell(w) for w in words)
    return ()


def _lines(rows: Iterable[list[Any]]) -> Iterator[str]:
    """Rows as text; whole numbers, which a sheet does not tell from others, without a decimal point."""
    for row in rows:
        line = "\t".join([repr(c).removesuffix(".0") if type(c) is float else _cell(c) for c in row])
        yield "" if line.isspace() else line


def _cell(value: Any) -> str:
    """A cell as a text table would hold it."""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, datetime.datetime):
        return value.isoformat(timespec="microseconds")
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    return str(value).translate(_BLANKS).strip()
