# SPDX-License-Identifier: BSD-3-Clause
"""Rates that files state: in lines, scalars, attributes and metadata; and units of counts since a moment."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import hdf5, read
from allanite.files.readers.delimited.preamble import rate_in
from allanite.files.readers.stamp_units import FACTORS, StampSteps, candidates
from allanite.files.readers.stated_rate import keyed_statement
from allanite.recording.records import Recording
from hostile_files import inline

N = 200
GYRO = np.random.default_rng(8).normal(0.5, 0.1, N)


def log(folder: Path, preamble: str, decimal: str = ".", heading: str = "gyro_x [deg/s]") -> Path:
    path = folder / "log.csv"
    rows = [f"{x:.5f}".replace(".", decimal) for x in GYRO]
    path.write_text("\n".join(["# a log", *preamble.split("\n"), heading, *rows]) + "\n")
    return path


# -- thousands ---------------------------------------------------------------------------------------------

#: How a number is written -> decimal sign that it is written with, and sign between its thousands.
WRITTEN = {"point": (".", ","), "comma": (",", "."), "Swiss": (".", "'"), "blank": (",", " ")}
NAMES = ("Sample rate: {} Hz", "sampling frequency = {} Hz", "ODR: {} Hz", "rate: {} Hz")


def written(value: float, form: str, digits: int) -> str:
    point, between = WRITTEN[form]
    return f"{value:,.{digits}f}".translate(str.maketrans({",": between, ".": point}))


@pytest.mark.long
@pytest.mark.parametrize("form", WRITTEN)
def test_a_rate_in_the_way_of_the_table_is_read(tmp_path: Path, form: str) -> None:
    """With thousands, a fraction, or both; where the table has the same decimal sign."""
    for value, digits, name in product((100.0, 1000.0, 2048.0, 10_000.0, 1234.5), (0, 1, 2), NAMES):
        if round(value, digits) != value:
            continue
        line = f"# {name.format(written(value, form, digits))}"
        recording = read(log(tmp_path, line, WRITTEN[form][0]))
        assert recording.rate == value, line


def test_a_number_that_may_be_two_is_taken_as_neither(tmp_path: Path) -> None:
    """Whole numbers show no decimal sign: the question lists both readings, for rates and intervals."""
    for value, sign, name in product((1, 2, 10, 20), ",.", ("Sample rate: {} Hz", "dt: {} us", "fs={}")):
        text = f"{value}{sign}000"
        path = tmp_path / "log.csv"
        path.write_text(
            f"# a log\n# {name.format(text)}\ngyro_x [LSB]\n" + "".join(f"{k % 7}\n" for k in range(N))
        )
        with pytest.raises(InputError, match="decimal sign") as error:
            read(path)
        factor = (lambda v: 1e6 / v) if "us" in name else float
        assert all(f"--rate {factor(v):.9g}" in str(error.value) for v in (value, 1000 * value)), text


def test_a_thousand_is_a_guess_in_words(tmp_path: Path) -> None:
    recording = read(log(tmp_path, "# Sample rate: 1,000 Hz"))
    assert any("1,000" in guess and "1000" in guess for guess in recording.notes["text"]["guesses"])


@pytest.mark.parametrize(
    "text",
    ["28.11.2026", "2026-11-28", "28/11/2026", "12:30", "12:30:05.5", "1,00,000", "1.2.3", "1'00", "10 000"],
)
def test_a_date_a_time_of_day_and_a_broken_number_are_no_interval(text: str) -> None:
    for name in ("dt", "ts", "Sample Time", "sampling interval", "period", "Sample rate", "fs"):
        stated = rate_in([f"# {name}: {text}"])
        assert (stated.rate, stated.doubt) == (None, None), name


# -- which rate --------------------------------------------------------------------------------------------

EXPLICIT = (
    "Sample rate: 100 Hz", "Sampling frequency = 100 Hz", "Output data rate: 100", "ODR: 100 Hz", "fs=100", "dt: 0.01",
    "sampling interval: 10 ms", "Gyro ODR: 100 Hz", "IMU data rate: 100 Hz", "Actual sampling rate, 100 Hz",
    "sample_rate: 100", "Abtastrate = 100 Hz", "imu update rate: 100", "logging rate: 100 Hz",
)  # fmt: skip
OTHERS = (
    "Cutoff frequency: 40 Hz", "Corner frequency = 40 Hz", "Filter frequency: 40 Hz", "Line frequency: 50 Hz",
    "Mains frequency: 50", "GPS rate: 5 Hz", "GPS update rate: 5 Hz", "Mag ODR: 50 Hz", "Mag: ODR 50 Hz",
    "Output data rate (mag): 50 Hz", "Baro sample rate: 25 Hz", "Baud rate: 9600", "baud_rate: 9600",
    "Clock frequency: 32 kHz", "Carrier frequency: 10 kHz", "Display refresh rate: 60 Hz", "Frame rate: 30",
    "Earth rate: 15.04", "max rate: 450", "Gyro full scale rate: 250", "Maximum sample rate: 8000 Hz", "Turn rate: 10",
    "Angular rate: 5", "Table rotation rate: 20", "Resonance frequency: 25 kHz", "GPS sample interval: 0.2 s",
    "warm-up period: 600 s", "Filter period: 1 s", "averaging period: 2 s", "camera sampling rate: 30 Hz",
    "bandwidth frequency: 47 Hz", "Low-pass filter frequency: 47 Hz", "MPU6050 wobble frequency: 3 Hz", "Gyro FS: 250",
)  # fmt: skip


@pytest.mark.parametrize("other", OTHERS)
def test_a_rate_of_something_else_is_not_that_of_the_samples(other: str) -> None:
    """Neither alone, nor before or behind that of the samples, on the same line or on another one."""
    alone = rate_in([f"# {other}"])
    assert (alone.rate, alone.doubt) == (None, None)
    for stated in EXPLICIT:
        for lines in ([other, stated], [stated, other], [f"{other}, {stated}"], [f"{stated}; {other}"]):
            assert rate_in([f"# {line}" for line in lines]).rate == pytest.approx(100.0), lines


@pytest.mark.parametrize("stated", EXPLICIT)
def test_the_sample_rate_wins_over_a_bare_rate(stated: str) -> None:
    for bare, turned in product(
        ("Rate: 40 Hz", "frequency = 40", "sensor rate: 40 Hz", "period: 2 s"), (False, True)
    ):
        lines = [bare, stated][:: -1 if turned else 1]
        found = rate_in(lines)
        assert found.rate == pytest.approx(100.0)
        assert any("several" in guess for guess in found.guesses)


@pytest.mark.long
def test_sample_rates_that_contradict_each_other_are_asked_about(tmp_path: Path) -> None:
    other = (
        "Accel ODR: 52 Hz",
        "fs = 52",
        "sampling interval: 19.230769 ms",
        "dt: 19.230769",
        "dt: 0.019230769",
    )
    for stated, second in product(EXPLICIT[::3], other):
        for lines in ([stated, second], [second, stated]):
            path = log(tmp_path, "\n".join(f"# {line}" for line in lines))
            with pytest.raises(InputError, match="several sample rates") as error:
                read(path)
            assert "--rate 100" in str(error.value) and "--rate 52" in str(error.value)
            assert read(path, rate=100).rate == 100


def test_stamps_settle_what_the_lines_leave_open(tmp_path: Path) -> None:
    """And are never overruled by them: the finding shows the difference."""
    doubtful = (
        "fs: 100\n# Accel ODR: 52 Hz",
        "Sample rate: 1,000 Hz",
        "dt: 1",
        "Sampling time: 3600 s",
        "fs: 200 Hz",
    )
    for line, unit in product(doubtful, ("t [s]", "time")):
        path = tmp_path / "log.csv"
        rows = "".join(f"{k / 100:.2f},{x:.5f}\n" for k, x in enumerate(GYRO))
        path.write_text(f"# a log\n# {line}\n{unit},gyro_x [deg/s]\n{rows}")
        recording = read(path)
        assert recording.rate == pytest.approx(100.0, rel=1e-6), line
        if line == "fs: 200 Hz":
            assert recording.notes["timebase"]["rate_nominal"] == 200.0


@pytest.mark.parametrize(
    "line", ["Sampling time: 3600 s", "sample time = 120", "Data time: 1 h", "frequency: 16 MHz"]
)
def test_what_may_be_a_duration_or_a_clock_is_asked_about(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="--rate"):
        read(log(tmp_path, f"# {line}"))
    assert read(log(tmp_path, f"# {line}\n# fs: 100")).rate == 100.0


# -- intervals without a unit ------------------------------------------------------------------------------

INTERVALS = (0.0005, 0.01, 0.5, 1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0, 2500.0, 10_000.0)


def by_line(folder: Path, dt: float, heading: str) -> Any:
    return read(log(folder, f"# dt: {dt:.10g}", heading=heading))


def by_array(folder: Path, dt: float, heading: str) -> Any:
    np.savez(folder / "log.npz", **{heading: GYRO}, dt=dt)  # type: ignore[arg-type]
    return read(folder / "log.npz")


def by_mapping(folder: Path, dt: float, heading: str) -> Any:
    return Recording.from_samples({heading: GYRO, "sample_interval": dt})


def by_attribute(folder: Path, dt: float, heading: str) -> Any:
    h5py = pytest.importorskip("h5py", reason="the extra allanite[hdf5] is not installed")
    with h5py.File(folder / "log.h5", "w") as file:
        name, _, unit = heading.rstrip("]").partition(" [")
        file[name], file.attrs["dt"] = GYRO, dt
        file[name].attrs["units"] = unit
    return read(folder / "log.h5")


def by_column(folder: Path, dt: float, heading: str) -> Any:
    path = folder / "log.csv"
    path.write_text(f"dt,{heading}\n" + "".join(f"{dt:.10g},{x:.5f}\n" for x in GYRO))
    return read(path)


@pytest.mark.parametrize("heading", ["gyro_x [deg/s]", "volts [V]"])
@pytest.mark.parametrize("door", [by_line, by_array, by_mapping, by_attribute])
def test_one_rule_for_an_interval_without_a_unit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, door: Callable[..., Any], heading: str
) -> None:
    """A line, a scalar and an attribute mean what a column of the same number means, or all ask."""
    monkeypatch.setattr(hdf5, "run", inline)
    for dt in INTERVALS:
        outcomes = []
        for way in (by_column, door):
            try:
                outcomes.append(way(tmp_path, dt, heading))
            except InputError as error:
                outcomes.append(str(error))
        column, other = outcomes
        if isinstance(column, str):
            asked = re.findall(r"\(([\d.e+-]+) Hz\)", column)
            assert isinstance(other, str), (dt, asked)
            assert [f"{float(rate):.4g}" for rate in re.findall(r"--rate ([\d.e+-]+)", other)] == asked, dt
            continue
        assert not isinstance(other, str), (dt, other)
        assert other.rate == pytest.approx(column.rate, rel=1e-9), dt
        if dt >= 1.0:
            guesses = [
                g for part in other.notes.values() if isinstance(part, dict) for g in part.get("guesses", ())
            ]
            assert any("no unit given, read as" in guess for guess in guesses), dt


def test_a_name_that_is_sure_wins_at_every_door(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the order of keys; two that are sure and differ are asked about."""
    monkeypatch.setattr(hdf5, "run", inline)
    h5py = pytest.importorskip("h5py", reason="the extra allanite[hdf5] is not installed")

    def attributes(facts: dict[str, float]) -> Any:
        with h5py.File(tmp_path / "log.h5", "w") as file:
            file["gyro_x"] = GYRO
            file.attrs.update(facts)
        return read(tmp_path / "log.h5")

    def arrays(facts: dict[str, float]) -> Any:
        np.savez(tmp_path / "log.npz", gyro_x=GYRO, **facts)  # type: ignore[arg-type]
        return read(tmp_path / "log.npz")

    for door, sure, bare in product(
        (attributes, arrays), ("fs", "sample_rate", "dt"), ("rate", "frequency", "period")
    ):
        fact = {sure: 0.01 if sure == "dt" else 100.0}
        for facts in ({bare: 7.0, **fact}, {**fact, bare: 7.0}):
            assert door(facts).rate == pytest.approx(100.0), facts
        with pytest.raises(InputError, match="several sample rates"):
            door({**fact, "sampling_rate": 52.0})


