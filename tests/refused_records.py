# SPDX-License-Identifier: BSD-3-Clause
"""Refusals of runs, repairs, triads, and of several records that do not fit each other."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

import sample_calibration
import sample_study
from allanite.files.store import LogStore
from log_store_runs import HEADER, batch_of
from refusals import Refusal, numbers, table
from refused_commands import GYRO, MARKOV, MEANS, POSED, TRIAD, models

__all__ = ["RECORDS"]

T = np.arange(600) / 10.0
SHORT = table("t [s],gyro [deg/s]", T[:150], y=numbers(150, 1))
FOUR_FORCES = table("t [s],a [m/s^2],b [m/s^2],c [m/s^2],d [m/s^2]", T, y=numbers(600, 4))
WORDS = "{name: a, type: u16, unit: LSB}, {name: b, type: u16, unit: LSB}"
LAYOUT = f"lines: {{}}\nrate: 10\nframe: {{endian: big, fields: [{WORDS}]}}\n"


def of_two_settings(path: Path) -> None:
    other = replace(HEADER, settings={**HEADER.settings, "range": 10.0})
    with LogStore.create(path, HEADER) as store:
        store.append(batch_of(0, 640))
        store.change(other)
        store.append(batch_of(640, 640))


def run_of(path: Path, damage: int | None) -> None:
    with LogStore.create(path, HEADER) as store:
        store.append(batch_of(0, 640))
        store.append(batch_of(640, 640))
    if damage is not None:
        segment = path / "000001.arrows"
        data = bytearray(segment.read_bytes())
        data[damage] ^= 1
        segment.write_bytes(data)


def held(factor: int, seed: int) -> np.ndarray:
    return np.repeat(numbers(2400 // factor, 1, seed=seed), factor, axis=0)


TWO_HOLDS = np.hstack([held(2, 1), held(3, 2)])
INTERLEAVED = np.hstack([numbers(2400, 1) + 5 * (np.arange(2400) % 2)[:, None], numbers(2400, 1, seed=2)])
LONG = np.arange(2400) / 100.0
SWINGING = 9.8 * np.sin(LONG[:, None] * 3 + np.arange(3))
WARMING = 5 * np.exp(-T[:, None] / 60) + numbers(600, 1)
ONE_CHANNEL = json.dumps(sample_study.build() | {"channels": sample_study.build()["channels"][:1]})
ROLL = np.where(LONG < 22, LONG, 0.0)
ROLLED = 9.8 * np.column_stack([np.sin(ROLL), 0 * ROLL, np.cos(ROLL)]) + numbers(2400, 3)
RUNS = (
    Refusal(
        line="convert 'a run' out.parquet --force",
        files={"a run": of_two_settings},
        says=("Such samples are never merged",),
    ),
    Refusal(
        line="compact 'a run'",
        files={"a run": lambda path: run_of(path, -100)},
        says=("allanite recover {}",),
    ),
    Refusal(
        line="info 'a run'",
        files={"a run": lambda path: run_of(path, 700)},
        says=("allanite recover --dry-run {}",),
    ),
)
REPAIRS = (
    Refusal(
        line="convert 'a log.csv' out.parquet --force --repair drop_repeats",
        files={"a log.csv": table("t [s],gyro a [deg/s],acc b [m/s^2]", LONG, y=TWO_HOLDS)},
        says=("the channels repeat differently",),
        adds={"--channels": "gyro"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force --repair split_interleaved",
        files={"a log.csv": table("t [s],a [deg/s],b [deg/s]", LONG, y=INTERLEAVED)},
        says=("alternate differently",),
        adds={"--channels": "a"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force --repair drop_duplicate_rows",
        files={
            "a log.csv": table("t [s],a [deg/s]", np.where(LONG > 12, LONG - 3, LONG), y=numbers(2400, 1))
        },
        says=("so rows are out of order",),
        adds={"--rate": "100"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force --repair cut_motion",
        files={"a log.csv": table("t [s],ax [m/s^2],ay [m/s^2],az [m/s^2]", LONG, y=ROLLED)},
        says=("cut_motion would leave",),
        adds={"--from": "22.5", "--to": "23.9 --from 22.5"},
    ),
    Refusal(
        line="allan 'a log.csv' --unit 'LSB/(deg/s)'",
        files={"a log.csv": table("t [s],gyro a", T, y=np.round(1000 * numbers(600, 1)))},
        says=("LSB or V, with",),
        adds={"--scale-factor": "'131 LSB/(deg/s)'"},
        instead=("--unit",),
    ),
    Refusal(
        line="characterize 'a log.csv' --json",
        files={"a log.csv": table("t [s],gyro a [deg/s]", T, y=np.ones((600, 1)))},
        says=("to continue despite it: --accept",),
    ),
)
MIXED = np.hstack([MEANS, numbers(12, 4, seed=3)])
TRIADS = (
    Refusal(
        line="calibrate --means 'the means.csv'",
        files={
            "the means.csv": table("acc x [m/s^2],acc y [m/s^2],acc z [m/s^2],acc 4 [m/s^2]", y=MIXED[:, :4])
        },
        says=("Say which three are x, y and z",),
    ),
    Refusal(
        line="calibrate --means 'the means.csv'",
        files={
            "the means.csv": table("ax [m/s^2],ay [m/s^2],az [m/s^2],gx [deg/s],gy [deg/s]", y=MIXED[:, :5])
        },
        says=("triad has three: name them with",),
        adds={"--gyro": "ax,ay,az", "--channels": "ax,ay,az"},
        later={"--gyro": "ax"},  # there are no three
    ),
    Refusal(
        line="calibrate --means 'the means.csv' --model 'N=0.01 m/s/√h'",
        files={"the means.csv": POSED},
        says=("the noise of a mean by the time over which it was taken",),
    ),
    Refusal(
        line="calibrate --means 'the means.csv'",
        files={
            "the means.csv": table(
                "ax [m/s^2],ay [m/s^2],az [m/s^2],sd_ax [m/s^2],sd_ay [m/s^2],sd_az [m/s^2]",
                y=np.hstack([MEANS, np.full((12, 3), 1e-3)]),
            )
        },
        says=("or of their means? Say --sd-of means",),
    ),
)
SEVERAL = (
    Refusal(
        line="compare 'a log.csv' 'b log.csv'",
        files={
            "a log.csv": SHORT,
            "b log.csv": table("t [s],gyro", T[:150], y=numbers(150, 1, seed=5)),
        },
        says=("the unit of channels is unknown",),
    ),
    Refusal(
        line="compare 'a log.csv' 'b log.csv'",
        files={
            "a log.csv": SHORT,
            "b log.csv": table("t [s],gyro [m/s^2]", T[:150], y=numbers(150, 1, seed=5)),
        },
        says=("measure different quantities; state",),
        adds={"--unit": "deg/s"},
    ),
    Refusal(
        line="allan 'a log.csv' --floor 'a floor.csv' --unit V",
        files={
            "a log.csv": table("t [s],u", T, y=numbers(600, 1)),
            "a floor.csv": table("t [s],u [mV]", T, y=numbers(600, 1, seed=4)),
        },
        says=("the floor states",),
    ),
    Refusal(
        line="calibrate acc.csv --gyro-log gyro.csv",
        files={"acc.csv": FOUR_FORCES, "gyro.csv": TRIAD},
        says=("name the three of the",),
        adds={"--accelerometer": "a,b,c"},
        later={"--accelerometer": "at rest"},  # as it is in one position
    ),
    Refusal(
        line="export openvins 'a calibration.json' --rate 100",
        files={
            "a calibration.json": json.dumps(sample_calibration.estimate().calibration.to_json()),
            "models.json": models("gyro"),
        },
        says=("a calibration has none",),
        adds={"--rate": "", "--model": "models.json"},
    ),
)
HALF_STAMPED = [f"{k / 100}" if k < 4000 else "" for k in range(9000)]
TIMES = (
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={
            "a log.csv": table(
                "time [s],a", [f"{k / 100}" if k < 4000 else "" for k in range(9000)], y=numbers(9000, 1)
            )
        },
        says=("the time column is empty",),
        adds={"--rate": "100"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={
            "a log.csv": table(
                "Year,Month,Day,Hour,Minute,Second,turn no,gx",
                *([2023] * 180, [2] * 180, [27 + k // 60 for k in range(180)]),
                *([0] * 180, [0] * 180, [k % 60 for k in range(180)], range(180)),
                y=numbers(180, 1),
            )
        },
        says=("is not a date. Correct the row",),
        adds={"RATE": "100", "--time": "7:s", "--time none": "none"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={
            "a log.csv": table(
                "time [s],a", np.cumsum(np.random.default_rng(1).exponential(1, 600)), y=numbers(600, 1)
            )
        },
        says=("--rate {} if nothing is missing",),
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={
            "a log.csv": "".join(f"{k:04x} {k * 7 % 65536:04x}\n" for k in range(600)),
            "its layout.yaml": LAYOUT,
        },
        says=("hexadecimal words are read by a layout",),
        adds={"--layout": "'its layout.yaml'"},
    ),
)
OTHERS = (
    Refusal(
        line="calibrate 'a log.csv' --gravity 9.81",
        files={
            "a log.csv": table("t [s],ax [m/s^2],ay [m/s^2],az [m/s^2]", LONG, y=SWINGING),
            "spans.csv": "start,stop\n0,6\n7,13\n14,20\n",
        },
        says=("the unit is nowhere at rest long enough",),
        adds={"--spans": "spans.csv"},
        later={"--spans": "not gravity"},  # it swings in these as well
    ),
    Refusal(
        line=f"filter 'a log.csv' --model {MARKOV} --reference 15deg/h --turns turns.csv --dwell 20",
        files={"a log.csv": GYRO, "turns.csv": "start,stop\n20,22\n"},
        says=("turns come either from a file",),
        adds={"--turns": "", "--dwell": ""},
    ),
    Refusal(
        line="calibrate --means 'the means.csv'",
        files={
            "the means.csv": table(
                "ax [m/s^2],ay [m/s^2],az [m/s^2],gx [deg/s],gy [deg/s],gz [deg/s],"
                "sem_ax [m/s^2],sem_ay [m/s^2],sem_az [m/s^2]",
                y=np.hstack([MIXED[:, :6], np.full((12, 3), 1e-3)]),
            )
        },
        says=("the table has standard deviations of the",),
        adds={"--channels": "ax,ay,az,sem_ax,sem_ay,sem_az"},
    ),
    Refusal(
        line="calibrate --means 'the means.csv'",
        files={
            "the means.csv": table(
                "ax [m/s^2],ay [m/s^2],az [m/s^2],sem_ax [m/s^2],std_ay [m/s^2],sem_az [m/s^2],n",
                *MEANS.T,
                *np.full((3, 12), 1e-3),
                [100] * 12,
            )
        },
        says=("some are of readings, some of means",),
        adds={"--sd-of": "means"},
    ),
    Refusal(
        line="export imu-tk study.json",
        files={"study.json": ONE_CHANNEL, "the means.csv": POSED},
        says=("expected what `allanite calibrate",),
        adds={"allanite calibrate": "results --means 'the means.csv'"},
    ),
    Refusal(
        line="environment 'a log.csv' --warm-up cut",
        files={"a log.csv": table("t [s],gyro [deg/s]", T, y=WARMING)},
        says=("the rest is too short to characterize",),
    ),
    Refusal(
        line="overbound x.json",
        files={"x.json": "no JSON", "a log.csv": GYRO},
        says=("study.json of 'allanite characterize LOG'",),
        adds={"LOG": "'a log.csv'", "--out": ""},
    ),
    Refusal(
        line="report x.json",
        files={"x.json": "no JSON", "a log.csv": GYRO},
        says=("study.json of 'allanite characterize LOG' or what",),
        adds={"LOG": "'a log.csv'", "--out": ""},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={
            "a log.csv": "".join(f"{word} {word}\n" for word in map("".join, product("abcdef", repeat=4))),
            "its layout.yaml": LAYOUT,
        },
        says=("hexadecimal words, a layout with",),
        adds={"--layout": "'its layout.yaml'"},
    ),
)
RECORDS = (*OTHERS, *RUNS, *REPAIRS, *TRIADS, *SEVERAL, *TIMES)
