# SPDX-License-Identifier: BSD-3-Clause
"""Each fault is found, and said with its place, its count and its severity. Ids are those of the test battery."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from allanite.errors import DataQualityError
from allanite.recording.health.examination import check, prepare
from allanite.recording.health.finding import Finding, Severity
from allanite.recording.health.survey import survey
from allanite.recording.records import ArrayColumn, Channel, Recording
from noise_records import flicker, record, walk, white

N = 50_000
BIAS = 20.0
HARMLESS = {"resolution_step", "counts"}


def found(samples: np.ndarray, *, unit: str = "m/s^2") -> dict[str, Finding]:
    """Findings by code; the harmless ones are dropped."""
    return by_code(check(record(samples, unit=unit)))


def by_code(findings: Sequence[Finding]) -> dict[str, Finding]:
    named = {f.code: f for f in findings if f.code not in HARMLESS}
    assert len(named) == len([f for f in findings if f.code not in HARMLESS]), "one finding per code expected"
    return named


def only(samples: np.ndarray, code: str, *, unit: str = "m/s^2") -> Finding:
    """The one finding, which must be the only one."""
    named = found(samples, unit=unit)
    assert list(named) == [code], [str(f) for f in named.values()]
    return named[code]


@pytest.fixture
def noise(rng: np.random.Generator) -> np.ndarray:
    """White noise of sd 1 at a level of 20."""
    return white(rng, N) + BIAS


# -- missing samples --------------------------------------------------------------------------------------


def test_b1_one_nan_is_a_gap_of_one(rng: np.random.Generator) -> None:
    samples = white(rng, 20_000) + BIAS
    samples[777] = np.nan
    gap = only(samples, "missing")
    assert (gap.severity, gap.count, gap.places) == (Severity.INFO, 1, ((777, 778),))
    assert "1 of 20000 samples missing" in gap.message
    prepared, _ = prepare(record(samples), [gap])
    assert np.flatnonzero(np.isnan(prepared.values("signal"))).tolist() == [777]


@pytest.mark.parametrize("n", [0, 1, 2, 31])
def test_b3_too_few_samples_names_the_number_and_the_minimum(n: int) -> None:
    recording = record(np.arange(n, dtype=float).reshape(-1, 1) if n else np.zeros((1, 1)))
    recording = recording if n else replace_columns(recording, np.zeros(0))
    with pytest.raises(DataQualityError, match=f"(?s){n} .*at least 32"):
        prepare(recording, check(recording))


def replace_columns(recording: Recording, samples: np.ndarray) -> Recording:
    return replace(recording, columns=(ArrayColumn(samples),))


def test_b3_all_nan_is_refused() -> None:
    recording = record(np.full(1000, np.nan))
    with pytest.raises(DataQualityError, match=r"all 1000 samples are missing \(at least 32"):
        prepare(recording, check(recording))


def test_b15_a_hole_of_40_000_samples(rng: np.random.Generator) -> None:
    samples = white(rng, 200_000) + walk(rng, 200_000, 0.01)
    samples[70_000:110_000] = np.nan
    gap = only(samples, "missing")
    assert (gap.severity, gap.count, gap.places) == (Severity.WARNING, 40_000, ((70_000, 110_000),))
    assert "the longest unbroken stretch is 900 s" in gap.message


def test_class_3_values_in_every_fourth_row_only(noise: np.ndarray) -> None:
    samples = np.full(N, np.nan)
    samples[2::4] = noise[2::4]
    finding = only(samples, "broken_up")
    assert finding.severity is Severity.FATAL
    assert "there is a value every 4 rows" in finding.message
    assert "25 Hz" in finding.advice


def test_class_3_every_fourth_cell_empty(noise: np.ndarray) -> None:
    noise[3::4] = np.nan
    finding = only(noise, "broken_up")
    assert "longest unbroken stretch is 3 samples" in finding.message


# -- overload, saturation, clipping -----------------------------------------------------------------------


@pytest.mark.parametrize("word", [np.inf, -np.inf, 9.9e37, -9.9e37, 9.91e37, 1e38, -1e38])
def test_b2_overload_words_are_never_numbers(noise: np.ndarray, word: float) -> None:
    noise[[5, 600, 601]] = word
    finding = only(noise, "overload")
    assert (finding.severity, finding.count) == (Severity.WARNING, 3)
    assert finding.places == ((5, 6), (600, 602))
    assert finding.excludes
    prepared, _ = prepare(record(noise), [finding])
    assert np.flatnonzero(np.isnan(prepared.values("signal"))).tolist() == [5, 600, 601]


def test_b2_overload_above_a_thousandth_is_refused(noise: np.ndarray) -> None:
    noise[::900] = 9.9e37
    recording = record(noise)
    with pytest.raises(DataQualityError, match="56 overload words"):
        prepare(recording, check(recording))


@pytest.mark.parametrize(
    ("dtype", "code"), [(np.int16, 32767), (np.int16, -32768), (np.uint16, 65535), (np.int32, 2147483647)]
)
def test_b2_repeated_codes_at_the_end_of_the_word(rng: np.random.Generator, dtype: Any, code: int) -> None:
    samples = np.round(30.0 * white(rng, N) + 900.0).astype(dtype)
    samples[4000:4010] = code
    named = found(samples, unit="LSB")
    assert named["saturated"].severity is Severity.WARNING
    assert (named["saturated"].count, named["saturated"].places) == (10, ((4000, 4010),))
    assert "clipping" not in named
    assert "spikes" not in named
    prepared, _ = prepare(record(samples, unit="LSB"), list(named.values()))
    assert np.isnan(prepared.values("signal")[4000:4010]).all()


def test_b2_saturation_above_a_thousandth_is_refused(rng: np.random.Generator) -> None:
    samples = np.round(30.0 * white(rng, N) + 900.0)  # as text gives them: float64
    samples[1000:1100] = 32767.0
    assert found(samples, unit="LSB")["saturated"].severity is Severity.FATAL


def test_a_level_near_half_range_is_not_saturated(rng: np.random.Generator) -> None:
    samples = np.round(26.0 * white(rng, N) + 32767.0).astype(np.uint16)
    assert found(samples, unit="LSB") == {}


@pytest.mark.parametrize("limit", [1.0, 3.0])
def test_b6_clipped_within_three_sigma_is_refused(rng: np.random.Generator, limit: float) -> None:
    samples = np.clip(white(rng, N), -limit, limit) + BIAS
    finding = only(samples, "clipping")
    assert finding.severity is Severity.FATAL
    assert finding.count == pytest.approx(2 * N * 0.5 * math.erfc(limit / math.sqrt(2)), rel=0.3)
    assert f"clipped at {limit:.0f}" in finding.message or f"clipped at {limit - 0.1:.1f}" in finding.message
    assert not finding.excludes


def test_b6_clipped_on_one_side_only(rng: np.random.Generator) -> None:
    finding = only(np.minimum(white(rng, N), 1.0) + BIAS, "clipping")
    assert "largest value 21" in finding.message
    assert "smallest" not in finding.message


@pytest.mark.long
def test_b6_clipped_at_five_sigma_is_flagged() -> None:
    n = 8_000_000  # 2.3 samples beyond each side are expected; this seed has 4 and 3
    samples = np.random.default_rng(3).standard_normal(n)
    assert min((samples > 5).sum(), (samples < -5).sum()) >= 2
    finding = only(np.clip(samples, -5.0, 5.0), "clipping")
    assert finding.severity is Severity.WARNING


def test_b6_int16_counts_clipped_at_one_sigma(rng: np.random.Generator) -> None:
    samples = np.clip(np.round(40.0 * white(rng, N)), -40, 40).astype(np.int16)
    assert only(samples, "clipping", unit="LSB").severity is Severity.FATAL


@pytest.mark.parametrize("start", [0.0, 20.0, 1000.0])
@pytest.mark.parametrize("sigma", [0.7, 3.0])
def test_roundings_of_a_count_are_one_level(rng: np.random.Generator, sigma: float, start: float) -> None:
    angle = np.cumsum(np.round(rng.normal(start, sigma, N))) * 1e-6
    rate = np.diff(angle) / 0.01  # nine counts, each in dozens of roundings
    assert len(np.unique(rate)) > 40
    assert set(found(rate)) <= {"quantisation", "bias_removed"}
    assert survey(record(rate), "signal").lattice.step == pytest.approx(1e-4, rel=1e-6)


def test_b6_clipped_counts_in_several_roundings(rng: np.random.Generator) -> None:
    counts = np.cumsum(np.clip(np.round(rng.normal(20.0, 10.0, N)), 10, 30))
    rate = np.diff(counts * 1e-6) / 0.01
    finding = found(rate)["clipping"]
    assert finding.severity is Severity.FATAL
    outer = np.abs(rate - 20e-4) > 9.99e-4
    assert finding.count == outer.sum()
    assert sum(stop - start for start, stop in finding.spans) == outer.sum()


def test_a_strong_vibration_is_not_called_clipping(rng: np.random.Generator) -> None:
    samples = np.round(50.0 * np.sin(0.731 * np.arange(N)) + 0.2 * white(rng, N)).astype(np.int16)
    assert "clipping" not in found(samples, unit="LSB")


@pytest.mark.parametrize("step", [0.1, 0.3, 0.7, 1.0])
@pytest.mark.parametrize("fine", [0.1, 0.3, 0.6])
def test_a_coarser_range_is_not_called_clipping_and_clips_in_it_are(
    rng: np.random.Generator, step: float, fine: float
) -> None:
    """A meter that ranges itself: the outermost codes are those of the coarse range, all of them often."""
    samples, changed = white(rng, 20_000), round(fine * 20_000)
    for limit in (math.inf, step * round(2.0 / step)):
        ranged = np.clip(samples, -limit, limit)
        ranged[:changed] = np.round(ranged[:changed], 4)
        ranged[changed:] = step * np.round(ranged[changed:] / step)
        assert ("clipping" in found(ranged)) == (limit < math.inf)


def test_b19_wrong_byte_order_is_refused(noise: np.ndarray) -> None:
    swapped = noise.astype(">f8").view("<f8")
    recording = record(swapped)
    named = {f.code: f for f in check(recording)}
    assert named["implausible_exponents"].severity is Severity.FATAL
    with pytest.raises(DataQualityError, match="byte order"):
        prepare(recording, list(named.values()))


# -- resolution -------------------------------------------------------------------------------------------


def test_b4_constant_has_no_noise() -> None:
    finding = only(np.full(1_000_000, 0.1), "no_noise_resolved")
    assert finding.severity is Severity.FATAL
    assert "no noise resolved" in finding.message
    assert "resolution limit" in finding.message


def test_b5_noise_of_a_tenth_of_a_step_at_the_middle_of_a_code(rng: np.random.Generator) -> None:
    samples = np.round(0.1 * white(rng, N) + 7.2)  # the nearest edge is 3 sigma away
    finding = only(samples, "quantisation_limited", unit="LSB")
    assert finding.severity is Severity.FATAL
    assert "the step (LSB) of the values, 1 LSB" in finding.message


def test_b5_noise_of_a_tenth_of_a_step_at_an_edge(rng: np.random.Generator) -> None:
    samples = 0.05 * np.round(0.1 * white(rng, N) + 7.5)
    finding = only(samples, "quantisation_limited")
    assert "0.05 m/s^2" in finding.message


def test_b5_one_rare_code_still_tells_the_step() -> None:
    samples = np.full(1_000_000, 3.0)
    samples[123_456] = 3.25  # escapes every probe
    assert "0.25" in only(samples, "quantisation_limited").message


def test_c10_rate_quantiser_at_half_a_step(rng: np.random.Generator) -> None:
    samples = np.round(0.5 * white(rng, N) + walk(rng, N, 0.01))
    finding = only(samples, "quantisation", unit="LSB")
    assert finding.severity is Severity.WARNING
    stated = float(finding.message.split("up to ")[1].split(" %")[0])
    assert stated == pytest.approx(15.47, abs=0.6)  # ADEV x 1.1547


def test_class_10_every_second_count_is_named(rng: np.random.Generator) -> None:
    samples = (4 * np.round(12.0 * white(rng, N) + 50.0)).astype(np.int16)
    named = {f.code: f for f in check(record(samples, unit="LSB"))}
    assert named["resolution_step"].severity is Severity.INFO
    assert "4 counts" in named["resolution_step"].message


def test_the_step_of_counts_that_were_scaled_in_float32(rng: np.random.Generator) -> None:
    counts = np.round(12.0 * white(rng, N) + walk(rng, N, 2.0))
    scaled = (counts.astype(np.float32) * np.float32(0.00875)).astype(np.float64) * math.pi / 180.0
    step = next(f for f in check(record(scaled, unit="rad/s")) if f.code == "resolution_step")
    assert f"{0.00875 * math.pi / 180.0:.4g} rad/s" in step.message


@pytest.mark.parametrize("noise_steps", [0.0, 0.1])
def test_c9_angle_quantiser_whose_errors_follow_a_pattern(
    rng: np.random.Generator, noise_steps: float
) -> None:
    angle = np.cumsum(0.08 + noise_steps * white(rng, N))
    recording = Recording.from_angle(0.01 * np.round(angle), rate=100.0, unit="deg")
    named = by_code(check(recording))
    assert named["quantisation_not_white"].severity is Severity.WARNING
    assert "0.01 deg" in named["quantisation_not_white"].message


def test_c8_dithered_angle_quantiser_is_white(rng: np.random.Generator) -> None:
    angle = np.cumsum(3.9 + 0.6 * white(rng, N))
    recording = Recording.from_angle(0.01 * np.round(angle), rate=100.0, unit="deg")
    assert by_code(check(recording)) == {}


def test_b9_float32_of_a_level_of_2_5_volts(rng: np.random.Generator) -> None:
    samples = (2.5 + 1e-6 * white(rng, N)).astype(np.float32)
    finding = only(samples, "float_step", unit="V")
    assert finding.severity is Severity.WARNING
    assert "float32" in finding.message
    assert "2.4e-07 V apart" in finding.message
    stored_wider = only(samples.astype(np.float64), "float_step", unit="V")
    assert stored_wider.message == finding.message


def test_b9_float32_at_9_81_is_harmless_until_the_noise_is_too_small(rng: np.random.Generator) -> None:
    noise = white(rng, N)
    assert found((9.81 + 1e-3 * noise).astype(np.float32)) == {}
    assert only((9.81 + 2e-6 * noise).astype(np.float32), "float_step")
    named = found((9.81 + 1e-7 * noise).astype(np.float32))
    assert named["quantisation_limited"].severity is Severity.FATAL


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.int16, np.uint16, np.int32, np.int64])
def test_b8_number_types(rng: np.random.Generator, dtype: Any) -> None:
    samples = np.round(100.0 * white(rng, N) + 800.0).astype(dtype)
    assert found(samples, unit="LSB") == {}


def test_b8_int64_near_2_to_the_62(rng: np.random.Generator) -> None:
    samples = np.round(100.0 * white(rng, N)).astype(np.int64) + (1 << 62)
    assert found(samples, unit="LSB") == {}
    samples[600:700] = samples[599]
    assert f"{float(samples[600]):.6g}" in only(samples, "stuck", unit="LSB").message


# -- repeats ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [2, 5])
@pytest.mark.parametrize("step", [0.0, 0.5])
def test_b7_each_sample_repeated(rng: np.random.Generator, factor: int, step: float) -> None:
    samples = white(rng, N // factor)
    samples = np.round(samples / step) * step if step else samples
    finding = found(np.repeat(samples, factor))["held_samples"]
    assert finding.severity is Severity.WARNING
    assert f"rate/{factor} = {100.0 / factor:g} Hz" in finding.message


def test_class_1_a_slower_sensor_read_at_an_uneven_ratio(rng: np.random.Generator) -> None:
    fresh = np.floor(np.arange(N) * 0.625).astype(int)  # 62.5 values per second in 100 rows
    finding = only(white(rng, N)[fresh], "held_samples")
    assert "37.5 %" in finding.message
    assert "the sensor updates at 62.5000 Hz (standard uncertainty 0.0005 Hz)" in finding.message


def test_b16_a_stretch_of_zeros(noise: np.ndarray) -> None:
    noise[10_000:11_000] = 0.0
    finding = only(noise, "zero_filled")
    assert (finding.severity, finding.count, finding.places) == (Severity.WARNING, 1000, ((10_000, 11_000),))
    prepared, _ = prepare(record(noise), [finding])
    left = prepared.values("signal")
    assert np.isnan(left[10_000:11_000]).all()
    assert np.isnan(left).sum() == 1000
    assert prepared.history[-1]["reason"] == "zero_filled"


def test_class_4_first_sample_zero_and_a_tail_of_zeros(noise: np.ndarray) -> None:
    noise[0] = 0.0
    noise[-300:] = 0.0
    noise[777] = 0.0
    finding = only(noise, "zero_filled")
    assert finding.places == ((0, 1), (777, 778), (N - 300, N))
    for part in ("the first sample", "the last 300 samples", "1 stretch within"):
        assert part in finding.message


def test_zeros_that_the_noise_reaches_are_values(rng: np.random.Generator) -> None:
    assert found(np.round(white(rng, N) / 0.2 + 10.0) * 0.2) == {}


@pytest.mark.parametrize("step", [0.0, 0.1, 0.6])
def test_class_4_a_stuck_stretch(rng: np.random.Generator, step: float) -> None:
    samples = white(rng, N) + walk(rng, N, 0.01)
    samples = np.round(samples / step) * step if step else samples
    samples[20_000:20_200] = samples[19_999]
    named = found(samples)
    stuck = named.pop("stuck")
    assert set(named) <= {"quantisation"}
    assert stuck.severity is Severity.WARNING
    (start, stop), *more = stuck.places
    assert not more
    assert 19_990 <= start <= 19_999
    assert 20_200 <= stop <= 20_210
    prepared, _ = prepare(record(samples), [stuck])
    assert np.isnan(prepared.values("signal")).sum() == stuck.count


def test_class_4_readings_frozen_from_some_row(noise: np.ndarray) -> None:
    noise[40_000:] = noise[40_000]
    finding = only(noise, "stuck")
    assert finding.places == ((40_000, N),)
    assert "frozen to the end" in finding.message
    noise[10_000:] = noise[10_000]
    assert only(noise, "stuck").severity is Severity.FATAL


def test_class_3_two_sensors_in_alternate_rows(rng: np.random.Generator) -> None:
    samples = white(rng, N)
    samples[1::2] += 5.0
    finding = found(samples)["interleaved"]
    assert finding.severity is Severity.FATAL
    assert "period 2" in finding.message
    assert float(finding.message.split("levels ")[1].split(" sigma")[0]) == pytest.approx(5.0, rel=0.1)
    assert "50 Hz" in finding.advice


def test_class_3_two_sensors_with_one_level_and_two_noises(rng: np.random.Generator) -> None:
    samples = white(rng, N)
    samples[1::2] *= 3.0
    finding = only(samples, "interleaved")
    assert finding.severity is Severity.WARNING
    assert "ratio" in finding.message


@pytest.mark.long
def test_rounded_white_noise_does_not_alternate() -> None:
    """By chance 4e-6 of records; the squares of differences on steps are 0, 1 or 4 of them."""
    for seed, step in itertools.product(range(9), (0.5, 0.6, 1.0)):
        rng = np.random.default_rng(seed)
        y = rng.standard_normal(5000)
        assert "interleaved" not in found(np.round(y / step) * step)
        y[rng.random(5000) < 0.02] *= 20.0
        assert "interleaved" not in found(np.round(y / step) * step)


def test_noise_near_the_step_of_float32_does_not_alternate() -> None:
    for seed in range(20):
        y = (1000.0 + 1e-4 * np.random.default_rng(seed).standard_normal(5000)).astype(np.float32)
        assert "interleaved" not in found(y)


@pytest.mark.parametrize("step", [0.0, 0.6])
@pytest.mark.parametrize("period", [2, 3, 4])
def test_one_row_in_several_with_three_times_the_noise(period: int, step: float) -> None:
    """Rounded or not, with strays in 0.3 % of the samples: the period is that of the rows, not a divisor of it."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        y = white(rng, 8000)
        y[::period] *= 3.0
        y = np.round(y / step) * step if step else y
        y[rng.random(len(y)) < 0.003] += 40.0
        alternating = found(y)["interleaved"]
        assert f"period {period}" in alternating.message
        assert 2.2 < float(alternating.message.split("ratio ")[1].split()[0]) < 3.1


