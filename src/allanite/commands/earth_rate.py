# SPDX-License-Identifier: BSD-3-Clause
"""The Earth's rotation with one axis that was turned, or the rate vector of three at rest."""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command, Conflict
from allanite.commands.option import ACCEPT, CONFIDENCE, MODEL, option

__all__ = ["EARTH_RATE"]

EARTH_RATE = Command(
    name="earth-rate",
    title="Earth rate",
    summary="Measure the Earth's rotation with a sensor turned by hand.",
    details=(
        "LOG holds one axis that was turned between north and south, or up and down. The turns are detected in "
        "the signal, or given by a file or an interval. For three axes at rest, the magnitude of the rate vector "
        'is measured, biases included. "Not resolved" is a valid result. --out writes report.html and '
        "earth-rate.json with dwells.csv; for three axes rate-vector.json with stretches.csv."
    ),
    example="allanite earth-rate take.parquet --model study.json --latitude -23.31 --first north",
    options=(
        replace(MODEL, otherwise="fitted to the log itself"),
        option(
            "latitude", "--latitude", "Latitude in degrees, south negative.", detail="-23.31 or 23.31S",
            required=True, metavar="DEG",
        ),
        option(
            "choice", "--first", "Direction of the axis before the first turn.", detail="one axis cannot tell",
            choices=("north", "south", "up", "down"),
        ),
        option("turns", "--turns", "CSV of turns.", detail="start,stop in seconds"),
        option("seconds", "--dwell", "Time between turns, if the signal does not show them.", detail="30"),
        option("seconds", "--dead-time", "Time to skip after each turn.", default=2.0),
        option("flag", "--vector", "Three axes at rest: measure the rate vector and its magnitude."),
        option("flag", "--settling", "Also fit a rotation that settles after each turn."),
        option("flag", "--warm-up", "Also fit an exponential warm-up."),
        option("text", "--temperature", "Also fit the dependence on this channel.", metavar="CHANNEL"),
        option("share", "--scale-uncertainty", "Uncertainty of the scale factor.", detail="0.1%"),
        option("degrees", "--latitude-uncertainty", "Uncertainty of the latitude.", detail="0.01deg"),
        option("degrees", "--tilt", "Tilt of the table axis or of a vertical axis.", detail="0.1deg"),
        option("degrees", "--heading-uncertainty", "Uncertainty of the axis heading.", detail="3deg"),
        option("deg/h", "--bias-uncertainty", "Bias uncertainty of each of three axes.", detail="0.01deg/h"),
        option("deg/h/g", "--g-sensitivity", "g-sensitivity of an axis turned between up and down.",
            detail="0.1deg/h/g"),
        replace(CONFIDENCE, help="Confidence level of the interval."),
        ACCEPT,
    ),
    conflicts=(
        Conflict(one="turns", others=("dwell",), says="give either --turns or --dwell, not both"),
        Conflict(
            one="vector",
            others=("first", "turns", "dwell", "settling", "warm_up", "temperature", "g_sensitivity"),
            says=(
                "--vector is for three axes at rest: leave out what is said of one axis that was turned (--first, "
                "--turns, --dwell, --settling, --warm-up, --temperature, --g-sensitivity)"
            ),
        ),
    ),
    work="allanite.commands.earth:earth_rate_of",
    tables={"dwells.csv": "allanite.views.earth_rate:rows"},
    documents=("rate-vector.json",),
)  # fmt: skip
