# SPDX-License-Identifier: BSD-3-Clause
"""What pictures and tables show of a fit: the steps, and the response less its best straight line."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.motion import RateSteps
from allanite.experiments.rate_table.record.clipping import Clipped
from allanite.experiments.rate_table.record.fit import TableSolution
from allanite.experiments.rate_table.record.rows import DIRECTION, RATE, RegressionRows, SampleSelection
from allanite.experiments.rate_table.results import ResponsePoint, StepResult
from allanite.experiments.rate_table.step_means import StepMeans
from allanite.noise import NoiseModel, White
from allanite.recording.records import Recording

__all__ = ["response_points", "step_results"]

Array = NDArray[np.float64]

#: Rates of a sweep that are shown, for each direction.
BINS = 32


def step_results(
    table: RateSteps,
    rows: RegressionRows,
    steps: StepMeans | None,
    window: SampleSelection,
    clipped: Clipped,
    corrected: Array | None,
    recording: Recording,
) -> tuple[StepResult, ...]:
    """Every step of the table, used or not."""
    place = {} if steps is None else {int(n): i for i, n in enumerate(steps.number)}
    whole = window.clock.record_time(table.spans)
    out = []
    for i, rate in enumerate(table.rate.tolist()):
        used = rows.steps[i, 0] > 0
        at = rows.steps[i, 2:] / recording.rate if used else whole[i]
        k = place.get(i)
        left = math.nan if corrected is None or not used else float(corrected[i])
        out.append(
            StepResult(
                start=float(at[0]),
                stop=float(at[1]),
                rate=rate,
                mean=float(rows.steps[i, 1]) if used else math.nan,
                residual=math.nan if steps is None or k is None else float(steps.residual[k]),
                sd=math.nan if steps is None or k is None else float(steps.sd[k]),
                corrected=left,
                used=bool(used),
                why="" if used else _why(i, whole, window, clipped, recording),
            )
        )
    return tuple(out)


def _why(i: int, whole: Array, window: SampleSelection, clipped: Clipped, recording: Recording) -> str:
    if clipped.steps[i]:
        return "beyond the range"
    if whole[i, 1] <= 0 or whole[i, 0] >= recording.duration:
        return "outside of the record"
    if whole[i, 1] - whole[i, 0] <= window.dead_time + window.guard:
        return "shorter than the dead time"
    return "samples missing"


def response_points(
    solution: TableSolution, steps: StepMeans | None, model: NoiseModel
) -> tuple[ResponsePoint, ...]:
    """Deviation from the best straight line: of each step, or of the rates of a sweep for each direction."""
    size = solution.fit[RATE][0]
    if steps is not None:
        u = steps.rate / solution.rows.full_scale
        fitted, _ = solution.deviation(u)
        return tuple(
            ResponsePoint(
                rate=float(steps.rate[i]),
                deviation=float(fitted[i] + steps.residual[i] / size),
                sd=float(steps.sd[i] / abs(size)),
                direction=0,
            )
            for i in range(steps.size)
        )
    return _of_sweep(solution, model, size)


def _of_sweep(solution: TableSolution, model: NoiseModel, size: float) -> tuple[ResponsePoint, ...]:
    """Means over bins of the rate; the standard deviation is that of white noise."""
    rows = solution.rows
    used = rows.used
    u, part = rows.column(RATE)[used], rows.part[used]
    left = (rows.mean - solution.predicted())[used] / size
    way = np.sign(rows.column(DIRECTION)[used])
    edges = np.linspace(u.min(), u.max(), BINS + 1)
    white = sum(t.N**2 for t in model.terms if isinstance(t, White)) / rows.dt
    points = []
    for direction in (1, -1):
        place = np.clip(np.searchsorted(edges, u, side="right") - 1, 0, BINS - 1)
        for b in range(BINS):
            members = (place == b) & (way == direction)
            weight = float(part[members].sum())
            if weight < 1:
                continue
            middle = float((part * u)[members].sum()) / weight
            fitted, _ = solution.deviation(np.array([middle]))
            mean = float((part * left)[members].sum()) / weight
            points.append(
                ResponsePoint(
                    rate=middle * rows.full_scale,
                    deviation=mean + float(fitted[0]),
                    sd=math.sqrt(white / weight) / abs(size),
                    direction=direction,
                )
            )
    return tuple(points)
