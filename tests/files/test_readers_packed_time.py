# SPDX-License-Identifier: BSD-3-Clause
"""Time packed into numbers, AM and PM in a column of their own, dates with names of months."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from allanite.files.readers import read
from allanite.recording.records import Recording

N = 900
UTC = datetime.UTC
Moment = datetime.datetime
GYRO = "gx [deg/s],gy [deg/s]"


def thousandths(moment: Moment) -> str:
    return f"{moment.microsecond // 1000:03d}"


def written(
    place: Path, heading: str, cells: Callable[[Moment], str], first: Moment, rate: float
) -> Recording:
    rows = [f"{heading},{GYRO}"] if heading else []
    for k in range(N):
        moment = first + datetime.timedelta(seconds=k / rate)
        rows.append(f"{cells(moment)},{np.sin(k):.4f},{np.cos(k):.4f}")
    place.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return read(place)


CASES: dict[str, tuple[str, Callable[[Moment], str], bool]] = {
    # heading, cells, and whether the date is known
    "date time": ("date,time", lambda m: f"{m:%Y%m%d,%H%M%S}.{thousandths(m)}", True),
    "nmea": ("Date,UTC", lambda m: f"{m:%d%m%y,%H%M%S}.{thousandths(m)}", False),
    "no zeros": ("Date,UTC", lambda m: f"{int(f'{m:%d%m%y}')},{float(f'{m:%H%M%S}.{thousandths(m)}')}", False),
    "nmea time": ("utc", lambda m: f"{m:%H%M%S}.{thousandths(m)}", False),
    "one number": ("time", lambda m: f"{m:%Y%m%d%H%M%S}.{thousandths(m)}", True),
    "one whole number": ("timestamp", lambda m: f"{m:%Y%m%d%H%M%S}{thousandths(m)}", True),
    "no names": ("", lambda m: f"{m:%Y%m%d,%H%M%S}.{thousandths(m)}", True),
    "no names, time": ("", lambda m: f"{m:%H%M%S}.{thousandths(m)}", False),
    "no names, one number": ("", lambda m: f"{m:%Y%m%d%H%M%S}.{thousandths(m)}", True),
    "own names": ("YYYYMMDD,HHMMSS.sss", lambda m: f"{m:%Y%m%d,%H%M%S}.{thousandths(m)}", True),
    "hhmmss": ("hhmmss", lambda m: f"{m:%H%M%S}.{thousandths(m)}", False),
    "milliseconds": ("utc_time", lambda m: f"{m:%H%M%S}{thousandths(m)}", False),
    "date of text": ("date,time", lambda m: f"{m:%Y-%m-%d,%H%M%S}.{thousandths(m)}", True),
    "halves": ("date,time,ampm", lambda m: f"{m:%Y-%m-%d,%I:%M:%S}.{thousandths(m)},{m:%p}", True),
    "halves, month": ("Date,Time,AM/PM", lambda m: f"{m:%d-%b-%Y,%I:%M:%S}.{thousandths(m)},{m:%p}".lower(), True),
    "halves, no name": ("Time,", lambda m: f"{m:%I:%M:%S}.{thousandths(m)},{m:%p}", False),
    "halves of hours": ("Hour,Min,Sec,PM", lambda m: f"{m:%I,%M,%S}.{thousandths(m)},{m:%p}", False),
    "halves of a clock of 24 h": ("Time,AM/PM", lambda m: f"{m:%H:%M:%S}.{thousandths(m)},{m:%p}", False),
    "syslog": ("time", lambda m: f"{m:%b %d %H:%M:%S}.{thousandths(m)}", False),
    "month without signs": ("day,time", lambda m: f"{m:%d%b%Y,%H:%M:%S}.{thousandths(m)}", True),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_packed_time_is_time(case: str, tmp_path: Path) -> None:
    """Over the end of a minute, an hour, noon, the hour after it, midnight and a year: no gap, no channel."""
    heading, cells, dated = CASES[case]
    for k, clock in enumerate(
        ("2023-12-31 23:59:57", "2024-02-28 11:59:58", "2024-02-28 12:59:55", "2024-03-01 00:00:58")
    ):
        first = Moment.fromisoformat(clock).replace(tzinfo=UTC)
        rate = (100.0, 10.0)[k % 2]
        recording = written(tmp_path / f"{k}.csv", heading, cells, first, rate)
        assert recording.rate == pytest.approx(rate), clock
        assert (recording.n_samples, len(recording.channels)) == (N, 2), clock
        if dated:
            assert recording.start == round(first.timestamp()) * 10**9, clock
        else:
            assert recording.start is None, clock


def test_gaps_in_packed_time_are_gaps(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    kept = np.sort(rng.choice(N, N - 60, replace=False))
    rows = ["date,utc,gx"]
    for k in kept:
        moment = Moment(2024, 1, 31, 23, 59, 30, tzinfo=UTC) + datetime.timedelta(seconds=k / 10)
        rows.append(f"{moment:%d%m%y,%H%M%S}.{moment.microsecond // 100_000},{np.sin(k):.4f}")
    log = tmp_path / "log.csv"
    log.write_text("\n".join(rows) + "\n", encoding="utf-8")
    recording = read(log)
    assert (recording.rate, recording.n_samples) == (10.0, int(kept[-1] - kept[0]) + 1)


@pytest.mark.parametrize(
    ("first", "step", "unit"),
    [
        (120_501.0, 0.1, "s"),
        (0.0, 10_000.0, "us"),
        (43_100.0, 0.5, "s"),
        (1000.0, 10.0, "ms"),
    ],
)
def test_seconds_and_counts_stay_what_they_are(first: float, step: float, unit: str, tmp_path: Path) -> None:
    """Numbers that are times of day only for a while, and a constant that may be a date."""
    log = tmp_path / "log.csv"
    rows = [f"{first + step * k:.1f},{np.sin(k):.4f},101010" for k in range(N)]
    log.write_text(f"time,{GYRO}\n" + "\n".join(rows) + "\n", encoding="utf-8")
    recording = read(log)
    assert recording.notes["timebase"]["unit"] == unit
    assert recording.rate == pytest.approx(1.0 / step / {"s": 1.0, "ms": 1e-3, "us": 1e-6}[unit])
    assert len(recording.channels) == 2
