# SPDX-License-Identifier: BSD-3-Clause
"""imunoise of KF-GINS (deg/sqrt(h), m/s/sqrt(h), deg/h, mGal; one correlation time in hours; names of its example).

Its biases are Gauss-Markov processes with the density 2 sigma^2/T, of one correlation time for both triads and their
scale factors. Their standard deviations are the initial ones as well, where initbgstd and initbastd are not given.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    SIGMA,
    TIME,
    Consumer,
    MarkovImu,
    N,
    Program,
    Slot,
    Usage,
    gauss_markov_imu,
    writer,
)

__all__ = [
    "CORRTIME",
    "FILE_NAME",
    "NAME",
    "SIGMA_NOT_FLOOR",
    "SLOTS",
    "SUMMARY",
    "TAKES",
    "TERMS",
    "USAGE",
    "write",
]

NAME = "kf_gins"
FILE_NAME = "kf_gins_imu.yaml"
SUMMARY = "KF-GINS: imunoise with arw, vrw, gbstd, abstd per axis and corrtime in hours"
TAKES = "study"
#: In the order of the file.
SLOTS = (
    Slot("arw", GYROSCOPE, N, "deg/sqrt(h)"),
    Slot("vrw", ACCELEROMETER, N, "m/s/sqrt(h)"),
    Slot("gbstd", GYROSCOPE, SIGMA, "deg/h"),
    Slot("abstd", ACCELEROMETER, SIGMA, "mGal"),
)
CORRTIME = Slot("corrtime", GYROSCOPE, TIME, "h")
#: What goes wrong in both programs.
SIGMA_NOT_FLOOR = (
    "gbstd and abstd are not the floor of the Allan deviation; corrtime is in HOURS, one for all"
)
USAGE = Usage(
    programs=(Program("KF-GINS", "i2Nav-WHU/KF-GINS: src/kf-gins/gi_engine.cpp"),),
    slots=(*SLOTS, CORRTIME),
    trap=SIGMA_NOT_FLOOR,
)
CONSUMER = Consumer(
    name="KF-GINS",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous: KF-GINS makes the numbers discrete itself",
        "gbstd, abstd: stationary standard deviation of the Gauss-Markov bias; its density is 2 sigma^2/corrtime",
        "they are the initial standard deviations as well, unless initbgstd and initbastd say otherwise",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms

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
        f"  {CORRTIME.key}: {imu.text(time / 3600)}  # h",
    ]


write = writer(_template, gauss_markov_imu, CONSUMER)
