# SPDX-License-Identifier: BSD-3-Clause
"""Documents of a variation: there and back, those of version 1, and what is wrong with a damaged one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import FormatError
from allanite.noise import NoiseModel, White
from allanite.quantities.quantity import QuantityStatus
from allanite.stability.variation import Variation, VariationVerdict, examine_variation
from allanite.stability.variation.remarks import remarks
from allanite.stability.variation.verdict import ModelSource
from allanite.views.report import html_of, render_file
from bettered import bettered

OLD = Path(__file__).parent / "documents"


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"variation-1-{name}.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def changed() -> Variation:
    y = np.random.default_rng(3).standard_normal((640, 2)) * 1e-4
    y[400:, 1] *= 2.0
    record = al.Recording.from_rate(y, rate=10.0, unit="rad/s", names=["gyro_x", "gyro_y"])
    return examine_variation(record, models=NoiseModel.of(White(N=3e-5)), windows=8)


def test_a_document_comes_back_as_it_was(changed: Variation) -> None:
    document = json.loads(json.dumps(changed.to_json(), allow_nan=False))
    again = Variation.from_json(document)
    assert (document["version"], document["verdict"]) == (2, "changes")
    assert again.to_json() == document and html_of(again) == html_of(changed)
    assert again.verdict is VariationVerdict.CHANGES and again["gyro_y"].lags[0].significant.dtype == np.bool_
    assert not any(
        isinstance(v, str) and " " in v for c in document["channels"] for v in c.values()
    )  # no sentence


@pytest.mark.parametrize("name", ["changes", "silent", "drift"])
def test_version_1_says_what_it_said(name: str) -> None:
    before = old(name)
    after = Variation.from_json(before)
    assert after.verdict.words == before["verdict"]
    assert after.reason == bettered(before["reason"])
    for was, channel in zip(before["channels"], after.channels, strict=True):
        assert remarks(channel, after.false_alarm) == bettered(was["remarks"])
        for told, change in zip(was["changes"], channel.changes, strict=True):
            assert str(change) == told["says"] and change.ratio.upper == told["upper"]
            assert (change.time is None) == (told["kind"] == "drift")


def test_version_1_of_a_size_that_nothing_told_and_of_a_rough_model() -> None:
    document = old("changes")
    document["channels"][0]["changes"][0] |= {"lower": 0.0, "upper": None}
    document["channels"][0]["remarks"] = [
        "no sum of noise terms explains the whole record: the scatter of the windows rests on a rough one"
    ]
    channel = Variation.from_json(document).channels[0]
    assert channel.changes[0].ratio.status is QuantityStatus.NOT_RESOLVED
    assert channel.model_source is ModelSource.ROUGH
    assert remarks(channel, 0.05)[0] == bettered(document["channels"][0]["remarks"][0])


def test_report_reads_both_versions(changed: Variation, tmp_path: Path) -> None:
    for name, document in (("1", old("changes")), ("2", changed.to_json())):
        source = tmp_path / f"{name}.json"
        source.write_text(json.dumps(document))
        page = render_file(source, tmp_path / f"{name}.html").read_text()
        assert "The noise changes." in page and "Constancy of every lag" in page


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 3}, r"version 3 of allanite-variation; this allanite reads up to version 2"),
        ({"rate": "ten"}, r"allanite-variation\.rate: a float is expected, not 'ten'"),
        ({"channels": {}}, r"allanite-variation\.channels: a list is expected"),
        ({"channels": [{"name": "x"}]}, r"allanite-variation\.channels\[0\]\.kind is missing"),
    ],
)
def test_a_damaged_document_is_refused_with_its_place(
    changed: Variation, change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    source = tmp_path / "damaged.json"
    source.write_text(json.dumps({**changed.to_json(), **change}))
    with pytest.raises(FormatError, match=words):
        render_file(source, tmp_path / "report.html")