@pytest.mark.parametrize(
    ("factor", "words"), [(1.0, "the same samples as 'x'"), (0.5, "0.5 times the samples of 'x'")]
)
def test_twin_channels(rng: np.random.Generator, factor: float, words: str) -> None:
    samples = rng.standard_normal((N, 3)) + [3.0, 4.0, 5.0]
    samples[:, 2] = factor * samples[:, 0]
    twin = by_code(check(record(samples, unit="V")))["duplicate_channels"]
    assert twin.channel == "z"
    assert words in twin.message


# -- rest -------------------------------------------------------------------------------------------------


def test_b17_one_spike_of_1000_sigma(rng: np.random.Generator) -> None:
    n = 200_000
    samples = white(rng, n)
    samples[77_777] += 1000.0
    finding = only(samples, "spikes")
    assert (finding.severity, finding.count, finding.places) == (Severity.WARNING, 1, ((77_777, 77_778),))
    with_it = float(finding.message.split("it makes N ")[1].split(" times as large")[0])
    assert with_it == pytest.approx(math.sqrt(6.0), rel=0.02)  # sqrt(1 + 1000^2/2e5)
    assert finding.message.endswith("; with 1 sample excluded, N is unaffected")
    prepared, _ = prepare(record(samples), [finding])
    assert np.flatnonzero(np.isnan(prepared.values("signal"))).tolist() == [77_777]


