# SPDX-License-Identifier: BSD-3-Clause
"""The calibration of a unit out of a log of rests, with everything that its report needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.by_file import log_of_files, refuse_beside_files, rests_by_file
from allanite.commands.means import read_means, refuse_rows_of_means
from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import is_lossy, read_whole
from allanite.commands.rests import judged_at_rest, rests_of, thermometers
from allanite.commands.turned import models_for, part_of
from allanite.commands.two_logs import read_two
from allanite.errors import DataQualityError
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.experiments.static_spans import SdOf, StaticSpans, UnitAxes
    from allanite.recording.records import Recording

__all__ = ["POSITIONS", "calibration_of", "calibration_of_means"]

Json = Mapping[str, Any]
Advance = Callable[[float, str], None]

POSITIONS = "positions.csv"
"""Name of the table of positions."""

#: Steps of the converter that no noise smooths are in the covariance of the means.
_STEPS = frozenset({"quantisation_limited"})


def calibration_of(
    log: str | os.PathLike[str],
    *,
    positions: Sequence[str | os.PathLike[str]] | None = None,
    between: float = 60.0,
    gyro_log: str | os.PathLike[str] | None = None,
    model: str | os.PathLike[str] | None = None,
    model_channels: Mapping[str, str] | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity: float | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    spans: str | os.PathLike[str] | None = None,
    without: Collection[int | tuple[int, int]] = (),
    start: float | None = None,
    stop: float | None = None,
    accept: Collection[str] = (),
    estimate: Mapping[str, Any] | None = None,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The calibration of the unit that made a log; see `calibrate`, whose further options `estimate` holds.

    Parameters
    ----------
    log, model, spans : path
        Whatever `read`, `load_models` and `read_spans` understand; times of the spans count from the first sample of
        the log.
    positions : sequence of path, optional
        One file for each position, in the order of recording; `log` is the first of them.
    between : float [s]
        From one of these files to the next, where they do not tell; see `joined_files`.
    model_channels : mapping of str to str, optional
        What the models call the channels of the log, where that is another name.
    gyro_log : path, optional
        Of the gyros, where `log` holds the accelerometers alone.
    latitude, height, gravity : float, optional [rad], [m], [m/s^2]
    gyro, accelerometer : sequence of str, optional
        Channels x, y, z, where their kinds do not say.
    without : collection of int or (int, int)
        Numbers of positions, and of turns between two, to leave out.
    start, stop : float, optional [s]
        Part of the log, or of each file.
    accept : collection of str
        Fatal findings to go on in spite of.
    **options
        Those of `read`.

    Raises
    ------
    InputError
        Files of positions, and a list of rests or a log of the gyros.
    DataQualityError
        A fatal finding in the rests that was not accepted; a file in which the unit was nowhere at rest.
    """
    from allanite.experiments.calibration import calibrate
    from allanite.experiments.static_spans import unit_axes
    from allanite.views.figures.static import document_of

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    heat, by_file = (estimate or {}).get("temperature"), None
    if positions is not None:
        refuse_beside_files(spans=spans, gyro_log=gyro_log)
        by_file = log_of_files(
            positions,
            lambda first: unit_axes(first, gyro, accelerometer),
            between=between,
            temperature=heat,
            accept=accept,
            start=start,
            stop=stop,
            **options,
        )
        whole, axes, start, stop = by_file.recording, by_file.axes, None, None
    else:
        if gyro_log is None:
            whole, start, stop = read_whole(log, start, stop, listed=spans is not None, **options)
        else:
            named = {"accelerometer": accelerometer, "gyro": gyro}
            whole, accelerometer, gyro = read_two(log, gyro_log, **named, **options)
        whole = whole if source is None else replace(whole, source=source)
        refuse_rows_of_means(whole, accept)
        axes = unit_axes(whole, gyro, accelerometer)
        whole = whole.select(*axes.names, *thermometers(whole, heat))
    part = part_of(whole, start, stop)
    given, where = models_for(model, [part[name] for name in axes.names], model_channels)
    models = given or None
    advance(0.1, "looking for rest")
    if by_file is None:
        rests = _rests(whole, part, axes, listing=spans, start=start, models=models)
    else:
        rests = rests_by_file(_found(part, axes, models=models), by_file)
    advance(0.3, "looking for faults")
    ready = judged_at_rest(part, rests, axes, accept=accept, milder=_STEPS)
    calibrated = calibrate(
        ready.recording,
        spans=rests,
        model=models,
        latitude=latitude,
        height=height or 0.0,
        gravity=gravity,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        without=without,
        progress=lambda fraction, what: advance(0.5 + 0.5 * fraction, what),
        **(estimate or {}),
    )
    if by_file is not None:
        calibrated = replace(calibrated, remarks=(*by_file.apart.says, *calibrated.remarks))
        ready = replace(ready, findings=(*by_file.findings, *by_file.without_pauses(ready.findings)))
    document = {
        **calibrated.to_json(),
        **(
            {}
            if by_file is None
            else {"files": [{"file": f.file, "sha256": f.sha256} for f in by_file.files]}
        ),
        **beside(part, None, ready.findings, file_sha256(log), command),
        "static_spans": document_of(rests, part),
        "spans_source": "found" if rests.source == "detected" else "given",
        "model_name": "" if model is None else next(iter(where.values())).split(", channel")[0],
    }
    return MeasurementResult(
        result=document,
        document=document,
        name="calibration",
        tables={POSITIONS: _rows(document)},
        lossy=ready.lossy,
    )


