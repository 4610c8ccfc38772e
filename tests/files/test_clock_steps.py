# SPDX-License-Identifier: BSD-3-Clause
"""Clock steps of any size, at any row, in any format: what is refused names the row, and the options it names work."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import DataQualityError, InputError
from allanite.files.readers import read
from allanite.recording.sample_columns import ArrayColumn

ROWS, START, STEP = 400, 1_700_000_000 * 10**9, 5_000_000
DAY = 86_400 * 10**9
SIZES = {"a day": DAY, "105 days": 105 * DAY, "half a year": 180 * DAY, "since boot": START - 10**9}
FIRST = {"first row": 1, "early": 50, "half-way": 250, "last row": ROWS - 1}


def csv(path: Path, stamps: np.ndarray, samples: np.ndarray) -> Path:
    rows = (f"{t},{x:.6f}" for t, x in zip(stamps.tolist(), samples, strict=True))
    path = path.with_suffix(".csv")
    path.write_text("\n".join(["timestamp [ns],gyro_x [deg/s]", *rows]) + "\n")
    return path


def npz(path: Path, stamps: np.ndarray, samples: np.ndarray) -> Path:
    path = path.with_suffix(".npz")
    np.savez(path, **{"timestamp [ns]": stamps, "gyro_x [deg/s]": samples})
    return path


def parquet(path: Path, stamps: np.ndarray, samples: np.ndarray) -> Path:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    path = path.with_suffix(".parquet")
    pq.write_table(pa.table({"timestamp [ns]": stamps, "gyro_x [deg/s]": samples}), path, row_group_size=150)
    return path


def mcap(path: Path, stamps: np.ndarray, samples: np.ndarray) -> Path:
    return _ros(path.with_suffix(".mcap"), stamps, samples)


def bag(path: Path, stamps: np.ndarray, samples: np.ndarray) -> Path:
    return _ros(path.with_suffix(".bag"), stamps, samples)


def _ros(path: Path, stamps: np.ndarray, samples: np.ndarray) -> Path:
    if importlib.util.find_spec("rosbags") is None:
        pytest.skip("the extra allanite[ros] is not installed")
    from ros_writers import IMU, Types, write

    types = Types(path.suffix == ".mcap")
    messages = [
        ("/imu", IMU, START + STEP * k, types.imu(int(t), (x, 2 * x, 3 * x), (x, x, 9.8)))
        for k, (t, x) in enumerate(zip(stamps, samples, strict=True))
    ]
    return write(types, path, messages)


WRITERS = (csv, npz, parquet, mcap, bag)
Writer = Callable[[Path, np.ndarray, np.ndarray], Path]


def stepped(size: int, row: int) -> np.ndarray:
    """Stamps that are early by `size` before a row."""
    stamps = START + STEP * np.arange(ROWS)
    stamps[:row] -= size
    return stamps


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    from allanite.files.readers import rosbag
    from hostile_files import inline

    monkeypatch.setattr(rosbag, "run", inline)


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("first", FIRST)
def test_a_step_forward(write: Writer, size: str, first: str, tmp_path: Path) -> None:
    """The message is that of any step; cut as it says, the longer part is exact, and --rate keeps all rows."""
    row = FIRST[first]
    samples = np.random.default_rng(row).normal(0.0, 1.0, ROWS)
    path = write(tmp_path / "log", stepped(SIZES[size], row), samples)
    with pytest.raises(DataQualityError, match=rf"row {row} by .* the clock was set") as raised:
        read(path)
    said = str(raised.value)
    cut = {end: float(value) for end, value in re.findall(r"--(from|to) (\S+)", said)}
    part = read(path, start=cut.get("from"), stop=cut.get("to"))
    longest = max(row, ROWS - row)
    assert f"({longest} of {ROWS} rows)" in said
    assert (part.n_samples, part.rate) == (longest, pytest.approx(200.0, rel=1e-5))
    kept = samples[row:] if longest == ROWS - row else samples[:row]
    np.testing.assert_allclose(part.values(part.names[0]), kept, atol=1e-6)
    rate = re.search(r"--rate ([\d.]+)", said)
    assert rate is not None
    whole = read(path, rate=float(rate[1]))
    np.testing.assert_allclose(whole.values(whole.names[0]), samples, atol=1e-6)


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("row", [1, 150, 399])
def test_a_step_back(write: Writer, size: str, row: int, tmp_path: Path) -> None:
    """Such a log is read, or refused with the rows and what to do; never for the size of its numbers."""
    samples = np.random.default_rng(row).normal(0.0, 1.0, ROWS)
    stamps = START + STEP * np.arange(ROWS)
    stamps[row:] -= SIZES[size]
    path = write(tmp_path / "log", stamps, samples)
    try:
        recording = read(path)
    except DataQualityError as error:
        assert f"row {row} " in str(error) or f"rows {row}" in str(error)  # noqa: PT017  # or it is read
    else:
        assert recording.notes["timebase"]["backward_rows"] == [row]
    assert read(path, rate=200.0).n_samples == ROWS


@pytest.mark.parametrize("kind", [np.int64, np.uint64, np.dtype(">i8")])
@pytest.mark.parametrize("share", [0.001, 0.3, 0.6])
def test_integers_stay_exact_near_most_of_them(kind: np.dtype, share: float) -> None:
    """Each sample is its integer less the origin, rounded to float64 once; within 2**53 of the origin not at all."""
    values = np.array(START + STEP * np.arange(1000), dtype=kind)
    odd = int(1000 * share)
    values[:odd] = np.arange(odd) * 7 + 3
    values[500] = np.iinfo(np.int64).max
    column = ArrayColumn(values)
    for sample, value in zip(column.read(0, 1000), values.tolist(), strict=True):
        exact = value - int(column.origin)
        off = abs(Fraction(float(sample)) - exact)
        assert off == 0 if abs(exact) < 2**53 else off <= abs(exact) * 2.0**-53


def test_numbers_that_float64_does_not_hold_are_refused() -> None:
    values = np.random.default_rng(1).integers(-(2**63), 2**63 - 1, 5000)
    with pytest.raises(InputError, match=r"span more than 2\*\*53"):
        ArrayColumn(values)
