# SPDX-License-Identifier: BSD-3-Clause
"""What the environment may do to a signal: the columns of the regression, on blocks and at any instant.

    y(t) = level + drift t + c1 (T - r) + c2 (T - r)^2 + c3 dT/dt + h p(t) + sum of a exp(-t/T_w) + noise

A thermometer that follows the sensor with a lag L shows T(t - L) where the sensor feels T(t): to first order the bias
is then c1 (T + L dT/dt), so that a lag and a coefficient of the rate are one and the same column, L = c3/c1. For a
thermometer that is a first-order low-pass filter this is exact.

Hysteresis without regard to speed is a bias that depends on the branch: p is +1 after warming, -1 after cooling, and
runs from one to the other while the temperature comes back by a certain span (the play operator [1]). It stays
where it is while the temperature rests, which tells it from a lag.

References
----------
.. [1] M. A. Krasnosel'skii, A. V. Pokrovskii, "Systems with hysteresis" (1989), chapter 1: play.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.stability.environment.climate import Climate

__all__ = ["BRANCH", "DRIFT", "QUADRATIC", "RATE", "TEMPERATURE", "EnvironmentDesign", "WarmUpDecay", "play"]

Array = NDArray[np.float64]

TEMPERATURE, QUADRATIC, RATE, BRANCH, DRIFT = (
    "temperature",
    "temperature squared",
    "rate of temperature",
    "branch",
    "drift",
)
"""Names of the columns."""
#: The branches are told apart after a way back of this part of the span of the temperature.
WAY_BACK = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUpDecay:
    """A warm-up that dies away with the time constant T [s]; with `slope`, its derivative to ln T beside it.

    The derivative, as a column of its own, allows to first order for the error of a T that was fitted.
    """

    T: float
    slope: bool = False

    @property
    def name(self) -> str:
        """Of the amplitude at the first sample."""
        return f"warm-up {self.T:.4g} s"

    @property
    def names(self) -> tuple[str, ...]:
        """Of its columns."""
        return (self.name, f"{self.name}, time constant") if self.slope else (self.name,)

    def columns(self, t: Array) -> Array:
        """At times since the first sample [s], shape (n, 1 or 2)."""
        decay = np.exp(-t / self.T)
        return np.column_stack([decay, t / self.T * decay]) if self.slope else decay[:, None]


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentDesign:
    """Columns by name, and how to make them at any instant.

    Attributes
    ----------
    climate : Climate
    reference : float [K]
        r, above the mean temperature.
    decays : tuple of WarmUpDecay
    """

    climate: Climate
    reference: float = 0.0
    decays: tuple[WarmUpDecay, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All columns but the level."""
        columns = (
            (DRIFT,) if self.climate.thermometer is None else (DRIFT, TEMPERATURE, QUADRATIC, RATE, BRANCH)
        )
        return (*columns, *(name for decay in self.decays for name in decay.names))

    @property
    def blocks(self) -> Array:
        """The columns in the blocks, shape (n, k)."""
        return self.at(self.climate.middle)

    def at(self, t: Array) -> Array:
        """The columns at times since the first sample [s], shape (len(t), k).

        The temperature is interpolated between the middles of the blocks: what it does between them is noise.
        """
        climate = self.climate
        length = climate.size * climate.dt
        table = [(t / length - 0.5)[:, None]]
        if climate.thermometer is not None:
            warmth = climate.warmth
            rate = np.gradient(warmth, climate.dt)
            now = _between(t, climate.middle, warmth) - self.reference
            table.append(
                np.column_stack(
                    [
                        now,
                        now**2,
                        _between(t, climate.middle, rate),
                        np.interp(t, climate.middle, play(warmth)),
                    ]
                )
            )
        table += [decay.columns(t) for decay in self.decays]
        return np.concatenate(table, axis=1)


def _between(t: Array, middle: Array, values: Array) -> Array:
    """Linear between the middles, and on in a straight line over the half blocks at both ends."""
    between = np.interp(t, middle, values)
    for end, edge, other in ((t < middle[0], 0, 1), (t > middle[-1], -1, -2)):
        slope = (values[edge] - values[other]) / (middle[edge] - middle[other])
        between = np.where(end, values[edge] + slope * (t - middle[edge]), between)
    return between


def play(warmth: Array, part: float = WAY_BACK) -> Array:
    """The branch of each value: from -1 (cooling) to +1 (warming); `part` of the span leads from one to the other."""
    half = 0.5 * part * float(warmth.max() - warmth.min())
    if half == 0:
        return np.zeros_like(warmth)
    out, centre = np.empty_like(warmth), float(warmth[0])
    for i, value in enumerate(warmth.tolist()):
        centre = min(max(centre, value - half), value + half)
        out[i] = (value - centre) / half
    return out
