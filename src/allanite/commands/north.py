# SPDX-License-Identifier: BSD-3-Clause
"""North with one or two axes on a table that was turned, and the null test between east and west."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import (
    ACCEPT,
    BETWEEN,
    CONFIDENCE,
    DEAD_TIME,
    LATITUDE,
    MEANS,
    MODEL,
    MODEL_CHANNELS,
    SETUP,
    option,
)
from allanite.commands.rules import OF_MEANS, Conflict, Requirement

__all__ = ["NORTH"]

_STOOD = "--{} states the positions: leave out --headings, --rotation and --null"

NORTH = Command(
    name="north",
    title="North",
    summary="Find north with one or two horizontal gyros.",
    details=(
        "LOG was recorded on a table that was turned. Headings are those of the first axis relative to a mark on the "
        "table; the result is the azimuth of the mark. One axis needs three positions around the circle; two axes "
        'need two opposite positions, and the side on which the second points (--second-axis). "No north" is a valid '
        "result.\n\n"
        "With --null, LOG is one axis turned between east and west, where the Earth rate cancels. It shows whether a "
        "bias follows the turns. Its headings are measured from north."
    ),
    example="allanite north log.parquet --model study.json --latitude -23.31 --headings positions.csv",
    options=(
        option("model", "--model", MODEL.help, metavar="MODEL", required=True),
        MODEL_CHANNELS,
        LATITUDE,
        option("headings", "--headings", "CSV of positions.", detail="start,stop,heading"),
        BETWEEN,
        *MEANS,
        option("deg/s", "--rotation", "Rate of a table that turned continuously, instead of positions.",
            detail="6deg/s"),
        option("choice", "--second-axis", "Side of the first axis on which the second points, seen from above.",
            choices=("left", "right")),
        option("flag", "--null", "Compare east with west, to detect a bias that follows the turns."),
        option("degrees", "--heading-at-start", "Heading of the first axis at the start of a rotation."),
        DEAD_TIME,
        *SETUP,
        option("degrees", "--misalignment", "Misalignment of the axes on the table.", detail="0.1deg"),
        CONFIDENCE,
        ACCEPT,
    ),
    rules=(
        *(Conflict(one=one, others=("headings", "rotation", "null"), says=_STOOD.format(one))
          for one in ("positions", "means")),
        Conflict(one="positions", others=("means",), says=_STOOD.format("positions")),
        Requirement(
            any_of=("headings", "rotation", "positions", "means"),
            says="state the positions of the table: --headings or --rotation",
        ),
        Conflict(one="headings", others=("rotation",), says="give either --headings or --rotation, not both"),
        *OF_MEANS,
        Conflict(one="null", others=("model_channels",), says="--model-channels is for north: --null has one axis"),
        Conflict(
            one="null", others=("rotation", "heading_at_start"),
            says="--null needs positions: --headings, with headings from north",
        ),
        Conflict(one="null", others=("second_axis",), says="--second-axis is for north: --null has one axis"),
        Conflict(
            one="null", others=("misalignment",),
            says="--misalignment is for north: for --null, use --heading-uncertainty",
        ),
        Conflict(
            one="null", others=("plot",),
            says="the null test has no figure: leave out --plot, and use --out for the report",
        ),
    ),
    work="allanite.commands.earth:north_of",
    documents=("east-west-null.json",),
    positions="with its heading, in recording order: north.csv=0 east.csv=90.",
    headed="north.csv=0 east.csv=90",
    headings="needed",
)  # fmt: skip
