# SPDX-License-Identifier: BSD-3-Clause
"""Regression in coloured noise: against dense generalised least squares, closed forms and simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.filtering.regression import Whitener, covariance_of, regress
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, White

WHITE = NoiseModel.of(White(N=0.3))
SEED = NoiseModel.of(White(N=1.0), GaussMarkov(q=0.05, T=20.0), RandomWalk(K=0.02))
FULL = SEED + Flicker(B=0.2) + Quantisation(Q=0.4)


def dense_covariance(model: NoiseModel, n: int, dt: float, sampling: str = "mean") -> np.ndarray:
    """Covariance of the samples, state by state: the second method."""
    space = model.state_space(dt, sampling=sampling, record=n * dt, ratio=math.sqrt(10))
    F, h, P = space.transition, space.output, space.initial
    covariance = np.zeros((n, n))
    for i in range(n):
        step = P
        for j in range(i, n):
            covariance[i, j] = covariance[j, i] = h @ step @ h
            step = F @ step
        P = F @ P @ F.T + space.process
    return covariance + space.noise * np.eye(n)


def dense_gls(y: np.ndarray, X: np.ndarray, V: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
    good = ~np.isnan(y)
    y, X, V = y[good], X[good], V[np.ix_(good, good)]
    inverse = np.linalg.inv(V)
    covariance = np.linalg.inv(X.T @ inverse @ X)
    c = covariance @ X.T @ inverse @ y
    r = y - X @ c
    logs = np.linalg.slogdet(V)[1] + np.linalg.slogdet(X.T @ inverse @ X)[1]
    chi2 = float(r @ inverse @ r)
    dof = len(y) - X.shape[1]
    return c, covariance, chi2, -0.5 * (dof * math.log(2 * math.pi) + logs + chi2)


def design(n: int, dt: float) -> np.ndarray:
    t = np.arange(n) * dt
    return np.column_stack([np.where((t // 30) % 2 == 0, 1.0, -1.0), np.ones(n), np.exp(-t / 40)])


@pytest.mark.parametrize("model", [WHITE, SEED, FULL], ids=["white", "seed", "all"])
@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_equals_dense_generalised_least_squares(model: NoiseModel, sampling: str) -> None:
    """K8: gaps included."""
    n, dt = 200, 1.5
    X, rng = design(n, dt), np.random.default_rng(1)
    y = X @ [1.0, 5.0, 2.0] + rng.standard_normal(n)
    y[[0, 7, 8, 9, 150]] = np.nan
    fit = regress(y, X, model, dt=dt, names=["rate", "level", "decay"], sampling=sampling)
    c, covariance, chi2, likelihood = dense_gls(y, X, dense_covariance(model, n, dt, sampling))
    np.testing.assert_allclose(fit.coefficients, c, rtol=1e-9)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-9)
    assert fit.chi2 == pytest.approx(chi2, rel=1e-9)
    assert fit.log_likelihood == pytest.approx(likelihood, rel=1e-9)
    assert fit.dof == n - 5 - 3


def test_k12_a_constant_in_white_noise_is_the_mean() -> None:
    y = np.random.default_rng(2).standard_normal(400)
    fit = regress(y, np.ones((400, 1)), WHITE, dt=0.25, names=["level"])
    assert fit["level"][0] == pytest.approx(y.mean(), rel=1e-12)
    assert fit["level"][1] == pytest.approx(0.3 / math.sqrt(100.0), rel=1e-12)


def test_partly_measured_rows_have_more_white_noise() -> None:
    """Half of each interval measured is half of the record in white noise."""
    half = covariance_of(np.ones((100, 1)), WHITE, dt=1.0, counts=np.full(100, 0.5))
    assert half[0, 0] == pytest.approx(0.3**2 / 50, rel=1e-12)
    with pytest.raises(InputError, match="from 0"):
        covariance_of(np.ones((3, 1)), WHITE, dt=1.0, counts=[0.5, 1.0, 1.5])


def test_covariance_needs_no_samples() -> None:
    X = design(300, 1.0)
    fit = regress(np.random.default_rng(3).standard_normal(300), X, FULL, dt=1.0, names="abc")
    np.testing.assert_allclose(covariance_of(X, FULL, dt=1.0), fit.covariance, rtol=1e-12)


def test_what_cannot_be_told_apart_is_unbounded_and_the_rest_is_not() -> None:
    """Rate and bias without reversals; the decay beside them is determined."""
    X = design(200, 1.0)
    X[:, 0] = 0.9
    fit = regress(np.ones(200), X, SEED, dt=1.0, names=["rate", "level", "decay"])
    assert fit.unbounded == ("rate", "level")
    assert fit.log_likelihood is None
    assert np.isinf(fit.sd[:2]).all() and np.isnan(fit.coefficients[:2]).all()
    alone = regress(np.ones(200), X[:, 1:], SEED, dt=1.0, names=["level", "decay"])
    assert fit["decay"] == pytest.approx(alone["decay"], rel=1e-9)


@pytest.mark.parametrize("scale", [1e-8, 1e-3, 1e5, 1e8])
def test_k3_scales_change_the_scale_alone(scale: float) -> None:
    X, y = design(200, 1.0), np.random.default_rng(4).standard_normal(200)
    louder = NoiseModel.of(White(N=scale), GaussMarkov(q=0.05 * scale, T=20.0), RandomWalk(K=0.02 * scale))
    one = regress(y, X, SEED, dt=1.0, names="abc", checkpoints=[100])
    other = regress(y * scale, X, louder, dt=1.0, names="abc", checkpoints=[100])
    np.testing.assert_allclose(other.coefficients, one.coefficients * scale, rtol=1e-9)
    np.testing.assert_allclose(other.covariance, one.covariance * scale**2, rtol=1e-9)
    np.testing.assert_allclose(other.running, one.running * scale, rtol=1e-9)
    columns = regress(y, X * scale, SEED, dt=1.0, names="abc")
    np.testing.assert_allclose(columns.coefficients, one.coefficients / scale, rtol=1e-9)


def test_running_estimates_are_those_of_the_part() -> None:
    X, y = design(300, 1.0), np.random.default_rng(5).standard_normal(300)
    whole = regress(y, X, SEED, dt=1.0, names="abc", checkpoints=[2, 120, 300])
    assert np.isinf(whole.running[0, 1]).all()  # two rows, three coefficients
    np.testing.assert_allclose(whole.running[2], [whole.coefficients, whole.sd], rtol=1e-8)
    part = regress(y[:120], X[:120], SEED, dt=1.0, names="abc")
    np.testing.assert_allclose(whole.running[1], [part.coefficients, part.sd], rtol=1e-8)


def test_whitened_noise_is_white_and_of_variance_one() -> None:
    """Sum of squares of the innovations of a simulated record: chi-square; their autocorrelation: 1/sqrt(n)."""
    n = 20_000
    model = NoiseModel.of(White(N=1.0), GaussMarkov(q=0.05, T=20.0), RandomWalk(K=0.02), Flicker(B=0.2))
    y = al.simulate(model, rate=1.0, duration=n, seed=6).values("gyro")
    out, _ = Whitener.of(model, dt=1.0, counts=np.ones(n))(np.column_stack([y]))
    e = out[:, 0]
    assert abs(e @ e / n - 1) < 4 * math.sqrt(2 / n)
    for lag in (1, 2, 10, 100):
        assert abs(e[lag:] @ e[:-lag]) / n < 4 / math.sqrt(n)


@pytest.mark.parametrize(
    "change",
    [
        {"names": ["one"]},
        {"columns": np.full((50, 2), np.inf)},
        {"model": NoiseModel.of()},
        {"counts": np.full(50, -1.0)},
        {"y": np.full(50, np.nan)},
    ],
)
def test_what_makes_no_sense_is_refused(change: dict) -> None:
    given = {"y": np.ones(50), "columns": np.ones((50, 2)), "model": WHITE, "names": ["a", "b"], "dt": 1.0}
    given |= change
    with pytest.raises(InputError):
        regress(given.pop("y"), given.pop("columns"), given.pop("model"), **given)
