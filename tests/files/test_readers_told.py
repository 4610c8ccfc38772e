# SPDX-License-Identifier: BSD-3-Clause
"""Stamps that do not lie near the times of their samples: coarse ones with pauses, late ones with losses."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.files.readers.timebase import ArrayStamps, fit_grid

CASES = 100  # a fault of 2.3 % of such logs is among them with 90 %


@dataclass(frozen=True, slots=True, kw_only=True)
class Logged:
    """A log on an even grid between pauses: when its samples were taken, and their stamps [s]."""

    interval: float
    taken: NDArray[np.float64]
    stamps: NDArray[np.float64]
    gaps: int
    step: float = 0.0


def coarse(seed: int) -> Logged:
    """Whole seconds, tenths, 1/64 s or milliseconds; half a sample to a hundred in each; pauses of any length."""
    rng = np.random.default_rng([20261123, 1, seed])
    step = float(rng.choice([1.0, 0.1, 0.01, 1 / 64, 0.001]))
    interval = step / 10 ** rng.uniform(-0.4, 2)
    n = int(10 ** rng.uniform(2.9, 3.3))
    most = max(2, int(n / max(40, 6 * step / interval)))
    rows = np.sort(rng.choice(np.arange(8, n - 8), int(rng.integers(0, min(most, 60) + 1)), replace=False))
    lengths = np.exp(rng.uniform(math.log(2.5), math.log(10 ** rng.uniform(1, 4)), len(rows)))
    taken = np.arange(n) * interval
    for row, length in zip(rows, lengths, strict=True):
        taken[row:] += length * interval
    ticks = (taken + rng.uniform(0, step) + rng.choice([0.0, 1.7e9])) / step
    stamps = (np.floor(ticks) if rng.random() < 0.5 else np.round(ticks)) * step
    return Logged(interval=interval, taken=taken, stamps=stamps - stamps[0], gaps=len(rows), step=step)


def late(seed: int) -> Logged:
    """Delays up to 0.4 of an interval, stalls after which several readings get nearly one stamp, lost samples."""
    rng = np.random.default_rng([20261123, 2, seed])
    interval = 10 ** rng.uniform(-3, -0.5)
    kept = rng.random(int(10 ** rng.uniform(2.9, 3.2))) >= 10 ** rng.uniform(-3.5, -1)
    for first in rng.integers(10, len(kept) - 400, int(rng.integers(0, 4))):
        kept[first : first + int(10 ** rng.uniform(0, 2.5))] = False
    kept[[0, -1]] = True
    place = np.flatnonzero(kept)
    stamps = place + rng.uniform(0, 0.4) * rng.random(len(place))
    for first in np.flatnonzero(rng.random(len(place)) < 10 ** rng.uniform(-3, -1.7)):
        end = place[first] + rng.uniform(1, 12)
        piled = np.arange(first, np.searchsorted(place, end))
        stamps[piled] = np.maximum(stamps[piled], end + 0.01 * np.arange(len(piled)))
    stamps = np.maximum.accumulate(stamps) * interval
    gaps = int(np.count_nonzero(np.diff(place) > 1))
    return Logged(interval=interval, taken=place * interval, stamps=stamps, gaps=gaps)


def verdict(log: Logged) -> str:
    try:
        base = fit_grid(ArrayStamps(log.stamps), source="t", unit="s")
    except DataQualityError as error:
        return "refused" if "--rate" in str(error) else "wrong"
    lengths = np.diff(base.source)
    place = np.concatenate([g + np.arange(n) for g, n in zip(base.grid, lengths, strict=True)])
    off = np.sort((place / base.rate - log.taken) / log.interval)
    # Coarse stamps leave half an interval of the phase open; late ones lie on one grid, whose places are whole.
    width = 1.5 if log.step else 0.5
    if not log.step:
        off = np.sort(place - np.round(log.taken / log.interval))
    astray = 1.0 - float((np.searchsorted(off, off + width) - np.arange(len(off))).max()) / len(off)
    span = abs((base.length - 1) / base.rate - log.stamps[-1]) < 2.0 * (log.interval + log.step)
    gaps = abs(base.facts["gaps"] - log.gaps) <= 1 + 0.03 * log.gaps
    rate = abs(base.rate * log.interval - 1.0) < 0.003
    if rate and span and gaps and astray < (0.03 if log.step else 0.015):
        return "right"
    contradictory = base.facts["duplicates"] > 0.001 * len(place)  # `time_stamps`, fatal
    return "said" if base.facts["unplaced"] or contradictory else "wrong"


@pytest.mark.long
@pytest.mark.parametrize(("logged", "said"), [(coarse, 0.15), (late, 0.2)])
def test_each_sample_has_its_place_or_the_stamps_are_said_not_to_tell(
    logged: Callable[[int], Logged], said: float
) -> None:
    """A pause within one step, or a loss within one stall, has no place in the stamps: it is said of those."""
    found = Counter(verdict(logged(seed)) for seed in range(CASES))
    assert found["wrong"] == 0, found
    assert found["said"] + found["refused"] <= said * CASES, found


@pytest.mark.parametrize("first", [0, 500])
@pytest.mark.parametrize("stalled", [3, 4, 9])
@pytest.mark.parametrize("scatter", [0.0, 0.3])
def test_a_sample_lost_in_a_single_stall_moves_no_other(first: int, stalled: int, scatter: float) -> None:
    """One stall in the record: the samples after it are where their stamps say."""
    taken = np.delete(np.arange(1000.0), first + 2)
    stamps = taken + scatter * np.random.default_rng(first + stalled).random(len(taken))
    piled = np.flatnonzero((taken >= first) & (taken < first + stalled))
    stamps[piled] = first + stalled - 0.02 * np.arange(len(piled), 0, -1)
    base = fit_grid(ArrayStamps((stamps - stamps[0]) * 0.01), source="t", unit="s")
    assert base.rate == pytest.approx(100.0, rel=1e-3)
    place = np.concatenate([g + np.arange(n) for g, n in zip(base.grid, np.diff(base.source), strict=True)])
    off = place - taken
    assert np.ptp(off[first + stalled :]) == 0.0
    assert first == 0 or off[0] == off[-1]


def test_pauses_that_leave_no_tick_whole_are_refused() -> None:
    rng = np.random.default_rng(5)
    taken = np.cumsum(np.where(np.arange(600) % 30 == 0, rng.uniform(1.0, 9.0, 600), 0.01))
    with pytest.raises(DataQualityError, match=r"steps of 1 s.*no place.*--rate|no even grid.*--rate"):
        fit_grid(ArrayStamps(np.floor(taken)), source="t", unit="s")


def test_sample_numbers_are_exact() -> None:
    """One in a hundred is lost, evenly: numbers say so, where stamps of one step would not."""
    numbers = np.delete(np.arange(2000.0), np.arange(50, 2000, 50))
    base = fit_grid(ArrayStamps(numbers), source="n", unit="samples", resolution=0.0)
    assert (base.rate, base.facts["gaps"]) == (1.0, 39)
