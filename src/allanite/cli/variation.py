# SPDX-License-Identifier: BSD-3-Clause
"""Does the noise change during the record: variation."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import (
    MODEL,
    Share,
    accept_option,
    log_options,
    place_of,
    print_json,
    result_options,
    typed,
)
from allanite.cli.program import LOSS, command

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
    log: str, windows: int, false_alarm: float, confidence: float, out: str | None, figure: str | None, force: bool,
    as_json: bool, **options: Any,
) -> int:  # fmt: skip
    """Say whether the noise of a LOG changes: the Allan deviation over time (dynamic Allan variance).

    The deviation of every window at every averaging time, each with its interval; a test of constancy for each and for
    all together; and when, in which term and by how much the noise stepped or drifted.
    """
    from allanite import delivery, terminal

    delivery.refuse_measurement(out, figure, "variation", ["variation.csv"], force=force)
    options["estimate"] = {"windows": windows, "false_alarm": false_alarm, "confidence": confidence}
    options |= {"command": typed(), "source": "stdin" if log == "-" else None}
    place = place_of(log)
    with terminal.progress(quiet=as_json) as advance:
        found = delivery.variation_of(place, progress=advance, **options)
    done = delivery.write_measurement(found, out, figure, force=force)
    if as_json:
        print_json(found.document)
    else:
        terminal.show_variation(found.document, done.files)
    return LOSS if found.lossy else 0
