# SPDX-License-Identifier: BSD-3-Clause
"""imu_err of gnss-ins-sim, as a Python module (deg/h, deg/sqrt(h), m/s^2, m/s/sqrt(h), s; numbers of three axes).

"stability" is the stationary standard deviation of a Gauss-Markov bias. It starts at zero and decays by 1 - dt/T, so
it is that process after some T, and to dt/T.
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

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "gnss_ins_sim"
FILE_NAME = "gnss_ins_sim_imu.py"
SUMMARY = "gnss-ins-sim: imu_err with angle random walk, bias stability and its correlation time, per axis"
TAKES = "study"
USAGE = Usage(
    programs=(Program("gnss-ins-sim", "Aceinna/gnss-ins-sim: gnss_ins_sim/pathgen/pathgen.py"),),
    slots=(
        Slot("gyro_arw", GYROSCOPE, N, "deg/sqrt(h)"),
        Slot("gyro_b_stability", GYROSCOPE, SIGMA, "deg/h"),
        Slot("gyro_b_corr", GYROSCOPE, TIME, "s"),
        Slot("accel_vrw", ACCELEROMETER, N, "m/s/sqrt(h)"),
        Slot("accel_b_stability", ACCELEROMETER, SIGMA, "m/s^2"),
        Slot("accel_b_corr", ACCELEROMETER, TIME, "s"),
    ),
    trap="b_stability is the standard deviation of the Gauss-Markov bias, not a floor of the Allan deviation",
)
CONSUMER = Consumer(
    name="gnss-ins-sim",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous: gnss-ins-sim makes the numbers discrete itself; its bias starts at zero",
        "b, the constant bias, is not a matter of noise: zero here",
    ),
    per_axis=True,
    simulator=True,
)
TERMS = CONSUMER.terms

#: The constant bias of each sensor, and its unit.
_CONSTANT = {GYROSCOPE: ("gyro_b", "deg/h"), ACCELEROMETER: ("accel_b", "m/s^2")}


def _template(imu: MarkovImu) -> list[str]:
    """A Python module with `imu_err`."""
    lines = [*imu.comment(), "", "import numpy as np", "", "imu_err = {"]
    for sensor, (key, unit) in _CONSTANT.items():
        constant = f'    "{key}": np.array({imu.row([0.0])}),  # {unit}'
        slots = [slot for slot in USAGE.slots if slot.sensor == sensor]
        lines += [constant] if sensor in imu.noise else []
        lines += imu.lines(
            slots, '    "{key}": np.array({row}),  # {unit}', '    # "{key}": np.array([]),  # {unit}'
        )
    return [*lines, "}"]


write = writer(_template, gauss_markov_imu, CONSUMER)
