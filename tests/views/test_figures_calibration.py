# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a self-calibration: positions on the sphere, residuals, parameters, correlations."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.experiments.calibration import CalibrationEstimate
from allanite.views.figures import matplotlib as paper
from allanite.views.figures import screen, sheet_of
from allanite.views.figures.correlation import correlation
from allanite.views.figures.drawing import Drawing, DrawnShape, Words
from allanite.views.figures.panel import DARK, LIGHT, Curve, Panel, Sheet
from allanite.views.figures.picture import svg
from allanite.views.figures.sphere import SPOT_LOOKS, Spot, sphere, sphere_panel
from allanite.views.registry import document_of
from sample_calibration import DEG_H, LEFT_OUT, MG, OPEN, OUTLIER, estimate

Array = NDArray[np.float64]
OLD = Path(__file__).parents[1] / "experiments" / "documents"
CENTRES, RADIUS = ((25.5, 25.0), (74.5, 25.0)), 19.0
VIEW = np.array([0.80, 0.52, 0.28]) / np.linalg.norm([0.80, 0.52, 0.28])


def middle(shape: DrawnShape) -> Array:
    return np.mean(shape.points, axis=0)


def marks(drawing: Drawing, kind: str) -> list[Array]:
    """Places of the marks of a kind, without that in the legend."""
    return [middle(s) for s in drawing.named(kind) if middle(s)[1] > 4]


def named(shown: Panel, start: str) -> Curve:
    return next(curve for curve in shown.curves if curve.label.startswith(start))


def shown(view: str, **changes: Any) -> tuple[Panel, ...]:
    return sheet_of(estimate(**changes), view=view).panels


# -- sphere -----------------------------------------------------------------------------------------------


def random_directions(n: int) -> Array:
    d = np.random.default_rng(7).standard_normal((n, 3))
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def test_every_position_stands_on_one_half_at_its_distance_from_the_middle() -> None:
    directions = random_directions(40)
    for d in directions:
        (place,) = marks(sphere([Spot(up=(*d,))]), "used")
        half = 0 if d @ VIEW >= 0 else 1
        away = math.acos(abs(d @ VIEW))
        # Lambert's map of equal area, with the rim at a quarter turn.
        assert np.hypot(*(place - CENTRES[half])) == pytest.approx(
            RADIUS * math.sqrt(2) * math.sin(away / 2), abs=0.01
        )


@pytest.mark.long
def test_equal_areas_of_the_sphere_are_equal_areas_of_the_picture() -> None:
    directions = random_directions(2000)
    places = marks(sphere([Spot(up=(*d,)) for d in directions]), "used")
    far = np.array([min(np.hypot(*(p - c)) for c in CENTRES) for p in places]) / RADIUS
    inside = int(np.count_nonzero(far < math.sqrt(0.5)))  # half of the area
    assert abs(inside - 1000) < 3.29 * math.sqrt(2000 * 0.25)  # 99.9 % of a binomial law


