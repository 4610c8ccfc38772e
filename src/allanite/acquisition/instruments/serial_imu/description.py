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

Fields and counters are described in the words of `allanite.files.byte_layout`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from allanite.acquisition.instruments.serial_imu.consistency import (
    wrong_in_channels,
    wrong_in_dialogue,
    wrong_in_frame,
    wrong_in_lines,
)
from allanite.acquisition.instruments.serial_imu.layout import (
    BinaryFrame,
    CellCounter,
    FrameField,
    IdentityQuery,
    LineColumn,
    PortSettings,
    TextLines,
    WireText,
)
from allanite.errors import FormatError
from allanite.files.byte_layout import ByteCounter
from allanite.plain_files.yaml_text import read_yaml_lines
from allanite.plain_files.yaml_validation import Entry, Fault, Place, check_entries
from allanite.recording.records import Channel

__all__ = ["Description", "read_description"]

#: Characters of a name, and texts that are sent.
_LONGEST_NAME, _MOST_TEXTS = 80, 64


class Description(Entry):
    """A device on a serial port.

    Attributes
    ----------
    maker, model, serial : str
    rate : float [Hz]
        Samples per second that the device is set to.
    sampling : "mean" or "point"
    aperture : float or None [s]
    port : PortSettings
    frame : BinaryFrame or None
    lines : TextLines or None
        One of the two.
    start, stop : tuple of WireText
        What makes the device begin and end; nothing for one that always sends.
    identity : IdentityQuery or None
    """

    maker: str = Field(default="", max_length=_LONGEST_NAME)
    model: str = Field(min_length=1, max_length=_LONGEST_NAME)
    serial: str = Field(default="", max_length=_LONGEST_NAME)
    rate: float = Field(gt=0, le=1e6, allow_inf_nan=False)
    sampling: Literal["mean", "point"] = "mean"
    aperture: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    port: PortSettings = PortSettings()
    frame: BinaryFrame | None = None
    lines: TextLines | None = None
    start: tuple[WireText, ...] = Field(default=(), max_length=_MOST_TEXTS)
    stop: tuple[WireText, ...] = Field(default=(), max_length=_MOST_TEXTS)
    identity: IdentityQuery | None = None

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
        return check_entries(Description, entries, "the description", {}, _contradictions)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels in the order of the fields or columns."""
        return tuple(field.channel(self.sampling, self.aperture) for field in self.measured)

    @property
    def measured(self) -> tuple[FrameField, ...] | tuple[LineColumn, ...]:
        """The fields or columns that are measured."""
        if self.frame is not None:
            return self.frame.fields
        return self.lines.columns if self.lines is not None else ()

    @property
    def counter(self) -> ByteCounter | CellCounter | None:
        """The counter of the device."""
        part = self.frame or self.lines
        return None if part is None else part.counter

    @property
    def identical(self) -> str:
        """Without a counter: are two equal frames in a row two samples ("keep") or a doubled frame ("drop")?"""
        part = self.frame or self.lines
        return "keep" if part is None else part.identical


def read_description(path: str | os.PathLike[str]) -> Description:
    """Read a description from a YAML file.

    Parameters
    ----------
    path : path
        File that describes the device.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not YAML, or something is wrong with the description: the message lists every fault with line and place.
    """
    place = Path(path)
    entries_of_file, lines = read_yaml_lines(place, "description of a device")
    if not isinstance(entries_of_file, Mapping):
        raise FormatError(f"{place} is not a description of a device: it has no entries like 'rate: 200'")
    return check_entries(Description, entries_of_file, str(place), lines, _contradictions)


def _contradictions(described: Description) -> Iterator[Fault]:
    """Place and words of everything that does not fit; nothing for a description that can be used."""
    frame, lines = described.frame, described.lines
    if (frame is None) == (lines is None):
        yield (), "give either 'frame' (binary) or 'lines' (text)"
    yield from wrong_in_dialogue(described.identity, start=described.start, stop=described.stop)
    where: Place = ("frame", "fields") if frame is not None else ("lines", "columns")
    yield from wrong_in_channels(described.measured, where, described.sampling, described.aperture)
    yield from wrong_in_frame(frame)
    yield from wrong_in_lines(lines)
