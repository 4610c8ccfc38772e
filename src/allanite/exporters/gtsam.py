# SPDX-License-Identifier: BSD-3-Clause
"""Covariances of GTSAM's PreintegrationCombinedParams, as a Python module (continuous densities, SI, squared).

PreintegrationParams, those of ImuFactor, have no noise of the bias: there the caller's BetweenFactorConstantBias holds
it, with a covariance that grows by walk^2 a second.

GTSAM divides the noise covariances by dt and multiplies them by Jacobians of size dt; to the bias it adds dt times
its covariance. So they are squares of root densities: gyroscopeCovariance = N^2 I [rad^2/s], biasOmegaCovariance =
walk^2 I [rad^2/s^3].
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, WalkImu, white_and_walk, writer

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "gtsam"
FILE_NAME = "gtsam_imu.py"
SUMMARY = "GTSAM: covariances of PreintegrationCombinedParams; sigmas of a bias between two ImuFactors; SI"
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
# not a number of a record at rest: integrationCovariance [m^2/s]


def apply(params):
    """Set what is above in a gtsam.PreintegrationCombinedParams, and return it.

    A gtsam.PreintegrationParams has no noise of the bias: it gets that of the samples alone, and bias_sigmas() is for
    the BetweenFactorConstantBias that goes with it.
    """
    for key, diagonal in COVARIANCES.items():
        setter = "set" + key[0].upper() + key[1:]
        if key.startswith("bias") and not hasattr(params, setter):
            continue
        getattr(params, setter)([[diagonal[i] if i == j else 0.0 for j in range(3)] for i in range(3)])
    return params


def bias_sigmas(seconds):
    """Standard deviations of the change of an imuBias.ConstantBias: accelerometer x, y, z, gyroscope x, y, z.

    For gtsam.noiseModel.Diagonal.Sigmas of the BetweenFactorConstantBias over this time.
    """
    diagonals = COVARIANCES["biasAccCovariance"] + COVARIANCES["biasOmegaCovariance"]
    return [(covariance * seconds) ** 0.5 for covariance in diagonals]
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
