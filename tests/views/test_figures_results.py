# SPDX-License-Identifier: BSD-3-Clause
"""Figures of Earth rate, turns, filter, plan and north: series, units, spans, and the same on paper and on screen."""

from __future__ import annotations

import io
import json
import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.experiments.earth_rate import EarthRateEstimate, measure_earth_rate
from allanite.experiments.north import Arc, NorthEstimate, RunningNorth
from allanite.experiments.north.circle import CIRCLE
from allanite.experiments.north.verdict import NorthVerdict
from allanite.experiments.planning import Plan, plan
from allanite.experiments.reference_aided import ReferenceAided, reference_aided
from allanite.filtering.kalman import Filtered, filter_recording
from allanite.noise import NoiseModel, White
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity
from allanite.views.figures import matplotlib as paper
from allanite.views.figures import screen, sheet_of
from allanite.views.figures.drawing import DrawnShape, Words, arrow, box
from allanite.views.figures.panel import DARK, LIGHT, SPAN_LOOKS, Curve, Panel, Sheet
from allanite.views.figures.records import overview
from allanite_seed_paper import twin as seed_paper

DEG = math.radians(1)
DEG_H = DEG / 3600


@pytest.fixture(scope="module")
def take() -> al.Recording:
    return seed_paper.take(2, seed=11)


@pytest.fixture(scope="module")
def estimate(take: al.Recording) -> EarthRateEstimate:
    return measure_earth_rate(take, latitude=seed_paper.LATITUDE, model=seed_paper.sensor())


@pytest.fixture(scope="module")
def at_rest() -> al.Recording:
    return seed_paper.week(seed=5, duration=600.0)


@pytest.fixture(scope="module")
def filtered(at_rest: al.Recording) -> Filtered:
    return filter_recording(at_rest, seed_paper.sensor())


@pytest.fixture(scope="module")
def planned() -> Plan:
    options: dict[str, Any] = {"dwells": (10.0, 30.0, 300.0), "durations": (720.0, 7200.0, 86400.0)}
    return plan(NoiseModel.of(White(N=seed_paper.N)), latitude=seed_paper.LATITUDE, **options)


@pytest.fixture(scope="module")
def aided(take: al.Recording, estimate: EarthRateEstimate) -> ReferenceAided:
    signs = estimate.reversals.signs()
    return reference_aided(take, seed_paper.sensor(), reference=EARTH_RATE, signs=signs)


def north(**changes: Any) -> NorthEstimate:
    """A search for north whose mark points to 350 deg, with an arc over north."""
    running = RunningNorth(
        time=np.array([60.0, 120.0]),
        azimuth=np.array([6.2, 6.1]),
        sd=np.array([0.3, 0.2]),
        horizontal_rate=np.array([6e-5, 5e-5]),
    )
    facts: dict[str, Any] = {
        "verdict": NorthVerdict.RESOLVED,
        "azimuth": math.radians(350),
        "sd": 0.1,
        "total_sd": 0.1,
        "confidence": 0.95,
        "inflation": 1.0,
        "interval": (Arc(math.radians(335), math.radians(30)),),
        "candidates": (math.radians(350),),
        "signal_to_noise": 12.0,
        "horizontal": Quantity.of(5e-5, (4e-5, 6e-5), "rad/s"),
        "horizontal_sd": 5e-6,
        "expected_rate": 5.2e-5,
        "biases": {"x": (0.0, 1e-6)},
        "running": running,
        "latitude": seed_paper.LATITUDE,
        "axes": {"x": 0.0},
        "models": {"x": seed_paper.sensor()},
        "duration": 120.0,
        "block": 1.0,
        "source": "table.csv",
    }
    return NorthEstimate(**{**facts, **changes})


def named(shown: Panel, start: str) -> Curve:
    return next(curve for curve in shown.curves if curve.label.startswith(start))


# -- Earth rate -------------------------------------------------------------------------------------------


