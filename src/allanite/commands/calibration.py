# SPDX-License-Identifier: BSD-3-Clause
"""The calibration of a unit out of a log of rests, with everything that its report needs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.by_file import LogOfFiles, log_of_files, refuse_beside_files, rests_by_file
from allanite.commands.means import read_means, refuse_rows_of_means
from allanite.commands.measurement import MeasurementResult, measured_result, origin_of, overview_of
from allanite.commands.recordings import is_lossy, read_whole
from allanite.commands.rests import judged_at_rest, rests_of, thermometers
from allanite.commands.turned import models_for, part_of
from allanite.commands.two_logs import read_two
from allanite.errors import DataQualityError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from allanite.experiments.static_spans import SdOf, StaticSpans, UnitAxes
    from allanite.noise import NoiseModel
    from allanite.recording.records import Recording

__all__ = ["calibration_of"]

Advance = Callable[[float, str], None]
Place = str | os.PathLike[str]

#: Steps of the converter that no noise smooths are in the covariance of the means.
_STEPS = frozenset({"quantisation_limited"})


def calibration_of(
    log: Place,
    *,
    positions: Sequence[Place] | None = None,
    between: float = 60.0,
    means: bool = False,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    gyro_log: Place | None = None,
    model: Place | None = None,
    model_channels: Mapping[str, str] | None = None,
    latitude: float | None = None,
    height: float = 0.0,
    gravity: float | None = None,
    gravity_uncertainty: float = 0.0,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    spans: Place | None = None,
    without: Collection[int | tuple[int, int]] = (),
    frame: str = "z",
    quadratic: bool = False,
    no_drift: bool = False,
    temperature: str | None = None,
    reference_temperature: float | None = None,
    confidence: float = 0.95,
    start: float | None = None,
    stop: float | None = None,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The calibration of the unit that made a log; see `calibrate`.

    Parameters
    ----------
    log, model, spans : path
        Whatever `read`, `load_models` and `read_spans` understand; times of the spans count from the first sample of
        the log.
    positions : sequence of path, optional
        One file for each position, in the order of recording; `log` is the first of them.
    between : float [s]
        From one of these files, or of the rows of a table, to the next, where they do not tell.
    means : bool
        `log` is a table with one row of means for each position; see `calibrate_means`.
    averaging, sd_of
        See `means_of`.
    model_channels : mapping of str to str, optional
        What the models call the channels of the log, where that is another name.
    gyro_log : path, optional
        Of the gyros, where `log` holds the accelerometers alone.
    latitude, height, gravity, gravity_uncertainty : float, optional [rad], [m], [m/s^2], [m/s^2]
        Where it was recorded.
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
        Files of positions, and a list of rests or a log of the gyros; options of logs with rows of means.
    DataQualityError
        A fatal finding in the rests that was not accepted; a file in which the unit was nowhere at rest.
    """
    job = _CalibrationJob(
        log=log, positions=positions, between=between, gyro_log=gyro_log, model=model, called=model_channels,
        gyro=gyro, accelerometer=accelerometer, spans=spans, start=start, stop=stop, accept=accept,
        temperature=temperature, source=source, command=command, progress=progress or (lambda fraction, what: None),
    )  # fmt: skip
    asked: dict[str, Any] = {
        "latitude": latitude, "height": height, "gravity": gravity, "without": without, "frame": frame,
        "quadratic": quadratic, "temperature": temperature, "reference_temperature": reference_temperature,
        "confidence": confidence, "stated": {"gravity": gravity_uncertainty} if gravity_uncertainty else {},
    }  # fmt: skip
    if means:
        return _of_means(job, averaging, sd_of, asked, options)
    return _of_logs(job, {**asked, "drift": not no_drift}, options)


@dataclass(frozen=True, slots=True, kw_only=True)
class _CalibrationJob:
    """What both ways of calibrating are told."""

    log: Place
    positions: Sequence[Place] | None
    between: float
    gyro_log: Place | None
    model: Place | None
    called: Mapping[str, str] | None
    gyro: Sequence[str] | None
    accelerometer: Sequence[str] | None
    spans: Place | None
    start: float | None
    stop: float | None
    accept: Collection[str]
    temperature: str | None
    source: str | None
    command: str | None
    progress: Advance

    def axes_of(self, recording: Recording) -> UnitAxes:
        """Channels of the triads."""
        from allanite.experiments.static_spans import unit_axes

        return unit_axes(recording, self.gyro, self.accelerometer)

    def models_of(self, recording: Recording, axes: UnitAxes) -> tuple[dict[str, NoiseModel], str]:
        """By channel, and what they are called; none where they are those of the log."""
        given, where = models_for(self.model, [recording[name] for name in axes.names], self.called)
        return given, "" if self.model is None else next(iter(where.values())).split(", channel")[0]


