# SPDX-License-Identifier: BSD-3-Clause
"""How far the low-pass filter of a sensor bends its Allan variance, against what chance does to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.noise.spectrum.band_limit import short_lag_bend

if TYPE_CHECKING:
    from allanite.noise.spectrum.results import Spectrum

__all__ = ["TOLERANCE", "deviation_of_variance", "filter_bend", "shortest_trusted_tau"]

Array = NDArray[np.float64]

#: A lag is bent when a line or the band limit moves its AVAR by this share of its own standard deviation.
TOLERANCE = 0.3


def shortest_trusted_tau(spectrum: Spectrum) -> float:
    """Averaging time [s] from which on the sensor's filter leaves the Allan variance alone; 0 without a filter."""
    if spectrum.band_limit is None:
        return 0.0
    m = np.unique(np.geomspace(1, max(spectrum.n_samples // 8, 2), 200).astype(int))
    bent = filter_bend(spectrum, m) > TOLERANCE * deviation_of_variance(spectrum, m)
    last = int(np.flatnonzero(bent)[-1]) if bent.any() else -1
    return float(m[min(last + 1, len(m) - 1)] * spectrum.dt)


def filter_bend(spectrum: Spectrum, m: ArrayLike) -> Array:
    """What the filter takes from or adds to the Allan variance at m samples, without its sign."""
    m = np.asarray(m, dtype=np.float64)
    if spectrum.band_limit is None:
        return np.zeros_like(m)
    return np.abs(
        short_lag_bend(spectrum.band_limit, spectrum.frequency, spectrum.background, m, spectrum.dt)
    )


def deviation_of_variance(
    spectrum: Spectrum, m: ArrayLike, avar: ArrayLike | None = None, edf: ArrayLike | None = None
) -> Array:
    """Standard deviation of the Allan variance at m samples."""
    m = np.asarray(m, dtype=np.float64)
    variance = _avar(spectrum, m) if avar is None else np.asarray(avar, dtype=np.float64)
    dof = np.maximum(np.minimum(0.67, 1.2 / m) * spectrum.n_samples, 1.0) if edf is None else np.asarray(edf)
    return np.asarray(variance * np.sqrt(2 / dof))


def _avar(spectrum: Spectrum, m: Array) -> Array:
    """Allan variance of the background: 4 * integral of S(f) [sin^2(pi f m Ts)/(m sin(pi f Ts))]^2 df over its bins."""
    f = spectrum.frequency
    if len(f) < 2:
        return np.zeros_like(m)
    edges = np.concatenate([[0.0], np.sqrt(f[1:] * f[:-1]), [0.5 / spectrum.dt]])
    width, turns = np.diff(edges), np.outer(m, f * spectrum.dt)
    blur = np.outer(m, np.diff(edges) * spectrum.dt)  # sin^4 averaged over each bin
    fourth = (
        3 / 8
        - np.cos(2 * np.pi * turns) * np.sinc(blur) / 2
        + np.cos(4 * np.pi * turns) * np.sinc(2 * blur) / 8
    )
    shape = fourth / (m[:, None] * np.sin(np.pi * f * spectrum.dt)) ** 2
    return np.asarray(4 * shape @ (spectrum.background * width))
