# SPDX-License-Identifier: BSD-3-Clause
"""A data sheet as a YAML file: what it states of each kind of sensor, or of each channel.

    sensor: XYZ-100
    gyro:
      angle_random_walk: 0.3 deg/√h
      bias_instability: 5 deg/h
      bias_instability_is: minimum
    accelerometer:
      noise_density: 60 µg/√Hz
      density_is: one-sided

Sections are called ``gyro``, ``accelerometer``, or like the channels of the log. ``sensor`` and ``source`` are for the
reader. Entries are those of `allanite.noise.datasheet`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from allanite.errors import FormatError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.datasheet import SheetEntry, sensor_sheet
from allanite.plain_files.yaml_text import read_yaml
from allanite.quantities.result import Result

__all__ = ["Datasheet", "SheetSection", "read_datasheet"]

_FOR_THE_READER = ("sensor", "source")


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetSection(Result):
    """What a data sheet states of one kind of sensor, or of one channel.

    Attributes
    ----------
    entries : tuple of SheetEntry
        Statement by statement.
    model : NoiseModel
        What they make; its "verdict" says how they were read.
    """

    entries: tuple[SheetEntry, ...]
    model: NoiseModel


@dataclass(frozen=True, slots=True, kw_only=True)
class Datasheet(Result):
    """What a data sheet states.

    Attributes
    ----------
    sections : mapping of str to SheetSection
        By "gyro", "accelerometer", or the name of a channel.
    sensor, source : str
        What it is called, and where the numbers come from.
    file : str
        Name of its file; "" where it comes from none.
    """

    sections: Mapping[str, SheetSection]
    sensor: str = ""
    source: str = ""
    file: str = ""

    @property
    def models(self) -> dict[str, NoiseModel]:
        """The model of each section."""
        return {name: section.model for name, section in self.sections.items()}

    @classmethod
    def of(cls, sensor: str = "", source: str = "", **sections: Mapping[str, Any]) -> Datasheet:
        """From the entries of each section.

        Raises
        ------
        InputError
            No section, a section called by a role that its units contradict, or what `NoiseModel.from_datasheet`
            refuses: the message names the section.
        """
        if not sections:
            raise InputError("a data sheet has sections: gyro, accelerometer, or names of channels")
        made = {}
        for name, entries in sections.items():
            if not isinstance(entries, Mapping):
                raise InputError(
                    f"section {name!r} holds entries like 'bias_instability: 5 deg/h', not {entries!r}"
                )
            try:
                sheet = sensor_sheet(entries)
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
            role = {"gyro": "rate", "accelerometer": "acceleration"}.get(name)
            if role is not None and sheet.kind != role:
                raise InputError(f"{name}: these are units of {sheet.kind}, not of {role}")
            made[name] = SheetSection(entries=sheet.entries, model=NoiseModel.of_sheet(sheet))
        return cls(sections=made, sensor=sensor, source=source)


def read_datasheet(path: str | os.PathLike[str]) -> Datasheet:
    """Read a data sheet from a YAML file.

    Parameters
    ----------
    path : path
        YAML file of the data sheet.

    Raises
    ------
    InputError
        No such file, or statements that are ambiguous or contradict one another: the message names file and section.
    FormatError
        Not YAML, or not of the form above.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     place = Path(folder) / "sheet.yaml"
    ...     _ = place.write_text("gyro: {angle_random_walk: 0.3 deg/√h}", encoding="utf-8")
    ...     print(read_datasheet(place).models["gyro"])
    NoiseModel(N=8.727e-05)
    """
    place = Path(path)
    content = read_yaml(place, "data sheet")
    if not isinstance(content, Mapping) or not all(isinstance(key, str) for key in content):
        raise FormatError(f"{place} is no data sheet: it holds no sections like 'gyro:'")
    words = {key: content[key] for key in _FOR_THE_READER if key in content}
    wrong = [key for key, value in words.items() if not isinstance(value, (str, int, float))]
    if wrong:
        raise FormatError(f"{place}: {wrong[0]} is a line of text, not {words[wrong[0]]!r}")
    try:
        sheet = Datasheet.of(
            str(words.get("sensor", "")),
            str(words.get("source", "")),
            **{key: value for key, value in content.items() if key not in _FOR_THE_READER},
        )
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return replace(sheet, file=place.name)
