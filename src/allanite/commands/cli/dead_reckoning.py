# SPDX-License-Identifier: BSD-3-Clause
"""What the noise costs a navigator: dead-reckon."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.options import MODEL, Angle, Duration, Durations, click_option, in_si, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.repeated import Listed
from allanite.commands.cli.results import Destination, result_options
from allanite.commands.option import LATITUDE

if TYPE_CHECKING:
    from allanite.quantities.units import QuantityKind

__all__ = ["dead_reckon"]


class Initial(Listed):
    """Standard deviations at the start: tilt=0.1deg,heading=1deg,gyro.bias=10deg/h,accelerometer.bias=1mg."""

    name = "initial"
    parts = "mapping"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        from allanite.errors import InputError
        from allanite.experiments.dead_reckoning import InitialErrors

        sizes = {}
        for part in value.split(","):
            name, _, text = (word.strip() for word in part.partition("="))
            try:
                sizes[name.replace(".", "_")] = in_si(text, self._quantity(name, param, ctx))
            except InputError as error:
                self.fail(f"{name}={text}: {error}", param, ctx)
        try:
            return InitialErrors(**sizes)
        except InputError as error:
            self.fail(str(error), param, ctx)

    def _quantity(self, name: str, param: click.Parameter | None, ctx: click.Context | None) -> QuantityKind:
        from allanite.quantities.units import QuantityKind

        quantities = {
            "position": QuantityKind.LENGTH,
            "velocity": QuantityKind.VELOCITY,
            "tilt": QuantityKind.ANGLE,
            "heading": QuantityKind.ANGLE,
            "gyro.bias": QuantityKind.ANGLE_RATE,
            "accelerometer.bias": QuantityKind.ACCELERATION,
            **{f"{s}.scale": QuantityKind.RATIO for s in ("gyro", "accelerometer")},
            **{f"{s}.misalignment": QuantityKind.ANGLE for s in ("gyro", "accelerometer")},
        }
        if name not in quantities:
            self.fail(f"{name!r} is no initial error; there are: {', '.join(quantities)}", param, ctx)
        return quantities[name]


@command("allanite dead-reckon --model study.json --latitude 48.1 --rest 60s --out budget", "dead-reckon")
@click.option(
    "--model",
    "models",
    metavar="MODEL",
    multiple=True,
    required=True,
    help=f"{MODEL} Of gyros and accelerometers (repeatable).",
)
@click_option(LATITUDE)
@click.option("--duration", type=Duration(), default=3600.0, show_default="1h", help="Time without aiding.")
@click.option("--times", type=Durations(), help="Times in the table: 1s,10s,1min,10min.")
@click.option(
    "--initial",
    type=Initial(),
    metavar="ERRORS",
    help="Standard deviations at the start: tilt=0.1deg,heading=1deg,velocity=0.1m/s,gyro.bias=10deg/h,"
    "accelerometer.bias=1mg,gyro.scale=500ppm,gyro.misalignment=1mrad.",
)
@click.option(
    "--rest",
    type=Duration(),
    help="Time at rest beforehand, used to level the unit and to remove the mean gyro rates.",
)
@click.option(
    "--remove-vertical",
    "vertical",
    is_flag=True,
    help="With --rest: also remove the vertical accelerometer bias (mean minus normal gravity).",
)
@click.option(
    "--heading", type=Angle(), default=0.0, help="Heading of the x axis, clockwise from north.  [default: 0]"
)
@click.option(
    "--height",
    type=click.Choice(["free", "held"]),
    default="free",
    show_default=True,
    help="Vertical channel: unaided, or held by a barometer.",
)
@click.option("--rate", type=float, help="Sample rate in Hz.  [default: that of the study, or 100]")
@result_options
def dead_reckon(
    models: tuple[str, ...], rate: float | None, height: str, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Predict unaided navigation errors from the noise.

    Reports one standard deviation of attitude, velocity and position over time for a level unit at rest, by error
    source, with an interval from the uncertainty of the noise models. Computed by covariance analysis, with the Earth's
    rotation and the Schuler oscillation.
    """
    from allanite.commands.dead_reckoning import dead_reckoning_of
    from allanite.views import terminal

    if rate is not None:
        options["rate"] = rate
    return to.deliver(
        "dead-reckoning",
        lambda **known: dead_reckoning_of(
            [place_of(m) for m in models], held=height == "held", **known, **options
        ),
        terminal.show_dead_reckoning,
        tables=["errors.csv"],
        quiet=True,
    )
