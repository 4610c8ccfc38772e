# SPDX-License-Identifier: BSD-3-Clause
"""The density of units: of exact units a kernel estimate, of limits the population below them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from allanite.stability.fleet.densities import density_of
from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.evidence import Design
from allanite.stability.fleet.levels import LEVELS
from allanite.stability.fleet.posterior import posterior_of
from allanite.stability.fleet.profile_table import ProfileTable

LEVEL = np.array(LEVELS)


def density(knots, root_at_zero, unit=None):
    unit = np.arange(len(knots)) if unit is None else unit
    table = ProfileTable.of(knots, root_at_zero)
    design = Design(table, np.ones((len(knots), 1)), unit, np.zeros(unit[-1] + 1, dtype=np.intp))
    return density_of(design, Draws(posterior_of(design)))


def area(d, values):
    return float(np.trapezoid(values, np.log(d.x)))


@pytest.mark.long
def test_exact_units_lie_on_their_population_and_outside_it_where_they_do():
    rng = np.random.default_rng(5)
    x = np.append(rng.normal(0.0, 0.1, 200), 1.0)
    sd = 0.02
    d = density(x[:, None] + sd * LEVEL, np.full(len(x), -np.inf))
    assert area(d, d.units) == pytest.approx(1.0, abs=0.01)
    assert area(d, d.population) == pytest.approx(1.0, abs=0.01)
    at = np.log(d.x)
    quartiles = np.subtract(*np.quantile(x, [0.75, 0.25])) / 1.34
    width = np.hypot(0.45 * quartiles * len(x) ** -0.2, sd)
    twin = stats.norm.pdf(at[:, None], x, width).mean(axis=1)
    np.testing.assert_allclose(d.units, twin, atol=0.05 * twin.max())
    beyond = at > 0.8
    assert area(d, np.where(beyond, d.units, 0.0)) == pytest.approx(1 / len(x), rel=0.05)


@pytest.mark.long
def test_a_unit_with_an_upper_limit_is_the_population_below_it():
    rng = np.random.default_rng(6)
    x = rng.normal(0.0, 0.3, 60)
    knots = x[:, None] + 0.05 * LEVEL
    # Forty more units say only: below exp(-0.2), by a loss that rises from zero there.
    limit = np.where(LEVEL > 0, -0.2 + 0.02 * LEVEL, -np.inf)
    every = np.vstack((knots, np.tile(limit, (40, 1))))
    floor = np.concatenate((np.full(60, -np.inf), np.zeros(40)))
    with_limits = density(every, floor)
    at = np.log(with_limits.x)
    below = area(with_limits, np.where(at < -0.1, with_limits.units, 0.0))
    assert below == pytest.approx((40 + (x < -0.1).sum()) / 100, abs=0.06)
    assert area(with_limits, with_limits.units) == pytest.approx(1.0, abs=0.02)


@pytest.mark.long
def test_repeats_of_a_unit_are_one_unit():
    rng = np.random.default_rng(7)
    true = np.repeat(rng.normal(0.0, 0.3, 40), 3)
    x = true + rng.normal(0.0, 0.1, 120)
    d = density(x[:, None] + 0.02 * LEVEL, np.full(120, -np.inf), np.repeat(np.arange(40), 3))
    assert area(d, d.units) == pytest.approx(1.0, abs=0.02)
    spread = np.sqrt(area(d, d.units * np.log(d.x) ** 2) - area(d, d.units * np.log(d.x)) ** 2)
    assert spread == pytest.approx(np.std(true), rel=0.15)
