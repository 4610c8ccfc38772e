# SPDX-License-Identifier: BSD-3-Clause
"""Where the units of a fleet lie: the density of all of them, of profiles, beside that of the population.

The density of the units is the mean of what is known of each: its likelihood times the density of the population,
normalized. A unit that its logs resolve is a narrow peak at its value, one that gives an upper limit has the population
below that. The curve is smoothed by half of Silverman's width [1], so that few units are no comb. It lies on the
density of the population where that describes the units.

References
----------
.. [1] B. Silverman, "Density estimation for statistics and data analysis", Chapman and Hall 1986, eq. (3.31).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.evidence import Design
from allanite.stability.fleet.results import UnitDensity

__all__ = ["density_of"]

Array = NDArray[np.float64]

_POINTS = 161
_MOST = 1000  # logs that draw the curve of a large fleet
_BEYOND = 0.001  # of the population, on each side of the curve
_LEAST = 1e-9


def density_of(design: Design, draws: Draws) -> UnitDensity:
    """Of the logarithm of a coefficient."""
    design = design.thinned(_MOST) if len(design.unit) > _MOST else design
    x = _grid(design, draws)
    population = draws.density(x)
    each = _log_likelihood(design, draws, x) + np.log(np.maximum(population, 1e-300))
    weight = np.exp(each - each.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    width = max(_silverman(weight, x) / 2, x[1] - x[0])
    kernel = np.exp(-0.5 * ((x[:, None] - x) / width) ** 2)
    units = weight.mean(axis=0) @ (kernel / kernel.sum(axis=1, keepdims=True)) / (x[1] - x[0])
    return UnitDensity(x=np.exp(x), units=units, population=population)


def _grid(design: Design, draws: Draws) -> Array:
    """Over the population and the best values of the logs."""
    ends = [np.median(draws.quantile_of_units(share)) for share in (_BEYOND, 1 - _BEYOND)]
    best, precision = design.profiles.normal
    known = best[precision > 0]
    every = np.concatenate((ends, known)) if len(known) else np.asarray(ends)
    margin = 0.05 * max(float(np.ptp(every)), 1e-3)
    return np.linspace(every.min() - margin, every.max() + margin, _POINTS)


def _log_likelihood(design: Design, draws: Draws, x: Array) -> Array:
    """Of each unit at x, repeats integrated, shape (n_units, n_points)."""
    effects = design.covariates[:, 1:] @ draws.location[:, 1:].mean(axis=0)
    variance = np.full(len(effects), float(np.median(draws.scale("repeat"))) ** 2)
    profiles = design.profiles

    def at(point: float) -> Array:
        m = point + effects
        return profiles.tilted(m, variance).log_mass if variance[0] > _LEAST else -0.5 * profiles.root(m) ** 2

    return design.per_unit(np.array([at(float(point)) for point in x])).T


def _silverman(weight: Array, x: Array) -> float:
    """Width of a kernel, from the scatter of the means of the units."""
    means = weight @ x
    low, high = np.quantile(means, [0.25, 0.75])
    return float(0.9 * min(means.std(), (high - low) / 1.34) * len(means) ** -0.2)
