# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood itself: against dense normal densities, exact expectations and the Cramer-Rao bound."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import LimitError
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.exact import exact_log_likelihood
from allanite.fitting.likelihood.objective import Objective, Point, RandomTerm
from allanite.fitting.likelihood.pool import autocovariance, contrasts
from allanite.fitting.likelihood.pyramid import LikelihoodPyramid, block_sizes, build
from allanite.fitting.slow_contrasts import slow_contrasts
from allanite.recording.records import Recording

Array = NDArray[np.float64]

#: The correlation time is one of those between which is interpolated.
ALL = (RandomTerm("Q"), RandomTerm("N"), RandomTerm("B"), RandomTerm("G", math.exp(2.5)), RandomTerm("K"))
MIXED = np.array([0.2, 1.0, 0.3, 0.5, 0.02])
SAMPLINGS = ("mean", "point")
#: By how much the stated error of a slope may be off, by the rows on top at most: 20 rows are fewer than are ever used.
SLOPE = {16: 0.08, 1024: 0.005}


def toeplitz(component: RandomTerm, n: int, sampling: str) -> Array:
    """Covariance of n samples of a unit process, up to a constant."""
    distance = np.abs(np.arange(n)[:, None] - np.arange(n))
    return autocovariance(component.unit(), n, 1, sampling)[distance]


def dense(y: Array, components: tuple[RandomTerm, ...], c: Array, sampling: str, slope: float = 0.0) -> float:
    """Normal density of the contrasts of the samples present, by SciPy where they are few."""
    from scipy.stats import multivariate_normal

    here = np.flatnonzero(np.isfinite(y))
    V = np.asarray(sum(v * toeplitz(k, len(y), sampling) for k, v in zip(components, c, strict=True)))
    C = contrasts(len(here))
    x, V = C @ (y[here] - slope * here), C @ V[np.ix_(here, here)] @ C.T
    if len(x) < 120:
        return float(multivariate_normal.logpdf(x, np.zeros(len(x)), V))
    L = np.linalg.cholesky(V)
    z = np.linalg.solve(L, x)
    return -float(z @ z + len(x) * math.log(2 * math.pi)) / 2 - float(np.log(np.diag(L)).sum())


def series(n: int, seed: int, missing: float = 0.0) -> Array:
    rng = np.random.default_rng(seed)
    y = np.cumsum(rng.standard_normal(n)) * 0.2 + rng.standard_normal(n)
    y[rng.random(n) < missing] = np.nan
    return y


def objective(y: Array, sampling: str = "mean", chunk: int = 333) -> Objective:
    return Objective.of(build([y[i : i + chunk] for i in range(0, len(y), chunk)], len(y)), sampling)


def point(o: Objective, c: Array, slope: float | None = 0.0) -> Point:
    return Point(ALL, c / o.scale**2, slope)


# -- the density ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("missing", [0.0, 0.3])
@pytest.mark.parametrize("term", range(len(ALL) + 1))
def test_a_short_record_has_its_exact_density(term: int, missing: float, sampling: str) -> None:
    y = series(90, 1, missing)
    c = (
        MIXED
        if term == len(ALL)
        else np.where(np.arange(len(ALL)) == term, 1.0, 0.0) + 0.01 * (np.arange(5) == 1)
    )
    o = objective(y, sampling)
    assert o.value(point(o, c, 0.004)) == pytest.approx(dense(y, ALL, c, sampling, 0.004), rel=1e-10)


@pytest.mark.long
@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_a_longer_record_has_it_nearly(sampling: str) -> None:
    # differences between models count; chance alone moves them by sqrt(2 x information)
    y = series(32 * 22, 2)
    o = objective(y, sampling)
    others = [MIXED, MIXED * 1.2, MIXED * [0, 1, 1, 2, 1], MIXED * [1, 0.8, 2, 0, 3]]
    ours = [o.value(point(o, c)) for c in others]
    exact = [dense(y, ALL, c, sampling) for c in others]
    assert ours == pytest.approx(exact, abs=2.0)
    assert np.diff(ours) == pytest.approx(np.diff(exact), abs=0.05 * np.abs(np.diff(exact)).max() + 0.5)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("slope", [0.003, None])
