# SPDX-License-Identifier: BSD-3-Clause
"""From a recording of three gyros and three accelerometers to roll, pitch and heading."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, InputError
from allanite.experiments.alignment.case import TURNED, Case
from allanite.experiments.alignment.checks import AlignmentCheck
from allanite.experiments.alignment.coarse import coarse_of, naive_of
from allanite.experiments.alignment.directions import (
    Direction,
    StandAnswer,
    answers_of,
    excludes,
    length_of,
    running_of,
)
from allanite.experiments.alignment.frame import AlignmentSetting, UnitFrame, frame_of, unit_of
from allanite.experiments.alignment.geometry import angles_of_down
from allanite.experiments.alignment.judgement import CERTAIN, SMALL_BIAS, judge
from allanite.experiments.alignment.known import Sensors, bias_sds, knowledge_of, uncertain
from allanite.experiments.alignment.latitude import latitude_distance, measured_latitude
from allanite.experiments.alignment.questions import (
    gravity_of_stands,
    questions,
    scatter_of_stands,
    tilt_of_turns,
)
from allanite.experiments.alignment.results import (
    AlignmentEstimate,
    Bias,
    Mode,
    Stand,
    fixed,
)
from allanite.experiments.alignment.solution import AlignmentSolution, Knowledge, solve
from allanite.experiments.alignment.turns import calibrated
from allanite.experiments.alignment.verdict import AlignmentCheckKind
from allanite.experiments.north.circle import half_width, seen_from
from allanite.experiments.setup import setup_of
from allanite.experiments.static_spans import StaticSpans
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.distributions import student_quantile
from allanite.quantities.earth import EARTH_RATE, checked_latitude, normal_gravity
from allanite.quantities.quantity import Quantity
from allanite.quantities.residual_tests import alarm, grave, inflation_of
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration
from allanite.recording.records import BLOCK, Kind, Recording

__all__ = ["align"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Progress = Callable[[float, str], None]

#: Rate that is beyond the bias of any gyro [rad/s].
BEYOND_BIAS = math.radians(5.0)
#: Attitudes that differ by more are told apart by accelerometers of any kind [rad].
TOLD_APART = math.radians(10.0)
#: The biases turn what the record tells of them by this part of what was known, or less: it determines them.
SEPARABLE = 0.5
#: An axis shows the vertical rate from this part on of what the most upright one shows of it.
UPRIGHT = 0.1


def align(
    recording: Recording,
    *,
    latitude: float,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
    calibration: Calibration | None = None,
    height: float = 0.0,
    axes: str = "FLU",
    spans: StaticSpans | ArrayLike | None = None,
    headings: ArrayLike | None = None,
    rotation: bool | None = None,
    bias_repeatability: tuple[float | None, float | None] | None = None,
    stated: SetupUncertainty | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    confidence: float = 0.95,
    checkpoints: int = 100,
    progress: Progress | None = None,
) -> AlignmentEstimate:
    """Roll, pitch and heading of a unit from gravity and the Earth's rotation, with intervals.

    Parameters
    ----------
    recording : Recording
        Record of three gyros and three accelerometers.
    latitude : float [rad]
        Short of the poles, where heading is undefined.
    model : NoiseModel or mapping of str to NoiseModel, optional
        Noise models of the gyros at rest; or by channel, or by role: "gyro", "accelerometer". If none is given for a
        triad, its noise is estimated from the record, averaged over all models that the record allows.
    calibration : Calibration, optional
        Calibration with its covariance. Without it, scale factors and misalignments are nominal, accelerometer biases
        zero, and gyro biases unknown.
    height : float [m]
        Above the ellipsoid.
    axes : str
        Directions of x, y and z of the sensor: "FLU", "FRD", "RFU", ...
    spans : StaticSpans or array_like, shape (n, 2) [samples], optional
        Stretches at rest; found in the record by default.
    headings : array_like, shape (n,), optional [rad]
        Of the unit in each of these spans, clockwise from a common mark, where it was turned unseen by the gyros: in
        positions that were recorded one by one. Their standard uncertainty is `stated.heading`. NaN where nobody knows:
        no azimuth connects such a span to those before and after it.
    rotation : bool, optional
        The unit turned about one axis all the time. Found by default: so where it was nowhere at rest, or where what
        looks like rest is an even rate of more than 5 deg/s.
    bias_repeatability : (float or None, float or None), optional [rad/s], [m/s^2]
        Standard deviations of the biases of gyros and accelerometers from one power-on to the next, added to those of
        the calibration. Without either, the gyro biases are unknown.
    stated : SetupUncertainty, optional
        Standard uncertainties of the gyro scale factors (without a calibration by default those of the channels), the
        latitude, the leveling (tilt) and the mounting (heading).
    gyro, accelerometer : sequence of str, optional
        Channels x, y, z, where they do not follow from their kind.
    confidence : float
        Confidence level of the intervals.
    checkpoints : int
        Number of points of the running estimate.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    AlignmentEstimate

    Raises
    ------
    InputError
        A latitude at a pole, channels that are missing, spans that are not in the record, headings without spans.
    DataQualityError
        The unit was never at rest, and did not turn about one axis either.

    Notes
    -----
    What nobody knows of the gyros comes out with the heading: their biases are constants of the fit, known beforehand
    by the calibration or not at all. Turning tells them from the Earth. The interval of the heading holds the truth
    with the stated probability at every signal to noise (`allanite.experiments.north.circle`), if noise and calibration
    are what was said; excess scatter of the stands widens it.
    """
    checked_latitude(latitude)
    seen_from(confidence)  # refuses a confidence that makes no sense
    advance = progress or (lambda fraction, what: None)
    unit, other_channels = unit_of(recording, calibration, gyro, accelerometer)
    frame = frame_of(recording, unit, model, axes, latitude)
    nominal = calibration is None or GYRO not in calibration.sensors
    stated = setup_of(stated, (recording[name] for name in frame.gyro) if nominal else ())
    setting = AlignmentSetting(
        frame=frame,
        sensors=Sensors.of(calibration, bias_repeatability, stated),
        stated=stated,
        height=height,
        confidence=confidence,
        other_channels=other_channels,
    )
    advance(0.0, "looking for rest")
    rest_spans, why = _spans(recording, spans, frame)
    placed = _checked_headings(headings, spans, len(rest_spans))
    if spans is None or (isinstance(spans, StaticSpans) and spans.source == "detected"):
        still = _still(recording, rest_spans, frame, setting.sensors)
        rest_spans, placed = rest_spans[still], None if placed is None else placed[still]
    if rotation or (rotation is None and not len(rest_spans)):
        return _rotating(recording, setting, checkpoints, advance, why)
    if not len(rest_spans):
        raise DataQualityError(
            "the unit is nowhere at rest: give the stretches at rest (spans), or say that it turned all the time "
            f"(rotation){_because(why)}"
        )
    advance(0.3, "averaging")
    times = np.linspace(0, float(rest_spans[-1, 1]) / recording.rate, checkpoints + 1)[1:]
    known = None if placed is None else (placed, stated.heading)
    case = Case.of(recording, rest_spans, frame, setting.sensors, times, known)
    advance(0.7, "fitting the Earth's rotation")
    return _aligned(recording, case, setting, times)


def _checked_headings(headings: ArrayLike | None, spans: object, count: int) -> Array | None:
    """One heading for each span.

    Raises
    ------
    InputError
        More or fewer than spans, spans that were not given, or no numbers.
    """
    if headings is None:
        return None
    given = np.asarray(headings, dtype=np.float64)
    if spans is None or given.shape != (count,) or np.isinf(given).any():
        raise InputError(
            f"headings are one number for each of the spans at rest that are given, not {headings!r}"
        )
    return given


def _rotating(
    recording: Recording,
    setting: AlignmentSetting,
    checkpoints: int,
    advance: Progress,
    why: Sequence[str] = (),
) -> AlignmentEstimate:
    """A unit that turned all the time, or so it seems where no rest was found, and why not."""
    from allanite.experiments.alignment.rotation import align_rotating

    try:
        return align_rotating(recording, setting, checkpoints, advance)
    except DataQualityError as error:
        raise DataQualityError(f"{error}{_because(why)}") from None


def _because(why: Sequence[str]) -> str:
    return "".join(f"; {words}" for words in why)


def _still(recording: Recording, spans: Index, frame: UnitFrame, sensors: Sensors) -> NDArray[np.bool_]:
    """Stretches whose mean rate may be a bias: an even rotation has no spread, and looks like rest.

    What gyros show in several attitudes alike is their bias, however large.
    """
    if not len(spans):
        return np.zeros(0, dtype=np.bool_)
    means = []
    for sensor, channels in ((GYRO, frame.gyro), (ACCELEROMETER, frame.accelerometer)):
        errors = replace(
            sensors.calibration.errors(sensor), bias=np.zeros(3), gravity_sensitivity=np.zeros((3, 3))
        )
        parts = (calibrated(recording, channels, errors, a, min(b, a + BLOCK)) for a, b in spans.tolist())
        means.append(np.stack([np.nanmean(part, axis=0) for part in parts]))
    rate, force = means
    up = force / np.linalg.norm(force, axis=1, keepdims=True)
    turned = float(np.linalg.norm(up - up[0], axis=1).max()) > TOLD_APART
    common = np.median(rate, axis=0) if turned and len(rate) > 2 else np.zeros(3)
    return np.asarray(np.linalg.norm(rate - common, axis=1) <= BEYOND_BIAS)


def _spans(
    recording: Recording, spans: StaticSpans | ArrayLike | None, frame: UnitFrame
) -> tuple[Index, tuple[str, ...]]:
    """Stretches at rest [samples], sorted, and what there is to say of them.

    Raises
    ------
    InputError
        Not in the record, not in order.
    """
    if spans is None:
        from allanite.experiments.static_spans import find_static_spans

        models = frame.given_models
        spans = find_static_spans(
            recording,
            gyro=frame.gyro,
            accelerometer=frame.accelerometer,
            model=models if len(models) == 6 else None,
        )
    if isinstance(spans, StaticSpans):
        return spans.array, spans.findings
    edges = np.asarray(spans, dtype=np.int64).reshape(-1, 2)
    flat = edges.ravel()
    if len(flat) and (flat[0] < 0 or flat[-1] > recording.n_samples or (np.diff(flat) < 0).any()):
        raise InputError("spans must be pairs of samples (start, stop) in order, inside of the record")
    return edges[edges[:, 1] > edges[:, 0]], ()


# -- from a case to the estimate ---------------------------------------------------------------------------


def _aligned(recording: Recording, case: Case, setting: AlignmentSetting, times: Array) -> AlignmentEstimate:
    one = case.geometry.n_stands == 1
    fit = _fitted(case, setting)
    solution, confidence, inflation = fit.solution, setting.confidence, fit.inflation
    (first, last), direction = fit.ends, fit.last_direction
    alone = _any_vertical(case, setting, fit)
    latitude, latitude_sd, of_latitude = _latitude(case, setting, alone)
    bare = AlignmentEstimate(
        last=last.attitude,
        first=first.attitude,
        mode=_mode(one),
        confidence=confidence,
        inflation=inflation,
        horizontal=fixed(direction.vector),
        horizontal_covariance=fixed(direction.covariance),
        horizontal_length=Quantity.of(
            direction.length, length_of(direction, _reference(setting), confidence), "rad/s"
        ),
        expected_rate=EARTH_RATE * math.cos(setting.frame.latitude),
        signal_to_noise=direction.signal_to_noise,
        running=running_of(case, solution, last, times, confidence, inflation, setting.stated.heading),
        measured_latitude=latitude,
        latitude_sd=latitude_sd,
        biases=_biases(case, solution, fit.sensors, alone),
        budget=last.budget,
        apparent_rate=float(np.linalg.norm(_true_rate(case, solution, 0, bias=False))),
        apparent_bias=fit.bias,
        checks=(*of_latitude, *fit.checks),
        lost=case.lost,
        other_channels=setting.other_channels,
        stands=_stands(case, solution, case.extents()),
        spans=tuple((float(a), float(b)) for a, b in case.spans / recording.rate),
        **_facts(recording, case, setting),
    )
    bare = _beside(bare, recording, case, solution, setting)
    return judge(bare, excluded=fit.excluded, assumed=fit.assumed)


def _mode(one: bool) -> Mode:
    return "static" if one else "positions"


def _middle(extent: tuple[float, float, float]) -> float:
    return 0.5 * (extent[0] + extent[1])


def _reference(setting: AlignmentSetting) -> float:
    """Standard deviation of the Earth's horizontal rate by the latitude [rad/s]."""
    return EARTH_RATE * abs(math.sin(setting.frame.latitude)) * setting.stated.latitude


