# SPDX-License-Identifier: BSD-3-Clause
"""Dead reckoning: closed forms, eigenfrequencies, simulated units, intervals, and what the command hands over."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from verification.dead_reckoning import CASES, STATES, strapdown_errors

import allanite as al
from allanite.commands.dead_reckoning import dead_reckoning_of
from allanite.errors import InputError
from allanite.experiments.dead_reckoning import DeadReckoning, InitialErrors, ReckoningRemark, dead_reckon
from allanite.experiments.dead_reckoning.dynamics import error_dynamics, radii
from allanite.experiments.dead_reckoning.intervals import VariancePart, interval
from allanite.experiments.dead_reckoning.propagation import covariances
from allanite.experiments.dead_reckoning.results import LINEAR
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
from allanite.quantities.earth import EARTH_RATE, normal_gravity
from allanite.views.plain_page import plain_page
from shell import Run

OLD = Path(__file__).parent / "documents"
LATITUDE = 0.84
G = normal_gravity(LATITUDE)
DEG = math.radians(1)


def budget(*terms: TermType, kind: str = "rate", t: float = 10.0, **options: Any) -> DeadReckoning:
    model = NoiseModel.of(*terms, kind=kind)
    return dead_reckon(model, latitude=LATITUDE, duration=t, times=[t], **options)


# -- closed forms -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("term", "gyro", "accelerometer"),
    [
        (White(N=1e-4), lambda t: G * 1e-4 * math.sqrt(t**5 / 20), lambda t: 1e-4 * math.sqrt(t**3 / 3)),
        (
            RandomWalk(K=1e-6),
            lambda t: G * 1e-6 * math.sqrt(t**7 / 252),
            lambda t: 1e-6 * math.sqrt(t**5 / 20),
        ),
        (Ramp(R=1e-7), lambda t: G * 1e-7 * t**4 / 24, lambda t: 1e-7 * t**3 / 6),
        # so slow that it is a constant
        (GaussMarkov.from_sigma(1e-4, 1e9), lambda t: G * 1e-4 * t**3 / 6, lambda t: 1e-4 * t**2 / 2),
        # so fast that it is white, of density 2 sigma^2 T
        (
            GaussMarkov.from_sigma(1e-2, 1e-6),
            lambda t: G * math.sqrt(2e-10 * t**5 / 20),
            lambda t: math.sqrt(2e-10 * t**3 / 3),
        ),
    ],
    ids=lambda x: type(x).__name__,
)
def test_position_at_short_times_is_the_closed_form(term: TermType, gyro: Any, accelerometer: Any) -> None:
    """Corrections are of the order of (t/134 min)^2, 1.6e-6 after 10 s, and of the Earth's rotation in 10 s."""
    for kind, known in (("rate", gyro), ("acceleration", accelerometer)):
        found = budget(term, kind=kind)
        for axis in ("position_north", "position_east"):
            assert found[axis][-1] == pytest.approx(known(10.0), rel=2e-5)
        together = math.hypot(found["position_north"][-1], found["position_east"][-1])
        assert found["position_horizontal"][-1] == pytest.approx(together, rel=1e-12)


def test_quantisation_tilts_at_the_start_and_jitters() -> None:
    """Attitude e(t) - e(0); velocity g (integral of e - e(0) t), the jitter being white of density Q^2 dt."""
    q, dt, t = 1e-5, 0.01, 10.0
    found = budget(Quantisation(Q=q, dt=dt))
    assert found["tilt_east"][-1] == pytest.approx(math.sqrt(2) * q, rel=1e-4)
    assert found["velocity_north"][-1] == pytest.approx(G * q * math.sqrt(t**2 + dt * t), rel=1e-4)


