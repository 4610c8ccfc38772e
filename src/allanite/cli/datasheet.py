# SPDX-License-Identifier: BSD-3-Clause
"""What the noise is held against: datasheet; and what lies above it: overbound."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import (
    Duration,
    Names,
    Share,
    accept_option,
    log_options,
    place_of,
    print_json,
    result_options,
    typed,
)
from allanite.cli.program import LOSS, command

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
    sheet: str, log: str | None, study: str | None, out: str | None, figure: str | None, force: bool, as_json: bool,
    **options: Any,
) -> int:  # fmt: skip
    """Hold a sensor against its data SHEET (YAML): what it states, what was measured, and whether it is met.

    With neither --log nor --study the sheet alone is drawn.
    """
    from allanite import delivery, terminal

    delivery.refuse_measurement(out, figure, "datasheet", ["datasheet.csv"], force=force)
    if log is not None:
        options["source"] = "stdin" if log == "-" else None
    options |= {"log": log and place_of(log), "study": study and place_of(study), "command": typed()}
    with terminal.progress(quiet=as_json or log is None) as advance:
        found = delivery.datasheet_of(sheet, progress=advance, **options)
    done = delivery.write_measurement(found, out, figure, force=force)
    if as_json:
        print_json(found.document)
    else:
        terminal.show_datasheet(found.document, done.files)
    return LOSS if found.lossy else 0


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
    out: str | None,
    figure: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Inflate the noise models of a STUDY as little as puts them above the sensor everywhere.

    The bound is a noise model that every command takes; `allanite export --overbound 95%` writes one into a file.
    """
    from allanite import delivery, model_file, terminal

    delivery.refuse_measurement(out, figure, "overbound", ["inflation.csv"], force=force)
    with terminal.progress(quiet=as_json) as advance:
        found = delivery.bounds_of(place_of(study), command=typed(), progress=advance, **options)
    models = {name: model.to_json() for name, model in found.result.models.items()}
    saved = [] if output is None else [model_file.save_models(models, output, force=force)]
    done = delivery.write_measurement(found, out, figure, force=force)
    if as_json:
        print_json(found.document)
    else:
        terminal.show_bounds(found.document, [*saved, *done.files])
