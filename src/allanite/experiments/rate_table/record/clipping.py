# SPDX-License-Identifier: BSD-3-Clause
"""Rates at which the sensor or its converter is at the end of its range: found in the samples, left out by name.

Samples that all have the largest value of the record are clipped, unless the record is so coarse that a good step has
them as well; then the step has to fall short of the line through the others, too. What is left out is chosen by the
rate of the table, never by the sample: choosing samples would bend the response.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.motion import RateSteps, RateTable
from allanite.experiments.rate_table.record.rows import SampleSelection
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Recording

__all__ = ["Clipped", "find_clipped"]

Array = NDArray[np.float64]

#: Part of the samples of a step, or of a record, at its largest value that makes a doubt; and least count.
SHARE, SHARE_OF_RECORD, COUNT = 0.02, 5e-4, 5
#: Different values over samples in a step below which the record is coarse.
COARSE = 0.2
#: A step falls short by more than this part of its rate.
SHORT = 0.003
#: What is left out begins a little below the rate at which clipping was seen.
ROOM = 0.98


@dataclass(frozen=True, slots=True, kw_only=True)
class Clipped:
    """What is beyond the range.

    Attributes
    ----------
    below, above : float [rad/s]
        Rates of the table beyond which samples are left out; infinite where there is no end.
    steps : ndarray of bool, shape (n_spans,)
        Steps that are left out whole.
    ends : (float or None, float or None)
        Values at which the record stops, below and above, in SI of the channel.
    """

    below: float
    above: float
    steps: NDArray[np.bool_]
    ends: tuple[float | None, float | None]

    @property
    def any(self) -> bool:
        """Anything is left out."""
        return bool(self.steps.any() or math.isfinite(self.below) or math.isfinite(self.above))


def find_clipped(recording: Recording, channel: str, table: RateTable, window: SampleSelection) -> Clipped:
    """Steps, or rates, at which the channel is clipped."""
    y = recording.values(channel)
    spans, numbers = window.spans(table)
    n_spans = len(table.spans)
    nothing = Clipped(
        below=-math.inf, above=math.inf, steps=np.zeros(n_spans, dtype=np.bool_), ends=(None, None)
    )
    if not np.isfinite(y).any() or not len(spans):
        return nothing
    ends = np.clip(np.round(spans * recording.rate), 0, len(y)).astype(np.int64)
    parts = [y[a:b][np.isfinite(y[a:b])] for a, b in ends]
    if isinstance(table, RateSteps):
        return _of_steps(table, numbers, parts, recording[channel].scale, nothing)
    return _of_samples(recording, channel, table, window, y, nothing)


def _of_steps(
    table: RateSteps, numbers: NDArray[np.int64], parts: list[Array], scale: float, nothing: Clipped
) -> Clipped:
    sizes = np.array([len(p) for p in parts])
    if not sizes.any():
        return nothing
    whole = np.concatenate(parts)
    limits = float(whole.min()), float(whole.max())
    if limits[0] == limits[1]:
        return nothing
    counts = np.array([[np.count_nonzero(p == limit) for limit in limits] for p in parts])
    with np.errstate(invalid="ignore"):
        doubt = (counts >= COUNT) & (counts >= SHARE * sizes[:, None])
    rates = table.rate[numbers]
    clear = ~doubt.any(axis=1) & (sizes > 0)
    if not doubt.any() or len(set(rates[clear].tolist())) < 2:
        return nothing
    means = np.array([p.mean() if len(p) else math.nan for p in parts])
    slope, level = np.polyfit(rates[clear], means[clear], 1)
    levels = np.unique(whole[:: max(len(whole) // 20000, 1)])
    grain = float(np.median(np.diff(levels))) if len(levels) > 1 else 0.0
    fine = (
        np.median([len(np.unique(p)) / len(p) for p, c in zip(parts, clear, strict=True) if c and len(p)])
        > COARSE
    )
    out, clipped_ends = nothing.steps.copy(), [False, False]
    for i in np.flatnonzero(doubt.any(axis=1)):
        for side, sign in enumerate((-1, 1)):
            expected = slope * rates[i] + level
            lacks = sign * (expected - means[i])
            short = lacks > max(SHORT * abs(slope * rates[i]), 3 * grain)
            if doubt[i, side] and (short or (fine and lacks > 0)):
                out[numbers[i]] = clipped_ends[side] = True
    low, high = (
        limit * scale if is_clipped else None for limit, is_clipped in zip(limits, clipped_ends, strict=True)
    )
    return Clipped(below=-math.inf, above=math.inf, steps=out, ends=(low, high))


def _of_samples(
    recording: Recording, channel: str, table: RateTable, window: SampleSelection, y: Array, nothing: Clipped
) -> Clipped:
    mean = recording[channel].sampling == "mean"
    t: Array = np.arange(len(y), dtype=np.float64) * recording.dt
    rate = table.means(window.clock.table_time(t), recording.dt if mean else 0.0)
    edges = window.spans(table)[0].ravel()
    inside = (np.searchsorted(edges, t, side="right") % 2 == 1) & np.isfinite(y)
    if not inside.any():
        return nothing
    below, above, ends = -math.inf, math.inf, [None, None]
    full = float(np.abs(rate[inside]).max())
    for side, limit in enumerate((float(y[inside].min()), float(y[inside].max()))):
        at = inside & (y == limit)
        count = int(at.sum())
        rates = rate[at]
        spread = float(np.ptp(rates)) if count else 0.0
        if count < max(COUNT, SHARE_OF_RECORD * inside.sum()) or spread < 0.01 * full:
            continue
        least = float(np.quantile(np.abs(rates), 0.05)) * ROOM
        if rates.mean() > 0:
            above = min(above, least)
        else:
            below = max(below, -least)
        ends[side] = limit * recording[channel].scale  # type: ignore[call-overload]
    return Clipped(below=below, above=above, steps=nothing.steps, ends=(ends[0], ends[1]))
