# SPDX-License-Identifier: BSD-3-Clause
"""How the records of a raw binary file are laid out: a small YAML file, checked as a whole.

    skip: 256
    rate: 200
    frame:
      header: "A5 5A"
      endian: little
      counter: {at: 2, type: u16}
      fields:
        - {name: gyro_z, at: 4, type: i24, unit: deg/s, scale: 1.25e-4}

The words are those of the description of a serial IMU, so that bytes captured from a port are described as they were
on the wire.

References
----------
.. [1] YAML 1.2, https://yaml.org/spec/1.2.2/
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from allanite.errors import FormatError, InputError
from allanite.recording import Channel
from allanite.units import Quantity, parse_unit

__all__ = ["TYPE_SIZES", "Clock", "FieldEntry", "Layout", "RecordCounter", "RecordFrame", "read_layout"]

#: Bytes that each type takes.
TYPE_SIZES: Final[dict[str, int]] = {
    **{f"{sign}{bits}": bits // 8 for bits in (8, 16, 24, 32, 64) for sign in "ui"},
    "f32": 4,
    "f64": 8,
}
_MOST_BYTES = 1 << 18  # a larger file is no layout
_LONGEST = 65_535

Endian = Literal["little", "big"]
UnsignedType = Literal["u8", "u16", "u24", "u32", "u64"]
AnyType = Literal["u8", "i8", "u16", "i16", "u24", "i24", "u32", "i32", "u64", "i64", "f32", "f64"]
Place = Annotated[int, Field(ge=0, le=_LONGEST)]
Fault = tuple[str, str]


def _bytes(given: object) -> bytes:
    if isinstance(given, bytes):
        return given
    try:
        return bytes.fromhex(given)  # type: ignore[arg-type]
    except (ValueError, TypeError):
        raise ValueError(f'bytes in hexadecimal, in quotes, like "A5 5A"; not {given!r}') from None


class _Entry(BaseModel):
    """Unknown entries are refused: a word spelled wrong must not be a default in silence."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class FieldEntry(_Entry):
    """One channel: value = scale * raw + offset, in `unit`. `missing`, `overload`: raw values that mean that."""

    name: str = Field(min_length=1, max_length=80)
    at: Place | None = None
    type: AnyType
    endian: Endian | None = None
    unit: str = ""
    scale: float = Field(default=1.0, allow_inf_nan=False)
    offset: float = Field(default=0.0, allow_inf_nan=False)
    scale_factor: str | None = None
    missing: tuple[int, ...] = ()
    overload: tuple[int, ...] = ()


class RecordCounter(_Entry):
    """A number that goes on by `step` from record to record and begins anew at `modulus`."""

    at: Place
    type: UnsignedType
    endian: Endian | None = None
    modulus: int | None = Field(default=None, ge=4)
    step: int = Field(default=1, ge=1)

    @property
    def turns_at(self) -> int:
        """Where it begins anew."""
        return self.modulus or 256 ** TYPE_SIZES[self.type]


class Clock(_Entry):
    """A time stamp in every record."""

    at: Place
    type: AnyType
    endian: Endian | None = None
    unit: str


class RecordFrame(_Entry):
    """A record."""

    header: Annotated[bytes, BeforeValidator(_bytes)] = Field(default=b"", max_length=16)
    length: int | None = Field(default=None, ge=1, le=_LONGEST)
    endian: Endian = "little"
    counter: RecordCounter | None = None
    time: Clock | None = None
    fields: tuple[FieldEntry, ...] = Field(min_length=1)

    @property
    def places(self) -> tuple[int, ...]:
        """Where each field begins: at its `at`, or behind the one before it; the first one behind the header."""
        places, behind = [], len(self.header)
        for field in self.fields:
            start = behind if field.at is None else field.at
            places.append(start)
            behind = start + TYPE_SIZES[field.type]
        return tuple(places)

    @property
    def size(self) -> int:
        """Bytes of a record: `length`, or up to the last byte that is described."""
        if self.length is not None:
            return self.length
        return max(stop for _, _, stop in self.spans())

    def spans(self) -> Iterator[tuple[str, int, int]]:
        """Name in the layout and bytes of all that has a place."""
        for i, (field, at) in enumerate(zip(self.fields, self.places, strict=True)):
            yield f"frame.fields[{i}]", at, at + TYPE_SIZES[field.type]
        for name, part in (("counter", self.counter), ("time", self.time)):
            if part is not None:
                yield f"frame.{name}", part.at, part.at + TYPE_SIZES[part.type]


