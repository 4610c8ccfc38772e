# SPDX-License-Identifier: BSD-3-Clause
"""Refusals of measurements, filters, plans and exports."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

import sample_study
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import Motion, simulate
from allanite.study.model_file import model_of, save_models
from refusals import Refusal, numbers, table

__all__ = ["COMMANDS"]

GOOD = "N=0.01 deg/√h, B=0.01 deg/h, K=0.05 deg/h/√h"
FLICKER = "'N=0.3 deg/√h, B=5 deg/h'"
MARKOV = "'N=0.3 deg/√h, B=5 deg/h, T=240 s'"
FORCE = "'N=0.1 m/s/√h'"
LATITUDE = "--latitude 48"
T = np.arange(600) / 10.0
GYRO = table("t [s],gyro [deg/s]", T, y=numbers(600, 1))
TRIAD = table("t [s],gx [deg/s],gy [deg/s],gz [deg/s]", T, y=numbers(600, 3))
BOTH = table("t [s],gyro x [deg/s],acc x [m/s^2]", T, y=numbers(600, 2))
FOUR = table("t [s],a [deg/s],b [deg/s],c [deg/s],d [deg/s]", T[:200], y=numbers(200, 4))


def in_positions(path: Path) -> None:
    """A gyro in four positions on a table."""
    motion = Motion.positions([math.radians(a) for a in (0, 90, 180, 270)], dwell=20.0)
    write_recording(
        simulate(model_of(GOOD), rate=8.0, duration=80.0, seed=3, unit="deg/h", motion=motion, latitude=0.84),
        path,
    )


HEADINGS = "start,stop,heading\n0,19,0\n21,39,90\n41,59,180\n61,79,270\n"


def in_part(heading: float) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        motion = Motion.positions([math.radians(heading)], dwell=20.0)
        record = simulate(
            model_of(GOOD), rate=8.0, duration=20.0, seed=3, unit="deg/h", motion=motion, latitude=0.84
        )
        write_recording(record, path)

    return write


def turned_over(path: Path) -> None:
    """A gyro that was turned from north to south and back."""
    motion = Motion.positions([math.pi * (k % 2) for k in range(8)], dwell=20.0)
    write_recording(
        simulate(
            model_of("N=0.05 deg/√h"),
            rate=10.0,
            duration=160.0,
            seed=3,
            unit="deg/s",
            motion=motion,
            latitude=0.84,
        ),
        path,
    )


def models(*names: str, words: str = "N=0.3 deg/√h, B=5 deg/h") -> Callable[[Path], object]:
    return lambda path: save_models({n: model_of(words) for n in names}, path)


POSES = [(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), (1, 0, 0), (-1, 0, 0), (0, 0.6, 0.8), (0.6, 0, 0.8),
         (0.8, 0.6, 0), (-0.6, 0.8, 0), (0, -0.6, -0.8), (-0.8, 0, 0.6)]  # fmt: skip
MEANS = 9.81 * np.array(POSES) + np.random.default_rng(1).normal(0, 1e-3, (12, 3))
POSED = table("ax [m/s^2],ay [m/s^2],az [m/s^2]", y=MEANS)
ROUND = np.radians([0, 60, 120, 180, 240, 300])
TABLE = table(
    "gyro [deg/h],heading [deg]",
    15.04 * math.cos(0.84) * np.cos(ROUND) + np.random.default_rng(1).normal(0, 0.01, 6) + 1,
    np.degrees(ROUND),
)
OF_MEANS = (
    Refusal(
        line="calibrate --means 'the means.csv' --height 100",
        files={"the means.csv": POSED},
        says=("goes with --latitude: gravity depends on both",),
        adds={"--height": "", "--latitude": "48"},
    ),
    Refusal(
        line=f"north --means 'the means.csv' {LATITUDE} --model '{GOOD}' --averaging 60s --headings 'turns.csv' --null",
        files={"the means.csv": TABLE, "turns.csv": HEADINGS},
        says=("states the positions",),
        adds={"--means": "", "--headings": "", "--rotation": "", "--null": ""},
        instead=("--headings", "--null"),
        later={"--means": "state the positions of the table"},
    ),
    Refusal(
        line=f"north --means 'the means.csv' {LATITUDE} --model '{GOOD}'",
        files={"the means.csv": TABLE},
        says=("depends on its averaging time: state --averaging 60s",),
    ),
    Refusal(
        line="calibrate --means 'the means.csv' --averaging 60s --spans spans.csv",
        files={"the means.csv": POSED, "spans.csv": "start,stop\n0,6\n"},
        says=("is for logs: leave it out with --means",),
        adds={"--spans": "", "--means": ""},
        later={"--means": "goes with --means"},  # --averaging
    ),
    Refusal(
        line="calibrate --means 'the means.csv' --rate 10",
        files={"the means.csv": POSED},
        says=("is for logs: rows of means are positions",),
        adds={"--rate": ""},
    ),
    Refusal(
        line="calibrate 'a log.csv' --averaging 60s",
        files={"a log.csv": POSED},
        says=("goes with --means",),
        adds={"--averaging": ""},
        later={"--averaging": "no sample rate"},
    ),
)
OF_NORTH = (
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model '{GOOD}' --null --headings 'turns.csv' --model-channels a=b",
        files={"a log.parquet": in_positions, "turns.csv": HEADINGS},
        says=("is for north: --null has one axis",),
        adds={"--model-channels": "", "--null": ""},
        instead=("--model-channels",),
    ),
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model '{GOOD}' --null --rotation 1deg/s",
        files={"a log.parquet": in_positions, "turns.csv": HEADINGS},
        says=("--null needs positions",),
        adds={"--null": "", "--headings": "turns.csv"},
        instead=("--rotation",),
        later={"--null": "state the positions of the table"},
    ),
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model '{GOOD}' --null --headings 'turns.csv' --misalignment 1deg",
        files={"a log.parquet": in_positions, "turns.csv": HEADINGS},
        says=("--misalignment is for north: for --null",),
        adds={"--misalignment": "", "--null": "", "--heading-uncertainty": "1deg"},
        instead=("--misalignment",),
    ),
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model '{GOOD}' --null --headings 'turns.csv' --plot x.pdf",
        files={"a log.parquet": in_positions, "turns.csv": HEADINGS},
        says=("the null test has no figure",),
        adds={"--plot": "", "--out": ""},
        instead=("--plot",),
    ),
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model '{GOOD}' --headings 'turns.csv' --rotation 10deg/s",
        files={"a log.parquet": in_positions, "turns.csv": HEADINGS},
        says=("give either --headings or --rotation, not both",),
        adds={"--headings": "", "--rotation": ""},
    ),
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model '{GOOD}'",
        files={"a log.parquet": in_positions, "turns.csv": HEADINGS},
        says=("state the positions of the table: --headings or --rotation",),
        adds={"--headings": "turns.csv", "--rotation": "10deg/s"},
    ),
    Refusal(
        line=f"north a.parquet=0deg b.parquet=90deg c.parquet=180deg {LATITUDE} --model '{GOOD}'",
        files={f"{n}.parquet": in_part(a) for n, a in (("a", 0), ("b", 90), ("c", 180))},
        says=("several LOGs are for --positions",),
    ),
    Refusal(
        line=f"plan --model '{GOOD}' {LATITUDE} --goal 1deg",
        says=("--goal is a fraction of the Earth rate",),
        adds={"--goal": "3%"},
    ),
    Refusal(
        line=f"plan --model '{GOOD}' {LATITUDE} --goal 3% --north",
        says=("--goal is an angle with --north",),
        adds={"--goal": "1deg", "--north": ""},
    ),
    Refusal(
        line=f"plan --model models.json {LATITUDE}",
        files={"models.json": models("gyro x", "gyro y")},
        says=("choose one with --channel",),
        adds={"--channel": "'gyro y'"},
    ),
    Refusal(
        line=f"plan {LATITUDE}",
        says=("--model",),
        adds={"--model": f"'{GOOD}'"},
    ),
)
OF_ONE_AXIS = [
    "--vector",
    "--first",
    "--turns",
    "--dwell",
    "--settling",
    "--warm-up",
    "--temperature",
    "--g-sensitivity",
]
OF_EARTH = (
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --bias-uncertainty 1deg/h",
        files={"a log.csv": GYRO},
        says=("--bias-uncertainty is for three axes at rest",),
        adds={"--bias-uncertainty": ""},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --first north",
        files={"a log.csv": TRIAD},
        says=("the log has three axes",),
        adds={"--channels": "gx"},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --vector --first north",
        files={"a log.csv": TRIAD},
        says=("is for three axes at rest:",),
        adds=dict.fromkeys(OF_ONE_AXIS, ""),
        later={"--vector": "the log has three axes"},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --vector",
        files={"a log.csv": FOUR},
        says=("--vector needs three channels of rates", "name the three axes"),
        adds={"--vector": ""},
        later={"--vector": "several channels of rates"},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --vector",
        files={"a log.csv": GYRO},
        says=("--vector needs three channels of rates", "leave out --vector"),
        adds={"--vector": ""},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE}",
        files={"a log.csv": table("t [s],a [deg/s],b [deg/s]", T, y=numbers(600, 2))},
        says=("several channels of rates",),
        adds={"--channels": "b"},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --dwell 20 --turns 'turns.csv' --channels gx",
        files={"a log.csv": TRIAD, "turns.csv": "start,stop\n20,22\n40,42\n"},
        says=("give either --turns or --dwell",),
        adds={"--dwell": "", "--turns": ""},
    ),
    Refusal(
        line=f"north 'a log.parquet' {LATITUDE} --model models.json --headings turns.csv",
        files={
            "a log.parquet": in_positions,
            "turns.csv": HEADINGS,
            "models.json": models("gyro x", "gyro y"),
        },
        says=("has no model of channel", "--model-channels {}"),
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --g-sensitivity 0.1deg/h/g --first north",
        files={"a log.csv": GYRO},
        says=("--g-sensitivity is for an axis that is turned",),
        adds={"--g-sensitivity": ""},
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE} --first up --heading-uncertainty 1deg",
        files={"a log.csv": GYRO},
        says=("a vertical axis has no heading",),
        adds={"--heading-uncertainty": "", "--tilt": "1deg"},
        instead=("--heading-uncertainty",),
    ),
    Refusal(
        line=f"earth-rate 'a log.csv' {LATITUDE}",
        files={"a log.csv": table("t [s],gyro [deg/s]", T[:90], y=np.repeat(numbers(30, 1), 3, axis=0))},
        says=("the noise cannot be fitted to this record",),
        adds={"--model": f"'{GOOD}'"},
    ),
)
OF_FILTERS = (
    Refusal(
        line=f"filter 'a log.csv' --model {MARKOV} --smooth --reference 15deg/h",
        files={"a log.csv": GYRO},
        says=("has no smoother: leave",),
        adds={"--smooth": "", "--reference": ""},
    ),
    Refusal(
        line=f"filter 'a log.csv' --model {MARKOV} --first north",
        files={"a log.csv": GYRO},
        says=("applies only with --reference",),
        adds={"--first": "", "--reference": "15deg/h", "allanite earth-rate": f"'a log.csv' {LATITUDE}"},
    ),
    Refusal(
        line="filter 'a log.csv'",
        files={"a log.csv": GYRO},
        says=("--model",),
        adds={"--model": MARKOV},
    ),
    Refusal(
        line="filter 'a log.csv' --model 'N=0.3 deg/√h'",
        files={"a log.csv": TRIAD},
        says=("one channel is filtered at a time",),
        adds={"--channels": "gy"},
    ),
    Refusal(
        line="filter 'a log.parquet' --model 'N=0.3 deg/√h'",
        files={"a log.parquet": turned_over},
        says=("the record seems to have been turned", "allanite earth-rate"),
        adds={
            "allanite earth-rate": f"'a log.parquet' {LATITUDE}",
            "--from": "1 --to 18",
            "--to": "18 --from 1",
        },
    ),
    Refusal(
        line=f"filter 'a log.csv' --model {FLICKER} --reference 15deg/h",
        files={"a log.csv": GYRO},
        says=("the model has flicker (B without T)",),
    ),
    Refusal(
        line=f"filter 'a log.csv' --model {MARKOV} --reference 15deg/h --correlation-time 100s",
        files={"a log.csv": GYRO},
        says=("but the Gauss-Markov term of the model has",),
        adds={"--correlation-time": ""},
    ),
    Refusal(
        line="simulate 'N=0.3 deg/√h' --duration 1min -o out.csv",
        says=("does not state a sample rate",),
        adds={"--rate": "10"},
    ),
    Refusal(
        line="convert 'a log.csv' 'b log.csv'",
        files={"a log.csv": GYRO, "b log.csv": GYRO},
        says=("exists; use --force",),
    ),
    Refusal(
        line="info result.json",
        files={
            "result.json": json.dumps(
                sample_study.build() | {"channels": sample_study.build()["channels"][:1]}
            )
        },
        says=("is a result of allanite",),
    ),
    Refusal(
        line="common 'a log.csv'",
        files={"a log.csv": FOUR},
        says=("for instance --channels",),
    ),
    Refusal(
        line="common 'a log.csv' --channels a",
        files={"a log.csv": FOUR},
        says=("of the log (--channels), or record",),
        adds={"--channels": "a,b"},
    ),
    Refusal(
        line=f"dead-reckon --model {FLICKER} {LATITUDE} --remove-vertical",
        says=("only a rest shows the bias",),
        adds={"--rest": "60s"},
    ),
)
COMMANDS = (*OF_MEANS, *OF_NORTH, *OF_EARTH, *OF_FILTERS)
