# SPDX-License-Identifier: BSD-3-Clause
"""A self-calibration in words: its page, its text in a terminal, and the units that people read."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.experiments.calibration.results import CalibrationParameter
from allanite.recording.calibration import Calibration
from allanite.views.figures import sheet_of
from allanite.views.figures.calibration import parameter_panels
from allanite.views.report import html_of, render_file
from allanite.views.terminal import show_calibration
from allanite.views.wording import (
    calibrated_words,
    calibration_facts,
    calibration_name,
    earth_seen_words,
    parameter_groups,
    position_lines,
    scatter_lines,
    still_open,
    turn_lines,
)
from pages import Balance, document_of, text_of
from sample_calibration import LEFT_OUT, MG, OPEN, OUTLIER, estimate

NASTY = "</script><img src=x onerror=alert(1)>{{ 7*7 }}\"'&"


@pytest.fixture(autouse=True)
def any_width(monkeypatch: pytest.MonkeyPatch) -> None:
    """No terminal says how wide it is."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return estimate().to_json()


@pytest.fixture(scope="module")
def page(document: dict[str, Any]) -> str:
    return html_of(document)


def assert_whole(page: str) -> None:
    parser = Balance()
    parser.feed(document_of(page))
    assert not parser.wrong and not parser.open
    assert len(set(parser.ids)) == len(parser.ids)
    assert set(re.findall(r'href="#([^"]+)"', document_of(page))) <= set(parser.ids)
    assert "NaN" not in document_of(page) and "None" not in text_of(page)


# -- the page ---------------------------------------------------------------------------------------------


def test_the_verdict_comes_first_and_then_what_is_open(page: str) -> None:
    assert_whole(page)
    said = text_of(page)
    order = (
        "Partly calibrated.",
        "18 of 21",
        "Not observable",
        "Parameter Unit Estimate",
        "Correlations:",
        "Worst position",
    )
    places = [said.index(words) for words in order]
    assert places == sorted(places)
    for figure in ("sphere", "residuals-figure", "parameters-figure", "correlation"):
        assert f'class="live" id="{figure}"' in page


def test_every_parameter_is_on_the_page_with_its_interval(page: str, document: dict[str, Any]) -> None:
    said = text_of(page)
    for group in parameter_groups(document):
        for line in group.lines:
            value, low_high = (words.replace("-", "−") for words in (line.value, line.range))
            assert f"{group.name} {line.name} {group.unit} {value} {low_high}" in said
    assert said.count("not observable, assumed") == len(OPEN)


def test_positions_and_turns_that_stand_out_say_why(page: str) -> None:
    assert len(re.findall(r'class="tag fatal">outlier<', page)) == 1
    assert text_of(page).count("not used: clipped") == 1


def test_method_and_gravity_are_said(page: str, document: dict[str, Any]) -> None:
    said = text_of(page)
    for words in (
        "9.80665 m/s² (standard gravity, nothing given)",
        "Tedaldi",
        "its z axis is that of",
        "24.5 to 26.8",
    ):
        assert words in said
    alone = {**document, "parameters": document["parameters"][:9], "earth": None, "turns": []}
    words = text_of(html_of({**alone, "correlation": np.eye(9).tolist()}))
    assert "The gyros turn with the Earth" not in words and "Gyros" not in words


def test_object_and_document_give_the_same_page_and_the_calibration_is_read_back(
    page: str, document: dict[str, Any], tmp_path: Path
) -> None:
    assert html_of(estimate()) == page
    (tmp_path / "calibration.json").write_text(json.dumps(document), encoding="utf-8")
    loaded = Calibration.load(tmp_path / "calibration.json")
    np.testing.assert_array_equal(loaded.covariance, estimate().calibration.covariance)
    path = render_file(tmp_path / "calibration.json", tmp_path / "report.html")
    assert path.read_text(encoding="utf-8") == page


