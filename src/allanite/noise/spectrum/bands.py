# SPDX-License-Identifier: BSD-3-Clause
"""Levels of a spectrum over bands of frequency, and the ratio of two of them.

The points of a spectrum are independent and chi-square. A weighted mean of them, each over a shape E that is known,

    L = sum of w_i S_i/E_i / sum of w_i,                                                                        (1)

is nearly chi-square with the degrees of freedom that its variance leaves [1]. Squares of the points estimate that
variance without bias if each is multiplied by d/(d + 2), d being its degrees of freedom:

    dof = (sum of x_i)^2 / sum of x_i^2/(d_i + 2) - 2,    x_i = w_i S_i/E_i,                                    (2)

which is d for a single point. The ratio of two levels of independent records is F-distributed.

References
----------
.. [1] F. E. Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bull. 2
   (1946) 110.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.periodogram import additive_dof
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.distributions import chi_square_quantile, f_quantile

__all__ = ["PER_DECADE", "MeanDensity", "amplitude_ratio", "band_edges", "band_of", "level", "widths"]

Array = NDArray[np.float64]

#: Bands per decade of frequency: a little more than an octave each.
PER_DECADE = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanDensity:
    """A mean of chi-square points.

    Attributes
    ----------
    value : float
    dof : float
    """

    value: float
    dof: float

    def interval(self, confidence: float) -> tuple[float, float]:
        """Ends of its chi-square interval."""
        tail = (1 - confidence) / 2
        low, high = (self.value * self.dof / chi_square_quantile(p, self.dof) for p in (1 - tail, tail))
        return low, high


def band_of(frequency: Array) -> NDArray[np.int64]:
    """Number of the band that each frequency [Hz] is in."""
    return np.asarray(np.floor(PER_DECADE * np.log10(frequency)), dtype=np.int64)


def band_edges(band: int) -> tuple[float, float]:
    """Ends of a band [Hz].

    >>> band_edges(3)[0], round(band_edges(3)[1], 3)
    (10.0, 21.544)
    """
    return 10 ** (band / PER_DECADE), 10 ** ((band + 1) / PER_DECADE)


def widths(spectrum: Spectrum) -> Array:
    """Bandwidth of each point [Hz]."""
    return np.asarray(np.diff(spectrum.bins, axis=1)[:, 0] * spectrum.resolution)


def level(spectrum: Spectrum, points: NDArray[np.bool_], shape: Array, weight: Array) -> MeanDensity | None:
    """The level of a spectrum without its lines over some of its points; None where there are none.

    Parameters
    ----------
    points : ndarray of bool, shape (n,)
    shape : ndarray, shape (n,)
        Density that a level of 1 stands for.
    weight : ndarray, shape (n,)
    """
    points = points & (shape > 0) & (spectrum.background > 0)
    if not points.any():
        return None
    dof = additive_dof(spectrum.edf[points], np.diff(spectrum.bins[points], axis=1)[:, 0])
    part = weight[points] * spectrum.background[points] / shape[points]
    total = float(part.sum())
    free = total**2 / float(np.sum(part**2 / (dof + 2))) - 2
    return MeanDensity(value=total / float(weight[points].sum()), dof=min(max(free, 1.0), float(dof.sum())))


def amplitude_ratio(one: MeanDensity, other: MeanDensity, confidence: float) -> tuple[float, float, float]:
    """Root of the ratio of two levels of independent records, with its interval."""
    tail = (1 - confidence) / 2
    ratio = one.value / other.value
    low, high = (ratio / f_quantile(p, one.dof, other.dof) for p in (1 - tail, tail))
    return math.sqrt(ratio), math.sqrt(low), math.sqrt(high)
