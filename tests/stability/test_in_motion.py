# SPDX-License-Identifier: BSD-3-Clause
"""Noise in motion: coverage without inflation, recovery with it, lines and combs, what a filter is told."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.noise import Estimate, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.noise.motion import MotionInflation
from allanite.noise.spectrum.bands import MeanDensity, amplitude_ratio, band_edges, band_of, level, widths
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.distributions import chi_square_quantile, f_quantile, f_tail
from allanite.recording.records import Recording
from allanite.stability.in_motion import InMotion, MotionVerdict, measure_in_motion
from allanite.stability.in_motion.levels import with_scatter
from allanite.stability.in_motion.lines import CHANCE, lines_in_motion
from allanite.stability.in_motion.matching import matched_channels
from allanite.stability.in_motion.told import told_model
from noise_records import binomial_bound

REST = NoiseModel.of(White(N=1e-4), RandomWalk(K=2e-4))
RATE = 100.0


def log(model: NoiseModel, seed: int, *, duration: float = 200.0, rate: float = RATE) -> Recording:
    return al.simulate(model, rate=rate, duration=duration, seed=seed)


def record(y: np.ndarray, rate: float = RATE, names: tuple[str, ...] = ("gyro",)) -> Recording:
    return Recording.from_rate(y, rate=rate, unit="rad/s", names=list(names))


def sine(amplitude: float, frequency: float, n: int, rate: float = RATE) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * frequency * np.arange(n) / rate)


# -- statistics ----------------------------------------------------------------------------------------------------


def test_ratio_of_chi_squares_is_that_of_the_definition() -> None:
    rng = np.random.default_rng(1)
    drawn = rng.chisquare(7, 200_000) / 7 / (rng.chisquare(12, 200_000) / 12)
    for p in (0.025, 0.5, 0.975):
        share = float(np.mean(drawn < f_quantile(p, 7, 12)))
        assert share == pytest.approx(p, abs=4 * math.sqrt(p * (1 - p) / 200_000))
        assert f_tail(f_quantile(p, 7, 12), 7, 12) == pytest.approx(1 - p)


def test_degrees_of_freedom_of_unequal_points_are_those_of_their_sum() -> None:
    """(2) of the module is unbiased for the variance of a sum of chi-squares with means 1 to 30."""
    d, mean = np.full(8, 6.0), np.geomspace(1, 30, 8)
    x = mean * np.random.default_rng(2).chisquare(d, (50_000, 8)) / d
    variance = np.sum(2 * mean**2 / d)
    estimated = 2 * np.sum(x**2 / (d + 2), axis=1)
    assert estimated.mean() == pytest.approx(variance, rel=5 * estimated.std() / variance / math.sqrt(len(x)))


def test_bands_cover_the_axis_without_overlap() -> None:
    for band in range(-9, 9):
        low, high = band_edges(band)
        assert band_edges(band + 1)[0] == high
        assert band_of(np.array([low * 1.0001, high * 0.9999])).tolist() == [band, band]


@pytest.mark.long
def test_level_over_the_own_model_is_one_at_every_rate_and_length() -> None:
    """A steep density seen through the window, by segments of other lengths: no band is off by more than chance."""
    off = []
    for rate, duration, seed in ((100.0, 400.0, 3), (37.0, 90.0, 4), (250.0, 50.0, 5)):
        for repeat in range(10):
            made = log(REST, 100 * seed + repeat, duration=duration, rate=rate)
            spectrum = power_spectrum(made, made.names[0])
            expected = spectrum.expected(REST)
            for band in sorted(set(band_of(spectrum.frequency).tolist())):
                found = level(spectrum, band_of(spectrum.frequency) == band, expected, widths(spectrum))
                low, high = (chi_square_quantile(p, found.dof) / found.dof for p in (0.005, 0.995))
                off.append(not low < found.value < high)
    assert sum(off) <= binomial_bound(len(off), 0.01)


@pytest.mark.long
@pytest.mark.parametrize(("rate", "duration"), [(RATE, 200.0), (50.0, 120.0)])
def test_intervals_without_inflation_cover_one(rate: float, duration: float) -> None:
    """Rest and motion have one noise: intervals of N, of K and of bands miss 1 as often as stated."""
    runs, missed_n, missed_k, missed, bands, verdicts = 80, 0, 0, 0, 0, 0
    for seed in range(runs):
        found = measure_in_motion(
            log(REST, 2 * seed), log(REST, 2 * seed + 1, rate=rate, duration=duration), models={"gyro": REST}
        ).channels[0]
        missed_n += not found.inflation.lower < 1 < found.inflation.upper
        missed_k += not found.slow.lower < 1 < found.slow.upper
        bands += len(found.bands)
        missed += sum(not b.inflation.lower < 1 < b.inflation.upper for b in found.bands)
        verdicts += found.verdict is not MotionVerdict.UNCHANGED
        assert (found.told == 1.0) is (found.verdict is not MotionVerdict.INFLATED)
    for count, trials in ((missed_n, runs), (missed_k, runs), (missed, bands), (verdicts, runs)):
        low, high = binom.ppf([5e-4, 1 - 5e-4], trials, 0.05)
        assert low <= count <= high


@pytest.mark.long
def test_intervals_cover_an_inflation_and_its_verdict_is_inflated() -> None:
    runs, missed_n, missed_k, factor = 40, 0, 0, 3.0
    moved = NoiseModel.of(White(N=factor * 1e-4), RandomWalk(K=factor * 2e-4))
    for seed in range(runs):
        found = measure_in_motion(
            log(REST, 1000 + seed), log(moved, 2000 + seed), models={"gyro": REST}, fixed=True
        )
        (channel,) = found.channels
        assert channel.verdict is MotionVerdict.INFLATED
        missed_n += not channel.inflation.lower < factor < channel.inflation.upper
        missed_k += not channel.slow.lower < factor < channel.slow.upper
        facts = channel.model.in_motion
        assert facts.slow == channel.slow.value and facts.noise == pytest.approx(channel.inflation.value)
        assert channel.model.term("white").N == pytest.approx(channel.noise.value)
        assert channel.model.term("random_walk").K == pytest.approx(2e-4 * channel.slow.value)
    assert missed_n <= binomial_bound(runs, 0.05)
    assert missed_k <= binomial_bound(runs, 0.05)


def test_a_noisier_log_at_rest_is_called_so() -> None:
    found = measure_in_motion(log(NoiseModel.of(White(N=3e-4)), 5), log(REST, 6), models={"gyro": REST})
    assert found.verdict is MotionVerdict.LOWER and "check that the sensor was at rest" in found.reason


@pytest.mark.long
def test_steady_logs_are_seldom_called_unsteady_and_a_change_always() -> None:
    rng, runs = np.random.default_rng(7), 5000
    dof = np.array([40.0, 35.0, 60.0, 40.0, 40.0, 12.0, 40.0, 40.0])
    whole = MeanDensity(value=1.0, dof=float(dof.sum()))
    called = 0
    for _ in range(runs):
        parts = [MeanDensity(value=v, dof=d) for v, d in zip(rng.chisquare(dof) / dof, dof, strict=True)]
        called += not with_scatter(whole, parts)[1]
    assert called <= binomial_bound(
        runs, 2e-3
    )  # 1e-3 of normal logarithms; those of 12 degrees have longer tails
    parts = [MeanDensity(value=v, dof=40.0) for v in (1, 1, 1, 4, 4, 4, 1, 1)]
    scattered, steady = with_scatter(whole, parts)
    assert not steady and scattered.dof < 0.2 * whole.dof and scattered.value == whole.value


@pytest.mark.long
def test_a_throttle_that_changes_widens_the_interval() -> None:
    rng = np.random.default_rng(8)
    still = record(1e-3 * rng.standard_normal(20_000))
    gain = np.repeat([1.0, 4.0, 2.0, 6.0], 5000)
    moved = measure_in_motion(still, record(1e-3 * gain * rng.standard_normal(20_000))).channels[0]
    steady = measure_in_motion(still, record(1e-3 * 3.8 * rng.standard_normal(20_000))).channels[0]
    assert steady.steady and not moved.steady
    width = [math.log(c.inflation.upper / c.inflation.lower) for c in (moved, steady)]
    assert width[0] > 3 * width[1]


# -- lines ---------------------------------------------------------------------------------------------------------


QUIET = power_spectrum(record(np.random.default_rng(9).standard_normal(4096), 200.0), "gyro")


def spectrum_with(*frequencies: float, width: float = 0.02) -> Spectrum:
    lines = [
        SpectralLine(frequency=f, amplitude=1.0, significance=9.0, width=width) for f in sorted(frequencies)
    ]
    return replace(QUIET, lines=tuple(lines), band_limit=None)


def test_harmonics_are_a_comb_also_when_they_are_folded() -> None:
    motion = spectrum_with(31.0, 62.0, 93.0, 200 - 124.0, 53.3)
    lines, (comb,) = lines_in_motion(motion, spectrum_with(), "rad/s")
    assert comb.fundamental == pytest.approx(31.0) and comb.orders == (1, 2, 3, 4) and comb.p < CHANCE
    by_frequency = {line.frequency: line for line in lines}
    assert [by_frequency[f].folded for f in (31.0, 62.0, 93.0, 76.0)] == [False, False, False, True]
    assert by_frequency[53.3].comb is None and by_frequency[53.3].aliases == pytest.approx((146.7, 253.3))
    assert by_frequency[31.0].rms.value == pytest.approx(math.sqrt(0.5))


def test_two_rotors_are_two_combs() -> None:
    motion = spectrum_with(11.0, 22.0, 33.0, 44.0, 13.1, 26.2, 39.3, 52.4)
    lines, combs = lines_in_motion(motion, spectrum_with(), "rad/s")
    assert sorted(c.fundamental for c in combs) == pytest.approx([11.0, 13.1])
    assert all(line.comb is not None for line in lines)


def test_lines_at_rest_are_no_rotor() -> None:
    motion, rest = spectrum_with(31.0, 62.0, 93.0), spectrum_with(31.01, 62.0, 93.0)
    lines, combs = lines_in_motion(motion, rest, "rad/s")
    assert all(line.at_rest for line in lines) and not combs


@pytest.mark.long
def test_lines_at_random_places_are_seldom_a_comb() -> None:
    rng, runs, combs = np.random.default_rng(10), 2000, 0
    for _ in range(runs):
        motion = spectrum_with(*rng.uniform(1.0, 99.0, 6), width=0.1)
        combs += len(lines_in_motion(motion, spectrum_with(), "rad/s")[1])
    assert combs <= binomial_bound(runs, CHANCE)


@pytest.mark.long
def test_white_noise_shows_no_new_line() -> None:
    runs, found = 40, 0
    for seed in range(runs):
        rng = np.random.default_rng([11, seed])
        pair = [record(1e-3 * rng.standard_normal(12_000)) for _ in range(2)]
        found += bool(
            measure_in_motion(*pair, models={"gyro": NoiseModel.of(White(N=1e-4))}).channels[0].lines
        )
    assert found <= binomial_bound(runs, 1e-3)


@pytest.mark.long
def test_a_line_is_told_as_the_noise_that_leaves_the_same_error_after_integration() -> None:
    """N' from the definition: the integrals of (S + lines)/f^2 and of 1/f^2 over the band."""
    n, amplitude, f, white = 60_000, 2e-3, 23.0, 1e-4
    rng = np.random.default_rng(12)
    sd = white * math.sqrt(RATE)
    still = record(sd * rng.standard_normal(n))
    found = measure_in_motion(
        still,
        record(sd * rng.standard_normal(n) + sine(amplitude, f, n)),
        models={"gyro": NoiseModel.of(White(N=white))},
    )
    (channel,) = found.channels
    assert channel.verdict is MotionVerdict.UNCHANGED
    (line,) = channel.lines
    assert line.steady and line.rms.value == pytest.approx(amplitude / math.sqrt(2), rel=0.01)
    weight = 1 / found.above - 1 / found.below
    expected = math.sqrt(white**2 + amplitude**2 / 4 / f**2 / weight)
    assert channel.with_lines.value == pytest.approx(expected, rel=0.02)
    facts = found.models["gyro"].in_motion
    assert facts.noise == pytest.approx(expected / white, rel=0.02)
    assert facts.lines == pytest.approx(1 - white**2 / expected**2, abs=0.02)
    assert found.models["gyro"].term("white").N == pytest.approx(expected, rel=0.02)


