# Specification: NMEA 0183, section 5 (sentences and their checksum), and what makers of serial units made of it.
# SPDX-License-Identifier: BSD-3-Clause
"""Sentences with a checksum, ``$VNIMU,0.1,...*63``: checked line by line and handed on as plain rows of cells.

Sums of two digits are the exclusive or of the bytes between ``$`` and ``*`` (NMEA 0183), of four the CRC-16/XMODEM
(VectorNav), of eight a CRC-32 without inversions (NovAtel, behind ``%`` or ``#``). A sentence that fails becomes a row
of missing samples, so that those behind it keep their place. A logger may have written something in front, such as
the time: these cells are kept.

Notes
-----
1. A sum of b bits lets one of 2^b damaged sentences pass.
"""

from __future__ import annotations

import binascii
import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from typing import Final

from allanite.errors import InputError
from allanite.files.readers.delimited.sentence_kinds import (
    fields_of,
    is_inertial,
    known_fields,
    words_of_kind,
)
from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell

__all__ = ["DAMAGED", "Sentences", "find_sentences"]

#: Stands for the row of a sentence that failed; the control character CAN, which no text holds.
DAMAGED: Final = b"\x18"

_SENTENCE = re.compile(
    rb"(?P<before>[^$!]*)(?P<sign>[$!])(?P<body>[A-Za-z][^$!*]*)(?:\*(?P<sum>[0-9A-Fa-f]{4}|[0-9A-Fa-f]{2}))?[ \t]*"
)
_NOVATEL = re.compile(rb"(?P<before>)(?P<sign>[%#])(?P<body>[A-Z][^%#*]*)\*(?P<sum>[0-9A-Fa-f]{8})[ \t]*")
_DIGIT = re.compile(rb"\d")
_SPLIT = re.compile(rb"(?=[$!][A-Z])")
_STANDARD = re.compile(r"(?:G[ABLNPQ]|II|IN|HC|HE|TI|WI|SD|AI|BD)[A-Z]{3}")
_MOST = 0.6  # of the lines that are looked at
_KINDS_SHOWN = 12


def _xor(body: bytes) -> int:
    """All bytes joined by exclusive or, by folding the whole in half."""
    number, bits = int.from_bytes(body, "little"), 8
    while bits < 8 * len(body):
        bits *= 2
    while bits > 8:
        bits //= 2
        number = (number >> bits) ^ (number & (1 << bits) - 1)
    return number


_SUMS: Final[dict[int, tuple[tuple[str, Callable[[bytes], int]], ...]]] = {
    2: (("exclusive or (NMEA 0183)", _xor), ("sum of the bytes", lambda body: sum(body) & 0xFF)),
    4: (
        ("CRC-16/XMODEM", lambda body: binascii.crc_hqx(body, 0)),
        ("CRC-16/IBM-3740", lambda body: binascii.crc_hqx(body, 0xFFFF)),
    ),
    8: (
        ("CRC-32 of NovAtel", lambda body: zlib.crc32(body, 0xFFFFFFFF) ^ 0xFFFFFFFF),
        ("CRC-32", zlib.crc32),
    ),
}


@dataclass(frozen=True, slots=True)
class _Sentence:
    before: str
    cells: list[str]
    digits: int
    checksum: int
    body: bytes

    @property
    def kind(self) -> str:
        return ",".join(self.cells[: words_of_kind(self.cells)])

    @property
    def fields(self) -> list[str]:
        return self.cells[words_of_kind(self.cells) :]


