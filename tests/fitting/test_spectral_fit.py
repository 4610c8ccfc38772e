# SPDX-License-Identifier: BSD-3-Clause
"""The spectral fit: its ordinates against dense covariances, its likelihood, its sets, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.optimize import minimize
from scipy.signal import butter, sosfilt
from scipy.stats import binom, chi2

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.fitting.slow_contrasts import slow_contrasts
from allanite.fitting.spectral.agreement import disagreement
from allanite.fitting.spectral.disagreements import Disagreement, Parted
from allanite.fitting.spectral.estimation import fit_spectral, spectral_ordinates
from allanite.fitting.spectral.modes import slow_modes
from allanite.fitting.spectral.remarks import agreement_findings
from allanite.fitting.spectral.whittle import WhittleProblem
from allanite.noise import (
    Estimate,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.recording.health.finding import Severity
from allanite.recording.records import Recording

RATE = 20.0
DT = 1 / RATE
MIXED = NoiseModel.of(White(N=1e-3), GaussMarkov.from_sigma(4e-4, 8.0), RandomWalk(K=1e-5))
TERMS: tuple[TermType, ...] = (
    White(N=0.1),
    Quantisation(Q=1e-2, dt=DT),
    Flicker(B=0.5),
    RandomWalk(K=0.3),
    GaussMarkov(q=1.0, T=2.0),
)


def simulated(model: NoiseModel, n: int, seed: int = 1, sampling: Any = "mean") -> Recording:
    return al.simulate(model, rate=RATE, duration=n * DT, seed=seed, name="x", sampling=sampling)


# -- ordinates --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("term", TERMS, ids=lambda t: t.type)
def test_contrasts_have_the_variance_of_the_dense_covariance(term: TermType, sampling: Any) -> None:
    """Two samples to a block, a gap in the record: every contrast against u' C u of the samples themselves."""
    n, size = 1100, 2
    y = np.zeros(n)
    y[300:420] = np.nan
    record = Recording.from_rate(y, rate=RATE, unit="rad/s", names="x", sampling=sampling)
    there = np.flatnonzero(~np.isnan(y[::size]))
    _, contrasts = slow_contrasts(there, np.ones(len(there)), len(there) // 4)
    weights = np.zeros((len(contrasts), n))
    for k in range(size):
        weights[:, there * size + k] = contrasts / size
    lag = np.arange(-1.0, n + 1)
    phase = term.phase_covariance(np.abs(lag), DT, sampling)
    covariance = toeplitz(2 * phase[1:-1] - phase[2:] - phase[:-2])
    dense = np.einsum("ki,ij,kj->k", weights, covariance, weights, optimize=True)
    np.testing.assert_allclose(slow_modes(record, "x", blocks=n // size).variance(term), dense, rtol=1e-6)


def test_contrasts_are_uncorrelated_in_white_noise_and_in_a_walk_across_gaps() -> None:
    place = np.array([0, 1, 2, 3, 9, 10, 11, 40, 41, 42, 43, 44])
    white = np.linspace(1.0, 2.0, len(place))
    rate, u = slow_contrasts(place, white, len(place) - 1)
    np.testing.assert_allclose(u.sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(u @ np.diag(white) @ u.T, np.eye(len(rate)), atol=1e-12)
    walk = np.minimum.outer(place, place).astype(float)
    np.testing.assert_allclose(u @ walk @ u.T, np.diag(1 / rate), atol=1e-9)


def test_without_gaps_the_contrasts_are_the_cosine_transform() -> None:
    from scipy.fft import dct

    y = np.random.default_rng(4).standard_normal(700)
    modes = slow_modes(Recording.from_rate(y, rate=RATE, unit="rad/s", names="x"), "x")
    np.testing.assert_allclose(modes.value**2, dct(y, norm="ortho")[1:] ** 2, atol=1e-9)
    np.testing.assert_allclose(modes.frequency, np.arange(1, 700) / (2 * 700 * DT), rtol=1e-9)


def test_whittle_of_white_and_walk_is_the_exact_likelihood() -> None:
    """White noise and a walk are diagonal in the contrasts: L is -2 ln of the dense normal law but for a constant."""
    n = 300
    truth = NoiseModel.of(White(N=0.1), RandomWalk(K=0.05))
    record = simulated(truth, n, seed=5, sampling="point")
    data, _ = spectral_ordinates(record, "x")
    problem = WhittleProblem(data=data, letters=("N", "K"))
    y = record.values("x")
    difference = np.eye(n)[1:] - np.eye(n)[:-1]  # the level is free
    found, dense = [], []
    for N, K in ((0.1, 0.05), (0.11, 0.03), (0.09, 0.1), (0.1, 0.001)):
        covariance = toeplitz(np.r_[2 * N**2 / DT + K**2 * DT, -(N**2) / DT, np.zeros(n - 3)])
        z = difference @ y
        dense.append(float(np.linalg.slogdet(covariance)[1] + z @ np.linalg.solve(covariance, z)))
        at = problem.best(fixed={0: N**2, 1: K**2})
        found.append(at.value)
    np.testing.assert_allclose(np.diff(found), np.diff(dense), rtol=1e-9)


@pytest.mark.long
def test_maximum_is_one_and_scaling_the_record_scales_it_exactly() -> None:
    record = simulated(MIXED, 20_000)
    scaled = Recording.from_rate(record.values("x") * 2.0**-30, rate=RATE, unit="rad/s", names="x")
    a, b = fit_spectral(record, terms="NGK"), fit_spectral(scaled, terms="NGK")
    for one, other in zip(a.estimates, b.estimates, strict=True):
        factor = 1.0 if one.symbol == "T" else 2.0**-30
        assert other.upper == pytest.approx(one.upper * factor, rel=2e-3)
    data, _ = spectral_ordinates(record, "x")
    problem = WhittleProblem(data=data, letters=("N", "G", "K"))
    best = problem.best()
    for place in range(3):
        for factor in (0.98, 1.02):
            moved = best.c.copy()
            moved[place] *= factor
            held = problem.best(fixed=dict(enumerate(moved.tolist())), times={1: best.times[0]}, near=best)
            assert held.value >= best.value - 1e-9


# -- the fit ----------------------------------------------------------------------------------------------


@pytest.mark.long
def test_c13_every_term_of_a_sum_is_recovered_within_its_set() -> None:
    truth = {"N": 1e-3, "B_equiv": 4e-4 / 1.0760, "T": 8.0, "K": 1e-5}
    hits = dict.fromkeys(truth, 0)
    runs = 6
    for seed in range(runs):
        model = fit_spectral(simulated(MIXED, 40_000, seed=seed), terms="NGK")
        for symbol, value in truth.items():
            e = model.estimate(symbol)
            assert e is not None
            hits[symbol] += e.lower <= value <= e.upper
    assert min(hits.values()) >= runs - 2, hits  # 2e-3 for each


def test_c14_white_noise_alone_gives_limits_for_the_rest() -> None:
    model = fit_spectral(simulated(NoiseModel.of(White(N=1e-3)), 30_000, seed=2))
    assert [t.type for t in model.terms] == ["white"]
    for symbol in ("Q", "B", "K", "R"):
        e = model.estimate(symbol)
        assert e is not None and not e.supported and e.value is None and 0 < e.upper < math.inf
    assert model.verdict == "The record supports white noise."


@pytest.mark.long
def test_two_gauss_markov_terms_in_one_sum() -> None:
    two = NoiseModel.of(White(N=1e-3), GaussMarkov.from_sigma(4e-3, 0.8), GaussMarkov.from_sigma(3e-3, 60.0))
    model = fit_spectral(simulated(two, 100_000, seed=3), terms="NGG")
    found = {e.symbol: e for e in model.estimates}
    for symbol, value in {"sigma": 4e-3, "T": 0.8, "sigma_2": 3e-3, "T_2": 60.0}.items():
        e = found[symbol]
        assert e.supported and e.lower / 1.1 < value < e.upper * 1.1, e
    assert sum(t.type == "gauss_markov" for t in model.terms) == 2


def test_a_ramp_is_found_with_its_size() -> None:
    truth = NoiseModel.of(White(N=1e-3), Ramp(R=2e-6))
    model = fit_spectral(simulated(truth, 40_000, seed=6))
    r = model.estimate("R")
    assert r is not None and r.supported and r.lower < 2e-6 < r.upper
    assert any(t.type == "ramp" for t in model.terms)


@pytest.mark.long
def test_b15_gaps_widen_the_sets_and_shift_nothing() -> None:
    y = simulated(MIXED, 60_000, seed=8).values("x").copy()
    whole = fit_spectral(Recording.from_rate(y, rate=RATE, unit="rad/s", names="x"), terms="NGK")
    y[20_000:35_000] = np.nan
    part = fit_spectral(Recording.from_rate(y, rate=RATE, unit="rad/s", names="x"), terms="NGK")
    for symbol, value in {"N": 1e-3, "T": 8.0, "K": 1e-5}.items():
        a, b = whole.estimate(symbol), part.estimate(symbol)
        assert a is not None and b is not None
        assert b.lower / 1.05 <= value <= b.upper * 1.05
        if symbol == "N":
            assert b.upper - b.lower > a.upper - a.lower


def test_a_steady_line_is_a_term_of_the_model() -> None:
    line = Sinusoid(amplitude=1e-3, frequency=3.3)
    model = fit_spectral(simulated(NoiseModel.of(White(N=1e-3)) + line, 60_000, seed=9))
    assert [t.type for t in model.terms] == ["white", "sinusoid"]
    n = model.estimate("N")
    assert n is not None and n.lower < 1e-3 < n.upper


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"terms": "NX"}, "no noise term has the letter 'X'"),
        ({"terms": "NN"}, "at most once"),
        ({"terms": "R"}, "but R"),
        ({"terms": 5}, "terms must be letters"),
        ({"terms": ["N", 5]}, "no noise term has the letter 5"),
        ({"confidence": 2.0}, "between 0 and 1"),
        ({"confidence": None}, "between 0 and 1"),
        ({"confidence": "a"}, "between 0 and 1"),
        ({"channel": "z"}, "no channel 'z'"),
    ],
)
def test_what_cannot_be_fitted_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        fit_spectral(simulated(MIXED, 2000), **given)


