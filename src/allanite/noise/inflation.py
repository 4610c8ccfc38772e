# SPDX-License-Identifier: BSD-3-Clause
"""What a noise model that lies above the sensor promises, and by how much it is inflated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.number_words import number
from allanite.quantities.result import Result

__all__ = ["Inflation"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Inflation(Result):
    """Promise of a bound, and its inflation.

    Attributes
    ----------
    probability : float
        Probability that the Allan deviation of the bound is above that of the sensor at all averaging times.
    shortest, horizon : float [s]
        The averaging times from which and to which it does.
    factors : mapping of str to float or None
        Factors of the amplitudes over the fit, by symbol; null for a term that the fit does not have.
    mean, greatest : float
        Factor of the deviation: on average over the logarithm of the averaging time, and at most.
    fitted : tuple of mapping
        The terms of the model below.
    """

    probability: float
    shortest: float
    horizon: float
    factors: Mapping[str, float | None]
    mean: float
    greatest: float
    fitted: tuple[Mapping[str, object], ...] = field(default=(), repr=False)

    @property
    def promise(self) -> str:
        """What the bound promises."""
        return (
            f"with probability {100 * self.probability:g} % the bound is above the sensor at all averaging times from "
            f"{self.shortest:.3g} to {self.horizon:.4g} s"
        )

    @property
    def extent(self) -> str:
        """How much the bound is inflated."""
        return f"{number(self.mean)} times the fit on average, {number(self.greatest)} times at most"

    @property
    def verdict(self) -> str:
        """The verdict of a model that is inflated."""
        return (
            f"Inflated: with probability {100 * self.probability:g} % its Allan deviation lies above that of the "
            f"sensor at every averaging time from {self.shortest:.3g} to {self.horizon:.3g} s; it is "
            f"{self.mean:.3g} times the fitted one on average over the logarithm of time, {self.greatest:.3g} times at "
            "most."
        )