class Layout(_Entry):
    """A file of records.

    Attributes
    ----------
    skip : int [bytes]
        In front of the first record.
    rate : float or None [Hz]
        Records per second, where they hold no time.
    frame : RecordFrame
    """

    skip: int = Field(default=0, ge=0)
    rate: float | None = Field(default=None, gt=0, le=1e9, allow_inf_nan=False)
    frame: RecordFrame


def read_layout(source: str | os.PathLike[str] | Mapping[str, Any]) -> Layout:
    """A layout out of a YAML file, or of plain data.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not YAML, or something is wrong with it: the message lists every fault with its place.
    """
    if isinstance(source, Mapping):
        return _checked(source, "the layout")
    place = Path(source)
    entries = _yaml(place)
    if not isinstance(entries, Mapping):
        raise FormatError(f"{place} is no layout of records: it holds no entries like 'frame:'")
    return _checked(entries, str(place))


def _yaml(place: Path) -> Any:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        if place.stat().st_size > _MOST_BYTES:
            raise FormatError(f"{place} has {place.stat().st_size} bytes: that is no layout of records")
        return YAML(typ="safe", pure=True).load(place.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(f"no such file: {place}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{place} cannot be read: {error}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        raise FormatError(f"{place} is not YAML: {' '.join(str(error).split())[:200]}") from None


def _checked(entries: Mapping[str, Any], source: str) -> Layout:
    try:
        made = Layout.model_validate(dict(entries))
    except ValidationError as error:
        found = error.errors()
        places = [_where(one["loc"]) for one in found]
        wrong = [
            (place, _said(one))
            for place, one in zip(places, found, strict=True)
            # a list whose entries are wrong counts as empty: that is no fault of its own
            if one["type"] != "too_short" or not any(p.startswith(f"{place}[") for p in places)
        ]
    else:
        wrong = list(_contradictions(made))
        if not wrong:
            return made
    told = "\n".join(f"  {place}: {what}" for place, what in wrong)
    raise FormatError(f"{source} has {len(wrong)} {'fault' if len(wrong) == 1 else 'faults'}:\n{told}")


def _where(loc: tuple[str | int, ...]) -> str:
    return "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in loc).lstrip(".") or "top level"


def _said(found: Any) -> str:
    if found["type"] == "missing":
        return "is missing"
    if found["type"] == "extra_forbidden":
        return "is no entry that is known here; see the how-to for those that are"
    said = str(found["msg"]).removeprefix("Value error, ").replace("Input should", "should")
    return said if found["type"] == "value_error" else f"{said}, not {str(found['input'])[:60]!r}"


def _contradictions(layout: Layout) -> Iterator[Fault]:
    frame = layout.frame
    spans = sorted(frame.spans(), key=lambda span: span[1])
    for name, start, stop in spans:
        if start < len(frame.header):
            yield name, f"bytes {start} to {stop - 1} lie in the header of {len(frame.header)} bytes"
        if stop > frame.size:
            yield name, f"ends at byte {stop}, but the record has {frame.size}"
    for (one, _, stop), (other, start, _) in zip(spans, spans[1:], strict=False):
        if start < stop:
            yield other, f"byte {start} belongs already to {one}"
    if frame.time is not None and layout.rate is not None:
        yield "rate", "the records have a time: leave the rate out"
    seen: set[str] = set()
    for i, field in enumerate(frame.fields):
        yield from ((f"frame.fields[{i}]{at}", said) for at, said in _wrong_field(field, seen))
    counter = frame.counter
    if counter is not None and counter.turns_at > 256 ** TYPE_SIZES[counter.type]:
        yield "frame.counter.modulus", f"{counter.modulus} does not fit into {counter.type}"
    if counter is not None and counter.step * 4 > counter.turns_at:
        yield "frame.counter.step", "is more than a quarter of the modulus: gaps would not be seen"
    if frame.time is not None:
        try:
            parse_unit(frame.time.unit, Quantity.TIME)
        except InputError as error:
            yield "frame.time.unit", str(error)


def _wrong_field(field: FieldEntry, seen: set[str]) -> Iterator[Fault]:
    if field.name in seen:
        yield ".name", f"{field.name!r} is there twice"
    seen.add(field.name)
    if field.scale == 0:
        yield ".scale", "a scale of 0 makes every sample the same"
    if field.type in ("f32", "f64") and (field.missing or field.overload):
        yield "", "raw values that mean missing or overload exist for integers only"
    try:
        Channel.of(field.name, field.unit, scale_factor=field.scale_factor)
    except InputError as error:
        yield ".unit", str(error)
