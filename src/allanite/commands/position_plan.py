# SPDX-License-Identifier: BSD-3-Clause
"""A plan of positions, from a model out of a file or words to everything that a report needs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from typing import Any

from allanite.commands.measurement import MeasurementResult, provenance
from allanite.commands.recordings import models_of_several

__all__ = ["position_plan_of"]

Advance = Callable[[float, str], None]


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
    from allanite.experiments.position_planning import plan_positions

    given, rate = models_of_several(models)
    if rate is not None:
        options.setdefault("rate", rate)
    made = plan_positions(given, progress=progress, **options)
    document = {**made.to_json(), "provenance": provenance("", command=command)}
    rows = [
        {
            "number": row["number"],
            "start_s": f"{row['start']:g}",
            "stop_s": f"{row['stop']:g}",
            "position": row["position"],
            **{f"{name}_deg": f"{math.degrees(row[name]):.3f}" for name in ("roll", "pitch", "heading")},
        }
        for row in made.table()
    ]
    return MeasurementResult(
        result=made, document=document, name="position-plan", tables={"positions.csv": rows}, lossy=False
    )
