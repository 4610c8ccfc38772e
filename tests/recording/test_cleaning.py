# SPDX-License-Identifier: BSD-3-Clause
"""Each repair on a record whose fault is known: what is left is the record without it, and the history says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.recording.cleaning import REPAIRS, clean
from allanite.recording.health.catalogue import CATALOGUE
from allanite.recording.health.examination import check
from noise_records import record, white
from shell import Run

N = 20_000
FATAL = "fatal"


@pytest.fixture
def noise(rng: np.random.Generator) -> np.ndarray:
    """White noise of sd 1 at a level of 20."""
    return white(rng, N) + 20.0


def codes(recording: al.Recording) -> set[str]:
    return {f.code for f in check(recording)} - {"resolution_step", "dialect_guessed"}


def taken(recording: al.Recording) -> dict[str, Any]:
    """The one repair in the history."""
    (step,) = [s for s in recording.history if s["step"] == "repair"]
    return dict(step)


def test_every_repair_answers_findings_that_name_it() -> None:
    for name, repair in REPAIRS.items():
        assert repair.does, name
        for code in repair.answers:
            assert CATALOGUE[code].repair == name, code
    for code, entry in CATALOGUE.items():
        assert not entry.repair or code in REPAIRS[entry.repair].answers, code


def test_a_finding_names_its_repair_and_a_repair_is_a_finding(noise: np.ndarray) -> None:
    held = record(np.repeat(noise[:5000], 2))
    (found,) = [f for f in check(held) if f.code == "held_samples"]
    assert found.advice.endswith("(--repair drop_repeats)")
    (said,) = [f for f in check(clean(held, "drop_repeats")) if f.code == "repaired"]
    assert "drop_repeats: 5000 samples of signal taken out: every value stood 2 times" in said.message


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("drop_everything", "no repair named 'drop_everything'; there are: drop_saturated"),
        ("drop_padding=3", "drop_padding takes no value"),
        ("drop_spikes=two", "at least 4 standard deviations"),
        ("drop_spikes=2", "at least 4 standard deviations"),
        ("swap=x", "two names"),
        ("swap=x,u", "no channel 'u'"),
    ],
)
def test_what_cannot_be_meant_is_refused(rng: np.random.Generator, asked: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        clean(record(rng.standard_normal((100, 3))), [asked])


def test_honest_noise_is_left_as_it_is(rng: np.random.Generator) -> None:
    samples = (
        white(rng, 4000)[:, None] * [1.0, 2.0, 3.0] + [20.0, 30.0, 40.0] + rng.standard_normal((4000, 3))
    )
    whole = record(samples, unit="deg/s")
    stretches = [name for name in REPAIRS if name.startswith(("drop_", "cut_"))]
    cleaned = clean(whole, stretches)
    assert cleaned.rate == whole.rate
    for name in whole.names:
        np.testing.assert_array_equal(cleaned.values(name), whole.values(name))
    assert [s["repair"] for s in cleaned.history] == stretches
    assert all(sum(s["samples"].values()) == 0 for s in cleaned.history)


# -- stretches that become gaps ---------------------------------------------------------------------------


def padded(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first sample, and more than half of the record at its end, exactly zero (class 4)."""
    bad = np.zeros(len(y), dtype=bool)
    bad[0], bad[8000:] = True, True
    return np.where(bad, 0.0, y), bad


