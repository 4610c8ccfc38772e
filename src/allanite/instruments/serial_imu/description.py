# SPDX-License-Identifier: BSD-3-Clause
"""What the frames or lines of a device look like: a YAML file, checked as a whole before a port is opened.

    model: X1
    rate: 200
    frame:
      header: "A5 5A"
      length: 20
      counter: {at: 2, type: u16}
      fields:
        - {name: gyro_z, at: 4, type: i24, unit: deg/s, scale: 1.25e-4}
      checksum: {kind: crc16-ccitt, from: 2}

References
----------
.. [1] YAML 1.2, https://yaml.org/spec/1.2.2/
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
)

from allanite.errors import FormatError
from allanite.instruments import Flag
from allanite.instruments.serial_imu.checksums import ChecksumKind
from allanite.recording import Channel

__all__ = [
    "INTEGERS",
    "TYPE_SIZES",
    "Answer",
    "ByteField",
    "Cell",
    "CellCounter",
    "CellStatus",
    "Counter",
    "Description",
    "Frame",
    "FrameChecksum",
    "LengthField",
    "LineChecksum",
    "Lines",
    "PortSettings",
    "Status",
    "StatusBit",
    "WireText",
    "read_description",
]

INTEGERS: dict[str, int] = {
    **{f"{sign}{bits}": bits // 8 for bits in (8, 16, 24, 32, 64) for sign in "ui"},
}
#: Bytes that each type takes.
TYPE_SIZES: dict[str, int] = {**INTEGERS, "f32": 4, "f64": 8}

Endian = Literal["little", "big"]
IntegerType = Literal["u8", "i8", "u16", "i16", "u24", "i24", "u32", "i32", "u64", "i64"]
UnsignedType = Literal["u8", "u16", "u24", "u32", "u64"]
AnyType = Literal[IntegerType, "f32", "f64"]
Place = Annotated[int, Field(ge=0, le=65535)]
#: Longest frame or line [bytes].
_LONGEST = 65_535


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
    bytes, BeforeValidator(_bytes), PlainSerializer(lambda found: found.hex(" ").upper(), return_type=str)
]


def _finite_scale(value: float) -> float:
    if value == 0:
        raise ValueError("a scale of 0 makes every sample the same")
    return value


Scale = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_finite_scale)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Part(BaseModel):
    """Unknown entries are refused: a word spelled wrong must not be a default in silence."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class WireText(_Part):
    """Bytes for the device: `text` (with the escapes of YAML's double quotes), or `hex`."""

    text: str | None = None
    hex: HexBytes | None = None

    @property
    def payload(self) -> bytes:
        """The bytes."""
        return self.hex if self.hex is not None else (self.text or "").encode("latin-1", "replace")


class Answer(_Part):
    """How to ask for the identity: what to send, and a regular expression with the groups serial and firmware."""

    ask: WireText
    answer: str
    seconds: float = Field(default=1.0, gt=0, le=60)


class PortSettings(_Part):
    """The serial line."""

    baud: int = Field(default=115_200, gt=0, le=12_000_000)
    bits: Literal[7, 8] = 8
    parity: Literal["none", "even", "odd"] = "none"
    stop: Literal[1, 2] = 1
    flow: Literal["none", "rtscts", "xonxoff"] = "none"


class _Measured(_Part):
    """One channel: value = scale * raw + offset, in `unit`."""

    name: str = Field(min_length=1, max_length=80)
    unit: str = ""
    scale: Scale = 1.0
    offset: Finite = 0.0
    scale_factor: str | None = None

    def channel(self, sampling: Literal["mean", "point"], aperture: float | None) -> Channel:
        """The channel of the recording."""
        return Channel.of(
            self.name, self.unit, sampling=sampling, aperture=aperture, scale_factor=self.scale_factor
        )


class ByteField(_Measured):
    """A field of a frame; without `at` it follows the one before. `missing`, `overload`: raw values that mean that."""

    at: Place | None = None
    type: AnyType
    endian: Endian | None = None
    missing: tuple[int, ...] = ()
    overload: tuple[int, ...] = ()


class Counter(_Part):
    """The counter of a frame; a clock is one too, with the `step` that it goes on by from sample to sample."""

    at: Place
    type: UnsignedType
    endian: Endian | None = None
    modulus: int | None = Field(default=None, ge=4)
    step: int = Field(default=1, ge=1)

    @property
    def turns_at(self) -> int:
        """Where it begins anew."""
        return self.modulus or 256 ** TYPE_SIZES[self.type]


