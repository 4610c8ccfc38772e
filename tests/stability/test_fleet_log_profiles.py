# SPDX-License-Identifier: BSD-3-Clause
"""A log without a ramp speaks of K without one; a log with a ramp does not."""

from __future__ import annotations

import numpy as np
import pytest

from allanite.filtering.simulation import simulate
from allanite.noise import NoiseModel, Ramp, RandomWalk, White
from allanite.noise.allan import allan_curve
from allanite.stability.fleet.log_profiles import profiles_of
from allanite.stability.record_comparison.series import record_of


def profiles(*terms, seed):
    record = record_of(
        allan_curve(simulate(NoiseModel(terms=terms), rate=10.0, duration=3600.0, seed=seed), threads=1)
    )
    (channel,) = record.channels
    return profiles_of(record.series(channel), 0.95)


@pytest.mark.long
def test_records_of_one_walk_agree_with_it_together():
    """The pooled loss of twenty records at the truth is that of their number: no pull by a ramp that is not there."""
    truth = np.array([np.log(4e-5)])
    roots = [profiles(White(N=3e-4), RandomWalk(K=4e-5), seed=seed)["K"].root(truth)[0] for seed in range(20)]
    assert abs(np.mean(roots)) < 3.3 / np.sqrt(20)


def test_a_ramp_that_shows_is_among_the_terms():
    ramped = profiles(White(N=3e-4), Ramp(R=1e-6), seed=1)
    assert ramped["R"].supported
    assert not profiles(White(N=3e-4), RandomWalk(K=4e-5), seed=1)["R"].supported
    assert set(ramped) >= {"Q", "N", "B", "K", "R"}
