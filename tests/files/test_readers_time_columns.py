# SPDX-License-Identifier: BSD-3-Clause
"""Time that stands in several columns, or as the interval since the row before."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import AllaniteError, DataQualityError, InputError
from allanite.files.readers import read
from allanite.recording.records import Recording

N = 300
UTC = datetime.UTC
DATES = (
    ("Year", "Month", "Day"), ("YYYY", "MM", "DD"), ("UTC Year", "UTC Month", "UTC Day"), ("yr", "mon", "dom"),
    ("yy", "mm", "dd"), ("year", "doy"), ("Y", "M", "D"), ("Date",), (),
)  # fmt: skip
CLOCKS = (
    ("Hour", "Minute", "Second"), ("hh", "mm", "ss"), ("HH", "MM", "SS"), ("hour", "min", "sec"),
    ("UTC Hour", "UTC Minute", "UTC Second"), ("Hour [h]", "Minute [min]", "Second [s]"), ("h", "m", "s"),
)  # fmt: skip


def table(path: Path, names: list[str], rows: list[list[str]]) -> Path:
    path.write_text("\n".join(",".join(row) for row in [names, *rows]) + "\n", encoding="utf-8")
    return path


def tried(path: Path) -> tuple[Recording | None, str]:
    """The recording, or what is asked."""
    try:
        return read(path), ""
    except InputError as error:
        return None, str(error)


def date_cells(moment: datetime.datetime, names: tuple[str, ...]) -> list[str]:
    if len(names) == 2:
        return [str(moment.year), str(moment.timetuple().tm_yday)]
    if len(names) == 1:
        return [moment.strftime("%Y-%m-%d")]
    year = moment.year % 100 if names and names[0] == "yy" else moment.year
    return [f"{n:02d}" for n in (year, moment.month, moment.day)] if names else []


@pytest.mark.long
def test_parts_of_a_date(tmp_path: Path) -> None:
    """Any names, with fractions in the seconds or in columns of their own, over midnights and ends of years."""
    for seed in range(60):
        rng = np.random.default_rng([41, seed])
        dates, clock = DATES[rng.integers(len(DATES))], CLOCKS[rng.integers(len(CLOCKS))]
        rate = float(rng.choice([1.0, 10.0, 20.0, 100.0, 200.0]))
        fine = (
            () if rate == 1.0 else [("",), ("ms",), ("Millisecond",), ("us",), ("ms", "us")][rng.integers(5)]
        )
        first = datetime.datetime(2023, 12, 31, 23, 59, int(rng.integers(60)), tzinfo=UTC)
        if rng.random() < 0.5:
            first = datetime.datetime(2024, int(rng.integers(1, 13)), 28, 12, 59, 58, tzinfo=UTC)
        rows = []
        for k in range(N):
            moment = first + datetime.timedelta(seconds=k / rate)
            seconds = f"{moment.second}.{moment.microsecond:06d}" if fine == ("",) else f"{moment.second}"
            cells = [*date_cells(moment, dates), str(moment.hour), str(moment.minute), seconds]
            if fine in (("ms",), ("Millisecond",)):
                cells.append(str(moment.microsecond // 1000))
            elif fine == ("us",):
                cells.append(str(moment.microsecond))
            elif fine == ("ms", "us"):
                cells += [str(moment.microsecond // 1000), str(moment.microsecond % 1000)]
            rows.append([*cells, f"{rng.normal():.4f}"])
        names = [*dates, *clock, *filter(None, fine), "gx [deg/s]"]
        got = read(table(tmp_path / "log.csv", names, rows))
        assert got.names == ("gx",), (seed, names)
        assert got.rate == pytest.approx(rate, rel=1e-9), (seed, names)
        assert got.n_samples == N, (seed, names)
        expected = round(first.timestamp()) * 10**9 if dates else None
        assert got.start == expected, (seed, names, got.start)


def test_a_fraction_beside_a_clock_of_whole_seconds(tmp_path: Path) -> None:
    forms = ("%H:%M:%S", "%Y-%m-%d %H:%M:%S", "%Y-%m-%d,%H:%M:%S", "epoch", "%d.%m.%Y %H:%M:%S")
    for seed in range(30):
        rng = np.random.default_rng([42, seed])
        rate, form = float(rng.choice([4.0, 10.0, 50.0, 125.0])), forms[rng.integers(len(forms))]
        unit, size = [("ms", 1e3), ("us", 1e6), ("time_ns", 1e9), ("msec", 1e3)][rng.integers(4)]
        first = datetime.datetime(2024, 5, 31, 23, 59, int(rng.integers(50, 60)), tzinfo=UTC)
        rows = []
        for k in range(N):
            moment = first + datetime.timedelta(seconds=k / rate)
            stamp = str(int(moment.timestamp())) if form == "epoch" else moment.strftime(form)
            rows.append(
                [*stamp.split(","), str(round(moment.microsecond * size / 1e6)), f"{rng.normal():.4f}"]
            )
        names = ["date", "time", unit, "gx"] if "," in form else ["time", unit, "gx"]
        got = read(table(tmp_path / "log.csv", names, rows))
        assert (got.names, got.n_samples) == (("gx",), N), (seed, names)
        assert got.rate == pytest.approx(rate, rel=1e-9), (seed, names, rows[:3])
        if form not in ("%H:%M:%S",):
            assert got.start == round(first.timestamp()) * 10**9, (seed, form)


def test_an_uptime_beside_a_clock_is_no_fraction(tmp_path: Path) -> None:
    rows = [[f"12:00:{k // 10:02d}", str(5000 + 100 * k), "0.5"] for k in range(N)]
    got = read(table(tmp_path / "log.csv", ["time", "ms", "gx"], rows))
    assert got.rate == pytest.approx(10.0)
    assert "'ms' is used" in " ".join(got.notes["text"]["guesses"])


def test_numbers_that_are_no_date(tmp_path: Path) -> None:
    names = ["Year", "Month", "Day", "Hour", "Minute", "Second", "gx"]
    rows = [["2023", "2", str(27 + k // 60), "0", "0", str(k % 60), "0.5"] for k in range(N)]
    with pytest.raises(InputError, match=r"row 120: year 2023, month 2, day 29 is not a date.*--time none"):
        read(table(tmp_path / "log.csv", names, rows))


def test_parts_that_make_no_time_stay_channels(tmp_path: Path) -> None:
    rows = [[str(k / 10), "3", str(k % 7), "0.5"] for k in range(N)]
    got = read(table(tmp_path / "log.csv", ["time [s]", "Hour", "Day", "gx"], rows))
    assert got.names == ("Hour", "Day", "gx")


# -- intervals ---------------------------------------------------------------------------------------------

INTERVALS = ("dt", "delta_t", "deltaT", "dT", "time_delta", "period", "Δt", "sample_interval", "delta time")


@pytest.mark.long
def test_intervals_are_time(tmp_path: Path) -> None:
    for seed in range(50):
        rng = np.random.default_rng([43, seed])
        name, (unit, size) = (
            str(rng.choice(INTERVALS)),
            [("s", 1.0), ("ms", 1e3), ("us", 1e6)][rng.integers(3)],
        )
        heading = str(rng.choice([f"{name}_{unit}", f"{name} [{unit}]", f"{name} ({unit})"]))
        rate = float(rng.choice([10.0, 50.0, 100.0, 400.0]))
        numbers = np.arange(N) + 3 * (np.arange(N) >= rng.integers(20, N - 20))
        stamps = (numbers + rng.uniform(-0.1, 0.1, size=N)) / rate
        steps = np.diff(stamps, prepend=stamps[0] - float(rng.choice([0.0, 3.5, np.nan])))
        cells = [
            f"{round(s * size)}" if unit == "us" and np.isfinite(s) else repr(float(s * size)) for s in steps
        ]
        rows = [[cell, f"{k % 5}.5"] for k, cell in enumerate(cells)]
        got = read(table(tmp_path / "log.csv", [heading, "gx"], rows))
        assert got.names == ("gx",), (seed, heading)
        assert got.rate == pytest.approx(rate, rel=0.01), (seed, heading)
        assert got.n_samples == N + 3, (seed, heading)
        assert np.isnan(got.values("gx")).sum() == 3
        assert "running sum" in " ".join(got.notes["text"]["guesses"])


def test_intervals_of_a_long_log(tmp_path: Path) -> None:
    steps = np.full(150_000, 10)
    np.savez(tmp_path / "log.npz", dt_ms=steps, gx=np.arange(150_000.0))
    got = read(tmp_path / "log.npz")
    assert got.rate == pytest.approx(100.0, rel=1e-12)
    assert got.n_samples == 150_000


def test_intervals_beside_stamps_are_left_out(tmp_path: Path) -> None:
    rows = [[f"{k / 50:.2f}", "20", "0.5"] for k in range(N)]
    got = read(table(tmp_path / "log.csv", ["time [s]", "dt", "gx"], rows))
    assert got.names == ("gx",)
    assert "repeats the steps of the time stamps: left out" in " ".join(got.notes["text"]["guesses"])
    rows = [[f"{k / 50:.2f}", "70", "0.5"] for k in range(N)]
    got = read(table(tmp_path / "log.csv", ["time [s]", "dt [ms]", "gx"], rows))
    assert "does not agree" in " ".join(got.notes["text"]["guesses"])
    got = read(table(tmp_path / "log.csv", ["time [s]", "period [ms]", "gx"], rows))
    assert got.names == ("period", "gx")


def test_a_unit_of_intervals_that_nobody_names_is_asked_about(tmp_path: Path) -> None:
    path = table(tmp_path / "log.csv", ["dt", "gx"], [["1000", "0.5"]] * N)
    with pytest.raises(InputError, match=r"--time dt:ms \(1 Hz\) or --time dt:us \(1000 Hz\)"):
        read(path)
    assert read(path, time="dt:us").rate == pytest.approx(1000.0)
    assert read(path, rate=5.0).rate == 5.0


@pytest.mark.parametrize("bad", ["", "-10"])
def test_an_interval_that_is_missing_is_refused(bad: str, tmp_path: Path) -> None:
    rows = [["10", "0.5"] for _ in range(N)]
    rows[200][0] = bad
    with pytest.raises((InputError, DataQualityError), match=r"row 200|no time column"):
        read(table(tmp_path / "log.csv", ["dt_ms", "gx"], rows))


def test_increments_keep_their_intervals(tmp_path: Path) -> None:
    rows = [["10", "0.001"] for _ in range(N)]
    got = read(table(tmp_path / "log.csv", ["dt_ms", "delta_theta_x"], rows))
    assert got.names == ("dt_ms", "delta_theta_x")
    assert got.rate == pytest.approx(100.0)


def test_a_clock_that_is_called_a_difference(tmp_path: Path) -> None:
    path = table(tmp_path / "log.csv", ["dt", "gx"], [[f"{k / 10:.1f}", "0.5"] for k in range(N)])
    with pytest.raises(AllaniteError, match="--time dt:"):
        read(path)
    assert read(path, time="dt:s").rate == pytest.approx(10.0)


def test_periods_that_are_measured_stay_channels(tmp_path: Path) -> None:
    path = table(tmp_path / "log.csv", ["period [us]"], [[f"{100 + k % 7 / 10:.1f}"] for k in range(N)])
    assert read(path, rate=10.0).names == ("period",)
    with pytest.raises(InputError, match="no time column"):
        read(path)


@pytest.mark.long
def test_whole_seconds_and_what_is_finer(tmp_path: Path) -> None:
    """Without any names, as a message prints itself; and the Fractional Seconds of a meter beside its clock."""
    for seed in range(100):  # a fault of 2.3 % of them is found with 90 %
        rng = np.random.default_rng([20261126, seed])
        rate = float(rng.choice([3.0, 10.0, 47.0, 200.0]))
        start = int(rng.integers(1_500_000_000, 1_900_000_000))
        kept = np.delete(np.arange(N), slice(100, 100 + int(rng.integers(0, 30))))
        whole, part = np.divmod(start * 1e9 + rng.integers(0, 10**9) + np.round(kept / rate * 1e9), 1e9)
        values = [f"{v:.4f}" for v in rng.normal(size=len(kept))]
        if rng.random() < 0.5:
            scale = {"ns": 1, "us": 1000, "ms": 1_000_000}[str(rng.choice(["ns", "us", "ms"]))]
            cells = [
                [str(int(s)), str(int(p) // scale), "imu_link", v]
                for s, p, v in zip(whole, part, values, strict=True)
            ]
            path = tmp_path / "log.csv"
            path.write_text("\n".join(map(",".join, cells)) + "\n", encoding="utf-8")
        else:
            names = [
                str(rng.choice(["Fractional Seconds", "frac_sec", "Fraction of Second", "subseconds"])),
                "v",
            ]
            moments = [datetime.datetime.fromtimestamp(int(s), UTC) for s in whole]
            dated = [[m.strftime("%m/%d/%Y"), m.strftime("%H:%M:%S")] for m in moments]
            cells = [[*d, f"{p / 1e9:.6f}", v] for d, p, v in zip(dated, part, values, strict=True)]
            path = table(tmp_path / "log.csv", ["Date", "Time", *names], cells)
        recording, question = tried(path)
        if recording is None:
            assert "--time Date:mdy" in question, (seed, question)
            recording = read(path, time="Date:mdy")
        assert recording.rate == pytest.approx(rate, rel=2e-3 / N * rate + 1e-6), (seed, cells[0])
        assert (recording.n_samples, len(recording.names)) == (N, 1), (seed, cells[0], recording.names)
        assert recording.start == pytest.approx(int(whole[0]) * 10**9 + int(part[0]), abs=1_000_000), seed


@pytest.mark.long
def test_a_clock_that_begins_anew_is_time_or_asked_about(tmp_path: Path) -> None:
    """Whatever it is called: "no time column" is said of no log that has one."""
    for seed in range(100):  # a fault of 2.3 % of them is found with 90 %
        rng = np.random.default_rng([20261126, 1, seed])
        rate, turn = float(rng.choice([1.0, 10.0, 100.0])), float(rng.choice([86_400.0, 3600.0, 60.0]))
        name = str(rng.choice(["zp", "q", "tod", "tod_s", "second_counter"]))
        seconds = (turn - float(rng.integers(20, 200)) / rate + np.arange(N) / rate) % turn
        path = table(
            tmp_path / "log.csv",
            [name, "wx"],
            [[f"{s:.2f}", f"{v:.4f}"] for s, v in zip(seconds, rng.normal(size=N), strict=True)],
        )
        recording, question = tried(path)
        if recording is None:
            assert f"--time {name}" in question, (seed, question)
            continue
        assert name.startswith("tod"), seed
        if turn == 86_400.0:
            assert (recording.n_samples, recording.rate) == (N, pytest.approx(rate, rel=1e-6)), seed
