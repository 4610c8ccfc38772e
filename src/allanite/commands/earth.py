# SPDX-License-Identifier: BSD-3-Clause
"""Earth rate, north, the null test and plan, from a log and a model to everything that a report needs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.by_file import ByFile, headed, read_files, without_pauses
from allanite.commands.means import read_means, record_of_means
from allanite.commands.measurement import MeasurementResult, measured_result, origin_of
from allanite.commands.recordings import is_lossy, read_whole
from allanite.commands.setup import stated_in
from allanite.commands.turned import (
    LONGEST_TURN,
    TurnedRecord,
    checked,
    gyro_of,
    gyros_of,
    model_for,
    models_for,
    part_of,
    placed_of,
    rates_of,
    turns_of,
)
from allanite.commands.vector import AXES, is_vector, vector_of
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.experiments.north import EastWestNull, NorthEstimate
    from allanite.experiments.reversals import PositionsApart, Reversals
    from allanite.experiments.static_spans import SdOf
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording

__all__ = ["earth_rate_of", "north_of"]

Json = Mapping[str, Any]
Advance = Callable[[float, str], None]


def earth_rate_of(
    log: str | os.PathLike[str],
    *,
    latitude: float,
    model: str | os.PathLike[str] | None = None,
    start: float | None = None,
    stop: float | None = None,
    turns: str | os.PathLike[str] | None = None,
    dwell: float | None = None,
    first: str | None = None,
    dead_time: float = 2.0,
    vector: bool = False,
    settling: bool = False,
    warm_up: bool = False,
    temperature: str | None = None,
    bias_uncertainty: float = 0.0,
    g_sensitivity: float = 0.0,
    confidence: float = 0.95,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The Earth rate out of a log of one axis that was turned, or the rate vector out of one of three axes at rest.

    See `measure_earth_rate` and `measure_rate_vector`. Three channels of rates are taken for the axes of one sensor,
    unless something is said about turns.

    Parameters
    ----------
    log, model : path
        Whatever `read` and `load_models` understand.
    start, stop : float, optional [s]
        Part of the log; directions count from the beginning of the part.
    turns, dwell, first, dead_time
        See `turns_of`.
    vector : bool
        Three axes, even where they were turned by half a turn.
    bias_uncertainty : float [rad/s]
        Standard uncertainty of the bias of each of three axes.
    accept : collection of str
        Fatal findings to go on in spite of.
    **options
        Those of `stated_in` and of `read`.
    """
    from allanite.experiments.earth_rate import measure_earth_rate

    advance, stated = progress or (lambda fraction, what: None), stated_in(options)
    advance(0.0, "reading")
    whole, start, stop = read_whole(log, start, stop, listed=turns is not None, source=source, **options)
    turned = any((turns, dwell is not None, first, settling, warm_up, temperature, g_sensitivity))
    if is_vector(whole, forced=vector, turned=turned):
        return vector_of(
            part_of(whole, start, stop),
            log=log,
            latitude=latitude,
            model=None if model is None else str(model),
            forced=vector,
            accept=accept,
            estimate={"bias": bias_uncertainty, "stated": stated, "confidence": confidence},
            command=command,
            progress=advance,
        )
    if bias_uncertainty:
        raise InputError("--bias-uncertainty is for three axes at rest: one axis has its bias fitted")
    channel = _one_axis(whole)
    noise, model_name = model_for(model, whole[channel])
    advance(0.1, "looking for the turns")
    part, reversals = turns_of(
        whole, channel, start=start, stop=stop, turns=turns, dwell=dwell, first=first, dead_time=dead_time
    )
    advance(0.4, "looking for faults")
    ready = checked(part, reversals, [channel], accept=accept)
    result = measure_earth_rate(
        ready.recording,
        latitude=latitude,
        model=noise,
        channel=channel,
        reversals=reversals,
        settling=settling,
        warm_up=warm_up,
        temperature=temperature,
        stated=stated,
        g_sensitivity=g_sensitivity,
        confidence=confidence,
        progress=lambda fraction, what: advance(0.5 + 0.5 * fraction, what),
    )
    return measured_result(
        "earth-rate",
        result,
        lossy=ready.lossy,
        model_name=model_name,
        **origin_of(part, ready.findings, log, command, channel),
    )


def _one_axis(recording: Recording) -> str:
    """The channel of the axis that was turned."""
    rates = rates_of(recording)
    if len(rates) == AXES:
        raise InputError(
            f"the log has three axes, {', '.join(rates)}, but turns refer to one: choose the turned axis "
            "with --channels; for three axes at rest, leave out the options of turns"
        )
    return gyro_of(recording)