def frozen(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Readings frozen from some row on (class 4): the first of them is a reading, and cannot be told from the rest."""
    bad = np.arange(len(y)) >= 9000
    return np.where(bad, y[9000], y), bad


def overloaded(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Overload words in a hundredth of the record (battery B2)."""
    bad = np.arange(len(y)) % 100 == 7
    return np.where(bad, 9.9e37, y), bad


def halved(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half the level before a gap (class 4)."""
    bad = (np.arange(len(y)) >= 11_900) & (np.arange(len(y)) < 12_500)
    return np.where(np.arange(len(y)) >= 12_000, np.where(bad, np.nan, y), np.where(bad, y / 2, y)), bad


@pytest.mark.parametrize(
    ("fault", "repair", "code"),
    [
        (padded, "drop_padding", "zero_filled"),
        (frozen, "drop_padding", "stuck"),
        (overloaded, "drop_saturated", "overload"),
        (halved, "drop_cut_blocks", "half_before_gap"),
    ],
)
def test_bad_stretches_become_gaps_and_nothing_else_changes(
    noise: np.ndarray, fault: Any, repair: str, code: str
) -> None:
    y, bad = fault(noise * [1.0] if fault is not halved else 40.0 + noise)
    broken = record(y)
    assert code in codes(broken)
    fixed = clean(broken, [repair])
    left = fixed.values("signal")
    np.testing.assert_array_equal(np.isnan(left), bad)
    np.testing.assert_array_equal(left[~bad], y[~bad])
    there = int((bad & np.isfinite(y)).sum())
    assert taken(fixed)["samples"] == {"signal": there}
    assert codes(fixed) <= {"missing", "repaired"}
    assert not any(f.severity == FATAL for f in check(fixed))


def test_spikes_beyond_the_threshold_go_and_the_others_stay(noise: np.ndarray) -> None:
    y = noise.copy()
    y[[100, 3000, 12_000]] += [9.0, -14.0, 500.0]
    fixed = clean(record(y), ["drop_spikes=12"])
    assert np.flatnonzero(np.isnan(fixed.values("signal"))).tolist() == [3000, 12_000]
    step = taken(fixed)
    assert step["threshold"] == 12.0
    assert 12.0 < step["smallest"] < 18.0
    assert np.isnan(clean(record(y), "drop_spikes").values("signal")[[3000, 12_000]]).all()
    with pytest.raises(DataQualityError, match="too frequent for isolated impulses"):
        clean(record(noise + 30.0 * (np.arange(N) % 40 == 0) * noise), "drop_spikes")


def test_motion_is_cut_out_of_all_channels(rng: np.random.Generator) -> None:
    y = 0.01 * rng.standard_normal((N, 3)) + [1.0, 2.0, 3.0]
    moving = slice(4000, 5000)
    y[moving, 1] += np.sin(np.arange(1000) / 30.0)
    fixed = clean(record(y, unit="deg/s"), ["cut_motion"])
    gaps = np.isnan(fixed.values("y"))
    assert gaps[moving].all()
    assert gaps.sum() < 0.4 * N
    for name in fixed.names:
        np.testing.assert_array_equal(np.isnan(fixed.values(name)), gaps)
    assert codes(fixed) <= {"missing", "repaired"}
    before, after = (float(al.allan_curve(r)["y"].deviation[0, 0]) for r in (record(y, unit="deg/s"), fixed))
    assert abs(after / np.radians(0.01) - 1.0) < 4.0 / np.sqrt(N) < before / np.radians(0.01) - 1.0


def test_a_unit_that_was_turned_slowly_keeps_its_usual_attitude(rng: np.random.Generator) -> None:
    tilt = np.radians(np.clip((np.arange(N) - 14_000) / 1000.0, 0.0, 1.0) * 8.0)
    y = np.stack([9.8 * np.sin(tilt), np.zeros(N), 9.8 * np.cos(tilt)], axis=1)
    y += 0.02 * rng.standard_normal((N, 3))
    fixed = clean(record(y), ["cut_motion"])
    gaps = np.isnan(fixed.values("x"))
    assert gaps[14_600:].all()
    assert gaps[:13_000].mean() < 0.3


def test_a_record_of_many_attitudes_has_no_usual_one(rng: np.random.Generator) -> None:
    tilt = np.radians(10.0) * (np.arange(N) // 1000)
    y = np.stack([9.8 * np.sin(tilt), np.zeros(N), 9.8 * np.cos(tilt)], axis=1)
    with pytest.raises(DataQualityError, match="the sensor was rarely at rest"):
        clean(record(y + 0.02 * rng.standard_normal((N, 3))), "cut_motion")


# -- rows -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("factor", "first"), [(2, 0), (5, 3)])
def test_held_values_stand_once_at_their_own_rate(noise: np.ndarray, factor: int, first: int) -> None:
    logged = record(np.repeat(noise, factor)[first:], rate=500.0)
    assert "held_samples" in codes(logged)
    fixed = clean(logged, ["drop_repeats"])
    assert fixed.rate == 500.0 / factor
    whole = noise[1 if first else 0 :]
    np.testing.assert_array_equal(fixed.values("signal"), whole[: fixed.n_samples])
    assert fixed.n_samples >= len(whole) - 1
    assert codes(fixed) <= {"repaired"}


def test_a_repaired_record_begins_at_its_first_whole_value(noise: np.ndarray) -> None:
    logged = replace(record(np.repeat(noise[:4000], 5)[3:], rate=500.0), start=10**18)
    assert clean(logged, "drop_repeats").start == 10**18 + 2 * 2_000_000


def test_a_slower_sensor_read_at_an_uneven_ratio_gets_its_rate_back(noise: np.ndarray) -> None:
    row = np.floor(np.arange(N) * 0.8).astype(int)
    y = noise[row]
    y[10_000:12_000] = np.nan
    fixed = clean(record(y, rate=100.0), "drop_repeats")
    assert abs(fixed.rate / 80.0 - 1.0) < 1e-3
    values = fixed.values("signal")
    kept = values[np.isfinite(values)]
    np.testing.assert_array_equal(kept, np.concatenate([noise[:8000], noise[9600:16_000]]))
    gap = np.flatnonzero(np.isnan(values))
    assert len(gap) == pytest.approx(1600, abs=2)
    assert (np.diff(gap) == 1).all()


def test_values_on_coarse_steps_are_not_taken_for_repeats(rng: np.random.Generator) -> None:
    coarse = np.round(white(rng, N))
    with pytest.raises(DataQualityError, match="readings and repeats cannot be distinguished"):
        clean(record(coarse), "drop_repeats")


def test_channels_of_two_rates_are_not_forced_into_one(rng: np.random.Generator) -> None:
    y = np.stack([np.repeat(white(rng, N // 2), 2), np.repeat(white(rng, N // 4), 4)], axis=1)
    both = al.Recording.from_rate(y, rate=100.0, unit="deg/s", names=["a", "b"])
    with pytest.raises(InputError, match="a 2 times, b 4 times"):
        clean(both, "drop_repeats")
    assert clean(both.select("b"), "drop_repeats").rate == 25.0


def twice(rng: np.random.Generator, folder: Path, same: bool) -> Path:
    """A log of which a hundredth of the rows stands twice: with its values, or with others."""
    y = 0.3 + 0.01 * white(rng, N)
    rows = np.sort(np.concatenate([np.arange(N), rng.choice(N, N // 100, replace=False)]))
    values = y[rows] if same else 0.3 + 0.01 * white(rng, len(rows))
    place = folder / "twice.csv"
    np.savetxt(place, np.column_stack([rows / 100.0, values]), "%.9f", ",", header="t,gyro_z", comments="")
    return place


@pytest.mark.long
def test_rows_written_twice_stand_once_and_the_log_is_no_longer_refused(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    log = al.read(twice(rng, tmp_path, True), unit="deg/s")
    assert "time_stamps" in codes(log)
    fixed = clean(log, ["drop_duplicate_rows"])
    assert (fixed.n_samples, fixed.rate) == (N, 100.0)
    assert taken(fixed)["samples"] == {"gyro_z": N // 100}
    assert codes(fixed) <= {"repaired"}


@pytest.mark.long
def test_stamps_that_repeat_without_their_values_stay_refused(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    log = al.read(twice(rng, tmp_path, False), unit="deg/s")
    assert "time_stamps" in codes(clean(log, ["drop_duplicate_rows"]))


def test_a_clock_that_was_set_back_is_offered_no_repair_that_refuses(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    t = np.arange(4000) / 1.0
    t[2000:] -= 1000.0
    place = tmp_path / "winter.csv"
    np.savetxt(
        place, np.column_stack([t, white(rng, 4000)]), "%.6f", ",", header="time [s],gyro_z", comments=""
    )
    (found,) = (f for f in check(al.read(place, unit="deg/s")) if f.code == "time_stamps")
    assert "drop_duplicate_rows" not in found.advice and "--repair keep_run" in found.advice
    assert clean(al.read(place, unit="deg/s"), "keep_run").n_samples == 2000


def test_rows_out_of_order_are_no_matter_of_duplicates(rng: np.random.Generator) -> None:
    backward = record(white(rng, 1000))
    object.__setattr__(backward, "notes", {"timebase": {"backward": 2, "duplicates": 3}})
    with pytest.raises(DataQualityError, match="step back 2 times"):
        clean(backward, "drop_duplicate_rows")


def test_two_sensors_in_one_column_become_two_channels(rng: np.random.Generator) -> None:
    one, other = white(rng, N // 2) + 20.0, 3.0 * white(rng, N // 2) - 40.0
    y = np.stack([one, other], axis=1).ravel()
    fixed = clean(record(y, rate=200.0), ["split_interleaved"])
    assert (fixed.names, fixed.rate) == (("signal_1", "signal_2"), 100.0)
    np.testing.assert_array_equal(fixed.values("signal_1"), one)
    np.testing.assert_array_equal(fixed.values("signal_2"), other)
    with pytest.raises(DataQualityError, match="no channel alternates"):
        clean(record(one), "split_interleaved")


def test_values_in_every_fourth_row_keep_these_rows(noise: np.ndarray) -> None:
    y = np.full((N, 2), np.nan)
    y[1::4, 0], y[2::4, 1] = noise[: N // 4], noise[N // 4 : N // 2]
    sparse = al.Recording.from_rate(y, rate=100.0, unit="deg/s", names=["a", "b"])
    assert "broken_up" in codes(sparse)
    fixed = clean(sparse, "split_interleaved")
    assert fixed.rate == 25.0
    np.testing.assert_array_equal(fixed.values("a"), noise[: N // 4])
    np.testing.assert_array_equal(fixed.values("b"), noise[N // 4 : N // 2])


def test_two_names_are_exchanged_and_the_samples_stay(rng: np.random.Generator) -> None:
    y = rng.standard_normal((500, 3))
    fixed = clean(record(y), "swap=x,z")
    assert fixed.names == ("z", "y", "x")
    np.testing.assert_array_equal(fixed.values("z"), y[:, 0])


# -- the command line -------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_repaired_log_is_studied_and_converted_and_both_say_so(
    run: Run, rng: np.random.Generator, tmp_path: Path
) -> None:
    log, out = twice(rng, tmp_path, True), tmp_path / "once.parquet"
    refused = run("info", log, "--unit", "deg/s", "--json")
    assert '"time_stamps"' in refused.out
    done = run("convert", log, out, "--unit", "deg/s", "--repair", "drop_duplicate_rows")
    assert done.code == 3, done.err
    again = al.read(out)
    assert (again.n_samples, taken(again)["repair"]) == (N, "drop_duplicate_rows")
    facts = json.loads(run("info", log, "--unit", "deg/s", "--repair", "drop_duplicate_rows", "--json").out)
    assert {"repaired"} == {f["code"] for f in facts["findings"]} - {"dialect_guessed", "resolution_step"}
    assert facts["history"][-1]["samples"] == {"gyro_z": N // 100}
    wrong = run("info", log, "--unit", "deg/s", "--repair", "drop_it")
    assert wrong.code == 1
    assert "there are: drop_saturated" in wrong.err
