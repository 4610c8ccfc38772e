# SPDX-License-Identifier: BSD-3-Clause
"""Comparison: laws against their formulas, spreads against published ones, and records whose differences are known."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import simulate
from allanite.fitting.families import FLICKER, GAUSS_MARKOV
from allanite.fitting.objective import linearized, solve
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, White
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.quantities.distributions import chi_square_quantile
from allanite.stability.record_comparison.bias import mean_sd
from allanite.stability.record_comparison.curves import Ratio, compared, holm
from allanite.stability.record_comparison.equality import detectable, least, level_set, without_each
from allanite.stability.record_comparison.estimation import _family, compare
from allanite.stability.record_comparison.evidence import evidence_of
from allanite.stability.record_comparison.null_law import Directions, EqualityLoss, ScaledChiSquare
from allanite.stability.record_comparison.parameters import bias_comparison
from allanite.stability.record_comparison.pooled import pooled_fit
from allanite.stability.record_comparison.population import population_of
from allanite.stability.record_comparison.profiles import Profile, normal_profile, traced
from allanite.stability.record_comparison.remarks import remarks
from allanite.stability.record_comparison.series import FittedChannel, record_of
from allanite.stability.record_comparison.verdict import ComparisonVerdict
from allanite.views.figures import sheet_of
from noise_records import binomial_bound
from shell import Run

Array = NDArray[np.float64]

SAMPLES = 2048
MODEL = NoiseModel.of(White(N=1e-3), RandomWalk(K=6e-4))
#: 1.4 times the white noise.
LOUD = NoiseModel.of(White(N=1.4e-3), RandomWalk(K=6e-4))
CRITICAL = 3.841


def curve(seed: int, model: NoiseModel = MODEL, **options: object) -> AllanCurve:
    given = {"rate": 10.0, "duration": SAMPLES / 10, "seed": seed, **options}
    return allan_curve(simulate(model, **given))  # type: ignore[arg-type]


def scaled(curve_: AllanCurve, factor: float) -> AllanCurve:
    return replace(curve_, **{k: getattr(curve_, k) * factor for k in ("deviation", "lower", "upper")})


def profiles(x: Array, sd: Array) -> list[Profile]:
    return [normal_profile(float(a), float(b), CRITICAL) for a, b in zip(x, sd, strict=True)]


def limit_at(edge: float) -> Profile:
    """A record that only knows that x is not above some edge."""
    return traced(
        lambda x: max(x - edge, 0.0) ** 2 * 25 if x > edge else 0.0,
        edge,
        0.2,
        CRITICAL,
        at_zero=0.0,
    )


# -- profiles ------------------------------------------------------------------------------------------------------


def test_a_normal_profile_with_a_spread_is_the_sum_of_the_variances() -> None:
    mu = np.linspace(-5, 7, 50)
    assert np.allclose(normal_profile(1.0, 0.3, 3.8).loss(mu, 0.7), (mu - 1) ** 2 / (0.09 + 0.49), rtol=1e-12)
    assert np.allclose(normal_profile(1.0, 0.3, 3.8).loss(mu), (mu - 1) ** 2 / 0.09, rtol=1e-12)


def test_a_bent_profile_with_a_spread_is_its_envelope() -> None:
    """Eq. (1) of `profiles` against the least value over a fine grid."""
    bent = traced(lambda x: 4 * x**2 + x**3 if x > -2 else 8.0, 0.0, 0.5, CRITICAL, at_zero=8.0)
    x = np.linspace(-12, 12, 200_001)
    for mu in (-6.0, -1.0, 0.3, 4.0):
        brute = float((bent.loss(x) + ((x - mu) / 0.8) ** 2).min())
        assert bent.loss(np.array([mu]), 0.8)[0] == pytest.approx(brute, rel=1e-6, abs=1e-8)
    assert np.allclose(bent.loss(np.array([-1.0, 0.5])), [3.0, 1.125], rtol=0.03)  # knots half an sd apart


def test_an_upper_limit_says_nothing_below_it() -> None:
    limit = limit_at(2.0)
    assert not limit.supported and limit.interval[0] == -math.inf
    assert limit.interval[1] == pytest.approx(2 + math.sqrt(CRITICAL) / 5, rel=1e-3)
    assert limit.loss(np.array([-30.0, 1.9]), 0.5).max() < 1e-12 < limit.loss(np.array([3.0]), 0.5)[0]


# -- equality ------------------------------------------------------------------------------------------------------


def test_zero_as_good_as_the_best_to_rounding_leaves_the_set_open_below() -> None:
    found = traced(lambda x: max(x, 0.0) ** 2, 0.0, 0.5, CRITICAL, at_zero=-1e-12)
    assert found.interval == (-math.inf, pytest.approx(math.sqrt(CRITICAL), rel=1e-3))
    assert not found.supported


def test_equality_of_normal_estimates_is_cochrans_chi_square() -> None:
    rng = np.random.default_rng(1)
    x, sd = rng.standard_normal(6), rng.uniform(0.2, 3, 6)
    w = 1 / sd**2
    middle = float(np.average(x, weights=w))
    found = profiles(x, sd)
    bent = [
        replace(p, knots=np.append(p.knots, 9.0), roots=np.append(p.roots, (9 - p.best) * p.high))
        for p in found
    ]
    for each in (found, bent):  # in closed form, and by search
        at, q = least(each)
        assert (at, q) == (
            pytest.approx(middle, abs=1e-6),
            pytest.approx(float(w @ (x - middle) ** 2), rel=1e-9),
        )
    low, high = level_set(bent, CRITICAL)
    assert high - low == pytest.approx(2 * math.sqrt(CRITICAL / w.sum()), rel=1e-5)
    assert np.argmax(without_each(found)) == np.argmax(np.abs(x - middle) * np.sqrt(w / (1 - w / w.sum())))


def test_an_upper_limit_contradicts_only_what_lies_above_it() -> None:
    one, other = profiles(np.array([1.0, 4.0]), np.array([0.1, 0.1]))
    assert least([one, limit_at(2.0)])[1] < 1e-9
    assert least([other, limit_at(2.0)])[1] > 30


def test_a_shift_of_the_detectable_size_is_seen_in_four_of_five_cases() -> None:
    """One of five shifted by it; 4000 draws, bounds of 99.9 %."""
    sd = np.array([0.5, 0.8, 1.0, 1.2, 2.0])
    shift = detectable(profiles(np.zeros(5), sd))
    rng = np.random.default_rng(2)
    x = sd * rng.standard_normal((4000, 5)) + np.array([0, 0, shift, 0, 0])
    w = 1 / sd**2
    q = ((x - (x @ w / w.sum())[:, None]) ** 2 * w).sum(axis=1)
    seen = float((q > chi_square_quantile(0.95, 4)).mean())
    assert abs(seen - 0.8) < 3.3 * math.sqrt(0.16 / 4000)


def test_the_law_is_chi_square_where_nothing_stands_at_zero() -> None:
    u = np.array([[1.0], [0.0]])
    none = np.zeros((2, 0))
    record = Directions(shared=u, alone=none, floor=np.zeros(0))
    assert EqualityLoss.of([record] * 4, [math.inf]).law() == ScaledChiSquare(dof=3.0)
    assert EqualityLoss.of([record] * 4, [50.0]).law() == ScaledChiSquare(dof=3.0)
    assert ScaledChiSquare(dof=0.0).tail(1.0) == 1.0


def test_the_law_at_zero_is_that_of_two_half_lines() -> None:
    """Two records whose true coefficient is zero: distances from a half line, drawn here by hand."""
    one, none = np.array([[1.0]]), np.zeros((1, 0))
    law = EqualityLoss.of([Directions(shared=one, alone=none, floor=np.zeros(0))] * 2, [0.0]).law()
    y = np.random.default_rng(5).standard_normal((400_000, 2))
    both = np.maximum(y.sum(axis=1) / 2, 0.0)[:, None]
    q = ((y - both) ** 2).sum(axis=1) - (np.minimum(y, 0.0) ** 2).sum(axis=1)
    true = float(np.quantile(q, 0.95))
    assert true < chi_square_quantile(0.95, 1)
    assert law.quantile(0.95) == pytest.approx(true, rel=0.2)  # 1000 draws
    assert law.quantile(0.95) < chi_square_quantile(0.95, 1)


def random_directions(seed: int, k: int) -> list[Directions]:
    """Three shared parameters of k records with 8 lags."""
    rng = np.random.default_rng(seed)
    return [Directions.of_shared(rng.standard_normal((8, 3))) for _ in range(k)]


def test_the_loss_of_equality_is_a_difference_of_least_squares() -> None:
    records = random_directions(3, 4)
    z = list(np.random.default_rng(4).standard_normal((4, 8)))

    def left(u: Array, y: Array) -> float:
        return float(((y - u @ np.linalg.lstsq(u, y)[0]) ** 2).sum())

    together = left(np.concatenate([r.shared for r in records]), np.concatenate(z))
    apart = sum(left(r.shared, y) for r, y in zip(records, z, strict=True))
    equality = EqualityLoss.of(records, [math.inf] * 3)
    assert equality.loss(z) == pytest.approx(together - apart, rel=1e-9)
    assert equality.law() == ScaledChiSquare(dof=9.0)


@pytest.mark.long
@pytest.mark.parametrize("floor", [[0.0, math.inf, math.inf], [0.0, 0.0, 0.5]])
def test_the_loss_of_noise_follows_its_law_at_the_border(floor: list[float]) -> None:
    """Bounds of 99.9 % for 1500 losses about a 95 % point that 1000 draws set."""
    equality = EqualityLoss.of(random_directions(5, 3), floor)
    law, rng = equality.law(), np.random.default_rng(6)
    beyond = [law.tail(equality.loss(list(rng.standard_normal((3, 8))))) < 0.05 for _ in range(1500)]
    assert abs(np.mean(beyond) - 0.05) < 3.3 * math.sqrt(0.05 * 0.95 * (1 / 1500 + 1 / 1000))


def test_what_a_model_changes_by_is_its_slope_where_it_fits() -> None:
    """Central differences of the whitened residuals of a curve that is the model, in c and in ln T."""
    (series,) = of(MODEL, 1, 1)
    data, symbols, c = series.fit.data, ("N", "G", "K"), {"N": 1.0, "G": 1e-3, "K": 1e-7}
    at = solve(data, symbols, times=(300.0,), fixed=c)
    assert at.weight is not None
    fitting = replace(data, variance=data.design.columns(symbols, at.times) @ at.c)
    change, left = linearized(fitting, at)

    def residuals(x: Array) -> Array:
        mu = data.design.columns(symbols, (math.exp(x[3]),)) @ x[:3]
        return at.weight.whitened(np.cbrt(fitting.variance / mu) - at.weight.centre)

    x = np.array([*at.c, math.log(300.0)])
    np.testing.assert_allclose(left, residuals(x), rtol=1e-12)
    for i, step in enumerate([*1e-4 * at.c, 1e-4]):
        h = step * np.eye(4)[i]
        slope = (residuals(x - h) - residuals(x + h)) / (2 * step)
        np.testing.assert_allclose(change[:, i], slope, rtol=1e-4, atol=1e-7 * np.abs(slope).max())


# -- curves --------------------------------------------------------------------------------------------------------


def covariance(n: int, rho: float, seed: int) -> Array:
    lags = np.arange(n)
    scale = np.random.default_rng(seed).uniform(0.5, 2, n)
    return np.asarray(rho ** np.abs(lags[:, None] - lags) * np.outer(scale, scale))


def test_two_curves_differ_by_hotellings_distance() -> None:
    """Q = d' (C1 + C2)^-1 d: neighbouring lags do not count twice."""
    tau, a, b = np.arange(1.0, 7), covariance(6, 0.8, 1), covariance(6, 0.6, 2)
    z = np.random.default_rng(3).standard_normal((2, 6))
    found = compared([Ratio(tau=tau, z=z[0], covariance=a), Ratio(tau=tau, z=z[1], covariance=b)])
    d = z[0] - z[1]
    assert found.statistic == pytest.approx(float(d @ np.linalg.solve(a + b, d)), rel=1e-9)
    assert found.dof == 6 and np.array_equal(found.tau, tau)


