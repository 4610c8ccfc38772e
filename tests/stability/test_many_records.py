# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of many records: what one pass gives is what each record by itself, and plain search, would give."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import nnls

from allanite.filtering.simulation import simulate
from allanite.fitting.families import FLICKER, GAUSS_MARKOV
from allanite.fitting.objective import CurveData, solve
from allanite.noise import NoiseModel, RandomWalk, White
from allanite.noise.allan import allan_curve
from allanite.stability.record_comparison.curves import Ratio, compared
from allanite.stability.record_comparison.equality import least, without_each
from allanite.stability.record_comparison.null_law import _with_one_shared
from allanite.stability.record_comparison.pooled import JointDesign
from allanite.stability.record_comparison.profiles import Chords, Profile, normal_profile, traced
from allanite.stability.record_comparison.series import FittedChannel, record_of

Array = NDArray[np.float64]
CRITICAL = 3.841


def _skewed(at: float, sd: float, skew: float, x: float) -> float:
    return ((x - at) / sd) ** 2 * (1 + skew * math.tanh(x - at))


def _one_sided(edge: float, x: float) -> float:
    return max(x - edge, 0.0) ** 2 * 25


def bent(rng: np.random.Generator, count: int) -> list[Profile]:
    """Profiles of every shape: normal, skewed, and upper limits."""
    made: list[Profile] = []
    for i in range(count):
        at, sd, skew = rng.normal(0, 2), rng.uniform(0.1, 1.0), rng.uniform(0.2, 0.8)
        if i % 3 == 0:
            made.append(normal_profile(at, sd, CRITICAL))
        elif i % 3 == 1:
            made.append(
                traced(
                    partial(_skewed, at, sd, skew),
                    at, sd, CRITICAL, at_zero=40.0,
                )
            )  # fmt: skip
        else:
            made.append(traced(partial(_one_sided, at), at, 0.2, CRITICAL, at_zero=0.0))
    return made


@pytest.mark.parametrize("seed", range(6))
def test_the_least_sum_of_bent_profiles_is_that_of_a_fine_search(seed: int) -> None:
    each = bent(np.random.default_rng(seed), 9)
    x = np.linspace(-12, 12, 400_001)
    total = sum((p.loss(x) for p in each), np.zeros_like(x))
    at, q = least(each)
    assert q <= total.min() + 1e-9
    assert q == pytest.approx(total.min(), rel=1e-6, abs=1e-6)
    assert sum(float(p.loss(np.array([at]))[0]) for p in each) == pytest.approx(q, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_without_each_is_the_least_of_the_others(seed: int) -> None:
    each = bent(np.random.default_rng([1, seed]), 8)
    whole = least(each)[1]
    others = [whole - least([p for j, p in enumerate(each) if j != i])[1] for i in range(len(each))]
    np.testing.assert_allclose(without_each(each), np.maximum(others, 0.0), rtol=1e-9, atol=1e-9)


def test_chords_of_many_profiles_add_up_those_of_each() -> None:
    each = bent(np.random.default_rng(3), 12)
    mu = np.linspace(-6, 6, 40)
    for tau in (1e-3, 0.5, 30.0):
        apart = sum((p.loss(mu, tau) for p in each), np.zeros_like(mu))
        np.testing.assert_allclose(Chords.of(each).total(mu, tau), apart, rtol=1e-12)


@pytest.mark.parametrize("alone", [1, 2, 4])
def test_the_distance_with_one_shared_parameter_is_that_of_all_columns_together(alone: int) -> None:
    rng = np.random.default_rng(alone)
    records = [(rng.standard_normal(alone + 1), rng.standard_normal((alone + 1, alone))) for _ in range(5)]
    points = [3 * rng.standard_normal((40, alone + 1)) for _ in records]
    # a parameter of any sign is one of either sign
    shared = np.concatenate([along for along, _ in records])[:, None]
    columns = np.concatenate([shared, -shared, block_diag(*(columns for _, columns in records))], axis=1)
    expected = [nnls(columns, y)[1] ** 2 for y in np.concatenate(points, axis=1)]
    np.testing.assert_allclose(_with_one_shared(records, points), expected, rtol=1e-9, atol=1e-9)


def test_a_curve_left_out_leaves_the_test_of_the_others() -> None:
    rng = np.random.default_rng(4)
    tau, parts = np.array([1.0, 2.0, 4.0, 8.0]), []
    for i in range(6):
        n = 4 if i % 2 else 3
        root = rng.standard_normal((n, n)) + 2 * np.eye(n)
        parts.append(Ratio(tau=tau[:n], z=rng.standard_normal(n), covariance=root @ root.T))
    parts.append(Ratio(tau=np.append(tau, 16.0), z=rng.standard_normal(5), covariance=np.eye(5)))
    whole = compared(parts)
    for i, (gain, lost, _) in enumerate(whole.records):
        others = compared([p for j, p in enumerate(parts) if j != i])
        assert gain == pytest.approx(whole.statistic - others.statistic, rel=1e-9)
        assert lost == whole.dof - others.dof
        assert whole.rest[i] == pytest.approx(others.p, rel=1e-9)


def records_of(rates: list[float]) -> list[FittedChannel]:
    model = NoiseModel.of(White(N=1e-3), RandomWalk(K=6e-4))
    curves = [allan_curve(simulate(model, rate=r, duration=200.0, seed=i)) for i, r in enumerate(rates)]
    louder = replace(curves[1], deviation=2 * curves[1].deviation)
    return [record_of(c).series(c.names[0]) for c in (curves[0], louder, *curves[2:])]


def test_records_together_have_the_weights_of_each() -> None:
    """Records of one kind share their covariance, others have their own; the objective is the sum of all."""
    series = records_of([10.0, 10.0, 4.0, 10.0])
    design = JointDesign.of(series)
    c = np.array([1e-3, 0.8, 1e-3, 2e-3, 1e-7])
    cases: tuple[tuple[tuple[str, ...], tuple[float, ...]], ...] = ((FLICKER, ()), (GAUSS_MARKOV, (30.0,)))
    for symbols, times in cases:
        mean = design.columns(symbols, times) @ c
        blocks = design.relative_covariances(symbols, c, times, mean)
        assert blocks[0] is blocks[1] is blocks[3] and blocks[2] is not blocks[0]
        values, stop = 0.0, 0
        for i, (s, block) in enumerate(zip(series, blocks, strict=True)):
            start, stop = stop, stop + len(block)
            there = np.array([value * design.factor(i, name) for name, value in zip(symbols, c, strict=True)])
            plain = s.fit.data.design.covariance(symbols, there, design.times(i, times))
            np.testing.assert_allclose(block, plain / np.outer(mean[start:stop], mean[start:stop]), rtol=1e-9)
            held = dict(zip(symbols, there, strict=True))
            values += solve(s.fit.data, symbols, times=design.times(i, times), fixed=held).value
        variance = np.concatenate([s.fit.data.variance for s in series])
        joint = solve(
            CurveData(variance, design), symbols, times=times, fixed=dict(zip(symbols, c, strict=True))
        )
        assert joint.value == pytest.approx(values, rel=1e-9)
