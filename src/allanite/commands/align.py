# SPDX-License-Identifier: BSD-3-Clause
"""Roll, pitch and heading of a unit from gravity and the Earth's rotation."""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import (
    ACCEPT,
    BETWEEN,
    CONFIDENCE,
    LATITUDE,
    MEANS,
    MODEL,
    MODEL_CHANNELS,
    RESTS,
    SETUP,
    option,
)
from allanite.commands.rules import OF_MEANS, of_logs

__all__ = ["ALIGN"]

_SCALE, _LATITUDE, _TILT, _HEADING = SETUP

ALIGN = Command(
    name="align",
    title="Alignment",
    summary="Find roll, pitch and heading from six axes at rest.",
    details=(
        "LOG holds three gyros and three accelerometers. To separate gyro bias from the Earth's rotation, turn the "
        'unit by 180 deg about the vertical, through several positions, or continuously. "No north" is a valid result. '
        "--out writes report.html, alignment.json and stands.csv."
    ),
    example="allanite align log.parquet --model study.json --calibration calibration.json --latitude 48.1",
    options=(
        BETWEEN,
        *MEANS,
        replace(MODEL, otherwise="from the log itself"),
        MODEL_CHANNELS,
        option("file", "--calibration", "Calibration file written by `calibrate`.", otherwise="nominal"),
        LATITUDE,
        option("number", "--height", "Height above the ellipsoid.", default=0.0, metavar="M"),
        option("text", "--axes", "Directions of x, y, z.", default="FLU",
            detail="forward F or back B, right R or left L, down D or up U"),
        option("deg/h", "--gyro-bias", "Repeatability or uncertainty of the gyro biases, 1 sigma.", detail="0.01deg/h"),
        option("acceleration", "--accelerometer-bias",
            "Repeatability or uncertainty of the accelerometer biases, 1 sigma.", detail="1mg"),
        *RESTS,
        option("flag", "--rotating/--resting", "The unit turned continuously.", python="rotation", otherwise="found"),
        replace(_SCALE, help="Scale-factor uncertainty of the gyros."),
        _LATITUDE,
        replace(_TILT, help="Uncertainty of the leveling."),
        replace(_HEADING, help="Uncertainty of the mounting and of each heading.", detail="0.1deg"),
        CONFIDENCE,
        ACCEPT,
    ),
    rules=(
        *OF_MEANS,
        *of_logs("positions", "spans"),
    ),
    on_page=False,
    work="allanite.commands.alignment:alignment_of",
    tables={"stands.csv": "allanite.views.alignment:rows"},
    document="alignment",
    positions="in recording order, with its heading if known: first.csv=0 turned.csv=180.",
    headed="first.csv=0 turned.csv=180",
)  # fmt: skip
