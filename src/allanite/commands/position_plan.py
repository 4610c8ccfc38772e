# SPDX-License-Identifier: BSD-3-Clause
"""Which positions for a calibration or a heading, from models out of files or words."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.declaration import Command
from allanite.commands.option import LATITUDE, MODEL, option
from allanite.commands.rules import Requirement

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult

__all__ = ["PLAN_POSITIONS", "position_plan_of"]

Advance = Callable[[float, str], None]

PLAN_POSITIONS = Command(
    name="plan positions",
    title="Positions",
    summary="Plan static positions for a calibration or an alignment.",
    details=(
        "Finds which positions to use, in which order and for how long, to reach given standard deviations of a "
        "calibration (`allanite calibrate`) or, with --heading, of a heading (`allanite align`). Computed by "
        "covariance analysis; no samples are needed."
    ),
    example="allanite plan positions --model study.json --latitude 48.1 --goal gyro.scale=0.05%",
    takes="model",
    options=(
        option("models", "--model", f"{MODEL.help} Of each kind.", python="models", metavar="MODEL", required=True),
        replace(LATITUDE, required=False),
        option("goals", "--goal", "Standard deviations.", python="goals",
            detail="gyro.bias=10deg/h,gyro.scale=0.1%,accelerometer.bias=1mg; 1deg with --heading",
            otherwise="1 mg, 0.1 %, 1 mrad, 36 deg/h; 1 deg"),
        option("flag", "--heading", "Plan an alignment instead of a calibration."),
        option("seconds", "--time", "Optimize for this total time instead.", detail="10min"),
        option("choice", "--candidates",
            "Positions the unit can take: the faces of a box, also its edges, also its corners.",
            choices=("faces", "edges", "all"), default="all"),
        option("integer", "--most", "Largest number of positions.", default=18),
        option("seconds", "--turn", "Time to turn from one rest to the next.", default=5.0),
        option("seconds", "--shortest", "Shortest rest.", default=5.0),
        option("number", "--rate", "Sample rate in Hz.", otherwise="that of the study, or 100"),
    ),
    rules=(
        Requirement(any_of=("latitude",), by=("heading",), says="--heading needs --latitude"),
    ),
    on_page=False,
    work="allanite.commands.position_plan:position_plan_of",
    tables={"positions.csv": "allanite.views.position_plan:rows"},
    document="position-plan",
)  # fmt: skip


def position_plan_of(
    models: Iterable[str | os.PathLike[str]],
    *,
    command: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Which positions, how long each; options are those of `plan_positions`.

    Parameters
    ----------
    models : iterable of path
        Studies, models, or words; several where gyros and accelerometers were studied apart.

    Raises
    ------
    InputError
        Two sources that name the same channel.
    """
    from allanite.commands.measurement import measured_result, provenance
    from allanite.commands.recordings import models_of_several
    from allanite.experiments.position_planning import plan_positions
    from allanite.study.result_document import Provenance

    given, rate = models_of_several(models)
    if rate is not None:
        options.setdefault("rate", rate)
    return measured_result(
        "position-plan",
        plan_positions(given, progress=progress, **options),
        lossy=False,
        provenance=Provenance(**provenance("", command=command)),
    )
