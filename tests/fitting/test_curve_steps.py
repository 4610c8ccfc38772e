# SPDX-License-Identifier: BSD-3-Clause
"""The compiled steps of the moment fit against NumPy, and against the conditions of a minimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import minimize, nnls

from allanite._kernels import curve_levels, curve_minimum, curve_step, curve_weight

Array = NDArray[np.float64]
SEEDS = range(60)


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Variances that are drawn from a sum of power laws, in sample units."""

    v: Array
    A: Array
    x: Array
    whiten: Array
    centre: Array

    @property
    def starts(self) -> NDArray[np.int64]:
        """All lags are of one record."""
        return np.zeros(len(self.v), dtype=np.int64)

    def objective(self, x: Array) -> float:
        mu = self.A @ x
        r = self.whiten @ (np.cbrt(self.v / mu) - self.centre)
        return float(r @ r + 2 / 3 * np.log(mu).sum())

    def gradient(self, x: Array) -> Array:
        mu = self.A @ x
        root = np.cbrt(self.v / mu)
        pull = 2 / 3 * root * (self.whiten.T @ (self.whiten @ (root - self.centre)))
        return (2 / 3 - pull) @ (self.A / mu[:, None])


def drawn(seed: int, zeros: bool = True) -> Problem:
    rng = np.random.default_rng([88, seed])
    lags = 2.0 ** np.arange(int(rng.integers(6, 16)))
    powers = [-2, -1, 0, 1, 2][: int(rng.integers(2, 6))]
    A = np.stack([lags**k for k in powers], axis=1)
    x = 10.0 ** rng.uniform(-3, 1, len(powers)) / np.geomspace(1, lags[-1], len(powers)) ** 1.5
    x[rng.random(len(x)) < 0.4 * zeros] = 0.0
    x[0] += 0.1
    edf = np.maximum(4.0 * lags[-1] / lags, 2.0)
    rho = np.exp(-np.abs(np.subtract.outer(np.log(lags), np.log(lags))))
    sd = np.sqrt(2 / (9 * edf))
    factor = np.linalg.cholesky(rho)
    centre = 1 - 2 / (9 * edf)
    v = (A @ x) * (centre + sd * (factor @ rng.standard_normal(len(lags)))).clip(0.1) ** 3
    return Problem(v=v, A=A, x=x, whiten=np.ascontiguousarray(np.linalg.inv(factor) / sd), centre=centre)


def twin(p: Problem, x: Array) -> Array:
    """A step by NumPy and SciPy."""
    mu = p.A @ x
    root, slope = np.cbrt(p.v / mu), p.A / mu[:, None]
    pull = 2 / 3 * root * ((p.whiten @ (root - p.centre)) @ p.whiten)

    def scaled(H: Array) -> tuple[Array, Array, Array]:
        scale = np.sqrt(np.diag(H))
        H = H / np.outer(scale, scale)
        np.fill_diagonal(H, 1 + 1e-9)
        return H, scale, np.linalg.cholesky(H)

    J = p.whiten @ (root[:, None] * slope)
    try:
        with np.errstate(invalid="raise"):
            H, scale, L = scaled(2 / 9 * J.T @ J + (slope.T * (4 / 3 * pull - 2 / 3)) @ slope)
    except (np.linalg.LinAlgError, FloatingPointError):
        J = p.whiten @ (np.maximum(root, 0.6)[:, None] * slope)
        H, scale, L = scaled(2 / 9 * J.T @ J)
    target = H @ (x * scale) - (2 / 3 - pull) @ slope / scale
    wanted = np.linalg.solve(H, target)
    if wanted.min() < 0:
        wanted = nnls(L.T, np.linalg.solve(L, target))[0]
    return wanted / scale - x


@pytest.mark.parametrize("far", [0.0, 1.0, 3.0])
def test_a_step_is_that_of_numpy(far: float) -> None:
    """Near the truth, and from starts that are off by up to three powers of ten."""
    for seed in SEEDS:
        p = drawn(seed)
        x = p.x * 10.0 ** np.random.default_rng(seed).uniform(-far, far, len(p.x))
        step = curve_step(p.v, p.A, x, p.A @ x, p.whiten, p.starts, p.centre)
        expected = twin(p, x)
        mean = p.A @ np.abs(expected) + p.A @ x
        np.testing.assert_allclose(p.A @ step / mean, p.A @ expected / mean, atol=2e-6, err_msg=str(seed))