def test_the_filter_has_the_exact_density(sampling: str, slope: float | None) -> None:
    y = series(120, 3, 0.2)
    without = MIXED * [1, 1, 0, 1, 1]
    at = Point(ALL, without, slope)
    used = slope
    if slope is None:
        o = objective(y, sampling)
        used = o(Point(ALL, without / o.scale**2, None)).slope
    assert exact_log_likelihood(y, at, sampling) == pytest.approx(
        dense(y, ALL, without, sampling, used or 0.0), rel=1e-9
    )
    flicker = exact_log_likelihood(y, Point(ALL, MIXED, 0.0), sampling)  # there a sum of states
    assert flicker == pytest.approx(dense(y, ALL, MIXED, sampling), abs=0.02)


def test_cuts_into_chunks_leave_no_trace() -> None:
    y = series(3000, 4, 0.1)
    a, b = objective(y, chunk=3000), objective(y, chunk=17)
    assert a.value(point(a, MIXED)) == pytest.approx(b.value(point(b, MIXED)), rel=1e-11)


# -- the parts --------------------------------------------------------------------------------------------


@pytest.fixture
def low_top(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few rows on top, so that short records have levels of blocks."""
    monkeypatch.setattr("allanite.fitting.likelihood.pyramid.TOP", 16)


@pytest.mark.long
@pytest.mark.usefixtures("low_top")
@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("k", range(len(ALL)))
def test_expected_moments_are_exact(k: int, sampling: str) -> None:
    # E x x' = L L', so the expected second moments are the sum of those of the columns of L: no chance in it
    n = 150
    gaps = np.zeros(n, dtype=bool)
    gaps[[3, 40, 41, 42, 55, 60, 61, 75]] = True
    C = contrasts(n)
    root = np.linalg.cholesky(C @ toeplitz(ALL[k], n, sampling) @ C.T)
    pyramids = [build([np.where(gaps, np.nan, C.T @ column)], n) for column in root.T]
    o = Objective(pyramids[0], sampling, 1.0)
    for i, pool in enumerate(pyramids[0].pools):
        total = sum(p.pools[i].second for p in pyramids)
        expected = o.matrices(ALL[k])[i][0]
        assert pool.count * np.abs(expected - total).max() < 1e-9 * pool.count * np.abs(total).max()
    values = np.array([p.modes.value for p in pyramids if p.modes is not None])
    # between means over incomplete blocks it is exact for white noise, and nearly so else: quantisation is lost there,
    # where it hardly shows
    error = {0: 0.12, 1: 1e-9}.get(k, 0.1)
    total = values.T @ values
    low = o.matrices(ALL[k])[-1][0]
    assert np.abs(low - total).max() < error * np.abs(total).max()
    assert o.variances(ALL[k])[0] == pytest.approx(np.diag(low), rel=1e-12)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("T", [2.2, 17.0, 120.0, 900.0, 2e5])
def test_interpolated_covariances_are_those_of_the_correlation_time(T: float, sampling: str) -> None:
    n = 90
    exact = contrasts(n) @ toeplitz(RandomTerm("G", T), n, sampling) @ contrasts(n).T
    y = series(n, 5)
    o = objective(y, sampling)
    modes = o.pyramid.modes
    assert modes is not None and not o.pyramid.pools  # all in one vector: its covariance is that of contrasts
    u = slow_contrasts(np.arange(n), np.ones(n), n - 1)[1] @ contrasts(n).T
    expected = u @ exact @ u.T
    found, slope = o.matrices(RandomTerm("G", T))[-1]
    assert np.abs(found - expected).max() < 5e-7 * np.abs(expected).max()
    step = 1e-3
    ends = [
        contrasts(n) @ toeplitz(RandomTerm("G", T * math.exp(d)), n, sampling) @ contrasts(n).T
        for d in (step, -step)
    ]
    change = u @ (ends[0] - ends[1]) @ u.T / (2 * step)
    assert np.abs(slope - change).max() < 2e-5 * max(np.abs(change).max(), np.abs(expected).max())


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("k", range(len(ALL)))
def test_expected_variances_of_modes_are_exact_across_gaps(k: int, sampling: str) -> None:
    n = 150
    here = np.setdiff1d(np.arange(n), [3, 40, 41, 42, 55, 60, 61, 75, *range(90, 120)])
    y = np.full(n, np.nan)
    y[here] = series(n, 11)[here]
    u = slow_contrasts(here, np.ones(len(here)), len(here) - 1)[1]
    covariance = u @ toeplitz(ALL[k], n, sampling)[np.ix_(here, here)] @ u.T
    o = objective(y, sampling)
    assert o.variances(ALL[k])[0] == pytest.approx(np.diag(covariance), rel=1e-8)
    assert o.matrices(ALL[k])[0][0] == pytest.approx(covariance, abs=1e-8 * np.abs(covariance).max())


def test_pyramid_and_modes_hold_every_sample_of_a_record_without_gaps() -> None:
    for n in (100, 900, 128 * 32, 5000, 40_000):
        pyramid = build([series(n, 5)], n)
        numbers = sum(p.count * (p.size - p.given) for p in pyramid.pools)
        assert pyramid.modes is not None
        assert pyramid.present == n
        assert n - 1 - numbers == pytest.approx(len(pyramid.modes.value), abs=64 * len(block_sizes(n)))


@pytest.mark.parametrize("averaged", [False, True])
@pytest.mark.parametrize("missing", [0.0, 0.1])
def test_the_score_is_the_derivative(missing: float, averaged: bool) -> None:
    y = series(2500, 6, missing)
    o = objective(y)
    at = replace(point(o, MIXED, None), averaged=averaged)
    value = o(at)

    def shifted(i: int, h: float) -> float:
        if i < len(ALL):
            return o.value(replace(at, c=at.c + h * (np.arange(len(ALL)) == i)))
        stretched = tuple(RandomTerm(k.symbol, k.T * math.exp(h)) if k.T else k for k in ALL)
        return o.value(replace(at, components=stretched))

    steps = [*(1e-5 * at.c), 1e-5]
    numeric = [(shifted(i, h) - shifted(i, -h)) / (2 * h) for i, h in enumerate(steps)]
    assert value.gradient == pytest.approx(numeric, rel=2e-5)


# -- what it loses ----------------------------------------------------------------------------------------


def operators(pyramid: LikelihoodPyramid, n: int) -> list[tuple[int, Array]]:
    """The matrices that take the samples to all vectors, with how many of their components are given."""
    found: list[tuple[int, Array]] = []
    sizes = block_sizes(n)
    for pool in pyramid.pools:
        width, size = pool.mixing.shape[1], sizes[0]
        starts = range(0, n - width + 1, size) if width > size else (0, n - size)
        for start in starts:
            M = np.zeros((pool.size, n))
            M[:, start : start + width] = pool.mixing
            found.append((pool.given, M))
        assert len(starts) == pool.count
    modes = pyramid.modes
    assert modes is not None and len(sizes) < 2
    size = sizes[0] if sizes else 1
    u = slow_contrasts(np.arange(modes.rows), np.ones(modes.rows), modes.rows - 1)[1]
    M = u @ np.kron(np.eye(n // size), np.full(size, 1 / size))
    return [*found, (0, M[: modes.low]), *((0, row[None]) for row in M[modes.low :])]


@pytest.mark.long
@pytest.mark.parametrize("top", [16, 1024])
@pytest.mark.parametrize(
    ("components", "c"),
    [
        ((ALL[1], ALL[4]), [1.0, 0.09]),  # corner at some samples: the worst there is for blocks
        ((ALL[1], ALL[2], ALL[4]), [1.0, 0.1, 1e-3]),
        ((ALL[0], ALL[1]), [2.0, 1.0]),
        ((ALL[1], ALL[3]), [1.0, 1.0]),
    ],
    ids=["N K", "N B K", "Q N", "N G"],
)
def test_the_composite_reaches_the_bound_of_the_whole_record(
    components: tuple[RandomTerm, ...], c: list[float], top: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the exact variance of its estimates (Godambe) against that of the full likelihood: no simulation
    monkeypatch.setattr("allanite.fitting.likelihood.pyramid.TOP", top)
    n = 320
    pyramid = build([series(n, 7)], n)
    parts = [v * toeplitz(k, n, "mean") for k, v in zip(components, c, strict=True)]
    V, C = sum(parts), contrasts(n)

    def information(M: Array) -> tuple[Array, list[Array]]:
        inverse = np.linalg.inv(M @ V @ M.T)
        pulls = [inverse @ (M @ P @ M.T) @ inverse for P in parts]
        return np.array([[np.vdot(a, M @ P @ M.T) / 2 for P in parts] for a in pulls]), [
            M.T @ a @ M for a in pulls
        ]

    full, _ = information(C)
    claimed, forms = np.zeros_like(full), [np.zeros((n, n)) for _ in parts]
    weight = np.zeros((n, n))  # what the slope of a ramp is judged by
    for given, M in operators(pyramid, n):
        for sign, rows in ((1, M), (-1, M[len(M) - given :])):
            if len(rows):
                H, pulls = information(rows)
                claimed += sign * H
                forms = [f + sign * p for f, p in zip(forms, pulls, strict=True)]
                weight += sign * rows.T @ np.linalg.inv(rows @ V @ rows.T) @ rows
    loaded = [f @ V for f in forms]
    scatter = np.array([[np.vdot(a, b.T) / 2 for b in loaded] for a in loaded])
    inverse = np.linalg.inv(claimed)
    true = np.sqrt(np.diag(inverse @ scatter @ inverse))
    assert (true / np.sqrt(np.diag(np.linalg.inv(full)))).max() < 1.03
    assert np.sqrt(np.diag(inverse)) / true == pytest.approx(1.0, abs=0.04 if top < 1024 else 0.005)
    ramp = np.arange(float(n))
    pull, bound = weight @ ramp, np.sqrt(1 / (C @ ramp @ np.linalg.solve(C @ V @ C.T, C @ ramp)))
    said, spread = 1 / np.sqrt(ramp @ pull), np.sqrt(pull @ V @ pull) / (ramp @ pull)
    assert spread / bound < 1.03
    assert said / spread == pytest.approx(1.0, abs=SLOPE[top])


@pytest.mark.long
def test_the_exact_engine_moves_the_composite_by_a_part_of_its_error() -> None:
    y = series(32 * 30, 8)
    record = Recording.from_rate(y, rate=2.0, unit="rad/s")
    problem = LikelihoodProblem.of(record)
    ours, exact = problem.maximum(("N", "K")), problem.maximum(("N", "K"), engine="exact")
    for symbol, variance in zip("NK", np.diag(ours.covariance["matrix"]), strict=True):
        assert abs(math.log(ours.parameters[symbol] / exact.parameters[symbol])) < 0.25 * math.sqrt(variance)
    c = (np.array([exact.parameters["N"] * math.sqrt(2), exact.parameters["K"] / math.sqrt(2)])) ** 2
    assert exact.log_likelihood == pytest.approx(dense(y, (ALL[1], ALL[4]), c, "mean"), abs=1e-6)
    assert exact.log_likelihood >= dense(y, (ALL[1], ALL[4]), c * [1.02, 1.0], "mean")
    assert exact.log_likelihood >= dense(y, (ALL[1], ALL[4]), c * [1.0, 0.9], "mean")


def test_the_exact_engine_refuses_what_would_take_hours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("allanite.fitting.likelihood.exact.MOST_SAMPLES", 1000)
    problem = LikelihoodProblem.of(Recording.from_rate(series(1001, 9), rate=1.0, unit="rad/s"))
    with pytest.raises(LimitError, match="composite"):
        problem.maximum(("N",), engine="exact")