def test_the_halves_are_seen_from_outside_with_z_up() -> None:
    spots = {name: Spot(up=up) for name, up in (("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1)))}
    at = {name: marks(sphere([spot]), "used")[0] - CENTRES[0] for name, spot in spots.items()}
    (a, b), (c, d) = at["y"] - at["x"], at["z"] - at["x"]
    assert a * d - b * c > 0  # x, y, z go round against the clock
    assert at["z"][1] == max(p[1] for p in at.values()) and abs(at["z"][0]) < 0.01
    opposite = marks(sphere([Spot(up=(0, 0, -1))]), "used")[0] - CENTRES[1]
    assert opposite[1] < 0 and abs(opposite[0]) < 0.01


def test_axes_are_named_where_they_stand() -> None:
    drawing = sphere([])
    assert {"+x", "+y", "+z", "−x", "−y", "−z"} <= set(drawing.words)
    assert len(drawing.named("axis")) == 6
    for i, axis in enumerate(np.eye(3)):
        (place,) = marks(sphere([Spot(up=(*axis,))]), "used")
        assert np.allclose(place, middle(drawing.named("axis")[i]), atol=0.01)


def test_faces_and_edges_stay_off_the_rim() -> None:
    lattice = [d for d in itertools.product((-1, 0, 1), repeat=3) if 0 < np.abs(d).sum() <= 2]
    places = marks(sphere([Spot(up=d) for d in lattice]), "used")
    assert len(places) == 18
    assert max(min(np.hypot(*(p - c)) for c in CENTRES) for p in places) < 0.96 * RADIUS


def test_kinds_differ_in_form_as_well_as_in_colour() -> None:
    looks = {(look.corners, look.filled) for look in SPOT_LOOKS.values()}
    assert len(looks) == len({look.colour for look in SPOT_LOOKS.values()}) == len(SPOT_LOOKS)
    spots = [Spot(up=(1, 1, 1), kind=kind) for kind in SPOT_LOOKS]
    assert {look.words for look in SPOT_LOOKS.values()} <= set(sphere(spots).words)
    assert "outlier" not in sphere(spots[:1]).words
    assert "wanted" in sphere(spots, words={"proposed": "wanted"}).words


def boxes(drawing: Drawing, labels: set[str]) -> list[tuple[float, float, float, float]]:
    found = [p for p in drawing.parts if isinstance(p, Words) and p.text in labels]
    half = [0.5 * len(w.text) * w.size for w in found]
    return [(w.x - h, w.y - w.size, w.x + h, w.y + w.size) for w, h in zip(found, half, strict=True)]


def test_numbers_do_not_cover_one_another() -> None:
    labels = {str(i) for i in range(50)}
    drawing = sphere([Spot(up=(*d,), label=str(i)) for i, d in enumerate(random_directions(50))])
    found = boxes(drawing, labels)
    assert len(found) >= 40  # the others have no room: a position that is nothing special may go without
    for one, other in itertools.combinations(found, 2):
        assert one[0] >= other[2] or other[0] >= one[2] or one[1] >= other[3] or other[1] >= one[3]


def test_positions_that_fall_together_share_one_number_and_outliers_always_have_theirs() -> None:
    same = [Spot(up=(1, 0.3, 0.2), label=str(i)) for i in range(1, 6)]
    assert "1, 2, 3 +2" in sphere(same).words
    crowd = [Spot(up=(*d,), label=str(i)) for i, d in enumerate(random_directions(400))]
    crowd[17] = Spot(up=crowd[17].up, label="here", kind="outlier")
    assert any("here" in words for words in sphere(crowd).words)


@pytest.mark.parametrize("up", [(0.0, 0.0, 0.0), (math.nan, 0.0, 1.0)])
def test_a_position_without_a_direction_has_no_mark(up: tuple[float, float, float]) -> None:
    assert not marks(sphere([Spot(up=up, label="1")]), "used")


def test_the_positions_of_a_calibration_are_on_the_sphere() -> None:
    (panel,) = shown("sphere")
    assert panel.drawing is not None
    found = estimate()
    assert len(marks(panel.drawing, "used")) == len(found.positions) - 2
    assert len(marks(panel.drawing, "outlier")) == len(marks(panel.drawing, "left out")) == 1
    assert {str(OUTLIER), str(LEFT_OUT)} <= set(panel.drawing.words)


def test_positions_to_add_are_on_the_sphere_where_they_were_said() -> None:
    add = ("z down", "on an edge, +x and -y up", "turn it about z by a quarter turn")
    drawing = shown("sphere", add=add)[0].drawing
    assert drawing is not None
    wanted = [marks(sphere([Spot(up=up)]), "used")[0] for up in ((0, 0, -1), (1, -1, 0))]
    assert np.allclose(sorted(map(tuple, marks(drawing, "proposed"))), sorted(map(tuple, wanted)), atol=0.01)


# -- residuals --------------------------------------------------------------------------------------------


def test_residuals_are_in_people_units_with_the_band_that_is_expected() -> None:
    found = estimate()
    force, rate, turns, misfit = shown("residuals")
    assert "[mg]" in force.y.label and "[deg/h]" in rate.y.label and "[mrad]" in turns.y.label
    used = [p for p in found.positions if p.used and not p.outlier]
    np.testing.assert_allclose(named(force, "position").y * MG, [p.excess for p in used])
    np.testing.assert_allclose(named(force, "position").x, [p.number for p in used])
    assert named(force, "outlier").x.tolist() == [OUTLIER]
    assert named(force, "outlier").y[0] * MG == pytest.approx(found.positions[OUTLIER - 1].excess)
    band = force.curves[0]
    assert band.upper is not None and band.lower is not None
    np.testing.assert_allclose(band.upper[::2] * MG, [1.959964 * p.excess_sd for p in found.positions])
    np.testing.assert_allclose(band.lower, -band.upper)
    for i, axis in enumerate("xyz"):
        np.testing.assert_allclose(named(rate, axis).y * DEG_H, [p.rate[i] for p in found.positions])  # type: ignore[index]
        np.testing.assert_allclose(named(turns, axis).y, [1e3 * t.residual[i] for t in found.turns if t.used])
    assert named(misfit, "outlier").y[0] == pytest.approx(8.2)
    assert len(named(misfit, "turn").x) == sum(t.used for t in found.turns)


def test_outliers_and_what_was_left_out_have_marks_of_their_own() -> None:
    force = shown("residuals")[0]
    looks = {(c.marker, c.colour) for c in force.curves if c.marker}
    assert len(looks) == 3
    (left,) = [c for c in force.curves if c.hollow is not None]
    assert left.x.tolist() == [LEFT_OUT]
    assert left.hollow is not None and left.hollow.all()


def test_small_residuals_are_in_micro_g() -> None:
    good = estimate()
    from dataclasses import replace

    fine = [replace(p, excess=1e-3 * (p.excess or 0.0), excess_sd=1e-6) for p in good.positions]
    panel = shown("residuals", positions=tuple(fine))[0]
    assert "[µg]" in panel.y.label


def test_one_triad_alone_has_its_own_figures() -> None:
    from dataclasses import replace

    still = tuple(replace(p, rate=None, rate_sd=None) for p in estimate().positions)
    titles = [p.title for p in shown("residuals", positions=still, turns=(), earth=None)]
    assert [t.split()[0] for t in titles] == ["Accelerometers", "Misfit:"]


# -- parameters and correlations --------------------------------------------------------------------------


def test_parameters_have_a_row_for_each_triad_and_a_panel_for_each_kind() -> None:
    sheet = sheet_of(estimate(), view="parameters")
    assert [[p.title.split(": ")[1] for p in row] for row in sheet.rows] == [
        ["bias [mg]", "scale factor [ppm]", "misalignment [mrad]"],
        ["bias [deg/h]", "scale factor [ppm]", "misalignment [mrad]"],
    ]
    found, bias = estimate(), sheet.rows[0][0].curves[0]
    for i, axis in enumerate("xyz"):
        row = found[f"accelerometer.bias_{axis}"]
        assert bias.lower is not None and bias.upper is not None
        drawn = [float(part[i]) * MG for part in (bias.lower, bias.y, bias.upper)]
        assert drawn == pytest.approx([row.interval[0], row.value, row.interval[1]])


def test_what_is_only_assumed_has_its_own_mark_and_does_not_squash_the_rest() -> None:
    scale = sheet_of(estimate(), view="parameters").rows[1][1]
    known, assumed = scale.curves
    assert (known.marker, known.colour) != (assumed.marker, assumed.colour)
    assert assumed.x.tolist() == [2.0] and len(known.x) == 2
    assert assumed.upper is not None and scale.y.limits is not None
    assert assumed.upper[0] > scale.y.limits[1]  # it runs out of the frame
    assert known.upper is not None and known.upper.max() < scale.y.limits[1]


def test_correlations_are_squares_whose_area_is_the_correlation() -> None:
    matrix = np.array([[1.0, 0.5, 0.0], [0.5, 1.0, -0.25], [0.0, -0.25, 1.0]])
    drawing = correlation(["a", "b", "c"], matrix)
    cell = 4.4
    (positive,) = [s for s in drawing.named("positive") if middle(s)[1] > 7]
    (negative,) = [s for s in drawing.named("negative") if middle(s)[1] > 7]
    side = max(x for x, _ in positive.points) - min(x for x, _ in positive.points)
    assert side == pytest.approx(0.86 * cell * math.sqrt(0.5))
    assert positive.fill and not negative.fill  # told apart without colour
    b, c = (next(p for p in drawing.parts if isinstance(p, Words) and p.text == n).y for n in ("b", "c"))
    assert (middle(positive)[1], middle(negative)[1]) == pytest.approx((b, c))


def test_correlations_are_those_of_what_was_estimated() -> None:
    (panel,) = shown("correlation")
    assert panel.drawing is not None
    assert "gyro scale factor x" in panel.drawing.words
    assert "gyro scale factor z" not in panel.drawing.words
    found = estimate()
    kept = [i for i, p in enumerate(found.parameters) if p.name not in OPEN]
    r = found.correlation[np.ix_(kept, kept)]
    lower = r[np.tril_indices(len(kept), -1)]
    drawn = [s for s in panel.drawing.named("positive") if middle(s)[1] > 7]
    assert len(drawn) == np.count_nonzero(lower >= 0.03)


# -- the log ----------------------------------------------------------------------------------------------


def test_the_log_is_drawn_with_its_rests_from_the_document_alone() -> None:
    """Of version 1, too, which held the overviews within the rests."""
    old = json.loads((OLD / "calibration-estimate-1-command-unit.json").read_text(encoding="utf-8"))
    document = document_of(old)
    titles = [p.title for p in sheet_of(document.result, view="log", recording=document.overviews).panels]
    assert titles == [
        f"10 static spans, {100 * old['static_spans']['share']:.3g} % of the record",
        "Rates",
        "Accelerations",
    ]
    again = document_of(json.loads(json.dumps(document.to_json())))
    assert [o.name for o in again.overviews or ()] == [o["name"] for o in old["static_spans"]["overviews"]]
    with pytest.raises(InputError, match="no figure 'log'"):
        sheet_of(estimate(), view="log")


def test_parameters_are_those_of_the_calibration() -> None:
    document = estimate().to_json()
    with pytest.raises(FormatError, match="parameters are not those of the calibration"):
        CalibrationEstimate.from_json({**document, "parameters": document["parameters"][1:]})


# -- both renderers ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", ["whole", "sphere", "residuals", "parameters", "correlation"])
def test_object_and_document_are_drawn_alike_on_paper_and_on_screen(view: str) -> None:
    found = estimate()
    sheet = sheet_of(found, view=view)
    assert screen.spec(sheet) == screen.spec(sheet_of(found.to_json(), view=view))
    assert len(paper.figure(sheet, dark=True).axes) == len(sheet.panels)


def test_every_colour_has_a_value_in_both_palettes() -> None:
    parts = [*sphere([Spot(up=(1, 1, 1), kind=k) for k in SPOT_LOOKS]).parts]
    parts += correlation(["a", "b"], np.eye(2)).parts
    colours = {p.colour for p in parts if p.colour} | {
        p.fill for p in parts if isinstance(p, DrawnShape) and p.fill
    }
    assert colours <= set(LIGHT) & set(DARK)
    assert svg(Sheet(rows=((sphere_panel([Spot(up=(1, 0, 0), label="1")]),),)))


def test_unknown_views_and_views_without_anything_are_refused() -> None:
    with pytest.raises(InputError, match="no view 'globe'"):
        sheet_of(estimate(), view="globe")
    with pytest.raises(InputError, match="no figure 'sphere'"):
        sheet_of(estimate(positions=(), turns=()), view="sphere")