def test_the_running_estimate_is_in_deg_per_hour_with_its_band(estimate: EarthRateEstimate) -> None:
    (shown,) = sheet_of(estimate, view="running").panels
    line, running = named(shown, "regression"), estimate.running
    assert "[deg/h]" in shown.y.label and "[min]" in shown.x.label
    np.testing.assert_allclose(line.y * DEG_H, running.rate)
    np.testing.assert_allclose(line.x * 60, running.time)
    assert line.lower is not None and line.upper is not None
    known = np.isfinite(running.sd)
    half = (line.upper - line.y)[known] * DEG_H
    np.testing.assert_allclose(half, 1.959964 * running.sd[known], rtol=1e-6)
    np.testing.assert_allclose((line.y - line.lower)[known] * DEG_H, half)
    np.testing.assert_allclose(named(shown, "mean of the pairs").y * DEG_H, running.pairs)
    assert named(shown, "known rate 15.041 deg/h").y[0] * DEG_H == pytest.approx(EARTH_RATE)
    result = named(shown, "result")
    assert (result.lower[0] * DEG_H, result.upper[0] * DEG_H) == pytest.approx(estimate.interval)  # type: ignore[index]


def test_a_wild_beginning_does_not_squash_the_rest(estimate: EarthRateEstimate) -> None:
    document = estimate.to_json()
    calm = sheet_of(document, view="running").panels[0].y.limits
    running = document["running"]
    wild = {**running, "sd": [1.0, None, *running["sd"][2:]], "rate": [5.0, None, *running["rate"][2:]]}
    limits = sheet_of({**document, "running": wild}, view="running").panels[0].y.limits
    assert limits == calm
    assert limits is not None and limits[0] < EARTH_RATE / DEG_H < limits[1]
    half = (estimate.interval[1] - estimate.interval[0]) / 2 / DEG_H  # the band goes with 1/sqrt(time)
    assert (
        limits[1] - limits[0] < 2 * half / math.sqrt(0.2) + 4 * half + abs(estimate.rate - EARTH_RATE) / DEG_H
    )


def test_dwells_are_told_apart_by_colour_and_marker(estimate: EarthRateEstimate) -> None:
    (shown,) = sheet_of(estimate, view="dwells").panels
    north_, south = named(shown, "north"), named(shown, "south")
    assert (north_.colour, north_.marker) != (south.colour, south.marker)
    assert north_.colour != south.colour and north_.marker != south.marker
    dwells = [d for d in estimate.dwells if d.sign == 1]
    np.testing.assert_allclose(north_.y * DEG_H + estimate.bias[0], [d.mean for d in dwells])
    assert north_.bars and north_.upper is not None
    np.testing.assert_allclose((north_.upper - north_.y) * DEG_H, [d.sd for d in dwells])
    alone = named(shown, "the Earth alone")
    assert np.nanmax(alone.y) * DEG_H == pytest.approx(EARTH_RATE * math.cos(seed_paper.LATITUDE))
    (left,) = sheet_of(estimate, view="residuals").panels
    np.testing.assert_allclose(named(left, "north").y * DEG_H, [d.residual for d in dwells])


def test_the_dead_time_that_was_used_stands_out(estimate: EarthRateEstimate) -> None:
    (shown,) = sheet_of(estimate, view="dead-time").panels
    np.testing.assert_allclose(named(shown, "regression").x, estimate.dead_times[:, 0])
    np.testing.assert_allclose(named(shown, "regression").y * DEG_H, estimate.dead_times[:, 1])
    assert named(shown, "2 s, as used").x.tolist() == [2.0]


def test_three_estimators_stand_side_by_side(estimate: EarthRateEstimate) -> None:
    (shown,) = sheet_of(estimate, view="estimators").panels
    assert [name for _, name in shown.x.names] == ["pairs", "north-south-north", "regression"]
    np.testing.assert_allclose(shown.curves[0].y * DEG_H, [r.rate for r in estimate.readings])
    assert named(shown, "result").y[0] * DEG_H == pytest.approx(estimate.rate)


def test_a_document_is_drawn_as_the_result_itself(
    estimate: EarthRateEstimate, filtered: Filtered, planned: Plan
) -> None:
    for result, words in ((estimate, {}), (planned, {}), (filtered, {"view": "drift"})):
        document = {"format": "allanite-filtered", **result.to_json()}  # its own format wins
        assert screen.spec(sheet_of(document, **words)) == screen.spec(sheet_of(result, **words))


