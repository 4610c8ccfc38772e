# SPDX-License-Identifier: BSD-3-Clause
"""Noise of an imu structure of NaveGo, as a MATLAB script (raw units, before imu_si_errors; densities in SI after it).

The filter has Q = diag([arw vrw gb_psd ab_psd])^2 and F = -1/corr. NaveGo makes gb_psd of gb_dyn by one formula in one
file and by another one in another; here it is set to the density that drives the bias, sigma sqrt(2/T), after the
conversion, and so are the two rate random walks.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    DRIVE,
    GYROSCOPE,
    SIGMA,
    TIME,
    Consumer,
    K,
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

NAME = "navego"
FILE_NAME = "navego_imu.m"
SUMMARY = "NaveGo: arw, vrw, gb_dyn, ab_dyn, gb_corr, ab_corr, with gb_psd and ab_psd of our own, per axis"
TAKES = "study"
#: Before imu_si_errors, in raw units; and after it, in SI.
_RAW = (
    Slot("arw", GYROSCOPE, N, "deg/sqrt(h)"),
    Slot("gb_dyn", GYROSCOPE, SIGMA, "deg/s"),
    Slot("gb_corr", GYROSCOPE, TIME, "s"),
    Slot("vrw", ACCELEROMETER, N, "m/s/sqrt(h)"),
    Slot("ab_dyn", ACCELEROMETER, SIGMA, "mg"),
    Slot("ab_corr", ACCELEROMETER, TIME, "s"),
)
_FITTED = (
    Slot("gb_psd", GYROSCOPE, DRIVE, "rad/s^2/sqrt(Hz)"),
    Slot("arrw", GYROSCOPE, K, "rad/s^2/sqrt(Hz)"),
    Slot("ab_psd", ACCELEROMETER, DRIVE, "m/s^3/sqrt(Hz)"),
    Slot("vrrw", ACCELEROMETER, K, "m/s^3/sqrt(Hz)"),
)
USAGE = Usage(
    programs=(
        Program("NaveGo", "rodralez/NaveGo: ins/imu_si_errors.m, ins-gnss/F_update.m, ins-gnss/ins_gnss.m"),
    ),
    slots=(*_RAW, *_FITTED),
    trap="set gb_psd and ab_psd after imu_si_errors, in SI: NaveGo derives them from gb_dyn in different ways",
)
CONSUMER = Consumer(
    name="NaveGo",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous; raw units, then imu_si_errors, then densities in SI that this file sets itself",
        "gb_dyn, ab_dyn: stationary standard deviation of the Gauss-Markov bias; psd = sigma sqrt(2/T)",
        Remark(
            "arrw, vrrw: K; the simulator noise_rrw.m steps by K dt, not K sqrt(dt): too small by sqrt(rate)",
            "K",
            "walk",
        ),
        Remark("arrw, vrrw: zero, as the walk is in gb_psd and ab_psd", "walk"),
        "gb_sta, ab_sta: spread between power-ups, not in a record of one run: yours to set",
    ),
    per_axis=True,
    holds_K=True,
)
TERMS = CONSUMER.terms


def _template(imu: MarkovImu) -> list[str]:
    """A script that fills the structure `imu`; `dt` is to be there."""
    line = "imu.{key} = {row};  % {unit}"
    middle = ["", "% imu = imu_si_errors(imu, dt);  % with the rest of the structure filled in; then:", ""]
    raw = imu.lines(_RAW, line, "% imu.{key}: not in the study")
    return [*imu.comment("%"), "", *raw, *middle, *imu.lines(_FITTED, line)]


write = writer(_template, gauss_markov_imu, CONSUMER)
