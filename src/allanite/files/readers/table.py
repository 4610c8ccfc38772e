# SPDX-License-Identifier: BSD-3-Clause
"""What a reader returns, and what its caller says about the file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.stamp_table import TimeChoice
from allanite.files.readers.stated_rate import RateDoubt
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Channel, Column, Sampling

__all__ = ["Options", "Table", "WordColumn"]


class WordColumn(Protocol):
    """A column of words beside those of numbers, read by position."""

    @property
    def name(self) -> str:
        """As it stands in the file."""
        ...

    def read(self, start: int, stop: int) -> NDArray[np.str_]:
        """WordColumn [start, stop)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What the caller says about a file; see `allanite.files.readers.read`."""

    unit: str | Mapping[str, str] | None = None
    rate: float | None = None
    channels: Sequence[str] | None = None
    sampling: Sampling = "mean"
    scale_factor: str | Mapping[str, str] | None = None
    delimiter: str | None = None
    decimal: str | None = None
    topic: str | None = None
    variable: str | None = None
    layout: str | os.PathLike[str] | Mapping[str, Any] | None = None
    time: str | None = None
    start: float | None = None
    stop: float | None = None
    kind: str | None = None
    carrier: float | None = None

    def __post_init__(self) -> None:
        for what, option in (("unit", self.unit), ("scale_factor", self.scale_factor)):
            _refuse_other_than_texts(what, option)
        names = [self.channels] if self.channels is None or isinstance(self.channels, str) else self.channels
        if not isinstance(names, Iterable) or not all(isinstance(n, str) for n in names if n is not None):
            raise InputError(f"channels must be names, as in ['gyro_x', 'gyro_y'], not {self.channels!r}")
        if not isinstance(self.time, str | None):
            raise InputError(f"time must name a column, as in 't' or 't:ms', not {self.time!r}")
        for what, moment in (("start", self.start), ("stop", self.stop)):
            if not isinstance(moment, int | float | np.integer | np.floating | None):
                raise InputError(f"{what} must be seconds since the first sample, not {moment!r}")

    @property
    def channel_names(self) -> list[str] | None:
        """The channels that are asked for; one alone may be given without a list."""
        if self.channels is None:
            return None
        return [self.channels] if isinstance(self.channels, str) else list(self.channels)


def _refuse_other_than_texts(what: str, option: object) -> None:
    texts = list(option.values()) if isinstance(option, Mapping) else [option or ""]
    if not all(isinstance(text, str) for text in texts):
        raise InputError(f"{what} must be a text or a mapping of channel or group to text, not {option!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Columns of a file, before anybody has said which is what.

    Attributes
    ----------
    format : str
        Name of the format, for messages and notes.
    headings : tuple of str
        As they stand in the file; "" where there is none.
    columns : tuple of Column
        One per heading, equally long.
    numbers : tuple of int
        Numbers of the columns in the file, from 1, where some of the file are not among them.
    units : tuple of str
        Units that the file gives apart from the headings (a units row, metadata); "" where there is none.
    units_from : str
        Where `units` come from: "units row", "preamble", "cells" (behind the numbers), "metadata", "layout", "none".
    time_units : dict of column number to unit
        Columns that hold dates, already in ns since 1970 UTC.
    questions : dict of column number to str
        What is asked of the caller where such a column is time: the order of its dates.
    stamps : TimeChoice or None
        Time that the reader knows for sure (message stamps).
    rate : float or None [Hz]
        Rate that the file states.
    rate_from : str
        Where it states it.
    rate_doubt : RateDoubt or None
        What it states of the rate, where that is not taken as it stands.
    apertures : mapping of heading to float [s]
        Over how long each sample gathered, where the file says so.
    text : dict or None
        Facts about a text file.
    source : dict
        Facts about the file.
    prefix : str
        Begins the names of columns that have none: the kind of the rows.
    guesses : tuple of str
        What had to be guessed, in words.
    left_out : tuple of str
        Headings of columns that hold no numbers.
    channels : tuple of Channel or None
        Channels in full, where the file is one of our own.
    words : tuple of WordColumn
        Columns of words, as long as the others: they may tell the rows of several sensors apart.
    """

    format: str
    headings: tuple[str, ...]
    columns: tuple[Column, ...]
    numbers: tuple[int, ...] = ()
    units: tuple[str, ...] = ()
    units_from: str = "none"
    time_units: dict[int, str] = field(default_factory=dict)
    questions: dict[int, str] = field(default_factory=dict)
    stamps: TimeChoice | None = None
    rate: float | None = None
    rate_from: str = ""
    rate_doubt: RateDoubt | None = None
    apertures: Mapping[str, float] = field(default_factory=dict)
    start: int | None = None
    text: dict[str, Any] | None = None
    source: dict[str, Any] = field(default_factory=dict)
    prefix: str = ""
    guesses: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    channels: tuple[Channel, ...] | None = None
    history: tuple[Mapping[str, Any], ...] = ()
    words: tuple[WordColumn, ...] = ()