def test_flicker_is_the_sum_that_simulation_uses() -> None:
    """The variance of the heading is that of the integral of the sum's autocovariance."""
    b, t, dt = 1e-5, 100.0, 0.01
    found = dead_reckon(NoiseModel.of(Flicker(B=b)), latitude=LATITUDE, duration=t, times=[t], rate=1 / dt)
    states = Flicker(B=b).markov(dt, sampling="mean", record=t, ratio=math.sqrt(10)).states
    variance = 0.0
    for s in states:
        if 0 < s.phi < 1:
            time = -dt / math.log(s.phi)
            x = t / time
            variance += s.start**2 * 2 * time**2 * (x - 1 + math.exp(-x))
        elif s.phi == 1:
            variance += (s.step**2 / dt) * t**3 / 3
    assert found["heading"][-1] == pytest.approx(math.sqrt(variance), rel=2e-3)


def test_a_line_swings() -> None:
    size, f, t = 1e-3, 0.3, 7.3
    found = budget(Sinusoid(amplitude=size, frequency=f), t=t)
    w = 2 * math.pi * f
    known = size / w * math.sqrt((math.sin(w * t) ** 2 + (1 - math.cos(w * t)) ** 2) / 2)
    assert found["heading"][-1] == pytest.approx(known, rel=1e-5)


@pytest.mark.parametrize(
    ("initial", "quantity", "known"),
    [
        ({"velocity": 0.1}, "position_north", lambda t: 0.1 * t),
        ({"position": 5.0}, "position_east", lambda t: 5.0),
        ({"tilt": 1e-3}, "position_east", lambda t: G * 1e-3 * t**2 / 2),
        ({"gyro_bias": 1e-5}, "position_north", lambda t: G * 1e-5 * t**3 / 6),
        ({"accelerometer_bias": 1e-3}, "position_north", lambda t: 1e-3 * t**2 / 2),
        ({"accelerometer_scale": 1e-3}, "position_down", lambda t: 1e-3 * G * t**2 / 2),
        ({"accelerometer_misalignment": 1e-3}, "position_north", lambda t: 1e-3 * G * t**2 / 2),
        ({"heading": 0.1}, "tilt_east", lambda t: 0.1 * EARTH_RATE * math.cos(LATITUDE) * t),
        ({"gyro_scale": 0.01}, "tilt_north", lambda t: 0.01 * EARTH_RATE * math.cos(LATITUDE) * t),
        ({"gyro_misalignment": 0.01}, "tilt_east", lambda t: 0.01 * EARTH_RATE * t),
    ],
    ids=[
        "velocity",
        "position",
        "tilt",
        "gyro bias",
        "accelerometer bias",
        "accelerometer scale",
        "accelerometer misalignment",
        "heading",
        "gyro scale",
        "gyro misalignment",
    ],
)
def test_initial_errors_at_short_times(initial: dict[str, float], quantity: str, known: Any) -> None:
    models = {
        "gyro": NoiseModel.of(White(N=0.0)),
        "accelerometer": NoiseModel.of(White(N=0.0), kind="acceleration"),
    }
    found = dead_reckon(
        models, latitude=LATITUDE, duration=10.0, times=[10.0], initial=InitialErrors(**initial)
    )
    assert found[quantity][-1] == pytest.approx(known(10.0), rel=1e-3)


def test_schuler_foucault_and_the_day_are_in_the_dynamics() -> None:
    rates = np.sort(np.abs(np.linalg.eigvals(error_dynamics(LATITUDE, held=True)).imag))[::2]
    meridian, across = radii(LATITUDE)
    schuler = math.sqrt(G / math.sqrt(meridian * across))
    turn = EARTH_RATE * math.sin(LATITUDE)
    assert rates[-2:] == pytest.approx([schuler - turn, schuler + turn], rel=1e-3)
    assert EARTH_RATE == pytest.approx(rates[rates > 1e-5][0], rel=1e-2)
    fastest = np.linalg.eigvals(error_dynamics(LATITUDE)).real.max()
    assert fastest == pytest.approx(math.sqrt(2 * G / meridian), rel=5e-3)


