# SPDX-License-Identifier: BSD-3-Clause
"""Recordings through the filter of their noise model."""

from __future__ import annotations

import json
import math
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.filtering.kalman import filter_recording
from allanite.filtering.kalman.series import envelope
from allanite.noise import (
    Estimate,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    White,
)
from allanite.recording.block_series import BlockSeries
from allanite.recording.records import Channel, Kind, Recording
from allanite.recording.sample_columns import ArrayColumn
from resident_memory import needs_resident_bytes, resident_bytes
from shell import Run

DEG = math.radians(1)
#: A gyro whose drift shows within minutes.
GYRO = NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), RandomWalk(K=4e-6))


def record(seed: int = 1, model: NoiseModel = GYRO, duration: float = 300.0, **options: Any) -> Recording:
    return al.simulate(model, rate=8.0, duration=duration, seed=seed, **options)


def from_rate(y: Any, unit: str = "rad/s", **options: Any) -> Recording:
    return Recording.from_rate(y, rate=8.0, unit=unit, names="gyro", **options)


@pytest.mark.long
@pytest.mark.parametrize("smooth", [False, True])
def test_stated_sd_of_drift_and_level_hold(smooth: bool) -> None:
    """100 records whose drift is known: squares of error over stated sd average to 1 within the 99.9 % bounds."""
    slow = NoiseModel.of(Flicker(B=3e-5), RandomWalk(K=4e-6))
    squares, levels, length = [], [], 240
    for seed in range(100):
        drift = record(seed, slow, duration=length / 8).values("gyro")
        white = 1e-4 * math.sqrt(8) * np.random.default_rng(seed).standard_normal(length)
        result = filter_recording(from_rate(drift + white + 0.01), GYRO, smooth=smooth, ratio=math.sqrt(10))
        squares.append(((result.drift - drift) / result.drift_sd)[[-1, 150]])
        levels.append((result.level - 0.01) / result.level_sd)
    for z in (*np.transpose(squares), levels):
        assert 0.59896 < np.mean(np.square(z)) < 1.53167


def test_mean_of_smoothed_samples_is_the_level() -> None:
    """Exact: what is left of the samples is orthogonal to the constant."""
    y = record().values("gyro") + 0.02
    y[100:150] = np.nan
    back = filter_recording(from_rate(y), GYRO, smooth=True)
    assert back.mean_corrected == pytest.approx(back.level, abs=1e-12 * back.level_sd)
    assert np.array_equal(np.isnan(back.corrected), np.isnan(y))
    assert np.isfinite(back.drift).all()
    assert back.mean_measured == pytest.approx(np.nanmean(y), rel=1e-13)
    forward = filter_recording(from_rate(y), GYRO)
    assert back.level == pytest.approx(forward.level, rel=1e-9)
    assert back.log_likelihood == forward.log_likelihood
    assert (back.drift_sd < forward.drift_sd).mean() > 0.9
    present = np.isfinite(y)
    assert (forward.corrected + forward.drift)[present] == pytest.approx(y[present], rel=1e-14)


def test_drift_is_taken_off() -> None:
    """The filter removes what of the drift can be known: slow wander of the samples falls, white noise stays."""
    source = record(3, duration=3600.0)
    result = filter_recording(source, GYRO)
    before, after = (
        al.allan_curve(r.select("gyro"), taus=[0.125, 128.0]) for r in (source, result.recording())
    )
    assert after.deviation[0, 0] == pytest.approx(before.deviation[0, 0], rel=0.02)
    assert after.deviation[1, 0] < 0.5 * before.deviation[1, 0]
    assert result.verdict == "consistent"
    wrong = NoiseModel.of(White(N=1.3e-4), Flicker(B=3e-5), RandomWalk(K=4e-6))
    assert "smaller than the model predicts" in filter_recording(source, wrong).reason


