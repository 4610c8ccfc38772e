# SPDX-License-Identifier: BSD-3-Clause
"""What the noise is held against: datasheet; and what lies above it: overbound."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from allanite.commands.cli.options import (
    Duration,
    Names,
    Share,
    accept_option,
    log_options,
    place_of,
)
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["datasheet", "overbound"]

_FILE = click.Path(exists=True, dir_okay=False, allow_dash=True)


@command("allanite datasheet sheet.yaml --log imu.csv --unit gyro=deg/s,acc=g --out sheet")
@click.argument("sheet", type=click.Path(exists=True, dir_okay=False))
@click.option("--log", help="Log of the sensor at rest, to characterize.")
@click.option("--study", type=_FILE, help="Study of the sensor, instead of a log.")
@log_options
@accept_option
@result_options
def datasheet(
    sheet: str, log: str | None, study: str | None, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Check a sensor against its data sheet.

    SHEET is a YAML file. Each value is compared with the measured one. Without --log or --study, only the sheet is
    plotted.
    """
    from allanite.commands.datasheet import datasheet_of
    from allanite.commands.measurement import MeasurementResult
    from allanite.views import terminal

    def measured(**known: Any) -> MeasurementResult:
        places: dict[str, Any] = {"log": log and place_of(log), "study": study and place_of(study)}
        return datasheet_of(sheet, **places, **known, **options)

    return to.deliver(
        "datasheet",
        measured,
        terminal.show_datasheet,
        tables=["datasheet.csv"],
        log=log,
        quiet=log is None,
    )


@command("allanite overbound results/study.json -o bound.json --plot bound.pdf")
@click.argument("study", type=_FILE)
@click.option(
    "--probability",
    type=Share(),
    default="95%",
    show_default=True,
    help="Probability that the bound lies above the sensor.",
)
@click.option(
    "--until", "horizon", type=Duration(), help="Longest averaging time.  [default: the longest lag fitted]"
)
@click.option("--terms", type=Names(), help="Terms allowed in the bound: N,K.")
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False), help="Output file for the bounding models (JSON)."
)
@result_options
def overbound(
    study: str,
    output: str | None,
    to: Destination,
    **options: Any,
) -> int:
    """Inflate a noise model until it bounds the sensor.

    The bound exceeds the sensor's noise at all averaging times, by as little as possible. Every command accepts it as a
    noise model; `allanite export --overbound 95%` writes one directly.
    """
    from allanite.commands.bounds import bounds_of
    from allanite.commands.measurement import MeasurementResult
    from allanite.study import model_file
    from allanite.views import terminal

    def save(measured: MeasurementResult) -> Path:
        models = {name: model.to_json() for name, model in measured.result.models.items()}
        return model_file.save_models(models, str(output), force=to.force)

    return to.deliver(
        "overbound",
        lambda **known: bounds_of(place_of(study), **known, **options),
        terminal.show_bounds,
        tables=["inflation.csv"],
        save=None if output is None else save,
    )
