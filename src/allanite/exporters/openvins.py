# SPDX-License-Identifier: BSD-3-Clause
"""kalibr_imu_chain.yaml of OpenVINS: https://docs.openvins.com (IMU intrinsics; gs-calibration and propagation pages).

What is read of a sample (w and a in SI) along the axes of its IMU:

    rate = R_IMUtoGYRO' Tw^-1 (w - b_w - Tg a_true),      a_true = R_IMUtoACC' Ta^-1 (a - b_a),

so that w = Tw R_IMUtoGYRO rate + Tg a_true + b_w and a = Ta R_IMUtoACC a_true + b_a. Two conventions make the matrices
unique, and the IMU frame with them:

``kalibr``
    Ta and Tw are lower triangular, R_IMUtoACC is the unit matrix. (J. Rehder et al., "Extending kalibr", ICRA 2016:
    the scale-misalignment model.) This is the body of a calibration of frame "x".
``rpng``
    Ta and Tw are upper triangular, R_IMUtoGYRO is the unit matrix.

a_true lies along the axes of that IMU: Tg is the gravity sensitivity of the calibration, its columns turned likewise.

A calibration of another frame is turned: matrix = triangle times rotation (QR). The file says by how much its IMU is
turned from the body of the calibration. Biases have no key: the filter finds them; a comment states them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from allanite import __version__
from allanite.errors import InputError
from allanite.exporters import kalibr
from allanite.exporters.imu import Consumer, NoiseOptions, Program, Usage, WalkImu, white_and_walk
from allanite.exporters.kalibr import noise_lines, open_lines, topic_line
from allanite.exporters.triads import (
    lower_and_rotation,
    notes_of,
    plain_line,
    propagated,
    upper_and_rotation,
)
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import rotation_vector
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "USAGE", "Intrinsics", "intrinsics_of", "write"]

NAME = "openvins"
FILE_NAME = "kalibr_imu_chain.yaml"
SUMMARY = "OpenVINS, with the names of Kalibr: Tw, Ta and rotations of a calibration, noise of a study"
TAKES = "either"
USAGE = Usage(  # the four numbers are those of an imu.yaml of Kalibr
    programs=(Program("OpenVINS", "rpng/open_vins: ov_msckf/src/state/Propagator.cpp"),),
    slots=kalibr.USAGE.slots,
    trap="OpenVINS reads these keys under imu0, beside its matrices; it does not read an imu.yaml of Kalibr",
)
CONSUMER = Consumer(
    name="OpenVINS",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; OpenVINS makes them discrete itself",
    ),
)
TERMS = CONSUMER.terms

Json = Mapping[str, Any]
Array = NDArray[np.float64]

_CONVENTIONS = {
    "kalibr": "lower triangular Tw and Ta, the IMU has the axes of the accelerometers",
    "rpng": "upper triangular Tw and Ta, the IMU has the axes of the gyros",
}
_SI = {ACCELEROMETER: "m/s²", GYRO: "rad/s"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Intrinsics:
    """Matrices of the consumer, shape (3, 3) each; see the module.

    Attributes
    ----------
    gravity_sensitivity : ndarray
        Of the gyros to the force along the axes of the consumer's IMU [rad/s/(m/s^2)].
    body_to_imu : ndarray
        Components along the axes of the calibration's body to those of the consumer's IMU.
    """

    gyro: Array
    imu_to_gyro: Array
    accelerometer: Array
    imu_to_accelerometer: Array
    gravity_sensitivity: Array
    body_to_imu: Array


def intrinsics_of(calibration: Calibration, convention: str = "kalibr") -> Intrinsics:
    """The matrices of a calibration; a triad that it does not hold is perfect.

    Raises
    ------
    InputError
        Another convention, or axes that are not right-handed.
    """
    if convention not in _CONVENTIONS:
        raise InputError(f"intrinsics must be {' or '.join(_CONVENTIONS)}, not {convention!r}")
    held, one = calibration.sensors, np.eye(3)
    gyro, accelerometer = (calibration.errors(s).matrix if s in held else one for s in (GYRO, ACCELEROMETER))
    split = lower_and_rotation if convention == "kalibr" else upper_and_rotation
    first, matrix = (ACCELEROMETER, accelerometer) if convention == "kalibr" else (GYRO, gyro)
    shape, to_imu = split(matrix) if first in held else (one, one)
    second, other = (GYRO, gyro) if convention == "kalibr" else (ACCELEROMETER, accelerometer)
    theirs, turn = split(other @ to_imu.T) if second in held else (one, one)
    parts = {first: (shape, one), second: (theirs, turn)}
    pulled = calibration.errors(GYRO).gravity_sensitivity if GYRO in held else np.zeros((3, 3))
    return Intrinsics(
        gyro=parts[GYRO][0],
        imu_to_gyro=parts[GYRO][1],
        accelerometer=parts[ACCELEROMETER][0],
        imu_to_accelerometer=parts[ACCELEROMETER][1],
        gravity_sensitivity=pulled @ to_imu.T,
        body_to_imu=to_imu,
    )


def write(
    document: Json,
    *,
    model: Json | None = None,
    intrinsics: str = "kalibr",
    rostopic: str | None = None,
    **options: Unpack[NoiseOptions],
) -> str:
    """The text of kalibr_imu_chain.yaml.

    Parameters
    ----------
    document : dict
        A calibration's; or a study's, for the noise alone: the matrices are unit matrices then, and the file says so.
    model : dict, optional
        A study document, for the four numbers of noise of a calibrated unit; without it their lines are left open.
    intrinsics : "kalibr" or "rpng"
    rostopic : str, optional
        As that of Kalibr (`allanite.exporters.kalibr`): by default that of the log of the study.
    **options
        `NoiseOptions`.

    Raises
    ------
    InputError
        A calibration of counts, axes that are not right-handed, two studies, or what `white_and_walk` refuses.
    """
    topic = topic_line(document if model is None else model, rostopic)
    calibration = (
        None if "channels" in document and "recording" in document else Calibration.from_json(document)
    )
    if calibration is None:
        if model is not None:
            raise InputError(
                "model is the study beside a calibration, and the file that was given is a study itself"
            )
        model = document
    else:
        _refuse_counts(calibration)
    comments, lines = [_WITHOUT_MODEL], [topic, *open_lines()]
    if model is not None:
        imu = white_and_walk(model, CONSUMER, **options)
        comments, lines = _without_title(imu), [topic, *noise_lines(imu)]
    elif options:
        raise InputError(f"{next(iter(options))} is about the noise: give model=, the study of the sensor")
    if intrinsics not in _CONVENTIONS:
        raise InputError(f"intrinsics must be {' or '.join(_CONVENTIONS)}, not {intrinsics!r}")
    what = "IMU intrinsics" if model is None else "IMU intrinsics and noise"
    head, tail = (
        _uncalibrated(intrinsics) if calibration is None else _calibrated(calibration, intrinsics, what)
    )
    return (
        "\n".join(
            [
                "%YAML:1.0",
                "",
                *(f"# {plain_line(text)}" for text in head),
                *comments,
                "",
                "imu0:",
                *_block("T_i_b", np.eye(4), "the body of the filter is this IMU"),
                *(f"  {line}" for line in lines),
                "  time_offset: 0.0",
                f'  model: "{intrinsics}"',
                *tail,
            ]
        )
        + "\n"
    )


def _without_title(imu: WalkImu) -> list[str]:
    """The comment on the noise; the title of the file stands above it."""
    _, source, *rest = imu.comments
    return ["#", f"# noise {source}", *(f"# {line}".rstrip() for line in rest)]


def _calibrated(calibration: Calibration, intrinsics: str, what: str) -> tuple[list[str], list[str]]:
    """Comments, and the matrices."""
    made = intrinsics_of(calibration, intrinsics)
    spread = _spread(calibration, intrinsics)
    return _head(calibration, made, intrinsics, what), [
        *_block("Tw", made.gyro, f"w = Tw R_IMUtoGYRO rate + b_w{_known(calibration, GYRO, spread[0])}"),
        *_block("R_IMUtoGYRO", made.imu_to_gyro, _turned(made.imu_to_gyro)),
        *_block("Ta", made.accelerometer,
                f"a = Ta R_IMUtoACC force + b_a{_known(calibration, ACCELEROMETER, spread[1])}"),
        *_block("R_IMUtoACC", made.imu_to_accelerometer, _turned(made.imu_to_accelerometer)),
        *_block("Tg", made.gravity_sensitivity, _of_force(calibration, spread[2])),
    ]  # fmt: skip


def _uncalibrated(intrinsics: str) -> tuple[list[str], list[str]]:
    """Comments, and unit matrices."""
    head = [
        f"IMU noise for OpenVINS, written by allanite {__version__}",
        "NOT CALIBRATED: Tw, Ta and the rotations are unit matrices and Tg is zero, for want of a calibration",
        f"model {intrinsics}: {_CONVENTIONS[intrinsics]}",
    ]
    keys = ("Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC")
    blocks = [line for key in keys for line in _block(key, np.eye(3), "")]
    return head, [*blocks, *_block("Tg", np.zeros((3, 3)), "")]


_WITHOUT_MODEL = (
    "# no noise model was given: fill in the four lines, or export again with the study of the sensor"
)


def _refuse_counts(calibration: Calibration) -> None:
    for sensor in calibration.sensors:
        unit = calibration.units.get(sensor, _SI[sensor])
        if unit not in (_SI[sensor], _SI[sensor].replace("²", "^2")):
            raise InputError(
                f"the {sensor} is calibrated in {unit!r}, and OpenVINS reads {_SI[sensor]}: calibrate what the driver "
                "publishes, or read the log with its scale factor (--scale-factor)"
            )


def _head(calibration: Calibration, made: Intrinsics, convention: str, what: str) -> list[str]:
    lines = [
        f"{what} for OpenVINS, written by allanite {__version__}",
        *notes_of(calibration, gravity_sensitivity=True),
        f"model {convention}: {_CONVENTIONS[convention]}",
        f"this IMU is turned from the body of the calibration by the rotation vector {_vector(made.body_to_imu)} rad",
    ]
    for sensor in calibration.sensors:
        errors = calibration.errors(sensor)
        sds = [calibration[f"{sensor}.bias_{a}"][1] for a in "xyz"]
        values = ", ".join(f"{v:.6e} (sd {s:.1e})" for v, s in zip(errors.bias, sds, strict=True))
        key = "b_w" if sensor == GYRO else "b_a"
        lines.append(f"{key} [{_SI[sensor].replace('²', '^2')}] has no key, the filter finds it: {values}")
    missing = [s for s in (GYRO, ACCELEROMETER) if s not in calibration.sensors]
    return [*lines, *(f"{s}: NOT CALIBRATED, taken as perfect" for s in missing)]


def _vector(body_to_imu: Array) -> str:
    return "[" + ", ".join(f"{v:.9f}" for v in rotation_vector(body_to_imu) + 0.0) + "]"


def _turned(matrix: Array) -> str:
    angle = float(np.linalg.norm(rotation_vector(matrix)))
    return "" if angle == 0 else f"a rotation by {angle:.6f} rad"


def _known(calibration: Calibration, sensor: str, sd: Array) -> str:
    return f"; sd up to {sd.max():.1e}" if sensor in calibration.sensors else ""


def _of_force(calibration: Calibration, sd: Array) -> str:
    meaning = "effect of acceleration on the gyros, rad/s per m/s^2"
    if not any(".gravity_sensitivity_" in name for name in calibration.names):
        return f"{meaning}: none found, or not looked for"
    return f"{meaning}; sd up to {sd.max():.1e}"


def _spread(calibration: Calibration, convention: str) -> tuple[Array, Array, Array]:
    """Standard deviations of the elements of Tw, Ta and Tg."""

    def parts(which: Callable[[Intrinsics], Array]) -> Array:
        def values(c: Calibration) -> Array:
            return which(intrinsics_of(c, convention)).ravel()

        variance = np.diag(propagated(calibration, values)[1])
        return np.sqrt(np.maximum(variance, 0.0)).reshape(3, 3)

    return parts(lambda m: m.gyro), parts(lambda m: m.accelerometer), parts(lambda m: m.gravity_sensitivity)


def _block(key: str, matrix: Array, comment: str) -> list[str]:
    head = f"  {key}:  # {comment}" if comment else f"  {key}:"
    decimals = 1 if not (matrix % 1).any() else 12
    rows = [", ".join(f"{v:{decimals + 3}.{decimals}f}" for v in row) for row in matrix + 0.0]
    return [head, *(f"    - [{row} ]" for row in rows)]