@dataclass(frozen=True, slots=True, kw_only=True)
class _FittedAlignment:
    """A fit with what was asked of it.

    Attributes
    ----------
    solution : AlignmentSolution
    sensors : Sensors
        As they were known, or taken to be known, in the fit.
    ends : pair of StandAnswer
        First stand and last.
    last_direction : Direction
        At the last, by what was said of the biases even where that is refuted.
    checks : tuple of AlignmentCheck
    inflation : float
    excluded : bool
        The horizontal rate is not that of the Earth, at `CERTAIN`.
    bias : float [rad/s]
        Of one attitude: root mean square of what length and vertical part differ from the Earth's by; NaN of several.
    assumed : bool
        The biases were taken to be as large as that.
    """

    solution: AlignmentSolution
    sensors: Sensors
    ends: tuple[StandAnswer, StandAnswer]
    last_direction: Direction
    checks: tuple[AlignmentCheck, ...]
    inflation: float
    excluded: bool
    bias: float = math.nan
    assumed: bool = False


def _fitted(case: Case, setting: AlignmentSetting) -> _FittedAlignment:
    """The fit. Of one attitude small biases are taken to be as large as they show, if nothing else is known of them."""
    if case.geometry.n_stands > 1:
        return _fitted_with(case, setting, setting.sensors)
    bias = _apparent_bias(case, setting)
    # two numbers tell the size of the third: Student's law with two degrees of freedom
    p = (1 + setting.confidence) / 2
    wide = student_quantile(p, 2) / half_width(setting.confidence)
    shown = setting.sensors.with_bias(wide * bias * setting.sensors.unit(GYRO))
    small = SMALL_BIAS * bias < EARTH_RATE * math.cos(setting.frame.latitude)
    if small and not setting.sensors.bias_known:
        return replace(_fitted_with(case, setting, shown), bias=bias, assumed=True)
    fit = _fitted_with(case, setting, setting.sensors)
    if small and (fit.excluded or grave(fit.checks)):
        # what was said of the biases is refuted, and so is an interval that rests on it
        refit = _fitted_with(case, setting, shown)
        fit = replace(fit, solution=refit.solution, sensors=shown, ends=refit.ends)
    return replace(fit, bias=bias)


