# SPDX-License-Identifier: BSD-3-Clause
"""Rows of several sensors in one table are told by what a column does, at any place and every door."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.files.readers import read
from allanite.files.readers.arrow_columns import table_of_arrow
from allanite.recording.records import Recording

RATE, N = 100, 600
IDS = {
    "whole": ["1", "2"],
    "four": ["0", "1", "2", "3"],
    "words": ["left", "right"],
    "addresses": ["aa:bb:cc:00:11:22", "aa:bb:cc:00:11:23", "aa:bb:cc:00:11:24"],
}
SAID = "distinguishes several sensors or records"
OF_KINDS = "lines of several types"  # words in a leading column are kinds of rows

NAMES = [
    "dev",
    "ch",
    "channel",
    "port",
    "addr",
    "bus",
    "slot",
    "src",
    "unit",
    "sensor_id",
    "node",
    "imu",
    "host",
    "axis",
    "I",
]

Columns = dict[str, list[str]]


def noise(count: int, seed: int = 0) -> list[str]:
    return [f"{x:.6f}" for x in np.random.default_rng([74, seed]).normal(0.5, 0.1, count)]


def merged(ids: list[str], name: str = "which", apart_ms: int = 0) -> Columns:
    """A table of several sensors, row by row; `apart_ms` is between their stamps."""
    n = N * len(ids)
    return {
        "t_ms": [str(i * 10 + k * apart_ms) for i in range(N) for k in range(len(ids))],
        "temp_c": [f"25.{i // len(ids) % 3}" for i in range(n)],
        "gyro_x [deg/s]": noise(n),
        name: ids * N,
    }


def single(**more: NDArray[np.int64]) -> Columns:
    return {
        "t_ms": [str(i * 10) for i in range(N)],
        "gyro_x [deg/s]": noise(N),
        **{name: list(map(str, values)) for name, values in more.items()},
    }


def at_place(table: Columns, name: str, place: int) -> Columns:
    others = [one for one in table if one != name]
    order = [*others[:place], name, *others[place:]]
    return {one: table[one] for one in order}


def written(path: Path, table: Columns) -> Path:
    lines = [",".join(table), *(",".join(row) for row in zip(*table.values(), strict=True)), ""]
    path.write_text("\n".join(lines), "utf-8")
    return path


def arrow(table: Columns) -> pa.Table:
    def column(cells: list[str]) -> pa.Array:
        words = any(cell[0].isalpha() for cell in cells)
        numbers = (float if any("." in cell for cell in cells) else int) if not words else str
        return pa.array([numbers(cell) for cell in cells])

    return pa.table({name: column(cells) for name, cells in table.items()})


def values_of(recording: Recording) -> NDArray[np.float64]:
    column = recording.columns[recording.index("gyro_x")]
    return column.read(0, len(column))


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("ids", IDS.values(), ids=IDS)
def test_the_column_is_found_at_every_place_and_the_advice_reads_one_sensor(
    tmp_path: Path, ids: list[str], place: int
) -> None:
    table = at_place(merged(ids), "which", place)
    path = written(tmp_path / "a.csv", table)
    with pytest.raises(InputError, match=f"{SAID}|{OF_KINDS}") as refusal:
        read(path)
    assert f"column {place + 1} (which)" in str(refusal.value) or OF_KINDS in str(refusal.value)
    assert f"--variable {ids[0]}" in str(refusal.value)
    for k, one in enumerate(ids):
        recording = read(path, variable=one)
        assert recording.rate == pytest.approx(RATE)
        np.testing.assert_array_equal(
            values_of(recording), np.array(table["gyro_x [deg/s]"][k :: len(ids)], dtype=float)
        )


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("ids", IDS.values(), ids=IDS)
def test_tables_in_memory_and_in_columns_are_asked_about_as_well(
    tmp_path: Path, ids: list[str], place: int
) -> None:
    table = arrow(at_place(merged(ids), "which", place))
    pq.write_table(table, tmp_path / "a.parquet", row_group_size=250)
    with pytest.raises(InputError, match=SAID):
        read(tmp_path / "a.parquet")
    with pytest.raises(InputError, match=SAID):
        Recording.from_samples(table)
    with pytest.raises(InputError, match=SAID) as refusal:
        Recording.from_samples(table.to_pandas())
    code = str(refusal.value).partition("in Python al.")[2]
    one = eval(code, {"Recording": Recording, "table": table.to_pandas()})
    assert one.rate == pytest.approx(RATE)
    assert one.n_samples == N


@pytest.mark.parametrize("apart_ms", [0, 1, 3])
@pytest.mark.parametrize("name", NAMES)
def test_a_column_with_the_name_of_an_identity_needs_no_equal_stamps(
    tmp_path: Path, name: str, apart_ms: int
) -> None:
    with pytest.raises(InputError, match=SAID):
        read(written(tmp_path / "a.csv", merged(["1", "2"], name, apart_ms)))


def test_lost_rows_do_not_hide_the_sensors(tmp_path: Path) -> None:
    table = merged(["1", "2", "3"])
    kept = np.random.default_rng(5).random(3 * N) > 0.04
    with pytest.raises(InputError, match=SAID):
        read(
            written(
                tmp_path / "a.csv",
                {name: [c for c, k in zip(cells, kept, strict=True) if k] for name, cells in table.items()},
            )
        )


@pytest.mark.parametrize("sensors", [["gyro"], ["gyro", "acc"], ["a", "b"]])
def test_axes_below_one_another_are_never_merged(tmp_path: Path, sensors: list[str]) -> None:
    rows = [(str(i * 10), s, axis) for i in range(N) for s in sensors for axis in "xyz"]
    table = dict(zip(("t_ms", "kind", "axis"), map(list, zip(*rows, strict=True)), strict=True))
    path = written(tmp_path / "a.csv", {**table, "value": noise(len(rows))})
    with pytest.raises(InputError, match=f"distinguishes several sensors|{OF_KINDS}"):
        read(path)
    for word in (*sensors, *"xyz"):
        try:
            recording = read(path, variable=word)
        except InputError:
            continue
        assert recording.rate == pytest.approx(RATE)


BITS = np.arange(N)
INNOCENT = {
    "status": BITS // 50 % 3,
    "toggle": BITS % 2,
    "two bits": BITS % 4,
    "four bits": BITS % 16,
    "seq": BITS % 16,
    "rare": (BITS % 97 == 0).astype(np.int64),
    "random": np.random.default_rng(6).integers(0, 3, N),
}


@pytest.mark.parametrize("door", ["text", "arrow"])
@pytest.mark.parametrize("name", INNOCENT)
def test_a_counter_or_a_status_is_no_identity(tmp_path: Path, name: str, door: str) -> None:
    table = single(**{name: INNOCENT[name]})
    recording = (
        read(written(tmp_path / "a.csv", table)) if door == "text" else Recording.from_samples(arrow(table))
    )
    assert recording.rate == pytest.approx(RATE)
    assert recording.n_samples == N


@pytest.mark.parametrize("door", ["text", "arrow"])
@pytest.mark.parametrize(
    ("name", "rows"),
    [
        (name, rows)
        for name in INNOCENT
        for rows in (2, 4, 10)
        if (name, rows)
        not in (("toggle", 2), ("two bits", 4))  # once round a stamp: so do two sensors, or four
    ],
)
def test_nor_is_it_one_under_a_coarse_clock(tmp_path: Path, name: str, rows: int, door: str) -> None:
    table = single(**{name: INNOCENT[name]})
    table["t_ms"] = [str(i // rows * rows * 10) for i in range(N)]
    recording = (
        read(written(tmp_path / "a.csv", table)) if door == "text" else Recording.from_samples(arrow(table))
    )
    assert recording.rate == pytest.approx(RATE, rel=0.02)


@pytest.mark.parametrize(
    "tags", [["host=a", "host=b"], ["bus=1,sensor=0", "bus=1,sensor=1", "bus=2,sensor=0"]]
)
def test_tags_of_the_line_protocol_tell_sensors_apart(tmp_path: Path, tags: list[str]) -> None:
    lines = [
        f"imu,{tag} gx={x} {1_700_000_000_000_000_000 + i * 10_000_000}"
        for i in range(N)
        for tag, x in zip(tags, noise(len(tags), i), strict=True)
    ]
    path = tmp_path / "a.txt"
    path.write_text("\n".join([*lines, ""]), "utf-8")
    with pytest.raises(InputError, match="tags distinguish several sensors") as refusal:
        read(path)
    assert all(f"imu,{tag}" in str(refusal.value) for tag in tags)
    path.write_text("\n".join([line for line in lines if line.startswith(f"imu,{tags[0]} ")] + [""]), "utf-8")
    assert read(path).rate == pytest.approx(RATE)


def test_damaged_words_are_refused_as_damage() -> None:
    table = arrow(merged(["left", "right"]))

    def decode(_: int, name: str) -> pa.ChunkedArray:
        if name == "which":
            raise pa.ArrowInvalid("offsets point anywhere")
        return table.column(name)

    read_words = table_of_arrow(
        table.schema, [table.num_rows], decode, form="Arrow", name="a.arrow", source={}
    ).words[0]
    with pytest.raises(FormatError, match="column which, row group 0: damaged"):
        read_words.read(0, 10)


@pytest.mark.parametrize("rate", [2, 3, 5, 8, 10, 16])
@pytest.mark.parametrize("per_second", [1_000, 1_000_000, 1_000_000_000])
def test_the_fraction_beside_whole_seconds_is_no_identity(tmp_path: Path, rate: int, per_second: int) -> None:
    start = 0.0321
    moments = start + np.arange(N) / rate
    whole = np.floor(moments)
    rows = [
        f"{1_700_000_000 + int(s)},{int((t - s) * per_second)},imu,{x}"
        for t, s, x in zip(moments, whole, noise(N), strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join([*rows, ""]), "utf-8")
    assert read(tmp_path / "a.csv").rate == pytest.approx(rate, rel=1e-3)
