# SPDX-License-Identifier: BSD-3-Clause
"""Noise of density f^-slope, for any slope near that of flicker: what a record is held against, not a term of a model.

References
----------
.. [1] N. Kasdin, "Discrete simulation of colored noise and stochastic processes and 1/f^alpha power law noise
   generation", Proc. IEEE 83 (1995) 802.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["PowerLaw"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerLaw:
    """Interval means of rate noise whose Allan variance is tau^(slope - 1) at tau in samples: 1 at one sample.

    The phase has the generalised covariance |t|^(slope + 1) / (2^(slope + 1) - 4), from which t^2 is taken, which no
    second difference sees; what is left tends to that of flicker, t^2 log t / (4 log 2), as the slope tends to 1.

    Attributes
    ----------
    slope : float
        Between 0 and 2, both excluded.
    """

    slope: float
    type: ClassVar[str] = "power_law"
    symbols: ClassVar[tuple[str, ...]] = ("P",)

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        """Of samples averaged over m of them; `dt` and `sampling` do not matter, as for flicker."""
        return np.asarray(np.asarray(m, dtype=np.float64) ** (self.slope - 1))

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        """Generalised covariance of the phase at a distance of t samples."""
        size = np.abs(t)
        logarithm = np.log(np.where(size == 0, 1.0, size))
        beyond = self.slope - 1
        if abs(beyond) < 1e-9:
            return np.asarray(size**2 * logarithm / (4 * math.log(2)))
        return np.asarray(size**2 * np.expm1(beyond * logarithm) / (4 * math.expm1(beyond * math.log(2))))
