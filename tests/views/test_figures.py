# SPDX-License-Identifier: BSD-3-Clause
"""Figures: what they show is right, and paper and screen show the same."""

from __future__ import annotations

import io
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
import sample_study
from allanite.errors import InputError, StorageError
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, White
from allanite.views.figures import matplotlib as paper
from allanite.views.figures import screen, sheet_of
from allanite.views.figures.panel import DARK, LIGHT, Panel
from allanite.views.figures.picture import svg

DEG_H = math.radians(1) / 3600
VIEWS = ("channels", "groups", "spectrum", "record")


@pytest.fixture(scope="module")
def study() -> dict[str, Any]:
    return sample_study.build()


@pytest.fixture(scope="module")
def recording() -> al.Recording:
    rng = np.random.default_rng(5)
    samples = rng.normal(0, 0.01, (50_000, 2))
    samples[30_000, 0] = 3.0  # a spike that an overview of 1500 blocks must not lose
    samples[10_000:12_500, 0] = np.nan
    return al.Recording.from_rate(samples, rate=100.0, unit="deg/s", names=["gyro_y", "gyro_x"])


def panel(obj: Any, **options: Any) -> Panel:
    return sheet_of(obj, **options).panels[0]


# -- what is shown ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("term", "symbol", "at"),
    [
        (Quantisation(Q=3 * DEG_H), "Q", math.sqrt(3)),
        (White(N=1e-4), "N", 1.0),
        (RandomWalk(K=1e-6), "K", 3.0),
        (Ramp(R=1e-8), "R", math.sqrt(2)),
    ],
)
def test_at_the_reading_point_the_line_of_a_term_is_as_high_as_its_coefficient(
    term: Any, symbol: str, at: float
) -> None:
    shown = panel(NoiseModel.of(term), tau=(0.1, 100.0))
    (label,), (guide,) = shown.labels, shown.guides
    assert label.x == pytest.approx(at)
    assert label.y * DEG_H == pytest.approx(getattr(term, symbol), rel=1e-12)
    assert guide.y[0] * (label.x / guide.x[0]) ** guide.slope == pytest.approx(label.y, rel=1e-9)


def test_flicker_is_read_as_the_minimum_over_0664() -> None:
    shown = panel(NoiseModel.of(White(N=1e-4), Flicker(B=5 * DEG_H), RandomWalk(K=1e-6)))
    label = next(text for text in shown.labels if text.text.startswith("B"))
    total = shown.curves[0]
    assert label.y / 0.6643 == pytest.approx(5.0, rel=1e-3)
    assert label.x == pytest.approx(total.x[np.argmin(total.y)])


def test_a_gauss_markov_term_is_read_at_its_peak() -> None:
    shown = panel(NoiseModel.of(White(N=1e-5), GaussMarkov.from_sigma(1.0760 * 5 * DEG_H, 200.0)))
    label = next(text for text in shown.labels if "B_equiv" in text.text)
    assert (label.x, label.y / 0.6643) == (
        pytest.approx(1.8926 * 200, rel=1e-3),
        pytest.approx(5.0, rel=1e-3),
    )


def test_what_the_record_only_bounds_is_an_arrow_on_the_line_of_the_limit(study: dict[str, Any]) -> None:
    gyro_y = study["channels"][1]
    shown = panel(gyro_y)
    limit = next(found for found in shown.limits if found.text.startswith("K <"))
    upper = next(e["upper"] for e in gyro_y["models"][0]["estimates"] if e["symbol"] == "K")
    assert limit.at[1] * DEG_H == pytest.approx(upper * math.sqrt(limit.at[0] / 3), rel=1e-9)
    assert not any(text.text.startswith("K") for text in shown.labels)
    assert not any(guide.slope == 0.5 for guide in shown.guides)


@pytest.mark.parametrize("channel", range(6))
def test_points_arrows_and_words_of_lines_stand_inside_the_frame(study: dict[str, Any], channel: int) -> None:
    shown = panel(study["channels"][channel])
    places = [(text.x, text.y) for text in shown.labels] + [limit.at for limit in shown.limits]
    places += [(guide.name_x, guide.name_y) for guide in shown.guides]
    assert shown.x.limits is not None
    assert shown.y.limits is not None
    for x, y in places:
        assert shown.x.limits[0] < x < shown.x.limits[1]
        assert shown.y.limits[0] < y < shown.y.limits[1]