@pytest.mark.long
def test_the_test_of_the_curves_keeps_its_level() -> None:
    """Four curves, one shorter than the others: p is uniform, the record that was moved is named."""
    rng = np.random.default_rng(4)
    c = [covariance(8, 0.7, i) for i in range(4)]
    tau = np.arange(1.0, 9)
    p = []
    for _ in range(400):
        z = [np.linalg.cholesky(v) @ rng.standard_normal(8) for v in c]
        short = Ratio(tau=tau[:5], z=z[3][:5], covariance=c[3][:5, :5])
        parts = [Ratio(tau=tau, z=z[i], covariance=c[i]) for i in range(3)] + [short]
        found = compared(parts)
        p.append(found.p)
    assert found.dof == 3 * 8 + 5 - 8
    assert np.abs(np.sort(p) - (np.arange(400) + 0.5) / 400).max() < 1.95 / math.sqrt(
        400
    )  # Kolmogorov, 0.1 %
    parts[1] = replace(parts[1], z=parts[1].z + 8)
    moved = compared(parts)
    assert moved.p < 1e-9 and np.argmin([r[2] for r in moved.records]) == 1 and moved.rest[1] > 1e-3


def test_holm() -> None:
    assert np.allclose(holm(np.array([0.04, 0.01, 0.03])), [0.06, 0.03, 0.06])


