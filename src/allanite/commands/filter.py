# SPDX-License-Identifier: BSD-3-Clause
"""The drift that a noise model knows, removed."""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, MODEL, TURNS, option
from allanite.commands.rules import Conflict, Requirement

__all__ = ["FILTER"]

FILTER = Command(
    name="filter",
    title="Filter",
    summary="Estimate and remove drift with a Kalman filter.",
    details=(
        "Uses the noise model of the sensor at rest, and tests whether it describes the LOG. --reference runs a "
        "published two-state filter instead, with a known rate, as on a rate table. That is not a measurement: the "
        "filter returns the rate it is given. The turn options apply only with --reference."
    ),
    example="allanite filter gyro.parquet --model study.json --smooth -o corrected.parquet",
    options=(
        replace(MODEL, required=True),
        option("flag", "--smooth", "Estimate drift from the whole record, not only from past samples."),
        option(
            "deg/h", "--reference", "Run the two-state filter with this known rate along the axis.",
            detail="15deg/h",
        ),
        option("seconds", "--correlation-time", "With --reference: correlation time of the flicker state."),
        *TURNS,
        ACCEPT,
    ),
    rules=(
        Conflict(
            one="smooth",
            others=("reference",),
            says="--smooth is for the filter of the noise model, the filter that is told the rate has no smoother: "
            "leave out --smooth or --reference",
        ),
        *(
            Requirement(
                any_of=("reference",),
                by=(name,),
                says=f"--{name.replace('_', '-')} applies only with --reference; a record that was turned is measured "
                "by allanite earth-rate",
            )
            for name in ("first", "turns", "dwell", "correlation_time")
        ),
    ),
    work="allanite.commands.filtering:filtered_of",
    series="corrected series",
)  # fmt: skip
