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
from allanite.experiments.calibration import CalibrationEstimate, CalibrationParameter, ParameterStatus
from allanite.recording.calibration import Calibration
from allanite.study.result_document import ResultDocument
from allanite.views import calibration as shown
from allanite.views.figures import sheet_of
from allanite.views.figures.calibration import parameter_panels
from allanite.views.report import html_of, render_file
from allanite.views.terminal.page import show_document
from allanite.views.wording.calibration import calibration_name, parameter_groups
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
        "Inconsistent.",
        "18 of 21",
        "Not observable",
        "Accelerometers Unit Estimate",
        "Correlations.",
        "Scatter of the accelerometers at rest",
    )
    places = [said.index(words) for words in order]
    assert places == sorted(places)
    for figure in ("sphere", "residuals-figure", "parameters-figure", "correlation"):
        assert f'class="live" id="{figure}"' in page


def test_every_parameter_is_on_the_page_with_its_interval(page: str) -> None:
    said = text_of(page)
    for group in parameter_groups(estimate().parameters):
        for line in group.lines:
            value, low_high = (words.replace("-", "−") for words in (line.value, line.range))
            assert f"{group.name} {line.name} {group.unit} {value} {low_high}" in said
    assert said.count("not observable, assumed") == len(OPEN)


def test_positions_and_turns_that_stand_out_say_why(page: str) -> None:
    assert (
        len(re.findall(r'class="tag fatal">outlier<', page)) == 2
    )  # in the verdict, and among all positions
    assert text_of(page).count("not used: clipped") == 1


def test_method_and_gravity_are_said(page: str, document: dict[str, Any]) -> None:
    said = text_of(page)
    for words in (
        "9.80665 m/s² (standard gravity, none given)",
        "Tedaldi",
        "Body axes: z is the z axis of",
        "24.5 to 26.8",
    ):
        assert words in said
    words = text_of(html_of(alone()))
    assert "the gyros turn with the Earth" not in words and "Gyros" not in words


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
    nasty |= {
        "source": NASTY,
        "add": [NASTY],
        "astray": {"miss": 1.0, "order": [NASTY] * 3, "turned": [NASTY]},
    }
    nasty["positions"][0] |= {"words": NASTY, "used": False, "why": NASTY}
    nasty["calibration"]["channels"]["gyro"] = [NASTY] * 3
    nasty["parameters"][0] |= {"unit": NASTY, "add": [NASTY], "status": "assumed"}
    nasty["scatter"][0] |= {"what": NASTY, "unit": NASTY}
    page = html_of(nasty)
    assert "<img src=x" not in page
    assert page.count("</script>") == 2


def test_nothing_that_was_found_still_has_a_page() -> None:
    none = tuple(replace(p, status=ParameterStatus.ASSUMED) for p in estimate().parameters)
    bare = estimate(parameters=none, positions=(), turns=(), checks=(), scatter=(), earth=None)
    page = html_of(bare)
    assert_whole(page)
    assert "Not calibrated." in text_of(page)
    assert 'id="sphere"' not in page


# -- words ------------------------------------------------------------------------------------------------


def row(name: str, unit: str, value: float, half: float, status: str = "estimated") -> CalibrationParameter:
    return CalibrationParameter(
        name=name,
        unit=unit,
        value=value,
        sd=half / 2,
        interval=(value - half, value + half),
        status=ParameterStatus(status),
        open=0.0,
        dof=math.inf,
    )


def alone(sensor: str = "accelerometer") -> CalibrationEstimate:
    """One triad of the unit."""
    whole = estimate()
    kept = [i for i, p in enumerate(whole.parameters) if p.name.startswith(sensor)]
    calibration = replace(
        whole.calibration,
        names=tuple(whole.calibration.names[i] for i in kept),
        values=whole.calibration.values[kept],
        covariance=whole.calibration.covariance[np.ix_(kept, kept)],
        status=tuple(whole.calibration.status[i] for i in kept),
    )
    parameters = tuple(whole.parameters[i] for i in kept)
    return estimate(calibration=calibration, parameters=parameters, earth=None, turns=())


def facts_of(result: CalibrationEstimate) -> dict[str, str]:
    return dict(shown._facts(ResultDocument(result=result)))


def texts(cells: Any) -> list[str]:
    return [cell if isinstance(cell, str) else cell.text for cell in cells]


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
    (group,) = parameter_groups([row(name, unit, value, half)])
    assert group.unit == text
    assert group.lines[0].x == pytest.approx(shown, rel=1e-9)


