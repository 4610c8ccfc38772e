# SPDX-License-Identifier: BSD-3-Clause
"""The filter of a noise model on a log, and the seed paper's filter that is told the rate."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.measurement import MeasurementResult, measured_result, origin_of
from allanite.commands.recordings import is_lossy, read_part, read_whole
from allanite.commands.turned import checked, gyro_of, model_for, turn_spans, turns_of
from allanite.errors import AllaniteError, DataQualityError, InputError

if TYPE_CHECKING:
    from allanite.noise import NoiseModel
    from allanite.recording.records import Recording

__all__ = ["aided_of", "filter_of", "filtered_of"]

Advance = Callable[[float, str], None]


def filtered_of(
    log: str | os.PathLike[str],
    *,
    smooth: bool = False,
    reference: float | None = None,
    correlation_time: float | None = None,
    first: str | None = None,
    turns: str | os.PathLike[str] | None = None,
    dwell: float | None = None,
    dead_time: float = 2.0,
    **options: Any,
) -> MeasurementResult:
    """A log through the filter of its noise model, or, with a reference, through the filter that is told the rate."""
    if reference is None:
        return filter_of(log, smooth=smooth, **options)
    return aided_of(
        log,
        reference=reference,
        correlation_time=correlation_time,
        first=first,
        turns=turns,
        dwell=dwell,
        dead_time=dead_time,
        **options,
    )


def filter_of(
    log: str | os.PathLike[str],
    *,
    model: str | os.PathLike[str],
    smooth: bool = False,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """A log of a sensor at rest without the drift that a model knows; options are those of `read_part`.

    Raises
    ------
    InputError
        Several channels that could be meant, or no model of the one there is.
    DataQualityError
        A fatal finding that was not accepted: a filter is for a sensor at rest.
    """
    from allanite.filtering.kalman import filter_recording
    from allanite.recording.health.examination import check, prepare

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    channel = _one_of(recording)
    noise, model_name = model_for(model, recording[channel])
    advance(0.1, "looking for faults")
    if noise is None:
        raise InputError("a filter needs the noise model of the sensor: --model")
    try:
        ready, findings = prepare(recording, check(recording), accept=accept, by_averages=False)
    except DataQualityError as error:
        raise _refused(recording, channel, error) from None
    filtered = filter_recording(
        ready,
        noise,
        channel=channel,
        smooth=smooth,
        progress=lambda fraction: advance(0.3 + 0.7 * fraction, "smoothing" if smooth else "filtering"),
    )
    measured = measured_result(
        "filter",
        filtered.result,
        lossy=is_lossy(f.to_json() for f in findings),
        model_name=model_name,
        **origin_of(ready, findings, log, command),
    )
    return replace(measured, series=filtered.recording())


def _refused(recording: Recording, channel: str, error: DataQualityError) -> DataQualityError:
    """The refusal; of a record that was turned, it says so first: there is nothing wrong with it but for a filter."""
    from allanite.experiments.reversals import find_reversals
    from allanite.experiments.reversals.remarks import times
    from allanite.plain_files.counted import plural
    from allanite.recording.records import Kind

    if recording[channel].kind not in (Kind.RATE, Kind.ANGLE):
        return error
    try:
        turns = find_reversals(recording, channel=channel).turns
    except AllaniteError:  # too little to look for turns in: the first refusal is the one to tell
        return error
    if not turns:
        return error
    return DataQualityError(
        f"the record seems to have been turned: {plural(len(turns), 'turn')}, at {times(recording.rate, turns)}. A "
        "filter of the noise is for a sensor at rest; what a turned one saw of the Earth: allanite earth-rate. A part "
        f"without turns: --from, --to\n{error}",
        error.findings,
    )


def _one_of(recording: Recording) -> str:
    """The one channel that can bear a noise model."""
    names = [c.name for c in recording.channels if c.kind.noise_bearing]
    if len(names) != 1:
        raise InputError(f"one channel is filtered at a time; choose one with --channels: {', '.join(names)}")
    return names[0]


def aided_of(
    log: str | os.PathLike[str],
    *,
    model: str | os.PathLike[str],
    reference: float,
    correlation_time: float | None = None,
    first: str | None = None,
    turns: str | os.PathLike[str] | None = None,
    dwell: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    dead_time: float = 2.0,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The seed paper's filter on a log, told the rate along the axis [rad/s]: reference-aided, no measurement.

    Turns are left out. With `first` the log is read in the second way, too: the reference with the sign of the
    heading.

    Parameters
    ----------
    correlation_time : float, optional [s]
        What the filter takes for T_b where the model has flicker.

    Raises
    ------
    InputError
        A model with flicker and no correlation time, or without the terms of the filter.
    """
    from allanite.experiments.aided_readings import AidedTake
    from allanite.experiments.reference_aided import reference_aided
    from allanite.recording.records import Recording

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    whole, start, stop = read_whole(log, start, stop, listed=turns is not None, source=source, **options)
    channel = gyro_of(whole)
    noise, model_name = model_for(model, whole[channel])
    if noise is None:
        raise InputError("the filter needs the noise model of the sensor: --model")
    _refuse_without_time(noise, correlation_time)
    part, reversals = turns_of(
        whole, channel, start=start, stop=stop, turns=turns, dwell=dwell, first=first, dead_time=dead_time
    )
    ready = checked(part, reversals, [channel], accept=accept)
    still = ready.recording.excluding({channel: turn_spans(reversals)}, "turns")
    advance(0.5, "filtering")
    given: dict[str, Any] = {"reference": reference, "channel": channel, "T": correlation_time}
    readings = [reference_aided(still, noise, **given)]
    if first is not None and reversals.turns:
        readings.append(reference_aided(ready.recording, noise, signs=reversals.signs(), **given))
    last = readings[-1]
    result = AidedTake(
        channel=channel,
        readings=tuple(replace(r, states=None) for each in readings for r in each.result.readings),
        model=noise,
        reversals=reversals,
    )
    measured = measured_result(
        "filter",
        result,
        lossy=ready.lossy,
        model_name=model_name,
        **origin_of(part, ready.findings, log, command),
    )
    corrected = Recording.from_rate(last.corrected, rate=last.rate, unit="rad/s", names=[channel])
    return replace(measured, series=corrected)


def _refuse_without_time(model: NoiseModel, time: float | None) -> None:
    """The seed paper's filter has one Gauss-Markov state for flicker, which needs a correlation time."""
    from allanite.noise import Flicker, GaussMarkov

    has_own = [t.T for t in model.terms if isinstance(t, GaussMarkov)]
    if time is None and any(isinstance(t, Flicker) for t in model.terms):
        raise InputError(
            "the model has flicker (B without T), and the filter gives it one correlation time: --correlation-time "
            "240s, or a model with T"
        )
    if time is not None and has_own and time not in has_own:
        raise InputError(
            f"--correlation-time {time:g} s, but the Gauss-Markov term of the model has {has_own[0]:g} s: leave it out"
        )