def test_short_and_silent_records_are_refused() -> None:
    with pytest.raises(DataQualityError, match="record longer"):
        fit_spectral(simulated(MIXED, 6))
    with pytest.raises(DataQualityError, match="now 0 samples"):
        fit_spectral(Recording.from_rate(np.zeros(0), rate=RATE, unit="rad/s", names="x"))
    silent = Recording.from_rate(np.zeros(5000), rate=RATE, unit="rad/s", names="x")
    with pytest.raises(DataQualityError, match="resolution"):
        fit_spectral(silent)
    two = Recording.from_rate(np.zeros((50, 2)), rate=RATE, unit="rad/s")
    with pytest.raises(InputError, match="several channels: name one of"):
        fit_spectral(two)


# -- isolated missing samples -------------------------------------------------------------------------------


def missing_singly(n: int, seed: int) -> Recording:
    """White noise of N = 1; two fifths of it are missing, never two in a row."""
    rng = np.random.default_rng(seed)
    y = rng.standard_normal(n) * math.sqrt(RATE)
    y[1::2][rng.random(n // 2) < 0.8] = np.nan
    return Recording.from_rate(y, rate=RATE, unit="rad/s", names="x")


@pytest.mark.long
def test_bridged_samples_carry_no_information() -> None:
    """No interval is shorter than the samples that are there allow, sqrt(1/(2 p n)), and 95 % of them hold N."""
    runs, hits, z = 25, 0, []
    for seed in range(runs):
        record = missing_singly(3000, seed)
        n = fit_spectral(record, terms="N").estimate("N")
        assert n is not None and n.value is not None
        sd = math.log(n.upper / n.lower) / (2 * 1.96)
        present = int(np.isfinite(record.values("x")).sum())
        assert sd > 0.96 / math.sqrt(2 * present)  # 4 % for the noise of the share that was put back
        hits += n.lower < 1.0 < n.upper
        z.append(math.log(n.value) / sd)
    assert hits >= binom.ppf(1e-4, runs, 0.95)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], runs)
    assert low < np.sum(np.square(z)) < high


