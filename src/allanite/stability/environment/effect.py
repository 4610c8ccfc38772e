# SPDX-License-Identifier: BSD-3-Clause
"""What is removed from a recording, sample by sample, as it is read: no copy of a long record is made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.recording.sample_columns import Calculated, Column
from allanite.stability.environment.design import EnvironmentDesign

__all__ = ["Effect", "Freed"]

Array = NDArray[np.float64]
#: Samples that are made at once.
ROWS = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """The part of a signal that the environment makes, as a function of time.

    Attributes
    ----------
    design : EnvironmentDesign
    names : tuple of str
        Columns of the design that make it.
    values : ndarray, shape (k,)
    """

    design: EnvironmentDesign = field(repr=False)
    names: tuple[str, ...]
    values: Array

    def part(self, names: Iterable[str]) -> Effect:
        """What some of the columns make."""
        wanted = set(names)
        kept = [i for i, name in enumerate(self.names) if name in wanted]
        return replace(self, names=tuple(self.names[i] for i in kept), values=self.values[kept])

    def __call__(self, t: Array) -> Array:
        """At times since the first sample [s], in SI, with a mean of zero over the record."""
        picked = [self.design.names.index(n) for n in self.names]
        columns = self.design.at(t)[:, picked] - self.design.blocks[:, picked].mean(axis=0)
        total = np.zeros(
            len(t)
        )  # column by column: the same to the last bit, however a record is cut into blocks
        for column, value in zip(columns.T, self.values, strict=True):
            total += value * column
        return total


@dataclass(frozen=True, slots=True)
class Freed(Calculated):
    """A column less an effect.

    Attributes
    ----------
    of : Column
    effect : Effect
    scale : float
        SI value of one sample unit.
    dt : float [s]
    delay : float
        Where in its interval a sample stands: 0.5 for means, 0 for points.
    """

    of: Column
    effect: Effect
    scale: float
    dt: float
    delay: float

    @property
    def origin(self) -> float:
        return self.of.origin

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> Array:
        samples = np.array(self.of.read(start, min(stop, len(self))))
        for first in range(0, len(samples), ROWS):
            part = samples[first : first + ROWS]
            t = np.asarray(
                (np.arange(start + first, start + first + len(part)) + self.delay) * self.dt, dtype=np.float64
            )
            part -= self.effect(t) / self.scale
        return samples
