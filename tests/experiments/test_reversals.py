# SPDX-License-Identifier: BSD-3-Clause
"""Turns are found and nothing else is; directions are right or unknown, never wrong."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import DataQualityError, FormatError, InputError
from allanite.experiments.reversals import (
    Reversals,
    find_reversals,
    periodic_reversals,
    read_positions,
    read_turns,
)
from allanite.filtering.simulation import Motion, simulate
from allanite.recording.health.finding import Severity
from allanite.recording.records import Recording
from allanite_seed_paper import twin as seed_paper

Array = NDArray[np.float64]
DEGREE = math.pi / 180
RATE = 32.0


# -- truth ------------------------------------------------------------------------------------------------


def scored(reversals: Reversals, truth: dict[str, Any]) -> dict[str, int]:
    """Turns, those found as one, those found in vain, samples against their direction, moving samples used."""
    rate, signs = reversals.rate, reversals.signs()
    true = np.array([(t["start"], t["stop"]) for t in truth["turns"]]).reshape(-1, 2)
    spans = np.array([(t.start, t.stop) for t in reversals.turns], dtype=np.float64).reshape(-1, 2) / rate
    wrong = 0
    for p in truth["positions"]:
        part = signs[round(p["start"] * rate) : round(p["stop"] * rate)]
        wrong += int((part * math.cos(p["heading"]) < 0).sum())
    return {
        "turns": len(true),
        "found": sum(bool(((spans[:, 0] <= a + 0.1) & (spans[:, 1] >= b - 0.1)).any()) for a, b in true),
        "vain": sum(not ((true[:, 0] < b) & (true[:, 1] > a)).any() for a, b in spans),
        "wrong": wrong,
        "moving": sum(int((signs[math.floor(a * rate) : math.ceil(b * rate)] != 0).sum()) for a, b in true),
    }


def perfect(reversals: Reversals, truth: dict[str, Any]) -> bool:
    score = scored(reversals, truth)
    return score["found"] == score["turns"] and score["vain"] == score["wrong"] == score["moving"] == 0


def truth_of(recording: Recording) -> dict[str, Any]:
    return dict(recording.history[-1]["motion"])


def noise(duration: float, seed: int, rate: float = RATE) -> Array:
    """White, Gauss-Markov and walk of the seed paper's gyro [deg/s]."""
    record = simulate(seed_paper.sensor(), rate=rate, duration=duration, seed=seed, unit="deg/s")
    return record.values("gyro").copy()


def turned(
    duration: float,
    seed: int,
    *,
    dwell: Callable[[np.random.Generator], float] = lambda chance: 30.0 + chance.standard_normal(),
    forth_and_back: bool = True,
    rate: float = RATE,
    angles: dict[int, float] | None = None,
    clip: float = math.inf,
) -> tuple[Array, dict[str, Any]]:
    """A record [deg/s] that this file makes by itself, so that samples can be spoilt: and its truth."""
    chance = np.random.default_rng(seed)
    y = noise(duration, seed, rate)
    edges = np.arange(len(y) + 1) / rate
    turns: list[dict[str, float]] = []
    positions = []
    at, heading = 0.0, 0.0
    while True:
        start = at + dwell(chance)
        stop = start + chance.uniform(1.0, 3.0)
        if stop > duration - 1.0:
            break
        angle = (angles or {}).get(len(turns), 180.0)
        way = -1.0 if forth_and_back and len(turns) % 2 else 1.0
        u = np.clip((edges - start) / (stop - start), 0.0, 1.0)
        y += way * angle * rate * np.diff(u**3 * (10 - u * (15 - 6 * u)))
        positions.append({"start": at, "stop": start, "heading": heading})
        turns.append({"start": start, "stop": stop})
        at, heading = stop, heading + way * angle * DEGREE
    positions.append({"start": at, "stop": duration, "heading": heading})
    return np.clip(y, -clip, clip), {"turns": turns, "positions": positions}


def record(y: Array, unit: str = "deg/s", rate: float = RATE, **options: Any) -> Recording:
    return Recording.from_rate(y, rate=rate, unit=unit, **options)


def codes(reversals: Reversals) -> set[str]:
    return {f.code for f in reversals.findings}


def at(seconds: float) -> int:
    return round(seconds * RATE)


