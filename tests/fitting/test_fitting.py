# SPDX-License-Identifier: BSD-3-Clause
"""The fit: recovers known truths, prints limits for what is absent, and refuses what it cannot do."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, FitError, InputError
from allanite.fitting.advice import advise, predicted_sd
from allanite.fitting.design import design_of
from allanite.fitting.moments import lags_used
from allanite.fitting.objective import CurveData, distance, solve
from allanite.fitting.sets import critical_value
from allanite.noise import (
    SIGMA_PER_B,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    White,
)
from allanite.recording.records import Recording

FAMILY = ("Q", "N", "B", "K", "R")


def fitted(model: NoiseModel, *, rate: float, duration: float, seed: int) -> NoiseModel:
    return al.fit(al.allan_curve(al.simulate(model, rate=rate, duration=duration, seed=seed)))


def perfect(model: NoiseModel, n: int = 200_000, rate: float = 10.0) -> al.AllanCurve:
    """A curve that lies on its model exactly."""
    zero = al.allan_curve(
        Recording.from_rate(np.random.default_rng(0).standard_normal(n), rate=rate, unit="rad/s")
    )
    return replace(zero, deviation=np.sqrt(model.avar_sampled(zero.lags, zero.dt))[:, None])


@pytest.mark.long
def test_a_covariance_knows_of_terms_that_are_not_resolved() -> None:
    """A walk that is there and not resolved bends sigma and T: their standard deviations are those of their sets."""
    truth = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(4e-4, 5.0), RandomWalk(K=3e-6))
    model = fitted(truth, rate=10.0, duration=7200.0, seed=7)
    walk, known = model.estimate("K"), model.covariance["symbols"]
    assert walk is not None and not walk.supported and walk.upper > 3e-6
    matrix = np.array(model.covariance["matrix"])
    assert np.linalg.eigvalsh(matrix).min() > 0
    assert known == ["N", "sigma", "T"]
    for i, symbol in enumerate(known):
        e = model.estimate(symbol)
        assert e is not None
        assert math.sqrt(matrix[i, i]) == pytest.approx(math.log(e.upper / e.lower) / 2 / 1.959964, rel=1e-6)
    # what the information of these three terms alone would say, by another formula: too little for sigma
    curve = al.allan_curve(al.simulate(truth, rate=10.0, duration=7200.0, seed=7))
    used = lags_used(curve)
    design = design_of(curve.lags[used], curve.n_samples, "mean")
    N, B = (term for term in model.terms if isinstance(term, (White, GaussMarkov)))
    c, T = np.array([N.N**2 * curve.dt**-1, B.sigma**2]), B.T / curve.dt
    G = [design.column("G", (T * f,)) for f in (1.01, 1 / 1.01)]
    slopes = np.stack(
        [
            2 * c[0] * design.column("N"),
            2 * c[1] * design.column("G", (T,)),
            c[1] * (G[0] - G[1]) / math.log(1.0201),
        ],
        axis=1,
    )  # of ln N, ln sigma, ln T
    V = design.covariance(["N", "G"], c, (T,))
    alone = np.linalg.inv(slopes.T @ np.linalg.solve(V, slopes))
    assert matrix[1, 1] > alone[1, 1]
    for i, j in ((0, 1), (0, 2), (1, 2)):  # correlations are those of the information
        ours = matrix[i, j] / math.sqrt(matrix[i, i] * matrix[j, j])
        assert ours == pytest.approx(alone[i, j] / math.sqrt(alone[i, i] * alone[j, j]), abs=0.02)


def test_c14_white_noise_alone_leaves_upper_limits() -> None:
    model = fitted(NoiseModel.of(White(N=1e-4)), rate=5.0, duration=20_000.0, seed=14)
    assert [t.type for t in model.terms] == ["white"]
    for symbol in ("Q", "B", "K", "R"):
        e = model.estimate(symbol)
        assert (
            e is not None and e.value is None and not e.supported and 0 < e.upper < math.inf and e.lower == 0
        )
    n = model.estimate("N")
    assert n is not None and n.supported and n.lower < 1e-4 < n.upper
    # the limit of K is where the walk would stand out at the longest lag (some 3 degrees of freedom: a factor of ten in
    # variance), not the floor of 4.7e-3 N that a forced slope gives
    k, longest = model.estimate("K"), 20_000.0 / 5
    assert k is not None and k.upper < math.sqrt(3 * 10) * 1e-4 / longest < 4.7e-3 * 1e-4


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "rate", "duration", "symbols"),
    [
        (NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5)), 20.0, 4000.0, {"N": 1e-4, "K": 1e-5}),
        (NoiseModel.of(White(N=1e-4), Flicker(B=5e-5)), 20.0, 8000.0, {"N": 1e-4, "B": 5e-5}),
        (
            NoiseModel.of(Quantisation(Q=2e-5, dt=0.01), White(N=1e-4), RandomWalk(K=1e-5)),
            100.0,
            2000.0,
            {"Q": 2e-5, "N": 1e-4, "K": 1e-5},
        ),
        (NoiseModel.of(White(N=1e-4), Ramp(R=1e-7)), 20.0, 4000.0, {"N": 1e-4, "R": 1e-7}),
    ],
    ids=["walk", "flicker", "quantisation", "ramp"],
)
def test_c13_known_terms_are_recovered(
    model: NoiseModel, rate: float, duration: float, symbols: dict[str, float]
) -> None:
    """Three records; a 95 % set may miss once in 60 parameters, three times is one in 5000."""
    missed = 0
    for seed in range(3):
        found = fitted(model, rate=rate, duration=duration, seed=100 + seed)
        for symbol, truth in symbols.items():
            e = found.estimate(symbol)
            assert e is not None and e.supported, f"{symbol} is not supported: {found.estimates}"
            missed += not e.lower <= truth <= e.upper
    assert missed <= 2


@pytest.mark.long
def test_gauss_markov_is_told_from_flicker_when_the_record_is_long() -> None:
    truth = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-4, 50.0))
    model = fitted(truth, rate=8.0, duration=40_000.0, seed=1)
    assert model.family == "gauss-markov" and model.alternative is None
    for symbol, value in (("T", 50.0), ("B_equiv", 1e-4 / SIGMA_PER_B), ("sigma", 1e-4)):
        e = model.estimate(symbol)
        assert e is not None and e.supported and e.lower < value < e.upper


@pytest.mark.long
def test_undecided_families_are_both_shown() -> None:
    truth = NoiseModel.of(White(N=1e-4), Flicker(B=5e-5))
    model = fitted(truth, rate=8.0, duration=1200.0, seed=0)
    assert model.alternative is not None
    assert {model.family, model.alternative.family} == {"flicker", "gauss-markov"}
    assert "cannot distinguish flicker" in model.verdict


@pytest.mark.long
def test_flicker_is_kept_when_the_record_is_long() -> None:
    truth = NoiseModel.of(White(N=1e-4), Flicker(B=5e-5))
    model = fitted(truth, rate=8.0, duration=200_000.0, seed=3)
    assert model.family == "flicker" and model.alternative is None


@pytest.mark.long
def test_units_do_not_matter() -> None:
    """Scaling the samples by 1e-8 scales the answer, and so does another time unit."""
    y = np.random.default_rng(5).standard_normal(100_000)
    y += 0.01 * np.cumsum(np.random.default_rng(6).standard_normal(100_000))
    reference = al.fit(al.allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s")))
    small = al.fit(al.allan_curve(Recording.from_rate(y * 1e-8, rate=1.0, unit="rad/s")))
    fast = al.fit(al.allan_curve(Recording.from_rate(y, rate=100.0, unit="rad/s")))
    for symbol, power in (("N", 0.5), ("K", -0.5)):
        a, b, c = (m.estimate(symbol) for m in (reference, small, fast))
        assert a is not None and b is not None and c is not None and a.value and b.value and c.value
        assert b.value == pytest.approx(a.value * 1e-8, rel=1e-4)
        assert c.value == pytest.approx(a.value * 0.01**power, rel=1e-4)
        assert b.upper == pytest.approx(a.upper * 1e-8, rel=1e-3)


@pytest.mark.long
def test_the_objective_has_its_minimum_on_a_perfect_curve() -> None:
    model = NoiseModel.of(White(N=1.0), Flicker(B=0.2), RandomWalk(K=0.01))
    curve = perfect(model)
    found = al.fit(curve)
    for term in model.terms:
        e = found.estimate(term.symbols[0])
        truth = getattr(term, term.symbols[0])
        assert e is not None and e.supported and e.value and e.lower < truth < e.upper
        assert (
            abs(math.log(e.value / truth)) < 0.3 * math.log(e.upper / e.lower) / 2
        )  # well inside: 0.6 of a deviation


def test_weights_of_the_null_make_the_distance_positive() -> None:
    design = design_of(np.array([1 << i for i in range(12)]), 20_000, "point")
    v = design.column("N") * np.exp(np.random.default_rng(1).normal(0, 0.02, 12))
    curve = CurveData(v, design)
    best = solve(curve, FAMILY)
    for n in (0.9, 0.99, 1.0, 1.01, 1.1):
        null = solve(curve, FAMILY, fixed={"N": n})
        assert distance(curve, null) >= -1e-9
    assert critical_value(curve, best, "N", frozenset("N"), 0.95) >= 3.84


def test_prediction_reaches_the_published_bound() -> None:
    """Relative bounds of the seed's sensor over 7 days at 32 Hz: N 0.0161, B_equiv 2.74, T_b 6.71, K 6.47 %."""
    seed = NoiseModel.of(
        White(N=0.0122), GaussMarkov.from_sigma(SIGMA_PER_B * 0.0027, 238.1), RandomWalk(K=6.8314e-5)
    )
    sd = predicted_sd(seed, n_samples=19_353_600, dt=1 / 32)
    published = {"N": 0.000161, "sigma": 0.0274, "T": 0.0671, "K": 0.0647}
    for symbol, bound in published.items():
        assert bound * 0.99 < sd[symbol] < bound * 1.02


