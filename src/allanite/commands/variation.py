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
    summary="Test whether the noise changes (dynamic Allan variance).",
    details=(
        "Computes the Allan deviation of every window at every averaging time, with intervals; tests constancy of"
        " each and of all together; and estimates when, in which term and by how much the noise stepped or "
        "drifted."
    ),
    example="allanite variation gyro.parquet --out variation",
    options=(
        replace(MODEL, otherwise="the fit to the log"),
        option("integer", "--windows", "Number of windows at short averaging times.", default=64),
        option("share", "--false-alarm", "False-alarm rate per constant channel.", default=0.05),
        CONFIDENCE,
        ACCEPT,
    ),
    run="allanite.stability.variation:examine_variation",
    tables={"variation.csv": "allanite.views.variation:rows"},
    judged_here=("noise_changes", "amplitude_drop"),
)
