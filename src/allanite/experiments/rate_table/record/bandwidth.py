# SPDX-License-Identifier: BSD-3-Clause
"""Gain and phase at each frequency of a table that swings: one regression for each sinusoid."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from allanite.experiments.rate_table.motion import Sinusoids
from allanite.experiments.rate_table.record.rows import LAG, RATE, RegressionRows, SampleSelection
from allanite.experiments.rate_table.results import FrequencyPoint
from allanite.noise import NoiseModel
from allanite.recording.records import Recording

__all__ = ["frequency_response"]

#: Periods that are left out at the beginning of each sinusoid, and most of it that may be.
PERIODS, PART = 1.0, 0.25


def dead_time(table: Sinusoids, row: int) -> float:
    """Left out at the beginning of a sinusoid [s]."""
    length = float(table.stop[row] - table.start[row])
    return min(PERIODS / float(table.frequency[row]), PART * length)


def frequency_response(
    recording: Recording, channel: str, table: Sinusoids, window: SampleSelection, model: NoiseModel
) -> tuple[FrequencyPoint, ...]:
    """Every sinusoid that holds samples, by itself: a level, and the two waves in and out of phase."""
    points = []
    for row in range(len(table.start)):
        chosen = np.arange(len(table.start)) == row
        row_window = replace(window, chosen=chosen, dead_time=dead_time(table, row))
        spans, _ = row_window.spans(table)
        if not len(spans) or spans[0, 0] >= recording.duration or spans[0, 1] <= 0:
            continue
        rows = RegressionRows.of(recording, channel, table, row_window, model=model)
        # The derivative is a difference over two samples: what it loses of the cosine is known.
        frequency, step = float(table.frequency[row]), recording.dt
        whole = 2 * math.pi * frequency * float(np.sinc(frequency * step))
        design = np.column_stack([np.ones_like(rows.mean), rows.column(RATE), rows.column(LAG) / whole])
        fit = rows.regress(design, ("level", "sine", "cosine"), model)
        if fit.unbounded:
            continue
        a, b = fit.coefficients[1:] / rows.full_scale
        covariance = fit.covariance[1:, 1:] / rows.full_scale**2
        size = math.hypot(a, b)
        radial, around = np.array([a, b]) / size, np.array([-b, a]) / size**2
        points.append(
            FrequencyPoint(
                frequency=frequency,
                amplitude=float(table.amplitude[row]),
                gain=size,
                gain_sd=math.sqrt(float(radial @ covariance @ radial)),
                phase=math.atan2(b, a),
                phase_sd=math.sqrt(float(around @ covariance @ around)),
            )
        )
    return tuple(points)