def _fitted_with(case: Case, setting: AlignmentSetting, sensors: Sensors) -> _FittedAlignment:
    """Where gravity finds fault with the turns, these are known that much less."""
    turns, one = case.geometry.turns, case.geometry.n_stands == 1
    solution = _solve(case, setting, sensors, uncertain(turns, case.turn_noise))
    tilted, excess = tilt_of_turns(case, solution)
    if excess > 0:
        solution = _solve(case, setting, sensors, uncertain(turns, case.turn_noise, excess))
    asked = [
        *questions(case),
        *scatter_of_stands(case, solution, one),
        *gravity_of_stands(case, solution, setting),
    ]
    inflation = inflation_of(asked)
    extents = case.extents()
    ends = answers_of(
        solution,
        (_middle(extents[0]), _middle(extents[-1])),
        setting.confidence,
        inflation,
        setting.stated.heading,
    )
    expected = EARTH_RATE * math.cos(setting.frame.latitude)
    return _FittedAlignment(
        solution=solution,
        sensors=sensors,
        ends=ends,
        last_direction=ends[1].direction,
        checks=(*asked, *([tilted] if tilted else [])),
        inflation=inflation,
        excluded=excludes(ends[1].direction, _reference(setting), expected, CERTAIN),
    )


def _solve(
    case: Case,
    setting: AlignmentSetting,
    sensors: Sensors,
    turns: Array,
    *free: str,
    near: Array | None = None,
) -> AlignmentSolution:
    start, known = knowledge_of(
        case.geometry.layout, sensors, setting.frame.latitude, setting.stated, case.accelerometer.covariance, turns,
        *free,
    )  # fmt: skip
    return solve(case.geometry, known, case.gyro.level, case.gyro.covariance, start, near)


