# SPDX-License-Identifier: BSD-3-Clause
"""Logs, tables and documents that the frozen results begin with: NumPy and fixed seeds, nothing of allanite."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["written"]

Array = NDArray[np.float64]
_SAMPLES = Path(__file__).parents[1] / "samples"
DEG, DEG_H, EARTH, G = np.pi / 180, np.pi / 180 / 3600, 15.041067, 9.80665  # EARTH in deg/h
LATITUDE = 48.1 * DEG
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)

LIMITS = "gyro:\n  angle_random_walk: 0.3 deg/√h\n"
SHEET = """\
sensor: XYZ-100
source: data sheet, revision B
gyro:
  angle_random_walk: 0.3 deg/√h
  bias_instability: 5 deg/h
  bias_instability_is: minimum
accelerometer:
  noise_density: 60 µg/√Hz
  density_is: one-sided
"""


def noise(
    rng: np.random.Generator, n: int, rate: float, *, white: float, walk: float = 0.0, slow: float = 0.0
) -> Array:
    """White noise of a density [u/√Hz], a random walk [u/√s], and a drift with a time constant of 20 s [u]."""
    y = white * np.sqrt(rate) * rng.standard_normal(n)
    y += np.cumsum(rng.standard_normal(n)) * walk / np.sqrt(rate)
    phi, steps = np.exp(-1 / (20.0 * rate)), rng.standard_normal(n)
    state = np.empty(n)
    state[0] = steps[0]
    for i in range(1, n):
        state[i] = phi * state[i - 1] + np.sqrt(1 - phi * phi) * steps[i]
    return np.asarray(y + slow * state)


def table(path: str, heads: str, *columns: Array, digits: str = "%.9g") -> None:
    """A CSV file of columns under their heads."""
    np.savetxt(path, np.column_stack(columns), fmt=digits, delimiter=",", header=heads, comments="")


def log(path: str, heads: str, rate: float, *columns: Array) -> None:
    """A CSV file with a column of time before the others."""
    n = columns[0].shape[0]
    table(path, f"time [s],{heads}", np.round(np.arange(n) / rate, 6), *columns)


def rows(path: str, head: str, lines: Sequence[str]) -> None:
    Path(path).write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")


def still() -> None:
    """One gyro; an IMU; three of a kind; a record with faults; one with a line; one read through a meter."""
    rng = np.random.default_rng(1)
    gyro = noise(rng, 6000, 10.0, white=0.005, walk=2e-5, slow=1e-3)
    log("gyro.csv", "gyro [deg/s]", 10.0, gyro)
    log("short.csv", "gyro [deg/s]", 10.0, gyro[:1500])
    imu = [noise(rng, 3000, 25.0, white=0.004 + 0.001 * i, walk=8e-4) for i in range(2)]
    force = [noise(rng, 3000, 25.0, white=1e-3, walk=2e-4) + level for level in (0.1, 9.8)]
    log("imu.csv", "gyro_x [deg/s],gyro_y [deg/s],acc_x [m/s^2],acc_z [m/s^2]", 25.0, *imu, *force)
    walk = np.cumsum(rng.standard_normal(4000)) * 3e-6
    log(
        "three.csv",
        "a [rad/s],b [rad/s],c [rad/s]",
        10.0,
        3e-4 * rng.standard_normal((4000, 3)) + walk[:, None],
    )
    for i, size in enumerate((1.0, 1.0, 1.25), 1):
        log(f"sn{i}.csv", "gyro [deg/s]", 10.0, size * noise(rng, 3000, 10.0, white=0.005, slow=8e-4))
    changed = noise(rng, 6000, 10.0, white=0.005, slow=4e-4)
    changed[2500:] *= 1.4
    log("changed.csv", "gyro [deg/s]", 10.0, changed)
    t = np.arange(6000) / 10.0
    log("line.csv", "gyro [deg/s]", 10.0, gyro + 4e-3 * np.sin(2 * np.pi * 1.7 * t + 0.3))
    true = noise(rng, 4096, 32.0, white=0.004, walk=1e-5)
    table("volts.csv", "gyro [V]", 0.024 * true + 5e-4 * rng.standard_normal(4096))
    table("shorted.csv", "gyro [V]", 5e-4 * rng.standard_normal(4096))
    phase = 1e-10 * rng.standard_normal(3001)
    phase[1:] += 3e-12 * np.cumsum(rng.standard_normal(3000))
    np.savetxt("phase.txt", 1e9 * phase, fmt="%.9g")
    innovations = np.random.default_rng(7).standard_normal((4000, 2)) * [3.0, 1.0]
    log("filter.csv", "nu_x,nu_y,S_x,S_y", 10.0, innovations, np.ones((4000, 2)))


def faulty() -> None:
    """A log with a gap, a stuck stretch, an outlier, a clipped channel and rows written twice; a curve of another."""
    rng = np.random.default_rng(2)
    y = np.clip(rng.standard_normal((3000, 2)), -9.0, [9.0, 1.2])
    y[700:760, 0] = y[700, 0]
    y[1500, 0] = 80.0
    t = np.arange(3000) / 20.0
    keep = (t < 60.0) | (t > 75.0)
    table("faulty.csv", "time [s],x [deg/h],y [deg/h]", t[keep], y[keep], digits="%.6f")
    held = np.repeat(rng.standard_normal(1000), 2)
    table("held.csv", "time [s],gyro [deg/s]", np.arange(2000) / 20.0, held, digits="%.6f")
    tau = 2.0 ** np.arange(12) / 100
    table("curve.txt", "tau oadev", tau, np.hypot(0.005 / np.sqrt(tau), 1e-3 * np.ones(12)))


def environment() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(7200) / 2.0
    warmth = 25 + 4 * np.sin(2 * np.pi * t / 1800.0) + 0.02 * rng.standard_normal(7200)
    drift = 0.01 * np.exp(-t / 300.0) + 2e-3 * (warmth - 25)
    y = drift + noise(rng, 7200, 2.0, white=0.006, walk=1e-5)
    table("warm.csv", "time [s],gyro [deg/s],temp [degC]", t, y, warmth, digits="%.7f")


def turned() -> None:
    """Takes of the Earth rate, of north by positions, rotation, means and east against west; three axes at rest."""
    rng, level = np.random.default_rng(4), EARTH * np.cos(LATITUDE)
    n = 9600
    dwell = (np.arange(n) // 240) % 2
    log(
        "take.csv",
        "gyro [deg/h]",
        8.0,
        40 + level * (1 - 2 * dwell) + noise(rng, n, 8.0, white=6.0, slow=0.5),
    )
    up = EARTH * np.sin(LATITUDE)
    log("over.csv", "gyro [deg/h]", 8.0, 5 + up * (1 - 2 * dwell) + noise(rng, n, 8.0, white=6.0, slow=0.5))
    starts = [120 * k for k in range(8)]
    turns = [f"{30 * k - 0.5},{30 * k + 0.5}" for k in range(1, 40)]
    rows("turns.csv", "start,stop", turns)
    headings = np.array([0, 90, 180, 270] * 2, dtype=float)
    y = 3 + level * np.cos((headings + 30) * DEG)[np.arange(9600) // 1200] + noise(rng, 9600, 10.0, white=2.0)
    log("north.csv", "gyro [deg/h]", 10.0, y)
    rows(
        "headings.csv",
        "start,stop,heading",
        [f"{s + 2},{s + 118},{h:g}" for s, h in zip(starts, headings, strict=True)],
    )
    for h, s in zip((0, 90, 180, 270), starts[:4], strict=True):
        log(f"n{h}.csv", "gyro [deg/h]", 10.0, y[10 * s : 10 * s + 1150])
    t = (np.arange(9600) + 0.5) / 10.0
    spin = 3 + level * np.cos((t + 30) * DEG) + noise(rng, 9600, 10.0, white=2.0)
    log("spin.csv", "gyro [deg/h]", 10.0, spin)
    rows("means.csv", "heading,rate [deg/h]", ["0,13.70", "90,-0.03", "180,-3.71", "270,10.04"])
    side = np.array([90, 270] * 8)[np.arange(9600) // 600]
    null = (
        3
        + (level * np.cos(side * DEG))
        + 1.5 * np.sign(np.sin(side * DEG))
        + noise(rng, 9600, 10.0, white=2.0)
    )
    log("null.csv", "gyro [deg/h]", 10.0, null)
    rows(
        "sides.csv",
        "start,stop,heading",
        [f"{60 * k + 2},{60 * k + 58},{(90, 270)[k % 2]}" for k in range(16)],
    )
    earth = EARTH * np.array([0.8 * np.cos(LATITUDE), -0.6 * np.cos(LATITUDE), np.sin(LATITUDE)])
    rates = earth + rng.standard_normal((12000, 3))
    force = [0, 0, 9.81] + 1e-3 * rng.standard_normal((12000, 3))
    heads = ",".join([f"gyro_{a} [deg/h]" for a in "xyz"] + [f"acc_{a} [m/s^2]" for a in "xyz"])
    log("axes.csv", heads, 20.0, rates, force)


def rotated(vector: Array) -> Array:
    """Rotation matrices of rotation vectors [rad], shape (..., 3)."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_rotvec(np.reshape(vector, (-1, 3))).as_matrix()
    return np.asarray(flat.reshape(*np.shape(vector)[:-1], 3, 3))