@dataclass(slots=True)
class Sentences:
    """How the sentences of one kind are taken out of a text.

    Attributes
    ----------
    kind : str
        First word of the sentences that are read, or the first two: "VNIMU", "VNRRG,54".
    others : tuple of str
        The other kinds in the text; where there is none, what fails is one of these.
    digits : int
        Of the checksum; 0 where there is none.
    checksum : str
        What it is called; "" where it is none that is known, so that nothing is checked.
    places : int
        Cells that a logger wrote in front of each sentence.
    fields : int
        Of a sentence, without the words of its kind.
    failed : int
        Sentences that failed so far.
    stray : int
        Lines so far that are no whole sentence and may have been one of this kind.
    begins : int
        Lines of the head before the first sentence of this kind, sound or not.
    """

    kind: str
    others: tuple[str, ...]
    digits: int
    checksum: str
    places: int
    fields: int
    stamps: str
    guesses: tuple[str, ...]
    failed: int = 0
    stray: int = 0
    begins: int = 0
    _sum: Callable[[bytes], int] | None = field(default=None, repr=False)

    @property
    def headings(self) -> tuple[str, ...]:
        """Names and units, where the maker's manual is known; "" elsewhere."""
        before = [""] * self.places
        if self.places == 1:
            before = [self.stamps]
        return (*before, *(fields_of(self.kind, self.fields) or [""] * self.fields))

    @property
    def named(self) -> bool:
        """The fields are those of a manual."""
        return bool(fields_of(self.kind, self.fields))

    def head(self, lines: Sequence[str]) -> list[str]:
        """Lines of the text as rows, each in its place; "" for what is none. Nothing is counted."""
        counts = self.failed, self.stray
        of_lines = [list(self._rows(line.encode())) for line in lines]
        self.failed, self.stray = counts
        self.begins = next(
            (i for i, rows in enumerate(of_lines) if rows and _DIGIT.search(lines[i].encode())), 0
        )  # a line without digits is a header
        sound = [[row.decode() for row in rows if row != DAMAGED] for rows in of_lines]
        return [
            rows[-1] if rows else self._header(line) if i < self.begins else ""
            for i, (rows, line) in enumerate(zip(sound, lines, strict=True))
        ]

    def _header(self, line: str) -> str:
        """A line before the sentences: names may stand behind a word in the place of the kind."""
        sentence = _read(line.encode())
        if sentence is None:
            return line
        return "" if _DIGIT.search(sentence.body) else self._row(sentence).decode()

    def piece(self, piece: bytes) -> bytes:
        """Whole lines of the text as rows; `DAMAGED` for one that fails."""
        rows = [row for line in re.split(rb"\r\n|\n|\r", piece) if line for row in self._rows(line)]
        return b"".join(row + b"\n" for row in rows)

    def _rows(self, line: bytes) -> Iterator[bytes]:
        parts = _SPLIT.split(line)
        if len(parts) > 1 and b"*" not in parts[0]:  # what stands in front belongs to the first sentence
            parts = [parts[0] + parts[1], *parts[2:]]
        for part in filter(bytes.strip, parts):
            sentence = _read(part)
            if sentence is not None and self._passes(sentence):
                if sentence.kind == self.kind:
                    yield self._row(sentence)
                continue
            if self._is_ours(part):
                self.failed += 1
                yield DAMAGED
            elif self._may_be_ours(part):
                self.stray += 1

    def _passes(self, sentence: _Sentence) -> bool:
        if self._sum is None:
            return sentence.digits == self.digits
        return sentence.digits == self.digits and self._sum(sentence.body) == sentence.checksum

    def _row(self, sentence: _Sentence) -> bytes:
        before = [sentence.before] if self.places else []
        return ",".join((*before, *sentence.fields)).encode()

    def _is_ours(self, part: bytes) -> bool:
        """A sentence that failed was of this kind, as far as one can tell."""
        if _holds(part, self.kind):
            return True
        return not self.others and not _is_comment(part) and 2 * part.count(b",") > self.fields

    def _may_be_ours(self, part: bytes) -> bool:
        if _is_comment(part) or not (b"," in part or b"*" in part):
            return False
        return not any(_holds(part, kind) for kind in self.others)


def find_sentences(lines: Sequence[str], variable: str | None, name: str) -> Sentences | None:
    """How the sentences of a text are read; None for a text of another kind.

    Parameters
    ----------
    lines : sequence of str
        Whole lines from the beginning, the middle and the end.
    variable : str or None
        The kind that the caller wants, with or without its ``$``.
    name : str
        The file, for messages.

    Raises
    ------
    InputError
        Several kinds and no word which to take, or a kind that is not there.
    """
    text = "".join(lines)
    if not any(sign in text for sign in "$!%#"):  # with one of which every sentence begins
        return None
    looked = [line.encode() for line in lines if line.strip()]
    sentences = [sentence for sentence in map(_read, looked) if sentence is not None]
    digits = Counter(s.digits for s in sentences).most_common(1)[0][0] if sentences else 0
    if digits == 0:
        sentences = [s for s in sentences if known_fields(s.kind)]
    if len(sentences) < max(_MOST * len(looked), 3):
        return None
    sentences = [s for s in sentences if s.digits == digits]
    checksum, compute = _checksum_of(sentences, digits)
    if compute is not None:
        sentences = [s for s in sentences if compute(s.body) == s.checksum]
    kinds = Counter(s.kind for s in sentences)
    kind, guesses = _chosen(kinds, variable, name)
    if digits and compute is None:
        guesses.append("the checksums after '*' are of an unknown type: the sentences are not checked")
    ours = [s for s in sentences if s.kind == kind]
    led = [s.before for s in ours if s.before]
    places = 1 if 2 * len(led) > len(ours) else 0
    places *= Counter(1 + text.count(",") for text in led).most_common(1)[0][0] if places else 1
    fields = Counter(len(s.fields) for s in ours).most_common(1)[0][0]
    return Sentences(
        kind,
        tuple(other for other in kinds if other != kind),
        digits,
        checksum,
        places,
        fields,
        _stamps(led),
        tuple(guesses),
        _sum=compute,
    )


