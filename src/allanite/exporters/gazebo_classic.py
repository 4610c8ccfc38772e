# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the IMU plug-in of Gazebo Classic, as elements of a model file (SI): RotorS, UUV simulator, older PX4.

The plug-in steps the bias as an exact first-order Gauss-Markov process: exp(-dt/T), and q^2 T/2 (1 - exp(-2 dt/T)). Its
"random walk" is the driving density q, not K. The sensors of today's Gazebo do not know these elements
(`allanite.exporters.gazebo`).
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    DRIVE,
    GYROSCOPE,
    SENSORS,
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
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "gazebo_classic"
FILE_NAME = "gazebo_classic_imu.xml"
SUMMARY = "Gazebo Classic: the IMU plug-in of RotorS, UUV simulator and PX4's older SITL, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "Gazebo Classic", "ethz-asl/rotors_simulator: rotors_gazebo_plugins/src/gazebo_imu_plugin.cpp"
        ),
    ),
    slots=tuple(
        slot
        for sensor in SENSORS
        for slot in (
            Slot(f"{sensor}NoiseDensity", sensor, N, UNITS[sensor][0]),
            Slot(f"{sensor}RandomWalk", sensor, DRIVE, UNITS[sensor][1]),
            Slot(f"{sensor}BiasCorrelationTime", sensor, TIME, "s"),
        )
    ),
    trap="RandomWalk drives a bias that decays with BiasCorrelationTime: over longer times it is no random walk",
)
CONSUMER = Consumer(
    name="the IMU plug-in of Gazebo Classic (RotorS, UUV simulator, PX4 SITL on Ubuntu 20.04 and earlier)",
    file=FILE_NAME,
    usage=USAGE,
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
    for sensor in imu.noise:
        slots = [slot for slot in USAGE.slots if slot.sensor == sensor]
        lines += imu.lines(slots, "<{key}>{value}</{key}>  <!-- {unit} -->")
        open_ = (
            f"{sensor}TurnOnBiasSigma, {_UNITS[sensor]}: spread between power-ups, not in a record of one run"
        )
        lines.append(f"<!-- {open_} -->")
    return lines


write = writer(_template, gauss_markov_imu, CONSUMER)