def test_what_stands_in_a_log_cannot_act(document: dict[str, Any]) -> None:
    nasty = json.loads(json.dumps(document))
    nasty |= {"source": NASTY, "reason": NASTY, "advice": [NASTY], "add": [NASTY], "remarks": [NASTY]}
    nasty["positions"][0] |= {"words": NASTY}
    nasty["calibration"]["channels"]["gyro"] = [NASTY] * 3
    nasty["parameters"][0] |= {"unit": NASTY, "advice": [NASTY], "status": NASTY}
    page = html_of(nasty)
    assert "<img src=x" not in page
    assert page.count("</script>") == 3


def test_nothing_that_was_found_still_has_a_page() -> None:
    bare = estimate(verdict="not calibrated", positions=(), turns=(), checks=(), scatter=(), earth=None)
    page = html_of(bare)
    assert_whole(page)
    assert "Not calibrated." in text_of(page)
    assert 'id="sphere"' not in page


# -- words ------------------------------------------------------------------------------------------------


def row(name: str, unit: str, value: float, half: float, status: str = "estimated") -> dict[str, Any]:
    interval = [value - half, value + half]
    return {"name": name, "unit": unit, "value": value, "interval": interval, "status": status, "advice": []}


@pytest.mark.parametrize(
    ("name", "unit", "value", "half", "text", "shown"),
    [
        ("accelerometer.bias_x", "m/s²", 12 * MG, 0.1 * MG, "mg", 12.0),
        ("accelerometer.bias_x", "m/s²", 0.012 * MG, 1e-4 * MG, "µg", 12.0),
        ("gyro.bias_x", "rad/s", math.radians(2.0), 1e-4, "deg/s", 2.0),
        ("gyro.bias_x", "rad/s", math.radians(0.01 / 3600), 1e-9, "deg/h", 0.01),
        ("gyro.scale_x", "1", 1.03, 1e-3, "%", 3.0),
        ("gyro.scale_x", "1", 1.00002, 1e-6, "ppm", 20.0),
        ("accelerometer.scale_x", "LSB/(m/s²)", 415.0, 0.5, "LSB/(m/s²)", 415.0),
        ("accelerometer.bias_x", "LSB", 33123.0, 2.0, "LSB", 33123.0),
        ("gyro.misalignment_xy", "rad", 5e-3, 1e-4, "mrad", 5.0),
        ("gyro.misalignment_xy", "rad", math.radians(10 / 3600), 1e-6, "arcsec", 10.0),
        ("accelerometer.quadratic_x", "1/(m/s²)", 10e-6 / 9.80665, 1e-8, "µg/g²", 10.0),
    ],
)
def test_parameters_are_in_the_units_of_people(
    name: str, unit: str, value: float, half: float, text: str, shown: float
) -> None:
    (group,) = parameter_groups({"parameters": [row(name, unit, value, half)]})
    assert group.unit == text
    assert group.lines[0].x == pytest.approx(shown, rel=1e-9)


def test_what_is_assumed_does_not_choose_the_unit() -> None:
    rows = [row("gyro.scale_x", "1", 1.0002, 1e-5), row("gyro.scale_y", "1", 1.0, 0.1, "assumed")]
    (group,) = parameter_groups({"parameters": rows})
    assert group.unit == "ppm"
    assert [line.estimated for line in group.lines] == [True, False]


def test_names_and_what_is_open(document: dict[str, Any]) -> None:
    assert calibration_name("gyro.misalignment_zx") == "gyro misalignment zx"
    ((names, advice),) = still_open(document)
    assert names == "gyro scale factor z; gyro misalignment xz, yz"
    assert advice == "add: turn it about its z axis by a quarter turn or more between two rests"
    ((_, alone),) = still_open({**document, "add": []})
    assert alone == advice.removeprefix("add: ")


def test_positions_turns_and_scatter_in_rows(document: dict[str, Any]) -> None:
    lines = position_lines(document)
    assert (lines[OUTLIER - 1][3], lines[OUTLIER - 1][-1]) == ("2.50 ± 0.30", "outlier")
    assert lines[LEFT_OUT - 1][-1] == "left out"
    assert lines[0][-2] == "–"  # no other position says anything about it
    assert turn_lines(document)[2][-1] == "not used: clipped" and turn_lines(document)[2][2] == "–"
    assert [line[-1] for line in scatter_lines(document)] == [
        "0.20 mg",
        "a drift of 13 deg/h over the record",  # 1 deg/h per root of a second, over 169 s
        "nothing",
    ]
    assert "13 of 14 positions" in calibrated_words(document)
    assert earth_seen_words(document).endswith("expected 15.04 deg/h: seen too weakly to be used")
    assert not earth_seen_words({**document, "earth": None})


