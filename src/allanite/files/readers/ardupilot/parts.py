# SPDX-License-Identifier: BSD-3-Clause
"""From the records of a dataflash log to one table: which message, which instance, which clock. Runs in a child."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.readers.ardupilot import batches
from allanite.files.readers.ardupilot.records import Format, Records, find_records
from allanite.files.readers.contents import FilePart, choose_part, listed
from allanite.files.readers.spool import GrowingColumn
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural

__all__ = ["table_in"]

#: Messages of inertial sensors; older logs number them (IMU2, GYR3) where newer ones have a column I.
_INERTIAL: Final = re.compile(r"(IMU|GYR|ACC)\d?")
_RANKS: Final = {"IMU": 0, "GYR": 1, "ACC": 2}
_CLOCKS: Final = ("SampleUS", "TimeUS", "TimeMS")
_SAMPLES: Final = re.compile(r"(Gyr|Acc)[XYZ]|T")
_UNITS: Final = {"Gyr": "rad/s", "Acc": "m/s²", "T": "°C"}
#: How units are written in UNIT records, where that differs from what is read everywhere.
_SPELLED: Final = {"degC": "°C", "d%": "%"}

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _PartPlace:
    """Where a part is: a type of record and, if it has one, an instance."""

    form: Format
    instance: int | None
    column: str | None  # that holds the instance


def table_in(path: str, topic: str | None, channels: list[str] | None) -> tuple[dict[str, Any], Arrays]:
    """The table that is asked for (or the best one), and everything that is to be said of it.

    The arguments are those of `allanite.files.readers.read`.
    """
    records = find_records(Path(path))
    if not records.places or not any(len(p) for p in records.places.values()):
        raise FormatError(f"{Path(path).name}: this log has no complete record")
    stated = _stated_units(records)
    parts: dict[str, tuple[FilePart, _PartPlace | batches.SensorBatches]] = {}
    for part, place in _parts(records, topic, stated):
        parts.setdefault(part.name, (part, place))
    chosen, guesses = choose_part(
        [p for p, _ in parts.values()],
        topic,
        channels,
        file=Path(path).name,
        option="topic",
        what="message",
    )
    place = parts[chosen.name][1]
    sensor: dict[str, Any] = {}
    if isinstance(place, batches.SensorBatches):
        arrays, units, more = place.samples(records)
        rate: float | None = place.rate
    else:
        arrays, units, more, sensor = _columns(records, place, stated)
        rate = None
    guesses += [*more, *records.odd, *_loss(records)]
    facts = {
        "headings": list(arrays),
        "units": units,
        "rate": rate,
        "guesses": guesses,
        "source": {
            "topic": chosen.name,
            "contents": listed([p for p, _ in parts.values()]),
            "records": int(sum(len(p) for p in records.places.values())),
            "bytes_skipped": records.skipped,
            **sensor,
        },
    }
    return facts, arrays


def _loss(records: Records) -> list[str]:
    if records.skipped == 0:
        return []
    where = f"{records.skipped} bytes in {records.breaks} place(s)"
    return [f"{where} are outside complete records and are skipped; messages may be missing there"]


# -- what there is -----------------------------------------------------------------------------------------


def _parts(
    records: Records, topic: str | None, stated: dict[int, dict[str, str]]
) -> Iterator[tuple[FilePart, _PartPlace | batches.SensorBatches]]:
    """Every message of an inertial sensor and the one asked for; inertial ones without records, too."""
    by_name = {form.name: form for form in records.formats.values()}
    asked = "" if topic is None else topic.split("[")[0]
    for name in sorted(by_name, key=lambda n: (_RANKS.get(n[:3], 9), n)):
        if not _INERTIAL.fullmatch(name) and name != asked:
            continue
        form = by_name[name]
        if _clock(form) is None or not len(records.places[form.kind]):
            continue
        yield from _instances(records, form, stated)
    yield from batches.batches_in(records)


def _clock(form: Format) -> str | None:
    return next((c for c in _CLOCKS if c in form.numbers), None)


def _instances(
    records: Records, form: Format, stated: dict[int, dict[str, str]]
) -> Iterator[tuple[FilePart, _PartPlace]]:
    column = next((c for c in form.numbers if c == "I" or stated.get(form.kind, {}).get(c) == "#"), None)
    clock = str(_clock(form))
    extents: dict[int | None, list[float]] = {}  # instance -> rows, first and last stamp
    for block in records.blocks(form.kind):
        stamps = block[clock].astype(np.float64)
        numbers = block[column] if column else np.zeros(len(block), dtype=np.uint8)
        for one in np.unique(numbers).tolist():
            stamps_of_instance = stamps[numbers == one]
            entry = extents.setdefault(
                int(one) if column else None, [0, float(stamps_of_instance[0]), float(stamps_of_instance[0])]
            )
            entry[0], entry[2] = entry[0] + len(stamps_of_instance), float(stamps_of_instance[-1])
    for instance, (rows, first, last) in sorted(extents.items(), key=lambda s: s[0] or 0):
        span = (last - first) * (1e-3 if clock == "TimeMS" else 1e-6)
        part = FilePart(
            name=form.name if instance is None else f"{form.name}[{instance}]",
            rows=int(rows),
            columns=tuple(_wanted(form, column)),
            rate=(rows - 1) / span if rows > 1 and span > 0 else None,
            rank=_RANKS.get(form.name[:3], 9),
        )
        yield part, _PartPlace(form=form, instance=instance, column=column)


def _wanted(form: Format, instance: str | None) -> list[str]:
    """Columns that are channels: the samples of an inertial message, all numbers of any other."""
    if _INERTIAL.fullmatch(form.name):
        return ["temperature" if c == "T" else c for c in form.numbers if _SAMPLES.fullmatch(c)]
    return [c for c in form.numbers if c not in _CLOCKS and c != instance]


# -- units -------------------------------------------------------------------------------------------------


def _stated_units(records: Records) -> dict[int, dict[str, str]]:
    """Type of record -> column -> unit, as UNIT and FMTU records have them; "#" marks the instance."""
    forms = {form.name: form for form in records.formats.values()}
    if not {"UNIT", "FMTU"} <= set(forms):
        return {}
    unit, fmtu = forms["UNIT"], forms["FMTU"]
    if not {"Id", "Label"} <= set(unit.columns) or not {"FmtType", "UnitIds"} <= set(fmtu.columns):
        return {}
    labels = {
        chr(int(row["Id"]) & 0x7F): _text(row["Label"])
        for block in records.blocks(unit.kind)
        for row in block
    }
    stated: dict[int, dict[str, str]] = {}
    for block in records.blocks(fmtu.kind):
        for row in block:
            form = records.formats.get(int(row["FmtType"]))
            if form is not None:
                pairs = zip(form.columns, _text(row["UnitIds"]), strict=False)
                stated[form.kind] = {c: "#" if u == "#" else labels.get(u, "") for c, u in pairs}
    return stated


def _text(value: Any) -> str:
    return bytes(value).split(b"\0", 1)[0].decode("ascii", "replace")


def _unit(form: Format, column: str, stated: dict[str, str]) -> str:
    if column in stated and stated[column] not in ("", "#", "?", "UNKNOWN"):
        return _SPELLED.get(stated[column], stated[column])
    return _UNITS.get(column[:3] if column != "T" else "T", "") if _INERTIAL.fullmatch(form.name) else ""


# -- columns -----------------------------------------------------------------------------------------------


def _columns(
    records: Records, place: _PartPlace, stated: dict[int, dict[str, str]]
) -> tuple[Arrays, list[str], list[str], dict[str, Any]]:
    """Stamps and channels of one part, their units, remarks, and what the source notes of the sensor's rate."""
    form, clock = place.form, str(_clock(place.form))
    wanted = {("T" if c == "temperature" else c): c for c in _wanted(form, place.column)}
    growing = {c: GrowingColumn(_type_of(form, c)) for c in (clock, *wanted)}
    watched = _Watched(form)
    for block in records.blocks(form.kind):
        rows = block if place.column is None else block[block[place.column] == place.instance]
        for column, grown in growing.items():
            factor, values = form.factor(column), rows[column]
            grown.append(np.ascontiguousarray(values if factor == 1.0 else values * factor))
        watched.look(rows)
    heading = "timestamp_ms" if clock == "TimeMS" else "timestamp_us"
    arrays = {heading: growing[clock].finish_array()}
    arrays |= {name: growing[column].finish_array() for column, name in wanted.items()}
    units = [
        "ms" if clock == "TimeMS" else "us",
        *(_unit(form, c, stated.get(form.kind, {})) for c in wanted),
    ]
    remarks_of_clock = [f"time is {clock}, the time of each sample"] if clock == "SampleUS" else []
    return arrays, units, remarks_of_clock + watched.remarks(), watched.sensor_rate()


