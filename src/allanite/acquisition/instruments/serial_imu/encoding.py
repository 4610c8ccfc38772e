# SPDX-License-Identifier: BSD-3-Clause
"""Samples in, bytes out: what a device of a description would send. The inverse of `framing`, for the simulator."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from allanite.acquisition.instruments.serial_imu.description import Description
from allanite.acquisition.instruments.serial_imu.frames import with_checksum
from allanite.acquisition.instruments.serial_imu.layout import BinaryFrame, StatusBit, TextLines
from allanite.acquisition.instruments.serial_imu.lines import with_line_checksum
from allanite.files.byte_layout import INTEGERS, TYPE_SIZES, ByteField

__all__ = ["Encoder"]


class Encoder:
    """The frames or lines that a device sends.

    Parameters
    ----------
    described : Description
    """

    def __init__(self, described: Description) -> None:
        self._frame, self._lines = described.frame, described.lines

    def encode(self, number: int, values: Sequence[float], flags: int = 0) -> bytes:
        """One frame or line.

        Parameters
        ----------
        number : int
            Of the sample; the counter shows it less whole turns.
        values : sequence of float, one for each channel [unit of the channel]
            Rounded to whole raw values; those beyond the range of the type become its end. NaN: the raw value that
            means missing or, under OVERLOAD, overload; 0 where there is none.
        flags : int
            Bits of `allanite.acquisition.instruments.Flag`; those that the status words of the device know are set.
        """
        if self._frame is not None:
            return _binary(self._frame, number, values, flags)
        assert self._lines is not None  # noqa: S101 - the description was checked
        return _text(self._lines, number, values, flags)


def _binary(frame: BinaryFrame, number: int, values: Sequence[float], flags: int) -> bytes:
    length = frame.length if isinstance(frame.length, int) else _shortest(frame)
    body = bytearray(length)
    body[: len(frame.header)] = frame.header
    if not isinstance(frame.length, int):
        stated = length - frame.length.add
        _put(body, frame.length.at, frame.length.type, frame.length.endian or frame.endian, stated)
    if frame.kind is not None:
        body[frame.kind.at : frame.kind.at + len(frame.kind.bytes)] = frame.kind.bytes
    if frame.counter is not None:
        raw = number * frame.counter.step % frame.counter.turns_at
        _put(body, frame.counter.at, frame.counter.type, frame.counter.endian or frame.endian, raw)
    for word in frame.status:
        _put(body, word.at, word.type, word.endian or frame.endian, _word(word.bits, flags))
    for field, at, value in zip(frame.fields, frame.places, values, strict=True):
        order = field.endian or frame.endian
        if field.type in INTEGERS:
            _put(body, at, field.type, order, _raw(field, value, flags))
        else:
            letter = ("<" if order == "little" else ">") + {"f32": "f", "f64": "d"}[field.type]
            struct.pack_into(letter, body, at, (value - field.offset) / field.scale)
    return with_checksum(frame, bytes(body))


def _shortest(frame: BinaryFrame) -> int:
    """A frame of the shortest length that holds everything, its checksum at the end."""
    from allanite.acquisition.instruments.serial_imu.checksums import SIZES

    ends = [at + TYPE_SIZES[field.type] for field, at in zip(frame.fields, frame.places, strict=True)]
    ends += [part.at + TYPE_SIZES[part.type] for part in (frame.counter, *frame.status) if part is not None]
    return max(ends) + (0 if frame.checksum is None else SIZES[frame.checksum.kind])


def _put(body: bytearray, at: int, kind: str, order: str, raw: int) -> None:
    size = TYPE_SIZES[kind]
    body[at : at + size] = raw.to_bytes(size, order, signed=kind[0] == "i")  # type: ignore[arg-type]


def _raw(field: ByteField, value: float, flags: int) -> int:
    if math.isnan(value):
        return next(iter((field.overload if flags & 1 else field.missing) or (0,)))
    bits = 8 * TYPE_SIZES[field.type]
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if field.type[0] == "i" else (0, (1 << bits) - 1)
    return min(max(round((value - field.offset) / field.scale), low), high)


def _word(bits: Sequence[StatusBit], flags: int) -> int:
    word = 0
    for bit in bits:
        if bool(flags & bit.mark) == bool(bit.when):
            word |= 1 << bit.bit
    return word


def _text(lines: TextLines, number: int, values: Sequence[float], flags: int) -> bytes:
    cells = ["0"] * lines.n_cells
    if lines.begins is not None:
        cells[0] = lines.begins
    for cell, value in zip(lines.columns, values, strict=True):
        raw = (value - cell.offset) / cell.scale
        text = ("OVLD" if flags & 1 else "nan") if math.isnan(raw) else repr(float(raw))
        cells[cell.column] = text.replace(".", lines.decimal)
    if lines.counter is not None:
        count = number * lines.counter.step % lines.counter.modulus
        cells[lines.counter.column] = f"{count:X}" if lines.counter.numbers == "hexadecimal" else str(count)
    for word in lines.status:
        flag_word = _word(word.bits, flags)
        cells[word.column] = f"{flag_word:X}" if word.numbers == "hexadecimal" else str(flag_word)
    separator = " " if lines.separator == "blank" else lines.separator
    return with_line_checksum(lines, separator.join(cells)).encode("ascii") + b"\r\n"