def test_a_constant_accelerometer_bias_swings_and_does_not_grow() -> None:
    """After half a period of Schuler 2 b/w^2; after a whole one next to nothing."""
    schuler = math.sqrt(G / radii(LATITUDE)[0])
    half = math.pi / schuler
    model = NoiseModel.of(White(N=0.0), kind="acceleration")
    found = dead_reckon(
        model, latitude=LATITUDE, duration=2 * half, times=[half, 2 * half], held=True,
        initial=InitialErrors(accelerometer_bias=1e-3),
    )  # fmt: skip
    middle, end = (found["position_north"][int(np.argmin(np.abs(found.times - t)))] for t in found.shown)
    assert middle == pytest.approx(2e-3 / schuler**2, rel=0.1)
    assert end < 0.3 * middle


def test_doubling_is_the_matrix_exponential(rng: np.random.Generator) -> None:
    f = np.stack([0.3 * rng.standard_normal((4, 4)), np.diag([-1e4, -1.0, 0.0, 0.1])])
    w, start = np.stack([np.eye(4), np.diag([1e4, 1, 1, 0])]), np.zeros((2, 4, 4))
    found = covariances(f, w, start, np.array([0.0, 1.5, 3.0]))
    assert not found[0].any()
    known = [
        quad(lambda s, i=i: (expm(f[0] * s) @ expm(f[0] * s).T)[i, i], 0, 3.0, epsabs=1e-12)[0]
        for i in range(4)
    ]
    assert np.diagonal(found[2, 0]) == pytest.approx(known, rel=1e-9)
    # a state that forgets 10 000 times a second does not overflow
    assert np.diagonal(found[2, 1]) == pytest.approx([0.5, 0.5 * (1 - math.exp(-6)), 3.0, 0.0], rel=1e-12)


# -- simulated units ------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        "MEMS, after 60 s at rest",
        "MEMS, after 60 s at rest, vertical bias removed",
        "tactical, all initial errors",
    ],
)
def test_simulated_units_err_as_told(name: str) -> None:
    """200 units know a standard deviation to 5 %."""
    whole, last = CASES[name], 40.0
    case = replace(whole, times=(last,))
    found = dead_reckon(
        case.models, latitude=case.latitude, duration=last, times=[last], initial=case.initial, rest=case.rest,
        vertical=case.vertical, rate=case.rate,
    )  # fmt: skip
    errors = strapdown_errors(case, np.random.SeedSequence(11), 200)[0]
    rms = np.sqrt((errors**2).mean(axis=0))
    for state, column in STATES.items():
        assert rms[column] == pytest.approx(found[state][-1], rel=0.2), state


@pytest.mark.parametrize("term", [White(N=1e-4), RandomWalk(K=3e-7), Flicker(B=2e-5)], ids=lambda t: t.type)
def test_the_heading_is_the_drift_of_one_axis_while_the_earth_has_hardly_turned(term: TermType) -> None:
    """`allanite diff` integrates one axis alone: equal within the Earth's turn, 0.07 rad in 1000 s, and the sum of
    states that stands for flicker; 1000 s of tilt are less by the swing of Schuler."""
    from allanite.fitting.model_difference import drift

    for t, apart in ((1.0, 1e-3), (100.0, 1e-3), (1000.0, 0.05)):
        found = budget(term, t=t, rest=t, rate=100.0)
        alone = drift(NoiseModel.of(term), t)
        assert found.sd[-1][found.quantities.index("heading")] == pytest.approx(alone, rel=apart)
        tilt = found.sd[-1][found.quantities.index("tilt_north")] / alone
        assert tilt == pytest.approx(1.0 if t < 1000 else 0.8, abs=0.004 if t < 1000 else 0.04)