# -- population ----------------------------------------------------------------------------------------------------

#: Log relative risks of thirteen trials of a vaccine and their variances (Colditz et al., JAMA 271 (1994) 698).
TRIALS = np.array(
    [
        -0.8893,
        -1.5854,
        -1.3481,
        -1.4416,
        -0.2175,
        -0.7861,
        -1.6209,
        0.0120,
        -0.4694,
        -1.3713,
        -0.3394,
        0.4459,
        -0.0173,
    ]
)
VARIANCES = np.array(
    [0.3256, 0.1946, 0.4154, 0.0200, 0.0512, 0.0069, 0.2230, 0.0040, 0.0564, 0.0730, 0.0124, 0.5325, 0.0714]
)


def test_spread_of_a_published_example() -> None:
    """Q = 152.23, tau^2 = 0.318 (Paule-Mandel) and [0.120, 1.112]; published to four digits."""
    found = profiles(TRIALS, np.sqrt(VARIANCES))
    assert least(found)[1] == pytest.approx(152.23, abs=0.5)  # variances of four digits
    p = population_of(found, 0.95)
    assert p is not None
    assert p.spread**2 == pytest.approx(0.3181, rel=0.01)
    assert p.spread_lower**2 == pytest.approx(0.1197, rel=0.02)
    assert p.spread_upper**2 == pytest.approx(1.1115, rel=0.02)
    assert p.middle == pytest.approx(-0.7150, abs=0.003)


