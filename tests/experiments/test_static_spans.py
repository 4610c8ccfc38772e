# SPDX-License-Identifier: BSD-3-Clause
"""Static spans of hand-moved logs: found, trimmed, not cut without reason, and what is no rest though it is still."""

from __future__ import annotations

import json
import math
import tracemalloc
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lfilter
from scipy.stats import binom, f

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.experiments.static_spans import (
    StaticSpans,
    find_static_spans,
    given_spans,
    read_spans,
    unit_axes,
)
from allanite.experiments.static_spans.cells import ChannelCells
from allanite.experiments.static_spans.floor import ratio_quantile
from allanite.noise import NoiseModel, White
from allanite.quantities.attitude import rotation
from allanite.recording.health.examination import check
from allanite.recording.records import Recording
from allanite.views.figures import sheet_of

Locate = Callable[[str], Path]
Array = NDArray[np.float64]

RATE = 100.0
G = 9.80665
DEG = math.pi / 180
#: White noise of a consumer unit: rad/s/sqrt(Hz), m/s^2/sqrt(Hz).
GYRO_N, ACCEL_N = 0.007 * DEG, 120e-6 * G
GYRO, ACCEL = ("gyro_x", "gyro_y", "gyro_z"), ("accel_x", "accel_y", "accel_z")
NAMED: Mapping[str, Any] = {"gyro": GYRO, "accelerometer": ACCEL}
MODEL = {
    **{n: NoiseModel.of(White(N=GYRO_N)) for n in GYRO},
    **{n: NoiseModel.of(White(N=ACCEL_N), kind="acceleration") for n in ACCEL},
}


def unit(
    gyro: Array, accel: Array, *, rate: float = RATE, units: tuple[str, str] = ("rad/s", "m/s²")
) -> Recording:
    a = Recording.from_rate(gyro, rate=rate, unit=units[0], names=GYRO)
    b = Recording.from_rate(accel, rate=rate, unit=units[1], names=ACCEL)
    return replace(a, channels=a.channels + b.channels, columns=a.columns + b.columns)


def noisy(turn: Array, force: Array, rng: np.random.Generator, rate: float = RATE) -> tuple[Array, Array]:
    """What a consumer unit shows of rates [rad/s] and forces [m/s^2], biases included."""
    gyro = turn + GYRO_N * math.sqrt(rate) * rng.standard_normal(turn.shape) + [0.01, -0.02, 0.005]
    return gyro, force + ACCEL_N * math.sqrt(rate) * rng.standard_normal(turn.shape)


def gravity_in(turn: Array, first: Array, rate: float = RATE) -> Array:
    """Specific force of a unit that turns like that, shape (n, 3)."""
    up = np.array([0.0, 0.0, G])
    attitude, steps, out = first, rotation(turn / rate), np.empty_like(turn)
    moving = turn.any(axis=1)
    for k in range(len(turn)):
        out[k] = up @ attitude
        if moving[k]:
            attitude = attitude @ steps[k]
    return out


def tremor(n: int, rms: float, rng: np.random.Generator, rate: float = RATE) -> Array:
    """Physiological tremor, 6 to 12 Hz."""
    t = np.arange(n)[:, None] / rate
    parts = [
        rng.normal(0, rms, 3) * np.sin(2 * np.pi * (rng.uniform(6, 12, 3) * t + rng.random(3)))
        for _ in range(4)
    ]
    return np.asarray(sum(parts)) / math.sqrt(2)