def _apparent_bias(case: Case, setting: AlignmentSetting) -> float:
    """Root mean square of what length and vertical part differ from the Earth's by [rad/s]."""
    held = setting.sensors.with_bias(0.0)
    turns = uncertain(case.geometry.turns, case.turn_noise)
    p = _solve(case, setting, held, turns, "vertical").parameters
    latitude = setting.frame.latitude
    apart = np.hypot(p[0], p[1]) - EARTH_RATE * math.cos(latitude), p[2] + EARTH_RATE * math.sin(latitude)
    return float(np.sqrt(np.mean(np.square(apart))))


def _any_vertical(case: Case, setting: AlignmentSetting, fit: _FittedAlignment) -> AlignmentSolution:
    """The fit without the latitude: the vertical rate is one more unknown."""
    turns = uncertain(case.geometry.turns, case.turn_noise)
    return _solve(case, setting, fit.sensors, turns, "vertical", near=fit.solution.parameters)


def _latitude(
    case: Case, setting: AlignmentSetting, alone: AlignmentSolution
) -> tuple[Quantity, float, list[AlignmentCheck]]:
    """The latitude that the rotation means, its standard deviation, and whether it is the one that was given.

    One attitude is asked already: what its vertical rate is off by. The scatter that widens the set is that of the fit
    without the latitude: a wrong one makes the stands scatter, and would hide itself.
    """
    one = case.geometry.n_stands == 1
    inflation = inflation_of([*questions(case), *scatter_of_stands(case, alone, one)])
    covariance = alone.covariance(alone.gradient(lambda p: p[..., :3])) * inflation**2
    rate = alone.parameters[:3]
    measured, sd = measured_latitude(rate, covariance, setting.confidence)
    if one or not measured.resolved:
        return measured, sd, []
    given = setting.frame.latitude
    test = alarm("latitude", latitude_distance(rate, covariance, given, setting.stated.latitude), 1)
    return (
        measured,
        sd,
        [AlignmentCheck.of(AlignmentCheckKind.LATITUDE, test, value=measured.value, given=given)],
    )


