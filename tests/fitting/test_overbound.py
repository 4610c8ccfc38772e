# SPDX-License-Identifier: BSD-3-Clause
"""Bounds above noise models: the parts against theory, the promise on records, the words in files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.commands.exporting import export_of
from allanite.errors import FitError, InputError
from allanite.fitting.design import design_of
from allanite.fitting.moments import lags_used
from allanite.fitting.objective import CurveData, solve
from allanite.fitting.overbound import bound_channels, overbound, plausible
from allanite.fitting.overbound.bounding import scale_open
from allanite.fitting.overbound.ensemble import walk
from allanite.fitting.overbound.envelope import band_above, least_above, reach
from allanite.fitting.overbound.plausible import _TermSums
from allanite.fitting.scale import with_scale_uncertainty
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.noise.allan import AllanCurve
from allanite.noise.allan.covariance import lag_pairs
from allanite.quantities.distributions import normal_quantile
from allanite.study.study import Study
from sample_study import build
from shell import Run

TRUTH = NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), RandomWalk(K=2e-6))


RATE, DURATION = 4.0, 2400.0


@pytest.fixture(scope="module", autouse=True)
def fewer_draws() -> Iterator[None]:
    """A third of the steps: the tests look at what a bound is; how often it covers is for the long run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plausible, "_STEPS", 100)
        patch.setattr(plausible, "_SETTLE", 40)
        patch.setattr(plausible, "_EVERY", 2)
        yield


@pytest.fixture(scope="module")
def record() -> tuple[AllanCurve, NoiseModel]:
    """Forty minutes at 4 Hz and what was fitted to them."""
    curve = al.allan_curve(al.simulate(TRUTH, rate=RATE, duration=DURATION, seed=5))
    return curve, al.fit(curve)


@pytest.fixture(scope="module")
def bound(record: tuple[AllanCurve, NoiseModel]) -> NoiseModel:
    return overbound(*record)


# -- parts ----------------------------------------------------------------------------------------------------


def test_ensemble_has_the_moments_of_a_normal_density() -> None:
    """Two parameters of scales 1 and 1000, correlated: mean and covariance within 5 standard errors (200 effective)."""
    covariance = np.array([[1.0, 600.0], [600.0, 1e6]])
    inverse = np.linalg.inv(covariance)

    def density(x: np.ndarray) -> np.ndarray:
        return -0.5 * np.einsum("ni,ij,nj->n", x - [3.0, 0.0], inverse, x - [3.0, 0.0])

    rng = np.random.default_rng(1)
    start = np.array([3.0, 0.0]) + rng.normal(size=(60, 2)) * [0.1, 10.0]
    drawn = walk(density, start, steps=300, settle=60, rng=rng)
    assert drawn.shape == (240 * 60, 2)
    assert abs(drawn[:, 0].mean() - 3) < 5 / math.sqrt(200)
    assert abs(drawn[:, 1].mean()) < 5e3 / math.sqrt(200)
    np.testing.assert_allclose(np.cov(drawn.T) / covariance, 1.0, atol=5 * math.sqrt(2 / 200))


def test_band_of_equal_curves_is_the_quantile_and_of_independent_ones_that_of_the_greatest() -> None:
    """One normal variable: 1.645. Forty independent ones: each below z with probability 0.95^(1/40), z = 3.02."""
    rng = np.random.default_rng(2)
    one = np.repeat(rng.normal(size=(8000, 1)), 5, axis=1)
    np.testing.assert_allclose(band_above(one, 0.95), normal_quantile(0.95), atol=0.06)
    many = rng.normal(size=(8000, 40))
    band = band_above(many, 0.95)
    assert np.mean(np.all(many <= band, axis=1)) == pytest.approx(0.95, abs=0.01)
    assert band.mean() == pytest.approx(normal_quantile(0.95 ** (1 / 40)), abs=0.08)


def test_least_sum_above_a_floor_that_is_such_a_sum_is_that_sum() -> None:
    tau = np.geomspace(0.1, 1000, 50)
    columns = np.stack([1 / tau, np.ones(50), tau], axis=1)
    truth = np.array([4.0, 0.5, 0.002])
    np.testing.assert_allclose(least_above(columns, np.zeros(3), columns @ truth), truth, rtol=1e-6)
    more = least_above(columns, np.array([0.0, 0.7, 0.0]), columns @ truth)
    assert more[1] >= 0.7 and np.all(columns @ more >= columns @ truth * (1 - 1e-9))