# -- the four takes ---------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_e_turns_of_random_takes_all_found_and_every_direction_right(number: int) -> None:
    chance = np.random.default_rng(number)
    for run in range(8):
        take = seed_paper.take(
            number,
            seed=run,
            faults=[f for f in ("settling", "coherent", "drift") if chance.integers(2)],
            dwell_sd=float(chance.choice([0.0, 1.0, 2.0])),
            overload=("clip", "nan", "1e38")[run % 3],
            full_scale=(30.0, 60.0, 110.0, 1000.0)[run % 4] * DEGREE,
            onward=bool(run % 2),
            knocks_per_hour=10.0,
        )
        found = find_reversals(take)
        assert perfect(found, truth_of(take)), (run, scored(found, truth_of(take)))
        assert np.mean(found.signs() != 0) > 0.78  # of 30 s: turn 2, dead time 2, guard 0.5, flanks 0.5


@pytest.mark.long
def test_e8_no_turn_in_records_at_rest() -> None:
    for run in range(40):
        still = simulate(
            seed_paper.sensor(flicker=bool(run % 2)),
            rate=RATE,
            duration=(720.0, 1500.0)[run % 2],
            seed=run,
            unit="deg/s",
            motion=Motion.still(knocks_per_hour=6.0 * (run % 3)),
            latitude=seed_paper.LATITUDE,
            warm_up=(1.0 * DEGREE, 120.0),
        )
        found = find_reversals(still)
        assert found.static and found.source == "none" and len(found.positions) == 1
        assert np.mean(found.signs() == 1) > 0.97


@pytest.mark.long
def test_a_week_at_rest_is_static_in_bounded_memory_and_seconds() -> None:
    import time
    import tracemalloc

    week = record(np.random.default_rng(1).standard_normal(19_353_600).astype(np.float32))
    find_reversals(week.window(0.0, 60.0))
    tracemalloc.start()
    begun = time.process_time()
    assert find_reversals(week).static
    assert time.process_time() - begun < 10.0
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


@pytest.mark.long
def test_dwells_log_uniform_from_10_to_600_s() -> None:
    for seed in range(3):
        y, truth = turned(
            7200.0, seed, dwell=lambda chance: float(np.exp(chance.uniform(math.log(10.0), math.log(600.0))))
        )
        found = find_reversals(record(y))
        assert perfect(found, truth)
        assert not codes(found) & {"turn_missed", "turn_doubled", "direction_unknown"}


# -- disturbances that are no turns -----------------------------------------------------------------------


def test_knock_inside_a_dwell_is_cut_out_and_changes_no_direction() -> None:
    y, truth = turned(720.0, 3)
    p = truth["positions"][4]
    k = at(0.5 * (p["start"] + p["stop"]))
    y[k : k + 8] += 80.0 * np.sin(np.arange(8) * math.pi / 4)
    found = find_reversals(record(y))
    assert perfect(found, truth)
    assert [d.kind for d in found.disturbed] == ["knock"] and codes(found) == {"dwell_disturbed"}
    assert not found.signs()[k - 8 : k + 16].any()
    pieces = [d for d in found.dwells if d.position == 4]
    assert len(pieces) == 2 and pieces[0].sign == pieces[1].sign


@pytest.mark.parametrize("size", [1e3, 1e6, 1e30])
def test_a_bit_error_is_no_turn_whatever_its_size(size: float) -> None:
    y, truth = turned(720.0, 4)
    y[at(100.0)] = size
    assert perfect(find_reversals(record(y)), truth)


def test_there_and_back_at_once_changes_no_direction() -> None:
    y, truth = turned(720.0, 5)
    k = at(truth["positions"][6]["start"] + 14.0)
    t = (np.arange(64) + 0.5) / 64
    y[k : k + 64] += 180 * 30 * (t * (1 - t)) ** 2 / 2
    y[k + 64 : k + 128] -= 180 * 30 * (t * (1 - t)) ** 2 / 2
    found = find_reversals(record(y))
    assert perfect(found, truth) and "dwell_disturbed" in codes(found)


def test_settling_rotation_neither_merges_turns_nor_counts_as_one() -> None:
    for seed in range(3):
        take = seed_paper.take(3, seed=seed, settling_angle=0.3 * DEGREE, settling_time=10.0)
        found = find_reversals(take)
        assert perfect(found, truth_of(take)) and codes(found) == {"turns_clipped"}
        assert max(t.stop - t.start for t in found.turns) < 4.5 * RATE


