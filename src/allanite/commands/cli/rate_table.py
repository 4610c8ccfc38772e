# SPDX-License-Identifier: BSD-3-Clause
"""From a record on a rate table to the response of the sensor."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    Angle,
    Duration,
    Latitude,
    Names,
    Share,
    accept_option,
    confidence_option,
    log_options,
    place_of,
)
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["rate_table"]

_AXES = ("vertical", "up", "down", "horizontal", "unknown")


@command("allanite rate-table log.parquet --model study.json --table table.csv", "rate-table")
@click.argument("log")
@log_options
@click.option("--model", metavar="MODEL", help=MODEL + "  [default: fitted to the log itself]")
@click.option(
    "--table",
    type=click.Path(exists=True, dir_okay=False),
    required=True,
    help="CSV: start,stop,rate_deg_s; time,angle_deg; time,rate_deg_s; or start,stop,amplitude_deg_s,frequency.",
)
@click.option("--channel", help="Channel along the table axis.  [default: the one that responds most]")
@click.option(
    "--cross-axes", type=Names(), help="Other channels on the table.  [default: all of the same kind]"
)
@click.option(
    "--nonlinearity", default="2", show_default=True, help="Degree of the polynomial, 1 to 5, or sign."
)
@click.option(
    "--temperature", metavar="CHANNEL", help="Temperature channel that scale factor and bias may follow."
)
@click.option("--offset", type=Duration(), help="Log time at time zero of the table.  [default: found]")
@click.option("--dead-time", type=Duration(), help="Time to skip after each rate change.  [default: found]")
@click.option("--axis", type=click.Choice(_AXES), default="vertical", show_default=True, help="Table axis.")
@click.option(
    "--latitude",
    type=Latitude(),
    metavar="DEG",
    help="Latitude, to remove the Earth rate from the bias: 48.1 or 23.31S.",
)
@click.option(
    "--table-uncertainty", "scale", type=Share(), default=0.0, help="Uncertainty of the table rate: 10ppm."
)
@click.option(
    "--misalignment", type=Angle(), default=0.0, help="Angle between sensor and table axis: 0.1deg."
)
@confidence_option
@accept_option
@result_options
def rate_table(
    log: str, nonlinearity: str, cross_axes: list[str] | None, temperature: str | None, offset: float | None,
    dead_time: float | None, axis: str, latitude: float | None, scale: float, misalignment: float,
    confidence: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Calibrate gyros on a rate table.

    Estimates scale factor, bias, nonlinearity and misalignment. The table's record is a CSV of steps, encoder angles,
    rates, or sinusoids. The two clocks are aligned; settling and clipping are excluded. --out writes report.html,
    rate-table.json and, for steps, steps.csv.
    """
    from allanite.commands.rate_table import rate_table_of
    from allanite.experiments.rate_table import TableUncertainty
    from allanite.views import terminal

    chosen = {
        "nonlinearity": _degree(nonlinearity), "cross_axes": cross_axes, "temperature": temperature,
        "offset": offset, "dead_time": dead_time, "axis": axis, "latitude": latitude, "confidence": confidence,
        "stated": TableUncertainty(scale=scale, misalignment=misalignment),
    }  # fmt: skip
    return to.deliver(
        "rate-table",
        lambda **known: rate_table_of(place_of(log), estimate=chosen, **known, **options),
        terminal.show_rate_table,
        tables=["steps.csv"],
        log=log,
    )


def _degree(text: str) -> int | str:
    """A degree, or "sign".

    Raises
    ------
    click.UsageError
        Something else.
    """
    if text == "sign":
        return text
    if text not in tuple("12345"):
        raise click.UsageError(f"--nonlinearity is a degree from 1 to 5, or sign, not {text!r}")
    return int(text)