def hand_moved(
    seed: int, *, rests: int = 8, first: tuple[float, float] = (5, 30), rest: tuple[float, float] = (2, 6),
    rate: float = RATE, pause: float = 0.4,
) -> tuple[Recording, NDArray[np.int64]]:  # fmt: skip
    """A unit put down `rests` + 1 times, and where it truly is at rest [samples].

    Turns of 30 to 180 deg in 0.7 to 2.5 s, with tremor and thrusts; between two of them the hand may hold still.
    """
    rng = np.random.default_rng(seed)
    turns, thrusts, truth, n = [], [], [], 0
    for i in range(rests + 1):
        k = round(rng.uniform(*(rest if i else first)) * rate)
        truth.append((n, n + k))
        turns.append(np.zeros((k, 3)))
        thrusts.append(np.zeros((k, 3)))
        n += k
        for _ in range(int(rng.integers(1, 3)) if i < rests else 0):
            k = round(rng.uniform(0.7, 2.5) * rate)
            s = ((np.arange(k) + 0.5) / k)[:, None]
            ends = np.minimum(np.minimum(s, 1 - s) * 8, 1)
            axis = rng.standard_normal(3)
            angle = rng.uniform(30, 180) * DEG * axis / np.linalg.norm(axis)
            turns.append(30 * s**2 * (1 - s) ** 2 * angle * rate / k + ends * tremor(k, 3 * DEG, rng, rate))
            thrust = np.sin(2 * np.pi * s) * rng.uniform(0.2, 2) * rng.standard_normal(3)
            thrusts.append(ends * (tremor(k, 0.15, rng, rate) + thrust))
            n += k
            if rng.random() < pause:
                k = round(rng.uniform(0.5, 2) * rate)
                turns.append(tremor(k, 1 * DEG, rng, rate))
                thrusts.append(tremor(k, 0.05, rng, rate))
                n += k
    turn = np.concatenate(turns)
    force = gravity_in(turn, rotation(rng.standard_normal(3)), rate) + np.concatenate(thrusts)
    return unit(*noisy(turn, force, rng, rate), rate=rate), np.array(truth)


def clean(seed: int, seconds: float = 60.0) -> tuple[Array, Array]:
    rng = np.random.default_rng([4, seed])
    n = round(seconds * RATE)
    return noisy(np.zeros((n, 3)), np.tile([1.0, 3.0, 9.3], (n, 1)), rng)


def turned(rates: Array, seed: int = 0, **options: Any) -> StaticSpans:
    """Spans of a unit with these rates [rad/s]."""
    rng = np.random.default_rng(seed)
    force = gravity_in(rates, rotation([0.3, -0.5, 0.2]))
    return find_static_spans(unit(*noisy(rates, force, rng)), **{**NAMED, **options})


def why(found: StaticSpans) -> set[str]:
    return {m.why for m in found.moving}


# -- recall and precision ------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize(
    ("case", "logs", "options"),
    [
        ("both triads", 12, {}),
        ("gyros alone", 6, {"accelerometer": ()}),
        ("accelerometers alone", 6, {"gyro": ()}),
        ("by the model", 6, {"model": MODEL}),
    ],
)
def test_e_rests_of_hand_moved_logs_are_found_and_hold_no_motion(
    case: str, logs: int, options: dict[str, Any]
) -> None:
    """Every rest of 2 s is one span within 0.3 s of its ends, and no span reaches out of its rest."""
    for seed in range(logs):
        recording, truth = hand_moved(seed)
        found = find_static_spans(recording, **{**NAMED, **options}).array
        assert len(found) == len(truth), (case, seed)
        late = found[:, 0] - truth[:, 0]
        early = truth[:, 1] - found[:, 1]
        assert min(late.min(), early.min()) >= 0, (case, seed)
        assert max(late.max(), early.max()) <= 0.3 * RATE, (case, seed)


@pytest.mark.long
def test_e_a_log_that_is_mostly_motion_shows_its_short_rests() -> None:
    for seed in range(10):
        recording, truth = hand_moved(seed, first=(1.5, 2), rest=(1.5, 2), pause=1.0)
        found = find_static_spans(recording, **NAMED)
        assert found.share < 0.5
        assert len(found) == len(truth)
        assert (found.array[:, 0] >= truth[:, 0]).all() and (found.array[:, 1] <= truth[:, 1]).all()


