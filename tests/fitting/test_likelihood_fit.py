# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood fit: recovers known truths, sets hold what they should, limits for what is absent, refusals."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.family import FLICKER
from allanite.fitting.likelihood.objective import LikelihoodValue, Point, RandomTerm
from allanite.fitting.likelihood.profile import coefficient_set, critical_value, slope_set
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, Sinusoid, White
from allanite.recording.records import Recording
from shell import Run

WALK = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5))


def record(
    model: NoiseModel, *, rate: float = 10.0, duration: float = 4000.0, seed: int = 1, sampling: str = "mean"
) -> Recording:
    return al.simulate(model, rate=rate, duration=duration, seed=seed, sampling=sampling)


def assert_within(found: float, truth: float, sds: float, variance_of_log: float) -> None:
    assert abs(math.log(found / truth)) < sds * math.sqrt(variance_of_log)


# -- any sum of terms -------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize(
    ("letters", "model"),
    [
        ("QN", NoiseModel.of(Quantisation(Q=2e-5, dt=0.1), White(N=2e-5))),
        ("NBK", NoiseModel.of(White(N=1e-4), Flicker(B=6e-5), RandomWalk(K=5e-6))),
        ("NG", NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-4, 30.0))),
        ("NR", NoiseModel.of(White(N=1e-4), Ramp(R=1e-7))),
    ],
)
def test_recovers_every_term_within_its_stated_error(letters: str, model: NoiseModel, sampling: str) -> None:
    found = LikelihoodProblem.of(record(model, sampling=sampling)).maximum(tuple(letters))
    variances = dict(zip(found.covariance["symbols"], np.diag(found.covariance["matrix"]), strict=True))
    truth = {}
    for term in model.terms:
        truth |= (
            {"sigma": term.sigma, "T": term.T}
            if isinstance(term, GaussMarkov)
            else {term.symbols[0]: getattr(term, term.symbols[0])}
        )
    for symbol, value in truth.items():
        assert_within(found.parameters[symbol], value, 3.5, variances[symbol])
    assert found.p > 1e-3
    assert found.n_parameters == len(truth)
    assert [t.type for t in found.terms] == [t.type for t in model.terms]


@pytest.mark.long
def test_two_gauss_markov_terms() -> None:
    model = NoiseModel.of(
        White(N=2e-5), GaussMarkov.from_sigma(1e-4, 3.0), GaussMarkov.from_sigma(1e-4, 150.0)
    )
    problem = LikelihoodProblem.of(record(model, duration=20_000.0))
    one, two = problem.maximum(("N", "G")), problem.maximum(("N", "G", "G"))
    variances = dict(zip(two.covariance["symbols"], np.diag(two.covariance["matrix"]), strict=True))
    for symbol, value in (("sigma", 1e-4), ("T", 3.0), ("sigma_2", 1e-4), ("T_2", 150.0)):
        assert_within(two.parameters[symbol], value, 3.5, variances[symbol])
    assert two.log_likelihood > one.log_likelihood + 20
    assert one.p < 1e-3 < two.p


def test_a_line_is_found_with_frequency_amplitude_and_phase() -> None:
    noise = record(WALK)
    t = (np.arange(noise.n_samples) + 0.5) * noise.dt
    # a mean over the interval is the value at its middle times sinc
    line = 3e-5 * np.sinc(1.234 * noise.dt) * np.sin(2 * np.pi * 1.234 * t + 0.7)
    problem = LikelihoodProblem.of(
        Recording.from_rate(noise.values(noise.names[0]) + line, rate=10.0, unit="rad/s")
    )
    found = problem.with_lines([1.2341]).maximum(("N", "K"))
    sine = found.terms[-1]
    assert isinstance(sine, Sinusoid)
    variances = dict(zip(found.covariance["symbols"], np.diag(found.covariance["matrix"]), strict=True))
    assert math.sqrt(variances["amplitude"]) == pytest.approx(math.sqrt(2 / 4000) * 1e-4 / 3e-5, rel=0.1)
    assert_within(sine.amplitude, 3e-5, 3.5, variances["amplitude"])
    assert_within(sine.frequency, 1.234, 3.5, variances["frequency"])
    assert sine.phase == pytest.approx(0.7, abs=4 * 2 * math.sqrt(variances["amplitude"]))
    assert found.log_likelihood > problem.maximum(("N", "K")).log_likelihood + 20
    assert_within(found.parameters["N"], 1e-4, 3.5, variances["N"])


