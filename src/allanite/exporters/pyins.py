# SPDX-License-Identifier: BSD-3-Clause
"""Arguments of pyins' EstimationModel (older: InertialSensorModel), as a Python module (root densities in SI).

`noise` is the root density of white noise, `bias_walk` that of the noise that is integrated into the bias. `bias_sd`,
the spread of the bias between power-ups, is not in a record of one run: the caller gives it, and pyins needs it for a
walk.
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
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "pyins"
FILE_NAME = "pyins_imu.py"
SUMMARY = "pyins: noise and bias_walk of EstimationModel, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(Program("pyins", "nmayorov/pyins: pyins/inertial_sensor.py"),),
    slots=tuple(
        Slot(key, sensor, formula, UNITS[sensor][i])
        for sensor in (GYROSCOPE, ACCELEROMETER)
        for i, (key, formula) in enumerate({"noise": N, "bias_walk": WALK}.items())
    ),
    trap="bias_walk needs a bias_sd above zero: without it there is no bias state",
)
CONSUMER = Consumer(
    name="pyins",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; pyins makes them discrete itself",
        "bias_sd, the spread between power-ups, is not in a record of one run: it is yours to give, above zero",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms

_NAMES = {GYROSCOPE: "gyro", ACCELEROMETER: "accel"}


def _template(imu: WalkImu) -> list[str]:
    """A Python module: a function for each triad, which gives keyword arguments."""
    lines = imu.comment()
    for sensor, name in _NAMES.items():
        if sensor not in imu.noise:
            continue
        slots = [slot for slot in USAGE.slots if slot.sensor == sensor]
        lines += [
            "",
            "",
            f"def {name}(bias_sd):",
            f'    """EstimationModel(**{name}(bias_sd)); bias_sd in {slots[0].unit.replace("/sqrt(Hz)", "")}."""',
            "    return {",
            '        "bias_sd": bias_sd,',
            *(f'        "{s.key}": {_numbers(imu, imu.values(s))},  # {s.unit}' for s in slots),
            "    }",
        ]
    return lines


def _numbers(imu: WalkImu, values: tuple[float, ...]) -> str:
    return imu.text(values[0]) if len(values) == 1 else imu.row(values)


write = writer(_template, white_and_walk, CONSUMER)
