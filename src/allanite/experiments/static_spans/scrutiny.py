# SPDX-License-Identifier: BSD-3-Clause
"""Spans without a spread that are no rest all the same: frozen samples, even rotations, a hand that holds still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.static_spans.axes import UnitAxes
from allanite.experiments.static_spans.cells import ChannelCells, runs
from allanite.experiments.static_spans.scan import RestScan
from allanite.quantities.earth import EARTH_RATE

__all__ = ["FLAT", "frozen", "held", "smooth", "turning"]

Array = NDArray[np.float64]
Spans = Sequence[tuple[int, int]]

#: Samples that repeat in one axis for so long [s] are no measurement, where noise moves them elsewhere.
STUCK = 0.3
#: A mean is off beyond so many of the usual deviations, and beyond this part of the largest rate.
OFF, PART = 6.0, 0.01
#: Variance over a sixteen times longer mean, over that of the shorter, from which it does not fall as noise does. White
#: noise: 1/16; flicker: 1.
FLAT = 0.5
#: Length of the means whose differences are compared [s], and fewest of them.
SWAY, LEAST = 0.4, 12
#: Share of the accelerometers' wander that follows the gyros, from which it is motion; and the chance of that.
FOLLOWED, CHANCE = 0.3, 1e-6


def frozen(cells: ChannelCells, spans: Spans) -> list[tuple[int, int]]:
    """Spans in which an axis repeats one value far longer than it does in the others."""
    if not spans:
        return []
    steps = np.array([cells.steps[a:b].sum(axis=0) for a, b in spans])
    share = np.array([cells.equal[a:b].sum(axis=0) for a, b in spans]) / np.maximum(steps, 1)
    usual = (share * steps).sum(axis=0) / steps.sum(axis=0)
    noisy = (np.median(share, axis=0) < 0.5) & (usual < 0.9)
    frozen_spans = []
    width = max(round(STUCK / cells.length), 2)
    for a, b in spans:
        still = (cells.equal[a:b] == cells.steps[a:b]) & (cells.steps[a:b] > 0) & noisy
        for axis in still.T:
            frozen_spans += [(a + i, a + j) for i, j in runs(axis) if j - i >= width]
    return frozen_spans


def turning(cells: ChannelCells, rest_scan: RestScan, axes: UnitAxes, spans: Spans) -> list[tuple[int, int]]:
    """Spans whose mean rate is off that of most of the time, by more than the bias of a sensor wanders.

    How much it wanders the spans show themselves, by the median; and nothing below a hundredth of the largest rate of
    the record counts, which needs no unit.
    """
    if len(spans) < 3 or not axes.gyro:
        return []
    rates = _span_means(cells, spans)[:, :3]
    length = np.array([b - a for a, b in spans]) * cells.length
    level = _weighted_median(rates, length)
    size = np.linalg.norm(rates - level, axis=1)
    usual = float(np.median(size)) / 0.6745
    noise = float(np.linalg.norm(rest_scan.white[:3])) / np.sqrt(length)
    with np.errstate(invalid="ignore"):
        largest = float(np.nanmax(np.linalg.norm(cells.mean()[:, :3] - level, axis=1)))
    off = (size > OFF * (usual + noise) + 2 * EARTH_RATE) & (size > PART * largest)
    return [span for span, is_off in zip(spans, off.tolist(), strict=True) if is_off]


def held(cells: ChannelCells, rest_scan: RestScan, axes: UnitAxes, spans: Spans) -> bool:
    """True when the accelerometers wander as the gyros turn: what passes for noise is motion.

    In each span the change of the mean force is regressed on the angle turned by the gyros, in each axis; at rest both
    are noise of different sensors and know nothing of each other. Units, biases and scale factors do not matter.
    """
    if not (axes.gyro and axes.accelerometer):
        return False
    m = max(round(SWAY / cells.length), 1)
    explained = total = dof = rest = 0.0
    for a, b in spans:
        n = (b - a) // m
        if n - 1 < LEAST:
            continue
        means = cells.mean(a, a + n * m).reshape(n, m, -1).mean(axis=1)
        if np.isnan(means).any():
            continue
        change = np.diff(means[:, 3:], axis=0)
        turned = 0.5 * (means[1:, :3] + means[:-1, :3])
        turned = turned - turned.mean(axis=0)
        change = change - change.mean(axis=0)
        scale = np.linalg.norm(change, axis=0)
        scale[scale < rest_scan.tolerance[3:] * np.sqrt(len(change))] = (
            0.0  # steps of the samples, not of the unit
        )
        basis, values, _ = np.linalg.svd(turned, full_matrices=False)
        basis = basis[:, values > 1e-9 * values[0]] if values[0] > 0 else basis[:, :0]
        part = (basis.T @ change)[:, scale > 0] / scale[scale > 0]
        weight = len(change)
        explained += weight * float((part**2).sum())
        total += weight * part.shape[1]
        dof += basis.shape[1] * part.shape[1]
        rest += (len(change) - 1 - basis.shape[1]) * part.shape[1]
    if total == 0 or rest <= 0:
        return False
    share = explained / total
    adjusted = 1 - (1 - share) * (dof + rest) / rest
    return bool(adjusted > FOLLOWED and _tail(share, dof, rest) < CHANCE)


def smooth(rest_scan: RestScan) -> bool:
    """True when no axis has noise that falls over longer means: what is left of the record is slow motion."""
    known = np.isfinite(rest_scan.fall) & ~rest_scan.counted
    return bool(np.count_nonzero(known) >= 3 and (rest_scan.fall[known] > FLAT).all())


def _tail(share: float, dof: float, rest: float) -> float:
    """Chance of explaining this share of noise by noise: Fisher's law in its beta form."""
    from scipy.special import betainc

    return float(betainc(0.5 * rest, 0.5 * dof, 1 - share))


def _span_means(cells: ChannelCells, spans: Spans) -> Array:
    return np.array([cells.total[a:b].sum(axis=0) / cells.count[a:b].sum(axis=0) for a, b in spans])


def _weighted_median(values: Array, weight: Array) -> Array:
    """Median of each column by weight."""
    out = np.zeros(values.shape[1])
    for i, column in enumerate(values.T):
        order = np.argsort(column)
        reached = np.cumsum(weight[order]) >= 0.5 * weight.sum()
        out[i] = column[order][int(np.argmax(reached))]
    return out
