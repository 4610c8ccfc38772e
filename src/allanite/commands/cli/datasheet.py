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
@click.option("--log", help="Log of the sensor at rest, to be characterised.")
@click.option("--study", type=_FILE, help="Its study, in place of a log.")
@log_options
@accept_option
@result_options
def datasheet(
    sheet: str, log: str | None, study: str | None, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Hold a sensor against its data SHEET (YAML): what it states, what was measured, and whether it is met.

    With neither --log nor --study the sheet alone is drawn.
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
    help="That the bound lies above the sensor.",
)
@click.option(
    "--until", "horizon", type=Duration(), help="Longest averaging time.  [default: the longest lag fitted]"
)
@click.option("--terms", type=Names(), help="Letters that the bound may consist of: N,K.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="Write the bounds as models: JSON.")
@result_options
def overbound(
    study: str,
    output: str | None,
    to: Destination,
    **options: Any,
) -> int:
    """Inflate the noise models of a STUDY as little as puts them above the sensor everywhere.

    The bound is a noise model that every command takes; `allanite export --overbound 95%` writes one into a file.
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