def test_without_reversals_the_bias_for_each_direction_is_shown(at_rest: al.Recording) -> None:
    model = seed_paper.sensor()
    found = measure_earth_rate(at_rest, latitude=seed_paper.LATITUDE, model=model)
    (shown,) = sheet_of(found).panels
    seen = EARTH_RATE * math.cos(seed_paper.LATITUDE)
    np.testing.assert_allclose(shown.curves[0].y * DEG_H, found.bias[0] + np.array([-seen, 0.0, seen]))
    with pytest.raises(InputError, match="no figure 'running'"):
        sheet_of(found, view="running")


def test_a_document_with_its_overview_draws_its_record(
    estimate: EarthRateEstimate, take: al.Recording
) -> None:
    document = {**estimate.to_json(), "overview": overview(take, take.names[0])}
    assert len(sheet_of(document).panels) == len(sheet_of(estimate).panels) + 1
    assert len(sheet_of(document, view="record").panels[0].envelopes) == 1


# -- turns ------------------------------------------------------------------------------------------------


def test_turns_are_spans_on_the_time_axis(take: al.Recording, estimate: EarthRateEstimate) -> None:
    (shown,) = sheet_of(take, turns=estimate).panels
    found = [(s.start * 60, s.stop * 60) for s in shown.spans if s.kind == "turn"]
    turns = estimate.reversals.turns
    np.testing.assert_allclose(found, [(t.start / take.rate, t.stop / take.rate) for t in turns])
    assert "[deg/s]" in shown.y.label
    assert [name for _, name in shown.x.landmarks] == ["N", "S"] * 12
    same = sheet_of(estimate.reversals, recording=overview(take, take.names[0])).panels[0]
    assert same.spans == shown.spans


def test_many_turns_become_strokes_at_the_foot(take: al.Recording, estimate: EarthRateEstimate) -> None:
    reversals = estimate.reversals.to_json()
    reversals["turns"] = [{"start": 500 * i, "stop": 500 * i + 60} for i in range(1, 46)]
    (shown,) = sheet_of(reversals, recording=take).panels
    assert not any(span.kind == "turn" for span in shown.spans)
    np.testing.assert_allclose(shown.rugs[0].x * 60, (500 * np.arange(1, 46) + 30) / take.rate)


def test_what_is_not_used_says_why(take: al.Recording, estimate: EarthRateEstimate) -> None:
    reversals = estimate.reversals.to_json()
    reversals["positions"][5] |= {"sign": 0, "heading": None}
    reversals["disturbed"] = [{"start": 9600, "stop": 9920, "kind": "handling", "hides": True}]
    sheet = sheet_of(reversals, recording=take)
    (shown,) = sheet.panels
    spans = {s.kind: s for s in shown.spans}
    assert set(spans) == {"turn", "disturbed", "unknown"}
    assert (spans["disturbed"].start * 60, spans["disturbed"].stop * 60) == pytest.approx((300.0, 310.0))
    position = reversals["positions"][5]
    assert spans["unknown"].start * 60 * take.rate == pytest.approx(position["start"])
    words = {look.words for look in SPAN_LOOKS.values() if look.words}
    words -= {"dead time, not used", "at rest, used"}  # not in this picture
    assert words <= {t.get_text() for t in paper.figure(sheet).axes[0].get_legend().get_texts()}  # type: ignore[union-attr]
    (document,) = screen.spec(sheet)["panels"]
    assert words <= {entry["words"] for entry in document["legend"]}
    (hatched,) = (span for span in document["spans"] if span.get("hatched"))
    assert (hatched["start"], hatched["stop"]) == pytest.approx(
        (spans["unknown"].start, spans["unknown"].stop), rel=1e-5
    )