def _true_rate(case: Case, solution: AlignmentSolution, stand: int, *, bias: bool = True) -> Array:
    """Mean rate of a stand in the axes of the sensor, its bias removed, shape (3,)."""
    errors = case.geometry.errors(solution.parameters, GYRO)
    if not bias:
        errors = replace(errors, bias=np.zeros(3))
    force = case.geometry.chain(solution.parameters).force
    return errors.true(case.gyro.level[stand], force=force[stand])


def _biases(
    case: Case, solution: AlignmentSolution, sensors: Sensors, alone: AlignmentSolution
) -> dict[str, Bias]:
    """Of the gyros; `alone` is the fit that is not told the latitude, and shows which biases rest on it."""
    layout, p = case.geometry.layout, solution.parameters
    at = layout.index("gyro.bias_")
    sds, without = (
        np.sqrt(np.diag(fit.covariance(fit.gradient(lambda q: q[..., at])))) for fit in (solution, alone)
    )
    before = bias_sds(sensors) if solution.knowledge.free.size == 2 else np.full(3, np.inf)
    across = _per_unit(case, solution)
    upwards = _vertical_parts(case, solution)
    upright = np.abs(upwards) > UPRIGHT * np.abs(upwards).max()
    vertical = float(p[layout.index("vertical")][0])
    return {
        name: Bias(
            value=float(p[at[i]]) if math.isfinite(sds[i]) else math.nan,
            sd=float(sds[i]),
            before=float(before[i]),
            separable=bool(sds[i] < SEPARABLE * before[i]) if before[i] > 0 else False,
            per_unit=float(across[i]),
            by_latitude=bool(upright[i] and sds[i] < SEPARABLE * without[i]),
            vertical=vertical * float(upwards[i]),
        )
        for i, name in enumerate(case.frame.gyro)
    }


def _vertical_parts(case: Case, solution: AlignmentSolution) -> Array:
    """What each gyro shows of a vertical rate of one, mean of the attitudes, shape (3,)."""
    geometry, with_one, without = case.geometry, solution.parameters.copy(), solution.parameters.copy()
    at = geometry.layout.index("vertical")
    with_one[at], without[at] = EARTH_RATE, 0.0  # a step that rounding leaves alone
    shown = geometry.gyros(with_one) - geometry.gyros(without)
    return np.asarray(shown.reshape(-1, 3).mean(axis=0)) / EARTH_RATE


