# SPDX-License-Identifier: BSD-3-Clause
"""Rows of several kinds without names, and GPS week with time of week, with names and without."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read
from shell import Run

N = 800
WEEK = 604_800


def text(path: Path, rows: list[list[object]], sign: str = ",") -> Path:
    path.write_text("".join(sign.join(map(str, row)) + "\n" for row in rows), encoding="utf-8")
    return path


def at_rest(rng: np.random.Generator, count: int) -> list[str]:
    return [f"{value:.5f}" for value in rng.standard_normal(count) * 0.01 + 0.3]


# -- several kinds -----------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("header", [False, True])
@pytest.mark.parametrize("kinds", [("IMU", "GPS"), ("GYRO", "ACC"), ("A", "B"), ("RAW", "RAW_2")])
def test_names_of_channels_tell_their_kind(
    kinds: tuple[str, str], header: bool, run: Run, tmp_path: Path
) -> None:
    """Every channel of every kind is read by its name alone; what an error offers runs as it is printed."""
    rng = np.random.default_rng(5)
    rows: list[list[object]] = [["type", "t", "x", "y", "z"]] if header else []
    for k in range(N):
        rows.append([kinds[0], f"{123.4 + k / 100:.3f}", *at_rest(rng, 3)])
        if k % 2:
            rows.append([kinds[1], f"{123.4 + k / 100:.3f}", *at_rest(rng, 3)])
    log = text(tmp_path / "log.txt", rows)
    for kind in kinds:
        own = read(log, variable=kind)
        assert own.rate == pytest.approx(100.0 if kind == kinds[0] else 50.0)
        assert [c.name for c in read(log, channels=[kind]).channels] == [c.name for c in own.channels]
        if header:
            continue
        for channel in own.channels:
            alone = read(log, channels=[channel.name])
            assert [c.name for c in alone.channels] == [channel.name]
            assert alone.rate == own.rate
    shown = run("info", str(log))
    if kinds[0] in ("A", "RAW"):
        assert shown.code == 1
        ways = re.findall(r"--variable [^\s,;)]+", shown.err)
        assert len(ways) == 2
    else:
        ways = ["--unit " + re.findall(r"--unit ([^\s;]+)", shown.out)[0]]
    if not header:
        with pytest.raises(InputError, match="one type is read at a time") as refused:
            read(log, channels=[f"{kind}_x" for kind in kinds])
        ways += re.findall(r"--channels [^\s;]+", str(refused.value))
    for way in ways:
        assert run("info", str(log), *shlex.split(way)).code in (0, 3), way


def test_a_finding_about_a_kind_ends_with_its_advice(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    rows: list[list[object]] = []
    for k in range(N):
        rows.append(["GYRO", f"{k / 100:.3f}", *at_rest(rng, 2), f"{0.001 * k:.4f}"])
        rows.append(["GPS", f"{k / 100:.3f}", *at_rest(rng, 3)])
    log = text(tmp_path / "log.txt", rows)
    shown = run("info", str(log))
    assert "only_grows" in shown.out
    way = re.findall(r"--channels [^\s;]+", shown.out)
    assert way == ["--channels GYRO_x,GYRO_y"]
    done = run("info", str(log), *shlex.split(way[0]))
    assert done.code in (0, 3)
    assert "only_grows" not in done.out


# -- GPS week ----------------------------------------------------------------------------------------------

NAMES = (
    ("week", "tow", 1), ("gps_week", "sow", 1), ("wn", "TOW_ms", 1000), ("WN", "iTOW", 1000), ("GPSWeek", "GPSTime", 1),
    ("GPS Week", "seconds of week", 1), ("GPS_WN", "gps_sow", 1), ("weekno", "time_of_week", 1), ("GWk", "GMS", 1000),
    ("GPSW", "GPSSOW", 1), ("wk", "TimeOfWeek[ms]", 1000), ("Week", "Time_ms", 1000), ("week_number", "tow [s]", 1),
    ("", "", 1), ("", "", 1000),
)  # fmt: skip


@pytest.mark.long
def test_week_and_time_of_week_are_one_clock(tmp_path: Path) -> None:
    """In either order, among typed rows or alone, with lost rows, and over the end of a week."""
    for seed in range(3 * len(NAMES)):
        rng = np.random.default_rng([72, seed])
        week, within, factor = NAMES[seed % len(NAMES)]
        typed = not week and seed % 2 == 0
        rate = float(rng.choice([10, 50, 100]))
        first = float(rng.choice([345_600.1, WEEK - N / rate / 2, WEEK - 3 / rate]))
        turned = bool(rng.random() < 0.3)
        kept = rng.random(N) > 0.01
        kept[:3] = kept[-3:] = True
        rows: list[list[object]] = []
        if week:
            names: list[object] = [week, within]
            rows = [[*(names[::-1] if turned else names), "gx", "gy", "gz"]]
        for k in np.flatnonzero(kept):
            whole, rest = divmod(round((first + k / rate) * 1000), WEEK * 1000)
            time = str(rest) if factor == 1000 else f"{rest / 1000:.3f}"
            clock: list[object] = [2290 + whole, time]
            rows.append([*(["IMU"] if typed else []), *(clock[::-1] if turned else clock), *at_rest(rng, 3)])
            if typed and k % 10 == 0:
                rows.append(["GPS", *clock, *at_rest(rng, 2)])
        log = text(tmp_path / f"{seed}.csv", rows)
        recording = read(log)
        case = (week, within, factor, typed, first, turned)
        assert recording.rate == pytest.approx(rate, rel=1e-5), case
        assert recording.n_samples == N, case
        assert int(np.isnan(recording.values("gx" if week else recording.names[0])).sum()) == int(
            (~kept).sum()
        ), case
        assert len(recording.channels) == 3, case
        assert recording.notes["timebase"]["unit"] == "gps week + s", case


def test_a_week_that_comes_late_or_never_is_left_out_with_a_word(tmp_path: Path) -> None:
    for late in (2, N):
        rows: list[list[object]] = [["week", "tow", "gx"]]
        for k in range(N):
            rows.append(
                [2290 + (k >= N // 2 + late), f"{(WEEK - 6 + k / 100) % WEEK:.2f}", f"{np.sin(k):.4f}"]
            )
        recording = read(text(tmp_path / f"{late}.csv", rows))
        assert (recording.rate, recording.n_samples, len(recording.channels)) == (100.0, N, 1)
        said = " ".join(recording.notes["text"]["guesses"])
        assert "'week'" in said and "604800" in said


def test_constants_beside_a_clock_from_zero_are_no_weeks(tmp_path: Path) -> None:
    """Without names: a whole number beside time since the beginning, beside noise, or one that is no week."""
    rng = np.random.default_rng(3)
    for constant, first in ((1013, 0.0), (512, 345_600.0), (2290.5, 345_600.0), (2290, 604_900.0)):
        rows: list[list[object]] = [[constant, f"{first + k / 100:.2f}", *at_rest(rng, 2)] for k in range(N)]
        recording = read(text(tmp_path / "log.csv", rows))
        assert (recording.rate, len(recording.channels)) == (100.0, 3), (constant, first)


@pytest.mark.parametrize("names", [["week", "tow"], []])
def test_seconds_or_milliseconds_of_a_week_are_asked(names: list[object], run: Run, tmp_path: Path) -> None:
    """Whole numbers ten apart in the first ten minutes of a week: both ways that are printed run."""
    rows: list[list[object]] = [[*names, "gx [deg/s]"]] if names else []
    rows += [[2290, 1000 + 10 * k, f"{np.sin(k):.4f}"] for k in range(N)]
    log = text(tmp_path / "log.csv", rows)
    asked = run("info", str(log))
    assert asked.code == 1
    ways = re.findall(r"--time (\S+) \(([\d.]+) Hz\)", asked.err)
    assert [float(rate) for _, rate in ways] == [0.1, 100.0]
    for way, rate in ways:
        done = run("info", str(log), "--time", way)
        assert f"at {float(rate):g} Hz, {N} samples" in done.out
        assert "ch1" not in done.out
