# SPDX-License-Identifier: BSD-3-Clause
"""A text file as pieces of whole lines: unpacked, in UTF-8 or single bytes, without NUL bytes.

Limits are kept on the way: a line may have a megabyte, a packed file may not unpack to a bomb.
"""

from __future__ import annotations

import bz2
import codecs
import lzma
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from allanite.errors import FormatError, LimitError
from allanite.files.readers.spool import refuse_bomb, to_file
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import open_regular

__all__ = ["TextStream", "head_lines", "is_text", "opened", "other_lines", "pieces"]

_HEAD = 1 << 18
_SAMPLE = 1 << 15
_PIECE = 16 << 20
_LONGEST_LINE = 1 << 20
_PACKED = {b"\x1f\x8b": "gzip", b"\xfd7zXZ\x00": "xz", b"BZh": "bzip2"}
_MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_CONTROL = bytes(set(range(32)) - set(b"\t\n\r\f\v\x1b\x1a"))


def is_text(head: bytes) -> bool:
    """True if hardly any byte is a control character, or if the text is packed."""
    if any(head.startswith(magic) for magic in (*_PACKED, *_MARKS)):
        return True
    body = head.rstrip(b"\x00")
    odd = sum(body.count(bytes([c])) for c in _CONTROL)
    return len(body) > 0 and odd <= 0.02 * len(body)


@dataclass(slots=True)
class TextStream:
    """A text as UTF-8 or single-byte characters, seekable; and what was met on the way."""

    file: IO[bytes]
    encoding: str
    bom: bool
    packed: str
    size: int
    nul_bytes: int = 0
    unterminated: bool = False

    @property
    def codec(self) -> str:
        """Encoding of the bytes in `file` (UTF-16 has been transcoded)."""
        return "utf-8" if self.encoding.startswith("utf-16") else self.encoding


def opened(path: Path) -> TextStream:
    """Open a text file, unpacked and decoded as far as needed; the caller closes it.

    Raises
    ------
    FormatError
        A damaged packed file, or one that holds no text.
    LimitError
        A decompression bomb.
    """
    file: IO[bytes] = open_regular(path)
    magic = file.read(6)
    file.seek(0)
    packed = next((kind for m, kind in _PACKED.items() if magic.startswith(m)), "")
    if packed:
        with file:
            file = to_file(_unpacked(file, packed, path.name))
        magic = file.read(4)
        file.seek(0)
        probe = file.read(4096)
        file.seek(0)
        if not is_text(probe):
            file.close()
            raise FormatError(
                f"{path.name}: it does not contain compressed text; unpack it and read the result"
            )
    mark = next((m for m in _MARKS if magic.startswith(m)), b"")
    encoding = _MARKS.get(mark, "")
    file.seek(len(mark))
    if encoding.startswith("utf-16"):
        with file:
            file = to_file(_transcoded(file, encoding, path.name))
        mark = b""
    start = len(mark)
    size = file.seek(0, 2) - start
    file.seek(start)
    if not encoding:
        encoding = _encoding(file.read(_HEAD))
        file.seek(start)
    return TextStream(
        file,
        encoding,
        bool(_MARKS.get(magic[: len(mark)] or b"-") or encoding.startswith("utf-16")),
        packed,
        size,
    )


def _unpacked(file: IO[bytes], kind: str, name: str) -> Iterator[bytes]:
    """The content of a packed file, a megabyte at a time; refuses bombs on the way."""
    make: Any = {
        "gzip": lambda: zlib.decompressobj(31),
        "xz": lzma.LZMADecompressor,
        "bzip2": bz2.BZ2Decompressor,
    }[kind]
    read = written = 0
    engine, pending = make(), b""
    try:
        while pending or (pending := file.read(1 << 16)):
            if engine.eof:  # several packed files one after another
                engine = make()
            out = engine.decompress(pending, 1 << 20)
            left = engine.unconsumed_tail if kind == "gzip" else b""
            unused = engine.unused_data if engine.eof else b""
            read += len(pending) - len(left) - len(unused)
            pending = left or unused
            written += len(out)
            refuse_bomb(read, written, name)
            yield out
            while kind != "gzip" and not engine.eof and not engine.needs_input:
                out = engine.decompress(b"", 1 << 20)
                written += len(out)
                refuse_bomb(read, written, name)
                yield out
    except (zlib.error, lzma.LZMAError, OSError, EOFError) as error:
        raise FormatError(f"{name}: damaged {kind} file ({error})") from None
    if not engine.eof:
        raise FormatError(f"{name}: the {kind} file is truncated")


