# SPDX-License-Identifier: BSD-3-Clause
"""Stamps to an even grid: the rate of the stamps as a whole, and every missing sample in its place."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.files.readers.timebase import ArrayStamps, Timebase, even_grid, fit_grid, resolution_of
from allanite.recording.health.log import OFF_GRID

K = np.arange(20_000)


def grid(stamps: Any, **options: Any) -> Timebase:
    return fit_grid(ArrayStamps(np.asarray(stamps, dtype=float)), source="t", unit="s", **options)


def positions(base: Timebase) -> NDArray[np.int64]:
    """Where each sample lies on the grid."""
    lengths = np.diff(base.source)
    return np.concatenate([g + np.arange(n) for g, n in zip(base.grid, lengths, strict=True)])


def test_even_stamps_give_their_rate_to_the_last_digit() -> None:
    for rate in (1.0, 32.0, 100.0, 250.0, 1000.0, 1 / 3):
        base = grid(K / rate)
        assert base.rate == pytest.approx(rate, rel=1e-15)
        assert (base.length, base.facts["gaps"], base.facts["duplicates"]) == (len(K), 0, 0)
    assert grid(np.round(K / 30, 3)).rate == 30.0


def test_median_rate_is_reported_but_not_used() -> None:
    bursts = (K // 5 * 5 + 5) * 0.01 + K % 5 * 1e-4
    base = grid(bursts)
    assert base.rate == pytest.approx(100.0, rel=1e-6)
    assert base.facts["median_rate"] == pytest.approx(10_000.0, rel=1e-3)
    assert base.facts["gaps"] == 0


@pytest.mark.parametrize("jitter", [0.02, 0.1, 0.25])
def test_b13_jitter_bends_neither_rate_nor_grid(jitter: float, rng: np.random.Generator) -> None:
    base = grid((K + jitter * rng.normal(size=len(K))) * 0.01)
    # Least squares: the slope has standard deviation jitter * sqrt(12) / n^1.5 (relative).
    assert abs(base.rate / 100 - 1) < 4 * jitter * np.sqrt(12) / len(K) ** 1.5
    assert base.facts["missing"] == 0
    assert base.facts["jitter_rms_s"] == pytest.approx(jitter * 0.01, rel=0.05)


def test_b14_clock_error_against_the_header_is_measured() -> None:
    base = grid(K * 0.01 * (1 + 500e-6), nominal=100.0)
    assert base.rate == pytest.approx(100 / (1 + 500e-6), rel=1e-12)
    assert base.facts["drift_ppm"] == pytest.approx(-499.75, abs=0.01)


@pytest.mark.parametrize(("rate", "step"), [(20.0, 1.0), (1000.0, 1.0), (1000.0, 0.0625)])
def test_stamps_coarser_than_the_samples(rate: float, step: float) -> None:
    base = grid(np.floor(K / rate / step) * step)
    assert base.rate == pytest.approx(rate, rel=1e-4)
    assert base.facts["resolution_s"] == pytest.approx(step)
    assert base.facts["duplicates"] == 0  # equal stamps are what the resolution makes of them


def test_float32_seconds_after_a_week() -> None:
    stamps = (604_800 + K / 1000).astype(np.float32)
    base = grid(stamps, resolution=float(np.spacing(stamps[-1])))
    assert base.rate == pytest.approx(1000.0, rel=1e-4)
    assert base.facts["missing"] == 0


def test_a_hole_keeps_its_length(rng: np.random.Generator) -> None:
    kept = (K < 4000) | (K >= 14_000)
    for jitter in (0.0, 0.1):
        base = grid((K[kept] + jitter * rng.normal(size=kept.sum())) * 0.01)
        assert base.facts["gap_places"] == [[4000, 14_000]]
        assert np.array_equal(positions(base), K[kept])


def test_a_hole_in_bursts_and_in_coarse_stamps() -> None:
    kept = (K < 4000) | (K >= 14_000)
    bursts = grid((K[kept] // 5 * 5) * 0.01 + K[kept] % 5 * 1e-4)
    assert bursts.facts["gap_places"] == [[4000, 14_000]]
    coarse = grid(np.floor(K[kept] * 0.01))
    assert coarse.facts["gaps"] == 1
    assert abs(coarse.facts["missing"] - 10_000) <= 100  # as far as stamps of one second can tell


@pytest.mark.parametrize("share", [0.001, 0.05, 0.3])
def test_scattered_dropouts_are_placed_exactly(share: float, rng: np.random.Generator) -> None:
    kept = rng.random(len(K)) >= share
    kept[[0, -1]] = True
    base = grid((K[kept] + 0.03 * rng.normal(size=kept.sum())) * 0.01)
    assert base.rate == pytest.approx(100.0, rel=1e-5)
    assert np.array_equal(positions(base), K[kept])
    assert base.facts["missing"] == np.count_nonzero(~kept)


@pytest.mark.long
def test_exact_stamps_with_losses_are_not_those_of_a_longer_interval() -> None:
    """A few losses of a short log may lie as evenly as the steps that a longer interval leaves out: hardly ever."""
    wrong = 0
    for seed in range(100):
        rng = np.random.default_rng([20261126, seed])
        n = int(10 ** rng.uniform(1.3, 3))
        lost = rng.choice(np.arange(3, n - 1), int(rng.integers(0, n // 8 + 1)), replace=False)
        kept = np.delete(np.arange(n), lost)
        rate = float(rng.choice([1.0, 25.0, 50.0, 100.0]))
        base = grid(np.round(kept / rate, 3))
        wrong += base.rate != pytest.approx(rate, rel=1e-6) or not np.array_equal(positions(base), kept)
    assert wrong <= 1


def test_a_late_stamp_is_no_gap() -> None:
    stamps = K * 0.01
    stamps[[100, 5000]] += 0.008
    stamps[7000:7003] += 0.016
    base = grid(stamps)
    assert (base.rate, base.facts["gaps"]) == (100.0, 0)


def test_b12_duplicates_and_backward_steps_are_counted_with_their_rows() -> None:
    stamps = np.sort(np.concatenate((K, K[::100]))) * 0.01
    base = grid(stamps)
    assert base.rate == pytest.approx(100.0, rel=1e-9)
    assert base.facts["duplicates"] == 200
    assert base.facts["duplicate_rows"] == [1, 102, 203, 304, 405]
    back = K * 0.01
    back[9000:] -= 0.5
    base = grid(back)
    assert base.rate == pytest.approx(100.0, rel=1e-9)
    assert (base.facts["backward"], base.facts["backward_rows"]) == (1, [9000])


def test_b12_one_wild_stamp_does_not_move_the_grid() -> None:
    for error in (1e9, -3.0):
        stamps = K * 0.01
        stamps[500] += error
        base = grid(stamps)
        assert (base.rate, base.length, base.facts["backward"]) == (100.0, len(K), 1)


@pytest.mark.parametrize(
    ("stamps", "hint"),
    [
        (np.where(K < 9000, K * 0.01, K * 0.01 + 1e9), r"row 9000 by 1e\+09 s"),
        (np.full(100, 5.0), "all are equal.*row 0.*row 4"),
        (-K * 0.01, "do not rise"),
        (np.random.default_rng(1).permutation(1000) * 0.01, "backward|not rise"),
        (np.array([1.0]), "at least 2"),
        (np.full(1000, np.nan), "empty"),
    ],
    ids=["jump", "equal", "falling", "shuffled", "one", "empty"],
)
def test_b12_no_grid_can_be_built(stamps: NDArray[np.float64], hint: str) -> None:
    with pytest.raises(DataQualityError, match=hint):
        grid(stamps)


def test_missing_stamps_are_bridged_and_counted() -> None:
    stamps = K * 0.01
    stamps[1000:1010] = np.nan
    stamps[-1] = np.nan
    base = grid(stamps)
    assert (base.rate, base.length) == (100.0, len(K))


def test_blocks_do_not_matter(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    kept = rng.random(len(K)) >= 0.02
    stamps = (K[kept] + 0.05 * rng.normal(size=kept.sum())) * 0.01
    whole = grid(stamps)
    monkeypatch.setattr("allanite.files.readers.filled_stamps.BLOCK", 777)
    parts = grid(stamps)
    assert np.array_equal(whole.grid, parts.grid)
    assert np.array_equal(whole.source, parts.source)
    assert parts.rate == pytest.approx(whole.rate, rel=1e-9)


def test_two_rows_are_the_least() -> None:
    assert grid([0.0, 0.5]).rate == 2.0
    assert even_grid(7, 5.0, source="rate argument").length == 7


@pytest.mark.parametrize(
    ("step", "expected"), [(1.0, 1.0), (0.01, 0.01), (1e-6, 1e-6), (0.125, 0.001), (np.pi / 1000, None)]
)
def test_resolution_of_stamps(step: float, expected: float | None) -> None:
    stamps = np.cumsum(np.tile([1, 2, 1], 300)) * step
    found = resolution_of(stamps)
    assert found == pytest.approx(expected) if expected else found < 1e-9


@settings(max_examples=60)
@given(
    st.lists(st.floats(), min_size=1, max_size=60),
    st.booleans(),
)
def test_any_stamps_give_a_grid_or_a_refusal(values: list[float], rising: bool) -> None:
    stamps = np.sort(np.array(values)) if rising else np.array(values)
    try:
        base = grid(stamps)
    except DataQualityError:
        return
    assert base.rate > 0
    assert np.isfinite(base.rate)
    assert np.all(np.diff(base.grid) > 0)
    assert base.length >= len(stamps)


# -- any grid, any pauses --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Logged:
    """A log whose samples were taken on an even grid between pauses, and what was written of their times."""

    interval: float
    taken: NDArray[np.float64]
    stamps: NDArray[np.float64]
    pauses: NDArray[np.int64]  # rows that follow one


def logged(seed: int) -> Logged:
    """Any interval, scatter up to 0.4 of it, pauses of any length, stamps written twice or swapped, stamps rounded."""
    rng = np.random.default_rng([20261123, seed])
    interval = 10 ** rng.uniform(-3, 2.5)
    n = int(10 ** rng.uniform(2, 4))
    pauses = np.sort(rng.choice(np.arange(8, n - 8), int(rng.integers(0, min(25, n // 25))), replace=False))
    taken = np.arange(n) * interval
    longest = 10 ** rng.uniform(0.8, 4)
    whole = rng.random() < 0.3  # the grid goes on through the pauses
    for row in pauses:
        length = math.exp(rng.uniform(math.log(2.5), math.log(longest)))
        taken[row:] += (round(length) if whole else length) * interval
    scatter = rng.choice([0.0, 0.1, 0.25, 0.4]) * interval
    stamps = taken + rng.uniform(-scatter, scatter, n)
    if rng.random() < 0.3:
        stamps = np.round(stamps, 2 - math.floor(math.log10(interval)))
    for row in rng.choice(np.arange(4, n - 4), int(rng.integers(0, 6)), replace=False):
        if np.abs(pauses - row).min(initial=99) > 4:
            swapped = [row, row - 1] if rng.random() < 0.5 else [row - 1, row - 1]
            stamps[[row - 1, row]] = stamps[swapped]
    return Logged(interval, taken, stamps, pauses)


@pytest.mark.parametrize("first", range(0, 100, 20))
def test_every_sample_keeps_its_place_and_every_pause_is_a_gap(first: int) -> None:
    """Half an interval for a pause that ends beside the grid; next to one, few stamps tell the phase."""
    far = wrong = pauses = 0
    for seed in range(first, first + 20):
        log = logged(seed)
        base = grid(log.stamps)
        off = positions(base) - (log.taken - log.taken[0]) * base.rate
        assert np.ptp(off) / 2 < 1.0, seed
        far += np.ptp(off) / 2 > 0.65
        span = float(np.ptp(log.taken))
        assert abs((base.length - 1) / base.rate - span) < 2 * log.interval, seed
        assert base.facts["off_grid"] <= OFF_GRID, seed
        wrong += abs(base.facts["gaps"] - len(log.pauses))
        pauses += len(log.pauses)
    assert far <= 2 and wrong <= 1 + 0.01 * pauses


def off_grid(stamps: NDArray[np.float64]) -> bool:
    """Whether the log is refused: by the reader, or by what it notes."""
    try:
        return bool(grid(stamps).facts["off_grid"] > OFF_GRID)
    except DataQualityError:
        return True


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 100, 20))
def test_samples_whose_errors_of_place_add_up_are_off_the_grid(first: int) -> None:
    """A logger that takes some intervals longer than others: its samples walk away from every even grid."""
    for seed in range(first, first + 20):
        rng = np.random.default_rng([20261127, seed])
        n = int(rng.integers(2000, 20_000))
        longer, share = rng.uniform(0.15, 0.45), rng.uniform(0.05, 0.5)
        steps = longer * (rng.random(n) < share)
        walk = np.cumsum(steps - steps.mean())
        line = np.polyval(np.polyfit(np.arange(n), walk, 1), np.arange(n))
        far = np.mean(np.abs(walk - line) > 1.0) > 0.1
        assert off_grid(np.cumsum(1.0 + steps) * 10 ** rng.uniform(-3, 1)) or not far, seed


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 40, 20))
def test_a_clock_that_drifts_slowly_leaves_its_samples_on_the_grid(first: int) -> None:
    """Half of these clocks leave the grid where a drift is not taken out."""
    for seed in range(first, first + 20):
        rng = np.random.default_rng([20261128, seed])
        k = np.arange(int(rng.integers(5000, 60_000)))
        ppm, turns = 450.0 * rng.choice([-1, 1]), rng.uniform(0.5, max(0.5, len(k) / 40_000))
        clock = 1e-6 * ppm * np.sin(2 * np.pi * (turns * k / len(k) + rng.random()))
        stamps = np.cumsum(1.0 + clock) + rng.choice([0.0, 0.05, 0.2]) * rng.uniform(-1, 1, len(k))
        assert not off_grid(stamps * 10 ** rng.uniform(-3, 1)), seed


@pytest.mark.parametrize("step", [0.0, 1.0])
def test_a_reading_a_minute_with_pauses_of_days(step: float, rng: np.random.Generator) -> None:
    taken = np.arange(1000) * 60.0
    rows = np.sort(rng.choice(np.arange(1, 1000), 19, replace=False))
    for row in rows:
        taken[row:] += math.exp(rng.uniform(math.log(600), math.log(3 * 86_400)))
    base = grid(np.round(taken) if step else taken)
    assert base.facts["gaps"] == 19
    assert base.rate == pytest.approx(1 / 60, rel=1e-4)
    assert np.array_equal(base.source[1:-1], rows)
    assert (base.length - 1) / base.rate == pytest.approx(taken[-1], abs=120)


def test_milliseconds_that_alternate_are_no_gaps() -> None:
    base = grid(np.floor(K * 1.5) / 1000)
    assert (base.rate, base.facts["gaps"]) == (pytest.approx(2000 / 3, rel=1e-6), 0)


@pytest.mark.parametrize(
    "intervals",
    [
        lambda rng, n: rng.exponential(1.0, n),
        lambda rng, n: rng.uniform(0.2, 1.8, n),
        lambda rng, n: np.exp(rng.normal(0.0, 0.3, n)),
        lambda rng, n: 1.0 + 0.2 * rng.normal(size=n),
    ],
    ids=["events", "uniform", "lognormal", "walk"],
)
@pytest.mark.parametrize("n", [800, 5000])
def test_times_that_fit_no_even_grid_are_refused(
    intervals: Callable[[np.random.Generator, int], NDArray[np.float64]], n: int, rng: np.random.Generator
) -> None:
    with pytest.raises(DataQualityError, match=r"no even grid.*--rate"):
        grid(np.cumsum(intervals(rng, n)))


@pytest.mark.parametrize("late", [0.4, 0.7, 2.0])
def test_stamps_of_a_host_that_are_late_by_intervals_are_even_samples(
    late: float, rng: np.random.Generator
) -> None:
    base = grid(np.maximum.accumulate(K + late * rng.exponential(size=len(K))))
    assert (base.rate, base.facts["gaps"]) == (pytest.approx(1.0, rel=1e-4), 0)
