# SPDX-License-Identifier: BSD-3-Clause
"""imu_err of gnss-ins-sim, as a Python module (deg/h, deg/sqrt(h), m/s^2, m/s/sqrt(h), s; numbers of three axes).

"stability" is the stationary standard deviation of a Gauss-Markov bias. It starts at zero and decays by 1 - dt/T, so
it is that process after some T, and to dt/T.
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, MarkovImu, gauss_markov_imu, writer
from allanite.quantities.units import parse_unit

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "gnss_ins_sim"
FILE_NAME = "gnss_ins_sim_imu.py"
SUMMARY = "gnss-ins-sim: imu_err with angle random walk, bias stability and its correlation time, per axis"
TAKES = "study"
CONSUMER = Consumer(
    name="gnss-ins-sim",
    file=FILE_NAME,
    convention=(
        "continuous: gnss-ins-sim makes the numbers discrete itself; its bias starts at zero",
        "b_stability: stationary standard deviation sigma of the Gauss-Markov bias, not a floor of the Allan deviation",
        "b, the constant bias, is not a matter of noise: zero here",
    ),
    per_axis=True,
    simulator=True,
)
TERMS = CONSUMER.terms

#: Key of the random walk, units of N, and of the bias.
_KEYS = {
    GYROSCOPE: ("gyro", "arw", "deg/sqrt(h)", "deg/h"),
    ACCELEROMETER: ("accel", "vrw", "m/s/sqrt(h)", "m/s^2"),
}


def _template(imu: MarkovImu) -> list[str]:
    """A Python module with `imu_err`."""
    lines = [*imu.comment(), "", "import numpy as np", "", "imu_err = {"]
    for sensor, (name, walk, of_noise, of_bias) in _KEYS.items():
        if sensor not in imu.noise:
            open_ = ((walk, of_noise), ("b", of_bias), ("b_stability", of_bias), ("b_corr", "s"))
            lines += [f'    # "{name}_{key}": np.array([]),  # {u}' for key, u in open_]
            continue
        noise = [v / parse_unit(of_noise).factor for v in imu.noise[sensor]]
        sigma = [v / parse_unit(of_bias).factor for v in imu.sigma[sensor]]
        for key, values, u in (
            ("b", [0.0], of_bias),
            (walk, noise, of_noise),
            ("b_stability", sigma, of_bias),
            ("b_corr", imu.time[sensor], "s"),
        ):
            lines.append(f'    "{name}_{key}": np.array({imu.row(values)}),  # {u}')
    return [*lines, "}"]


write = writer(_template, gauss_markov_imu, CONSUMER)