def test_a_floor_that_no_sum_reaches_is_refused() -> None:
    with pytest.raises(FitError, match="no sum"):
        least_above(np.arange(5.0)[:, None], np.zeros(1), np.ones(5))


def test_reach_is_the_share_of_the_way() -> None:
    start, end = np.array([1.0, 1.0]), np.array([2.0, 3.0])
    curves = np.array([[0.5, 1.0], [1.5, 1.0], [1.5, 3.0], [1.0, 5.0]])
    np.testing.assert_allclose(reach(curves, start, end), [0.0, 0.5, 1.0, 2.0])


@pytest.mark.long
def test_likelihood_is_that_of_the_fit(record: tuple[AllanCurve, NoiseModel]) -> None:
    """Without a ramp, differences of the log density are those of the objective at its own weights, less the prior."""
    curve, _ = record
    used = lags_used(curve)
    lags, v = curve.lags[used], curve.variance[used, 0]
    symbols = ("Q", "N", "B", "K", "R")
    scaled = CurveData(v / v[0], design_of(lags, curve.n_samples, "mean"))
    sums = _TermSums(
        variance=v / v[0],
        lags=lags,
        n_samples=curve.n_samples,
        sampling="mean",
        pairs=lag_pairs(lags, curve.n_samples),
        symbols=symbols,
        discrepancy=0.0,
    )
    found = []
    for shift in (0.0, 0.3):
        c = np.array([1e-5, 1.0 + shift, 0.05, 1e-5 * (1 + shift), 1e-30])
        fixed = dict(zip(symbols, [*c[:4], 0.0], strict=True))
        expected = solve(scaled, symbols, fixed=fixed, start=c).value
        log_c = np.log(c)
        found.append((sums.log_density(log_c[None])[0] - log_c.sum() / 2, -expected / 2))
    assert found[1][0] - found[0][0] == pytest.approx(found[1][1] - found[0][1], abs=1e-3)


# -- the promise ----------------------------------------------------------------------------------------------


def _ratio(bound: NoiseModel, truth: NoiseModel, dt: float) -> np.ndarray:
    m = np.geomspace(bound.overbound.shortest, bound.overbound.horizon, 150) / dt
    return np.asarray(np.sqrt(bound.avar_sampled(m, dt) / truth.avar_sampled(m, dt)))


def test_bound_is_above_truth_and_measurement_and_says_its_factors(
    record: tuple[AllanCurve, NoiseModel], bound: NoiseModel
) -> None:
    curve, model = record
    facts = bound.overbound
    assert facts is not None
    assert _ratio(bound, TRUTH, curve.dt).min() >= 1
    inside = curve.tau <= facts.horizon * (1 + 1e-9)
    measured = curve.variance[inside, 0]
    assert np.all(bound.avar_sampled(curve.lags[inside], curve.dt) >= measured * (1 - 1e-9))
    assert 1 < facts.mean < 1.6 and facts.greatest >= facts.mean
    for letter, factor in facts.factors.items():
        term = next(t for t in bound.terms if t.symbols[0] == letter)
        below = next((t for t in model.terms if t.symbols[0] == letter), None)
        if below is None:
            assert factor is None
        else:
            assert factor >= 1
            assert getattr(term, letter) == pytest.approx(factor * getattr(below, letter))
    again = NoiseModel.from_json(json.loads(json.dumps(bound.to_json())))
    assert again == bound and "95 %" in bound.verdict