@pytest.mark.long
def test_lines_come_with_intervals_of_rife_and_boorstyn() -> None:
    """Amplitude sd sqrt(2/T) N, frequency sd sqrt(6/T^3) N/(pi A) in white noise; what is not there is a limit."""
    n, duration, size = 1e-4, 2000.0, 2e-5
    model = NoiseModel.of(White(N=n), Sinusoid(amplitude=size, frequency=1.3, phase=0.4))
    found = al.fit(record(model, duration=duration, sampling="point"), terms="N", lines=[1.3, 3.1])
    half = 1.959964
    amplitude, frequency = found.estimate("amplitude"), found.estimate("frequency")
    assert amplitude.supported and amplitude.lower < size < amplitude.upper
    assert amplitude.upper - amplitude.value == pytest.approx(half * math.sqrt(2 / duration) * n, rel=0.02)
    spread = half * math.sqrt(6 / duration**3) * n / (math.pi * amplitude.value)
    assert frequency.upper - frequency.value == pytest.approx(spread, rel=0.02)
    assert frequency.lower < 1.3 < frequency.upper
    absent = found.estimate("amplitude_2")
    assert not absent.supported and absent.value is None and absent.upper < 3e-5
    assert not found.estimate("frequency_2").supported


def test_more_terms_are_never_less_likely() -> None:
    problem = LikelihoodProblem.of(record(WALK, duration=1000.0))
    values = [problem.maximum(tuple(s)).log_likelihood for s in ("N", "NK", "NBK", "QNBK", "QNBKR")]
    assert (np.diff(values) > -1e-3).all()


@pytest.mark.long
def test_a_correlation_time_at_its_longest_does_not_stop_the_climb() -> None:
    """Where a random walk is wanted, a Gauss-Markov term goes to the longest time, and the others to their best."""
    model = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-4, 10.0), RandomWalk(K=3e-5))
    problem = LikelihoodProblem.of(record(model, duration=10_000.0, seed=3))
    points: list[Point] = []

    def counted(at: Point) -> LikelihoodValue:
        points.append(at)
        return problem.search.evaluate(at)

    longest = problem.search.times[1]
    terms = RandomTerm("N"), RandomTerm("G", 50.0), RandomTerm("G", longest / 3)
    peak = replace(problem.search, evaluate=counted).climb(Point(terms, problem.start(terms)))
    assert peak.at.components[2].T == pytest.approx(longest)
    assert len(points) < 10
    slope, bend = peak.value.gradient[:4], np.diag(peak.value.information)[:4]
    assert np.abs(slope / np.sqrt(bend)).max() < 1e-2  # standard deviations away from the best


# -- invariance -------------------------------------------------------------------------------------------


@pytest.mark.long
def test_rescaled_samples_rescale_the_result() -> None:
    y = record(WALK, duration=1000.0)
    samples = y.values(y.names[0])
    fits = [al.fit(Recording.from_rate(samples * s, rate=10.0, unit="rad/s")) for s in (1.0, 1e-8)]
    for a, b in zip(fits[0].estimates, fits[1].estimates, strict=True):
        assert a.supported == b.supported
        assert b.upper == pytest.approx(a.upper * 1e-8, rel=1e-4)
        if a.value is not None:
            assert b.value == pytest.approx(a.value * 1e-8, rel=1e-5)


def test_a_constant_does_not_matter_nor_do_angles() -> None:
    noise = record(WALK, duration=1000.0)
    samples = noise.values(noise.names[0])
    angle = Recording.from_angle(np.concatenate([[0.0], np.cumsum(samples) * 0.1]), rate=10.0, unit="rad")
    plain = LikelihoodProblem.of(noise).maximum(("N", "K")).parameters
    lifted = Recording.from_rate(samples + 0.3, rate=10.0, unit="rad/s")
    assert LikelihoodProblem.of(lifted).maximum(("N", "K")).parameters == pytest.approx(plain, rel=1e-6)
    # the first angle is no rate: all blocks are shifted by one sample
    assert LikelihoodProblem.of(angle).maximum(("N", "K")).parameters == pytest.approx(plain, rel=0.02)


@pytest.mark.parametrize("scattered", [True, False])
def test_gaps_widen_and_do_not_bias(scattered: bool) -> None:
    noise = record(WALK, duration=4000.0, seed=5)
    samples = noise.values(noise.names[0]).copy()
    rng = np.random.default_rng(5)
    if scattered:
        samples[rng.random(len(samples)) < 0.4] = np.nan
    else:
        for start in rng.integers(0, len(samples), 40):
            samples[start : start + 400] = np.nan
    found = LikelihoodProblem.of(Recording.from_rate(samples, rate=10.0, unit="rad/s")).maximum(("N", "K"))
    for symbol, variance in zip(("N", "K"), np.diag(found.covariance["matrix"]), strict=True):
        assert_within(found.parameters[symbol], 1e-4 if symbol == "N" else 1e-5, 3.5, variance)
    present = np.isfinite(samples).sum()
    # of white noise alone sqrt(1/2n); what scattered gaps keep to themselves is less than a fifth
    sd_n = math.sqrt(found.covariance["matrix"][0][0])
    assert 1 / math.sqrt(2 * present) < sd_n < 1.35 / math.sqrt(2 * present)
    assert found.p > 1e-3


