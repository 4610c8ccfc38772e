# SPDX-License-Identifier: BSD-3-Clause
"""Does a sensor keep what its data sheet promises?"""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, option

__all__ = ["DATASHEET"]

DATASHEET = Command(
    name="datasheet",
    title="Data sheet",
    summary="Check a sensor against its data sheet.",
    details=(
        "SHEET is a YAML file. Each value is compared with the measured one. Without --log or --study, only the sheet "
        "is plotted."
    ),
    example="allanite datasheet sheet.yaml --log imu.csv --unit gyro=deg/s,acc=g --out sheet",
    takes="sheet",
    options=(
        option("log", "--log", "Log of the sensor at rest, to characterize."),
        option("study", "--study", "Study of the sensor, instead of a log."),
        ACCEPT,
    ),
    on_page=False,
    work="allanite.commands.sheet:datasheet_of",
    tables={"datasheet.csv": "allanite.views.datasheet:rows"},
)
