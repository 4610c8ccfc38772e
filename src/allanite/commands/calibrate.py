# SPDX-License-Identifier: BSD-3-Clause
"""The calibration of accelerometers and gyros that were put into several positions."""

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
    option,
)
from allanite.commands.rules import OF_MEANS, Requirement, of_logs

__all__ = ["CALIBRATE"]

CALIBRATE = Command(
    name="calibrate",
    title="Calibration",
    summary="Calibrate accelerometers and gyros from static positions.",
    details=(
        "Turn the unit by hand and let it rest in each position. Gravity determines the accelerometers; the turns "
        "between rests and the Earth's rotation determine the gyros. Parameters that the positions do not determine "
        "are reported, with the positions to add. Positions can be separate files (--positions) or rows of means "
        "(--means); then the turns are not used. --out writes report.html, calibration.json, which other commands "
        "accept, and positions.csv."
    ),
    example="allanite calibrate log.parquet --model study.json --latitude 48.1 --out calibration",
    options=(
        BETWEEN,
        *MEANS,
        option("file", "--gyro-log", "Log of the gyros, if LOG holds the accelerometers only."),
        replace(MODEL, otherwise="from the log itself"),
        MODEL_CHANNELS,
        replace(LATITUDE, help="Latitude, for gravity and the Earth's rotation.", detail="", required=False),
        option("number", "--height", "Height above the ellipsoid, with --latitude.", otherwise="0", metavar="M"),
        option("number", "--gravity", "Local gravity, if known better.", detail="9.81744", metavar="M/S2"),
        option("number", "--gravity-uncertainty", "Standard uncertainty of gravity.", detail="0.0003",
            metavar="M/S2"),
        *RESTS,
        option("numbers", "--without", "Positions to exclude.", detail="7,12; a turn: 7-8"),
        option("choice", "--frame", "Accelerometer axis that defines a body axis.", choices=("z", "x"), default="z"),
        option("flag", "--quadratic", "Also fit a quadratic term of each accelerometer."),
        option("flag", "--no-drift", "Assume constant biases: weight all positions alike."),
        option("number", "--reference-temperature",
            "Also fit temperature slopes; report biases at this temperature.", metavar="DEGC"),
        option("text", "--temperature", "Temperature channel, if there are several.", metavar="CHANNEL"),
        CONFIDENCE,
        ACCEPT,
    ),
    rules=(
        Requirement(any_of=("latitude",), by=("height",),
            says="--height goes with --latitude: gravity depends on both"),
        *OF_MEANS,
        *of_logs("positions", "gyro_log", "spans"),
    ),
    on_page=False,
    work="allanite.commands.calibration:calibration_of",
    tables={"positions.csv": "allanite.views.calibration:rows"},
    document="calibration",
    positions="in recording order: zup.csv zdown.csv.",
    headed="zup.csv zdown.csv",
    headings="none",
)  # fmt: skip