@pytest.mark.long
def test_advice_says_how_long() -> None:
    model = fitted(NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5)), rate=20.0, duration=2000.0, seed=1)
    advice = {a.symbol: a for a in advise(model, n_samples=40_000, dt=0.05)}
    assert "K" in advice and advice["K"].duration > 0 and "K" in advice["K"].text
    longer = predicted_sd(
        NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5)), n_samples=int(advice["K"].duration * 20), dt=0.05
    )
    assert advice["K"].reached or longer["K"] < 0.13


def test_slopes_read_the_curve_and_warn() -> None:
    model = NoiseModel.of(White(N=1.0), RandomWalk(K=0.05))
    read = al.fit(perfect(model), method="slopes")
    n, k, b = read.estimate("N"), read.estimate("K"), read.estimate("B")
    assert n is not None and n.value == pytest.approx(1.0, rel=0.02)
    assert k is not None and k.value == pytest.approx(0.05, rel=0.05)
    assert (
        b is not None and b.value is not None and b.value > 0.1
    )  # a minimum that is no flicker: biased, and said so
    q = read.estimate("Q")
    assert q is not None and q.value is None and "no slope -1.0" in q.note


def test_slopes_are_read_off_the_oadev_alone_with_one_exclusion_for_each_lag() -> None:
    y = 0.1 * np.random.default_rng(2).standard_normal(20_000)
    record = Recording.from_rate(y, rate=1.0, unit="rad/s", names="x")
    for statistic in ("mdev", "ohdev", "totdev"):
        with pytest.raises(InputError, match=f"Allan deviation .*, not of {statistic}"):
            al.fit(al.allan_curve(record, statistic=statistic)["x"], method="slopes")
    curve = al.allan_curve(record)["x"]
    for exclude in ([True], [False], [False, True]):
        with pytest.raises(InputError, match=f"each of the {len(curve.lags)} lags"):
            al.fit(curve, method="slopes", exclude=exclude)
    n = al.fit(curve, method="slopes", exclude=curve.lags < 4).estimate("N")
    assert n is not None and n.value == pytest.approx(0.1, rel=0.05)