def _transcoded(file: IO[bytes], encoding: str, name: str) -> Iterator[bytes]:
    decoder = codecs.getincrementaldecoder(encoding)()
    try:
        while piece := file.read(1 << 20):
            yield decoder.decode(piece).encode()
    except UnicodeDecodeError as error:
        raise FormatError(f"{name}: damaged {encoding} text at byte {error.start}") from None


def _encoding(head: bytes) -> str:
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


# -- lines -------------------------------------------------------------------------------------------------


def _split_lines(block: bytes, encoding: str) -> list[str]:
    text = block.replace(b"\x00", b"").decode(encoding, errors="replace")
    return re.split(r"\r\n|\n|\r", text)


def head_lines(stream: TextStream, name: str) -> list[str]:
    """Whole lines from the beginning, some 256 KiB of them."""
    start = stream.file.tell()
    block = stream.file.read(_LONGEST_LINE + 1)
    stream.file.seek(start)
    if len(block) > _LONGEST_LINE and b"\n" not in block and b"\r" not in block:
        raise _too_long(name, 1)
    end = len(block) if len(block) <= _HEAD else max(block.find(b"\n", _HEAD), block.find(b"\r", _HEAD)) + 1
    lines = _split_lines(block[:end] or block, stream.codec)
    if len(lines) > 1:
        lines.pop()  # after the last end of line: nothing, or a line that is cut
    return lines


def other_lines(stream: TextStream) -> list[str]:
    """Whole lines from the middle and the end of a longer file."""
    start, lines = stream.file.tell(), []
    if stream.size > _HEAD + 2 * _SAMPLE:
        for at in (stream.size // 2, stream.size - _SAMPLE):
            stream.file.seek(start + at)
            whole = _split_lines(stream.file.read(_SAMPLE), stream.codec)[1:-1]
            lines += whole[:: max(len(whole) // 40, 1)]
        stream.file.seek(start)
    return lines


def pieces(stream: TextStream, skip: int, name: str) -> Iterator[tuple[bytes, int]]:
    """Pieces of whole lines behind the first `skip` lines, each with its first line's number.

    NUL bytes are taken out and counted; a last line without an end is left out and noted.

    Raises
    ------
    LimitError
        A line of more than a megabyte.
    """
    carry, line, to_skip, end = b"", 1, skip, b""
    while block := stream.file.read(_PIECE):
        if b"\x00" in block:  # much faster than to count them
            stream.nul_bytes += block.count(b"\x00")
            block = block.replace(b"\x00", b"")
        end = end or (b"\n" if b"\n" in carry or b"\n" in block else b"\r")
        cut = _end_of_lines(block, end)
        if cut == 0:  # in the middle of a line, or among blank ones: what was carried over belongs to it
            carry, block = b"", carry + block
            cut = _end_of_lines(block, end)
        piece, carry = b"".join((carry, memoryview(block)[:cut])), block[cut:]
        if len(carry) > _LONGEST_LINE and end not in carry[:_LONGEST_LINE]:
            raise _too_long(name, line + piece.count(end))
        while to_skip and piece:
            stop = piece.find(end) + 1
            piece, to_skip, line = piece[stop:], to_skip - 1, line + 1
        if piece:
            if end == b"\r":
                piece = piece.replace(b"\r", b"\n")
            _refuse_long_lines(piece, line, name)
            yield piece, line
            line += int(np.count_nonzero(np.frombuffer(piece, dtype=np.uint8) == 0x0A))  # faster than count
    if carry.strip(b"\r\n \t\x1a"):
        stream.unterminated = True


def _end_of_lines(block: bytes, end: bytes) -> int:
    """Where the last line that is not blank ends: blank lines at the end of a file mean nothing, so they wait."""
    cut = block.rfind(end) + 1
    tail = block[max(cut - 4096, 0) : cut]
    if tail.isspace():
        tail = block[:cut]
    filled = cut - len(tail) + len(tail.rstrip(b"\r\n \t"))
    return block.find(end, filled) + 1 if filled else 0


def _refuse_long_lines(piece: bytes, line: int, name: str) -> None:
    """A line may not be longer than a megabyte; looked for in steps of one."""
    at = 0
    while at + _LONGEST_LINE < len(piece):
        last = piece.rfind(b"\n", at, at + _LONGEST_LINE)
        if last < 0:
            raise _too_long(name, line + piece.count(b"\n", 0, at))
        at = last + 1


def _too_long(name: str, line: int) -> LimitError:
    return LimitError(
        f"{name}, line {line}: longer than {_LONGEST_LINE >> 20} MiB; no log has such lines: refused"
    )
