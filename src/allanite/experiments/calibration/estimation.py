# SPDX-License-Identifier: BSD-3-Clause
"""From a recording that was put into several positions to the calibration of its triads."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from allanite.errors import DataQualityError, InputError
from allanite.experiments.calibration import words
from allanite.experiments.calibration.adjustment import adjust
from allanite.experiments.calibration.gathering import Gathered, gather
from allanite.experiments.calibration.outcome import Circumstances, outcome
from allanite.experiments.calibration.problem import problem_of
from allanite.experiments.calibration.results import CalibrationEstimate, GravitySource
from allanite.experiments.calibration.rows import BETWEEN, gather_rows, noise_source, row_edges
from allanite.experiments.calibration.verdict import CalibrationNoise
from allanite.experiments.reversals import PositionsApart
from allanite.experiments.static_spans import (
    PositionMeans,
    StaticSpans,
    UnitAxes,
    find_rests,
    held_by_hand,
    unit_axes,
)
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.quantities.earth import normal_gravity
from allanite.recording.calibration import ACCELEROMETER, GYRO, Frame
from allanite.recording.records import Kind, Recording
from allanite.recording.thermometers import checked_thermometer

__all__ = ["STANDARD_GRAVITY", "calibrate", "calibrate_means"]

_UNSETTLED = (
    "the fit does not settle, so there are no parameters: look at the axes, the units and the rests (--spans), or "
    "record more positions"
)

Progress = Callable[[float, str], None]

#: Conventional value [m/s^2] (3rd CGPM, 1901), where neither gravity nor the latitude is given.
STANDARD_GRAVITY = 9.80665


def calibrate(
    recording: Recording,
    *,
    spans: StaticSpans | ArrayLike | None = None,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
    latitude: float | None = None,
    height: float = 0.0,
    gravity: float | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    frame: Frame = "z",
    quadratic: bool = False,
    drift: bool = True,
    reference_temperature: float | None = None,
    temperature: str | None = None,
    without: Collection[int | tuple[int, int]] = (),
    stated: Mapping[str, float] | None = None,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> CalibrationEstimate:
    """Biases, scale factors and misalignments of a unit that rested in several positions.

    Parameters
    ----------
    recording : Recording
        Record of three accelerometers, three gyros or both, at rest in two or more positions and turned between them.
    spans : StaticSpans or array_like, shape (n, 2) [samples], optional
        Spans at rest; detected in the recording by default.
    model : NoiseModel or mapping of str to NoiseModel, optional
        By name of the channel, or by role: "gyro", "accelerometer"; a single one is that of a single triad. In the
        unit of the channels after their scale. Without it the noise is that within the spans.
    latitude : float, optional [rad]
        Gives gravity and the vertical part of the Earth's rotation.
    height : float [m]
        Above the ellipsoid.
    gravity : float, optional [m/s^2]
        Local gravity, in place of the value by latitude. Scale factors of accelerometers are proportional to its
        inverse.
    gyro, accelerometer : sequence of str, optional
        Channels x, y, z; needed where the recording does not tell. An empty sequence: do without.
    frame : "z" or "x"
        Axes that define the body, see `allanite.recording.calibration`.
    quadratic : bool
        Estimate quadratic terms of the accelerometers too.
    drift : bool
        Look for a random walk of the biases where the positions scatter more than the noise. Without it every position
        counts alike, as in the programs that most published coefficients come from.
    reference_temperature : float, optional
        Estimate the slopes of the biases with temperature, and give the biases at this one.
    temperature : str, optional
        Channel of it; the only one of its kind by default.
    without : collection of int or (int, int)
        Numbers of spans, from 1, to leave out; pairs of them: the turn from the one to the next.
    stated : mapping of str to float, optional
        Standard uncertainties that no record shows: "gravity" [m/s^2], or parameters as in
        `Calibration.with_repeatability`.
    confidence : float
        Confidence level of the intervals.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    CalibrationEstimate

    Raises
    ------
    InputError
        Channels, spans, a latitude or a confidence that make no sense.
    DataQualityError
        No span at rest; accelerometers that do not show gravity; counts and too few positions; a fit that does not
        settle.

    Notes
    -----
    All unknowns are fitted together, see `allanite.experiments.calibration.adjustment.design`. Biases are those during
    the recording: add what another switching-on changes by `stated` or `Calibration.with_repeatability`.
    """
    advance = progress or (lambda fraction, what: None)
    stated = dict(stated or {})
    _refuse(latitude, gravity, frame, confidence, stated)
    axes = unit_axes(recording, gyro, accelerometer).triads
    heat = _temperature(recording, temperature, reference_temperature, sum(axes.values(), ()))
    advance(0.0, "looking for static spans")
    kinds = {
        name: Kind.UNKNOWN for three in axes.values() for name in three
    }  # in counts a model may be of any
    models = models_of(model, kinds, roles=axes) or None
    static_spans = _spans(recording, spans, models, axes)
    advance(0.2, "reading the spans")
    in_hand = static_spans.held or (spans is not None and _held(recording, axes, static_spans))
    data = gather(
        recording, axes, static_spans.array, model=models, temperature=heat, without=without, in_hand=in_hand
    )
    return _fitted(
        data,
        recording,
        {"sure": models is not None, "drift": drift, "in_hand": in_hand},
        advance,
        _gravity(gravity, latitude, height),
        quadratic=quadratic,
        spans=static_spans.array,
        static_spans=static_spans,
        frame=frame,
        latitude=latitude,
        reference_temperature=reference_temperature,
        stated=stated,
        spans_source="found" if spans is None else "given",
        model_source=CalibrationNoise.RECORD if models is None else CalibrationNoise.GIVEN,
        confidence=confidence,
        date=_date(recording),
        duration=recording.duration,
        source=recording.source,
    )


def calibrate_means(
    means: PositionMeans,
    *,
    between: float = BETWEEN,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
    latitude: float | None = None,
    height: float = 0.0,
    gravity: float | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    frame: Frame = "z",
    quadratic: bool = False,
    reference_temperature: float | None = None,
    temperature: str | None = None,
    without: Collection[int | tuple[int, int]] = (),
    stated: Mapping[str, float] | None = None,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> CalibrationEstimate:
    """The same out of the means of the readings in each position, without the log.

    Parameters
    ----------
    means : PositionMeans
    between : float [s]
        From one position to the next, where the table does not tell: slow noise of a model goes on in it.
    model : NoiseModel or mapping of str to NoiseModel, optional
        Needs the averaging times of the means. Without it the noise is that of the standard deviations in the table, or
        what the positions scatter by.
    without : collection of int
        Numbers of rows, from 1, to leave out.
    latitude, height, gravity, gyro, accelerometer, frame, quadratic, reference_temperature, temperature, stated, \
