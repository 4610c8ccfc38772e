# SPDX-License-Identifier: BSD-3-Clause
"""Which column is time, and how its values count: as the caller says, as the file says, or asked."""

from __future__ import annotations

import datetime
import io
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import AllaniteError, FormatError, InputError
from allanite.files.readers import read
from allanite.files.readers.headings import read_heading
from allanite.files.readers.stamp_units import StampSteps, tell
from allanite.files.readers.timebase import ArrayStamps, fit_grid
from allanite.recording.cleaning import clean
from allanite.recording.health.examination import check
from allanite.recording.records import Recording

CASES = range(100)  # a fault of 2.3 % of such logs is among them with 90 %
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
N = 60


def case(seed: int) -> np.random.Generator:
    return np.random.default_rng([20, seed])


def text(columns: list[NDArray[Any]], names: list[str] | None = None) -> str:
    """A table as a CSV file."""
    out = io.StringIO()
    if names is not None:
        out.write(",".join(names) + "\n")
    for row in zip(*columns, strict=True):
        out.write(",".join(str(v) if isinstance(v, str) else repr(v.item()) for v in row) + "\n")
    return out.getvalue()


def signals(rng: np.random.Generator, n: int, count: int) -> list[NDArray[Any]]:
    return [rng.normal(size=n) for _ in range(count)]


def tried(path: Path) -> tuple[Recording | None, str]:
    """The recording, or what the refusal says."""
    try:
        return read(path), ""
    except AllaniteError as error:
        return None, str(error)


def in_unit(seconds: NDArray[np.float64], unit: str, whole: bool) -> NDArray[Any]:
    values = seconds / UNITS[unit]
    return np.round(values).astype(np.int64) if whole else values


@pytest.mark.long
@pytest.mark.parametrize("block", range(4))
def test_the_column_that_is_named_is_time(tmp_path: Path, block: int) -> None:
    """By name, in another case, and by number; in a table with a header, without one, and as rows of a matrix."""
    for seed in CASES[block::4]:
        rng = case(seed)
        width, place = int(rng.integers(2, 6)), 0
        place = int(rng.integers(width))
        rate = float(rng.choice([1.0, 20.0, 95.5, 100.0, 400.0, 2000.0]))
        unit = str(rng.choice(list(UNITS)))
        whole = unit in ("us", "ns")
        stamps = in_unit((np.arange(N) + float(rng.integers(1000))) / rate, unit, whole)
        columns = signals(rng, N, width)
        columns[place] = stamps
        names = [f"v{i}" for i in range(width)]
        names[place] = str(rng.choice(["Foo", "my clock", "a:b", "x"]))
        form = str(rng.choice(["named", "numbered", "bare", "rows", "npy"]))
        path = tmp_path / ("log.npy" if form in ("rows", "npy") else "log.csv")
        if form in ("rows", "npy"):
            matrix = np.stack([c.astype(float) for c in columns])
            np.save(path, matrix if form == "rows" else matrix.T)
        else:
            path.write_text(text(columns, None if form == "bare" else names))
        word = (
            (names[place].upper() if rng.random() < 0.5 else names[place])
            if form == "named"
            else str(place + 1)
        )
        recording = read(path, time=f"{word}:{unit}")
        assert recording.rate == pytest.approx(rate, rel=1e-4), (seed, form, unit)
        assert (recording.n_samples, len(recording.names)) == (N, width - 1), (seed, form)
        assert np.array_equal(recording.values(recording.names[0]), columns[0 if place else 1]), seed