# -- sets -------------------------------------------------------------------------------------------------


def test_the_ends_of_a_set_are_where_the_test_turns() -> None:
    problem = LikelihoodProblem.of(record(NoiseModel.of(White(N=1e-4), Flicker(B=4e-5)), duration=2000.0))
    best = problem.peak(FLICKER, slope=None)
    search, i = problem.search, FLICKER.index("B")
    critical = critical_value(best, i, frozenset({1, 2}), 0.95)
    assert 3.84 <= critical + 0.01 < 6.0
    ends = coefficient_set(search, best, i, critical, lambda: problem.peak(("Q", "N", "K"), slope=None))
    assert 0 < ends[0] < best.at.c[i] < ends[1]
    for end in ends:
        at = replace(best.at, c=np.where(np.arange(4) == i, end, best.at.c))
        null = search.climb(at, held=frozenset({i}))
        assert 2 * (best.log_likelihood - null.log_likelihood) == pytest.approx(critical, rel=0.05)


def test_the_slope_of_a_ramp_has_the_interval_of_a_regression() -> None:
    # in white noise alone the slope and its interval are those of any textbook
    from scipy.stats import linregress, t

    y = record(NoiseModel.of(White(N=1e-4)), rate=1.0, duration=900.0, seed=4)
    samples = y.values(y.names[0])
    problem = LikelihoodProblem.of(y)
    best = problem.peak(("N",), slope=None, averaged=True)
    low, high = slope_set(problem.search, best, 0.95)
    line = linregress(np.arange(900.0), samples)
    reach = t.ppf(0.975, 898) * line.stderr
    assert (low, high) == pytest.approx((line.slope - reach, line.slope + reach), rel=2e-3)


@pytest.mark.long
def test_given_terms_all_have_their_sets() -> None:
    model = NoiseModel.of(
        White(N=2e-5), GaussMarkov.from_sigma(1e-4, 3.0), GaussMarkov.from_sigma(1e-4, 150.0)
    )
    noise = record(model, duration=20_000.0)
    given, found = al.fit(noise, terms="NGGK"), al.fit(noise)
    for m in (given, found):
        assert [t.type for t in m.terms if t.type == "gauss_markov"] == ["gauss_markov"] * 2
        truth = {"N": 2e-5, "sigma": 1e-4, "T": 3.0, "sigma_2": 1e-4, "T_2": 150.0}
        for symbol, value in truth.items():
            e = m.estimate(symbol)
            assert e is not None and e.supported and e.value is not None and e.lower < value < e.upper
            assert e.lower < e.value < e.upper
        walk = m.estimate("K")
        assert walk is not None and not walk.supported
    assert "a second Gauss-Markov term" in found.verdict
    assert given.estimate("R") is None and found.estimate("R") is not None
    with pytest.raises(InputError, match="letters"):
        al.fit(noise, terms="NX")


@pytest.mark.long
def test_c14_white_noise_alone_leaves_upper_limits() -> None:
    model = al.fit(record(NoiseModel.of(White(N=1e-4)), duration=2000.0, seed=14))
    assert [t.type for t in model.terms] == ["white"]
    assert model.family == "flicker"
    for symbol in ("Q", "B", "K", "R"):
        e = model.estimate(symbol)
        assert (
            e is not None and e.value is None and not e.supported and 0 < e.upper < math.inf and e.lower == 0
        )
    n = model.estimate("N")
    assert n is not None and n.lower < 1e-4 < n.upper
    assert model.goodness["method"] == "likelihood"
    assert model.verdict.startswith("By maximum likelihood")


@pytest.mark.long
def test_a_ramp_is_supported_with_its_set() -> None:
    model = al.fit(record(NoiseModel.of(White(N=1e-4), Ramp(R=1e-8)), duration=3600.0, seed=3))
    e = model.estimate("R")
    assert e is not None and e.supported and e.lower < 1e-8 < e.upper
    assert model.term("ramp") is not None


