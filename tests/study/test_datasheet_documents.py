# SPDX-License-Identifier: BSD-3-Clause
"""Documents of data sheets beside studies: there and back, and those of version 1."""

from __future__ import annotations

import json
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.study.datasheet import DatasheetJudgement, StatementNote, StatementVerdict
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from allanite.views.report import html_of

OLD = Path(__file__).parent / "documents"
NAMES = sorted(path.stem for path in OLD.glob("datasheet-1-*.json"))


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_version_1_says_what_it_said(name: str) -> None:
    before = old(name)
    after = DatasheetJudgement.from_json(before)
    sheet = after.datasheet
    assert (sheet.sensor, sheet.source) == (before["sensor"], before["source"])
    assert {n: m.to_json() for n, m in sheet.models.items()} == {
        n: s["model"] for n, s in before["sections"].items()
    }
    assert (after.verdict.words, after.reason) == (before["verdict"], before["reason"])
    for was, channel in zip(before["channels"], after.channels, strict=True):
        assert (channel.name, channel.section, channel.sheet.to_json()) == (
            was["name"],
            was["section"],
            was["model"],
        )
        for one, now in zip(was["statements"], channel.statements, strict=True):
            assert now.entry.to_json() == {key: one[key] for key in now.entry.to_json()}
            assert (now.verdict or "", now.note) == (one["verdict"], one["note"])
            ends = (None, None) if one["upper"] is None else (one["lower"], one["upper"])
            shown = now.measured.to_json()
            assert (shown["value"], shown["lower"], shown["upper"]) == (one["measured"], *ends)
            assert now.ratio.to_json()["value"] == (one["ratio"][0] and pytest.approx(one["ratio"][0]))


@pytest.mark.parametrize("name", NAMES)
def test_a_document_comes_back_as_it_was(name: str) -> None:
    document = document_of(old(name))
    data = json.loads(json.dumps(document.to_json(), allow_nan=False))
    assert data["version"] == 2
    assert json.loads(json.dumps(document_of(data).to_json(), allow_nan=False)) == data
    page = unescape(html_of(data))
    assert html_of(old(name)) == html_of(data)
    assert (document.result.datasheet.sensor or document.result.datasheet.file) in page
    shown = [s.note for c in document.result.channels for s in c.statements if s.note]
    assert all(note.partition("e-")[0] in page for note in shown)
    channels = len(document.result.channels)
    assert len(sheet_of(data).rows) == (channels + 1 if channels else len(document.result.datasheet.sections))


def test_every_verdict_and_note_is_in_a_document_of_version_1() -> None:
    results = [DatasheetJudgement.from_json(old(name)) for name in NAMES]
    statements = [s for result in results for c in result.channels for s in c.statements]
    assert {type(r.verdict)(r.verdict) for r in results} == {*type(results[0].verdict)}
    assert {s.remark for s in statements} == {None, *StatementNote}
    assert {s.verdict for s in statements} == {None, *StatementVerdict}
    result = DatasheetJudgement.from_json(old("datasheet-1-no-model"))
    assert replace(result, channels=result.channels * 4).reason.endswith("gyro: bias instability and 2 more")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"remark": "fine"}, r"allanite-datasheet\.channels\[0\]\.statements\[0\]\.remark: one of"),
        ({"measured": {}}, r"allanite-datasheet\.channels\[0\]\.statements\[0\]\.measured\.value is missing"),
        (
            {"entry": None},
            r"allanite-datasheet\.channels\[0\]\.statements\[0\]\.entry: an object is expected",
        ),
    ],
)
def test_a_damaged_document_is_refused_with_its_place(change: dict[str, Any], words: str) -> None:
    document = DatasheetJudgement.from_json(old("datasheet-1-open")).to_json()
    document["channels"][0]["statements"][0] |= change  # type: ignore[index]
    with pytest.raises(FormatError, match=words):
        DatasheetJudgement.from_json(document)
