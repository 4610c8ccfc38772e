# SPDX-License-Identifier: BSD-3-Clause
"""The parts of a description: the frame or the lines of a device, its port, and what it is sent."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from allanite.acquisition.instruments import Flag
from allanite.acquisition.instruments.serial_imu.checksums import ChecksumKind
from allanite.files.byte_layout import (
    LONGEST,
    ByteField,
    ByteRecord,
    Endian,
    HexBytes,
    Offset,
    RawChannel,
    UnsignedType,
)
from allanite.plain_files.yaml_validation import Entry

__all__ = [
    "BinaryFrame",
    "CellCounter",
    "CellStatus",
    "FrameChecksum",
    "FrameField",
    "IdentityQuery",
    "KindField",
    "LengthField",
    "LineChecksum",
    "LineColumn",
    "PortSettings",
    "Status",
    "StatusBit",
    "TextLines",
    "WireText",
]

#: Bytes that are sent at once; characters of a regular expression.
_LONGEST_TEXT, _LONGEST_PATTERN = 1024, 200


Finite = Annotated[float, Field(allow_inf_nan=False)]


class WireText(Entry):
    """Bytes for the device: `text` (with the escapes of YAML's double quotes), or `hex`."""

    text: str | None = Field(default=None, max_length=_LONGEST_TEXT)
    hex: HexBytes | None = Field(default=None, max_length=_LONGEST_TEXT)

    @property
    def payload(self) -> bytes:
        """The bytes."""
        return self.hex if self.hex is not None else (self.text or "").encode("latin-1", "replace")


class IdentityQuery(Entry):
    """How to ask for the identity: what to send, and a regular expression with the groups serial and firmware."""

    ask: WireText
    answer: str = Field(max_length=_LONGEST_PATTERN)
    seconds: float = Field(default=1.0, gt=0, le=60)


class PortSettings(Entry):
    """The serial line."""

    baud: int = Field(default=115_200, gt=0, le=12_000_000)
    bits: Literal[7, 8] = 8
    parity: Literal["none", "even", "odd"] = "none"
    stop: Literal[1, 2] = 1
    flow: Literal["none", "rtscts", "xonxoff"] = "none"


class StatusBit(Entry):
    """A bit that says something of a sample: of `fields`, or of all."""

    bit: int = Field(ge=0, le=63)
    flag: Literal["overload", "missing", "resync", "doubtful"]
    fields: tuple[str, ...] = ()
    when: Literal[0, 1] = 1

    @property
    def mark(self) -> int:
        """Its bit among the flags of the sample."""
        return int(getattr(Flag, self.flag.upper()))


class Status(Entry):
    """A status word of a frame."""

    at: Offset
    type: UnsignedType
    endian: Endian | None = None
    bits: tuple[StatusBit, ...] = Field(min_length=1)


class FrameChecksum(Entry):
    """The checksum of a frame. `at`, `from`, `to` count from the start, negative ones from the end.

    `at` is by default the end of the frame, `to` the checksum itself.
    """

    model_config = ConfigDict(populate_by_name=True)

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


class LengthField(Entry):
    """Where a frame tells its length: the whole frame has field + `add` bytes, never more than `longest`."""

    at: Offset
    type: Literal["u8", "u16"]
    endian: Endian | None = None
    add: int = 0
    longest: int = Field(default=256, ge=2, le=LONGEST)


class KindField(Entry):
    """Bytes that frames of samples have at `at`; whole frames with others are passed over."""

    at: Offset
    bytes: HexBytes


class _Limited(Entry):
    """What a value lies between, in its unit; beyond it no sensor gave it."""

    limits: tuple[Finite, Finite] | None = None


class FrameField(ByteField, _Limited):
    """A field of a frame."""


class BinaryFrame(ByteRecord):
    """A binary frame."""

    fields: tuple[FrameField, ...] = Field(min_length=1)

    header: HexBytes = Field(min_length=1, max_length=16)
    length: Annotated[int, Field(ge=2, le=LONGEST)] | LengthField
    status: tuple[Status, ...] = ()
    checksum: FrameChecksum | None = None
    kind: KindField | None = None
    confirm: bool | None = None
    identical: Literal["keep", "drop"] = "keep"


class LineColumn(RawChannel, _Limited):
    """A column of a line, counted from 0."""

    column: int = Field(ge=0, le=1000)


class CellCounter(Entry):
    """The counter of a line. Text does not show where it begins anew: say its modulus."""

    column: int = Field(ge=0, le=1000)
    modulus: int = Field(ge=4)
    step: int = Field(default=1, ge=1)
    numbers: Literal["decimal", "hexadecimal"] = "decimal"

    @property
    def turns_at(self) -> int:
        """Where it begins anew."""
        return self.modulus


class CellStatus(Entry):
    """A status word of a line."""

    column: int = Field(ge=0, le=1000)
    numbers: Literal["decimal", "hexadecimal"] = "decimal"
    bits: tuple[StatusBit, ...] = Field(min_length=1)


class LineChecksum(Entry):
    """Hexadecimal digits behind a mark; of what stands between `skip` and the mark. NMEA 0183: all the defaults."""

    kind: ChecksumKind = "xor"
    skip: str = Field(default="$", max_length=8)
    mark: str = Field(default="*", min_length=1, max_length=8)


class TextLines(Entry):
    """Lines of text."""

    separator: str = Field(default=",", min_length=1, max_length=8)
    decimal: Literal[".", ","] = "."
    begins: str | None = Field(default=None, min_length=1, max_length=40)
    cells: int | None = Field(default=None, ge=1, le=1000)
    columns: tuple[LineColumn, ...] = Field(min_length=1)
    counter: CellCounter | None = None
    status: tuple[CellStatus, ...] = ()
    checksum: LineChecksum | None = None
    longest: int = Field(default=512, ge=8, le=LONGEST)
    identical: Literal["keep", "drop"] = "keep"

    @property
    def n_cells(self) -> int:
        """Cells of a line; by default up to the last one that is named."""
        named = [cell.column for cell in self.columns] + [word.column for word in self.status]
        named += [self.counter.column] if self.counter is not None else []
        return self.cells or max(named) + 1
