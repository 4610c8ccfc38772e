# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth's rotation says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.reversals import Reversals
from allanite.experiments.reversals.sides import is_vertical, part_seen
from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import ResidualTest
from allanite.quantities.units import STANDARD_GRAVITY

__all__ = [
    "G_SENSITIVITY",
    "AxisComponent",
    "DwellMean",
    "EarthRateEstimate",
    "RateReading",
    "RunningEstimate",
]

Array = NDArray[np.float64]

G_SENSITIVITY = "g-sensitivity"
"""Its name in the budget."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RateReading:
    """The Earth rate by one estimator from the means of the dwells.

    Attributes
    ----------
    name : str
        "pairs", the seed's north-south pairs, or "north-south-north", which cancels a drift; "up-down-up" of an axis
        that was turned over.
    rate : float [rad/s]
    sd : float [rad/s]
        Under the noise model.
    scatter : float or None [rad/s]
        Standard error from the scatter of the single values alone, taken for independent; None where they overlap.
    count : int
        Single values.
    """

    name: str
    rate: float
    sd: float
    scatter: float | None
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisComponent:
    """A number of the axis itself beside the one that is expected.

    Attributes
    ----------
    value, sd, expected : float
    interval : (float, float)
        At the confidence of the estimate.
    """

    value: float
    sd: float
    interval: tuple[float, float]
    expected: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DwellMean:
    """One dwell.

    Attributes
    ----------
    start, stop : float [s]
        Usable part, since the beginning of the record.
    sign : int
        +1 north or up, -1 south or down, 0 unknown.
    mean : float [rad/s]
    sd : float [rad/s]
        Of its white noise.
    residual : float [rad/s]
        Mean less bias, drift-free part and Earth: what is left of it after the fit.
    """

    start: float
    stop: float
    sign: int
    mean: float
    sd: float
    residual: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningEstimate:
    """The estimate as the record grows: one entry at the end of dwells.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
    rate, sd : ndarray, shape (n,) [rad/s]
        By regression; NaN and infinity until rate and bias can be told apart.
    pairs : ndarray, shape (n,) [rad/s]
        Mean of the pairs so far, NaN before the first.
    """

    time: Array
    rate: Array
    sd: Array
    pairs: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthRateEstimate:
    """The Earth's rotation as one axis saw it, with what speaks for and against the number.

    Attributes
    ----------
    rate : float [rad/s]
        NaN where rate and bias cannot be told apart.
    sd : float [rad/s]
        Standard deviation by the noise, multiplied by `inflation`.
    total_sd : float [rad/s]
        With the stated uncertainties.
    interval : (float, float) [rad/s]
        At `confidence`, from `total_sd`.
    confidence : float
    verdict : str
        "resolved", "not resolved", "inconsistent", "inconsistent with Earth" or "not separable"; "not separable from
        g-sensitivity" for a vertical axis whose g-sensitivity nobody stated.
    reason : str
        One or two sentences.
    inflation : float
        1, or the factor by which excess scatter or noise widens the interval.
    bias : (float, float) [rad/s]
        The constant of the record at its beginning, and its standard deviation; where the record has no reversals,
        the constant is bias and Earth together.
    nuisances : dict of str to (float, float)
        Other coefficients that were fitted, with their standard deviations.
    budget : dict of str to float [rad/s]
        Standard uncertainties by source.
    readings : tuple of RateReading
    running : RunningEstimate
    dwells : tuple of DwellMean
    checks : tuple of ResidualTest
    dead_times : ndarray, shape (n, 3) [s, rad/s, rad/s]
        The estimate and its standard deviation for other times left out after each turn.
    advice : tuple of str
    latitude : float [rad]
    first : str
        "north", "south", "up", "down", or "unknown": then the sign of the rate is a choice.
    model : NoiseModel
    model_source : str
        "given", or "this record": then fitted to it.
    reversals : Reversals
    duration : float [s]
    block : float [s]
        Length of the means that were regressed.
    """

    rate: float
    sd: float
    total_sd: float
    interval: tuple[float, float]
    confidence: float
    verdict: str
    reason: str
    inflation: float
    bias: tuple[float, float]
    nuisances: dict[str, tuple[float, float]] = field(default_factory=dict)
    budget: dict[str, float] = field(default_factory=dict)
    readings: tuple[RateReading, ...] = ()
    running: RunningEstimate
    dwells: tuple[DwellMean, ...] = field(repr=False)
    checks: tuple[ResidualTest, ...] = ()
    dead_times: Array = field(repr=False)
    advice: tuple[str, ...] = ()
    latitude: float
    first: str
    model: NoiseModel = field(repr=False)
    model_source: str
    reversals: Reversals = field(repr=False)
    duration: float
    block: float
    channel: str
    source: str

    @property
    def deviation(self) -> float:
        """Distance from the known rate of the Earth, in total standard deviations."""
        return (self.rate - EARTH_RATE) / self.total_sd

    @property
    def projection(self) -> float:
        """Part of the Earth's rotation along the axis where it points north, or up."""
        return part_seen(self.first, self.latitude)

    @property
    def component(self) -> AxisComponent:
        """What the axis saw of the Earth where it points north, or up [rad/s]; the latitude is no part of it."""
        sd = self._sd_without("latitude") * abs(self.projection)
        return self._with_interval(self.rate * self.projection, sd, EARTH_RATE * self.projection)

    @property
    def g_sensitivity(self) -> AxisComponent | None:
        """Of a vertical axis [rad/s/(m/s^2)], under the known rate of the Earth; None for a level axis."""
        if not is_vertical(self.first):
            return None
        along = self.projection / STANDARD_GRAVITY
        sd = self._sd_without(G_SENSITIVITY) * abs(along)
        return self._with_interval((self.rate - EARTH_RATE) * along, sd, 0.0)

    @property
    def bounds_sum(self) -> bool:
        """True where the rate is that of the Earth and a g-sensitivity that nobody stated, together."""
        return is_vertical(self.first) and not self.budget.get(G_SENSITIVITY)

    def _sd_without(self, source: str) -> float:
        return math.sqrt(sum(v**2 for k, v in self.budget.items() if k != source))

    def _with_interval(self, value: float, sd: float, expected: float) -> AxisComponent:
        half = sd * (self.interval[1] - self.interval[0]) / 2 / self.total_sd
        return AxisComponent(value=value, sd=sd, interval=(value - half, value + half), expected=expected)

    @property
    def resolved(self) -> bool:
        """True when the rate is a measurement of the Earth's rotation."""
        return self.verdict == "resolved"

    def reading(self, name: str) -> RateReading | None:
        """One of the simple estimators, or None where the record does not allow it."""
        return next((r for r in self.readings if r.name == name), None)

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; numbers that do not exist are null."""
        return {
            "format": "allanite-earth-rate",
            "version": 1,
            **{
                name: plain(getattr(self, name))
                for name in (
                    "source", "channel", "verdict", "reason", "rate", "sd", "total_sd", "interval", "confidence",
                    "inflation", "bias", "nuisances", "budget", "readings", "checks", "advice", "latitude", "first",
                    "model_source", "duration", "block", "dwells", "running", "component", "g_sensitivity",
                )
            },
            "earth_rate": EARTH_RATE,
            "dead_times": plain(self.dead_times),
            "model": self.model.to_json(),
            "reversals": self.reversals.to_json(),
        }  # fmt: skip
