# SPDX-License-Identifier: BSD-3-Clause
"""The IMU of a model of Gazebo (gz sim, once Ignition), as an element of SDF: http://sdformat.org/spec (noise, imu).

What PX4's SITL simulates with on Ubuntu 22.04 and later (``make px4_sitl gz_x500``). Each axis has a ``<noise>`` of its
own, which gz-sensors (GaussianNoiseModel) adds in every sample:

``stddev``
    Standard deviation of a sample: N sqrt(update_rate). It is not a density.
``dynamic_bias_stddev``, ``dynamic_bias_correlation_time``
    Driving density q = sigma sqrt(2/T) and T of a Gauss-Markov bias, whose step is exact: exp(-dt/T), and
    q^2 T/2 (1 - exp(-2 dt/T)). dt is the time between two samples.

The bias starts from ``bias_mean`` and ``bias_stddev``, and that start decays with T.
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
    rate_text,
    sample_writer,
)
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "gazebo"
FILE_NAME = "gazebo_imu.sdf"
SUMMARY = (
    "Gazebo (gz sim), PX4 SITL: imu sensor of SDF, noise of one sample and a Gauss-Markov bias, per axis, SI"
)
TAKES = "study"

#: Element of a triad, and unit of its samples.
_ELEMENTS = {GYROSCOPE: ("angular_velocity", "rad/s"), ACCELEROMETER: ("linear_acceleration", "m/s^2")}

USAGE = Usage(
    programs=(Program("Gazebo (gz sim), PX4 SITL", "gazebosim/gz-sensors: src/GaussianNoiseModel.cc"),),
    slots=tuple(
        slot
        for sensor in SENSORS
        for slot in (
            Slot("stddev", sensor, N.of_a_sample, _ELEMENTS[sensor][1]),
            Slot("dynamic_bias_stddev", sensor, DRIVE, UNITS[sensor][1]),
            Slot("dynamic_bias_correlation_time", sensor, TIME, "s"),
        )
    ),
    trap="a density in stddev makes the noise too small by sqrt(update_rate)",
)
CONSUMER = Consumer(
    name="Gazebo (gz sim; PX4 SITL on Ubuntu 22.04 and later)",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "not for the IMU plug-ins of Gazebo Classic: export gazebo-classic for those",
        "stddev = N sqrt(update_rate), of one sample",
        "1/update_rate must be a multiple of the step of the physics, or the rate will be another one",
        "dynamic_bias_stddev: continuous, driving density q = sigma sqrt(2/T) of the bias; the step is exact",
        "the bias starts at zero; bias_stddev, the spread between power-ups, is not in a record of one run",
    ),
    per_axis=True,
    simulator=True,
)
TERMS = CONSUMER.terms


def _template(imu: MarkovImu, rate: float) -> list[str]:
    """The sensor; it goes into a link of a model, in place of the imu sensor there."""
    # two hyphens would end an XML comment
    lines = ["<!--", *(line.replace("--", "- -") for line in imu.comments), "-->"]
    lines += ['<sensor name="imu_sensor" type="imu">', "  <always_on>true</always_on>"]
    lines += [f"  <update_rate>{rate_text(rate)}</update_rate>", "  <imu>"]
    for sensor, (element, _) in _ELEMENTS.items():
        if sensor not in imu.noise:
            lines.append(f"    <!-- {element}: not in the study: fill in, or it has no noise -->")
            continue
        slots = [(slot, imu.values(slot, rate)) for slot in USAGE.slots if slot.sensor == sensor]
        lines.append(f"    <{element}>")
        for i, axis in enumerate("xyz"):
            lines += [f"      <{axis}>", '        <noise type="gaussian">', "          <mean>0.0</mean>"]
            for slot, values in slots:
                value = imu.text(values[i if len(values) == 3 else 0])
                lines.append(f"          <{slot.key}>{value}</{slot.key}>  <!-- {slot.unit} -->")
            lines += ["        </noise>", f"      </{axis}>"]
        lines.append(f"    </{element}>")
    return [*lines, "  </imu>", "</sensor>"]


write = sample_writer(_template, gauss_markov_imu, CONSUMER)
