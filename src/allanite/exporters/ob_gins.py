# SPDX-License-Identifier: BSD-3-Clause
"""imumodel of OB_GINS (deg/sqrt(h), m/s/sqrt(h), deg/h, mGal; one correlation time in hours; names of its example).

As KF-GINS, with one number for three axes, and a decay of 1 - dt/T in a step.
"""

from __future__ import annotations

from allanite.exporters.imu import Consumer, MarkovImu, Program, Usage, gauss_markov_imu, writer
from allanite.exporters.kf_gins import CORRTIME, SIGMA_NOT_FLOOR, SLOTS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "ob_gins"
FILE_NAME = "ob_gins_imu.yaml"
SUMMARY = "OB_GINS: imumodel with arw, vrw, gbstd, abstd and corrtime in hours"
TAKES = "study"
USAGE = Usage(
    programs=(Program("OB_GINS", "i2Nav-WHU/OB_GINS: src/preintegration/preintegration_normal.cc"),),
    slots=(*SLOTS, CORRTIME),
    trap=SIGMA_NOT_FLOOR,
)
CONSUMER = Consumer(
    name="OB_GINS",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous: OB_GINS makes the numbers discrete itself, with a decay of 1 - dt/T in a step",
        "gbstd, abstd: stationary standard deviation of the Gauss-Markov bias; its density is 2 sigma^2/corrtime",
    ),
)
TERMS = CONSUMER.terms


def _template(imu: MarkovImu) -> list[str]:
    """imumodel, a part of the configuration file."""
    time = imu.common_time(FILE_NAME)
    return [
        *(*imu.comment(), "", "imumodel:"),
        *imu.lines(SLOTS, "    {key}: {value}  # {unit}", "    # {key}:  # {unit}, not in the study"),
        f"    {CORRTIME.key}: {imu.text(time / 3600)}  # h",
    ]


write = writer(_template, gauss_markov_imu, CONSUMER)
