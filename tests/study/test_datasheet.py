# SPDX-License-Identifier: BSD-3-Clause
"""Data sheets: every convention against its formula, every ambiguity refused, verdicts against measurements."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.commands import measure
from allanite.errors import FormatError, InputError
from allanite.noise import FLICKER_FLOOR, SIGMA_PER_B, GaussMarkov, NoiseModel, White
from allanite.noise.datasheet import ENTRIES, sensor_sheet
from allanite.study.datasheet import Datasheet, DatasheetJudgement, hold_against, read_datasheet
from allanite.study.model_file import load_models
from allanite.study.study import Study
from allanite.views.figures import sheet_of
from sample_study import ARW, DEG_H, MICRO_G, RRW, TRUTHS, build
from shell import Run

G = 9.80665
SHEET = NoiseModel.from_datasheet


def _value(model: NoiseModel, type_: str, symbol: str) -> float:
    term = model.term(type_)
    assert term is not None
    return float(getattr(term, symbol))


# -- conventions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entries", "type_", "symbol", "expected"),
    [
        ({"angle_random_walk": "0.3 deg/√h"}, "white", "N", 0.3 * ARW),
        ({"velocity_random_walk": "0.06 m/s/√h"}, "white", "N", 1e-3),
        ({"noise_density": "0.005 deg/s/√Hz", "density_is": "two-sided"}, "white", "N", 0.3 * ARW),
        ({"noise_density": "0.005 dps/rtHz", "density_is": "one-sided"}, "white", "N", 0.3 * ARW / math.sqrt(2)),
        ({"noise_density": "60 µg/√Hz", "density_is": "two_sided"}, "white", "N", 60 * MICRO_G),
        (
            {"rms_noise": "0.1 deg/s", "bandwidth": "50 Hz", "bandwidth_is": "noise-equivalent"},
            "white", "N", math.radians(0.01),
        ),
        (
            {"rms_noise": "1 mg", "bandwidth": "80 Hz", "bandwidth_is": "first-order"},
            "white", "N", 1e-3 * G / math.sqrt(2 * 80 * math.pi / 2),
        ),
        (
            {"rms_noise": "1 mg", "bandwidth": "80 Hz", "bandwidth_is": "second-order"},
            "white", "N", 1e-3 * G / math.sqrt(2 * 80 * 1.1107207345),
        ),
        ({"bias_instability": "5 deg/h", "bias_instability_is": "coefficient"}, "flicker", "B", 5 * DEG_H),
        ({"bias_instability": "5 deg/h", "bias_instability_is": "minimum"}, "flicker", "B", 5 * DEG_H / FLICKER_FLOOR),
        ({"rate_random_walk": "2 deg/h/√h"}, "random_walk", "K", 2 * RRW),
        ({"acceleration_random_walk": "30 µg/√h"}, "random_walk", "K", 30 * MICRO_G / 60),
        ({"rate_ramp": "0.1 deg/h/h"}, "ramp", "R", 0.1 * DEG_H / 3600),
        ({"acceleration_ramp": "4 µg/h"}, "ramp", "R", 4 * MICRO_G / 3600),
        ({"quantisation": "0.2 arcsec"}, "quantisation", "Q", math.radians(0.2 / 3600)),
    ],
)  # fmt: skip
def test_each_convention_is_its_formula(
    entries: dict[str, str], type_: str, symbol: str, expected: float
) -> None:
    model = SHEET(**entries)
    assert len(model.terms) == 1
    assert _value(model, type_, symbol) == pytest.approx(expected, rel=1e-9)
    gyro = any(unit in str(entries) for unit in ("deg", "dps", "arcsec"))
    assert model.kind == ("rate" if gyro else "acceleration")
    assert "From a data sheet" in model.verdict


def test_second_order_noise_bandwidth_is_that_of_a_butterworth_filter() -> None:
    """The integral of |H|^2 = 1/(1 + f^4) from 0."""
    f = np.linspace(0, 400, 4_000_001)
    y = 1 / (1 + f**4)
    width = np.sum((y[1:] + y[:-1]) / 2) * (f[1] - f[0])
    model = SHEET(rms_noise="1 deg/s", bandwidth="1 Hz", bandwidth_is="second-order")
    assert _value(model, "white", "N") == pytest.approx(math.radians(1) / math.sqrt(2 * width), rel=1e-6)


def test_stated_minimum_is_the_minimum_of_the_curve_at_the_stated_place() -> None:
    common = {
        "angle_random_walk": "0.3 deg/√h",
        "bias_instability": "5 deg/h",
        "bias_instability_is": "minimum",
    }
    tau = np.geomspace(1, 1e5, 200_001)
    placed = SHEET(**common, bias_instability_tau="300 s").adev(tau)
    assert placed.min() == pytest.approx(5 * DEG_H, rel=1e-9)
    assert tau[placed.argmin()] == pytest.approx(300, rel=1e-3)
    walked = SHEET(**common, rate_random_walk="6 deg/h/√h").adev(tau)
    assert walked.min() == pytest.approx(5 * DEG_H, rel=1e-9)
    alone = SHEET(**common).adev(np.array([1e9]))
    assert alone[0] == pytest.approx(5 * DEG_H, rel=1e-3)


def test_correlation_time_makes_a_gauss_markov_term() -> None:
    sigma = SHEET(bias_stability="10 deg/h", correlation_time="5 min").terms[0]
    assert isinstance(sigma, GaussMarkov)
    assert sigma.sigma == pytest.approx(10 * DEG_H)
    assert sigma.T == 300.0
    peak = SHEET(bias_instability="5 deg/h", bias_instability_is="minimum", correlation_time="300 s").terms[0]
    assert isinstance(peak, GaussMarkov)
    assert peak.sigma == pytest.approx(SIGMA_PER_B * 5 * DEG_H / FLICKER_FLOOR)
    assert math.sqrt(peak.avar(1.8926178 * 300)) == pytest.approx(5 * DEG_H)


ARW_ = {"angle_random_walk": "0.3 deg/√h"}
BIAS = {"bias_instability": "5 deg/h"}


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"noise_density": "0.005 deg/s/√Hz"}, "state density_is='one-sided'"),
        (BIAS, "state bias_instability_is='minimum'"),
        ({"bias_stability": "5 deg/h"}, "state its correlation_time"),
        ({"rms_noise": "0.1 deg/s"}, "state bandwidth"),
        ({"rms_noise": "0.1 deg/s", "bandwidth": "9 Hz"}, "bandwidth_is='first-order'"),
        ({"angle_random_walk": "0.005 deg/s/√Hz"}, "give it as noise_density"),
        ({"noise_density": "0.3 deg/√h", "density_is": "two-sided"}, "give it as angle_random_walk"),
        ({"angle_random_walk": "0.3 deg/s/√h"}, "did you mean deg/√h"),
        ({"velocity_random_walk": "1 mg/√h"}, "did you mean m/s/√h"),
        ({"angle_random_walk": "0.3"}, "not a number with its unit"),
        ({"angle_random_walk": 0.3}, "with its unit as text"),
        ({"angle_random_walk": "-0.3 deg/√h"}, "not a number with its unit"),
        ({"angle_random_walk": "0 deg/√h"}, "must be positive"),
        ({**BIAS, "bias_instability_is": "1 sigma"}, "'minimum' or 'coefficient'"),
        ({**ARW_, "noise_density": "0.005 deg/s/√Hz", "density_is": "two-sided"}, "both state N"),
        ({**ARW_, "density_is": "two-sided"}, "stands without noise_density"),
        ({**ARW_, "bias_instability_tau": "9 s"}, "stands without bias_instability"),
        ({**ARW_, "correlation_time": "300 s"}, "state bias_stability"),
        ({**ARW_, "acceleration_ramp": "4 µg/h"}, "different sensors"),
        ({**BIAS, "bias_stability": "5 deg/h", "correlation_time": "9 s"}, "both state the bias"),
        (
            {**ARW_, **BIAS, "bias_instability_is": "minimum", "bias_instability_tau": "3 s"},
            "contradicts the white noise",
        ),
        (
            {
                **ARW_, **BIAS, "bias_instability_is": "minimum", "bias_instability_tau": "300 s",
                "rate_random_walk": "0.1 deg/h/√h",
            },
            "put the minimum at",
        ),
        ({"noise": "1 deg/h"}, "no entry 'noise'"),
        ({}, "states no noise"),
    ],
)  # fmt: skip
def test_ambiguity_and_contradiction_are_refused_with_what_to_state(
    entries: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        SHEET(**entries)


def test_every_entry_is_documented() -> None:
    from allanite.noise import datasheet

    assert datasheet.__doc__ is not None
    missing = [e for e in ENTRIES if e not in datasheet.__doc__]
    assert not missing


# -- files ------------------------------------------------------------------------------------------------------

YAML = """\
sensor: XYZ-100
source: revision B
gyro:
  angle_random_walk: 0.31 deg/√h
  bias_instability: 4.0 deg/h
  bias_instability_is: coefficient
