# SPDX-License-Identifier: BSD-3-Clause
"""What the fields of a serial unit's sentences hold, by the manuals of their makers.

A kind is known by its first word, or its first two where the second one says what follows. Its fields are named only
where a sentence has exactly so many of them: another firmware may send something else. A field called ``-`` repeats the
time, is reserved, or comes from satellites (velocities of PCHRR).

References
----------
.. [1] VectorNav registers as reprinted in Safran, "VersaSync User Manual", section 5.3.4 (VNYPR to VNDTV); checksums:
   VectorNav, "VN-100 User Manual", UM001, section 3.8.
.. [2] Inertial Sense, "ASCII (NMEA) protocol": PIMU, PRIMU, PPIMU.
.. [3] Fixposition, "FP_A-RAWIMU" and "FP_A-CORRIMU", versions 1 and 2.
.. [4] Redshift Labs, "UM7 Datasheet", rev. 1.6, pp. 24-29: PCHRS, PCHRR, PCHRA.
.. [5] NovAtel, "OEM7 Commands and Logs": RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX. Their increments are
   counts: the scale depends on the inertial unit.
"""

from __future__ import annotations

from allanite.files.readers.headings import read_heading

__all__ = ["fields_of", "is_inertial", "known_fields", "words_of_kind"]

_MAG, _ACC, _GYRO = (
    " ".join(f"{name}_{axis}[{unit}]" for axis in "xyz")
    for name, unit in (("mag", "gauss"), ("acc", "m/s²"), ("gyro", "rad/s"))
)
_YPR = "yaw[deg] pitch[deg] roll[deg]"
_QUATERNION = "q_x q_y q_z q_w"
_DELTAS = "delta_theta_x delta_theta_y delta_theta_z delta_velocity_x delta_velocity_y delta_velocity_z"
_NOVATEL = "acc_z[LSB] acc_minus_y[LSB] acc_x[LSB] gyro_z[LSB] gyro_minus_y[LSB] gyro_x[LSB]"
_LONG_HEADER = (
    "- " * 9
)  # port, sequence, idle time, time status, week, seconds, receiver status, reserved, version
_FIXPOSITION = f"version gps_week gps_tow[s] {_ACC} {_GYRO}"

# Of VectorNav: name of the sentence, number of the register that $VNRRG reads, fields.
_VECTORNAV = (
    ("VNYPR", 8, _YPR),
    ("VNQTN", 9, _QUATERNION),
    ("VNQMR", 15, f"{_QUATERNION} {_MAG} {_ACC} {_GYRO}"),
    ("VNMAG", 17, _MAG),
    ("VNACC", 18, _ACC),
    ("VNGYR", 19, _GYRO),
    ("VNMAR", 20, f"{_MAG} {_ACC} {_GYRO}"),
    ("VNYMR", 27, f"{_YPR} {_MAG} {_ACC} {_GYRO}"),
    ("VNIMU", 54, f"{_MAG} {_ACC} {_GYRO} temperature[°C] pressure[kPa]"),
    ("VNDTV", 80, f"interval[s] {_DELTAS}"),
)
_OTHERS = (
    ("PIMU", f"time[s] {_GYRO} {_ACC}"),
    ("PRIMU", f"time[s] {_GYRO} {_ACC}"),
    ("PPIMU", f"time[s] {_DELTAS} interval[s]"),
    ("FP,RAWIMU", _FIXPOSITION),
    ("FP,RAWIMU", f"{_FIXPOSITION} bias_flag status -"),
    ("FP,CORRIMU", _FIXPOSITION),
    ("FP,CORRIMU", f"{_FIXPOSITION} bias_flag status -"),
    ("PCHRS,0", "time[s] gyro_x[deg/s] gyro_y[deg/s] gyro_z[deg/s] -"),
    ("PCHRS,1", "time[s] acc_x[g] acc_y[g] acc_z[g] -"),
    ("PCHRS,2", "time[s] mag_x mag_y mag_z -"),
    ("PCHRR", "time[s] - - - roll_rate[deg/s] pitch_rate[deg/s] yaw_rate[deg/s] -"),
    ("PCHRA", "time[s] roll[deg] pitch[deg] yaw[deg] heading[deg] -"),
    ("RAWIMUSA", f"- - gps_week gps_tow[s] status {_NOVATEL}"),
    ("RAWIMUSXA", f"- - - - gps_week gps_tow[s] status {_NOVATEL}"),
    ("RAWIMUA", f"{_LONG_HEADER} gps_week gps_tow[s] status {_NOVATEL}"),
    ("RAWIMUXA", f"{_LONG_HEADER} - - gps_week gps_tow[s] status {_NOVATEL}"),
)


def _known() -> dict[tuple[str, int], tuple[str, ...]]:
    rows = [*_OTHERS]
    for kind, register, fields in _VECTORNAV:
        rows += [(kind, fields), (f"VNRRG,{register:02d}", fields), (f"VNRRG,{register}", fields)]
    return {(kind, len(fields.split())): tuple(fields.split()) for kind, fields in rows}


_KNOWN = _known()
_KINDS = {kind for kind, _ in _KNOWN}
_TWO_WORDS = {kind.split(",")[0] for kind in _KINDS if "," in kind}


def words_of_kind(cells: list[str]) -> int:
    """How many of the first cells say of what kind a sentence is.

    The second one does where a manual says so, and where it is a word in a sentence of a maker's own ($P..., $FP).
    """
    if len(cells) < 3:
        return 1
    proprietary = cells[0].startswith("P") and len(cells[1]) > 1 and cells[1].isalpha()
    return 2 if cells[0] in _TWO_WORDS or proprietary else 1


def fields_of(kind: str, count: int) -> tuple[str, ...]:
    """Headings of a sentence's fields with their units; empty where no manual is known."""
    return _KNOWN.get((kind, count), ())


def known_fields(kind: str) -> tuple[str, ...]:
    """The same, for whatever number of fields is known first."""
    return next((fields for (known, _), fields in _KNOWN.items() if known == kind), ())


def is_inertial(kind: str) -> bool:
    """True if a manual says that the sentence holds rates or accelerations, or its name does."""
    groups = {read_heading(field).group for field in known_fields(kind)}
    return bool(groups & {"gyro", "acc"}) or ("imu" in kind.lower() and kind not in _KINDS)
