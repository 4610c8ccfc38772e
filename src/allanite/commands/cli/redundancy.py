# SPDX-License-Identifier: BSD-3-Clause
"""Several sensors of one kind as one: combine."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import MODEL, Duration, Share, confidence_option, log_options, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["combine"]


@command("allanite combine gyros.parquet --model study.json --directions axes.csv -o combined.parquet")
@click.argument("log")
@log_options
@click.option("--model", metavar="MODEL", required=True, help=f"{MODEL} One for all, or one for each.")
@click.option(
    "--directions",
    type=click.Path(exists=True, dir_okay=False),
    help="CSV of the sensing axes: channel,x,y,z.  [default: all along one]",
)
@click.option("--averaging", type=Duration(), help="Averaging time for which to optimize the weights.")
@click.option("--moving", is_flag=True, help="The sensors moved: take the weights from the models only.")
@click.option(
    "--motion-error", type=Share(), default=0.0, help="Error of scale factors, and of axes in rad: 0.1%."
)
@click.option(
    "--window",
    type=Duration(),
    help="Averaging window of the parity residuals.  [default: a thousandth of the record]",
)
@click.option(
    "--false-alarm",
    type=Share(),
    default="1%",
    show_default=True,
    help="False-alarm rate per fault-free record.",
)
@confidence_option
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="File for the combined signal: .parquet, .npz, .npy, .csv or .mat.",
)
@result_options
def combine(
    log: str, moving: bool, averaging: float | None, window: float | None, false_alarm: float, motion_error: float,
    confidence: float, output: str | None, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Combine redundant sensors and detect faulty ones.

    The weights come from the noise models and, at rest, from the noise that the sensors share. With more sensors than
    axes, parity residuals are free of motion and show steps, drifts, spikes, excess noise and a stuck sensor. Two more
    sensors than axes are needed to identify the faulty one.
    """
    from allanite.commands.filtering import refuse_corrected
    from allanite.commands.redundancy import combination_of, save_combined
    from allanite.views import terminal

    refuse_corrected(output, force=to.force)
    options["estimate"] = {
        "rest": not moving,
        "averaging": averaging,
        "window": window,
        "false_alarm": false_alarm,
        "motion_error": motion_error,
        "confidence": confidence,
    }
    return to.deliver(
        "combination",
        lambda **known: combination_of(place_of(log), **known, **options),
        terminal.show_combination,
        tables=["weights.csv"],
        log=log,
        save=None if output is None else lambda measured: save_combined(measured, output, force=to.force),
    )