# -- counts since a moment ---------------------------------------------------------------------------------


@pytest.mark.long
def test_the_unit_before_since_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Attributes as xarray writes them, in files and in memory, and headings of text."""
    monkeypatch.setattr(hdf5, "run", inline)
    h5py = pytest.importorskip("h5py", reason="the extra allanite[hdf5] is not installed")
    words = {
        "seconds": 1.0,
        "milliseconds": 1e-3,
        "microseconds": 1e-6,
        "nanoseconds": 1e-9,
        "ms": 1e-3,
        "us": 1e-6,
    }
    for (word, factor), steps, since in product(
        words.items(), (1, 10, 20), ("2026-11-28", "1970-01-01 00:00:00")
    ):
        rate = 1.0 / (steps * factor)
        if rate > 1e8:
            continue
        counts = np.arange(N) * steps
        with h5py.File(tmp_path / "log.h5", "w") as file:
            file["gyro_x"], file["time"] = GYRO, counts
            file["time"].attrs["units"] = f"{word} since {since}"
        assert read(tmp_path / "log.h5").rate == pytest.approx(rate, rel=1e-9), (word, steps)
        path = tmp_path / "log.csv"
        rows = "".join(f"{c},{x:.5f}\n" for c, x in zip(counts, GYRO, strict=True))
        path.write_text(f"time [{word} since boot],gyro_x [deg/s]\n{rows}")
        assert read(path).rate == pytest.approx(rate, rel=1e-9), (word, steps)


def test_packed_values_are_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """value = stored scale_factor + add_offset, in one piece or in many; the fill value is a gap."""
    monkeypatch.setattr(hdf5, "run", inline)
    h5py = pytest.importorskip("h5py", reason="the extra allanite[hdf5] is not installed")
    from allanite.files.readers import hdf5_tree

    stored = np.arange(-100, 100).astype(np.int16)
    for scale, offset, piece in product((None, 1e-4, 0.5), (None, 0.0, 25.0), (8 << 20, 64)):
        monkeypatch.setattr(hdf5_tree, "_PIECE", piece)
        with h5py.File(tmp_path / "log.h5", "w") as file:
            data = file.create_dataset("gyro_x", data=stored)
            data.attrs["units"], data.attrs["_FillValue"], file.attrs["fs"] = "deg/s", np.int16(-7), 100.0
            data.attrs.update(
                {k: v for k, v in (("scale_factor", scale), ("add_offset", offset)) if v is not None}
            )
        values = read(tmp_path / "log.h5").values("gyro_x")
        wanted = stored * (1.0 if scale is None else scale) + (0.0 if offset is None else offset)
        gap = stored == -7
        assert np.array_equal(np.isnan(values), gap)
        np.testing.assert_allclose(values[~gap], wanted[~gap], rtol=1e-15)


# -- fast stamps -------------------------------------------------------------------------------------------


def test_seconds_are_offered_where_other_units_are() -> None:
    for rate in np.geomspace(2.1e4, 5e6, 60):
        offered = candidates(StampSteps(1.0 / rate, whole=False), 0.0, inertial=True)
        assert offered[0] == "s", rate
        assert all(0.9 <= rate / FACTORS[u] <= 2e4 for u in offered[1:])


def test_a_fast_log_in_seconds_can_be_stated(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "time,gyro_x [deg/s]\n" + "".join(f"{k / 32768:.9f},{x:.5f}\n" for k, x in enumerate(GYRO))
    )
    with pytest.raises(InputError, match=r"--time time:s \(3.277e\+04 Hz\)"):
        read(path)
    assert read(path, time="time:s").rate == pytest.approx(32768, rel=1e-3)


@pytest.mark.parametrize(
    "part", ["time(", "rate 1 ", "rate: 1 ", "dt=1,", "fs  ", "1 000 ", "fs=1,000", "rate ", " "]
)
def test_a_line_without_end_takes_no_longer_than_its_beginning(part: str) -> None:
    begun = time.process_time()
    for line in (part * 100_000, "fs=" + part * 100_000):
        rate_in([line])
    assert time.process_time() - begun < 2.0


# -- units at the end of a name ----------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["{}_{}", "{} ({})", "{}[{}]", "{}_[{}]"])
def test_a_unit_at_the_end_of_a_name_is_that_of_the_number(form: str) -> None:
    for name, (unit, size) in product(
        ("sample_rate", "fs", "Sampling_Frequency"), (("Hz", 1.0), ("kHz", 1e3))
    ):
        stated = keyed_statement(form.format(name, unit), 200.0 / size, "attribute")
        assert stated is not None and stated.clear and stated.readings == (pytest.approx(200.0),)
    for name, (unit, size) in product(("dt", "Ts", "sample_interval"), FACTORS.items()):
        if unit not in ("s", "ms", "us", "ns"):
            continue
        stated = keyed_statement(form.format(name, unit), 0.005 / size, "attribute")
        assert stated is not None and stated.clear and stated.readings == (pytest.approx(200.0),)


@pytest.mark.parametrize("key", ["dt_hz", "fs_ms", "range_hz", "bias_s", "temperature_s", "odr_setting"])
def test_a_unit_that_does_not_fit_the_name_states_nothing(key: str) -> None:
    assert keyed_statement(key, 100.0, "attribute") is None


def test_the_frequency_of_a_clock_is_none_of_samples_with_its_unit_too() -> None:
    assert keyed_statement("frequency_hz", 24e6, "attribute") is None
    assert keyed_statement("dt_ms", 0.0, "attribute") is None
