# SPDX-License-Identifier: BSD-3-Clause
"""Means of a triad in each stand, and their covariance in the noise of each axis: all that a fit needs of a record.

What the gyros and accelerometers show is constant within a stand. The generalised least squares of any model that is
constant within stands is therefore that of the levels of the stands, if these come with their full covariance: nothing
is lost, and what follows works on a few numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError, LimitError
from allanite.experiments.rate_vector.levels import MOST_ROWS, LevelRows, levels_of_record
from allanite.filtering.block_means import block_means, longest_block
from allanite.filtering.regression import Whitener
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.recording.records import Kind, Recording, Sampling

__all__ = ["Blocks", "StandMeans", "blocks_of", "slope_of_temperature", "stand_means"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Most blocks of an axis.
MOST_BLOCKS = 2_000_000
#: Blocks in a stretch where no time lies between the stretches (see `allanite.experiments.north.tracks`).
PER_TOUCHING = 120


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocks:
    """Block means of the three axes of a triad.

    Attributes
    ----------
    dt : float [s]
    mean, part : ndarray, shape (n, 3)
        In the unit of the channels after their scale; NaN and 0 where nothing was measured at rest.
    span : ndarray of int64, shape (n,)
        -1 where there is none.
    time : ndarray, shape (n,) [s]
    sampling : "mean" or "point"
    """

    dt: float
    mean: Array = field(repr=False)
    part: Array = field(repr=False)
    span: Index = field(repr=False)
    time: Array = field(repr=False)
    sampling: Sampling


@dataclass(frozen=True, slots=True, kw_only=True)
class StandMeans:
    """Levels of a triad in each stand.

    Attributes
    ----------
    level : ndarray, shape (n_stands, 3)
    covariance : ndarray, shape (3, n_stands, n_stands)
        The axes are independent.
    chi2, dof : float
        Of the residuals within the stands, all axes whose noise is that of a model.
    models : tuple of NoiseModel
        Of each axis; white noise of the same size where it came from the record.
    running : tuple of (ndarray of bool, shape (n_stands,), ndarray, shape (3, seen), ndarray, shape (3, seen, seen))
        Stands seen before each checkpoint, their levels and covariance.
    """

    level: Array
    covariance: Array = field(repr=False)
    chi2: float
    dof: float
    models: tuple[NoiseModel, ...] = field(repr=False)
    running: tuple[tuple[NDArray[np.bool_], Array, Array], ...] = field(default=(), repr=False)


def blocks_of(
    recording: Recording,
    channels: Sequence[str],
    spans: Index,
    models: Sequence[NoiseModel | None],
    warmer: tuple[str, float, Array] | None,
) -> Blocks:
    """The blocks of three channels over spans at rest.

    Parameters
    ----------
    warmer : (str, float, ndarray, shape (3,)), optional
        Channel of the temperature, its reference, and the slope of each axis with it, which is removed.

    Raises
    ------
    LimitError
        More blocks than can be held.
    """
    size = _block_size(recording, spans, models)
    if recording.n_samples // size > MOST_BLOCKS:
        raise LimitError(f"{recording.n_samples // size} blocks are too many: take a part of the record")
    axis_blocks = [block_means(recording, name, size, spans) for name in channels]
    mean, part = (
        np.stack([b.mean for b in axis_blocks], axis=1),
        np.stack([b.part for b in axis_blocks], axis=1),
    )
    span = np.min([b.span for b in axis_blocks], axis=0)
    if warmer is not None:
        name, reference, slope = warmer
        mean = mean - (block_means(recording, name, size, spans).mean[:, None] - reference) * slope
    unusable = (span < 0) | np.isnan(mean).any(axis=1)
    mean[unusable], part[unusable] = np.nan, 0.0
    return Blocks(
        dt=axis_blocks[0].dt,
        mean=mean,
        part=part,
        span=np.where(unusable, -1, span),
        time=axis_blocks[0].time,
        sampling=recording[channels[0]].sampling if size == 1 else "mean",
    )


def _block_size(recording: Recording, spans: Index, models: Sequence[NoiseModel | None]) -> int:
    """Samples in a block; without a model, as many as leave the record's own noise its rows."""
    given = [m for m in models if m is not None]
    if len(given) < len(models):
        return max(-(-recording.n_samples // MOST_ROWS), 1)
    lengths = (spans[:, 1] - spans[:, 0]) / recording.rate
    dwell = float(np.quantile(lengths, 0.2))
    between = float(np.quantile(spans[1:, 0] - spans[:-1, 1], 0.2)) / recording.rate if len(spans) > 1 else 0
    room = dwell if len(spans) == 1 else max(between, dwell / PER_TOUCHING)
    length = min(*(longest_block(m, dwell) for m in given), room)
    return max(int(length * recording.rate), 1)


def slope_of_temperature(
    recording: Recording, slope: Array, reference: float | None
) -> tuple[str, float, Array] | None:
    """What has to be removed for the temperature; None where nothing.

    Raises
    ------
    InputError
        Slopes, and no channel of temperature or no reference.
    """
    if not slope.any():
        return None
    names = [c.name for c in recording.channels if c.kind is Kind.TEMPERATURE]
    if not names or reference is None:
        raise InputError(
            "the biases of this calibration depend on temperature: the recording needs a channel of it, and the "
            "calibration its reference"
        )
    return names[0], reference, slope


def stand_means(
    blocks: Blocks,
    stand_of_span: Index,
    channels: Sequence[str],
    models: Sequence[NoiseModel | None],
    checkpoints: Array | None = None,
) -> StandMeans:
    """Levels of each stand by generalised least squares.

    Parameters
    ----------
    stand_of_span : ndarray of int64, shape (n_spans,)
        -1: not used.
    checkpoints : ndarray, optional [s]
    """
    stand = np.where(blocks.span >= 0, stand_of_span[blocks.span], -1)
    n = int(stand_of_span.max()) + 1
    rows = np.zeros(0, np.int64) if checkpoints is None else np.searchsorted(blocks.time, checkpoints)
    axes = [
        _axis(blocks, i, stand, n, name, model, rows)
        for i, (name, model) in enumerate(zip(channels, models, strict=True))
    ]
    running = []
    for k in range(len(rows)):
        # an axis may have lost a stand to missing samples that the others have
        stand_mask = np.logical_and.reduce([a.running[k][0] for a in axes])
        parts = [a.running[k] for a in axes]
        keep = [stand_mask[p[0]] for p in parts]
        running.append(
            (
                stand_mask,
                np.stack([p[1][i] for p, i in zip(parts, keep, strict=True)]),
                np.stack([p[2][np.ix_(i, i)] for p, i in zip(parts, keep, strict=True)]),
            )
        )
    return StandMeans(
        level=np.stack([a.level for a in axes], axis=1),
        covariance=np.stack([a.covariance for a in axes]),
        chi2=sum(a.chi2 for a in axes),
        dof=sum(a.dof for a in axes),
        models=tuple(a.model for a in axes),
        running=tuple(running),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _StandAxis:
    level: Array
    covariance: Array
    chi2: float
    dof: float
    model: NoiseModel
    running: Sequence[tuple[NDArray[np.bool_], Array, Array]]


def _axis(
    blocks: Blocks, axis: int, stand: Index, n: int, name: str, model: NoiseModel | None, rows: Index
) -> _StandAxis:
    y, part = blocks.mean[:, axis], blocks.part[:, axis]
    used = (stand >= 0) & (part > 0)
    if len(np.unique(stand[used])) < n:
        raise InputError(f"channel {name!r} has no usable sample in one of the stretches at rest")
    if model is None:
        return _axis_of_record(blocks, axis, stand, n, name, rows)
    offset = float(y[used].mean())
    table = np.zeros((len(y), n + 1))
    table[used, stand[used]] = 1.0
    table[used, n] = y[used] - offset
    whitener = Whitener.of(
        model, dt=blocks.dt, counts=np.where(used, np.minimum(part, 1.0), 0.0), sampling=blocks.sampling
    )
    white = np.nan_to_num(whitener(table)[0])
    covariance, level = _solved(white.T @ white)
    residual = white[:, n] - white[:, :n] @ level
    return _StandAxis(
        level=level + offset,
        covariance=covariance,
        chi2=float(residual @ residual),
        dof=float(used.sum() - n),
        model=model,
        running=_running(white, rows, offset),
    )


def _solved(products: Array) -> tuple[Array, Array]:
    """Covariance and coefficients from the sums of products of columns and, last, the samples."""
    covariance = np.linalg.inv(products[:-1, :-1])
    covariance = 0.5 * (covariance + covariance.T)
    return covariance, covariance @ products[:-1, -1]


def _running(white: Array, rows: Index, offset: float) -> list[tuple[NDArray[np.bool_], Array, Array]]:
    """From sums of products that grow from one checkpoint to the next."""
    n = white.shape[1] - 1
    products, done, out = np.zeros((n + 1, n + 1)), 0, []
    for stop in rows.tolist():
        part = white[done:stop]
        products, done = products + part.T @ part, max(done, stop)
        stand_mask = np.diag(products)[:n] > 0
        kept = np.append(np.flatnonzero(stand_mask), n)
        covariance, level = (
            _solved(products[np.ix_(kept, kept)]) if stand_mask.any() else (np.zeros((0, 0)), np.zeros(0))
        )
        out.append((stand_mask, level + offset, covariance))
    return out


def _axis_of_record(blocks: Blocks, axis: int, stand: Index, n: int, name: str, rows: Index) -> _StandAxis:
    """In the noise that the record shows; as it grows, in white noise of the same size."""
    given = LevelRows(dt=blocks.dt, mean=blocks.mean, part=np.minimum(blocks.part, 1.0), pose=stand)
    record_levels = levels_of_record(given, axis, name)
    used = (stand >= 0) & (blocks.part[:, axis] > 0)
    time = np.bincount(stand[used], blocks.part[used, axis], n) * blocks.dt
    white = White(N=math.sqrt(float(np.mean(np.diag(record_levels.covariance) * time))))
    surrogate = _axis(blocks, axis, stand, n, name, NoiseModel.of(white), rows)
    return _StandAxis(
        level=record_levels.level,
        covariance=record_levels.covariance,
        chi2=0.0,
        dof=0.0,
        model=surrogate.model,
        running=surrogate.running,
    )
