# SPDX-License-Identifier: BSD-3-Clause
"""Noise as Markov states: the discrete forms have the covariance of the processes they stand for."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from allanite.errors import InputError
from allanite.noise import (
    FLICKER_FLOOR,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    StateSpace,
    White,
    markov,
)
from allanite.noise.markov import MarkovForm

DT = 0.02
EXAMPLES = {
    "quantisation": Quantisation(Q=0.3, dt=0.5),
    "white": White(N=1.0),
    "flicker": Flicker(B=0.5),
    "random_walk": RandomWalk(K=0.2),
    "ramp": Ramp(R=0.01),
    "gauss_markov": GaussMarkov(q=0.3, T=12.0),
    "sinusoid": Sinusoid(amplitude=0.4, frequency=0.03),
}


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_state_space_has_the_avar_of_its_samples(name: str, sampling: str) -> None:
    """Exact: Allan variance from the covariance of the state space's output, against avar_sampled.

    Flicker is a sum, whose Allan variance is 0.5 % off at half of the record, where m = 8 of 16 samples lies.
    """
    dt, m = 0.5, 8
    space = NoiseModel.of(EXAMPLES[name]).state_space(
        dt, sampling=sampling, record=2 * m * dt, ratio=math.sqrt(10)
    )
    weight = np.concatenate([-np.ones(m), np.ones(m)]) / m
    avar = weight @ output_covariance(space, 2 * m) @ weight / 2
    exact = float(EXAMPLES[name].avar_sampled(m, dt, sampling))
    assert avar == pytest.approx(exact, rel=6e-3 if name == "flicker" else 1e-9)


def output_covariance(space: StateSpace, n: int) -> np.ndarray:
    """Covariance of n successive samples."""
    F, h = space.transition, space.output
    covariance, state = np.empty((n, n)), space.initial
    for i in range(n):
        step = state
        for j in range(i, n):
            covariance[i, j] = covariance[j, i] = h @ step @ h if len(h) else 0.0
            step = F @ step
        state = F @ state @ F.T + space.process
    return covariance + space.noise * np.eye(n)


def test_state_space_of_a_sum_shares_one_mean() -> None:
    """Whatever the number of terms, the mean over the interval is one state; the covariances add."""
    terms = [EXAMPLES[name] for name in sorted(EXAMPLES)]
    whole = NoiseModel.of(*terms).state_space(0.5, record=8.0)
    parts = [NoiseModel.of(t).state_space(0.5, record=8.0) for t in terms]
    assert whole.labels.count("mean") == 1
    np.testing.assert_allclose(
        output_covariance(whole, 16), sum(output_covariance(p, 16) for p in parts), rtol=1e-12, atol=1e-15
    )


def test_a_level_joins_the_states_as_a_diffuse_constant() -> None:
    space = NoiseModel.of(White(N=1.0), RandomWalk(K=0.1)).state_space(0.5).with_constant()
    assert space.labels == ("random_walk", "mean", "level")
    assert space.diffuse.tolist() == [False, False, True]
    assert (space.output.tolist(), space.rate.tolist()) == ([0, 1, 1], [1, 0, 1])


@pytest.mark.parametrize("wrong", [{"dt": 0.0}, {"dt": 1.0, "sampling": "mid"}, {"dt": 1.0, "record": -1.0}])
def test_a_state_space_of_nothing_sensible_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError):
        NoiseModel.of(White(N=1.0)).state_space(**wrong)


def expected_avar(form: MarkovForm, m: int) -> float:
    """Exact Allan variance of Markov states on the sample grid, from their autocovariance."""
    k = np.arange(2 * m, dtype=float)
    r, walk = np.zeros(2 * m), 0.0
    r[0] = form.white
    for s in form.states:
        if s.phi == 1.0:  # means of a walk, less the bridge that stands in `white`
            slope = (2 * s.now * s.step) ** 2
            walk += slope * (m / 3 - 1 / (12 * m))
            continue
        variance = s.step**2 / (1 - s.phi**2)
        r[0] += variance * (s.now**2 + s.later**2 + 2 * s.now * s.later * s.phi)
        both = s.now * s.later * (s.phi ** (k[1:] - 1) + s.phi ** (k[1:] + 1))
        r[1:] += variance * (both + (s.now**2 + s.later**2) * s.phi ** k[1:])
    weight = np.where(k <= m, 2 * m - 3 * k, k - 2 * m) / (2 * m**2)
    weight[1:] *= 2
    return float(weight @ r) + walk


@pytest.mark.parametrize("n", [300, 10_000])
def test_c5_flicker_lies_on_its_floor_at_every_lag(n: int) -> None:
    form = Flicker(B=1.0).markov(DT, sampling="mean", record=n * DT, ratio=math.sqrt(10))
    for m in (1, 2, 3, 4, 8, 30, n // 100, n // 10):
        assert expected_avar(form, m) == pytest.approx(FLICKER_FLOOR**2, rel=2e-4), m
    assert expected_avar(form, n // 2) == pytest.approx(FLICKER_FLOOR**2, rel=6e-3)


def test_states_have_the_exact_variance_of_interval_means() -> None:
    for term in (GaussMarkov(q=1.0, T=DT / 3), GaussMarkov(q=1.0, T=7 * DT), RandomWalk(K=1.0)):
        form = term.markov(DT, sampling="mean", record=100 * DT, ratio=10.0)
        for m in (1, 2, 40):
            assert expected_avar(form, m) == pytest.approx(float(term.avar(m * DT)), rel=1e-12)


@pytest.mark.parametrize("a", [1e-12, 1e-6, 1e-3, 0.3, 1.9, 2.1, 5.0, 300.0])
def test_bridge_keeps_its_digits(a: float) -> None:
    with mpmath.workdps(60):
        x = mpmath.mpf(a)
        weight, rest = mpmath.tanh(x / 2) / x, 2 / x**2 * (x - 2 * mpmath.tanh(x / 2))
    assert markov._bridge(a) == pytest.approx((float(weight), float(rest)), rel=1e-14)


@pytest.mark.parametrize("sampling, first", [("mean", 0.25), ("point", 0.0)])
def test_a_ramp_is_that_of_the_middle_of_its_sample(sampling: str, first: float) -> None:
    space = Ramp(R=2.0).steady_space(0.5, sampling=sampling)
    covariance = space.initial
    for k in range(3):
        assert space.output @ covariance @ space.output == pytest.approx((2.0 * (first + 0.5 * k)) ** 2)
        covariance = space.transition @ covariance @ space.transition.T


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("per_sample", [0.1, 30.0, 299.0, 301.0, 1e4])
def test_phase_of_a_short_correlation_time_has_its_allan_variance(per_sample: float, sampling: str) -> None:
    """Means of a process that forgets within a sample share its ends with their neighbors: they are not quite white."""
    term = GaussMarkov.from_sigma(1.0, 1 / per_sample)
    for m in (1.0, 2.0, 30.0):
        places, weights = m * np.arange(3), np.array([1.0, -2.0, 1.0])
        phase = term.phase_covariance(np.abs(places[:, None] - places), 1.0, sampling)
        expected = float(term.avar_sampled(m, 1.0, sampling))
        assert weights @ phase @ weights / (2 * m**2) == pytest.approx(expected, rel=1e-9)
