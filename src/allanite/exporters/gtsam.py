# SPDX-License-Identifier: BSD-3-Clause
"""Covariances of GTSAM's PreintegrationCombinedParams, as a Python module (continuous densities, SI, squared).

PreintegrationParams, those of ImuFactor, have no noise of the bias: there the caller's BetweenFactorConstantBias holds
it, with a covariance that grows by walk^2 a second.

GTSAM divides the noise covariances by dt and multiplies them by Jacobians of size dt; to the bias it adds dt times
its covariance. So they are squares of root densities: gyroscopeCovariance = N^2 I [rad^2/s], biasOmegaCovariance =
walk^2 I [rad^2/s^3].
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    WALK,
    Consumer,
    N,
    Program,
    Slot,
    Usage,
    WalkImu,
    white_and_walk,
    writer,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "gtsam"
FILE_NAME = "gtsam_imu.py"
SUMMARY = "GTSAM: covariances of PreintegrationCombinedParams; sigmas of a bias between two ImuFactors; SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "GTSAM",
            "borglab/gtsam: gtsam/navigation/CombinedImuFactor.cpp, gtsam/navigation/ManifoldPreintegration.cpp",
        ),
    ),
    slots=(
        Slot("gyroscopeCovariance", GYROSCOPE, N.squared, "rad^2/s"),
        Slot("biasOmegaCovariance", GYROSCOPE, WALK.squared, "rad^2/s^3"),
        Slot("accelerometerCovariance", ACCELEROMETER, N.squared, "m^2/s^3"),
        Slot("biasAccCovariance", ACCELEROMETER, WALK.squared, "m^2/s^5"),
    ),
    trap="enter squares of densities: GTSAM divides them by dt, so neither N nor the variance of a sample is right",
)
CONSUMER = Consumer(
    name="GTSAM",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time covariances in SI: squares of two-sided root densities; GTSAM makes them discrete itself",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms

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
    lines = imu.lines(USAGE.slots, '    "{key}": {row},  # {unit}', '    # "{key}": [],  # {unit}')
    return [*imu.comment(), "", "COVARIANCES = {  # diagonals", *lines, "}", *_END.splitlines()]


write = writer(_template, white_and_walk, CONSUMER)
