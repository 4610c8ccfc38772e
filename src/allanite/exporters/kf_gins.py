# SPDX-License-Identifier: BSD-3-Clause
"""imunoise of KF-GINS (deg/sqrt(h), m/s/sqrt(h), deg/h, mGal; one correlation time in hours; names of its example).

Its biases are Gauss-Markov processes with the density 2 sigma^2/T, of one correlation time for both triads and their
scale factors. Their standard deviations are the initial ones as well, where initbgstd and initbastd are not given.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    MarkovImu,
    Slot,
    gauss_markov_imu,
    writer,
)

__all__ = ["FILE_NAME", "NAME", "SLOTS", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "kf_gins"
FILE_NAME = "kf_gins_imu.yaml"
SUMMARY = "KF-GINS: imunoise with arw, vrw, gbstd, abstd per axis and corrtime in hours"
TAKES = "study"
CONSUMER = Consumer(
    name="KF-GINS",
    file=FILE_NAME,
    convention=(
        "continuous: KF-GINS makes the numbers discrete itself",
        "gbstd, abstd: stationary standard deviation of the Gauss-Markov bias; its density is 2 sigma^2/corrtime",
        "they are the initial standard deviations as well, unless initbgstd and initbastd say otherwise",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms

#: In the order of the file.
SLOTS = (
    Slot("arw", GYROSCOPE, "noise", "deg/sqrt(h)"),
    Slot("vrw", ACCELEROMETER, "noise", "m/s/sqrt(h)"),
    Slot("gbstd", GYROSCOPE, "sigma", "deg/h"),
    Slot("abstd", ACCELEROMETER, "sigma", "mGal"),
)
_OPEN = (
    "# gsstd: [ , , ]  # ppm, scale factors of the gyroscopes, from the data sheet or a calibration",
    "# asstd: [ , , ]  # ppm, of the accelerometers",
)


def _template(imu: MarkovImu) -> list[str]:
    """imunoise, a part of the configuration file."""
    time = imu.common_time(FILE_NAME)
    return [
        *(*imu.comment(), "", "imunoise:"),
        *imu.lines(SLOTS, "  {key}: {row}  # {unit}", "  # {key}: [ , , ]  # {unit}, not in the study"),
        *(f"  {line}" for line in _OPEN),
        f"  corrtime: {imu.text(time / 3600)}  # h",
    ]


write = writer(_template, gauss_markov_imu, CONSUMER)
