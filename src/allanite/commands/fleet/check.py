# SPDX-License-Identifier: BSD-3-Clause
"""Does a unit on the bench keep the limits of its fleet?"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.declaration import Command
from allanite.commands.fleet.sheet_limits import ROLES, Key, sheet_limits
from allanite.commands.option import ACCEPT, option
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult
    from allanite.recording.records import Channel
    from allanite.stability.fleet.checking import AcceptanceLimit
    from allanite.stability.fleet.results import FleetPopulation

__all__ = ["FLEET_CHECK", "checked_log"]

FLEET_CHECK = Command(
    name="fleet check",
    title="Bench test",
    summary="Check a unit against its fleet: pass, fail, or cannot tell.",
    details=(
        "A coefficient passes where its whole 95 % interval lies below the limit, and fails where it lies above. The "
        "limit is the tolerance bound of the population, or that of --sheet or --limit. Exit code: 0 pass, 10 fail, "
        "11 cannot tell; a log with a fatal finding is refused with 1."
    ),
    example="allanite fleet check imu.csv --unit gyro=deg/s,acc=g --against fleet",
    options=(
        option(
            "place", "--against", "Folder or population.json of a fleet: its tolerance bounds are the limits.",
            metavar="FLEET", on_page=False,
        ),
        option("file", "--sheet", "Data sheet (YAML) whose values are the limits.", on_page=False),
        option(
            "texts", "--limit", "Limit of a coefficient, of all channels or of one.",
            detail="'N=0.15 deg/√h', 'gyro_x:B=3 deg/h'", python="limits", metavar="LIMIT",
        ),
        ACCEPT,
    ),
    on_page=False,
    work="allanite.commands.fleet.check:checked_log",
    document="check",
    tables={"check.csv": "allanite.views.fleet_check:rows"},
)  # fmt: skip

#: Exit codes of a production line: 1 to 4 say that something else went wrong.
_CODES = {"pass": 0, "fail": 10, "cannot tell": 11}
_LIMIT = re.compile(
    r"(?:(?P<channel>.+):)?(?P<symbol>[QNBKR])\s*=\s*(?P<value>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>.*)"
)

Place = str | os.PathLike[str]


def checked_log(
    log: Place,
    *,
    against: Place | None = None,
    sheet: Place | None = None,
    limits: Sequence[str] = (),
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Callable[[float, str], None] | None = None,
    **options: Any,
) -> MeasurementResult:
    """A log beside the limits of a fleet, of a data sheet, and those given; a later one of these goes first.

    Parameters
    ----------
    log : path
    against : path, optional
        Folder, fleet.parquet or population.json of a fleet.
    sheet : path, optional
        Data sheet.
    limits : sequence of str
        "N=0.15 deg/√h", or of one channel "gyro_x:N=0.15 deg/√h".
    **options
        Those of `read_part`.

    Raises
    ------
    InputError
        No limit, one that no channel has, or one without a unit.
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.commands.measurement import measured_result, origin_of
    from allanite.commands.recordings import noise_channels, ready_log
    from allanite.noise.allan import allan_curve
    from allanite.stability.fleet.checking import check_unit

    if against is None and sheet is None and not limits:
        raise InputError("there is no limit: give a fleet by against, a data sheet by sheet, or limits")
    recording, findings = ready_log(log, accept=accept, source=source, progress=progress, **options)
    noise = recording.select(*noise_channels(recording))
    chosen = _limits(noise.channels, against, sheet, limits)
    result = check_unit(allan_curve(noise), chosen)
    measured = measured_result("check", result, lossy=False, **origin_of(recording, findings, log, command))
    return replace(measured, code=_CODES[result.verdict.value])


def _limits(
    channels: Sequence[Channel], against: Place | None, sheet: Place | None, given: Sequence[str]
) -> list[AcceptanceLimit]:
    """One limit for each coefficient, by what was stated last."""
    from allanite.stability.fleet.checking import AcceptanceLimit, LimitSource

    values: dict[Key, tuple[float, LimitSource]] = {}
    if against is not None:
        names = {c.name for c in channels}
        bounds = {(c.channel, c.symbol): c.tolerance[1] for c in _population(Path(against)).coefficients}
        of_log = {key: bound for key, bound in bounds.items() if key[0] in names}
        if not of_log:
            there = ", ".join(dict.fromkeys(channel for channel, _ in bounds))
            raise InputError(f"{against}: the fleet has the channels {there}, and the log {', '.join(names)}")
        values |= {key: (bound, LimitSource.POPULATION) for key, bound in of_log.items()}
    if sheet is not None:
        kinds = {c.name: c.kind for c in channels}
        values |= {key: (value, LimitSource.DATASHEET) for key, value in sheet_limits(sheet, kinds)}
    for text in given:
        values |= {key: (value, LimitSource.GIVEN) for key, value in _given(channels, text)}
    order = {c.name: i for i, c in enumerate(channels)}
    return [
        AcceptanceLimit(channel=channel, symbol=symbol, value=value, source=source)
        for (channel, symbol), (value, source) in sorted(
            values.items(), key=lambda item: (order[item[0][0]], "QNBKR".index(item[0][1]))
        )
    ]


def _population(place: Path) -> FleetPopulation:
    """Of a document, of the document in a fleet's folder if it is that of its table, or made of the table."""
    from allanite.stability.fleet.table_files import table_sha256

    if place.suffix == ".json":
        return _read(place)[0]
    document = place / "population.json"
    if document.is_file():
        population, sha256 = _read(document)
        if sha256 is not None and sha256 == table_sha256(place):
            return population
    from allanite.stability.fleet.population import describe_fleet

    return describe_fleet(place)


def _read(path: Path) -> tuple[FleetPopulation, str | None]:
    from allanite.plain_files.json_values import load_plain
    from allanite.stability.fleet.results import FleetPopulation
    from allanite.study.result_document import read_document

    document = read_document(FleetPopulation, load_plain(path, "the population of a fleet"))
    return document.result, None if document.provenance is None else document.provenance.sha256


def _given(channels: Sequence[Channel], text: str) -> list[tuple[Key, float]]:
    """A limit as it was written, of each channel that it is for."""
    from allanite.quantities.display_units import display_unit
    from allanite.quantities.units import parse_unit

    match = _LIMIT.fullmatch(text.strip())
    if match is None or not match["unit"]:
        raise InputError(f"limit {text!r}: write a coefficient with its unit, such as 'N=0.15 deg/√h'")
    unit, symbol = parse_unit(match["unit"]), match["symbol"]
    value = float(match["value"]) * unit.factor
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"limit {text!r}: a limit is a positive number")

    def fits(channel: Channel) -> bool:
        shown = display_unit(channel.kind.value, symbol, channel.unit)[0]
        return shown == match["unit"] or (
            channel.kind.rate.value in ROLES and parse_unit(shown).quantity is unit.quantity
        )

    for_them = [c for c in channels if match["channel"] in (None, c.name) and fits(c)]
    if not for_them:
        there = ", ".join(f"{c.name} [{display_unit(c.kind.value, symbol, c.unit)[0]}]" for c in channels)
        raise InputError(
            f"limit {text!r}: no such channel, or another unit; {symbol} of the channels: {there}"
        )
    return [((c.name, symbol), value) for c in for_them]
