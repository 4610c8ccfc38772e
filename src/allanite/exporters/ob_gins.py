# SPDX-License-Identifier: BSD-3-Clause
"""imumodel of OB_GINS (deg/sqrt(h), m/s/sqrt(h), deg/h, mGal; one correlation time in hours; names of its example).

As KF-GINS, with one number for three axes, and a decay of 1 - dt/T in a step.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu import SENSORS, Consumer, MarkovOptions, common_time, gauss_markov_imu
from allanite.exporters.kf_gins import KEYS
from allanite.units import parse_unit

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "ob_gins"
FILE_NAME = "ob_gins_imu.yaml"
SUMMARY = "OB_GINS: imumodel with arw, vrw, gbstd, abstd and corrtime in hours"
TAKES = "study"
CONSUMER = Consumer(
    name="OB_GINS",
    file=FILE_NAME,
    convention=(
        "continuous: OB_GINS makes the numbers discrete itself, with a decay of 1 - dt/T in a step",
        "gbstd, abstd: stationary standard deviation of the Gauss-Markov bias; its density is 2 sigma^2/corrtime",
    ),
)
TERMS = CONSUMER.terms


def write(document: Mapping[str, Any], **options: Unpack[MarkovOptions]) -> str:
    """The text of imumodel, a part of the configuration file.

    Parameters
    ----------
    document : dict
        A study document.
    **options
        `MarkovOptions`.

    Raises
    ------
    InputError
        Several correlation times, or what `gauss_markov_imu` refuses.
    """
    imu = gauss_markov_imu(document, CONSUMER, **options)
    time = common_time(imu, FILE_NAME, SENSORS)
    lines = [*imu.comment(), "", "imumodel:"]
    for key, sensor, what, of in KEYS:
        unit = of.replace("√h", "sqrt(h)")
        if sensor not in imu.noise:
            lines.append(f"    # {key}:  # {unit}, not in the study")
            continue
        value = (imu.noise if what == "noise" else imu.sigma)[sensor][0]
        lines.append(f"    {key}: {imu.text(value / parse_unit(of).factor)}  # {unit}")
    lines.append(f"    corrtime: {imu.text(time / 3600)}  # h")
    return "\n".join(lines) + "\n"