def test_units_and_kinds_do_not_change_the_result() -> None:
    y = record().values("gyro")
    plain = filter_recording(from_rate(y), GYRO)
    angle = np.concatenate([[0.0], np.cumsum(y) / 8])
    others = {
        "deg/s": from_rate(y / DEG, "deg/s"),
        "V": from_rate(y / DEG * 0.024, "V", scale_factor="24 mV/(deg/s)"),
        "rad": Recording.from_angle(angle, rate=8.0, unit="rad", names="gyro"),
        "deg": Recording.from_angle(angle / DEG, rate=8.0, unit="deg", names="gyro"),
    }
    for unit, source in others.items():
        result = filter_recording(source, GYRO)
        assert result.unit == "rad/s", unit
        assert result.kind is Kind.RATE
        assert result.n_samples == len(y)
        assert result.corrected == pytest.approx(plain.corrected, rel=1e-9, abs=1e-12)
        assert result.level_sd == pytest.approx(plain.level_sd, rel=1e-12)
    counts = from_rate(np.round(y / 1e-6).astype(np.int16), "LSB")
    scaled = NoiseModel.of(White(N=100.0), Flicker(B=30.0), RandomWalk(K=4.0), kind="counts")
    result = filter_recording(counts, scaled)
    assert (result.unit, result.kind) == ("LSB", Kind.COUNTS)
    assert result.level * 1e-6 == pytest.approx(plain.level, abs=0.1 * plain.level_sd)


def test_overload_words_and_far_integers() -> None:
    y = record().values("gyro")
    gap, words = y.copy(), y.copy()
    gap[[0, 7, 8, 9]], words[[0, 7, 8, 9]] = np.nan, [9.91e37, -9.9e37, np.inf, 1e38]
    one, other = (filter_recording(from_rate(x), GYRO) for x in (gap, words))
    assert np.array_equal(one.corrected, other.corrected, equal_nan=True)
    counts = np.round(y / 1e-7).astype(np.int64)
    model = NoiseModel.of(White(N=1e3), Flicker(B=300.0), RandomWalk(K=40.0), kind="counts")
    channel = Channel.of("gyro", "LSB")
    near, far = (
        filter_recording(Recording(channels=(channel,), columns=(ArrayColumn(c),), rate=8.0), model)
        for c in (counts, counts + (1 << 60))
    )
    assert far.drift == pytest.approx(near.drift, abs=1e-6 * near.drift_sd.max())
    assert far.level - 2.0**60 == pytest.approx(near.level, abs=256)  # what float64 can say there


def test_quantisation_is_no_drift() -> None:
    """It is filtered as noise of the sample: what is subtracted is slow."""
    model = GYRO + Quantisation(Q=1e-4, dt=1 / 8)
    result = filter_recording(record(model=model, duration=600.0), model)
    assert np.std(np.diff(result.drift)) < 0.1 * np.std(np.diff(result.corrected))
    assert result.consistency.consistent
    assert "quantisation" not in result.terms


def test_lines_and_ramps_are_taken_off() -> None:
    model = NoiseModel.of(White(N=1e-4), Sinusoid(amplitude=2e-3, frequency=0.5), Ramp(R=1e-5))
    result = filter_recording(record(model=model), model, smooth=True)
    assert np.std(result.corrected) == pytest.approx(1e-4 * math.sqrt(8), rel=0.1)
    assert {"sinusoid", "ramp", "level"} == set(result.terms)


def test_white_noise_alone_has_no_drift() -> None:
    source = record(model=NoiseModel.of(White(N=1e-4)))
    result = filter_recording(source, NoiseModel.of(White(N=1e-4)))
    assert not result.drift.any()
    assert result.level == pytest.approx(source.values("gyro").mean(), rel=1e-9, abs=1e-15)
    assert any("no drift" in note for note in result.notes)


def test_flicker_as_one_term_is_the_seeds_choice() -> None:
    source = record()
    single = filter_recording(source, GYRO, flicker="single", T=100.0)
    own = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(3e-5 * 1.0760, 100.0), RandomWalk(K=4e-6))
    assert single.n_states == 4
    assert single.drift == pytest.approx(filter_recording(source, own).drift, rel=1e-3, abs=1e-8)
    assert any("one Gauss-Markov state" in note for note in single.notes)
    assert any("a sum of" in note for note in filter_recording(source, GYRO).notes)
    for options in (
        {"flicker": "single"},
        {"T": 100.0},
        {"flicker": "both"},
        {"flicker": "single", "T": -1.0},
    ):
        with pytest.raises(InputError, match=r"flicker|T is the correlation"):
            filter_recording(source, GYRO, **options)


