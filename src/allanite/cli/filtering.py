# SPDX-License-Identifier: BSD-3-Clause
"""The filter of a noise model: filter."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import (
    MODEL,
    Rate,
    accept_option,
    log_options,
    place_of,
    print_json,
    result_options,
    turn_options,
    typed,
)
from allanite.cli.program import LOSS, command

__all__ = ["filter_"]


@command("allanite filter gyro.parquet --model study.json --smooth -o corrected.parquet", "filter")
@click.argument("log")
@log_options
@click.option("--model", metavar="MODEL", required=True, help=MODEL)
@click.option(
    "--smooth", is_flag=True, help="Estimate the drift from the whole record, not from the samples so far."
)
@click.option(
    "--reference", type=Rate(), help="Run the seed paper's filter, told this rate along the axis: 15deg/h."
)
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False), help="Corrected series: .parquet, .npy or .csv."
)
@turn_options
@accept_option
@result_options
def filter_(
    log: str, smooth: bool, reference: float | None, output: str | None, first: str | None, turns: str | None,
    dwell: float | None, dead_time: float, out: str | None, figure: str | None, force: bool, as_json: bool,
    **options: Any,
) -> int:  # fmt: skip
    """Take the drift that a noise model knows off a LOG of a sensor at rest, and test whether the model holds.

    With --reference the two-state filter of the seed paper is run instead, against a rate that is known (a rate
    table). It is no measurement: the filter gives back what it is told. The options of turns are for it alone.
    """
    from allanite import delivery, terminal

    delivery.refuse_measurement(out, figure, "filter", force=force)
    delivery.refuse_corrected(output, force=force)
    options |= {"command": typed(), "source": "stdin" if log == "-" else None}
    place = place_of(log)
    with terminal.progress(quiet=as_json) as advance:
        if reference is None:
            found = delivery.filter_of(place, smooth=smooth, progress=advance, **options)
        else:
            turned: dict[str, Any] = {"first": first, "turns": turns, "dwell": dwell, "dead_time": dead_time}
            found = delivery.aided_of(place, reference=reference, progress=advance, **turned, **options)
    saved = [] if output is None else [delivery.save_corrected(found, output, force=force)]
    done = delivery.write_measurement(found, out, figure, force=force)
    if as_json:
        print_json(found.document)
    else:
        show = terminal.show_filtered if reference is None else terminal.show_aided
        show(found.document, [*saved, *done.files])
    return LOSS if found.lossy else 0
