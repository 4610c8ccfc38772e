# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment: temperature and warm-up."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    accept_option,
    confidence_option,
    environment_options,
    log_options,
    place_of,
)
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["environment"]


@command("allanite environment gyro.csv --temperature temp --warm-up model --out environment")
@click.argument("log")
@log_options
@environment_options
@click.option("--model", metavar="MODEL", help=f"{MODEL}  [default: fitted to the log]")
@confidence_option
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="File for the residual: .parquet, .npz, .npy, .csv or .mat.",
)
@accept_option
@result_options
def environment(
    log: str, output: str | None, to: Destination, **options: Any
) -> int:  # fmt: skip
    """Separate temperature and warm-up from noise.

    Estimates temperature coefficients, thermometer lag, hysteresis and warm-up, with intervals, and removes only what
    the record resolves.
    """
    from allanite.commands.environment import environment_of, save_residual
    from allanite.commands.filtering import refuse_corrected
    from allanite.views import terminal

    refuse_corrected(output, force=to.force)
    return to.deliver(
        "environment",
        lambda **known: environment_of(place_of(log), **known, **options),
        terminal.show_environment,
        log=log,
        save=None if output is None else lambda measured: save_residual(measured, output, force=to.force),
    )
