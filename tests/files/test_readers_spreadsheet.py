# SPDX-License-Identifier: BSD-3-Clause
"""Spreadsheets, written from their specifications: the rules are those of text tables."""

from __future__ import annotations

import contextlib
import datetime
import importlib.util
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import FormatError, InputError, LimitError
from allanite.files.readers import read, spreadsheet
from allanite.recording.records import Kind
from hostile_files import inline, mutations, outcomes, tally
from spreadsheet_writers import ods, xlsx

pytest.importorskip("python_calamine", reason="the extra allanite[spreadsheet] is not installed")

RNG = np.random.default_rng(8)
VALUES = RNG.normal(size=(60, 2))
HEAD = ["t (s)", "Gyro X\n(deg/s)", "Acc Z (g)"]
ROWS = [[k * 0.01, *map(float, row)] for k, row in enumerate(VALUES)]


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's function without the child: the sandbox has tests of its own, and the samples go through it."""
    monkeypatch.setattr(spreadsheet, "run", inline)


@pytest.mark.parametrize("write", [xlsx, ods])
def test_a_sheet_is_read_like_a_text_table(tmp_path: Path, write: Any) -> None:
    recording = read(write(tmp_path / "log.data", {"log": [HEAD, *ROWS]}))
    assert recording.rate == 100.0
    assert [(c.name, c.unit, c.kind) for c in recording.channels] == [
        ("Gyro_X", "deg/s", Kind.RATE),
        ("Acc_Z", "g", Kind.ACCELERATION),
    ]
    assert np.array_equal(recording.values("Gyro_X"), VALUES[:, 0])
    assert np.array_equal(recording.values("Acc_Z"), VALUES[:, 1])
    source = recording.notes["source"]
    assert (source["format"], source["sheet"]) == ("spreadsheet", "log")
    text = tmp_path / "log.csv"
    text.write_text("t (s),Gyro X (deg/s),Acc Z (g)\n" + "".join(",".join(map(repr, r)) + "\n" for r in ROWS))
    other = read(text)
    assert other.channels == recording.channels
    assert np.array_equal(other.values("Acc_Z"), recording.values("Acc_Z"))


def test_preamble_units_row_whole_numbers_and_cells_without_a_value(tmp_path: Path) -> None:
    rows: list[list[Any]] = [
        ["Device: X100", None, None],
        ["SN: 12", None, None],
        ["Fs", 50.0, None],
        [None] * 3,
    ]
    rows += [["Gyro Z", "Counts", "Remark"], ["deg/h", "LSB", None]]
    rows += [[k + 0.25, 2 * k, None] for k in range(20)]
    rows[10][0], rows[11][0], rows[12][0], rows[9][2] = None, "NaN", "#DIV/0!", "see here"
    recording = read(xlsx(tmp_path / "a.xlsx", {"data": rows}, first_row=4))
    assert recording.rate == 50.0
    assert [(c.name, c.unit) for c in recording.channels] == [("Gyro_Z", "deg/h"), ("Counts", "LSB")]
    assert recording.columns[1].dtype == np.int64
    assert np.flatnonzero(np.isnan(recording.values("Gyro_Z"))).tolist() == [4, 5, 6]
    assert (recording.notes["source"]["serial"], recording.notes["source"]["sensor"]) == ("12", "X100")


def test_dates_are_time(tmp_path: Path) -> None:
    begin = datetime.datetime(2026, 9, 1, 12, 30)
    rows = [["when", "gyro (deg/s)"]]
    rows += [[begin + datetime.timedelta(seconds=k / 4), float(k % 3)] for k in range(40)]  # type: ignore[list-item]
    for path in (xlsx(tmp_path / "a.xlsx", {"a": rows}), ods(tmp_path / "a.ods", {"a": rows})):
        recording = read(path)
        assert recording.rate == pytest.approx(4.0, rel=1e-6)
        assert recording.start == pytest.approx(1_788_265_800 * 10**9, abs=10**6)


def test_the_longest_sheet_is_read_unless_another_is_named(tmp_path: Path) -> None:
    sheets = {"Notes": [["made by", "hand"]], "Run 1": [HEAD, *ROWS[:40]], "Run 2": [HEAD, *ROWS]}
    path = xlsx(tmp_path / "a.xlsx", sheets)
    recording = read(path)
    assert recording.n_samples == 60
    source = recording.notes["source"]
    assert (
        "several sheets: Run 2 was read; choose another (Notes, Run 1) with --variable (variable= in Python)"
        in recording.notes["text"]["guesses"]
    )
    assert any(
        part.startswith("Run 1 (41 rows: t (s), Gyro X (deg/s), Acc Z (g))") for part in source["contents"]
    )
    assert read(path, variable="Run 1").n_samples == 40
    with pytest.raises(InputError, match="variable='Run 3'"):
        read(path, variable="Run 3")
    with pytest.raises(FormatError, match="no table of numbers"):
        read(path, variable="Notes")
    assert read(path, variable="Run 1", unit={"acc": "m/s²"})["Acc_Z"].unit == "m/s²"


