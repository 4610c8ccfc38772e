# SPDX-License-Identifier: BSD-3-Clause
"""From a log of a unit at rest to roll, pitch and heading: align."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    Acceleration,
    Angle,
    Rate,
    Share,
    accept_option,
    click_option,
    confidence_option,
    log_options,
    model_channels_option,
    place_of,
    rest_options,
    with_options,
)
from allanite.commands.cli.positions import (
    for_means,
    headed_files_of,
    position_option,
    single_log,
)
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options
from allanite.commands.option import BETWEEN, LATITUDE, MEANS

__all__ = ["align"]

_HEADED = "first.csv=0 turned.csv=180"


@command("allanite align log.parquet --model study.json --calibration calibration.json --latitude 48.1")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@log_options
@position_option("in recording order, with its heading if known: first.csv=0 turned.csv=180.")
@with_options((BETWEEN, *MEANS))
@click.option("--model", metavar="MODEL", help=MODEL + "  [default: from the log itself]")
@model_channels_option
@click.option(
    "--calibration",
    type=click.Path(exists=True, dir_okay=False),
    help="Calibration file written by `calibrate`.  [default: nominal]",
)
@click_option(LATITUDE)
@click.option("--height", type=float, default=0.0, metavar="M", help="Height above the ellipsoid.")
@click.option(
    "--axes",
    default="FLU",
    show_default=True,
    help="Directions of x, y, z: forward F or back B, right R or left L, down D or up U.",
)
@click.option(
    "--gyro-bias", type=Rate(), help="Repeatability or uncertainty of the gyro biases, 1 sigma: 0.01deg/h."
)
@click.option(
    "--accelerometer-bias",
    type=Acceleration(),
    help="Repeatability or uncertainty of the accelerometer biases, 1 sigma: 1mg.",
)
@rest_options
@click.option(
    "--rotating/--resting", "rotation", default=None, help="The unit turned continuously.  [default: found]"
)
@click.option(
    "--scale-uncertainty",
    "scale",
    type=Share(),
    default=0.0,
    help="Scale-factor uncertainty of the gyros: 0.1%.",
)
@click.option(
    "--latitude-uncertainty", type=Angle(), default=0.0, help="Uncertainty of the latitude: 0.01deg."
)
@click.option("--tilt", type=Angle(), default=0.0, help="Uncertainty of the leveling: 0.1deg.")
@click.option(
    "--heading-uncertainty",
    "heading",
    type=Angle(),
    default=0.0,
    help="Uncertainty of the mounting and of each heading: 0.1deg.",
)
@confidence_option
@accept_option
@result_options
def align(
    logs: tuple[str, ...], positions: bool, means: bool,
    latitude: float, height: float, axes: str, gyro_bias: float | None, accelerometer_bias: float | None,
    rotation: bool | None, scale: float, latitude_uncertainty: float, tilt: float, heading: float, confidence: float,
    to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Find roll, pitch and heading from six axes at rest.

    LOG holds three gyros and three accelerometers. To separate gyro bias from the Earth's rotation, turn the unit by
    180 deg about the vertical, through several positions, or continuously. "No north" is a valid result. --out writes
    report.html, alignment.json and stands.csv.
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
