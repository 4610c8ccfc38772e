# SPDX-License-Identifier: BSD-3-Clause
"""The share of all units beyond a limit, and how far the limit lies from the middle.

Each draw of the population has a share above the limit and an index, the distance of the limit from the median over
that of the 99.865 % quantile, both of the logarithm [1]. For normal units that is (ln L - mu) / (3 tau), Cpk of an
upper limit. What the logs leave open of middle and spreads is therefore in both intervals.

References
----------
.. [1] ISO 22514-2:2017, "Statistical methods in process management - Capability and performance - Part 2: Process
   capability and performance of time-dependent process models", quantile method.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.quantity import Quantity
from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.results import Capability

__all__ = ["capability_of"]

Array = NDArray[np.float64]

_THREE_SIGMA = 0.9986501019683699  # of a normal distribution, below three standard deviations


def capability_of(draws: Draws, limit: float, confidence: float, content: float) -> Capability:
    """What the draws of a population say of an upper limit.

    Parameters
    ----------
    draws : Draws
        Of the population.
    limit : float [SI]
        Largest value that a unit may have.
    confidence : float
        Of the intervals.
    content : float
        Share of the units that must keep the limit.
    """
    x, middle = math.log(limit), draws.location[:, 0]
    reach = np.maximum(draws.quantile_of_units(_THREE_SIGMA) - middle, 1e-12)
    return Capability(
        limit=limit,
        allowed=1.0 - content,
        share=_summary(draws.share_beyond(x), confidence),
        index=_summary((x - middle) / reach, confidence),
    )


def _summary(values: Array, confidence: float) -> Quantity:
    """Median and interval of equally likely values."""
    low, median, high = np.quantile(values, [0.5 - confidence / 2, 0.5, 0.5 + confidence / 2])
    return Quantity.of(float(median), (float(low), float(high)), "1")