# -- what is asked -------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_slow_movement_is_told_as_noise_only_of_a_body_held_still() -> None:
    moved = NoiseModel.of(White(N=1e-4), RandomWalk(K=2e-3))
    pair = log(REST, 13), log(moved, 14)
    for fixed in (False, True):
        model = measure_in_motion(*pair, models={"gyro": REST}, fixed=fixed).models["gyro"]
        assert (model.term("random_walk").K > 1e-3) is fixed
        assert ("held still" in model.verdict) is fixed


@pytest.mark.long
def test_of_several_logs_the_noisiest_is_told() -> None:
    logs = [log(NoiseModel.of(White(N=k * 1e-4)), 20 + k) for k in (2, 6, 4)]
    found = measure_in_motion(log(REST, 15), logs, models={"gyro": REST})
    assert len(found.channels) == 3 and len(found.logs) == 3
    assert found.models["gyro"].term("white").N == pytest.approx(6e-4, rel=0.05)


def test_channels_match_by_name_by_axis_and_alone() -> None:
    y = np.random.default_rng(16).standard_normal((200, 3))
    rest = record(y, names=("gx", "gy", "gz"))
    for names in (("gyro_x", "gyro_y", "gyro_z"), ("rate[0]", "rate[1]", "rate[2]"), ("wx", "wy", "wz")):
        assert matched_channels(rest, record(y, names=names)) == list(zip(rest.names, names, strict=True))
    backwards = record(y, names=("gyro_z", "gyro_y", "gyro_x"))
    assert matched_channels(rest, backwards) == [("gx", "gyro_x"), ("gy", "gyro_y"), ("gz", "gyro_z")]
    assert matched_channels(rest.select("gx"), record(y[:, :1], names=("a",))) == [("gx", "a")]
    assert matched_channels(rest, backwards, ["gx,gyro_z"]) == [("gx", "gyro_z")]
    other = Recording.from_rate(y[:, 0], rate=RATE, unit="m/s^2", names=["ax"])
    with pytest.raises(InputError, match=r"no channel .* belongs to one"):
        matched_channels(rest, other)
    with pytest.raises(InputError, match="state the units of both"):
        matched_channels(rest, other, ["gx,ax"])
    with pytest.raises(InputError, match="by one name, or by two"):
        matched_channels(rest, backwards, ["a,b,c"])


