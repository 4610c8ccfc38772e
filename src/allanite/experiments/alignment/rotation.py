# SPDX-License-Identifier: BSD-3-Clause
"""A unit that turned about one axis all the time: the Earth's rotation is what the turning modulates.

The axis of rotation a is fixed in the unit and on the ground. In the plane across it, with the angle theta of the unit
by the integrated gyros, two directions p and q of the unit see

    p: w_1 cos(theta) + w_2 sin(theta) + constant,     q: w_2 cos(theta) - w_1 sin(theta) + constant,

w being the Earth's rotation across the axis. The constants hold the biases and the part of the turning that leaks in
by misalignment: they drop out. So does the constant part of the accelerometers, which is what turning at a constant
rate adds to them, wherever they sit; what the turning modulates in them is the tilt u of the axis. Of the Earth's
rotation along the axis the gyros say nothing, but that along the vertical is known from the latitude, and both agree
where

    w_3 = (Omega sin(latitude) - w_1 u_1 - w_2 u_2)/u_3.

A bias along the axis, or an error of scale, makes theta grow wrongly: w then seems to turn by kappa per second. The
middle of the record does not mind; the heading at its end is off by kappa times half the record, so that kappa is
fitted, and its error counted. The roll and pitch of the unit come from its accelerometers at the angle of that time;
there the constant parts count, centripetal acceleration too: r rate^2/g, 0.1 mrad for 10 cm at 6 deg/s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.alignment.checks import AlignmentCheck
from allanite.experiments.alignment.directions import (
    Direction,
    direction_of,
    excludes,
    length_of,
    packed,
)
from allanite.experiments.alignment.frame import AlignmentSetting
from allanite.experiments.alignment.judgement import CERTAIN, judge
from allanite.experiments.alignment.modulation import (
    DESIGN,
    ModulationFit,
    Outcome,
    columns_of,
    combined,
    fit_in,
    fit_of_record,
    joined,
)
from allanite.experiments.alignment.results import (
    UNSEEN_LATITUDE,
    AlignmentEstimate,
    LevelledAttitude,
    RunningHeading,
    fixed,
    largest_sd,
)
from allanite.experiments.alignment.spin import Spin, spin_of
from allanite.experiments.alignment.verdict import AlignmentCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.attitude import axes_matrix
from allanite.quantities.earth import EARTH_RATE, normal_gravity
from allanite.quantities.quantity import Quantity
from allanite.quantities.residual_tests import alarm, inflation_of, scatter_check, size_check
from allanite.recording.calibration import GYRO
from allanite.recording.records import Recording

__all__ = ["align_rotating"]

Array = NDArray[np.float64]

#: An axis of rotation so far from the vertical hides too much of the Earth's rotation [rad].
STEEPEST = math.radians(75.0)
#: Rotation rates that vary by more than this part are a column of their own.
VARIES = 1e-3


def align_rotating(
    recording: Recording, setting: AlignmentSetting, checkpoints: int, advance: Callable[[float, str], None]
) -> AlignmentEstimate:
    """The alignment of a unit that turned about one axis all the time.

    Raises
    ------
    DataQualityError
        No rotation about one axis, too little of it, or an axis that lies too flat.
    """
    advance(0.3, "averaging")
    spin = spin_of(recording, setting)
    advance(0.7, "fitting the Earth's rotation")
    whole = Rotating.of(spin, setting)
    outcome, errors = whole.outcome, whole.errors
    x = errors.split(errors.mean)
    _, up, _, _ = outcome.vectors(x)
    tilt = math.acos(min(abs(float(up[2])), 1.0))
    if tilt > STEEPEST:
        raise DataQualityError(
            f"the axis of rotation is tilted by {math.degrees(tilt):.0f} deg, and the Earth's rotation along it cannot "
            "be measured: there is no heading. Turn about an axis nearer to the vertical"
        )
    inflation = inflation_of(whole.checks)
    first = whole.attitude(0, setting, inflation)[0]
    attitude, direction, budget = whole.attitude(1, setting, inflation)
    reference = EARTH_RATE * abs(math.sin(setting.frame.latitude)) * setting.stated.latitude
    estimate = AlignmentEstimate(
        last=attitude,
        first=first,
        mode="rotation",
        confidence=setting.confidence,
        inflation=inflation,
        horizontal=fixed(direction.vector),
        horizontal_covariance=fixed(direction.covariance),
        horizontal_length=Quantity.of(
            direction.length, length_of(direction, reference, setting.confidence), "rad/s"
        ),
        expected_rate=EARTH_RATE * math.cos(setting.frame.latitude),
        signal_to_noise=direction.signal_to_noise,
        measured_latitude=UNSEEN_LATITUDE,
        latitude_sd=math.inf,
        gravity=outcome.gravity(x),
        expected_gravity=normal_gravity(setting.frame.latitude, setting.height),
        running=whole.running(direction, setting, checkpoints),
        budget=budget,
        checks=whole.checks,
        other_channels=setting.other_channels,
        revolutions=spin.revolutions,
        tilt=tilt,
        spans=(spin.span,),
        latitude=setting.frame.latitude,
        height=setting.height,
        axes=setting.frame.axes,
        channels={"gyro": setting.frame.gyro, "accelerometer": setting.frame.accelerometer},
        models=setting.frame.given_models,
        calibrated=setting.sensors.given,
        calibration_source=setting.sensors.calibration.source,
        duration=recording.duration,
        source=recording.source,
    )
    wrong = excludes(direction, reference, estimate.expected_rate, CERTAIN)
    return judge(estimate, excluded=wrong)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotating:
    """A rotation with its fits.

    Attributes
    ----------
    spin : Spin
    fits : list of ModulationFit
        Gyros along p and q.
    outcome : Outcome
    errors : Errors
    checks : tuple of AlignmentCheck
    """

    spin: Spin = field(repr=False)
    fits: list[ModulationFit] = field(repr=False)
    outcome: Outcome = field(repr=False)
    errors: Errors = field(repr=False)
    checks: tuple[AlignmentCheck, ...]

    @classmethod
    def of(cls, spin: Spin, setting: AlignmentSetting) -> Rotating:
        """Fit both triads."""
        fits, forces = _fits(spin, setting)
        values, covariance, weight, misfit = joined(fits)
        prior = _kappa_prior(spin, setting)
        errors = Errors.of(values, covariance, forces, prior, setting)
        outcome = _outcome(spin, setting, weight, values, covariance, prior)
        return cls(
            spin=spin,
            fits=fits,
            outcome=outcome,
            errors=errors,
            checks=_checks(fits, misfit, outcome, errors),
        )

    def attitude(
        self, end: int, setting: AlignmentSetting, inflation: float
    ) -> tuple[LevelledAttitude, Direction, dict[str, float]]:
        """At the beginning (0) or the end (1)."""
        spin, outcome, errors = self.spin, self.outcome, self.errors
        theta, away = spin.angle[end], spin.span[end] - spin.middle
        x = errors.split(errors.mean)
        axis = outcome.axis(x, theta, away)
        answer = outcome.answer(x, theta, away, axis)

        def smooth(parts: Mapping[str, Array]) -> Array:
            out = outcome.answer(parts, theta, away, axis)
            out[2] = answer[2] + math.remainder(out[2] - answer[2], math.tau)
            return out

        gradient = errors.gradient(smooth)
        covariance = gradient @ errors.covariance @ gradient.T * inflation**2
        more = setting.stated.heading
        direction = direction_of(answer[:2], covariance[:2, :2], setting.confidence, more)
        turned = np.array([answer[1], -answer[0]]) @ gradient[:2] / float(answer[:2] @ answer[:2])
        attitude = LevelledAttitude(
            time=spin.span[end],
            roll=float(answer[2]),
            pitch=float(answer[3]),
            roll_sd=math.sqrt(float(covariance[2, 2])) if axis == "forward" else math.inf,
            pitch_sd=math.sqrt(float(covariance[3, 3]))
            if axis == "forward"
            else self._lean(theta, inflation),
            heading=direction.heading,
            heading_sd=direction.sd,
            interval=direction.arc,
            heading_axis=axis,
        )
        return attitude, direction, _budget(turned, errors, inflation, more)

    def _lean(self, theta: float, inflation: float) -> float:
        """Standard deviation of the vertical where it is largest: of the pitch of a nose up or down [rad]."""
        gradient = self.errors.gradient(lambda x: self.outcome.sensor_up(x, theta))
        return inflation * largest_sd(gradient @ self.errors.covariance @ gradient.T)

    def running(self, direction: Direction, setting: AlignmentSetting, count: int) -> RunningHeading:
        """From constant and modulated columns alone; the growth of theta is that of the final fit."""
        spin, fits, outcome, errors = self.spin, self.fits, self.outcome, self.errors
        rows = np.unique(np.linspace(0, len(spin.time), count + 1)[1:].astype(np.int64))
        theta, away = spin.angle[1], spin.span[1] - spin.middle
        gradient = errors.gradient(lambda x: outcome.answer(x, theta, away)[:2])[:, :8] @ DESIGN[:, :2]
        final, final_covariance = _across(fits, len(spin.time))
        rest = direction.covariance - gradient @ final_covariance @ gradient.T
        out = []
        for row in rows.tolist():
            w, covariance = _across(fits, row)
            is_determined = bool(np.isfinite(covariance).all())
            moved = direction.vector + gradient @ (w - final)
            whole = gradient @ covariance @ gradient.T + rest if is_determined else covariance
            out.append(direction_of(moved, whole, setting.confidence, setting.stated.heading))
        return packed(spin.time[rows - 1] + 0.5 * spin.dt, [*out[:-1], direction])


def _fits(spin: Spin, setting: AlignmentSetting) -> tuple[list[ModulationFit], list[ModulationFit]]:
    """Gyros along p and q; accelerometers along p, q and a."""
    time = spin.time - spin.middle
    turning = spin.rate[:, 2] - np.nanmean(spin.rate[:, 2])
    varies = float(np.nanstd(turning)) > VARIES * abs(float(np.nanmean(np.abs(spin.rate[:, 2]))))
    cosine, sine = np.nan_to_num(spin.cosine), np.nan_to_num(spin.sine)
    table = columns_of(cosine, sine, time, np.nan_to_num(turning) if varies else None)
    gyro, acc = setting.frame.models
    return (
        [
            _fit(spin, table, spin.rate[:, k], gyro, np.abs(spin.basis[:, k]), f"{GYRO} {'pq'[k]}")
            for k in range(2)
        ],
        [
            _fit(
                spin,
                table[:, :3],
                spin.force[:, k],
                acc,
                np.abs(spin.basis[:, k]),
                f"accelerometer {'pqa'[k]}",
            )
            for k in range(3)
        ],
    )


def _fit(spin: Spin, table: Array, y: Array, models: Any, weights: Array, name: str) -> ModulationFit:
    given: list[NoiseModel] = [m for m in models if m is not None]
    if len(given) < len(models):
        return fit_of_record(table, y, spin.part, spin.dt, name)
    return fit_in(combined(given, weights), table, y, spin.part, spin.dt)


def _kappa_prior(spin: Spin, setting: AlignmentSetting) -> float:
    """Standard deviation of the rate along the axis beforehand [rad/s]; infinite without a calibration."""
    if not (setting.sensors.given and setting.sensors.bias_known):
        return math.inf
    calibration = setting.sensors.calibration
    base = calibration.errors(GYRO)
    rate = spin.basis[:, 2] * (spin.angle[1] - spin.angle[0]) / (spin.span[1] - spin.span[0])
    force = spin.basis @ np.nanmean(spin.force, axis=0)
    reading, slopes = base.seen(rate, force=force), np.zeros(len(calibration.names))
    for i, name in enumerate(calibration.names):
        if name.startswith(GYRO) and calibration.covariance[i, i] > 0:
            h = math.sqrt(float(calibration.covariance[i, i]))
            ends = []
            for side in (h, -h):
                values = calibration.values.copy()
                values[i] += side
                errors = calibration.with_values(values).errors(GYRO)
                ends.append(float(errors.true(reading, force=force) @ spin.basis[:, 2]))
            slopes[i] = (ends[0] - ends[1]) / (2 * h)
    return math.sqrt(max(float(slopes @ calibration.covariance @ slopes), 0.0))


def _outcome(
    spin: Spin, setting: AlignmentSetting, weight: Array, values: Array, covariance: Array, prior: float
) -> Outcome:
    w, spread = weight @ values, weight @ covariance @ weight.T
    across = np.array([0.0, 0.0, -w[1], w[0]]) / float(w[:2] @ w[:2])
    measured = float(across @ spread @ across)
    return Outcome(
        latitude=setting.frame.latitude,
        mounting=axes_matrix(setting.frame.axes),
        basis=spin.basis,
        weight=weight,
        drift=1.0 if math.isinf(prior) else prior**2 / (prior**2 + measured),
        along=spin.along,
        values=setting.sensors.values,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """All that is uncertain, and by how much: the argument of `Outcome`.

    Attributes
    ----------
    names : tuple of str
    sizes : tuple of int
    mean : ndarray, shape (n,)
    covariance : ndarray, shape (n, n)
    labels : tuple of str
        Source of the budget of each number.
    """

    names: tuple[str, ...]
    sizes: tuple[int, ...]
    mean: Array = field(repr=False)
    covariance: Array = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)

    @classmethod
    def of(
        cls,
        values: Array,
        covariance: Array,
        forces: list[ModulationFit],
        prior: float,
        setting: AlignmentSetting,
    ) -> Errors:
        """From fits, calibration and what was stated."""
        calibration, stated = setting.sensors.calibration, setting.stated
        force = np.zeros((9, 9))
        for k, fit in enumerate(forces):
            places = np.array([k, 3 + k, 6 + k])
            force[np.ix_(places, places)] = fit.covariance
        vertical = (EARTH_RATE * math.cos(setting.frame.latitude) * stated.latitude) ** 2
        parts: dict[str, tuple[Array, Array]] = {
            "gyro": (values, covariance),
            "force": (np.stack([f.value for f in forces], axis=1).ravel(), force),
            "kappa": (np.zeros(1), np.array([[0.0 if math.isinf(prior) else prior**2]])),
            "calibration": (calibration.values, calibration.covariance),
            "vertical": (np.zeros(1), np.array([[vertical]])),
            "tilt": (np.zeros(3), np.eye(3) * stated.tilt**2),
        }
        sizes = tuple(len(mean) for mean, _ in parts.values())
        whole, at = np.zeros((sum(sizes), sum(sizes))), 0
        for mean, part_covariance in parts.values():
            whole[at : at + len(mean), at : at + len(mean)] = part_covariance
            at += len(mean)
        labels = ["gyro noise"] * 8 + ["accelerometer noise"] * 9 + ["gyro bias"]
        for name in calibration.names:
            kind = "gyro scale and misalignment" if name.startswith(GYRO) else "accelerometer calibration"
            labels.append("gyro bias" if ".gravity_sensitivity_" in name else kind)
        return cls(
            names=tuple(parts),
            sizes=sizes,
            mean=np.concatenate([mean for mean, _ in parts.values()]),
            covariance=whole,
            labels=(*labels, "latitude", "tilt", "tilt", "tilt"),
        )

    def split(self, x: Array) -> Mapping[str, Array]:
        """By name."""
        return dict(zip(self.names, np.split(x, np.cumsum(self.sizes)[:-1]), strict=True))

    def gradient(self, call: Callable[[Mapping[str, Array]], Array]) -> Array:
        """Central differences by all uncertain numbers, shape (n, len(mean))."""
        sds = np.sqrt(np.diag(self.covariance))
        columns = []
        for i, h in enumerate(sds.tolist()):
            if h == 0:
                columns.append(np.zeros_like(call(self.split(self.mean))))
                continue
            ends = []
            for side in (0.1 * h, -0.1 * h):
                x = self.mean.copy()
                x[i] += side
                ends.append(call(self.split(x)))
            columns.append((ends[0] - ends[1]) / (0.2 * h))
        return np.stack(columns, axis=1)


def _checks(
    fits: list[ModulationFit], misfit: float, outcome: Outcome, errors: Errors
) -> tuple[AlignmentCheck, ...]:
    checks = []
    dof = sum(f.dof for f in fits)
    if dof > 0:
        size = size_check(sum(f.chi2 for f in fits), int(dof))
        checks.append(AlignmentCheck.of(AlignmentCheckKind.SIZE, size))
    checks.append(AlignmentCheck.of(AlignmentCheckKind.ACROSS, scatter_check("directions", misfit, 4)))
    gradient = errors.gradient(lambda x: np.array([outcome.vectors(x)[3]]))
    growth = outcome.vectors(errors.split(errors.mean))[3]
    variance = float((gradient @ errors.covariance @ gradient.T)[0, 0])
    if variance > 0:
        test = alarm("constancy", growth**2 / variance, 1)
        checks.append(AlignmentCheck.of(AlignmentCheckKind.CONSTANCY, test))
    return tuple(checks)


def _budget(turned: Array, errors: Errors, inflation: float, more: float) -> dict[str, float]:
    """Standard uncertainties of the heading by source [rad]."""
    labels, out = np.array(errors.labels), {}
    for name in dict.fromkeys(errors.labels):
        places = np.flatnonzero(labels == name)
        variance = float(turned[places] @ errors.covariance[np.ix_(places, places)] @ turned[places])
        if variance > 0:
            out[name] = inflation * math.sqrt(variance)
    if more:
        out["heading"] = more
    total = inflation * math.sqrt(float(turned @ errors.covariance @ turned))
    return {**out, "together": math.hypot(total, more)}


def _across(fits: list[ModulationFit], rows: int) -> tuple[Array, Array]:
    """w and its covariance from the first rows; infinite while it cannot be told."""
    products = np.zeros((4, 4))
    swap = (np.eye(2), np.array([[0.0, -1.0], [1.0, 0.0]]))
    for fit, turn in zip(fits, swap, strict=True):
        assert fit.white is not None  # noqa: S101 - for the type checker
        white = fit.white[:rows]
        free = np.column_stack([white[:, 1:3] @ turn.T, white[:, -1]])
        level = white[:, 0]
        size = float(level @ level)
        free = free - np.outer(level, level @ free) / size if size > 0 else free
        products[:3, :3] += free.T @ free
    values = np.linalg.eigvalsh(products[:2, :2])
    if not values[0] > 1e-9 * max(values[1], 1e-300):
        return np.zeros(2), np.full((2, 2), np.inf)
    covariance = np.asarray(np.linalg.inv(products[:2, :2]), dtype=np.float64)
    return covariance @ products[:2, 2], covariance
