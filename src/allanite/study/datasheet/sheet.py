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
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from allanite.errors import FormatError, InputError
from allanite.noise import NoiseModel
from allanite.noise.datasheet import SensorSheet, sensor_sheet
from allanite.plain_files.json_values import plain
from allanite.plain_files.yaml_text import read_yaml

__all__ = ["Datasheet", "read_datasheet"]

_FOR_THE_READER = ("sensor", "source")


@dataclass(frozen=True, slots=True, kw_only=True)
class Datasheet:
    """What a data sheet states.

    Attributes
    ----------
    sections : mapping of str to SensorSheet
        By "gyro", "accelerometer", or the name of a channel.
    sensor, source : str
        What it is called, and where the numbers come from.
    models : dict of str to NoiseModel
        The model of each section.
    """

    sections: Mapping[str, SensorSheet]
    sensor: str = ""
    source: str = ""
    models: dict[str, NoiseModel] = field(init=False)

    def __post_init__(self) -> None:
        made = {name: NoiseModel.of_sheet(section) for name, section in self.sections.items()}
        object.__setattr__(self, "models", made)

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
                made[name] = sensor_sheet(entries)
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
            role = {"gyro": "rate", "accelerometer": "acceleration"}.get(name)
            if role is not None and made[name].kind != role:
                raise InputError(f"{name}: these are units of {made[name].kind}, not of {role}")
        return cls(sections=made, sensor=sensor, source=source)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "sensor": self.sensor,
            "source": self.source,
            "sections": {
                name: {"entries": plain(section.entries), "model": self.models[name].to_json()}
                for name, section in self.sections.items()
            },
        }


def read_datasheet(path: str | os.PathLike[str]) -> Datasheet:
    """A data sheet out of a YAML file.

    Parameters
    ----------
    path : path

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
        return Datasheet.of(
            str(words.get("sensor", "")),
            str(words.get("source", "")),
            **{key: value for key, value in content.items() if key not in _FOR_THE_READER},
        )
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