@pytest.mark.parametrize("time_constant", [60.0, 300.0, 1800.0])
def test_warm_up_of_a_degree_per_second_disturbs_nothing(time_constant: float) -> None:
    y, truth = turned(1500.0, 6)
    y += np.exp(-np.arange(len(y)) / RATE / time_constant)
    found = find_reversals(record(y))
    assert perfect(found, truth) and not found.disturbed


def test_stuck_seconds_are_left_out_and_a_stuck_minute_hides_turns() -> None:
    y, truth = turned(720.0, 7)
    k = at(truth["positions"][3]["start"] + 10.0)
    short = y.copy()
    short[k : k + 100] = short[k]
    found = find_reversals(record(short))
    assert perfect(found, truth) and "dwell_stuck" in codes(found)
    assert not found.signs()[k : k + 100].any()
    y[k : k + at(60.0)] = y[k]
    found = find_reversals(record(y))
    score = scored(found, truth)
    assert score["wrong"] == score["vain"] == 0 and score["turns"] - score["found"] <= 2
    assert not found.signs()[k : k + at(60.0)].any()
    assert np.mean(found.signs() != 0) > 0.65  # the turns around it tell the direction afterwards


# -- turns missed, doubled, unlike ------------------------------------------------------------------------


def test_missed_turn_is_named_and_the_direction_stays() -> None:
    take = seed_paper.take(2, seed=1, missed=(8,))
    found = find_reversals(take)
    assert perfect(found, truth_of(take))
    (missed,) = (f for f in found.findings if f.code == "turn_missed")
    assert missed.severity is Severity.INFO
    assert abs(missed.places[0][0] / RATE - 8 * 30.0) < 5.0


def test_doubled_turn_counts_twice_and_is_named() -> None:
    y, truth = turned(720.0, 8, dwell=lambda chance: 30.0 if chance.uniform() < 0.85 else 4.0)
    found = find_reversals(record(y))
    assert perfect(found, truth) and "turn_doubled" in codes(found)


def test_quarter_and_full_turns_are_named_and_give_no_false_direction() -> None:
    y, truth = turned(720.0, 9, angles={3: 90.0, 4: -90.0, 10: 360.0}, forth_and_back=False)
    found = find_reversals(record(y))
    assert perfect(found, truth) and "turn_unlike" in codes(found)
    signs = [p.sign for p in found.positions]
    assert signs[3:6] == [-1, 0, -1] and signs[10] == signs[11]
    assert math.isnan(found.positions[4].heading)


def test_two_quarter_turns_the_same_way_are_a_half() -> None:
    y, truth = turned(720.0, 10, angles={3: 90.0, 4: 90.0}, forth_and_back=False)
    found = find_reversals(record(y))
    assert perfect(found, truth)
    assert [p.sign for p in found.positions][3:6] == [-1, 0, 1]


# -- missing samples --------------------------------------------------------------------------------------


def test_turns_of_which_only_missing_samples_are_left() -> None:
    y, truth = turned(720.0, 11)
    for t in truth["turns"]:
        y[at(t["start"] - 0.2) : at(t["stop"] + 0.2)] = np.nan
    found = find_reversals(record(y))
    assert perfect(found, truth) and "turn_hidden" in codes(found)


@pytest.mark.parametrize("word", [9.9e37, 1e38, -math.inf])
def test_turns_of_which_only_overload_words_are_left(word: float) -> None:
    y, truth = turned(
        1500.0, 12, dwell=lambda chance: float(np.exp(chance.uniform(math.log(10.0), math.log(200.0))))
    )
    for t in truth["turns"]:
        y[at(t["start"] - 0.2) : at(t["stop"] + 0.2)] = word
    assert perfect(find_reversals(record(y)), truth)


def test_single_turn_out_of_sight_is_settled_by_the_rhythm_or_by_the_sense_of_the_others() -> None:
    for forth_and_back in (True, False):
        y, truth = turned(720.0, 13, forth_and_back=forth_and_back)
        t = truth["turns"][7]
        y[at(t["start"] - 0.5) : at(t["stop"] + 0.5)] = np.nan
        found = find_reversals(record(y))
        assert perfect(found, truth) and "turn_hidden" in codes(found)


