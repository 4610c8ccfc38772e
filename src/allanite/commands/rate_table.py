# SPDX-License-Identifier: BSD-3-Clause
"""A run on a rate table, from a log, a model and the table's own record to everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, LATITUDE, MODEL, option

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult
    from allanite.experiments.rate_table import RateTableEstimate
    from allanite.recording.records import Channel, Recording

__all__ = ["RATE_TABLE", "rate_table_of"]

Advance = Callable[[float, str], None]

RATE_TABLE = Command(
    name="rate-table",
    title="Rate table",
    summary="Calibrate gyros on a rate table.",
    details=(
        "Estimates scale factor, bias, nonlinearity and misalignment. The table's record is a CSV of steps, encoder "
        "angles, rates, or sinusoids. The two clocks are aligned; settling and clipping are excluded. --out writes "
        "report.html, rate-table.json and, for steps, steps.csv."
    ),
    example="allanite rate-table log.parquet --model study.json --table table.csv",
    options=(
        replace(MODEL, otherwise="fitted to the log itself"),
        option(
            "file", "--table",
            "CSV: start,stop,rate_deg_s; time,angle_deg; time,rate_deg_s; or start,stop,amplitude_deg_s,frequency.",
            required=True,
        ),
        option("text", "--channel", "Channel along the table axis.", otherwise="the one that responds most"),
        option("names", "--cross-axes", "Other channels on the table.", otherwise="all of the same kind"),
        option("choice", "--nonlinearity", "Degree of the polynomial, or sign: two lines that meet at zero.",
            choices=("1", "2", "3", "4", "5", "sign"), default="2"),
        option("text", "--temperature", "Temperature channel that scale factor and bias may follow.",
            metavar="CHANNEL"),
        option("seconds", "--offset", "Log time at time zero of the table.", otherwise="found"),
        option("seconds", "--dead-time", "Time to skip after each rate change.", otherwise="found"),
        option("choice", "--axis", "Table axis.", choices=("vertical", "up", "down", "horizontal", "unknown"),
            default="vertical"),
        replace(LATITUDE, help="Latitude, to remove the Earth rate from the bias.", detail="48.1 or 23.31S",
            required=False),
        option("share", "--table-uncertainty", "Uncertainty of the table rate.", detail="10ppm"),
        option("degrees", "--misalignment", "Angle between sensor and table axis.", detail="0.1deg"),
        CONFIDENCE,
        ACCEPT,
    ),
    on_page=False,
    work="allanite.commands.rate_table:rate_table_of",
    tables={"steps.csv": "allanite.views.rate_table:rows"},
)  # fmt: skip


def rate_table_of(
    log: str | os.PathLike[str],
    *,
    table: str | os.PathLike[str],
    model: str | os.PathLike[str] | None = None,
    channel: str | None = None,
    cross_axes: Sequence[str] | None = None,
    nonlinearity: int | str = 2,
    temperature: str | None = None,
    offset: float | None = None,
    dead_time: float | None = None,
    axis: str = "vertical",
    latitude: float | None = None,
    table_uncertainty: float = 0.0,
    misalignment: float = 0.0,
    confidence: float = 0.95,
    start: float | None = None,
    stop: float | None = None,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The response to a rate table out of a log; see `measure_rate_table`.

    Parameters
    ----------
    log, model : path
        Whatever `read` and `load_models` understand.
    table : path
        CSV of the table's motion (`read_rate_table`).
    channel : str, optional
        On the axis of the table; of several the one that responds most.
    table_uncertainty, misalignment : float, [rad]
        See `TableUncertainty`.
    start, stop : float, optional [s]
        Part of the log.
    accept : collection of str
        Fatal findings to go on in spite of.
    **options
        Those of `read`.
    """
    import numpy as np

    from allanite.commands.measurement import measured_result, origin_of
    from allanite.commands.recordings import read_whole
    from allanite.commands.turned import judged, models_for, part_of
    from allanite.experiments.rate_table import TableUncertainty, measure_rate_table, read_rate_table

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    whole, start, stop = read_whole(log, start, stop, listed=True, source=source, **options)
    turned = read_rate_table(table)
    part = part_of(whole, start, stop)
    models, where = models_for(model, _following(part, channel), mapped=False)
    chosen: dict[str, Any] = {
        "table": turned, "model": models or None, "cross_axes": cross_axes, "temperature": temperature,
        "nonlinearity": nonlinearity if nonlinearity == "sign" else int(nonlinearity), "offset": offset,
        "dead_time": dead_time, "axis": axis, "latitude": latitude, "confidence": confidence,
        "stated": TableUncertainty(scale=table_uncertainty, misalignment=misalignment),
    }  # fmt: skip
    result = measure_rate_table(
        part, channel=channel, progress=lambda f, what: advance(0.5 * f, what), **chosen
    )
    advance(0.5, "looking for faults")
    used = part.select(result.channel, *_beside(result, temperature))
    ready = judged(
        used,
        np.array([[0, part.n_samples]]),  # nobody says that the table rests before and after
        used.names,
        where="while the table turned",
        longest=0.0,
        accept=accept,
    )
    if any(f.excludes for f in ready.findings):
        result = measure_rate_table(ready.recording, channel=result.channel, **chosen)
    return measured_result(
        "rate-table",
        result,
        lossy=ready.lossy,
        model_name=where[result.channel],
        **origin_of(part, ready.findings, log, command, result.channel),
    )


def _following(recording: Recording, channel: str | None) -> list[Channel]:
    """Channels that need a model: those of the kind that is measured."""
    from allanite.recording.records import Kind

    for kinds in ((Kind.RATE,), (Kind.VOLTAGE, Kind.COUNTS), (Kind.UNKNOWN,)):
        of_kind = [c for c in recording.channels if c.kind in kinds]
        if channel is not None and channel not in [c.name for c in of_kind]:
            continue
        if of_kind:
            return of_kind
    return [] if channel is None else [recording[channel]]


def _beside(result: RateTableEstimate, temperature: str | None) -> list[str]:
    """Other channels that took part."""
    across = [n.removeprefix("misalignment of ") for n in result.names if n.startswith("misalignment of ")]
    return [*across, *([] if temperature is None else [temperature])]