def test_without_measurement_error_the_intervals_are_students() -> None:
    from scipy.stats import t

    x = np.array([1.0, 2.0, 4.0, 4.5, 7.0])
    p = population_of(profiles(x, np.full(5, 1e-3)), 0.95)
    assert p is not None and p.next_lower is not None and p.next_upper is not None
    s, q = x.std(ddof=1), t.ppf(0.975, 4)
    assert (p.middle, p.spread) == (pytest.approx(x.mean(), abs=1e-3), pytest.approx(s, rel=1e-2))
    assert p.upper - p.lower == pytest.approx(2 * q * s / math.sqrt(5), rel=0.05)  # 20 000 draws
    assert p.next_upper - p.next_lower == pytest.approx(2 * q * s * math.sqrt(1.2), rel=0.05)


def test_records_that_agree_give_a_limit_of_the_spread_and_the_weighted_mean() -> None:
    p = population_of(profiles(np.array([0.0, 0.1, -0.1]), np.full(3, 1.0)), 0.95)
    assert p is not None and p.spread == p.spread_lower == 0 < p.spread_upper
    assert p.upper - p.lower > 2 * 1.96 / math.sqrt(3)
    assert population_of(profiles(np.array([0.0]), np.array([1.0])), 0.95) is None


@pytest.mark.parametrize("k", [2, 3, 40])
@pytest.mark.parametrize("rounding", [0.0, 1e-16, 1e-12])
def test_records_that_are_equal_bound_the_spread_as_usual_ones_do(k: int, rounding: float) -> None:
    """Q is rounding then, or nothing: a spread of 0 for certain would be as wrong as no answer."""
    x = -9.0 + rounding * np.arange(k)
    p = population_of(profiles(x, np.full(k, 0.1)), 0.95)
    assert p is not None
    assert (p.spread, p.spread_lower) == (0.0, 0.0)
    tail = chi_square_quantile(0.5, k - 1) / chi_square_quantile(0.025, k - 1)
    assert p.spread_upper == pytest.approx(0.1 * math.sqrt(tail - 1.0), rel=1e-3)
    assert p.lower <= p.middle <= p.upper


@pytest.mark.long
@pytest.mark.parametrize("case", range(12))
def test_records_of_any_shape_have_a_population(case: int) -> None:
    """Straight and bent profiles, those that end at zero, and limits, equal or not: numbers, and no division by 0."""
    rng = np.random.default_rng(case)
    k = int(rng.choice([2, 3, 5]))
    sd = rng.uniform(0.02, 0.4, k)
    x = rng.choice([0.0, 1e-12, 0.02, 1.0]) * rng.standard_normal(k) + 3.0

    def one(j: int) -> Profile:
        ceiling = float(rng.uniform(0.0, 6.0))
        shapes = (
            lambda: normal_profile(x[j], sd[j], CRITICAL),
            lambda: traced(
                lambda t: min(((t - x[j]) / sd[j]) ** 2, ceiling if t < x[j] else math.inf),
                x[j], sd[j], CRITICAL, at_zero=ceiling,
            ),
            lambda: limit_at(float(x[j])),
        )  # fmt: skip
        return shapes[int(rng.integers(0, 3))]()

    found = [one(j) for j in range(k)]
    p = population_of(found, 0.95)
    if p is not None:
        ends = [p.lower, p.middle, p.upper, p.spread_lower, p.spread, p.spread_upper]
        assert np.isfinite(ends).all()
        assert p.spread_lower <= p.spread <= p.spread_upper
    assert np.isfinite(without_each(found)).all()