def _of_logs(job: _CalibrationJob, asked: Mapping[str, Any], options: Mapping[str, Any]) -> MeasurementResult:
    """A log, one of each triad, or one for each position."""
    from allanite.experiments.calibration import calibrate

    job.progress(0.0, "reading")
    whole, axes, by_file, start, stop = _read(job, options)
    part = part_of(whole, start, stop)
    models, model_name = job.models_of(part, axes)
    job.progress(0.1, "looking for rest")
    if by_file is None:
        rests = _rests(whole, part, axes, listing=job.spans, start=start, models=models or None)
    else:
        rests = rests_by_file(_searched(part, axes, models=models or None), by_file)
    job.progress(0.3, "looking for faults")
    ready = judged_at_rest(part, rests, axes, accept=job.accept, milder=_STEPS)
    result = calibrate(
        ready.recording,
        spans=rests,
        model=models or None,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        progress=lambda fraction, what: job.progress(0.5 + 0.5 * fraction, what),
        **asked,
    )
    result = replace(result, spans_source="found" if rests.source == "detected" else "given")
    findings = ready.findings
    if by_file is not None:
        result = replace(result, apart=by_file.apart)
        findings = (*by_file.findings, *by_file.without_pauses(findings))
    return measured_result(
        "calibration",
        result,
        lossy=ready.lossy,
        model_name=model_name,
        files=None if by_file is None else by_file.files,
        overviews=tuple(overview_of(part, name) for name in rests.channels or part.names),
        **origin_of(part, findings, job.log, job.command),
    )


def _read(
    job: _CalibrationJob, options: Mapping[str, Any]
) -> tuple[Recording, UnitAxes, LogOfFiles | None, float | None, float | None]:
    """The log with its axes, the files it is made of, and the part of it that is wanted."""
    if job.positions is not None:
        refuse_beside_files(spans=job.spans, gyro_log=job.gyro_log)
        by_file = log_of_files(
            job.positions, job.axes_of, between=job.between, temperature=job.temperature, accept=job.accept,
            start=job.start, stop=job.stop, **options,
        )  # fmt: skip
        return by_file.recording, by_file.axes, by_file, None, None
    start, stop = job.start, job.stop
    if job.gyro_log is None:
        whole, start, stop = read_whole(job.log, start, stop, listed=job.spans is not None, **options)
    else:
        named = {"accelerometer": job.accelerometer, "gyro": job.gyro}
        whole, accelerometer, gyro = read_two(job.log, job.gyro_log, **named, **options)
        job = replace(job, accelerometer=accelerometer, gyro=gyro)
    whole = whole if job.source is None else replace(whole, source=job.source)
    refuse_rows_of_means(whole, job.accept)
    axes = job.axes_of(whole)
    return whole.select(*axes.names, *thermometers(whole, job.temperature)), axes, None, start, stop


def _rests(whole: Recording, part: Recording, axes: UnitAxes, **given: Any) -> StaticSpans:
    """Rests as `rests_of` gives them.

    Raises
    ------
    DataQualityError
        None was found.
    """
    listed = given["listing"] is not None
    rests = rests_of(whole, part, axes, **given) if listed else _searched(part, axes, models=given["models"])
    if not len(rests):
        raise DataQualityError(
            "the unit is nowhere at rest long enough: let it rest for 5 s at least in each position, or say when it "
            "was at rest with --spans"
        )
    return rests


def _searched(part: Recording, axes: UnitAxes, *, models: Mapping[str, NoiseModel] | None) -> StaticSpans:
    """Rests of a unit that was put down or held, by the models where they are of all channels."""
    from allanite.experiments.static_spans import find_rests

    complete = models if models and set(axes.names) <= set(models) else None
    return find_rests(part, gyro=axes.gyro, accelerometer=axes.accelerometer, model=complete)


def _of_means(
    job: _CalibrationJob,
    averaging: float | None,
    sd_of: SdOf | None,
    asked: Mapping[str, Any],
    options: Mapping[str, Any],
) -> MeasurementResult:
    """A table with one row of means for each position."""
    from allanite.experiments.calibration import calibrate_means
    from allanite.study.result_document import RecordFacts

    means, findings = read_means(
        job.log,
        averaging=averaging,
        sd_of=sd_of,
        source=job.source,
        start=job.start,
        stop=job.stop,
        **options,
    )
    axes = job.axes_of(means.rows)
    models, model_name = job.models_of(means.rows, axes)
    result = calibrate_means(
        means,
        between=job.between,
        model=models or None,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        progress=job.progress,
        **asked,
    )
    origin = origin_of(means.rows, findings, job.log, job.command)
    facts = replace(RecordFacts.of(means.rows), rate=math.nan, duration=math.nan)
    return measured_result(
        "calibration",
        result,
        lossy=is_lossy(f.to_json() for f in findings),
        model_name=model_name,
        **{**origin, "recording": facts},
    )