confidence, progress
        See `calibrate`.

    Raises
    ------
    InputError
        Channels, rows, a latitude or a confidence that make no sense; a model without averaging times.
    DataQualityError
        Accelerometers that do not show gravity; too few positions to tell the noise by, where nothing else does; a
        fit that does not settle.

    Notes
    -----
    No turn is seen: scale factors and misalignments of gyros stay open, unless the Earth's rotation shows them.
    """
    advance = progress or (lambda fraction, what: None)
    stated, rows = dict(stated or {}), means.rows
    _refuse(latitude, gravity, frame, confidence, stated)
    axes = unit_axes(rows, gyro, accelerometer).triads
    heat = _temperature(rows, temperature, reference_temperature, sum(axes.values(), ()))
    kinds = {name: Kind.UNKNOWN for three in axes.values() for name in three}
    models = models_of(model, kinds, roles=axes) or None
    source = noise_source(means, axes, models)
    data = gather_rows(
        means, axes, models=models, source=source, temperature=heat, without=without, between=between
    )
    scattered = source is CalibrationNoise.SCATTER
    estimate = _fitted(
        data,
        rows,
        {"sure": True, "drift": False, "noise_known": not scattered},
        advance,
        _gravity(gravity, latitude, height),
        quadratic=quadratic,
        spans=row_edges(means, between),
        sd_columns=means.sd_columns if source is CalibrationNoise.TABLE else None,
        apart=_apart(means, source, between),
        frame=frame,
        latitude=latitude,
        reference_temperature=reference_temperature,
        stated=stated,
        spans_source="rows of means",
        model_source=source,
        confidence=confidence,
        date="",
        duration=math.nan,
        source=rows.source,
    )
    return _as_the_table_tells(estimate, means)


def _fitted(
    data: Gathered,
    recording: Recording,
    how: Mapping[str, bool],
    advance: Progress,
    gravity: tuple[float, GravitySource],
    *,
    quadratic: bool,
    **about: Any,
) -> CalibrationEstimate:
    """The fit of what was gathered, and the result; `how` it is adjusted, and what `Circumstances` take besides."""
    g, source = gravity
    advance(0.4, "fitting")
    problem = problem_of(data, recording, g, about["frame"], quadratic, about["reference_temperature"])
    fit = adjust(problem.observed, problem.weights, problem.start, about["latitude"], **how)
    if not fit.solution.converged:
        astray = problem.astray
        raise DataQualityError(
            _UNSETTLED if astray is None else words.astray(astray.miss, astray.order, astray.turned)
        )
    advance(0.9, "judging")
    units = {s: _unit(recording, three) for s, three in data.axes.items()}
    return outcome(
        Circumstances(data=data, problem=problem, units=units, gravity=g, gravity_source=source, **about), fit
    )


def _apart(means: PositionMeans, source: CalibrationNoise, between: float) -> PositionsApart | None:
    """What a model takes from the table: the time between rows, in place of their standard deviations."""
    given = source is CalibrationNoise.GIVEN
    timed = means.start is not None
    if not given or (timed and not means.sd):
        return None
    return PositionsApart(
        rows=True,
        count=1 if timed else 2,
        assumed=None if timed else between,
        sd_ignored=bool(means.sd),
    )


def _as_the_table_tells(estimate: CalibrationEstimate, means: PositionMeans) -> CalibrationEstimate:
    """Without the times that a table does not hold, and the models that nobody gave."""
    given = estimate.model_source is CalibrationNoise.GIVEN
    bare = replace(estimate, rate=math.nan, models=estimate.models if given else {})
    if estimate.model_source is CalibrationNoise.SCATTER:
        bare = replace(bare, scatter=tuple(replace(s, ratio=math.nan) for s in estimate.scatter))
    if means.start is not None and means.duration is not None:
        return bare
    return replace(
        bare,
        positions=tuple(replace(p, start=math.nan, stop=math.nan) for p in estimate.positions),
        turns=tuple(replace(t, start=math.nan, stop=math.nan) for t in estimate.turns),
    )


# -- what was asked for -----------------------------------------------------------------------------------


def _refuse(
    latitude: float | None, gravity: float | None, frame: str, confidence: float, stated: Mapping[str, float]
) -> None:
    if latitude is not None and not abs(latitude) <= math.pi / 2:
        raise InputError(f"latitude {latitude!r}: give it in radians, from -pi/2 to pi/2")
    if gravity is not None and not 9.7 <= gravity <= 9.9:
        raise InputError(f"gravity {gravity!r}: on the ground it lies from 9.7 to 9.9 m/s²")
    if frame not in ("z", "x"):
        raise InputError(f"frame {frame!r}: it is 'z' or 'x'")
    if not 0.5 <= confidence < 1:
        raise InputError(f"confidence must be from 0.5 to below 1, not {confidence!r}")
    for name, value in stated.items():
        if not (math.isfinite(value) and value >= 0):
            raise InputError(
                f"the stated uncertainty of {name} must be finite and not negative, not {value!r}"
            )


def _temperature(
    recording: Recording, name: str | None, reference: float | None, measured: Collection[str]
) -> str | None:
    channel_names = [c.name for c in recording.channels if c.kind is Kind.TEMPERATURE]
    if name is not None:
        return checked_thermometer(recording, name, measured)
    if reference is not None and len(channel_names) != 1:
        raise InputError(
            f"a reference temperature needs one channel of temperature; the recording has {len(channel_names)}: say "
            "which with temperature="
        )
    return channel_names[0] if len(channel_names) == 1 else None


def _gravity(gravity: float | None, latitude: float | None, height: float) -> tuple[float, GravitySource]:
    if gravity is not None:
        return gravity, "given"
    if latitude is not None:
        return normal_gravity(latitude, height), "latitude"
    return STANDARD_GRAVITY, "standard"


def _spans(
    recording: Recording,
    spans: StaticSpans | ArrayLike | None,
    models: Mapping[str, NoiseModel] | None,
    axes: Mapping[str, tuple[str, ...]],
) -> StaticSpans:
    if isinstance(spans, StaticSpans):
        return spans
    if spans is None:
        rests = find_rests(
            recording,
            gyro=axes.get(GYRO, ()),
            accelerometer=axes.get(ACCELEROMETER, ()),
            model=models,
        )
        if not len(rests):
            raise DataQualityError(
                "the unit is nowhere at rest long enough; give the spans, or record positions of 5 s at least"
            )
        return rests
    from allanite.experiments.static_spans import StaticSpan

    edges = np.asarray(spans)
    if edges.ndim != 2 or edges.shape[1] != 2 or not len(edges):
        raise InputError("spans must be rows of two sample numbers: where each begins and ends")
    return StaticSpans(
        rate=recording.rate,
        n_samples=recording.n_samples,
        spans=tuple(StaticSpan(start=int(a), stop=int(b)) for a, b in edges),
        source="given",
    )


def _held(recording: Recording, axes: Mapping[str, tuple[str, ...]], spans: StaticSpans) -> bool:
    """Whether spans that were given were held in the hand."""
    return held_by_hand(
        recording,
        UnitAxes(gyro=axes.get(GYRO, ()), accelerometer=axes.get(ACCELEROMETER, ())),
        spans.array,
    )


def _unit(recording: Recording, names: tuple[str, ...]) -> str:
    channel = recording[names[0]]
    return {Kind.ACCELERATION: "m/s²", Kind.RATE: "rad/s"}.get(channel.kind, channel.unit or "counts")


def _date(recording: Recording) -> str:
    if recording.start is None:
        return ""
    return datetime.fromtimestamp(recording.start / 1e9, tz=UTC).isoformat(timespec="seconds")