def test_b17_small_impulses_are_reported_and_kept(rng: np.random.Generator) -> None:
    n = 500_000
    samples = white(rng, n) + walk(rng, n, 0.05)
    samples[[1000, 250_000]] += [12.0, -11.0]
    finding = only(samples, "spikes")
    assert (finding.severity, finding.count, finding.excludes) == (Severity.INFO, 2, False)
    assert re.search(r"; they make N 0\.\d+ % larger$", finding.message)
    prepared, _ = prepare(record(samples), [finding])
    assert not np.isnan(prepared.values("signal")).any()


def test_b17_a_knock_is_left_out_whole(rng: np.random.Generator) -> None:
    n = 500_000
    samples = white(rng, n)
    ring = 80.0 * np.exp(-np.arange(120) / 25.0) * np.cos(1.1 * np.arange(120))
    samples[200_000:200_120] += ring
    finding = found(samples)["spikes"]
    assert finding.excludes
    assert len(finding.spans) == 1
    (start, stop) = finding.places[0]
    assert 200_000 <= start < 200_003
    assert 200_040 <= stop <= 200_120
    assert finding.count > 30


def test_b17_a_spike_in_an_angle(rng: np.random.Generator) -> None:
    angle = np.cumsum(white(rng, N) + 300.0)
    angle[30_000] += 200.0
    recording = Recording.from_angle(angle, rate=100.0, unit="arcsec")
    finding = by_code(check(recording))["spikes"]
    assert finding.places == ((30_000, 30_001),)


