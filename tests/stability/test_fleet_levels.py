# SPDX-License-Identifier: BSD-3-Clause
"""Nine numbers hold a profile: what is restored from them is the profile again."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from allanite.stability.fleet.levels import LEVELS, levels_of, profile_of
from allanite.stability.record_comparison.profiles import Profile, limit, normal_profile, traced

CRITICAL = 3.84
Root = Callable[[np.ndarray], np.ndarray]


def fine(
    root: Root, *, low: float = 0.0, best: float = 0.0, ends: tuple[float, float] = (-9.0, 3.0)
) -> Profile:
    """A profile with knots so dense that its own lines do not matter."""
    x = np.linspace(*ends, 6001)
    roots = root(x)
    high = float((roots[-1] - roots[-2]) / (x[-1] - x[-2]))
    return Profile(knots=x, roots=roots, low=low, high=high, best=best, critical=CRITICAL)


def assert_restored(profile: Profile, bound: float = 0.02) -> Profile:
    levels, root_at_zero = levels_of(profile)
    restored = profile_of(levels.astype(np.float32), float(np.float32(root_at_zero)), CRITICAL)
    assert np.all(np.diff(restored.knots) > 0)
    assert np.all(np.diff(restored.roots) >= 0)
    x = np.linspace(profile.knots[0] - 1.0, profile.knots[-1] + 1.0, 4001)
    root = profile.root(x)
    inside = np.abs(root) <= 4
    error = np.abs(restored.root(x) - root)[inside] / np.maximum(1.0, np.abs(root[inside]))
    assert error.max() <= bound
    return restored


@given(
    best=st.floats(min_value=-30, max_value=10),
    sd=st.floats(min_value=1e-3, max_value=0.3),
)
def test_a_normal_estimate_comes_back_as_a_straight_line(best, sd):
    profile = normal_profile(best, sd, CRITICAL)
    levels, root_at_zero = levels_of(profile)
    np.testing.assert_allclose(levels, best + sd * np.array(LEVELS), rtol=0, atol=1e-9 * (1 + abs(best)))
    assert root_at_zero == -math.inf
    restored = assert_restored(profile)
    assert restored.best == pytest.approx(best, abs=2e-6 * (1 + abs(best)))
    assert restored.interval == pytest.approx(profile.interval, abs=4e-6 * (1 + abs(best)))


@given(
    s=st.floats(min_value=0.02, max_value=3.0),
    bend=st.floats(min_value=1e-6, max_value=0.12),
)
def test_an_estimate_that_is_normal_in_its_variance_comes_back(s, bend):
    # S goes to -1/s at zero, and grows slower than the variance far above
    def root(x):
        straight = (np.exp(2 * x) - 1) / s
        return np.where(straight > 0, np.log1p(bend * np.maximum(straight, 0)) / bend, straight)

    profile = fine(root)
    restored = assert_restored(profile)
    assert restored.low == 0
    assert restored.roots[0] == pytest.approx(-1 / s, rel=1e-3)


@given(
    linear=st.floats(min_value=0.0, max_value=30.0),
    bend=st.floats(min_value=1e-6, max_value=0.12),
)
def test_an_upper_limit_comes_back(linear, bend):
    def root(x):
        straight = np.sqrt(linear * np.exp(2 * x) + np.exp(4 * x))
        return np.log1p(bend * straight) / bend

    profile = fine(root, best=-math.inf, ends=(-12.0, 3.0))
    levels, root_at_zero = levels_of(profile)
    assert np.all(levels[:5] == -math.inf)
    assert root_at_zero == pytest.approx(0, abs=1e-3)
    restored = assert_restored(profile)
    assert restored.best == -math.inf
    assert restored.interval[1] == pytest.approx(profile.interval[1], abs=0.01)


@given(n=st.floats(min_value=1.0, max_value=200.0), sign=st.sampled_from([-1.0, 1.0]))
def test_a_bent_profile_comes_back(n, sign):
    # the likelihood of a variance with n degrees of freedom, and its mirror image
    def root(x):
        u = 2 * sign * x
        return np.sign(x) * np.sqrt(n * np.maximum(u + np.expm1(-u), 0.0))

    x = np.linspace(-8, 8, 16001)
    inside = np.abs(root(x)) < 7
    x = x[inside]
    s = root(x)
    low, high = (s[1] - s[0]) / (x[1] - x[0]), (s[-1] - s[-2]) / (x[-1] - x[-2])
    assert_restored(Profile(knots=x, roots=s, low=low, high=high, best=0.0, critical=CRITICAL))


@settings(max_examples=30)
@given(level=st.sampled_from(LEVELS[:4]), offset=st.floats(min_value=-2e-3, max_value=2e-3))
def test_a_root_at_zero_beside_a_level_does_no_harm(level, offset):
    depth = -level + offset
    assert_restored(fine(lambda x: depth * np.expm1(2 * x)))


@pytest.mark.parametrize("start", [-3.0, -2.7, -2.4, -2.1])
def test_what_the_walks_trace_is_as_close_as_their_chords(start):
    # the root of the limit is exp(2 x), of the estimate 5 expm1(2 x): levels of both in closed form
    upper = limit(lambda x: math.exp(4 * x), start, CRITICAL)
    np.testing.assert_allclose(levels_of(upper)[0][5:], 0.5 * np.log(LEVELS[5:]), atol=0.03)
    inner = traced(lambda x: (5 * math.expm1(2 * x)) ** 2, 0.0, 0.1, CRITICAL, at_zero=25.0)
    levels = levels_of(inner)[0]
    np.testing.assert_allclose(levels[1:], 0.5 * np.log1p(np.array(LEVELS[1:]) / 5), atol=0.01)
    for profile in (upper, inner):
        levels, root_at_zero = levels_of(profile)
        restored = profile_of(levels, root_at_zero, CRITICAL)
        inside = levels[np.isfinite(levels)]
        np.testing.assert_allclose(restored.root(inside), profile.root(inside), atol=1e-9)


def test_a_record_that_says_nothing_of_a_coefficient_stays_silent():
    silent = Profile(
        knots=np.array([-3.0, 2.0]), roots=np.array([0.0, 0.3]), low=0, high=0, best=-math.inf, critical=4
    )
    levels, root_at_zero = levels_of(silent)
    assert set(levels) == {-math.inf, math.inf}
    assert np.all(profile_of(levels, root_at_zero).root(np.linspace(-9, 9, 7)) == 0)


def test_one_level_is_enough():
    weak = Profile(
        knots=np.array([-3.0, 2.0]), roots=np.array([0.0, 1.2]), low=0, high=0, best=-math.inf, critical=4
    )
    levels, root_at_zero = levels_of(weak)
    restored = profile_of(levels, root_at_zero)
    assert restored.root(np.array([levels[5]])) == pytest.approx(0.75)
    assert restored.high == 0
