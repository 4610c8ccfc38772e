# SPDX-License-Identifier: BSD-3-Clause
"""Counterparts of the paper's thirteen figures: each from one function, in its units, saying what it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import allanite as al
import sample_study
from allanite.errors import InputError
from allanite.experiments.earth_rate import EarthRateEstimate, measure_earth_rate
from allanite.experiments.reference_aided import ReferenceAided, reference_aided
from allanite.quantities.earth import EARTH_RATE
from allanite.views.figures import matplotlib as paper
from allanite.views.figures import screen
from allanite.views.figures.bench import bench
from allanite.views.figures.drawing import DrawnShape, Words
from allanite_seed_paper import figures
from allanite_seed_paper import twin as seed_paper
from allanite_seed_paper.figures import PaperFigure

DEG = math.radians(1)
REFERENCES = (EARTH_RATE, 2 * EARTH_RATE, -EARTH_RATE)


@pytest.fixture(scope="module")
def study() -> dict[str, Any]:
    return sample_study.build()


@pytest.fixture(scope="module")
def take() -> al.Recording:
    return seed_paper.take(2, seed=11)


@pytest.fixture(scope="module")
def estimate(take: al.Recording) -> EarthRateEstimate:
    return measure_earth_rate(take, latitude=seed_paper.LATITUDE, model=seed_paper.sensor())


@pytest.fixture(scope="module")
def both(
    take: al.Recording, estimate: EarthRateEstimate
) -> tuple[list[ReferenceAided], list[ReferenceAided]]:
    signs = estimate.reversals.signs()
    flags = np.concatenate(([0], (signs == 0).astype(int), [0]))
    turning = np.flatnonzero(np.diff(flags)).reshape(-1, 2)
    quiet = take.excluding({take.names[0]: turning}, "turning")
    model = seed_paper.sensor()
    unsigned = [reference_aided(quiet, model, reference=r) for r in REFERENCES]
    return unsigned, [reference_aided(take, model, reference=r, signs=signs) for r in REFERENCES]


@pytest.fixture(scope="module")
def everything(
    study: dict[str, Any],
    take: al.Recording,
    estimate: EarthRateEstimate,
    both: tuple[list[ReferenceAided], list[ReferenceAided]],
) -> Sequence[PaperFigure]:
    """All thirteen, with the shortest take in the place of every take."""

    def four(thing: Any) -> Mapping[int, Any]:
        return dict.fromkeys((1, 2, 3, 4), thing)

    return figures.all_figures(
        study=study,
        takes=four(take),
        reversals=four(estimate),
        unsigned=four(both[0]),
        demodulated=four(both[1]),
    )


def test_there_are_thirteen_in_order_with_title_and_one_sentence(everything: Sequence[PaperFigure]) -> None:
    assert [figure.number for figure in everything] == list(range(1, 14))
    for figure in everything:
        assert figure.title == figures.TITLES[figure.number]
        assert figure.caption.endswith(".") and ". " not in figure.caption


@pytest.mark.parametrize("number", range(1, 14))
def test_every_figure_is_drawn_on_paper_and_on_screen(everything: Sequence[PaperFigure], number: int) -> None:
    figure = everything[number - 1]
    axes, document = al.plot(figure.sheet).axes, screen.spec(figure.sheet)
    assert len(axes) == len(figure.sheet.panels) == len(document["panels"])
    for panel in figure.sheet.panels:
        assert panel.drawing or panel.x.names or "[" in panel.x.label
        assert panel.drawing or "[" in panel.y.label


def test_the_standard_curve_has_five_slopes_and_letters() -> None:
    (panel,) = figures.figure_1().sheet.panels
    assert [label.text[0] for label in panel.labels] == list("QNBKR")
    assert [guide.slope for guide in panel.guides] == [-1.0, -0.5, 0.0, 0.5, 1.0]
    assert panel.y.limits is not None
    assert all(panel.y.limits[0] < guide.name_y < panel.y.limits[1] for guide in panel.guides)
    curve = panel.curves[0]
    for label, guide in zip(panel.labels, panel.guides, strict=True):
        total = float(np.exp(np.interp(math.log(label.x), np.log(curve.x), np.log(curve.y))))
        assert label.y <= total * 1.001 and label.y > 0.7 * total  # each rules where its letter stands
        assert guide.y[1] / guide.y[0] == pytest.approx((guide.x[1] / guide.x[0]) ** guide.slope, rel=0.02)


def test_the_curve_is_in_the_unit_of_the_paper(study: dict[str, Any]) -> None:
    (panel,) = figures.figure_2(study).sheet.panels
    assert "[deg/s]" in panel.y.label
    np.testing.assert_allclose(panel.curves[0].y * DEG, study["channels"][0]["curve"]["deviation"])
    with pytest.raises(InputError, match="no channel of rates"):
        figures.figure_2({**study, "channels": study["channels"][3:]})


def _read(study: dict[str, Any]) -> dict[str, Any]:
    """The study of one gyro whose curve was read at lags that are known."""
    channel = dict(study["channels"][0])
    tau, sigma = (np.array(channel["curve"][k], dtype=float) for k in ("tau", "deviation"))
    at = {"N": 5, "B": 12, "K": 15}
    slopes = {
        "N": sigma[5] * math.sqrt(tau[5]),
        "B": sigma[12] / 0.66428248,
        "K": sigma[15] * math.sqrt(3 / tau[15]),
        "T": tau[12] / 1.89,
    }
    channel["slopes"] = {name: {"value": float(value), "note": ""} for name, value in slopes.items()}
    return {**study, "channels": [channel], "at": {k: float(tau[i]) for k, i in at.items()}}


def test_n_b_and_k_are_marked_where_they_were_read(study: dict[str, Any]) -> None:
    document = _read(study)
    curve, parts = figures.figure_3(document).sheet.panels
    found = {label.text[0]: label for label in curve.labels}
    assert {name: label.x for name, label in found.items()} == pytest.approx(document["at"])
    for guide, label in zip(curve.guides, curve.labels, strict=True):  # each slope runs through its point
        assert guide.y[0] * (label.x / guide.x[0]) ** guide.slope == pytest.approx(label.y)
    assert found["N"].text.endswith("deg/√s") and "T_b" in found["B"].text
    slopes = document["channels"][0]["slopes"]
    published = (seed_paper.N, seed_paper.B, seed_paper.T_B, seed_paper.K)
    expected = [slopes[s]["value"] / v for s, v in zip("NBTK", published, strict=True)]
    np.testing.assert_allclose(parts.curves[0].y, expected)
    assert any("95 % interval" in c.label for c in parts.curves[1:])


def test_a_coefficient_that_was_not_read_is_left_out(study: dict[str, Any]) -> None:
    document = _read(study)
    document["channels"][0]["slopes"] = {"note": "no slopes"}
    curve, parts = figures.figure_3(document).sheet.panels
    assert curve.labels == ()
    assert len(parts.curves) == 1


def test_the_bench_holds_what_the_paper_used_inside_its_sheet() -> None:
    drawing = bench()
    words = " ".join(drawing.words)
    for part in ("SiRRS01-03", "3458A", "GPIB", "computer", "power supply", "turntable", "by hand"):
        assert part in words
    for shape in (p for p in drawing.parts if isinstance(p, DrawnShape)):
        assert all(0 <= x <= drawing.width and 0 <= y <= drawing.height for x, y in shape.points)


def test_words_of_the_bench_neither_touch_nor_leave_the_sheet() -> None:
    figure = figures.figure_4()
    drawn = paper.figure(figure.sheet)
    drawn.canvas.draw()
    (axes,) = drawn.axes
    drawing = figure.sheet.panels[0].drawing
    assert drawing is not None
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == sum(isinstance(p, Words) for p in drawing.parts)
    for i, one in enumerate(boxes):
        assert drawn.bbox.x0 <= one.x0 and one.x1 <= drawn.bbox.x1
        assert drawn.bbox.y0 <= one.y0 and one.y1 <= drawn.bbox.y1
        assert not any(one.overlaps(other) for other in boxes[i + 1 :])


def test_the_raw_take_shows_its_turns_and_its_noise(take: al.Recording, estimate: EarthRateEstimate) -> None:
    whole, close = figures.figure_6(take, estimate).sheet.panels
    assert "[deg/s]" in whole.y.label
    assert sum(span.kind == "turn" for span in whole.spans) == len(estimate.reversals.turns)
    assert float(np.nanmax(whole.envelopes[0].high)) == pytest.approx(110.0)  # the converter's end
    assert close.x.limits == (0.0, 4.0)
    assert close.y.limits is not None and close.y.limits[1] - close.y.limits[0] < 1.0


def test_the_cumulative_mean_of_the_raw_take_is_the_bias(
    take: al.Recording, estimate: EarthRateEstimate, both: tuple[list[ReferenceAided], list[ReferenceAided]]
) -> None:
    mean = figures.figure_9(take, estimate, both[0][0]).sheet.panels[1].curves[0]
    assert mean.y[-1] * DEG / 1000 == pytest.approx(estimate.bias[0], rel=0.02)


def test_the_mean_is_seen_to_follow_what_was_typed_in(
    both: tuple[list[ReferenceAided], list[ReferenceAided]],
) -> None:
    figure = figures.figure_11(*both)
    assert "not a measurement" in figure.title and "not a measurement" in figure.sheet.panels[0].title
    _, unsigned, demodulated = figure.sheet.panels
    told = np.array(REFERENCES) / DEG * 1000
    for panel, found, follows in ((unsigned, both[0], 1.0), (demodulated, both[1], 0.1)):
        ends = np.array([curve.y[-1] for curve in panel.curves])
        np.testing.assert_allclose(ends * DEG / 1000, [one.mean_corrected for one in found], rtol=2e-2)
        moved = (ends[1] - ends[0]) / (told[1] - told[0])
        assert abs(moved - follows) < 0.1
        assert len({(c.colour, c.style, c.marker) for c in panel.curves}) == 3
    np.testing.assert_allclose([label.y for label in unsigned.labels], told)
    assert [c.label for c in unsigned.curves][2] == "given −0.004178 deg/s"


def test_the_readings_may_not_be_mixed_up(both: tuple[list[ReferenceAided], list[ReferenceAided]]) -> None:
    unsigned, demodulated = both
    with pytest.raises(InputError, match="figure 10 needs the unsigned reading"):
        figures.figure_10(demodulated, unsigned)
    with pytest.raises(InputError, match="figure 13 needs the demodulated reading"):
        figures.figure_13(unsigned, [])


def test_four_takes_beside_the_bound_and_the_known_rate(estimate: EarthRateEstimate) -> None:
    figure = figures.four_takes(
        {2: estimate, 4: estimate.to_json()}, bounds={2: estimate.sd, 4: estimate.sd / 2}
    )
    (panel,) = figure.sheet.panels
    curves = {c.label or c.band_label: c for c in panel.curves}
    milli = DEG / 1000
    np.testing.assert_allclose(curves["regression"].y * milli, [estimate.rate] * 2)
    published = [seed_paper.TAKES[n].published for n in (2, 4)]
    np.testing.assert_allclose(
        next(c for n, c in curves.items() if n.startswith("published")).y * milli, published
    )
    bound = next(c for n, c in curves.items() if "bound" in n)
    assert bound.upper is not None
    half = (bound.upper - bound.y) * milli / 1.959964
    assert half[0] == pytest.approx(estimate.sd, rel=1e-6)
    assert half[3] == pytest.approx(estimate.sd / 2, rel=1e-6)
    assert [name.split("\n")[0] for _, name in panel.x.names] == ["take 2, 12 min", "take 4, 60 min"]
    (without,) = figures.four_takes({2: estimate}, published=False).sheet.panels
    assert not any(c.label.startswith("published") or "bound" in c.band_label for c in without.curves)
