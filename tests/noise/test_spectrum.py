# SPDX-License-Identifier: BSD-3-Clause
"""Densities, lines and band limits against models whose spectra are known."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, lfilter
from scipy.special import ndtri
from scipy.stats import chi2

import allanite as al
from allanite.errors import InputError
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, Sinusoid, White
from allanite.noise.spectrum import lines
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.exclusion import lags_to_exclude, quiet_lags
from allanite.noise.spectrum.lines import _Law
from allanite.noise.spectrum.periodogram import Periodogram, _Decimator, _Welch, periodograms
from allanite.noise.spectrum.results import Spectrum
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.noise.spectrum.stability import without_stable_lines
from allanite.recording.records import Recording

RATE = 100.0
DT = 1 / RATE
TERMS = {
    "white": White(N=0.1),
    "quantisation": Quantisation(Q=1e-2, dt=DT),
    "flicker": Flicker(B=0.5),
    "random_walk": RandomWalk(K=0.3),
    "gauss_markov": GaussMarkov(q=1.0, T=0.05),
}
COLOURED = NoiseModel.of(White(N=0.1), Flicker(B=0.1), RandomWalk(K=0.02))


def simulated(model: NoiseModel, n: int, seed: int = 1, sampling: Any = "mean") -> Recording:
    return al.simulate(model, rate=RATE, duration=n * DT, seed=seed, sampling=sampling, name="x")


def recorded(samples: np.ndarray) -> Recording:
    return Recording.from_rate(samples, rate=RATE, unit="rad/s", names="x")


def scores(spectrum: Spectrum, model: NoiseModel) -> np.ndarray:
    expected = sampled_psd(model, spectrum.frequency, spectrum.dt, spectrum.sampling)
    return (spectrum.density / expected - 1) / np.sqrt(2 / spectrum.edf)


# -- density ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("records", [1e3, 1e6, 1e9, 1e12])
def test_a_term_that_outlasts_the_record_has_the_density_of_its_random_walk(records: float) -> None:
    """To the part 1/(2 pi f T)^2 that is left of its memory, at every frequency and however long its time is."""
    f = np.array([0.01, 0.1, 0.37, 0.5]) * RATE
    slow = sampled_psd(NoiseModel.of(GaussMarkov(q=1.0, T=records * DT)), f, DT, "mean")
    walk = sampled_psd(NoiseModel.of(RandomWalk(K=1.0)), f, DT, "mean")
    np.testing.assert_allclose(slow, walk, rtol=1e-12 + 1 / (2 * np.pi * 0.01 * records) ** 2)


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("key", TERMS)
def test_c12_sampled_density_integrates_to_the_allan_variance(key: str, sampling: Any) -> None:
    f = np.geomspace(1e-5, RATE / 2, 400_001)
    density = sampled_psd(NoiseModel.of(TERMS[key]), f, DT, sampling)
    for m in (1, 3, 40):
        shape = (np.sin(np.pi * f * m * DT) ** 2 / (m * np.sin(np.pi * f * DT))) ** 2
        integral = 4 * np.trapezoid(density * shape, f)
        assert integral == pytest.approx(float(TERMS[key].avar_sampled(m, DT, sampling)), rel=2e-4)


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("key", TERMS)
def test_density_of_each_term(key: str, sampling: Any) -> None:
    model = NoiseModel.of(TERMS[key])
    z = scores(power_spectrum(simulated(model, 300_000, sampling=sampling), "x"), model)
    assert len(z) > 80
    assert np.std(z) == pytest.approx(1, abs=4 * math.sqrt(1 / 2 / len(z)))
    assert np.abs(z).max() < 5


def test_c11_white_noise_stands_at_n_squared_two_sided() -> None:
    spectrum = power_spectrum(simulated(NoiseModel.of(White(N=0.1)), 400_000), "x")
    level = np.average(spectrum.density, weights=spectrum.edf)
    sd = math.sqrt(2 / spectrum.edf.sum())
    assert level == pytest.approx(0.01, rel=4 * sd)
    assert math.sqrt(2 * level) == pytest.approx(0.14142, rel=2 * sd)  # one-sided


def test_intervals_cover() -> None:
    model, inside, total = NoiseModel.of(White(N=0.1)), 0, 0
    for seed in range(40):
        s = power_spectrum(simulated(model, 4000, seed), "x")
        inside += int(np.sum((s.lower < 0.01) & (s.upper > 0.01)))
        total += len(s.frequency)
    assert inside / total == pytest.approx(
        0.95, abs=4 * 1.5 * math.sqrt(0.95 * 0.05 / total)
    )  # 1.5: neighbours


def test_angle_is_differenced_and_unit_scaled(rng: np.random.Generator) -> None:
    angle = Recording.from_angle(np.cumsum(rng.standard_normal(100_000)), rate=RATE, unit="deg", names="x")
    spectrum = power_spectrum(angle, "x")
    level = np.average(spectrum.density, weights=spectrum.edf)
    assert level == pytest.approx(math.radians(1) ** 2 * RATE, rel=4 * math.sqrt(2 / spectrum.edf.sum()))


def test_m1_offset_changes_nothing(rng: np.random.Generator) -> None:
    y = rng.standard_normal(30_000)
    plain, shifted = (power_spectrum(recorded(y + c), "x") for c in (0.0, 1e6))
    np.testing.assert_allclose(shifted.density, plain.density, rtol=1e-6)


def test_m10_streams_do_not_feel_the_blocks(rng: np.random.Generator) -> None:
    y = rng.standard_normal(10_000)
    y[1234] = np.nan
    for make in (lambda: _Welch(256), _Decimator):
        whole, parts = make(), make()
        outputs = [whole.feed(y)], [parts.feed(b) for b in np.split(y, [1, 700, 701, 5000])]
        if isinstance(whole, _Welch):
            np.testing.assert_allclose(parts.density(), whole.density(), rtol=1e-13)
            assert (parts.segments, parts.pairs) == (whole.segments, whole.pairs)
        else:
            np.testing.assert_allclose(*map(np.concatenate, outputs), atol=1e-14)


# -- missing samples --------------------------------------------------------------------------------------


def test_b1_first_sample_may_be_missing() -> None:
    model = NoiseModel.of(White(N=0.1))
    y = np.array(simulated(model, 100_000).values("x"))
    y[[0, 777]] = np.nan
    spectrum = power_spectrum(recorded(y), "x")
    assert np.abs(scores(spectrum, model)).max() < 5
    assert spectrum.skipped == 0


@pytest.mark.parametrize("share", [0.001, 0.01])
def test_scattered_gaps_leave_the_density_alone(share: float, rng: np.random.Generator) -> None:
    y = np.array(simulated(COLOURED, 300_000).values("x")) + 1e3
    y[rng.random(len(y)) < share] = np.nan
    z = scores(power_spectrum(recorded(y), "x"), COLOURED)
    assert np.std(z) == pytest.approx(1, abs=4 * math.sqrt(1 / 2 / len(z)))


def test_b15_a_hole_costs_segments_and_bridges_nothing() -> None:
    y = np.array(simulated(COLOURED, 200_000).values("x"))
    y[60_000:100_000] = np.nan
    spectrum = power_spectrum(recorded(y), "x")
    z = scores(spectrum, COLOURED)
    assert spectrum.skipped > 0
    assert np.std(z) == pytest.approx(1, abs=4 * math.sqrt(1 / 2 / len(z)))


def test_short_or_empty_records_give_an_empty_spectrum() -> None:
    for y in (np.ones(10), np.full(5000, np.nan)):
        spectrum = power_spectrum(recorded(y), "x")
        assert len(spectrum.frequency) == 0
        assert not lags_to_exclude(spectrum, [DT]).excluded.any()
        assert "empty" in repr(spectrum)


def test_b4_constant_samples_have_no_density_and_no_lines() -> None:
    spectrum = power_spectrum(recorded(np.full(50_000, 0.1)), "x")
    assert np.all(spectrum.density < 1e-30)
    assert (spectrum.lines, spectrum.corner) == ((), None)


def test_unknown_channel() -> None:
    with pytest.raises(InputError, match="no channel"):
        power_spectrum(recorded(np.ones(100)), "y")


# -- lines ------------------------------------------------------------------------------------------------


def averaged(segments: int, merged: int, rng: np.random.Generator) -> np.ndarray:
    """Bins of many averaged Hann periodograms of white noise, over their mean."""
    found = []
    for _ in range(1500):
        welch = _Welch(128)
        welch.feed(rng.standard_normal(64 * (segments + 1)))
        found.append(welch.density()[8:56].reshape(-1, merged).mean(axis=1))
    return np.concatenate(found)


@pytest.mark.parametrize(("segments", "merged"), [(7, 1), (30, 1), (7, 8)])
def test_tail_of_the_averaged_periodogram(segments: int, merged: int, rng: np.random.Generator) -> None:
    stream = Periodogram(
        frequency=np.zeros(2), density=np.zeros(2), first=0, last=0, segment=128,
        segments=segments, pairs=segments - 1, skipped=0, merged=merged,
    )  # fmt: skip
    law, bins = _Law(stream), averaged(segments, merged, rng)
    p = 3e-3
    count = np.sum(bins > law.quantile(math.log(p)))
    assert count == pytest.approx(p * len(bins), abs=4 * math.sqrt(2 * p * len(bins)))  # 2: neighbours
    assert law.log_tail(law.quantile(math.log(p))) == pytest.approx(math.log(p), abs=1e-6)
    assert np.std(bins) == pytest.approx(law.deviation, rel=0.03)


@pytest.mark.long
@pytest.mark.parametrize("below", [0, 1])
@pytest.mark.parametrize("segments", [7, 30])
def test_tail_at_half_the_sample_rate(segments: int, below: int, rng: np.random.Generator) -> None:
    runs, p = 6000, 0.01
    bins = np.empty(runs)
    for i in range(runs):
        welch = _Welch(64)
        welch.feed(rng.standard_normal(32 * (segments + 1)))
        bins[i] = welch.density()[-1 - below]
    stream = Periodogram(
        frequency=np.zeros(2), density=np.zeros(2), first=0, last=0, segment=64,
        segments=segments, pairs=segments - 1, skipped=0,
    )  # fmt: skip
    law = _Law(stream, below)
    assert np.mean(bins) == pytest.approx(1.0, abs=4 * law.deviation / math.sqrt(runs))
    assert np.std(bins) == pytest.approx(law.deviation, rel=0.05)
    count = np.sum(bins > law.quantile(math.log(p)))
    assert 0.7 * p * runs - 4 * math.sqrt(p * runs) < count < p * runs + 4 * math.sqrt(p * runs)


@pytest.mark.long
def test_false_alarms_are_rarer_than_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "FALSE_ALARM", 0.1)
    models = [NoiseModel.of(term) for term in TERMS.values()] + [COLOURED]
    runs = [power_spectrum(simulated(models[i % 6], 4000, seed=i), "x") for i in range(300)]
    assert sum(bool(s.lines) for s in runs) <= 30
    assert all(s.corner is None for s in runs)


@pytest.mark.parametrize("apart", [3.2, 4.6, 7.9])
def test_a_line_is_found_up_to_three_resolutions_from_the_nyquist_frequency(apart: float) -> None:
    """One that is not found there bends the curve as quantization does."""
    t, white = np.arange(7200), np.random.default_rng(17).standard_normal((10, 7200))
    step = float(power_spectrum(recorded(white[0]), "x").resolution[-1])
    f = 0.5 / DT - apart * step
    for noise in white:
        (line,) = power_spectrum(recorded(noise + 0.3 * np.sin(2 * np.pi * f * DT * t + 1)), "x").lines
        assert line.frequency == pytest.approx(f, abs=step)


@pytest.mark.parametrize("cycles", [0.0, 0.03, 0.3, 0.6, 1.5, 4.0, 20.0])
def test_a_line_beside_its_image_is_removed(cycles: float, rng: np.random.Generator) -> None:
    """So many cycles from half the sample rate in the record: what is left has the power of the noise there."""
    n = 12_000
    k = np.arange(n)
    for phase in (0.5, 1.6, 2.8, -1.0):
        noise = rng.standard_normal(n)
        record = recorded(noise + 0.5 * np.sin(2 * np.pi * (0.5 - cycles / n) * k + phase))
        spectrum = power_spectrum(record, "x")
        (line,) = spectrum.lines
        assert line.frequency_lower <= (0.5 - cycles / n) / DT * (1 + 1e-12)
        assert line.frequency_upper == pytest.approx(min(line.frequency_upper, 0.5 / DT))
        assert ("confounded" in line.note) == (cycles < 1) or not line.stable
        if not line.stable:  # once in a hundred
            assert line.coherence < 0.01
            continue
        rest = np.concatenate([x for _, x in without_stable_lines(record, spectrum).blocks("x")])
        beat = (np.where(k % 2, -1.0, 1.0) * (rest - rest.mean())).reshape(16, -1).sum(axis=1)
        assert np.sum(beat**2) / (n / 16) < chi2.isf(1e-4, 16)
        assert power_spectrum(recorded(rest), "x").lines == ()


@pytest.mark.parametrize("scale", [1.0, -1.0])
def test_an_alternation_of_either_sign_and_with_gaps_is_removed(
    scale: float, rng: np.random.Generator
) -> None:
    n = 12_000
    x = rng.standard_normal(n) + 5.0 + 0.4 * (-1.0) ** np.arange(n)
    x[rng.random(n) < 0.01] = np.nan
    record = recorded(scale * x)
    spectrum = power_spectrum(record, "x")
    (line,) = spectrum.lines
    assert line.stable and line.frequency == 0.5 / DT
    assert abs(line.amplitude - 0.4) < 5 / np.sqrt(n)
    rest = np.concatenate([x for _, x in without_stable_lines(record, spectrum).blocks("x")])
    assert abs(np.nanmean(rest * (-1.0) ** np.arange(n))) < 0.01


def test_line_in_coloured_noise() -> None:
    model = COLOURED + Sinusoid(amplitude=0.05, frequency=3.3217, phase=1.0)
    spectrum = power_spectrum(simulated(model, 400_000, sampling="point"), "x")
    (line,) = spectrum.lines
    assert line.frequency == pytest.approx(3.3217, abs=line.width / 2)
    assert line.amplitude == pytest.approx(0.05, rel=0.1)
    assert line.significance > 10
    clean = (spectrum.background / sampled_psd(COLOURED, spectrum.frequency, DT) - 1) / np.sqrt(
        2 / spectrum.edf
    )
    assert np.abs(clean).max() < 5
    assert spectrum.density.max() > spectrum.background.max() or np.any(
        spectrum.density > 1.2 * spectrum.background
    )


def test_line_below_the_decimated_rates() -> None:
    model = NoiseModel.of(White(N=0.1), Sinusoid(amplitude=0.3, frequency=0.0411))
    (line,) = power_spectrum(simulated(model, 400_000), "x").lines
    assert line.frequency == pytest.approx(0.0411, abs=line.width / 2)


def test_c7_a_sine_is_a_line_and_not_flicker() -> None:
    record = al.simulate(
        NoiseModel.of(Sinusoid(amplitude=1.0, frequency=0.05)),
        rate=1.0,
        duration=2_000_000,
        seed=1,
        sampling="point",
        name="x",
    )
    spectrum = power_spectrum(record, "x")
    (line,) = spectrum.lines
    assert line.frequency == pytest.approx(0.05, rel=1e-5)
    assert line.amplitude == pytest.approx(1.0, rel=1e-3)
    assert lags_to_exclude(spectrum, [1.0, 10.0, 100.0]).excluded.all()


def test_harmonics_are_found_with_their_line() -> None:
    parts = [Sinusoid(amplitude=a, frequency=k * 5.37109375) for k, a in ((1, 0.2), (3, 0.0215))]
    noise = NoiseModel.of(White(N=0.1))
    with_line = power_spectrum(simulated(noise + parts[0] + parts[1], 300_000, seed=2), "x").lines
    alone = power_spectrum(simulated(noise + parts[1], 300_000, seed=2), "x").lines
    assert [round(line.frequency / 5.37) for line in with_line] == [1, 3]
    assert alone == ()  # too weak where every bin is tested


def narrow_band(n: int, frequency: float, width: float, rng: np.random.Generator) -> np.ndarray:
    """Noise in a band, by a resonant filter that lets nothing through at 0 and at the Nyquist frequency."""
    radius = math.exp(-math.pi * width * DT)
    taps = [1, -2 * radius * math.cos(2 * math.pi * frequency * DT), radius**2]
    y = lfilter([1.0, 0.0, -1.0], taps, rng.standard_normal(n))
    return np.asarray(y / y.std())


def test_drifting_line_is_a_line_and_broad_hump_is_not(rng: np.random.Generator) -> None:
    n = 400_000
    white = rng.standard_normal(n)
    drifting = power_spectrum(recorded(white + 0.5 * narrow_band(n, 11.0, 0.012, rng)), "x").lines
    assert [round(line.frequency, 1) for line in drifting] == [11.0]
    for width in (0.4, 2.0):
        assert power_spectrum(recorded(white + 2 * narrow_band(n, 20.0, width, rng)), "x").lines == ()


# -- band limit -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("order", "share"), [(1, 0.3), (2, 0.5), (2, 0.9), (4, 0.15)])
def test_low_pass_is_recognised_with_its_corner(order: int, share: float, rng: np.random.Generator) -> None:
    n = 400_000
    filtered = lfilter(*butter(order, share), rng.standard_normal(n)) / math.sqrt(DT) * 0.1
    spectrum = power_spectrum(recorded(filtered), "x")
    assert spectrum.corner == pytest.approx(share * RATE / 2, rel=0.05)
    assert spectrum.band_limit is not None
    assert spectrum.band_limit.plateau == pytest.approx(0.01, rel=0.06)
    assert spectrum.lines == ()


def moving_average(white: np.ndarray, size: int) -> np.ndarray:
    return np.asarray(np.convolve(white, np.full(size, 1 / size), mode="valid"))


LOW_PASSES: dict[str, tuple[float, Callable[[np.ndarray], np.ndarray]]] = {
    "mean of 8": (0.443 / 8, lambda w: moving_average(w, 8)),  # sinc^2 is a half where its argument is 0.443
    "mean of 20": (0.443 / 20, lambda w: moving_average(w, 20)),
    "Butterworth 2, 3 Hz": (0.03, lambda w: np.asarray(lfilter(*butter(2, 0.06), w))),
    "Butterworth 2, 0.5 Hz": (0.005, lambda w: np.asarray(lfilter(*butter(2, 0.01), w))),
}


@pytest.mark.parametrize("seconds", [400, 1800])
@pytest.mark.parametrize("key", LOW_PASSES)
def test_low_corner_is_recognised_and_leaves_the_white_noise(
    key: str, seconds: int, rng: np.random.Generator
) -> None:
    corner, low_pass = LOW_PASSES[key]
    record = recorded(0.1 / math.sqrt(DT) * low_pass(rng.standard_normal(seconds * int(RATE))))
    spectrum = power_spectrum(record, "x")
    # The plateau is known to 2/sqrt(edf), and the density falls with the square of the frequency or faster.
    assert spectrum.corner == pytest.approx(corner * RATE, rel=0.3 if seconds * corner < 5 else 0.15)
    curve = al.allan_curve(record)
    bent = lags_to_exclude(spectrum, curve.tau, avar=curve.variance[:, 0], edf=curve.edf[:, 0])
    white = al.fit(curve, exclude=bent.excluded).estimate("N")
    assert bent.excluded[0]
    assert white is not None
    assert white.lower < 0.1 < white.upper


def test_quantised_output_of_a_low_pass_is_recognised(rng: np.random.Generator) -> None:
    """The floor that the converter adds ends the fall long before the Nyquist frequency."""
    y = np.round(3 * lfilter(*butter(2, 0.06), rng.standard_normal(200_000)))
    assert power_spectrum(recorded(y), "x").corner == pytest.approx(3.0, rel=0.15)


def test_kept_lags_are_free_of_the_filter(rng: np.random.Generator) -> None:
    """Mean of two samples: the Allan variance is N^2/tau (1 - 3/(4 m)) for m > 1, exactly."""
    n = 500_000
    y = np.convolve(rng.standard_normal(n + 1), [0.5, 0.5], mode="valid")
    spectrum = power_spectrum(recorded(y), "x")
    m = 2 ** np.arange(16)
    excluded = lags_to_exclude(spectrum, m * DT).excluded
    sd = np.sqrt(2 * m / (1.2 * n))
    bent = 3 / (4 * m)
    assert excluded[bent > sd].all()
    assert not excluded[bent < 0.1 * sd].any()
    assert spectrum.shortest_trusted_tau == pytest.approx(
        DT * (3 / 4 / 0.3 * math.sqrt(1.2 * n / 2)) ** (2 / 3), rel=0.3
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "model",
    [
        NoiseModel.of(White(N=1.0)),
        NoiseModel.of(White(N=1.0), Flicker(B=2.0)),
        NoiseModel.of(White(N=0.2), Quantisation(Q=0.1, dt=DT)),
        NoiseModel.of(Flicker(B=1.0)),
        NoiseModel.of(RandomWalk(K=1.0)),
        NoiseModel.of(White(N=1.0), RandomWalk(K=1.0)),
        NoiseModel.of(White(N=0.1), GaussMarkov.from_sigma(1.0, 0.3)),
        NoiseModel.of(White(N=0.1), GaussMarkov.from_sigma(0.3, 0.1)),
        NoiseModel.of(GaussMarkov.from_sigma(1.0, 1.0)),
        NoiseModel.of(GaussMarkov.from_sigma(1.0, 0.16)),
        NoiseModel.of(White(N=0.02), GaussMarkov.from_sigma(1.0, 0.16)),
        NoiseModel.of(White(N=0.02), GaussMarkov.from_sigma(1.0, 0.6), Flicker(B=0.2)),
        NoiseModel.of(Quantisation(Q=1e-4, dt=DT), GaussMarkov.from_sigma(1.0, 0.3)),
    ],
    ids=str,
)
@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_no_noise_term_is_taken_for_a_filter(model: NoiseModel, sampling: Any) -> None:
    spectrum = power_spectrum(simulated(model, 500_000, sampling=sampling), "x")
    assert spectrum.corner is None
    assert spectrum.shortest_trusted_tau == 0.0
    assert not lags_to_exclude(spectrum, DT * 2 ** np.arange(10)).excluded.any()


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("key", TERMS)
def test_no_term_falls_faster_than_the_means_of_a_random_walk(key: str, sampling: Any) -> None:
    """What the search for low corners rests on; flicker, a sum of Gauss-Markov terms, to the ripple of the sum."""
    f = np.geomspace(1e-3, RATE / 2, 2000)
    walk = sampled_psd(NoiseModel.of(RandomWalk(K=1.0)), f, DT, "mean")
    ratio = np.log(sampled_psd(NoiseModel.of(TERMS[key]), f, DT, sampling) / walk)
    assert np.all(ratio > np.maximum.accumulate(ratio) - 0.01)


def test_hump_on_white_noise_is_no_filter(rng: np.random.Generator) -> None:
    n = 300_000
    for frequency in (1.0, 5.0, 15.0):
        y = rng.standard_normal(n) + narrow_band(n, frequency, 2.0, rng)
        assert power_spectrum(recorded(y), "x").corner is None


# -- lags -------------------------------------------------------------------------------------------------


def lined(amplitude: float = 0.05) -> Spectrum:
    model = NoiseModel.of(White(N=0.1), Sinusoid(amplitude=amplitude, frequency=0.7))
    return power_spectrum(simulated(model, 400_000), "x")


def test_lags_bent_by_a_line() -> None:
    spectrum, m = lined(), 2 ** np.arange(17)
    bent = lags_to_exclude(spectrum, m * DT)
    added = Sinusoid(amplitude=0.05, frequency=0.7).avar(m * DT)
    sd = 0.01 / (m * DT) * np.sqrt(2 * m / (1.2 * 400_000))
    assert bent.excluded[added > sd].all()
    assert not bent.excluded[0]
    assert not bent.excluded[-3:].any()
    assert all(("line at 0.7" in r) == e for r, e in zip(bent.reasons, bent.excluded, strict=True))
    loose = lags_to_exclude(spectrum, m * DT, avar=np.ones(len(m)), edf=np.full(len(m), 100.0))
    assert not loose.excluded.any()


def test_quiet_lags_lie_on_whole_periods() -> None:
    spectrum, octave = lined(0.5), 2 ** np.arange(17)
    quiet = quiet_lags(spectrum, octave)
    kept = ~lags_to_exclude(spectrum, quiet * DT).excluded
    assert kept.sum() > (~lags_to_exclude(spectrum, octave * DT).excluded).sum()
    assert np.all(np.diff(quiet) > 0)
    np.testing.assert_array_equal(
        quiet_lags(power_spectrum(simulated(COLOURED, 10_000), "x"), octave[:10]), octave[:10]
    )


def test_json_round_trip() -> None:
    spectrum = lined()
    data = json.loads(json.dumps(spectrum.to_json()))
    again = Spectrum.from_json(data)
    assert again.to_json() == spectrum.to_json()
    assert again.lines == spectrum.lines
    np.testing.assert_array_equal(
        lags_to_exclude(again, [0.7]).excluded, lags_to_exclude(spectrum, [0.7]).excluded
    )
    with pytest.raises(ValueError, match="read-only"):
        spectrum.density[0] = 0


def test_progress_ends_at_one() -> None:
    seen: list[float] = []
    power_spectrum(simulated(COLOURED, 600_000), "x", progress=seen.append)
    assert (seen == sorted(seen), seen[-1]) == (True, 1.0)


def test_streams_share_the_frequencies() -> None:
    streams = periodograms(simulated(COLOURED, 1_000_000), "x")
    edges = [(p.frequency[p.first], p.frequency[p.last - 1]) for p in streams[::-1]]
    assert len(streams) == 3
    for (_, end), (start, _) in pairwise(edges):
        assert 0 < start - end < 1.5 * streams[0].resolution
    assert edges[-1][1] == RATE / 2


# -- real recordings --------------------------------------------------------------------------------------


def test_adis16405_lines_hump_and_filter(real_data: Callable[[str], Path]) -> None:
    with np.load(real_data("adis16405_calgary/adis_16405_imu4.npz")) as file:
        data, names = file["data"], [str(c) for c in file["columns"]]
    found = {}
    for i, name in enumerate(names):
        record = Recording.from_rate(data[:, i], rate=100.0, unit="deg/s" if i < 3 else "g", names="x")
        found[name] = power_spectrum(record, "x")
    for axis in ("ax", "ay", "az"):
        frequencies = [line.frequency for line in found[axis].lines]
        for expected in (0.536, 1.606):
            assert min(abs(f - expected) for f in frequencies) < 2e-3, (axis, frequencies)
    assert not any(19 < line.frequency < 21 for line in found["gz"].lines)
    assert all(30 < (s.corner or 0) < 50 for s in found.values())


def test_two_sided_quantile_of_edf_is_gaussian_for_many_degrees() -> None:
    spectrum = power_spectrum(simulated(NoiseModel.of(White(N=0.1)), 400_000), "x")
    last = -1
    ratio = math.log(spectrum.upper[last] / spectrum.lower[last])
    assert ratio == pytest.approx(2 * ndtri(0.975) * math.sqrt(2 / spectrum.edf[last]), rel=0.01)
