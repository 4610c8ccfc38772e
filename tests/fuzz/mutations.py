# SPDX-License-Identifier: BSD-3-Clause
"""Changes that a damaged or a hostile file may have: bytes, numbers that say a length, pieces, words, checksums."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from tests.fuzz.seeds import Seed

__all__ = ["mutated"]

Rng = np.random.Generator
Change = Callable[[Rng, bytes, bytes], bytes]

_LARGEST = 1 << 20  # bytes of what becomes of a file
_MOST_CHANGES = 4
_TOKENS: Final = [
    *(b"0 -1 1e400 -1e400 nan inf Infinity null true None .inf 0x 1e-400 65536 4294967296".split()),
    b"18446744073709551616",
    b"", b" ", b"[]", b"{}", b"[[[[[[[[", b"{\"a\":", b"\"", b"'", b"\\", b"\0", b"\n", b"\r", b"\t", b",", b";", b":",
    b"*a", b"&a ", b"<<: ", b"!!python/name:os.system", b"%", b"#", b"../", b"/dev/zero", b"\xff\xfe", b"\xef\xbb\xbf",
    "٣".encode(), "²".encode(), "\u202e".encode(), b"9" * 400, b"9" * 5000, b"0x" + b"f" * 5000, b"9999-12-31", b"-",
]  # fmt: skip
_NUMBER = re.compile(rb"\d[\d.]*")
_WORD = re.compile(rb"[A-Za-z_]\w+")
_FACTS = re.compile(rb"batch=\d{8} utc_ns=[+-]\d{19} bytes=(\d{10}) crc32=([0-9a-f]{8})")


def mutated(seed: Seed, others: Sequence[Seed], rng: Rng) -> Seed:
    """A copy of a seed with one to four changes in one of its files; `others` give what is spliced in."""
    names = sorted(seed.files)
    name = names[rng.integers(len(names))]
    content = seed.files[name]
    other = others[rng.integers(len(others))]
    partner = other.files[sorted(other.files)[rng.integers(len(other.files))]]
    changes = _TEXT if _is_text(content) else _BINARY
    few = 1 if rng.random() < 0.6 else _MOST_CHANGES
    for _ in range(rng.integers(1, few + 1)):
        content = changes[rng.integers(len(changes))](rng, content, partner)[:_LARGEST]
    if seed.role == "run" and rng.random() < 0.7:
        content = _signed(name, content)
    return replace(seed, files={**seed.files, name: content})


def _is_text(content: bytes) -> bool:
    head = content[:2000]
    return b"\0" not in head and sum(byte > 126 for byte in head) < 0.05 * len(head) + 1


def _place(rng: Rng, content: bytes, width: int = 1) -> int:
    """Anywhere, or where headers are."""
    reach = max(len(content) - width, 0) + 1
    near = (reach, min(reach, 64), min(reach, 1024))[rng.integers(3)]
    return int(rng.integers(near)) if rng.random() < 0.8 else reach - 1 - int(rng.integers(min(reach, 512)))


def _piece(rng: Rng, content: bytes) -> tuple[int, int]:
    start = _place(rng, content)
    return start, min(start + int(2 ** rng.uniform(0, 12)), len(content))


# -- bytes -------------------------------------------------------------------------------------------------


def _bytes(rng: Rng, content: bytes, _: bytes) -> bytes:
    copy = bytearray(content or b"\0")
    for _ in range(rng.integers(1, 6)):
        copy[_place(rng, copy)] = rng.integers(256)
    return bytes(copy)


def _bit(rng: Rng, content: bytes, _: bytes) -> bytes:
    copy = bytearray(content or b"\0")
    copy[_place(rng, copy)] ^= 1 << int(rng.integers(8))
    return bytes(copy)


def _length(rng: Rng, content: bytes, _: bytes) -> bytes:
    """A number of 1 to 8 bytes at an extreme, or near the length of the file."""
    width = (1, 2, 4, 4, 8)[rng.integers(5)]
    top = 1 << 8 * width
    choices = (
        0,
        1,
        2,
        top - 1,
        top // 2,
        top // 2 - 1,
        len(content),
        len(content) + 1,
        len(content) * 2,
        65_537,
    )
    value = choices[rng.integers(len(choices))] % top
    at = _place(rng, content, width) // (width if rng.random() < 0.7 else 1)
    at = at * width if at * width + width <= len(content) else 0
    number = value.to_bytes(width, "little" if rng.random() < 0.7 else "big")
    return content[:at] + number + content[at + width :]


def _step(rng: Rng, content: bytes, _: bytes) -> bytes:
    """A byte a little larger or smaller: a length that is off by one, a version, a count."""
    copy = bytearray(content or b"\0")
    at = _place(rng, copy)
    copy[at] = (copy[at] + int(rng.choice([-2, -1, 1, 2]))) % 256
    return bytes(copy)


# -- pieces ------------------------------------------------------------------------------------------------


def _cut(rng: Rng, content: bytes, _: bytes) -> bytes:
    return content[: _place(rng, content)]


def _without(rng: Rng, content: bytes, _: bytes) -> bytes:
    start, stop = _piece(rng, content)
    return content[:start] + content[stop:]


def _twice(rng: Rng, content: bytes, _: bytes) -> bytes:
    start, stop = _piece(rng, content)
    times = int(2 ** rng.uniform(1, 8))
    return content[:start] + content[start:stop] * times + content[stop:]


def _moved(rng: Rng, content: bytes, _: bytes) -> bytes:
    start, stop = _piece(rng, content)
    rest = content[:start] + content[stop:]
    at = _place(rng, rest)
    return rest[:at] + content[start:stop] + rest[at:]


def _spliced(rng: Rng, content: bytes, partner: bytes) -> bytes:
    """The beginning of one file and the end of another, or a piece of another in the middle."""
    if rng.random() < 0.5:
        return content[: _place(rng, content)] + partner[_place(rng, partner) :]
    start, stop = _piece(rng, partner)
    at = _place(rng, content)
    end = at + stop - start if rng.random() < 0.5 else at
    return content[:at] + partner[start:stop] + content[end:]


def _zeros(rng: Rng, content: bytes, _: bytes) -> bytes:
    start, stop = _piece(rng, content)
    return content[:start] + bytes([(0, 255)[rng.integers(2)]]) * (stop - start) + content[stop:]


# -- words -------------------------------------------------------------------------------------------------


def _token(rng: Rng, content: bytes, _: bytes) -> bytes:
    at = _place(rng, content)
    return content[:at] + _TOKENS[rng.integers(len(_TOKENS))] + content[at:]


def _one_of(rng: Rng, pattern: re.Pattern[bytes], content: bytes) -> tuple[int, int]:
    found = [m.span() for m in pattern.finditer(content)]
    return found[rng.integers(len(found))] if found else (0, 0)


def _number(rng: Rng, content: bytes, _: bytes) -> bytes:
    start, stop = _one_of(rng, _NUMBER, content)
    return content[:start] + _TOKENS[rng.integers(len(_TOKENS))] + content[stop:]


def _digits(rng: Rng, content: bytes, _: bytes) -> bytes:
    start, stop = _one_of(rng, _NUMBER, content)
    return content[:stop] + content[start:stop] * int(2 ** rng.uniform(0, 12)) + content[stop:]


def _word(rng: Rng, content: bytes, _: bytes) -> bytes:
    """A word in the place of another one."""
    start, stop = _one_of(rng, _WORD, content)
    a, b = _one_of(rng, _WORD, content)
    return content[:start] + content[a:b] + content[stop:]


def _value(rng: Rng, content: bytes, _: bytes) -> bytes:
    """What stands behind a colon, a comma or an equals sign becomes something else."""
    start, stop = _one_of(rng, re.compile(rb"[:,=]\s*[^\s,:=\[\]{}]+"), content)
    return content[: start + 1] + _TOKENS[rng.integers(len(_TOKENS))] + content[stop:]


def _line(rng: Rng, content: bytes, partner: bytes) -> bytes:
    """A line less, twice, elsewhere, or one of another file."""
    lines = content.split(b"\n")
    at, to = rng.integers(len(lines)), rng.integers(len(lines))
    if rng.random() < 0.3:
        others = partner.split(b"\n")
        lines.insert(to, others[rng.integers(len(others))])
    elif rng.random() < 0.5:
        lines[to:to] = [lines[at]] * int(2 ** rng.uniform(0, 8))
    else:
        del lines[at]
    return b"\n".join(lines)


def _nested(rng: Rng, content: bytes, _: bytes) -> bytes:
    at, sign = _place(rng, content), (b"[", b"{", b"- ", b"(", b'{"a":', b"a: ")[rng.integers(6)]
    return content[:at] + sign * int(2 ** rng.uniform(0, 13)) + content[at:]


_PIECES: tuple[Change, ...] = (_cut, _without, _twice, _moved, _spliced)
_BINARY: tuple[Change, ...] = (
    _bytes,
    _bytes,
    _bit,
    _length,
    _length,
    _length,
    _step,
    _zeros,
    _token,
    _digits,
    *_PIECES,
)
_TEXT: tuple[Change, ...] = (
    _bytes, _bit, _token, _token, _number, _number, _digits, _word, _value, _value, _line, _line, _nested, *_PIECES,
)  # fmt: skip


# -- checksums ---------------------------------------------------------------------------------------------


def _signed(name: str, content: bytes) -> bytes:
    """A file of a run with checksums that agree: what is behind them is to be reached."""
    if name.endswith(".jsonl"):
        lines = [re.sub(rb', "crc32": "[0-9a-f]*"\}$', b"}", line) for line in content.split(b"\n")]
        return b"\n".join(
            line[:-1] + b', "crc32": "%08x"}' % zlib.crc32(line) if line.endswith(b"}") else line
            for line in lines
        )
    opening = content[: 8 + min(int.from_bytes(content[4:8], "little"), len(content))]
    crc, copy = zlib.crc32(opening), bytearray(content)
    for found in _FACTS.finditer(content, len(opening)):
        start = content.rfind(b"\xff\xff\xff\xff", 0, found.start())
        stop, at = start + int(found[1]), found.start(2)
        copy[at : at + 8] = b"00000000"
        copy[at : at + 8] = b"%08x" % zlib.crc32(bytes(copy[start:stop]), crc)
    return bytes(copy)
