# SPDX-License-Identifier: BSD-3-Clause
"""Plans of positions: the quick covariance against that of the calibration, plans against simulated calibrations."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.experiments.calibration import calibrate, predict
from allanite.experiments.position_planning import PositionPlan, plan_positions
from allanite.experiments.position_planning.prediction import PlannedUnit
from allanite.experiments.position_planning.schemes import STANDARD, attitudes_along, candidates_of, words_of
from allanite.experiments.position_planning.search import Draft, dwell_for, worst_of
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.quantities.distributions import chi_square_quantile
from allanite.recording.calibration import parameter_names
from allanite.views.figures import sheet_of
from allanite.views.position_plan import parameter_unit
from pages import text_of
from shell import Run

LATITUDE = math.radians(48.1)
ACCELEROMETER = NoiseModel.of(White(N=1e-3), Flicker(B=2e-4), kind="acceleration")
GYRO = NoiseModel.of(White(N=1e-4), Flicker(B=2e-5))
NAVIGATION = NoiseModel.of(White(N=3e-7), Flicker(B=5e-9))
BOTH = {"accelerometer": ACCELEROMETER, "gyro": GYRO}
GOALS = {
    "accelerometer.bias": 2e-3,
    "accelerometer.scale": 1e-4,
    "accelerometer.misalignment": 2e-4,
    "gyro.scale": 3e-4,
    "gyro.misalignment": 3e-4,
}
WORDS = ["--model", "N=0.344 deg/√h, B=4 deg/h", "--model", "N=0.06 m/s/√h, B=20 µg"]


def unit(models: Any = BOTH, turn: float = 5.0, **options: Any) -> PlannedUnit:
    return PlannedUnit(
        models={s: (m,) * 3 for s, m in models.items()},
        gravity=9.81,
        latitude=options.pop("latitude", LATITUDE),
        rate=50.0,
        turn=turn,
        **options,
    )


@pytest.fixture(scope="module")
def found() -> PositionPlan:
    return plan_positions(BOTH, goals=GOALS, latitude=LATITUDE, candidates="edges", most=9, rate=50.0)


# -- positions and the way between them ----------------------------------------------------------------------


def test_candidates_are_faces_edges_and_corners() -> None:
    assert [len(candidates_of(w)) for w in ("faces", "edges", "all")] == [6, 18, 26]
    assert np.allclose(np.linalg.norm(candidates_of("all"), axis=1), 1.0)
    with pytest.raises(InputError, match="faces, edges, all"):
        candidates_of("corners")


def test_the_way_shows_each_direction_upwards_and_turns_by_the_shortest_way() -> None:
    ups = candidates_of("all")
    way = attitudes_along(ups)
    assert np.allclose(-way[:, 2], ups, atol=1e-12)
    assert np.allclose(way @ np.swapaxes(way, 1, 2), np.eye(3), atol=1e-12)
    steps = np.swapaxes(way[:-1], 1, 2) @ way[1:]
    angle = np.arccos(np.clip((np.trace(steps, axis1=1, axis2=2) - 1) / 2, -1, 1))
    assert np.allclose(angle, np.arccos(np.clip((ups[1:] * ups[:-1]).sum(axis=1), -1, 1)), atol=1e-7)
    assert words_of([0.0, 0.1, 1.0]) == "z up"


def test_the_usual_schemes() -> None:
    assert {name: len(a) for name, a in STANDARD.items()} == {
        "6 faces": 6,
        "9: faces and 3 edges": 9,
        "19 quarter turns": 19,
    }
    steps = np.swapaxes(STANDARD["19 quarter turns"][:-1], 1, 2) @ STANDARD["19 quarter turns"][1:]
    assert np.allclose(np.trace(steps, axis1=1, axis2=2), 1.0)  # quarter turns, all of them
    assert np.allclose(STANDARD["19 quarter turns"][0], np.eye(3))


# -- the quick covariance ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("models", "latitude", "dwell"),
    [
        (BOTH, LATITUDE, 30.0),
        (BOTH, None, 8.0),
        ({"accelerometer": ACCELEROMETER, "gyro": NAVIGATION}, LATITUDE, 120.0),
        ({"accelerometer": ACCELEROMETER}, LATITUDE, 20.0),
    ],
)
def test_the_quick_covariance_is_that_of_the_calibration(models: Any, latitude: Any, dwell: float) -> None:
    """Parameters that the scheme determines, and which those are; with the Earth seen and not seen."""
    for attitudes in (STANDARD["9: faces and 3 edges"], attitudes_along(candidates_of("all")[::2])):
        quick = unit(models, latitude=latitude).forecast(attitudes, [dwell] * len(attitudes))
        exact = predict(
            attitudes, dwell=dwell, turn=5.0, models=models, latitude=latitude, gravity=9.81, rate=50.0
        )
        assert quick.names == exact.names
        known = [n not in exact.assumed for n in exact.names]
        assert np.allclose(quick.sd[known], exact.sd[known], rtol=0.01)
        assert quick.earth == exact.earth_resolved


def test_faces_alone_leave_misalignments_open() -> None:
    f = unit({"accelerometer": ACCELEROMETER}).forecast(STANDARD["6 faces"], [60.0] * 6)
    assert f.open == tuple(f"accelerometer.misalignment_{p}" for p in ("xy", "xz", "yz"))


def test_white_noise_of_faces_is_that_of_six_means() -> None:
    """|f| = g in six faces, by hand: bias and g times scale are half the sum and half the difference of two means."""
    n, dwell = 1e-3, 25.0
    model = NoiseModel.of(White(N=n), kind="acceleration")
    f = unit({"accelerometer": model}).forecast(STANDARD["6 faces"], [dwell] * 6)
    sd = dict(zip(f.names, f.sd, strict=True))
    expected = n / math.sqrt(2 * dwell)
    for axis in "xyz":
        assert sd[f"accelerometer.bias_{axis}"] == pytest.approx(expected, rel=1e-3)
        assert sd[f"accelerometer.scale_{axis}"] == pytest.approx(expected / 9.81, rel=1e-3)


# -- plans ---------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_plan_reaches_its_goals_and_no_sooner_than_it_says(found: PositionPlan) -> None:
    assert found.reached
    assert found.worst is not None
    assert 0.5 < found.worst <= 1.01
    sd = dict(zip(found.names, found.sd, strict=True))
    for key, goal in GOALS.items():
        assert max(v for n, v in sd.items() if n.startswith(key + "_")) <= 1.01 * goal
    rests = sum(p.dwell for p in found.positions)
    assert found.total == pytest.approx(rests + found.turn * (len(found.positions) - 1))
    assert all(p.dwell >= 5.0 for p in found.positions)
    assert not found.open
    ups = np.array([p.up for p in found.positions])
    assert ((ups[1:] * ups[:-1]).sum(axis=1) < 1 - 1e-9).all()  # each differs from the one before


def test_a_plan_beats_the_usual_schemes(found: PositionPlan) -> None:
    for scheme in found.schemes:
        assert scheme.total is None or scheme.total >= found.total
        assert scheme.worst is None or scheme.worst >= found.worst  # type: ignore[operator]
    faces = found.schemes[0]
    assert (faces.name, faces.total) == ("6 faces", None)
    assert "accelerometer.misalignment_xy" in faces.open


@pytest.mark.long
def test_a_harder_goal_takes_longer_and_only_wanted_parameters_count() -> None:
    only = {"accelerometer": NoiseModel.of(White(N=1e-3), kind="acceleration")}
    times = []
    for goal in (2e-4, 1e-4):
        p = plan_positions(only, goals={"accelerometer.bias": goal}, candidates="faces", most=6)
        assert len(p.positions) <= 6
        assert p.open  # misalignments, which nobody asked for
        times.append(sum(q.dwell for q in p.positions))
    assert times[1] / times[0] == pytest.approx(4.0, rel=0.25)  # rests are whole seconds


@pytest.mark.long
def test_what_flicker_forbids_is_said() -> None:
    p = plan_positions(
        {"accelerometer": ACCELEROMETER}, goals={"accelerometer.bias": 5e-5}, candidates="faces", most=6
    )
    assert not p.reached
    assert "slow noise does not average" in p.says
    wandering = NoiseModel.of(White(N=1e-3), RandomWalk(K=1e-4), kind="acceleration")
    p = plan_positions(
        {"accelerometer": wandering}, goals={"accelerometer.bias": 5e-5}, candidates="faces", most=6
    )
    assert not p.reached
    assert max(q.dwell for q in p.positions) <= 60.0  # longer rests would be worse
    p = plan_positions(
        {"accelerometer": ACCELEROMETER},
        goals={"accelerometer.misalignment": 1e-3},
        candidates="faces",
        most=6,
    )
    assert "no allowed position determines accelerometer.misalignment" in p.says
    assert any("allow edges" in note for note in p.notes)


@pytest.mark.long
def test_the_best_of_a_given_time() -> None:
    p = plan_positions(BOTH, goals=GOALS, latitude=LATITUDE, time=120.0, candidates="edges", most=8)
    assert p.total == pytest.approx(120.0, abs=len(p.positions))
    assert p.total <= 120.0
    worse = unit(turn=5.0)
    usual = Draft(ups=-STANDARD["9: faces and 3 edges"][:, 2], shares=np.ones(9))
    targets = np.array(
        [next((g for k, g in GOALS.items() if n.startswith(k + "_")), np.inf) for n in worse.names]
    )
    assert p.worst is not None
    assert p.worst < worst_of(usual.forecast(worse, 80 / 9), targets)


def test_dwell_for_is_the_shortest_that_does() -> None:
    u = unit({"accelerometer": NoiseModel.of(White(N=1e-3), kind="acceleration")})
    draft = Draft(ups=-STANDARD["6 faces"][:, 2], shares=np.ones(6))
    goals = np.array([1e-4 if ".bias_" in n else np.inf for n in u.names])
    assert dwell_for(u, draft, goals) == pytest.approx((1e-3 / 1e-4) ** 2 / 2, rel=0.025)


@pytest.mark.long
def test_the_unit_that_was_planned_is_calibrated_as_planned(found: PositionPlan) -> None:
    """30 records of perfect units in the planned positions: errors against the planned covariance.

    Under it the sum of squares of whitened errors of 21 parameters is chi-square with 630 degrees of freedom; that is
    2.8 % of the standard deviation. Bounds to one in a thousand.
    """
    attitudes = attitudes_along([p.up for p in found.positions])
    dwells = [p.dwell for p in found.positions]
    motion = UnitMotion.positions(attitudes, dwell=dwells, turn=found.turn)
    edges = np.cumsum([0.0, *(d + found.turn for d in dwells)])[:-1]
    spans = np.stack([edges, edges + dwells], axis=1)
    runs, rate = 30, 20.0
    whitener = np.linalg.inv(np.linalg.cholesky(found.covariance))
    perfect = np.array([1.0 if ".scale_" in n else 0.0 for n in found.names])
    total = 0.0
    for seed in range(runs):
        record = simulate_unit(BOTH, rate=rate, motion=motion, latitude=LATITUDE, seed=seed)
        models = {n: GYRO if n.startswith("gyro") else ACCELEROMETER for n in record.names}
        made = calibrate(
            record, spans=np.round(spans * rate).astype(int), model=models, latitude=LATITUDE
        ).calibration
        values = np.array([made[n][0] for n in found.names])
        total += float(((whitener @ (values - perfect)) ** 2).sum())
    dof = runs * len(found.names)
    assert chi_square_quantile(5e-4, dof) < total < chi_square_quantile(1 - 5e-4, dof)


# -- headings ------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_heading_needs_half_a_turn_where_the_bias_hides_the_earth() -> None:
    """Two positions: of white noise the heading has the sd N/(Omega cos(latitude) sqrt(time at rest)), whatever the
    bias; one position has the bias in it.
    """
    model = {"gyro": NoiseModel.of(White(N=3e-7)), "accelerometer": ACCELEROMETER}
    p = plan_positions(model, heading=True, goals=math.radians(0.1), latitude=LATITUDE)
    assert p.reached
    assert p.schemes[0].total is None  # one position never
    assert "2 positions" in p.says
    rest = sum(q.dwell for q in p.positions)
    expected = 3e-7 / (7.292115e-5 * math.cos(LATITUDE) * math.sqrt(rest))
    assert p.sd[0] == pytest.approx(expected, rel=0.03)
    assert p.sd[0] <= math.radians(0.1) * 1.001
    assert [q.words for q in p.positions] == ["level", "level, 180 deg from the first"]


@pytest.mark.long
def test_a_consumer_unit_gets_no_heading() -> None:
    p = plan_positions(BOTH, heading=True, latitude=LATITUDE, time=60.0)
    assert not p.reached
    assert any("to give north" in note for note in p.notes)


# -- what is refused -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goals": {"gyro.bais": 1.0}}, "no parameter 'gyro.bais'"),
        ({"goals": {"gyro.bias": -1.0}}, "must be positive"),
        ({"goals": 0.1}, "go by parameter"),
        ({"heading": True}, "depends on the latitude"),
        ({"heading": True, "latitude": 0.5, "goals": {"gyro.bias": 1.0}}, "positive angle"),
        ({"most": 1}, "2 and 60"),
        ({"time": 8.0}, "hold no two rests"),
        ({"turn": 0.0}, "turn must be positive"),
        ({"models": NoiseModel.of(White(N=1.0), kind="voltage")}, "not for voltage"),
    ],
)
def test_what_makes_no_sense_is_refused(options: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        plan_positions(**{"models": BOTH, **options})


# -- document, words, figures, command -----------------------------------------------------------------------


def test_document_report_and_figures(found: PositionPlan, tmp_path: Path) -> None:
    document = found.to_json()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    sphere, length, schemes = sheet_of(document).panels
    assert sphere.drawing is not None
    assert {str(p.number) for p in found.positions} <= set(sphere.drawing.words)
    assert [c.label for c in length.curves][:2] == ["accelerometer: bias", "accelerometer: scale"]
    # longer is not worse, but for flicker, whose level grows with the record
    assert all((c.y[1:] < 1.01 * c.y[:-1]).all() for c in length.curves)
    assert schemes.curves[0].label == "this plan"
    text = al.render(found, tmp_path / "plan.html").read_text()
    assert "Which positions" in text or "which positions" in text
    assert all(p.words in text for p in found.positions)
    table = found.table()
    assert [row["number"] for row in table] == list(range(1, len(table) + 1))
    assert table[1]["start"] == pytest.approx(found.positions[0].dwell + found.turn)


def test_units_of_people() -> None:
    assert parameter_unit("accelerometer.bias_x") == ("mg", 9.80665e-3)
    assert parameter_unit("gyro.bias")[0] == "deg/h"
    assert parameter_unit("gyro.scale_z") == ("ppm", 1e-6)
    assert parameter_unit("heading")[0] == "deg"
    assert {parameter_unit(n)[0] for n in parameter_names("gyro")} == {"deg/h", "ppm", "mrad"}


@pytest.mark.long
def test_the_command(run: Run, tmp_path: Path) -> None:
    goal = "accelerometer.bias=1mg,accelerometer.scale=0.1%,gyro.scale=500ppm,gyro.bias=30deg/h"
    goal += ",gyro.misalignment_xy=1mrad"
    out = tmp_path / "plan"
    words = ["--latitude", "48.1", "--goal", goal, "--candidates", "edges", "--most", "7", "--out", str(out)]
    done = run("plan", "positions", *WORDS, *words)
    assert done.code == 0, done.err
    assert "reach the goals" in done.out
    document = json.loads((out / "position-plan.json").read_text())
    assert document["goals"]["accelerometer.bias"] == pytest.approx(9.80665e-3)
    assert document["goals"]["gyro.bias"] == pytest.approx(math.radians(30 / 3600))
    rows = (out / "positions.csv").read_text().splitlines()
    assert rows[0] == "number,start_s,stop_s,position,roll_deg,pitch_deg,heading_deg"
    assert rows[1].startswith("1,0,5,z up,")
    assert len(rows) == len(document["positions"]) + 1
    plan = PositionPlan.from_json(document)
    assert plan.goal("gyro.misalignment_xy") == pytest.approx(1e-3)
    assert plan.goal("gyro.misalignment_yx") is None
    report = text_of((out / "report.html").read_text())
    assert re.search(r"gyro\.misalignment_xy mrad \S+ 1\.00 gyro\.misalignment_xz mrad \S+ gyro", report), (
        report
    )


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["positions", *WORDS, "--goal", "gyro.scale=fast"], 2, "is not a fraction"),
        (["positions", *WORDS, "--goal", "accelerometer.bias=1deg"], 2, "is no acceleration"),
        (["positions", *WORDS, "--goal", "scale=1%"], 2, "write gyro.scale"),
        (["positions", *WORDS, "--heading"], 2, "--latitude"),
        (["positions"], 2, "--model"),
        (["positions", "--model", "N=0.3 deg/√h", "--model", "N=0.4 deg/√h"], 1, "second model of 'gyro'"),
        ([], 2, "Missing option '--model'"),
        (["--model", "N=0.3 deg/√h"], 2, "Missing option '--latitude'"),
    ],
)
def test_wrong_usage(run: Run, words: list[str], code: int, said: str) -> None:
    done = run("plan", *words)
    assert done.code == code
    assert said in done.err
