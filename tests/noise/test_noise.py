# SPDX-License-Identifier: BSD-3-Clause
"""Every noise term: its views agree with each other, with closed forms and with 60-digit arithmetic."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.noise import (
    FLICKER_FLOOR,
    GM_PEAK_DEVIATION,
    GM_PEAK_TAU,
    SIGMA_PER_B,
    TERMS,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    Term,
    TermType,
    White,
)

mpmath = pytest.importorskip("mpmath")

EXAMPLES: dict[str, TermType] = {
    "quantisation": Quantisation(Q=0.3, dt=0.5),
    "white": White(N=0.7),
    "flicker": Flicker(B=1.3),
    "random_walk": RandomWalk(K=0.2),
    "ramp": Ramp(R=0.01),
    "gauss_markov": GaussMarkov(q=0.4, T=30.0),
    "sinusoid": Sinusoid(amplitude=0.5, frequency=0.05),
}


def test_every_term_has_an_example() -> None:
    assert set(EXAMPLES) == set(TERMS)
    assert all(isinstance(t, Term) for t in EXAMPLES.values())


@pytest.mark.parametrize("name", ["white", "flicker", "random_walk", "gauss_markov"])
def test_avar_is_the_integral_of_the_density(name: str) -> None:
    """AVAR = 4 int S sin^4/(pi f tau)^2: two-sided density, factor 4."""
    term = EXAMPLES[name]
    for tau in (0.7, 30.0, 500.0):
        end = (
            40 * np.pi
        )  # beyond it sin^4 turns fast and has its mean 3/8; at whole turns the remainder is of order x^-3
        low, high = np.linspace(1e-6, end, 800_001), np.geomspace(end, 1e8, 200_001)
        shape = np.concatenate([np.sin(low) ** 4, np.full(len(high), 3 / 8)])
        x = np.concatenate([low, high])
        integrand = 4 * term.psd(x / np.pi / tau) * shape / x**2 / (np.pi * tau)
        total = np.trapezoid(integrand, x) + integrand[0] * x[0]
        assert total == pytest.approx(float(term.avar(tau)), rel=1e-5)


def test_c2_random_walk_of_point_samples() -> None:
    walk = RandomWalk(K=1.0).avar_sampled(np.array([1, 2, 5, 10, 100]), 1.0, "point")
    np.testing.assert_allclose(walk, [0.5, 0.75, 1.7, 3.35, 33.335], rtol=1e-14)
    means = RandomWalk(K=1.0).avar_sampled(np.array([1, 2, 5, 10]), 1.0, "mean")
    np.testing.assert_allclose(walk[:4] / means, [1.5, 1.125, 1.02, 1.005], rtol=1e-14)


def test_c3_gauss_markov_both_samplings_and_its_peak() -> None:
    term = GaussMarkov(q=1.0, T=100.0)
    m = np.array([1, 10, 100, 189, 500, 2000])
    means = [
        0.3308449584560374,
        3.09459532928217,
        16.80912407245783,
        19.05692091375368,
        14.05381277613316,
        4.625000001030577,
    ]
    points = [
        0.4975083125415973,
        3.11123615222801,
        16.8106506582354,
        19.05764393814916,
        14.05402899383449,
        4.625044792612166,
    ]
    np.testing.assert_allclose(term.avar_sampled(m, 1.0, "mean"), means, rtol=1e-13)
    np.testing.assert_allclose(term.avar_sampled(m, 1.0, "point"), points, rtol=1e-13)
    peak = 0.436542471073806 * term.q * math.sqrt(term.T)
    assert math.sqrt(term.avar(1.892617832925 * term.T)) == pytest.approx(peak, rel=1e-10)
    assert GM_PEAK_DEVIATION * term.sigma == pytest.approx(peak, rel=1e-10)
    assert GM_PEAK_TAU == pytest.approx(1.892617832925, rel=1e-12)
    assert SIGMA_PER_B == pytest.approx(1.075997572915214, rel=1e-12)


def test_c4_gauss_markov_at_tiny_x() -> None:
    term = GaussMarkov(q=1.0, T=1e6)
    assert float(term.avar_sampled(1, 1.0, "mean")) / 1e6 == pytest.approx(3.3333308333345e-7, rel=1e-12)
    assert float(term.avar_sampled(1, 1.0, "point")) / 1e6 == pytest.approx(4.9999975000008e-7, rel=1e-12)


def _exact_gauss_markov(x: float, m: int) -> tuple[float, float]:
    """AVAR/sigma^2 at m samples, T = m/x samples, in 60 digits: interval means and point samples."""
    with mpmath.workdps(60):
        x_, m_ = mpmath.mpf(x), mpmath.mpf(m)
        shape = (1 - (3 - 4 * mpmath.exp(-x_) + mpmath.exp(-2 * x_)) / (2 * x_)) / x_
        a = x_ / m_
        phi = mpmath.exp(-a)
        top = m_ * (1 - phi**2) - 3 * phi + 4 * phi ** (m_ + 1) - phi ** (2 * m_ + 1)
        points = top / (m_**2 * (1 - phi) ** 2)
        return float(2 * shape), float(points)


@pytest.mark.parametrize("x", [10.0**k for k in range(-8, 9)])
def test_r11_every_model_avar_in_sixty_digits(x: float) -> None:
    for m in (1, 7, 1000):
        term = GaussMarkov.from_sigma(1.0, m / x)
        means, points = _exact_gauss_markov(x, m)
        assert float(term.avar_sampled(m, 1.0, "mean")) == pytest.approx(means, rel=1e-12)
        assert float(term.avar_sampled(m, 1.0, "point")) == pytest.approx(points, rel=1e-12)
        with mpmath.workdps(60):
            floor = float(2 * mpmath.log(2) / mpmath.pi)
            tau = mpmath.mpf(x)
            closed = {
                "quantisation": 3 * mpmath.mpf(0.3) ** 2 / tau**2,
                "white": mpmath.mpf(0.7) ** 2 / tau,
                "random_walk": mpmath.mpf(0.2) ** 2 * tau / 3,
                "ramp": mpmath.mpf(0.01) ** 2 * tau**2 / 2,
            }
        for name, value in closed.items():
            assert float(EXAMPLES[name].avar(x)) == pytest.approx(float(value), rel=1e-12)
        assert float(EXAMPLES["flicker"].avar(x)) == pytest.approx(1.3**2 * floor, rel=1e-12)
    assert FLICKER_FLOOR == pytest.approx(0.664282470267960019, rel=1e-15)


@pytest.mark.parametrize("ratio,tolerance", [(10.0, 0.02), (4.0, 5e-4), (math.sqrt(10), 1e-4)])
def test_sum_of_gauss_markov_terms_is_flicker(ratio: float, tolerance: float) -> None:
    terms = Flicker(B=1.0).gauss_markov_sum(1e-7, 1e11, ratio)
    tau = np.geomspace(1, 1e4, 40)
    total = sum(t.avar(tau) for t in terms)
    np.testing.assert_allclose(total, FLICKER_FLOOR**2, rtol=tolerance)


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_json_gives_back_the_term(name: str) -> None:
    model = NoiseModel.of(EXAMPLES[name])
    assert NoiseModel.from_json(model.to_json()) == model


def test_models_add() -> None:
    model = NoiseModel.of(White(N=1.0)) + RandomWalk(K=0.5)
    tau = np.array([1.0, 10.0])
    np.testing.assert_allclose(model.avar(tau), 1 / tau + 0.25 * tau / 3, rtol=1e-15)
    assert model.state_space(0.1, sampling="point").noise == pytest.approx(10.0)
    with pytest.raises(InputError, match="do not add"):
        _ = model + NoiseModel.of(White(N=1.0), kind="acceleration")


def test_json_keeps_the_alternative() -> None:
    other = NoiseModel.of(GaussMarkov(q=0.4, T=30.0))
    model = NoiseModel(terms=(Flicker(B=1.0),), alternative=other)
    assert NoiseModel.from_json(model.to_json()) == model
    assert model.families == (NoiseModel.of(Flicker(B=1.0)), other)


@pytest.mark.parametrize(
    "make",
    [
        lambda: GaussMarkov.from_sigma(1.0, 0.0),
        lambda: Flicker(B=1.0).gauss_markov_sum(10.0, 1.0),
        lambda: Quantisation(Q=1.0, dt=0.0),
        lambda: Sinusoid(amplitude=1.0, frequency=1.0, phase=math.nan),
        lambda: NoiseModel.of(White(N=1.0)).avar_sampled(1, 1.0, "means"),
        lambda: NoiseModel.from_json({"terms": [], "estimates": [{}]}),
    ],
)
def test_what_makes_no_noise_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(InputError):
        make()


@pytest.mark.parametrize("bad", [-1.0, math.nan, math.inf, "1", None])
def test_bad_coefficients_are_refused(bad: object) -> None:
    with pytest.raises(InputError, match="White: N"):
        White(N=bad)  # type: ignore[arg-type]


def test_unknown_terms_are_refused_with_the_list() -> None:
    with pytest.raises(InputError, match="gauss_markov"):
        NoiseModel.from_json({"terms": [{"type": "pink", "B": 1.0}]})
    with pytest.raises(InputError, match="not a noise model"):
        NoiseModel.from_json({"terms": [{"type": "white", "X": 1.0}]})
