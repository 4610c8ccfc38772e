# SPDX-License-Identifier: BSD-3-Clause
"""Rests of a unit that is held in the hand: it never stands still, but moves far less than on the way.

How much it moves is its level over windows of 0.4 s: the rms of the rates about their value at rest, and the rms of
the accelerations about their mean in the window. The levels of rests and of turns are two classes, which the split of
largest variance between them (Otsu) takes apart, in logarithms. The usual level of a rest is the median of those found
so; a rest is steady while both triads stay below `STEADY` times it, and half a window at either end is left out. So
the threshold is the record's own.

References
----------
.. [1] N. Otsu, "A threshold selection method from gray-level histograms", IEEE Trans. SMC 9 (1979) 62.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.static_spans.axes import UnitAxes, unit_axes
from allanite.experiments.static_spans.cells import ChannelCells, cut, runs
from allanite.experiments.static_spans.detection import level_of
from allanite.experiments.static_spans.results import MovingSpan, StaticSpan, StaticSpans
from allanite.recording.records import Kind, Recording

__all__ = ["STEADY", "find_held_spans"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Window of a level [s]; shortest rest [s].
WINDOW, SHORTEST = 0.4, 0.5
#: A rest is steady up to so many times the usual level.
STEADY = 4.0
#: Turns move at least so many times as much as rests, in the median: else there are no two classes.
APART = 4.0
#: A rest counts in the usual level by its length, but for no more than this [s]: one long rest on a table is no hand.
COUNTED = 5.0
#: Share of the record that moves least and shows the rates at rest.
STILL = 0.2


def find_held_spans(
    recording: Recording,
    *,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> StaticSpans:
    """Find the rests of a unit that a hand holds.

    Parameters
    ----------
    recording : Recording
        Of three gyros, three accelerometers, or both.
    gyro, accelerometer : sequence of str, optional
        The channels x, y, z: see `unit_axes`.

    Returns
    -------
    StaticSpans
        None of them where rests and turns are not two classes. No sample is missing within a span. `floor` holds the
        threshold of each channel.
    """
    axes = unit_axes(recording, gyro, accelerometer)
    cells = cut(recording, axes.names, lambda part: None)
    whole = (cells.count == cells.size).all(axis=1)
    levels = [
        _level(cells, whole, slice(3 * k, 3 * k + 3), name)
        for k, name in enumerate(_triads(axes.gyro, axes.accelerometer))
    ]
    usual = _usual(levels, cells.length)
    quiet = whole.copy()
    for level, floor in zip(levels, usual, strict=False):
        quiet &= level <= STEADY * floor
    least = SHORTEST / cells.length - 1e-9
    guard = round(WINDOW / 2 / cells.length)  # a hand that settles moves the means more than one that holds
    inner = [(a + guard, b - guard) for a, b in runs(quiet)] if usual else []
    spans = [(a, b) for a, b in inner if b - a >= least]
    per_triad = dict(zip(_triads(axes.gyro, axes.accelerometer), usual, strict=False))
    thresholds = {
        n: STEADY * per_triad[t] for t, names in axes.triads.items() if t in per_triad for n in names
    }
    return StaticSpans(
        rate=recording.rate,
        n_samples=recording.n_samples,
        spans=tuple(StaticSpan(start=a * cells.size, stop=b * cells.size) for a, b in spans),
        moving=_between(spans, cells, recording.n_samples),
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        source="detected",
        noise="record",
        shortest=SHORTEST,
        floor=thresholds,
        held=True,
        level=level_of(cells, _over(levels, usual)) if spans else None,
        findings=(_said(recording, thresholds, axes),) if spans else (),
    )


def _over(levels: Sequence[Array], usual: Sequence[float]) -> Array:
    """Level over threshold of the triad that moves more; NaN where samples are missing."""
    ratio = np.max([level / (STEADY * floor) for level, floor in zip(levels, usual, strict=True)], axis=0)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def _said(recording: Recording, thresholds: dict[str, float], axes: UnitAxes) -> str:
    """The threshold in words."""
    sizes = {Kind.RATE: (math.pi / 180, "deg/s"), Kind.ACCELERATION: (1.0, "m/s²")}
    parts = []
    for names in axes.triads.values():
        size, unit = sizes.get(recording[names[0]].kind, (1.0, recording[names[0]].unit or "counts"))
        parts.append(f"{thresholds[names[0]] / size:.2g} {unit}")
    return (
        f"held in the hand: a rest is what moves less than {' and '.join(parts)} (rms over {WINDOW:g} s), {STEADY:g} "
        "times as much as the usual rest of this record"
    )


def _triads(gyro: tuple[str, ...], accelerometer: tuple[str, ...]) -> list[str]:
    return ["gyro"] * bool(gyro) + ["accelerometer"] * bool(accelerometer)


def _level(cells: ChannelCells, whole: Mask, place: slice, name: str) -> Array:
    """Motion of a triad around each cell, shape (n,); infinite where samples are missing."""
    mean = np.where(whole[:, None], cells.mean()[:, place], 0.0)
    width = max(round(WINDOW / cells.length), 2)
    window = np.ones(width)

    def summed(values: Array) -> Array:
        return np.convolve(values, window, mode="same")

    count = np.maximum(summed(whole.astype(np.float64)), 1.0)
    first = np.stack([summed(v) for v in mean.T], axis=1) / count[:, None]
    spread = np.maximum(summed((mean**2).sum(axis=1)) / count - (first**2).sum(axis=1), 0.0)
    if name == "gyro" and whole.any():
        still = whole & (spread <= np.quantile(spread[whole], STILL))
        rest = np.median(mean[still], axis=0)
        spread = summed((np.where(whole[:, None], mean - rest, 0.0) ** 2).sum(axis=1)) / count
    return np.where(whole, np.sqrt(spread), np.inf)


def _usual(levels: Sequence[Array], length: float) -> list[float]:
    """Level of the usual rest for each triad; nothing where rests and turns are not apart."""
    known = np.isfinite(levels[0])
    for level in levels:
        known &= level > 0
    if np.count_nonzero(known) < 2 * WINDOW / length:
        return []
    quiet = known.copy()
    for level in levels:
        x = np.log(level[known])
        bar = _split(x)
        if np.median(x[x > bar]) - np.median(x[x <= bar]) < math.log(APART):
            return []
        quiet &= level <= math.exp(bar)
    rests = [(a, b) for a, b in runs(quiet) if (b - a) * length >= SHORTEST]
    if len(rests) < 2:
        return []
    weight = np.minimum([(b - a) * length for a, b in rests], COUNTED)
    out = []
    for level in levels:
        rest_levels = np.array([np.median(level[a:b]) for a, b in rests])
        order = np.argsort(rest_levels)
        reached = np.cumsum(weight[order]) >= 0.5 * weight.sum()
        out.append(float(rest_levels[order][int(np.argmax(reached))]))
    return out


def _split(x: Array) -> float:
    """The value that divides x into two classes with the largest variance between them [1]."""
    x = np.sort(x)
    n = np.arange(1, len(x))
    low = np.cumsum(x)[:-1]
    between = (low / n - (x.sum() - low) / (len(x) - n)) ** 2 * n * (len(x) - n)
    k = int(np.argmax(between))
    return float((x[k] + x[k + 1]) / 2)


def _between(spans: Sequence[tuple[int, int]], cells: ChannelCells, n_samples: int) -> tuple[MovingSpan, ...]:
    edges = [0, *(e * cells.size for span in spans for e in span), n_samples]
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return tuple(MovingSpan(start=a, stop=b, why="moving") for a, b in pairs if b > a)
