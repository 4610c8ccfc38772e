# SPDX-License-Identifier: BSD-3-Clause
"""Is a coefficient of a fleet in control?"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.commands.declaration import Command
from allanite.commands.option import option

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult

__all__ = ["FLEET_CHART", "chart_of_fleet"]

FLEET_CHART = Command(
    name="fleet chart",
    title="Control chart",
    summary="Draw the control chart of a coefficient of a fleet.",
    details=(
        "FLEET is a folder that `allanite fleet run` wrote, or its fleet.parquet. Every point has its interval, and "
        "limits that include it. Logs are in the order of their dates where all have one. With --phase-two the logs "
        "before it set the limits for those from it on."
    ),
    example="allanite fleet chart fleet --channel gyro_x --term N --plot chart.pdf",
    takes="fleet",
    options=(
        option("text", "--channel", "Channel of the coefficient.", required=True, metavar="NAME"),
        option("choice", "--term", "Coefficient.", choices=("Q", "N", "B", "K", "R"), required=True),
        option(
            "text", "--phase-two", "Date or number of the first log that is judged by the ones before it.",
            detail="2026-03-01 or 31", otherwise="all logs are judged by all", metavar="DATE",
        ),
        option(
            "choice", "--rules", "Patterns of points that signal.",
            choices=("individuals", "western-electric", "nelson"), default="western-electric",
        ),
        option("flag", "--no-ewma", "Leave out the exponentially weighted mean.", python="no_ewma"),
    ),
    on_page=False,
    brief=True,
    work="allanite.commands.fleet.chart:chart_of_fleet",
    document="chart",
    tables={"points.csv": "allanite.views.control_chart:rows"},
)  # fmt: skip


def chart_of_fleet(
    fleet: str | os.PathLike[str],
    *,
    channel: str,
    term: str,
    phase_two: str | None = None,
    rules: str = "western-electric",
    no_ewma: bool = False,
    command: str | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeasurementResult:
    """The control chart of a coefficient; see `allanite.stability.fleet.charts.control_chart`.

    Raises
    ------
    InputError
        What `control_chart` refuses.
    """
    from allanite.commands.fleet.report import provenance_of_fleet
    from allanite.commands.measurement import measured_result
    from allanite.stability.fleet.charts import control_chart

    chart = control_chart(
        Path(fleet), channel=channel, term=term, phase_two=phase_two, rules=rules, weighted=not no_ewma
    )
    return measured_result("chart", chart, lossy=False, provenance=provenance_of_fleet(fleet, command))