@pytest.mark.long
@pytest.mark.parametrize("block", range(2))
def test_a_counter_goes_on_where_it_begins_anew(tmp_path: Path, block: int) -> None:
    """Any step, any width, the width said or told from the column; lost samples are gaps."""
    for seed in CASES[block::2]:
        rng = case(1000 + seed)
        bits = int(rng.choice([8, 16, 24, 32]))
        stride = int(rng.integers(1, 3 if bits == 8 else 300))
        n = 400
        lost = rng.integers(50, 300) if rng.random() < 0.5 else None
        numbers = np.arange(n + 3)
        kept = numbers if lost is None else np.delete(numbers, slice(int(lost), int(lost) + 3))
        start = (1 << bits) - stride * 200 - int(rng.integers(stride))
        counts = (start + stride * kept) % (1 << bits)
        step, seconds = (
            ("1/1000 s", 1e-3),
            ("15.625 us", 15.625e-6),
            ("32768 Hz", 1 / 32768),
            ("2e-6 s", 2e-6),
        )[int(rng.integers(4))]
        near_turn = lost is not None and abs(int(lost) - 200) < 8
        said = f":2^{bits}" if near_turn or rng.random() < 0.5 else ""
        path = tmp_path / "log.npz"
        np.savez(path, cnt=counts, v=rng.normal(size=len(counts)))
        recording = read(path, time=f"cnt:{step}{said}")
        assert recording.rate == pytest.approx(1 / (stride * seconds), rel=1e-9), (seed, bits, stride)
        assert recording.n_samples == len(numbers), (seed, bits, stride, said)
        assert np.isnan(recording.values("v")).sum() == (0 if lost is None else 3), seed


@pytest.mark.long
@pytest.mark.parametrize("block", range(2))
def test_a_first_column_that_only_grows_is_time_or_asked_about(tmp_path: Path, block: int) -> None:
    """Of a file without names: any unit, even or not, coarse or in bursts, behind row numbers or not."""
    told = 0
    for seed in CASES[block::2]:
        rng = case(2000 + seed)
        rate = float(rng.choice([1.0, 10.0, 50.0, 100.0, 1000.0]))
        unit = str(rng.choice(["s", "ms", "us", "ns"]))
        t = np.arange(N) / rate
        shape = str(rng.choice(["even", "jitter", "pauses", "coarse", "random", "counter"]))
        t = t + {
            "jitter": rng.uniform(-0.3, 0.3, N) / rate,
            "pauses": np.cumsum(rng.random(N) < 0.1) * rng.integers(5, 5000) / rate,
            "random": np.cumsum(rng.exponential(size=N)) / rate,
        }.get(shape, np.zeros(N))
        t = np.floor(t * rate / 7) * 7 / rate if shape == "coarse" else np.sort(t)
        stamps = in_unit(t + float(rng.choice([0.0, 1234.5, 1.7e9])), unit, unit != "s")
        columns = [*([np.arange(N)] if shape == "counter" else []), stamps, *signals(rng, N, 2)]
        path = tmp_path / ("log.npy" if rng.random() < 0.5 else "log.csv")
        if path.suffix == ".npy":
            matrix = np.stack([c.astype(float) for c in columns])
            np.save(path, matrix if rng.random() < 0.5 else matrix.T)
        else:
            path.write_text(text(columns))
        number = 2 if shape == "counter" else 1
        recording, error = tried(path)
        if recording is None:
            assert re.search(rf"--time {number}:|time column 'column {number}'", error), (seed, error)
            continue
        told += 1
        assert len(recording.names) == 2, (seed, shape, unit)
        if shape in ("even", "jitter", "counter"):
            assert recording.rate == pytest.approx(rate, rel=0.02), (seed, shape, unit)
    assert told > 10


