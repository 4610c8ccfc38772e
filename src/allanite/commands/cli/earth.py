# SPDX-License-Identifier: BSD-3-Clause
"""From a turned record to the Earth: north, plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    Rate,
    Share,
    accept_option,
    confidence_option,
    log_options,
    model_channels_option,
    place_of,
)
from allanite.commands.cli.positions import (
    for_means,
    headed_files_of,
    means_options,
    position_options,
    single_log,
)
from allanite.commands.cli.program import command, family
from allanite.commands.cli.results import Destination, result_options

__all__ = ["north", "plan"]


_HEADED = "north.csv=0 east.csv=90"
LATITUDE = "Latitude in degrees, south negative: -23.31 or 23.31S."


def latitude_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where on Earth."""
    return click.option("--latitude", type=Latitude(), required=True, metavar="DEG", help=LATITUDE)(command)


def stated_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """What only the user knows about the set-up; standard uncertainties, all of them."""
    options = [
        click.option("--scale-uncertainty", "scale", type=Share(), default=0.0,
            help="Uncertainty of the scale factor: 0.1%."),
        click.option("--latitude-uncertainty", type=Angle(), default=0.0, help="Uncertainty of the latitude: 0.01deg."),
        click.option("--tilt", type=Angle(), default=0.0, help="Tilt of the table axis or of a vertical axis: 0.1deg."),
        click.option("--heading-uncertainty", "heading", type=Angle(), default=0.0,
            help="Uncertainty of the axis heading: 3deg."),
    ]  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


def _one_of(options: Mapping[str, Any], *names: str, needed: bool = False) -> None:
    """Options that exclude one another, of which one may be needed.

    Raises
    ------
    click.UsageError
        Two of them, or none where one is needed.
    """
    given = [f"--{name}" for name in names if options[name] is not None]
    allowed = " or ".join(f"--{name}" for name in names)
    if len(given) > 1:
        raise click.UsageError(f"give either {allowed}, not both")
    if needed and not given:
        raise click.UsageError(f"say how the table stood: {allowed}")


@command("allanite north log.parquet --model study.json --latitude -23.31 --headings positions.csv")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@log_options
@click.option("--model", metavar="MODEL", required=True, help=MODEL)
@model_channels_option
@latitude_option
@click.option(
    "--headings", type=click.Path(exists=True, dir_okay=False), help="CSV of positions: start,stop,heading."
)
@position_options("with its heading, in recording order: north.csv=0 east.csv=90.")
@means_options
@click.option(
    "--rotation", type=Rate(), help="Rate of a table that turned continuously, instead of positions: 6deg/s."
)
@click.option("--null", is_flag=True, help="Compare east with west, to detect a bias that follows the turns.")
@click.option(
    "--heading-at-start",
    type=Angle(),
    default=0.0,
    help="Heading of the first axis at the start, with --rotation.",
)
@click.option(
    "--dead-time", type=Duration(), default=2.0, show_default=True, help="Time to skip after each turn."
)
@stated_options
@click.option(
    "--misalignment", type=Angle(), default=0.0, help="Misalignment of the axes on the table: 0.1deg."
)
@confidence_option
@accept_option
@result_options
def north(
    logs: tuple[str, ...], positions: bool, between: float, means: bool, latitude: float, null: bool,
    misalignment: float, confidence: float, scale: float,
    latitude_uncertainty: float, tilt: float, heading: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Find north with one or two horizontal gyros.

    LOG was recorded on a table that was turned. Headings are those of the first axis relative to a mark on the table;
    the result is the azimuth of the mark. One axis needs three positions around the circle; two axes need two opposite
    positions. "No north" is a valid result.

    With --null, LOG is one axis turned between east and west, where the Earth rate cancels. It shows whether a bias
    follows the turns. Its headings are measured from north.
    """
    from allanite.commands.earth import north_of, null_of
    from allanite.experiments.earth_rate import SetupUncertainty
    from allanite.views import terminal

    by_file = headed_files_of(logs, _HEADED) if positions else None
    log = single_log(logs, _HEADED) if by_file is None else next(iter(by_file))
    if by_file is None and not means:
        _one_of(options, "headings", "rotation", needed=True)
    elif null or (means and positions) or options["headings"] is not None or options["rotation"] is not None:
        raise click.UsageError(
            f"--{'means' if means else 'positions'} says how the table stood: leave --headings, --rotation and "
            "--null out"
        )
    if not means or null:
        for_means(False, options)
    chosen: dict[str, Any] = {
        "stated": SetupUncertainty(scale=scale, latitude=latitude_uncertainty, tilt=tilt, heading=heading),
        "confidence": confidence,
    }
    if null:
        _refuse_with_null(options, to.figure, misalignment)
        measure, show = null_of, terminal.show_null
    else:
        measure, show = north_of, terminal.show_north
        chosen["misalignment"] = misalignment
        options |= {"positions": by_file, "between": between, "means": means}
    options |= {"latitude": latitude, "estimate": chosen}
    return to.deliver(
        "east-west-null" if null else "north",
        lambda **known: measure(place_of(log), **known, **options),
        show,
        log=log,
    )


def _refuse_with_null(options: dict[str, Any], figure: str | None, misalignment: float) -> None:
    """What the null test has no use for; its options are those that are left.

    Raises
    ------
    click.UsageError
        A rotation, a misalignment or a figure.
    """
    rotation = options.pop("rotation")
    at_start = options.pop("heading_at_start")
    if options.pop("model_channels") is not None:
        raise click.UsageError("--model-channels is for north: --null has one axis")
    if rotation is not None or at_start:
        raise click.UsageError("--null needs positions: --headings, with headings from north")
    if misalignment:
        raise click.UsageError("--misalignment is for north: for --null, say --heading-uncertainty")
    if figure is not None:
        raise click.UsageError("the null test has no figure: leave --plot out, and see --out for the report")


@family("allanite plan --model study.json --latitude -23.31 --goal 3%")
@click.option("--model", metavar="MODEL", help=f"{MODEL}  [required]")
@click.option("--channel", help="Channel whose model to use, if there are several.")
@click.option("--latitude", type=Latitude(), metavar="DEG", help=f"{LATITUDE}  [required]")
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
@stated_options
@result_options
def plan(
    model: str | None, north: bool, goal: Aim | None, dwells: list[float] | None, durations: list[float] | None,
    scale: float, latitude_uncertainty: float, tilt: float, heading: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Predict the accuracy of Earth rate or north before you record.

    Computed by covariance analysis for each dwell and record length; no samples are needed. To plan positions for a
    calibration or an alignment, use `allanite plan positions`.
    """
    from allanite.commands.earth import plan_of
    from allanite.experiments.earth_rate import SetupUncertainty
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
    stated = SetupUncertainty(scale=scale, latitude=latitude_uncertainty, tilt=tilt, heading=heading)
    given: dict[str, Any] = {
        name: value for name, value in (("dwells", dwells), ("durations", durations)) if value
    }
    options["goal"] = None if goal is None else goal.value
    options |= {"what": "north" if north else "rate", "stated": stated, **given}
    return to.deliver(
        "plan",
        lambda progress, **known: plan_of(place_of(model), **known, **options),
        terminal.show_plan,
        tables=["plan.csv"],
        quiet=True,
    )
