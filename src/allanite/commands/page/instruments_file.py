# SPDX-License-Identifier: BSD-3-Clause
"""The administrator's list of instruments: a YAML file that is read once, when the page starts.

instruments:
  - kind: serial
    title: IMU on the rate table
    port: /dev/ttyUSB0
    format: x1.yaml
  - kind: 3458a
    title: Multimeter on the bench
    resource: GPIB0::22::INSTR
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from allanite.acquisition.instruments.hp3458a.resources import device_of
from allanite.commands.page.attached import KINDS, Named
from allanite.errors import FormatError, InputError
from allanite.plain_files.yaml_text import read_yaml_lines
from allanite.plain_files.yaml_validation import Entry, Fault, Place, check_entries

__all__ = ["read_instruments"]

Line = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=200)]


class _Instrument(Entry):
    kind: Literal["serial", "3458a"]
    title: Line
    port: Line | None = None
    resource: Line | None = None
    format: Line | None = None


class _Listing(Entry):
    instruments: tuple[_Instrument, ...]


def read_instruments(source: str | os.PathLike[str], written: Iterable[Path]) -> tuple[Named, ...]:
    """The instruments that a file names.

    Parameters
    ----------
    source : path
    written : iterable of Path
        Folders that the page writes to, links resolved; the file must not be in one of them.

    Raises
    ------
    InputError
        No such file, one that the page could write, or wrong entries: the message lists all of them.
    """
    place = Path(source).resolve()
    if any(place.is_relative_to(folder) for folder in written):
        raise InputError(
            f"{source} is in a folder that the page writes to: move the list of instruments elsewhere, "
            "for example in "
            "/etc/allanite"
        )
    try:
        content, lines = read_yaml_lines(place, "list of instruments")
        if not isinstance(content, Mapping):
            raise FormatError(f"{source} is not a list of instruments: it must begin with 'instruments:'")
        listing = check_entries(
            _Listing, content, str(source), lines, lambda made: _faults(made, place.parent)
        )
    except FormatError as error:
        raise InputError(str(error)) from None
    return tuple(
        Named(
            kind=entry.kind,
            name=entry.port or entry.resource or "",
            title=entry.title,
            format="" if entry.format is None else str(place.parent / entry.format),
        )
        for entry in listing.instruments
    )


def _faults(listing: _Listing, beside: Path) -> Iterator[Fault]:
    titles = [entry.title for entry in listing.instruments]
    for i, entry in enumerate(listing.instruments):
        for at, fault in _faults_of(entry, beside):
            yield ("instruments", i, *at), fault
        if entry.title in titles[:i]:
            yield ("instruments", i, "title"), f"{entry.title!r} is given twice"


def _faults_of(entry: _Instrument, beside: Path) -> Iterator[tuple[Place, str]]:
    needed = KINDS[entry.kind]
    other = "resource" if needed == "port" else "port"
    if getattr(entry, needed) is None:
        yield (), f"gives no {needed}"
    if getattr(entry, other) is not None:
        yield (other,), f"belongs to another kind; a {entry.kind} has a {needed}"
    if entry.kind == "3458a" and entry.format is not None:
        yield ("format",), "describes the frames of a serial device"
    if entry.format is not None and not (beside / entry.format).is_file():
        yield ("format",), f"no such file: {beside / entry.format}"
    if entry.kind == "3458a" and entry.resource is not None:
        try:
            device_of(entry.resource)
        except InputError as error:
            yield ("resource",), str(error)
