# SPDX-License-Identifier: BSD-3-Clause
"""Theo1 and its forms, the Haar wavelet variance, the robust variance: values, laws, refusals."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import allanite as al
import reference
from allanite import _kernels
from allanite.errors import DataQualityError, InputError
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    TermType,
    White,
)
from allanite.noise.allan import covariance, robust, theo_covariance
from allanite.noise.allan.curve import AllanCurve
from allanite.noise.allan.degrees import chi_square_factors, shifted_factors
from allanite.noise.allan.statistics import STATISTICS, Phase
from allanite.noise.allan.theo import ratio_lags, sums_of_inner_squares, thinning
from allanite.recording.records import Recording
from reference import Floats

NEW = ("haar", "robust", "theo1", "theobr", "theoh")
TERMS = (White(N=1.0), Flicker(B=1.0), RandomWalk(K=1.0), GaussMarkov.from_sigma(1.0, 40.0))


def curve(y: object, statistic: str, **options: object) -> AllanCurve:
    recording = Recording.from_rate(np.asarray(y), rate=1.0, unit="rad/s")
    return al.allan_curve(recording, statistic=statistic, **options)  # type: ignore[arg-type]


def with_gaps(n: int, seed: int = 3) -> Floats:
    y = np.random.default_rng(seed).standard_normal(n)
    y[[0, n // 3, n // 3 + 1, n - 1]] = np.nan
    return y


def lehmer(n: int) -> Floats:
    state, values = 1234567890, np.empty(n)
    for i in range(n):
        values[i] = state / 2147483647
        state = 16807 * state % 2147483647
    return values


# -- kernels ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("m", [2, 10, 24, 90])
def test_theo_squares_against_twin(m: int) -> None:
    y = with_gaps(300)
    x, runs = reference.phase_of(y), reference.runs_where(reference.complete(y, m))
    value = _kernels.theo_squares(x, x[m // 2 :], m // 2, runs)
    assert value == pytest.approx(reference.theo_squares(y, m)[0], rel=1e-12)


@pytest.mark.parametrize("m", [1, 7, 60])
@pytest.mark.parametrize("cut", [0.5, 30.0])
def test_biweight_sums_against_twin(m: int, cut: float) -> None:
    y = with_gaps(3000)
    x, runs = reference.phase_of(y), reference.runs_where(reference.complete(y, 2 * m))
    value = _kernels.biweight_sums(x, m, runs, 1.7 * m, cut)
    np.testing.assert_allclose(value, reference.biweight_sums(y, m, 1.7 * m, cut), rtol=1e-12)


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        ("theo_squares", (np.zeros(9), np.zeros(9), 0, np.array([[0, 1]]))),
        ("theo_squares", (np.zeros(9), np.zeros(9), 9, np.array([[0, 1]]))),
        ("theo_squares", (np.zeros(9), np.zeros(7), 3, np.array([[0, 5]]))),
        ("biweight_sums", (np.zeros(9), 0, np.array([[0, 1]]), 1.0, 1.0)),
        ("biweight_sums", (np.zeros(9), 2, np.array([[0, 6]]), 1.0, 1.0)),
        ("biweight_sums", (np.zeros(9), 2, np.array([[0, 5]]), 0.0, 1.0)),
        ("biweight_sums", (np.zeros(9), 2, np.array([[0, 5]]), 1.0, math.nan)),
    ],
)
def test_bad_arguments_are_refused(kernel: str, arguments: tuple[object, ...]) -> None:
    with pytest.raises(ValueError, match=r"must be|before the window leaves"):
        getattr(_kernels, kernel)(*arguments)


# -- values -------------------------------------------------------------------------------------------------------


def test_r2_theo1_of_the_thousand_points() -> None:
    found = curve(lehmer(1000), "theo1", taus=[7.5, 75.0, 750.0])
    np.testing.assert_array_equal(found.lags, [10, 100, 1000])
    np.testing.assert_allclose(
        found.deviation[:, 0], [0.1075739889, 0.03178931260, 0.005052399627], rtol=1e-9
    )
    np.testing.assert_array_equal(found.count[:, 0], [991, 901, 1])


def test_r13_theo1_of_an_independent_package() -> None:
    allantools = pytest.importorskip("allantools")
    y = np.random.default_rng(13).standard_normal(600)
    m, expected, _, _ = allantools.theo1(y, rate=1.0, data_type="freq", taus=[10, 64, 300])
    np.testing.assert_allclose(curve(y, "theo1", taus=0.75 * m).deviation[:, 0], expected, rtol=1e-11)


def test_theobr_and_theoh_by_their_definitions() -> None:
    y = np.cumsum(np.random.default_rng(5).standard_normal(300)) + 3.0
    theo1, oadev = (lambda m, s=s: _one(y, s, m) ** 2 for s in ("theo1", "oadev"))
    ratios = [oadev(9 + 3 * j) / theo1(12 + 4 * j) for j in range(301 // 30 - 3 + 1)]
    theobr, hybrid = curve(y, "theobr"), curve(y, "theoh")
    np.testing.assert_array_equal(theobr.lags, [16, 32, 64, 128, 256])
    expected = [math.sqrt(np.mean(ratios) * theo1(int(m))) for m in theobr.lags]
    np.testing.assert_allclose(theobr.deviation[:, 0], expected, rtol=1e-11)
    np.testing.assert_array_equal(hybrid.lags, [1, 2, 4, 8, 16, 32, 64, 128, 256])
    np.testing.assert_array_equal(hybrid.tau, [1, 2, 4, 8, 16, 32, 48, 96, 192])
    both = [*(_one(y, "oadev", m) for m in (1, 2, 4, 8, 16, 32)), *theobr.deviation[2:, 0]]
    np.testing.assert_allclose(hybrid.deviation[:, 0], both, rtol=1e-12)
    given = curve(y, "theoh", taus=[192.0, 3.0, 96.0])
    expected = [_one(y, "oadev", 3), hybrid.deviation[7, 0], hybrid.deviation[-1, 0]]
    np.testing.assert_allclose(given.deviation[:, 0], expected, rtol=1e-12)


def _one(y: Floats, statistic: str, m: int) -> float:
    tau = 0.75 * m if statistic == "theo1" else float(m)
    return float(curve(y, statistic, taus=[tau]).deviation[0, 0])


def test_haar_is_the_unbiased_modwt_wavelet_variance() -> None:
    """Of the coefficients of the maximal overlap transform, scale m = 2^(j-1); and half of the Allan variance."""
    y = np.random.default_rng(1).standard_normal(500)
    found = curve(y, "haar")
    for m, value in zip(found.lags.tolist(), found.variance[:, 0], strict=True):
        filter_ = np.concatenate((np.full(m, 1 / (2 * m)), np.full(m, -1 / (2 * m))))
        assert value == pytest.approx(float(np.mean(np.convolve(y, filter_, "valid") ** 2)), rel=1e-11)
    allan = curve(y, "oadev")
    for name in ("deviation", "lower", "upper"):
        np.testing.assert_allclose(getattr(found, name) * math.sqrt(2), getattr(allan, name), rtol=1e-12)
    np.testing.assert_array_equal(found.edf, allan.edf)


def test_robust_solves_its_equation() -> None:
    y = np.random.default_rng(2).standard_normal(2000)
    constants = robust.biweight()
    found = curve(y, "robust", taus=[1.0, 10.0, 100.0])
    for m, count, variance in zip([1, 10, 100], found.count[:, 0], found.variance[:, 0], strict=True):
        psi, _ = reference.biweight_sums(y, m, 2 * m * m * variance, robust.CUTOFF**2, float(y[0]))
        assert psi / count == pytest.approx(constants.level, rel=1e-9)


# -- relations every statistic keeps ------------------------------------------------------------------------------


@pytest.mark.parametrize("statistic", NEW)
def test_m1_m2_m3_offset_scale_and_direction(statistic: str) -> None:
    y = np.random.default_rng(7).standard_normal(400)
    base = curve(y, statistic)
    for changed, factor in ((y + 1e6, 1.0), (-1e-9 * y, 1e-9), (y[::-1], 1.0)):
        other = curve(changed, statistic)
        np.testing.assert_allclose(other.deviation, factor * base.deviation, rtol=2e-8)
        np.testing.assert_allclose(other.edf, base.edf, rtol=1e-9)


@pytest.mark.parametrize("statistic", NEW)
def test_b1_gaps_leave_out_exactly_the_windows_that_they_touch(statistic: str) -> None:
    y = with_gaps(700)
    found = curve(y, statistic)
    inside = curve(y[1:-1], statistic, taus=found.tau[found.count[:, 0] > 0])
    np.testing.assert_array_equal(inside.count[:, 0], found.count[found.count[:, 0] > 0, 0])
    if statistic in ("haar", "theo1"):  # the others hold numbers of the whole record
        np.testing.assert_allclose(
            inside.deviation[:, 0], found.deviation[found.count[:, 0] > 0, 0], rtol=1e-9
        )
    assert np.all(np.isfinite(found.deviation) == (found.count > 0))
    assert np.all(np.isfinite(found.upper) == (found.count > 0))


@pytest.mark.parametrize("statistic", NEW)
def test_angles_are_the_same_as_rates(statistic: str) -> None:
    y = np.random.default_rng(9).standard_normal(500)
    angle = Recording.from_angle(np.concatenate([[0.0], np.cumsum(y)]) / 4.0, rate=4.0, unit="rad")
    rate = Recording.from_rate(y, rate=4.0, unit="rad/s")
    a, b = (al.allan_curve(r, statistic=statistic) for r in (angle, rate))
    np.testing.assert_allclose(a.deviation, b.deviation, rtol=1e-9)
    np.testing.assert_array_equal(a.tau, b.tau)


def test_a_missing_angle_spoils_the_windows_of_theo1_that_hold_it() -> None:
    theta = np.cumsum(np.random.default_rng(9).standard_normal(301))
    theta[100] = np.nan
    found = al.allan_curve(
        Recording.from_angle(theta, rate=1.0, unit="rad"), statistic="theo1", taus=[7.5, 37.5]
    )
    np.testing.assert_array_equal(found.count[:, 0], [291 - 11, 251 - 51])


@pytest.mark.parametrize("statistic", NEW)
def test_m10_threads_give_the_same_bits(statistic: str) -> None:
    y = np.random.default_rng(4).standard_normal(1500)
    one, three = (curve(y, statistic, threads=k) for k in (1, 3))
    np.testing.assert_array_equal(one.deviation, three.deviation)


@pytest.mark.parametrize("statistic", NEW)
def test_m13_curves_survive_the_file(statistic: str, tmp_path: object) -> None:
    found = curve(with_gaps(300), statistic)
    back = AllanCurve.from_csv(found.to_csv(tmp_path / "c.csv"))  # type: ignore[operator]
    for name in ("lags", "tau", "deviation", "lower", "upper", "edf", "count"):
        np.testing.assert_array_equal(getattr(back, name), getattr(found, name))


# -- Theo1: mean, bias, degrees of freedom ------------------------------------------------------------------------


def _exact(term: TermType, m: int, n: int, sampling: str) -> tuple[float, float]:
    """Mean and degrees of freedom of Theo1 from the whole matrix of its quadratic form."""
    t = np.abs(np.arange(n + 1)[:, None] - np.arange(n + 1)).astype(float)
    S, F = term.phase_covariance(t, 1.0, sampling), np.zeros((n + 1, n + 1))
    for i in range(n - m + 1):
        for d in range(1, m // 2 + 1):
            z = np.zeros(n + 1)
            np.add.at(z, [i, i + d, i + m - d, i + m], [1.0, -1.0, -1.0, 1.0])
            places = np.flatnonzero(z)
            F[np.ix_(places, places)] += np.outer(z[places], z[places]) / d
    product = F @ S
    mean = float(np.trace(product))
    return mean / (0.75 * m**2 * (n - m + 1)), mean**2 / float(np.sum(product * product.T))


@pytest.mark.parametrize("term", [*TERMS, Quantisation(Q=1.0, dt=1.0)], ids=lambda t: t.type)
@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_u1_theo1_mean_and_edf_against_full_matrices(term: TermType, sampling: str) -> None:
    model = NoiseModel.of(term)
    for m, n, tolerance in ((10, 40, 1e-7), (40, 64, 1e-7), (80, 120, 0.02)):
        mean, edf = _exact(term, m, n, sampling)
        assert theo_covariance.mean(model, [m], 1.0, sampling)[0] == pytest.approx(mean, rel=1e-9)
        assert theo_covariance.edf_theo1(model, [m], n, 1.0, sampling)[0] == pytest.approx(edf, rel=tolerance)


def test_theo1_is_unbiased_for_white_noise_and_biased_as_published_for_red() -> None:
    m = [16, 100, 4096, 1_000_000]
    np.testing.assert_allclose(
        theo_covariance.theo1_bias(NoiseModel.of(White(N=2.0)), m, 0.1, "mean"), 1.0, rtol=1e-12
    )
    # Taylor and Howe give 1.87 and 2.70 for long windows.
    assert theo_covariance.theo1_bias(NoiseModel.of(Flicker(B=1.0)), m[3:], 1.0, "mean")[0] == pytest.approx(
        1.87, rel=7e-3
    )
    walk = theo_covariance.theo1_bias(NoiseModel.of(RandomWalk(K=1.0)), m[3:], 1.0, "point")
    assert walk[0] == pytest.approx(2.70, rel=1e-3)


def test_theo1_bias_of_a_ramp() -> None:
    """z_d = R d (m - d): E = R^2 sum d (m - d)^2/(0.75 m^2), and AVAR = R^2 (0.75 m)^2/2."""
    m, d = 200, np.arange(1, 101)
    expected = (0.75 * m) ** 2 / 2 / (float(np.sum(d * (m - d) ** 2)) / (0.75 * m**2))
    assert theo_covariance.theo1_bias(NoiseModel.of(Ramp(R=3.0)), [m], 1.0, "mean")[0] == pytest.approx(
        expected, rel=1e-12
    )
    found = curve(3e-3 * np.arange(500.0), "theo1", taus=[0.75 * m])
    assert found.variance[0, 0] == pytest.approx(
        float(theo_covariance.mean(NoiseModel.of(Ramp(R=3e-3)), [m], 1.0, "mean")[0]), rel=1e-9
    )


def test_gaps_cost_theo1_the_degrees_of_freedom_of_the_windows_that_are_gone() -> None:
    """Two halves that do not see each other have twice the degrees of freedom of one (white noise)."""
    model, m = NoiseModel.of(White(N=1.0)), 20
    half = np.array([[0, 181]])
    both = np.array([[0, 181], [1200, 1381]])
    one, two = (theo_covariance.edf_theo1(model, [m], 2000, 1.0, "mean", [s])[0] for s in (half, both))
    whole = theo_covariance.edf_theo1(model, [m], 200, 1.0, "mean")[0]
    assert one == pytest.approx(whole, rel=1e-9)
    assert two == pytest.approx(2 * one, rel=1e-9)


def test_a_law_of_the_right_skewness_has_the_quantiles_of_the_exact_one() -> None:
    """A constant plus a chi-square law is the shifted law itself."""
    share, dof = 0.4, 3.0  # Q = 1 - share + share X/dof
    edf, shape = 2 / (share**2 * 2 / dof), dof
    low, high = shifted_factors(np.array([edf]), np.array([shape]), 0.9)
    x_low, x_high = chi_square_factors(np.array([dof]), 0.9)
    np.testing.assert_allclose(
        [low[0] ** -2, high[0] ** -2], [1 - share + share * v[0] ** -2 for v in (x_low, x_high)]
    )
    same = shifted_factors(np.array([7.0]), np.array([7.0]), 0.9)
    np.testing.assert_allclose(same, chi_square_factors(np.array([7.0]), 0.9), rtol=1e-12)


def test_long_windows_are_thinned_without_harm() -> None:
    """Every s-th start: the same estimate to a small part of its own spread; the mean of white noise to the digit."""
    y = np.random.default_rng(6).standard_normal(6000)
    exact, thin = (curve(y, "theo1", engine=e) for e in ("exact", "decimated"))
    assert (exact.engine, thin.engine) == ("exact", "decimated")
    assert [thinning(m) for m in (10, 510, 512, 4096)] == [1, 1, 2, 16]
    short = exact.lags < 512
    np.testing.assert_array_equal(exact.deviation[short], thin.deviation[short])
    spread = np.sqrt(2 / exact.edf)
    assert np.all(np.abs(thin.variance / exact.variance - 1) < 0.15 * spread)


# -- robust -------------------------------------------------------------------------------------------------------


def test_robust_constants() -> None:
    constants = robust.biweight()
    assert constants.efficiency == pytest.approx(0.8, rel=1e-9)
    z = np.random.default_rng(0).standard_normal(1_000_000)
    psi = z**2 * np.clip(1 - z**2 / robust.CUTOFF**2, 0, None) ** 4
    assert psi.mean() == pytest.approx(constants.level, abs=4 * psi.std() / 1000)
    assert psi.var() == pytest.approx(float(constants.series.sum()), rel=6e-3)  # four standard errors


def test_robust_edf_by_the_plain_sum() -> None:
    model, n, m, constants = NoiseModel.of(RandomWalk(K=1.0)), 300, 12, robust.biweight()
    windows = n - 2 * m + 1
    k = np.arange(-windows + 1, windows).astype(float)
    r = covariance.cross_covariance(
        RandomWalk(K=1.0), np.array([[m, m]], dtype=float), np.array([0, len(k)]), k, "mean"
    )
    rho = r / r[windows - 1]
    series = sum(c * rho ** (2 * i + 2) for i, c in enumerate(constants.series))
    expected = 2 * constants.slope**2 * windows**2 / float(np.sum((windows - np.abs(k)) * series))
    assert robust.edf(model, [m], n, 1.0, "mean")[0] == pytest.approx(expected, rel=1e-6)
    assert expected < covariance.edf(model, [m], n, 1.0, "mean")[0]


def test_outliers_move_the_robust_curve_little_and_the_other_far() -> None:
    rng = np.random.default_rng(8)
    clean = rng.standard_normal(100_000)
    dirty = clean.copy()
    dirty[rng.choice(len(clean), 200, replace=False)] += 100.0
    lags = [1.0, 4.0, 16.0]
    truth, bad = curve(dirty, "robust", taus=lags), curve(dirty, "oadev", taus=lags)
    expected = 1 / np.sqrt(lags)
    # A share e = 2 m 0.2 % of windows is cut off, so the mean of psi falls by e: ln s by e a/D = 1.55 e.
    shift = np.sqrt(1 - 1.6 * 2 * np.array(lags) * 0.002)
    ok = [True, True, False]  # at m = 16 a disturbance is no longer beyond the cut
    np.testing.assert_allclose(truth.deviation[:, 0][ok], (expected * shift)[ok], rtol=0.02)
    assert np.all(bad.deviation[:, 0] > 4 * expected)


def test_b3_a_record_that_hardly_moves_has_no_robust_variance() -> None:
    """One window in twenty differs from zero: no scale makes them a sample of a normal law."""
    y = np.zeros(1000)
    y[::40] = 1.0
    found = curve(y, "robust", taus=[1.0])
    assert np.isnan([found.deviation, found.lower, found.upper, found.edf]).all()
    with pytest.warns(al.errors.DataQualityWarning, match="exactly zero"):
        assert curve(np.ones(100), "robust", taus=[1.0]).deviation[0, 0] == 0.0


def test_robust_knows_no_ramp() -> None:
    model = NoiseModel.of(White(N=1.0), Ramp(R=1.0))
    with pytest.raises(InputError, match="ramp"):
        curve(np.random.default_rng(0).standard_normal(100), "robust")["signal"].with_model(model)


# -- intervals ----------------------------------------------------------------------------------------------------


def _coverage(model: NoiseModel, estimate: Callable[[Phase], Floats], truth: Floats, edf: Floats, shape: Floats,
              runs: int, n: int) -> Floats:  # fmt: skip
    y = al.simulate(model, rate=1.0, duration=float(n * runs), seed=17).values("gyro").reshape(runs, n)
    none = np.zeros((0, 2), dtype=np.int64)
    found = np.array(
        [estimate(Phase(x=np.concatenate([[0.0], np.cumsum(v - v[0])]), missing=none)) for v in y]
    )
    low, high = shifted_factors(edf, shape, 0.6827)
    return np.mean((found * low**2 <= truth) & (truth <= found * high**2), axis=0)


@pytest.mark.parametrize("term", TERMS, ids=lambda t: t.type)
def test_u3_intervals_hold_what_they_say(term: TermType) -> None:
    """300 records of 512 samples, Theo1 and the robust variance: bounds that all 28 values keep with 99.9 %."""
    model, n, runs = NoiseModel.of(term), 512, 300
    lags = np.array([16, 64, 256, 512])
    edf = theo_covariance.edf_theo1(model, lags, n, 1.0, "mean")
    shape = edf * theo_covariance.shapes(model, lags, n, 1.0, "mean")
    mean = theo_covariance.mean(model, lags, 1.0, "mean")
    theo1 = STATISTICS["theo1"]
    found = _coverage(model, lambda p: sums_of_inner_squares(p, theo1, lags, 1)[0], mean, edf, shape, runs, n)
    assert np.all((found > 0.572) & (found < 0.793)), found
    lags = np.array([1, 8, 32])
    edf = robust.edf(model, lags, n, 1.0, "mean")
    truth = model.avar_sampled(lags, 1.0)
    found = _coverage(model, lambda p: robust.m_estimates(p, lags, 1)[0], truth, edf, edf, runs, n)
    assert np.all((found > 0.572) & (found < 0.793)), found


@pytest.mark.parametrize("statistic", NEW)
def test_u9_wider_confidence_wider_interval(statistic: str) -> None:
    y = np.random.default_rng(3).standard_normal(500)
    a, b = (curve(y, statistic, confidence=c) for c in (0.3, 0.7))
    ok = np.isfinite(a.deviation)
    assert ok.any()
    assert np.all(b.lower[ok] < a.lower[ok]) and np.all(a.upper[ok] < b.upper[ok])


@pytest.mark.parametrize("statistic", NEW)
def test_with_model_takes_the_degrees_of_freedom_of_the_model(statistic: str) -> None:
    y = np.random.default_rng(3).standard_normal(500)
    found = curve(y, statistic)
    same = found.with_model(NoiseModel.of(White(N=1.0)))
    np.testing.assert_allclose(same.edf, found.edf, rtol=1e-9)  # the local law of white noise is white
    red = found.with_model(NoiseModel.of(RandomWalk(K=1.0)))
    assert np.all(red.edf[2:] < same.edf[2:])
    assert ("exact" in red.interval_basis) == (statistic == "haar")


# -- where they are shown -----------------------------------------------------------------------------------------


def test_every_statistic_has_a_name_in_figures_and_reports() -> None:
    from allanite.views.figures.curves import STATISTICS as NAMES

    assert set(NAMES) == set(STATISTICS)
    assert len({NAMES[s] for s in NEW}) == len(NEW)


def test_a_study_shows_theoh_at_its_averaging_times_and_fits_oadev() -> None:
    from allanite.commands.study import curve_of

    recording = al.simulate(NoiseModel.of(White(N=1e-3)), rate=10.0, duration=400.0, seed=2)
    study = al.characterize(recording, statistic="theoh")
    channel = study.to_json()["channels"][0]
    shown = curve_of(study)
    assert channel["curve"]["statistic"] == "theoh"
    assert not any(channel["curve"]["used"])
    assert "N" in {e["symbol"] for e in channel["models"][0]["estimates"] if e["supported"]}
    np.testing.assert_allclose(shown.tau, channel["curve"]["tau"], rtol=1e-15)
    assert shown.tau[-1] > 0.6 * 400.0


# -- refusals -----------------------------------------------------------------------------------------------------


def test_refusals() -> None:
    y = np.random.default_rng(3).standard_normal(500)
    with pytest.raises(InputError, match=r"multiples of 1.5 s.*nearest is 10.5 s"):
        curve(y, "theo1", taus=[10.0])
    with pytest.raises(InputError, match=r"nearest is 7\.5 s"):
        curve(y, "theo1", taus=[1.5])
    with pytest.raises(InputError, match="to 375 s"):
        curve(y, "theoh", taus=[400.0])
    with pytest.raises(DataQualityError, match="at least 10"):
        curve(y[:9], "theo1")
    with pytest.raises(DataQualityError, match="from 89 samples"):
        curve(y[:88], "theobr")
    assert len(ratio_lags(89)) == 1 and len(ratio_lags(10**6)) == 200
    with pytest.raises(InputError, match=r"unknown"):
        curve(y, "mdev").with_model(NoiseModel.of(White(N=1.0)))
    with pytest.raises(InputError, match="not robust"):
        al.fit(curve(y, "robust"))
