# SPDX-License-Identifier: BSD-3-Clause
"""What a search for north says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.north.circle import Arc
from allanite.experiments.north.tracks import Rotation
from allanite.experiments.reversals import Reversals
from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import ResidualTest

__all__ = ["EastWestNull", "NorthEstimate", "RunningNorth"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningNorth:
    """The estimate as the record grows.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
    azimuth, sd : ndarray, shape (n,) [rad]
        NaN and infinity until both components are seen; 0 to below 2 pi.
    horizontal_rate : ndarray, shape (n,) [rad/s]
    """

    time: Array
    azimuth: Array
    sd: Array
    horizontal_rate: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class NorthEstimate:
    """Where north is, as one horizontal axis or two saw it.

    Attributes
    ----------
    azimuth : float [rad]
        Of the table's mark, from north over east, 0 to below 2 pi; NaN where the design cannot tell it.
    sd : float [rad]
        Linear standard deviation by the noise, multiplied by `inflation`. The interval is not made of it: the two
        agree where the sd is small.
    total_sd : float [rad]
        With the stated uncertainties.
    interval : tuple of Arc
        Directions that the record does not contradict, at `confidence`: one arc, the whole circle, or, where one
        component alone is seen, two arcs (none where even the known rate of the Earth does not explain it).
    confidence : float
    verdict : str
        "north found", "no north", "not resolved", "inconsistent" or "inconsistent with Earth".
    reason : str
    inflation : float
        1, or the factor by which excess scatter or noise widens everything.
    signal_to_noise : float
        Length of the measured vector in standard deviations.
    horizontal_rate : float [rad/s]
        Length of the measured vector.
    horizontal_sd : float [rad/s]
        With the stated uncertainties.
    horizontal_interval : (float, float) [rad/s]
    expected_rate : float [rad/s]
        The Earth's rate times the cosine of the latitude.
    candidates : tuple of float [rad]
        The azimuth; the two under the known rate where one component alone is seen.
    biases : dict of str to (float, float) [rad/s]
        Level of each axis, and its standard deviation.
    budget : dict of str to float [rad]
        Standard uncertainties of the azimuth by source.
    running : RunningNorth
    checks : tuple of ResidualTest
    advice : tuple of str
    latitude : float [rad]
    axes : dict of str to float [rad]
        Channels, and the heading of each less that of the first.
    models : dict of str to NoiseModel
    reversals : Reversals or None
        The positions.
    rotation : Rotation or None
    duration, block : float [s]
        Of the record, and of the means that were regressed.
    source : str
    """

    azimuth: float
    sd: float
    total_sd: float
    interval: tuple[Arc, ...]
    confidence: float
    verdict: str
    reason: str
    inflation: float
    signal_to_noise: float
    horizontal_rate: float
    horizontal_sd: float
    horizontal_interval: tuple[float, float]
    expected_rate: float
    candidates: tuple[float, ...]
    biases: dict[str, tuple[float, float]]
    budget: dict[str, float] = field(default_factory=dict)
    running: RunningNorth = field(repr=False)
    checks: tuple[ResidualTest, ...] = ()
    advice: tuple[str, ...] = ()
    latitude: float
    axes: dict[str, float]
    models: dict[str, NoiseModel] = field(repr=False)
    reversals: Reversals | None = field(repr=False)
    rotation: Rotation | None
    duration: float
    block: float
    source: str

    @property
    def found(self) -> bool:
        """True when the azimuth is a measurement of north."""
        return self.verdict == "north found"

    def contains(self, azimuth: float) -> bool:
        """Does the interval hold this azimuth [rad]?"""
        return any(arc.contains(azimuth) for arc in self.interval)

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; numbers that do not exist are null."""
        names = (
            "source", "verdict", "reason", "azimuth", "sd", "total_sd", "confidence", "inflation", "signal_to_noise",
            "horizontal_rate", "horizontal_sd", "horizontal_interval", "expected_rate", "candidates", "biases",
            "budget", "checks", "advice", "latitude", "axes", "duration", "block", "running",
        )  # fmt: skip
        return {
            "format": "allanite-north",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in names},
            "interval": [arc.to_json() for arc in self.interval],
            "earth_rate": EARTH_RATE,
            "models": {name: model.to_json() for name, model in self.models.items()},
            "reversals": None if self.reversals is None else self.reversals.to_json(),
            "rotation": None if self.rotation is None else self.rotation.to_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class EastWestNull:
    """The rate that turning between east and west seems to show, where the Earth shows none.

    Attributes
    ----------
    value : float [rad/s]
        Bias that follows the turns: + pointing east, - pointing west. NaN where it cannot be told from the level.
    sd : float [rad/s]
        By the noise, multiplied by `inflation`.
    total_sd : float [rad/s]
        With the stated uncertainties: heading and tilt let some of the Earth in.
    interval : (float, float) [rad/s]
    confidence : float
    limit : float [rad/s]
        The larger end of the interval, without its sign: a bias beyond it is excluded.
    verdict : str
        "no bias that follows the turns", "a bias follows the turns", "inconsistent" or "not separable".
    reason : str
    inflation : float
    bias : (float, float) [rad/s]
        The level, and its standard deviation.
    budget : dict of str to float [rad/s]
    checks : tuple of ResidualTest
    advice : tuple of str
    latitude : float [rad]
    channel : str
    source : str
    """

    value: float
    sd: float
    total_sd: float
    interval: tuple[float, float]
    confidence: float
    limit: float
    verdict: str
    reason: str
    inflation: float
    bias: tuple[float, float]
    budget: dict[str, float] = field(default_factory=dict)
    checks: tuple[ResidualTest, ...] = ()
    advice: tuple[str, ...] = ()
    latitude: float
    channel: str
    source: str

    @property
    def error_of_rate(self) -> float:
        """What such a bias would add to an Earth rate measured between north and south, at most [rad/s]."""
        return self.limit / math.cos(self.latitude)

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; numbers that do not exist are null."""
        return {
            "format": "allanite-east-west-null",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in self.__dataclass_fields__},
            "error_of_rate": plain(self.error_of_rate),
        }