def north_of(
    log: str | os.PathLike[str],
    *,
    latitude: float,
    model: str | os.PathLike[str],
    model_channels: Mapping[str, str] | None = None,
    headings: str | os.PathLike[str] | None = None,
    positions: Mapping[str | os.PathLike[str], float] | None = None,
    between: float = 60.0,
    means: bool = False,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    rotation: float | None = None,
    heading_at_start: float = 0.0,
    second_axis: str | None = None,
    null: bool = False,
    start: float | None = None,
    stop: float | None = None,
    dead_time: float = 2.0,
    misalignment: float = 0.0,
    confidence: float = 0.95,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Where north is, or whether a bias follows the turns, out of a log; see `find_north` and `east_west_null`.

    Parameters
    ----------
    model_channels : mapping of str to str, optional
        What the models call the channels of the log, where that is another name.
    headings : path, optional
        Positions with their headings; times count from the first sample of the log.
    positions : mapping of path to float [rad], optional
        One file for each position, with its heading, in the order of recording; `log` is the first of them.
    between : float [s]
        From one of these files to the next, where they do not tell; see `joined_positions`.
    means : bool
        `log` is a table with one row of means for each position, and a column of headings.
    averaging, sd_of
        See `means_of`.
    rotation, heading_at_start : float [rad/s], [rad]
        Of a table that turned all the time.
    second_axis : "left" or "right", optional
        Side of the first axis, seen from above, to which a second one points.
    null : bool
        Headings are from north, and those near east and west are compared.
    start, stop : float, optional [s]
        Part of the log, or of each file.
    **options
        Those of `stated_in` and of `read`.

    Raises
    ------
    InputError
        None or several of positions in one log, in files of their own, and a rotation; more than two channels of rates;
        two, and not the side of the second.
    """
    from allanite.experiments.north import Rotation, east_west_null, find_north

    if sum(given is not None for given in (headings, positions, rotation, means or None)) != 1:
        raise InputError(
            "state the positions of the table: in one log (--headings), in separate files (--positions), "
            "in rows of means (--means), or as a rotation (--rotation)"
        )
    advance, stated = progress or (lambda fraction, what: None), stated_in(options)
    advance(0.0, "reading")
    apart: PositionsApart | None = None
    by_file: ByFile | None = None
    if means:
        whole, joined, of_table, apart = _table_of(
            log, averaging, sd_of, between, source, start=start, stop=stop, **options
        )
    elif positions is None:
        whole, start, stop = read_whole(
            log, start, stop, listed=headings is not None, source=source, **options
        )
    else:
        from allanite.experiments.reversals import joined_positions

        by_file = read_files(list(positions), accept=accept, start=start, stop=stop, **options)
        whole, joined, apart = joined_positions(
            by_file.recordings, list(positions.values()), between=between, dead_time=dead_time
        )
    channels = gyros_of(whole, most=1 if null else 2)
    axes = _sided(channels, second_axis)
    models, where = models_for(model, [whole[name] for name in channels], model_channels, mapped=not null)
    if apart is None:
        part, placed = placed_of(whole, channels[0], headings, start=start, stop=stop, dead_time=dead_time)
    else:
        part, placed = whole, joined
    advance(0.3, "looking for faults")
    if means:
        ready = TurnedRecord(recording=part, findings=of_table, lossy=is_lossy(f.to_json() for f in of_table))
    else:
        longest = LONGEST_TURN if positions is None else math.inf
        ready = checked(part, placed, channels, accept=accept, longest=longest)
    findings = ready.findings
    if by_file is not None:
        of_each = [(p.start, p.stop) for p in placed.positions]
        findings = (*by_file.findings, *without_pauses(findings, whole.n_samples, of_each))
    known: dict[str, Any] = {"latitude": latitude, "stated": stated, "confidence": confidence}
    result: NorthEstimate | EastWestNull
    if null:
        advance(0.5, "fitting the rates")
        one = models[channels[0]]
        result = east_west_null(ready.recording, model=one, positions=placed, channel=channels[0], **known)
    else:
        north = find_north(
            ready.recording,
            model=models,
            positions=placed if rotation is None else None,
            rotation=None if rotation is None else Rotation(rate=rotation, start=heading_at_start),
            channels=axes,
            misalignment=misalignment,
            progress=lambda fraction, what: advance(0.5 + 0.5 * fraction, what),
            **known,
        )
        result = replace(north, apart=apart)
    return measured_result(
        "east-west-null" if null else "north",
        result,
        lossy=ready.lossy,
        model_name=where[channels[0]],
        files=None if by_file is None else headed(by_file, (positions or {}).values()),
        **origin_of(part, findings, log, command, channels[0]),
    )


def _sided(channels: Sequence[str], side: str | None) -> dict[str, float]:
    """Axes with their headings less that of the first [rad].

    Raises
    ------
    InputError
        A second axis and no side, or a side and no second axis.
    """
    first, *others = channels
    if not others:
        if side is not None:
            raise InputError(f"--second-axis needs two channels of rates; the log has one, {first}")
        return {first: 0.0}
    (second,) = others
    if side is None:
        raise InputError(
            f"two axes, {first} and {second}: state to which side of {first} the axis {second} points, seen from "
            "above: --second-axis left (forward, left, up) or --second-axis right (forward, right, down). The wrong "
            "side mirrors the azimuth"
        )
    return {first: 0.0, second: math.pi / 2 if side == "right" else -math.pi / 2}


def _table_of(
    table: str | os.PathLike[str],
    averaging: float | None,
    sd_of: SdOf | None,
    between: float,
    source: str | None,
    **options: Any,
) -> tuple[Recording, Reversals, tuple[Finding, ...], PositionsApart]:
    """Rows of means as a record, and where the sensor stood in each.

    Raises
    ------
    InputError
        No column of headings.
    """
    from allanite.experiments.reversals import placed

    means, findings = read_means(table, averaging=averaging, sd_of=sd_of, source=source, **options)
    if means.heading is None:
        raise InputError(
            "the table has no column heading: where the axis pointed in each row, in degrees from the mark"
        )
    record, spans, apart = record_of_means(means, between)
    names = [f"row {k}" for k in range(1, means.n + 1)]
    where = placed(record, spans, means.heading.tolist(), names, dead_time=0.0, guard=0.0)
    return record, where, findings, apart
