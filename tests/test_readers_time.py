# SPDX-License-Identifier: BSD-3-Clause
"""Which column is time, and how its values count: as the caller says, as the file says, or asked."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import AllaniteError, InputError
from allanite.readers import read
from allanite.readers.headings import read_heading
from allanite.recording import Recording

CASES = range(200)
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
    assert told > 20


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
    assert told > 100


@pytest.mark.parametrize(
    ("said", "match"),
    [
        ("nowhere:ms", r"no column 'nowhere'.*1 \(t\), 2 \(v\)"), ("t:furlongs", "write a column and its unit"),
        ("t:1us:2^99", "begins anew: write 2"), ("t:0 s", "write a column"),
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
    with pytest.raises(InputError, match=r"no time column.*--rate 200 .*name of the file says 200 Hz"):
        read(path)
    path.write_text(text([np.arange(N) * 3.1 + 2.0, rng.normal(size=N)], ["zp", "w"]))
    with pytest.raises(InputError, match=r"column 'zp' only grows.*--time zp:UNIT.*--rate 200"):
        read(path)
    with pytest.raises(InputError, match=r"no column is time, as was said"):
        read(path, time="none")
    recording = read(path, time="none", rate=10)
    assert recording.names == ("zp", "w")


def test_clocks_that_begin_anew_by_themselves(tmp_path: Path) -> None:
    """Microseconds of a processor, the seconds of a week, of a day: told from the column, and said."""
    k = np.arange(500)
    for name, turn, step in (
        ("micros", 2**32, 10_000), ("tow [s]", 604_800, 0.1), ("iTOW [ms]", 604_800_000, 50), ("time [s]", 86_400, 0.25)
    ):  # fmt: skip
        values = (turn - 250 * step + k * step) % turn
        path = tmp_path / "log.csv"
        path.write_text(text([values, np.sin(k)], [name, "wx"]))
        recording = read(path)
        assert (recording.n_samples, recording.notes["timebase"]["backward"]) == (500, 0), name
        assert any("begins anew" in g for g in recording.notes["text"]["guesses"]), name
    path.write_text(text([k % 100 / 10, np.sin(k)], ["time [s]", "wx"]))  # five records one after another
    assert read(path).notes["timebase"]["backward"] == 4
