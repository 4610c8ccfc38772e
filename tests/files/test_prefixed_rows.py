# SPDX-License-Identifier: BSD-3-Clause
"""Rows as a serial monitor prints them: a stamp in front, told from the first number by an arrow, a colon or blanks."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

import allanite as al

BEGIN = datetime(2026, 11, 28, 23, 59, 58)
STAMPS = {
    "clock": lambda k: f"{BEGIN + timedelta(milliseconds=10 * k):%H:%M:%S.%f}"[:-3],
    "ISO": lambda k: f"{BEGIN + timedelta(milliseconds=10 * k):%Y-%m-%dT%H:%M:%S.%f}Z",
    "date and clock": lambda k: f"{BEGIN + timedelta(milliseconds=10 * k):%Y-%m-%d %H:%M:%S.%f}",
    "epoch": lambda k: f"{1732000000 + 0.01 * k:.3f}",
    "in brackets": lambda k: f"[{BEGIN + timedelta(milliseconds=10 * k):%Y-%m-%d %H:%M:%S.%f}]",
}


def written(path, stamp, between, delimiter, samples, decimal="."):
    rows = (delimiter.join(f"{x:.6f}".replace(".", decimal) for x in row) for row in samples)
    stamps = (stamp(k).replace(".", decimal) for k in range(len(samples)))
    path.write_text("".join(f"{at}{between}{row}\n" for at, row in zip(stamps, rows, strict=True)))


@pytest.fixture
def samples():
    return np.random.default_rng(20261128).standard_normal((600, 3)).round(6)


@pytest.mark.parametrize(("delimiter", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", ".")])
@pytest.mark.parametrize("between", [" -> ", " ", ": ", " | ", " => "])
@pytest.mark.parametrize("name", STAMPS)
def test_every_number_is_read_and_the_stamp_is_the_time(tmp_path, samples, name, between, delimiter, decimal):
    written(tmp_path / "log.txt", STAMPS[name], between, delimiter, samples, decimal)
    record = al.read(tmp_path / "log.txt")
    assert record.rate == pytest.approx(100, rel=1e-6)
    assert record.n_samples == len(samples)
    np.testing.assert_array_equal(np.stack([record.values(c.name) for c in record.channels], 1), samples)


def test_a_word_in_front_takes_no_number_with_it(tmp_path, samples):
    written(tmp_path / "log.txt", lambda _: "IMU", " ", ",", samples)
    record = al.read(tmp_path / "log.txt", rate=100)
    np.testing.assert_array_equal(np.stack([record.values(c.name) for c in record.channels], 1), samples)


@pytest.mark.parametrize("between", [" -> ", " = ", ": ", "] "])
def test_a_number_in_a_text_that_would_be_left_out_is_refused(tmp_path, samples, between):
    rows = (f"{a},{b},state{between}{c}\n" for a, b, c in samples)
    (tmp_path / "log.txt").write_text("".join(rows))
    with pytest.raises(al.FormatError, match="column 3 holds a number behind other text, as in 'state"):
        al.read(tmp_path / "log.txt", rate=100)


@pytest.mark.parametrize(
    "cell", ["28 Nov 2026", "Sat Nov 28 2026", "12 deg/s", "run 7", "v1.2", "A 1.5"], ids=str
)
def test_dates_units_and_texts_that_do_not_change_are_as_before(tmp_path, samples, cell):
    (tmp_path / "log.txt").write_text("".join(f"{cell},{a},{b}\n" for a, b, _ in samples))
    record = al.read(tmp_path / "log.txt", rate=100)
    kept = [record.values(c.name) for c in record.channels]
    np.testing.assert_array_equal(np.stack(kept[-2:], 1), samples[:, :2])
    assert len(kept) == (3 if cell == "12 deg/s" else 2)


@pytest.mark.parametrize("hint", ["sep={}", '"sep={}"', "SEP={}"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("channels", [1, 2, 3])
def test_a_hint_for_spreadsheets_is_no_header(tmp_path, samples, channels, delimiter, hint):
    head = delimiter.join(["t (s)", *(f"gyro_{axis} (deg/s)" for axis in "xyz"[:channels])])
    rows = (
        delimiter.join([f"{k / 100:.2f}", *map(repr, row[:channels])])
        for k, row in enumerate(samples.tolist())
    )
    (tmp_path / "log.csv").write_text("\n".join([hint.format(delimiter), head, *rows]) + "\n")
    record = al.read(tmp_path / "log.csv")
    assert (record.rate, record.names) == (100.0, tuple(f"gyro_{axis}" for axis in "xyz"[:channels]))
    assert {c.unit for c in record.channels} == {"deg/s"}
