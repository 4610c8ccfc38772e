# SPDX-License-Identifier: BSD-3-Clause
"""Equally likely draws of a population: its location and scales, its next unit, its quantiles and shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.stability.fleet.evidence import WIDE
from allanite.stability.fleet.posterior import Posterior

__all__ = ["DRAWS", "Draws"]

Array = NDArray[np.float64]

DRAWS = 4096


class Draws:
    """Equally likely draws of all that a fleet leaves open."""

    def __init__(self, posterior: Posterior) -> None:
        rng = np.random.default_rng(952)
        edges = np.cumsum(posterior.weight) / posterior.weight.sum()
        self.index = np.searchsorted(edges, (np.arange(DRAWS) + 0.5) / DRAWS).clip(0, len(edges) - 1)
        self.rng, self.posterior = rng, posterior
        z = rng.standard_normal((DRAWS, posterior.location.shape[1]))
        self.location = posterior.location[self.index] + np.einsum(
            "npq,nq->np", posterior.root[self.index], z
        )

    def scale(self, level: str) -> Array:
        """Of a level, or the share of the wide part."""
        values: Array = np.asarray([getattr(s, level) for s in self.posterior.scales], dtype=np.float64)
        return np.asarray(values[self.index])

    def lots(self) -> Array:
        """l, shape (n_draws, n_lots)."""
        step = max(1, self.posterior.lots.shape[1] // 16)
        few = self.index[::step]
        away = self.location[::step] - self.posterior.location[few]
        noise = self.rng.standard_normal((len(few), self.posterior.lots.shape[1]))
        lean = np.einsum("njp,np->nj", self.posterior.lot_lean[few], away)
        return np.asarray(self.posterior.lots[few] - lean + self.posterior.lot_sd[few] * noise)

    def next_unit(self) -> Array:
        """x of a unit yet to come, from a lot yet to come."""
        wide = self.rng.random(DRAWS) < self.scale("wide")
        unit = self.scale("unit") * np.where(wide, WIDE, 1.0) * self.rng.standard_normal(DRAWS)
        return np.asarray(self.location[:, 0] + self.scale("lot") * self.rng.standard_normal(DRAWS) + unit)

    def quantile_of_units(self, share: float) -> Array:
        """x below which this share of all units lies, of each draw, by bisection."""
        parts = narrow, _, _ = self._parts()
        low, high = -40.0 * np.ones(DRAWS), 40.0 * np.ones(DRAWS)
        for _ in range(50):
            z = 0.5 * (low + high)
            below = self._share_beyond(self.location[:, 0] + narrow * z, *parts) > 1 - share
            low, high = np.where(below, z, low), np.where(below, high, z)
        return np.asarray(self.location[:, 0] + narrow * 0.5 * (low + high))

    def share_beyond(self, x: float | Array) -> Array:
        """Share of all units above x, of each draw."""
        return self._share_beyond(x, *self._parts())

    def _share_beyond(self, x: float | Array, narrow: Array, broad: Array, wide: Array) -> Array:
        from scipy.special import ndtr

        distance = self.location[:, 0] - x
        inner, outer = (ndtr(distance / np.maximum(sd, 1e-300)) for sd in (narrow, broad))
        return np.asarray((1 - wide) * inner + wide * outer)

    def density(self, x: Array) -> Array:
        """Of all units at x, the mean over all draws."""
        narrow, broad, wide = (np.maximum(part[::8, None], 1e-12) for part in self._parts())
        distance = x - self.location[::8, :1]
        inner, outer = (np.exp(-0.5 * (distance / sd) ** 2) / sd for sd in (narrow, broad))
        return np.asarray(((1 - wide) * inner + wide * outer).mean(axis=0) / np.sqrt(2 * np.pi))

    def _parts(self) -> tuple[Array, Array, Array]:
        """Standard deviations of the narrow and the wide part of all units, and the share of the wide part."""
        lot, unit, wide = (self.scale(name) for name in ("lot", "unit", "wide"))
        return np.hypot(lot, unit), np.hypot(lot, WIDE * unit), wide
