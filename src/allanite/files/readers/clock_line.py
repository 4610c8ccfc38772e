# SPDX-License-Identifier: BSD-3-Clause
"""The straight line behind time stamps: their slope against the sample number, and how much it bends.

Wild stamps do not count. Where samples are missing, and where the clock fell back, is known beforehand (`Marks`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.filled_stamps import BLOCK, CACHED, Filled
from allanite.files.readers.late_stamps import InTime
from allanite.files.readers.rate_change import RateChange, kink
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.sums import sum_of_products

__all__ = ["ClockLine", "Marks", "fit_line"]

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

_PARTS = 256  # of the stamps, of each of which a median is taken
_ENOUGH = 1024  # stamps for a median
_FEWEST_PARTS = 16  # medians from which a bend of the clock is told


@dataclass(frozen=True, slots=True)
class Marks:
    """What one pass over the stamps has found, at interval numbers (interval k lies between k and k + 1)."""

    gaps: _Ints  # intervals that hold missing samples
    missing: _Ints  # how many
    shifts: _Ints  # intervals where the clock fell back for good
    offsets: _Floats  # by how much [s], negative
    loose: bool = False  # gaps end beside the grid: the stamps behind one tell nothing of the rate before it


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockLine:
    """Least-squares line through stamps.

    Attributes
    ----------
    interval : float [s]
        Slope: time from sample to sample.
    change_ppm, change_error_ppm : float or None
        Change of the rate from the first stamp to the last and its standard error; None where nothing can be said:
        too few stamps, or the clock was set.
    kink : RateChange or None
        The rate changes once, by more than clocks do.
    wander : float [s]
        How far stamps lie from the line, by medians of parts: single late ones do not count.
    """

    interval: float
    change_ppm: float | None
    change_error_ppm: float | None
    kink: RateChange | None
    wander: float


def fit_line(stamps: Filled | InTime, marks: Marks, interval: float, ticks: bool) -> ClockLine:
    """The line through stamps whose interval is nearly known.

    Parameters
    ----------
    interval : float [s]
        First estimate.
    ticks : bool
        The stamps come in bursts or from a coarse clock: only those count that follow a jump.
    """
    places, level, whole = _levels(stamps, marks, interval, ticks)
    if len(places) == 0:
        return ClockLine(interval=interval, change_ppm=None, change_error_ppm=None, kink=None, wander=0.0)
    line = _fitted(stamps, marks, interval, ticks, places, level)
    change, wander = None, 0.0
    rest = (level - (line - interval) * places)[whole]
    if len(rest) and not (len(marks.shifts) or marks.loose):  # the bend would be that of the step
        change = _bend(places[whole], rest, line)
        wander = float(np.abs(rest - np.median(rest)).max())
    return ClockLine(
        interval=line,
        change_ppm=None if change is None else change[0],
        change_error_ppm=None if change is None else change[1],
        kink=None if len(marks.shifts) else kink(places[whole], (level + interval * places)[whole]),
        wander=wander,
    )


def slope(x: _Floats, y: _Floats) -> float:
    """Least-squares slope of y against x."""
    x = x - x.mean()
    return float(x @ (y - y.mean()) / (x @ x))


def _placed(
    stamps: Filled | InTime, marks: Marks, interval: float, ticks: bool, thin: int = 1, most: int = BLOCK
) -> Iterator[tuple[_Floats, _Floats]]:
    """Blocks of (position on the grid, stamp - interval * position), steps of the clock taken out.

    Every `thin`-th stamp; of stamps in bursts, or coarser than the samples, those that follow a jump.
    """
    gained = np.cumsum(marks.missing)
    fallen = np.cumsum(marks.offsets)
    for first, count, block in stamps.blocks(0, 0, most):
        block = block if first + count + 1 == len(stamps) else block[:-1]
        k = np.arange(first, first + len(block), thin)
        if ticks:
            ticked = np.flatnonzero(np.diff(block) > interval) + 1
            k, block = k[ticked], block[ticked]
        position = k.astype(np.float64)
        if len(gained):
            at = np.searchsorted(marks.gaps, k)
            position += np.where(at > 0, gained[at - 1], 0)
        residual = block[::thin] - interval * position
        if len(fallen):
            at = np.searchsorted(marks.shifts, k)
            residual -= np.where(at > 0, fallen[at - 1], 0.0)
        yield position, residual


def _levels(
    stamps: Filled | InTime, marks: Marks, interval: float, ticks: bool
) -> tuple[_Floats, _Floats, NDArray[np.bool_]]:
    """Medians of position and of residual, part by part, and which parts are whole ones."""
    size = max(len(stamps) // _PARTS, 16)
    thin = 1 if ticks else max(size // _ENOUGH, 1)
    x, y, whole = [], [], []
    for position, residual in _placed(stamps, marks, interval, ticks, thin):
        step = max(len(position) * size // stamps.block, 1) if ticks else size // thin
        x += _part_medians(position, step)
        y += _part_medians(residual, step)
        full = len(position) // step
        whole += [k < full for k in range(-(-len(position) // step))]
    return np.concatenate([*x, []]), np.concatenate([*y, []]), np.array(whole, dtype=bool)


def _part_medians(values: _Floats, step: int) -> list[_Floats]:
    """Medians of the parts of `step` values, all whole ones at once, and then of what is left."""
    full, thin = len(values) // step * step, max(step // _ENOUGH, 1)
    whole, rest = values[:full].reshape(-1, step)[:, ::thin], values[full:][::thin]
    return [np.median(part, axis=1) for part in (whole, rest[np.newaxis]) if part.size]


def _fitted(
    stamps: Filled | InTime, marks: Marks, interval: float, ticks: bool, places: _Floats, level: _Floats
) -> float:
    """Least-squares slope of the stamps against their positions, wild stamps left out."""
    intercept, rise, spread = _robust_line(places, level)
    centre = places[len(places) // 2]
    sums = np.zeros(5)
    for position, e in _placed(stamps, marks, interval, ticks, most=CACHED):
        e -= intercept + rise * position
        typical = float(np.median(np.abs(e[:: len(e) // 4096 + 1]))) if len(e) else 0.0
        good = np.abs(e) <= 8.0 * spread + 0.05 * interval + 8.0 * typical
        position -= centre
        u, e = (position, e) if good.all() else (position[good], e[good])
        sums += np.array([len(u), u.sum(), sum_of_products(u, u), e.sum(), sum_of_products(u, e)])
    count, su, suu, se, sue = sums
    denominator = count * suu - su * su
    return interval + rise + (float((count * sue - su * se) / denominator) if denominator > 0 else 0.0)


def _bend(places: _Floats, level: _Floats, interval: float) -> tuple[float, float] | None:
    """Change of the rate from end to end and its standard error [ppm], by the bend of the stamps about their line."""
    if len(places) < _FEWEST_PARTS:
        return None
    half = np.ptp(places) / 2
    if not half > 0:
        return None
    u = (places - places.min()) / half - 1.0
    powers = np.stack([np.ones_like(u), u, 1.5 * u * u - 0.5], axis=1)
    normal = np.linalg.inv(powers.T @ powers)
    coefficients = normal @ (powers.T @ level)
    rest = level - powers @ coefficients
    # Neighbours are alike where the clock wanders: so many fewer of them count.
    alike = float(np.sum(rest[1:] * rest[:-1]) / max(np.sum(rest**2), 1e-300))
    alike = min(max(alike, 0.0), 0.95)
    variance = float(np.sum(rest**2)) / (len(u) - 3) * (1 + alike) / (1 - alike)
    # y = c (1.5 u^2 - 0.5): its slope goes from -3c to 3c over a half length; a longer interval is a lower rate
    per = -6.0 / (half * interval) * 1e6
    return float(per * coefficients[2]), float(abs(per) * math.sqrt(variance * float(normal[2, 2])))


def _robust_line(x: _Floats, y: _Floats) -> tuple[float, float, float]:
    """Intercept, slope and median deviation through block medians, blocks far off left out (three rounds)."""
    keep = np.ones(len(x), dtype=bool)
    rise, intercept, spread = 0.0, float(np.median(y)), 0.0
    for _ in range(3):
        if np.ptp(x[keep]) == 0:
            break
        rise = slope(x[keep], y[keep])
        intercept = float(y[keep].mean() - rise * x[keep].mean())
        e = np.abs(y - intercept - rise * x)
        spread = float(np.median(e))
        keep = e <= 6.0 * spread + 1e-12
    return intercept, rise, spread
