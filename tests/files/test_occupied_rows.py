# SPDX-License-Identifier: BSD-3-Clause
"""Rows without a sample: those of something else leave the grid, lost samples keep their place on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers import occupied_rows, read
from allanite.files.readers.filled_stamps import ArrayStamps
from allanite.files.readers.kept_rows import KeptRows
from allanite.recording.records import ArrayColumn, Recording

RATE, N = 100.0, 4000
SEEDS = range(8)


def rng_of(seed: int) -> np.random.Generator:
    return np.random.default_rng([73, seed])


def samples(rng: np.random.Generator, count: int = N) -> NDArray[np.float64]:
    return np.round(rng.normal(0.5, 0.1, count), 6)


def csv(path: Path, header: str, lines: list[str]) -> Path:
    path.write_text("\n".join([header, *lines, ""]), "utf-8")
    return path


def sample_lines(values: NDArray[np.float64]) -> list[str]:
    return [f"{i / RATE:.4f},{x}" for i, x in enumerate(values)]


def values_of(recording: Recording, channel: str = "gyro_x") -> NDArray[np.float64]:
    column = recording.columns[recording.index(channel)]
    return column.read(0, len(column))


@pytest.mark.parametrize("line", ["GPS 3D fix", ",", "12.5", "$GPGGA,1,2,3"])
@pytest.mark.parametrize("every", [10, 50, 777])
def test_lines_without_a_stamp_and_a_sample_take_no_place(tmp_path: Path, line: str, every: int) -> None:
    values = samples(rng_of(every))
    lines = sample_lines(values)
    mixed = [one for i, s in enumerate(lines) for one in ((s, line) if i % every == every - 1 else (s,))]
    recording = read(csv(tmp_path / "a.csv", "t [s],gyro_x [deg/s]", mixed))
    assert recording.rate == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_array_equal(values_of(recording), values)
    assert f"{N // every} row" in str(recording.notes["text"]["guesses"])


@pytest.mark.parametrize("jitter", [0.0, 0.05])
@pytest.mark.parametrize("other", [10.0, 37.0, 80.0, 100.0, 250.0])
def test_rows_of_another_sensor_take_no_place(tmp_path: Path, other: float, jitter: float) -> None:
    rng = rng_of(round(other))
    values, count = samples(rng), int(N / RATE * other)
    t = (np.arange(N) + jitter * rng.uniform(-1, 1, N)) / RATE
    theirs = np.arange(count) / other + 0.0037
    rows = [(s, f"{s:.6f},{x},") for s, x in zip(t, values, strict=True)]
    rows += [(s, f"{s:.6f},,{x}") for s, x in zip(theirs, samples(rng, count), strict=True)]
    path = csv(tmp_path / "a.csv", "t [s],gyro_x [deg/s],acc_x [m/s^2]", [line for _, line in sorted(rows)])
    for channel, rate, length in (("gyro_x", RATE, N), ("acc_x", other, count)):
        recording = read(path, channels=[channel])
        assert recording.rate == pytest.approx(rate, rel=1e-4)
        assert recording.n_samples == length
        assert np.isfinite(values_of(recording, channel)).all()
    with pytest.raises(InputError, match="--channels gyro or --channels acc") as refusal:
        read(path)
    assert f"gyro_x at {RATE:.4g} Hz" in str(refusal.value)


def test_every_door_leaves_the_rows_of_others_out(tmp_path: Path) -> None:
    rng = rng_of(1)
    t = np.concatenate([np.arange(N) / RATE, np.arange(80) / 2.0 + 0.0037])
    gyro = np.concatenate([samples(rng), np.full(80, np.nan)])
    height = np.concatenate([np.full(N, np.nan), samples(rng, 80)])
    order = np.argsort(t)
    table = pa.table({"t [s]": t[order], "gyro_x [deg/s]": gyro[order], "gps_alt [m]": height[order]})
    pq.write_table(table, tmp_path / "a.parquet", row_group_size=700)
    for recording in (
        read(tmp_path / "a.parquet", channels=["gyro_x"]),
        Recording.from_samples(table, channels=["gyro_x"]),
    ):
        assert recording.rate == pytest.approx(RATE, rel=1e-9)
        np.testing.assert_array_equal(values_of(recording), gyro[:N])


@pytest.mark.parametrize("form", ["stamped", "bare"])
@pytest.mark.parametrize("share", [0.001, 0.02, 0.3])
def test_lost_samples_are_the_same_whether_their_rows_are_there_or_not(
    tmp_path: Path, share: float, form: str
) -> None:
    rng = rng_of(round(1000 * share))
    values = samples(rng)
    lines = sample_lines(values)
    lost = rng.random(N) < share
    lost[[0, -1]] = False
    empty = [
        (f"{i / RATE:.4f}," if form == "stamped" else ",") if lost[i] else s for i, s in enumerate(lines)
    ]
    there = read(csv(tmp_path / "there.csv", "t [s],gyro_x [deg/s]", empty))
    gone = read(
        csv(
            tmp_path / "gone.csv",
            "t [s],gyro_x [deg/s]",
            [s for s, out in zip(lines, lost, strict=True) if not out],
        )
    )
    assert there.rate == gone.rate == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_array_equal(values_of(there), np.where(lost, np.nan, values))
    np.testing.assert_array_equal(values_of(there), values_of(gone))


@pytest.mark.parametrize("seed", SEEDS)
def test_lost_samples_and_rows_of_others_together(tmp_path: Path, seed: int) -> None:
    rng = rng_of(seed)
    values = samples(rng)
    lost = rng.random(N) < 0.02
    lost[[0, -1]] = False
    lines: list[str] = []
    for i, s in enumerate(sample_lines(values)):
        lines.append(f"{i / RATE:.4f}," if lost[i] else s)
        lines += ["GPS 3D fix"] if rng.random() < 0.02 else []
    recording = read(csv(tmp_path / "a.csv", "t [s],gyro_x [deg/s]", lines))
    assert recording.rate == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_array_equal(values_of(recording), np.where(lost, np.nan, values))


@pytest.mark.long
@pytest.mark.parametrize("extra", [False, True])
def test_blocks_are_judged_as_the_whole(monkeypatch: pytest.MonkeyPatch, extra: bool) -> None:
    rng = rng_of(3)
    n = 50_000
    t, values = np.arange(n) / RATE, samples(rng, n)
    values[12_000:25_000] = np.nan  # a whole block and its edges
    values[rng.random(n) < 0.1] = np.nan
    if extra:
        at = np.sort(rng.integers(1, n, 700))
        t, values = np.insert(t, at, t[at] - 0.0041), np.insert(values, at, np.nan)
    table = {"t [s]": t, "gyro_x [deg/s]": values}
    whole = Recording.from_samples(table)
    monkeypatch.setattr(occupied_rows, "BLOCK", 8192)
    parts = Recording.from_samples(table)
    assert whole.rate == parts.rate == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_array_equal(values_of(parts), values_of(whole))
    known = values[np.isfinite(values)]
    np.testing.assert_array_equal(values_of(whole)[np.isfinite(values_of(whole))], known)


@pytest.mark.parametrize("step", [0.02, 0.1, 1.0])
def test_under_coarse_stamps_an_empty_row_keeps_its_place(tmp_path: Path, step: float) -> None:
    rng = rng_of(2)
    values = samples(rng)
    lost = rng.random(N) < 0.01
    stamps = np.floor(np.arange(N) / RATE / step + 1e-6) * step
    lines = [f"{t:.2f},{'' if out else x}" for t, x, out in zip(stamps, values, lost, strict=True)]
    recording = read(csv(tmp_path / "a.csv", "t [s],gyro_x [deg/s]", lines))
    assert recording.rate == pytest.approx(RATE, rel=1e-3)
    np.testing.assert_array_equal(values_of(recording), np.where(lost, np.nan, values))


@pytest.mark.parametrize("seed", SEEDS)
def test_kept_rows_read_as_the_rows_picked_from_the_whole(seed: int) -> None:
    rng = rng_of(seed)
    n = int(rng.integers(1, 60_000))
    values, mask = rng.normal(size=n), rng.random(n) < rng.choice([0.001, 0.5, 0.999])
    mask[rng.integers(n)] = True
    blocks = [mask[a : a + 16_384] for a in range(0, n, 16_384)]
    rows, picked = KeptRows.of(blocks), values[mask]
    column = rows.of_column(ArrayColumn(values))
    assert len(column) == len(picked)
    for _ in range(20):
        a, b = np.sort(rng.integers(0, len(picked) + 1, 2))
        np.testing.assert_array_equal(column.read(int(a), int(b)), picked[a:b])
        np.testing.assert_array_equal(
            rows.gathered(ArrayStamps(values), int(a), int(b)), picked[a:b] - values[0]
        )
