# SPDX-License-Identifier: BSD-3-Clause
"""A clock that restarts within a log: the runs are told, each can be kept, and a stated rate does not hide the seam."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.recording.cleaning import clean
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Finding

RATE = 200.0


def log(folder: Path, lengths: list[int], begins: list[float], lost: int = 0) -> tuple[Path, np.ndarray]:
    """Runs of so many rows, each from its own time [s] on; `lost` rows are missing in the first one."""
    stamps = np.concatenate([t + np.arange(n) / RATE for n, t in zip(lengths, begins, strict=True)])
    samples = np.random.default_rng(len(stamps)).normal(0.0, 1.0, len(stamps))
    there = np.r_[0:100, 100 + lost : len(stamps)]
    path = folder / "log.csv"
    rows = (f"{t:.6f},{x:.9g}" for t, x in zip(stamps[there], samples[there], strict=True))
    path.write_text("\n".join(["t [s],gyro_x [deg/s]", *rows]) + "\n")
    samples[100 : 100 + lost] = np.nan
    return path, samples


def fault(recording: al.Recording, code: str = "time_stamps") -> Finding | None:
    return next((f for f in check(recording) if f.code == code), None)


@pytest.mark.parametrize("lost", [0, 7])
@pytest.mark.parametrize(
    ("lengths", "begins"),
    [
        ([3000, 3000], [0.0, 5.0]),
        ([2000, 4000], [0.0, 0.0]),
        ([4000, 2000], [100.0, 95.0]),
        ([3000, 1000, 3500], [1.0, 1.0, 1.0]),
    ],
)
def test_each_run_can_be_kept(lengths: list[int], begins: list[float], lost: int, tmp_path: Path) -> None:
    """What is advised ends the fault when it is followed literally, and takes the rows that it says."""
    path, samples = log(tmp_path, lengths, begins, lost)
    recording = al.read(path)
    found = fault(recording)
    assert found is not None
    assert "--repair keep_run keeps" in found.advice
    rows = re.search(r"longest run \((\d+) rows\)", found.advice)
    assert rows is not None and int(rows[1]) == max(lengths)
    edges = np.concatenate(([0], np.cumsum(lengths)))
    longest = int(np.argmax(lengths))
    ways = {"keep_run": longest, "keep_run=first": 0, "keep_run=last": len(lengths) - 1, "keep_run=2": 1}
    for repair, k in ways.items():
        kept = clean(recording, repair)
        np.testing.assert_allclose(kept.values("gyro_x"), samples[edges[k] : edges[k + 1]], rtol=1e-8)
        assert kept.rate == pytest.approx(RATE) and fault(kept) is None
        assert kept.history[-1]["samples"]["gyro_x"] == len(samples) - lengths[k]
    with pytest.raises(InputError, match=rf"number of a run from 1 to {len(lengths)}"):
        clean(recording, "keep_run=9")


@pytest.mark.parametrize("begin", [0.0, 5.0, 1e6])
def test_a_stated_rate_does_not_hide_the_seam(begin: float, tmp_path: Path) -> None:
    """Back to an earlier time, or on to one far beyond the record."""
    path, _ = log(tmp_path, [3000, 3000], [0.0, begin])
    found = fault(al.read(path, rate=RATE), "no_time_stamps")
    assert found is not None
    assert found.severity.name == "WARNING" and "(3000)" in found.message
    assert found.places == ((3000, 3001),)


def test_a_stated_rate_without_a_seam_is_no_warning(tmp_path: Path) -> None:
    path, _ = log(tmp_path, [6000], [0.0], lost=50)
    found = fault(al.read(path, rate=RATE), "no_time_stamps")
    assert found is not None and found.severity.name == "INFO"


def test_rows_that_stand_twice_are_to_be_removed_first(tmp_path: Path) -> None:
    """The repair is named before the rate, which would stretch time; and it works."""
    path, samples = log(tmp_path, [4000], [0.0])
    lines = path.read_text().splitlines()
    twice = set(np.random.default_rng(1).choice(4000, 200, replace=False).tolist())
    path.write_text(
        "\n".join([line for k, line in enumerate(lines, -1) for _ in range(1 + (k in twice))]) + "\n"
    )
    recording = al.read(path)
    found = fault(recording)
    assert found is not None
    assert found.advice.index("--repair drop_duplicate_rows") < found.advice.index("--rate")
    assert "stretch time by 4.8 %" in found.advice
    kept = clean(recording, "drop_duplicate_rows")
    assert fault(kept) is None
    np.testing.assert_allclose(kept.values("gyro_x"), samples, rtol=1e-8)


def test_a_log_without_restarts_stays_whole(tmp_path: Path) -> None:
    path, samples = log(tmp_path, [3000], [0.0])
    assert clean(al.read(path), "keep_run").n_samples == len(samples)