def test_a_turn_at_close_range(take: al.Recording, estimate: EarthRateEstimate) -> None:
    whole, close = sheet_of(estimate.reversals, recording=take, zoom=3).panels
    turn = estimate.reversals.turns[2]
    assert whole.x.limits is not None
    assert whole.x.limits[0] == pytest.approx(turn.start / 32 - 8) and whole.x.limits[0] < turn.stop / 32
    dead = next(s for s in close.spans if s.kind == "dead" and s.stop > turn.stop / 32)
    assert (dead.start, dead.stop) == pytest.approx((turn.stop / 32, estimate.reversals.dwells[3].start / 32))
    assert close.y.limits is not None  # six standard deviations of a sample to either side of the level
    sd = seed_paper.N * math.sqrt(take.rate) / DEG
    assert (close.y.limits[1] - close.y.limits[0]) / 12 == pytest.approx(sd, rel=0.15)
    with pytest.raises(InputError, match="no turn 99"):
        sheet_of(estimate.reversals, recording=take, zoom=99)
    with pytest.raises(InputError, match="needs the Recording"):
        sheet_of(estimate.reversals, recording=overview(take, take.names[0]), zoom=1)
    with pytest.raises(InputError, match="pass recording="):
        sheet_of(estimate.reversals)


# -- filter, plan, north ----------------------------------------------------------------------------------


def test_the_drift_has_a_band_of_two_sd(filtered: Filtered) -> None:
    (shown,) = sheet_of(filtered, view="drift").panels
    (drift,) = shown.curves
    assert "[deg/h]" in shown.y.label
    rows = np.round(drift.x * filtered.rate * 60).astype(
        int
    )  # middles of blocks; the drift hardly moves in them
    np.testing.assert_allclose(drift.y * DEG_H, filtered.drift[rows - 1], atol=5e-6)
    assert drift.upper is not None
    late = rows > 1000
    np.testing.assert_allclose(
        ((drift.upper - drift.y) / 2 * DEG_H)[late], filtered.drift_sd[rows - 1][late], rtol=0.02
    )


def test_measured_and_corrected_are_shown_with_every_slow_term(filtered: Filtered) -> None:
    panels = sheet_of(filtered).panels
    assert [p.title.split(":")[0].split(" ")[0] for p in panels[:2]] == ["Measured", "Corrected"]
    labels = [curve.label for curve in sheet_of(filtered, view="terms").panels[0].curves]
    assert labels == ["Gauss-Markov", "random walk"]
    document = {**filtered.to_json(), "measured": None}
    assert len(sheet_of(document, view="series").panels) == 1


def test_whiteness_is_judged_by_its_bounds(filtered: Filtered) -> None:
    (shown,) = sheet_of(filtered, view="whiteness").panels
    band, stems = shown.curves
    assert band.upper is not None
    assert band.upper[0] == pytest.approx(1.96 / math.sqrt(filtered.consistency.count))
    np.testing.assert_allclose(stems.y, filtered.consistency.correlations)
    assert stems.x.tolist() == list(range(1, 21))
    assert "NIS" in shown.title


def test_a_plan_in_percent_with_its_goal_and_best_dwell(planned: Plan) -> None:
    by_dwell, by_length = sheet_of(planned).panels
    assert "% of the Earth rate" in by_dwell.y.label and by_dwell.x.log and by_dwell.y.log
    for i, curve in enumerate(by_dwell.curves):
        finite = np.isfinite(planned.total[:, i])
        np.testing.assert_allclose(curve.y[finite], 100 * planned.total[finite, i] / EARTH_RATE)
        assert curve.hollow is not None
        assert curve.x[~curve.hollow].tolist() == [planned.best[i]]
    (goal,) = by_dwell.labels
    assert (goal.y, goal.text, goal.place) == (pytest.approx(3.0), "goal 3 %", "level")
    reached = next(label for label in by_length.labels if label.place == "point")
    assert reached.x == planned.duration


def test_several_dead_times_in_one_figure(planned: Plan) -> None:
    other = {**planned.to_json(), "dead_time": 5.0}
    (shown,) = sheet_of([planned.to_json(), other]).panels
    assert [c.label for c in shown.curves] == ["2 s lost at each turn", "5 s lost at each turn"]
    assert "in a record of 2 h" in shown.x.label


