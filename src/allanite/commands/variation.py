# SPDX-License-Identifier: BSD-3-Clause
"""Does the noise change during the record?"""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, MODEL, option

__all__ = ["VARIATION"]

VARIATION = Command(
    name="variation",
    title="Does the noise change?",
    summary="Say whether the noise of a LOG changes: the Allan deviation over time (dynamic Allan variance).",
    details=(
        "The deviation of every window at every averaging time, each with its interval; a test of constancy for each "
        "and for all together; and when, in which term and by how much the noise stepped or drifted."
    ),
    example="allanite variation gyro.parquet --out variation",
    options=(
        replace(MODEL, otherwise="the fit to the log"),
        option("integer", "--windows", "Of the short averaging times.", default=64),
        option("share", "--false-alarm", "Per channel that is constant.", default=0.05),
        CONFIDENCE,
        ACCEPT,
    ),
    run="allanite.stability.variation:examine_variation",
    tables={"variation.csv": "allanite.views.variation:rows"},
    judged_here=("noise_changes", "amplitude_drop"),
)
