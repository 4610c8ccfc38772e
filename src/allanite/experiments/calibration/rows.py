# SPDX-License-Identifier: BSD-3-Clause
"""From rows of means, one for each position, to what is observed; and what tells their noise.

A mean has no record of its noise. A noise model and the averaging time give it, or standard deviations in the table;
else the scatter of the positions about the fit is all there is, with the degrees of freedom that the fit leaves.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.experiments.calibration.gathering import Gathered, unused_of
from allanite.experiments.calibration.verdict import CalibrationNoise
from allanite.experiments.static_spans import PositionMeans
from allanite.noise import NoiseModel, White
from allanite.recording.calibration import GYRO

__all__ = ["BETWEEN", "gather_rows", "noise_source", "row_edges"]

Array = NDArray[np.float64]

#: Resolution of time in rows [s], and the time from row to row where none is told.
GRID, BETWEEN = 1e-3, 60.0


def noise_source(
    means: PositionMeans, axes: Mapping[str, tuple[str, ...]], models: Mapping[str, NoiseModel] | None
) -> CalibrationNoise:
    """What tells the noise: the same for all triads.

    Raises
    ------
    InputError
        A model and no averaging time; standard deviations of one triad alone.
    """
    if models:
        if means.duration is None:
            raise InputError(
                "a noise model gives the noise of a mean by the time over which it was taken: say it with --averaging "
                "60s, or in a column duration"
            )
        return CalibrationNoise.GIVEN
    sensors_with_sd = [sensor for sensor, three in axes.items() if means.sds(three) is not None]
    if sensors_with_sd and len(sensors_with_sd) < len(axes):
        lacking = ", ".join(sensor for sensor in axes if sensor not in sensors_with_sd)
        raise InputError(
            f"the table has standard deviations of the {sensors_with_sd[0]}, and none of the {lacking}: give both, "
            "or leave one triad out (--channels)"
        )
    return CalibrationNoise.TABLE if sensors_with_sd else CalibrationNoise.SCATTER


def gather_rows(
    means: PositionMeans,
    axes: Mapping[str, tuple[str, ...]],
    *,
    models: Mapping[str, NoiseModel] | None,
    source: CalibrationNoise,
    temperature: str | None,
    without: Collection[int | tuple[int, int]],
    between: float = BETWEEN,
) -> Gathered:
    """Read the rows; `source` as of `noise_source`.

    Raises
    ------
    InputError
        Rows that do not exist, or turns to leave out: there is none.
    DataQualityError
        No row with a mean of every axis.
    """
    leave = {n for n in without if isinstance(n, int)}
    if any(not isinstance(n, int) for n in without):
        raise InputError("rows of means have no turns between them to leave out")
    if unknown := sorted(leave - set(range(1, means.n + 1))):
        raise InputError(f"there is no position {unknown[0]}; they are numbered from 1 to {means.n}")
    level = {sensor: means.means(three) for sensor, three in axes.items()}
    edges = row_edges(means, between)
    whole = {s: np.isfinite(v) * np.diff(edges, axis=1) for s, v in level.items()}
    unused = unused_of(whole, leave)
    use = np.array([k + 1 not in unused for k in range(means.n)], dtype=np.bool_)
    if not use.any():
        raise DataQualityError("no row has a mean of every axis")
    n, place = int(use.sum()), np.flatnonzero(use)
    nothing = np.zeros(0, dtype=np.int64)
    return Gathered(
        axes=dict(axes),
        edges=edges[use],
        numbers=tuple((place + 1).tolist()),
        unused=unused,
        means={s: v[use] for s, v in level.items()},
        whole={s: v[use].astype(np.float64) for s, v in whole.items()},
        coarse={s: _variances(means, three, place, source) for s, three in axes.items()},
        held=np.zeros((3, 0)),
        in_hand=False,
        restless=np.ones(n),
        wander=np.zeros((n, 3, 3)),
        temperature=None if temperature is None else means.means([temperature])[use, 0],
        before=nothing,
        after=nothing,
        motion=None,
        dropped={(k, k + 1): "no samples between" for k in range(n - 1)} if GYRO in axes else {},
        models=dict(
            models or {name: NoiseModel.of(White(N=0.0)) for three in axes.values() for name in three}
        ),
        given=source is CalibrationNoise.GIVEN,
        sampling=dict.fromkeys(axes, "mean"),
        rate=1 / GRID,
        n_samples=int(edges[-1, 1]),
    )


def row_edges(means: PositionMeans, between: float) -> NDArray[np.int64]:
    """Beginning and end of each position, shape (n, 2), in `GRID`."""
    start, duration = _times(means, between)
    return np.rint(np.stack([start, start + duration], axis=1) / GRID).astype(np.int64)


def _times(means: PositionMeans, between: float) -> tuple[Array, Array]:
    """Beginning and length of each position [s]; one after the other where the table does not tell."""
    duration = np.ones(means.n) if means.duration is None else means.duration
    if means.start is not None:
        return means.start - means.start[0], duration
    return np.concatenate([[0.0], np.cumsum(duration + between)[:-1]]), duration


def _variances(
    means: PositionMeans, three: tuple[str, ...], place: NDArray[np.int64], source: CalibrationNoise
) -> Array:
    """Covariance of the means besides that of a model, shape (3, n, n): of the table, and of its digits."""
    sds = means.sds(three) if source is CalibrationNoise.TABLE else None
    out = np.zeros((3, len(place), len(place)))
    for axis, name in enumerate(three):
        stated = np.zeros(len(place)) if sds is None else sds[place, axis] ** 2
        np.fill_diagonal(out[axis], stated + means.rounding(name))
    return out