def test_rest_takes_constants_off() -> None:
    models = {
        "gyro": NoiseModel.of(White(N=1e-5)),
        "accelerometer": NoiseModel.of(White(N=1e-5), kind="acceleration"),
    }
    begun = InitialErrors(gyro_bias=1e-3, accelerometer_bias=1e-2, heading=0.02, gyro_scale=0.1)
    found = dead_reckon(models, latitude=LATITUDE, rest=30.0, vertical=True, initial=begun, duration=600.0)
    alone = dead_reckon(models, latitude=LATITUDE, rest=30.0, vertical=True, duration=600.0)
    assert found["position_horizontal"] == pytest.approx(alone["position_horizontal"], rel=1e-6)
    # what an accelerometer's bias does is tilt the unit
    tilt = found.by_source("tilt_north")["accelerometer turn-on bias"]
    assert tilt == pytest.approx(np.full(len(tilt), 1e-2 / G), rel=1e-3)
    # and the mean of white noise over 30 s is a constant rate after it
    short = dead_reckon(models, latitude=LATITUDE, rest=30.0, vertical=True, duration=60.0)
    known = math.hypot(1e-5 * math.sqrt(60.0), 1e-5 / math.sqrt(30.0) * 60.0)
    assert short["heading"][-1] == pytest.approx(known, rel=2e-3)


@pytest.mark.parametrize(
    ("bias", "rest", "t"), [(9.81e-3, 60.0, 60.0), (1e-2, 5.0, 10.0), (2e-4, 300.0, 30.0)]
)
def test_the_vertical_bias_stays_in_the_height_unless_it_is_asked_to_go(
    bias: float, rest: float, t: float
) -> None:
    """b t^2/2, less than (t/10 min)^2 from it; and what happens to it is told either way."""
    quiet, begun = NoiseModel.of(White(N=1e-9), kind="acceleration"), InitialErrors(accelerometer_bias=bias)
    options: dict[str, Any] = {"latitude": LATITUDE, "rest": rest, "initial": begun, "duration": t}
    kept = dead_reckon(quiet, **options)
    assert kept["position_down"][-1] == pytest.approx(bias * t**2 / 2, rel=0.02)
    assert any("stays in the height" in note for note in kept.notes)
    gone = dead_reckon(quiet, vertical=True, **options)
    assert gone["position_down"][-1] < 1e-4 * bias * t**2
    assert any("is removed at rest" in note for note in gone.notes)
    coriolis = 1e-4 * bias * t**2  # what falls is carried aside
    assert kept["position_north"] == pytest.approx(gone["position_north"], abs=coriolis)
    assert [kept.to_json()["vertical"], gone.to_json()["vertical"]] == [False, True]


def test_heading_turns_the_axes() -> None:
    axes = {
        "x": NoiseModel.of(White(N=1e-3)), "y": NoiseModel.of(White(N=1e-4)), "z": NoiseModel.of(White(N=1e-5)),
    }  # fmt: skip
    north = dead_reckon(axes, latitude=LATITUDE, duration=10.0)
    east = dead_reckon(axes, latitude=LATITUDE, duration=10.0, heading=math.pi / 2)
    assert north["tilt_north"][-1] == pytest.approx(1e-3 * math.sqrt(10), rel=1e-3)
    assert east["tilt_east"][-1] == pytest.approx(1e-3 * math.sqrt(10), rel=1e-3)
    assert north["heading"][-1] == pytest.approx(1e-5 * math.sqrt(10), rel=1e-2)


# -- intervals ------------------------------------------------------------------------------------------------------


def fitted(**more: Any) -> NoiseModel:
    estimates = (
        Estimate(symbol="N", value=1e-4, lower=0.9e-4, upper=1.2e-4, supported=True),
        Estimate(symbol="K", value=None, lower=0.0, upper=1e-6, supported=False),
        Estimate(symbol="R", value=None, lower=0.0, upper=math.inf, supported=False),
    )
    return NoiseModel(terms=(White(N=1e-4),), estimates=estimates[: more.pop("count", 2)], **more)