@pytest.mark.long
def test_the_document_comes_back_and_says_what_it_says() -> None:
    rng, n = np.random.default_rng(17), 30_000
    buzz = sum(sine(1e-3 / k, 12.5 * k, n) for k in (1, 2, 3))
    found = measure_in_motion(
        record(1e-3 * rng.standard_normal(n)), record(2e-3 * rng.standard_normal(n) + buzz)
    )
    again = InMotion.from_json(json.loads(json.dumps(found.to_json(), allow_nan=False)))
    assert again.to_json() == found.to_json() and again.reason == found.reason
    assert again.models["gyro"] == found.models["gyro"]
    (comb,) = found.channels[0].combs
    assert comb.fundamental == pytest.approx(12.5, abs=0.05)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"above": 40.0}, "half the common band"),
        ({"above": -1.0}, "half the common band"),
        ({"confidence": 1.5}, "between 0 and 1"),
        ({"models": {"other": REST}}, "no noise model of 'gyro'"),
    ],
)
def test_what_makes_no_sense_is_refused(options: dict, says: str) -> None:
    with pytest.raises(InputError, match=says):
        measure_in_motion(log(REST, 18), log(REST, 19), **options)


def test_no_log_in_motion_and_a_log_too_short_are_refused() -> None:
    with pytest.raises(InputError, match="state a log in motion"):
        measure_in_motion(log(REST, 18), [])
    with pytest.raises(DataQualityError, match="record longer"):
        measure_in_motion(log(REST, 18), log(REST, 19, duration=0.4), models={"gyro": REST})


