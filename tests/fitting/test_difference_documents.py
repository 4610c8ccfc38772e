# SPDX-License-Identifier: BSD-3-Clause
"""Documents of two noise models side by side: there and back, and those of version 1."""

from __future__ import annotations

import json
import math
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.fitting.model_difference import Difference
from allanite.quantities.quantity import QuantityStatus
from allanite.views.plain_page import plain_page
from allanite.views.registry import document_of
from allanite.views.report import html_of

OLD = Path(__file__).parent / "documents"
NAMES = sorted(path.stem for path in OLD.glob("difference-1-*.json"))


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_version_1_says_what_it_said(name: str) -> None:
    before = old(name)
    after = Difference.from_json(before)
    assert [*after.names] == before["names"] and [*after.unpaired] == before["unpaired"]
    assert after.rest == before["rest"]
    for was, channel in zip(before["channels"], after.channels, strict=True):
        assert (channel.name, [*channel.names]) == (was["name"], was["names"])
        assert channel.first.to_json() == was["first"] and channel.second.to_json() == was["second"]
        for line, pair in zip(was["drifts"], channel.drifts, strict=True):
            assert (pair.seconds, pair.first, pair.second) == (line["seconds"], line["first"], line["second"])
            ratio = pair.ratio.to_json()
            assert [ratio[key] for key in ("value", "lower", "upper")] == [
                line[key] for key in ("ratio", "lower", "upper")
            ]
            assert pair.ratio.resolved is (line["lower"] is not None)
            assert (pair.ratio.status is QuantityStatus.GIVEN) is not any(was["intervals"])


@pytest.mark.parametrize("name", NAMES)
def test_a_document_comes_back_as_it_was(name: str) -> None:
    document = document_of(old(name))
    data = json.loads(json.dumps(document.to_json(), allow_nan=False))
    assert data["version"] == 2
    assert json.loads(json.dumps(document_of(data).to_json(), allow_nan=False)) == data
    assert plain_page(data) == plain_page(old(name))
    page = unescape(html_of(data))
    assert all(f"{pair.seconds:g} s" in page for pair in document.result.channels[0].drifts[:2])


def test_every_kind_of_ratio_is_in_a_document_of_version_1() -> None:
    ratios = [p.ratio for n in NAMES for c in Difference.from_json(old(n)).channels for p in c.drifts]
    assert {r.status for r in ratios} == {*QuantityStatus} - {QuantityStatus.UPPER_LIMIT}
    assert any(math.isnan(r.value) for r in ratios), "over a model without noise there is none"
    pages = " ".join(unescape(html_of(old(name))) for name in NAMES)
    assert (
        "[not resolved]" in pages and "Only in one of the two" in pages and "the same time at rest" in pages
    )


def test_a_damaged_document_is_refused_with_its_place() -> None:
    document = Difference.from_json(old("difference-1-words")).to_json()
    document["channels"][0]["drifts"][1]["ratio"] = 2.0  # type: ignore[index]
    words = r"allanite-difference\.channels\[0\]\.drifts\[1\]\.ratio: an object is expected"
    with pytest.raises(FormatError, match=words):
        Difference.from_json(document)
