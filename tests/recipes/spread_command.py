# SPDX-License-Identifier: BSD-3-Clause
"""Do the samples of all channels scatter alike? A toy."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, option

__all__ = ["SPREAD"]

SPREAD = Command(
    name="spread",
    title="Do channels scatter alike?",
    summary="Test whether the samples of all channels scatter alike.",
    details="Computes the standard deviation of the samples of each channel.",
    example="allanite spread gyro.parquet --out spread",
    group="Look at a log",
    options=(
        option("number", "--factor", "Ratio of two standard deviations that is too large.", default=2.0),
        ACCEPT,
    ),
    run="allanite.stability.spread:measure_spread",
    tables={"spread.csv": "allanite.views.spread:rows"},
)