def test_isolated_gap_in_a_dwell_is_no_turn_and_stays_in_it() -> None:
    y, truth = turned(720.0, 14)
    k = at(truth["positions"][5]["start"] + 12.0)
    y[k : k + at(3.0)] = np.nan
    found = find_reversals(record(y))
    assert perfect(found, truth) and "gap_without_turn" in codes(found)
    assert found.signs()[k : k + at(3.0)].all()


def test_samples_missing_at_random_do_no_harm() -> None:
    y, truth = turned(720.0, 15)
    y[np.random.default_rng(1).random(len(y)) < 0.3] = np.nan
    assert perfect(find_reversals(record(y)), truth)


@pytest.mark.long
def test_gap_of_ten_minutes_leaves_the_direction_unknown_unless_the_sense_of_turns_tells_it() -> None:
    for seed in range(6):
        for forth_and_back in (True, False):
            y, truth = turned(2400.0, 20 + seed, forth_and_back=forth_and_back)
            y[at(900.0) : at(1500.0)] = np.nan
            found = find_reversals(record(y))
            score = scored(found, truth)
            assert score["wrong"] == 0 and score["vain"] == 0
            after = found.signs()[at(1510.0) :]
            (told,) = (f for f in found.findings if f.code == "direction_unknown")
            assert "900" in told.message
            known = np.mean(after != 0)
            assert known > 0.7 if forth_and_back else known == 0.0
            later = [p for p in found.positions if p.segment == 1]  # relative to each other they are known
            assert all(
                abs(math.remainder(b.relative - a.relative - math.pi, math.tau)) < 1e-9
                for a, b in zip(later, later[1:], strict=False)
            )


# -- units, rates, small records --------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["LSB", "V", "unknown"])
def test_without_a_physical_unit_size_tells_turns_from_knocks(unit: str) -> None:
    y, truth = turned(720.0, 30)
    y[at(50.0) : at(50.2)] += 40.0
    found = find_reversals(record(y * 131.0, unit=unit))
    assert perfect(found, truth) and "turns_by_size" in codes(found)
    assert all(math.isnan(t.angle) for t in found.turns)


def test_angles_are_measured_and_never_hang_on_the_unit() -> None:
    y, truth = turned(720.0, 31)
    for unit, scale in (("deg/s", 1.0), ("rad/s", DEGREE), ("deg/h", 3600.0)):
        found = find_reversals(record(y * scale, unit=unit))
        assert perfect(found, truth)
        assert all(abs(abs(t.angle) / math.pi - 1) < 5e-3 for t in found.turns)


@pytest.mark.parametrize("step", [0.05, 0.5, 5.0])
def test_quantised_record(step: float) -> None:
    y, truth = turned(720.0, 32)
    assert perfect(find_reversals(record(np.round(y / step).astype(np.int32), unit="LSB")), truth)
    assert perfect(find_reversals(record(np.round(y / step) * step)), truth)


@pytest.mark.parametrize("rate", [2.0, 10.0, 400.0])
def test_other_sample_rates(rate: float) -> None:
    y, truth = turned(720.0, 33, rate=rate)
    assert perfect(find_reversals(record(y, rate=rate)), truth)


def test_record_of_angles() -> None:
    y, truth = turned(720.0, 34)
    angle = Recording.from_angle(np.cumsum(y) / RATE, rate=RATE, unit="deg")
    assert perfect(find_reversals(angle), truth)


@pytest.mark.parametrize("coupling", [0.02, 0.2])
def test_axis_that_sees_only_a_part_of_the_turn(coupling: float) -> None:
    """An axis that is reversed is at right angles to the turn: ideally it sees nothing of it."""
    take = seed_paper.take(3, seed=2, coupling=coupling)
    found = find_reversals(take)
    score = scored(found, truth_of(take))
    assert score["wrong"] == score["vain"] == 0 and len(found.turns) == score["turns"]
    assert {f.severity for f in found.findings if f.code == "turns_by_size"} == {Severity.WARNING}