def test_lags_outside_the_fit_are_hollow(study: dict[str, Any]) -> None:
    unused = [not used for used in study["channels"][3]["curve"]["used"]]
    data = panel(study["channels"][3]).curves[0]
    assert data.hollow is not None
    assert data.hollow.tolist() == unused
    assert sum(unused) == 2


def test_the_curve_is_in_people_units(study: dict[str, Any]) -> None:
    channel = study["channels"][0]
    shown = panel(channel)
    assert "[deg/h]" in shown.y.label
    np.testing.assert_allclose(shown.curves[0].y * DEG_H, channel["curve"]["deviation"], rtol=1e-12)
    np.testing.assert_allclose(shown.curves[0].upper * DEG_H, channel["curve"]["upper"], rtol=1e-12)


def test_both_families_are_drawn_when_the_record_is_undecided(study: dict[str, Any]) -> None:
    styles = {curve.label: curve.style for curve in panel(study["channels"][1]).curves}
    assert styles["model (N, B)"] == "dashed"
    assert styles["or: model (N, Gauss-Markov)"] == "dashdot"


def test_axes_are_red_green_and_blue_by_their_letter_with_a_marker_each(study: dict[str, Any]) -> None:
    turned = {**study, "channels": [study["channels"][i] for i in (2, 0, 1)]}
    looks = {c.label: (c.colour, c.marker) for c in panel(turned, view="groups").curves[:3]}
    assert {name: look[0] for name, look in looks.items()} == {"gyro_x": "x", "gyro_y": "y", "gyro_z": "z"}
    assert len({look[1] for look in looks.values()}) == 3
    assert set(LIGHT) == set(DARK)


def test_the_model_is_drawn_as_its_samples_show_it(study: dict[str, Any]) -> None:
    channel = {**study["channels"][0], "curve": {**study["channels"][0]["curve"], "sampling": "point"}}
    channel["models"] = [{**NoiseModel.of(RandomWalk(K=1e-6)).to_json(), "estimates": []}]
    line = panel(channel).curves[1]  # at m = 1 a walk in points lies 50 % above that of means
    assert line.y[0] * DEG_H == pytest.approx(math.sqrt(1.5) * 1e-6 * math.sqrt(0.01 / 3), rel=1e-6)


def test_the_flat_part_of_the_spectrum_is_n(study: dict[str, Any]) -> None:
    shown = panel(study["channels"][5], view="spectrum")
    line = next(curve for curve in shown.curves if curve.style == "dashed")
    assert "[m/s/√h]" in shown.y.label
    assert line.y[0] == pytest.approx(0.041, rel=1e-3)
    assert [text.text for text in shown.labels] == ["line 12.5 Hz", "filter corner 20 Hz"]


def test_an_overview_keeps_the_spike_and_marks_the_gap(recording: al.Recording) -> None:
    shown = panel(recording)
    envelope = shown.envelopes[0]
    assert envelope.high.size <= 1500
    assert np.nanmax(envelope.high) == pytest.approx(3.0)
    assert [(span.start, span.stop) for span in shown.spans] == [
        (pytest.approx(100 / 60), pytest.approx(125 / 60))
    ]
    inside = (envelope.x > 100.5 / 60) & (envelope.x < 124.5 / 60)
    assert np.isnan(envelope.low[inside]).all()
    assert shown.envelopes[0].colour == "y"


def test_a_gap_over_the_edge_of_a_block_is_one_gap() -> None:
    samples = np.zeros(600_000)
    samples[250_000:300_000] = np.nan  # blocks end at 2**18
    shown = panel(al.Recording.from_rate(samples, rate=1.0, unit="V"))
    assert len(shown.spans) == 1


def test_places_of_findings_are_marked_in_their_channel_only(study: dict[str, Any]) -> None:
    panels = sheet_of(study, view="record").panels
    assert [sum(s.kind == "finding" for s in p.spans) for p in panels] == [0, 0, 1, 0, 0, 0]
    assert all(sum(s.kind == "gap" for s in p.spans) == 2 for p in panels)