class StatusBit(_Part):
    """A bit that says something of a sample: of `fields`, or of all."""

    bit: int = Field(ge=0, le=63)
    flag: Literal["overload", "missing", "resync", "doubtful"]
    fields: tuple[str, ...] = ()
    when: Literal[0, 1] = 1

    @property
    def mark(self) -> int:
        """Its bit among the flags of the sample."""
        return int(getattr(Flag, self.flag.upper()))


class Status(_Part):
    """A status word of a frame."""

    at: Place
    type: UnsignedType
    endian: Endian | None = None
    bits: tuple[StatusBit, ...] = Field(min_length=1)


class FrameChecksum(_Part):
    """The checksum of a frame. `at`, `from`, `to` count from the start, negative ones from the end.

    `at` is by default the end of the frame, `to` the checksum itself.
    """

    kind: ChecksumKind
    start: int = Field(alias="from")
    stop: int | None = Field(default=None, alias="to")
    at: int | None = None
    endian: Endian | None = None
    init: int | None = Field(default=None, ge=0)
    poly: int | None = Field(default=None, ge=0)
    reflected: bool = False
    xor_out: int = Field(default=0, ge=0)
    modulus: Literal[255, 256] = 255
    negated: bool = False


class LengthField(_Part):
    """Where a frame tells its length: the whole frame has field + `add` bytes, never more than `longest`."""

    at: Place
    type: Literal["u8", "u16"]
    endian: Endian | None = None
    add: int = 0
    longest: int = Field(default=256, ge=2, le=_LONGEST)


class KindField(_Part):
    """Bytes that frames of samples have at `at`; whole frames with others are passed over."""

    at: Place
    bytes: HexBytes


class Frame(_Part):
    """A binary frame."""

    header: HexBytes = Field(min_length=1, max_length=16)
    length: Annotated[int, Field(ge=2, le=_LONGEST)] | LengthField
    endian: Endian = "little"
    fields: tuple[ByteField, ...] = Field(min_length=1)
    counter: Counter | None = None
    status: tuple[Status, ...] = ()
    checksum: FrameChecksum | None = None
    kind: KindField | None = None
    confirm: bool | None = None
    identical: Literal["keep", "drop"] = "keep"


class Cell(_Measured):
    """A column of a line, counted from 0."""

    column: int = Field(ge=0, le=1000)


class CellCounter(_Part):
    """The counter of a line. Text does not show where it begins anew: say its modulus."""

    column: int = Field(ge=0, le=1000)
    modulus: int = Field(ge=4)
    step: int = Field(default=1, ge=1)
    numbers: Literal["decimal", "hexadecimal"] = "decimal"

    @property
    def turns_at(self) -> int:
        """Where it begins anew."""
        return self.modulus


class CellStatus(_Part):
    """A status word of a line."""

    column: int = Field(ge=0, le=1000)
    numbers: Literal["decimal", "hexadecimal"] = "decimal"
    bits: tuple[StatusBit, ...] = Field(min_length=1)


class LineChecksum(_Part):
    """Hexadecimal digits behind a mark; of what stands between `skip` and the mark. NMEA 0183: all the defaults."""

    kind: ChecksumKind = "xor"
    skip: str = Field(default="$", max_length=8)
    mark: str = Field(default="*", min_length=1, max_length=8)


class Lines(_Part):
    """Lines of text."""

    separator: str = Field(default=",", min_length=1, max_length=8)
    decimal: Literal[".", ","] = "."
    begins: str | None = Field(default=None, min_length=1, max_length=40)
    cells: int | None = Field(default=None, ge=1, le=1000)
    columns: tuple[Cell, ...] = Field(min_length=1)
    counter: CellCounter | None = None
    status: tuple[CellStatus, ...] = ()
    checksum: LineChecksum | None = None
    longest: int = Field(default=512, ge=8, le=_LONGEST)
    identical: Literal["keep", "drop"] = "keep"

    @property
    def n_cells(self) -> int:
        """Cells of a line; by default up to the last one that is named."""
        named = [cell.column for cell in self.columns] + [word.column for word in self.status]
        named += [self.counter.column] if self.counter is not None else []
        return self.cells or max(named) + 1


