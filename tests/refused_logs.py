# SPDX-License-Identifier: BSD-3-Clause
"""Refusals of logs: their form, time, units, channels and rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from refusals import N, Refusal, numbers, table

__all__ = ["LOGS"]

T = np.arange(N) / 100.0
Y = numbers()
GYRO = "x [deg/s],y [deg/s],z [deg/s]"
PLAIN = table(f"t [s],{GYRO}", T, y=Y)


LAYOUT = "rate: 200\nframe:\n  fields:\n    - {name: gyro_x, type: i16, unit: deg/s, scale: 1.0e-4}\n"


def dates() -> list[str]:
    return [f"03/04/2024 10:{k // 60:02d}:{k % 60:02d}" for k in range(N)]


def of_kinds(*kinds: str, stamps: bool = True) -> str:
    lines = []
    for k in range(N):
        for i, kind in enumerate(kinds):
            at = f"{k / 100:.3f}," if stamps else ""
            lines.append(f"{kind},{at}" + ",".join(f"{v + i:.5f}" for v in Y[k]))
    return "\n".join([*lines, ""])


def cube(path: Path) -> None:
    np.save(path, np.random.default_rng(1).standard_normal((2, N, 3)))


def cube_inside(path: Path) -> None:
    np.savez(path, deep=np.random.default_rng(1).standard_normal((2, N, 3)))


def steps_with_a_hole() -> list[str]:
    steps = ["0.01"] * N
    steps[500] = ""
    return steps


def clock_set() -> np.ndarray:
    t = T + 10.0
    t[400:] += 1e6
    return t


FORMS = (
    Refusal(
        line="info log.csv --config bench.toml",
        files={"log.csv": PLAIN, "bench.toml": '[names]\nw = "gyro_w"\n'},
        says=("no channel ", " was taken into account; --config none leaves it out)"),
        instead=("--config",),
    ),
    Refusal(
        line="info log.csv --config nowhere.toml",
        files={"log.csv": PLAIN},
        says=("pass --config none, or name another file",),
        instead=("--config",),
    ),
    Refusal(
        line="convert log.csv out.parquet --force --rate 100 --unit deg/s",
        files={"log.csv": "y\n" + "".join(f'"2,5{k % 7}4"\n' for k in range(N))},
        says=("with a decimal comma. Write",),
    ),
    Refusal(
        line="convert 'a log.npy' out.parquet --force --rate 100 --unit deg/s",
        files={"a log.npy": cube},
        says=("an array of shape", "choose a record"),
    ),
    Refusal(
        line="convert 'a log.npz' out.parquet --force --rate 100 --unit deg/s",
        files={"a log.npz": cube_inside},
        says=("choose a record of three dimensions",),
    ),
    Refusal(
        line="convert 'a log.bin' out.parquet --force",
        files={"a log.bin": b"\x07\x01\xfe\xff" * 64, "its layout.yaml": LAYOUT},
        says=("is binary, in an unknown format",),
        adds={"--layout": "'its layout.yaml'"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force --rate 100",
        files={"a log.csv": table("n,sensor,x,y,z", range(N), ["left one", "right"] * (N // 2), y=Y)},
        says=("distinguishes several sensors or records",),
    ),
    Refusal(
        line="convert 'a log.txt' out.parquet --force --rate 100",
        files={
            "a log.txt": "".join(
                f"a={k % 5},{1 + k * 37 % 1999};b={k % 3},{1 + k * 91 % 899}\n" for k in range(N)
            )
        },
        says=("is either one number with a decimal comma, or two",),
    ),
    Refusal(
        line="convert 'a log.txt' out.parquet --force --rate 100",
        files={
            "a log.txt": "".join(
                f"gx={k % 5}.5 gy=0.{k}\n" if k % 2 else f"P$1={k}.25 T=20.{k}\n" for k in range(N)
            )
        },
        says=("labels that never share a line",),
    ),
    Refusal(
        line="convert 'a log.txt' out.parquet --force --channels A_x,B_x",
        files={"a log.txt": of_kinds("A", "B")},
        says=("are in different types of lines", "--channels {}"),
    ),
    Refusal(
        line="convert 'a log.txt' out.parquet --force",
        files={"a log.txt": of_kinds("A", "B")},
        says=("lines of several types", "--variable {}"),
    ),
)
TIMES = (
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("x,y,z", y=Y)},
        says=("the rate, --rate",),
        adds={"RATE": "100"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("my count,x,y,z", np.arange(N) * 0.01 + np.sin(np.arange(N)) * 0.002, y=Y)},
        says=("--time {}:UNIT", "the rate, --rate"),
        adds={"RATE": "100", "UNIT": "s"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("Date and time,x,y,z", dates(), y=Y)},
        says=("do not distinguish day and month",),
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("my time,x,y,z", np.arange(N) * 4, y=Y)},
        says=("and its values fit several. State which", "--time {}:{} ("),
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("time tick,x,y,z", np.arange(N) * 4, y=Y)},
        says=("--time '{}:STEP'",),
        adds={"STEP": "1/400 s"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={
            "a log.csv": table("", np.cumsum(np.random.default_rng(1).choice([0.5, 0.7, 1.9], N)), y=Y),
        },
        says=("has no name and increases unevenly",),
        adds={"RATE": "100"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("dt [s],x,y,z", steps_with_a_hole(), y=Y)},
        says=("is the interval since the previous row",),
        adds={"RATE": "100", "COLUMN[:UNIT]": "2:s"},
        later={
            "--time": "not in chronological order"
        },  # a second column of time would have been taken without a word
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("time [s],x,y,z", np.where(np.arange(N) % 5 == 4, T - 0.035, T), y=Y)},
        says=("runs backward at",),
        adds={"--rate": "100"},
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("time [s],x,y,z", clock_set(), y=Y)},
        says=("jumps far beyond the length of the record", "--to {}"),
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("time [s],x,y,z", np.where(np.arange(N) < 200, T, T + 1e6), y=Y)},
        says=("jumps far beyond the length of the record", "--from {}"),
    ),
)
UNITS = (
    Refusal(
        line="convert 'a log.csv' out.parquet --force",
        files={"a log.csv": table("t [s],gyro x [deg],gyro y [deg/s],gyro z [deg/s]", T, y=Y)},
        says=("the heading says",),
    ),
    Refusal(
        line="convert 'a log.csv' out.parquet --force --unit deg/s",
        files={"a log.csv": table("t [s],acc x,acc y,acc z", T, y=Y)},
        says=("fits none of the channels",),
        adds={"--unit": "acc_x=g"},
    ),
    Refusal(
        line="allan 'a log.csv' --kind phase --scale-factor '3 LSB/s'",
        files={"a log.csv": table("t [s],x", T, y=Y[:, :1] * 1e-9)},
        says=("takes no scale factor",),
        adds={"--scale-factor": "", "--unit": "ns", "--carrier": "10e6 --unit cycles"},
        instead=("--scale-factor",),
        later={"--scale-factor": "is not in the file"},
    ),
    Refusal(
        line="allan 'a log.csv' --kind phase",
        files={"a log.csv": table("t [s],x", T, y=Y[:, :1] * 1e-9)},
        says=("is not in the file: pass --unit",),
        adds={"--unit": "ns", "--carrier": "10e6 --unit cycles"},
    ),
    Refusal(
        line="allan 'a log.csv' --kind phase --unit cycles",
        files={"a log.csv": table("t [s],x", T, y=Y[:, :1])},
        says=("need the frequency of the carrier",),
    ),
    Refusal(
        line="allan 'a log.csv' --carrier 10e6",
        files={"a log.csv": table("t [s],x [deg/s]", T, y=Y[:, :1])},
        says=("goes with --kind phase",),
        adds={"--carrier": ""},
        later={"--kind phase": "a phase is in", "--kind frequency": "a fractional frequency is in"},
    ),
    Refusal(
        line="allan 'a log.csv'",
        files={"a log.csv": table("t [s],the counter [Hz]", T, y=Y[:, :1])},
        says=("of a clock, pass",),
        later={"--kind": "need the frequency of the carrier"},
    ),
    Refusal(
        line="allan 'a log.csv' --statistic mtie",
        files={"a log.csv": table("t [s],x [ns]", T, y=Y[:, :1])},
        says=("is that of a clock",),
        later={"--kind frequency": "a fractional frequency is in"},
    ),
)
LOGS = FORMS + TIMES + UNITS