# -- paper and screen ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", VIEWS)
def test_paper_and_screen_show_the_same(study: dict[str, Any], view: str) -> None:
    sheet = sheet_of(study, view=view)
    drawn = paper.figure(sheet)
    document = screen.spec(sheet)["panels"]
    axes = [a for a in drawn.axes if a.get_visible()]
    assert len(axes) == len(sheet.panels) == len(document)
    for paper_axes, shown, stated in zip(axes, sheet.panels, document, strict=True):
        if shown.x.limits:
            assert paper_axes.get_xlim() == pytest.approx(stated["x"]["limits"], rel=1e-3)
        words = {mark["text"] for name in ("labels", "limits") for mark in stated.get(name, ())}
        paper_words = {t.get_text() for t in paper_axes.texts}
        for text in [*shown.labels, *shown.limits]:
            assert text.text in words & paper_words
        for curve, plain in zip(shown.curves, stated.get("curves", ()), strict=True):
            assert plain["label"] == curve.label
            finite = np.isfinite(curve.y)
            assert np.array(plain["y"], dtype=float)[finite] == pytest.approx(curve.y[finite], rel=1e-5)
            assert [y is None for y in plain["y"]] == (~finite).tolist()


@pytest.mark.parametrize("view", ["channels", "groups"])
def test_equal_decades_are_square_on_paper(study: dict[str, Any], view: str) -> None:
    drawn = paper.figure(sheet_of(study, view=view))
    drawn.savefig(io.BytesIO(), format="png", dpi=50)
    for axes in drawn.axes:
        across = axes.transData.transform([(1.0, 1.0), (10.0, 1.0)])
        up = axes.transData.transform([(1.0, 1.0), (1.0, 10.0)])
        assert across[1][0] - across[0][0] == pytest.approx(up[1][1] - up[0][1], rel=1e-3)


@pytest.mark.parametrize("suffix", ["pdf", "svg", "png"])
def test_every_paper_format_is_written(study: dict[str, Any], suffix: str) -> None:
    target = io.BytesIO()
    al.plot(study["channels"][0]).savefig(target, format=suffix)
    assert len(target.getvalue()) > 10_000


def test_the_same_study_gives_the_same_picture(study: dict[str, Any]) -> None:
    sheet = sheet_of(study["channels"][0])
    first, second = svg(sheet), svg(sheet)
    assert first == second
    assert "N = 0.30012 deg/√h" in first
    assert "date" not in first.lower()


@pytest.mark.filterwarnings("ignore:Glyph")
@pytest.mark.parametrize("name", ["$\\frac{a}$", "<b>bold</b>", "a_b^c", "%s", "}{", "日本"])
def test_names_are_text_and_never_markup(study: dict[str, Any], name: str) -> None:
    channel = {**study["channels"][0], "name": name}
    al.plot({**study, "channels": [channel]}, view="record").savefig(io.BytesIO(), format="svg")
    al.plot(channel).savefig(io.BytesIO(), format="svg")
    page = al.plot(channel, interactive=True).to_html()
    assert page.count("<b>") == 0 and page.count("</script>") == 2  # ours


