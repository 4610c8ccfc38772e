# SPDX-License-Identifier: BSD-3-Clause
"""What is in a file with several tables, and which of them is read.

A flight log holds dozens of message types with a clock each, a LabVIEW file holds groups. A reader lists them as
`FilePart`, best first; the first one that has the channels asked for is read, unless the caller names another. Which
one was taken, and what else there is, is said in the notes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.files.readers.headings import canonical_group, read_heading
from allanite.files.readers.table import Table
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import ArrayColumn

__all__ = ["FilePart", "choose_part", "has_channel", "listed", "message_table"]

_MOST = 60  # parts that a message or the notes list
_MOST_COLUMNS, _MOST_NAMED = 8, 20
_AS_FAST = 0.8  # of the highest rate: a part so fast is not set aside for its rate


@dataclass(frozen=True, slots=True, kw_only=True)
class FilePart:
    """A table of a file.

    Attributes
    ----------
    name : str
        What the option that chooses it takes.
    rows : int
    columns : tuple of str
        Headings, time not included.
    rate : float or None [Hz]
        Rows over the time they span; None where the part has no time.
    rank : int
        Kind of part: a lower one is preferred among parts that are about as fast.
    spare : bool
        Never read unless asked for or alone: a copy, or pieces with long gaps between them.
    """

    name: str
    rows: int
    columns: tuple[str, ...]
    rate: float | None = None
    rank: int = 0
    spare: bool = False

    def __str__(self) -> str:
        rate = "" if self.rate is None else f", {self.rate:.4g} Hz"
        more = ", …" if len(self.columns) > _MOST_COLUMNS else ""
        columns = "" if self.columns == (self.name,) else f": {', '.join(self.columns[:_MOST_COLUMNS])}{more}"
        return f"{self.name} ({self.rows} rows{rate}{columns})"


def listed(parts: Sequence[FilePart]) -> list[str]:
    """The parts in words, for the notes."""
    return [str(p) for p in parts[:_MOST]] + (
        [f"and {len(parts) - _MOST} more"] if len(parts) > _MOST else []
    )


def choose_part(
    parts: Sequence[FilePart],
    wanted: str | None,
    channels: Sequence[str] | None,
    *,
    file: str,
    option: str,
    what: str,
) -> tuple[FilePart, list[str]]:
    """The part to read, and why, in words.

    Parameters
    ----------
    parts : sequence of FilePart
    wanted : str or None
        Name of a part. "IMU" means the first of IMU[0], IMU[1].
    channels : sequence of str or None
        Names or groups that the part must have, where none is named.
    file, option, what : str
        For messages: the file, the option that chooses ("topic"), and what parts are called ("message").

    Raises
    ------
    InputError
        There is none, or none with these channels; the message lists what there is.
    """
    full = [p for p in parts if p.rows > 0]
    everything = "; ".join(listed(parts)) or "nothing"
    if wanted is not None:
        of_name = [p for p in parts if p.name == wanted]
        of_name = of_name or [p for p in parts if p.name.lower() == wanted.lower()]
        of_name = of_name or [p for p in parts if p.name.lower().startswith(f"{wanted.lower()}[")]
        if not of_name:
            raise InputError(f"{file}: no {what} {wanted!r}; there are: {everything}")
        others = [p.name for p in of_name[1:]]
        choice = f"several {what}s {wanted}: {of_name[0].name} was read, not {', '.join(others)}"
        return of_name[0], [choice] if others else []
    fitting = [p for p in full if channels is None or all(has_channel(p, word) for word in channels)]
    if not fitting:
        asked = "" if channels is None else f" with the channels {', '.join(channels)}"
        raise InputError(f"{file}: no {what} of an inertial sensor{asked}; there are: {everything}")
    best = _best(fitting)
    rest = [p.name for p in full if p is not best]
    if not rest:
        return best, []
    more = f" and {len(rest) - _MOST_NAMED} more" if len(rest) > _MOST_NAMED else ""
    names = ", ".join(rest[:_MOST_NAMED]) + more
    return best, [
        f"several {what}s: {best.name} was read; choose another ({names}) with --{option} ({option}= in Python)"
    ]


def _best(parts: Sequence[FilePart]) -> FilePart:
    steady = [p for p in parts if not p.spare] or list(parts)
    fastest = max((p.rate or 0.0) for p in steady)
    fast = [p for p in steady if (p.rate or 0.0) >= _AS_FAST * fastest]
    return min(fast, key=lambda p: (p.rank, -p.rows))  # the first of equals


def has_channel(part: FilePart, word: str) -> bool:
    """True if a part has a channel of this name, or of this group."""
    group = canonical_group(word)
    return any(
        word.lower() in (column.lower(), read_heading(column).name.lower())
        or (group != "" and read_heading(column).group == group)
        for column in part.columns
    )


def message_table(
    facts: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], path: Path, file_format: str
) -> Table:
    """The table of one message of a flight log, as the child process gave it.

    Raises
    ------
    DataQualityError
        The message never comes.
    """
    headings = tuple(facts["headings"])
    if len(arrays[headings[0]]) == 0:
        raise DataQualityError(f"{path.name}: the log holds no message {facts['source']['topic']}")
    units, rate = tuple(facts["units"]), facts.get("rate")
    return Table(
        format=file_format,
        headings=headings,
        columns=tuple(ArrayColumn(arrays[h]) for h in headings),
        units=units,
        units_from="metadata" if any(units[1:]) else "none",  # the first column is time
        rate=rate,
        rate_from="header of the batches" if rate else "",
        apertures=facts.get("apertures", {}),
        source={"size_bytes": path.stat().st_size, **facts["source"]},
        guesses=tuple(facts["guesses"]),
    )