def test_many_outliers_are_another_distribution(rng: np.random.Generator) -> None:
    samples = rng.standard_t(3.0, N)
    named = found(samples)
    assert named["heavy_tails"].severity is Severity.WARNING
    assert "spikes" not in named


def test_a_level_shift_is_no_spike(noise: np.ndarray) -> None:
    noise[25_000:] += 30.0
    finding = only(noise, "disturbance")
    (start, stop) = finding.places[0]
    assert start <= 25_000 <= stop


def test_class_14_people_in_the_first_minutes(rng: np.random.Generator) -> None:
    samples = white(rng, N) + 0.2 * flicker(rng, N)
    samples[:4000] += 4.0 * np.sin(2 * np.pi * 0.02 * np.arange(4000))
    finding = only(samples, "disturbance")
    assert finding.severity is Severity.WARNING
    assert max(stop for _, stop in finding.places) < 5200
    assert finding.spans[0, 0] == 0
    assert not finding.excludes


def test_class_14_a_sensor_turned_by_hand_is_refused(rng: np.random.Generator) -> None:
    samples = white(rng, N)
    for start in range(5000, 45_000, 8000):
        samples[start : start + 300] += 2000.0 * np.hanning(300)
    named = found(samples)
    assert named["not_at_rest"].severity is Severity.FATAL
    with pytest.raises(DataQualityError, match="--accept not_at_rest"):
        prepare(record(samples), list(named.values()))


