# SPDX-License-Identifier: BSD-3-Clause
"""From the last fit to the result: units of the channels, intervals, positions, turns, and what may be said."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment import OPEN, Adjustment, left_out, plausible_of
from allanite.experiments.calibration.adjustment.design import SENSITIVITY
from allanite.experiments.calibration.adjustment.scatter import Deletion, deletion, shift
from allanite.experiments.calibration.adjustment.weights import DRIFT, TURNS
from allanite.experiments.calibration.agreement import alone_and_together
from allanite.experiments.calibration.completion import Completion, complete
from allanite.experiments.calibration.gathering import Gathered
from allanite.experiments.calibration.orientations import ORIENTATIONS, half_axes_away, words_of
from allanite.experiments.calibration.problem import CalibrationProblem
from allanite.experiments.calibration.questions import checks_of
from allanite.experiments.calibration.results import (
    CalibrationEstimate,
    CalibrationParameter,
    CalibrationPosition,
    CalibrationTurn,
    GravitySource,
    ObservationScatter,
    SpansSource,
    uncovered,
)
from allanite.experiments.calibration.verdict import CalibrationNoise, ParameterNeed, ParameterStatus
from allanite.experiments.reversals import PositionsApart
from allanite.experiments.static_spans import SdColumns, StaticSpans
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import rotation_vector
from allanite.quantities.distributions import normal_quantile, student_quantile
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, Frame

__all__ = ["Circumstances", "outcome"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Probability with which nothing at all is called an outlier in a sound record.
SOUND = 0.999

#: Kinds of observations in words.
_WHAT = {ACCELEROMETER: "accelerometers at rest", GYRO: "gyros at rest", TURNS: "turns"}
_UNITS = {ACCELEROMETER: "m/s²", GYRO: "rad/s", TURNS: "rad"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Circumstances:
    """Everything but the fit; attributes as of `CalibrationEstimate`, `spans` all of them [samples]."""

    data: Gathered = field(repr=False)
    problem: CalibrationProblem = field(repr=False)
    units: Mapping[str, str]
    spans: Index
    static_spans: StaticSpans | None = None
    sd_columns: SdColumns | None = None
    apart: PositionsApart | None = None
    frame: Frame
    gravity: float
    gravity_source: GravitySource
    latitude: float | None
    reference_temperature: float | None
    stated: Mapping[str, float]
    spans_source: SpansSource
    model_source: CalibrationNoise
    confidence: float
    date: str
    duration: float
    source: str


def outcome(about: Circumstances, fit: Adjustment) -> CalibrationEstimate:
    """The result."""
    calibration = _calibration(about, fit)
    opened = (fit.solution.open**2).sum(axis=1)
    lacks = (opened > OPEN).any() and not about.problem.astray
    completion = complete(fit) if lacks else Completion()
    limit = (1 - SOUND) / (fit.observed.n + fit.observed.m)
    positions = _positions(about, fit, limit)
    turns = _turns(about, fit, limit)
    missing = uncovered(positions)
    expected = about.data.in_hand or about.model_source is CalibrationNoise.SCATTER
    agreement = None if about.problem.astray else alone_and_together(fit)
    result = CalibrationEstimate(
        calibration=calibration,
        parameters=_not_resolved(_parameters(about, fit, calibration, opened, completion), missing),
        add=(*completion.add, *half_axes_away(_directions(completion.add), missing)),
        checks=(*checks_of(fit, expected=expected), *([] if agreement is None else [agreement])),
        scatter=_scatter(fit),
        positions=positions,
        turns=turns,
        earth=fit.earth,
        astray=about.problem.astray,
        follows_gravity=_effect_of_gravity(about, fit),
        in_hand=about.data.in_hand,
        gravity=about.gravity,
        gravity_source=about.gravity_source,
        latitude=about.latitude,
        stated=about.stated,
        temperature_span=_range(about.data.temperature),
        models=about.data.models,
        model_source=about.model_source,
        spans_source=about.spans_source,
        static_spans=about.static_spans,
        sd_columns=about.sd_columns,
        apart=about.apart,
        confidence=about.confidence,
        rate=about.data.rate,
        duration=about.duration,
        source=about.source,
    )
    return replace(result, verdict=result.judged()[0])


# -- parameters -------------------------------------------------------------------------------------------


def _calibration(about: Circumstances, fit: Adjustment) -> Calibration:
    names = fit.observed.names
    sizes = _sizes_of(names, about.problem.gains)
    values = fit.solution.state.values * sizes
    for k, name in enumerate(names):
        sensor, _, rest = name.partition(".")
        if rest.startswith("bias_") and not rest.startswith("bias_temperature"):
            values[k] += about.problem.offsets[sensor]["xyz".index(rest[-1])]
    covariance = fit.covariance * np.outer(sizes, sizes)
    stated = dict(about.stated)
    relative = stated.pop("gravity", 0.0) / about.gravity
    scales = np.array(
        [v if n.startswith("accelerometer.scale") else 0.0 for n, v in zip(names, values, strict=True)]
    )
    opened = (fit.solution.open**2).sum(axis=1)
    calibration = Calibration(
        names=names,
        values=values,
        covariance=covariance + relative**2 * np.outer(scales, scales),
        status=tuple("assumed" if o > OPEN else "estimated" for o in opened),
        frame=about.frame,
        channels=dict(about.data.axes),
        units=dict(about.units),
        temperature=about.reference_temperature,
        gravity=about.gravity if ACCELEROMETER in about.data.axes else None,
        date=about.date,
        source=about.source,
    )
    return calibration.with_repeatability(stated) if stated else calibration


def _sizes_of(names: tuple[str, ...], gains: Mapping[str, float]) -> Array:
    """What one unit of each parameter of the fit is in the units of the channels."""
    kinds = [name.partition(".")[::2] for name in names]
    return np.array(
        [1.0 if rest.startswith(("misalignment", "quadratic")) else gains[sensor] for sensor, rest in kinds]
    )


def _parameters(
    about: Circumstances, fit: Adjustment, calibration: Calibration, opened: Array, completion: Completion
) -> tuple[CalibrationParameter, ...]:
    out = []
    normal = normal_quantile(0.5 + about.confidence / 2)
    wide = np.sqrt(fit.upper_variance(about.confidence))
    believed = normal * plausible_of(calibration.names) * _sizes_of(calibration.names, about.problem.gains)
    for k, name in enumerate(calibration.names):
        value, sd = calibration[name]
        dof, status = float(fit.dof[k]), ParameterStatus(calibration.status[k])
        half = normal * sd
        if math.isfinite(dof):
            half = sd * min(student_quantile(0.5 + about.confidence / 2, dof), normal * float(wide[k]))
        if half > believed[k] > 0:  # the record says no more than what is known of any unit
            half = float(believed[k])
            status = ParameterStatus.NOT_RESOLVED if status is ParameterStatus.ESTIMATED else status
        need = (
            ParameterNeed.POSITIONS if status is ParameterStatus.NOT_RESOLVED else completion.needs.get(name)
        )
        out.append(
            CalibrationParameter(
                name=name,
                unit=_unit_of(name, about.units),
                value=value,
                sd=sd,
                interval=(value - half, value + half),
                status=status,
                open=float(min(opened[k], 1.0)),
                dof=dof,
                add=completion.by_name.get(name, ()) if status is ParameterStatus.ASSUMED else (),
                need=None if status is ParameterStatus.ESTIMATED else need,
            )
        )
    return tuple(out)


def _directions(positions: Sequence[str]) -> Array:
    """Unit vectors that point up in positions, shape (n, 3)."""
    ups = np.array([ORIENTATIONS[words] for words in positions], dtype=np.float64).reshape(-1, 3)
    return np.asarray(ups / np.linalg.norm(ups, axis=1, keepdims=True))


def _not_resolved(
    parameters: tuple[CalibrationParameter, ...], missing: tuple[str, ...]
) -> tuple[CalibrationParameter, ...]:
    """Bias and scale factor of an accelerometer rest on readings with its axis up and down; one alone extrapolates."""
    asked: dict[str, tuple[str, ...]] = {}
    for words in missing:
        for kind in ("bias", "scale"):
            name = f"{ACCELEROMETER}.{kind}_{words[0]}"
            asked[name] = (*asked.get(name, ()), words)
    return tuple(
        replace(p, status=ParameterStatus.NOT_RESOLVED, add=asked[p.name])
        if p.name in asked and p.status is ParameterStatus.ESTIMATED
        else p
        for p in parameters
    )


def _unit_of(name: str, units: Mapping[str, str]) -> str:
    sensor, _, rest = name.partition(".")
    unit, si = units[sensor], _UNITS[sensor]
    if rest.startswith("misalignment"):
        return "rad"
    if rest.startswith("quadratic"):
        return f"1/({si})"
    if rest.startswith("scale"):
        return "1" if unit == si else f"{unit}/({si})"
    if rest.startswith("gravity_sensitivity"):
        return f"{unit}/({_UNITS[ACCELEROMETER]})"
    return f"{unit}/K" if rest.startswith("bias_temperature") else unit


# -- positions and turns ------------------------------------------------------------------------------------


def _positions(about: Circumstances, fit: Adjustment, limit: float) -> tuple[CalibrationPosition, ...]:
    used = {number: k for k, number in enumerate(about.data.numbers)}
    known = _linked(fit)
    suspects = _suspects(fit)
    return tuple(
        _position(about, fit, number, used[number], known, limit, suspects)
        if number in used
        else _left_out(about, number)
        for number in range(1, len(about.spans) + 1)
    )


def _suspects(fit: Adjustment) -> set[int]:
    """The spans that lie farthest from what the others predict, where a scatter hides them: of each triad one."""
    suspects = set()
    for triad in fit.observed.triads:
        if triad.sensor in fit.beyond:
            shifts = [shift(fit.solution, _rows(fit, triad.sensor, k)) for k in range(fit.observed.n)]
            suspects.add(int(np.argmax([chi2 / max(dof, 1) for chi2, dof in shifts])))
    return suspects


def _linked(fit: Adjustment) -> set[int]:
    """Spans whose heading the turns give."""
    known = {0}
    for i, j in zip(fit.observed.before.tolist(), fit.observed.after.tolist(), strict=True):
        if i in known:
            known.add(j)
    return known


def _position(
    about: Circumstances,
    fit: Adjustment,
    number: int,
    k: int,
    known: set[int],
    limit: float,
    suspects: Collection[int],
) -> CalibrationPosition:
    observed, state = fit.observed, fit.solution.state
    attitude = state.attitudes[k]
    up = -attitude[2]
    excess = excess_sd = rate = rate_sd = None
    noise = fit.solution.noise
    for triad in observed.triads:
        place = fit.rows[triad.sensor][3 * k : 3 * k + 3]
        spread = noise[np.ix_(place, place)]
        values = state.values[observed.place(triad.sensor)]
        mean_reading = observed.means[triad.sensor][k]
        true = triad.errors(values).true(mean_reading, observed.warmer[k], up * observed.gravity)
        if triad.sensor == ACCELEROMETER:
            excess = float(np.linalg.norm(true)) - observed.gravity
            excess_sd = math.sqrt(float(up @ spread @ up))
        else:
            rate, rate_sd = _fixed(true - attitude.T @ state.earth), _fixed(np.sqrt(np.diag(spread)))
    p, misfit = _worst([_deleted(fit, t.sensor, k) for t in observed.triads])
    if k in suspects:
        p, misfit = min(
            (p, misfit),
            _worst([left_out(fit, _rows(fit, t.sensor, k), fit.rows[t.sensor]) for t in observed.triads]),
        )
    start, stop = (about.data.edges[k] / about.data.rate).tolist()
    return CalibrationPosition(
        number=number,
        start=start,
        stop=stop,
        up=_fixed(up),
        words=words_of(up) if ACCELEROMETER in fit.rows else "",
        attitude=_fixed(attitude),
        heading_known=k in known,
        temperature=None if about.data.temperature is None else float(about.data.temperature[k]),
        excess=excess,
        excess_sd=excess_sd,
        rate=rate,
        rate_sd=rate_sd,
        misfit=misfit,
        p=p,
        outlier=p < limit,
        used=True,
    )


def _left_out(about: Circumstances, number: int) -> CalibrationPosition:
    start, stop = (about.spans[number - 1] / about.data.rate).tolist()
    nothing = np.full(3, math.nan)
    return CalibrationPosition(
        number=number,
        start=start,
        stop=stop,
        up=_fixed(nothing),
        words="",
        attitude=_fixed(np.full((3, 3), math.nan)),
        heading_known=False,
        temperature=None,
        excess=None,
        excess_sd=None,
        rate=None,
        rate_sd=None,
        misfit=math.nan,
        p=1.0,
        outlier=False,
        used=False,
        why=about.data.unused[number],
    )


def _deleted(fit: Adjustment, what: str, k: int) -> Deletion:
    return deletion(fit.solution, _rows(fit, what, k), fit.kinds[what], fit.scatter_dof(what))


def _rows(fit: Adjustment, what: str, k: int) -> Index:
    """Rows of one span or turn."""
    return fit.rows[what][3 * k : 3 * k + 3]


def _worst(deletions: list[Deletion]) -> tuple[float, float]:
    """Probability and misfit of the triad that says more, charged for the choice."""
    testable_deletions = [d for d in deletions if d.dof]
    if not testable_deletions:
        return 1.0, math.nan
    worst = min(testable_deletions, key=lambda d: (d.p, -d.chi2))
    return min(worst.p * len(testable_deletions), 1.0), worst.misfit


def _turns(about: Circumstances, fit: Adjustment, limit: float) -> tuple[CalibrationTurn, ...]:
    observed, data = fit.observed, about.data
    out = []
    if GYRO not in fit.rows:
        return ()
    links = {int(i): k for k, i in enumerate(observed.before)}
    for i in range(observed.n - 1):
        attitudes = fit.solution.state.attitudes
        vector = rotation_vector(attitudes[i].T @ attitudes[i + 1])
        angle = float(np.linalg.norm(vector))
        turn_deletion, residual = Deletion(chi2=0.0, dof=0, p=1.0), np.full(3, math.nan)
        if i in links and TURNS in fit.rows:
            rows = fit.rows[TURNS][3 * links[i] : 3 * links[i] + 3]
            residual, turn_deletion = fit.solution.residual[rows], _deleted(fit, TURNS, links[i])
        out.append(
            CalibrationTurn(
                before=data.numbers[i],
                after=data.numbers[i + 1],
                start=float(data.edges[i, 1] / data.rate),
                stop=float(data.edges[i + 1, 0] / data.rate),
                angle=angle,
                axis=_fixed(vector / angle if angle > 0 else vector),
                residual=_fixed(residual),
                misfit=turn_deletion.misfit,
                p=turn_deletion.p,
                outlier=turn_deletion.p < limit,
                used=i in links,
                why=data.dropped.get((i, i + 1), ""),
            )
        )
    return tuple(out)


# -- the rest -----------------------------------------------------------------------------------------------


def _scatter(fit: Adjustment) -> tuple[ObservationScatter, ...]:
    return tuple(
        ObservationScatter(
            what=_WHAT[name],
            unit=_UNITS[name],
            ratio=group.ratio,
            chi2=group.chi2,
            dof=group.dof,
            sd=fit.beyond.get(name, 0.0),
            sd_dof=fit.sizes.dof.get(name, 0.0),
            walk=fit.beyond.get(DRIFT.get(name, ""), 0.0),
            walk_dof=fit.sizes.dof.get(DRIFT.get(name, ""), 0.0),
        )
        for name, group in fit.pure.items()
    )


def _effect_of_gravity(about: Circumstances, fit: Adjustment) -> float | None:
    """The largest part of a gyro's bias for 1 g [rad/s]; None where gravity was not looked for in them."""
    if not fit.observed.triads[-1].follows_gravity:
        return None
    first = fit.observed.names.index(SENSITIVITY[0])
    return float(np.abs(fit.solution.state.values[first:]).max()) * about.gravity


def _range(values: Array | None) -> tuple[float, float] | None:
    return None if values is None else (float(values.min()), float(values.max()))


def _fixed(values: Array) -> Array:
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy
