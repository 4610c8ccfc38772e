# SPDX-License-Identifier: BSD-3-Clause
"""A calibration in the parameters of other programs: triangular matrices, rotations, and what is known of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.plain_files.printable import printable
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration

__all__ = ["lower_and_rotation", "notes_of", "plain_line", "propagated", "upper_and_rotation"]

Array = NDArray[np.float64]

#: Of a parameter, for its derivative: biases in counts are large, misalignments small.
_STEP = 1e-6


def lower_and_rotation(matrix: Array) -> tuple[Array, Array]:
    """L and C of matrix = L C: L lower triangular with a positive diagonal, C a rotation.

    Raises
    ------
    InputError
        Axes that are left-handed, or in one plane.
    """
    q, r = np.linalg.qr(matrix.T)
    signs = np.sign(np.diag(r))
    if not np.linalg.det(matrix) > 0 or not signs.all():
        raise InputError(
            "the axes of a triad are not a right-handed set (one scale factor is negative, or axes are exchanged): "
            "name the channels in the order x, y, z, and turn the sign of the one that is reversed"
        )
    return np.asarray(r.T * signs), np.asarray((q * signs).T)


def upper_and_rotation(matrix: Array) -> tuple[Array, Array]:
    """U and C of matrix = U C: U upper triangular with a positive diagonal, C a rotation."""
    lower, turn = lower_and_rotation(matrix[::-1, ::-1])  # reversing the axes twice keeps the handedness
    return lower[::-1, ::-1], turn[::-1, ::-1]


def propagated(calibration: Calibration, values: Callable[[Calibration], Array]) -> tuple[Array, Array]:
    """Functions of the parameters, shape (m,), and their covariance, shape (m, m), linear in the uncertainties."""
    centre = values(calibration)
    steps = _STEP * np.maximum(np.abs(calibration.values), calibration.sd)
    steps[steps == 0] = _STEP
    slopes = np.empty((len(centre), len(steps)))
    for i, step in enumerate(steps):
        shift = np.zeros(len(steps))
        shift[i] = step
        up, down = (values(calibration.with_values(calibration.values + s * shift)) for s in (1, -1))
        slopes[:, i] = (up - down) / (2 * step)
    return centre, slopes @ calibration.covariance @ slopes.T


def notes_of(calibration: Calibration, *, gravity_sensitivity: bool = False) -> list[str]:
    """What a file without a place for it must say: its source, its frame, what is assumed, and what is left out.

    Parameters
    ----------
    gravity_sensitivity : bool
        The file has a place for that of the gyros.
    """
    where = calibration.source or "parameters in memory"
    dated = f", {calibration.date}" if calibration.date else ""
    axes = {
        "z": "z of the accelerometers is the z axis of the body, y lies in its plane of y and z",
        "x": "x of the accelerometers is the x axis of the body, y lies in its plane of x and y",
    }
    lines = [f"calibration of {where}{dated}", f"body: {axes[calibration.frame]}"]
    if calibration.gravity is not None:
        lines.append(f"accelerometers by {calibration.gravity:.6f} m/s^2")
    if calibration.temperature is not None:
        lines.append(f"biases at {calibration.temperature:g} of the temperature channel")
    assumed = [n for n, s in zip(calibration.names, calibration.status, strict=True) if s == "assumed"]
    if assumed:
        lines.append(f"NOT DETERMINED by the measurement, taken as nominal: {', '.join(assumed)}")
    return [*lines, *_left_out(calibration, gravity_sensitivity)]


def _left_out(calibration: Calibration, gravity_sensitivity: bool) -> list[str]:
    """Parts of equation (1) that the consumer cannot hold, with their size at a usual signal."""
    lines = []
    usual: Mapping[str, tuple[float, str]] = {
        ACCELEROMETER: (9.80665, "m/s^2 at 1 g"),
        GYRO: (1.0, "rad/s at 1 rad/s"),
    }
    for sensor in calibration.sensors:
        errors = calibration.errors(sensor)
        size, unit = usual[sensor]
        worst = float(np.abs(errors.quadratic).max()) * size**2
        if worst > 0:
            lines.append(
                f"{sensor}: quadratic terms have no place here and are LEFT OUT: up to {worst:.1e} {unit}"
            )
        pulled = float(np.abs(errors.gravity_sensitivity).max()) * usual[ACCELEROMETER][0]
        if pulled > 0 and not gravity_sensitivity:
            lines.append(
                f"{sensor}: its biases follow gravity, which has no place here and is LEFT OUT: up to {pulled:.1e} "
                f"{_per_g(calibration, sensor)}"
            )
        if errors.temperature.any():
            lines.append(f"{sensor}: slopes with temperature have no place here and are LEFT OUT")
    return lines


def _per_g(calibration: Calibration, sensor: str) -> str:
    return f"{calibration.units.get(sensor) or 'rad/s'} at 1 g"


def plain_line(text: str) -> str:
    """Text of a user on one line of ASCII: without control characters, which no YAML and no Python file may hold."""
    return printable(" ".join(text.split())).encode("ascii", "backslashreplace").decode("ascii")