def test_a_word_among_numbers_is_named_with_its_row(tmp_path: Path) -> None:
    rows = [HEAD, *(list(r) for r in ROWS)]
    rows[30][1] = "broken"
    with pytest.raises(FormatError, match=r"a\.xlsx, line 31, column 2 \(Gyro X\s+\(deg/s\)\): 'broken'"):
        read(xlsx(tmp_path / "a.xlsx", {"a": rows}))


def test_numbers_written_as_text_with_a_decimal_comma(tmp_path: Path) -> None:
    rows = [["t (s)", "gyro (deg/s)"], *([f"{k / 10:.1f}".replace(".", ","), f"{k},5"] for k in range(20))]
    recording = read(xlsx(tmp_path / "a.xlsx", {"a": rows}))
    assert np.array_equal(recording.values("gyro"), np.arange(20) + 0.5)
    with pytest.raises(InputError, match="delimiter"):
        read(tmp_path / "a.xlsx", delimiter=",")


def test_damaged_and_swollen_files(tmp_path: Path) -> None:
    path = xlsx(tmp_path / "a.xlsx", {"a": [HEAD, *ROWS]})
    content = path.read_bytes()
    (tmp_path / "cut.xlsx").write_bytes(content[: len(content) // 2])
    with pytest.raises(FormatError, match="damaged"):
        read(tmp_path / "cut.xlsx")
    (tmp_path / "old.xls").write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(2000))
    with pytest.raises(FormatError, match="damaged"):
        read(tmp_path / "old.xls")
    of_a_later_version = bytearray(content)
    of_a_later_version[content.rindex(b"PK\x01\x02") + 6] = 132
    (tmp_path / "later.xlsx").write_bytes(of_a_later_version)
    assert np.array_equal(read(tmp_path / "later.xlsx").values("Gyro_X"), VALUES[:, 0])  # what can be read is
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet9.xml", bytes(64 << 20))
    with pytest.raises(LimitError, match="bomb"):
        read(path)
    (tmp_path / "other.zip").write_bytes(b"PK\x03\x04" + bytes(100))
    with pytest.raises(FormatError, match="unpack it"):
        read(tmp_path / "other.zip")


def test_what_a_document_refers_to_is_not_opened(tmp_path: Path) -> None:
    """An external entity in the XML of a sheet is the classic way to a file beside it."""
    secret = tmp_path / "secret.txt"
    secret.write_text("31415.9265")
    path = xlsx(tmp_path / "a.xlsx", {"a": [HEAD, *ROWS]})
    with zipfile.ZipFile(path) as archive:
        members = {n: archive.read(n) for n in archive.namelist()}
    sheet = members["xl/worksheets/sheet1.xml"].decode()
    entity = f'<!DOCTYPE a [<!ENTITY e SYSTEM "{secret.as_uri()}">]>'
    sheet = sheet.replace("?>", f"?>{entity}", 1).replace(f"<v>{ROWS[5][1]!r}</v>", "<v>&e;</v>")
    assert "&e;" in sheet
    with zipfile.ZipFile(path, "w") as archive:
        for name, raw in {**members, "xl/worksheets/sheet1.xml": sheet.encode()}.items():
            archive.writestr(name, raw)
    with contextlib.suppress(FormatError):  # to refuse it is as well
        assert not (read(path).values("Gyro_X") == 31415.9265).any()


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = xlsx(tmp_path / "a.xlsx", {"a": [HEAD, *ROWS]})
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "allanite\[spreadsheet\]".*\.csv'):
        read(path)


def test_f4_mutations(tmp_path: Path) -> None:
    sound = xlsx(tmp_path / "sound.xlsx", {"a": [HEAD, *ROWS]})
    files = []
    for i, content in enumerate(mutations(sound.read_bytes(), 20)):
        files.append(tmp_path / f"{i}.xlsx")
        files[-1].write_bytes(content)
    found = tally(outcomes(sound, files))
    assert sum(found.values()) == 20
    assert found.get("refused", 0) > 0
