# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment: temperature and warm-up."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import (
    MODEL,
    accept_option,
    environment_options,
    log_options,
    place_of,
    print_json,
    result_options,
    typed,
)
from allanite.cli.program import LOSS, command

__all__ = ["environment"]


@command("allanite environment gyro.csv --temperature temp --warm-up model --out environment")
@click.argument("log")
@log_options
@environment_options
@click.option("--model", metavar="MODEL", help=f"{MODEL}  [default: fitted to the log]")
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Level of the intervals.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="Residual: .parquet, .npy or .csv.")
@accept_option
@result_options
def environment(
    log: str, output: str | None, out: str | None, figure: str | None, force: bool, as_json: bool, **options: Any
) -> int:  # fmt: skip
    """What temperature and warm-up do to the sensors in a LOG, and the log without it.

    Coefficients of the bias with intervals, lag of the thermometer, hysteresis, warm-up, told from the noise of the
    sensor. Only what the record resolves is taken off.
    """
    from allanite import delivery, terminal

    delivery.refuse_measurement(out, figure, "environment", [], force=force)
    delivery.refuse_corrected(output, force=force)
    options |= {"command": typed(), "source": "stdin" if log == "-" else None}
    place = place_of(log)
    with terminal.progress(quiet=as_json) as advance:
        found = delivery.environment_of(place, progress=advance, **options)
    saved = [] if output is None else [delivery.save_residual(found, output, force=force)]
    done = delivery.write_measurement(found, out, figure, force=force)
    if as_json:
        print_json(found.document)
    else:
        terminal.show_environment(found.document, [*saved, *done.files])
    return LOSS if found.lossy else 0
