# SPDX-License-Identifier: BSD-3-Clause
"""Are several records the same, and how much do they scatter?"""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, option

__all__ = ["COMPARE"]

COMPARE = Command(
    name="compare",
    title="Compare recordings",
    summary="Compare repeated logs, or several units of one type.",
    details=(
        "Tests whether they agree, and estimates how much they scatter. A RECORD is a log, a study.json (or its "
        "folder), or an allan.csv. Log options apply to all RECORDs, or to the RECORD that they name."
    ),
    example="allanite compare monday.csv tuesday.csv wednesday.csv --unit deg/s --out compared",
    takes="recordings",
    options=(
        option("names", "--names", "Names of the records.", detail="SN1,SN2,SN3", otherwise="those of the files"),
        option(
            "texts", "--match", "Channels to compare: x, or one name per record: x,gyro_x.", metavar="CHANNELS",
        ),
        ACCEPT,
        CONFIDENCE,
        option("number", "--level", "Significance level of the tests.", default=0.05),
    ),
    work="allanite.commands.comparison:comparison_of",
    document="comparison",
    tables={"parameters.csv": "allanite.views.comparison:rows"},
)  # fmt: skip
