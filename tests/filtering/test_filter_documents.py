# SPDX-License-Identifier: BSD-3-Clause
"""Documents of filtered channels: there and back, and those of version 1."""

from __future__ import annotations

import json
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.filtering.kalman import FilterEstimate, FilterRemark, FilterVerdict
from allanite.filtering.kalman.consistency import WhitenessCause
from allanite.views.plain_page import plain_page
from allanite.views.registry import document_of
from allanite.views.report import html_of
from bettered import bettered

OLD = Path(__file__).parent / "documents"
NAMES = sorted(path.stem for path in OLD.glob("filtered-1-*.json"))


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_version_1_says_what_it_said(name: str) -> None:
    before = old(name)
    after = document_of(before).result
    assert isinstance(after, FilterEstimate)
    assert list(after.notes) == bettered(before["notes"])
    assert after.consistency.consistent is before["consistency"]["consistent"]
    said = before["verdict"].removeprefix("consistent").lstrip("; ").removeprefix("not tested: ")
    assert after.reason == bettered(
        said or "the innovations have the size and the whiteness that the noise model says"
    )
    numbers = ("rate", "samples", "states", "smoothed", "level", "mean_measured", "mean_corrected")
    plain = after.to_json()
    assert {n: plain[n] for n in numbers} == {n: before[n] for n in numbers}
    assert plain["terms"] == before["terms"] and after.model.to_json() == before["model"]
    assert (after.measured is None) is ("measured" not in before["overview"])
    assert plain["drift"] == before["overview"]["drift"]


@pytest.mark.parametrize("name", NAMES)
def test_a_document_comes_back_as_it_was(name: str) -> None:
    document = document_of(old(name))
    data = json.loads(json.dumps(document.to_json(), allow_nan=False))
    assert data["version"] == 2
    assert json.loads(json.dumps(document_of(data).to_json(), allow_nan=False)) == data
    assert plain_page(data) == plain_page(old(name))


def test_a_report_shows_a_document_of_a_command_with_its_origin() -> None:
    document = old("filtered-1-command-consistent")
    page, made = unescape(html_of(document)), document["provenance"]
    assert made["command"] in page and made["sha256"] in page and "given in words" in page


def test_every_verdict_remark_and_cause_is_in_a_document_of_version_1() -> None:
    results = [FilterEstimate.from_json(old(name)) for name in NAMES]
    assert {r.verdict for r in results} == {*FilterVerdict}
    assert {code for r in results for code in r.conditions.remarks} == {*FilterRemark}
    assert {r.consistency.cause for r in results} == {None, *WhitenessCause}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 3}, r"version 3 of allanite-filtered; this allanite reads up to version 2"),
        ({"conditions": {}}, r"allanite-filtered\.conditions\.drifting is missing"),
        ({"drift": [1]}, r"allanite-filtered\.drift: an object is expected"),
    ],
)
def test_a_damaged_document_is_refused_with_its_place(change: dict[str, Any], words: str) -> None:
    document = FilterEstimate.from_json(old("filtered-1-markov")).to_json()
    with pytest.raises(FormatError, match=words):
        FilterEstimate.from_json({**document, **change})
