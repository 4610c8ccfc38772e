# SPDX-License-Identifier: BSD-3-Clause
"""The alignment of a unit out of its log, with everything that its report needs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.by_file import LogOfFiles, headed, log_of_files, refuse_beside_files, rests_by_file
from allanite.commands.means import read_means, record_of_means, refuse_rows_of_means
from allanite.commands.measurement import MeasurementResult, measured_result, origin_of
from allanite.commands.recordings import is_lossy, read_whole
from allanite.commands.rests import judged_at_rest, rests_of, thermometers
from allanite.commands.setup import stated_in
from allanite.commands.turned import models_for, part_of
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from allanite.experiments.reversals import PositionsApart
    from allanite.experiments.static_spans import SdOf, StaticSpans, UnitAxes
    from allanite.noise import NoiseModel
    from allanite.recording.calibration import Calibration
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording
    from allanite.study.result_document import PositionFile

__all__ = ["alignment_of"]

Advance = Callable[[float, str], None]


def alignment_of(
    log: str | os.PathLike[str],
    *,
    latitude: float,
    positions: Mapping[str | os.PathLike[str], float | None] | None = None,
    between: float = 60.0,
    means: bool = False,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    model: str | os.PathLike[str] | None = None,
    model_channels: Mapping[str, str] | None = None,
    calibration: str | os.PathLike[str] | None = None,
    height: float = 0.0,
    axes: str = "FLU",
    gyro_bias: float | None = None,
    accelerometer_bias: float | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    spans: str | os.PathLike[str] | None = None,
    rotation: bool | None = None,
    confidence: float = 0.95,
    start: float | None = None,
    stop: float | None = None,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The alignment of the unit that made a log; see `align`.

    Parameters
    ----------
    log, model, calibration, spans : path
        Whatever `read`, `load_models`, `Calibration.load` and `read_spans` understand; times of the spans count from
        the first sample of the log.
    positions : mapping of path to float or None [rad], optional
        One file for each position, in the order of recording, with its heading from a common mark, or None for all;
        `log` is the first of them.
    between : float [s]
        From one of these files to the next, where they do not tell; see `joined_files`.
    means : bool
        `log` is a table with one row of means for each attitude, with its heading where there are several.
    averaging, sd_of
        See `means_of`.
    model_channels : mapping of str to str, optional
        What the models call the channels of the log, where that is another name.
    gyro_bias, accelerometer_bias : float, optional [rad/s], [m/s^2]
        Of `bias_repeatability`.
    gyro, accelerometer : sequence of str, optional
        Channels x, y, z, where neither the calibration nor their kinds say.
    start, stop : float, optional [s]
        Part of the log, or of each file.
    accept : collection of str
        Fatal findings to go on in spite of.
    **options
        Those of `stated_in` and of `read`.

    Raises
    ------
    DataQualityError
        A fatal finding at rest that was not accepted, or a unit that was neither at rest nor turning about one axis.
    InputError
        Means without a model of each axis: a mean does not tell its noise.
    """
    from allanite.experiments.alignment import align
    from allanite.recording.calibration import Calibration

    known = None if calibration is None else Calibration.load(os.fspath(calibration))
    job = _Job(
        log=log, start=start, stop=stop, between=between, known=known, model=model, called=model_channels, gyro=gyro,
        accelerometer=accelerometer, accept=accept, source=source, progress=progress or (lambda fraction, what: None),
    )  # fmt: skip
    asked: dict[str, Any] = {
        "latitude": latitude, "calibration": known, "height": height, "axes": axes, "rotation": rotation,
        "bias_repeatability": (gyro_bias, accelerometer_bias), "stated": stated_in(options), "confidence": confidence,
    }  # fmt: skip
    if means:
        case = _of_means(job, averaging, sd_of, options)
    else:
        case = _of_logs(job, positions, spans, options, turning=bool(rotation))
    aligned = align(
        case.recording,
        model=case.models,
        spans=case.spans,
        headings=case.headings,
        gyro=case.axes.gyro,
        accelerometer=case.axes.accelerometer,
        progress=lambda fraction, what: job.progress(0.5 + 0.5 * fraction, what),
        **asked,
    )
    return measured_result(
        "alignment",
        replace(aligned, apart=case.apart),
        lossy=case.lossy,
        files=case.files,
        **origin_of(case.whole, case.findings, log, command),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Job:
    """What both ways of aligning are told."""

    log: str | os.PathLike[str]
    start: float | None
    stop: float | None
    between: float
    known: Calibration | None
    model: str | os.PathLike[str] | None
    called: Mapping[str, str] | None
    gyro: Sequence[str] | None
    accelerometer: Sequence[str] | None
    accept: Collection[str]
    source: str | None
    progress: Advance

    def axes_of(self, recording: Recording) -> UnitAxes:
        """Channels of both triads."""
        from allanite.experiments.alignment import unit_of

        return unit_of(recording, self.known, self.gyro, self.accelerometer)[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class _UnitLog:
    """What is aligned: samples without those that a finding excludes, and what is known of them."""

    whole: Recording
    recording: Recording
    axes: UnitAxes
    models: dict[str, NoiseModel] | None
    spans: Any
    headings: Any
    apart: PositionsApart | None
    findings: tuple[Finding, ...]
    files: tuple[PositionFile, ...] | None
    lossy: bool


def _of_logs(
    job: _Job,
    positions: Mapping[str | os.PathLike[str], float | None] | None,
    listing: str | os.PathLike[str] | None,
    options: Mapping[str, Any],
    *,
    turning: bool,
) -> _UnitLog:
    """A log, or one for each position."""
    job.progress(0.0, "reading")
    by_file, start, stop = None, job.start, job.stop
    if positions is None:
        whole, start, stop = read_whole(
            job.log, start, stop, listed=listing is not None, source=job.source, **options
        )
        refuse_rows_of_means(whole, job.accept)
        axes = job.axes_of(whole)
        whole = whole.select(*axes.names, *thermometers(whole))
    else:
        refuse_beside_files(spans=listing)
        by_file = log_of_files(
            list(positions), job.axes_of, between=job.between, accept=job.accept, start=start, stop=stop, **options
        )  # fmt: skip
        whole, axes, start, stop = by_file.recording, by_file.axes, None, None
    part = part_of(whole, start, stop)
    models = _models(job.model, part, axes, job.called)
    job.progress(0.1, "looking for rest")
    rests = rests_of(whole, part, axes, listing=listing, start=start, models=models)
    of_files = list((positions or {}).values())
    rests = rests if by_file is None else rests_by_file(rests, by_file)
    job.progress(0.3, "looking for faults")
    # a unit that turned all the time is not cut where it turned
    used = rests if len(rests) and not turning else None
    ready = judged_at_rest(part, used, axes, accept=job.accept)
    findings = ready.findings
    if by_file is not None:
        findings = (*by_file.findings, *by_file.without_pauses(findings))
    return _UnitLog(
        whole=part,
        recording=ready.recording,
        axes=axes,
        models=models,
        spans=rests,
        headings=None if by_file is None else _headings(rests, by_file, of_files),
        apart=None if by_file is None else replace(by_file.apart, headed=None not in of_files),
        findings=findings,
        files=None if by_file is None else headed(by_file, of_files),
        lossy=ready.lossy,
    )


def _of_means(job: _Job, averaging: float | None, sd_of: SdOf | None, options: Mapping[str, Any]) -> _UnitLog:
    """A table with one row of means for each attitude."""
    import numpy as np

    means, findings = read_means(
        job.log,
        averaging=averaging,
        sd_of=sd_of,
        source=job.source,
        start=job.start,
        stop=job.stop,
        **options,
    )
    record, spans, apart = record_of_means(means, job.between)
    axes = job.axes_of(record)
    models = _models(job.model, record, axes, job.called) or {}
    if lacking := [name for name in axes.names if name not in models]:
        raise InputError(
            f"means carry no noise information, and there is no model of {', '.join(lacking)}: pass one "
            "of gyros and accelerometers (--model study.json)"
        )
    return _UnitLog(
        whole=record,
        recording=record,
        axes=axes,
        models=models,
        spans=np.array(spans),
        headings=np.full(means.n, np.nan) if means.heading is None else means.heading,
        apart=apart if means.n > 1 or apart.sd_ignored else None,
        findings=findings,
        files=None,
        lossy=is_lossy(f.to_json() for f in findings),
    )


def _headings(rests: StaticSpans, log: LogOfFiles, headings: Sequence[float | None]) -> list[float]:
    """Of each rest, by the file it is in; NaN where no file has one.

    Raises
    ------
    InputError
        Some files have one, and others not.
    """
    if None in headings and set(headings) != {None}:
        raise InputError("give the heading of every position, or of none: first.csv=0 turned.csv=180")
    of_rests = [headings[log.file_at(s.start)] for s in rests.spans]
    return [math.nan if heading is None else heading for heading in of_rests]


def _models(
    source: str | os.PathLike[str] | None,
    part: Recording,
    axes: UnitAxes,
    called: Mapping[str, str] | None,
) -> dict[str, NoiseModel] | None:
    """By channel. A model of gyros alone, as words give it, leaves the accelerometers to the record."""
    from allanite.study.model_file import load_models

    if source is None:
        return None
    models, _ = load_models(source)
    kinds = {model.kind for model in models.values()}
    taking = [part[name] for name in axes.names if part[name].kind.rate in kinds or len(kinds) > 1]
    return models_for(source, taking, called)[0]