def slow_turns(seed: int, rest: float = 2.0) -> tuple[Recording, Array]:
    """Three rests, each with a turn of ten seconds after it, and where they are [s]."""
    rng = np.random.default_rng(seed)
    still, s = np.zeros((round(rest * RATE), 3)), (np.arange(round(10 * RATE)) / (10 * RATE))[:, None]
    parts = []
    for _ in range(3):
        axis = rng.standard_normal(3)
        turn = rng.uniform(0.8, 2.5) * axis / np.linalg.norm(axis) * np.pi / 20 * np.sin(np.pi * s)
        parts += [still, turn]
    rates = np.concatenate(parts)
    starts = np.arange(3) * (rest + 10)
    return unit(*noisy(rates, gravity_in(rates, np.eye(3)), rng)), np.column_stack([starts, starts + rest])


@pytest.mark.long
def test_e_slow_turns_do_not_pass_for_the_rest_between_them() -> None:
    """A tenth of the record is at rest: short of it, nothing is found; but motion is not called rest."""
    lengths = inside = 0.0
    for seed in range(20):
        recording, truth = slow_turns(seed, rest=1.2)
        for start, stop in find_static_spans(recording, **NAMED).times:
            lengths += stop - start
            inside += max(min(stop, end) - max(start, begin) for begin, end in truth)
    assert lengths - inside < 0.01 * 20 * 33.6  # of all that was recorded


def test_e_a_channel_that_is_dead_is_named() -> None:
    recording, _ = hand_moved(1, rests=3)
    whole = np.stack([recording.values(n) for n in NAMED["gyro"] + NAMED["accelerometer"]], axis=1)
    for value, said in ((0.0, "accel_x repeats one value throughout"), (np.nan, "accel_x has no samples")):
        samples = np.array(whole)
        samples[:, 3] = value
        found = find_static_spans(unit(samples[:, :3], samples[:, 3:]), **NAMED)
        assert any(said in words for words in found.findings), found.findings
        assert (len(found) == 4) == (value == 0.0)


@pytest.mark.parametrize("rate", [10.0, 1000.0])
def test_e_other_sample_rates(rate: float) -> None:
    recording, truth = hand_moved(3, rate=rate, rests=4)
    found = find_static_spans(recording, **NAMED)
    assert np.abs(found.times - truth / rate).max() <= 0.3


@pytest.mark.long
@pytest.mark.parametrize(
    "kind", ["white", "model", "filtered", "drifting", "counts", "below one count", "gaps"]
)
def test_e_clean_records_are_not_cut(kind: str) -> None:
    """One record in a hundred may be cut: of n no more than the binomial law allows at 99.9 %.

    A third of them cut fails with 90 %.
    """
    n, cut = 20, 0
    for seed in range(n):
        gyro, accel = clean(seed)
        units = ("rad/s", "m/s²")
        if kind == "filtered":
            gyro, accel = (lfilter(*butter(2, 0.2), x - x[0], axis=0) for x in (gyro, accel))
        if kind == "drifting":
            ramp = np.linspace(0, 1, len(gyro))[:, None]
            gyro, accel = gyro + 3e-3 * ramp, accel + 0.03 * ramp
        if kind in ("counts", "below one count"):
            steps = (1e-3, 0.01) if kind == "counts" else (6e-3, 0.06)
            gyro, accel, units = np.round(gyro / steps[0]), np.round(accel / steps[1]), ("LSB", "LSB")
        if kind == "gaps":
            for start in np.random.default_rng(seed).integers(0, len(gyro) - 3, 20):
                gyro[start : start + 2] = accel[start : start + 2] = np.nan
        model = MODEL if kind == "model" else None
        found = find_static_spans(unit(gyro, accel, units=units), model=model, **NAMED)
        cut += len(found) != 1 or found.share < 1
    assert cut <= binom.ppf(0.999, n, 0.01)


def test_e_the_law_of_energies_over_a_floor_is_fishers() -> None:
    assert ratio_quantile(4, 30, 1e-3) == pytest.approx(f.isf(1e-3, 4, 30), rel=1e-9)
    assert ratio_quantile(1, math.inf, 1e-3) == pytest.approx(3.2905**2, rel=1e-4)
    assert 8**2 < ratio_quantile(1, 20, 1e-8) < 10**2  # where 1 - p has lost its digits


