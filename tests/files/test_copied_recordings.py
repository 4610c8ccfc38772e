# SPDX-License-Identifier: BSD-3-Clause
"""Recordings go to other processes by pickle, wherever their samples lie, and equal those of the same samples."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.recording.records import Recording

pa = pytest.importorskip("pyarrow")
pd = pytest.importorskip("pandas")

SAMPLES = Path(__file__).parents[1] / "samples"
N = 400


def frame() -> Any:
    """A gap in time, a missing value, and integers that float64 does not hold."""
    rng = np.random.default_rng(7)
    table = pd.DataFrame({"t": np.arange(N) / 100.0, "gyro_x": rng.normal(size=N)})
    table["ticks"] = 2**60 + 3 * np.arange(N) + rng.integers(0, 3, N)
    table.loc[5, "gyro_x"] = np.nan
    return table.drop(index=range(100, 140)).reset_index(drop=True)


def of_parquet(folder: Path) -> Recording:
    frame().to_parquet(folder / "log.parquet", row_group_size=50)
    return al.read(folder / "log.parquet", unit={"gyro": "deg/s"}, time="t")


def of_feather(folder: Path) -> Recording:
    frame().to_feather(folder / "log.feather", compression="uncompressed")
    return al.read(folder / "log.feather", unit={"gyro": "deg/s"}, time="t")


def of_text(folder: Path) -> Recording:
    frame().to_csv(folder / "log.csv", index=False)
    return al.read(folder / "log.csv", unit={"gyro": "deg/s"}, time="t")


def of_npy(folder: Path) -> Recording:
    np.save(folder / "log.npy", frame()[["t", "gyro_x"]].to_numpy())
    return al.read(folder / "log.npy", unit="deg/s", rate=100.0)


def of_pandas(folder: Path) -> Recording:
    return al.Recording.from_samples(frame(), unit={"gyro": "deg/s"}, time="t")


def of_arrow(folder: Path) -> Recording:
    return al.Recording.from_samples(pa.table(frame()), unit={"gyro": "deg/s"}, time="t")


def of_run(folder: Path) -> Recording:
    return al.read(SAMPLES / "run" / "finished")


def of_array(folder: Path) -> Recording:
    return al.Recording.from_rate(frame()["gyro_x"].to_numpy(), rate=100.0, unit="deg/s")


MAKERS = [of_parquet, of_feather, of_text, of_npy, of_pandas, of_arrow, of_run, of_array]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("copied", [lambda one: pickle.loads(pickle.dumps(one)), copy.deepcopy])
def test_a_copied_recording_has_the_same_samples(
    tmp_path: Path, make: Callable[[Path], Recording], copied: Callable[[Recording], Recording]
) -> None:
    recording = make(tmp_path)
    for one in (recording, recording.window(0.5, 2.5) if recording.duration > 3 else recording):
        again = copied(one)
        for name in one.names:
            assert np.array_equal(again.values(name), one.values(name), equal_nan=True)
            assert again.columns[again.index(name)].dtype == one.columns[one.index(name)].dtype
            assert again.origin(name) == one.origin(name)
        assert again == one


@pytest.mark.parametrize("make", MAKERS)
def test_recordings_are_equal_only_if_every_sample_is(
    tmp_path: Path, make: Callable[[Path], Recording]
) -> None:
    recording = make(tmp_path)
    assert recording == make(tmp_path)
    samples = recording.values(recording.names[0])
    assert np.isfinite(samples).any()
    same = al.Recording.from_rate(samples, rate=100.0, unit="deg/s")
    changed = np.array(samples)
    changed[np.flatnonzero(np.isfinite(changed))[-1]] += 1.0
    assert al.Recording.from_rate(np.array(samples), rate=100.0, unit="deg/s") == same
    assert al.Recording.from_rate(changed, rate=100.0, unit="deg/s") != same
    assert recording.window(0.0, recording.duration / 2) != recording
