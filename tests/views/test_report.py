# SPDX-License-Identifier: BSD-3-Clause
"""The report: complete, self-contained, safe against what stands in a file, and right in a real browser."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import allanite as al
import sample_study
from allanite.errors import StorageError
from allanite.study.study import Study
from allanite.views.report import html_of
from allanite.views.report.powers import with_links, with_powers
from allanite.views.wording.study import CoefficientWording, reading
from axe import require_axe, violations
from figure_labels import draw_all, misplaced_labels, unfold
from pages import Balance, document_of, text_of
from real_browser import opened_browser

NASTY = "</script><img src=x onerror=alert(1)>{{ 7*7 }}\"'&"


@pytest.fixture(scope="module")
def study() -> dict[str, Any]:
    return sample_study.build()


@pytest.fixture(scope="module")
def page(study: dict[str, Any]) -> str:
    return html_of(study)


def small() -> dict[str, Any]:
    """A study of one channel: a report of it takes a quarter of the time."""
    whole = sample_study.build()
    return {**whole, "channels": whole["channels"][:1]}


# -- what it says -------------------------------------------------------------------------------------------


def test_every_estimate_stands_in_it_with_its_interval_and_in_si(study: dict[str, Any], page: str) -> None:
    from allanite.views.wording.study import readings

    text = document_of(page)
    for channel in Study.from_json(study).channels:
        for model in channel.models:
            for found in readings(channel, model).values():
                for part in (found.value, found.range, found.si):
                    assert str(with_powers(part)) in text, f"{channel.name} {found.symbol}: {part}"


def test_verdict_findings_advice_and_provenance_stand_in_it(study: dict[str, Any], page: str) -> None:
    text = text_of(page)
    answer = "Angle random walk N 0.270 to 0.320 deg/√h all three channels"
    assert text.index(answer) < text.index("Allan deviation of all channels")
    for finding in study["findings"]:
        for part in ("code", "message", "advice", "risk"):
            assert finding[part] in text
    assert "Accepted despite “clipping” (gyro_z)" in text
    assert "Worst finding: gap" in text
    assert "a record of about 29 h would determine K to 10 % (1 sd)" in text
    assert "The model does not explain the curve" in text
    assert study["provenance"]["sha256"] in text
    assert study["provenance"]["command"] in text
    assert "exclude reason: stuck value samples: acc_x 900" in text
    for word in ("IEEE Std 952", "Metrologia 45", "slope readings are biased"):
        assert word in text


def test_a_place_of_a_finding_can_be_found_again(page: str) -> None:
    assert "at 2:46:40 to 2:56:40; 9:10:00 to 9:10:12" in text_of(page)


def test_a_record_without_faults_says_so() -> None:
    clean = small()
    clean["findings"] = []
    clean["recording"] |= {"missing": 0, "gaps": []}
    text = text_of(html_of(clean))
    assert "No problems found." in text
    assert "No sample is missing." in text


def test_a_term_that_some_channels_only_bound_says_so_beside_its_number(page: str) -> None:
    assert "Rate random walk K 9.6 deg/h/√h gyro_x; gyro_y and gyro_z below 7.8 deg/h/√h" in text_of(page)


def test_one_channel_has_its_interval_beside_its_number() -> None:
    assert "Angle random walk N 0.30012 deg/√h 95 % interval [0.29952, 0.30072]" in text_of(html_of(small()))


def test_a_footnote_stands_below_the_table_of_its_star(study: dict[str, Any]) -> None:
    starred = small()
    starred["channels"] = [study["channels"][1], study["channels"][3]]
    starred["channels"][0] = {**starred["channels"][0], "models": starred["channels"][0]["models"][1:]}
    text, note = text_of(html_of(starred)), "* the B whose floor"
    assert text.count(note) == 1
    assert text.index(" * ") < text.index(note) < text.index("Accelerometer: noise coefficients")
    assert note not in text_of(html_of(small()))


def test_a_report_names_no_object_of_the_program() -> None:
    exact = small()
    exact["channels"][0]["curve"]["interval_basis"] = "exact under NoiseModel(N=1.7e-05; B=2.1e-06)"
    text = text_of(html_of(exact))
    assert "NoiseModel(" not in text
    assert "Bands assume exact under the fitted model" in text


def test_names_of_files_beside_it_are_links() -> None:
    page = html_of(small(), ("study.json", "allan.csv", "a b & c.csv"))
    assert re.findall(r'<a href="([^"#]+)"', document_of(page)) == [
        "study.json",
        "allan.csv",
        "a%20b%20%26%20c.csv",
    ]
    assert "Files" not in text_of(html_of(small()))
    words = with_powers("whole study: week/report.html, not report.html.bak, 1e-05")
    linked = with_links(words, ["week/report.html", "report.html"])
    assert linked.count("<a ") == 1
    assert '<a href="week/report.html">week/report.html</a>, not report.html.bak, 1\u202f×' in linked


def test_exponents_are_written_as_powers_and_shared_by_the_ends_of_an_interval() -> None:
    assert with_powers("1.2e-05") == "1.2\u202f×\u202f10<sup>−5</sup>"
    assert with_powers("[1.1e-05, 1.3e-05]") == "[1.1, 1.3]\u202f×\u202f10<sup>−5</sup>"
    assert with_powers("[9.1e-06, 1.3e-05]").count("<sup>") == 2
    assert with_powers("<b>T_b -3") == "&lt;b&gt;<i>T</i><sub>b</sub> −3"


# -- the file -----------------------------------------------------------------------------------------------


def test_it_is_one_file_under_six_megabytes_that_asks_for_nothing(page: str) -> None:
    assert len(page.encode()) < 6e6
    outside = document_of(page)
    assert not re.search(r"""<link|<script[^>]+src|@import|(?:src|href)=["']?(?:https?:)?//""", outside)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    assert policy[1].startswith("default-src 'none'")