@pytest.mark.long
def test_slow_noise_beside_random_holes_is_covered() -> None:
    """Three of ten missing: white noise that neighbors hold twice is not taken for flicker."""
    truth, runs = {"N": 1e-4, "B": 1e-4, "K": 1e-4}, 25
    model = NoiseModel.of(White(N=truth["N"]), Flicker(B=truth["B"]), RandomWalk(K=truth["K"]))
    hits = dict.fromkeys(truth, 0)
    for seed in range(runs):
        record = al.simulate(model, rate=100.0, duration=300.0, seed=seed, name="x")
        y = record.values("x").copy()
        y[np.random.default_rng(seed).random(len(y)) < 0.3] = np.nan
        found = fit_spectral(Recording.from_rate(y, rate=100.0, unit="rad/s", names="x"), terms="NBK")
        for symbol, value in truth.items():
            estimate = found.estimate(symbol)
            assert estimate is not None
            hits[symbol] += estimate.lower <= value <= estimate.upper
    assert min(hits.values()) >= binom.ppf(1e-4, runs, 0.95)


def test_common_errors_are_marginalised() -> None:
    """The whitened columns and the likelihood against the dense covariance and a plain minimisation."""
    data, _ = spectral_ordinates(missing_singly(3000, 1), "x")
    problem = WhittleProblem(data=data, letters=("N", "K"))
    at = problem.best()
    assert data.common.shape[1] > 1 and not data.common[: len(data.contrast)].any()
    dense = np.diag(2 / data.weight) + data.common @ data.common.T
    columns = problem.columns(()) / at.mean[:, None]
    seen = problem.whitened(columns, np.ones(len(columns)))
    np.testing.assert_allclose(seen.T @ seen, columns.T @ np.linalg.solve(dense, columns), rtol=1e-8)
    ratio = problem.values(at.ramp) / at.mean * 1.1  # away from the minimum

    def L(e: np.ndarray) -> float:
        turn = data.common @ e
        return float(data.weight @ (np.log(at.mean) + turn + ratio * np.exp(-turn)) + e @ e)

    found = minimize(L, np.zeros(data.common.shape[1]), method="BFGS", options={"gtol": 1e-6})
    np.testing.assert_allclose(problem._shared(ratio), found.x, atol=1e-4)
    at_minimum = problem.values(at.ramp) / at.mean
    e = problem._shared(at_minimum)
    turn = data.common @ e
    value = data.weight @ (np.log(at.mean) + turn + at_minimum * np.exp(-turn)) + e @ e
    assert at.value == pytest.approx(float(value), rel=1e-10)


