# SPDX-License-Identifier: BSD-3-Clause
"""Correlations over units: false pairs, coverage, units that are left out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from allanite.stability.fleet.correlations import correlated_pairs

NAMES = [(f"gyro_{axis}", symbol) for axis in "xyz" for symbol in "NB"]


@pytest.mark.long
def test_any_false_pair_is_as_rare_as_stated():
    rng, fleets = np.random.default_rng(1), 300
    false = sum(bool(correlated_pairs(NAMES, rng.standard_cauchy((30, 6)), 0.95)[0]) for _ in range(fleets))
    assert false <= stats.binom.ppf(0.9995, fleets, 0.05)
    assert false >= stats.binom.ppf(0.0005, fleets, 0.035)  # Holm among 15 pairs is not much more careful


@pytest.mark.long
def test_intervals_cover():
    rng, fleets, rho = np.random.default_rng(2), 1000, 0.7
    covered = 0
    for _ in range(fleets):
        x = rng.multivariate_normal([0, 0], [[1, rho], [rho, 1]], 60)
        (pair,), tested = correlated_pairs(NAMES[:2], np.exp(x), 0.95)
        assert tested == 1
        covered += pair.correlation.lower <= rho <= pair.correlation.upper
    low, high = stats.binom.ppf([0.0005, 0.9995], fleets, 0.95)
    assert low <= covered <= high, covered


def test_units_with_limits_are_left_out_and_counted():
    rng = np.random.default_rng(3)
    common = rng.normal(size=50)
    values = np.column_stack([common + 0.2 * rng.normal(size=50) for _ in range(3)])
    values[:15, 1] = np.nan
    values[10:15, 0] = np.nan
    values[:42, 2] = np.nan  # eight units are too few
    pairs, tested = correlated_pairs(NAMES[:3], values, 0.95)
    assert tested == 1
    assert (pairs[0].first, pairs[0].second) == ("N of gyro_x", "B of gyro_x")
    assert (pairs[0].units, pairs[0].left_out) == (35, 10)
    assert abs(np.arctanh(pairs[0].correlation.value) - np.arctanh(1 / 1.04)) < 3.29 / np.sqrt(35 - 3)
