# SPDX-License-Identifier: BSD-3-Clause
"""Rules of control charts: patterns by hand, and how often chance makes them, against published run lengths."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom, norm

from allanite.errors import InputError
from allanite.stability.fleet.control_rules import (
    EWMA_LIMIT,
    EWMA_WEIGHT,
    NELSON,
    WESTERN_ELECTRIC,
    ControlRule,
    ewma,
    signals,
)

Array = NDArray[np.float64]


@pytest.mark.parametrize(
    ("rule", "points", "at"),
    [
        (ControlRule.BEYOND_3, [0, 3.1, -3.1, 2.9], [1, 2]),
        (ControlRule.TWO_OF_THREE, [2.1, 0, 2.2, -2.1, 2.3], [2, 4]),
        (ControlRule.TWO_OF_THREE, [2.1, -2.1, 0, 2.1], []),
        (ControlRule.FOUR_OF_FIVE, [1.1, 1.2, 0.5, 1.3, 1.4, -2], [4]),
        (ControlRule.FOUR_OF_FIVE, [-1.1, -1.1, -1.1, 1.1, -1.1], [4]),
        (ControlRule.EIGHT_ON_SIDE, [0.1] * 8 + [-0.1], [7]),
        (ControlRule.NINE_ON_SIDE, [-0.1] * 9, [8]),
        (ControlRule.SIX_TREND, [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.4], [5]),
        (ControlRule.SIX_TREND, [0.5, 0.4, 0.3, 0.2, 0.1], []),
        (ControlRule.FOURTEEN_ALTERNATING, [0.1 * (-1) ** i for i in range(14)], [13]),
        (ControlRule.FOURTEEN_ALTERNATING, [0.1 * (-1) ** i for i in range(13)], []),
        (ControlRule.FIFTEEN_WITHIN_1, [0.5] * 15 + [1.5], [14]),
        (ControlRule.EIGHT_BEYOND_1, [1.1, -1.1] * 4, [7]),
    ],
)
def test_a_pattern_is_marked_where_it_is_complete(
    rule: ControlRule, points: list[float], at: list[int]
) -> None:
    assert np.flatnonzero(signals(np.array(points, dtype=float), rule)).tolist() == at


def test_one_point_in_370_is_beyond_three_standard_deviations_by_chance() -> None:
    z = np.random.default_rng(5).standard_normal(400_000)
    count = int(signals(z, ControlRule.BEYOND_3).sum())
    low, high = binom.ppf([0.0005, 0.9995], len(z), 2 * norm.sf(3.0))
    assert low <= count <= high


def _run_lengths(rules: tuple[ControlRule, ...], runs: int, length: int, seed: int) -> Array:
    """Points until the first signal, in runs that are long enough that none survives."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(runs):
        z = rng.standard_normal(length)
        marked = np.logical_or.reduce([signals(z, rule) for rule in rules])
        out.append(int(np.argmax(marked)) + 1 if marked.any() else length)
    return np.array(out, dtype=float)


@pytest.mark.long
@pytest.mark.parametrize(
    ("rules", "published"),
    [  # Champ and Woodall 1987, table 1, in control
        (WESTERN_ELECTRIC, 91.75),
        ((ControlRule.BEYOND_3, ControlRule.TWO_OF_THREE), 225.44),
        ((ControlRule.BEYOND_3, ControlRule.FOUR_OF_FIVE), 166.05),
        ((ControlRule.BEYOND_3, ControlRule.EIGHT_ON_SIDE), 152.73),
    ],
)
def test_the_run_lengths_of_the_handbook_are_those_of_champ_and_woodall(
    rules: tuple[ControlRule, ...], published: float
) -> None:
    lengths = _run_lengths(rules, 2000, 3000, 11)
    assert abs(lengths.mean() - published) < 3.3 * lengths.std() / np.sqrt(len(lengths))


@pytest.mark.parametrize(
    ("shift", "published"),
    [(0.0, 500.0), (0.5, 41.8), (1.0, 10.5), (2.0, 3.7)],  # Lucas and Saccucci 1990, weight 0.2, limit 2.962
)
def test_the_weighted_mean_has_the_published_run_lengths(shift: float, published: float) -> None:
    """By the Markov chain of Brook and Evans, with limits that are those of a long run."""
    edge = EWMA_LIMIT * np.sqrt(EWMA_WEIGHT / (2 - EWMA_WEIGHT))
    n = 301
    width = 2 * edge / n
    at = -edge + width * (np.arange(n) + 0.5)
    ends = (
        (at[None, :] - (1 - EWMA_WEIGHT) * at[:, None]) + np.array([[-0.5], [0.5]])[:, :, None] * width
    ) / EWMA_WEIGHT
    Q = norm.cdf(ends[1] - shift) - norm.cdf(ends[0] - shift)
    lengths = np.linalg.solve(np.eye(n) - Q, np.ones(n))
    assert float(lengths[n // 2]) == pytest.approx(published, rel=0.012)


def test_the_weighted_mean_and_its_spread_are_those_of_the_recursion() -> None:
    z = np.random.default_rng(1).standard_normal((4000, 12))
    means = np.array([ewma(row)[0] for row in z])
    spread = ewma(z[0])[1]
    assert means[0, 1] == pytest.approx(0.2 * z[0, 1] + 0.8 * 0.2 * z[0, 0])
    assert means.std(axis=0) / spread == pytest.approx(np.ones(12), abs=0.05)


def test_nelson_has_eight_tests_and_points_must_be_finite() -> None:
    assert len(set(NELSON)) == 8
    assert all(len(signals(np.zeros(0), rule)) == 0 for rule in ControlRule)
    with pytest.raises(InputError, match="finite points"):
        signals(np.array([np.nan]), ControlRule.BEYOND_3)