accelerometer:
  velocity_random_walk: 0.02 m/s/√h
"""


def test_file_is_the_entries_and_serves_as_a_model(tmp_path: Path) -> None:
    place = tmp_path / "sheet.yaml"
    place.write_text(YAML, encoding="utf-8")
    sheet = read_datasheet(place)
    assert (sheet.sensor, sheet.source, list(sheet.sections)) == (
        "XYZ-100",
        "revision B",
        ["gyro", "accelerometer"],
    )
    assert _value(sheet.models["gyro"], "white", "N") == pytest.approx(0.31 * ARW)
    models, rate = load_models(place)
    assert models == sheet.models and rate is None


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("gyro: [1, 2]", InputError, "section 'gyro' holds entries"),
        (
            "gyro: {bias_instability: 5 deg/h}",
            InputError,
            "sheet.yaml: gyro: bias_instability 5 deg/h can be read",
        ),
        ("gyro: {velocity_random_walk: 1 m/s/√h}", InputError, "units of acceleration, not of rate"),
        ("sensor: x", InputError, "has sections"),
        ("sensor: {a: b}\ngyro: {}", FormatError, "sensor is a line of text"),
        ("- a\n- b", FormatError, "holds no sections"),
        ("gyro: {a: b\n", FormatError, "not YAML"),
        ("gyro: {a: b}\ngyro: {c: d}", FormatError, "not YAML"),
        ("a: &a [*a]\n" + "x" * 300_000, FormatError, "not a data sheet"),
    ],
)
def test_files_that_are_no_sheets_are_refused(
    tmp_path: Path, text: str, error: type[Exception], words: str
) -> None:
    place = tmp_path / "sheet.yaml"
    place.write_text(text, encoding="utf-8")
    with pytest.raises(error, match=words):
        read_datasheet(place)
    with pytest.raises(InputError, match="no such file"):
        read_datasheet(tmp_path / "none.yaml")


# -- verdicts -----------------------------------------------------------------------------------------------------


def _with_estimate(symbol: str, value: float | None, lower: float, upper: float) -> Study:
    """The sample study with one estimate of gyro_x replaced."""
    document = copy.deepcopy(build())
    estimates = document["channels"][0]["models"][0]["estimates"]
    estimates[:] = [e for e in estimates if e["symbol"] != symbol]
    estimates.append(
        {
            "symbol": symbol,
            "value": value,
            "lower": lower,
            "upper": upper,
            "supported": value is not None,
            "note": "",
        }
    )
    return Study.from_json(document)


@pytest.mark.parametrize(
    ("interval", "expected"),
    [
        ((0.30, 0.29, 0.31), "meets"),
        ((0.32, 0.311, 0.33), "does not meet"),
        ((0.31, 0.30, 0.32), "not resolved"),
        ((None, 0.0, 0.30), "meets"),
        ((None, 0.0, 0.40), "not resolved"),
    ],
)
def test_verdict_is_where_the_interval_stands(
    interval: tuple[float | None, float, float], expected: str
) -> None:
    value, low, high = (None if v is None else v * ARW for v in interval)
    assert low is not None and high is not None
    found = hold_against(
        _with_estimate("N", value, low, high), Datasheet.of(gyro_x={"angle_random_walk": "0.31 deg/√h"})
    )
    statement = found.channels[0].statements[0]
    assert statement.verdict == expected
    assert statement.ratio.upper == pytest.approx(interval[2] / 0.31)


def test_a_channel_of_two_families_is_judged_by_the_intervals_of_both() -> None:
    document = build()
    models = next(c for c in document["channels"] if c["name"] == "gyro_y")["models"]
    for model, lower, upper in zip(models, (0.30, 0.31), (0.33, 0.34), strict=True):
        n = next(e for e in model["estimates"] if e["symbol"] == "N")
        n |= {"value": 0.32 * ARW, "lower": lower * ARW, "upper": upper * ARW}
    sheet = Datasheet.of(gyro_y={"angle_random_walk": "0.305 deg/√h"})
    (statement,) = hold_against(Study.from_json(document), sheet).channels[0].statements
    ratio = statement.ratio
    assert (ratio.value, ratio.lower, ratio.upper) == pytest.approx(
        (0.32 / 0.305, 0.30 / 0.305, 0.34 / 0.305)
    )
    assert statement.verdict == "not resolved"


def test_curves_stand_beside_one_another() -> None:
    """The measured curve over that of the truth, stated as a sheet, is one within the scatter of the sample study."""
    kind, truth, _ = TRUTHS["gyro_x"]
    assert kind == "rate"
    sheet = Datasheet.of(
        gyro_x={
            "angle_random_walk": "0.3 deg/√h",
            "bias_instability": "5 deg/h",
            "bias_instability_is": "coefficient",
            "rate_random_walk": "9 deg/h/√h",
        }
    )
    found = hold_against(Study.from_json(build()), sheet)
    channel = found.channels[0]
    np.testing.assert_allclose(channel.stated, truth.adev(channel.curve.tau), rtol=1e-9)
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert [s["entry"]["symbol"] for s in document["channels"][0]["statements"]] == ["N", "B", "K"]
    ratio = sheet_of(found, view="ratio").panels[0]
    np.testing.assert_allclose(ratio.curves[0].y, 1.0, atol=0.8)
    (level,) = (c for c in ratio.curves if c.label == "the data sheet")
    assert (level.y == 1.0).all() and ratio.x.limits == tuple(level.x)
    assert "the data sheet" in ratio.entries and not ratio.labels  # words at its end would cover the last bar


def test_minimum_is_bounded_by_the_curve() -> None:
    """gyro_x has its minimum inside the record; acc_z, white noise alone, still falls at its end."""
    rising = {
        "angle_random_walk": "0.31 deg/√h",
        "bias_instability": "9 deg/h",
        "bias_instability_is": "minimum",
    }
    falling = {"bias_instability": "1 mg", "bias_instability_is": "minimum"}
    found = hold_against(Study.from_json(build()), Datasheet.of(gyro_x=rising, acc_z=falling))
    gyro, acc = (c.statements[-1] for c in found.channels)
    assert gyro.measured.lower < gyro.measured.value < gyro.measured.upper and "at " in gyro.note
    truth = TRUTHS["gyro_x"][1].adev(np.geomspace(0.1, 1e4, 2001)).min()
    assert gyro.measured.lower < truth < gyro.measured.upper
    assert acc.measured.status == "upper limit" and acc.measured.lower == 0 and acc.verdict == "meets"
    assert "still falls" in acc.note
    assert found.verdict == "meets the data sheet"


def test_correlation_time_is_no_promise_and_a_term_of_another_family_stays_open() -> None:
    entries = {"bias_stability": "10 deg/h", "correlation_time": "300 s"}
    found = hold_against(Study.from_json(build()), Datasheet.of(gyro_x=entries))
    sigma, time = found.channels[0].statements
    assert sigma.verdict == "not resolved" and "no Gauss-Markov term" in sigma.note
    assert time.verdict is None
    assert found.verdict == "not resolved" and "bias stability" in found.reason


def test_sheets_and_studies_that_do_not_match_are_refused() -> None:
    study = Study.from_json(build())
    with pytest.raises(InputError, match="section 'gyro_w'"):
        hold_against(study, Datasheet.of(gyro_w=ARW_))
    with pytest.raises(InputError, match="is of rate"):
        hold_against(study, Datasheet.of(acc_x=ARW_))
    with pytest.raises(InputError, match="has sections"):
        Datasheet.of()
    assert sensor_sheet(ARW_).entries[0].symbol == "N"


# -- commands -----------------------------------------------------------------------------------------------------


def test_command_holds_a_study_against_a_sheet(run: Run, tmp_path: Path) -> None:
    sheet, study, out = tmp_path / "sheet.yaml", tmp_path / "study.json", tmp_path / "out"
    sheet.write_text(YAML.partition("accel")[0].replace("gyro:", "gyro_x:"), encoding="utf-8")
    study.write_text(json.dumps(build()))
    done = run("datasheet", sheet, "--study", study, "--out", out, "--plot", tmp_path / "sheet.png")
    assert done.code == 0, done.err
    assert "Does not meet the data sheet. gyro_x: bias instability (1 meets)" in done.out
    document = json.loads((out / "datasheet.json").read_text())
    assert document["format"] == "allanite-datasheet" and len(document["channels"]) == 1
    assert len((out / "datasheet.csv").read_text().splitlines()) == 3
    page = (out / "report.html").read_text()
    assert "XYZ-100" in page and "0.31 deg/√h" in page and "Measured, 95 % interval" in page
    assert (tmp_path / "sheet.png").stat().st_size > 10_000
    with pytest.raises(InputError, match="no view"):
        al.plot(document, view="none")


def test_command_draws_a_sheet_alone_and_refuses_what_is_about_a_log(run: Run, tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text(YAML, encoding="utf-8")
    done = run("datasheet", sheet, "--plot", tmp_path / "sheet.png")
    assert done.code == 0 and "N 0.310 deg/√h, B 4.00 deg/h" in done.out
    assert run("datasheet", sheet, "--unit", "deg/s").code == 1
    alone = run("datasheet", sheet, "--json")
    assert json.loads(alone.out)["channels"] == []


@pytest.mark.long
def test_command_characterizes_a_log_for_its_sheet(run: Run, tmp_path: Path) -> None:
    """On the command line and in Python the same; a log with gaps ends with code 3."""
    sheet, log = tmp_path / "sheet.yaml", tmp_path / "gyro.csv"
    sheet.write_text("gyro: {angle_random_walk: 0.4 deg/√h}", encoding="utf-8")
    truth = NoiseModel.of(White(N=0.3 * ARW))
    samples = al.simulate(truth, rate=4.0, duration=900.0, seed=1).values("gyro").tolist()
    rows = [f"{i / 4},{value!r}" for i, value in enumerate(samples) if not 400 <= i < 404]
    log.write_text("time [s],gyro [rad/s]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    done = run("datasheet", sheet, "--log", log, "--out", tmp_path / "out")
    assert done.code == 3 and "Meets the data sheet." in done.out, done.err
    document = json.loads((tmp_path / "out" / "datasheet.json").read_text())
    assert document["provenance"]["source"] == "gyro.csv" and document["findings"]
    measured = measure("datasheet", sheet, log=log)
    assert (
        measured.result.channels[0].statements
        == DatasheetJudgement.from_json(document).channels[0].statements
    )
    assert run("datasheet", sheet, "--log", log, "--study", log).code == 1
