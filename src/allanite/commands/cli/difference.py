# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side: diff."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import Duration, Durations, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["diff"]


@command("allanite diff results/study.json sheet.yaml --out difference")
@click.argument("first")
@click.argument("second")
@click.option(
    "--after",
    "seconds",
    type=Durations(),
    help="Times at which to compare the drift.  [default: 1s,100s,1000s]",
)
@click.option(
    "--rest",
    type=Duration(),
    help="Time at rest beforehand, over which the bias is averaged.  [default: as long as each time]",
)
@result_options
def diff(first: str, second: str, to: Destination, **options: Any) -> int:
    """Compare two noise models.

    Shows parameters, Allan deviations and unaided drift side by side. FIRST and SECOND are studies, data sheets,
    imu.yaml files, models, or text: 'N=0.3 deg/√h, B=5 deg/h'.
    """
    from allanite.commands.difference import difference_of
    from allanite.views import terminal

    return to.deliver(
        "difference",
        lambda **known: difference_of(place_of(first), place_of(second), **known, **options),
        terminal.show_difference,
        tables=["difference.csv"],
        quiet=True,
    )
