# SPDX-License-Identifier: BSD-3-Clause
"""A call of PSINS' imuerrset, as a MATLAB script (deg/h, ug, deg/sqrt(h), ug/sqrt(Hz), s).

sqrtR0G with TauG is the standard deviation and the time of a Gauss-Markov bias; with TauG = inf sqrtR0G is a random
walk, in (deg/h)/sqrt(h) and ug/sqrt(h).
"""

from __future__ import annotations

from dataclasses import replace

from allanite.exporters.imu import (
    ACCELEROMETER,
    DRIVE,
    GYROSCOPE,
    SIGMA,
    TIME,
    Consumer,
    MarkovImu,
    N,
    Program,
    Remark,
    Slot,
    Usage,
    gauss_markov_imu,
    writer,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "psins"
FILE_NAME = "psins_imuerr.m"
SUMMARY = "PSINS: imuerrset with web, wdb and either a Gauss-Markov bias or a random walk (TauG = inf)"
TAKES = "study"
USAGE = Usage(
    programs=(Program("PSINS", "PSINS toolbox: imuerrset.m, imuadderr.m"),),
    slots=(
        Slot("web", GYROSCOPE, N, "deg/sqrt(h)"),
        Slot("sqrtR0G", GYROSCOPE, SIGMA, "deg/h"),
        Slot("TauG", GYROSCOPE, TIME, "s"),
        Slot("wdb", ACCELEROMETER, N, "ug/sqrt(Hz)"),
        Slot("sqrtR0A", ACCELEROMETER, SIGMA, "ug"),
        Slot("TauA", ACCELEROMETER, TIME, "s"),
    ),
    trap="sqrtR0 is a standard deviation if Tau is finite, and a random walk per sqrt(h) if Tau is infinite",
)
CONSUMER = Consumer(
    name="PSINS",
    file=FILE_NAME,
    usage=USAGE,
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

#: The constant bias of each sensor, its unit, and that of the walk of the bias.
_CONSTANT = {GYROSCOPE: ("eb", "deg/h", "deg/h/sqrt(h)"), ACCELEROMETER: ("db", "ug", "ug/sqrt(h)")}


def _template(imu: MarkovImu) -> list[str]:
    """A script with one call."""
    lines = [*imu.comment("%"), ""]
    for sensor, (constant, unit, of_walk) in _CONSTANT.items():
        slots = [slot for slot in USAGE.slots if slot.sensor == sensor]
        lines.append(f"{constant} = {imu.text(0.0)};  % {unit}")
        if sensor in imu.noise and imu.walks:
            white, bias, time = slots
            slots = [white, replace(bias, formula=DRIVE, unit=of_walk)]
            lines += [*imu.lines(slots, _LINE), f"{time.key} = inf;  % s"]
            continue
        lines += imu.lines(slots, _LINE, "{key} = [];  % not in the study: fill in")
    lines.append("imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);")
    return lines


_LINE = "{key} = {value};  % {unit}"

write = writer(_template, gauss_markov_imu, CONSUMER)