def test_absent_terms_do_not_lower_the_curve_where_others_rule() -> None:
    """White noise: quantisation that is not there takes of it in every draw, so that the fit alone is drawn too."""
    curve = al.allan_curve(al.simulate(NoiseModel.of(White(N=1e-4)), rate=RATE, duration=DURATION, seed=7))
    model = al.fit(curve)
    assert {t.type for t in model.terms} == {"white"}
    m = np.array([1.0, 2.0, 4.0, 8.0])
    every, alone = (
        plausible.plausible_variances(
            curve, lags_used(curve), model, m, fitted_terms_only=only, rng=np.random.default_rng(3)
        )
        for only in (False, True)
    )
    assert np.allclose(alone * m, alone[:, :1])  # white noise and nothing else
    N = next(e for e in model.estimates if e.symbol == "N")
    ends = np.sqrt(np.quantile(alone[:, 0] / RATE, [0.025, 0.975]))
    # a quantile of some hundred independent draws is known to a fifth of the width
    assert ends == pytest.approx([N.lower, N.upper], abs=0.2 * (N.upper - N.lower))
    assert np.median(every[:, 2]) < np.median(alone[:, 2])
    bounded = overbound(curve, model, above_measured=False).avar_sampled(m, curve.dt)
    assert np.all(np.mean(alone < bounded * (1 + 1e-9), axis=0) >= 0.95)


@pytest.mark.long
def test_higher_probability_and_further_horizon_cost_more(
    record: tuple[AllanCurve, NoiseModel], bound: NoiseModel
) -> None:
    curve, model = record
    low = overbound(curve, model, probability=0.6, above_measured=False)
    far = overbound(curve, model, horizon=40_000.0)
    assert low.overbound.mean < bound.overbound.mean
    assert far.overbound.horizon == 40_000.0
    assert _ratio(far, TRUTH, curve.dt).min() >= 1
    assert far.overbound.greatest > bound.overbound.greatest


@pytest.mark.long
def test_a_term_that_hardly_adds_stays_and_the_others_keep_their_factors(
    record: tuple[AllanCurve, NoiseModel],
) -> None:
    """The bound is no smaller than the fit in any term, and every term of the bound has its line in `factors`."""
    curve, model = record
    little = NoiseModel(terms=(RandomWalk(K=1e-15), *(t for t in model.terms if t.type != "random_walk")))
    bound = overbound(curve, little)
    assert bound.overbound is not None
    factors = bound.overbound.factors
    for term in bound.terms:
        symbol = term.symbols[0]
        assert symbol in factors and (factors[symbol] or 1.0) >= 1.0
    assert bound.term("random_walk") is not None
    assert set(factors) == {t.symbols[0] for t in bound.terms}


def test_one_error_of_the_scale_factor_is_common_to_all_averaging_times() -> None:
    drawn = np.geomspace(1.0, 9.0, 4) * np.ones((20_000, 1))
    logs = np.log(scale_open(drawn, 0.03, np.random.default_rng(1)) / drawn)
    assert np.ptp(logs, axis=1).max() < 1e-12
    assert math.isclose(logs[:, 0].std(), 2 * 0.03, rel_tol=0.03)  # of the variance, so twice


@pytest.mark.long
@pytest.mark.parametrize("relative", [0.03, 0.2])
def test_bound_is_above_the_sensor_under_every_likely_scale_factor(
    record: tuple[AllanCurve, NoiseModel], bound: NoiseModel, relative: float
) -> None:
    """One factor for all averaging times: the bound rises by its quantile, and by little more, at each of them."""
    curve, model = record
    wide = overbound(curve, with_scale_uncertainty(model, relative))
    tau = curve.tau[lags_used(curve)]
    over_fit = np.sqrt(wide.avar_sampled(tau * RATE, 1 / RATE) / model.avar_sampled(tau * RATE, 1 / RATE))
    over_bound = np.sqrt(wide.avar_sampled(tau * RATE, 1 / RATE) / bound.avar_sampled(tau * RATE, 1 / RATE))
    quantile = normal_quantile(0.95) * relative  # of 3000 draws: known within 5 %
    assert over_fit.min() > math.exp(0.95 * quantile)
    assert over_bound.max() < math.exp(1.3 * quantile)


def test_bound_holds_under_both_families_where_the_record_cannot_decide() -> None:
    """A Gauss-Markov truth that the record cannot tell from flicker."""
    truth = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(4e-5, 60.0))
    curve = al.allan_curve(al.simulate(truth, rate=RATE, duration=DURATION, seed=2))
    model = al.fit(curve)
    assert model.alternative is not None
    assert _ratio(overbound(curve, model), truth, curve.dt).min() >= 1


