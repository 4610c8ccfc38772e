# SPDX-License-Identifier: BSD-3-Clause
"""Windows, expected periodograms, intervals, and lines that are sinusoids."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import binom
from scipy.stats import t as student_t

import allanite as al
from allanite.errors import InputError
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.expected import sight_of
from allanite.noise.spectrum.holes import Bridge, _definite
from allanite.noise.spectrum.periodogram import welch
from allanite.noise.spectrum.results import Spectrum
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.noise.spectrum.stability import sinusoids, without_stable_lines
from allanite.noise.spectrum.windows import HANN, WINDOWS, Window, window_of
from allanite.recording.records import Recording

RATE = 100.0
DT = 1 / RATE
TERMS: tuple[TermType, ...] = (
    White(N=0.1),
    Quantisation(Q=1e-2, dt=DT),
    Flicker(B=0.5),
    RandomWalk(K=0.3),
    GaussMarkov(q=1.0, T=0.05),
    GaussMarkov(q=1.0, T=20.0),
)
COLOURED = NoiseModel.of(White(N=0.1), Flicker(B=0.1), RandomWalk(K=0.02))


def simulated(model: NoiseModel, n: int, seed: int = 1) -> Recording:
    return al.simulate(model, rate=RATE, duration=n * DT, seed=seed, name="x")


def within(hits: float, runs: int, p: float = 0.95) -> bool:
    """A share lies inside the 99.99 % bounds of its binomial law."""
    low, high = binom.ppf([5e-5, 1 - 5e-5], runs, p)
    return bool(low <= round(hits * runs) <= high)


# -- windows ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("window", WINDOWS.values(), ids=WINDOWS)
def test_window_does_not_see_a_constant_beyond_its_order(window: Window) -> None:
    transform = np.abs(np.fft.rfft(window.samples(64)))
    assert transform[window.order + 1 :].max() < 1e-12 * transform[0]
    kernel = window.kernel(np.arange(-64, 64, 0.25), 128)
    assert kernel.sum() / 4 == pytest.approx(1, rel=1e-9)
    assert (np.arange(-64, 64, 0.25) ** 2 @ kernel)[()] / 4 > window.spread / 2


def test_unknown_windows_are_refused() -> None:
    with pytest.raises(InputError, match="leak"):
        window_of("boxcar")
    with pytest.raises(InputError, match="hann, blackman"):
        window_of("tukey")


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("window", WINDOWS.values(), ids=WINDOWS)
def test_expected_periodogram_is_that_of_the_dense_covariance(window: Window, sampling: Any) -> None:
    length = 256
    bins = np.array([window.order + 2, window.order + 3, 8, 20, 63, 100, 120])
    sight = sight_of(np.stack([bins, bins + 1], axis=1), np.full(len(bins), RATE / length), RATE / 2, window)
    taper = window.samples(length)
    seen = taper * np.exp(-2j * np.pi * np.outer(bins, np.arange(length)) / length)
    for term in TERMS:
        lag = np.arange(-1.0, length + 1)
        phase = term.phase_covariance(np.abs(lag), DT, sampling)
        covariance = toeplitz(2 * phase[1:-1] - phase[2:] - phase[:-2])
        dense = np.einsum("ki,ij,kj->k", seen, covariance, seen.conj()).real * DT / (taper @ taper)
        found = sight(lambda f, t=term: sampled_psd(NoiseModel.of(t), f, DT, sampling))  # type: ignore[misc]
        np.testing.assert_allclose(found, dense, rtol=4e-4)


# -- Welch ------------------------------------------------------------------------------------------------


def test_c11_one_sided_welch_density_of_white_noise() -> None:
    white = np.random.default_rng(11).standard_normal(400_000)
    spectrum = power_spectrum(
        Recording.from_rate(white, rate=100.0, unit="V", names="x"), "x", method="welch"
    )
    one_sided = math.sqrt(2 * float(spectrum.density.mean()))
    assert one_sided == pytest.approx(0.14142, rel=4 / math.sqrt(2 * 400_000))


@pytest.mark.parametrize(("name", "overlap"), [("hann", 0.5), ("hann", 0.75), ("blackman-harris", 0.75)])
def test_degrees_of_freedom_of_overlapping_segments(name: str, overlap: float) -> None:
    """The scatter of bins far enough apart tells the degrees of freedom: var/mean^2 = 2/edf."""
    white = Recording.from_rate(
        np.random.default_rng(3).standard_normal(400_000), rate=1.0, unit="V", names="x"
    )
    found = welch(white, "x", 8192, window=window_of(name), overlap=overlap)
    apart = found.density[found.first : found.last : 6]
    measured = 2 * apart.mean() ** 2 / apart.var()
    assert measured == pytest.approx(found.edf, rel=4 * math.sqrt(2 / len(apart)))
    plain = 2 * found.segments
    assert found.edf < plain if overlap > 0.5 else found.edf == pytest.approx(plain / (1 + 2 / 36), rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("term", [TERMS[0], TERMS[2], TERMS[3], TERMS[5]], ids=lambda t: t.type)
@pytest.mark.parametrize("method", ["log", "welch"])
def test_intervals_cover_the_density_down_to_the_lowest_bins(term: TermType, method: Any) -> None:
    runs, n = 30, 6000
    model = NoiseModel.of(term)
    hits = []
    for seed in range(runs):
        spectrum = power_spectrum(simulated(model, n, seed), "x", method=method)
        truth = sampled_psd(model, spectrum.frequency, DT)
        hits.append((spectrum.lower < truth) & (truth < spectrum.upper))
    covered = np.array(hits)
    lowest = covered[:, ::2][:, :4]  # neighbours share what they see: every other one
    assert within(float(lowest.mean()), lowest.size)
    assert within(float(covered[:, ::3].mean()), covered[:, ::3].size)


def test_bins_that_the_window_bends_are_left_out() -> None:
    """Where many segments know the density well, a random walk is shown only from where the window shows it right."""
    walk = NoiseModel.of(RandomWalk(K=0.3))
    few = power_spectrum(simulated(walk, 4000), "x", method="welch", segment=4.0)
    many = power_spectrum(simulated(walk, 200_000), "x", method="welch", segment=4.0)
    assert few.bins[0, 0] < many.bins[0, 0]
    moved = many.expected(walk) / sampled_psd(walk, many.frequency, DT) - 1
    assert np.all(np.abs(moved) < 0.31 * np.sqrt(2 / many.edf))
    assert moved[0] > 0.2 * math.sqrt(2 / many.edf[0])


@pytest.mark.parametrize("method", ["log", "welch"])
def test_b15_gaps_cost_segments_and_leave_the_density_alone(method: Any) -> None:
    y = simulated(NoiseModel.of(White(N=0.1)), 100_000).values("x").copy()
    y[30_000:45_000] = np.nan
    y[np.random.default_rng(1).integers(0, len(y), 400)] = np.nan
    y[0] = np.nan
    spectrum = power_spectrum(Recording.from_rate(y, rate=RATE, unit="rad/s", names="x"), "x", method=method)
    assert spectrum.skipped > 0
    score = (spectrum.density / 0.01 - 1) / np.sqrt(2 / spectrum.edf)
    assert abs(float(score.mean())) < 4 * math.sqrt(2 / len(score))
    assert np.mean(np.abs(score) < 2.5) > 0.95


@pytest.mark.parametrize(
    ("choices", "said"),
    [
        ({"method": "bartlett"}, "'log' or 'welch'"),
        ({"method": "log", "segment": 1.0}, "choices of method 'welch'"),
        ({"method": "welch", "overlap": 0.95}, "0 to 0.9"),
        ({"method": "welch", "segment": 900.0}, "from 0.16 to 25 s"),
        ({"method": "welch", "window": "boxcar"}, "no window 'boxcar'"),
        ({"confidence": 95.0}, "between 0 and 1"),
        ({"confidence": None}, "between 0 and 1"),
        ({"method": "welch", "segment": math.nan}, "segment must be a length in seconds"),
        ({"method": "welch", "segment": math.inf}, "segment must be a length in seconds"),
        ({"method": "welch", "segment": "1"}, "segment must be a length in seconds"),
        ({"method": "welch", "overlap": "half"}, "0 to 0.9"),
        ({"least": 4.5}, "whole number of segments, 4 at least"),
        ({"least": 3}, "whole number of segments, 4 at least"),
        ({"least": math.nan}, "whole number of segments, 4 at least"),
    ],
)
def test_wrong_choices_are_refused(choices: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        power_spectrum(simulated(COLOURED, 10_000), "x", **choices)


def test_spectrum_and_model_survive_json() -> None:
    spectrum = power_spectrum(
        simulated(COLOURED, 20_000), "x", method="welch", window="blackman", overlap=0.6
    )
    again = Spectrum.from_json(json.loads(json.dumps(spectrum.to_json())))
    assert again.to_json() == spectrum.to_json()
    np.testing.assert_array_equal(again.expected(COLOURED), spectrum.expected(COLOURED))
    old = {k: v for k, v in spectrum.to_json().items() if k not in ("bins", "resolution", "window")}
    plain = Spectrum.from_json(old).expected(COLOURED)  # as documents were before
    np.testing.assert_allclose(plain, sampled_psd(COLOURED, spectrum.frequency, DT))


def test_m4_expected_spectrum_of_every_term_is_what_is_measured() -> None:
    for i, term in enumerate(TERMS):
        model = NoiseModel.of(term)
        spectrum = power_spectrum(simulated(model, 60_000, seed=i), "x")
        score = (spectrum.density / spectrum.expected(model) - 1) * np.sqrt(spectrum.edf / 2)
        assert abs(float(score[::2].mean())) < 4 / math.sqrt(len(score[::2])), term


# -- lines ------------------------------------------------------------------------------------------------

LINE = Sinusoid(amplitude=0.05, frequency=3.3217, phase=1.0)


def test_c7_a_sinusoid_is_a_steady_line_with_calibrated_intervals() -> None:
    runs, hits, steady = 16, [], 0
    for seed in range(runs):
        spectrum = power_spectrum(simulated(COLOURED + LINE, 100_000, seed), "x")
        lines = [line for line in spectrum.lines if abs(line.frequency - 3.3217) < 0.02]
        steady += sum(line.stable for line in lines)
        for line, found in zip([each for each in lines if each.stable], sinusoids(spectrum), strict=True):
            seen = 0.05 * float(np.sinc(LINE.frequency * DT))
            hits.append(line.amplitude_lower < seen < line.amplitude_upper)
            hits.append(line.frequency_lower < LINE.frequency < line.frequency_upper)
            assert found.amplitude == pytest.approx(0.05, rel=0.5)
            assert abs(found.phase - 1.0) < 1.2
    assert steady >= runs - 3  # one in a hundred is refused
    assert within(float(np.mean(hits)), len(hits))


def test_a_steady_line_is_taken_out_without_a_trace() -> None:
    record = simulated(COLOURED + LINE, 200_000)
    spectrum = power_spectrum(record, "x")
    clean = without_stable_lines(record, spectrum)
    assert power_spectrum(clean, "x").lines == ()
    pure = simulated(COLOURED, 200_000).values("x")
    left = clean.values("x") - pure  # the same noise: the seed is the same
    assert np.sqrt(np.mean(left**2)) < 0.12 * 0.05
    np.testing.assert_array_equal(clean.raw("x", 1000, 1500), clean.raw("x")[1000:1500])


def test_m1_a_line_in_angles_is_taken_out_of_the_rates() -> None:
    rates = simulated(COLOURED + LINE, 100_000).values("x")
    record = Recording.from_angle(np.cumsum(rates) * DT, rate=RATE, unit="rad", names="x")
    spectrum = power_spectrum(record, "x")
    assert [line.stable for line in spectrum.lines] == [True]
    assert power_spectrum(without_stable_lines(record, spectrum), "x").lines == ()


def test_the_sign_of_a_scale_factor_turns_the_phase_of_a_line() -> None:
    """The same sine, in SI, behind a sensor of either sign: amplitude, phase and what is left are the same."""
    rates = np.degrees(simulated(NoiseModel.of(White(N=0.02)) + LINE, 40_000).values("x"))
    found = []
    for sign in (1, -1):
        record = Recording.from_rate(
            sign * 0.024 * rates, rate=RATE, unit="V", names="x", scale_factor=f"{sign * 24.0} mV/(deg/s)"
        )
        spectrum = power_spectrum(record, "x")
        (line,) = sinusoids(spectrum)
        found.append((line, without_stable_lines(record, spectrum).values("x")))
        (drawn,) = (each for each in spectrum.lines if each.stable)
        sd = (drawn.amplitude_upper - drawn.amplitude_lower) / 3.92 / drawn.amplitude
        assert (
            abs(line.phase - LINE.phase) < 4 * 2 * sd
        )  # its own sd, and that of the frequency at the first sample
        assert power_spectrum(without_stable_lines(record, spectrum), "x").lines == ()
    (plus, left), (minus, mirrored) = found
    assert minus.phase == pytest.approx(plus.phase, abs=1e-9)
    np.testing.assert_allclose(mirrored, -left, atol=1e-9)  # volts of the other sign


def test_a_wandering_line_is_said_to_be_no_sinusoid(rng: np.random.Generator) -> None:
    y = simulated(COLOURED, 200_000).values("x").copy()
    t = np.arange(len(y)) * DT
    y += 0.1 * np.sin(2 * np.pi * 7.1 * t + 0.004 * np.cumsum(rng.standard_normal(len(y))))
    record = Recording.from_rate(y, rate=RATE, unit="rad/s", names="x")
    spectrum = power_spectrum(record, "x")
    (line,) = [line for line in spectrum.lines if abs(line.frequency - 7.1) < 0.05]
    assert not line.stable and line.coherence < 0.01 and "no sinusoid" in line.note
    assert line.amplitude_lower < 0.1 < line.amplitude_upper
    assert sinusoids(spectrum) == ()
    assert without_stable_lines(record, spectrum).columns[0] is record.columns[0]


def test_lines_across_gaps() -> None:
    y = simulated(COLOURED + LINE, 200_000).values("x").copy()
    y[50_000:70_000] = np.nan
    record = Recording.from_rate(y, rate=RATE, unit="rad/s", names="x")
    spectrum = power_spectrum(record, "x")
    (line,) = spectrum.lines
    assert line.stable
    assert line.frequency == pytest.approx(LINE.frequency, abs=2e-4)
    assert np.isnan(without_stable_lines(record, spectrum).values("x")).sum() == 20_000


def test_hann_is_the_default() -> None:
    assert window_of("hann") is HANN


# -- missing samples --------------------------------------------------------------------------------------


@pytest.mark.parametrize("term", [TERMS[0], TERMS[3], TERMS[5]], ids=lambda t: t.type)
def test_b15_isolated_missing_samples_do_not_leak(term: TermType) -> None:
    """Two samples in a hundred missing: at weight zero a random walk would stand tens of times too high at the top."""
    model = NoiseModel.of(term)
    score = []
    for seed in range(12):
        y = simulated(model, 8000, seed).values("x").copy()
        y[np.random.default_rng(seed).random(len(y)) < 0.02] = np.nan
        spectrum = power_spectrum(Recording.from_rate(y, rate=RATE, unit="rad/s", names="x"), "x")
        truth = spectrum.expected(model)
        score.append(((spectrum.density / truth - 1) * np.sqrt(spectrum.edf / 2))[::3])
    mean = np.array(score).mean()
    assert abs(float(mean)) < 4 / math.sqrt(np.size(score))
    assert np.std(np.array(score)) < 1.25


def test_bridged_samples_and_their_variance_are_those_of_the_best_estimate(rng: np.random.Generator) -> None:
    walk = np.cumsum(rng.standard_normal(20_000))
    missing = np.arange(50, 19_950, 100)
    holed = walk.copy()
    holed[missing] = np.nan
    bridge = Bridge()
    filled = bridge(holed)
    error = filled[missing] - walk[missing]
    assert np.var(error) == pytest.approx(
        0.5, rel=4 * math.sqrt(2 / len(missing))
    )  # of the mean of both neighbours
    # holes far apart: their errors are their own, and what is put back is their variance
    put_back = bridge.lacking * len(walk) / len(missing)
    assert put_back == pytest.approx([0.5, *[0.0] * (len(put_back) - 1)], abs=0.025)
    holed[300:310] = np.nan  # longer runs stay missing
    assert np.isnan(Bridge()(holed)).sum() == 10


def slowness() -> Any:
    """White noise, and slow noise in which it drowns within a few, some hundred and all samples."""
    white = White(N=0.2)
    return pytest.mark.parametrize(
        "model",
        [
            pytest.param(NoiseModel.of(white, *slow), id=name)
            for name, slow in {
                "white": [],
                "Gauss-Markov": [GaussMarkov.from_sigma(1.0, 5.0)],
                "flicker": [Flicker(B=0.2)],
                "walk": [RandomWalk(K=0.004)],
                "all": [Flicker(B=0.02), RandomWalk(K=0.02)],
            }.items()
        ],
    )


@pytest.mark.long
@slowness()
def test_what_is_put_back_is_what_bridging_took(model: NoiseModel) -> None:
    """Random holes: by distance, and as an autocovariance would, against the samples that were missing."""
    n, parts, rng = 120_000, 40, np.random.default_rng(8)
    y = al.simulate(model, rate=1.0, duration=float(n), seed=3)
    y = y.values(y.names[0]).copy()
    y -= y.mean()
    missing = rng.random(n) < 0.3
    bridge = Bridge()
    filled = bridge(np.where(missing, np.nan, y))
    error = np.where(np.isfinite(filled), y - filled, 0.0)
    filled = y - error
    taken = np.array([error * filled + filled * error + error**2])  # of one distance a row
    for h in range(1, len(bridge.lacking)):
        a, b = slice(None, -h), slice(h, None)
        row = error[a] * filled[b] + filled[a] * error[b] + error[a] * error[b]
        taken = np.concatenate([taken, [np.append(row, np.zeros(h))]])
    # slow noise is in all distances alike, and in the density at zero frequency alone
    taken = taken[:-1] - taken[-1]
    put_back = bridge.lacking[:-1] - bridge.lacking[-1]
    sums = taken.reshape(len(taken), parts, -1).sum(axis=2) * parts / np.isfinite(filled).sum()
    spread = sums.std(axis=1, ddof=1) / math.sqrt(parts)
    assert np.all(np.abs(put_back - sums.mean(axis=1)) < student_t.isf(1e-5, parts - 1) * spread)
    assert put_back[0] > 20 * spread[0]
    account = bridge.account(1.0, n)
    f = np.linspace(0.0, 0.5, 33)
    h = np.arange(1, len(bridge.lacking))
    transform = bridge.lacking[0] + 2 * np.cos(2 * np.pi * np.outer(f, h)) @ bridge.lacking[1:]
    assert account.put_back(f) == pytest.approx(transform, rel=1e-9, abs=1e-12)
    assert 0 < account.white * account.share < account.put_back(f).max()


@pytest.mark.long
@slowness()
@pytest.mark.parametrize("share", [0.1, 0.4])
def test_density_with_random_holes_is_that_without(model: NoiseModel, share: float) -> None:
    """At all frequencies: what neighbours tell of a missing sample is known, and what they tell twice."""
    n, runs, ratios = 15_000, 12, []
    for i in range(runs):
        y = al.simulate(model, rate=1.0, duration=float(n), seed=40 + i)
        y = y.values(y.names[0]).copy()
        y[np.random.default_rng(i).random(n) < share] = np.nan
        found = power_spectrum(Recording.from_rate(y, rate=1.0, unit="rad/s", names="x"), "x")
        band = np.digitize(found.frequency, np.geomspace(0.02, 0.5, 9))
        weight, power = (
            np.bincount(band, w, 10)[1:9]
            for w in (found.edf, found.edf * found.density / found.expected(model))
        )
        ratios.append(np.divide(power, weight, out=np.full(8, np.nan), where=weight > 0))
    ratio = np.array(ratios)[
        :, np.isfinite(ratios).all(axis=0)
    ]  # long runs of missing samples leave no long segments
    mean, scatter = ratio.mean(axis=0), ratio.std(axis=0, ddof=1)
    assert np.all(np.abs(mean - 1) < student_t.isf(1e-5, runs - 1) * scatter / math.sqrt(runs))
    assert len(mean) >= 4
    assert scatter[-1] < 0.1


@pytest.mark.long
def test_an_autocovariance_that_is_none_is_made_one() -> None:
    """Every second sample is there, and one of five of the others: odd distances are known from few pairs."""
    rng, largest = np.random.default_rng(15), 0.0
    for _ in range(60):
        y = rng.standard_normal(1000)
        y[1::2][rng.random(500) < 0.9] = np.nan
        largest = max(largest, float(np.nanmax(np.abs(Bridge()(y)))))
    assert largest < 6.0  # of 60 000 standard normal numbers the largest is near 4.5; it was beyond a hundred
    broken = np.array([1.0, 0.9, -0.9, *[0.0] * 22])
    assert np.linalg.eigvalsh(toeplitz(broken))[0] < 0
    assert np.linalg.eigvalsh(toeplitz(_definite(broken)))[0] > 0
    sound = 0.9 ** np.arange(25)
    assert np.array_equal(_definite(sound), sound)


# -- what bridged samples cost ------------------------------------------------------------------------------


def holed(n: int, pattern: str, rng: np.random.Generator) -> np.ndarray:
    """White noise of variance one; three or four tenths of it are missing, at random places or never two in a row."""
    y = rng.standard_normal(n)
    if pattern == "random":
        y[rng.random(n) < 0.3] = np.nan
    else:
        y[1::2][rng.random(n // 2) < 0.8] = np.nan
    return y


@pytest.mark.long
@pytest.mark.parametrize("pattern", ["random", "single"])
def test_bridged_bins_share_an_error(pattern: str) -> None:
    """Over 250 records: the mean over all bins, and differences of bins, scatter as eq. (3) of `holes` says.

    The variance of 250 values is known to sqrt(2/250) = 9 %.
    """
    runs, n, length = 250, 2000, 64
    rng, densities, shared, dof, seen = np.random.default_rng(5), [], 0.0, 0.0, 0.0
    for _ in range(runs):
        record = Recording.from_rate(holed(n, pattern, rng), rate=1.0, unit="rad/s", names="x")
        found = welch(record, "x", length)
        bins = np.arange(4, length // 2 - 3)
        densities.append(found.density[bins])
        common = found.bridged.common(np.ones(len(bins)), (bins - 0.5) / length, (bins + 0.5) / length)
        shared = shared + common @ common.T / runs
        dof, seen = dof + found.edf / runs, seen + found.bridged.share / runs
    P, count = np.array(densities), len(densities[0])
    assert P.mean() == pytest.approx(1.0, abs=4 * math.sqrt(2 / (runs * n * (1 - seen))))
    # the common part alone is a lower bound, with the own part of every bin an upper one (bins are correlated)
    assert P.mean(axis=1).var() > 0.75 * shared.mean()
    assert P.mean(axis=1).var() < 1.3 * (shared.mean() + (1 - seen) * 2 / dof * 2 / count)
    assert P.var(axis=0).mean() < 1.1 * (np.trace(shared) / count + (1 - seen) * 2 / dof)
    # the lag of one sample stands out: it is what `errors` hold besides the level
    wave = np.cos(2 * np.pi * bins / length)
    wave -= wave.mean()
    assert (P @ wave).var() > 0.75 * wave @ shared @ wave
    assert (P @ wave).var() < 1.3 * (wave @ shared @ wave + (1 - seen) * 2 / dof * 2 * wave @ wave)


@pytest.mark.long
@pytest.mark.parametrize("method", ["log", "welch"])
def test_intervals_cover_where_samples_are_bridged(method: Any) -> None:
    """A fifth missing at random: 95 % of the intervals hold it.

    With a chi-square law of the whole density 98 % of the log-binned ones would.
    """
    rng, hits, total = np.random.default_rng(6), 0, 0
    for _ in range(80):
        y = rng.standard_normal(3000)
        y[rng.random(3000) < 0.2] = np.nan
        chosen = {"segment": 0.64} if method == "welch" else {}
        found = power_spectrum(
            Recording.from_rate(y, rate=RATE, unit="rad/s", names="x"), "x", method=method, **chosen
        )
        hits += int(np.sum((found.lower < DT) & (found.upper > DT)))
        total += len(found.frequency)
        assert 0.15 < found.bridged.share < 0.25
        assert np.all(found.lower > found.bridged.put_back(found.frequency))
    # bins share their level: as if a third of them were independent
    assert within(hits / total, total // 3)


def test_a_whole_record_has_nothing_bridged_and_json_keeps_what_is(rng: np.random.Generator) -> None:
    assert power_spectrum(simulated(COLOURED, 5000), "x").bridged.lacking == ()
    found = power_spectrum(
        Recording.from_rate(holed(3000, "single", rng), rate=RATE, unit="rad/s", names="x"), "x"
    )
    again = Spectrum.from_json(json.loads(json.dumps(found.to_json())))
    assert found.bridged.errors and again.bridged == found.bridged
    old = {key: value for key, value in found.to_json().items() if key != "bridged"}
    assert Spectrum.from_json(old).bridged.share == 0.0