@pytest.mark.long
def test_an_upper_limit_far_below_the_others_widens_the_spread() -> None:
    resolved = profiles(np.array([1.0, 1.1, 0.9]), np.full(3, 0.1))
    alone, above, below = (
        population_of(p, 0.95) for p in (resolved, [*resolved, limit_at(3.0)], [*resolved, limit_at(-3.0)])
    )
    assert alone is not None and above is not None and below is not None
    assert above.spread == pytest.approx(alone.spread, abs=0.01)
    assert below.spread > 1.0 and below.resolved == 3


@pytest.mark.long
@pytest.mark.parametrize(("k", "spread"), [(3, 0.0), (3, 2.0), (8, 0.7)])
def test_middle_and_spread_cover(k: int, spread: float) -> None:
    """60 draws each; a right interval covers fewer than 50 in one of a thousand cases."""
    rng = np.random.default_rng(k)
    covered = np.zeros(3)
    for _ in range(60):
        sd = rng.uniform(0.5, 2, k)
        p = population_of(profiles(spread * rng.standard_normal(k) + sd * rng.standard_normal(k), sd), 0.95)
        assert p is not None and p.next_lower is not None and p.next_upper is not None
        ahead = spread * rng.standard_normal()
        covered += (
            p.lower <= 0 <= p.upper,
            p.spread_lower <= spread <= p.spread_upper,
            p.next_lower <= ahead <= p.next_upper,
        )
    assert (covered >= 50).all(), covered


# -- bias ----------------------------------------------------------------------------------------------------------


def test_sd_of_a_mean_is_that_of_the_noise_model() -> None:
    """White and walk in closed form; a Gauss-Markov term as the double sum of its covariance; flicker by its states."""
    assert mean_sd(NoiseModel.of(White(N=2.0)), 100.0, 800, 0.1) == pytest.approx(2 / math.sqrt(80))
    assert mean_sd(NoiseModel.of(RandomWalk(K=2.0)), 75.0, 750, 0.1) == pytest.approx(10.0)
    t = np.linspace(0, 10, 2001)
    kept = np.exp(-np.abs(t[:, None] - t) / 3).mean()
    drift = NoiseModel.of(GaussMarkov.from_sigma(1.5, 3.0))
    assert mean_sd(drift, 10.0, 100, 0.1) ** 2 == pytest.approx(1.5**2 * kept, rel=2e-3)
    flicker = mean_sd(NoiseModel.of(Flicker(B=1.0)), 1000.0, 10_000, 0.1)
    states = NoiseModel.of(
        *(GaussMarkov.from_sigma(math.sqrt(math.log(2) / math.pi), 3e4 / 2 ** (i + 0.5)) for i in range(24))
    )
    assert flicker == pytest.approx(mean_sd(states, 1000.0, 10_000, 0.1), rel=0.02)


# -- records -------------------------------------------------------------------------------------------------------


def test_records_of_one_noise_are_not_told_apart() -> None:
    curves = [curve(s) for s in (1, 2, 3)]
    found = compare(curves, names=["a", "b", "c"])
    assert found.to_json() == compare(curves, names=["a", "b", "c"], threads=1).to_json()
    c = found["gyro"]
    assert found.verdict is ComparisonVerdict.NO_DIFFERENCE and found.p > 0.05
    for symbol, truth in (("N", 1e-3), ("K", 6e-4)):
        assert c[symbol].common.lower < truth < c[symbol].common.upper
    population = c["N"].population
    assert population is not None and population.middle.lower < 1e-3 < population.middle.upper
    assert not any(v.resolved for v in c["B"].records) and c["B"].population is None
    assert c.bias is None  # a curve does not know the mean
    assert json.dumps(found.to_json(), allow_nan=False)