def test_very_short_records_and_empty_ones() -> None:
    assert find_reversals(record(noise(2.0, 1))).static
    one = find_reversals(record(noise(0.5, 1)))
    assert one.static and len(one.dwells) == 0  # under a second there is no dwell
    assert find_reversals(record(np.full(1000, 3.0))).static
    with pytest.raises(DataQualityError, match="has 0 samples"):
        find_reversals(record(np.full(1000, np.nan)))


def test_one_reversal_is_enough() -> None:
    y, truth = turned(70.0, 35)
    found = find_reversals(record(y))
    assert len(found.turns) == len(truth["turns"]) >= 1 and perfect(found, truth)


# -- the result -------------------------------------------------------------------------------------------


def test_first_direction_is_the_users() -> None:
    y, _ = turned(720.0, 40)
    north, south, none = (find_reversals(record(y), first=f) for f in ("north", "south", None))
    assert np.array_equal(north.signs(), -south.signs())
    assert south.positions[0].heading == math.pi and south.first == "south"
    assert np.array_equal(none.signs(), north.signs()) and none.first == "unknown"
    with pytest.raises(InputError, match="'east'"):
        find_reversals(record(y), first="east")


def test_dead_time_is_cut_anew_from_the_ends_of_the_turns() -> None:
    y, _ = turned(720.0, 41)
    found = find_reversals(record(y), dead_time=2.0)
    none, long, all_of_it = (found.with_dead_time(s) for s in (0.0, 5.0, 60.0))
    assert found.dwells[0].start == 0
    for d, e, f, t in zip(none.dwells[1:], found.dwells[1:], long.dwells[1:], found.turns, strict=True):
        assert (d.start, e.start, f.start) == (t.stop, t.stop + at(2.0), t.stop + at(5.0))
        assert d.stop == e.stop == f.stop
    assert found.dwells[0].stop == found.turns[0].start - at(0.5)
    assert len(all_of_it.dwells) == 1  # before the first turn nothing was turned
    assert all_of_it.with_dead_time(2.0) == found
    for wrong in (-1.0, math.nan, "2"):
        with pytest.raises(InputError, match="dead time"):
            found.with_dead_time(wrong)  # type: ignore[arg-type]


def test_json_and_table_agree() -> None:
    y, truth = turned(720.0, 42, angles={3: 90.0})
    y[at(truth["positions"][2]["start"] + 9.0)] = 1e4
    found = find_reversals(record(y))
    plain = json.loads(json.dumps(found.to_json(), allow_nan=False))
    again = Reversals.from_json(plain)
    assert again.to_json() == found.to_json() and np.array_equal(again.signs(), found.signs())
    with pytest.raises(InputError, match="not a list of turns"):
        Reversals.from_json({"rate": 1.0})
    rows = found.table()
    assert len(rows) == len(found.dwells)
    assert {r["direction"] for r in rows} == {"north", "south", "unknown"}
    assert "turns" in repr(found)


def test_channel_must_be_clear() -> None:
    y, truth = turned(300.0, 43)
    both = Recording.from_rate(np.stack([y, y], axis=1), rate=RATE, unit="deg/s", names=["x", "z"])
    with pytest.raises(InputError, match="x, z"):
        find_reversals(both)
    assert perfect(find_reversals(both, channel="z"), truth)
    with pytest.raises(InputError, match="acceleration"):
        find_reversals(record(y, unit="m/s²"), channel="signal")
    with pytest.raises(InputError, match="no channel"):
        find_reversals(record(y, unit="m/s²"))


# -- from a period or a file ------------------------------------------------------------------------------


def test_period_takes_its_phase_from_the_signal_where_there_is_one() -> None:
    take = seed_paper.take(2, seed=3)
    found = periodic_reversals(take, dwell=30.0)
    assert perfect(found, truth_of(take)) and found.source == "period"
    assert not codes(found)
    y, truth = turned(
        720.0, 50, dwell=lambda chance: 17.0 if chance.bit_generator.state["has_uint32"] else 30.0
    )
    slow = periodic_reversals(record(y), dwell=30.0)  # the true period is 30 s and a turn
    assert codes(slow) <= {"turn_not_seen", "turn_not_listed"}
    assert scored(slow, truth)["wrong"] == 0