def test_the_only_density_is_kept_in_a_short_record() -> None:
    """Without its only term there is no model to compare with: that is a loss without bound, no failure."""
    n = fit_spectral(simulated(NoiseModel.of(White(N=0.1)), 1500, seed=3), terms="N").estimate("N")
    assert n is not None and n.supported and n.lower < 0.1 < n.upper


# -- lags against frequencies -----------------------------------------------------------------------------


def test_a_true_model_agrees_with_the_spectrum_and_a_wrong_one_does_not() -> None:
    data, _ = spectral_ordinates(simulated(MIXED, 60_000, seed=10), "x")
    assert disagreement(MIXED, data) is None
    wrong = disagreement(NoiseModel.of(White(N=1.03e-3), *MIXED.terms[1:]), data)
    assert wrong is not None and wrong.whole and 0.9 < wrong.ratio < 0.97
    slow = disagreement(NoiseModel.of(*MIXED.terms[:2], RandomWalk(K=1e-4)), data)
    assert slow is not None and slow.band[1] < 0.1 and "times that of the curve's model" in slow.words


def test_each_of_two_gauss_markov_terms_is_compared_with_its_own_interval() -> None:
    """The interval of the quicker one is narrow, that of the slower one holds what the spectrum says."""
    quick, slow = GaussMarkov.from_sigma(4e-3, 10.0), GaussMarkov.from_sigma(3e-3, 1000.0)
    data, _ = spectral_ordinates(simulated(NoiseModel.of(White(N=1e-3), quick, slow), 60_000, seed=10), "x")
    near, wide = (0.9, 1.1), (0.01, 100.0)
    narrow = [
        Estimate(symbol=s, value=v, lower=v * a, upper=v * b, supported=True)
        for s, v, (a, b) in (("sigma", quick.sigma, near), ("sigma_2", 8 * slow.sigma, wide))
    ]
    louder = GaussMarkov.from_sigma(8 * slow.sigma, slow.T)
    model = NoiseModel(terms=(White(N=1e-3), louder, quick), estimates=tuple(narrow))
    found = disagreement(model, data)
    assert found is not None and found.whole
    assert not found.parameters


