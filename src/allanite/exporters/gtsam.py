# SPDX-License-Identifier: BSD-3-Clause
"""Covariances of GTSAM's PreintegrationCombinedParams, as a Python module (continuous densities, SI, squared).

GTSAM divides the noise covariances by dt and multiplies them by Jacobians of size dt; to the bias it adds dt times
its covariance. So they are squares of root densities: gyroscopeCovariance = N^2 I [rad^2/s], biasOmegaCovariance =
walk^2 I [rad^2/s^3].
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, WalkImu, white_and_walk, writer

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "gtsam"
FILE_NAME = "gtsam_imu.py"
SUMMARY = "GTSAM: covariances of PreintegrationParams and PreintegrationCombinedParams, continuous, SI"
TAKES = "study"
CONSUMER = Consumer(
    name="GTSAM",
    file=FILE_NAME,
    convention=(
        "continuous-time covariances in SI: squares of two-sided root densities; GTSAM makes them discrete itself",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms

_KEYS = {
    GYROSCOPE: ("gyroscopeCovariance", "biasOmegaCovariance", "rad^2/s", "rad^2/s^3"),
    ACCELEROMETER: ("accelerometerCovariance", "biasAccCovariance", "m^2/s^3", "m^2/s^5"),
}
_END = '''
# not numbers of a record at rest: integrationCovariance [m^2/s], and biasAccOmegaInt, the prior of the biases


def apply(params):
    """Set what is above in a gtsam.PreintegrationCombinedParams; give it back."""
    for key, diagonal in COVARIANCES.items():
        matrix = [[diagonal[i] if i == j else 0.0 for j in range(3)] for i in range(3)]
        getattr(params, "set" + key[0].upper() + key[1:])(matrix)
    return params
'''


def _template(imu: WalkImu) -> list[str]:
    """A Python module: the diagonals of the covariances, and a function that sets them."""
    lines = [*imu.comment(), "", "COVARIANCES = {  # diagonals"]
    for sensor, (noise, walk, of_noise, of_walk) in _KEYS.items():
        if sensor not in imu.noise:
            lines += [f'    # "{noise}": [],  # {of_noise}', f'    # "{walk}": [],  # {of_walk}']
            continue
        for key, values, unit in ((noise, imu.noise, of_noise), (walk, imu.walk, of_walk)):
            lines.append(f'    "{key}": {imu.row([v * v for v in values[sensor]])},  # {unit}')
    return [*lines, "}", *_END.splitlines()]


write = writer(_template, white_and_walk, CONSUMER)