# -- slow, even, held, frozen -----------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [0.2, 0.05, 0.03])
def test_e_slow_tilts_below_the_noise_of_the_gyro_are_seen_by_the_accelerometer(rate: float) -> None:
    """0.03 deg/s moves 0.5 mg in a second: 4 times the noise of such means, and a gyro's noise is 0.07 deg/s."""
    rates = np.zeros((6000, 3))
    rates[2000:3000, 0] = rate * DEG
    found = turned(rates)
    assert len(found) == 2
    assert found.array[0, 1] <= 2000 + 50 and found.array[1, 0] >= 3000 - 50
    assert found.times[0, 1] > 17 and found.times[1, 0] < 33
    if rate < 0.1:
        assert len(turned(rates, accelerometer=())) == 1


def test_e_an_even_rotation_is_no_rest() -> None:
    """About the vertical, so that no accelerometer moves."""
    rates = np.zeros((6000, 3))
    vertical = np.array([0.0, 0.0, 1.0]) @ rotation([0.3, -0.5, 0.2])
    rates[2000:3000], rates[4000:4500] = 5 * DEG * vertical, -2 * DEG * vertical
    found = turned(rates)
    assert "turning" in why(found) and any("steady rate" in text for text in found.findings)
    assert all(not rates[a:b].any() for a, b in found.array) and len(found) == 3


@pytest.mark.parametrize("size", [0.2, 1.0])
def test_e_a_hand_that_holds_still_is_no_rest(size: float) -> None:
    """Without any rest in the record the floor is that of the hand; gyros and accelerometers agree about its motion."""
    rng = np.random.default_rng(5)
    t = np.arange(6000)[:, None] / RATE
    sway = sum(
        rng.standard_normal(3) * np.sin(2 * np.pi * (f * t + rng.random(3))) for f in (0.31, 0.55, 0.87, 1.3)
    )
    found = turned(size * DEG * sway / 2 + tremor(6000, size * DEG, rng))
    assert len(found) == 0 and why(found) == {"held"}
    assert "the accelerometers tilt as the gyros turn" in found.findings[0]
    known = turned(size * DEG * sway / 2 + tremor(6000, size * DEG, rng), model=MODEL)
    assert len(known) == 0 and "moving" in why(known)


def test_e_clipped_and_frozen_samples_are_no_rest() -> None:
    rng = np.random.default_rng(8)
    rates = np.zeros((6000, 3))
    rates[2000:2500, 0] = 6.0
    gyro, accel = noisy(rates, np.tile([0.0, 0.0, G], (6000, 1)), rng)
    clipped = find_static_spans(unit(np.clip(gyro, -4.36, 4.36), accel), **NAMED)
    gyro, accel = clean(1)
    gyro[2000:2500, 1] = gyro[2000, 1]
    frozen = find_static_spans(unit(gyro, accel), **NAMED)
    for found in (clipped, frozen):
        assert "frozen" in why(found) and len(found) == 2
        assert found.array[0, 1] <= 2000 and found.array[1, 0] >= 2500


def test_e_two_attitudes_are_two_spans_though_the_turn_between_them_is_missing() -> None:
    gyro, accel = clean(2)
    accel[3000:] = accel[3000:] @ rotation([1.0, 0, 0])
    assert len(find_static_spans(unit(gyro, accel), **NAMED)) == 2
    gyro[2950:3050] = accel[2950:3050] = np.nan
    found = find_static_spans(unit(gyro, accel), **NAMED)
    assert found.array.tolist() == [[0, 2950], [3050, 6000]] and why(found) == {"missing"}


def test_e_a_model_of_another_sensor_is_named() -> None:
    gyro, accel = clean(3)
    model = {**MODEL, "gyro_y": NoiseModel.of(White(N=0.1 * GYRO_N))}
    found = find_static_spans(unit(gyro, accel), model=model, **NAMED)
    assert len(found) == 0
    assert any("gyro_y" in text and "is it the model of this sensor" in text for text in found.findings)
    assert found.noise == "model"
    assert find_static_spans(unit(gyro, accel), model=MODEL["gyro_x"]).noise == "both"


