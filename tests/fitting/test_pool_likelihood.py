# SPDX-License-Identifier: BSD-3-Clause
"""The compiled likelihood of pools against NumPy, which follows the equations of `fitting.likelihood.objective`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite._kernels import pool_likelihood

Array = NDArray[np.float64]
SLOPES = [(0.0, False), (0.3, False), (None, False), (None, True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pools:
    """Pools of vectors whose covariance is a sum, some components given, and singles beside them."""

    c: Array
    E: list[Array]  # of each pool, shape (n_rows, d, d)
    F: Array  # of the singles, shape (n_rows, k)
    shapes: list[tuple[int, int, int]]
    mean: list[Array]
    tilt: list[Array]
    second: list[Array]
    value: Array
    ramp: Array

    def compiled(self, slope: float | None, averaged: bool) -> tuple[Array, Array]:
        rows = np.concatenate([*(E.reshape(len(E), -1) for E in self.E), self.F], axis=1)
        parts = [x.ravel() for pool in zip(self.mean, self.tilt, self.second, strict=True) for x in pool]
        shapes = np.array(self.shapes, dtype=np.int64).reshape(-1, 3)
        b = math.nan if slope is None else slope
        moments = np.concatenate([*parts, np.zeros(0)])
        return pool_likelihood(self.c, rows, shapes, moments, self.value, self.ramp, b, averaged)

    def parts(self) -> list[tuple[float, Array, Array, Array, Array]]:
        """Weight, E, m, r and S: of each pool, of what is given in it with the sign turned, of each single."""
        found = []
        for (d, given, n), E, m, r, S in zip(
            self.shapes, self.E, self.mean, self.tilt, self.second, strict=True
        ):
            found.append((float(n), E, m, r, S))
            at = slice(d - given, d)
            if given:
                found.append((-float(n), E[:, at, at], m[at], r[at], S[at, at]))
        for j, x in enumerate(self.value):
            E, r = self.F[:, j, None, None], self.ramp[j : j + 1]
            found.append((1.0, E, np.array([x]), r, np.array([[x * x]])))
        return found


def drawn(seed: int, size: int, extra: int, pools: int = 3, singles: int = 7) -> Pools:
    """Covariances with random eigenvalues; `extra` rows stand for what else changes them."""
    rng = np.random.default_rng([31, seed, size])

    def covariances(d: int) -> Array:
        A = rng.standard_normal((size + extra, d, 2 * d))
        return A @ A.transpose(0, 2, 1) / d

    sizes = rng.integers(1, 12, pools).tolist()
    shapes = [(d, int(rng.integers(0, d)), int(rng.integers(1, 500))) for d in sizes]
    means = [rng.standard_normal(d) for d in sizes]
    spread = [rng.standard_normal((d, 3 * d)) for d in sizes]
    return Pools(
        c=10.0 ** rng.uniform(-2, 2, size),
        E=[covariances(d) for d in sizes],
        F=rng.uniform(0.1, 2.0, (size + extra, singles)),
        shapes=shapes,
        mean=means,
        tilt=[rng.standard_normal(d) for d in sizes],
        second=[np.outer(m, m) + s @ s.T / 9 for m, s in zip(means, spread, strict=True)],
        value=rng.standard_normal(singles),
        ramp=rng.standard_normal(singles),
    )


def twin(p: Pools, slope: float | None, averaged: bool) -> tuple[Array, Array]:
    """Minus twice the log-likelihood, slope and its information, gradient; expected information."""
    parts, n = p.parts(), len(p.c)
    V = [np.tensordot(p.c, E[:n], axes=1) for _, E, *_ in parts]
    W = [np.linalg.inv(v) for v in V]
    information = sum(k * r @ w @ r for (k, _, _, r, _), w in zip(parts, W, strict=True))
    best = sum(k * r @ w @ m for (k, _, m, r, _), w in zip(parts, W, strict=True)) / information
    b = best if slope is None else slope
    deviance, gradient, inner = 0.0, np.zeros(len(p.F)), np.zeros((len(p.F),) * 2)
    for (k, E, m, r, S), v, w in zip(parts, V, W, strict=True):
        left = S - b * (np.outer(m, r) + np.outer(r, m)) + b**2 * np.outer(r, r)
        deviance += k * (np.linalg.slogdet(v)[1] + np.trace(w @ left))
        change = k / 2 * w @ (left - v) @ w
        if averaged:
            change += k / 2 * np.outer(w @ r, w @ r) / information
        gradient += np.einsum("tij,ij->t", E, change)
        inner += k / 2 * np.einsum("tij,sji->ts", w @ E, w @ E)
    return np.array([deviance, b, information, *gradient]), inner


@pytest.mark.parametrize(("slope", "averaged"), SLOPES)
def test_it_is_that_of_numpy(slope: float | None, averaged: bool) -> None:
    for size in range(1, 16):
        for seed in range(4):
            p = drawn(seed, size - size // 4, size // 4)
            for ours, theirs in zip(p.compiled(slope, averaged), twin(p, slope, averaged), strict=True):
                np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize(("pools", "singles"), [(0, 5), (2, 0), (1, 1)])
def test_pools_or_singles_may_be_missing(pools: int, singles: int) -> None:
    p = drawn(1, 2, 0, pools, singles)
    for ours, theirs in zip(p.compiled(None, True), twin(p, None, True), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9)


@pytest.mark.parametrize("averaged", [False, True])
def test_the_gradient_is_that_of_the_value(averaged: bool) -> None:
    """Of the profile over the slope, and of the mean over it: half the log of its information more."""
    p = drawn(5, 3, 0)

    def value(c: Array) -> float:
        head = replace(p, c=c).compiled(None, averaged)[0]
        return float(-head[0] / 2 - (math.log(head[2]) / 2 if averaged else 0.0))

    for i, gradient in enumerate(p.compiled(None, averaged)[0][3:]):
        step = np.where(np.arange(3) == i, 1e-5 * p.c[i], 0.0)
        assert (value(p.c + step) - value(p.c - step)) / (2 * step[i]) == pytest.approx(gradient, rel=1e-5)


@pytest.mark.parametrize("bad", [-1.0, 0.0, math.nan, math.inf])
def test_a_covariance_that_is_none_is_impossible(bad: float) -> None:
    for pools, singles in ((1, 0), (0, 1)):
        p = drawn(2, 1, 0, pools, singles)
        head, inner = replace(p, c=np.array([bad])).compiled(0.0, False)
        if math.isinf(bad) and not pools:
            continue  # a variance without end has a likelihood: zero
        assert head.tolist() == [math.inf, 0.0, 0.0, 0.0] and not inner.any()


def test_shapes_that_do_not_fit_are_refused() -> None:
    p = drawn(3, 2, 1)
    with pytest.raises(ValueError, match="pools: sizes"):
        replace(p, shapes=[(d, d + 1, n) for d, _, n in p.shapes]).compiled(0.0, False)
    with pytest.raises(ValueError, match="moments: mean, tilt"):
        replace(p, mean=[m[:-1] for m in p.mean]).compiled(0.0, False)
    with pytest.raises(ValueError, match="values, tilts"):
        replace(p, ramp=p.ramp[1:]).compiled(0.0, False)
    with pytest.raises(ValueError, match="rows: one for each coefficient"):
        replace(p, c=np.ones(4)).compiled(0.0, False)
    with pytest.raises(ValueError, match="rows: one for each coefficient"):
        drawn(3, 16, 0).compiled(0.0, False)
    with pytest.raises(ValueError, match="rows: the covariances"):
        replace(p, F=p.F[:, 1:]).compiled(0.0, False)
