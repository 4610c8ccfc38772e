# SPDX-License-Identifier: BSD-3-Clause
"""What the accelerometers beside a gyro say of its turns: a sensor that was turned over reverses gravity with each.

A turn about the vertical leaves gravity where it is. A gyro that is turned over hardly sees it, as any that is turned
across its axis: its turns look too small, and nothing is wrong with it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.reversals.sides import First
from allanite.experiments.reversals.turns import Position
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.result import Result
from allanite.recording.records import Kind, Recording

__all__ = ["TurnedOver", "turned_over"]

#: Half of the change of an accelerometer, at the least, and the scatter about it, at most [m/s^2]: the sensor leans by
#: less than 45 deg.
CHANGE, SCATTER = 7.0, 2.0
_AXIS = re.compile(r"[xyz](?=_?\d*$)", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnedOver(Result):
    """An accelerometer whose sign changes with each turn.

    Attributes
    ----------
    channel : str
        The accelerometer.
    along : bool
        By its name it lies along the axis of the gyro, which pointed up and down then.
    first : "up" or "down"
        Where that axis pointed to begin with, if the accelerometer reads +g with its axis up.
    means : (float, float) [m/s^2]
        In the positions like the first one, and in the others.
    """

    channel: str
    along: bool
    first: First
    means: tuple[float, float]

    @property
    def says(self) -> str:
        """What it shows."""
        there, back = self.means
        return f"{self.channel} goes from {there:+.1f} to {back:+.1f} m/s² and back with the turns"


def turned_over(recording: Recording, channel: str, positions: Sequence[Position]) -> TurnedOver | None:
    """Whether gravity was reversed with the axis of a gyro, from one position to the next; None where nothing says so.

    Parameters
    ----------
    recording : Recording
        With the accelerometers, if there are any.
    channel : str
        The gyro.
    positions : sequence of Position
    """
    placed = [p for p in positions if p.sign and p.stop > p.start]
    if not {-1, 1} <= {p.sign for p in placed}:
        return None
    axis = _axis_of(channel)
    names = [c.name for c in recording.channels if c.kind is Kind.ACCELERATION]
    along = [name for name in names if axis and _axis_of(name) == axis]
    for name in along or names:
        means = _means(recording, name, placed)
        if means is not None:
            first: First = "up" if means[0] > 0 else "down"
            return TurnedOver(channel=name, along=bool(along), first=first, means=means)
    return None


def _axis_of(name: str) -> str:
    match = _AXIS.search(name)
    return match[0].lower() if match else ""


def _means(recording: Recording, name: str, placed: Sequence[Position]) -> tuple[float, float] | None:
    """Means of an accelerometer in both directions [m/s^2], where gravity alone makes them."""
    values = np.array([_median(recording.scaled(name, p.start, p.stop)) for p in placed])
    like = np.array([p.sign == placed[0].sign for p in placed])
    if not (np.isfinite(values[like]).any() and np.isfinite(values[~like]).any()):
        return None
    here, there = (float(np.nanmean(values[side])) for side in (like, ~like))
    scatter = np.nanstd(values - np.where(like, here, there))
    return (here, there) if abs(here - there) / 2 >= CHANGE and scatter <= SCATTER else None


def _median(values: NDArray[np.float64]) -> float:
    present = values[np.isfinite(values)]
    return float(np.median(present)) if len(present) else np.nan