def test_lags_are_thinned_and_excluded() -> None:
    y = np.random.default_rng(1).standard_normal(10_000)
    curve = al.allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s"), taus=40)
    used = curve.lags[lags_used(curve)]
    assert np.all(used[1:] / used[:-1] >= 1.6)
    bent = curve.lags < 10
    assert curve.lags[lags_used(curve, bent)][0] == 10


def test_a_saved_curve_is_fitted_like_the_record(tmp_path: object) -> None:
    y = np.random.default_rng(1).standard_normal(20_000)
    curve = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="deg/s"))
    again = al.AllanCurve.from_csv(curve.to_csv(f"{tmp_path}/allan.csv"))
    assert al.fit(again) == al.fit(curve)


_IMU_UTILS = ["A3", "N3", "16448", "gx4", "xsens"]


def _foreign_curve(folder: Path, name: str, axis: str) -> al.AllanCurve:
    """Curves computed by another program, in deg/h; the record was some three times the last lag long."""
    tau = np.loadtxt(folder / f"data_{name}_gyr_t.txt")
    deviation = np.loadtxt(folder / f"data_{name}_gyr_{axis}.txt")
    dt = float(tau[0])
    return al.AllanCurve.from_arrays(tau, deviation, dt=dt, n_samples=round(3 * tau[-1] / dt), unit="deg/h")


def _printed(folder: Path, name: str, axis: str) -> float:
    text = (folder / f"{name}_imu_param.yaml").read_text()
    return float(re.search(rf"{axis}-axis:\s*\n\s*gyr_n:\s*([-+.\de]+)", text)[1])  # type: ignore[index]


