# SPDX-License-Identifier: BSD-3-Clause
"""PredictionNoise of ROVIO, part of its info file (squares of continuous densities in SI, per axis).

Its filter multiplies the covariance of the prediction by dt: jacNoise holds the root of dt for velocity, attitude and
both biases (ImuPrediction.hpp). So vel is N^2 of the accelerometers and att that of the gyros, acb and gyb are the
squares of their walks.
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

NAME = "rovio"
FILE_NAME = "rovio_imu.info"
SUMMARY = "ROVIO: vel, att, acb, gyb of PredictionNoise, squares of continuous densities, per axis, SI"
TAKES = "study"
USAGE = Usage(
    programs=(Program("ROVIO", "ethz-asl/rovio: include/rovio/ImuPrediction.hpp"),),
    slots=(
        Slot("vel_", ACCELEROMETER, N.squared, "m^2/s^3", axes="012"),
        Slot("acb_", ACCELEROMETER, WALK.squared, "m^2/s^5", axes="012"),
        Slot("gyb_", GYROSCOPE, WALK.squared, "rad^2/s^3", axes="012"),
        Slot("att_", GYROSCOPE, N.squared, "rad^2/s", axes="012"),
    ),
    trap="squares of densities under the names of states: vel holds the accelerometer noise, att the gyroscope noise",
)
CONSUMER = Consumer(
    name="ROVIO",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time covariances in SI: squares of two-sided root densities; ROVIO makes them discrete itself",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu) -> list[str]:
    """A part of the info file, in place of these lines there."""
    lines = imu.lines(USAGE.slots, "        {key} {value}  ; {unit}", "        ; {key}  {unit}")
    return [
        *imu.comment(";"),
        *("", "Prediction", "{", "    PredictionNoise", "    {"),
        *lines,
        *("    }", "}"),
    ]


write = writer(_template, white_and_walk, CONSUMER)
