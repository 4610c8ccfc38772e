# SPDX-License-Identifier: BSD-3-Clause
"""A call of PSINS' imuerrset, as a MATLAB script (deg/h, ug, deg/sqrt(h), ug/sqrt(Hz), s).

sqrtR0G with TauG is the standard deviation and the time of a Gauss-Markov bias; with TauG = inf sqrtR0G is a random
walk, in (deg/h)/sqrt(h) and ug/sqrt(h).
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    MarkovImu,
    Remark,
    gauss_markov_imu,
    writer,
)
from allanite.quantities.units import parse_unit

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "psins"
FILE_NAME = "psins_imuerr.m"
SUMMARY = "PSINS: imuerrset with web, wdb and either a Gauss-Markov bias or a random walk (TauG = inf)"
TAKES = "study"
CONSUMER = Consumer(
    name="PSINS",
    file=FILE_NAME,
    convention=(
        "continuous: PSINS makes the numbers discrete itself",
        Remark("sqrtR0: stationary standard deviation of the bias, Tau its time", "N", unless="walk"),
        Remark("sqrtR0 with Tau = inf: the random walk of the bias, per sqrt(h)", "walk"),
        "eb, db, the constant biases, are not a matter of noise: zero here",
    ),
    simulator=True,
    holds_walk=True,
)
TERMS = CONSUMER.terms

#: Names in the call, and units of N, of the bias and of its walk.
_KEYS = {
    GYROSCOPE: ("eb", "web", "sqrtR0G", "TauG", "deg/sqrt(h)", "deg/h", "deg/h/sqrt(h)"),
    ACCELEROMETER: ("db", "wdb", "sqrtR0A", "TauA", "ug/sqrt(Hz)", "ug", "ug/sqrt(h)"),
}


def _template(imu: MarkovImu) -> list[str]:
    """A script with one call."""
    lines = [*imu.comment("%"), ""]
    for sensor, (constant, white, bias, time, of_noise, of_bias, of_walk) in _KEYS.items():
        lines.append(f"{constant} = {imu.text(0.0)};  % {of_bias}")
        if sensor not in imu.noise:
            lines += [f"{name} = [];  % not in the study: fill in" for name in (white, bias, time)]
            continue
        unit = of_walk if imu.walks else of_bias
        value = imu.density(sensor)[0] if imu.walks else imu.sigma[sensor][0]
        lines += [
            f"{white} = {imu.text(imu.noise[sensor][0] / parse_unit(of_noise).factor)};  % {of_noise}",
            f"{bias} = {imu.text(value / parse_unit(unit).factor)};  % {unit}",
            f"{time} = {'inf' if imu.walks else imu.text(imu.time[sensor][0])};  % s",
        ]
    lines.append("imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);")
    return lines


write = writer(_template, gauss_markov_imu, CONSUMER)
