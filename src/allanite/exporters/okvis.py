# SPDX-License-Identifier: BSD-3-Clause
"""imu_params of OKVIS (continuous densities in SI; names and comments of its own example files).

sigma_bg and sigma_ba are spreads of the bias between power-ups, which no record of one run can tell; they stay open.
So does tau, the time of the reversion of the accelerometer bias to its mean: its own examples say that it is not in
use.
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

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "okvis"
FILE_NAME = "okvis_imu.yaml"
SUMMARY = "OKVIS: imu_params with sigma_g_c, sigma_a_c, sigma_gw_c, sigma_aw_c, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program("OKVIS", "ethz-asl/okvis: okvis_ceres/src/ImuError.cpp"),
        Program("OKVIS2", "smartroboticslab/okvis2: okvis_ceres/src/ImuError.cpp"),
    ),
    slots=(
        Slot("sigma_g_c", GYROSCOPE, N, "rad/s/sqrt(Hz)"),
        Slot("sigma_a_c", ACCELEROMETER, N, "m/s^2/sqrt(Hz)"),
        Slot("sigma_gw_c", GYROSCOPE, WALK, "rad/s^2/sqrt(Hz)"),
        Slot("sigma_aw_c", ACCELEROMETER, WALK, "m/s^3/sqrt(Hz)"),
    ),
    trap="sigma_gw_c and sigma_aw_c are bias random walks; sigma_bg and sigma_ba are spreads at turn-on",
)
CONSUMER = Consumer(
    name="OKVIS",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; OKVIS makes them discrete itself",
        "OKVIS2 has the same keys in a section that it calls imu_parameters, with `use: true`",
    ),
)
TERMS = CONSUMER.terms

_OPEN = (
    "# sigma_bg:  # rad/s, spread of the bias between power-ups: not in a record of one run",
    "# sigma_ba:  # m/s^2, likewise",
    "# tau:  # s, reversion of the accelerometer bias; its example: 3600.0, not in use",
    "# g_max:  # rad/s, range of the gyroscopes, from the data sheet",
    "# a_max:  # m/s^2, range of the accelerometers, from the data sheet",
)


def _template(imu: WalkImu) -> list[str]:
    """imu_params, a part of the configuration file."""
    return [
        *("%YAML:1.0", "", *imu.comment(), "", "imu_params:"),
        *imu.lines(USAGE.slots, "    {key}: {value}  # {unit}", "    # {key}:  # {unit}"),
        f"    imu_rate: {imu.frequency}",
        *(f"    {line}" for line in _OPEN),
    ]


write = writer(_template, white_and_walk, CONSUMER)