def _rests(whole: Recording, part: Recording, axes: UnitAxes, **given: Any) -> StaticSpans:
    """Rests as `rests_of` gives them.

    Raises
    ------
    DataQualityError
        None was found.
    """
    rests = _found(part, axes, **given) if given["listing"] is None else rests_of(whole, part, axes, **given)
    if not len(rests):
        raise DataQualityError(
            "the unit is nowhere at rest long enough: let it rest for 5 s at least in each position, or say when it "
            "was at rest with --spans"
        )
    return rests


def _found(part: Recording, axes: UnitAxes, *, models: Mapping[str, Any] | None, **_: Any) -> StaticSpans:
    """Rests of a unit that was put down or held, by the models where they are of all channels."""
    from allanite.experiments.static_spans import find_rests

    complete = models if models and set(axes.names) <= set(models) else None
    return find_rests(part, gyro=axes.gyro, accelerometer=axes.accelerometer, model=complete)


def calibration_of_means(
    table: str | os.PathLike[str],
    *,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    between: float = 60.0,
    model: str | os.PathLike[str] | None = None,
    model_channels: Mapping[str, str] | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity: float | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    without: Collection[int | tuple[int, int]] = (),
    estimate: Mapping[str, Any] | None = None,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The same out of a table with one row of means for each position; see `calibrate_means`.

    Parameters
    ----------
    table : path
        Whatever `read` understands.
    averaging : float, optional [s]
        Over which each row is the mean, where no column says it.
    sd_of : "readings" or "means", optional
        See `means_of`.
    between : float [s]
        From one position to the next, where the table does not tell: slow noise of a model goes on in it.
    **options
        Others as of `calibration_of`.

    Raises
    ------
    InputError
        Options of logs.
    """
    from allanite.experiments.calibration import calibrate_means
    from allanite.experiments.static_spans import unit_axes

    means, findings = read_means(table, averaging=averaging, sd_of=sd_of, source=source, **options)
    axes = unit_axes(means.rows, gyro, accelerometer)
    given, where = models_for(model, [means.rows[name] for name in axes.names], model_channels)
    about = {name: value for name, value in (estimate or {}).items() if name != "drift"}
    calibrated = calibrate_means(
        means,
        between=between,
        model=given or None,
        latitude=latitude,
        height=height or 0.0,
        gravity=gravity,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        without=without,
        progress=progress,
        **about,
    )
    facts = beside(means.rows, None, findings, file_sha256(table), command)
    document = {
        **calibrated.to_json(),
        **facts,
        "recording": {**facts["recording"], "rate": None, "duration": None},
        "model_name": "" if model is None else next(iter(where.values())).split(", channel")[0],
    }
    return MeasurementResult(
        result=document,
        document=document,
        name="calibration",
        tables={POSITIONS: _rows(document)},
        lossy=is_lossy(f.to_json() for f in findings),
    )


# -- the table --------------------------------------------------------------------------------------------


def _rows(document: Json) -> list[Json]:
    """One row for each position, in people's units."""
    from allanite.quantities.units import STANDARD_GRAVITY
    from allanite.views.wording import DEG_H

    def shown(value: float | None, factor: float = 1.0) -> str:
        return "" if value is None else f"{value / factor:.6g}"

    def time(value: float | None) -> str:
        return "" if value is None else f"{value:.6f}"

    return [
        {
            "number": p["number"],
            "start_s": time(p["start"]),
            "stop_s": time(p["stop"]),
            "used": "yes" if p["used"] else "no",
            "outlier": "yes" if p["outlier"] else "no",
            **{f"up_{axis}": shown(value) for axis, value in zip("xyz", p["up"], strict=True)},
            "excess_mg": shown(p["excess"], 1e-3 * STANDARD_GRAVITY),
            "excess_sd_mg": shown(p["excess_sd"], 1e-3 * STANDARD_GRAVITY),
            **{
                f"rate_{axis}_deg_h": shown(value, DEG_H)
                for axis, value in zip("xyz", p["rate"] or (None,) * 3, strict=True)
            },
            "misfit": shown(p["misfit"]),
            "temperature": shown(p["temperature"]),
        }
        for p in document["positions"]
    ]