def test_intervals_follow_from_those_of_the_parameters() -> None:
    found = dead_reckon(fitted(), latitude=LATITUDE, duration=60.0, times=[60.0])
    own = {s.name: s for s in found.sources}
    n, k = own["gyro N"], own["gyro K"]
    assert n.lower[-1] == pytest.approx(0.9 * n.sd[-1])
    assert n.upper[-1] == pytest.approx(1.2 * n.sd[-1])
    assert k.is_limit
    assert not k.sd.any()
    at = found.quantities.index("heading")
    assert k.upper[-1, at] == pytest.approx(1e-6 * math.sqrt(60**3 / 3), rel=1e-3)
    v, up_n, up_k = n.sd[-1, at] ** 2, n.upper[-1, at] ** 2, k.upper[-1, at] ** 2
    assert found.upper[-1, at] ** 2 == pytest.approx(v + math.hypot(up_n - v, up_k), rel=1e-9)
    assert found.lower[-1, at] == pytest.approx(n.lower[-1, at])
    assert any("not resolved" in note and "gyro K" in note for note in found.notes)


def test_an_open_end_is_infinite_and_no_interval_is_none() -> None:
    open_ = dead_reckon(fitted(count=3), latitude=LATITUDE, duration=60.0)
    assert np.isinf(open_.upper[-1]).any()
    assert np.isfinite(open_.lower).all()
    assert open_.to_json()["upper"][-1][0] is None
    words = dead_reckon(NoiseModel.of(White(N=1e-4)), latitude=LATITUDE, duration=60.0)
    assert np.isnan(words.upper).all()
    assert any("no intervals" in note for note in words.notes)


def test_a_correlation_time_enters_by_its_ends_and_limits_of_one_as_flicker() -> None:
    sigma, time = 3e-5, 100.0
    estimates = (
        Estimate(symbol="sigma", value=sigma, lower=sigma, upper=sigma, supported=True),
        Estimate(symbol="T", value=time, lower=50.0, upper=200.0, supported=True),
    )
    model = NoiseModel(terms=(GaussMarkov.from_sigma(sigma, time),), estimates=estimates)
    found = dead_reckon(model, latitude=LATITUDE, duration=1000.0, times=[1000.0])
    for end, t in ((found.lower, 50.0), (found.upper, 200.0)):
        other = dead_reckon(
            NoiseModel.of(GaussMarkov.from_sigma(sigma, t)),
            latitude=LATITUDE,
            duration=1000.0,
            times=[1000.0],
        )
        assert end[-1] == pytest.approx(other.sd[-1], rel=1e-9)
    limits = (
        Estimate(symbol="N", value=1e-4, lower=9e-5, upper=1.1e-4, supported=True),
        Estimate(symbol="sigma", value=None, lower=0.0, upper=1e-5, supported=False),
        Estimate(symbol="B_equiv", value=None, lower=0.0, upper=9e-6, supported=False),
        Estimate(symbol="T", value=None, lower=0.0, upper=math.inf, supported=False),
    )
    none = dead_reckon(
        NoiseModel(terms=(White(N=1e-4),), estimates=limits), latitude=LATITUDE, duration=60.0, times=[60.0]
    )
    flicker = budget(Flicker(B=9e-6), t=60.0)
    assert [s.name for s in none.sources if s.is_limit] == ["gyro B"]
    assert next(s for s in none.sources if s.is_limit).upper[-1] == pytest.approx(flicker.sd[-1])


