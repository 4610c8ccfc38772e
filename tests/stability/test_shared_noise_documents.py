# SPDX-License-Identifier: BSD-3-Clause
"""Documents of a separation: there and back, and those of version 1."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.stability.shared_noise import Separation
from allanite.views.report import html_of, render_file
from bettered import bettered

OLD = Path(__file__).parent / "documents"


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"separation-1-{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["shared", "none", "opposite", "unlike", "late"])
def test_version_1_says_what_it_said(name: str, tmp_path: Path) -> None:
    before = old(name)
    after = Separation.from_json(before)
    assert (after.verdict.words, after.reason) == (before["verdict"], bettered(before["reason"]))
    assert after.remarks == bettered([words.replace("(p = 0)", "(p < 0.001)") for words in before["remarks"]])
    again = json.loads(json.dumps(after.to_json(), allow_nan=False))
    assert again["version"] == 2 and Separation.from_json(again).to_json() == again
    assert html_of(Separation.from_json(again)) == html_of(after)
    source = tmp_path / "separation.json"
    source.write_text(json.dumps(before))
    assert after.reason[1:] in render_file(source, tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_common_part_that_is_seen_at_no_lag_is_said_to_be_so() -> None:
    document = Separation.from_json(old("shared")).to_json()
    document["common"]["lower"] = [0.0] * len(document["tau"])
    assert "not resolved at any lag" in Separation.from_json(document).reason


def test_a_damaged_document_is_refused_with_its_place() -> None:
    document = Separation.from_json(old("none")).to_json()
    with pytest.raises(FormatError, match=r"allanite-separation\.verdict: one of 'opposite sign'"):
        Separation.from_json({**document, "verdict": "perhaps"})
