# SPDX-License-Identifier: BSD-3-Clause
"""plan_positions(models, goals): which positions, how long each, for a calibration; see `headings` for a heading."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.calibration.prediction import predict
from allanite.experiments.position_planning.headings import heading_plan
from allanite.experiments.position_planning.prediction import Forecast, PlannedUnit
from allanite.experiments.position_planning.results import Candidates, PlannedPosition, PositionPlan, Scheme
from allanite.experiments.position_planning.schemes import STANDARD, candidates_of, words_of
from allanite.experiments.position_planning.search import (
    Draft,
    dwell_for,
    found_scheme,
    nearest_dwell,
    worst_of,
)
from allanite.experiments.position_planning.verdict import PositionPlanVerdict
from allanite.noise import NoiseModel
from allanite.quantities.attitude import angles_of
from allanite.quantities.earth import normal_gravity
from allanite.recording.calibration import ACCELEROMETER, GYRO, Frame

__all__ = ["GOALS", "plan_positions"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

#: Standard deviations that are wanted unless told otherwise: 1 mg, 0.1 %, 1 mrad; 36 deg/h, 0.1 %, 1 mrad.
GOALS: Mapping[str, float] = {
    "accelerometer.bias": 9.80665e-3,
    "accelerometer.scale": 1e-3,
    "accelerometer.misalignment": 1e-3,
    "gyro.bias": math.radians(0.01),
    "gyro.scale": 1e-3,
    "gyro.misalignment": 1e-3,
}
#: Gravity where nothing is said of the place [m/s^2].
STANDARD_GRAVITY = 9.80665
#: A goal counts as reached within this part of it.
REACHED = 0.01
#: Lengths of record that are told, up to so many times that of the plan.
LENGTHS, STRETCHED = 10, 10.0


def plan_positions(
    models: Mapping[str, NoiseModel] | NoiseModel,
    *,
    goals: Mapping[str, float] | float | None = None,
    heading: bool = False,
    latitude: float | None = None,
    time: float | None = None,
    candidates: Candidates = "all",
    most: int = 18,
    turn: float = 5.0,
    shortest: float = 5.0,
    rate: float = 100.0,
    frame: Frame = "z",
    axes: str = "FLU",
    progress: Progress | None = None,
) -> PositionPlan:
    """Which positions of a unit, and how long in each, for a wanted calibration or a wanted heading.

    Parameters
    ----------
    models : NoiseModel, or mapping of str to NoiseModel
        "gyro" and "accelerometer", or one of them; or channels by name, of which the noisiest of each kind counts.
    goals : mapping of str to float, or float, optional
        Wanted standard deviations in SI, by parameter ("gyro.scale_x") or kind of parameter ("gyro.scale": all three);
        with `heading` one angle [rad]. By default 1 mg, 0.1 %, 1 mrad and 36 deg/h; 1 deg with `heading`.
    heading : bool
        Plan an alignment instead of a calibration.
    latitude : float, optional [rad]
        Latitude, for gravity and the Earth's rotation; required for an alignment.
    time : float, optional [s]
        Make the best of this length of record, instead of the shortest one that reaches the goals.
    candidates : "faces", "edges" or "all"
        Positions that the unit can have: the 6 faces of a box, also its 12 edges, also its 8 corners.
    most : int
        Positions.
    turn : float [s]
        Time from the end of one rest to the start of the next.
    shortest : float [s]
        Rest.
    rate : float [Hz]
        Sample rate.
    frame : "z" or "x"
        Axes that define the body of the calibration.
    axes : str
        Directions of the axes of the sensors, for an alignment.
    progress : callable, optional
        Called with a fraction and words.

    Returns
    -------
    PositionPlan

    Raises
    ------
    InputError
        No model of gyros or accelerometers, goals of unknown parameters, times that are not positive, an alignment
        without latitude.
    """
    advance = progress or (lambda fraction, what: None)
    by_sensor = _by_sensor(models)
    _check(time, most, turn, shortest, rate)
    if heading:
        if latitude is None:
            raise InputError("an alignment depends on the latitude: give it")
        goal = math.radians(1.0) if goals is None else _angle(goals)
        return heading_plan(
            by_sensor,
            goal=goal,
            shortest=shortest,
            latitude=latitude,
            time=time,
            turn=turn,
            rate=rate,
            axes=axes,
            progress=advance,
        )
    unit = PlannedUnit(
        models={sensor: (model,) * 3 for sensor, model in by_sensor.items()},
        gravity=STANDARD_GRAVITY if latitude is None else normal_gravity(latitude),
        latitude=latitude,
        rate=rate,
        turn=turn,
        shortest=shortest,
        frame=frame,
    )
    wanted = _wanted(goals, by_sensor)
    targets = _targets(unit.names, wanted)
    draft = found_scheme(
        unit,
        targets,
        candidates_of(candidates),
        most=most,
        time=time,
        progress=lambda part: advance(0.85 * part, "looking for positions"),
    )
    return _plan(unit, draft, targets, wanted, by_sensor, time, candidates, advance)


# -- what is asked for ------------------------------------------------------------------------------------------


def _by_sensor(models: Mapping[str, NoiseModel] | NoiseModel) -> dict[str, NoiseModel]:
    """The noisiest model of each kind of sensor, at one second."""
    given = {"": models} if isinstance(models, NoiseModel) else dict(models)
    out = {}
    for sensor, kind in ((ACCELEROMETER, "acceleration"), (GYRO, "rate")):
        sensor_models = [m for m in given.values() if m.kind == kind]
        if sensor_models:
            out[sensor] = max(sensor_models, key=lambda m: float(m.avar(1.0)))
    if not out:
        kinds = ", ".join(sorted({m.kind for m in given.values()})) or "nothing"
        raise InputError(f"positions are planned for gyros or accelerometers, not for {kinds}")
    return out


def _check(time: float | None, most: int, turn: float, shortest: float, rate: float) -> None:
    times = (("time", time), ("turn", turn), ("shortest", shortest), ("rate", rate))
    for name, value in times:
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} must be positive, not {value!r}")
    if time is not None and time < 2 * shortest + turn:
        raise InputError(
            f"{time:g} s hold no two rests of {shortest:g} s with a turn of {turn:g} s between them"
        )
    if not 2 <= most <= 60:
        raise InputError(f"most must lie between 2 and 60 positions, not {most}")


def _angle(goals: Mapping[str, float] | float) -> float:
    value = goals.get("heading", math.nan) if isinstance(goals, Mapping) else goals
    if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0):
        raise InputError(f"the goal of a heading is a positive angle in rad, not {goals!r}")
    return float(value)


def _wanted(goals: Mapping[str, float] | float | None, models: Mapping[str, NoiseModel]) -> dict[str, float]:
    if goals is None:
        return {name: goal for name, goal in GOALS.items() if name.partition(".")[0] in models}
    if not isinstance(goals, Mapping) or not goals:
        raise InputError(f"goals of a calibration go by parameter, like gyro.scale; not {goals!r}")
    return dict(goals)


def _targets(names: tuple[str, ...], wanted: Mapping[str, float]) -> Array:
    """Of every parameter; infinite where nothing is wanted."""
    out = np.full(len(names), np.inf)
    for key, goal in wanted.items():
        hit = np.array([n == key or _kind_of(n) == key for n in names])
        if not hit.any():
            kinds = ", ".join(dict.fromkeys(map(_kind_of, names)))
            raise InputError(
                f"no parameter {key!r} to be calibrated; there are: {kinds}, and each axis by itself"
            )
        if not (math.isfinite(goal) and goal > 0):
            raise InputError(f"the goal of {key} must be positive, not {goal!r}")
        out[hit] = np.minimum(out[hit], goal)
    return out


def _kind_of(name: str) -> str:
    return name.rpartition("_")[0]


# -- the result ---------------------------------------------------------------------------------------------------


def _plan(
    unit: PlannedUnit,
    draft: Draft,
    targets: Array,
    wanted: dict[str, float],
    models: dict[str, NoiseModel],
    time: float | None,
    candidates: Candidates,
    advance: Progress,
) -> PositionPlan:
    dwell = dwell_for(unit, draft, targets) if time is None else (time - (draft.n - 1) * unit.turn) / draft.n
    if not math.isfinite(dwell):
        dwell = nearest_dwell(unit, draft, targets)
    dwells = _round(dwell * draft.shares, up=time is None)
    draft = Draft(ups=draft.ups, shares=dwells / dwells.mean())
    forecast = _told(unit, draft, dwells)
    first = max(draft.n * unit.shortest + (draft.n - 1) * unit.turn, 0.2 * forecast.total)
    totals = np.geomspace(first, STRETCHED * forecast.total, LENGTHS)
    advance(0.9, "comparing with the usual schemes")
    usual = {name: Draft(ups=-a[:, 2], shares=np.ones(len(a)), attitudes=a) for name, a in STANDARD.items()}
    compared = {"this plan": _curve(unit, draft, targets, totals)}
    compared |= {name: _curve(unit, other, targets, totals) for name, other in usual.items()}
    schemes = tuple(_scheme(unit, name, other, targets, forecast.total) for name, other in usual.items())
    groups = tuple(dict.fromkeys(map(_kind_of, unit.names)))
    return PositionPlan(
        verdict=_verdict(forecast, targets),
        what="calibration",
        positions=_positions(draft, dwells),
        turn=unit.turn,
        total=forecast.total,
        given=time is not None,
        shortest=unit.shortest,
        candidates=candidates,
        worst=worst_of(forecast, targets),
        goals=wanted,
        names=forecast.names,
        sd=forecast.sd,
        covariance=forecast.covariance,
        open=forecast.open,
        earth=forecast.earth,
        totals=totals,
        groups=groups,
        running=_running(unit, draft, groups, totals),
        schemes=schemes,
        compared=compared,
        latitude=unit.latitude,
        rate=unit.rate,
        models=models,
    )


def _verdict(forecast: Forecast, targets: Array) -> PositionPlanVerdict:
    if worst_of(forecast, targets) <= 1 + REACHED:
        return PositionPlanVerdict.REACHED
    last = forecast.names[int(np.argmax(forecast.sd / targets))]
    return PositionPlanVerdict.NOT_DETERMINED if last in forecast.open else PositionPlanVerdict.NOT_REACHED


def _told(unit: PlannedUnit, draft: Draft, dwells: Array) -> Forecast:
    """By the linear algebra of the calibration itself."""
    prediction = predict(
        draft.way,
        dwell=dwells,
        turn=unit.turn,
        models=unit.models,
        latitude=unit.latitude,
        gravity=unit.gravity,
        frame=unit.frame,
        rate=unit.rate,
    )
    return Forecast(
        names=prediction.names,
        covariance=prediction.covariance,
        open=prediction.assumed,
        earth=prediction.earth_resolved,
        total=float(dwells.sum() + (draft.n - 1) * unit.turn),
    )


def _round(dwells: Array, *, up: bool) -> Array:
    """Whole seconds, fives beyond a minute, half minutes beyond ten."""
    step = np.where(dwells > 600, 30.0, np.where(dwells > 60, 5.0, 1.0))
    whole = np.ceil(dwells / step - 1e-9) if up else np.floor(dwells / step + 1e-9)
    return np.asarray(np.maximum(whole * step, 1.0))


def _positions(draft: Draft, dwells: Array) -> tuple[PlannedPosition, ...]:
    positions = []
    for i, (attitude, dwell) in enumerate(zip(draft.way, dwells, strict=True), 1):
        up = -attitude[2]
        roll, pitch, heading = angles_of(attitude)
        positions.append(
            PlannedPosition(
                number=i,
                words=words_of(up),
                up=(float(up[0]), float(up[1]), float(up[2])),
                attitude=(roll, pitch, heading),
                dwell=float(dwell),
            )
        )
    return tuple(positions)


def _forecasts(unit: PlannedUnit, draft: Draft, totals: Array) -> list[Forecast | None]:
    """At each length of record; None where the turns take all of it."""
    dwells = (totals - (draft.n - 1) * unit.turn) / draft.n
    return [draft.forecast(unit, float(d)) if d > 1 / unit.rate else None for d in dwells]


def _curve(unit: PlannedUnit, draft: Draft, targets: Array, totals: Array) -> Array:
    forecasts = _forecasts(unit, draft, totals)
    return np.array([math.nan if f is None else worst_of(f, targets) for f in forecasts])


def _running(unit: PlannedUnit, draft: Draft, groups: tuple[str, ...], totals: Array) -> Array:
    """Largest standard deviation of each kind; infinite where one of the kind is open."""
    of_kind = [np.array([_kind_of(n) == g for n in unit.names]) for g in groups]
    rows = []
    for f in _forecasts(unit, draft, totals):
        if f is None:
            rows.append([math.nan] * len(groups))
            continue
        sd = np.where([n in f.open for n in f.names], math.inf, f.sd)
        rows.append([float(sd[hit].max()) for hit in of_kind])
    return np.array(rows)


def _scheme(unit: PlannedUnit, name: str, draft: Draft, targets: Array, total: float) -> Scheme:
    dwell = dwell_for(unit, draft, targets)
    worst = float(_curve(unit, draft, targets, np.array([total]))[0])
    reached = math.isfinite(dwell)
    return Scheme(
        name=name,
        positions=draft.n,
        total=draft.total(unit, dwell) if reached else None,
        dwell=dwell if reached else None,
        worst=worst if math.isfinite(worst) else None,
        open=draft.forecast(unit, dwell if reached else nearest_dwell(unit, draft, targets)).open,
    )