@pytest.mark.long
def test_arrays_go_with_the_time_of_their_length(tmp_path: Path) -> None:
    for seed in CASES:
        rng = case(3000 + seed)
        names = ["t", "t_a"] if rng.random() < 0.5 else ["time_gyro", "time_acc"]
        lengths = rng.choice(np.arange(40, 120), size=3, replace=False)
        rates = rng.choice([10.0, 25.0, 100.0, 200.0], size=2, replace=False)
        w, a = (rng.normal(size=(int(n), 3)) for n in lengths[:2])
        turned = rng.random() < 0.3
        arrays = {
            names[0]: np.arange(lengths[0]) / rates[0], "w": w.T if turned and lengths[0] > 60 else w,
            names[1]: np.arange(lengths[1]) / rates[1], "a": a,
        }  # fmt: skip
        if rng.random() < 0.3:
            arrays["t_rest"] = np.arange(float(lengths[2] + 200))  # longer than all samples, and time of none
        keys = list(rng.permutation(list(arrays)))
        np.savez(tmp_path / "log.npz", **{str(k): arrays[k] for k in keys})
        which = seed % 2
        name, n, rate = ("w", "a")[which], lengths[which], pytest.approx(rates[which], rel=1e-9)
        options: dict[str, Any] = ({"variable": name}, {"time": names[which]}, {})[seed % 3]
        recording = read(tmp_path / "log.npz", **options)
        if not options:
            n, rate = max(lengths[:2]), pytest.approx(rates[int(np.argmax(lengths[:2]))], rel=1e-9)
        assert (recording.n_samples, recording.rate, len(recording.names)) == (n, rate, 3), (seed, options)


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("ustime", "µs"), ("now[ms]", "ms"), ("t_us", "µs"), ("tus", "µs"), ("millis", "ms"), ("micros()", "µs"),
        ("nanos", "ns"), ("T[us]", "us"), ("now_us", "µs"), ("tow", ""), ("iTOW", ""), ("timestamp_ns", "ns"),
        ("elapsed_ms", "ms"), ("seconds_elapsed", "s"), ("usec", "µs"), ("microseconds", "µs"),
        ("mstime", "ms"), ("time_since_start (s)", "s"), ("uptime_ms", "ms"), ("sysmillis", "ms"),
        ("host_time_ns", "ns"), ("elapsed", ""), ("ts", ""), ("systime", ""), ("times", ""), ("uptime", ""),
    ],
)  # fmt: skip
def test_names_of_time_and_their_units(heading: str, unit: str) -> None:
    found = read_heading(heading)
    assert (found.group, found.unit) == (
        "time",
        {"µs": ("µs", "us")}.get(unit, (unit,))[-1] if "[us]" in heading else unit,
    )


@pytest.mark.parametrize(
    "heading", ["dt", "dt_us", "delta_t", "time_diff", "temp", "t1", "rate", "tension", "s", "timeout"]
)
def test_names_that_are_not_those_of_time(heading: str) -> None:
    assert read_heading(heading).group != "time"


@pytest.mark.long
def test_a_unit_that_is_not_named_is_told_from_the_values_or_asked(tmp_path: Path) -> None:
    """A gyro's log at 1 Hz to 20 kHz: the rate is right, or the question names the option."""
    told = 0
    for seed in CASES:
        rng = case(4000 + seed)
        rate = float(rng.choice([1.0, 5.0, 20.0, 47.0, 100.0, 250.0, 1000.0, 4000.0]))
        unit = str(rng.choice(["s", "ms", "us", "ns"]))
        if rate > 1000 and unit == "ms":
            continue
        seconds = np.arange(N) / rate + float(rng.choice([0.0, 77.0, 1.7e9]))
        if rng.random() < 0.5:
            seconds = seconds + rng.uniform(-0.1, 0.1, N) / rate
        path = tmp_path / "log.csv"
        name = str(rng.choice(["time", "timestamp", "now", "elapsed", "ts"]))
        path.write_text(
            text([in_unit(seconds, unit, unit != "s"), *signals(rng, N, 2)], [name, "gyro_x", "gyro_y"])
        )
        recording, error = tried(path)
        if recording is None:
            assert re.search(rf"--time {name}:{unit} \([\d.]+ Hz\)", error), (seed, error)
            assert read(path, time=f"{name}:{unit}").rate == pytest.approx(rate, rel=0.02), seed
            continue
        told += 1
        assert recording.rate == pytest.approx(rate, rel=0.02), (seed, rate, unit)
    assert told > 50


def test_a_rate_that_the_file_states_settles_the_unit_of_its_stamps() -> None:
    steps = StampSteps(mean=10.0, whole=True)
    assert tell(steps, 0.0, None, False) is None
    for nominal, unit in ((100.0, "ms"), (0.1, "s"), (1e5, "us")):
        told = tell(steps, 0.0, nominal, False)
        assert told is not None and told.unit == unit


