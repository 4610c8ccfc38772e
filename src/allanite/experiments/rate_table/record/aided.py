# SPDX-License-Identifier: BSD-3-Clause
"""The reference-aided filter of the seed paper where it is at home: the table's rate is known, and slow noise is not.

The filter is told the fitted response to the table and takes off what is slow in the difference. What it leaves of the
steps shows by how much the slow noise of the sensor moved them. It measures nothing: the response was told to it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.motion import RateSteps, RateTable
from allanite.experiments.rate_table.record.fit import TableSolution
from allanite.experiments.rate_table.record.rows import RATE
from allanite.experiments.rate_table.results import Aided
from allanite.experiments.reference_aided import reference_aided
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording

__all__ = ["aided_of"]

Array = NDArray[np.float64]

#: Points of the drawn drift.
POINTS = 600
#: Correlation time that flicker gets, as a part of the record: it needs one here.
PART = 0.1
#: Longest record that is filtered sample by sample.
MOST = 20_000_000


def aided_of(
    recording: Recording, channel: str, table: RateTable, solution: TableSolution, model: NoiseModel
) -> tuple[Aided, Array] | None:
    """The filtered record, and what is left of each stretch of the table; None where the model has no such filter."""
    slow = [t for t in model.terms if isinstance(t, (Flicker, GaussMarkov))]
    terms = tuple(t for t in model.terms if isinstance(t, (White, Flicker, GaussMarkov, RandomWalk)))
    walks = [t for t in terms if isinstance(t, RandomWalk)]
    if len(slow) != 1 or len(walks) > 1 or not any(isinstance(t, White) for t in terms):
        return None
    if not model.terms or recording.n_samples > MOST:
        return None
    rows = solution.rows
    left = rows.mean - solution.predicted()
    # One row for each block: the filter of the paper on means, in which the table's rate is exact.
    means = Recording.from_rate(
        np.where(rows.used, left, math.nan), rate=1 / rows.dt, unit="unknown", names=["left"]
    )
    T = None if isinstance(slow[0], GaussMarkov) else PART * recording.duration
    spread = max(float(np.nanstd(left)), 1e-300)
    filtered = reference_aided(
        means,
        replace(model, terms=terms, kind="unknown", alternative=None),
        reference=0.0,
        T=T,
        channel="left",
        prior=spread**2,
        exact=True,
    )
    drift = np.asarray(filtered.states.sum(axis=1))
    corrected = left - drift
    count = len(table.spans)
    raw_of, corrected_of = (
        _means(rows.span, rows.part, left, count),
        _means(rows.span, rows.part, corrected, count),
    )
    before, after = (_size(v) if isinstance(table, RateSteps) else math.nan for v in (raw_of, corrected_of))
    every = max(len(drift) // POINTS, 1)
    time: Array = (np.arange(len(drift), dtype=np.float64) + 0.5) * rows.dt
    fitted = solution.predicted()
    aided = Aided(
        time=_final(time[::every]),
        drift=_final(drift[::every]),
        raw=before,
        corrected=after,
        scale=_slope(solution, corrected + fitted) / rows.full_scale,
        scale_raw=_slope(solution, rows.mean) / rows.full_scale,
    )
    return aided, corrected_of


def _means(span: NDArray[np.int64], part: Array, values: Array, count: int) -> Array:
    used = (span >= 0) & np.isfinite(values)
    weight = np.bincount(span[used], part[used], count)
    total = np.bincount(span[used], (part * values)[used], count)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(total / weight)


def _size(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else math.nan


def _slope(solution: TableSolution, y: Array) -> float:
    """By least squares, beside a level and the shape of the fit."""
    rows = solution.rows
    used = rows.used & np.isfinite(y)
    weight = np.sqrt(rows.part[used])
    columns = [np.ones_like(y), rows.column(RATE), *(rows.straight(n) for n in solution.shape)]
    table = np.column_stack(columns)[used] * weight[:, None]
    return float(np.linalg.lstsq(table, y[used] * weight, rcond=None)[0][1])


def _final(values: Array) -> Array:
    out = np.array(values)
    out.flags.writeable = False
    return out