def test_tags_are_balanced_and_identities_unique(page: str) -> None:
    parser = Balance()
    parser.feed(document_of(page))
    assert not parser.wrong
    assert not parser.open
    assert len(set(parser.ids)) == len(parser.ids)


def test_the_data_survive_the_way_into_the_page(study: dict[str, Any], page: str) -> None:
    found = re.search(r'<script type="application/json" id="figure-data">(.*?)</script>', page, re.S)
    assert found is not None
    figures = json.loads(found[1])
    assert set(figures) == set(re.findall(r'class="live" id="([^"]+)"', page))
    curve = next(c for c in figures["channel-0-0"]["panels"][0]["curves"] if c["label"] == "gyro_x")
    assert curve["x"] == pytest.approx(study["channels"][0]["curve"]["tau"], rel=1e-5)
    assert page.count('class="still"') == len(figures)


def test_what_stands_in_a_log_cannot_act() -> None:
    nasty = small()
    nasty["channels"][0]["name"] = NASTY
    nasty["provenance"] |= {"source": NASTY, "command": NASTY}
    nasty["recording"]["history"] = [{"step": NASTY, NASTY: [NASTY]}]
    for finding in nasty["findings"]:
        finding |= {"code": NASTY, "message": NASTY, "advice": NASTY, "risk": NASTY, "channel": NASTY}
    nasty["channels"][0]["advice"][0]["text"] = NASTY
    nasty["channels"][0]["models"][0] |= {"verdict": NASTY, "family": NASTY}
    nasty["channels"][0]["models"][0]["estimates"][0]["note"] = NASTY
    page = html_of(nasty)
    assert "<img src=x" not in page
    assert page.count("</script>") == 2
    assert "49" not in re.findall(r"onerror=alert\(1\)&gt;(.{4})", page)
    parser = Balance()
    parser.feed(document_of(page))
    assert not parser.wrong


