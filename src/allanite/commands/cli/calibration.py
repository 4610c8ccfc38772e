# SPDX-License-Identifier: BSD-3-Clause
"""From a log of a unit that was turned by hand to its calibration: calibrate."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import (
    MODEL,
    Latitude,
    accept_option,
    confidence_option,
    log_options,
    model_channels_option,
    place_of,
    with_options,
)
from allanite.commands.cli.positions import files_of, for_means, position_option, single_log
from allanite.commands.cli.program import command
from allanite.commands.cli.repeated import Listed
from allanite.commands.cli.results import Destination, result_options
from allanite.commands.option import BETWEEN, MEANS, RESTS

__all__ = ["calibrate"]


class Numbers(Listed):
    """Whole numbers from 1, and pairs of them, with commas between: 7,12-13."""

    name = "numbers"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int | tuple[int, int], ...]:
        if isinstance(value, tuple):
            return value
        numbers: list[int | tuple[int, int]] = []
        for word in str(value).split(","):
            ends = [int(end) if end.strip().isdecimal() else 0 for end in word.split("-")]
            if len(ends) > 2 or min(ends) < 1:
                self.fail(
                    f"{value!r} are no numbers of positions: write 7 or 7,12, and 7-8 for a turn", param, ctx
                )
            numbers.append((ends[0], ends[1]) if len(ends) == 2 else ends[0])
        return tuple(numbers)


@command("allanite calibrate log.parquet --model study.json --latitude 48.1 --out calibration")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@log_options
@position_option("in recording order: zup.csv zdown.csv.")
@with_options((BETWEEN, *MEANS))
@click.option(
    "--gyro-log",
    type=click.Path(exists=True, dir_okay=False),
    help="Log of the gyros, if LOG holds the accelerometers only.",
)
@click.option("--model", metavar="MODEL", help=MODEL + "  [default: from the log itself]")
@model_channels_option
@click.option(
    "--latitude", type=Latitude(), metavar="DEG", help="Latitude, for gravity and the Earth's rotation."
)
@click.option(
    "--height", type=float, metavar="M", help="Height above the ellipsoid, with --latitude.  [default: 0]"
)
@click.option("--gravity", type=float, metavar="M/S2", help="Local gravity, if known better: 9.81744.")
@click.option(
    "--gravity-uncertainty",
    type=float,
    default=0.0,
    metavar="M/S2",
    help="Standard uncertainty of gravity: 0.0003.",
)
@with_options(RESTS)
@click.option("--without", type=Numbers(), default=(), help="Positions to exclude: 7,12; a turn: 7-8.")
@click.option(
    "--frame",
    type=click.Choice(["z", "x"]),
    default="z",
    show_default=True,
    help="Accelerometer axis that defines a body axis.",
)
@click.option("--quadratic", is_flag=True, help="Also fit a quadratic term of each accelerometer.")
@click.option("--no-drift", is_flag=True, help="Assume constant biases: weight all positions alike.")
@click.option(
    "--reference-temperature",
    type=float,
    metavar="DEGC",
    help="Also fit temperature slopes; report biases at this temperature.",
)
@click.option("--temperature", metavar="CHANNEL", help="Temperature channel, if there are several.")
@confidence_option
@accept_option
@result_options
def calibrate(
    logs: tuple[str, ...], positions: bool, means: bool,
    frame: str, quadratic: bool, no_drift: bool, temperature: str | None, reference_temperature: float | None,
    confidence: float, gravity_uncertainty: float, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Calibrate accelerometers and gyros from static positions.

    Turn the unit by hand and let it rest in each position. Gravity determines the accelerometers; the turns between
    rests and the Earth's rotation determine the gyros. Parameters that the positions do not determine are reported,
    with the positions to add. Positions can be separate files (--positions) or rows of means (--means); then the turns
    are not used. --out writes report.html, calibration.json, which other commands accept, and positions.csv.
    """
    from allanite.commands.calibration import calibration_of, calibration_of_means
    from allanite.views import terminal

    if options["height"] is not None and options["latitude"] is None:
        raise click.UsageError("--height goes with --latitude: gravity depends on both")
    log = logs[0] if positions else single_log(logs, "zup.csv zdown.csv")
    options["positions"] = files_of(logs) if positions else None
    options["estimate"] = {
        "frame": frame,
        "quadratic": quadratic,
        "drift": not no_drift,
        "temperature": temperature,
        "reference_temperature": reference_temperature,
        "confidence": confidence,
        "stated": {"gravity": gravity_uncertainty} if gravity_uncertainty else {},
    }
    measure = calibration_of_means if means else calibration_of
    for_means(means, options, positions=positions, gyro_log=options["gyro_log"], spans=options["spans"])
    return to.deliver(
        "calibration",
        lambda **known: measure(place_of(log), **known, **options),
        terminal.show_calibration,
        tables=["positions.csv"],
        log=log,
    )
