# SPDX-License-Identifier: BSD-3-Clause
"""The table of a fleet on disk: a folder of files, of which a run writes those whose logs changed."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from allanite.commands.fleet import partitions
from allanite.commands.fleet.folder import FleetFolder
from allanite.commands.fleet.labels import LogLabels
from allanite.stability.fleet.rows import read_table
from allanite.stability.fleet.table_files import table_files, table_sha256

LOGS = [f"L{k % 3}/u{k:02d}_{k}.csv" for k in range(24)]
PATTERN = "{lot}/{unit}_{serial}.csv"


@pytest.fixture(autouse=True)
def _few_logs_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(partitions, "_LOGS", 3)
    monkeypatch.setattr(partitions, "_ROWS", 7)


def rows_of(log: str, channels: str = "xy") -> list[dict[str, object]]:
    facts = {"log": log, "sha256": "0" * 64, "status": "resolved", "term": "N", "_stamp": "1 1", "_key": "k"}
    return [
        facts | {"channel": c, "profile": [float(i) for i in range(9)], "findings": ["gap"]} for c in channels
    ]


def ran(folder: Path, logs: list[str], labels: LogLabels | None = None, channels: str = "xy") -> Path:
    """A run that does these logs."""
    fleet = FleetFolder(folder)
    with fleet.locked():
        for log in logs:
            fleet.commit(rows_of(log, channels))
        fleet.compact(labels or LogLabels(PATTERN))
    return fleet.table


def written(table: Path) -> dict[str, int]:
    return {file.name: file.stat().st_ino for file in table_files(table)}


def test_a_log_is_in_one_file_and_rows_are_in_order(tmp_path: Path) -> None:
    table = ran(tmp_path, LOGS[::-1])
    assert [file.name for file in table_files(table)] == [f"{i:03d}-of-008.parquet" for i in range(8)]
    homes = [{*pq.read_table(file)["log"].to_pylist()} for file in table_files(table)]
    assert sum(map(len, homes)) == len(LOGS) == len(set.union(*homes))
    for file in table_files(table):
        keys = list(zip(*(pq.read_table(file)[name].to_pylist() for name in ("log", "channel")), strict=True))
        assert keys == sorted(keys)
    assert [p.name for p in (tmp_path / ".fleet").iterdir() if p.is_dir()] == ["parts"]


def test_only_files_whose_logs_changed_are_written(tmp_path: Path) -> None:
    table = ran(tmp_path, LOGS)
    before, digest = written(table), table_sha256(tmp_path)
    home = next(f.name for f in table_files(table) if LOGS[5] in pq.read_table(f)["log"].to_pylist())
    ran(tmp_path, [])
    assert written(table) == before and table_sha256(table) == digest
    ran(tmp_path, [LOGS[5]], channels="z")
    assert {name for name, inode in written(table).items() if before[name] != inode} == {home}
    assert read_table(table, filters=[("log", "=", LOGS[5])])["channel"].to_pylist() == ["z"]
    assert len(read_table(table)) == 2 * len(LOGS) - 1 and table_sha256(table) != digest


@pytest.mark.long
def test_a_fleet_that_grows_is_that_of_one_run(tmp_path: Path) -> None:
    for end in (1, 2, 5, 13, 24):
        ran(tmp_path / "grown", LOGS[end // 2 : end])
        ran(tmp_path / "grown", LOGS[:end])
    grown, whole = (read_table(place) for place in (tmp_path / "grown", ran(tmp_path / "whole", LOGS)))
    assert grown.equals(whole)


def test_labels_that_change_are_written_to_all_files(tmp_path: Path) -> None:
    table = ran(tmp_path, LOGS)
    assert str(read_table(table)["serial"].type) == "string"
    sheet = tmp_path / "units.csv"
    sheet.write_text("unit,hours\nu01_1,5\n")
    ran(tmp_path, [], LogLabels(metadata=str(sheet)))
    assert {str(pq.read_schema(file).field("hours").type) for file in table_files(table)} == {"double"}
    assert read_table(table, filters=[("log", "=", LOGS[1])])["hours"].to_pylist() == [5.0, 5.0]
    sheet.write_text("unit,hours\nu01_1,five\n")
    ran(tmp_path, [], LogLabels(metadata=str(sheet)))
    assert {str(pq.read_schema(file).field("hours").type) for file in table_files(table)} == {"string"}
    assert "serial" not in read_table(table).column_names


def test_a_table_in_one_file_becomes_a_folder(tmp_path: Path) -> None:
    """As allanite wrote it before."""
    table = ran(tmp_path, LOGS[:20])
    whole = read_table(table)
    for file in table_files(table):
        file.unlink()
    table.rmdir()
    pq.write_table(whole.sort_by("log"), table, row_group_size=11)
    assert read_table(tmp_path).num_rows == 40 and len(table_sha256(tmp_path) or "") == 64
    ran(tmp_path, LOGS[18:], channels="z")
    assert table.is_dir()
    ran(tmp_path / "anew", LOGS[:18])
    ran(tmp_path / "anew", LOGS[18:], channels="z")
    assert read_table(table).equals(read_table(tmp_path / "anew"))


def test_a_table_that_was_about_to_be_replaced_is_there_again(tmp_path: Path) -> None:
    """A loss of power between the two names."""
    table = ran(tmp_path, LOGS)
    whole = read_table(table)
    table.rename(tmp_path / ".fleet" / "replaced")
    (tmp_path / ".fleet" / "table").mkdir()
    (tmp_path / ".fleet" / "table" / "000-of-001.parquet").write_bytes(b"half")
    with FleetFolder(tmp_path).locked():
        assert read_table(table).equals(whole)
    assert [p.name for p in (tmp_path / ".fleet").iterdir() if p.is_dir()] == ["parts"]


def test_logs_that_failed_and_are_gone_leave_the_table(tmp_path: Path) -> None:
    table = ran(tmp_path, LOGS)
    failed = {"log": "gone.csv", "status": "error", "error": "FormatError: empty", "_stamp": "1", "_key": "k"}
    fleet = FleetFolder(tmp_path)
    with fleet.locked():
        fleet.commit([failed])
        fleet.compact(LogLabels(PATTERN))
        assert read_table(table, filters=[("log", "=", "gone.csv")])["error"].to_pylist() == [failed["error"]]
    again = FleetFolder(tmp_path)
    with again.locked():
        again.forget_failed(LOGS)
        again.compact(LogLabels(PATTERN))
    assert "gone.csv" not in read_table(table)["log"].to_pylist() and len(read_table(table)) == 2 * len(LOGS)


def test_no_table_has_no_digest(tmp_path: Path) -> None:
    assert table_files(tmp_path / "none") == [] and table_sha256(tmp_path / "none") is None