@pytest.mark.long
def test_figures_leave_no_trace_in_the_process() -> None:
    code = (
        "import sys, io, allanite as al; from allanite.noise import White\n"
        "from allanite_seed_paper.figures import figure_4\n"
        "al.plot(al.NoiseModel.of(White(N=1.0)))\n"
        "al.plot(figure_4().sheet).savefig(io.BytesIO(), format='pdf')\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, timeout=60)
    assert done.returncode == 0


def test_an_interactive_figure_brings_its_script_along(tmp_path: Path) -> None:
    figure = al.plot(NoiseModel.of(White(N=1.0)), interactive=True)
    page = figure.to_html()
    assert "AllaniteChart" in page and "<script src=" not in page
    assert "http" not in page.replace("http://www.w3.org", "")  # the name of SVG
    assert len(page) < 80_000
    frame = figure._repr_html_()
    assert frame.startswith("<iframe srcdoc=") and "<script" not in frame
    assert figure.save(tmp_path / "curve.html").read_text(encoding="utf-8") == page
    with pytest.raises(StorageError, match="--force"):
        figure.save(tmp_path / "curve.html")


# -- every result, and what has no figure -------------------------------------------------------------------


def test_a_curve_alone_is_drawn_with_a_key_of_slopes(recording: al.Recording) -> None:
    curve = al.allan_curve(recording.select("gyro_x"))
    shown = panel(curve)
    assert sorted(guide.slope for guide in shown.guides) == [-1.0, -0.5, 0.0, 0.5, 1.0]
    np.testing.assert_allclose(shown.curves[0].y * DEG_H, curve.deviation[:, 0])
    assert len(panel(curve, model=NoiseModel.of(White(N=1e-4))).curves) == 2


def test_channels_of_different_units_get_panels_of_their_own(rng: np.random.Generator) -> None:
    samples = rng.normal(size=(1000, 2))
    both = al.Recording.from_rate(samples, rate=10.0, unit="deg/s", names=["w", "f"])
    both = both.with_channels(
        lambda c: al.Channel.of(c.name, "m/s²") if c.name == "f" else c, {"step": "unit"}
    )
    assert [p.y.label.split("[")[1] for p in sheet_of(al.allan_curve(both)).panels] == ["deg/h]", "µg]"]


def test_a_spectrum_is_drawn(recording: al.Recording) -> None:
    from allanite.noise.spectrum.estimation import power_spectrum

    shown = panel(power_spectrum(recording, "gyro_x"), kind="rate")
    white = math.sqrt(0.01**2 / 100) * 60  # deg/√h
    assert np.median(shown.curves[0].y) == pytest.approx(white, rel=0.05)


@pytest.mark.parametrize("interactive", [False, True])
def test_a_study_object_and_its_parts_are_drawn(study: dict[str, Any], interactive: bool) -> None:
    whole = al.Study.from_json(study)
    for obj, options in [(whole, {}), (whole, {"channels": ["acc_z"]}), (whole["acc_z"], {"view": "record"})]:
        assert al.plot(obj, interactive=interactive, **options) is not None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"view": "pie"}, "no view 'pie'"),
        ({"channels": ["q"]}, "no channel 'q'"),
        ({"colour": "red"}, "'colour'"),
    ],
)
def test_unknown_options_are_refused(study: dict[str, Any], options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        al.plot(study, **options)


def test_what_has_no_figure_is_refused() -> None:
    with pytest.raises(InputError, match="no figure for a int"):
        al.plot(3)


def test_a_curve_without_a_single_value_is_still_a_figure(study: dict[str, Any]) -> None:
    curve = study["channels"][0]["curve"]
    nothing: list[None] = [None] * len(curve["lags"])
    bare = {**curve, "deviation": nothing, "lower": nothing, "upper": nothing}
    channel = {**study["channels"][0], "curve": bare, "models": []}
    assert al.plot(channel) is not None
    assert al.plot(channel, interactive=True) is not None


# -- axes of the caller -------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", VIEWS)
def test_a_figure_is_drawn_into_axes_that_are_given(study: dict[str, Any], view: str) -> None:
    from matplotlib.figure import Figure

    own = [a for a in al.plot(study, view=view).axes if a.get_visible()]
    made = Figure(figsize=(8, 3 * len(own)))
    given = made.subplots(len(own))
    assert al.plot(study, view=view, ax=given) is made
    assert made.axes == list(np.ravel(given))
    for one, other in zip(own, made.axes, strict=True):
        assert one.get_xlabel() == other.get_xlabel() or not one.get_xlabel()
        assert (one.get_ylabel(), len(one.lines)) == (other.get_ylabel(), len(other.lines))
        for drawn, again in zip(one.lines, other.lines, strict=True):
            np.testing.assert_array_equal(drawn.get_xydata(), again.get_xydata())


def test_axes_that_do_not_fit_are_refused(study: dict[str, Any]) -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots(7)
    with pytest.raises(al.InputError, match=r"axes, not 7"):
        al.plot(study, ax=axes)
    with pytest.raises(al.InputError, match="interactive"):
        al.plot(study, interactive=True, ax=axes)
