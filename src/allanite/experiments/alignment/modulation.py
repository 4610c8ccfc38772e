# SPDX-License-Identifier: BSD-3-Clause
"""What turning modulates: the fit of one direction across the axis, and what follows from its coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, fields, replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.geometry import named_axis
from allanite.experiments.rate_vector.levels import LevelRows, levels_of_record
from allanite.filtering.regression import Whitener
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.calibration import ACCELEROMETER, GYRO, errors_of
from allanite.recording.records import Sampling

__all__ = [
    "DESIGN",
    "ModulationFit",
    "Outcome",
    "columns_of",
    "combined",
    "fit_in",
    "fit_of_record",
    "joined",
]

Array = NDArray[np.float64]

#: From w and its slope to the modulated coefficients of p, then q.
DESIGN = np.array(
    [
        [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.0],
    ]
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ModulationFit:
    """Coefficients of the columns in one direction."""

    value: Array
    covariance: Array = field(repr=False)
    chi2: float
    dof: float
    white: Array | None = field(default=None, repr=False)


def columns_of(cosine: Array, sine: Array, time: Array, spin: Array | None) -> Array:
    """Constant, the two modulated columns, these times time, and the change of the rotation rate, if there is any."""
    columns = [np.ones_like(cosine), cosine, sine, cosine * time, sine * time]
    return np.column_stack(columns if spin is None else [*columns, spin])


def combined(models: Sequence[NoiseModel], weights: Array) -> NoiseModel:
    """Noise of a sum of axes with these weights; the axes are independent."""
    if all(m == models[0] for m in models):
        return models[0]
    sizes = {"Q", "N", "B", "K", "R", "q", "amplitude"}
    terms = []
    for model, weight in zip(models, np.abs(weights).tolist(), strict=True):
        for term in model.terms if weight > 1e-6 else ():
            changed = {f.name: getattr(term, f.name) * weight for f in fields(term) if f.name in sizes}
            terms.append(replace(term, **changed))
    return NoiseModel(terms=tuple(terms), kind=models[0].kind, unit=models[0].unit)


def fit_in(
    model: NoiseModel, columns: Array, y: Array, part: Array, dt: float, sampling: Sampling = "mean"
) -> ModulationFit:
    """Generalised least squares of one direction."""
    used = np.isfinite(y)
    table = np.where(used[:, None], np.column_stack([columns, y]), 0.0)
    whitener = Whitener.of(model, dt=dt, counts=np.where(used, part, 0.0), sampling=sampling)
    white = np.nan_to_num(whitener(table)[0])
    k = columns.shape[1]
    products = white.T @ white
    covariance = np.asarray(np.linalg.inv(products[:k, :k]), dtype=np.float64)
    value = covariance @ products[:k, k]
    residual = white[:, k] - white[:, :k] @ value
    return ModulationFit(
        value=value,
        covariance=covariance,
        chi2=float(residual @ residual),
        dof=float(used.sum() - k),
        white=white,
    )


class _Harmonics(LevelRows):
    """Rows whose columns are those of the rotation."""

    table: Array

    def columns(self) -> Array:
        return self.table


def fit_of_record(columns: Array, y: Array, part: Array, dt: float, name: str) -> ModulationFit:
    """In the noise that the record shows; its rows are whitened as those of white noise of the same size."""
    used = np.isfinite(y)
    median = float(np.nanmedian(y))
    rows = _Harmonics(
        dt=dt,
        mean=(y - median)[:, None],
        part=np.where(used, part, 0.0)[:, None],
        pose=np.where(used, 0, -1),
    )
    object.__setattr__(rows, "table", columns)
    record_levels = levels_of_record(rows, 0, name)
    value = record_levels.level.copy()
    value[0] += median
    white_fit = fit_in(NoiseModel.of(White(N=1.0)), columns, y, part, dt)
    size = math.sqrt(
        float(np.trace(record_levels.covariance[1:3, 1:3]) / np.trace(white_fit.covariance[1:3, 1:3]))
    )
    assert white_fit.white is not None  # noqa: S101 - for the type checker
    return ModulationFit(
        value=value, covariance=record_levels.covariance, chi2=0.0, dof=0.0, white=white_fit.white / size
    )


def joined(fits: Sequence[ModulationFit]) -> tuple[Array, Array, Array, float]:
    """Modulated coefficients of p and q, their covariance, the weights that make w and its slope, and the misfit.

    Returns
    -------
    values : ndarray, shape (8,)
    covariance : ndarray, shape (8, 8)
    weight : ndarray, shape (4, 8)
    chi2 : float
        Of four degrees of freedom: do both directions say the same?
    """
    values = np.concatenate([f.value[1:5] for f in fits])
    covariance = np.zeros((8, 8))
    for k, f in enumerate(fits):
        covariance[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = f.covariance[1:5, 1:5]
    weighted = np.linalg.solve(covariance, DESIGN)
    weight = np.linalg.solve(DESIGN.T @ weighted, weighted.T)
    residual = values - DESIGN @ (weight @ values)
    return values, covariance, weight, float(residual @ np.linalg.solve(covariance, residual))


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What follows from coefficients; all of it is a smooth function of them.

    Attributes
    ----------
    latitude : float [rad]
    mounting : ndarray, shape (3, 3)
        Sensor to forward, right, down.
    basis : ndarray, shape (3, 3)
        Columns p, q, a.
    weight : ndarray, shape (4, 8)
        From the modulated coefficients to w and its slope.
    drift : float
        Weight of kappa by the record against kappa as known beforehand.
    along : float [rad/s]
        What the Earth was taken to turn along the axis.
    values : mapping of str to float
        Parameters of the calibration with which the record was read.

    Notes
    -----
    Coefficients come by name: "gyro" (8), modulated ones of p, then q; "force" (9), constant and modulated parts of
    the accelerometers along p, q, a; "kappa", error of the rate along the axis; "calibration"; "vertical", error of
    the vertical part of the Earth's rotation; "tilt" (3), error of the levelling.
    """

    latitude: float
    mounting: Array
    basis: Array
    weight: Array
    drift: float
    along: float
    values: Mapping[str, float] = field(repr=False)

    def vectors(self, x: Mapping[str, Array]) -> tuple[Array, Array, float, float]:
        """Earth and vertical in the frame of the axis, kappa, and the growth of w."""
        change = self._changed(x, GYRO)[:2, :2]
        modulated = ((x["gyro"].reshape(2, 4).T @ change.T).T - self._followed(x)).ravel()
        w1, w2, s1, s2 = self.weight @ modulated
        size = w1**2 + w2**2
        measured, growth = (w1 * s2 - w2 * s1) / size, (w1 * s1 + w2 * s2) / math.sqrt(size)
        up = self._up(x)
        vertical = EARTH_RATE * math.sin(self.latitude) + float(x["vertical"][0])
        w3 = (vertical - w1 * up[0] - w2 * up[1]) / up[2]
        known = w3 - self.along + float(x["kappa"][0])
        kappa = self.drift * measured + (1 - self.drift) * known
        return np.array([w1, w2, w3]), up, float(kappa), float(growth)

    def _changed(self, x: Mapping[str, Array], sensor: str) -> Array:
        """How calibrated vectors along p, q, a change with the parameters."""
        new, old = errors_of(self._parameters(x), sensor), errors_of(self.values, sensor)
        return np.asarray(self.basis.T @ np.linalg.inv(new.matrix) @ old.matrix @ self.basis)

    def _followed(self, x: Mapping[str, Array]) -> Array:
        """What gyros that follow gravity add to the coefficients of p and q with the parameters, shape (2, 4)."""
        new, old = errors_of(self._parameters(x), GYRO), errors_of(self.values, GYRO)
        more = np.linalg.inv(new.matrix) @ (new.gravity_sensitivity - old.gravity_sensitivity)
        force = x["force"].reshape(3, 3)[1:] @ (self.basis.T @ more @ self.basis)[:2].T
        return np.column_stack([force.T, np.zeros((2, 2))])

    def _parameters(self, x: Mapping[str, Array]) -> dict[str, float]:
        return dict(zip(self.values, x["calibration"].tolist(), strict=True))

    def _pull(self, x: Mapping[str, Array]) -> tuple[float, float, float, float]:
        """Length of the specific force, and its parts in the frame of the axis."""
        force = x["force"].reshape(3, 3) @ self._changed(x, ACCELEROMETER).T
        f1, f2, f3 = 0.5 * (force[1, 0] - force[2, 1]), 0.5 * (force[2, 0] + force[1, 1]), force[0, 2]
        return math.sqrt(f1**2 + f2**2 + f3**2), float(f1), float(f2), float(f3)

    def _up(self, x: Mapping[str, Array]) -> Array:
        """Upwards in the frame of the axis: its tilt is what the turning modulates."""
        size, *parts = self._pull(x)
        return np.array(parts) / size

    def sensor_up(self, x: Mapping[str, Array], theta: float) -> Array:
        """Upwards in the axes of the sensor at an angle theta."""
        old = errors_of(self.values, ACCELEROMETER)
        c, s = math.cos(theta), math.sin(theta)
        coefficients = x["force"].reshape(3, 3)
        reading = old.seen((coefficients[0] + c * coefficients[1] + s * coefficients[2]) @ self.basis.T)
        force = errors_of(self._parameters(x), ACCELEROMETER).true(reading)
        up = force / np.linalg.norm(force)
        return np.asarray(up + np.cross(x["tilt"], up))

    def gravity(self, x: Mapping[str, Array]) -> float:
        """Length of the specific force, without constants across the axis [m/s^2]."""
        return self._pull(x)[0]

    def axis(self, x: Mapping[str, Array], theta: float, away: float) -> str:
        """Whose heading is meant at an angle theta."""
        kappa = self.vectors(x)[2]
        return named_axis(-(self.mounting @ self.sensor_up(x, theta - kappa * away)))

    def answer(self, x: Mapping[str, Array], theta: float, away: float, axis: str = "") -> Array:
        """Horizontal rate along and right of the heading axis, roll, pitch; `away` [s] from the middle."""
        earth, up, kappa, _ = self.vectors(x)
        angle = theta - kappa * away
        down = -(self.mounting @ self.sensor_up(x, angle))
        axis = axis or named_axis(down)
        axis_direction = {"forward": (1.0, 0.0, 0.0), "down": (0.0, 0.0, 1.0), "up": (0.0, 0.0, -1.0)}[axis]
        c, s = math.cos(angle), math.sin(angle)
        in_unit = self.basis.T @ (self.mounting.T @ np.array(axis_direction))
        ahead = np.array([c * in_unit[0] - s * in_unit[1], s * in_unit[0] + c * in_unit[1], in_unit[2]])
        ahead = ahead - up * float(ahead @ up)
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(-up, ahead)
        return np.array(
            [
                earth @ ahead,
                earth @ right,
                math.atan2(down[1], down[2]),
                math.atan2(-down[0], math.hypot(down[1], down[2])),
            ]
        )
