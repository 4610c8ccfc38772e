# SPDX-License-Identifier: BSD-3-Clause
"""Was the unit put down or held in the hand? And the rests that follow.

A hand tilts the unit as the gyros turn. Over each rest the change of the specific force f from one mean to the next is
compared with what the gyros predict of it, -w x f, in every axis; at rest both are noise of different sensors. One
correlation coefficient over all rests decides, whatever the units of the channels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.experiments.static_spans.axes import UnitAxes, unit_axes
from allanite.experiments.static_spans.cells import ChannelCells, cut
from allanite.experiments.static_spans.detection import find_static_spans
from allanite.experiments.static_spans.hand import find_held_spans
from allanite.experiments.static_spans.results import StaticSpans
from allanite.noise import NoiseModel
from allanite.recording.records import Recording

__all__ = ["find_rests", "held_by_hand"]

Array = NDArray[np.float64]

#: Means that are compared [s]; this part of a rest at either end is left out; fewest means of a rest.
MEAN, ENDS, LEAST = 0.2, 0.1, 4
#: The forces follow the gyros from this coefficient on, and from so many standard deviations of chance.
FOLLOWS, CHANCE = 0.2, 2.5
#: Rests that are missed by more than this part of their time were not put down.
MISSED = 0.5
#: A direction is covered when a rest comes this near: cosine of 60 deg.
NEAR = 0.5


def find_rests(
    recording: Recording,
    *,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
) -> StaticSpans:
    """Find the rests of a unit that was put down, or held in the hand.

    They are those of `find_held_spans` where the forces follow the gyros (`held_by_hand`), where nothing is quite at
    rest or less than half of the time that is held steadily, or where a half axis has a steady rest and none at rest.

    Parameters
    ----------
    recording : Recording
        Recording of the unit.
    gyro, accelerometer : sequence of str, optional
        Three channels each, by axis; by default the only ones of their kind.
    model : NoiseModel or mapping of channel name to NoiseModel, optional
        Noise models as for `find_static_spans`.
    """
    still = find_static_spans(recording, gyro=gyro, accelerometer=accelerometer, model=model)
    held = find_held_spans(recording, gyro=gyro, accelerometer=accelerometer)
    axes = unit_axes(recording, gyro, accelerometer)
    if not len(held):
        return still
    if held_by_hand(recording, axes, held.array) or _missed(still.array, held.array) > MISSED:
        return held
    return held if _uncovered(recording, axes, still.array, held.array) else still


def held_by_hand(recording: Recording, axes: UnitAxes, spans: ArrayLike) -> bool:
    """True when the accelerometers tilt as the gyros turn within spans, shape (n, 2) [samples]."""
    edges = np.asarray(spans, dtype=np.int64).reshape(-1, 2)
    if not (axes.gyro and axes.accelerometer and len(edges)):
        return False
    cells = cut(recording, axes.names, lambda part: None)
    places = np.clip(-(-edges // cells.size), 0, cells.n)
    center = _center(recording, axes, edges)
    parts = [p for a, b in places.tolist() if (p := _followed(cells, center, a, b)) is not None]
    if not parts:
        return False
    both, predicted, measured, count = np.sum(parts, axis=0).tolist()
    if not predicted * measured > 0:
        return False
    coefficient = both / math.sqrt(predicted * measured)
    return bool(coefficient > max(FOLLOWS, CHANCE / math.sqrt(count)))


def _followed(cells: ChannelCells, center: Array, a: int, b: int) -> tuple[float, float, float, float] | None:
    """Products of predicted and seen changes of the force within cells a to b, and their number."""
    cut_off = int((b - a) * ENDS)
    size = max(round(MEAN / cells.length), 1)
    n = (b - a - 2 * cut_off) // size
    if n < LEAST:
        return None
    mean = cells.mean(a + cut_off, a + cut_off + n * size).reshape(n, size, -1).mean(axis=1)
    if np.isnan(mean).any():
        return None
    turned, force = mean[:, :3] - mean[:, :3].mean(axis=0), mean[:, 3:] - center
    change = np.diff(force, axis=0)
    change = change - change.mean(axis=0)
    predicted = -np.cross((turned[1:] + turned[:-1]) / 2, force.mean(axis=0))
    return (
        float((predicted * change).sum()),
        float((predicted**2).sum()),
        float((change**2).sum()),
        2.0 * (n - 2),
    )


def _missed(still: NDArray[np.int64], held: NDArray[np.int64]) -> float:
    """Part of the time that is held steadily in spans of which less than half is at rest."""
    if not len(still):
        return 1.0
    common = np.minimum(held[:, None, 1], still[None, :, 1]) - np.maximum(held[:, None, 0], still[None, :, 0])
    length = held[:, 1] - held[:, 0]
    lost = np.maximum(common, 0).sum(axis=1) < 0.5 * length
    return float(length[lost].sum() / length.sum())


def _uncovered(
    recording: Recording, axes: UnitAxes, still: NDArray[np.int64], held: NDArray[np.int64]
) -> bool:
    """Whether a half axis of the accelerometers has a steady rest near and none at rest."""
    if not axes.accelerometer:
        return False
    center = _center(recording, axes, held)
    reached = [_reached(_means(recording, axes, edges) - center) for edges in (still, held)]
    return bool((reached[1] & ~reached[0]).any())


def _reached(force: Array) -> NDArray[np.bool_]:
    up = force / np.linalg.norm(force, axis=1, keepdims=True)
    return np.concatenate([(up > NEAR).any(axis=0), (up < -NEAR).any(axis=0)])


def _center(recording: Recording, axes: UnitAxes, edges: NDArray[np.int64]) -> Array:
    """Near the readings of no force: the middle of the range of the means, for samples in counts."""
    means = _means(recording, axes, edges)
    return np.asarray((means.min(axis=0) + means.max(axis=0)) / 2) if len(means) > 3 else np.zeros(3)


def _means(recording: Recording, axes: UnitAxes, edges: NDArray[np.int64]) -> Array:
    y = np.stack([recording.scaled(n) for n in axes.accelerometer], axis=-1)
    means = [np.nanmean(y[a:b], axis=0) for a, b in edges.tolist() if np.isfinite(y[a:b]).any(axis=0).all()]
    return np.array(means).reshape(-1, 3)
