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

import math
from collections.abc import Mapping
from typing import Any, Unpack

from allanite.errors import InputError
from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    MarkovImu,
    NoiseOptions,
    gauss_markov_imu,
    rate_text,
)
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "gazebo"
FILE_NAME = "gazebo_imu.sdf"
SUMMARY = (
    "Gazebo (gz sim), PX4 SITL: imu sensor of SDF, noise of one sample and a Gauss-Markov bias, per axis, SI"
)
TAKES = "study"
TERMS = ("N", "K")

Json = Mapping[str, Any]

#: Element of a triad, and unit of its samples.
_ELEMENTS = {GYROSCOPE: ("angular_velocity", "rad/s"), ACCELEROMETER: ("linear_acceleration", "m/s^2")}


def write(document: Json, *, filter_rate: float | None = None, **options: Unpack[NoiseOptions]) -> str:
    """The text of the sensor; it goes into a link of a model, in place of the imu sensor there.

    Parameters
    ----------
    document : dict
        A study document.
    filter_rate : float, optional [Hz]
        Rate of the simulated sensor (update_rate); that of the study by default.
    **options
        `NoiseOptions`; axes="rms" by default, as this is a simulator.

    Raises
    ------
    InputError
        A rate that is not a positive number, or what `gauss_markov_imu` refuses.
    """
    rate = document["recording"]["rate"] if filter_rate is None else filter_rate
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"filter_rate must be a positive number of samples per second, not {rate!r}")
    consumer = Consumer(
        name="Gazebo (gz sim; PX4 SITL on Ubuntu 22.04 and later)",
        file=FILE_NAME,
        convention=(
            "not for the IMU plug-ins of Gazebo Classic: export gazebo-classic for those",
            f"stddev: DISCRETE, N sqrt(update_rate), of a sample at {rate_text(rate)} Hz; export again for another",
            "1/update_rate must be a multiple of the step of the physics, or the rate will be another one",
            "dynamic_bias_stddev: continuous, driving density q = sigma sqrt(2/T) of the bias; the step is exact",
            "the bias starts at zero; bias_stddev, the spread between power-ups, is not in a record of one run",
        ),
        per_axis=True,
        simulator=True,
    )
    imu = gauss_markov_imu(document, consumer, **options)
    return "\n".join(_sensor(imu, rate)) + "\n"


def _sensor(imu: MarkovImu, rate: float) -> list[str]:
    # two hyphens would end an XML comment
    lines = ["<!--", *(line.replace("--", "- -") for line in imu.comments), "-->"]
    lines += ['<sensor name="imu_sensor" type="imu">', "  <always_on>true</always_on>"]
    lines += [f"  <update_rate>{rate_text(rate)}</update_rate>", "  <imu>"]
    for sensor, (element, unit) in _ELEMENTS.items():
        if sensor not in imu.noise:
            lines.append(f"    <!-- {element}: not in the study: fill in, or it has no noise -->")
            continue
        lines.append(f"    <{element}>")
        for i, axis in enumerate("xyz"):
            lines += [f"      <{axis}>", '        <noise type="gaussian">', "          <mean>0.0</mean>"]
            for key, values, of in (
                ("stddev", [v * math.sqrt(rate) for v in imu.noise[sensor]], unit),
                ("dynamic_bias_stddev", imu.density(sensor), UNITS[sensor][1]),
                ("dynamic_bias_correlation_time", imu.time[sensor], "s"),
            ):
                value = imu.text(values[i if len(values) == 3 else 0])
                lines.append(f"          <{key}>{value}</{key}>  <!-- {of} -->")
            lines += ["        </noise>", f"      </{axis}>"]
        lines.append(f"    </{element}>")
    return [*lines, "  </imu>", "</sensor>"]
