# SPDX-License-Identifier: BSD-3-Clause
"""From a log of a sensor at rest to its noise model."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, FLOOR, STATISTICS, TEMPERATURE, WARM_UP, option

__all__ = ["CHARACTERIZE"]

CHARACTERIZE = Command(
    name="characterize",
    title="Noise model",
    summary="Read a LOG of a sensor at rest, say what is wrong with it, and fit its noise model.",
    details=(
        "Leaves report.html, study.json, allan.csv and imu.yaml in a folder. With --json the study goes to stdout "
        "alone, and files are written only where --out or --plot name them."
    ),
    example="allanite characterize imu.csv --unit gyro=deg/s,acc=g --from 10min --out results",
    options=(
        option(
            "choice", "--method", "Fit the curve, or the samples: smaller errors, and no unbroken stretches needed.",
            choices=("moments", "likelihood"), default="moments",
        ),
        TEMPERATURE,
        WARM_UP,
        option(
            "spans", "--exclude", "Averaging times to leave out of the fit.",
            detail="0.1:0.5,100:1000 in seconds, or with units", metavar="SPANS",
        ),
        FLOOR,
        ACCEPT,
        option(
            "choice", "--statistic", "Of the curve that is shown.", detail=", ".join(STATISTICS), choices=STATISTICS,
            default="oadev", metavar="NAME",
        ),
    ),
    work="allanite.commands.study:characterized",
    document="study",
    further=("allan.csv", "imu.yaml"),
    folder="{log}-allanite",
)  # fmt: skip
