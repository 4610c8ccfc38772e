# SPDX-License-Identifier: BSD-3-Clause
"""One row for each position: the means of its readings, kept in place of the log, with what the table tells of them.

A table of means says nothing of the noise by itself. Columns beside the means may: standard deviations of the means, or
of the readings with their number. Columns of times, lengths and headings are known by their names.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import refuse_more
from allanite.quantities.result import Result
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.position_rows import MOST
from allanite.recording.records import Channel, Kind, Recording

__all__ = ["PositionMeans", "SdColumns", "SdOf", "means_of"]

Array = NDArray[np.float64]
SdOf = Literal["readings", "means"]

#: What marks a column as the standard deviation of another one: of its readings, or of its mean.
_MARKS: dict[str, SdOf] = {
    **dict.fromkeys(("sd", "std", "stdev", "stddev", "sigma", "σ", "s"), "readings"),
    **dict.fromkeys(("sem", "se", "stderr", "sdom", "u", "unc", "uncertainty"), "means"),
}
_MEAN = {"mean", "means", "avg", "average"}
#: Names of columns that are no reading.
_COLUMNS = {
    "count": {"n", "count", "counts", "samples", "nsamples", "samplecount", "numsamples", "numberofsamples"},
    "duration": {"duration", "dwell", "averaging", "averagingtime", "averagetime", "avgtime", "length"},
    "start": {"start", "begin", "starttime", "time", "timestamp", "t"},
    "stop": {"stop", "end", "stoptime", "endtime"},
    "heading": {"heading", "azimuth"},
    "number": {"position", "pose", "no", "nr", "number", "index", "id", "row"},
}
_QUANTITIES = {
    "duration": QuantityKind.TIME,
    "start": QuantityKind.TIME,
    "stop": QuantityKind.TIME,
    "heading": QuantityKind.ANGLE,
}
_PLAIN = {"heading": math.radians(1.0)}
#: Digits after the decimal point up to which a table may have been rounded.
_DIGITS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class SdColumns(Result):
    """How standard deviations in a table of means were understood.

    Attributes
    ----------
    names : tuple of str
        Of their columns.
    count : str
        Column of the number of readings, where they are of readings; "" where they are of means.
    """

    names: tuple[str, ...]
    count: str = ""

    @property
    def says(self) -> str:
        """The same in a sentence."""
        taken = f"columns {', '.join(self.names)} are used as standard deviations of the"
        if not self.count:
            return f"{taken} means"
        return (
            f"{taken} readings, and divided by the root of their number ({self.count}) as for white noise; only the "
            "scatter of the positions shows slow noise"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionMeans:
    """Means of the readings in static positions.

    Attributes
    ----------
    rows : Recording
        Of the readings and thermometers: one sample for each position; its rate means nothing.
    sd : mapping of str to ndarray, shape (n,)
        Standard uncertainty of each mean by the table, in SI or the unit of the channel without one; empty where the
        table has none.
    start, duration : ndarray, shape (n,), or None [s]
        When each position began, and over which time it was averaged.
    heading : ndarray, shape (n,), or None [rad]
    sd_columns : SdColumns or None
        Of which that is.
    """

    rows: Recording = field(repr=False)
    sd: Mapping[str, Array] = field(default_factory=dict, repr=False)
    start: Array | None = None
    duration: Array | None = None
    heading: Array | None = None
    sd_columns: SdColumns | None = None

    @property
    def n(self) -> int:
        """Number of positions."""
        return self.rows.n_samples

    def means(self, names: Iterable[str]) -> Array:
        """Of channels, shape (n, channels), in SI or their own unit without one."""
        return np.stack([self.rows.scaled(name) for name in names], axis=1)

    def rounding(self, name: str) -> float:
        """Variance that writing the table with so many digits adds to each of its means."""
        channel, written = self.rows[name], self.rows.values(name)
        known = written[np.isfinite(written)]
        size = float(np.abs(known).max(initial=0.0)) or 1.0
        for digits in range(_DIGITS + 1):
            if np.allclose(np.round(known, digits), known, rtol=0, atol=1e-14 * size):
                break
        return (max(10.0**-digits, 1e-9 * size) * channel.scale) ** 2 / 12

    def sds(self, names: Iterable[str]) -> Array | None:
        """Standard uncertainties of the means of a triad, shape (n, 3); None where the table has none.

        Raises
        ------
        InputError
            Of some of its axes alone.
        """
        three = list(names)
        names_with_sd = [name for name in three if name in self.sd]
        if not names_with_sd:
            return None
        if len(names_with_sd) < len(three):
            lacking = ", ".join(name for name in three if name not in names_with_sd)
            raise InputError(
                f"the table has standard deviations of {', '.join(names_with_sd)}, and none of {lacking}: give all "
                "three, or none"
            )
        return np.stack([self.sd[name] for name in three], axis=1)


def means_of(
    recording: Recording, *, sd_of: SdOf | None = None, averaging: float | None = None
) -> PositionMeans:
    """A table of means, read as a recording with one sample for each row.

    Parameters
    ----------
    sd_of : "readings" or "means", optional
        What columns of standard deviations are of, where neither their names nor a column of counts tell. Those of
        readings need the counts, and take the noise for white.
    averaging : float, optional [s]
        Time over which each row is the mean, where no column says it.

    Raises
    ------
    InputError
        Standard deviations of nobody knows what, or that are not positive; an averaging time that makes no sense.
    LimitError
        More rows than positions that anybody takes.
    """
    refuse_more(
        recording.n_samples,
        MOST,
        "rows",
        recording.source or "the table",
        "A log of samples is read without --means",
    )
    column_names = {
        what: name for name in recording.names for what, names in _COLUMNS.items() if _plain(name) in names
    }
    rest = [name for name in recording.names if name not in column_names.values()]
    pairs = _deviations(rest)
    rows = recording.select(*(name for name in rest if name not in pairs))
    sd, sd_columns = _uncertainties(recording, pairs, column_names.get("count"), sd_of)
    start = _column(recording, column_names, "start")
    duration = _column(recording, column_names, "duration")
    if duration is None and start is not None and "stop" in column_names:
        stop = _column(recording, column_names, "stop")
        duration = None if stop is None else stop - start
    if duration is None and averaging is not None:
        duration = np.full(recording.n_samples, float(averaging))
    if duration is not None and not (np.isfinite(duration).all() and (duration > 0).all()):
        raise InputError("the time over which each row was averaged must be positive seconds in every row")
    if start is not None and not (np.isfinite(start).all() and (np.diff(start) > 0).all()):
        raise InputError(
            f"column {column_names['start']}: the times of the positions must grow from row to row"
        )
    return PositionMeans(
        rows=rows,
        sd=sd,
        start=start,
        duration=duration,
        heading=_column(recording, column_names, "heading"),
        sd_columns=sd_columns,
    )


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "", name.casefold())


def _column(recording: Recording, column_names: Mapping[str, str], what: str) -> Array | None:
    """A column that is no reading, in SI."""
    if what not in column_names:
        return None
    name = column_names[what]
    try:
        factor = parse_unit(recording[name].unit, _QUANTITIES[what]).factor
    except InputError:  # none, or that of all readings
        factor = _PLAIN.get(what, 1.0)
    return np.asarray(recording.values(name) * factor)


def _marked(name: str) -> tuple[str, str]:
    """What is left of a name without its mark, and the mark; "" for none."""
    parts = [p for p in re.split(r"[\W_]+", name.casefold()) if p and p not in _MEAN]
    for part in parts:
        if part in _MARKS:
            return "".join(p for p in parts if p != part), part
    whole = "".join(parts)
    for mark in sorted(_MARKS, key=len, reverse=True):
        if whole.startswith(mark):
            return whole.removeprefix(mark), mark
        if whole.endswith(mark):
            return whole.removesuffix(mark), mark
    return whole, ""


def _deviations(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Columns of standard deviations, with the channel and the mark of each."""
    listed = list(names)
    plain = {"".join(p for p in re.split(r"[\W_]+", n.casefold()) if p not in _MEAN): n for n in listed}
    deviations = {}
    for name in listed:
        rest, mark = _marked(name)
        if mark and plain.get(rest, name) != name:
            deviations[name] = (plain[rest], mark)
    return deviations