def test_models_may_be_given_by_role() -> None:
    record = unit(*clean(3))
    by_role = find_static_spans(record, model={"gyro": MODEL["gyro_x"], "accelerometer": MODEL["accel_x"]})
    by_name = find_static_spans(record, model=MODEL)
    assert by_role.to_json() == by_name.to_json() and by_role.noise == "model"
    assert find_static_spans(record, model={"gyro": MODEL["gyro_x"]}).noise == "both"


# -- axes, given spans, documents ----------------------------------------------------------------------------------


def test_the_axes_of_a_unit_are_found_by_kind_or_named() -> None:
    recording = unit(*clean(0, 2.0))
    assert unit_axes(recording).names == GYRO + ACCEL
    assert unit_axes(recording, accelerometer=()).triads == {"gyro": GYRO}
    counts = unit(*clean(0, 2.0), units=("LSB", "LSB"))
    with pytest.raises(InputError, match=r"accel_x \(counts\).*--scale-factor .*--gyro .* --accelerometer "):
        unit_axes(counts)
    assert unit_axes(counts, **NAMED).accelerometer == ACCEL
    six = Recording.from_rate(np.zeros((10, 6)), rate=1.0, unit="deg/s", names=list("abcdef"))
    with pytest.raises(InputError, match=r"6 channels of rates: a, b, c, d, e, f\. Say which three"):
        unit_axes(six)
    with pytest.raises(InputError, match="2 channels of accelerations"):
        unit_axes(recording.select(*GYRO, *ACCEL[:2]))
    with pytest.raises(InputError, match="three different channels"):
        unit_axes(recording, gyro=("gyro_x", "gyro_x", "gyro_y"))
    with pytest.raises(InputError, match="cannot be axes of the gyro"):
        unit_axes(recording, gyro=ACCEL)
    with pytest.raises(InputError, match="gyro and accelerometer at once"):
        unit_axes(counts, gyro=ACCEL, accelerometer=ACCEL)


