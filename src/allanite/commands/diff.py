# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import option

__all__ = ["DIFF"]

DIFF = Command(
    name="diff",
    title="Two noise models",
    summary="Compare two noise models.",
    details=(
        "Shows parameters, Allan deviations and unaided drift side by side. FIRST and SECOND are studies, data sheets, "
        "imu.yaml files, models, or text: 'N=0.3 deg/√h, B=5 deg/h'."
    ),
    example="allanite diff results/study.json sheet.yaml --out difference",
    takes="pair",
    options=(
        option(
            "seconds-list", "--after", "Times at which to compare the drift.", python="seconds",
            otherwise="1s,100s,1000s",
        ),
        option(
            "seconds", "--rest", "Time at rest beforehand, over which the bias is averaged.",
            otherwise="as long as each time",
        ),
    ),
    on_page=False,
    work="allanite.commands.difference:difference_of",
    tables={"difference.csv": "allanite.views.difference:rows"},
    document="difference",
    brief=True,
)  # fmt: skip
