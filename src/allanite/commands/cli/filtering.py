# SPDX-License-Identifier: BSD-3-Clause
"""The filter of a noise model: filter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    Duration,
    Rate,
    accept_option,
    log_options,
    place_of,
    with_options,
)
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options
from allanite.commands.option import TURNS

__all__ = ["filter_"]


@command("allanite filter gyro.parquet --model study.json --smooth -o corrected.parquet", "filter")
@click.argument("log")
@log_options
@click.option("--model", metavar="MODEL", required=True, help=MODEL)
@click.option(
    "--smooth", is_flag=True, help="Estimate drift from the whole record, not only from past samples."
)
@click.option(
    "--reference",
    type=Rate(),
    help="Run the seed paper's filter with this known rate along the axis: 15deg/h.",
)
@click.option(
    "--correlation-time", type=Duration(), help="With --reference: correlation time of the flicker state."
)
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="File for the corrected series: .parquet, .npz, .npy, .csv or .mat.",
)
@with_options(TURNS)
@accept_option
@result_options
def filter_(
    log: str, smooth: bool, reference: float | None, correlation_time: float | None, output: str | None,
    first: str | None, turns: str | None, dwell: float | None, dead_time: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Estimate and remove drift with a Kalman filter.

    Uses the noise model of the sensor at rest, and tests whether it describes the LOG. --reference runs the seed
    paper's two-state filter instead, with a known rate, as on a rate table. That is not a measurement: the filter
    returns the rate it is given. The turn options apply only with --reference.
    """
    from allanite.commands.filtering import aided_of, filter_of, refuse_corrected, save_corrected
    from allanite.commands.measurement import MeasurementResult
    from allanite.views import terminal

    turned: dict[str, Any] = {"first": first, "turns": turns, "dwell": dwell}
    alone = {**turned, "correlation_time": correlation_time}
    _refuse_mixed(smooth, reference, [name for name, value in alone.items() if value is not None])
    refuse_corrected(output, force=to.force)
    measure: Callable[..., MeasurementResult] = filter_of
    show = terminal.show_filtered
    if reference is None:
        options["smooth"] = smooth
    else:
        measure, show = aided_of, terminal.show_aided
        options |= {"reference": reference, "dead_time": dead_time, **alone}
    return to.deliver(
        "filter",
        lambda **known: measure(place_of(log), **known, **options),
        show,
        log=log,
        save=None if output is None else lambda measured: save_corrected(measured, output, force=to.force),
    )


def _refuse_mixed(smooth: bool, reference: float | None, aided: Sequence[str]) -> None:
    """Options of one filter beside those of the other.

    Raises
    ------
    click.UsageError
        Smoothing with a reference, or what belongs to the reference without one.
    """
    if smooth and reference is not None:
        raise click.UsageError(
            "--smooth is for the filter of the noise model, the filter that is told the rate has no smoother: leave "
            "out --smooth or --reference"
        )
    if aided and reference is None:
        names = ", ".join(f"--{name.replace('_', '-')}" for name in aided)
        raise click.UsageError(
            f"for the filter that is told the rate only: {names}. Add --reference; a record that was turned is "
            "measured by allanite earth-rate"
        )