def test_a_stretch_of_half_the_noise(rng: np.random.Generator) -> None:
    samples = white(rng, N)
    samples[20_000:30_000] *= 0.5
    finding = only(samples, "amplitude_drop")
    assert finding.severity is Severity.INFO
    assert finding.spans[0, 0] >= 19_400
    assert finding.spans[-1, 1] <= 30_600
    assert finding.count > 8000


@pytest.mark.long
def test_noise_that_grows_is_said_beside_a_window_that_is_low() -> None:
    """Of two halves a few windows of the quiet one may have half the usual power: that does not say it all."""
    low = 0
    for seed in range(30):
        rng = np.random.default_rng([seed, 3])
        samples = white(rng, 20_000)
        samples[10_000:] *= rng.uniform(1.45, 1.6)
        named = found(samples)
        assert "disturbance" in named or named["noise_changes"].severity is Severity.WARNING
        low += {"amplitude_drop", "noise_changes"} <= set(named)
    assert low


@pytest.mark.parametrize("length", [1, 37])
def test_class_4_half_the_level_before_a_gap(noise: np.ndarray, length: int) -> None:
    noise[30_000 - length : 30_000] *= 0.5
    noise[30_000:30_500] = np.nan
    finding = found(noise)["half_before_gap"]
    assert finding.places == ((30_000 - length, 30_000),)
    assert finding.excludes


