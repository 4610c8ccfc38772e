# SPDX-License-Identifier: BSD-3-Clause
"""Files of imu_tk: D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to implement method for IMU calibration
without external equipments", ICRA 2014, eq. 9 and 10: x = T K (y - b), y the raw sample.

T has ones on its diagonal, K is diagonal, b is in the unit of y. A file of a triad is 21 numbers: T row by row, K row
by row, b. What follows them its reader does not look at; comments stand there. The covariance has no place in these
files and goes into a third one.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import __version__
from allanite.exporters.triads import notes_of, plain_line, propagated
from allanite.plain_files.json_values import plain
from allanite.recording.calibration import AXES, Calibration, TriadErrors

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "write"]

NAME = "imu_tk"
FILE_NAME = "imu_acc.calib, imu_gyro.calib, imu_covariance.json"
SUMMARY = "imu_tk: misalignment, scale and bias of each triad, with the covariance beside them"
TAKES = "calibration"

Json = Mapping[str, Any]
Array = NDArray[np.float64]

_FILES = {"accelerometer": "imu_acc.calib", "gyro": "imu_gyro.calib"}
_PAIRS = [(i, j) for i in range(3) for j in range(3) if i != j]


def write(document: Json) -> dict[str, str]:
    """The texts of the files, by their names.

    Parameters
    ----------
    document : dict
        A calibration's.
    """
    calibration = Calibration.from_json(document)
    texts = {_FILES[sensor]: _triad(calibration, sensor) for sensor in calibration.sensors}
    return {**texts, "imu_covariance.json": _covariance(calibration)}


def _parts(errors: TriadErrors) -> tuple[Array, Array, Array]:
    """T, K and b; each column of the inverse matrix is a column of T times an element of K."""
    inverse = np.linalg.inv(errors.matrix)
    scale = np.diag(inverse)
    return inverse / scale, np.diag(scale), errors.bias


def _triad(calibration: Calibration, sensor: str) -> str:
    unit = "m/s^2" if sensor == "accelerometer" else "rad/s"
    t, k, b = _parts(calibration.errors(sensor))
    _, covariance = propagated(calibration, lambda c: _row(c, sensor))
    names, sds = _names(sensor), np.sqrt(np.diag(covariance))
    known = [f"{name.partition('.')[2]} {sd:.2e}" for name, sd in zip(names, sds, strict=True)]
    channels = ", ".join(calibration.channels.get(sensor, ())) or "x, y, z"
    counted = calibration.units.get(sensor, "") or "the unit of its channels"
    comments = [
        f"{sensor} for imu_tk, written by allanite {__version__}",
        f"x = T K (y - b): y raw sample of {channels} in {counted}, x in {unit} along the axes of the body",
        "above: T row by row, K row by row, b",
        *notes_of(calibration),
        f"standard deviations: {', '.join(known)}; correlations: imu_covariance.json",
    ]
    return "\n".join(
        [*_rows(t), "", *_rows(k), "", *_rows(b[:, None]), "", *(f"# {plain_line(c)}" for c in comments), ""]
    )


def _rows(matrix: Array) -> list[str]:
    return [" ".join(f"{value:19.12e}" for value in row) for row in matrix + 0.0]  # no negative zeros


def _row(calibration: Calibration, sensor: str) -> Array:
    """All numbers of a triad that are not fixed: off the diagonal of T, the diagonal of K, b."""
    t, k, b = _parts(calibration.errors(sensor))
    return np.concatenate([[t[pair] for pair in _PAIRS], np.diag(k), b])


def _names(sensor: str) -> list[str]:
    off = [f"T_{AXES[i]}{AXES[j]}" for i, j in _PAIRS]
    return [f"{sensor}.{n}" for n in (*off, *(f"K_{a}" for a in AXES), *(f"b_{a}" for a in AXES))]


def _covariance(calibration: Calibration) -> str:
    sensors = calibration.sensors
    values, covariance = propagated(calibration, lambda c: np.concatenate([_row(c, s) for s in sensors]))
    content = {
        "format": "allanite-imu-tk-covariance",
        "version": 1,
        "allanite": __version__,
        "equation": "x = T K (y - b), y raw sample, x true vector in SI",
        "notes": notes_of(calibration),
        "names": [name for sensor in sensors for name in _names(sensor)],
        "values": plain(values),
        "covariance": plain(covariance),
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