def test_poor_studies_still_give_a_report() -> None:
    poor = sample_study.build()
    first, second, third, *rest = poor["channels"]
    first |= {"models": [], "slopes": {"note": "too short"}, "advice": [], "mean": None, "sd": None}
    second["curve"] |= {
        k: [None] * len(second["curve"]["lags"]) for k in ("deviation", "lower", "upper", "edf")
    }
    third |= {"spectrum": {}, "overview": {"t": [], "low": [], "high": []}}
    rest[0] |= {"kind": "unknown", "unit": ""}
    rest[0]["spectrum"] |= {"frequency": [], "density": [], "lower": [], "upper": [], "corner": None}
    rest[1] |= {"kind": "counts", "unit": "LSB"}
    rest[2] |= {"kind": "voltage", "unit": "V"}
    poor["provenance"] |= {"sha256": None, "command": None, "source": ""}
    text = text_of(html_of(poor))
    assert "No model was fitted to gyro_x" in text
    assert "too short" in text
    assert "units/√Hz" in text


def test_the_same_study_gives_the_same_page() -> None:
    assert html_of(al.Study.from_json(small())) == html_of(small())


def test_a_report_is_never_replaced_by_accident(tmp_path: Path) -> None:
    study, target = small(), tmp_path / "report.html"
    target.write_text("mine")
    with pytest.raises(StorageError, match="--force"):
        al.render(study, target)
    assert target.read_text() == "mine"
    assert al.render(study, target, force=True) == target
    assert target.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_coefficients_are_worded_a_fixed_number_of_times_for_a_channel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However many channels there are: words for all others in each row of a table take the square of their number."""
    calls = 0

    def counted(*given: Any, **named: Any) -> CoefficientWording:
        nonlocal calls
        calls += 1
        return reading(*given, **named)

    monkeypatch.setattr("allanite.views.wording.study.reading", counted)
    counts = []
    for copies in (4, 8):
        study = sample_study.build()
        first = study["channels"][0]
        study["channels"] = [{**first, "name": f"gyro_{k}"} for k in range(copies)]
        calls = 0
        html_of(study)
        counts.append(calls)
    assert counts[1] == 2 * counts[0] > 0


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="nowhere"):
        al.render(small(), tmp_path / "nowhere" / "report.html")


# -- in a browser -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with opened_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def report_file(page: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(page, encoding="utf-8")
    return path


def test_a_browser_draws_every_figure_without_error_or_request(
    browser: Any, report_file: Path, page: str
) -> None:
    view = browser.new_page(viewport={"width": 1180, "height": 900})
    troubles: list[str] = []
    view.on("console", lambda m: troubles.append(m.text))
    view.on("pageerror", lambda e: troubles.append(str(e)))
    view.on("request", lambda r: r.url.startswith(("file:", "data:", "blob:")) or troubles.append(r.url))
    view.goto(report_file.as_uri())
    unfold(view)
    draw_all(view)
    assert view.locator(".live[data-drawn]").count() == page.count('class="live"')
    assert view.locator(".still").first.is_hidden()
    square = view.evaluate(
        "() => { const { range, across, high } = document.getElementById('channel-0-0').chart.panels[0];"
        " const decades = ([a, b]) => Math.log10(b / a);"
        " return [across / decades(range.x), high / decades(range.y)]; }"
    )
    assert square[0] == pytest.approx(square[1], rel=0.02)
    before = view.evaluate("getComputedStyle(document.body).backgroundColor")
    view.locator("#theme").click()
    assert view.evaluate("getComputedStyle(document.body).backgroundColor") != before
    view.emulate_media(media="print")
    assert view.locator(".still").first.is_visible()
    assert view.locator(".live").first.is_hidden()
    assert not troubles
    view.close()


@pytest.mark.parametrize("width", [390, 1280])
def test_no_label_overlaps_or_is_cut_and_no_page_scrolls_sideways(
    browser: Any, report_file: Path, width: int
) -> None:
    view = browser.new_page(viewport={"width": width, "height": 900})
    view.goto(report_file.as_uri())
    unfold(view)
    draw_all(view)
    assert misplaced_labels(view) == []
    assert view.evaluate("document.documentElement.scrollWidth") <= width
    wide = "all => all.filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => e.textContent)"
    assert view.locator(".stacks").evaluate_all(wide) == []
    view.close()


def test_six_axes_are_at_most_6000_pixels_as_first_opened_and_one_at_most_4000(
    browser: Any, report_file: Path, tmp_path: Path
) -> None:
    one = al.render(small(), tmp_path / "one.html")
    for path, most in ((report_file, 6000), (one, 4000)):
        view = browser.new_page(viewport={"width": 1100, "height": 900})
        view.goto(path.as_uri())
        draw_all(view)
        assert view.evaluate("document.documentElement.scrollHeight") <= most
        view.close()


def test_a_switch_hides_a_channel_and_its_model_with_the_keyboard(browser: Any, report_file: Path) -> None:
    view = browser.new_page(viewport={"width": 1100, "height": 900})
    view.goto(report_file.as_uri())
    draw_all(view)
    of = """(name) => { const [panel] = document.getElementById('group-0').chart.panels;
      return panel.facts.curves.filter((c) => c.axis === name).map((c) => !panel.hidden(c, c.label)); }"""
    switch = view.locator("#curves figure").first.get_by_role("checkbox", name="gyro_y")
    assert view.evaluate(of, "gyro_y") == [True, True]  # curve with its band, model
    switch.focus()
    view.keyboard.press("Space")
    assert view.evaluate(of, "gyro_y") == [False, False]
    assert view.evaluate(of, "gyro_x") == [True, True]
    view.locator("#theme").click()  # a figure that is drawn anew keeps its switches
    assert view.evaluate(of, "gyro_y") == [False, False]
    switch.check()
    assert view.evaluate(of, "gyro_y") == [True, True]
    view.close()


def test_axe_has_nothing_against_it_folded_or_not(browser: Any, report_file: Path) -> None:
    script = require_axe()
    view = browser.new_page(viewport={"width": 1100, "height": 900})
    view.goto(report_file.as_uri())
    view.evaluate(script)
    draw_all(view)
    assert violations(view) == []
    unfold(view)
    draw_all(view)
    assert violations(view) == []
    view.close()


@pytest.mark.parametrize("scripts", [True, False])
def test_paper_has_no_fold(browser: Any, report_file: Path, scripts: bool) -> None:
    context = browser.new_context(java_script_enabled=scripts)
    view = context.new_page()
    view.goto(report_file.as_uri())
    folded = view.locator("#provenance dl, #method .references, #curves .card, #curves details .still")
    shown = "all => all.map((e) => e.checkVisibility())"
    assert not any(folded.evaluate_all(shown))
    view.emulate_media(media="print")
    assert all(folded.evaluate_all(shown))
    assert view.locator(".live:visible, .chart-key:visible, .chart-tools:visible, nav:visible").count() == 0
    context.close()


def test_a_link_to_a_part_that_is_folded_opens_it(browser: Any, report_file: Path) -> None:
    view = browser.new_page()
    view.goto(report_file.as_uri())
    assert not view.locator("#provenance dl").is_visible()
    view.get_by_role("link", name="Provenance").click()
    view.locator("#provenance dl").wait_for(timeout=2_000)
    view.close()


@pytest.mark.long
def test_without_javascript_the_pictures_are_there(browser: Any, report_file: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    view = context.new_page()
    view.goto(report_file.as_uri())
    stills = view.locator("#curves > figure .still, #record .still")
    assert stills.count() == 3  # all axes of each kind, and the record
    assert all(stills.nth(i).is_visible() for i in range(stills.count()))
    assert stills.first.bounding_box()["height"] > 200
    assert not view.locator(".live").first.is_visible()
    context.close()