def test_the_result_serves_like_that_of_a_curve() -> None:
    # study, exporters and planning read these fields
    noise = record(NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-4, 30.0)), duration=8000.0, seed=2)
    ours, moments = al.fit(noise), al.fit(al.allan_curve(noise))
    assert ours.family == moments.family == "gauss-markov"
    assert [e.symbol for e in ours.estimates] == [e.symbol for e in moments.estimates]
    assert set(moments.goodness) <= set(ours.goodness)
    for e, m in zip(ours.estimates, moments.estimates, strict=True):
        assert max(e.lower, m.lower) <= min(e.upper, m.upper)
    again = NoiseModel.from_json(json.loads(json.dumps(ours.to_json())))
    assert again == ours


@pytest.mark.long
def test_a_filtered_sensor_leaves_its_shortest_means_out() -> None:
    noise = record(WALK, duration=8000.0, seed=7)
    y = noise.values(noise.names[0])
    smooth = np.convolve(y, [0.25, 0.5, 0.25], mode="same")
    model = al.fit(Recording.from_rate(smooth, rate=10.0, unit="rad/s"))
    assert model.goodness["left_out"] == 1 and model.goodness["shortest_tau"] >= 0.4
    assert "left out" in model.verdict
    k = model.estimate("K")
    assert k is not None and k.lower < 1e-5 < k.upper


# -- refusals ---------------------------------------------------------------------------------------------


def test_refusals_say_what_to_do() -> None:
    noise = record(WALK, duration=100.0)
    curve = al.allan_curve(noise)
    with pytest.raises(InputError, match="fit\\(allan_curve"):
        al.fit(noise, method="moments")
    with pytest.raises(InputError, match="fit\\(recording"):
        al.fit(curve, method="likelihood")
    with pytest.raises(InputError, match="no channel"):
        al.fit(noise, channel="nobody")
    with pytest.raises(InputError, match="engine"):
        al.fit(noise, engine="fast")
    with pytest.raises(InputError, match="unexpected"):
        al.fit(noise, colour="red")
    with pytest.raises(InputError, match="takes no channel"):
        al.fit(curve, channel="x")
    with pytest.raises(InputError, match="exclude"):
        al.fit(noise, exclude=[True])
    problem = LikelihoodProblem.of(noise)
    for terms in ((), ("R",), ("X",), ("N", "N"), ("G", "G", "G")):
        with pytest.raises(InputError, match="letters"):
            problem.maximum(terms)
    with pytest.raises(InputError, match="above 0 and up to 5 Hz"):
        problem.with_lines([7.0])
    several = Recording.from_rate(np.zeros((1000, 2)), rate=1.0, unit="rad/s")
    with pytest.raises(InputError, match="name the channel"):
        al.fit(several)
    with pytest.raises(DataQualityError, match="constant"):
        al.fit(several, channel="x")
    with pytest.raises(DataQualityError, match="usable samples"):
        al.fit(Recording.from_rate(np.full(1000, np.nan), rate=1.0, unit="rad/s"))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_the_exact_engine_finds_its_terms_itself(seed: int) -> None:
    """Terms that are left out on the way have no part in what the exact likelihood adds."""
    x = Recording.from_rate(np.random.default_rng(seed).standard_normal(2048), rate=1.0, unit="rad/s")
    exact, composite = al.fit(x, engine="exact"), al.fit(x)
    assert exact.goodness["engine"] == "exact"
    one, other = exact.estimate("N"), composite.estimate("N")
    assert one is not None and other is not None
    assert one.value == pytest.approx(other.value, rel=0.01) and one.upper == pytest.approx(
        other.upper, rel=0.01
    )


@pytest.mark.long
def test_fit_takes_lines_from_the_command_line(run: Run, tmp_path: Path) -> None:
    model = NoiseModel.of(White(N=1e-4), Sinusoid(amplitude=5e-5, frequency=1.3))
    path = tmp_path / "line.npy"
    np.save(path, record(model, duration=600.0).values("gyro"))
    reading = ("fit", path, "--rate", 10, "--unit", "rad/s")
    words = (*reading, "--method", "likelihood")
    done = run(*words, "--terms", "N", "--lines", "1.3", "--json")
    (fitted,) = json.loads(done.out).values()
    line = next(e for e in fitted["estimates"] if e["symbol"] == "amplitude")
    assert line["supported"] and line["lower"] < 5e-5 < line["upper"]
    shown = run(*words, "--terms", "N", "--lines", "1.3").out
    assert "line [" in shown and "f [Hz]" in shown
    for lines, terms in (("auto", ["N", "amplitude", "frequency"]), ("none", ["N"])):
        (named,) = json.loads(run(*words, "--terms", "N", "--lines", lines, "--json").out).values()
        assert [e["symbol"] for e in named["estimates"]] == terms
    refused = run(*reading, "--method", "moments", "--lines", "1.3")
    assert refused.code == 1 and "--method moments takes no lines: use --method likelihood" in refused.err
