# SPDX-License-Identifier: BSD-3-Clause
"""Documents of bounds: there and back, and those of version 1."""

from __future__ import annotations

import json
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.fitting.overbound import Bounds
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from allanite.views.report import html_of

OLD = Path(__file__).parent / "documents"
NAMES = sorted(path.stem for path in OLD.glob("overbound-1-*.json"))


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_version_1_says_what_it_said(name: str) -> None:
    before = old(name)
    after = Bounds.from_json(before)
    page = unescape(html_of(before))
    assert after.probability == before["probability"]
    for was, channel in zip(before["channels"], after.channels, strict=True):
        assert (channel.name, channel.kind, channel.unit) == (was["name"], was["kind"], was["unit"])
        assert [m.to_json() for m in channel.fitted.families] == was["models"]
        assert channel.bound.to_json() == was["bound"]
        assert channel.inflation.verdict == was["bound"]["verdict"]
        assert channel.curve.deviation.tolist() == pytest.approx(was["curve"]["deviation"])
        facts = was["bound"]["overbound"]
        assert {t.symbol: t.factor for t in channel.terms()} == facts["factors"]
        ends = f"from {facts['shortest']:.3g} to {facts['horizon']:.4g} s"
        assert ends in channel.inflation.promise and ends.split(" to ")[0] in page


@pytest.mark.parametrize("name", NAMES)
def test_a_document_comes_back_as_it_was(name: str) -> None:
    document = document_of(old(name))
    data = json.loads(json.dumps(document.to_json(), allow_nan=False))
    assert data["version"] == 2
    assert json.loads(json.dumps(document_of(data).to_json(), allow_nan=False)) == data
    assert html_of(data) == html_of(old(name))
    assert len(sheet_of(data).rows) == len(document.result.channels) + 1


def test_what_the_terms_of_a_bound_say() -> None:
    by_symbol = {
        t.symbol: t for t in Bounds.from_json(old("overbound-1-line-and-two-markov")).channels[0].terms()
    }
    assert list(by_symbol)[:3] == ["N", "sigma", "sigma_2"]
    assert by_symbol["sigma"].fitted == pytest.approx(4e-5) and by_symbol["sigma_2"].fitted == pytest.approx(
        6e-5
    )
    assert by_symbol["K"].fitted is None and by_symbol["K"].factor is None
    assert by_symbol["sigma"].bound == pytest.approx(by_symbol["sigma"].factor * 4e-5)
    channels = [Bounds.from_json(old(name)).channels[0] for name in NAMES]
    assert any(term.needed for channel in channels for term in channel.terms())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"curve": {}}, r"allanite-overbound\.channels\[0\]\.curve\.statistic is missing"),
        ({"fitted": {"terms": [{"type": "new"}]}}, r"allanite-overbound\.channels\[0\]\.fitted: unknown noise term"),
        ({"name": 3}, r"allanite-overbound\.channels\[0\]\.name: a str is expected"),
    ],
)  # fmt: skip
def test_a_damaged_document_is_refused_with_its_place(change: dict[str, Any], words: str) -> None:
    document = Bounds.from_json(old("overbound-1-white")).to_json()
    document["channels"][0] |= change  # type: ignore[index]
    with pytest.raises(FormatError, match=words):
        Bounds.from_json(document)


def test_a_bound_without_its_promise_is_refused() -> None:
    document = old("overbound-1-white")
    del document["channels"][0]["bound"]["overbound"]
    with pytest.raises(FormatError, match="the bound of gyro states no overbound"):
        Bounds.from_json(document)
    document = old("overbound-1-white")
    del document["channels"][0]["bound"]["overbound"]["horizon"]
    with pytest.raises(FormatError, match=r"bound: .*horizon is missing"):
        Bounds.from_json(document)
