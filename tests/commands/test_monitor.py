# SPDX-License-Identifier: BSD-3-Clause
"""monitor: what is said of a run, while it grows and afterwards, and how it looks."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.acquisition.capture import capture
from allanite.acquisition.instruments.simulated import SimulatedInstrument
from allanite.commands.monitor import RunWatch
from allanite.commands.monitor.stamps import MOST
from allanite.files.store import Flag, LogStore, host_ns
from allanite.files.store import segment as segments
from allanite.files.store.survey import clock_rate
from allanite.noise import NoiseModel, White
from allanite.views.terminal.octaves import LogScale
from log_store_runs import BEGUN, HEADER, SECOND, batch_of, write_run
from shell import Run

SCALE = 1 / 0.024  # deg/s per volt


def test_a_finished_run_is_shown_with_its_curve(tmp_path: Path, run: Run) -> None:
    sensor = SimulatedInstrument(NoiseModel.of(White(N=1e-4)), rate=32.0, speed=20000.0)
    done = capture(sensor, tmp_path / "run", duration=1200.0)
    document = json.loads(run("monitor", "--json", done.folder).out)
    assert (document["status"], document["samples"], document["missing"]) == ("success", 38_400, 0)
    assert document["plan"] == {
        "samples": 38_400,
        "seconds": 1200.0,
        "share": 1.0,
        "left": None,
        "ends": None,
    }
    assert document["age"] is None and document["last_gap"] is None and document["because"] == []
    curve = al.allan_curve(al.read(done.folder), taus="octave", engine="decimated", confidence=0.6827)
    (found,) = document["curves"].values()
    assert found["deviation"][:8] == pytest.approx(curve.deviation[:8, 0].tolist(), rel=1e-9)
    assert found["lower"][:8] == pytest.approx(curve.lower[:8, 0].tolist(), rel=1e-9)
    text = run("monitor", done.folder).out  # a run that has ended is shown once
    assert "● finished as planned" in text and "20 min of 20 min" in text and "left" not in text
    assert text == run("monitor", "--once", tmp_path).out  # a folder of runs: the one written to last


def test_each_look_reads_only_what_has_come(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[tuple[str, int]] = []
    load = segments.Segment.load

    def counting(path: Path, offset: int = 0) -> segments.Segment:
        found = load(path, offset)
        read.append((found.name, len(found.data)))
        return found

    with LogStore.create(tmp_path / "run", HEADER, rotate_bytes=20_000) as store:
        store.note("plan", seconds=1000.0, samples=32_000)
        for k in range(60):
            store.append(batch_of(32 * k))
        store.sync()
        watch = RunWatch(tmp_path / "run")
        first = watch.look()
        assert (first["status"], first["samples"]) == ("recording", 1920)
        assert first["plan"]["left"] == pytest.approx(1000 - 60) and first["disk"]["needed"] > 0
        monkeypatch.setattr(segments.Segment, "load", staticmethod(counting))
        assert watch.look()["samples"] == 1920
        assert sum(n for _, n in read) == 0
        store.append(batch_of(1920))
        store.sync()
        read.clear()
        assert watch.look()["samples"] == 1952
        assert 0 < sum(n for _, n in read) < 4000
    assert watch.look()["status"] == "success"
    curve, same = (
        watch.curve(),
        al.allan_curve(
            al.read(tmp_path / "run").select("gyro_z"), taus="octave", engine="decimated", confidence=0.6827
        ),
    )
    assert curve is not None
    kept = np.isin(curve.lags, same.lags)
    assert curve.deviation[kept] == pytest.approx(same.deviation, rel=1e-6, nan_ok=True)


def test_gaps_have_their_reason_and_overloads_are_counted(tmp_path: Path, run: Run) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store_end = 0
        for first, reason in ((0, ""), (64, "silent"), (128, "silent"), (300, "the port was gone")):
            if first:
                store.note("gap", counter=store_end, samples=first - store_end, reason=reason)
            batch = batch_of(first)
            flags = batch.flags.copy()
            if first == 300:
                flags[3:7] = Flag.OVERLOAD, Flag.MISSING, Flag.DOUBTFUL, Flag.DOUBTFUL | Flag.RESYNC
                store.note("remark", text="2 frames came twice")
                store.note("remark", text="and 7 more remarks were not recorded", more=7)
            store.append(replace(batch, flags=flags))
            store_end = first + 32
    document = json.loads(run("monitor", "--json", tmp_path / "run").out)
    counts = [
        document[key] for key in ("samples", "missing", "gaps", "overloads", "doubtful", "resyncs", "remarks")
    ]
    assert counts == [128, 204, 3, 2, 2, 1, 8] and document["outage"] is None
    assert document["missing_share"] == pytest.approx(204 / 332)
    assert document["because"] == [
        {"reason": "the port was gone", "gaps": 1, "samples": 140},
        {"reason": "silent", "gaps": 2, "samples": 64},
    ]
    assert document["last_gap"]["reason"] == "the port was gone" and document["last_gap"]["counter"] == 160
    assert document["curves"]["gyro_z"]["n_samples"] == 332
    text = run("monitor", "--once", tmp_path / "run").out
    assert "204 (61 %) in 3 gaps; the last, noted" in text
    assert (
        re.search("^no value +2$", text, re.M)
        and re.search("^doubtful +2$", text, re.M)
        and "8 of the inst" in text
    )
    assert not any(line.endswith(" ") for line in text.splitlines())  # nothing fills up a line in a pipe


def test_what_is_missing_at_the_end_is_counted_and_an_outage_is_told_at_once(
    tmp_path: Path, run: Run
) -> None:
    folder = tmp_path / "run"
    with LogStore.create(folder, HEADER) as store:
        store.note("plan", seconds=10.0, samples=320)
        store.note("silence", number=1, reason="slow to begin")
        batch = batch_of(0)
        late = time.time_ns() - 30 * SECOND
        store.append(replace(batch, monotonic_ns=host_ns() + batch.counter, utc_ns=late))
        store.sync()
        watch = RunWatch(folder)
        assert watch.look()["outage"] is None  # samples came after that silence
        store.note("lost", reason="the port is gone")
        state = watch.look()
        assert (state["missing"], state["gaps"], state["outage"]["reason"]) == (0, 0, "the port is gone")
        text = run("monitor", "--once", folder).out
        by_clock = re.search("none yet noted; and by the clock about ([0-9]+)", text)
        assert "no data arrive: the port is gone" in text and by_clock is not None
        so_far = (time.time_ns() - late) / SECOND * 32
        for counted in (state["outage"]["samples"], int(by_clock[1])):
            assert 30 * 32 - 64 <= counted <= so_far + 64
        store.note("gap", counter=32, samples=100, reason="the port is gone")
        store.note("gap", counter=132, samples=28, reason="stopped")
        store.close("abort", "SIGINT")
    for state in (watch.look(), json.loads(run("monitor", "--json", folder).out)):
        assert (state["missing"], state["gaps"], state["outage"]) == (128, 1, None)
        assert state["missing_share"] == 0.8 and state["plan"]["share"] == 0.5
    assert "128 (80 %) in 1 gap; the last" in run("monitor", folder).out


def test_ctrl_c_is_how_a_look_ends(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(seconds: float) -> None:
        raise KeyboardInterrupt

    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        store.sync()
        monkeypatch.setattr(time, "sleep", interrupt)
        done = run("monitor", tmp_path / "run")
    assert (done.code, done.err) == (0, "")


@pytest.mark.long
def test_the_rate_is_that_of_the_stamps_with_its_scatter(tmp_path: Path, rng: np.random.Generator) -> None:
    n, ppm, late = 2500, 40e-6, 2e-3
    with LogStore.create(tmp_path / "run", HEADER) as store:
        for k in range(n):
            batch = batch_of(32 * k)
            stamps = batch.counter / 32 * 1e9 / (1 + ppm) + late * 1e9 * rng.standard_normal()
            store.append(replace(batch, monotonic_ns=np.rint(stamps).astype(np.int64)))
    watch = RunWatch(tmp_path / "run")
    found = watch.look()["measured_rate"]
    assert len(watch._part.stamps) < MOST
    kept = n // 2  # every second one went
    # The slope of a line through n points of scatter s over the span T: s sqrt(12/n)/T, times the rate.
    expected = 32 * late * np.sqrt(12 / kept) / n
    assert found["standard_uncertainty"] == pytest.approx(expected, rel=0.1)
    assert abs(found["value"] - 32 * (1 + ppm)) < 4 * found["standard_uncertainty"]


@pytest.mark.parametrize("n", [5, 8, 40])
def test_twice_the_uncertainty_of_the_rate_holds_the_truth(n: int, rng: np.random.Generator) -> None:
    """From few stamps as from many: 4000 simulations each, whose own scatter is a third of a percent."""
    counter = 32 * np.arange(n)
    holds, trials = 0, 4000
    for late in rng.standard_normal((trials, n)):
        stamps = np.rint(counter / 32 * 1e9 + 2e6 * late).astype(np.int64)
        value, u = clock_rate(np.c_[counter, stamps]) or (0.0, 0.0)
        holds += abs(value - 32) < 2 * u
    # P(|t| < 2 √(ν/(ν-2))), ν = n - 2, is 0.954 to 0.959 here (tables of the t distribution: 0.959 for ν = 3).
    assert 0.945 < holds / trials < 0.970


def test_stamps_that_say_nothing_measure_nothing() -> None:
    counter = 32 * np.arange(100)
    computed = np.rint(counter * (1e9 / 31.99)).astype(np.int64)
    assert clock_rate(np.c_[counter, computed]) is None
    assert clock_rate(np.c_[counter, computed + 40_000 * (counter % 3)]) is not None
    assert clock_rate(np.c_[counter, computed + 40_000 * (counter % 3)][:4]) is None


def test_other_settings_begin_another_part(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        watch = RunWatch(tmp_path / "run")
        assert watch.look()["part"] == 1
        store.change(replace(HEADER, settings={**HEADER.settings, "range": 10.0}))
        store.append(batch_of(32, 16))
        store.sync()
        state = watch.look()
        assert (state["part"], state["samples"], state["missing"]) == (2, 16, 0)
        assert watch._part.header.settings["range"] == 10.0 and watch._follower.share == 1.0
        assert RunWatch(tmp_path / "run").look()["samples"] == 16
    assert watch.look()["status"] == "success"


def test_a_dead_recorder_and_a_silent_one_are_told_apart(tmp_path: Path, run: Run) -> None:
    now = time.time_ns()
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(replace(batch_of(0), utc_ns=now - 60 * SECOND))
        store.sync()
        text = run("monitor", "--once", tmp_path / "run").out
        assert "recording, but nothing has been stored for 60" in text
    torn = write_run(tmp_path / "torn", [0, 32])
    manifest = torn / "manifest.jsonl"
    manifest.write_text("".join(line for line in manifest.open() if '"end"' not in line))
    assert "interrupted: the recorder died" in run("monitor", "--once", torn).out
    assert json.loads(run("monitor", "--json", torn).out)["samples"] == 64


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_no_line_is_wider_than_the_terminal_and_nothing_is_cut(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch, columns: int, rng: np.random.Generator
) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.note("plan", seconds=604_800.0, samples=19_353_600)
        for k in range(64):
            batch = batch_of(32 * k)
            values = np.c_[0.012 + 2e-5 * rng.standard_normal(32), np.full(32, 31.25)]
            store.append(replace(batch, values=values, utc_ns=BEGUN))
    monkeypatch.setenv("COLUMNS", str(columns))
    text = run("monitor", "--once", tmp_path / "run").out
    assert max(map(len, text.splitlines())) <= columns
    assert columns < 80 or "…" not in text
    drawn = [line for line in text.splitlines() if "●" in line][1:]
    assert len(drawn) == 11 and all("[" in line for line in drawn)  # octaves of 2048 samples
    places = [line.index("●") for line in drawn]
    assert places[:6] == sorted(places[:6], reverse=True)  # white noise falls
    if columns == 120:  # through the scale factor
        assert f"= {float(text.split('= ')[1].split()[0]):g}" and "deg/h" in text
        assert float(text.split("= ")[1].split()[0]) == pytest.approx(0.012 * SCALE * 3600, rel=0.01)


def test_a_scale_places_decades_and_intervals() -> None:
    scale = LogScale(0.01, 100.0, 41)
    assert [scale.place(v) for v in (0.01, 0.1, 1.0, 100.0, 1e9, 0.0)] == [0, 10, 20, 40, 40, 0]
    assert scale.ticks() == pytest.approx([0.01, 0.1, 1, 10, 100])
    assert scale.labels().split() == ["0.01", "0.1", "1", "10", "100"]
    bar = scale.bar(0.5, 1.0, 5.0).plain
    assert (bar[17], bar[20], bar[27]) == ("├", "●", "┤") and bar[10] == "·" and len(bar) == 41
    assert LogScale(0.4, 2.5, 30).ticks() == pytest.approx([0.5, 1, 2])


def test_a_channel_without_a_curve_is_refused(tmp_path: Path, run: Run) -> None:
    folder = write_run(tmp_path / "run", [0, 32])
    failed = run("monitor", folder, "--channel", "temperature")
    assert failed.code == 1 and "those that carry noise: gyro_z" in failed.err
    (tmp_path / "nothing").mkdir()
    assert run("monitor", tmp_path / "nothing").code == 1