def test_period_without_any_trace_in_the_signal_starts_with_the_record() -> None:
    take = seed_paper.take(2, seed=4, coupling=0.0)
    assert find_reversals(take).static
    found = periodic_reversals(take, dwell=30.0, turn=3.0, first="north")
    assert perfect(found, truth_of(take))
    given = periodic_reversals(take, dwell=30.0, phase=10.0)
    assert [t.start for t in given.turns[:2]] == [at(10.0), at(40.0)]
    for wrong in ({"dwell": 0.0}, {"dwell": 1.0}, {"dwell": 1e4}, {"dwell": 30.0, "phase": -1.0}):
        with pytest.raises(InputError):
            periodic_reversals(take, **wrong)


def written(folder: Path, text: str) -> Path:
    path = folder / "list.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_turns_of_a_file_take_in_the_excursions_they_touch(tmp_path: Path) -> None:
    y, truth = turned(720.0, 51)
    late = "\n".join(f"{t['start'] + 0.8:.2f},{t['stop'] + 0.5:.2f}" for t in truth["turns"])
    found = read_turns(written(tmp_path, "# by hand\n\nstart,stop\n" + late), record(y))
    assert perfect(found, truth) and not found.findings and found.source == "file"
    begun = "\n".join(f"{t['start'] / 60:.4f}".replace(".", ",") for t in truth["turns"])
    found = read_turns(written(tmp_path, "time [min];note\n" + begun.replace("\n", ";x\n") + ";x"), record(y))
    assert perfect(found, truth)


def test_file_and_signal_that_contradict_each_other_are_both_named(tmp_path: Path) -> None:
    y, truth = turned(720.0, 52)
    listed = [t for i, t in enumerate(truth["turns"]) if i != 5]
    text = "start,stop\n" + "\n".join(f"{t['start']},{t['stop']}" for t in listed)
    found = read_turns(written(tmp_path, text + "\n718.0,719.5\n"), record(y))
    assert codes(found) == {"turn_not_listed", "turn_not_seen"}
    a, b = (at(truth["turns"][5][k]) for k in ("start", "stop"))
    assert not found.signs()[a:b].any()  # cut out, though it is not listed


@pytest.mark.parametrize("shift", [-40.0, -6.0, 0.3, 6.0, 40.0])
def test_a_list_of_another_clock_is_told_by_how_much(shift: float, tmp_path: Path) -> None:
    y, truth = turned(720.0, 53, dwell=lambda chance: chance.uniform(20.0, 45.0))
    kept = [t for t in truth["turns"] if 0 <= t["start"] + shift and t["stop"] + shift < 720.0]
    rows = [f"{t['start'] + shift:.2f},{t['stop'] + shift:.2f}" for t in kept]
    found = read_turns(written(tmp_path, "\n".join(["start,stop", *rows])), record(y))
    said = [f.message for f in found.findings if f.code == "turn_not_seen"]
    if abs(shift) < 1:
        assert not said
        return
    (told,) = re.findall(
        r"if all its times were (\S+) s (earlier|later), (\d+) of these (\d+) would agree", said[0]
    )
    assert float(told[0]) == pytest.approx(abs(shift), abs=1.0) and int(told[2]) >= 0.9 * int(told[3])
    assert told[1] == ("earlier" if shift > 0 else "later")


def test_turns_at_random_times_agree_with_no_shift(tmp_path: Path) -> None:
    y, truth = turned(720.0, 54, dwell=lambda chance: chance.uniform(20.0, 45.0))
    starts = np.sort(
        np.random.default_rng(3).choice(np.arange(20, 700, 5), len(truth["turns"]), replace=False)
    )
    rows = [f"{start},{start + 2}" for start in starts]
    found = read_turns(written(tmp_path, "\n".join(["start,stop", *rows])), record(y))
    assert not any("would agree" in f.message for f in found.findings)


