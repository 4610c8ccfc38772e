# SPDX-License-Identifier: BSD-3-Clause
"""Noise of an imu structure of NaveGo, as a MATLAB script (raw units, before imu_si_errors; densities in SI after it).

The filter has Q = diag([arw vrw gb_psd ab_psd])^2 and F = -1/corr. NaveGo makes gb_psd of gb_dyn by one formula in one
file and by another one in another; here it is set to the density that drives the bias, sigma sqrt(2/T), after the
conversion, and so are the two rate random walks.
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

NAME = "navego"
FILE_NAME = "navego_imu.m"
SUMMARY = "NaveGo: arw, vrw, gb_dyn, ab_dyn, gb_corr, ab_corr, with gb_psd and ab_psd of our own, per axis"
TAKES = "study"
CONSUMER = Consumer(
    name="NaveGo",
    file=FILE_NAME,
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

#: Letter, keys of N and K, raw units of N and sigma, SI units of K and of the driving density.
_KEYS = {
    GYROSCOPE: ("g", "arw", "arrw", "deg/sqrt(h)", "deg/s", "rad/s^2/sqrt(Hz)"),
    ACCELEROMETER: ("a", "vrw", "vrrw", "m/s/sqrt(h)", "mg", "m/s^3/sqrt(Hz)"),
}


def _template(imu: MarkovImu) -> list[str]:
    """A script that fills the structure `imu`; `dt` is to be there."""
    raw, fitted = [], []
    for sensor, (letter, noise, walk, of_noise, of_bias, si) in _KEYS.items():
        if sensor not in imu.noise:
            raw.append(f"% imu.{noise}, imu.{letter}b_dyn, imu.{letter}b_corr: not in the study")
            continue
        values = [v / parse_unit(of_noise).factor for v in imu.noise[sensor]]
        sigma = [v / parse_unit(of_bias).factor for v in imu.sigma[sensor]]
        raw += [
            f"imu.{noise} = {imu.row(values)};  % {of_noise}",
            f"imu.{letter}b_dyn = {imu.row(sigma)};  % {of_bias}",
            f"imu.{letter}b_corr = {imu.row(imu.time[sensor])};  % s",
        ]
        fitted += [
            f"imu.{letter}b_psd = {imu.row(imu.density(sensor))};  % {si}",
            f"imu.{walk} = {imu.row(imu.K[sensor])};  % {si}",
        ]
    middle = ["", "% imu = imu_si_errors(imu, dt);  % with the rest of the structure filled in; then:", ""]
    return [*imu.comment("%"), "", *raw, *middle, *fitted]


write = writer(_template, gauss_markov_imu, CONSUMER)