def vector_of(matrix: Array) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix).as_rotvec())


def held(attitudes: Sequence[Array], *, rate: float, dwell: float, turn: float) -> tuple[Array, Array]:
    """Rates [rad/s] and specific forces [m/s²] of a body that rests, turns, rests: means over samples."""
    earth = EARTH * DEG_H * np.array([np.cos(LATITUDE), 0.0, -np.sin(LATITUDE)])
    down, rest, move = np.array([0.0, 0.0, -G]), round(dwell * rate), round(turn * rate)
    w, f = [], []
    for i, c in enumerate(attitudes):
        w.append(np.tile(c.T @ earth, (rest, 1)))
        f.append(np.tile(c.T @ down, (rest, 1)))
        if i + 1 < len(attitudes):
            vector = vector_of(c.T @ attitudes[i + 1])
            part = (np.arange(move)[:, None] + (_NODES + 1) / 2) / move
            back = np.swapaxes(c @ rotated(vector * part[..., None]), -1, -2)
            w.append(np.einsum("nqij,j,q->ni", back, earth, _WEIGHTS / 2) + vector * rate / move)
            f.append(np.einsum("nqij,j,q->ni", back, down, _WEIGHTS / 2))
    return np.concatenate(w), np.concatenate(f)


def unit() -> None:
    """A unit with errors in many positions; one that is levelled, turned by half a turn, kept still, and spun."""
    rng = np.random.default_rng(5)
    ups = [
        (0, 0, 1),
        (0, 0, -1),
        (0, 1, 0),
        (0, -1, 0),
        (1, 0, 0),
        (-1, 0, 0),
        (1, 1, 1),
        (-1, 1, -1),
        (1, -1, 1),
    ]
    ups += [(-1, -1, 1), (1, 1, -1), (1, 0, 1), (0, -1, 1)]
    attitudes = []
    for i, up in enumerate(ups):
        v = -np.array(up) / np.linalg.norm(up)
        axis = np.cross(v, [0.0, 0.0, 1.0])
        s = float(np.linalg.norm(axis))
        tip = axis / s * np.arctan2(s, v[2]) if s > 1e-9 else np.array([0.0 if v[2] > 0 else np.pi, 0.0, 0.0])
        attitudes.append(rotated(np.array([0.0, 0.0, 0.4 * i])) @ rotated(tip))
    w, f = held(attitudes, rate=40.0, dwell=5.0, turn=2.0)
    skew = np.eye(3) + 0.004 * rng.standard_normal((3, 3))
    lean = np.eye(3) + 0.004 * np.tril(rng.standard_normal((3, 3)))
    gyros = (w @ skew.T + [4e-4, -3e-4, 2e-4]) / DEG + 0.02 * rng.standard_normal(w.shape)
    force = f @ lean.T + [0.02, -0.03, 0.01] + 0.004 * rng.standard_normal(f.shape)
    heads = ",".join([f"gyro_{a} [deg/s]" for a in "xyz"] + [f"acc_{a} [m/s^2]" for a in "xyz"])
    log("unit.csv", heads, 40.0, gyros, force)
    stops = [(7 * i * 40, (7 * i + 5) * 40) for i in range(len(ups))]
    means = np.array([force[a:b].mean(axis=0) / G for a, b in stops])
    table("acc.csv", "ax [g],ay [g],az [g]", means, digits="%.6f")
    body = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]]).T  # forward, left, up in north, east, down
    level = [rotated(np.array([0.0, 0.0, h * DEG])) @ body for h in (30.0, 210.0)]
    for name, places, dwell in (("two", level, 150.0), ("one", level[:1], 200.0)):
        w, f = held(places, rate=20.0, dwell=dwell, turn=5.0)
        gyros = w / DEG_H + [3.0, -2.0, 1.0] + 5.0 * rng.standard_normal(w.shape)
        log(
            f"{name}.csv",
            heads.replace("deg/s", "deg/h"),
            20.0,
            gyros,
            f + 1e-3 * rng.standard_normal(f.shape),
        )