def test_unsound_requests_are_refused(record: tuple[AllanCurve, NoiseModel]) -> None:
    curve, model = record
    for options, words in (
        ({"probability": 95}, "between 0.5 and 0.999"),
        ({"horizon": -1.0}, "positive number of seconds"),
        ({"horizon": 1e-3}, "shorter than the shortest lag"),
        ({"terms": ("N", "X")}, "not of 'X'"),
        ({"terms": ("K",)}, "needs N"),
    ):
        with pytest.raises(InputError, match=words):
            overbound(curve, model, **options)
    with pytest.raises(InputError, match="model is of acceleration"):
        overbound(curve, NoiseModel.of(White(N=1.0), kind="acceleration"))
    with pytest.raises(InputError, match="no terms"):
        overbound(curve, NoiseModel.of())
    with pytest.raises(InputError, match="no channel has a noise model"):
        bound_channels(curve, {})


# -- files ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study(record: tuple[AllanCurve, NoiseModel], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of the record alone, as `characterize` would leave it."""
    curve, model = record
    document = build()
    channel = {**document["channels"][0], "models": [m.to_json() for m in model.families]}
    channel["curve"] = {**curve.to_json(), "used": lags_used(curve).tolist(), "excluded": []}
    document["channels"] = [channel]
    document["recording"] |= {"rate": RATE, "channels": document["recording"]["channels"][:1]}
    path = tmp_path_factory.mktemp("study") / "study.json"
    Study.from_json(document).save(path)
    return path


def _numbers(text: str) -> dict[str, float]:
    keys = (line.split("#")[0].split(":") for line in text.splitlines() if line[:4] == "gyro")
    return {key: float(value) for key, value in keys}


def test_exported_bound_says_so_and_its_own_two_numbers_are_the_bound(study: Path, bound: NoiseModel) -> None:
    """White noise and walk alone lie above flicker too."""
    text = export_of("kalibr", study, overbound=0.95)
    assert "gyro_x: INFLATED: with probability 95 %" in text and ("K ADDED" in text or "K x" in text)
    written = _numbers(text)
    of_file = NoiseModel.of(
        White(N=written["gyroscope_noise_density"]), RandomWalk(K=written["gyroscope_random_walk"])
    )
    m = np.geomspace(1, 2048, 100)
    assert np.all(of_file.avar_sampled(m, 1 / RATE) >= TRUTH.avar_sampled(m, 1 / RATE))
    assert "INFLATED" in al.export("cpp", {"gyro": bound}, rate=RATE)
    assert "INFLATED" not in export_of("kalibr", study)
    with pytest.raises(InputError, match="--bound-until"):
        export_of("kalibr", study, bound_until=100.0)


def test_a_file_that_would_change_a_bound_refuses_it(bound: NoiseModel) -> None:
    assert bound.term("flicker") is not None
    with pytest.raises(InputError, match=r"flicker\) that this file cannot"):
        al.export("kalibr", {"gyro": bound}, rate=RATE)
    with pytest.raises(InputError, match=r"flicker\) that this file cannot"):
        al.export("cpp", {"gyro": bound}, rate=RATE, flicker="single", correlation_time=100.0)


def test_command_bounds_a_study(study: Path, run: Run, tmp_path: Path) -> None:
    out = tmp_path / "bound"
    done = run(
        "overbound",
        study,
        "--terms",
        "N,B,K",
        "--out",
        out,
        "--plot",
        tmp_path / "b.png",
        "-o",
        tmp_path / "b.json",
    )
    assert done.code == 0, done.err
    assert (
        "the bound is above the sensor at all averaging times from 0.25 to 512 s" in done.out
        and "times the fit on average" in done.out
    )
    document: dict[str, Any] = json.loads((out / "overbound.json").read_text())
    assert document["format"] == "allanite-overbound"
    facts = document["channels"][0]["bound"]["overbound"]
    rows = (out / "inflation.csv").read_text().splitlines()
    assert len(rows) == 1 + len(facts["factors"])
    page = (out / "report.html").read_text()
    assert "Noise models above the sensor" in page and "Inflation" in page
    assert (tmp_path / "b.png").stat().st_size > 10_000
    written = NoiseModel.from_json(json.loads((tmp_path / "b.json").read_text())["gyro_x"])
    assert written.overbound.to_json() == facts