def test_terms_show_the_whole_record_in_few_points() -> None:
    result = filter_recording(record(duration=1000.0), GYRO)
    assert set(result.terms) == {"flicker", "random_walk", "level"}
    level = result.terms["level"]
    assert len(level.t) == len(level.value) <= 1500
    assert (np.diff(level.t) > 0).all()
    assert level.sd[-1] < level.sd[10]
    assert level.value[-1] == pytest.approx(result.level, abs=0.1 * result.level_sd)
    last = sum(result.terms[name].value[-1] for name in ("flicker", "random_walk"))
    assert last == pytest.approx(result.drift[-3:].mean(), abs=0.2 * result.drift_sd[-1])
    document = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert document["verdict"] == result.verdict
    assert max(document["corrected"]["t"]) < 1000
    assert document["level"] == result.level
    assert "one axis at rest cannot separate" in result.notes[0]
    np.testing.assert_allclose(
        np.array(document["measured"]["low"])[[0, -1]],
        [f(record(duration=1000.0).values("gyro")[s]) for f, s in ((min, slice(6)), (min, slice(-2, None)))],
        rtol=1e-9,
    )
    assert "consistent" in repr(result)


def test_result_is_a_recording_again() -> None:
    source = record()
    made = filter_recording(source, GYRO).recording()
    assert made.names == ("gyro", "gyro_drift", "gyro_drift_sd")
    assert made.history[-1]["step"] == "filter"
    assert made.history[:-1] == source.history
    assert (made.n_samples, made.rate, made.start) == (source.n_samples, source.rate, source.start)
    assert not made.values("gyro").flags.writeable


