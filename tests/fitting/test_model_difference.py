# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side: drift by closed forms, by states and by the Allan variance; ratios with intervals."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

import allanite as al
from allanite.errors import InputError
from allanite.fitting.model_difference import drift, model_difference
from allanite.noise import (
    Estimate,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.study.result_document import ResultDocument
from allanite.study.study import Study
from allanite.views.difference import view
from sample_study import ARW, DEG_H, RRW, build
from shell import Run

TERMS: tuple[TermType, ...] = (
    White(N=1e-4),
    Flicker(B=2e-5),
    RandomWalk(K=3e-7),
    GaussMarkov.from_sigma(2e-5, 40.0),
    Ramp(R=1e-9),
    Quantisation(Q=1e-5),
    Sinusoid(amplitude=1e-4, frequency=0.013),
)


@pytest.mark.parametrize("term", TERMS, ids=lambda t: t.type)
def test_drift_of_a_rest_as_long_is_the_allan_deviation(term: TermType) -> None:
    """Both ways of computing it: the one of the Allan variance, and the contrast of three places of the phase."""
    model = NoiseModel.of(term)
    for t in (1.0, 10.0, 1000.0):
        expected = math.sqrt(2 * float(model.avar(t))) * t
        assert drift(model, t) == pytest.approx(expected, rel=1e-12)
        assert drift(model, t, rest=t * (1 + 1e-7)) == pytest.approx(expected, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize(("t", "r"), [(1.0, 60.0), (100.0, 60.0), (1000.0, 60.0)])
def test_closed_forms(t: float, r: float) -> None:
    """White: N^2 (t + t^2/r). Walk: K^2 (t^3/3 + t^2 r/3): its mean before has a variance r/3 about its end."""
    n, k = 1e-4, 3e-7
    assert drift(NoiseModel.of(White(N=n)), t, r) ** 2 == pytest.approx(n**2 * (t + t**2 / r), rel=1e-9)
    walk = k**2 * (t**3 / 3 + t**2 * r / 3)
    assert drift(NoiseModel.of(RandomWalk(K=k)), t, r) ** 2 == pytest.approx(walk, rel=1e-9)
    assert drift(NoiseModel.of(Ramp(R=k)), t, r) == pytest.approx(k * t * (t + r) / 2, rel=1e-12)


@pytest.mark.parametrize(
    "term", [t for t in TERMS if t.type in ("gauss_markov", "random_walk", "white")], ids=str
)
def test_drift_by_the_states_of_the_model(term: TermType) -> None:
    """The sum of samples, propagated step by step from rest to the end; the mean before as a further state."""
    dt, rest, run = 0.5, 20, 60
    space = NoiseModel.of(term).state_space(dt)
    n = space.size
    mean, covariance = np.zeros(n + 1), np.zeros((n + 1, n + 1))
    covariance[:n, :n] = space.initial
    f, q = np.eye(n + 1), np.zeros((n + 1, n + 1))
    f[:n, :n], q[:n, :n] = space.transition, space.process
    assert not mean.any()
    for i in range(rest + run):
        weight = dt if i >= rest else -dt * run / rest
        take = np.eye(n + 1)
        take[n, :n] = weight * space.output
        covariance = take @ covariance @ take.T
        covariance[n, n] += weight**2 * space.noise
        covariance = f @ covariance @ f.T + q
    expected = math.sqrt(covariance[n, n])
    assert drift(NoiseModel.of(term), run * dt, rest * dt) == pytest.approx(expected, rel=1e-7)


def test_ratio_and_its_interval() -> None:
    """Of white noise alone the drift is N times a constant: the interval is that of N."""
    fitted = NoiseModel(terms=(White(N=1e-4),), covariance={"symbols": ["N"], "matrix": [[0.01**2]]})
    stated = NoiseModel.of(White(N=2e-4))
    found = model_difference({"g": fitted}, {"g": stated})
    for pair in found.channels[0].drifts:
        ratio = pair.ratio
        assert ratio.value == pytest.approx(2.0) and ratio.resolved
        assert ratio.upper / ratio.value == pytest.approx(math.exp(1.96 * 0.01), rel=1e-5)
        assert ratio.value / ratio.lower == pytest.approx(math.exp(1.96 * 0.01), rel=1e-5)
    assert found.channels[0].intervals == (True, False)
    alone = model_difference({"g": stated}, {"g": stated}).channels[0].drifts[0]
    assert (alone.ratio.value, alone.ratio.status) == (1.0, "given")


def test_interval_covers_what_the_covariance_scatters(rng: np.random.Generator) -> None:
    """Parameters drawn from their covariance: the ratio of their drifts lies inside in 95 %, first order or not."""
    terms = (White(N=1e-4), Flicker(B=2e-5), RandomWalk(K=3e-7))
    matrix = np.array([[1e-5, -1e-5, 0], [-1e-5, 4e-3, -4e-3], [0, -4e-3, 2e-2]])
    fitted = NoiseModel(terms=terms, covariance={"symbols": ["N", "B", "K"], "matrix": matrix.tolist()})
    pair = (
        model_difference({"g": fitted}, {"g": NoiseModel.of(*terms)}, seconds=(1000.0,)).channels[0].drifts[0]
    )
    assert pair.ratio.resolved
    factors = np.exp(rng.multivariate_normal(np.zeros(3), matrix, 2000))
    sizes = np.array([NoiseModel.of(t).avar(1000.0) for t in terms])
    ratios = np.sqrt(sizes.sum() / (factors**2 @ sizes))
    assert ((ratios > pair.ratio.lower) & (ratios < pair.ratio.upper)).mean() == pytest.approx(0.95, abs=0.02)


def test_every_amplitude_of_a_model_widens_the_ratio() -> None:
    """Errors that all amplitudes share are errors of the drift: no symbol may be passed over."""
    slow, quick = GaussMarkov.from_sigma(1e-5, 400.0), GaussMarkov.from_sigma(2e-5, 40.0)
    line = Sinusoid(amplitude=1e-4, frequency=0.013)
    terms = (White(N=1e-4), slow, quick, line)  # in no order of their times
    symbols = ["N", "sigma", "T", "sigma_2", "T_2", "amplitude"]
    shared = np.array([0.0 if s.startswith("T") else 0.01 for s in symbols])
    covariance = {"symbols": symbols, "matrix": np.outer(shared, shared).tolist()}
    fitted = NoiseModel(terms=terms, covariance=covariance)
    (pair,) = (
        model_difference({"g": NoiseModel.of(*terms)}, {"g": fitted}, seconds=(77.0,)).channels[0].drifts
    )
    for end in (pair.ratio.upper, 1 / pair.ratio.lower):
        assert math.log(end) == pytest.approx(1.96 * 0.01, rel=1e-4)


def test_time_of_a_gauss_markov_term_moves_the_ratio_at_the_sigma_that_was_fitted() -> None:
    """Long after T the drift of the term is sigma sqrt(2 T t): half of the error of ln T."""
    term = GaussMarkov.from_sigma(2e-5, 0.01)
    covariance = {"symbols": ["sigma", "T"], "matrix": [[0.0, 0.0], [0.0, 0.01**2]]}
    fitted = NoiseModel(terms=(term,), covariance=covariance)
    (pair,) = (
        model_difference({"g": NoiseModel.of(term)}, {"g": fitted}, seconds=(1000.0,)).channels[0].drifts
    )
    assert math.log(pair.ratio.upper) == pytest.approx(1.96 * 0.005, rel=1e-3)


def test_a_gauss_markov_term_that_is_not_resolved_is_not_what_is_shown() -> None:
    """The curve needs it or one like it: the lower end does without, the upper one has its limit as flicker."""
    n, sigma, t = 1e-4, 3e-5, 100.0
    fitted = NoiseModel(
        terms=(White(N=n), GaussMarkov.from_sigma(sigma, 50.0)),
        covariance={"symbols": ["N"], "matrix": [[0.0]]},
        estimates=(
            Estimate(symbol="N", value=n, lower=n, upper=n, supported=True),
            Estimate(symbol="sigma", value=None, lower=0.0, upper=4e-5, supported=False),
            Estimate(symbol="B_equiv", value=None, lower=0.0, upper=4e-5, supported=False),
        ),
    )
    (pair,) = (
        model_difference({"g": NoiseModel.of(White(N=n))}, {"g": fitted}, seconds=(t,)).channels[0].drifts
    )
    white, flicker = 2 * t * n**2, 2 * t**2 * float(Flicker(B=4e-5).avar(t))
    assert pair.ratio.lower == pytest.approx(1.0)
    assert pair.ratio.upper == pytest.approx(math.sqrt((white + flicker) / white))


def test_interval_goes_from_what_is_shown_to_all_limits() -> None:
    """By hand: white noise shown, a walk that the curve needs in place of something like it, flicker bounded."""
    n, k, t = 1e-4, 3e-6, 100.0
    fitted = NoiseModel(
        terms=(White(N=n), RandomWalk(K=k)),
        covariance={"symbols": ["N"], "matrix": [[0.0]]},
        estimates=(
            Estimate(symbol="N", value=n, lower=n, upper=n, supported=True),
            Estimate(symbol="K", value=None, lower=0.0, upper=2 * k, supported=False),
            Estimate(symbol="B", value=None, lower=0.0, upper=2e-5, supported=False),
        ),
    )
    (pair,) = (
        model_difference({"g": NoiseModel.of(White(N=n))}, {"g": fitted}, seconds=(t,)).channels[0].drifts
    )
    white, walk = 2 * t * n**2, 2 * t**3 * k**2 / 3
    flicker = 2 * t**2 * float(Flicker(B=2e-5).avar(t))
    assert pair.second == pytest.approx(math.sqrt(white + walk))
    assert pair.ratio.lower == pytest.approx(math.sqrt(white / white))
    assert pair.ratio.upper == pytest.approx(math.sqrt((white + 4 * walk + flicker) / white))


@pytest.mark.long
def test_interval_of_a_record_too_short_for_its_slow_noise() -> None:
    """One model, pairs of records of 200 s: the drift after 1000 s is extrapolated, and the interval says so."""
    truth, held = NoiseModel.of(White(N=2e-5), RandomWalk(K=3.5e-6)), []
    models = [
        al.fit(al.allan_curve(al.simulate(truth, rate=20.0, duration=200.0, seed=s))) for s in range(24)
    ]
    assert not any(isinstance(t, Ramp) for m in models for t in m.terms)  # none of them shows one
    for a, b in zip(models[::2], models[1::2], strict=True):
        for pair in model_difference({"g": a}, {"g": b}).channels[0].drifts:
            assert pair.ratio.resolved
            held.append(pair.ratio.lower <= 1 <= pair.ratio.upper)
    assert sum(held[0::3]) >= binom.ppf(1e-4, 12, 0.95)
    assert sum(held[1::3]) >= binom.ppf(1e-4, 12, 0.95)
    assert sum(held[2::3]) >= binom.ppf(1e-4, 12, 0.95)


def test_who_goes_with_whom() -> None:
    gyro, acc = NoiseModel.of(White(N=1.0)), NoiseModel.of(White(N=1.0), kind="acceleration")

    def pairs(first: Any, second: Any) -> list[tuple[str, str]]:
        return [c.names for c in model_difference(first, second).channels]

    assert pairs({"x": gyro, "a": acc}, {"a": acc, "x": gyro}) == [("x", "x"), ("a", "a")]
    assert pairs({"x": gyro, "y": gyro}, {"gyro": gyro}) == [("x", "gyro"), ("y", "gyro")]
    assert pairs({"x": gyro, "y": gyro}, {"p": gyro, "q": gyro}) == [("x", "p"), ("y", "q")]
    left = model_difference({"x": gyro}, {"x": gyro, "a": acc}, names=("A", "B")).unpaired
    assert left == ("a in B",)
    with pytest.raises(InputError, match="which go together"):
        pairs({"x": gyro, "y": gyro}, {"p": gyro, "q": gyro, "r": gyro})
    with pytest.raises(InputError, match="no sensor of a kind in both"):
        pairs({"x": gyro}, {"a": acc})
    with pytest.raises(InputError, match="positive time"):
        drift(gyro, 0.0)


def test_words_are_the_numbers() -> None:
    models = Study.from_json(build()).models
    sheet = NoiseModel.of(White(N=0.3 * ARW), Flicker(B=5 * DEG_H), RandomWalk(K=9 * RRW))
    result = model_difference({"gyro_x": models["gyro_x"]}, {"gyro_x": sheet})
    document = result.to_json()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    (lines,) = (
        b
        for b in view(ResultDocument(result=result)).blocks()
        if getattr(b, "heads", " ")[0] == "Drift after"
    )
    cells = [[cell.text for cell in row] for row, _ in lines.rows]
    assert [row[0] for row in cells] == ["1 s", "100 s", "1000 s"]
    assert cells[2][2] == f"{math.degrees(drift(sheet, 1000.0)):.2f} deg"


def test_command(run: Run, tmp_path: Path) -> None:
    study, out = tmp_path / "study.json", tmp_path / "out"
    document = build()
    document["channels"] = [c for c in document["channels"] if c["name"] == "gyro_x"]
    study.write_text(json.dumps(document), encoding="utf-8")
    imu = tmp_path / "imu.yaml"
    assert run("export", "kalibr", study, "-o", imu).code == 0
    done = run("diff", study, imu, "--out", out)
    assert done.code == 0, done.err
    assert "Drift after" in done.out and "1000 s" in done.out and "gyro_x / gyro" in done.out
    document = json.loads((out / "difference.json").read_text())
    assert document["format"] == "allanite-difference" and len(document["channels"]) == 1
    assert len((out / "difference.csv").read_text().splitlines()) == 1 + 3
    page = (out / "report.html").read_text()
    assert "Two noise models side by side" in page and "imu.yaml" in page
    for pair in document["channels"][0]["drifts"]:
        assert pair["ratio"]["value"] > (1 if pair["seconds"] > 1 else 0.9), (
            "a walk above the bias where that matters"
        )
    words = run(
        "diff", "N=0.3 deg/√h, B=5 deg/h", "N=0.4 deg/√h", "--after", "10s", "--rest", "60s", "--json"
    )
    only = json.loads(words.out)["channels"][0]["drifts"]
    assert [p["seconds"] for p in only] == [10.0] and only[0]["ratio"]["lower"] is None
    assert run("diff", study, tmp_path / "none.json").code == 1
    named = json.loads(study.read_text(encoding="utf-8"))
    named["channels"][0]["name"] = '=HYPERLINK("x")'
    study.write_text(json.dumps(named), encoding="utf-8")
    assert run("diff", study, imu, "--out", tmp_path / "f9").code == 0
    rows = list(csv.reader((tmp_path / "f9" / "difference.csv").read_text().splitlines()))
    assert [row[0] for row in rows[1:]] == ['\'=HYPERLINK("x")'] * 3, "a label is no formula"
    with pytest.raises(InputError, match="no view"):
        al.plot(document, view="none")
