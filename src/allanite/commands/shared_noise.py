# SPDX-License-Identifier: BSD-3-Clause
"""What two or three sensors share, and what each has alone."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, option

__all__ = ["COMMON"]

COMMON = Command(
    name="common",
    title="Shared noise",
    summary="Separate the noise that sensors share from their own.",
    details=(
        "Uses the Allan cross-covariance for two sensors and the three-cornered hat for three. Every value has an "
        "interval; a variance near or below zero becomes an upper limit."
    ),
    example="allanite common gyros.parquet --channels a,b,c --out common",
    options=(
        option("names", "--opposite", "Sensors mounted with the opposite sign.", detail="b"), CONFIDENCE, ACCEPT,
    ),
    run="allanite.stability.shared_noise:separate_noise",
    document="separation",
    tables={"separation.csv": "allanite.views.shared_noise:rows"},
)  # fmt: skip