def test_class_4_half_the_noise_before_a_gap(rng: np.random.Generator) -> None:
    samples = white(rng, N)
    samples[29_400:30_000] *= 0.5
    samples[30_000:30_500] = np.nan
    assert found(samples)["half_before_gap"].places == ((29_488, 30_000),)


# -- meaning ----------------------------------------------------------------------------------------------


def six_axes(
    rng: np.random.Generator, gyro: str, acc: str, bias: float = 0.01, level: float = 9.80
) -> Recording:
    units = [gyro] * 3 + [acc] * 3
    names = ["gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"]
    sizes = np.array([1e-3] * 3 + [1e-2] * 3)
    samples = rng.standard_normal((20_000, 6)) * sizes + [bias, -bias, 2 * bias, 0.1, -0.1, level]
    channels = tuple(Channel.of(n, u) for n, u in zip(names, units, strict=True))
    base = record(samples[:, 0])
    columns = tuple(record(samples[:, i]).columns[0] for i in range(6))
    return replace(base, channels=channels, columns=columns)


def test_b18_a_good_triad_says_nothing(rng: np.random.Generator) -> None:
    assert check(six_axes(rng, "rad/s", "m/s^2")) == ()


@pytest.mark.parametrize(
    ("unit", "level", "words"),
    [
        ("g", 9.8, "m/s² labeled as g"),
        ("m/s^2", 1.0, "g labeled as m/s²"),
        ("mg", 1.0, "g labeled as mg"),
        ("m/s^2", 9.99, "9.991 m/s² (1.9 % high)"),
    ],
)
def test_b18_a_triad_that_is_not_one_g_long(
    rng: np.random.Generator, unit: str, level: float, words: str
) -> None:
    named = by_code(check(six_axes(rng, "rad/s", unit, level=level)))
    assert list(named) == ["gravity"]
    assert named["gravity"].severity is Severity.WARNING
    assert words in named["gravity"].message


