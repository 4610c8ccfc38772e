# SPDX-License-Identifier: BSD-3-Clause
"""The Earth's rotation with one axis that was turned, or the rate vector of three at rest."""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, LATITUDE, MODEL, SETUP, TURNS, option
from allanite.commands.rules import Conflict

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
        LATITUDE,
        *TURNS,
        option("flag", "--vector", "Three axes at rest: measure the rate vector and its magnitude."),
        option("flag", "--settling", "Also fit a rotation that settles after each turn."),
        option("flag", "--warm-up", "Also fit an exponential warm-up."),
        option("text", "--temperature", "Also fit the dependence on this channel.", metavar="CHANNEL"),
        *SETUP,
        option("deg/h", "--bias-uncertainty", "Bias uncertainty of each of three axes.", detail="0.01deg/h"),
        option("deg/h/g", "--g-sensitivity", "g-sensitivity of an axis turned between up and down.",
            detail="0.1deg/h/g"),
        replace(CONFIDENCE, help="Confidence level of the interval."),
        ACCEPT,
    ),
    rules=(
        Conflict(one="turns", others=("dwell",), says="give either --turns or --dwell, not both"),
        Conflict(
            one="vector",
            others=("first", "turns", "dwell", "settling", "warm_up", "temperature", "g_sensitivity"),
            says=(
                "--vector is for three axes at rest: leave out the options of one turned axis (--first, "
                "--turns, --dwell, --settling, --warm-up, --temperature, --g-sensitivity)"
            ),
        ),
    ),
    work="allanite.commands.earth:earth_rate_of",
    tables={"dwells.csv": "allanite.views.earth_rate:rows"},
    documents=("rate-vector.json",),
)  # fmt: skip
