# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the IMU plug-in of Gazebo Classic, as elements of a model file (SI): RotorS, UUV simulator, older PX4.

The plug-in steps the bias as an exact first-order Gauss-Markov process: exp(-dt/T), and q^2 T/2 (1 - exp(-2 dt/T)). Its
"random walk" is the driving density q, not K. The sensors of today's Gazebo do not know these elements
(`allanite.exporters.gazebo`).
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, MarkovImu, gauss_markov_imu, writer
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "gazebo_classic"
FILE_NAME = "gazebo_classic_imu.xml"
SUMMARY = "Gazebo Classic: the IMU plug-in of RotorS, UUV simulator and PX4's older SITL, continuous, SI"
TAKES = "study"
CONSUMER = Consumer(
    name="the IMU plug-in of Gazebo Classic (RotorS, UUV simulator, PX4 SITL on Ubuntu 20.04 and earlier)",
    file=FILE_NAME,
    convention=(
        "continuous-time root densities in SI units, two-sided; the plug-in makes them discrete itself",
        "RandomWalk: driving density q = sigma sqrt(2/T) of the Gauss-Markov bias, which its step keeps exactly",
    ),
    simulator=True,
)
TERMS = CONSUMER.terms

_UNITS = {GYROSCOPE: "rad/s", ACCELEROMETER: "m/s^2"}


def _template(imu: MarkovImu) -> list[str]:
    """The elements; they go into the plug-in's element of a model."""
    # two hyphens would end an XML comment
    lines = ["<!--", *(line.replace("--", "- -") for line in imu.comments), "-->"]
    for sensor in (GYROSCOPE, ACCELEROMETER):
        if sensor not in imu.noise:
            continue
        noise, walk = UNITS[sensor]
        for key, value, unit in (
            ("NoiseDensity", imu.noise[sensor][0], noise),
            ("RandomWalk", imu.density(sensor)[0], walk),
            ("BiasCorrelationTime", imu.time[sensor][0], "s"),
        ):
            lines.append(f"<{sensor}{key}>{imu.text(value)}</{sensor}{key}>  <!-- {unit} -->")
        open_ = (
            f"{sensor}TurnOnBiasSigma, {_UNITS[sensor]}: spread between power-ups, not in a record of one run"
        )
        lines.append(f"<!-- {open_} -->")
    return lines


write = writer(_template, gauss_markov_imu, CONSUMER)
