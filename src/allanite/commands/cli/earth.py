# SPDX-License-Identifier: BSD-3-Clause
"""The accuracy of an Earth rate or of north before it is measured: plan."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    Aim,
    Angle,
    Duration,
    Durations,
    Goal,
    Latitude,
    place_of,
    with_options,
)
from allanite.commands.cli.program import family
from allanite.commands.cli.results import Destination, result_options
from allanite.commands.option import LATITUDE, SETUP

__all__ = ["plan"]

_LATITUDE = f"{LATITUDE.help.removesuffix('.')}: {LATITUDE.detail}.  [required]"


@family("allanite plan --model study.json --latitude -23.31 --goal 3%")
@click.option("--model", metavar="MODEL", help=f"{MODEL}  [required]")
@click.option("--channel", help="Channel whose model to use, if there are several.")
@click.option("--latitude", type=Latitude(), metavar="DEG", help=_LATITUDE)
@click.option("--north", is_flag=True, help="Plan a north search instead of an Earth-rate measurement.")
@click.option(
    "--goal", type=Goal(), help="One standard deviation: 3%, or 1deg with --north.  [default: these]"
)
@click.option("--dead-time", type=Duration(), default=2.0, show_default=True, help="Time lost at each turn.")
@click.option("--dwells", type=Durations(), help="Times between turns: 10,30,5min.")
@click.option("--durations", type=Durations(), help="Record lengths: 10min,1h,2h.")
@click.option(
    "--axes", type=int, default=1, show_default=True, help="Number of horizontal axes, with --north."
)
@click.option(
    "--positions", type=int, help="Number of positions around the table, with --north.  [default: 4]"
)
@click.option(
    "--misalignment", type=Angle(), default=0.0, help="Misalignment of the axes on the table, with --north."
)
@with_options(SETUP)
@result_options
def plan(
    model: str | None, north: bool, goal: Aim | None, dwells: list[float] | None, durations: list[float] | None,
    to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Predict the accuracy of Earth rate or north before you record.

    Computed by covariance analysis for each dwell and record length; no samples are needed. To plan positions for a
    calibration or an alignment, use `allanite plan positions`.
    """
    from allanite.commands.earth import plan_of
    from allanite.views import terminal

    context = click.get_current_context()
    if context.invoked_subcommand is not None:
        return 0
    if model is None or options["latitude"] is None:
        name = "--model" if model is None else "--latitude"
        raise click.MissingParameter(param_hint=f"'{name}'", param_type="option", ctx=context)
    if goal is not None and goal.is_angle != north:
        raise click.UsageError(
            "--goal is a share of the Earth rate, 3%; an angle needs --north"
            if goal.is_angle
            else "--goal is an angle with --north, 1deg"
        )
    given: dict[str, Any] = {
        name: value for name, value in (("dwells", dwells), ("durations", durations)) if value
    }
    options["goal"] = None if goal is None else goal.value
    options |= {"what": "north" if north else "rate", **given}
    return to.deliver(
        "plan",
        lambda progress, **known: plan_of(place_of(model), **known, **options),
        terminal.show_document,
        tables=["plan.csv"],
        quiet=True,
    )
