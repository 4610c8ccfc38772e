# SPDX-License-Identifier: BSD-3-Clause
"""What the noise of a unit costs a navigator."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import LATITUDE, MODEL, option

__all__ = ["DEAD_RECKON"]

DEAD_RECKON = Command(
    name="dead-reckon",
    title="Dead reckoning",
    summary="Predict unaided navigation errors from the noise.",
    details=(
        "Reports one standard deviation of attitude, velocity and position over time for a level unit at rest, by "
        "error source, with an interval from the uncertainty of the noise models. Horizontal position, velocity and "
        "tilt are root sums of squares of north and east. Computed by covariance analysis, "
        "with the Earth's rotation and the Schuler oscillation."
    ),
    example="allanite dead-reckon --model study.json --latitude 48.1 --rest 60s --out budget",
    takes="model",
    options=(
        option("models", "--model", f"{MODEL.help} Of gyros and accelerometers.", python="models", metavar="MODEL",
            required=True),
        LATITUDE,
        option("seconds", "--duration", "Time without aiding.", otherwise="1h"),
        option("seconds-list", "--times", "Times in the table: 1s,10s,1min,10min."),
        option("initial", "--initial", "Standard deviations at the start: tilt=0.1deg,heading=1deg,velocity=0.1m/s,"
            "gyro.bias=10deg/h,accelerometer.bias=1mg,gyro.scale=500ppm,gyro.misalignment=1mrad.", metavar="ERRORS"),
        option("seconds", "--rest",
            "Time at rest beforehand, used to level the unit and to remove the mean gyro rates."),
        option("flag", "--remove-vertical", "With --rest: also remove the vertical accelerometer bias (mean minus "
            "normal gravity).", python="vertical"),
        option("degrees", "--heading", "Heading of the x axis, clockwise from north.", otherwise="0"),
        option("choice", "--height", "Vertical channel: unaided, or held by a barometer.", choices=("free", "held"),
            default="free"),
        option("number", "--rate", "Sample rate in Hz.", otherwise="that of the study, or 100"),
    ),
    on_page=False,
    work="allanite.commands.dead_reckoning:dead_reckoning_of",
    tables={"errors.csv": "allanite.views.dead_reckoning:rows"},
    document="dead-reckoning",
    brief=True,
)  # fmt: skip