def test_a_minimum_has_no_way_down() -> None:
    """Kuhn and Tucker: no slope along what is positive, none downhill along what is zero; SciPy finds none lower."""
    for seed in SEEDS:
        p = drawn(seed)
        x = curve_minimum(
            p.v, p.A, np.zeros(len(p.v)), p.x, p.whiten, p.starts, p.centre, steps=60, settled=1e-12
        )
        size = 1 / np.maximum((p.A / (p.A @ x)[:, None]).max(axis=0), 1e-300)  # of a coefficient that matters
        slope = p.gradient(x) * size
        assert x.min() >= 0
        assert slope.min() > -1e-4, seed
        assert np.abs(slope * np.minimum(x / size, 1)).max() < 1e-4, seed
        other = minimize(
            lambda u, p=p, size=size: p.objective(np.maximum(u, 0) * size + 1e-300),
            x / size,
            bounds=[(0, None)] * len(x),
        )
        assert other.fun > p.objective(x) - 1e-5, seed


def test_what_is_held_counts_and_the_start_does_not() -> None:
    for seed in SEEDS:
        p = drawn(seed, zeros=False)
        rest = p.A[:, 0] * p.x[0]
        A = np.ascontiguousarray(p.A[:, 1:])
        starts = (p.x[1:], p.x[1:] * 3, p.x[1:] / 5)
        found = [
            curve_minimum(p.v, A, rest, s, p.whiten, p.starts, p.centre, steps=60, settled=1e-12)
            for s in starts
        ]
        values = [p.objective(np.r_[p.x[0], x]) for x in found]
        assert np.ptp(values) < 1e-5, seed


def test_records_below_one_another_are_blocks_of_one_triangle() -> None:
    """Of three records, of different length, the triangles alone give every digit of the whole matrix."""
    parts = [drawn(seed, zeros=False) for seed in (3, 5, 8)]
    p = min((q.A.shape[1] for q in parts), default=0)
    A = np.concatenate([np.ascontiguousarray(q.A[:, :p]) for q in parts])
    v, centre = (np.concatenate([getattr(q, name) for q in parts]) for name in ("v", "centre"))
    whole, sizes = block_diag(*(q.whiten for q in parts)), np.array([len(q.v) for q in parts])
    rows = np.concatenate([np.pad(q.whiten, ((0, 0), (0, sizes.max() - len(q.v)))) for q in parts])
    starts = np.repeat(np.cumsum(sizes) - sizes, sizes)
    x, rest, nowhere = parts[0].x[:p] + 0.1, np.zeros(len(v)), np.zeros(len(v), dtype=np.int64)
    np.testing.assert_array_equal(
        curve_step(v, A, x, A @ x, rows, starts, centre), curve_step(v, A, x, A @ x, whole, nowhere, centre)
    )
    minima = [
        curve_minimum(v, A, rest, x, w, s, centre, steps=60, settled=1e-12)
        for w, s in ((rows, starts), (whole, nowhere))
    ]
    np.testing.assert_array_equal(*minima)


@pytest.mark.parametrize("lags", [1, 2, 16, 90])
@pytest.mark.parametrize("discrepancy", [0.0, 0.2])
def test_weight_against_its_twin(lags: int, discrepancy: float) -> None:
    rng = np.random.default_rng([89, lags])
    root = rng.standard_normal((lags, lags + 5)) * np.geomspace(1e-3, 2.5, lags)[:, None]
    relative = root @ root.T / lags
    variance = np.diag(relative)
    share = 2 / (9 * np.maximum(2 / variance, 0.5))  # of the last lags fewer than half a degree of freedom
    rho = relative / np.sqrt(np.outer(variance, variance))
    np.fill_diagonal(rho, 1 + 1e-9 + (discrepancy / 3) ** 2 / share)
    factor = np.linalg.cholesky(rho)
    whiten, centre, log_det = curve_weight(relative, discrepancy, 0.5)
    np.testing.assert_allclose(whiten @ (np.sqrt(share)[:, None] * factor), np.eye(lags), atol=1e-12)
    assert not np.triu(whiten, 1).any()
    np.testing.assert_allclose(centre, 1 - share, rtol=1e-15)
    covariance = np.sqrt(np.outer(share, share)) * rho
    assert log_det == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-12)


@pytest.mark.parametrize("relative", [[[1.0, 2.0], [2.0, 1.0]], [[1.0, np.nan], [np.nan, 1.0]]])
def test_weight_of_no_covariance_is_none(relative: list[list[float]]) -> None:
    assert np.isnan(curve_weight(np.array(relative), 0.0, 0.5)[2])