@pytest.mark.long
@pytest.mark.parametrize("smooth", [False, True])
def test_memory_is_bounded(smooth: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long series go to a file, and nothing else grows with the record: 2^16 samples are 0.5 MiB a series.

    Where the gain comes from polynomials, the cuts into blocks leave a trace of rounding.
    """
    source = record(duration=(1 << 16) / 8)
    kept = filter_recording(source, GYRO, smooth=smooth)
    monkeypatch.setattr("allanite.recording.block_series.IN_MEMORY", 0)
    monkeypatch.setattr("allanite.filtering.kalman.filtered._ROWS", 1 << 11)
    monkeypatch.setattr("allanite.filtering.kalman.smoothing._BYTES", 1 << 19)
    shown: list[float] = []
    tracemalloc.start()
    result = filter_recording(source, GYRO, smooth=smooth, progress=shown.append)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2 << 20
    assert isinstance(result.corrected, np.memmap)
    assert result.corrected == pytest.approx(kept.corrected, rel=1e-12)
    pictures = [r.result.corrected for r in (result, kept)]
    for name in ("t", "low", "high"):
        assert np.allclose(*(getattr(p, name) for p in pictures), rtol=1e-12, atol=0)
    assert shown == sorted(shown)
    assert shown[-1] == 1.0


@needs_resident_bytes
def test_a_picture_leaves_no_series_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of a file that is mapped count as memory of the process as long as they are not given back."""
    monkeypatch.setattr("allanite.recording.block_series.IN_MEMORY", 0)
    rows, block = 1 << 23, np.ones(1 << 18)
    series = BlockSeries(rows)
    for start in range(0, rows, len(block)):
        series.put(start, block)
    whole = series.finish()
    envelope(whole[: 1 << 18])
    before = resident_bytes()
    assert envelope(whole, whole)[2].max() == 2.0
    assert resident_bytes() - before < whole.nbytes / 4


def test_broken_covariance_falls_back_to_the_square_root_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding is made to break the covariance form by saying that it skipped a row."""
    from allanite.filtering.kalman.filtering import FilterRun

    monkeypatch.setattr(FilterRun, "skipped", property(lambda run: int(not run.square_root)))
    result = filter_recording(record(), GYRO)
    assert result.form == "square root"
    assert any("square-root form was used" in note for note in result.notes)
    assert not any("broke" in note for note in filter_recording(record(), GYRO, form="square root").notes)


def test_a_record_without_samples_is_not_resolved() -> None:
    result = filter_recording(from_rate(np.full(50, np.nan)), GYRO, smooth=True)
    assert math.isnan(result.level)
    assert math.isinf(result.level_sd)
    assert result.verdict == "not tested"
    json.dumps(result.to_json(), allow_nan=False)


def test_which_channel_and_which_model() -> None:
    six = al.simulate({"x": GYRO, "y": GYRO}, rate=8.0, duration=60.0, seed=1)
    assert filter_recording(six, GYRO, channel="y").channel == "y"
    assert filter_recording(six, {"y": GYRO}).channel == "y"
    assert filter_recording(record(), {"other": GYRO}).channel == "gyro"
    other = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(3e-5, 50.0))
    undecided = NoiseModel(terms=GYRO.terms, family="flicker", alternative=other)
    assert any("could not distinguish" in note for note in filter_recording(record(), undecided).notes)


@pytest.mark.parametrize(("T", "worse"), [(5.0, "flicker"), (3e4, "gauss-markov")])
@pytest.mark.parametrize("first", ["flicker", "gauss-markov"])
def test_where_a_fit_could_not_decide_the_family_that_drifts_more_is_filtered(
    T: float, worse: str, first: str
) -> None:
    """Whichever comes first: a filter that trusts the steadier one is sure of a level that it does not know."""
    pink = NoiseModel(terms=(White(N=1e-4), Flicker(B=1e-5)), family="flicker")
    red = NoiseModel(terms=(White(N=1e-4), GaussMarkov.from_sigma(5e-5, T)), family="gauss-markov")
    model = replace(pink, alternative=red) if first == "flicker" else replace(red, alternative=pink)
    measured = al.simulate(pink, rate=1.0, duration=4000.0, seed=3)
    found = filter_recording(measured, model)
    assert found.model.family == worse
    words = {"flicker": "flicker", "gauss-markov": "a Gauss-Markov term"}[worse]
    assert f"this filter models {words}, which drifts more" in " ".join(found.notes)
    alone = filter_recording(measured, pink if worse == "flicker" else red)
    assert found.level_sd == alone.level_sd
    assert found.level_sd >= filter_recording(measured, red if worse == "flicker" else pink).level_sd


FITTED = NoiseModel(
    terms=GYRO.terms,
    kind="acceleration",
    estimates=(Estimate(symbol="N", value=1.0, lower=0.9, upper=1.1, supported=True),),
)


@pytest.mark.parametrize(
    ("model", "options", "message"),
    [
        (GYRO, {}, "name the channel"),
        ({"x": GYRO, "y": GYRO}, {}, "name the channel"),
        ({"z": GYRO}, {"channel": "x"}, "no model for channel 'x'; there are models for: z"),
        (GYRO, {"channel": "q"}, "no channel 'q'"),
        (GYRO, {"channel": "temp"}, "no filter"),
        (FITTED, {"channel": "x"}, "one of acceleration"),
        (NoiseModel.of(), {"channel": "x"}, "no noise in a sample"),
        ("white", {"channel": "x"}, "needs a NoiseModel"),
    ],
)
def test_refusals(model: Any, options: dict[str, Any], message: str) -> None:
    table = al.simulate({"x": GYRO, "y": GYRO}, rate=8.0, duration=10.0, seed=1)
    channels = (*table.channels, Channel.of("temp", "degC"))
    whole = Recording(channels=channels, columns=(*table.columns, ArrayColumn(np.zeros(80))), rate=8.0)
    with pytest.raises(InputError, match=message):
        filter_recording(whole, model, **options)


def test_a_record_too_short_for_turns_is_refused_as_too_short(run: Run, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time [s],gyro [deg/h]\n" + "".join(f"{k / 10},{30 + k % 2}\n" for k in range(5)))
    done = run("filter", log, "--model", "N=0.3 deg/√h, B=5 deg/h")
    assert done.code == 1
    assert "too_short" in done.err and "turns" not in done.err