def test_what_is_assumed_does_not_choose_the_unit() -> None:
    rows = [row("gyro.scale_x", "1", 1.0002, 1e-5), row("gyro.scale_y", "1", 1.0, 0.1, "assumed")]
    (group,) = parameter_groups(rows)
    assert group.unit == "ppm"
    assert [line.estimated for line in group.lines] == [True, False]


def test_names_and_what_is_open() -> None:
    assert calibration_name("gyro.misalignment_zx") == "gyro misalignment zx"
    ((names, advice),) = shown._open(estimate())
    assert names == "gyro scale factor z; gyro misalignment xz, yz"
    assert advice == "add: on an edge, -x and -y up"
    ((_, words),) = shown._open(estimate(add=()))
    assert words == advice.removeprefix("add: ")


def test_positions_turns_and_scatter_in_rows() -> None:
    found = estimate()
    lines = [texts(shown._position(p, found)) for p in found.positions]
    assert (lines[OUTLIER - 1][3], lines[OUTLIER - 1][-1]) == ("2.50 ± 0.30", "outlier")
    assert lines[LEFT_OUT - 1][-1] == "left out"
    assert lines[0][-2] == "–"  # no other position says anything about it
    turn = texts(shown._turn(found.turns[2]))
    assert turn[-1] == "not used: clipped" and turn[2] == "–"
    assert [shown._added(s, found.duration) for s in found.scatter] == [
        "0.20 mg",
        "drift of 13 deg/h over the record",  # 1 deg/h per root of a second, over 169 s
        "none",
    ]
    facts = facts_of(found)
    assert facts["Used"].startswith(
        "13 of 14 positions (found in the signal), 2.17 min at rest; 11 turns between"
    )
    assert facts["Earth"].endswith("expected 15.04 deg/h: too uncertain to be used")
    assert not facts_of(estimate(earth=None))["Earth"]


def test_numbers_that_do_not_exist_are_dashes_and_have_no_marks() -> None:
    position = replace(estimate().positions[0], excess=None, excess_sd=None, rate=None, rate_sd=None)
    line = texts(shown._position(position, estimate(positions=(position,))))
    assert line[3:6] == ["–", "–", "–"]
    nowhere = replace(position, up=np.full(3, math.nan), words="", used=False, why="left out")
    line = texts(shown._position(nowhere, estimate(positions=(nowhere,))))
    assert (line[1], line[-1]) == ("–", "left out")
    with pytest.raises(InputError, match="no figure 'sphere'"):
        sheet_of(estimate(positions=(nowhere,)), view="sphere")


def test_numbers_that_round_to_zero_have_no_sign() -> None:
    (group,) = parameter_groups([row("gyro.scale_x", "1", 0.9999, 0.1, "assumed")])
    assert group.lines[0].value == "0"


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
    names = tuple(f"gyro.gravity_sensitivity_{a}{b}" for a in "xyz" for b in "xyz")
    found = estimate()
    calibration = replace(
        found.calibration,
        names=found.calibration.names + names,
        values=np.append(found.calibration.values, np.full(9, size)),
        covariance=np.eye(30),
        status=(*found.calibration.status, *["estimated"] * 9),
    )
    more = tuple(row(n, unit, size, 0.05 * size) for n in names)
    result = estimate(calibration=calibration, parameters=found.parameters + more)
    group = parameter_groups(result.parameters)[-1]
    assert (group.name, group.unit, len(group.lines)) == ("Gravity sensitivity", said, 9)
    assert (group.lines[1].name, group.lines[1].value) == ("xy", value)
    show_document(ResultDocument(result=result))
    assert "Gravity sensitivity xy" in capsys.readouterr().out
    assert "Gravity sensitivity zz" in text_of(html_of(result))
    assert parameter_panels(result)[-1][0].title == f"Gyros: gravity sensitivity [{said}]"


def test_stated_gravity_is_said() -> None:
    facts = facts_of(estimate(stated={"gravity": 3e-4}))
    assert facts["Gravity"] == "9.80665 m/s² (standard gravity, none given, ± 0.0003 stated)"


# -- the terminal -----------------------------------------------------------------------------------------


def test_the_terminal_says_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    show_document(ResultDocument(result=estimate()), ["out/report.html"])
    said = capsys.readouterr().out
    assert said.startswith("Inconsistent. Position 7 disagrees with all others.")
    flat = " ".join(said.split())
    for group in parameter_groups(estimate().parameters):
        for line in group.lines:
            assert f"{group.name} {line.name} {group.unit} {line.value} {line.range}" in flat
    for words in (
        "Gyro scale factor z; gyro misalignment xz,",
        "outlier",
        "left out",
        "wrote out/report.html",
        "standard",
    ):
        assert words in said
