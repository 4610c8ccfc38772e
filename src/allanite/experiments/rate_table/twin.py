# SPDX-License-Identifier: BSD-3-Clause
"""A twin of a run on a rate table: a record whose truth is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.motion import RateSteps, RateTable, TableClock
from allanite.filtering.simulation import simulate
from allanite.filtering.simulation.record import checked_seed
from allanite.noise import NoiseModel
from allanite.recording.records import ArrayColumn, Recording

__all__ = ["simulate_on_table"]

Array = NDArray[np.float64]


def simulate_on_table(
    model: NoiseModel,
    table: RateTable,
    *,
    rate: float,
    duration: float,
    seed: int | np.random.Generator,
    scale: float = 1.0,
    bias: float = 0.0,
    powers: Sequence[float] = (),
    asymmetry: float = 0.0,
    full_scale: float | None = None,
    offset: float = 0.0,
    drift: float = 0.0,
    settling: float = 0.0,
    limit: float | None = None,
    noise_growth: float = 0.0,
    **options: Any,
) -> Recording:
    """A record of a sensor on a rate table.

    Parameters
    ----------
    model : NoiseModel
        Noise model in SI of the channel.
    table : RateSteps, Sampled or Sinusoids
        Motion of the table.
    rate, duration : float [Hz], [s]
        Sample rate and length of the record.
    seed : int or Generator
        Seed of the samples, as for `simulate`.
    scale : float
        SI of the channel per rad/s.
    bias : float [SI of the channel]
        Bias of the sensor.
    powers : sequence of float
        Coefficients of the square, the cube, ... of the rate over full scale, relative to scale times full scale.
    asymmetry : float
        Scale factor of positive rates less that of negative ones, relative.
    full_scale : float, optional [rad/s]
        Full scale of the coefficients; by default that of the table.
    offset, drift : float [s], relative
        Offset and relative drift of the record's clock against the table's.
    settling : float [s]
        Time constant with which a step is reached.
    limit : float, optional [SI of the channel]
        Limit at which the converter clips.
    noise_growth : float
        White noise at full scale over that of the model, less one; in proportion to the rate.
    **options
        Those of `simulate`: `unit`, `name`, `sampling`.

    Returns
    -------
    Recording
        Recording with the truth in its history.
    """
    seed = checked_seed(seed)
    record = simulate(model, rate=rate, duration=duration, seed=seed, **options)
    facts = record.channels[0]
    clock = TableClock(offset=offset, drift=drift)
    t: Array = np.arange(record.n_samples, dtype=np.float64) / rate
    table_time = clock.table_time(t)
    table_rate = _seen(table, table_time, record.dt if facts.sampling == "mean" else 0.0, settling)
    whole = full_scale or table.full_scale
    u = table_rate / whole
    shape = u + asymmetry / 2 * np.abs(u) + sum(c * u**k for k, c in enumerate(powers, 2))
    noise = record.values(facts.name) * facts.scale
    if noise_growth:
        more = np.random.default_rng([seed, 1]).standard_normal(len(noise))
        size = math.sqrt(sum(term.N**2 for term in model.terms if hasattr(term, "N")) * rate)
        noise = noise + size * np.sqrt((1 + noise_growth * np.abs(u)) ** 2 - 1) * more
    y = bias + scale * whole * shape + noise
    if limit is not None:
        y = np.clip(y, -limit, limit)
    truth = {
        "step": "turn on a rate table",
        "scale": scale,
        "bias": bias,
        "powers": list(powers),
        "asymmetry": asymmetry,
        "offset": offset,
        "drift": drift,
        "table": table.to_json(),
    }
    return replace(
        record, columns=(ArrayColumn(y / facts.scale), *record.columns[1:]), history=(*record.history, truth)
    )


def _seen(table: RateTable, table_time: Array, wide: float, settling: float) -> Array:
    """Rate of the table at its own times, means over `wide` seconds; at rest before and after."""
    if isinstance(table, RateSteps):
        if wide:
            return (_angle(table, table_time + wide, settling) - _angle(table, table_time, settling)) / wide
        return (
            _angle(table, table_time + 1e-6, settling) - _angle(table, table_time - 1e-6, settling)
        ) / 2e-6
    inside = (table_time >= table.spans[0, 0]) & (table_time + wide <= table.spans[-1, 1])
    return np.where(inside, table.means(table_time, wide), 0.0)


def _angle(table: RateSteps, t: Array, settling: float) -> Array:
    """Angle of a table that takes each rate at the start of its step, as an exponential, and stops after the last."""
    start = np.append(table.start, table.stop[-1])
    target = np.append(table.rate, 0.0)
    rate, angle = np.zeros(len(start)), np.zeros(len(start))  # at the start of each
    for i in range(len(start) - 1):
        length = start[i + 1] - start[i]
        left = math.exp(-length / settling) if settling else 0.0
        rate[i + 1] = target[i] + (rate[i] - target[i]) * left
        angle[i + 1] = angle[i] + target[i] * length + (rate[i] - target[i]) * settling * (1 - left)
    at = np.maximum(np.searchsorted(start, t, side="right") - 1, 0)
    since = np.maximum(t - start[at], 0.0)
    out = angle[at] + target[at] * since
    if settling:
        out += (rate[at] - target[at]) * settling * -np.expm1(-since / settling)
    return np.asarray(out)
