# SPDX-License-Identifier: BSD-3-Clause
"""The noise of ImuParams.yaml of Kimera-VIO (continuous densities in SI; the file form is that of OpenCV).

Its preintegration is GTSAM's, whose covariances are the squares of these (imu-frontend, ImuFrontend.cpp; the names are
those of ImuFrontendParams.cpp).
"""

from __future__ import annotations

from allanite.exporters.imu import Consumer, Program, Usage, WalkImu, white_and_walk, writer
from allanite.exporters.kalibr import USAGE as KALIBR

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "kimera"
FILE_NAME = "kimera_imu.yaml"
SUMMARY = "Kimera-VIO: the noise of ImuParams.yaml, with the names of Kalibr, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "Kimera-VIO",
            "MIT-SPARK/Kimera-VIO: src/imu-frontend/ImuFrontend.cpp, src/imu-frontend/ImuFrontendParams.cpp",
        ),
    ),
    slots=KALIBR.slots,
    trap="Kimera-VIO does not read an imu.yaml of Kalibr: it needs rate_hz and the keys in the comments below",
)
CONSUMER = Consumer(
    name="Kimera-VIO",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; Kimera-VIO makes them discrete itself",
    ),
)
TERMS = CONSUMER.terms

_OPEN = (
    "# imu_preintegration_type:  # 0: CombinedImuFactor, 1: ImuFactor",
    "# T_BS:  # unit matrix, as the body is the IMU",
    "# imu_integration_sigma:  # not a number of a record at rest",
    "# imu_time_shift:  # s, from the calibration of the camera",
    "# n_gravity: [0.0, 0.0, -9.81]  # m/s^2",
)


def _template(imu: WalkImu) -> list[str]:
    """The noise; the keys that are comments are those of ImuParams.yaml that hold none."""
    lines = imu.lines(USAGE.slots, "{key}: {value}  # {unit}", "# {key}:  # {unit}")
    return ["%YAML:1.0", "", *imu.comment(), "", f"rate_hz: {imu.frequency}", *lines, *_OPEN]


write = writer(_template, white_and_walk, CONSUMER)
