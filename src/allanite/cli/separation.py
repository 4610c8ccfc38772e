# SPDX-License-Identifier: BSD-3-Clause
"""Noise that sensors share, and what each has alone: common."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import (
    Names,
    accept_option,
    log_options,
    place_of,
    print_json,
    result_options,
    typed,
)
from allanite.cli.program import LOSS, command

__all__ = ["separate"]


@command("allanite common gyros.parquet --channels a,b,c --out common", name="common")
@click.argument("log")
@log_options
@click.option("--opposite", type=Names(), default="", help="Sensors mounted the other way round: b.")
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Level of the intervals.")
@accept_option
@result_options
def separate(
    log: str, opposite: list[str], confidence: float, out: str | None, figure: str | None, force: bool, as_json: bool,
    **options: Any,
) -> int:  # fmt: skip
    """Take the noise of two or three sensors in a LOG apart: what each has alone, and what they share.

    Two sensors by the Allan cross-covariance, three by the three-cornered hat. Every number has its interval; where a
    variance comes out near zero or negative, an upper limit.
    """
    from allanite import delivery, terminal

    delivery.refuse_measurement(out, figure, "separation", ["separation.csv"], force=force)
    options["estimate"] = {"opposite": opposite, "confidence": confidence}
    options |= {"command": typed(), "source": "stdin" if log == "-" else None}
    place = place_of(log)
    with terminal.progress(quiet=as_json) as advance:
        found = delivery.separation_of(place, progress=advance, **options)
    done = delivery.write_measurement(found, out, figure, force=force)
    if as_json:
        print_json(found.document)
    else:
        terminal.show_separation(found.document, done.files)
    return LOSS if found.lossy else 0
