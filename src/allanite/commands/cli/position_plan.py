# SPDX-License-Identifier: BSD-3-Clause
"""Which positions for a calibration or a heading: plan positions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from allanite.commands.cli.earth import plan
from allanite.commands.cli.options import (
    MODEL,
    Acceleration,
    Angle,
    Duration,
    Rate,
    Share,
    click_option,
    place_of,
)
from allanite.commands.cli.program import example_of
from allanite.commands.cli.repeated import Listed
from allanite.commands.cli.results import Destination, result_options
from allanite.commands.option import LATITUDE

__all__ = ["positions"]


class Goals(Listed):
    """Wanted standard deviations: gyro.scale=0.1%,accelerometer.bias=1mg; or an angle for a heading: 1deg."""

    name = "goals"
    parts = "mapping"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        if "=" not in value:
            return Angle()(value, param, ctx)
        out = {}
        for part in value.split(","):
            name, _, size = (text.strip() for text in part.partition("="))
            sensor, _, rest = name.partition(".")
            if sensor not in ("gyro", "accelerometer") or not rest or not size:
                self.fail(f"{part!r}: write gyro.scale=0.1%, or accelerometer.bias_x=1mg", param, ctx)
            out[name] = self._size(sensor, rest.partition("_")[0], size, param, ctx)
        return out

    def _size(
        self, sensor: str, kind: str, text: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        if kind == "scale":
            return float(Share()(text, param, ctx))
        if kind == "misalignment":
            return float(Angle()(text, param, ctx))
        if kind != "bias":
            self.fail(f"{kind!r} is none of bias, scale and misalignment", param, ctx)
        kinds = {"gyro": Rate(), "accelerometer": Acceleration()}
        return float(kinds[sensor](text, param, ctx))


@plan.command(
    "positions",
    epilog=example_of("allanite plan positions --model study.json --latitude 48.1 --goal gyro.scale=0.05%"),
)
@click.option(
    "--model",
    "models",
    metavar="MODEL",
    multiple=True,
    required=True,
    help=f"{MODEL} Of each kind (repeatable).",
)
@click_option(replace(LATITUDE, required=False))
@click.option(
    "--goal",
    "goals",
    type=Goals(),
    help="Standard deviations: gyro.bias=10deg/h,gyro.scale=0.1%,accelerometer.bias=1mg; 1deg with --heading.  "
    "[default: 1 mg, 0.1 %, 1 mrad, 36 deg/h; 1 deg]",
)
@click.option("--heading", is_flag=True, help="Plan an alignment instead of a calibration.")
@click.option("--time", type=Duration(), help="Optimize for this total time instead: 10min.")
@click.option(
    "--candidates",
    type=click.Choice(["faces", "edges", "all"]),
    default="all",
    show_default=True,
    help="Positions the unit can take: the faces of a box, also its edges, also its corners.",
)
@click.option("--most", type=int, default=18, show_default=True, help="Positions.")
@click.option(
    "--turn", type=Duration(), default=5.0, show_default=True, help="Time to turn from one rest to the next."
)
@click.option("--shortest", type=Duration(), default=5.0, show_default=True, help="Shortest rest.")
@click.option("--rate", type=float, help="Sample rate in Hz.  [default: that of the study, or 100]")
@result_options
def positions(
    models: tuple[str, ...], rate: float | None, to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Plan static positions for a calibration or an alignment.

    Finds which positions to use, in which order and for how long, to reach given standard deviations of a calibration
    (`allanite calibrate`) or, with --heading, of a heading (`allanite align`). Computed by covariance analysis; no
    samples are needed.
    """
    from allanite.commands.position_plan import position_plan_of
    from allanite.views import terminal

    if rate is not None:
        options["rate"] = rate
    if options["heading"] and options["latitude"] is None:
        raise click.UsageError("--heading depends on the latitude: --latitude")
    return to.deliver(
        "position-plan",
        lambda **known: position_plan_of([place_of(m) for m in models], **known, **options),
        terminal.show_position_plan,
        tables=["positions.csv"],
    )