def _type_of(form: Format, column: str) -> np.dtype[Any]:
    kind = form.dtype[column]
    return np.dtype(np.float64) if form.factor(column) != 1.0 else kind


class _Watched:
    """What the driver says of its samples: errors counted, health, and the rate of the sensor behind the message."""

    def __init__(self, form: Format) -> None:
        self._errors: dict[str, tuple[float, float]] = {
            c: (0.0, 0.0) for c in ("EG", "EA") if c in form.numbers
        }
        self._unhealthy: dict[str, int] = {c: 0 for c in ("GH", "AH") if c in form.numbers}
        self._rates: dict[str, float] = {c: 0.0 for c in ("GHz", "AHz") if c in form.numbers}
        self._started = False

    def look(self, rows: NDArray[Any]) -> None:
        """Take the next rows in."""
        if len(rows) == 0:
            return
        for c, (first, _) in self._errors.items():
            self._errors[c] = (first if self._started else float(rows[c][0]), float(rows[c][-1]))
        for c in self._unhealthy:
            self._unhealthy[c] += int(np.count_nonzero(rows[c] == 0))
        for c in self._rates:
            self._rates[c] = max(self._rates[c], float(rows[c].max()))
        self._started = True

    def sensor_rate(self) -> dict[str, Any]:
        """The rate of the sensor, where the message states it: the autopilot filters and decimates it for the log."""
        rate = max(self._rates.values(), default=0.0)
        if rate <= 0:
            return {}
        advice = "log the raw samples: GYR and ACC (INS_RAW_LOG_OPT), or batches"
        return {"sensor_rate": {"hz": rate, "from": "GHz and AHz of the message", "advice": advice}}

    def remarks(self) -> list[str]:
        """What is to be said of them, in words."""
        who = {"G": "gyro", "A": "accelerometer"}
        sentences = [
            f"the driver of the {who[c[1]]} counted {last - first:.0f} errors during the log"
            for c, (first, last) in self._errors.items()
            if last > first
        ]
        sentences += [
            f"the {who[c[0]]} is marked as not healthy in {plural(n, 'sample')}"
            for c, n in self._unhealthy.items()
            if n
        ]
        return sentences