class Description(_Part):
    """A device on a serial port.

    Attributes
    ----------
    maker, model, serial : str
    rate : float [Hz]
        Samples per second that the device is set to.
    sampling : "mean" or "point"
    aperture : float or None [s]
    port : PortSettings
    frame : Frame or None
    lines : Lines or None
        One of the two.
    start, stop : tuple of WireText
        What makes the device begin and end; nothing for one that always sends.
    identity : Answer or None
    """

    maker: str = ""
    model: str = Field(min_length=1)
    serial: str = ""
    rate: float = Field(gt=0, le=1e6, allow_inf_nan=False)
    sampling: Literal["mean", "point"] = "mean"
    aperture: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    port: PortSettings = PortSettings()
    frame: Frame | None = None
    lines: Lines | None = None
    start: tuple[WireText, ...] = ()
    stop: tuple[WireText, ...] = ()
    identity: Answer | None = None

    @classmethod
    def of(cls, entries: Mapping[str, Any]) -> Description:
        """From plain data.

        Raises
        ------
        FormatError
            Everything that is wrong, each with its place.

        Examples
        --------
        >>> imu = Description.of({
        ...     "model": "X1", "rate": 100,
        ...     "lines": {"columns": [{"name": "gyro_z", "column": 0, "unit": "deg/s"}]},
        ... })
        >>> imu.channels[0].unit
        'deg/s'
        """
        return _checked(entries, "the description", {})

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels in the order of the fields or columns."""
        return tuple(field.channel(self.sampling, self.aperture) for field in self.measured)

    @property
    def measured(self) -> tuple[ByteField, ...] | tuple[Cell, ...]:
        """The fields or columns that are measured."""
        if self.frame is not None:
            return self.frame.fields
        return self.lines.columns if self.lines is not None else ()

    @property
    def counter(self) -> Counter | CellCounter | None:
        """The counter of the device."""
        part = self.frame or self.lines
        return None if part is None else part.counter

    @property
    def identical(self) -> str:
        """Without a counter: are two equal frames in a row two samples ("keep") or a doubled frame ("drop")?"""
        part = self.frame or self.lines
        return "keep" if part is None else part.identical


def read_description(path: str | os.PathLike[str]) -> Description:
    """A description out of a YAML file.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not YAML, or something is wrong with the description: the message lists every fault with line and place.
    """
    from allanite.instruments.serial_imu.yaml_file import read_yaml

    place = Path(path)
    found, lines = read_yaml(place)
    if not isinstance(found, Mapping):
        raise FormatError(f"{place} is no description of a device: it holds no entries like 'rate: 200'")
    return _checked(found, str(place), lines)


def _checked(
    entries: Mapping[str, Any], source: str, lines: Mapping[tuple[str | int, ...], int]
) -> Description:
    from allanite.instruments.serial_imu.consistency import contradictions

    try:
        made = Description.model_validate(dict(entries))
    except ValidationError as error:
        found = error.errors()
        places = [_place_of(one["loc"], entries) for one in found]
        wrong = [
            (place, _said(one))
            for place, one in zip(places, found, strict=True)
            # a list whose entries are wrong counts as empty: that is no fault of its own
            if one["type"] != "too_short" or not any(p != place and p[: len(place)] == place for p in places)
        ]
        raise FormatError(_listed(wrong, source, lines)) from None
    if wrong := contradictions(made):
        raise FormatError(_listed(wrong, source, lines))
    return made


def _place_of(loc: tuple[str | int, ...], entries: object) -> tuple[str | int, ...]:
    """The place without the names that pydantic gives to the members of a union."""
    place: list[str | int] = []
    inside: Any = entries
    for i, step in enumerate(loc):
        if isinstance(inside, Mapping) and step not in inside and i < len(loc) - 1:
            continue
        place.append(step)
        if isinstance(inside, Mapping):
            inside = inside.get(step)
        elif isinstance(inside, (list, tuple)) and isinstance(step, int) and step < len(inside):
            inside = inside[step]
        elif i < len(loc) - 1:
            place.pop()
    return tuple(place)


def _said(found: Any) -> str:
    if found["type"] == "missing":
        return "is missing"
    if found["type"] == "extra_forbidden":
        return "is no entry that is known here; see the how-to for those that are"
    said = str(found["msg"]).removeprefix("Value error, ")
    said = said.replace("Input should", "should")
    return said if found["type"] == "value_error" else f"{said}, not {str(found['input'])[:60]!r}"


def _listed(
    wrong: list[tuple[tuple[str | int, ...], str]],
    source: str,
    lines: Mapping[tuple[str | int, ...], int],
) -> str:
    in_order = sorted(wrong, key=lambda fault: _line(fault[0], lines) or 0)
    told = list(dict.fromkeys(f"  {_where(place, lines)}: {what}" for place, what in in_order))
    return f"{source} has {len(told)} {'fault' if len(told) == 1 else 'faults'}:\n" + "\n".join(told)


def _where(place: tuple[str | int, ...], lines: Mapping[tuple[str | int, ...], int]) -> str:
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).lstrip(".")
    known = _line(place, lines)
    return (text or "top level") if known is None else f"line {known}, {text}"


def _line(place: tuple[str | int, ...], lines: Mapping[tuple[str | int, ...], int]) -> int | None:
    """Of the entry, or of the nearest one around it."""
    return next((lines[place[:n]] for n in range(len(place), 0, -1) if place[:n] in lines), None)
