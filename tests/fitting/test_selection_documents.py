# SPDX-License-Identifier: BSD-3-Clause
"""Documents of a selection: there and back, and those of version 1."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.fitting.selection import TermSelection
from allanite.views.report import html_of, render_file

OLD = Path(__file__).parent / "documents"


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"selection-1-{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["clear", "open", "markov", "wandering", "unexplained", "lines"])
def test_version_1_says_what_it_said(name: str, tmp_path: Path) -> None:
    before = old(name)
    after = TermSelection.from_json(before)
    assert after.verdict.words == before["verdict"]
    assert after.reason == before["reason"].replace("quantisation", "quantization")
    for was, channel in zip(before["channels"], after.channels, strict=True):
        assert channel.verdict == was["verdict"].replace("quantisation", "quantization")
        assert (channel.sure, channel.explained) == (was["sure"], was["explained"])
        assert channel.term_weights == pytest.approx(was["presence"], abs=2e-3)
        assert [line.kept for line in channel.lines] == [line["kept"] for line in was["lines"]]
    again = json.loads(json.dumps(after.to_json(), allow_nan=False))
    assert again["version"] == 2 and TermSelection.from_json(again).to_json() == again
    source = tmp_path / "selection.json"
    source.write_text(json.dumps(before))
    page = render_file(source, tmp_path / "report.html").read_text(encoding="utf-8")
    assert after.channels[0].best.words in page
    assert html_of(TermSelection.from_json(again)) == html_of(after)


def test_version_1_of_lines_that_stay_in_the_record() -> None:
    document = old("open")
    remarks = [
        "the line at 1.705 Hz is no sinusoid and stays in the record: it drifts",
        "the line at 0.02 Hz has too few periods to be told from slow noise and stays in the record",
    ]
    document["channels"][0]["remarks"] = remarks
    del document["channels"][0]["slow"]  # of the first documents
    (channel,) = TermSelection.from_json(document).channels
    assert [line.words for line in channel.left_in] == [
        "the line at 1.705 Hz stays in the record: it drifts",
        "the line at 0.02 Hz stays in the record: it has too few periods to be told from slow noise",
    ]
    assert channel.slow == {}
    page = html_of(document)
    assert "1.705 Hz stays in the record" in page and "too few periods" in page


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"candidates": []}, r"allanite-selection\.channels\[0\]: gyro has no set of terms"),
        ({"samples": "many"}, r"allanite-selection\.channels\[0\]\.samples: a int is expected"),
    ],
)
def test_a_damaged_document_is_refused_with_its_place(change: dict[str, Any], words: str) -> None:
    document = TermSelection.from_json(old("clear")).to_json()
    document["channels"][0] |= {"name": "gyro", **change}  # type: ignore[index]
    with pytest.raises(FormatError, match=words):
        TermSelection.from_json(document)