@pytest.mark.long
def test_a_record_with_more_noise_is_named_and_the_others_agree() -> None:
    curves = [curve(s) for s in (1, 2, 3)]
    found = compare([*curves, curve(4, LOUD)], names=list("abcd"))
    c = found["gyro"]
    assert (
        found.verdict is ComparisonVerdict.DIFFER and "N" in found.reason and "d stands out" in found.reason
    )
    for outlier in (c.outlier, c["N"].outlier):
        assert outlier is not None and outlier.record == "d" and outlier.p < 1e-3 and outlier.rest_p > 0.05
    assert c["N"].worst == "d" and c["N"].worst_p is not None and c["N"].worst_p < 1e-3
    population = c["N"].population
    assert population is not None and population.spread.lower > 0
    assert population.spread.value == pytest.approx(np.std([0, 0, 0, math.log(1.4)], ddof=1), rel=0.2)


@pytest.mark.long
def test_a_walk_that_one_record_excludes_and_another_shows_differs() -> None:
    """The record without a walk gives a limit only, and takes part with it."""
    strong = [curve(s, NoiseModel.of(White(N=1e-3), RandomWalk(K=2e-3))) for s in (1, 2)]
    quiet = curve(3, NoiseModel.of(White(N=1e-3)))
    found = compare([*strong, quiet], names=["x", "y", "quiet"])
    k = found["gyro"]["K"]
    assert [v.resolved for v in k.records] == [True, True, False] and math.isnan(k.records[2].value)
    assert k.equality is not None and k.equality.p < 1e-3
    assert k.outlier is not None and k.outlier.record == "quiet" and k.outlier.rest_p > 0.05


@pytest.mark.long
def test_rates_lengths_and_sampling_conventions_may_differ() -> None:
    others = (
        {"rate": 7.0, "duration": SAMPLES / 7},
        {"rate": 20.0, "duration": SAMPLES / 20, "sampling": "point"},
    )
    found = compare([curve(1), *(curve(5 + i, **o) for i, o in enumerate(others))], names=list("abc"))
    assert found.verdict is ComparisonVerdict.NO_DIFFERENCE
    assert all(
        any(words in r for r in remarks(found)) for words in ("the sample rates differ", "point samples")
    )
    n = found["gyro"]["N"].common
    assert n.lower < 1e-3 < n.upper
    moved = compare([curve(1), scaled(curve(5, **others[0]), 1.3)], names=["a", "b"])
    assert (
        moved.verdict is ComparisonVerdict.DIFFER and moved["gyro"].outlier is None
    )  # of two, nobody can tell which


@pytest.mark.parametrize("stated", [(None, 0.01), (0.002, 0.01), (0.01, 0.01)])
def test_a_scale_factor_in_no_test_is_named_with_what_it_may_set_apart(
    stated: tuple[float | None, float],
) -> None:
    """Of the largest: two calibrations of u each differ by 1.96 sqrt(2) u."""
    curves = [
        replace(c, channels=(replace(c.channels[0], scale_uncertainty=u),))
        for c, u in zip((curve(1), curve(2)), stated, strict=True)
    ]
    found = compare(curves, names=["a", "b"])
    assert found["gyro"].scale_uncertainty == 0.01
    (words,) = [r for r in remarks(found) if "scale factor" in r]
    assert "uncertainty of the scale factor, 1 %" in words and "by 2.8 % of" in words
    plain = compare([curve(1), curve(2)], names=["a", "b"])
    assert plain["gyro"].scale_uncertainty is None and plain.p == found.p
    assert not any("scale factor" in r for r in remarks(plain))


@pytest.mark.long
def test_units_are_converted_and_kinds_must_agree() -> None:
    y = simulate(MODEL, rate=10.0, duration=SAMPLES / 10, seed=1).values("gyro")
    degrees = al.Recording.from_rate(np.degrees(y), rate=10.0, unit="deg/s", names=["g"])
    metres = al.Recording.from_rate(y, rate=10.0, unit="m/s^2", names=["a"])
    found = compare([allan_curve(degrees), curve(2)], names=["deg", "rad"])
    assert found.verdict is ComparisonVerdict.NO_DIFFERENCE and found.channels[0].name == "signal"
    with pytest.raises(InputError, match="measure different quantities"):
        compare([allan_curve(metres), curve(2)])


