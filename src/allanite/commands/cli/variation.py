# SPDX-License-Identifier: BSD-3-Clause
"""Does the noise change during the record: variation."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    Share,
    accept_option,
    log_options,
    place_of,
)
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["variation"]


@command("allanite variation gyro.parquet --out variation")
@click.argument("log")
@log_options
@click.option("--model", metavar="MODEL", help=f"{MODEL}  [default: the fit to the log]")
@click.option("--windows", type=int, default=64, show_default=True, help="Of the short averaging times.")
@click.option(
    "--false-alarm", type=Share(), default="5%", show_default=True, help="Per channel that is constant."
)
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Level of the intervals.")
@accept_option
@result_options
def variation(
    log: str, windows: int, false_alarm: float, confidence: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Say whether the noise of a LOG changes: the Allan deviation over time (dynamic Allan variance).

    The deviation of every window at every averaging time, each with its interval; a test of constancy for each and for
    all together; and when, in which term and by how much the noise stepped or drifted.
    """
    from allanite.commands.variation import variation_of
    from allanite.views import terminal

    options["estimate"] = {"windows": windows, "false_alarm": false_alarm, "confidence": confidence}
    return to.deliver(
        "variation",
        lambda **known: variation_of(place_of(log), **known, **options),
        terminal.show_variation,
        tables=["variation.csv"],
        log=log,
    )