@pytest.mark.parametrize("order", [1, -1])
def test_of_two_gauss_markov_terms_each_enters_by_its_own_ends(order: int) -> None:
    """The slower one is not resolved by itself: its limit is its own, not that of the quicker one."""
    quick, slow = GaussMarkov.from_sigma(3e-5, 100.0), GaussMarkov.from_sigma(1e-5, 1000.0)
    estimates = (
        Estimate(symbol="sigma", value=3e-5, lower=3e-5, upper=3e-5, supported=True),
        Estimate(symbol="sigma_2", value=None, lower=0.0, upper=2e-5, supported=False),
    )
    model = NoiseModel(terms=(quick, slow)[::order], estimates=estimates)
    found = dead_reckon(model, latitude=LATITUDE, duration=600.0, times=[600.0])
    alone, beside = (budget(t, t=600.0).sd[-1] ** 2 for t in (quick, slow))
    assert found.lower[-1] ** 2 == pytest.approx(alone, rel=1e-9)
    assert found.upper[-1] ** 2 == pytest.approx(alone + 4 * beside, rel=1e-9)


def test_correlated_estimates_add_as_they_correlate() -> None:
    model = fitted(covariance={"symbols": ["N", "K"], "matrix": [[0.04, -0.04], [-0.04, 0.04]]})
    one = np.ones(1)
    parts = [
        VariancePart(key=("g", symbol), value=one, lower=0.5 * one, upper=2 * one, direction=one)
        for symbol in ("N", "K")
    ]
    low, high = interval(2 * one, parts, {"g": model})
    assert low == pytest.approx(2.0)
    assert high == pytest.approx(2.0)
    other = replace(parts[1], key=("h", "K"))
    low, high = interval(2 * one, [parts[0], other], {"g": model, "h": model})
    assert low == pytest.approx(2 - math.sqrt(0.5))
    assert high == pytest.approx(2 + math.sqrt(2.0))


def test_three_axes_of_one_model_err_together_in_the_interval_and_three_models_do_not() -> None:
    one = dead_reckon(fitted(), latitude=LATITUDE, duration=60.0, times=[60.0])
    three = dead_reckon(dict.fromkeys("xyz", fitted()), latitude=LATITUDE, duration=60.0, times=[60.0])
    at = one.quantities.index("tilt")
    assert three.sd[-1] == pytest.approx(one.sd[-1])
    assert [s.name for s in three.sources] == [s.name for s in one.sources]
    assert three.upper[-1, at] < one.upper[-1, at]


# -- what is said, and refused -------------------------------------------------------------------------------------


def test_notes_say_what_is_missing_and_where_the_model_ends() -> None:
    bad = dead_reckon(
        NoiseModel.of(White(N=1e-2), Flicker(B=1e-3)),
        latitude=LATITUDE,
        duration=3600.0,
        initial=InitialErrors(),
    )
    notes = " ".join(bad.notes)
    for words in ("accelerometers", "no initial errors", "10 deg", "second-order"):
        assert words in notes
    assert bad.linear_until is not None
    assert bad.linear_until < 3600
    # g tilt^2/2 twice integrated, of a tilt that is constant
    still = dead_reckon(
        NoiseModel.of(White(N=0.0)), latitude=LATITUDE, duration=10.0, initial=InitialErrors(tilt=0.01)
    )
    assert still.sinking[-1] == pytest.approx(G * 2 * 1e-4 / 2 * 100 / 2, rel=1e-3)


def test_every_remark_is_in_a_document_of_version_1_and_the_first_documents_are_read() -> None:
    documents = [json.loads(p.read_text(encoding="utf-8")) for p in OLD.glob("dead-reckoning-1-*.json")]
    codes = {code for d in documents for code in DeadReckoning.from_json(d).remarks}
    assert codes == {*ReckoningRemark}
    first = next(d for d in documents if d["rest"] and d["vertical"])
    del first["vertical"]
    assert DeadReckoning.from_json(first).vertical


def test_an_alternative_is_told() -> None:
    flicker = NoiseModel.of(White(N=1e-4), Flicker(B=2e-5))
    both = replace(flicker, alternative=NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(2e-5, 100.0)))
    found = dead_reckon({"gyro": both}, latitude=LATITUDE)
    assert found.sd == pytest.approx(dead_reckon({"gyro": flicker}, latitude=LATITUDE).sd, nan_ok=True)
    assert any("cannot decide" in note for note in found.notes)