def on_tables() -> None:
    """A rate table that steps and one that swings; five gyros on a cone, of which one has a fault."""
    rng = np.random.default_rng(6)
    rates = np.array([0, 10, -10, 30, -30, 60, -60, 60, -60, 30, -30, 10, -10, 0.0])
    rows("steps.csv", "start,stop,rate_deg_s", [f"{20 * i},{20 * i + 20},{r:g}" for i, r in enumerate(rates)])
    seen = np.concatenate([np.zeros(60), np.repeat(rates, 400), np.zeros(100)])
    out = 2.5 + 0.024 * seen + 1e-7 * seen**2 + 4e-4 * rng.standard_normal(seen.size)
    log("table.csv", "gyro [V]", 20.0, out)
    rows("swings.csv", "start,stop,amplitude_deg_s,frequency_hz", ["0,60,50,0.1", "70,100,50,1"])
    t = np.arange(4200) / 40.0
    swing = np.where(
        t < 60, 50 * np.sin(0.2 * np.pi * t), np.where((t >= 70) & (t < 100), 50 * np.sin(2 * np.pi * t), 0)
    )
    log("swung.csv", "gyro [deg/s]", 40.0, 0.1 + 1.01 * swing + 0.02 * rng.standard_normal(t.size))
    turn, lean = 2 * np.pi * np.arange(5) / 5, 54.7356 * DEG
    axes = np.column_stack(
        [np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.full(5, np.cos(lean))]
    )
    y = axes @ [0.01, 0.0, -0.02] + 4e-4 * rng.standard_normal((6000, 5))
    y[4000:, 3] += 4e-4
    log("cone.csv", ",".join(f"g{i} [rad/s]" for i in range(5)), 20.0, y)
    rows(
        "directions.csv",
        "channel,x,y,z",
        [f"g{i},{x:.6f},{y:.6f},{z:.6f}" for i, (x, y, z) in enumerate(axes)],
    )


