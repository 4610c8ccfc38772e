# SPDX-License-Identifier: BSD-3-Clause
"""Innovations of a filter with wrong numbers: which one is wrong, and by how much, against the density from theory."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.stats import binom

from allanite.errors import InputError
from allanite.filtering.innovations import Innovations, InnovationsVerdict, WrongNumber, examine_innovations
from noise_records import binomial_bound

RATE, N, K = 10.0, 0.1, 0.1
SD, STEP = N * math.sqrt(RATE), K / math.sqrt(RATE)  # of a sample


def filtered(
    seed: int, noise: float = 1.0, drift: float = 1.0, n: int = 20_000
) -> tuple[np.ndarray, np.ndarray]:
    """Innovations and variances of a scalar filter whose N and K are so many times too large."""
    rng = np.random.default_rng(seed)
    y = np.cumsum(STEP * rng.standard_normal(n)) + SD * rng.standard_normal(n)
    r, q = (noise * SD) ** 2, (drift * STEP) ** 2
    p, x = (q + math.sqrt(q * q + 4 * q * r)) / 2, y[0]  # steady state
    e = np.empty(n)
    gain = p / (p + r)
    for i, value in enumerate(y):
        e[i] = value - x
        x += gain * e[i]
    return e[200:], np.full(n - 200, p + r)


def theory(f: float, noise: float, drift: float) -> float:
    """(2) of the module, rooted."""
    w = 2 * math.sin(math.pi * f / RATE)
    return math.sqrt((STEP**2 + (SD * w) ** 2) / ((drift * STEP) ** 2 + (noise * SD * w) ** 2))


def misfits(found: Innovations) -> set[WrongNumber]:
    return set(found.axes[0].misfits)


@pytest.mark.long
def test_a_right_filter_is_seldom_called_wrong_and_its_intervals_cover_one() -> None:
    runs, wrong, bands, missed = 120, 0, 0, 0
    for seed in range(runs):
        (axis,) = examine_innovations(*filtered(seed, n=6000), rate=RATE).axes
        wrong += bool(axis.misfits)
        bands += len(axis.bands)
        missed += sum(not b.ratio.lower < 1 < b.ratio.upper for b in axis.bands)
    assert wrong <= binomial_bound(runs, 2e-3)
    low, high = binom.ppf([5e-4, 1 - 5e-4], bands, 0.05)
    assert low <= missed <= high


@pytest.mark.long
@pytest.mark.parametrize(
    ("noise", "drift", "expected"),
    [
        (1 / 3, 1.0, {WrongNumber.NOISE_SMALL}),
        (3.0, 1.0, {WrongNumber.NOISE_LARGE}),
        (1.0, 1 / 5, {WrongNumber.DRIFT_SMALL}),
        (1.0, 5.0, {WrongNumber.DRIFT_LARGE}),
        (1 / 3, 1 / 3, {WrongNumber.NOISE_SMALL, WrongNumber.DRIFT_SMALL}),
        (3.0, 1 / 3, {WrongNumber.NOISE_LARGE, WrongNumber.DRIFT_SMALL}),
    ],
)
def test_the_number_that_is_wrong_is_found_with_its_factor(
    noise: float, drift: float, expected: set[WrongNumber]
) -> None:
    runs, missed, right = 20, 0, 0
    for seed in range(runs):
        (axis,) = examine_innovations(*filtered(1000 + seed, noise, drift), rate=RATE).axes
        assert axis.verdict is InnovationsVerdict.FAILS
        right += set(axis.misfits) == expected
        for ratio, *ends in (
            (axis.fast, axis.fast_above, RATE / 2),
            (axis.slow, 0.003, axis.slow_below),
        ):
            low, high = sorted(theory(f, noise, drift) for f in ends)
            missed += not (ratio.lower < high and low < ratio.upper)
    assert right >= runs - binomial_bound(runs, 2e-3)
    assert missed <= binomial_bound(2 * runs, 0.05)


@pytest.mark.long
def test_intervals_of_the_factors_hold_the_true_ones() -> None:
    """Of any size, of either number or of both; also where the record does not reach down to the plateau of K."""
    factors = [(1.0, f) for f in (0.1, 0.3, 3.0, 10.0, 30.0)] + [
        (f, 1.0) for f in (0.1, 0.3, 3.0, 10.0, 30.0)
    ]
    runs, missed, near = 4, 0, []
    for case, (noise, drift) in enumerate([*factors, (3.0, 0.1), (0.3, 10.0)]):
        for seed in range(runs):
            (axis,) = examine_innovations(
                *filtered(case * runs + seed, 1 / noise, 1 / drift, 8000), rate=RATE
            ).axes
            for found, true in ((axis.noise_factor, noise), (axis.drift_factor, drift)):
                missed += found.lower > true or found.upper < true
                near.append(found.resolved and abs(math.log(found.value / true)) < math.log(1.5))
    assert missed <= binomial_bound(len(near), 0.07)  # the likelihood's interval is a limit for long records
    assert np.mean(near) > 0.8


def test_a_record_that_ends_above_the_plateau_of_the_drift_sets_a_limit_only() -> None:
    (axis,) = examine_innovations(*filtered(3, 1.0, 1 / 300, 5000), rate=RATE).axes
    assert WrongNumber.DRIFT_SMALL in axis.misfits and not axis.drift_factor.resolved
    assert 1 < axis.drift_factor.lower < 300 and math.isnan(axis.drift_factor.upper)
    assert "times at least" in axis.reason


def test_density_of_the_innovations_is_that_of_theory_in_every_band() -> None:
    for noise, drift in ((0.5, 1.0), (1.0, 0.3), (2.0, 0.5)):
        (axis,) = examine_innovations(*filtered(7, noise, drift, 200_000), rate=RATE).axes
        for band in axis.bands[2:]:
            low, high = sorted(theory(f, noise, drift) for f in (band.lower, band.upper))
            slack = 4 * (band.ratio.upper - band.ratio.lower)
            assert low - slack < band.ratio.value < high + slack


@pytest.mark.long
def test_a_covariance_is_taken_apart_as_a_whole() -> None:
    rng = np.random.default_rng(8)
    root = np.array([[1.0, 0.0], [0.9, 0.3]])
    e = rng.standard_normal((8000, 2)) @ root.T
    s = np.broadcast_to(root @ root.T, (8000, 2, 2))
    assert examine_innovations(e, s, rate=1.0).verdict is InnovationsVerdict.HOLDS
    assert examine_innovations(2 * e, s, rate=1.0).verdict is InnovationsVerdict.FAILS


@pytest.mark.long
def test_size_over_time_shows_when_it_went_wrong() -> None:
    e = np.random.default_rng(9).standard_normal((10_000, 3))
    e[6000:7000] *= 2.0
    e[100:120, 1] = np.nan
    series = examine_innovations(e, np.ones((10_000, 3)), rate=100.0).series
    bad = series.nis > series.upper
    late = (series.start >= 60.0) & (series.stop <= 70.0)
    assert bad[late].all() and bad[~late].sum() <= binomial_bound(int((~late).sum()), 0.025)
    assert series.stop[-1] == pytest.approx(100.0)


def test_the_document_comes_back() -> None:
    found = examine_innovations(*filtered(10, 0.3, n=3000), rate=RATE, names=["yaw"], source="log.csv")
    again = Innovations.from_json(json.loads(json.dumps(found.to_json(), allow_nan=False)))
    assert again.to_json() == found.to_json() and again.reason == found.reason
    assert "measurement noise (N) is too small" in again.reason and again.reason.startswith("yaw")


def test_a_short_log_is_tested_in_size_alone() -> None:
    (axis,) = examine_innovations(
        3 * np.random.default_rng(11).standard_normal(40), np.ones(40), rate=1.0
    ).axes
    assert not axis.fast.resolved and not axis.bands
    assert axis.verdict is InnovationsVerdict.FAILS and "larger than the model predicts" in axis.reason
    empty = examine_innovations(np.full(100, np.nan), np.ones(100), rate=1.0)
    assert empty.verdict is InnovationsVerdict.UNTESTED


@pytest.mark.parametrize("rows", [1, 5, 29])
def test_a_few_innovations_show_nothing_but_what_is_plainly_wrong(rows: int) -> None:
    e = np.r_[np.random.default_rng(1).standard_normal(rows), np.full(20, np.nan)]
    (axis,) = examine_innovations(e, np.ones(len(e)), rate=1.0).axes
    assert axis.verdict is InnovationsVerdict.UNTESTED and "of the 30 that a test needs" in axis.reason
    (axis,) = examine_innovations(20 * e, np.ones(len(e)), rate=1.0).axes
    assert axis.verdict is InnovationsVerdict.FAILS


@pytest.mark.parametrize(
    ("e", "s", "rate", "says"),
    [
        (np.zeros(5), np.ones(4), 1.0, "variances of the same shape"),
        (np.zeros(5), np.zeros(5), 1.0, "variance of row 0 is not positive"),
        (np.zeros((5, 2)), -np.ones((5, 2, 2)), 1.0, "not positive definite"),
        (np.zeros(5), np.ones(5), 0.0, "rate must be a positive"),
    ],
)
def test_what_makes_no_sense_is_refused(e: np.ndarray, s: np.ndarray, rate: float, says: str) -> None:
    with pytest.raises(InputError, match=says):
        examine_innovations(e, s, rate=rate)