def test_the_compass_points_from_north_over_east() -> None:
    drawing = sheet_of(north(), view="compass").panels[0].drawing
    assert drawing is not None
    (needle,) = drawing.named("mark")
    (head,) = drawing.named("mark head")
    (x, y), tip = needle.points[0], head.points[0]
    assert math.degrees(math.atan2(tip[0] - x, tip[1] - y)) == pytest.approx(-10)
    (arc,) = drawing.named("arc")
    ends = [math.degrees(math.atan2(p[0] - x, p[1] - y)) for p in (arc.points[1], arc.points[-1])]
    assert ends == pytest.approx([-25.0, 5.0])
    assert "azimuth of the mark 350 deg" in drawing.words
    assert "95 % interval 335 to 5 deg" in drawing.words


def test_e8_no_north_is_the_full_circle_and_no_needle() -> None:
    estimate = north(verdict=NorthVerdict.NO_NORTH, interval=(CIRCLE,))
    drawing = sheet_of(estimate, view="compass").panels[0].drawing
    assert drawing is not None
    assert not drawing.named("mark")
    (arc,) = drawing.named("arc")
    x, y = arc.points[0]
    around = np.degrees([math.atan2(px - x, py - y) for px, py in arc.points[1:]])
    assert np.ptp(np.unwrap(around, period=360)) == pytest.approx(360)
    assert any("every direction" in words for words in drawing.words)


def test_two_candidates_are_both_shown() -> None:
    nan = np.array([math.nan])
    estimate = north(
        interval=(Arc(1.0, 0.1), Arc(5.0, 0.1)),
        azimuth=math.nan,
        horizontal=Quantity.of(math.nan, (0.0, math.inf), "rad/s"),
        candidates=(1.05, 5.05),
        running=RunningNorth(time=np.array([60.0]), azimuth=nan, sd=nan, horizontal_rate=nan),
    )
    (shown,) = sheet_of(estimate).panels  # no running estimate to draw
    assert shown.drawing is not None
    assert len(shown.drawing.named("candidate")) == len(shown.drawing.named("arc")) == 2


def test_e5_the_running_azimuth_wraps() -> None:
    azimuth, _ = sheet_of(
        north(running=replace(north().running, azimuth=np.array([0.05, 6.1]))), view="running"
    ).panels
    away = math.degrees(0.05) + 10
    assert azimuth.curves[0].y[0] == pytest.approx(away)


def test_reference_aided_is_drawn_and_named_as_such(aided: ReferenceAided) -> None:
    raw, corrected, means, states = sheet_of(aided).panels
    assert "not a measurement" in corrected.title
    assert "Reference-aided" in means.title
    assert means.labels[0].y * DEG / 1000 == pytest.approx(aided.mean_reference)
    row = round(means.curves[0].x[-1] * 60 * aided.rate - 0.5)
    assert means.curves[0].y[-1] * DEG / 1000 == pytest.approx(aided.cumulative_corrected[row])
    assert raw.curves[0].y[-1] * DEG / 1000 == pytest.approx(aided.cumulative_raw[row])
    assert raw.x.limits == pytest.approx((0.0, 12.0))
    np.testing.assert_allclose(states.curves[1].y[-1] * DEG, aided.states[-1, 1])
    (reading,) = aided.result.readings
    both = replace(aided.result, readings=(replace(reading, states=None),) * 2)  # as documents hold them
    assert [p.title for p in sheet_of(both).panels[2:]] == [means.title] * 2


# -- drawings ---------------------------------------------------------------------------------------------


def test_an_arrow_ends_at_its_point() -> None:
    line, head = arrow((0.0, 0.0), (10.0, 0.0), width=2.0)
    assert head.points[0] == (10.0, 0.0)
    assert 0 < line.points[-1][0] < 10.0 and head.fill == "ink"
    assert len(arrow((0.0, 0.0), (9.0, 0.0), both=True)) == 3
    assert len(box(0, 0, 2, 1).points) == 4 and len(box(0, 0, 2, 1, round_=0.3).points) > 4