def _read(line: bytes) -> _Sentence | None:
    """The sentence of a line, checked or not."""
    match = _SENTENCE.fullmatch(line) or _NOVATEL.fullmatch(line)
    if match is None:
        return None
    body, stated = match["body"], match["sum"] or b""
    cells = (
        body.replace(b";", b",").replace(b" ", b"").replace(b",+", b",").decode("utf-8", "replace").split(",")
    )
    before = match["before"].decode("utf-8", "replace").strip(" \t\"'[](){}<>,;:|=-")
    return _Sentence(before, cells, len(stated), int(stated, 16) if stated else -1, body)


def _holds(part: bytes, kind: str) -> bool:
    return re.search(rb"(?<![A-Za-z0-9])" + re.escape(kind.encode()) + rb"(?![A-Za-z0-9])", part) is not None


def _is_comment(line: bytes) -> bool:
    return line.lstrip().startswith((b"#", b"%", b"//"))


def _checksum_of(sentences: Sequence[_Sentence], digits: int) -> tuple[str, Callable[[bytes], int] | None]:
    """The checksum that the most sentences pass, if those are more than chance makes of another one."""
    tried = [
        (sum(compute(s.body) == s.checksum for s in sentences), -k, name, compute)
        for k, (name, compute) in enumerate(_SUMS.get(digits, ()))
    ]
    passed, _, name, compute = max(tried, default=(0, 0, "", None), key=lambda entry: entry[:2])
    return (name, compute) if passed >= max(0.1 * len(sentences), 2) else ("", None)


def _chosen(kinds: Counter[str], variable: str | None, name: str) -> tuple[str, list[str]]:
    """The kind that is read, and what had to be guessed."""
    if variable is not None:
        wanted = variable.lstrip("$!%#").casefold()
        for kind in kinds:
            if kind.casefold() == wanted:
                return kind, []
        raise InputError(f"{name}: no sentences {variable!r}; there are: {_listed(kinds)}")
    if len(kinds) == 1:
        return next(iter(kinds)), []
    inertial = [kind for kind in kinds if is_inertial(kind)]
    left = inertial or [kind for kind in kinds if not _STANDARD.fullmatch(kind)]
    if len(left) != 1:
        example = (left or list(kinds))[0]
        raise InputError(
            f"{name}: sentences of several kinds: {_listed(kinds)}. Choose one: --variable {for_shell(example)} "
            "(variable= in Python)"
        )
    return left[0], [
        f"sentences of several kinds ({_listed(kinds)}): {left[0]} was read; choose another with --variable"
    ]


def _listed(kinds: Counter[str]) -> str:
    shown = [kind for kind, _ in kinds.most_common(_KINDS_SHOWN)]
    more = len(kinds) - len(shown)
    return ", ".join(map(_described, shown)) + (f" and {more} more" if more > 0 else "")


def _described(kind: str) -> str:
    names = [field.partition("[")[0] for field in known_fields(kind)]
    held = list(dict.fromkeys(n.rsplit("_", 1)[0] if n[-2:] in ("_x", "_y", "_z") else n for n in names))
    return f"{kind} ({', '.join(n for n in held if n != '-')})" if held else kind


def _stamps(led: Sequence[str]) -> str:
    """What one number in front of each sentence is: time if it never falls, a counter if it goes on by one."""
    try:
        numbers = [float(text) for text in led]
    except ValueError:
        return ""
    steps = {b - a for a, b in zip(numbers, numbers[1:], strict=False)}
    if not steps or min(steps) < 0 or max(steps) == 0:
        return ""
    return "counter" if steps == {1.0} else "time"
