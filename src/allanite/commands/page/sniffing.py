# SPDX-License-Identifier: BSD-3-Clause
"""What a file may be, from its first bytes alone: nothing of a foreign file is parsed in the server.

The readers decide in the end; this only says what is worth showing.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from allanite.plain_files.regular_file import open_regular
from allanite.stability.fleet.table_files import TABLE

__all__ = ["HEAD", "describes_frames", "document_format", "layout_beside", "recording_format"]

HEAD: Final = 4096
"""Bytes that are looked at."""
_LONGEST: Final = 64 << 10  # of a description: comments may stand above

#: Beginnings of files, and what reads them.
_MAGIC: Final = (
    (b"\x93NUMPY", "numpy_file"),
    (b"PAR1", "parquet"),
    (b"ARROW1", "parquet"),
    (b"MATLAB 5.0", "matlab"),
    (b"MATLAB 7.3", "matlab"),
    (b"\x89HDF\r\n\x1a\n", "hdf5"),
    (b"#ROSBAG V", "rosbag"),
    (b"\x89MCAP", "rosbag"),
    (b"SQLite format 3\x00", "rosbag"),
    (b"\xa3\x95", "ardupilot"),
    (b"ULog\x01\x12\x35", "ulog"),
    (b"TDSm", "tdms"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "spreadsheet"),
    (b"\xff\xff\xff\xff", "parquet"),  # an Arrow stream
    *(
        (magic, "r_data")
        for magic in (b"RDX2\n", b"RDX3\n", b"RDA2\n", b"RDA3\n", b"X\n\0\0\0", b"A\n2\n", b"A\n3\n")
    ),
)
#: R packs what it saves.
_R: Final = frozenset({".rda", ".rdata", ".rds"})
_PACKED: Final = ((b"\x1f\x8b", ".gz"), (b"\xfd7zXZ\x00", ".xz"), (b"BZh", ".bz2"))
_ZIP = b"PK\x03\x04"
#: Text that is no log, by its suffix.
_NO_LOGS: Final = frozenset(
    {
        ".json", ".jsonl", ".yaml", ".yml", ".html", ".htm", ".md", ".rst", ".py", ".m", ".c", ".h", ".cpp", ".hpp",
        ".js", ".css", ".xml", ".svg", ".toml", ".ini", ".cfg", ".sh", ".ipynb", ".tex", ".service", ".pdf",
        ".launch",
    }
)  # fmt: skip
#: Beginnings of tables that allanite wrote: curves, and what an environment did to the curve of a channel.
_OURS: Final = (b"# format: allanite-", b"tau,before,after,deviation,error,share,left\n")
_NUMBERS = re.compile(rb"(?:^|[\s,;|\"])[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?(?:$|[\s,;|\"])", re.M)
#: A number behind its label, and an object of JSON in a line.
_LABELED = re.compile(rb"[^\W\d][\"')\]]?[ \t]*[:=][ \t]*[-+]?\d")
_OBJECT = re.compile(rb"^\{.*:[ \t]*[-+]?\d.*\}[,\s]*$")
#: Lines with a number, in the first bytes of a log, at least; one of two that are whole.
_FEWEST_LINES = 2
#: Raw binary files, where one layout describes all of a folder.
_RAW: Final = frozenset({".bin", ".dat", ".raw"})
#: Of a description of a serial device, frames of bytes or lines of text.
_DESCRIPTION = re.compile(rb"^(?:frame|lines)[ \t]*:[ \t]*(?:#.*|\{.*)?\r?$", re.M)
_FRAME = re.compile(rb"^frame[ \t]*:[ \t]*(?:#.*|\{.*)?\r?$", re.M)
_FORMAT = re.compile(rb'"format"\s*:\s*"(allanite-[a-z-]{1,40})"')
_MODEL = re.compile(rb'^\s*\{\s*"[^"]{1,200}"\s*:\s*\{\s*"(?:terms|family)"')


def recording_format(path: Path, head: bytes) -> str | None:
    """Name of the reader that this may be for; None for what is no recording."""
    if path.is_dir():
        return _folder_format(path)
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    if head.startswith(_ZIP):
        return "numpy_file" if b".npy" in head else "spreadsheet" if _is_workbook(path, head) else None
    if any(head.startswith(magic) for magic, _ in _PACKED):
        return "r_data" if path.suffix.lower() in _R else "text" if ".tar" not in path.name else None
    if _is_telemetry(head):
        return "mavlink"
    is_log = _is_objects if path.suffix.lower() in _NO_LOGS else _is_table
    return "text" if is_log(head) else None


def layout_beside(path: Path) -> Path | None:
    """The layout of a raw binary log: the YAML file of its name beside it, or layout.yaml for all of the folder."""
    if path.suffix.lower() in _NO_LOGS or not path.is_file():
        return None
    named = [path.with_suffix(".yaml"), path.with_suffix(".yml"), path.with_name(f"{path.name}.yaml")]
    shared = [path.with_name("layout.yaml")] if path.suffix.lower() in _RAW else []
    return next((p for p in (*named, *shared) if p.is_file() and _FRAME.search(_first(p))), None)


def describes_frames(path: Path) -> bool:
    """Whether this may be the description of a serial device."""
    return path.suffix.lower() in (".yaml", ".yml") and bool(_DESCRIPTION.search(_first(path, _LONGEST)))


def _first(path: Path, most: int = HEAD) -> bytes:
    with open_regular(path) as file:
        return file.read(most)


def _folder_format(path: Path) -> str | None:
    if (path / "manifest.jsonl").is_file() or (path / "000001.arrows").is_file():
        return "run"
    if path.name == TABLE and any(path.glob("*.parquet")):
        return "parquet"
    bags = path.is_dir() and (path / "metadata.yaml").is_file()
    if bags and any(p.suffix in (".db3", ".mcap") for p in path.iterdir()):
        return "rosbag"
    return None


def _is_telemetry(head: bytes) -> bool:
    """A stamp in microseconds since 1970, whose first byte is zero, and the sign of a packet of MAVLink 2 or 1."""
    return head[:1] == b"\x00" and head[8:9] in (b"\xfd", b"\xfe")


def _is_workbook(path: Path, head: bytes) -> bool:
    """By its first members, or its suffix: the list of all members stands at the end of a zip."""
    named = path.suffix.lower() in (".xlsx", ".xlsm", ".xlsb", ".ods")
    return named or b"xl/" in head or b"opendocument.spreadsheet" in head


def _is_table(head: bytes) -> bool:
    """Text with several lines of numbers."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        head = head.decode("utf-16", "replace").encode()
    head = head.rstrip(b"\x00")  # what a crash leaves behind a log
    if b"\x00" in head or head.startswith(_OURS) or _FORMAT.search(head):
        return False
    lines = head.splitlines()
    rows = sum(1 for line in lines if _NUMBERS.search(line) or _LABELED.search(line))
    return rows >= min(_FEWEST_LINES, max(len(lines), 1))


def _is_objects(head: bytes) -> bool:
    """Objects of JSON, one a line."""
    return sum(1 for line in head.splitlines() if _OBJECT.match(line)) >= _FEWEST_LINES


def document_format(path: Path, head: bytes) -> str | None:
    """Format of a result of allanite; None for what is none."""
    if path.suffix.lower() != ".json" or not head.lstrip().startswith(b"{"):
        return None
    match = _FORMAT.search(head)
    if match:
        return match.group(1).decode()
    return "models" if _MODEL.match(head) else None
