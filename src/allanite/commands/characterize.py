# SPDX-License-Identifier: BSD-3-Clause
"""From a log of a sensor at rest to its noise model."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, FLOOR, STATISTICS, TEMPERATURE, WARM_UP, option

__all__ = ["CHARACTERIZE"]

CHARACTERIZE = Command(
    name="characterize",
    title="Noise model",
    summary="Check a log at rest, fit its noise model, write a report.",
    details=(
        "Writes report.html, study.json, allan.csv and imu.yaml to a folder. With --json, the study goes to "
        "stdout, and files are written only with --out or --plot."
    ),
    example="allanite characterize imu.csv --unit gyro=deg/s,acc=g --from 10min --out results",
    options=(
        option(
            "choice", "--method", "Fit the Allan curve (moments) or the samples (likelihood: smaller errors, tolerates "
            "many gaps).",
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
            "choice", "--statistic", "Statistic to show.", detail=", ".join(STATISTICS), choices=STATISTICS,
            default="oadev", metavar="NAME",
        ),
    ),
    work="allanite.commands.study:characterized",
    document="study",
    further=("allan.csv", "imu.yaml"),
    folder="{log}-allanite",
    summarized=True,
)  # fmt: skip