@pytest.mark.parametrize(
    ("said", "match"),
    [
        ("nowhere:ms", r"no column 'nowhere'.*1 \(t\), 2 \(v\)"), ("t:furlongs", "write a column and its unit"),
        ("t:1us:2^99", "restarts: write 2"), ("t:0 s", "write a column"),
        ("9", "no column '9'"), ("t:1/0 s", "write a column"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_an_error(tmp_path: Path, said: str, match: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text([np.arange(N) / 10, np.ones(N)], ["t", "v"]))
    with pytest.raises(InputError, match=match):
        read(path, time=said)


def test_no_time_column_is_said_where_there_is_none(tmp_path: Path) -> None:
    rng = case(0)
    path = tmp_path / "static_200Hz.csv"
    path.write_text(text(signals(rng, N, 2), ["v", "w"]))
    with pytest.raises(InputError, match=r"no time column.*--rate 200 .*file name states 200 Hz"):
        read(path)
    path.write_text(text([np.arange(N) * 3.1 + 2.0, rng.normal(size=N)], ["zp", "w"]))
    with pytest.raises(InputError, match=r"column 'zp' only grows.*--time zp:UNIT.*--rate 200"):
        read(path)
    with pytest.raises(InputError, match=r"no column is time, as stated"):
        read(path, time="none")
    recording = read(path, time="none", rate=10)
    assert recording.names == ("zp", "w")


def test_clocks_that_begin_anew_by_themselves(tmp_path: Path) -> None:
    """Microseconds of a processor, the seconds of a week, of a day: told from the column, and said."""
    k = np.arange(500)
    for name, turn, step in (
        ("micros", 2**32, 10_000), ("tow", 604_800, 0.1), ("iTOW", 604_800_000, 100), ("time [s]", 86_400, 0.25)
    ):  # fmt: skip
        values = (turn - 250 * step + k * step) % turn
        path = tmp_path / "log.csv"
        path.write_text(text([values, np.sin(k)], [name, "wx"]))
        recording = read(path)
        assert (recording.n_samples, recording.notes["timebase"]["backward"]) == (500, 0), name
        assert any("wraps at" in g for g in recording.notes["text"]["guesses"]), name
    path.write_text(text([k % 100 / 10, np.sin(k)], ["time [s]", "wx"]))  # five records one after another
    assert read(path).notes["timebase"]["backward"] == 4


@pytest.mark.long
def test_the_advice_to_cut_a_record_works_as_it_is_written(tmp_path: Path) -> None:
    """A clock that was set once or twice, by hours to decades, forward or back: what is advised gives that part."""
    for seed in CASES:
        rng = case(5000 + seed)
        rate = float(rng.choice([1.0, 10.0, 100.0]))
        lengths = rng.integers(40, 300, size=int(rng.integers(2, 4)))
        jumps = np.concatenate(([0.0], 10.0 ** rng.uniform(8.0, 9.3, size=len(lengths) - 1) / rate))
        jumps[1:] *= np.where(np.arange(1, len(lengths)) == 2, rng.choice([-0.3, 1.0]), 1.0)
        t = np.arange(lengths.sum()) / rate + np.repeat(np.cumsum(np.round(jumps)), lengths)
        np.savez(tmp_path / "log.npz", t_s=t + rng.uniform(-0.1, 0.1, len(t)) / rate, gyro=np.arange(len(t)))
        recording, error = tried(tmp_path / "log.npz")
        assert recording is None, seed
        advice = re.search(
            r"Split it there, (?:--from (\S+))? ?(?:--to (\S+))? ?for the longest part \((\d+) of", error
        )
        assert advice, (seed, error)
        ends = {k: float(v) for k, v in zip(("start", "stop"), advice.groups(), strict=False) if v}
        part = read(tmp_path / "log.npz", **ends)
        assert part.rate == pytest.approx(rate, rel=0.01), seed
        edges = np.concatenate(([0], np.cumsum(lengths)))
        k = int(np.searchsorted(edges, part.values("gyro")[0], side="right")) - 1
        assert np.array_equal(part.values("gyro"), np.arange(edges[k], edges[k + 1])), (seed, k)
        assert int(advice[3]) == part.n_samples == lengths.max(), seed


@pytest.mark.long
def test_the_advice_on_a_clock_that_was_set_back_gives_rows_of_one_part(tmp_path: Path) -> None:
    """By less than the record, once or twice: what is advised ends the finding, and takes as many rows as it says."""
    cut = 0
    for seed in CASES:
        rng = case(9000 + seed)
        rate = float(rng.choice([1.0, 10.0, 100.0]))
        lengths = rng.integers(40, 300, size=int(rng.integers(2, 4)))
        steps = -np.round(rng.uniform(0.1, 1.6) * lengths[: len(lengths) - 1]) / rate
        t = np.arange(lengths.sum()) / rate + np.repeat(np.cumsum(np.r_[0.0, steps]), lengths)
        np.savez(tmp_path / "log.npz", t_s=t + rng.uniform(-0.1, 0.1, len(t)) / rate, gyro=np.arange(len(t)))
        fault = next(f for f in check(read(tmp_path / "log.npz")) if f.code == "time_stamps")
        ways = dict(re.findall(r"--(from|to) (\S+)", fault.advice))
        if ways:
            ends = {{"from": "start", "to": "stop"}[k]: float(v) for k, v in ways.items()}
            part = read(tmp_path / "log.npz", **ends)
        else:
            part = clean(read(tmp_path / "log.npz"), "keep_run")
        cut += bool(ways)
        wanted = re.search(r"(?:takes|longest run) \(?(\d+) rows", fault.advice)
        assert wanted and abs(part.n_samples - int(wanted[1])) <= 1, (seed, fault.advice)
        assert 2 * part.n_samples >= lengths.max() - 2, seed
        assert np.all(np.diff(part.values("gyro")) == 1), seed
        assert "time_stamps" not in {f.code for f in check(part)}, seed
    assert 0 < cut < len(CASES)  # a run beats a cut by times, unless these are its own


@pytest.mark.parametrize("rows", [(20, 21), (7, 300)])
def test_rows_out_of_order_are_to_be_sorted_and_a_restart_is_not(
    tmp_path: Path, rows: tuple[int, int]
) -> None:
    t = np.arange(400) / 100
    swapped = t.copy()
    swapped[[*rows]] = swapped[[*reversed(rows)]]
    for name, stamps in (("swapped", swapped), ("restarted", np.r_[t, t])):
        np.savez(tmp_path / "log.npz", t_s=stamps, gyro=np.arange(len(stamps)))
        advice = next(f for f in check(read(tmp_path / "log.npz")) if f.code == "time_stamps").advice
        assert ("sort the rows" in advice) == (name == "swapped"), (name, advice)
        assert ("--repair keep_run" in advice) == (name == "restarted"), (name, advice)


@pytest.mark.long
def test_a_part_is_cut_by_the_stamps_as_they_are(tmp_path: Path) -> None:
    """Jitter, pauses, lost stamps: the rows between two times, those and no others."""
    for seed in CASES:
        rng = case(6000 + seed)
        n, rate = 200, float(rng.choice([0.5, 10.0, 100.0]))
        t = (
            np.arange(n)
            + np.cumsum(rng.integers(1, 40, n) * (rng.random(n) < 0.03))
            + rng.uniform(-0.2, 0.2, n)
        ) / rate
        t -= t[0]
        np.savez(tmp_path / "log.npz", t_s=t, gyro=np.arange(n))
        a, b = np.sort(rng.choice(n, size=2, replace=False)) if seed % 3 else (0, n - 1)
        if b - a < 20:
            continue
        start = None if seed % 5 == 0 else float(t[a])
        stop = None if seed % 7 == 0 else float(t[b])
        part = read(tmp_path / "log.npz", start=start, stop=stop)
        values = part.values("gyro")
        wanted = np.arange(a if start is not None else 0, b if stop is not None else n)
        assert np.array_equal(values[np.isfinite(values)], wanted), seed
        assert part.duration == pytest.approx(t[wanted[-1]] - t[wanted[0]] + 1 / rate, abs=1.0 / rate), seed
        step = next((s for s in part.history if s["step"] == "window"), None)
        assert (step is None) == (start is None and stop is None)
        assert step is None or step["start_s"] == pytest.approx(t[wanted[0]], abs=1e-9)
    for ends in ({"start": 1e6}, {"stop": 1e6}, {"start": 3.0, "stop": 2.0}, {"start": math.nan}):
        with pytest.raises(InputError, match="window from"):
            read(tmp_path / "log.npz", **ends)  # type: ignore[arg-type]
    assert read(tmp_path / "log.npz", rate=100, start=0.5, stop=1.0).n_samples == 50


def written(
    moment: datetime.datetime, order: str, sign: str, short: bool, style: str, zeros: bool
) -> list[str]:
    """A date and a time of day as loggers write them: one cell, or two."""
    number = "02d" if zeros else "d"
    year = f"{moment.year % 100:02d}" if short else str(moment.year)
    parts = {"y": year, "m": f"{moment.month:{number}}", "d": f"{moment.day:{number}}"}
    date = sign.join(parts[letter] for letter in order)
    clock = moment.strftime("%H:%M:%S.") + f"{moment.microsecond // 1000:03d}"
    if style == "12 hours":
        half = moment.strftime("%I:%M:%S.") + f"{moment.microsecond // 1000:03d}"
        return [f"{date} {half} {'AM' if moment.hour < 12 else 'PM'}"]
    return {"blank": [f"{date} {clock}"], "two": [date, clock], "after": [f"{clock} {date}"]}[style]


@pytest.mark.long
def test_dates_in_any_order_are_told_from_the_whole_column_or_asked(tmp_path: Path) -> None:
    """Every stamp, to the millisecond, in each order; what stays open is asked, and the answer gives the right one."""
    asked = 0
    for seed in CASES:
        rng = case(7000 + seed)
        order = str(rng.choice(["dmy", "mdy", "ymd"]))
        short = bool(rng.random() < 0.3)
        sign = str(rng.choice(["/", ".", "-"]))
        style = str(rng.choice(["blank", "two", "after", "12 hours"]))
        start = datetime.datetime(2020, 1, 1) + datetime.timedelta(
            seconds=int(rng.integers(0, 5 * 365 * 86_400))
        )
        step = float(rng.choice([0.01, 1.0, 600.0, 7200.0]))
        if rng.random() < 0.3:  # through a midnight
            start = start.replace(hour=23, minute=59, second=59)
        moments = [start + datetime.timedelta(milliseconds=round(1000 * step * k)) for k in range(N)]
        rows = [written(m, order, sign, short, style, bool(rng.random() < 0.5)) for m in moments]
        head = ["Date"] + ["Time"] * (len(rows[0]) - 1) + ["gyro_x"]
        path = tmp_path / "log.csv"
        path.write_text(
            "\n".join(",".join(r) for r in [head, *([*row, f"{rng.normal():.4f}"] for row in rows)]) + "\n"
        )
        recording, error = tried(path)
        if recording is None:
            asked += 1
            assert f"--time Date:{order} ({start.strftime('%d %B %Y').lstrip('0')})" in error, (seed, error)
            recording = read(path, time=f"Date:{order}")
        else:
            assert (
                max(m.day for m in moments) > 12
                or len({m.date() for m in moments}) > 1
                or (start.day == start.month or order == "ymd")
            ), (seed, rows[0])
        first = int(np.datetime64(start, "ns").astype(np.int64))
        assert recording.start == first, (seed, rows[0], rows[-1])
        assert (recording.n_samples, recording.rate) == (N, pytest.approx(1 / step, rel=1e-3)), (
            seed,
            rows[0],
        )
    assert 10 < asked < 60


def test_a_day_that_is_told_late_in_the_file_counts(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    days = [f"{d:02d}/03/2026 {h:02d}:00:00,{d}.5\n" for d in range(9, 16) for h in range(24)]
    path.write_text("when,wx\n" + "".join(days))
    recording = read(path)
    assert recording.start == int(np.datetime64("2026-03-09T00:00:00", "ns").astype(np.int64))
    assert (recording.n_samples, recording.notes["timebase"]["unit"]) == (168, "dd/mm/yyyy")
    path.write_text("when,wx\n" + "".join(days).replace("15/03", "31/02"))
    with pytest.raises(FormatError, match=r"column 1 \(when\).*not dates in any single order"):
        read(path)
    with pytest.raises(FormatError, match="not dates"):
        read(path, time="when:mdy")


@pytest.mark.long
def test_rows_of_several_kinds_are_listed_each_with_its_rate(tmp_path: Path) -> None:
    """The kind in any column, with a header or without; seconds or microseconds; kinds of other widths and rates."""
    for seed in CASES[::5]:
        rng = case(8000 + seed)
        names = rng.permutation(
            [["ACC", "GYRO", "MAG"], ["accel", "gyro", "baro"], ["IMU", "GPS", "BARO"]][seed % 3]
        )
        rates = rng.choice([20, 50, 100, 200], size=3, replace=False)
        unit, width = str(rng.choice(["s", "us"])), rng.integers(1, 5, size=3)
        place = int(rng.choice([0, 1, 2, -1])) if width.min() > 1 else int(rng.choice([0, 1, -1]))
        rows = []
        for name, rate, k in zip(names, rates, width, strict=True):
            for t in np.arange(3 * rate) / rate + 12.5:
                cells = [
                    f"{t:.4f}" if unit == "s" else str(round(t * 1e6)),
                    *(f"{v:.4f}" for v in rng.normal(size=k)),
                ]
                cells.insert(len(cells) if place < 0 else place, str(name))
                rows.append((t, ",".join(cells)))
        path = tmp_path / "log.txt"
        path.write_text("\n".join(row for _, row in sorted(rows)) + "\n")
        for name, rate, k in zip(names, rates, width, strict=True):
            recording = read(path, variable=str(name))
            assert (recording.n_samples, len(recording.names)) == (3 * rate, k), (seed, name, place)
            assert recording.rate == pytest.approx(rate, rel=1e-3), (seed, name, place, unit)
            listed = " ".join(recording.notes["source"]["contents"])
            for other, own in zip(names, rates, strict=True):
                assert f"{other} ({3 * own} rows, {own} Hz" in listed, (seed, listed)
        chosen = read(path)
        assert chosen.names[0].split("_")[0] in ("GYRO", "gyro", "IMU", "ACC", "accel"), seed


@pytest.mark.long
def test_a_steady_clock_is_called_steady_whatever_the_pauses(tmp_path: Path) -> None:
    """Pauses that end beside the grid: the rate is that of the samples between them, and no drift is said."""
    for seed in CASES:
        rng = case(9000 + seed)
        n, k = 1000, np.arange(1000)
        jitter = float(rng.choice([0.0, 0.02, 0.1, 0.3]))
        pauses = np.zeros(n)
        pauses[rng.choice(np.arange(100, n - 100), size=int(rng.integers(1, 6)), replace=False)] = 1.0
        t = k + np.cumsum(pauses * rng.exponential(40.0, n) + pauses * 2.0) + rng.uniform(-jitter, jitter, n)
        base = fit_grid(ArrayStamps((t - t[0]) / 95.0), source="t", unit="s")
        # Least squares over the parts between six pauses: the shortest ones tell least.
        lengths = np.diff(np.concatenate(([0], np.flatnonzero(pauses), [n])))
        sd = jitter / math.sqrt(3.0) * math.sqrt(12.0 / float((lengths.astype(float) ** 3).sum()))
        assert abs(base.rate / 95.0 - 1.0) < 5.0 * sd + 1e-8, (seed, jitter)
        change, error = base.facts["rate_change_ppm"], base.facts["rate_change_error_ppm"]
        assert change is None or abs(change) < max(100.0, 5.0 * error), (seed, jitter)


@pytest.mark.parametrize(
    "name",
    ["MJD", "jd", "Julian Date", "mjd_utc", "JDUTC", "Modified Julian Date", "time_mjd", "jd_tt", "BJD"],
)
def test_days_of_the_julian_calendar_are_days(name: str, tmp_path: Path) -> None:
    """Whatever the rate: a slow log is not one in seconds."""
    first = 60340.5 if "m" in name.lower().replace("time_", "") else 2460341.0
    for rate in (1.0, 0.01):
        log = tmp_path / "log.csv"
        rows = "".join(f"{first + k / rate / 86_400:.8f},{k * k % 17}\n" for k in range(300))
        log.write_text(f"{name},volt [V]\n{rows}", encoding="utf-8")
        recording = read(log)
        assert recording.rate == pytest.approx(rate, rel=1e-4)
        assert recording.notes["timebase"]["unit"] == "d"
