# SPDX-License-Identifier: BSD-3-Clause
"""An axis turned between up and down: the sine of the latitude, what leans, what follows gravity, and the words for it.

The simulated table lies on its side: its axis leans by 90 deg to the south, so that heading 0 points up.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from allanite.commands.cli.options import GSensitivity
from allanite.errors import InputError
from allanite.experiments.earth_rate import EarthRateEstimate, SetupUncertainty, measure_earth_rate
from allanite.experiments.reversals import Reversals, find_reversals, periodic_reversals
from allanite.experiments.reversals.sides import direction_of, part_seen, triple_of
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import Motion, simulate
from allanite.noise import Flicker, NoiseModel, White
from allanite.quantities.earth import DEG_H, EARTH_RATE, checked_latitude
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.recording.records import Channel, Recording
from allanite.study.model_file import save_models
from allanite.views.figures.earth import open_panel
from pages import text_of
from shell import Run

DEG = math.pi / 180
NORTHERN, SOUTHERN = 48.1 * DEG, -23.31 * DEG
QUIET = NoiseModel.of(White(N=1e-10))
SENSOR = NoiseModel.of(White(N=0.3 * DEG / 60), Flicker(B=1.0 * DEG_H))
PER_G = DEG_H / STANDARD_GRAVITY


def twin(
    model: NoiseModel = QUIET,
    *,
    latitude: float = NORTHERN,
    lean: float = 0.0,
    follows: float = 0.0,
    duration: float = 600.0,
    dwell: float = 30.0,
    seed: int = 1,
    **given: Any,
) -> Recording:
    """A take that begins with the axis up: it leans by `lean` [rad] towards north, and `follows` [rad/s] gravity."""
    side = {"table_tilt": math.pi / 2 - lean, "table_tilt_heading": math.pi, "coupling": 0.05}
    motion = side | given.pop("motion", {})
    return simulate(
        model,
        rate=8.0,
        duration=duration,
        seed=seed,
        unit="deg/s",
        motion=Motion.reversals(dwell, coherent_bias=follows, **motion),
        latitude=latitude,
        **given,
    )


def measured(
    record: Recording, model: NoiseModel = QUIET, *, latitude: float = NORTHERN, **given: Any
) -> Any:
    return measure_earth_rate(record, latitude=latitude, model=model, **({"first": "up"} | given))


# -- the sine of the latitude ---------------------------------------------------------------------------------


@pytest.mark.parametrize("latitude", [NORTHERN, SOUTHERN, 89.9999 * DEG])
def test_without_noise_the_rate_is_that_of_the_earth(latitude: float) -> None:
    found = measured(
        twin(latitude=latitude, turn_on_bias=1e-3), latitude=latitude, g_sensitivity=1e-3 * PER_G
    )
    assert found.rate == pytest.approx(EARTH_RATE, rel=1e-5)
    assert found.component.value == pytest.approx(EARTH_RATE * math.sin(latitude), rel=1e-5)
    assert found.component.expected == pytest.approx(EARTH_RATE * math.sin(latitude), rel=1e-12)
    assert [r.name for r in found.readings] == ["pairs", "up-down-up"]
    assert [r.rate for r in found.readings] == pytest.approx([EARTH_RATE] * 2, rel=1e-4)
    assert found.verdict == "resolved"
    assert [row["direction"] for row in found.reversals.table()[:3]] == ["up", "down", "up"]


def test_down_first_is_the_other_sign() -> None:
    record = twin(motion={"table_tilt_heading": 0.0})  # leans to the north: heading 0 points down
    assert measured(record, first="down").rate == pytest.approx(EARTH_RATE, rel=1e-5)
    wrong = measured(record, first="up")
    assert wrong.rate == pytest.approx(-EARTH_RATE, rel=1e-5)
    assert wrong.verdict == "inconsistent with Earth"


def test_a_clock_and_a_document_know_up_and_down() -> None:
    turns = periodic_reversals(twin(), dwell=30.0, first="down")
    assert [row["direction"] for row in turns.table()[:2]] == ["down", "up"]
    assert Reversals.from_json(turns.to_json()) == turns
    assert [d.sign for d in turns.beginning("up").dwells] == [-d.sign for d in turns.dwells]
    with pytest.raises(InputError, match="'up', 'down'"):
        periodic_reversals(twin(), dwell=30.0, first="east")


@pytest.mark.parametrize("first", ["north", "south", "up", "down"])
def test_every_direction_is_its_own_at_its_sign(first: str) -> None:
    sign = -1 if first in ("south", "down") else 1
    assert direction_of(first, sign) == first
    assert triple_of(first) in ("north-south-north", "up-down-up")
    assert part_seen(first, 0.3) == (math.sin(0.3) if first in ("up", "down") else math.cos(0.3))


def beside_accelerometers(
    record: Recording, turns: Reversals, swing: dict[str, float], gyro: str
) -> Recording:
    """The record with accelerometers that read so much [m/s^2] in the first position, and the opposite in the next."""
    rng = np.random.default_rng(9)
    sign = np.zeros(record.n_samples)
    for p in turns.positions:
        sign[p.start : p.stop] = p.sign
    columns = [record.scaled("gyro"), *(sign * a + rng.normal(0.1, 0.05, len(sign)) for a in swing.values())]
    log = Recording.from_rate(np.column_stack(columns), rate=record.rate, unit="rad/s", names=[gyro, *swing])
    return log.with_channels(
        lambda c: Channel.of(c.name, "m/s^2") if c.name in swing else c, {"step": "test"}
    )


@pytest.mark.parametrize(
    ("gyro", "swing", "says"),
    [
        ("gyro_x", {"acc_x": 9.8, "acc_y": 0.0, "acc_z": 0.0}, "--first up"),
        ("gx", {"ax": -9.6, "ay": 0.0, "az": 1.0}, "--first down"),
        ("rate", {"acc_z": 9.7}, "was vertical"),  # whose axis is along it, no name says
        ("gx", {"ax": 0.1, "az": 9.8}, ""),  # about a level axis: this one stayed level
        ("gx", {}, ""),
    ],
)
def test_accelerometers_tell_an_axis_that_was_turned_over(
    gyro: str, swing: dict[str, float], says: str
) -> None:
    record = twin(SENSOR, seed=3)
    log = beside_accelerometers(record, find_reversals(record), swing, gyro)
    for first in ("north", None):
        found = measured(log, SENSOR, first=first, channel=gyro)
        (size,) = (f for f in found.reversals.findings if f.code == "turns_by_size")
        assert size.severity == ("info" if says else "warning")
        assert (says or "an axis across its own") in size.advice and ("--dwell 30" in size.advice) == (
            not says
        )
        asked = " ".join(found.advice)
        assert not says.startswith("--") or f"State it: {says}" in asked
        assert first or "--first" in asked
    if says.startswith("--"):
        followed = measured(log, SENSOR, first=says.split()[1], channel=gyro)
        assert not any("State it" in line or "is unknown" in line for line in followed.advice)


@pytest.mark.parametrize("latitude", [NORTHERN, SOUTHERN])
@pytest.mark.parametrize("first", ["north", "south", None])
def test_a_rate_that_only_a_vertical_axis_explains_says_so(latitude: float, first: str | None) -> None:
    found = measured(twin(latitude=latitude), latitude=latitude, first=first)
    assert found.verdict == "inconsistent with Earth"
    (says,) = (line for line in found.advice if "turned over" in line)
    for way, rate in re.findall(r"--first (up|down) (?:it is )?(-?[\d.]+) deg/h", says):
        again = measured(twin(latitude=latitude), latitude=latitude, first=way)
        assert again.rate / DEG_H == pytest.approx(float(rate), abs=0.06)
    assert "--first up it is 15.0 deg/h" in says


def test_turns_that_no_signal_shows_are_asked_for() -> None:
    """Without a word of turns; with what is asked for, the rate is there."""
    hidden = twin(SENSOR, seed=5, duration=1200.0, motion={"coupling": 0.0})
    found = measured(hidden, SENSOR, first=None)
    assert found.verdict == "not separable"
    (asked,) = (line for line in found.advice if "does not show it" in line)
    assert (
        "--dwell SECONDS" in asked and "--turns FILE" in asked and "--first north, south, up or down" in asked
    )
    given = periodic_reversals(hidden, dwell=30.0, first="up")
    assert measure_earth_rate(hidden, latitude=NORTHERN, model=SENSOR, reversals=given).rate == pytest.approx(
        EARTH_RATE, rel=0.25
    )


def test_nothing_is_seen_at_the_equator() -> None:
    for latitude in (0.0, 1e-6, math.nan, 2.0):
        with pytest.raises(InputError, match=r"undefined at latitude .* vertical"):
            checked_latitude(latitude, vertical=True)
    assert checked_latitude(-math.pi / 2, vertical=True) == -math.pi / 2
    with pytest.raises(InputError, match="vertical"):
        measured(twin(), latitude=0.0)


# -- what leans and what follows gravity ----------------------------------------------------------------------


def test_the_budget_is_what_the_effects_do() -> None:
    """Without noise: a lean, a wrong latitude, a scale factor, a bias that follows gravity."""
    size, follows = 1e-3, 0.1 * PER_G
    budget = SetupUncertainty(scale=size, latitude=size, tilt=size).budget_of_vertical(NORTHERN)
    gravity = measured(twin(), g_sensitivity=follows).budget["g-sensitivity"] / EARTH_RATE
    effects = {
        "scale factor": (measured(twin(scale_error=size)), budget["scale factor"]),
        "tilt": (measured(twin(lean=size)), budget["tilt"]),
        "latitude": (measured(twin(latitude=NORTHERN + size)), budget["latitude"]),
        "g-sensitivity": (measured(twin(follows=follows * STANDARD_GRAVITY)), gravity),
    }
    for name, (found, stated) in effects.items():
        assert found.rate / EARTH_RATE - 1 == pytest.approx(stated, rel=0.01), name
    assert "heading" not in budget


def test_at_a_pole_a_lean_counts_in_the_second_order() -> None:
    lean, pole = 0.05, math.pi / 2
    leans = np.random.default_rng(0).standard_normal((200_000, 2)) * lean
    exact = math.sqrt(np.mean((1 - np.cos(np.hypot(*leans.T))) ** 2))
    assert SetupUncertainty(tilt=lean).budget_of_vertical(pole)["tilt"] == pytest.approx(exact, rel=0.02)
    assert measured(twin(latitude=pole, lean=lean), latitude=pole).rate == pytest.approx(
        EARTH_RATE * math.cos(lean), rel=1e-5
    )


@pytest.mark.long
def test_intervals_cover_rate_component_and_g_sensitivity() -> None:
    """30 takes whose g-sensitivity is drawn from what is stated. Bounds: 99.9 % of the binomial and chi-square laws."""
    runs, sd = 30, 3.0 * PER_G
    drawn = np.random.default_rng(7).standard_normal(runs) * sd
    found = [
        measured(
            twin(
                SENSOR,
                latitude=SOUTHERN,
                follows=g * STANDARD_GRAVITY,
                duration=240.0,
                dwell=20.0,
                seed=200 + k,
            ),
            SENSOR,
            latitude=SOUTHERN,
            g_sensitivity=sd,
        )
        for k, g in enumerate(drawn.tolist())
    ]
    least = stats.binom.ppf(1e-3, runs, 0.95)
    seen = EARTH_RATE * math.sin(SOUTHERN)

    def holds(ends: tuple[float, float], truth: float) -> bool:
        return ends[0] <= truth <= ends[1]

    assert sum(holds(e.interval, EARTH_RATE) for e in found) >= least
    assert sum(holds(e.component.interval, seen) for e in found) >= least
    assert sum(holds(e.g_sensitivity.interval, g) for e, g in zip(found, drawn, strict=True)) >= least
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], runs)
    assert low < sum(((e.rate - EARTH_RATE) / e.total_sd) ** 2 for e in found) < high
    alone = [(e.g_sensitivity.value - g) / e.g_sensitivity.sd for e, g in zip(found, drawn, strict=True)]
    assert low < np.sum(np.square(alone)) < high


def test_without_a_g_sensitivity_the_earth_alone_is_never_claimed() -> None:
    record = twin(SENSOR, duration=1500.0)
    open_, stated = measured(record, SENSOR), measured(record, SENSOR, g_sensitivity=0.1 * PER_G)
    assert (open_.verdict, stated.verdict) == ("not separable from g-sensitivity", "resolved")
    assert not open_.resolved
    assert "g-sensitivity" in open_.reason
    assert any("is the sum of the Earth rate and the g-sensitivity" in words for words in open_.advice)
    assert not any("g-sensitivity" in words for words in stated.advice)
    follows = 30 * PER_G
    off = measured(twin(SENSOR, duration=1500.0, follows=follows * STANDARD_GRAVITY), SENSOR)
    assert off.verdict == "inconsistent with Earth"
    assert "a g-sensitivity of" in off.reason
    low, high = off.g_sensitivity.interval
    assert low < follows < high
    weak = measured(twin(NoiseModel.of(White(N=1e-3))), NoiseModel.of(White(N=1e-3)))
    assert weak.verdict == "not resolved"
    assert any("g-sensitivity" in words for words in weak.advice)


def test_what_such_an_axis_does_not_have_is_refused() -> None:
    record = twin()
    with pytest.raises(InputError, match="no heading"):
        measured(record, stated=SetupUncertainty(heading=0.01))
    for first in ("north", None):
        with pytest.raises(InputError, match="between up and down"):
            measured(record, first=first, g_sensitivity=PER_G)
    for value in (-1.0, math.nan, "much"):
        with pytest.raises(InputError, match="g-sensitivity"):
            measured(record, g_sensitivity=value)
    assert measured(record, first="north").g_sensitivity is None


# -- words ----------------------------------------------------------------------------------------------------


def level_words(text: str) -> list[str]:
    """Where a text speaks of north or south."""
    return re.findall(r".{0,40}(?:north|south).{0,40}", text, re.I)


def without_program(page: str) -> str:
    """A page with its data but without the program that draws, which knows maps."""
    return re.sub(r"<script.*?</script>", lambda m: m[0] if len(m[0]) < 500_000 else "", page, flags=re.S)


STATED = ["--g-sensitivity", "0.1deg/h/g", "--tilt", "0.1deg", "--latitude-uncertainty", "1deg"]
TAKES: dict[str, tuple[dict[str, Any], list[str]]] = {
    "open": ({"duration": 1500.0}, []),
    "stated": ({"duration": 1500.0}, STATED),
    "contradicts": ({"duration": 600.0, "follows": 100 * DEG_H}, []),
    "by the clock": ({"motion": {"coupling": 0.0}}, ["--dwell", "30"]),
    "never turned": ({"dwell": 1e6}, []),
}


@pytest.mark.long
@pytest.mark.parametrize("name", list(TAKES))
def test_no_output_speaks_of_a_level_axis(name: str, run: Run, tmp_path: Path) -> None:
    made, options = TAKES[name]
    write_recording(twin(SENSOR, **made), tmp_path / "take.parquet")
    save_models({"gyro": SENSOR.to_json()}, tmp_path / "gyro.json")
    out = tmp_path / "out"
    done = run(
        "earth-rate", tmp_path / "take.parquet", "--model", tmp_path / "gyro.json", "--latitude", "48.1",
        "--first", "up", *options, "--out", out,
    )  # fmt: skip
    assert done.code == 0, done.err
    for text in (done.out, *(path.read_text(encoding="utf-8") for path in out.iterdir())):
        assert not level_words(without_program(text))
    document = json.loads((out / "earth-rate.json").read_text(encoding="utf-8"))
    words = text_of((out / "report.html").read_text(encoding="utf-8")).replace("−", "-")
    if name == "never turned":
        estimate = EarthRateEstimate.from_json(document)
        assert "if the axis points up" in estimate.reason
        assert [words for _, words in open_panel(estimate).x.names] == ["if the axis pointed up", "down"]
        return
    for text in (done.out, words):
        assert "11.195 deg/h up, -11.195 deg/h down" in text
        assert "if the Earth turns at its known rate" in text
    assert "The means of the dwells, up and down" in words
    assert ("deviation 0.18 by the latitude" in words) is (name == "stated")
    assert ("is the sum of the Earth rate and the g-sensitivity" in words) is (name != "stated")
    rows = (out / "dwells.csv").read_text(encoding="utf-8").splitlines()
    assert [row.split(",")[3] for row in rows[1:3]] == ["up", "down"]


def test_a_level_axis_is_still_called_by_its_names() -> None:
    found = measure_earth_rate(
        simulate(
            SENSOR,
            rate=8.0,
            duration=600.0,
            seed=1,
            unit="deg/s",
            motion=Motion.reversals(30.0),
            latitude=0.8,
        ),
        latitude=0.8,
        model=SENSOR,
        first="south",
    )
    assert [r.name for r in found.readings] == ["pairs", "north-south-north"]
    assert found.component.expected == pytest.approx(EARTH_RATE * math.cos(0.8))
    assert found.to_json()["g_sensitivity"] is None


def test_units_of_a_g_sensitivity() -> None:
    assert GSensitivity()("0.1deg/h/g") == pytest.approx(0.1 * PER_G)
    assert GSensitivity()("2 (deg/s)/g") == pytest.approx(7200 * PER_G)
    assert GSensitivity()("1e-5rad/s/(m/s^2)") == pytest.approx(1e-5)