def test_ratio_of_levels_is_its_own_inverse() -> None:
    one, other = MeanDensity(value=4.0, dof=20.0), MeanDensity(value=1.0, dof=9.0)
    ratio, low, high = amplitude_ratio(one, other, 0.9)
    assert ratio == 2.0 and low < 2.0 < high
    assert amplitude_ratio(other, one, 0.9) == pytest.approx((0.5, 1 / high, 1 / low))


def test_a_flight_controller_at_rest_is_told_from_one_in_the_hand(real_data):
    log = al.read(real_data("formats_px4_ardupilot") / "sample.ulg")
    rest = log.window(9, 39)
    later = al.measure_in_motion(rest, [log.window(39, 68)])
    held = al.measure_in_motion(rest, [log.window(0, 7)])
    assert {c.verdict for c in later.channels} == {MotionVerdict.UNCHANGED}
    assert all(c.inflation.lower < 1 < c.inflation.upper for c in later.channels)
    assert {c.verdict for c in held.channels} == {MotionVerdict.INFLATED}
    assert all(c.inflation.lower > 10 for c in held.channels)


def test_every_slow_term_of_the_model_that_a_filter_is_told_grows_with_its_estimate() -> None:
    """Whatever the symbols: a second Gauss-Markov term has a number, and an equivalent B for each."""
    terms = (White(N=1e-4), GaussMarkov.from_sigma(3e-5, 10.0), GaussMarkov.from_sigma(1e-5, 500.0))
    sizes = {"N": 1e-4, "sigma": 3e-5, "B_equiv": 2.8e-5, "sigma_2": 1e-5, "B_equiv_2": 9e-6}
    estimates = tuple(
        Estimate(symbol=s, value=v, lower=v / 2, upper=2 * v, supported=True)
        for s, v in {**sizes, "T": 10.0, "T_2": 500.0}.items()
    )
    facts = MotionInflation(
        log="flight", above=1.0, below=5.0, noise=1.0, noise_lower=0.9, noise_upper=1.1, lines=0.0, slow=3.0,
        fixed=True,
    )  # fmt: skip
    told = told_model(NoiseModel(terms=terms, estimates=estimates), facts, 1e-4)
    for before in estimates:
        after = told.estimate(before.symbol)
        assert after is not None and after.value is not None and before.value is not None
        assert after.value / before.value == pytest.approx(1.0 if before.symbol[0] in "NT" else 3.0)
    assert [t.sigma for t in told.terms if isinstance(t, GaussMarkov)] == pytest.approx([9e-5, 3e-5])
