# SPDX-License-Identifier: BSD-3-Clause
"""Documents of the environment: there and back, and those of version 1."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from allanite.errors import FormatError
from allanite.stability.environment.results import Environment
from allanite.views.report import html_of, render_file
from bettered import bettered

OLD = Path(__file__).parent / "documents"
NAMES = ("modelled", "constant", "lag", "hysteresis", "straight", "one-way", "nothing", "left-in", "cut")


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"environment-1-{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_version_1_says_what_it_said(name: str, tmp_path: Path) -> None:
    before = old(name)
    after = Environment.from_json(before)
    for was, channel in zip(bettered(before["channels"]), after.channels, strict=True):
        assert (channel.verdict.words, channel.reason) == (was["verdict"], was["reason"])
        assert list(channel.advice) == was["advice"]
        assert [c.note for c in channel.coefficients] == [c["note"] for c in was["coefficients"]]
        assert channel.warm_up.says == was["warm_up"]["says"]
        assert (channel.lag is None) == (was["lag"] is None)
        if channel.lag is not None and channel.hysteresis is not None:
            assert channel.lag.says == was["lag"]["says"]
            assert channel.hysteresis.status.words == was["hysteresis"]["says"]
    again = json.loads(json.dumps(after.to_json(), allow_nan=False))
    assert again["version"] == 2 and Environment.from_json(again).to_json() == again
    source = tmp_path / "environment.json"
    source.write_text(json.dumps(before))
    page = render_file(source, tmp_path / "report.html").read_text(encoding="utf-8")
    assert after.channels[0].reason in page and "gyro.csv" in page
    assert html_of(Environment.from_json(again)) == html_of(after)


def test_advice_of_a_thermometer_and_of_a_coefficient_that_goes_with_time() -> None:
    before = old("nothing")
    (channel,) = before["channels"]
    channel |= {"attenuation": 0.05}
    channel["thermometer"]["missing"] = 0.021
    note = "without a drift of the sensor itself it would be resolved: the temperature went with time"
    channel["coefficients"][0] |= {"status": "not separable", "note": note}
    channel["warm_up"] |= {"action": "not looked for", "says": "no warm-up was looked for"}
    (after,) = Environment.from_json(before).channels
    assert after.reason.endswith(f"with a drift of the sensor in the fit; {bettered(note)}")
    assert any("about 5% too small" in words for words in after.advice)
    assert any("missing in 2.1% of the record" in words for words in after.advice)
    assert after.warm_up.says == "warm-up was not tested"


def test_a_damaged_document_is_refused_with_its_place() -> None:
    document = Environment.from_json(old("lag")).to_json()
    document["channels"][0]["lag"]["status"] = "late"
    with pytest.raises(
        FormatError, match=r"allanite-environment\.channels\[0\]\.lag\.status: one of 'resolved'"
    ):
        Environment.from_json(document)