def fleet() -> None:
    """The table of thirty units in two lots, twice each a year apart: one stands out, one drifts, some give limits."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rng, levels = np.random.default_rng(30), np.array((-4.0, -2.5, -1.5, -0.75, 0.0, 0.75, 1.5, 2.5, 4.0))
    lines = []
    for unit in range(30):
        common = 0.15 * rng.standard_normal()
        for symbol, middle in (("N", 0.25 * DEG / 60), ("K", 2 * DEG / 3600 / 60)):
            true = np.log(middle) + common + 0.05 * rng.standard_normal() + (1.2 if unit == 4 else 0.0)
            for year in range(2):
                best = true + 0.03 * rng.standard_normal() + (0.5 * year if unit == 9 else 0.0)
                knots, limit = best + 0.03 * levels, symbol == "K" and unit % 6 == 0
                lines.append(
                    {
                        "log": f"u{unit:02}_{year}.csv", "unit": f"u{unit:02}", "lot": f"L{unit // 15}",
                        "date": np.datetime64(f"202{4 + year}-03-01T00:00:00"), "channel": "gyro_x", "kind": "rate",
                        "term": symbol, "unit_of_measure": {"N": "rad/s/√Hz", "K": "rad/s/√s"}[symbol],
                        "profile": np.where(levels > 0, knots, -np.inf) if limit else knots,
                        "root_at_zero": 0.0 if limit else -np.inf,
                    }
                )  # fmt: skip
    types = {"profile": pa.list_(pa.float32(), 9), "root_at_zero": pa.float32(), "date": pa.timestamp("s")}
    columns = {name: pa.array([line[name] for line in lines], types.get(name)) for name in lines[0]}
    Path("fleet").mkdir()
    pq.write_table(pa.table(columns), "fleet/fleet.parquet")


def written() -> None:
    """Everything into the current folder, with copies of the sample logs of every format in `samples`."""
    for make in (still, faulty, environment, turned, unit, on_tables, fleet):
        make()
    Path("sheet.yaml").write_text(SHEET, encoding="utf-8")
    Path("limits.yaml").write_text(LIMITS, encoding="utf-8")
    shutil.copytree(_SAMPLES, "samples")
    shutil.copytree("samples/run/finished", "damaged")
    segment = Path("damaged/000001.arrows")
    content = bytearray(segment.read_bytes())
    content[len(content) * 2 // 3] ^= 1
    segment.write_bytes(content)