def test_what_is_refused() -> None:
    a, b = curve(1), curve(2)
    with pytest.raises(InputError, match="at least two"):
        compare([a])
    with pytest.raises(InputError, match="same samples"):
        compare([a, a])
    with pytest.raises(InputError, match="as many names"):
        compare([a, b], names=["a"])
    with pytest.raises(InputError, match="no channel 'y'"):
        compare([a, b], channels=["y"])
    with pytest.raises(InputError, match="one name, or one for each"):
        compare([a, b], channels=[["x", "y", "z"]])
    with pytest.raises(InputError, match="level must lie between"):
        compare([a, b], level=0.0)
    with pytest.raises(InputError, match="make a study"):
        compare([a, simulate(MODEL, rate=10.0, duration=10.0, seed=1)])
    with pytest.raises(FormatError, match="not a study"):
        compare([a, {"format": "allanite-plan"}])
    other = allan_curve(simulate(MODEL, rate=10.0, duration=60.0, seed=1), statistic="hdev")
    with pytest.raises(InputError, match="oadev"):
        compare([a, other])


@pytest.mark.long
def test_studies_know_their_means_and_a_turn_on_bias_shows() -> None:
    """Means many sd apart; the noise is the same, and the verdict speaks of the noise."""
    biases = (0.0, 0.06, -0.03)
    records = [
        simulate(MODEL, rate=10.0, duration=SAMPLES / 10, seed=20 + i, turn_on_bias=b)
        for i, b in enumerate(biases)
    ]
    studies = [al.characterize(r) for r in records]
    found = compare(studies, names=["a", "b", "c"])
    bias = found["gyro"].bias
    assert bias is not None and bias.population is not None and bias.equality is not None
    assert found.verdict is ComparisonVerdict.NO_DIFFERENCE and bias.equality.p_adjusted < 0.01
    assert bias.population.spread.value == pytest.approx(np.std(biases, ddof=1), rel=0.3)
    sheet = al.plot(found)
    assert [a.get_title(loc="left").split(":")[0] for a in sheet.axes[:3]] == ["gyro", "N", "B"]
    assert len(al.plot(found, interactive=True, view="curves").sheet.panels[0].curves) >= 4
    with pytest.raises(InputError, match="view"):
        al.plot(found, view="pie")


# -- the command ---------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_compare_logs_and_studies(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for i, n in enumerate((1.0, 1.0, 1.5)):
        model = NoiseModel.of(White(N=1e-3 * n), RandomWalk(K=6e-4))
        write_recording(simulate(model, rate=10.0, duration=SAMPLES / 10, seed=30 + i), f"sn{i}.parquet")
    assert run("characterize", "sn0.parquet", "--out", "first").code == 0
    places = ["first", "sn1.parquet", "sn2.parquet"]
    done = run("compare", *places, "--names", "A,B,C", "--out", "both", "--plot", "both.png")
    assert done.code == 0, done.err
    assert "The records differ. gyro in N; C stands out, the others agree." in done.out
    assert {p.name for p in Path("both").iterdir()} == {"report.html", "comparison.json", "parameters.csv"}
    page = Path("both/report.html").read_text(encoding="utf-8")
    assert "C stands out" in page and "Paule" in page
    document = json.loads(Path("both/comparison.json").read_text(encoding="utf-8"))
    assert document["format"] == "allanite-comparison" and document["records"][0]["sha256"]
    assert run("report", "both/comparison.json", "-o", "again.html").code == 0
    assert run("compare", *places, "--out", "both").code == 1  # the files are there
    same = run("compare", "sn0.parquet", "sn0.parquet")
    assert same.code == 1 and "same samples" in same.err
    assert run("compare", "sn0.parquet").code == 1
    gone = run("compare", "sn0.parquet", "gone.csv")
    assert gone.code == 1 and "no such file: gone.csv" in gone.err


@pytest.mark.parametrize("unit", [1e5, 1e12])
def test_common_bias_does_not_depend_on_its_unit(unit: float) -> None:
    """Of normal estimates: the weighted mean with the interval of its standard deviation."""
    values, sd = np.array([1.0, 2.0, 1.5]), np.array([1.0, 0.3, 2.0])
    found = bias_comparison(["a", "b", "c"], profiles(unit * values, unit * sd), 0.95, "rad/s")
    weight = 1 / sd**2
    middle, reach = float(np.average(values, weights=weight)), math.sqrt(CRITICAL / weight.sum())
    common = [x / unit for x in (found.common.value, found.common.lower, found.common.upper)]
    assert common == pytest.approx([middle, middle - reach, middle + reach], rel=1e-9)
    assert found.population is not None and found.detectable is not None
    one = bias_comparison(["a", "b", "c"], profiles(values, sd), 0.95, "rad/s")
    assert one.population is not None and one.detectable is not None
    assert found.population.middle.upper / unit == pytest.approx(one.population.middle.upper, rel=1e-9)
    assert found.detectable / unit == pytest.approx(one.detectable, rel=1e-9)


