# SPDX-License-Identifier: BSD-3-Clause
"""imu_params of OKVIS (continuous densities in SI; names and comments of its own example files).

sigma_bg and sigma_ba are spreads of the bias between power-ups, which no record of one run can tell; they stay open.
So does tau, the time of the reversion of the accelerometer bias to its mean: its own examples say that it is not in
use.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, NoiseOptions, rate_text, white_and_walk
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "okvis"
FILE_NAME = "okvis_imu.yaml"
SUMMARY = "OKVIS: imu_params with sigma_g_c, sigma_a_c, sigma_gw_c, sigma_aw_c, continuous, SI"
TAKES = "study"
CONSUMER = Consumer(
    name="OKVIS",
    file=FILE_NAME,
    convention=("continuous-time root densities in SI units, two-sided; OKVIS makes them discrete itself",),
)
TERMS = CONSUMER.terms

_KEYS = {GYROSCOPE: ("sigma_g_c", "sigma_gw_c"), ACCELEROMETER: ("sigma_a_c", "sigma_aw_c")}
_OPEN = (
    "# sigma_bg:  # rad/s, spread of the bias between power-ups: not in a record of one run",
    "# sigma_ba:  # m/s^2, likewise",
    "# tau:  # s, reversion of the accelerometer bias; its example: 3600.0, not in use",
    "# g_max:  # rad/s, range of the gyroscopes, from the data sheet",
    "# a_max:  # m/s^2, range of the accelerometers, from the data sheet",
)


def write(document: Mapping[str, Any], **options: Unpack[NoiseOptions]) -> str:
    """The text of imu_params, a part of the configuration file.

    Parameters
    ----------
    document : dict
        A study document.
    **options
        `NoiseOptions`.

    Raises
    ------
    InputError
        What `white_and_walk` refuses.
    """
    imu = white_and_walk(document, CONSUMER, **options)
    lines = ["%YAML:1.0", "", *imu.comment(), "", "imu_params:"]
    for place, values in enumerate((imu.noise, imu.walk)):
        for sensor, keys in _KEYS.items():
            unit = UNITS[sensor][place]
            if sensor in values:
                lines.append(f"    {keys[place]}: {imu.text(values[sensor][0])}  # {unit}")
            else:
                lines.append(f"    # {keys[place]}:  # {unit}")
    lines.append(f"    imu_rate: {rate_text(imu.rate)}")
    return "\n".join([*lines, *(f"    {line}" for line in _OPEN)]) + "\n"
