# SPDX-License-Identifier: BSD-3-Clause
"""Attitude from two mean vectors: TRIAD, QUEST, and what the plain mean over the beginning would have said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.alignment.results import MOVED, CoarseAlignment, NaiveMean
from allanite.experiments.alignment.turns import Force, calibrated
from allanite.experiments.north.circle import Arc
from allanite.quantities.attitude import angles_of, axes_matrix, quest, triad
from allanite.quantities.earth import earth_rate_vector
from allanite.recording.calibration import TriadErrors
from allanite.recording.records import BLOCK, Recording

__all__ = ["NAIVE", "coarse_of", "mean_vector", "naive_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Length of the naive mean [s].
NAIVE = 300.0
_UP = np.array([0.0, 0.0, -1.0])


def coarse_of(
    force: Array, rate: Array, sds: tuple[float, float], latitude: float, axes: str
) -> tuple[CoarseAlignment, ...]:
    """TRIAD and QUEST of mean vectors in the axes of the sensor.

    Parameters
    ----------
    force, rate : ndarray, shape (3,)
    sds : (float, float)
        Of their directions [rad].
    """
    observations, known = np.stack([force, rate]), np.stack([_UP, earth_rate_vector(latitude)])
    weights = 1 / np.maximum(np.array(sds), 1e-12) ** 2
    out = []
    try:
        attitudes = {
            "TRIAD": triad(force, rate, known[0], known[1]),
            "QUEST": quest(observations, known, weights),
        }
    except InputError:  # parallel, or of no length: they say nothing
        return ()
    for name, attitude in attitudes.items():
        roll, pitch, heading = angles_of(attitude @ axes_matrix(axes).T)
        out.append(CoarseAlignment(name=name, roll=roll, pitch=pitch, heading=heading))
    return tuple(out)


def mean_vector(
    recording: Recording,
    channels: Sequence[str],
    errors: TriadErrors,
    stop: int,
    force: Force | None = None,
) -> Array:
    """Plain mean of the calibrated samples before `stop`."""
    total, count = np.zeros(3), 0
    for start in range(0, stop, BLOCK):
        rows = calibrated(recording, channels, errors, start, min(start + BLOCK, stop), force=force)
        rows = rows[~np.isnan(rows).any(axis=1)]
        total, count = total + rows.sum(axis=0), count + len(rows)
    return total / max(count, 1)


def naive_of(
    recording: Recording,
    channels: tuple[Sequence[str], Sequence[str]],
    errors: tuple[TriadErrors, TriadErrors],
    spans: Index,
    *,
    heading: float,
    interval: Arc,
    latitude: float,
    axes: str,
) -> NaiveMean | None:
    """The plain mean beside the heading that was found; channels and errors of gyros, then accelerometers."""
    stop = min(recording.n_samples, round(NAIVE * recording.rate))
    pull = partial(calibrated, recording, channels[1], errors[1])
    rate, force = (mean_vector(recording, c, e, stop, pull) for c, e in zip(channels, errors, strict=True))
    size = float(np.linalg.norm(rate)) * float(np.linalg.norm(force))
    alignments = coarse_of(force, rate, (1e-3, 1e-3), latitude, axes)
    if not alignments or not size > 0:
        return None
    rest = int(np.diff(np.clip(spans, 0, stop), axis=1).sum())
    moving = (stop - rest) / recording.rate
    away = abs(math.remainder(alignments[0].heading - heading, 2 * math.pi))
    if math.isnan(heading) or interval.full or interval.contains(alignments[0].heading):
        away = math.nan
    return NaiveMean(
        duration=stop / recording.rate,
        heading=alignments[0].heading,
        rate=float(np.linalg.norm(rate)),
        latitude=math.asin(min(max(float(rate @ force) / size, -1.0), 1.0)),
        moving=moving,
        away=away,
        flagged=moving > MOVED or not math.isnan(away),
    )