def test_b18_degrees_labelled_as_radians(rng: np.random.Generator) -> None:
    samples = 0.2 * white(rng, N) + 0.7  # 0.02 deg/s/rtHz at 100 Hz, a common gyro
    assert found(samples, unit="deg/s") == {}
    finding = only(samples, "unit_trap", unit="rad/s")
    assert "57.3" in finding.message
    assert "'rad/s'" in finding.message


def test_b18_an_unknown_unit_is_named(noise: np.ndarray) -> None:
    assert only(noise, "unit_missing", unit="unknown").severity is Severity.WARNING


def test_class_9_a_bias_removed_on_board(rng: np.random.Generator) -> None:
    named = [f for f in check(six_axes(rng, "rad/s", "m/s^2", bias=1e-6)) if f.code == "bias_removed"]
    assert {f.channel for f in named} == {"gyro_x", "gyro_y", "gyro_z"}
    assert all(f.severity is Severity.WARNING for f in named)
    assert "Earth's rotation" in named[0].message


@pytest.mark.parametrize(("aperture", "factor"), [(0.02, "1.25"), (1 / 60, "1.37")])
def test_class_10_an_aperture_shorter_than_the_interval(
    rng: np.random.Generator, aperture: float, factor: str
) -> None:
    samples = white(rng, N) + BIAS
    recording = Recording.from_rate(samples, rate=32.0, unit="V", aperture=aperture)
    finding = by_code(check(recording))["aliasing"]
    assert finding.severity is Severity.WARNING
    assert f"{factor} times" in finding.message


# -- time and text ----------------------------------------------------------------------------------------


def noted(rng: np.random.Generator, **parts: dict[str, Any]) -> dict[str, Finding]:
    recording = replace(record(white(rng, 20_000) + BIAS), notes=parts)
    return by_code(check(recording))


STAMPS = {"source": "t", "unit": "s", "rate": 100.0, "median_rate": 100.0, "jitter_rms_s": 0.0}


@pytest.mark.parametrize(
    ("notes", "words"),
    [
        (
            {"duplicates": 200, "duplicate_rows": [99, 199, 299, 399, 499]},
            "200 time stamps equal the one before (1 %)",
        ),
        ({"backward": 1, "backward_rows": [777]}, "time stamps step back once, at row 777"),
    ],
)
def test_b12_stamps_that_contradict_each_other_are_refused(
    rng: np.random.Generator, notes: dict[str, Any], words: str
) -> None:
    finding = noted(rng, timebase=STAMPS | notes)["time_stamps"]
    assert finding.severity is Severity.FATAL
    assert words in finding.message
    rows = notes.get("duplicate_rows") or notes["backward_rows"]
    assert [a for a, _ in finding.places] == rows


def test_b12_a_few_duplicates_are_a_warning(rng: np.random.Generator) -> None:
    named = noted(rng, timebase=STAMPS | {"duplicates": 3, "duplicate_rows": [5, 6, 9]})
    assert list(named) == ["duplicate_stamps"]


def test_b13_jitter_is_stated(rng: np.random.Generator) -> None:
    named = noted(rng, timebase=STAMPS | {"jitter_rms_s": 1e-3})
    assert named["rate_jitter"].severity is Severity.INFO
    assert "10 %" in named["rate_jitter"].message
    assert noted(rng, timebase=STAMPS | {"jitter_rms_s": 8e-3})["rate_jitter"].severity is Severity.WARNING
    assert noted(rng, timebase=STAMPS | {"jitter_rms_s": 5e-5}) == {}


def test_b14_a_clock_500_ppm_off_the_header(rng: np.random.Generator) -> None:
    finding = noted(rng, timebase=STAMPS | {"rate_nominal": 100.0 / 1.0005})["clock_rate"]
    assert finding.severity is Severity.WARNING
    assert "+500 ppm" in finding.message
    assert noted(rng, timebase=STAMPS | {"rate_nominal": 100.002}) == {}


def test_class_1_a_median_that_tells_another_rate(rng: np.random.Generator) -> None:
    named = noted(rng, timebase=STAMPS | {"median_rate": 89.0})
    assert list(named) == ["rate_not_median"]
    assert named["rate_not_median"].severity is Severity.INFO


def test_class_1_stamps_of_one_second(rng: np.random.Generator) -> None:
    assert list(noted(rng, timebase=STAMPS | {"resolution_s": 1.0})) == ["coarse_stamps"]


def test_class_10_every_fourth_sample_logged(rng: np.random.Generator) -> None:
    finding = noted(rng, timebase=STAMPS | {"rate_nominal": 400.0})["decimated"]
    assert "one sample in 4" in finding.message


