# SPDX-License-Identifier: BSD-3-Clause
"""Is the sensor filtered below half its sample rate?

A sum of noise terms with power-law densities is log-convex: the logarithm of its density against the logarithm of
the frequency lies above each of its tangents. Only a low-pass bends it below. So: where the spectrum has a plateau,
and its end at the Nyquist frequency lies clearly below the tangent of the plateau, the sensor is band limited.

A Gauss-Markov term whose correlation time is no longer than two or three samples looks the same, and is the same thing
to the Allan variance of short lags: it is called a band limit too. One pole of less than 0.4 samples goes unseen: it
takes less than a tenth of the density at the Nyquist frequency.

Further down, a longer Gauss-Markov term bends the spectrum as well, and one pole of a filter is one. But no noise term
falls faster than the random walk: the density over that of a random walk rises with the frequency for every term, and
so for every sum of them. A plateau past which the spectrum falls faster is the work of a filter of two poles or more,
or of a moving average.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["BandLimit", "find_band_limit", "short_lag_bend"]

Array = NDArray[np.float64]

#: A plateau is flat over half a decade, between these shares of the Nyquist frequency.
LOWEST, HIGHEST, DECADES = 1 / 60, 1 / 2, 0.5
#: It may begin down here, where fewer points tell its slope, when the spectrum falls from it faster than a random walk.
LOWEST_STEEP, SLOPE_SD_STEEP = 1 / 1000, 0.4
#: Slopes in log-log that count as a plateau, and how well the slope must be known.
FLATTEST, STEEPEST, SLOPE_SD = 0.1, -0.35, 0.1
#: Points of a plateau lie within so many standard deviations, or this share, of its line.
SIGMAS, SHARE = 4.0, 0.08
#: The end of the spectrum, over the Nyquist frequency.
TOP = 0.85
#: It lies below the tangent by this factor at least (folding at the Nyquist frequency alone takes 0.95 from a plateau
#: with as much flicker as `STEEPEST` lets pass), and by so many standard deviations.
DROP, CERTAINTY = 0.9, 5.0
#: Faster than a random walk: so many points together lie below as many at a lower frequency by this factor at least
#: (both over a random walk), and at less than this share of the plateau.
TOGETHER, FALL, FALLEN = 3, 0.7, 0.5
#: Nothing past the plateau of such a filter stands above it by more than this factor, and nothing before it lies below
#: the share `FALLEN` of it: that would be a hump.
HUMP = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class BandLimit:
    """A spectrum that falls toward the Nyquist frequency from a plateau.

    Attributes
    ----------
    plateau : float
        Density of the plateau: N^2 of the white noise before the filter.
    begins : float [Hz]
        Middle of the plateau.
    corner : float [Hz]
        Frequency at which the density is half that of the plateau; beyond the Nyquist frequency, that of a one-pole
        filter.
    """

    plateau: float
    begins: float
    corner: float


def find_band_limit(frequency: Array, density: Array, edf: Array, nyquist: float) -> BandLimit | None:
    """The band limit of a spectrum without lines, or None.

    Parameters
    ----------
    frequency, density, edf : ndarray, shape (n,)
        Log-binned spectrum up to the Nyquist frequency.
    nyquist : float [Hz]
    """
    good = (density > 0) & (frequency > LOWEST_STEEP * nyquist)
    x, y = np.log(frequency[good] / nyquist), np.log(density[good])
    sd = np.sqrt(2 / edf[good])
    top = x > math.log(TOP)
    if not top.any():
        return None
    end = _mean(x[top], y[top], sd[top])
    tangents = [t for t in _plateaus(x, y, sd) if t.above(end)]
    high = [t for t in tangents if t.begins > math.log(LOWEST) and t.slope_sd <= SLOPE_SD]
    if high:
        tangent = min(high, key=lambda t: abs(t.slope))
    else:
        low = [t for t in tangents if _falls_steeply(t, x, y, sd)]
        if not low:
            return None
        tangent = min(low, key=lambda t: abs(t.slope) + t.slope_sd)
    return BandLimit(
        plateau=math.exp(tangent.level),
        begins=math.exp(tangent.middle) * nyquist,
        corner=_corner(x, y, tangent, end) * nyquist,
    )


def _plateaus(x: Array, y: Array, sd: Array) -> list[_Tangent]:
    span = DECADES * math.log(10)
    starts = x[x <= math.log(HIGHEST) - span]
    windows = ((x >= start) & (x <= start + span) for start in starts)
    return [t for w in windows if (t := _Tangent.through(x[w], y[w], sd[w]))]


def _falls_steeply(tangent: _Tangent, x: Array, y: Array, sd: Array) -> bool:
    """Past its plateau the spectrum falls faster than a random walk, and the plateau is no hump."""
    line = tangent.level + tangent.slope * np.maximum(x - tangent.middle, 0.0)
    past, before = x >= tangent.middle, x < tangent.begins
    if np.any(y[past] - line[past] > math.log(HUMP) + SIGMAS * sd[past]):
        return False
    if before.sum() >= TOGETHER:
        rise, known = _running((y - line)[before], sd[before])
        if np.any(rise < math.log(FALLEN) - SIGMAS * known):
            return False
    x, y, sd, line = x[past], y[past], sd[past], line[past]
    phase = np.pi / 2 * np.exp(x)
    # Means of a random walk: its values at instants fall slower.
    walk = np.log((2 + np.cos(2 * phase)) / np.sin(phase) ** 2)
    over, known = _running(y - walk, sd)
    below, _ = _running(y - line, sd)
    certainty = CERTAINTY * np.hypot(known[:, None], known)
    falls = over[:, None] - over > certainty - math.log(FALL)
    falls &= below < math.log(FALLEN) - CERTAINTY * known
    return bool(np.triu(falls, TOGETHER).any())


def _running(y: Array, sd: Array) -> tuple[Array, Array]:
    """Means of `TOGETHER` neighbours, and their standard deviations."""
    ones = np.ones(TOGETHER)
    weight = np.convolve(1 / sd**2, ones, mode="valid")
    return np.convolve(y / sd**2, ones, mode="valid") / weight, 1 / np.sqrt(weight)


@dataclass(frozen=True, slots=True)
class _Tangent:
    begins: float
    middle: float
    level: float
    slope: float
    level_sd: float
    slope_sd: float

    @classmethod
    def through(cls, x: Array, y: Array, sd: Array) -> _Tangent | None:
        """The line through a plateau; None where the points are no plateau."""
        if len(x) < 4:
            return None
        middle, level, level_sd = _mean(x, y, sd)
        weight = (x - middle) / sd**2
        size = float(weight @ (x - middle))
        slope, slope_sd = float(weight @ y) / size, 1 / math.sqrt(size)
        rest = np.abs(y - level - slope * (x - middle))
        known = slope_sd <= SLOPE_SD_STEEP and STEEPEST <= slope <= FLATTEST
        flat = known and np.all(rest < np.maximum(SIGMAS * sd, SHARE))
        return cls(float(x[0]), middle, level, slope, level_sd, slope_sd) if flat else None

    def above(self, end: tuple[float, float, float]) -> bool:
        """The point `end` (x, y, sd of y) lies clearly below the line."""
        x, y, sd = end
        drop = self.level + self.slope * (x - self.middle) - y
        drop_sd = math.hypot(sd, self.level_sd, self.slope_sd * (x - self.middle))
        return drop > -math.log(DROP) + CERTAINTY * drop_sd


def _mean(x: Array, y: Array, sd: Array) -> tuple[float, float, float]:
    weight = 1 / sd**2
    total = float(weight.sum())
    return float(weight @ x) / total, float(weight @ y) / total, 1 / math.sqrt(total)


def _corner(x: Array, y: Array, tangent: _Tangent, end: tuple[float, float, float]) -> float:
    half = tangent.level - math.log(2)
    above = np.flatnonzero((y > half) & (x > tangent.middle))
    last = int(above[-1]) if len(above) else 0
    if end[1] < half and len(above) and last + 1 < len(x):
        share = (y[last] - half) / (y[last] - y[last + 1])
        return math.exp(x[last] + share * (x[last + 1] - x[last]))
    return math.exp(end[0]) / math.sqrt(math.expm1(tangent.level - end[1]))


def short_lag_bend(limit: BandLimit, frequency: Array, density: Array, m: Array, dt: float) -> Array:
    """AVAR that the filter takes from samples averaged over m of them: what a white plateau would give, less what is.

    Above the plateau the density differs from it by d(f), and AVAR by 4 * integral of
    d(f) [sin^2(pi f m dt)/(m sin(pi f dt))]^2 df up to the Nyquist frequency, humps included (with their sign).
    """
    f = np.linspace(limit.begins, 0.5 / dt, 4097)
    lost = limit.plateau - np.exp(
        np.interp(np.log(f), np.log(frequency), np.log(np.maximum(density, 1e-300)))
    )
    x = np.pi * f * dt
    shape = (np.sin(np.outer(m, x)) ** 2 / (np.asarray(m)[:, None] * np.sin(x))) ** 2
    return np.asarray(4 * np.trapezoid(lost * shape, f, axis=1))
