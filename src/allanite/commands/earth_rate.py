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
    summary=(
        "Measure the Earth's rotation with a LOG of one axis that was turned between north and south, or up and down."
    ),
    details=(
        "The turns are read off the signal, or come from a file or a clock. Of a LOG of three axes at rest the length "
        'of the rate vector is measured, with the biases in it. "Not resolved" is a result as well. With --out the '
        "folder gets report.html and earth-rate.json with dwells.csv, or of three axes rate-vector.json with "
        "stretches.csv."
    ),
    example="allanite earth-rate take.parquet --model study.json --latitude -23.31 --first north",
    options=(
        replace(MODEL, otherwise="fitted to the log itself"),
        option(
            "latitude", "--latitude", "Latitude in degrees, south negative.", detail="-23.31 or 23.31S",
            required=True, metavar="DEG",
        ),
        option(
            "choice", "--first", "Where the axis points at first.", detail="one axis cannot tell",
            choices=("north", "south", "up", "down"),
        ),
        option("turns", "--turns", "CSV of turns.", detail="start,stop in seconds"),
        option("seconds", "--dwell", "Turned so often, for turns that do not show.", detail="30"),
        option("seconds", "--dead-time", "Left out after each turn.", default=2.0),
        option("flag", "--vector", "Three axes at rest: the rate vector and its length."),
        option("flag", "--settling", "Fit a rotation that settles after each turn, too."),
        option("flag", "--warm-up", "Fit an exponential warm-up, too."),
        option("text", "--temperature", "Fit this channel, too.", metavar="CHANNEL"),
        option("share", "--scale-uncertainty", "Of the scale factor.", detail="0.1%"),
        option("degrees", "--latitude-uncertainty", "Of the latitude.", detail="0.01deg"),
        option("degrees", "--tilt", "Lean of the table's or a vertical axis.", detail="0.1deg"),
        option("degrees", "--heading-uncertainty", "Of the axis.", detail="3deg"),
        option("deg/h", "--bias-uncertainty", "Of each of three axes.", detail="0.01deg/h"),
        option("deg/h/g", "--g-sensitivity", "Of an axis turned between up and down.", detail="0.1deg/h/g"),
        replace(CONFIDENCE, help="Level of the interval."),
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