@pytest.mark.parametrize("name", _IMU_UTILS)
def test_a_curve_alone_gives_what_another_program_printed(
    real_data: Callable[[str], Path], name: str
) -> None:
    """It printed the value at 1 s as white noise; ours tells what else is in it, and the sum is the same within 8 %."""
    folder = real_data("imu_utils_curves")
    model = al.fit(_foreign_curve(folder, name, "y"))
    assert float(model.adev(1.0)) == pytest.approx(_printed(folder, name, "y"), rel=0.08)
    n = model.estimate("N")
    assert n is not None and n.supported and n.upper < 1.02 * float(model.adev(1.0))


def test_a_printed_density_that_is_none_stands_out(real_data: Callable[[str], Path]) -> None:
    """One file holds the deviation per sample under the name of the density: sqrt(196 Hz) = 14 times too large."""
    folder = real_data("imu_utils_curves")
    model = al.fit(_foreign_curve(folder, "BMI160", "y"))
    assert _printed(folder, "BMI160", "y") / float(model.adev(1.0)) == pytest.approx(14.0, rel=0.15)


def test_refusals() -> None:
    y = np.random.default_rng(1).standard_normal((2000, 2))
    two = al.allan_curve(Recording.from_rate(y, rate=1.0, unit="g"))
    with pytest.raises(InputError, match="one channel"):
        al.fit(two)
    with pytest.raises(InputError, match="oadev"):
        al.fit(al.allan_curve(Recording.from_rate(y[:, 0], rate=1.0, unit="g"), statistic="mdev"))
    with pytest.raises(InputError, match="method"):
        al.fit(two["x"], method="guess")
    with pytest.raises(DataQualityError, match="at least 3"):
        al.fit(two["x"], exclude=np.ones(len(two.lags), dtype=bool))
    with pytest.raises(DataQualityError, match="2 lags can be fitted, at least 3"):
        al.fit(two["x"], exclude=np.arange(len(two.lags)) > 1)


@pytest.mark.filterwarnings("ignore::allanite.errors.DataQualityWarning")
def test_b4_a_constant_has_no_model() -> None:
    curve = al.allan_curve(Recording.from_rate(np.full(5000, 0.1), rate=1.0, unit="g"))
    with pytest.raises(DataQualityError, match="resolution limit"):
        al.fit(curve)


def test_model_json_keeps_the_estimates() -> None:
    model = fitted(NoiseModel.of(White(N=1e-4)), rate=20.0, duration=500.0, seed=2)
    again = NoiseModel.from_json(model.to_json())
    assert (
        again.estimates == model.estimates and again.terms == model.terms and again.goodness == model.goodness
    )


@pytest.mark.long
@pytest.mark.parametrize("n", [32, 40, 64])
def test_short_records_are_fitted_or_refused_never_a_crash(n: int) -> None:
    for seed in range(3):
        y = np.random.default_rng(seed).standard_normal(n)
        try:
            model = al.fit(al.allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s")))
        except (DataQualityError, FitError):
            continue
        n_ = model.estimate("N")
        assert n_ is not None and n_.upper > 0


@pytest.mark.long
def test_what_is_no_noise_is_refused() -> None:
    t = np.arange(40_000) / 10.0
    y = np.random.default_rng(1).standard_normal(len(t)) + 5.0 * np.sin(2 * np.pi * 0.01 * t)
    curve = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="rad/s"))
    with pytest.raises(FitError, match="no sum of noise terms"):
        al.fit(curve)


def test_excluded_lags_survive_the_file(tmp_path: Path) -> None:
    y = np.random.default_rng(1).standard_normal((20_000, 2))
    curve = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="rad/s"))
    bent = np.zeros(curve.deviation.shape, dtype=bool)
    bent[1:3, 0] = True
    again = al.AllanCurve.from_csv(replace(curve, excluded=bent).to_csv(tmp_path / "allan.csv"))
    np.testing.assert_array_equal(again.excluded, bent)
    assert not lags_used(again["x"])[1:3].any() and lags_used(again["y"])[1:3].all()
    with pytest.raises(InputError, match="one value for each"):
        al.fit(curve["x"], exclude=[True])
    with pytest.raises(InputError, match="confidence"):
        al.fit(curve["x"], confidence=2.0)


def test_a_curve_that_is_a_ramp_alone_is_refused_with_words() -> None:
    """A walk of a walk with a gap: beside its trend no noise is resolved."""
    y = np.cumsum(np.cumsum(np.random.default_rng(4).standard_normal(2000)))
    y[500:1150] = np.nan
    curve = al.allan_curve(al.Recording.from_rate(y, rate=10.0, unit="rad/s"))
    with pytest.raises(FitError, match="that of a ramp"):
        al.fit(curve)
