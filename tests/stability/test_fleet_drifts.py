# SPDX-License-Identifier: BSD-3-Clause
"""Drifts of units over their repeats: against least squares, and the rate of false alarms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.drifts import dated_logs
from allanite.stability.fleet.evidence import Design
from allanite.stability.fleet.levels import LEVELS
from allanite.stability.fleet.posterior import posterior_of
from allanite.stability.fleet.profile_table import ProfileTable

LEVEL = np.array(LEVELS)
SD = 0.05


def logs_of(x, years, *, limits=()):
    """Units in rows, repeats in columns."""
    units, repeats = x.shape
    knots = x.ravel()[:, None] + SD * LEVEL
    floor = np.full(x.size, -np.inf)
    for row in limits:
        knots[row] = np.where(LEVEL > 0, x.ravel()[row] + SD * LEVEL, -np.inf)
        floor[row] = 0.0
    unit = np.repeat(np.arange(units), repeats)
    design = Design(ProfileTable.of(knots, floor), np.ones((x.size, 1)), unit, np.zeros(units, dtype=np.intp))
    return dated_logs(design, Draws(posterior_of(design)), np.tile(years, units), None)


@pytest.mark.long
def test_slopes_of_normal_logs_are_those_of_least_squares():
    rng = np.random.default_rng(4)
    years = np.array([0.0, 0.3, 1.1, 2.0])
    x = rng.normal(0, 0.2, (30, 1)) + SD * rng.normal(size=(30, 4))
    x[3] += 0.25 * years
    logs = logs_of(x, years)
    p = logs.probability()
    assert np.argmin(p) == 3 and p[3] < 1e-3
    centered = years - years.mean()
    slope = x[3] @ centered / (centered @ centered)
    variances = logs.variances + SD**2
    sd = np.sqrt(variances / (centered @ centered))
    below = logs._confidence(logs._peaks(), np.zeros(30))  # by Newton steps, of which normal logs need none
    assert p == pytest.approx(2 * np.minimum(below, 1 - below), abs=1e-6)
    median, low, high = logs.of_units(np.array([3])).slope(0.95)
    assert median == pytest.approx(slope, abs=1e-4)
    assert np.mean(stats.norm.cdf((low - slope) / sd)) == pytest.approx(0.025, abs=1e-4)
    assert np.mean(stats.norm.cdf((high - slope) / sd)) == pytest.approx(0.975, abs=1e-4)
    assert p == pytest.approx(
        [2 * np.mean(stats.norm.cdf(-abs(row @ centered) / (centered @ centered) / sd)) for row in x],
        abs=1e-6,
    )


@pytest.mark.long
def test_a_unit_that_does_not_drift_is_rarely_said_to():
    rng, p = np.random.default_rng(5), []
    for _ in range(6):
        x = rng.normal(0, 0.2, (60, 1)) + np.hypot(SD, 0.1) * rng.normal(size=(60, 3))
        p.append(logs_of(x, np.array([0.0, 0.5, 1.0])).probability())
    false = int((np.concatenate(p) < 0.05).sum())
    low, high = stats.binom.ppf([0.0005, 0.9995], 360, 0.05)
    assert low <= false <= high, false


@pytest.mark.long
def test_an_upper_limit_takes_part_as_one():
    rng = np.random.default_rng(6)
    years = np.array([0.0, 1.0, 2.0])
    x = np.zeros((20, 3)) + SD * rng.normal(size=(20, 3))
    x[0] = [0.0, 0.0, -1.0]  # a limit far below the others: it fell
    x[1] = [0.0, 0.0, 1.0]  # a limit far above: it says nothing
    logs = logs_of(x, years, limits=(2, 5))
    p = logs.probability()
    assert p[0] < 1e-3 and p[1] > 0.05
    _, _, high = logs.of_units(np.array([0])).slope(0.95)
    assert high < 0


def test_logs_of_one_month_tell_nothing():
    x = SD * np.random.default_rng(7).normal(size=(20, 2))
    assert logs_of(x, np.array([0.0, 0.05])) is None
