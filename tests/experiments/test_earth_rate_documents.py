# SPDX-License-Identifier: BSD-3-Clause
"""Documents of an Earth rate: there and back, those of version 1, and what is wrong with a damaged one."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from allanite.experiments.earth_rate import EarthRateEstimate
from allanite.experiments.earth_rate.verdict import EarthRateVerdict, RateRemark
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.views.blocks import figures_of
from allanite.views.registry import document_of
from allanite.views.report import html_of, page_of

OLD = Path(__file__).parent / "documents"
NAMES = sorted(path.stem.removeprefix("earth-rate-1-") for path in OLD.glob("earth-rate-1-*.json"))


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"earth-rate-1-{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_version_1_has_the_same_numbers(name: str) -> None:
    before = old(name)
    after = EarthRateEstimate.from_json(before)
    assert after.dead_times.tolist() == before["dead_times"] and after.dead_times.shape[1:] == (3,)
    assert [None if math.isnan(v) else v for v in (after.rate, *after.interval)] == [
        before["rate"],
        *before["interval"],
    ]


@pytest.mark.parametrize("name", ["resolved", "still", "over", "settling", "command"])
def test_what_version_1_stated_is_still_there(name: str) -> None:
    before = old(name)
    now = EarthRateEstimate.from_json(before).to_json()
    gone = {
        "reason",
        "advice",
        "rate",
        "interval",
        "provenance",
        "recording",
        "overview",
        "findings",
        "model_name",
    }
    changed = {"version", "checks", "component", "g_sensitivity"}
    assert {key: now[key] for key in before if key not in gone | changed} == {
        key: value for key, value in before.items() if key not in gone | changed
    }
    for key in ("component", "g_sensitivity"):
        was, is_ = before[key], now[key]
        assert (was is None) == (is_ is None)
        for end, position in (("lower", 0), ("upper", 1)):
            if was is not None and was["interval"][position] is not None:
                assert is_[end] == pytest.approx(was["interval"][position], rel=1e-12)


def test_remarks_are_codes_whose_values_are_there() -> None:
    upright = EarthRateEstimate.from_json(old("upright"))
    assert upright.remarks == (RateRemark.STATE_FIRST,)
    assert upright.rate_if_up is not None
    assert upright.rate_if_up == pytest.approx(EARTH_RATE, rel=1e-3)
    over = EarthRateEstimate.from_json(old("over"))
    assert over.remarks == (RateRemark.TURNED_OVER,)
    assert over.turned_over is not None
    assert (over.turned_over.channel, over.turned_over.means) == ("acc_x", (9.9, -9.7))
    settling = EarthRateEstimate.from_json(old("settling"))
    assert settling.remarks == (RateRemark.SETTLING,) and settling.settling is not None
    assert settling.settling.rate / DEG_H == pytest.approx(13.71)
    families = EarthRateEstimate.from_json(old("families"))
    assert families.remarks == (RateRemark.UNDECIDED,) and families.undecided is not None
    assert (families.undecided.family, families.undecided.other) == ("flicker", "gauss-markov")
    still = EarthRateEstimate.from_json(old("still")).to_json()
    assert still["remarks"] == ["turn the sensor", "state the turns"]


@pytest.mark.parametrize("name", NAMES)
def test_a_rate_that_is_not_seen_is_no_resolved_quantity(name: str) -> None:
    estimate = EarthRateEstimate.from_json(old(name))
    seen = estimate.verdict not in (EarthRateVerdict.NOT_RESOLVED, EarthRateVerdict.NOT_SEPARABLE)
    assert estimate.rotation.resolved is seen and estimate.component.resolved is seen


def test_what_is_fitted_beside_the_rate_has_its_unit() -> None:
    estimate = EarthRateEstimate.from_json(old("fitted"))
    page = html_of(estimate)
    value = estimate.nuisances["temperature"][0] / DEG_H
    assert re.search(rf"temperature, {value:.0f}(\.\d+)? ± [\d.]+ deg/h/°C \(1 sd\)", page.replace("−", "-"))
    assert re.search(r"warm-up [\d.]+ s, -?[\d.]+ ± [\d.]+ deg/h \(1 sd\)", page.replace("−", "-"))


def test_a_document_of_a_command_keeps_its_record_and_its_origin() -> None:
    """Of version 1, and as it is written again: the picture of the record, the file, the command, what was found."""
    before = old("command")
    page = html_of(before)
    again = json.loads(json.dumps(document_of(before).to_json(), allow_nan=False))
    assert again["overview"] == before["overview"] and again["findings"] == before["findings"]
    assert 'id="record-figure"' in page and html_of(again) == page
    for words in (
        "allanite earth-rate take.parquet --latitude 48.1 --first up",
        before["provenance"]["sha256"],
    ):
        assert words in page
    figures = {s.id: [*figures_of(s.blocks)] for s in page_of(before).sections}
    assert [f.id for f in figures["pictures"]][:2] == ["running", "dwells"]
    assert len(figures["record"]) == 1
