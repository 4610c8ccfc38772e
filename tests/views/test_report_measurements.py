# SPDX-License-Identifier: BSD-3-Clause
"""Reports of measurements: what they say, that they are safe and whole, and that a browser shows them."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.experiments.earth_rate import SetupUncertainty, measure_earth_rate
from allanite.experiments.north import find_north
from allanite.experiments.planning import plan
from allanite.experiments.reference_aided import reference_aided
from allanite.experiments.reversals import Position, Reversals
from allanite.filtering.kalman import filter_recording
from allanite.filtering.simulation import Motion, simulate
from allanite.views.blocks import Section, Text, page_of, table
from allanite.views.figures.records import overview
from allanite.views.report import html_of, render_file
from allanite_seed_paper import twin as seed_paper
from pages import Balance, document_of, text_of
from real_browser import opened_browser

FACTS = {"rate": 32.0, "samples": 23040, "duration": 720.0, "channels": [], "history": []}
NASTY = "</script><img src=x onerror=alert(1)>{{ 7*7 }}\"'&"


def assert_whole(page: str) -> None:
    parser = Balance()
    parser.feed(document_of(page))
    assert not parser.wrong
    assert not parser.open
    assert len(set(parser.ids)) == len(parser.ids)
    places = set(re.findall(r'href="#([^"]+)"', document_of(page)))
    assert places <= set(parser.ids)
    assert "default-src 'none'" in page
    figures = re.search(r'<script type="application/json" id="figure-data">(.*?)</script>', page, re.S)
    assert figures is not None
    drawn = json.loads(figures[1])
    assert set(drawn) == set(re.findall(r'class="live" id="([^"]+)"', page))
    assert page.count('class="still"') == len(drawn)


@pytest.fixture(scope="module")
def take() -> al.Recording:
    return seed_paper.take(2, seed=1)


@pytest.fixture(scope="module")
def measured(take: al.Recording) -> dict[str, Any]:
    stated = SetupUncertainty(scale=1e-3, heading=math.radians(3.0))
    found = measure_earth_rate(take, latitude=seed_paper.LATITUDE, model=seed_paper.sensor(), stated=stated)
    return found.to_json()


def test_the_report_of_an_earth_rate(measured: dict[str, Any]) -> None:
    page = html_of(measured)
    assert_whole(page)
    text = text_of(page)
    assert text.index("Resolved.") < text.index("Pairs of dwells") < text.index("Scatter of the dwells")
    value = f"{math.degrees(measured['rotation']['value']) * 3600:.1f}"
    assert f"{value} deg/h" in text
    for name in (
        "Size of the noise",
        "Warm-up",
        "Settling",
        "scale factor",
        "15.041",
        "Dwells used 24",
        "−23.31°",
    ):
        assert name in text
    for figure in ("running", "dwells", "residuals", "estimators"):
        assert f'class="live" id="{figure}"' in page
    assert "Birge" in text
    assert text.count("passed") == len(measured["checks"])


def test_with_its_record_every_place_on_the_page_has_a_name_of_its_own(
    take: al.Recording, measured: dict[str, Any]
) -> None:
    page = html_of({**measured, "overview": overview(take, "gyro")})
    assert_whole(page)
    assert 'id="record-figure"' in page


def test_north_without_anything_that_grew_has_a_page() -> None:
    still = simulate(seed_paper.sensor(), rate=8.0, duration=120.0, seed=1)
    stood = (
        Position(start=0, stop=480, heading=math.pi / 2, sign=0),
        Position(start=480, stop=960, heading=-math.pi / 2, sign=0),
    )
    cut = Reversals.cut(rate=8.0, n_samples=960, turns=(), positions=stood, source="file", first="unknown")
    page = html_of(find_north(still, model=seed_paper.sensor(), latitude=seed_paper.LATITUDE, positions=cut))
    assert_whole(page)


def test_a_check_that_fails_stands_first_with_its_meaning(measured: dict[str, Any]) -> None:
    checks = [dict(c) for c in measured["checks"]]
    checks[-1] |= {"passed": False, "at": 77.0}
    text = text_of(html_of({**measured, "verdict": "inconsistent", "checks": checks}))
    says = "At 77 s the order of the two directions changes: a turn was missed or counted twice; correct it with a file"
    assert text.index(f"Order of the turns {says} of turns. not passed") < text.index("Size of the noise")
    assert f"Inconsistent. The residuals contradict the noise model: {says[:1].lower()}{says[1:]}" in text


def test_without_reversals_the_report_says_so_and_draws_no_rate() -> None:
    still = simulate(seed_paper.sensor(), rate=8.0, duration=600.0, seed=1)
    found = measure_earth_rate(still, latitude=seed_paper.LATITUDE, model=seed_paper.sensor())
    page = html_of(found)
    assert_whole(page)
    assert "Not separable." in text_of(page)
    assert "Bias and Earth together" in text_of(page)
    assert 'id="running"' not in page
    assert "NaN" not in document_of(page)


def test_the_report_of_a_filter() -> None:
    still = simulate(seed_paper.sensor(), rate=8.0, duration=900.0, seed=1)
    found = filter_recording(still, seed_paper.sensor())
    page = html_of(found)
    assert_whole(page)
    text = text_of(page)
    assert "Consistent." in text
    for words in ("size of the innovations (NIS)", "whiteness", "Level under the drift", "Ljung"):
        assert words in text
    assert {"series", "drift", "whiteness"} <= set(re.findall(r'class="live" id="([^"]+)"', page))
    wrong = html_of(filter_recording(still, seed_paper.sensor() + seed_paper.sensor()))
    assert "The model does not hold." in text_of(wrong)


def test_the_report_of_the_filter_that_is_told_the_rate() -> None:
    still = simulate(seed_paper.sensor(), rate=8.0, duration=900.0, seed=1)
    page = html_of(reference_aided(still, seed_paper.sensor(), reference=7e-5))
    assert_whole(page)
    text = text_of(page)
    assert text.index("This is not a measurement") < text.index("Unsigned: ") < text.index("Demodulated: ")
    assert "unsigned 14.44" in text
    assert "100 %" in text


def test_the_report_of_a_plan() -> None:
    made = plan(
        seed_paper.sensor(), latitude=seed_paper.LATITUDE, dwells=[20.0, 30.0], durations=[3600.0, 7200.0]
    )
    page = html_of(made)
    assert_whole(page)
    text = text_of(page)
    assert made.says in text
    assert "3 % after" in text
    assert document_of(page).count('class="value best"') == 2
    never = plan(
        seed_paper.sensor(), latitude=seed_paper.LATITUDE, goal=1e-6, stated=SetupUncertainty(scale=0.01),
        dwells=[30.0], durations=[3600.0],
    )  # fmt: skip
    assert "not reached" in text_of(html_of(never))


def test_the_report_of_north() -> None:
    headings = [math.radians(a) for a in (10.0, 100.0, 190.0, 280.0)]
    record = simulate(
        seed_paper.sensor(), rate=8.0, duration=1200.0, seed=1, latitude=seed_paper.LATITUDE,
        motion=Motion.positions(headings, dwell=100.0, turn_time=(1.0, 1.0)),
    )  # fmt: skip
    positions = tuple(
        Position(
            start=800 * i + 10 * (i > 0), stop=800 * (i + 1), heading=math.radians(90.0 * i % 360), sign=0
        )
        for i in range(12)
    )
    stood = Reversals.cut(
        rate=8.0, n_samples=9600, turns=(), positions=positions, source="file", first="unknown"
    )
    found = find_north(record, model=seed_paper.sensor(), latitude=seed_paper.LATITUDE, positions=stood)
    page = html_of(found)
    assert_whole(page)
    text = text_of(page)
    assert "azimuth of the mark" in text
    assert "95 % interval:" in text
    assert "horizontal rate" in text
    assert "Bias of gyro" in text


def test_a_list_of_turns_that_the_signal_contradicts_leads_the_report(measured: dict[str, Any]) -> None:
    found = {
        "code": "turn_not_listed", "severity": "warning", "channel": "gyro", "message": "gyro: 18 turns in the signal",
        "advice": "compare", "risk": "", "count": 18, "accepted": False, "places": [],
    }  # fmt: skip
    said = text_of(html_of({**measured, "findings": [found], "recording": FACTS}))
    first = said.index("Signal and list disagree. 18 turns in the signal.")
    assert first < said.index("95 % interval")
    assert "contradict each other" not in text_of(html_of(measured))


def test_steps_of_the_record_are_a_list_with_the_names_of_its_channels(measured: dict[str, Any]) -> None:
    noise = {"kind": "rate", "terms": [{"type": "white", "N": 2.1e-4}]}
    history = [
        {"step": "simulate", "seed": 3, "models": {"gyro_x": noise}, "turns": list(range(40))},
        {"step": "exclude", "terms": "none", "models": {"terms": 5}},
    ]
    page = html_of({**measured, "recording": {**FACTS, "history": history}, "findings": []})
    for line in ("seed: 3", "models: gyro_x N 0.722 deg/√h", "turns: 40 entries", "models: terms 5"):
        assert f"<li>{line} </li>" in page


def test_objects_and_their_documents_give_the_same_page(take: al.Recording, measured: dict[str, Any]) -> None:
    stated = SetupUncertainty(scale=1e-3, heading=math.radians(3.0))
    found = measure_earth_rate(take, latitude=seed_paper.LATITUDE, model=seed_paper.sensor(), stated=stated)
    assert html_of(found) == html_of(json.loads(json.dumps(measured)))


def test_what_has_no_report_is_named() -> None:
    with pytest.raises(InputError, match="int"):
        html_of(3)
    with pytest.raises(InputError, match="allanite-poem"):
        html_of({"format": "allanite-poem"})


def test_a_document_of_a_later_version_is_not_drawn(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text(
        '{"format": "allanite-position-plan", "version": 3}', encoding="utf-8"
    )
    with pytest.raises(
        FormatError, match="version 3 of allanite-position-plan; this allanite reads up to version 2"
    ):
        render_file(tmp_path / "plan.json", tmp_path / "plan.html")
    assert not (tmp_path / "plan.html").exists()


def test_what_stands_in_a_log_cannot_act(measured: dict[str, Any]) -> None:
    nasty = json.loads(json.dumps(measured))
    nasty |= {"source": NASTY, "channel": NASTY, "model_name": NASTY, "verdict": "inconsistent"}
    nasty |= {
        "nuisances": {NASTY: [1e-6, 1e-7]},
        "undecided": {"family": NASTY, "other": NASTY, "narrower": 0.1},
    }
    made = ("allanite", "created", "source", "sha256", "command", "python", "numpy")
    nasty["provenance"] = dict.fromkeys(made, NASTY)
    nasty["recording"] = {**FACTS, "history": [{"step": NASTY, NASTY: [NASTY]}]}
    nasty["checks"][1] |= {"kind": "temperature", "channel": NASTY, "passed": False}
    finding = dict.fromkeys(("code", "message", "advice", "risk", "channel"), NASTY)
    nasty["findings"] = [{**finding, "severity": "fatal", "count": 1, "places": [[0, 9]], "accepted": False}]
    page = html_of(nasty)
    assert "<img src=x" not in page
    assert page.count("</script>") == 2
    assert "49" not in re.findall(r"onerror=alert\(1\)&gt;(.{4})", page)
    assert_whole(page)


def test_al_render_writes_it(measured: dict[str, Any], tmp_path: Path) -> None:
    path = al.render(measured, tmp_path / "report.html")
    assert path.read_text(encoding="utf-8").startswith("<!doctype html>")


# -- in a browser -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with opened_browser() as browser:
        yield browser


def test_a_browser_draws_it_wide_and_narrow(browser: Any, measured: dict[str, Any], tmp_path: Path) -> None:
    path = al.render(measured, tmp_path / "report.html")
    view = browser.new_page(viewport={"width": 1180, "height": 900})
    troubles: list[str] = []
    view.on("console", lambda m: troubles.append(m.text))
    view.on("pageerror", lambda e: troubles.append(str(e)))
    view.on("request", lambda r: r.url.startswith(("file:", "data:", "blob:")) or troubles.append(r.url))
    view.goto(path.as_uri())
    places = view.locator(".live")
    for i in range(places.count()):
        places.nth(i).scroll_into_view_if_needed()
        places.nth(i).locator(".chart-picture").first.wait_for(timeout=10_000)
    view.locator("#theme").click()
    assert not troubles
    view.set_viewport_size({"width": 390, "height": 800})
    view.wait_for_timeout(300)
    assert view.evaluate("document.documentElement.scrollWidth") <= 390
    view.close()


def test_what_nobody_scrolled_to_is_drawn_before_it_is_printed(
    browser: Any, measured: dict[str, Any], tmp_path: Path
) -> None:
    path = al.render(measured, tmp_path / "report.html")
    view = browser.new_page(viewport={"width": 1180, "height": 400})
    view.goto(path.as_uri())
    count = "document.querySelectorAll('.live[data-drawn]').length"
    places = view.locator(".live").count()
    view.wait_for_timeout(300)  # for those that are in view
    assert view.evaluate(count) < places
    view.emulate_media(media="screen")
    view.pdf(path=tmp_path / "screen.pdf", format="A4")
    assert view.evaluate(count) == places
    view.close()


@pytest.mark.long
def test_no_printed_page_ends_with_the_head_of_a_table(browser: Any, tmp_path: Path) -> None:
    reader = shutil.which("pdftotext")
    if reader is None:
        pytest.skip("no pdftotext: sudo apt-get install poppler-utils")
    sections = []
    for k in range(40):  # tables at every height of a page, short and long ones
        rows = [(f"ROW{k}", "x")] * (3 if k % 2 else 14)
        spacers = [Text(f"spacer {i}") for i in range(k % 13)]
        made = table((f"HEAD{k}", "b"), rows, caption=f"CAPTION{k}")
        sections.append(Section(id=f"s{k}", title=f"Section {k}", blocks=[*spacers, *made]))
    place = tmp_path / "tables.html"
    place.write_text(
        html_of(page_of(title="t", kicker="k", facts=[], sections=sections)),
        encoding="utf-8",
    )
    view = browser.new_page()
    view.goto(place.as_uri())
    view.pdf(path=tmp_path / "tables.pdf", format="A4")
    view.close()
    done = subprocess.run(
        [reader, "-layout", str(tmp_path / "tables.pdf"), "-"], capture_output=True, text=True, check=True
    )
    ends = [page.split("\n") for page in done.stdout.split("\f") if page.strip()]
    last = [next(line for line in reversed(page) if line.strip()) for page in ends]
    assert len(last) > 10
    assert not [line for line in last if "HEAD" in line or "CAPTION" in line]