@pytest.mark.long
def test_picture_has_a_column_for_each_channel_and_no_hole() -> None:
    """Three channels side by side: as wide as high, or wider; a parameter that one lacks leaves its place free."""
    two = compare([curve(1), curve(2)], names=["a", "b"]).to_json()
    (channel,) = two["channels"]
    few = {**channel, "name": "z", "parameters": channel["parameters"][:1]}
    three = {**two, "channels": [{**channel, "name": "x"}, {**channel, "name": "y"}, few]}
    sheet = sheet_of(three)
    assert {len(row) for row in sheet.rows} == {3}
    for row in sheet.rows[1:]:
        labels = {p.y.label for p in row if p.drawing is None}
        assert len(labels) == 1 and all(p.drawing is None for p in row[:2])
    assert sum(p.drawing is not None for p in sheet.panels) == len(channel["parameters"]) - 1 > 0
    width, height = al.plot(three).get_size_inches()
    assert height <= width
    assert "AllaniteChart" in al.plot(three, interactive=True).to_html()
    alone = sheet_of(two)
    said = [c.label for p in alone.panels for c in p.curves if c.label]
    assert {len(row) for row in alone.rows} == {1} and len(set(said)) == len(said)


@pytest.mark.long
def test_records_of_flicker_noise_are_not_taken_for_gauss_markov_because_they_are_many() -> None:
    """Each record may have a correlation time of its own: what that gains by chance adds up."""
    model = NoiseModel.of(White(N=1e-3), Flicker(B=1e-4), RandomWalk(K=1.2e-5))
    found = []
    for i in range(80):
        one = curve(i, model, rate=2.0, duration=18_000.0)
        found.append(record_of(one).series(one.names[0]))
    rng = np.random.default_rng(1)
    groups = [[found[i] for i in rng.choice(len(found), 10, replace=False)] for _ in range(100)]
    wrong = sum(_family(group)[0] == "gauss-markov" for group in groups)
    assert wrong <= binomial_bound(len(groups), 0.02)


def of(model: NoiseModel, count: int, seed: int) -> list[FittedChannel]:
    found = []
    for i in range(count):
        one = curve(seed + i, model, rate=2.0, duration=6_000.0)
        found.append(record_of(one).series(one.names[0]))
    return found


@pytest.mark.long
def test_quantisation_and_ramp_take_part_where_something_shows_them() -> None:
    plain = NoiseModel.of(White(N=1e-3), Flicker(B=1e-4), RandomWalk(K=1.2e-5))
    rough = NoiseModel.of(Quantisation(Q=3e-3), *plain.terms)
    steep = NoiseModel.of(*plain.terms, Ramp(R=5e-6))
    quick = NoiseModel.of(White(N=1e-3), GaussMarkov.from_sigma(3e-4, 100.0))
    same = of(plain, 6, 300)
    assert pooled_fit(same, FLICKER)[1].symbols == ("N", "B", "K")
    assert pooled_fit(of(rough, 2, 310), FLICKER)[1].symbols == ("Q", "N", "B", "K")
    assert pooled_fit([*same, *of(steep, 1, 320)], FLICKER)[1].symbols == ("N", "B", "K", "R")
    assert pooled_fit(of(quick, 3, 340), GAUSS_MARKOV)[1].symbols == ("N", "G", "K")
    some = evidence_of(of(quick, 1, 340)[0], ("N", "G", "K"), 0.95)
    assert set(some.profiles) >= {"N", "B_equiv", "T", "K"} and "Q" not in some.profiles
    assert some.profiles["N"].best == pytest.approx(math.log(1e-3), abs=0.05)


@pytest.mark.long
def test_white_noise_of_many_records_is_not_low() -> None:
    """The mean of N over 50 records: with quantisation in every fit it was 0.4 of its standard deviation low."""
    plain = NoiseModel.of(White(N=1e-3), Flicker(B=1e-4), RandomWalk(K=1.2e-5))
    z = []
    for one in of(plain, 50, 400):
        profile = evidence_of(one, ("N", "B", "K"), 0.95).profiles["N"]
        z.append((profile.best - math.log(1e-3)) / profile.sd)
    assert abs(np.mean(z)) < 3 / math.sqrt(len(z))
    low, high = (chi_square_quantile(p, len(z)) for p in (1e-4, 1 - 1e-4))
    assert low < np.sum(np.square(z)) < high