@pytest.mark.parametrize("lags", [1, 2, 16, 40])
@pytest.mark.parametrize("discrepancy", [0.0, 0.2])
def test_levels_against_their_twin(lags: int, discrepancy: float) -> None:
    rng = np.random.default_rng([90, lags])
    roots = rng.standard_normal((2, 3, lags, lags + 5)) * np.geomspace(1e-2, 2.5, lags)[:, None]
    parts, weights = roots @ np.swapaxes(roots, 2, 3) / lags, rng.exponential(size=(7, 3))
    tables = np.arange(7) % 2
    means, variance = rng.uniform(0.5, 2.0, (7, lags)), rng.uniform(0.5, 2.0, lags)
    levels = curve_levels(variance, means, weights, parts, tables, discrepancy, 0.5)
    for level, mean, weight, table in zip(levels, means, weights, tables, strict=True):
        V = np.tensordot(weight, parts[table], 1)
        share = 2 / (9 * np.maximum(2 * mean**2 / np.diag(V), 0.5))
        rho = V / np.sqrt(np.outer(np.diag(V), np.diag(V)))
        np.fill_diagonal(rho, 1 + 1e-9 + (discrepancy / 3) ** 2 / share)
        residual = np.cbrt(variance / mean) - 1 + share
        C = np.sqrt(np.outer(share, share)) * rho
        expected = (
            residual @ np.linalg.solve(C, residual) + np.linalg.slogdet(C)[1] + 2 / 3 * np.log(mean).sum()
        )
        assert level == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_model_without_a_covariance_has_no_level() -> None:
    parts = np.array([[[[1.0, 0.5], [0.5, 1.0]], [[0.0, 2.0], [2.0, 0.0]]]])
    weights = np.array([[1.0, 0.0], [1.0, 1.0], [np.nan, 0.0], [np.inf, 1.0]])
    levels = curve_levels(np.ones(2), np.ones((4, 2)), weights, parts, np.zeros(4, dtype=np.int64), 0.0, 0.5)
    assert np.isfinite(levels).tolist() == [True, False, False, False]
    assert np.isposinf(levels[1:]).all()


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="relative: must be square"):
        curve_weight(np.ones((2, 3)), 0.0, 0.5)
    one, square, zeros = np.ones(2), np.ones((1, 1, 2, 2)), np.zeros(3, dtype=np.int64)
    for means, weights, parts, tables, said in (
        (np.ones((3, 1)), np.ones((3, 1)), square, zeros, "means"),
        (np.ones((3, 2)), np.ones((2, 1)), square, zeros, "weights"),
        (np.ones((3, 2)), np.ones((3, 2)), square, zeros, "weights"),
        (np.ones((3, 2)), np.ones((3, 1)), np.ones((1, 1, 2, 3)), zeros, "parts"),
        (np.ones((3, 2)), np.ones((3, 1)), square, zeros[:2], "tables: one per model"),
        (np.ones((3, 2)), np.ones((3, 1)), square, zeros + 1, "tables: there is none"),
        (np.ones((3, 2)), np.ones((3, 1)), square, zeros - 1, "tables: there is none"),
    ):
        with pytest.raises(ValueError, match=said):
            curve_levels(one, means, weights, parts, tables, 0.0, 0.5)
    p = drawn(1)
    for starts in (p.starts - 1, p.starts + 1, p.starts[1:]):
        with pytest.raises(ValueError, match="starts"):
            curve_step(p.v, p.A, p.x, p.A @ p.x, p.whiten, starts, p.centre)
    with pytest.raises(ValueError, match="starts"):
        curve_step(p.v, p.A, p.x, p.A @ p.x, np.ascontiguousarray(p.whiten[:, :-1]), p.starts, p.centre)
    with pytest.raises(ValueError, match="columns: a row per lag"):
        curve_step(p.v, p.A, p.x[1:], p.A @ p.x, p.whiten, p.starts, p.centre)
    with pytest.raises(ValueError, match="whiten, starts, centre"):
        curve_step(p.v, p.A, p.x, p.A @ p.x, p.whiten, p.starts, p.centre[1:])
    with pytest.raises(ValueError, match="means: must be as long"):
        curve_step(p.v, p.A, p.x, (p.A @ p.x)[1:], p.whiten, p.starts, p.centre)
    with pytest.raises(ValueError, match="rest: must be as long"):
        curve_minimum(p.v, p.A, p.v[1:], p.x, p.whiten, p.starts, p.centre, steps=3, settled=1e-5)
