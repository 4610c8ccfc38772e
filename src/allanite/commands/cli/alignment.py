# SPDX-License-Identifier: BSD-3-Clause
"""From a log of a unit at rest to roll, pitch and heading: align."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.earth import latitude_option
from allanite.commands.cli.options import (
    MODEL,
    Acceleration,
    Angle,
    Names,
    Rate,
    Share,
    accept_option,
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
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["align"]

_HEADED = "first.csv=0 turned.csv=180"


@command("allanite align log.parquet --model study.json --calibration calibration.json --latitude 48.1")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@log_options
@position_options(
    "in the order of recording, with its heading where it is known: first.csv=0 turned.csv=180."
)
@means_options
@click.option("--model", metavar="MODEL", help=MODEL + "  [default: from the log itself]")
@model_channels_option
@click.option(
    "--calibration",
    type=click.Path(exists=True, dir_okay=False),
    help="What `calibrate` wrote.  [default: nominal]",
)
@latitude_option
@click.option("--height", type=float, default=0.0, metavar="M", help="Above the ellipsoid.")
@click.option("--axes", default="FLU", show_default=True, help="Where x, y, z point: F B, R L, D U.")
@click.option("--gyro-bias", type=Rate(), help="How well the biases repeat or are known, one sd: 0.01deg/h.")
@click.option("--accelerometer-bias", type=Acceleration(), help="Likewise: 1mg.")
@click.option("--gyro", type=Names(), metavar="NAMES", help="Channels x, y, z, where the units do not say.")
@click.option("--accelerometer", type=Names(), metavar="NAMES", help="Likewise.")
@click.option(
    "--spans",
    type=click.Path(exists=True, dir_okay=False),
    help="CSV of the rests: start,stop in seconds.  [default: found]",
)
@click.option(
    "--rotating/--resting", "rotation", default=None, help="It turned all the time.  [default: found]"
)
@click.option("--scale-uncertainty", "scale", type=Share(), default=0.0, help="Of the gyros: 0.1%.")
@click.option("--latitude-uncertainty", type=Angle(), default=0.0, help="Of the latitude: 0.01deg.")
@click.option("--tilt", type=Angle(), default=0.0, help="Of the levelling: 0.1deg.")
@click.option(
    "--heading-uncertainty",
    "heading",
    type=Angle(),
    default=0.0,
    help="Of the mounting, and of each position's heading: 0.1deg.",
)
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Level of the intervals.")
@accept_option
@result_options
def align(
    logs: tuple[str, ...], positions: bool, means: bool,
    latitude: float, height: float, axes: str, gyro_bias: float | None, accelerometer_bias: float | None,
    rotation: bool | None, scale: float, latitude_uncertainty: float, tilt: float, heading: float, confidence: float,
    to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Find roll, pitch and heading with a LOG of three gyros and three accelerometers at rest.

    Turn the unit by 180 deg about the vertical in between, or through several positions, or let it turn all the time:
    that tells the biases of the gyros from the Earth's rotation. "No north" is a result as well. With --out the folder
    gets report.html, alignment.json and stands.csv.
    """
    from allanite.commands.alignment import alignment_of, alignment_of_means
    from allanite.quantities.setup_uncertainty import SetupUncertainty
    from allanite.views import terminal

    by_file = headed_files_of(logs, _HEADED, needed=False) if positions else None
    log = single_log(logs, _HEADED) if by_file is None else next(iter(by_file))
    options["positions"] = by_file
    options["estimate"] = {
        "height": height,
        "axes": axes,
        "rotation": rotation,
        "bias_repeatability": (gyro_bias, accelerometer_bias),
        "stated": SetupUncertainty(scale=scale, latitude=latitude_uncertainty, tilt=tilt, heading=heading),
        "confidence": confidence,
    }
    measure = alignment_of_means if means else alignment_of
    for_means(means, options, positions=positions, spans=options["spans"])
    return to.deliver(
        "alignment",
        lambda **known: measure(place_of(log), latitude=latitude, **known, **options),
        terminal.show_alignment,
        tables=["stands.csv"],
        log=log,
    )