def test_numbers_that_do_not_exist_are_dashes_and_have_no_marks() -> None:
    position = replace(estimate().positions[0], excess=None, excess_sd=None, rate=None, rate_sd=None)
    (line,) = position_lines(estimate(positions=(position,)).to_json())
    assert line[3:6] == ("–", "–", "–")
    nowhere = replace(position, up=np.full(3, math.nan), words="", used=False, why="left out")
    (line,) = position_lines(estimate(positions=(nowhere,)).to_json())
    assert (line[1], line[-1]) == ("–", "left out")
    with pytest.raises(InputError, match="no figure 'sphere'"):
        sheet_of(estimate(positions=(nowhere,)), view="sphere")


def test_numbers_that_round_to_zero_have_no_sign() -> None:
    (group,) = parameter_groups({"parameters": [row("gyro.scale_x", "1", 0.9999, 0.1, "assumed")]})
    assert group.lines[0].value == "0"


def test_every_key_of_the_document_is_described() -> None:
    text = (Path(__file__).parents[2] / "docs" / "reference" / "study-format.md").read_text(encoding="utf-8")
    found = estimate().to_json()
    keys = {*found, *found["calibration"], *found["parameters"][0]} - {"format", "version"}
    assert not sorted(key for key in keys if f"`{key}`" not in text)


@pytest.mark.parametrize(
    ("unit", "size", "said", "value"),
    [
        ("rad/s/(m/s²)", math.radians(40 / 3600), "deg/h/g", "40.0"),
        ("rad/s/(m/s²)", math.radians(2.5), "deg/s/g", "2.50"),
        ("counts/(m/s²)", 3.0 * 9.80665, "counts/(m/s²)", "3.00"),
    ],
)
def test_biases_that_follow_gravity_are_parameters(
    unit: str, size: float, said: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the table, on the page and in the picture, as any other."""
    size /= 9.80665
    names = [f"gyro.gravity_sensitivity_{a}{b}" for a in "xyz" for b in "xyz"]
    facts = {"unit": unit, "sd": 0.1 * size, "status": "estimated", "open": 0.0, "dof": math.inf}
    interval = (0.95 * size, 1.05 * size)
    rows = tuple(CalibrationParameter(name=n, value=size, interval=interval, **facts) for n in names)
    found = estimate()
    document = {
        **estimate(parameters=found.parameters + rows).to_json(), "correlation": np.eye(30).tolist()
    }  # fmt: skip
    group = parameter_groups(document)[-1]
    assert (group.name, group.unit, len(group.lines)) == ("Gravity sensitivity", said, 9)
    assert (group.lines[1].name, group.lines[1].value) == ("xy", value)
    show_calibration(document)
    assert "gravity sensitivity xy" in capsys.readouterr().out
    assert "Gravity sensitivity zz" in text_of(html_of(document))
    assert parameter_panels(document)[-1][0].title == f"Gyros: gravity sensitivity [{said}]"


def test_stated_gravity_is_said() -> None:
    facts = dict(calibration_facts(estimate(stated={"gravity": 3e-4}).to_json()))
    assert facts["gravity"] == "9.80665 m/s² (standard gravity, nothing given, ± 0.0003 stated)"


# -- the terminal -----------------------------------------------------------------------------------------


def test_the_terminal_says_the_same(document: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    show_calibration(document, ["out/report.html"])
    said = capsys.readouterr().out
    assert said.startswith("Partly calibrated: 18 of 21")
    flat = " ".join(said.split())
    for group in parameter_groups(document):
        for line in group.lines:
            assert f"{group.name.lower()} {line.name} {group.unit} {line.value} {line.range}" in flat
    for words in (
        "Not observable: gyro scale factor z",
        "outlier",
        "left out",
        "wrote out/report.html",
        "standard",
    ):
        assert words in said