def _per_unit(case: Case, solution: AlignmentSolution) -> Array:
    """Heading at the end per unit of a bias of each axis, if the biases were held, shape (3,) [rad per unit]."""
    geometry, p = case.geometry, solution.parameters
    held = Knowledge(
        free=geometry.layout.index("north."), known=np.zeros(0, np.int64), factor=np.zeros((0, 0))
    )
    alone = solve(geometry, held, case.gyro.level, case.gyro.covariance, p, p)
    n = geometry.n_stands
    ones = np.zeros((3 * n, 3))
    for i in range(3):
        factor = np.linalg.cholesky(case.gyro.covariance[i])
        ones[i * n : (i + 1) * n, i] = np.linalg.solve(factor, np.ones(n))
    shift = -alone.inverse @ alone.rows.T @ ones
    (h1, h2), gradient = alone.answers[0][4:6], alone.answers[1][4:6]
    size = h1**2 + h2**2
    return np.asarray(np.array([h2, -h1]) @ gradient @ shift / size) if size > 0 else np.full(3, math.nan)


def _stands(
    case: Case, solution: AlignmentSolution, extents: Sequence[tuple[float, float, float]]
) -> tuple[Stand, ...]:
    geometry, p = case.geometry, solution.parameters
    unit = np.abs(np.diag(geometry.errors(p, GYRO).matrix))
    residual = (case.gyro.level - geometry.gyros(p)) / unit
    sds = np.sqrt(np.einsum("ikk->ki", case.gyro.covariance)) / unit
    chain = geometry.chain(p)
    out = []
    for k, (start, stop, rest) in enumerate(extents):
        roll, pitch = angles_of_down(chain.down[k])
        out.append(
            Stand(
                start=start, stop=stop, rest=rest, roll=float(roll), pitch=float(pitch),
                turned=float(chain.azimuth[k]), residual=fixed(residual[k]), sd=fixed(sds[k]),
            )
        )  # fmt: skip
    return tuple(out)


def _facts(recording: Recording, case: Case, setting: AlignmentSetting) -> dict[str, Any]:
    frame = setting.frame
    force = case.geometry.errors(case.geometry.begin, ACCELEROMETER).true(case.geometry.reading[0])
    in_si = setting.sensors.given or recording[frame.accelerometer[0]].kind is Kind.ACCELERATION
    calibration = setting.sensors.calibration
    return {
        "gravity": float(np.linalg.norm(force)) if in_si else math.nan,
        "expected_gravity": normal_gravity(frame.latitude, setting.height),
        "latitude": frame.latitude,
        "height": setting.height,
        "axes": frame.axes,
        "channels": {"gyro": frame.gyro, "accelerometer": frame.accelerometer},
        "models": frame.given_models,
        "calibrated": setting.sensors.given,
        "calibration_source": calibration.source,
        "duration": recording.duration,
        "source": recording.source,
    }


def _beside(
    bare: AlignmentEstimate,
    recording: Recording,
    case: Case,
    solution: AlignmentSolution,
    setting: AlignmentSetting,
) -> AlignmentEstimate:
    """With the coarse answers, and the naive mean of a unit that was not turned."""
    geometry, p, frame = case.geometry, solution.parameters, setting.frame
    force = geometry.errors(p, ACCELEROMETER).true(geometry.reading[0])
    rate = _true_rate(case, solution, 0)
    noise = float(np.sqrt(case.gyro.covariance[:, 0, 0].mean())) / setting.sensors.unit(GYRO)
    size = max(float(np.linalg.norm(rate)), noise)
    sds = max(bare.first.pitch_sd, 1e-6), noise / size
    bare = replace(bare, coarse=coarse_of(force, rate, sds, frame.latitude, frame.axes))
    if max((abs(s.turned) for s in bare.stands), default=0.0) > TURNED or len(bare.stands) > 1 or case.lost:
        return bare
    errors = geometry.errors(p, GYRO), geometry.errors(p, ACCELEROMETER)
    naive = naive_of(
        recording, (frame.gyro, frame.accelerometer), errors, case.spans, heading=bare.heading,
        interval=bare.interval, latitude=frame.latitude, axes=frame.axes,
    )  # fmt: skip
    return replace(bare, naive=naive)
