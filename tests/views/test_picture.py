# SPDX-License-Identifier: BSD-3-Clause
"""Still pictures: what Matplotlib draws of a panel, written without it."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import sample_study
from allanite.views.figures import matplotlib as paper
from allanite.views.figures import sheet_of
from allanite.views.figures.frames import limits_of
from allanite.views.figures.panel import (
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
)
from allanite.views.figures.picture import svg
from allanite.views.figures.ticks import ticks_of

SVG = "{http://www.w3.org/2000/svg}"
TAU = np.array([0.01, 0.1, 1.0, 10.0, 100.0])
DEVIATION = np.array([30.0, 9.0, 3.0, np.nan, 1.1])


def sheet(*panels: Panel) -> Sheet:
    return Sheet(rows=tuple((panel,) for panel in panels))


def curve(**facts: Any) -> Curve:
    return Curve(**{"x": TAU, "y": DEVIATION, "label": "measured", "colour": "x", **facts})


def logarithmic(*curves: Curve, **facts: Any) -> Panel:
    x, y = (
        Axis(label="τ [s]", log=True, limits=(0.005, 200.0)),
        Axis(label="σ [deg/h]", log=True, limits=(0.5, 50.0)),
    )
    return Panel(title="curve", x=x, y=y, curves=curves, **facts)


def drawn(shown: Sheet) -> ElementTree.Element:
    return ElementTree.fromstring(svg(shown))


def words(picture: ElementTree.Element) -> list[str]:
    return ["".join(text.itertext()) for text in picture.iter(f"{SVG}text")]


def ways(picture: ElementTree.Element, **facts: str) -> list[str]:
    return [
        p.get("d", "") for p in picture.iter(f"{SVG}path") if all(p.get(k) == v for k, v in facts.items())
    ]


def numbers(way: str) -> list[float]:
    return [float(part) for part in re.findall(r"-?[\d.]+", way)]


# -- places -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("log", [True, False])
def test_points_are_where_matplotlib_draws_them(log: bool) -> None:
    axes = [Axis(label="a", log=log, limits=(0.005, 200.0)), Axis(label="b", log=log, limits=(0.5, 50.0))]
    panel = Panel(title="one", x=axes[0], y=axes[1], curves=(curve(y=DEVIATION[[0, 1, 2, 2, 4]]),))
    for shown in (sheet(panel), sheet(panel, panel), Sheet(rows=((panel, panel),))):
        figure = paper.figure(shown)
        figure.set_dpi(72)
        height = figure.get_figheight() * 72
        lines = [w for w in ways(drawn(shown), stroke="#c8442c") if w.count("L") == TAU.size - 1]
        for axis, line in zip(figure.axes, lines, strict=True):
            at = axis.transData.transform(np.column_stack([TAU, panel.curves[0].y]))
            expected = np.column_stack([at[:, 0], height - at[:, 1]])
            assert np.array(numbers(line)).reshape(-1, 2) == pytest.approx(expected, abs=0.02)


def test_missing_values_interrupt_lines_and_bands() -> None:
    picture = drawn(sheet(logarithmic(curve(lower=0.8 * DEVIATION, upper=1.2 * DEVIATION))))
    (line,) = ways(picture, stroke="#c8442c", **{"stroke-width": "1.1"})
    assert line.count("M") == 2 and line.count("L") == 2
    band = next(w for w in ways(picture, fill="#c8442c") if "z" in w and "L" in w)
    assert band.count("M") == 2 and band.count("z") == 2
    assert "nan" not in svg(sheet(logarithmic(curve())))


def test_bars_are_strokes_between_the_ends_and_hollow_points_have_the_color_of_the_paper() -> None:
    hollow = np.array([True, False, False, False, False])
    looks = {
        "lower": 0.5 * DEVIATION,
        "upper": 2 * DEVIATION,
        "bars": True,
        "marker": "circle",
        "hollow": hollow,
    }
    picture = drawn(sheet(logarithmic(curve(style="none", **looks))))
    bars = next(w for w in ways(picture, stroke="#c8442c") if "V" in w)
    assert bars.count("M") == 4
    filled, empty = (ways(picture, fill=colour, stroke="#c8442c") for colour in ("#c8442c", "#ffffff"))
    assert filled[0].count("M") == 3 and empty[0].count("M") == 1


def test_without_limits_all_that_is_shown_is_inside() -> None:
    panel = Panel(
        title="free", x=Axis(label="t"), y=Axis(label="v", log=True), curves=(curve(upper=9 * DEVIATION),)
    )
    (left, right), (low, high) = limits_of(panel)
    assert left < 0.01 and right > 100 and low < 1.1 and high > 270
    assert limits_of(Panel(title="empty", x=Axis(label=""), y=Axis(label="", log=True))) == ((0, 1), (1, 10))


# -- words --------------------------------------------------------------------------------------------------------


def everything() -> Panel:
    return logarithmic(
        curve(marker="circle", lower=0.9 * DEVIATION, upper=1.1 * DEVIATION, band_label="95 % interval"),
        curve(label="model", style="dashed", colour="model"),
        guides=(Guide(x=(0.01, 100.0), y=(30.0, 0.3), name="-1/2", name_x=1.0, slope=-0.5),),
        labels=(
            Label(x=1.0, y=3.0, text="N = 3", colour="ink"),
            Label(x=10.0, y=1.0, text="here", colour="ink", place="line"),
            Label(x=1.0, y=2.0, text="goal", colour="ink", place="level"),
        ),
        limits=(Limit(x=TAU, y=0.1 * TAU, at=(10.0, 1.0), text="K < 1"),),
        spans=(
            ShadedSpan(start=0.1, stop=0.2, kind="quiet"),
            ShadedSpan(start=0.3, stop=0.4, kind="unknown"),
            ShadedSpan(start=1.0, stop=2.0, kind="finding"),
        ),
        rugs=(Rug(x=TAU, label="turns", colour="purple"),),
        envelopes=(Envelope(x=TAU, low=0.5 * TAU, high=TAU, label="record", colour="z"),),
        key="above",
    )


def test_all_that_a_panel_says_is_written() -> None:
    panel = everything()
    written = words(drawn(sheet(panel, panel)))
    for text in (
        "-1/2",
        "N = 3",
        "here",
        "goal",
        "K < 1",
        panel.title,
        panel.x.label,
        panel.y.label,
        *panel.entries,
    ):
        assert written.count(text) == 2, text
    assert set(panel.entries) == {
        "at rest, used", "direction not known", "turns", "record", "measured", "model", "95 % interval"
    }  # fmt: skip


def test_a_legend_covers_no_point_where_there_is_room() -> None:
    flat = np.full(TAU.size, 40.0)  # at the top: the legend goes to the foot
    picture = drawn(sheet(logarithmic(curve(y=flat), curve(y=flat, label="model"))))
    entries = [t for t in picture.iter(f"{SVG}text") if t.text in ("measured", "model")]
    ink = [numbers(w)[1] for w in ways(picture, stroke="#c8442c") if w.count("L") == TAU.size - 1]
    assert all(float(entry.get("y", 0)) > max(ink) + 20 for entry in entries)


@pytest.mark.parametrize("name", ["<b>bold</b> & more", "a\x07\x1b[31mb", "日本", "]]>", "two\nlines"])
def test_names_are_text_and_never_markup(name: str) -> None:
    shown = sheet(logarithmic(curve(label=name), curve(label="other")), logarithmic(curve(label=name)))
    assert any(name[:1] in text for text in words(drawn(shown)))
    assert svg(shown).isprintable() or "\x1b" not in svg(shown)


@pytest.mark.parametrize("view", ["channels", "groups", "spectrum", "record"])
def test_a_study_has_the_words_of_its_paper_figure(view: str) -> None:
    shown = sheet_of(sample_study.build(), view=view)
    written = set(words(drawn(shown)))
    figure = paper.figure(shown)
    for axes, panel in zip(figure.axes, shown.panels, strict=True):
        points = {label.text for label in panel.labels} | {limit.text for limit in panel.limits}
        assert points | {axes.get_ylabel()} <= written
        ticks = axes.get_yticklabels() + (axes.get_xticklabels() if axes.get_xlabel() else [])
        assert {tick.get_text() for tick in ticks} <= written
        legend = axes.get_legend()
        assert legend is None or {t.get_text() for t in legend.get_texts()} <= written


def test_a_part_of_a_paper_figure_has_numbers() -> None:
    (axes,) = paper.figure(sheet(logarithmic(curve()))).axes
    axes.set_xlim(1.2, 1.9)
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [f"1.{digit}" for digit in range(2, 10)]


# -- ticks --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "log", "expected"),
    [
        ((0.005, 200.0), True, ["0.01", "0.1", "1", "10", "100"]),
        (
            (1e-6, 1e5),
            True,
            ["10⁻⁶", "10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "1", "10", "100", "1000", "10⁴", "10⁵"],
        ),
        ((1.5, 30.0), True, ["2", "5", "10", "20"]),
        ((1.2, 4.5), True, ["2", "3", "4"]),
        ((1.2, 1.9), True, ["1.2", "1.3", "1.4", "1.5", "1.6", "1.7", "1.8", "1.9"]),
        ((-60.0, 60.0), False, ["−60", "−40", "−20", "0", "20", "40", "60"]),
        ((-2e-7, 3e-7), False, ["−2×10⁻⁷", "−1×10⁻⁷", "0", "1×10⁻⁷", "2×10⁻⁷", "3×10⁻⁷"]),
        ((0.0, 0.05), False, ["0", "0.01", "0.02", "0.03", "0.04", "0.05"]),
        ((0.0, 0.0), False, ["0"]),
    ],
)
def test_ticks_are_round_numbers(limits: tuple[float, float], log: bool, expected: list[str]) -> None:
    ticks = ticks_of(Axis(label="", log=log), limits, 420.0, 60.0 if not log else 34.0)
    assert [name for _, name in ticks.major] == expected
    assert all(limits[0] <= at <= limits[1] for at in ticks.minor)


def test_ticks_that_would_touch_are_left_out() -> None:
    ticks = ticks_of(Axis(label="", log=True), (1e-12, 1e12), 240.0, 34.0)
    assert [name for _, name in ticks.major] == ["10⁻¹²", "10⁻⁸", "10⁻⁴", "1", "10⁴", "10⁸", "10¹²"]
    names = ticks_of(Axis(label="", names=((1, "one"), (9, "nine"))), (0.0, 5.0), 100.0, 30.0)
    assert [name for _, name in names.major] == ["one"]


# -- files --------------------------------------------------------------------------------------------------------


def test_equal_sheets_give_equal_pictures_and_load_no_drawing_library() -> None:
    assert svg(sheet(everything())) == svg(sheet(everything()))
    code = (
        "import sys; from allanite.noise import NoiseModel, White\n"
        "from allanite.views.figures import sheet_of\n"
        "from allanite.views.figures.picture import svg\n"
        "svg(sheet_of(NoiseModel.of(White(N=1.0))))\n"
        "print([name for name in ('matplotlib', 'pandas') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, timeout=60, capture_output=True, text=True
    )
    assert done.stdout == "[]\n"