@pytest.mark.parametrize(
    ("models", "options", "message"),
    [
        ({"v": NoiseModel.of(White(N=1.0), kind="voltage")}, {}, "not of voltage"),
        (dict.fromkeys("xy", NoiseModel.of(White(N=1.0))), {}, "2 noise models of a gyro"),
        (NoiseModel.of(White(N=1.0)), {"latitude": math.pi / 2}, "pole"),
        (NoiseModel.of(White(N=1.0)), {"duration": -1.0}, "duration must be positive"),
        (NoiseModel.of(White(N=1.0)), {"duration": 1e7}, "30 days"),
        (NoiseModel.of(White(N=1.0)), {"rest": 0.0}, "rest must be positive"),
        (NoiseModel.of(White(N=1.0)), {"vertical": True}, "only a rest shows"),
        (NoiseModel.of(White(N=1.0)), {"times": [7200.0]}, "between 0 and the duration"),
        (NoiseModel.of(White(N=1.0)), {"heading": math.nan}, "heading must be"),
        (NoiseModel.of(White(N=0.0)), {}, "no error to compute"),
    ],
)
def test_refusals(models: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        dead_reckon(models, **{"latitude": LATITUDE, **options})
    with pytest.raises(InputError, match="tilt must be finite"):
        InitialErrors(tilt=-1.0)
    with pytest.raises(InputError, match="no quantity 'depth'"):
        _ = budget(White(N=1.0))["depth"]


# -- the end of the linear model ----------------------------------------------------------------------------------

NAVIGATION_GRADE = {
    "gyro": NoiseModel.of(White(N=3e-7), Flicker(B=1.5e-8)),
    "accelerometer": NoiseModel.of(White(N=5e-5), Flicker(B=5e-5), kind="acceleration"),
}
MEMS = {
    "gyro": NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), RandomWalk(K=3e-6)),
    "accelerometer": NoiseModel.of(White(N=1e-3), GaussMarkov.from_sigma(1e-3, 300.0), kind="acceleration"),
}
DAY = 86400.0


@pytest.mark.long
@pytest.mark.parametrize("duration", [60.0, DAY, 3 * DAY, 30 * DAY])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("models", [NAVIGATION_GRADE, MEMS], ids=["navigation", "mems"])
def test_no_error_is_stated_beyond_the_linear_model(
    models: dict[str, NoiseModel], held: bool, duration: float
) -> None:
    initial = InitialErrors(heading=1e-3, gyro_bias=1e-8, accelerometer_bias=1e-4)
    made = dead_reckon(models, latitude=LATITUDE, duration=duration, held=held, initial=initial)
    resolved = np.isfinite(made.sd).all(axis=1)
    assert resolved[: made.last + 1].all() and not np.isfinite(made.sd[made.last + 1 :]).any()
    assert all(np.nanmax(made[quantity]) <= limit for quantity, limit in LINEAR.items())
    ended = made.resolved_until is not None
    assert ended is (made.last + 1 < len(made.times)) is (ReckoningRemark.ENDS in made.remarks)
    assert not ended or made.resolved_until == made.times[made.last]
    for source in made.sources:
        assert not np.isfinite(source.sd[made.last + 1 :]).any()
        upper = source.upper[: made.last + 1, made.column("position_horizontal")]
        assert not (np.isfinite(upper) & (upper > LINEAR["position_horizontal"])).any()
    shown = plain_page(json.loads(json.dumps(made.to_json(), allow_nan=False)))
    assert "nan" not in json.dumps(shown).replace("nance", "")
    assert ("Not resolved beyond" in json.dumps(shown)) is ended


