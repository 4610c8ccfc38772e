# SPDX-License-Identifier: BSD-3-Clause
"""A table of positions given as a log is told apart from one, and from every short log there is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from allanite.recording.health.examination import check
from allanite.recording.health.rows import rows_of_means
from allanite.recording.position_rows import are_positions
from allanite.recording.records import Recording
from shell import Run

Rng = np.random.Generator
FACES = np.vstack([np.eye(3), -np.eye(3)])


def gravity(n: int, rng: Rng, *, faces: bool = False) -> np.ndarray:
    """Means of biased accelerometers in so many attitudes [g]."""
    up = np.resize(FACES, (n, 3)) if faces else Rotation.random(n, rng=rng).as_matrix()[:, 2]
    return (up @ (np.eye(3) + 0.01 * rng.standard_normal((3, 3)))) + 0.02 * rng.standard_normal(3)


def saved(place: Path, head: list[str], table: np.ndarray) -> Path:
    if place.suffix == ".mat":
        savemat(place, {"acc": table[:, -6:-3], "gyro": table[:, -3:]})
    else:
        rows = [",".join(head), *(",".join(f"{x:.8g}" for x in row) for row in table)]
        place.write_text("\n".join(rows if head else rows[1:]) + "\n", encoding="utf-8")
    return place


AXES = [f"{sensor}_{a}{unit}" for sensor, unit in (("acc", " [g]"), ("gyro", " [deg/s]")) for a in "xyz"]
BARE = [name.split(" ")[0] for name in AXES]


@pytest.mark.parametrize(
    ("name", "head", "n", "faces"),
    [
        ("t.csv", AXES, 24, False),
        ("t.csv", ["pose", *AXES], 49, False),
        pytest.param("t.csv", ["roll", "pitch", *BARE], 30, False, marks=pytest.mark.long),
        ("t.csv", [], 24, False),
        pytest.param("t.mat", BARE, 36, False, marks=pytest.mark.long),
        ("t.csv", AXES, 6, True),
        pytest.param("t.csv", AXES, 24, True, marks=pytest.mark.long),
    ],
)
def test_a_table_of_positions_is_told_to_say_so(
    name: str, head: list[str], n: int, faces: bool, rng: Rng, run: Run, tmp_path: Path
) -> None:
    """With nothing said, and with a rate; what is advised runs."""
    beside = rng.uniform(-180, 180, (n, max(len(head) - 6, 0)))
    table = np.column_stack([beside, gravity(n, rng, faces=faces), 1e-3 * rng.standard_normal((n, 3))])
    log = str(saved(tmp_path / name, head, table))
    for words in (["info", log], ["calibrate", log], ["align", log, "--latitude", "48"]):
        assert "--means" in run(*words).err
        told = run(*words, "--rate", "100")
        assert "--means" in (told.out if words[0] == "info" else told.err)
        assert words[0] == "info" or told.code == 1
    refused = run("characterize", log, "--rate", "100")
    assert refused.code == 1 and "rows_of_means" in refused.err
    units = ["--unit", "ch0=g,ch1=g,ch2=g,ch3=deg/s,ch4=deg/s,ch5=deg/s"] if not head else []
    units = units or (["--unit", "acc=g,gyro=deg/s"] if head[-1] == "gyro_z" else [])
    done = run("calibrate", log, "--means", *units)
    assert done.code == (1 if n == 6 else 0) and (n > 6 or "degrees of freedom" in done.err), done.err


def noise(n: int, rng: Rng) -> np.ndarray:
    return rng.standard_normal((n, 3))


def walk(n: int, rng: Rng) -> np.ndarray:
    return np.cumsum(rng.standard_normal((n, 3)), axis=0)


def rest(n: int, rng: Rng) -> np.ndarray:
    return Rotation.random(rng=rng).as_matrix()[2] + 10 ** rng.uniform(-4, -1) * rng.standard_normal((n, 3))


def phases(n: int, rng: Rng) -> np.ndarray:
    """Three phases of a current: one length, and in a plane."""
    angle = rng.uniform(0.05, 3.0) * np.arange(n)[:, None] + np.arange(3) * 2 * np.pi / 3
    return np.sin(angle) + 0.01 * rng.standard_normal((n, 3))


def spinning(n: int, rng: Rng) -> np.ndarray:
    """Accelerometers of a unit that turns about some axis at a constant rate."""
    turn = Rotation.from_rotvec(
        np.arange(n)[:, None] * rng.uniform(0.1, 3.0) * Rotation.random(rng=rng).as_matrix()[0]
    )
    return turn.apply(Rotation.random(rng=rng).as_matrix()[2]) + 0.01 * rng.standard_normal((n, 3))


def handled(n: int, rng: Rng) -> np.ndarray:
    """At rest in one attitude after the other, each for ten samples."""
    return np.repeat(gravity(n // 10 + 1, rng), 10, axis=0)[:n] + 0.002 * rng.standard_normal((n, 3))


def counts(n: int, rng: Rng) -> np.ndarray:
    return np.round(rng.standard_normal((n, 3)) * 2)


@pytest.mark.parametrize("made", [noise, walk, rest, phases, spinning, handled, counts])
def test_no_ordinary_short_log_is_taken_for_one(made: Callable[[int, Rng], np.ndarray]) -> None:
    """Two hundred of each, with other channels beside."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        n = int(rng.integers(6, 200))
        columns = [*made(n, rng).T, *rng.standard_normal((int(rng.integers(0, 4)), n))]
        assert not are_positions(columns)


def test_a_log_with_stamps_of_its_own_is_a_log(rng: Rng) -> None:
    """Somebody shakes the unit: as many attitudes as samples, and no doubt that they are samples."""
    tumbling = Recording.from_rate(gravity(60, rng), rate=50.0, unit="g", names=["acc_x", "acc_y", "acc_z"])
    assert not list(rows_of_means(tumbling))
    assert "rows_of_means" not in {f.code for f in check(tumbling)}
