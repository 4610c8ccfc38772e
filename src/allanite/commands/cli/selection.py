# SPDX-License-Identifier: BSD-3-Clause
"""Which noise terms a log supports: select."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import Frequencies, accept_option, confidence_option, log_options, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["select"]


@command("allanite select gyro.parquet --lines auto --out selection")
@click.argument("log")
@log_options
@click.option("--lines", type=Frequencies(), default="auto", show_default=True, help=Frequencies.__doc__)
@confidence_option
@accept_option
@result_options
def select(log: str, to: Destination, **options: Any) -> int:
    """Choose the noise terms that a log supports.

    Weighs every combination of quantization, white noise, flicker, up to two Gauss-Markov terms, random walk, ramp and
    spectral lines. Parameter intervals include the uncertainty about the combination.
    """
    from allanite.commands.selection import selection_of
    from allanite.views import terminal

    return to.deliver(
        "selection",
        lambda **known: selection_of(place_of(log), **known, **options),
        terminal.show_selection,
        tables=["selection.csv"],
        log=log,
    )
