# SPDX-License-Identifier: BSD-3-Clause
"""Several records beside one another: compare."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import accept_option, confidence_option, log_options, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["compare"]


@command("allanite compare monday.csv tuesday.csv wednesday.csv --unit deg/s --out compared")
@click.argument("records", nargs=-1, required=True, metavar="RECORD RECORD...")
@log_options
@click.option("--names", help="Names of the records: SN1,SN2,SN3.  [default: those of the files]")
@click.option(
    "--match",
    multiple=True,
    metavar="CHANNELS",
    help="Channels to compare: x, or one name per record: x,gyro_x (repeatable).",
)
@accept_option
@confidence_option
@click.option("--level", type=float, default=0.05, show_default=True, help="Significance level of the tests.")
@result_options
def compare(
    records: tuple[str, ...], names: str | None, match: tuple[str, ...], confidence: float, level: float,
    to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Compare repeated logs, or several units of one type.

    Tests whether they agree, and estimates how much they scatter. A RECORD is a log, a study.json (or its folder), or
    an allan.csv. Log options apply to all RECORDs, or to the RECORD that they name.
    """
    from allanite.commands.comparison import comparison_of
    from allanite.views import terminal

    options["names"] = [n.strip() for n in names.split(",")] if names else None
    options["matches"] = [[n.strip() for n in m.split(",")] if "," in m else m for m in match] or None
    options["compare"] = {"confidence": confidence, "level": level}
    return to.deliver(
        "comparison",
        lambda **known: comparison_of([place_of(r) for r in records], **known, **options),
        terminal.show_comparison,
        tables=["parameters.csv"],
    )
