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
from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import is_lossy, read_whole
from allanite.commands.rests import judged_at_rest, rests_of, thermometers
from allanite.commands.turned import models_for, part_of
from allanite.errors import InputError
from allanite.plain_files.json_values import plain
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.experiments.static_spans import SdOf, StaticSpans, UnitAxes
    from allanite.noise import NoiseModel
    from allanite.recording.records import Recording

__all__ = ["STANDS", "alignment_of", "alignment_of_means"]

Json = Mapping[str, Any]
Advance = Callable[[float, str], None]

STANDS = "stands.csv"
"""Name of the table of attitudes."""

_UNSAID = (
    "nothing says by how much the unit was turned from file to file, so that the last one alone is aligned: give the "
    "heading of each from a common mark, first.csv=0 turned.csv=180, or let one log run on during the turns"
)
_UNSAID_ROWS = (
    "nothing says by how much the unit was turned from row to row, so that the last one alone is aligned: give a "
    "column heading, from a common mark"
)


def alignment_of(
    log: str | os.PathLike[str],
    *,
    latitude: float,
    positions: Mapping[str | os.PathLike[str], float | None] | None = None,
    between: float = 60.0,
    model: str | os.PathLike[str] | None = None,
    model_channels: Mapping[str, str] | None = None,
    calibration: str | os.PathLike[str] | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    spans: str | os.PathLike[str] | None = None,
    start: float | None = None,
    stop: float | None = None,
    accept: Collection[str] = (),
    estimate: Mapping[str, Any] | None = None,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The alignment of the unit that made a log; see `align`, whose further options `estimate` holds.

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
    model_channels : mapping of str to str, optional
        What the models call the channels of the log, where that is another name.
    gyro, accelerometer : sequence of str, optional
        Channels x, y, z, where neither the calibration nor their kinds say.
    start, stop : float, optional [s]
        Part of the log, or of each file.
    accept : collection of str
        Fatal findings to go on in spite of.
    **options
        Those of `read`.

    Raises
    ------
    DataQualityError
        A fatal finding at rest that was not accepted, or a unit that was neither at rest nor turning about one axis.
    """
    from allanite.experiments.alignment import align, unit_of
    from allanite.recording.calibration import Calibration

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    known = None if calibration is None else Calibration.load(os.fspath(calibration))
    by_file = None
    if positions is None:
        whole, start, stop = read_whole(log, start, stop, listed=spans is not None, source=source, **options)
        refuse_rows_of_means(whole, accept)
        axes, _ = unit_of(whole, known, gyro, accelerometer)
        whole = whole.select(*axes.names, *thermometers(whole))
    else:
        refuse_beside_files(spans=spans)
        by_file = log_of_files(
            list(positions),
            lambda first: unit_of(first, known, gyro, accelerometer)[0],
            between=between,
            accept=accept,
            start=start,
            stop=stop,
            **options,
        )
        whole, axes, start, stop = by_file.recording, by_file.axes, None, None
    part = part_of(whole, start, stop)
    models = _models(model, part, axes, model_channels)
    advance(0.1, "looking for rest")
    rests = rests_of(whole, part, axes, listing=spans, start=start, models=models)
    headings = None
    if by_file is not None:
        rests = rests_by_file(rests, by_file)
        headings = _headings(rests, by_file, list((positions or {}).values()))
    turning = bool((estimate or {}).get("rotation"))
    advance(0.3, "looking for faults")
    # a unit that turned all the time is not cut where it turned
    used = rests if len(rests) and not turning else None
    ready = judged_at_rest(part, used, axes, accept=accept)
    aligned = align(
        ready.recording,
        latitude=latitude,
        model=models,
        calibration=known,
        spans=rests,
        headings=headings,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        progress=lambda fraction, what: advance(0.5 + 0.5 * fraction, what),
        **(estimate or {}),
    )
    if by_file is not None:
        unsaid = (_UNSAID,) if None in (positions or {}).values() else ()
        aligned = replace(aligned, advice=(*aligned.advice, *unsaid, *by_file.apart.says))
        ready = replace(ready, findings=(*by_file.findings, *by_file.without_pauses(ready.findings)))
    document = {
        **aligned.to_json(),
        **({} if by_file is None else {"files": plain(headed(by_file, (positions or {}).values()))}),
        **beside(part, None, ready.findings, file_sha256(log), command),
    }
    return _measured(document, lossy=ready.lossy)


def alignment_of_means(
    table: str | os.PathLike[str],
    *,
    latitude: float,
    model: str | os.PathLike[str] | None = None,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    between: float = 60.0,
    model_channels: Mapping[str, str] | None = None,
    calibration: str | os.PathLike[str] | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    estimate: Mapping[str, Any] | None = None,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The same out of a table with one row of means for each attitude, with its heading where there are several.

    Parameters
    ----------
    table : path
        Whatever `read` understands.
    averaging, sd_of
        See `means_of`.
    **options
        Others as of `alignment_of`.

    Raises
    ------
    InputError
        No model of an axis: a mean does not tell its noise.
    """
    import numpy as np

    from allanite.experiments.alignment import align, unit_of
    from allanite.recording.calibration import Calibration

    means, findings = read_means(table, averaging=averaging, sd_of=sd_of, source=source, **options)
    record, spans, apart = record_of_means(means, between)
    known = None if calibration is None else Calibration.load(os.fspath(calibration))
    axes, _ = unit_of(record, known, gyro, accelerometer)
    models = _models(model, record, axes, model_channels) or {}
    if lacking := [name for name in axes.names if name not in models]:
        raise InputError(
            f"a mean does not tell its noise, and there is no model of {', '.join(lacking)}: give one of gyros and "
            "accelerometers (--model study.json)"
        )
    aligned = align(
        record,
        latitude=latitude,
        model=models,
        calibration=known,
        spans=np.array(spans),
        headings=np.full(means.n, np.nan) if means.heading is None else means.heading,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        progress=progress,
        **(estimate or {}),
    )
    unsaid = (_UNSAID_ROWS,) if means.heading is None and means.n > 1 else ()
    more = (*unsaid, *(apart.says if means.n > 1 else apart.says[1:]))
    aligned = replace(aligned, advice=(*aligned.advice, *more))
    document = {**aligned.to_json(), **beside(record, None, findings, file_sha256(table), command)}
    return _measured(document, lossy=is_lossy(f.to_json() for f in findings))


def _measured(document: Json, *, lossy: bool) -> MeasurementResult:
    return MeasurementResult(
        result=document,
        document=document,
        name="alignment",
        tables={STANDS: _rows(document)},
        lossy=lossy,
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
    taking = [part[name] for name in axes.names if part[name].kind.value in kinds or len(kinds) > 1]
    return models_for(source, taking, called)[0]


def _rows(document: Json) -> list[Json]:
    """One row for each attitude, in people's units."""
    from allanite.views.wording import DEG, DEG_H

    return [
        {
            "start_s": f"{s['start']:.6f}",
            "stop_s": f"{s['stop']:.6f}",
            "rest_s": f"{s['rest']:.6f}",
            **{f"{name}_deg": f"{s[name] / DEG:.6f}" for name in ("roll", "pitch", "turned")},
            **{f"residual_{a}_deg_h": f"{v / DEG_H:.6g}" for a, v in zip("xyz", s["residual"], strict=True)},
            **{f"sd_{a}_deg_h": f"{v / DEG_H:.6g}" for a, v in zip("xyz", s["sd"], strict=True)},
        }
        for s in document["stands"]
    ]