# -- paper and screen -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sheets(
    take: al.Recording, estimate: EarthRateEstimate, filtered: Filtered, planned: Plan, aided: ReferenceAided
) -> dict[str, Sheet]:
    return {
        "earth rate": sheet_of(estimate),
        "turn": sheet_of(estimate.reversals, recording=take, zoom=1),
        "filtered": sheet_of(filtered),
        "plan": sheet_of(planned),
        "north": sheet_of(north()),
        "aided": sheet_of(aided),
    }


KINDS = ("earth rate", "turn", "filtered", "plan", "north", "aided")


@pytest.mark.parametrize("kind", KINDS)
def test_both_renderers_draw_all_of_it(sheets: dict[str, Sheet], kind: str) -> None:
    sheet = sheets[kind]
    drawn, document = paper.figure(sheet), screen.spec(sheet)["panels"]
    assert len(drawn.axes) == len(sheet.panels) == len(document)
    for axes, shown, stated in zip(drawn.axes, sheet.panels, document, strict=True):
        if shown.drawing is None:
            assert (
                {t.get_text() for t in axes.get_legend().get_texts()} == set(shown.entries)
                if shown.key == "above"
                else True
            )
            assert axes.get_xlim() == pytest.approx(shown.x.limits)
            assert stated["x"]["limits"] == pytest.approx(shown.x.limits, rel=1e-5)
            assert [entry["words"] for entry in stated.get("legend", [])] == list(shown.entries)
            for name in ("curves", "envelopes", "spans", "rugs", "labels", "limits", "guides"):
                assert len(stated.get(name, [])) == len(getattr(shown, name)), name
            continue
        outlines = [p for p in shown.drawing.parts if isinstance(p, DrawnShape)]
        words = [p for p in shown.drawing.parts if isinstance(p, Words)]
        assert (len(axes.patches), len(axes.texts)) == (len(outlines), len(words))
        assert [part["text"] for part in stated["drawing"]["parts"] if "text" in part] == [
            w.text for w in words
        ]
        assert sum("points" in part for part in stated["drawing"]["parts"]) == len(outlines)


@pytest.mark.parametrize("kind", KINDS)
def test_every_axis_says_its_unit(sheets: dict[str, Sheet], kind: str) -> None:
    for shown in sheets[kind].panels:
        for axis in (shown.x, shown.y):
            assert shown.drawing is not None or axis.names or "[" in axis.label


@pytest.mark.parametrize("kind", ["earth rate", "north"])
def test_the_dark_figure_has_no_colour_of_the_light_one(sheets: dict[str, Sheet], kind: str) -> None:
    file = io.StringIO()
    paper.figure(sheets[kind], dark=True).savefig(file, format="svg")
    text = file.getvalue()
    shared = set(LIGHT.values()) & set(DARK.values())
    assert not [colour for colour in LIGHT.values() if colour in text and colour not in shared]
    assert not re.search(
        "#[0-9a-f]{6}", json.dumps(screen.spec(sheets[kind]))
    )  # names, which the style resolves
    assert '<html lang="en" data-theme="dark">' in screen.ScreenFigure(sheets[kind], dark=True).to_html()


def test_a_legend_above_a_panel_has_room(sheets: dict[str, Sheet]) -> None:
    drawn = paper.figure(sheets["earth rate"])
    drawn.savefig(io.BytesIO(), format="png", dpi=50)
    whole = drawn.bbox
    boxes = [axes.get_window_extent() for axes in drawn.axes]
    for axes in drawn.axes:
        legend = axes.get_legend().get_window_extent()  # type: ignore[union-attr]
        assert legend.x1 < whole.x1 + 4 and legend.y1 < whole.y1
        assert not any(legend.overlaps(box_) for box_ in boxes if box_.y0 > axes.get_window_extent().y1 + 1)


@pytest.mark.parametrize(("view", "obj"), [("pie", "estimate"), ("pie", "filtered"), ("pie", "north")])
def test_unknown_views_are_refused(request: pytest.FixtureRequest, view: str, obj: str) -> None:
    thing = north() if obj == "north" else request.getfixturevalue(obj)
    with pytest.raises(InputError, match="no view 'pie'"):
        sheet_of(thing, view=view)