def test_class_2_no_time_stamps(rng: np.random.Generator) -> None:
    named = noted(rng, timebase={"source": "header", "unit": "", "rate": 100.0})
    assert list(named) == ["no_time_stamps"]
    assert "header" in named["no_time_stamps"].message


def test_b14_a_rate_given_against_the_header(rng: np.random.Generator) -> None:
    given = {"source": "rate argument", "unit": "", "rate": 100.0, "rate_nominal": 200.0}
    assert set(noted(rng, timebase=given)) == {"no_time_stamps", "decimated"}
    named = noted(rng, timebase=given | {"rate_nominal": 101.0})
    assert "the rate given is 100 Hz" in named["clock_rate"].message


def test_f6_what_the_text_reader_met(rng: np.random.Generator) -> None:
    text = {
        "ragged": 2,
        "ragged_rows": [17, 4000],
        "missing_cells": 3,
        "unterminated_last_line": True,
        "nul_bytes": 512,
        "guesses": ["decimal comma: every line has exactly one"],
        "bom": True,
        "overload_words": 0,
    }
    named = noted(rng, text=text)
    assert {c: f.severity.value for c, f in named.items()} == {
        "ragged_rows": "warning",
        "unterminated_last_line": "warning",
        "nul_bytes": "warning",
        "cells_missing": "info",
        "dialect_guessed": "info",
    }
    assert named["ragged_rows"].places == ((17, 18), (4000, 4001))
    assert "decimal comma" in named["dialect_guessed"].message


def test_f6_guesses_of_the_other_readers_are_stated(rng: np.random.Generator) -> None:
    named = noted(rng, source={"format": "rosbag", "guesses": ["several IMU topics (/a, /b): /a is read"]})
    assert {c: f.message for c, f in named.items()} == {
        "dialect_guessed": "several IMU topics (/a, /b): /a is read"
    }


def test_b2_overload_words_of_a_text_log(rng: np.random.Generator) -> None:
    assert noted(rng, text={"overload_words": 5})["overload"].severity is Severity.WARNING
    assert noted(rng, text={"overload_words": 50})["overload"].severity is Severity.FATAL


def test_notes_of_another_shape_are_no_crash(rng: np.random.Generator) -> None:
    recording = replace(record(white(rng, 5000) + BIAS), notes={"timebase": None, "text": "odd", "source": 3})
    assert check(recording) == ()


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_samples_lost_at_random_do_no_harm_without_averages(noise: np.ndarray, share: float) -> None:
    noise[np.random.default_rng(4).random(N) < share] = np.nan
    lost = Recording.from_rate(noise, rate=100.0, unit="rad/s")
    findings = check(lost)
    [broken] = [f for f in findings if f.code == "broken_up"]
    assert broken.severity is Severity.FATAL
    assert "--method likelihood" in broken.advice and "--repair" not in broken.advice
    with pytest.raises(DataQualityError, match="broken_up"):
        prepare(lost, findings)
    ready, seen = prepare(lost, findings, by_averages=False)
    assert ready.n_samples == N
    assert [f.severity for f in seen if f.code == "broken_up"] == [Severity.WARNING]


@pytest.mark.parametrize(
    "there",
    [
        pytest.param(lambda i: i % 4 == 2, id="every fourth row"),
        pytest.param(lambda i: i % 4 < 3, id="all but every fourth row"),
        pytest.param(lambda i: np.diff(np.floor(0.37 * i), prepend=0) > 0, id="a slower clock"),
        pytest.param(lambda i: np.isin(i, np.round(i / 0.21 + np.sin(i))), id="a slower clock that wavers"),
        pytest.param(lambda i: np.diff(np.floor(0.73 * i), prepend=0) > 0, id="a clock nearly as fast"),
    ],
)
def test_values_of_a_slower_sensor_are_refused_in_any_analysis(
    noise: np.ndarray, there: Callable[[np.ndarray], np.ndarray]
) -> None:
    shared = Recording.from_rate(np.where(there(np.arange(N)), noise, np.nan), rate=100.0, unit="rad/s")
    with pytest.raises(DataQualityError, match="broken_up"):
        prepare(shared, check(shared), by_averages=False)


@pytest.mark.parametrize("code", [0.35, 0.1])  # no binary fractions: equal increments differ in the last bits
def test_an_angle_that_advances_one_step_a_sample_is_not_in_motion(
    code: float, rng: np.random.Generator
) -> None:
    """Windows in which it never slips have no energy but the rounding of floating-point numbers."""
    angle = np.floor(np.cumsum(1.00002 + 0.05 * white(rng, N) * (np.arange(N) > N // 2)))
    named = set(by_code(check(Recording.from_angle(code * angle, rate=100.0, unit="arcsec", names=["fog"]))))
    assert not {"not_at_rest", "disturbance", "spikes", "heavy_tails"} & named
