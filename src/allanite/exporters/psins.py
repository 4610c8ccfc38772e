# SPDX-License-Identifier: BSD-3-Clause
"""A call of PSINS' imuerrset, as a MATLAB script (deg/h, ug, deg/sqrt(h), ug/sqrt(Hz), s).

sqrtR0G with TauG is the standard deviation and the time of a Gauss-Markov bias; with TauG = inf sqrtR0G is a random
walk, in (deg/h)/sqrt(h) and ug/sqrt(h).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, MarkovOptions, gauss_markov_imu
from allanite.units import parse_unit

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
        "sqrtR0 with a finite Tau: stationary standard deviation; with Tau = inf: a random walk, per sqrt(h)",
        "eb, db, the constant biases, are not a matter of noise: zero here",
    ),
    simulator=True,
)
TERMS = CONSUMER.terms

#: Names in the call, and units of N, of the bias and of its walk.
_KEYS = {
    GYROSCOPE: ("eb", "web", "sqrtR0G", "TauG", "deg/√h", "deg/h", "deg/h/√h"),
    ACCELEROMETER: ("db", "wdb", "sqrtR0A", "TauA", "µg/√Hz", "µg", "µg/√h"),
}


def write(document: Mapping[str, Any], **options: Unpack[MarkovOptions]) -> str:
    """The text of a script with one call.

    Parameters
    ----------
    document : dict
        A study document.
    **options
        `MarkovOptions`; axes="rms" by default, as this is a simulator.

    Raises
    ------
    InputError
        What `gauss_markov_imu` refuses.
    """
    imu = gauss_markov_imu(document, CONSUMER, **options)
    lines = [*imu.comment("%"), ""]
    for sensor, (constant, white, bias, time, of_noise, of_bias, of_walk) in _KEYS.items():
        ascii_unit = {u: _ascii(u) for u in (of_noise, of_bias, of_walk)}
        lines.append(f"{constant} = {imu.text(0.0)};  % {ascii_unit[of_bias]}")
        if sensor not in imu.noise:
            lines += [f"{name} = [];  % not in the study: fill in" for name in (white, bias, time)]
            continue
        unit = of_walk if imu.walks else of_bias
        value = imu.density(sensor)[0] if imu.walks else imu.sigma[sensor][0]
        lines += [
            f"{white} = {imu.text(imu.noise[sensor][0] / parse_unit(of_noise).factor)};  % {ascii_unit[of_noise]}",
            f"{bias} = {imu.text(value / parse_unit(unit).factor)};  % {ascii_unit[unit]}",
            f"{time} = {'inf' if imu.walks else imu.text(imu.time[sensor][0])};  % s",
        ]
    lines.append("imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);")
    return "\n".join(lines) + "\n"


def _ascii(unit: str) -> str:
    return unit.replace("√Hz", "sqrt(Hz)").replace("√h", "sqrt(h)").replace("µ", "u")