@pytest.mark.parametrize(
    "text, error, match",
    [
        ("", FormatError, "empty"),
        ("start,stop\n", FormatError, "no rows"),
        ("1,2\n3,4\n", FormatError, "line 1: no column 'start'"),
        ("stop\n1\n", FormatError, "no column 'start'"),
        ("start,start\n1,2\n", FormatError, "two columns"),
        ("start,stop\n1,2\nx,4\n", FormatError, "line 3: start must be a number, not 'x'"),
        ("start,stop\n1,2\n\nnan,4\n", FormatError, "line 4"),
        ("note,start\nhello\n", FormatError, "line 2: 1 cell,"),
        ("start [V],stop\n1,2\n", FormatError, "line 1: column 'start'"),
        ("start,stop\n5,4\n", InputError, "line 2: stop 4 s does not come after"),
        ("start,stop\n5,9\n8,10\n", InputError, "line 3: .* overlaps"),
        ("start,stop\n50,52\n8,10\n", InputError, "line 3: .* before the line above"),
        ("start,stop\n5,9\n800,801\n", InputError, "line 3: 800 s is outside of the record of 60 s"),
        ("start,stop\n-5,-3\n", InputError, "line 2: -5 s is outside"),
    ],
)
def test_wrong_list_of_turns(tmp_path: Path, text: str, error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        read_turns(written(tmp_path, text), record(noise(60.0, 1)))


def test_list_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_turns(tmp_path / "none.csv", record(noise(60.0, 1)))


def test_positions_with_headings(tmp_path: Path) -> None:
    y = record(noise(200.0, 2))
    text = "name;start [s];stop_s;heading\nA;0;40;0\nB;45;90;120\nC;90;140;-120\nD;150;200;540\n"
    found = read_positions(written(tmp_path, text), y, dead_time=3.0)
    assert [round(math.degrees(d.heading)) for d in found.dwells] == [0, 120, -120, 180]
    assert [d.sign for d in found.dwells] == [1, 0, 0, -1]
    assert [p.name for p in found.positions] == ["A", "B", "C", "D"]
    assert [(d.start / RATE, d.stop / RATE) for d in found.dwells] == [
        (0, 39.5),
        (48, 89.5),
        (93, 139.5),
        (153, 200),
    ]
    assert found.first == "north" and len(found.turns) == 3 and not found.findings
    assert found.table()[1]["direction"] == "120 deg"
    radians = "start,stop,azimuth [rad]\n0,100,3.14159\n100,200,0\n"
    assert [d.sign for d in read_positions(written(tmp_path, radians), y).dwells] == [-1, 1]
    assert Reversals.from_json(found.to_json()).table() == found.table()


def test_wrong_positions(tmp_path: Path) -> None:
    y = record(noise(60.0, 3))
    with pytest.raises(FormatError, match="no column 'heading'"):
        read_positions(written(tmp_path, "start,stop\n0,30\n"), y)
    with pytest.raises(FormatError, match="line 2: stop must be a number"):
        read_positions(written(tmp_path, "start,stop,heading\n0,,30\n"), y)
    with pytest.raises(InputError, match="line 3: stop 70 s is after the end"):
        read_positions(written(tmp_path, "start,stop,heading\n0,30,0\n31,70,180\n"), y)


def test_positions_of_several_axes_need_no_channel(tmp_path: Path) -> None:
    both = Recording.from_rate(
        np.stack([noise(60.0, 4)] * 2, axis=1), rate=RATE, unit="deg/s", names=["x", "y"]
    )
    text = "start,stop,heading\n0,30,0\n30,60,90\n"
    assert len(read_positions(written(tmp_path, text), both).dwells) == 2


def test_a_record_that_begins_inside_a_turn_counts_from_its_first_position() -> None:
    record = seed_paper.take(2, seed=5)
    turn = record.history[-1]["motion"]["turns"][0]
    part = record.window((turn["start"] + turn["stop"]) / 2, None)
    for first, sign in (("north", 1), ("south", -1)):
        found = find_reversals(part, first=first)
        assert found.first == first
        assert found.dwells[0].sign == sign
        assert [d.sign for d in found.dwells[:4]] == [sign, -sign, sign, -sign]


def test_a_window_of_the_turns_is_that_of_the_record() -> None:
    record = seed_paper.take(2, seed=5)
    whole = find_reversals(record)
    a, n = round(100.0 * record.rate), round(300.0 * record.rate)
    part = whole.window(a, n)
    inside = [d for d in whole.dwells if a < d.start - 64 and d.stop + 64 < a + n]
    assert len(inside) > 5
    assert {(d.start - a, d.stop - a, d.sign) for d in inside} <= {
        (d.start, d.stop, d.sign) for d in part.dwells
    }
    assert part.beginning("south").dwells[0].sign == -1
    with pytest.raises(InputError, match="none of"):
        whole.window(10 * record.n_samples, 10)