def _uncertainties(
    recording: Recording, pairs: Mapping[str, tuple[str, str]], count: str | None, sd_of: SdOf | None
) -> tuple[dict[str, Array], SdColumns | None]:
    """Of the means, and how the columns were understood."""
    if not pairs:
        return {}, None
    meanings = {sd_of or _MARKS[mark] for _, mark in pairs.values()}
    names = ", ".join(pairs)
    if len(meanings) > 1:
        raise InputError(f"columns {names}: some are of readings, some of means; say which with --sd-of")
    of_means = meanings == {"means"}
    if not of_means and count is None:
        raise InputError(
            f"columns {names}: standard deviations of the readings, or of their means? Say --sd-of means; those of "
            "readings need a column with their number (n)"
        )
    root: Array | float = 1.0
    if not of_means and count is not None:
        numbers = recording.values(count)
        if not (np.isfinite(numbers).all() and (numbers >= 1).all()):
            raise InputError(f"column {count}: every row needs the number of its readings")
        root = np.sqrt(numbers)
    uncertainties = {}
    for name, (of, _) in pairs.items():
        sd = np.asarray(recording.values(name) * _scale(recording[name], recording[of]) / root)
        if not (np.isfinite(sd).all() and (sd > 0).all()):
            raise InputError(f"column {name}: standard deviations must be positive numbers in every row")
        uncertainties[of] = sd
    return uncertainties, SdColumns(names=tuple(pairs), count="" if of_means or count is None else count)


def _scale(channel: Channel, of: Channel) -> float:
    """To SI, by the unit of the column, or that of its means where it has none."""
    if channel.kind is of.kind and of.kind is not Kind.UNKNOWN:
        return channel.scale
    return parse_unit(channel.unit).factor if channel.unit else of.scale
