# SPDX-License-Identifier: BSD-3-Clause
"""Figures in a real browser: what is read, zoomed, moved, hidden and saved, with the pointer and with the keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.views.figures.drawing import Drawing, Words, circle
from allanite.views.figures.frames import limits_of
from allanite.views.figures.panel import (
    DARK,
    LIGHT,
    MARKERS,
    SPAN_LOOKS,
    Axis,
    Curve,
    Envelope,
    Guide,
    Label,
    Limit,
    Panel,
    Rug,
    ShadedSpan,
    Sheet,
)  # fmt: skip
from allanite.views.figures.screen import ScreenFigure
from allanite.views.figures.ticks import ticks_of
from axe import require_axe, violations
from real_browser import opened_browser

TAU = np.array([0.01, 0.1, 1.0, 10.0, 100.0])
SIGMA = np.array([30.0, 9.5, 3.0, 1.2, 1.1])
X = Axis(label="Averaging time τ [s]", log=True, limits=(0.005, 200.0))
Y = Axis(label="Allan deviation [deg/h]", log=True, limits=(0.5, 60.0))


def measured(**facts: Any) -> Curve:
    looks = {"lower": 0.9 * SIGMA, "upper": 1.1 * SIGMA, "band_label": "95 % interval", "marker": "circle"}
    return Curve(**{"x": TAU, "y": SIGMA, "label": "gyro_x", "colour": "x", "axis": "x", **looks, **facts})


MODEL = Curve(x=TAU, y=3 / np.sqrt(TAU), label="", colour="model", style="dashed", axis="x")
ALL = Panel(
    title="everything",
    x=Axis(label=X.label, log=True, limits=X.limits, landmarks=((60.0, "1 min"),)),
    y=Y,
    curves=(
        measured(hollow=np.array([True, False, False, False, False])), MODEL,
        measured(y=2 * SIGMA, label="gyro_y", colour="y", axis="y", bars=True, style="none", marker="square"),
    ),
    guides=(Guide(x=(0.005, 200.0), y=(40.0, 0.2), name="-1/2", name_x=0.03, slope=-0.5),),
    labels=(
        Label(x=1.0, y=3.0, text="N = 3.0 deg/√h", colour="ink"),
        Label(x=20.0, y=1.0, text="not fitted", colour="ink", place="line"),
        Label(x=1.0, y=0.8, text="goal", colour="ink", place="level"),
    ),
    limits=(Limit(x=TAU, y=0.01 * TAU, at=(100.0, 1.0), text="K < 1", side="above left"),),
    spans=tuple(ShadedSpan(start=0.1 * 2**i, stop=0.11 * 2**i, kind=kind) for i, kind in enumerate(SPAN_LOOKS)),
    rugs=(Rug(x=TAU, label="turns", colour="purple"),),
    envelopes=(Envelope(x=TAU, low=0.5 * SIGMA, high=0.6 * SIGMA, label="record", colour="z"),),
    key="above",
)  # fmt: skip
LINES = Panel(
    title="over time",
    x=Axis(label="Time [s]", limits=(0.0, 10.0)),
    y=Axis(label="Rate [deg/h]", limits=(-1.0, 1.0)),
    curves=(Curve(x=np.linspace(0, 10, 101), y=np.sin(np.arange(101) / 9), label="rate", colour="z"),),
)
DRAWING = Panel(
    title="compass",
    drawing=Drawing(
        width=10.0, height=4.0, parts=(circle((2.0, 2.0), 1.5), Words(x=6.0, y=2.0, text="the\nnorth"))
    ),
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with opened_browser() as browser:
        yield browser


@pytest.fixture
def shown(browser: Any, tmp_path: Path) -> Iterator[Any]:
    """Opens the page of panels, one above the other, and watches it."""
    troubles: list[str] = []
    views = []

    def show(*panels: Panel, width: int = 1000, dark: bool = False) -> Any:
        sheet = Sheet(rows=tuple((panel,) for panel in panels))
        path = ScreenFigure(sheet, dark).save(tmp_path / f"{len(views)}.html")
        views.append(browser.new_page(viewport={"width": width, "height": 900}))
        views[-1].on("console", lambda message: troubles.append(message.text))
        views[-1].on("pageerror", lambda error: troubles.append(str(error)))
        views[-1].on("request", lambda r: r.url.startswith(("file:", "blob:")) or troubles.append(r.url))
        views[-1].goto(path.as_uri())
        views[-1].locator("#figure[data-drawn]").wait_for()
        return views[-1]

    yield show
    for view in views:
        view.close()
    assert troubles == []


def panel_of(view: Any, number: int = 0) -> Mapping[str, Any]:
    """Frame and range of a panel, in pixels of the window and in units."""
    found: Mapping[str, Any] = view.evaluate(
        """(n) => { const p = chart.panels[n], box = p.picture.getBoundingClientRect();
          const at = (c) => c.x.map((x, i) => [box.x + p.px(x), box.y + p.py(c.y[i])]);
          return { ...p.range, left: box.x + p.left, top: box.y + p.top, across: p.across, high: p.high,
                   points: (p.facts.curves || []).map(at) }; }""",
        number,
    )
    return found


def stroke(view: Any, begin: tuple[float, float], end: tuple[float, float]) -> None:
    view.mouse.move(*begin)
    view.mouse.down()
    view.mouse.move(*((a + b) / 2 for a, b in zip(begin, end, strict=True)))
    view.mouse.move(*end)
    view.mouse.up()


def inner(frame: Mapping[str, Any], across: float, up: float) -> tuple[float, float]:
    return frame["left"] + across * frame["across"], frame["top"] + (1 - up) * frame["high"]


# -- what is drawn -------------------------------------------------------------------------------------------------


def test_everything_of_a_panel_is_drawn(shown: Any) -> None:
    view = shown(ALL, LINES)
    words = view.locator("#figure svg text").all_text_contents()
    for text in (
        X.label,
        Y.label,
        "1 min",
        "-1/2",
        "N = 3.0 deg/√h",
        "not fitted",
        "goal",
        "K < 1",
        "0.01",
        "100",
    ):
        assert text in words
    assert view.locator(".chart-key").first.locator("label").all_text_contents() == list(ALL.entries)
    assert view.locator(".chart-title span:first-child").all_text_contents() == ["everything", "over time"]
    ink = {part.split(")")[0] for part in view.locator("#figure").inner_html().split("var(--of-")[1:]}
    assert {
        "x",
        "y",
        "z",
        "ink",
        "model",
        "guide",
        "limit",
        "purple",
        "gap",
        "finding",
        "grid",
        "paper",
    } <= ink


@pytest.mark.parametrize("dark", [False, True])
def test_colors_are_those_of_the_theme_and_change_with_it(shown: Any, dark: bool) -> None:
    view = shown(LINES, dark=dark)
    line = "() => getComputedStyle(document.querySelector('#figure path[stroke*=-z]')).stroke"

    def rgb(colour: str) -> str:
        return f"rgb({', '.join(str(int(colour[i : i + 2], 16)) for i in (1, 3, 5))})"

    themes = [LIGHT, DARK][:: -1 if dark else 1]
    assert view.evaluate(line) == rgb(themes[0]["z"])
    view.evaluate(f"() => (document.documentElement.dataset.theme = '{'light' if dark else 'dark'}')")
    assert view.evaluate(line) == rgb(themes[1]["z"])
    view.emulate_media(media="print")
    assert view.evaluate(line) == rgb(LIGHT["z"])


@pytest.mark.parametrize("marker", MARKERS)
def test_every_marker_is_centered_on_its_point(shown: Any, marker: str) -> None:
    curve = Curve(x=np.array([5.0]), y=np.array([0.5]), label="one", colour="x", style="none", marker=marker)
    view = shown(Panel(title="marker", x=LINES.x, y=LINES.y, curves=(curve,)))
    box = view.locator("#figure path[stroke*='-of-x']").last.bounding_box()
    ((point,),) = panel_of(view)["points"]
    assert box["x"] + box["width"] / 2 == pytest.approx(point[0], abs=1.0)
    assert box["y"] + box["height"] / 2 == pytest.approx(point[1], abs=2.0)
    assert 4 < box["width"] < 15  # half-widths of up to 4.4 px, and the miter of the line


def test_ticks_are_those_of_the_still_picture(shown: Any) -> None:
    view = shown(ALL, LINES)
    for number, panel in enumerate((ALL, LINES)):
        ends, frame = limits_of(panel)[1], panel_of(view, number)
        expected = [name for _, name in ticks_of(panel.y, ends, frame["high"], 34).major]
        drawn = (
            view.locator("svg.chart-picture")
            .nth(number)
            .locator(".chart-tick[text-anchor=end]")
            .all_text_contents()
        )
        assert drawn == expected


# -- pointer -------------------------------------------------------------------------------------------------------


def test_a_stroke_zooms_and_a_double_click_shows_all(shown: Any) -> None:
    view = shown(ALL)
    whole = panel_of(view)
    stroke(view, inner(whole, 0.25, 0.75), inner(whole, 0.5, 0.5))
    part = panel_of(view)
    for way, ends in (("x", (0.25, 0.5)), ("y", (0.5, 0.75))):
        low, high = np.log10(whole[way])
        assert np.log10(part[way]) == pytest.approx([low + e * (high - low) for e in ends], abs=0.02)
    assert view.get_by_role("button", name="Show all").is_visible()
    view.mouse.dblclick(*inner(whole, 0.5, 0.5))
    assert (panel_of(view)["x"], panel_of(view)["y"]) == (whole["x"], whole["y"])
    stroke(view, inner(whole, 0.25, 0.5), inner(whole, 0.5, 0.51))  # a flat one keeps the heights
    assert panel_of(view)["y"] == whole["y"] and panel_of(view)["x"] != whole["x"]
    view.get_by_role("button", name="Show all").click()
    assert panel_of(view)["x"] == whole["x"]


def test_shift_and_drag_moves_what_is_shown(shown: Any) -> None:
    view = shown(LINES)
    frame = panel_of(view)
    view.keyboard.down("Shift")
    stroke(view, inner(frame, 0.5, 0.5), inner(frame, 0.4, 0.5))
    view.keyboard.up("Shift")
    assert panel_of(view)["x"] == pytest.approx([1.0, 11.0], abs=0.1)
    assert panel_of(view)["y"] == pytest.approx([-1.0, 1.0], abs=0.02)


def test_panels_of_one_time_axis_are_zoomed_together(shown: Any) -> None:
    view = shown(LINES, LINES)
    frame = panel_of(view)
    stroke(view, inner(frame, 0.2, 0.5), inner(frame, 0.6, 0.5))
    assert panel_of(view)["x"] == pytest.approx([2.0, 6.0], abs=0.1) == panel_of(view, 1)["x"]


def test_a_point_is_read_with_its_unit_and_its_interval(shown: Any) -> None:
    view = shown(ALL)
    view.mouse.move(*panel_of(view)["points"][0][1])
    reading = view.locator(".chart-reading")
    assert reading.locator("div").all_text_contents() == [
        "gyro_x", "Averaging time τ [s]: 0.1", "Allan deviation [deg/h]: 9.5", "[8.55, 10.45]"
    ]  # fmt: skip
    view.mouse.move(5, 5)
    assert reading.is_hidden()


def test_words_of_a_record_are_text_and_never_markup(shown: Any) -> None:
    name = "<img src=x onerror=console.log(1)>"
    axis = Axis(label=name, limits=(0.0, 10.0))
    view = shown(
        Panel(title=name, x=axis, y=LINES.y, curves=(LINES.curves[0], measured(label=name, axis="")))
    )
    assert view.locator("img").count() == 0
    assert name in view.locator("#figure svg text").all_text_contents()
    assert name in view.locator(".chart-key label").all_text_contents()


# -- legend --------------------------------------------------------------------------------------------------------


def test_an_entry_of_the_legend_hides_its_curve_and_its_channel(shown: Any) -> None:
    view = shown(ALL)
    inked = (
        "(name) => document.querySelectorAll(`#figure svg.chart-picture [stroke='var(--of-${name})']`).length"
    )
    before = {name: view.evaluate(inked, name) for name in ("x", "y", "model")}
    assert all(before.values())
    view.get_by_role("checkbox", name="gyro_x").uncheck()
    assert [view.evaluate(inked, name) for name in ("x", "model")] == [0, 0]
    assert view.evaluate(inked, "y") == before["y"]
    view.get_by_role("checkbox", name="gyro_x").focus()
    view.keyboard.press("Space")
    assert view.evaluate(inked, "x") == before["x"]
    for entry in ALL.entries:
        view.get_by_role("checkbox", name=entry, exact=True).uncheck()
    assert view.evaluate("() => chart.panels[0].curves().length") == 0


# -- keys ----------------------------------------------------------------------------------------------------------


def test_the_keys_read_zoom_and_move(shown: Any) -> None:
    view = shown(ALL)
    picture, status = view.get_by_role("application"), view.get_by_role("status")
    assert "Allan deviation [deg/h] against Averaging time τ [s]" in picture.get_attribute("aria-label")
    picture.focus()
    view.keyboard.press("ArrowRight")
    assert (
        status.text_content() == "gyro_x, Averaging time τ [s]: 0.01, Allan deviation [deg/h]: 30, [27, 33]"
    )
    view.keyboard.press("ArrowRight")
    assert "Averaging time τ [s]: 0.1," in status.text_content()
    view.keyboard.press("ArrowLeft")
    view.keyboard.press("ArrowDown")
    view.keyboard.press("ArrowDown")
    assert status.text_content().startswith("gyro_y, Averaging time τ [s]: 0.01")
    whole = panel_of(view)
    view.keyboard.press("+")
    part = panel_of(view)
    assert np.ptp(np.log10(part["x"])) == pytest.approx(np.ptp(np.log10(whole["x"])) / 2)
    view.keyboard.press("Shift+ArrowRight")
    assert panel_of(view)["x"][0] > part["x"][0]
    view.keyboard.press("-")
    view.keyboard.press("Home")
    assert panel_of(view)["x"] == whole["x"]
    view.keyboard.press("Escape")
    assert view.locator(".chart-reading").is_hidden()


def test_what_is_zoomed_deep_has_ticks(shown: Any) -> None:
    view = shown(ALL)
    view.get_by_role("application").focus()
    for _ in range(12):
        view.keyboard.press("+")
        assert view.locator(".chart-tick").count() >= 2


# -- width, files, access ------------------------------------------------------------------------------------------


def test_a_narrow_window_has_one_column_and_scrolls_drawings_only(shown: Any) -> None:
    view = shown(ALL, LINES, DRAWING, width=390)
    assert view.evaluate("document.documentElement.scrollWidth") <= 390
    assert view.locator("#figure svg.chart-picture").last.bounding_box()["width"] == 640
    scrolled = view.locator(".chart-sheet[tabindex='0']")
    assert scrolled.get_attribute("aria-label") == "compass"
    view.set_viewport_size({"width": 1200, "height": 900})
    view.wait_for_function("document.querySelector('svg.chart-picture').getAttribute('width') > 1100")
    assert view.locator(".chart-sheet[tabindex='0']").count() == 0


def test_a_picture_is_saved_with_its_legend_in_the_colors_of_the_page(shown: Any) -> None:
    view = shown(ALL, LINES, dark=True)
    with view.expect_download() as caught:
        view.get_by_role("button", name="Save picture everything").click()
    assert caught.value.suggested_filename == "everything.svg"
    text = Path(caught.value.path()).read_text(encoding="utf-8")
    assert "var(" not in text and DARK["paper"] in text and "everything" in text
    assert all(entry in text for entry in ALL.entries) and "tabindex" not in text


@pytest.mark.parametrize("dark", [False, True])
def test_axe_has_nothing_against_it(shown: Any, dark: bool) -> None:
    view = shown(ALL, LINES, DRAWING, width=600, dark=dark)
    view.evaluate(require_axe())
    assert violations(view) == []


@pytest.mark.long
def test_a_figure_that_is_stated_again_keeps_zoom_and_keys_and_what_is_hidden(shown: Any) -> None:
    view = shown(ALL)
    view.get_by_role("checkbox", name="gyro_y").uncheck()
    view.get_by_role("application").focus()
    view.keyboard.press("+")
    zoomed = panel_of(view)
    view.evaluate("() => chart.show(structuredClone(chart.facts))")
    assert (panel_of(view)["x"], panel_of(view)["y"]) == (zoomed["x"], zoomed["y"])
    assert not view.get_by_role("checkbox", name="gyro_y").is_checked()
    view.keyboard.press("Home")
    assert panel_of(view)["x"] == list(X.limits or ())
    clicks = "() => { window.clicks = []; chart.options.clicked = (point) => window.clicks.push(point); }"
    view.evaluate(clicks)
    view.keyboard.press("ArrowRight")
    view.keyboard.press("Enter")
    x, y = panel_of(view)["points"][0][1]
    view.mouse.click(x, y)
    assert view.evaluate("window.clicks") == [{"x": 0.01, "y": 30}, {"x": 0.1, "y": 9.5}]