def test_the_end_is_the_same_for_every_longer_duration_and_the_numbers_before_it_too() -> None:
    """An unaided height leaves the linear model after hours; what is stated before does not depend on what follows."""
    model = NoiseModel.of(White(N=5e-5), kind="acceleration")
    times = [3600.0, 6 * 3600.0]
    short, long = (
        dead_reckon(model, latitude=LATITUDE, duration=t, times=times) for t in (6 * 3600.0, 30 * DAY)
    )
    assert short.resolved_until is not None or short.sd[-1, short.column("position_down")] < 6.4e5
    for a, b in zip(short.rows, long.rows, strict=True):
        np.testing.assert_allclose(long.sd[b], short.sd[a], rtol=1e-9)
    ends = [
        dead_reckon(model, latitude=LATITUDE, duration=t).resolved_until for t in (2 * DAY, 7 * DAY, 30 * DAY)
    ]
    assert all(end is not None and 0.8 < end / ends[0] < 1.25 for end in ends if ends[0] is not None)


@pytest.mark.parametrize("name", ["not-linear", "beyond-the-record", "ramp-not-decided", "strong"])
def test_former_documents_lose_what_is_beyond_the_linear_model(name: str) -> None:
    document = json.loads((OLD / f"dead-reckoning-1-{name}.json").read_text(encoding="utf-8"))
    made = DeadReckoning.from_json(document)
    assert made.resolved_until is not None and made.resolved_until < made.duration
    assert made.says.endswith("later errors are not resolved") and "e+" not in made.says
    assert DeadReckoning.from_json(made.to_json()).says == made.says


def test_initial_errors_beyond_the_linear_model_are_refused() -> None:
    with pytest.raises(InputError, match="beyond the linear error model"):
        dead_reckon(MEMS, latitude=LATITUDE, initial=InitialErrors(heading=2.0))


# -- the command -----------------------------------------------------------------------------------------------------


def test_command_writes_report_document_and_table(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "budget"
    done = run(
        "dead-reckon", "--model", "N=0.3 deg/√h, B=5 deg/h", "--model", "N=60 µg/√Hz", "--latitude", "48.1",
        "--duration", "10min", "--rest", "60s", "--initial", "heading=1deg,accelerometer.bias=1mg", "--out", out,
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "Horizontal position [m]" in done.out
    assert "gyro B" in done.out
    document = json.loads((out / "dead-reckoning.json").read_text(encoding="utf-8"))
    assert document["initial"]["heading"] == pytest.approx(DEG)
    assert document["upper"][-1][0] is None
    assert (
        (out / "errors.csv").read_text(encoding="utf-8").startswith("time_s,source,quantity,sd,lower,upper\n")
    )
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Dead-reckoning error" in page


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("heading=1deg/h", "angle rate"),
        ("colour=1deg", "not an initial error"),
        ("tilt=1", "number with its unit"),
        ("tilt=-1deg", "not negative"),
    ],
)
def test_initial_errors_in_words_are_refused_with_a_reason(run: Run, words: str, message: str) -> None:
    done = run("dead-reckon", "--model", "N=0.3 deg/√h", "--latitude", "48", "--initial", words)
    assert done.code == 2
    assert message in done.err


def test_models_of_another_program_tell_their_rate_but_no_length_of_a_record(tmp_path: Path) -> None:
    place = tmp_path / "imu.yaml"
    place.write_text(
        "update_rate: 200.0\ngyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 1.9e-5\n"
        "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"
    )
    found = dead_reckoning_of([place], latitude=LATITUDE, duration=60.0)
    assert found.plain["rate"] == 200.0
    assert not any("extrapolated" in note for note in found.result.notes)


def test_figures_of_every_view() -> None:
    found = dead_reckon(fitted(), latitude=LATITUDE, duration=600.0)
    assert len(al.plot(found).axes) >= 5
    held = dead_reckon(fitted(), latitude=LATITUDE, duration=600.0, held=True)
    with pytest.raises(InputError, match="the height is held"):
        al.plot(held, view="height")