@pytest.mark.parametrize(
    ("factor", "severity"),
    [(1.03, Severity.INFO), (0.97, Severity.INFO), (1.2, Severity.WARNING), (0.8, Severity.WARNING)],
)
def test_a_disagreement_is_graded_by_its_size_and_not_by_its_certainty(
    factor: float, severity: Severity
) -> None:
    record = simulated(NoiseModel.of(White(N=1e-3)), 60_000, seed=10)
    model = NoiseModel.of(White(N=factor * 1e-3))
    found = agreement_findings(model, record, spectral_ordinates(record, "x")[1])
    assert [f.severity for f in found] == [severity]


@pytest.mark.parametrize(
    ("ratio", "whole", "pairs", "size"),
    [
        (1.21, True, [], 0.1),
        (1 / 1.21, True, [], 0.1),
        (787.0**2, True, [(1.0, 1.01)], 786.0),
        (4.0, False, [(1.0, 1.01)], 0.01),
        (1.0, True, [(1.5, 1.0), (1.0, 1.01)], 0.5),
        (1.0, True, [(1.5, 0.0)], math.inf),
    ],
)
def test_the_size_of_a_disagreement_is_its_largest_factor(
    ratio: float, whole: bool, pairs: list[tuple[float, float]], size: float
) -> None:
    parameters = tuple(Parted(symbol="N", lags=a, frequencies=b) for a, b in pairs)
    parted = Disagreement(p=1e-9, band=(1.0, 2.0), ratio=ratio, parameters=parameters, whole=whole)
    assert parted.size == pytest.approx(size)


@pytest.mark.long
def test_a_hump_that_the_curve_averages_is_a_finding() -> None:
    """Band-limited noise that is neither a line nor a term: the finding says where the density is another."""
    rng, n = np.random.default_rng(12), 80_000
    hump = sosfilt(butter(2, [3.5, 4.5], "bandpass", fs=RATE, output="sos"), rng.standard_normal(n))
    white = simulated(NoiseModel.of(White(N=1e-3)), n, seed=13).values("x")
    study = al.characterize(
        Recording.from_rate(white + hump * white.std() / hump.std(), rate=RATE, unit="rad/s", names="x")
    )
    found = [f for f in study.findings if f.code == "lag_and_frequency_disagree"]
    assert len(found) == 1 and found[0].severity == "warning"
    assert "Hz the density is" in found[0].message and "N from the frequencies" in found[0].message
