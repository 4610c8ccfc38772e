# SPDX-License-Identifier: BSD-3-Clause
"""Noise that sensors share, and what each has alone: common."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import Names, accept_option, confidence_option, log_options, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["separate"]


@command("allanite common gyros.parquet --channels a,b,c --out common", name="common")
@click.argument("log")
@log_options
@click.option("--opposite", type=Names(), default="", help="Sensors mounted with the opposite sign: b.")
@confidence_option
@accept_option
@result_options
def separate(
    log: str, opposite: list[str], confidence: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Separate the noise that sensors share from their own.

    Uses the Allan cross-covariance for two sensors and the three-cornered hat for three. Every value has an interval; a
    variance near or below zero becomes an upper limit.
    """
    from allanite.commands.shared_noise import separation_of
    from allanite.views import terminal

    options["estimate"] = {"opposite": opposite, "confidence": confidence}
    return to.deliver(
        "separation",
        lambda **known: separation_of(place_of(log), **known, **options),
        terminal.show_separation,
        tables=["separation.csv"],
        log=log,
    )
