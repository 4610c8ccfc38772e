# SPDX-License-Identifier: BSD-3-Clause
"""PositionPlan: the positions, what they will tell, and how other schemes compare."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain

__all__ = ["PlannedPosition", "PositionPlan", "Scheme"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedPosition:
    """One position.

    Attributes
    ----------
    number : int
        From 1, in order.
    words : str
    up : tuple of float, shape (3,)
        What points up, in the axes of the unit.
    attitude : tuple of float, shape (3,) [rad]
        Roll, pitch, heading of the axes of the unit as forward, right, down.
    dwell : float [s]
    """

    number: int
    words: str
    up: tuple[float, float, float]
    attitude: tuple[float, float, float]
    dwell: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheme:
    """A usual scheme beside the plan.

    Attributes
    ----------
    name : str
    positions : int
    total, dwell : float or None [s]
        When it reaches the goals, and with which dwell; None where it does not.
    worst : float or None
        Largest standard deviation over its goal in the time of the plan; None where that is too short for it.
    open : tuple of str
        Parameters that it does not determine.
    """

    name: str
    positions: int
    total: float | None
    dwell: float | None
    worst: float | None
    open: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionPlan:
    """Which positions, how long each.

    Attributes
    ----------
    what : "calibration" or "heading"
    positions : tuple of PlannedPosition
    turn : float [s]
        From the end of one rest to the beginning of the next.
    total : float [s]
    reached : bool
        The goals are reached.
    worst : float or None
        Largest standard deviation over its goal; None where one is infinite.
    goals : dict of str to float
        Wanted standard deviations: by parameter or kind of parameter ("gyro.scale"), or "heading" [rad].
    names : tuple of str
        Of the parameters; "heading", "roll", "pitch" of an alignment.
    sd : ndarray, shape (k,)
        Predicted; infinite where the positions do not determine it.
    covariance : ndarray, shape (k, k)
        Of the parameters of a calibration; of an alignment the diagonal.
    open : tuple of str
        Parameters that the positions do not determine.
    earth : bool
        The gyros see the Earth's rotation.
    totals : ndarray, shape (m,) [s]
        Lengths of record, all dwells stretched alike.
    groups : tuple of str
        Kinds of parameters.
    running : ndarray, shape (m, g)
        Largest standard deviation of each kind, by length of record.
    schemes : tuple of Scheme
    compared : dict of str to ndarray, shape (m,)
        Largest standard deviation over its goal, by length of record: of the plan ("this plan") and of each scheme.
    says : str
    notes : tuple of str
    latitude : float or None [rad]
    rate : float [Hz]
    models : dict of str to NoiseModel
    """

    what: Literal["calibration", "heading"]
    positions: tuple[PlannedPosition, ...]
    turn: float
    total: float
    reached: bool
    worst: float | None
    goals: Mapping[str, float]
    names: tuple[str, ...]
    sd: Array
    covariance: Array = field(repr=False)
    open: tuple[str, ...] = ()
    earth: bool = False
    totals: Array = field(repr=False)
    groups: tuple[str, ...] = field(repr=False)
    running: Array = field(repr=False)
    schemes: tuple[Scheme, ...] = field(repr=False)
    compared: Mapping[str, Array] = field(repr=False)
    says: str
    notes: tuple[str, ...] = ()
    latitude: float | None
    rate: float
    models: Mapping[str, NoiseModel] = field(repr=False)

    def table(self) -> list[dict[str, Any]]:
        """One row for each position: number, start, stop [s], what points up, roll, pitch, heading [rad]."""
        rows, start = [], 0.0
        for p in self.positions:
            roll, pitch, heading = p.attitude
            rows.append(
                {
                    "number": p.number,
                    "start": start,
                    "stop": start + p.dwell,
                    "position": p.words,
                    "roll": roll,
                    "pitch": pitch,
                    "heading": heading,
                }
            )
            start += p.dwell + self.turn
        return rows

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what is infinite."""
        names = (
            "what", "says", "notes", "reached", "worst", "total", "turn", "goals", "positions", "names", "sd",
            "covariance", "open", "earth", "totals", "groups", "running", "schemes", "compared", "latitude", "rate",
        )  # fmt: skip
        return {
            "format": "allanite-position-plan",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in names},
            "models": {name: model.to_json() for name, model in self.models.items()},
        }
