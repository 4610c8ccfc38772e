# SPDX-License-Identifier: BSD-3-Clause
"""Do the parts of a description fit together? Every contradiction is found, not only the first."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from allanite.acquisition.instruments.serial_imu.checksums import SIZES
from allanite.acquisition.instruments.serial_imu.layout import (
    BinaryFrame,
    CellStatus,
    FrameChecksum,
    FrameField,
    IdentityQuery,
    LineColumn,
    Status,
    TextLines,
    WireText,
)
from allanite.files.byte_layout import TYPE_SIZES, Span, wrong_in_record, wrong_measured
from allanite.plain_files.yaml_validation import Fault, Place, name_of
from allanite.recording.records import Sampling

__all__ = ["wrong_in_channels", "wrong_in_dialogue", "wrong_in_frame", "wrong_in_lines"]


def wrong_in_dialogue(identity: IdentityQuery | None, **texts: Sequence[WireText]) -> Iterator[Fault]:
    """What does not fit together in what the device is sent and asked."""
    if identity is not None:
        try:
            groups = re.compile(identity.answer).groupindex
        except re.error as error:
            yield ("identity", "answer"), f"is not a regular expression: {error}"
        else:
            if not groups.keys() & {"serial", "firmware"}:
                yield ("identity", "answer"), "names no group: write for example 'SN (?P<serial>[0-9]+)'"
    for name, several in texts.items():
        for i, text in enumerate(several):
            if (text.text is None) == (text.hex is None):
                yield (name, i), "give either 'text' or 'hex'"


def wrong_in_channels(
    measured: Sequence[FrameField | LineColumn], where: Place, sampling: Sampling, aperture: float | None
) -> Iterator[Fault]:
    """Channels that cannot be."""
    yield from wrong_measured(measured, where, sampling, aperture)
    for i, entry in enumerate(measured):
        if entry.limits is not None and not entry.limits[0] < entry.limits[1]:
            yield (*where, i, "limits"), "the first one must be below the second"


def wrong_in_frame(frame: BinaryFrame | None) -> Iterator[Fault]:
    """What does not fit together in a frame."""
    if frame is None:
        return
    fixed = frame.length if isinstance(frame.length, int) else None
    longest = frame.length if isinstance(frame.length, int) else frame.length.longest
    yield from wrong_in_record(frame, _spans(frame), longest, where=("frame",), what="frame")
    yield from _statuses(frame.status, [f.name for f in frame.fields], ("frame", "status"))
    if frame.checksum is not None:
        yield from _checksum(frame.checksum, fixed, longest)


def _spans(frame: BinaryFrame) -> Iterator[Span]:
    """Place in the description and bytes of all that has one in the frame."""
    for i, (field, start) in enumerate(zip(frame.fields, frame.places, strict=True)):
        yield ("frame", "fields", i), start, start + TYPE_SIZES[field.type]
    if frame.counter is not None:
        at = frame.counter.at
        yield ("frame", "counter", "at"), at, at + TYPE_SIZES[frame.counter.type]
    for i, status in enumerate(frame.status):
        yield ("frame", "status", i, "at"), status.at, status.at + TYPE_SIZES[status.type]
    if not isinstance(frame.length, int):
        at = frame.length.at
        yield ("frame", "length", "at"), at, at + TYPE_SIZES[frame.length.type]
    if frame.kind is not None:
        yield ("frame", "kind", "at"), frame.kind.at, frame.kind.at + len(frame.kind.bytes)
    if frame.checksum is not None and isinstance(frame.length, int):
        size = SIZES[frame.checksum.kind]
        at = frame.length - size if frame.checksum.at is None else frame.checksum.at % frame.length
        yield ("frame", "checksum"), at, at + size


def _checksum(checksum: FrameChecksum, fixed: int | None, longest: int) -> Iterator[Fault]:
    where: Place = ("frame", "checksum")
    bits = 8 * SIZES[checksum.kind]
    length = longest if fixed is None else fixed
    ends = {"from": checksum.start, "to": checksum.stop, "at": checksum.at}
    outside = [name for name, at in ends.items() if at is not None and not -length <= at <= length]
    for name in outside:
        yield (*where, name), f"{ends[name]} lies outside a frame of {length} bytes"
    if fixed is not None and not outside:
        at = fixed - SIZES[checksum.kind] if checksum.at is None else checksum.at % fixed
        stop = at if checksum.stop is None else _from_start(checksum.stop, fixed)
        if _from_start(checksum.start, fixed) >= stop:
            yield (*where, "from"), "covers no byte"
    is_crc = checksum.kind in ("crc8", "crc16-ccitt")
    defaults = type(checksum).model_fields
    given = {name for name, entry in defaults.items() if getattr(checksum, name) != entry.default}
    for name in sorted(given & {"init", "poly", "reflected", "xor_out"}):
        if not is_crc:
            yield (*where, name), f"{checksum.kind} has no such parameter"
        elif name != "reflected" and (getattr(checksum, name) or 0) >> bits:
            yield (*where, name), f"does not fit into {bits} bits"
    for name, kind in (("modulus", "fletcher16"), ("negated", "sum8")):
        if name in given and checksum.kind != kind:
            yield (*where, name), f"is a parameter of {kind} only"


def _from_start(at: int, length: int) -> int:
    return at + length if at < 0 else at


def _statuses(words: Iterable[Status | CellStatus], names: list[str], where: Place) -> Iterator[Fault]:
    for i, word in enumerate(words):
        width = 8 * TYPE_SIZES[word.type] if hasattr(word, "type") else 64
        for j, bit in enumerate(word.bits):
            if bit.bit >= width:
                yield (*where, i, "bits", j, "bit"), f"bit {bit.bit} of a word of {width} bits"
            for name in bit.fields:
                if name not in names:
                    yield (
                        (*where, i, "bits", j, "fields"),
                        f"no field {name!r}; there are: {', '.join(names)}",
                    )


def wrong_in_lines(lines: TextLines | None) -> Iterator[Fault]:
    """What does not fit together in lines."""
    if lines is None:
        return
    if lines.decimal == lines.separator:
        yield ("lines", "decimal"), "is the separator as well"
    if lines.separator != "blank" and len(lines.separator) > 1:
        yield ("lines", "separator"), f"is one character, or the word blank; not {lines.separator!r}"
    used: dict[int, str] = {} if lines.begins is None else {0: "begins"}
    entries: list[tuple[Place, int]] = [
        (("lines", "columns", i), cell.column) for i, cell in enumerate(lines.columns)
    ]
    entries += [(("lines", "counter"), lines.counter.column)] if lines.counter is not None else []
    entries += [(("lines", "status", i), word.column) for i, word in enumerate(lines.status)]
    for place, column in entries:
        if column in used:
            yield (*place, "column"), f"column {column} belongs already to {used[column]}"
        used[column] = name_of(place)
        if lines.cells is not None and column >= lines.cells:
            yield (*place, "column"), f"column {column} of a line with {lines.cells} cells, counted from 0"
    if lines.counter is not None and lines.counter.step * 4 > lines.counter.modulus:
        yield (
            ("lines", "counter", "step"),
            "is more than a quarter of the modulus: gaps could not be detected",
        )
    yield from _statuses(lines.status, [c.name for c in lines.columns], ("lines", "status"))
