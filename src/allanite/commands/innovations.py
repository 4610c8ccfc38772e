# SPDX-License-Identifier: BSD-3-Clause
"""Which number of a filter is wrong?"""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import CONFIDENCE, option
from allanite.commands.rules import Conflict

__all__ = ["INNOVATIONS"]

INNOVATIONS = Command(
    name="innovations",
    title="Innovations of a filter",
    summary="Test the innovations of a filter, and find what is wrong.",
    details=(
        "LOG is what your filter wrote: time, the innovation of each axis, and the variance or standard deviation that "
        "it stated. Tests their size over time (NIS), their whiteness, and their size over frequency, which separates "
        "the measurement noise (N) from the drift (K)."
    ),
    example="allanite innovations filter.csv --innovations nu_x,nu_y --variances S_x,S_y",
    options=(
        option(
            "names", "--innovations", "Columns of the innovations.", otherwise="those that are no variances"
        ),
        option(
            "names",
            "--variances",
            "Columns of their variances.",
            otherwise="by their names: S_x, var_x, cov_x",
        ),
        option("names", "--deviations", "Columns of their standard deviations, in place of variances."),
        CONFIDENCE,
    ),
    rules=(
        Conflict(
            one="variances",
            others=("deviations",),
            says="--variances and --deviations state one thing twice: leave one out",
        ),
    ),
    on_page=False,
    work="allanite.commands.filter_log:innovations_of",
    tables={
        "bands.csv": "allanite.views.innovations:band_rows",
        "nis.csv": "allanite.views.innovations:nis_rows",
    },
)
