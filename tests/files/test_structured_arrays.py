# SPDX-License-Identifier: BSD-3-Clause
"""Structured arrays of NumPy: every number of every field is a channel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from allanite.files.readers import read

CASES = 100  # a fault of 2.3 % of them is found with 90 %
N = 64


@pytest.mark.long
def test_fields_with_several_numbers_and_fields_of_their_own(tmp_path: Path) -> None:
    for seed in range(CASES):
        rng = np.random.default_rng([20261126, 3, seed])
        rate = float(rng.choice([10.0, 100.0, 400.0]))
        widths = rng.integers(1, 5, size=2)
        nested = rng.random() < 0.5
        number = str(rng.choice(["<f4", "<f8", ">f4", "<i2"]))
        inner = [(axis, number) for axis in "xyz"]
        kinds = [("t", "<f8"), ("w", number, (int(widths[0]),)), ("a", inner if nested else number)]
        log = np.zeros(N, dtype=kinds)
        log["t"] = np.arange(N) / rate
        log["w"] = 100 * rng.normal(size=(N, widths[0]))
        expected = {f"w{k}": log["w"][:, k] for k in range(widths[0])}
        if nested:
            for axis in "xyz":
                log["a"][axis] = 100 * rng.normal(size=N)
            expected |= {f"a_{axis}": log["a"][axis] for axis in "xyz"}
        else:
            log["a"] = 100 * rng.normal(size=N)
            expected |= {"a": log["a"]}
        path = tmp_path / ("log.npz" if rng.random() < 0.5 else "log.npy")
        if path.suffix == ".npz":
            np.savez(path, imu=log)
        else:
            np.save(path, log)
        recording = read(path)
        assert recording.rate == pytest.approx(rate, rel=1e-9), seed
        assert len(recording.names) == len(expected), (seed, recording.names)
        for name, values in zip(recording.names, expected.values(), strict=True):
            assert np.array_equal(recording.values(name), values), (seed, name)
        assert recording.names[-3:] == ("a_x", "a_y", "a_z") or not nested, seed


@pytest.mark.parametrize("dtype", ["datetime64[us]", "datetime64[ns]", "timedelta64[ms]", "timedelta64[us]"])
@pytest.mark.parametrize("structured", [True, False])
def test_moments_and_durations_are_the_time_beside_samples(
    tmp_path: Path, structured: bool, dtype: str
) -> None:
    values = np.random.default_rng(3).standard_normal(400)
    begin = np.datetime64("2026-11-28T10:00", "ms").astype(np.int64) if dtype.startswith("date") else 0
    t = (begin + 10 * np.arange(400)).astype(f"{dtype[: dtype.index('[')]}[ms]").astype(dtype)
    if structured:
        table = np.empty(400, dtype=[("t", dtype), ("gx", float)])
        table["t"], table["gx"] = t, values
        np.save(tmp_path / "log.npy", table)
    else:
        np.savez(tmp_path / "log.npz", t=t, gx=values)
    (path,) = tmp_path.iterdir()
    got = read(path)
    assert (got.rate, got.n_samples, got.names) == (pytest.approx(100.0), 400, ("gx",))
    assert got.start == (None if begin == 0 else begin * 10**6)
    np.testing.assert_array_equal(got.values("gx"), values)