@pytest.mark.parametrize(
    "options", [{"shortest": 0.0}, {"shortest": 1e4}, {"model": {"nobody": MODEL["gyro_x"]}}]
)
def test_what_cannot_be_searched_is_refused(options: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        find_static_spans(unit(*clean(0, 2.0)), **options)


def test_spans_may_be_given_in_seconds_or_in_a_file(tmp_path: Path) -> None:
    recording = unit(*clean(0, 10.0))
    given = given_spans([(0, 2.5), (3, 9.99)], recording, labels=["up", "down"])
    assert given.array.tolist() == [[0, 250], [300, 999]] and why(given) == {"unlisted"}
    path = tmp_path / "spans.csv"
    path.write_text("start,stop,label\n0,2.5,up\n3,9.99,down\n", encoding="utf-8")
    read = read_spans(path, recording)
    assert read.spans == given.spans and read.source == "file"
    for wrong in ([(2, 1)], [(0, 3), (2, 4)], [(5, 6), (0, 1)], [(0, 11)], [], [(0, math.nan)], [(1, 2, 3)]):
        with pytest.raises(InputError):
            given_spans(wrong, recording)
    with pytest.raises(InputError, match="static span 2: 2 s to 4 s overlaps with the one before"):
        given_spans([(0, 3), (2, 4)], recording)
    path.write_text("start\n1\n", encoding="utf-8")
    with pytest.raises(FormatError, match="stop"):
        read_spans(path, recording)


@pytest.mark.parametrize("rate", [1.3, 2.0, 3.2, 5.0, 12.0, 100.0])
def test_a_unit_at_rest_is_at_rest_however_long_the_cells(rate: float) -> None:
    """Slow logs and very long ones have cells of more than 0.05 s, in which less is left of the fall of the noise."""
    n, rng = 6000, np.random.default_rng(round(10 * rate))
    gyro, accel = noisy(np.zeros((n, 3)), np.tile([0.0, 0.0, G], (n, 1)), rng, rate)
    for samples, white in ((gyro, GYRO_N), (accel, ACCEL_N)):  # a walk of a tenth of the white noise at 0.6 s
        samples += 0.9 * white / math.sqrt(rate) * np.cumsum(rng.standard_normal((n, 3)), axis=0)
    found = find_static_spans(unit(gyro, accel, rate=rate), **NAMED)
    (span,) = found.spans
    assert span.start == 0 and span.stop > 0.99 * n


@pytest.mark.long
def test_memory_is_some_tens_of_bytes_for_a_cell_of_an_axis() -> None:
    """A hundred where all axes of all cells were looked at together: 2.4 GB for a record of 4 million cells."""
    samples = 600_000
    gyro, accel = noisy(
        np.zeros((samples, 3)), np.tile([0.0, 0.0, G], (samples, 1)), np.random.default_rng(5)
    )
    record, cells = unit(gyro, accel, rate=40.0), samples // 2
    tracemalloc.start()
    found = find_static_spans(record, **NAMED)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(found) == 1
    assert peak < 70 * cells * 6


def test_means_of_cells_are_made_once_for_a_span(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the whole record for each of its spans take time with the square of its length."""
    made = 0

    def counted(cells: ChannelCells, start: int = 0, stop: int | None = None) -> Array:
        nonlocal made
        made += (cells.n if stop is None else stop) - start
        return mean(cells, start, stop)

    mean = ChannelCells.mean
    monkeypatch.setattr(ChannelCells, "mean", counted)
    record, _ = slow_turns(1, rest=6.0)
    found = find_static_spans(record, **NAMED)
    assert len(found) == 3
    assert 0 < made <= 2 * record.n_samples / round(0.05 * RATE)


def test_documents_come_back_and_are_drawn() -> None:
    recording, truth = hand_moved(1, rests=3)
    found = find_static_spans(recording, **NAMED)
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    again = StaticSpans.from_json(document)
    assert again.spans == found.spans and again.moving == found.moving and again.floor == found.floor
    parts = sorted([(s.start, s.stop) for s in (*found.spans, *found.moving)])
    assert parts[0][0] == 0 and parts[-1][1] == recording.n_samples
    assert all(a[1] == b[0] for a, b in zip(parts, parts[1:], strict=False))
    sheet = sheet_of(document, recording=recording)
    assert [p.title for p in sheet.panels[1:]] == ["Rates", "Accelerations"]
    for panel in sheet.panels:
        quiet = [s for s in panel.spans if s.kind == "quiet"]
        assert len(quiet) == len(truth) and [name for _, name in panel.x.landmarks] == ["1", "2", "3", "4"]
    assert len(sheet_of(found).panels) == 1
    assert al.plot(found, recording=recording).axes
    with pytest.raises(InputError, match="recording="):
        sheet_of(given_spans([(0, 1)], recording))
    for damaged in ({}, {**document, "version": 9}, {**document, "spans": [{"start": 3}]}):
        with pytest.raises(FormatError):
            StaticSpans.from_json(damaged)


@pytest.mark.long
def test_e_motion_in_a_record_said_to_be_static_is_a_finding() -> None:
    """A tilt of 3 deg within a minute: slower than anything that the windows of single axes compare."""
    rates = np.zeros((30_000, 3))
    rates[18_000:24_000, 0] = 0.05 * DEG
    rng = np.random.default_rng(1)
    moved = unit(*noisy(rates, gravity_in(rates, np.eye(3)), rng))
    said = {f.code: f for f in check(moved)}
    assert "the unit was turned" in said["motion"].message
    assert min(a for a, _ in said["motion"].spans) > 18_000
    still = unit(*noisy(0 * rates, np.tile([0.0, 0.0, G], (30_000, 1)), rng))
    assert "motion" not in {f.code for f in check(still)}
    assert "motion" in {f.code for f in check(hand_moved(0)[0])}


# -- real recordings -----------------------------------------------------------------------------------------------


def test_xsens_poses(real_data: Locate) -> None:
    """50 s of rest, then 38 or 39 poses by the publication; three of them are shaken and fall into two spans each."""
    accel = np.loadtxt(real_data("imu_tk_xsens/xsens_acc.mat"))[:, 1:]
    gyro = np.loadtxt(real_data("imu_tk_xsens/xsens_gyro.mat"))[:, 1:]
    found = find_static_spans(unit(gyro, accel, units=("LSB", "LSB")), **NAMED)
    assert 49 < found.durations[0] < 52.5
    assert 39 <= len(found) <= 44
    means = np.array([accel[a:b].mean(axis=0) for a, b in found.array]) - [33123, 33276, 32360]
    length = np.linalg.norm(means / [415, 413, 415], axis=1)
    assert np.abs(length / 9.81744 - 1).max() < 0.02  # the certificate without its misalignments


def test_openaxes_poses(real_data: Locate) -> None:
    path = real_data("openaxes_d20/log_imu9_2022-06-22_22-13-55.csv")
    samples = np.loadtxt(path, delimiter=";", skiprows=1, usecols=range(8, 17))
    found = find_static_spans(unit(samples[:, 6:9], samples[:, 3:6], rate=100.06))
    assert 37 <= len(found) <= 39  # 38 poses
    finer = find_static_spans(unit(samples[:, 6:9], samples[:, :3], rate=100.06))
    assert 28 <= len(finer) <= 38  # the quieter accelerometer sees the fixture settle


def test_mpu6050_static_and_hand_held(real_data: Locate) -> None:
    def read(name: str) -> Recording:
        d = np.loadtxt(real_data(f"tomisuarez_mpu6050/{name}.csv"), delimiter=",", skiprows=5)
        return unit(d[:, 3:], d[:, :3], units=("LSB", "LSB"))

    static = find_static_spans(read("example_data_tinit_calc"), **NAMED)
    assert len(static) == 1 and static.share == 1
    listed = np.loadtxt(real_data("tomisuarez_mpu6050/static_intervals.csv"), delimiter=",").T
    found = find_static_spans(read("example_data_calibration"), **NAMED)
    # of the ten intervals of the repository six are shorter than 1.1 s, and in most of them a hand holds the unit
    assert 3 <= len(found) < len(listed)
    assert found.times[0, 1] > listed[0, 1] / RATE and found.times[0, 0] < 1


@pytest.mark.parametrize("number", range(5))
def test_mpu9150_moved_by_hand(real_data: Locate, number: int) -> None:
    d = np.loadtxt(real_data(f"mikoff_mpu9150/imu{number}.log"))
    found = find_static_spans(unit(d[:, 3:], d[:, :3]))
    assert 15 <= len(found) <= 21 and 0.38 < found.share < 0.47  # five units on one board
    length = [np.linalg.norm(d[a:b, :3].mean(axis=0)) for a, b in found.array]
    assert np.ptp(length) < 0.1 * G


def test_nineteen_positions_without_noise(real_data: Locate) -> None:
    d = np.fromfile(real_data("psins_sysclbt_simulated/imusysclbt.bin"), "<f4").reshape(-1, 7) * 100
    found = find_static_spans(unit(d[:, :3], d[:, 3:6]))
    assert len(found) == 19
    assert np.allclose(found.durations[:3], [69, 89, 39], atol=2.6)  # turns fade in and out over a second
    rates = np.array([np.linalg.norm(d[a:b, :3].mean(axis=0)) for a, b in found.array])
    assert np.allclose(rates, rates[0], rtol=0.05)


def test_laser_gyros_in_a_parked_vehicle(real_data: Locate) -> None:
    """Heading of y 90.6 deg; the mean of the first 300 s says 83.2."""
    d = np.loadtxt(real_data("psins_lasergyro/lasergyro.imu"), comments="%")[3:]
    gyro, accel = d[:, :3] * 10 / 3600 * DEG, d[:, 3:6] * 0.0125 * G
    found = find_static_spans(unit(gyro, accel))
    assert 0.5 < found.share < 0.9
    assert sum(b - a for a, b in found.array if b <= 12_000) < 6_000  # people are getting in
    used = np.concatenate([np.arange(a, b) for a, b in found.array])
    rate, up = gyro[used].mean(axis=0), accel[used].mean(axis=0)
    up /= np.linalg.norm(up)
    north = rate - up * (rate @ up)
    y = np.array([0.0, 1.0, 0.0]) - up * up[1]
    heading = math.degrees(math.atan2(y @ np.cross(north, up), y @ north))
    assert heading == pytest.approx(90.6, abs=1.0)
