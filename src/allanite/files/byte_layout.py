# SPDX-License-Identifier: BSD-3-Clause
"""The words in which a YAML file says what numbers lie in a record of bytes, and the faults that they may have.

They are the same for the frames of a device on a serial port and for the records of a raw binary file, so that bytes
captured from a port are described as they were on the wire.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, Field, PlainSerializer

from allanite.errors import InputError
from allanite.plain_files.yaml_validation import Entry, Fault, Place, name_of
from allanite.recording.records import Channel, Sampling

__all__ = [
    "INTEGERS",
    "LONGEST",
    "TYPE_SIZES",
    "AnyType",
    "ByteCounter",
    "ByteField",
    "ByteRecord",
    "Endian",
    "HexBytes",
    "Offset",
    "RawChannel",
    "Span",
    "UnsignedType",
    "wrong_in_record",
    "wrong_measured",
]

INTEGERS: Final[dict[str, int]] = {
    **{f"{sign}{bits}": bits // 8 for bits in (8, 16, 24, 32, 64) for sign in "ui"},
}
#: Bytes that each type takes.
TYPE_SIZES: Final[dict[str, int]] = {**INTEGERS, "f32": 4, "f64": 8}
#: Longest record [bytes].
LONGEST: Final = 65_535

Endian = Literal["little", "big"]
UnsignedType = Literal["u8", "u16", "u24", "u32", "u64"]
AnyType = Literal[UnsignedType, "i8", "i16", "i24", "i32", "i64", "f32", "f64"]
Offset = Annotated[int, Field(ge=0, le=LONGEST)]
#: Where something is described, and the bytes [start, stop) of the record that it takes.
Span = tuple[Place, int, int]


def _bytes(given: object) -> bytes:
    if isinstance(given, bytes):
        return given
    if not isinstance(given, str):
        raise ValueError(f'bytes in hexadecimal, in quotes, like "A5 5A"; not {given!r}')
    try:
        return bytes.fromhex(given)
    except ValueError:
        raise ValueError(f'bytes in hexadecimal like "A5 5A", not {given!r}') from None


HexBytes = Annotated[
    bytes, BeforeValidator(_bytes), PlainSerializer(lambda value: value.hex(" ").upper(), return_type=str)
]


class RawChannel(Entry):
    """One channel: value = scale * raw + offset, in `unit`."""

    name: str = Field(min_length=1, max_length=80)
    unit: str = ""
    scale: float = Field(default=1.0, allow_inf_nan=False)
    offset: float = Field(default=0.0, allow_inf_nan=False)
    scale_factor: str | None = None

    def channel(self, sampling: Sampling = "mean", aperture: float | None = None) -> Channel:
        """The channel of the recording."""
        return Channel.of(
            self.name, self.unit, sampling=sampling, aperture=aperture, scale_factor=self.scale_factor
        )


class ByteField(RawChannel):
    """A field; without `at` it follows the one before. `missing`, `overload`: raw values that mean that."""

    at: Offset | None = None
    type: AnyType
    endian: Endian | None = None
    missing: tuple[int, ...] = ()
    overload: tuple[int, ...] = ()


class ByteCounter(Entry):
    """A number that goes on by `step` from record to record and begins anew at `modulus`. A clock is one, too."""

    at: Offset
    type: UnsignedType
    endian: Endian | None = None
    modulus: int | None = Field(default=None, ge=4)
    step: int = Field(default=1, ge=1)

    @property
    def turns_at(self) -> int:
        """Where it begins anew."""
        return self.modulus or 256 ** TYPE_SIZES[self.type]


class ByteRecord(Entry):
    """A header and fields."""

    header: HexBytes = Field(default=b"", max_length=16)
    endian: Endian = "little"
    fields: tuple[ByteField, ...] = Field(min_length=1)
    counter: ByteCounter | None = None

    @property
    def places(self) -> tuple[int, ...]:
        """Where each field begins: at its `at`, or behind the one before it; the first one behind the header."""
        places, behind = [], len(self.header)
        for field in self.fields:
            start = behind if field.at is None else field.at
            places.append(start)
            behind = start + TYPE_SIZES[field.type]
        return tuple(places)


def wrong_in_record(
    record: ByteRecord, spans: Iterable[Span], longest: int, *, where: Place, what: str
) -> Iterator[Fault]:
    """What does not fit together in a record.

    Parameters
    ----------
    record : ByteRecord
    spans : iterable of Span
        Everything that has a place in it.
    longest : int
        Bytes that it has at the most.
    where : Place
        Its own entry.
    what : str
        What it is called, for messages.
    """
    in_order = sorted(spans, key=lambda span: span[1:])
    for place, start, stop in in_order:
        if start < len(record.header):
            yield place, f"bytes {start} to {stop - 1} lie in the header of {len(record.header)} bytes"
        if stop > longest:
            yield place, f"ends at byte {stop}, but the {what} has {longest}"
    for (one, _, stop), (other, start, _) in zip(in_order, in_order[1:], strict=False):
        if start < stop:
            yield other, f"byte {start} belongs already to {name_of(one)}"
    for i, field in enumerate(record.fields):
        if field.type not in INTEGERS and (field.missing or field.overload):
            yield (*where, "fields", i), "raw values for missing or overload are possible only for integers"
    counter = record.counter
    if counter is not None and counter.turns_at > 256 ** TYPE_SIZES[counter.type]:
        yield (*where, "counter", "modulus"), f"{counter.modulus} does not fit into {counter.type}"
    if counter is not None and counter.step * 4 > counter.turns_at:
        yield (*where, "counter", "step"), "is more than a quarter of the modulus: gaps could not be detected"


def wrong_measured(
    measured: Sequence[RawChannel], where: Place, sampling: Sampling = "mean", aperture: float | None = None
) -> Iterator[Fault]:
    """Channels that cannot be: a name that is there twice, a scale of 0, a unit that is none."""
    names: set[str] = set()
    for i, one in enumerate(measured):
        if one.name in names:
            yield (*where, i, "name"), f"{one.name!r} is there twice"
        names.add(one.name)
        if one.scale == 0:
            yield (*where, i, "scale"), "a scale of 0 makes every sample the same"
        try:
            one.channel(sampling, aperture)
        except InputError as error:
            yield (*where, i, "unit"), str(error)
