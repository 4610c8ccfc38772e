# SPDX-License-Identifier: BSD-3-Clause
"""The share of units beyond a limit: against the t distribution, by coverage, and at its ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from allanite.errors import InputError
from allanite.stability.fleet.capability import capability_of
from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.evidence import Design
from allanite.stability.fleet.levels import LEVELS
from allanite.stability.fleet.population import describe_fleet
from allanite.stability.fleet.posterior import posterior_of
from allanite.stability.fleet.profile_table import ProfileTable
from allanite.stability.fleet.results import FleetPopulation
from allanite.stability.fleet.verdict import CapabilityVerdict
from fleet_tables import MIDDLE, fleet_table

SD = 1e-3


def draws_of(x):
    """The population of units that are known exactly."""
    n = len(x)
    profiles = ProfileTable.of(x[:, None] + SD * np.array(LEVELS), np.full(n, -np.inf))
    design = Design(profiles, np.ones((n, 1)), np.arange(n), np.zeros(n, dtype=np.intp))
    return Draws(posterior_of(design))


def exact_interval(x, limit, confidence=0.95):
    """Of the share above a limit, by the noncentral t distribution."""
    n = len(x)
    k = math.sqrt(n) * (limit - x.mean()) / x.std(ddof=1)
    tails = 0.5 + confidence / 2, 0.5 - confidence / 2

    def noncentrality(p):
        low, high = k - 40.0, k + 40.0
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if stats.nct.cdf(k, n - 1, middle) > p else (low, middle)
        return low

    shares = [stats.norm.sf(noncentrality(p) / math.sqrt(n)) for p in tails]
    return min(shares), max(shares)


def test_the_interval_of_a_share_is_that_of_the_noncentral_t_distribution():
    x = np.random.default_rng(3).normal(0.0, 0.2, 40)
    capability = capability_of(draws_of(x), math.exp(0.4), 0.95, 0.99)
    low, high = exact_interval(x, 0.4)
    assert stats.norm.isf(capability.share.lower) == pytest.approx(stats.norm.isf(low), rel=0.05)
    assert stats.norm.isf(capability.share.upper) == pytest.approx(stats.norm.isf(high), rel=0.05)
    reach = stats.norm.isf([capability.share.upper, capability.share.lower]) / 3
    assert [capability.index.lower, capability.index.upper] == pytest.approx(reach, rel=1e-6)


@pytest.mark.long
def test_the_interval_covers_the_share_and_the_index():
    records, limit = 20, 0.4  # two standard deviations: 2.28 %; a coverage of 58 % fails with 90 %
    rng = np.random.default_rng(952)
    covered = np.zeros(2)
    for _ in range(records):
        capability = capability_of(draws_of(rng.normal(0.0, 0.2, 25)), math.exp(limit), 0.95, 0.99)
        truth = ((capability.share, stats.norm.sf(2.0)), (capability.index, 2 / 3))
        covered += [q.lower <= value <= q.upper for q, value in truth]
    low, high = stats.binom.ppf([0.0005, 0.9995], records, 0.95)
    assert np.all((low <= covered) & (covered <= high)), covered


@pytest.mark.long
@pytest.mark.parametrize(
    ("factor", "verdict"),
    [
        (2.0, CapabilityVerdict.MEETS),
        (1.26, CapabilityVerdict.CANNOT_TELL),  # 2.3 standard deviations, of which 1 % lies above 2.33
        (1.0, CapabilityVerdict.DOES_NOT_MEET),
    ],
)
def test_a_verdict_follows_from_the_interval(factor, verdict):
    made = describe_fleet(
        fleet_table(symbols=("N",), lots=1), limits={("gyro_x", "N"): factor * MIDDLE, ("gyro_y", "N"): 1.0}
    )
    capability = made.coefficients[0].capability
    assert capability.verdict is verdict is made.capability_verdict
    assert capability.allowed == pytest.approx(0.01) and capability.limit == factor * MIDDLE
    assert made.capability_reason.startswith("N of gyro_x: ")
    assert FleetPopulation.from_json(made.to_json()).to_json() == made.to_json()
    assert (made.coefficients[0].tolerance[1] < capability.limit) or verdict is not CapabilityVerdict.MEETS


@pytest.mark.long
def test_documents_without_limits_are_read_as_before():
    made = describe_fleet(fleet_table(symbols=("N",)))
    assert made.capability_verdict is None and made.capability_reason == ""
    plain = made.to_json()
    for coefficient in plain["coefficients"]:
        del coefficient["capability"]
    assert FleetPopulation.from_json(plain).to_json() == made.to_json()


def test_a_limit_is_a_positive_number():
    with pytest.raises(InputError, match="limit of N of gyro_x must be a positive number, not 0"):
        describe_fleet(fleet_table(), limits={("gyro_x", "N"): 0.0})
