# SPDX-License-Identifier: BSD-3-Clause
"""Documents of a comparison: there and back, and those of version 1."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.quantities.quantity import QuantityStatus
from allanite.stability.record_comparison.remarks import remarks
from allanite.stability.record_comparison.results import Comparison
from allanite.views.report import html_of, render_file
from bettered import bettered

OLD = Path(__file__).parent / "documents"


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"comparison-1-{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["rates", "outlier", "pair", "odd"])
def test_version_1_says_what_it_said(name: str, tmp_path: Path) -> None:
    before = old(name)
    after = Comparison.from_json(before)
    assert (after.verdict.words, after.reason) == (before["verdict"], bettered(before["reason"]))
    assert remarks(after) == bettered(before["remarks"])
    for was, channel in zip(before["channels"], after.channels, strict=True):
        for parameter, now in zip(was["parameters"], channel.parameters, strict=True):
            values = [None if v.value != v.value else v.value for v in now.records]
            assert values == [r["value"] for r in parameter["records"]]
            assert [v.resolved for v in now.records] == [r["supported"] for r in parameter["records"]]
            assert (now.population is None) == (parameter["population"] is None)
            if now.population is not None:
                assert now.population.middle.lower == parameter["population"]["lower"]
                assert now.population.spread.upper == parameter["population"]["spread_upper"]
    again = json.loads(json.dumps(after.to_json(), allow_nan=False))
    assert again["version"] == 2 and Comparison.from_json(again).to_json() == again
    assert html_of(Comparison.from_json(again)) == html_of(after)
    source = tmp_path / "comparison.json"
    source.write_text(json.dumps(before))
    assert after.reason[1:] in render_file(source, tmp_path / "report.html").read_text(encoding="utf-8")


def test_version_1_of_families_apertures_and_a_spread_without_an_end() -> None:
    document = old("outlier")
    (channel,) = document["channels"]
    channel["families"] = ["flicker", "neither", "both", "both"]
    document["remarks"] = [
        (
            "gyro: the records do not follow one family (a: flicker, b: neither, c: both, d: both); slow terms are "
            "compared as flicker"
        ),
        "gyro: the averaging time within a sample (aperture) differs, and the white noise with it",
    ]
    white = next(p for p in channel["parameters"] if p["symbol"] == "N")
    white["population"] |= {"spread_lower": 0.0, "spread_upper": None, "next_upper": None}
    after = Comparison.from_json(document)
    assert remarks(after) == bettered(document["remarks"])
    population = after["gyro"]["N"].population
    assert population is not None and population.next_sensor is None
    assert population.spread.status is QuantityStatus.NOT_RESOLVED


def test_a_damaged_document_is_refused_with_its_place() -> None:
    document = Comparison.from_json(old("pair")).to_json()
    with pytest.raises(FormatError, match=r"version 3 of allanite-comparison"):
        Comparison.from_json({**document, "version": 3})
    with pytest.raises(FormatError, match=r"allanite-comparison\.channels\[0\]\.family: one of 'flicker'"):
        Comparison.from_json({**document, "channels": [{**document["channels"][0], "family": "pink"}]})
