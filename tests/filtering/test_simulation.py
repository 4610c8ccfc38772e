# SPDX-License-Identifier: BSD-3-Clause
"""Simulated records against the closed forms of their terms, with bounds from theory and fixed seeds."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.filtering.simulation import record as simulation
from allanite.noise import (
    TERMS,
    Estimate,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    White,
)

DT = 0.02
LAGS = (1, 2, 5, 20, 100, 1000)
CASES: dict[str, Any] = {
    "quantisation": Quantisation(Q=0.3, dt=DT),
    "white": White(N=0.7),
    "flicker": Flicker(B=0.4),
    "random_walk": RandomWalk(K=1.3),
    "ramp": Ramp(R=2e-3),
    "gauss_markov": GaussMarkov(q=1.0, T=0.31),
    "sinusoid": Sinusoid(amplitude=0.8, frequency=2.5, phase=0.4),
}
RANDOM = [key for key in CASES if key not in ("ramp", "sinusoid")]


def made(term: Any, n: int, seed: int = 1, **options: Any) -> np.ndarray:
    record = al.simulate(
        NoiseModel.of(term), rate=1 / DT, duration=n * DT, seed=seed, unit="unknown", name="x", **options
    )
    assert record.n_samples == n
    return record.values("x")


def avar(y: np.ndarray, m: int) -> float:
    phase = np.concatenate([[0.0], np.cumsum(y - y.mean())])
    d = phase[2 * m :] - 2 * phase[m:-m] + phase[: -2 * m]
    return float(np.mean(d**2)) / (2 * m**2)


@cache
def relative_sd(key: str, n: int, m: int, sampling: str) -> float:
    """Of the overlapping Allan variance: Var = 2/M^2 sum n_k r(k)^2, from the phase covariance of the term."""
    count = n - 2 * m + 1
    reach = min(count, 40 * m + 4000)  # beyond, r(k) is nothing for these terms
    k = np.arange(reach, dtype=float)
    weights = {-2: 1, -1: -4, 0: 6, 1: -4, 2: 1}
    r = sum(w * CASES[key].phase_covariance(k + j * m, DT, sampling) for j, w in weights.items()) / (
        2 * m * m
    )
    pairs = np.where(k == 0, 1, 2) * (count - k)
    return math.sqrt(2 * np.sum(pairs * r**2)) / count / r[0]


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("key", RANDOM)
def test_variance_of_each_term_in_both_samplings(key: str, sampling: str) -> None:
    n, term = 400_000, CASES[key]
    y = made(term, n, sampling=sampling)
    for m in LAGS:
        expected = float(term.avar_sampled(m, DT, sampling))
        assert avar(y, m) == pytest.approx(expected, rel=4 * relative_sd(key, n, m, sampling)), m


def test_every_term_is_simulated() -> None:
    assert set(CASES) == set(TERMS)
    for term in CASES.values():
        for sampling in ("mean", "point"):
            assert np.isfinite(made(term, 50, sampling=sampling)).all()


def test_c1_white(rng: np.random.Generator) -> None:
    y = al.simulate(NoiseModel.of(White(N=1.0)), rate=1.0, duration=2_000_000, seed=5).values("gyro")
    for m, edf in ((1, 2 / 3 * 2e6), (100, 2e6 / 100 * 1.4), (10_000, 2e6 / 1e4 * 1.4)):
        assert avar(y, m) == pytest.approx(1 / m, rel=4 * math.sqrt(2 / edf))


def test_c2_point_sampled_random_walk() -> None:
    n = 1_000_000
    y = made(RandomWalk(K=1 / math.sqrt(DT)), n, sampling="point")
    expected = {1: 0.5, 2: 0.75, 5: 1.7, 10: 3.35, 100: 33.335}
    for m, value in expected.items():
        assert avar(y, m) == pytest.approx(value, rel=4 * math.sqrt(2 * m / n))


@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_c6_ramp(sampling: str) -> None:
    y = made(Ramp(R=2e-3 / DT), 1000, sampling=sampling)
    for m in (1, 10, 400):
        assert avar(y, m) == pytest.approx((2e-3 * m) ** 2 / 2, rel=1e-12)
    assert y[0] == pytest.approx(1e-3 if sampling == "mean" else 0.0, abs=1e-18)


@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_c7_sinusoid(sampling: str) -> None:
    term = CASES["sinusoid"]
    y = made(term, 200_000, sampling=sampling)
    for m in (1, 3, 7, 11):
        assert avar(y, m) == pytest.approx(float(term.avar_sampled(m, DT, sampling)), rel=1e-4)
    if sampling == "point":
        assert y[0] == pytest.approx(0.8 * math.sin(0.4), rel=1e-12)


# -- streams ----------------------------------------------------------------------------------------------

EVERYTHING = NoiseModel(terms=tuple(CASES.values()))


def test_m10_block_size_leaves_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> np.ndarray:
        return al.simulate(EVERYTHING, rate=50.0, duration=100.0, seed=3).values("gyro")

    whole = run()
    for normals in (1, 700, 1 << 20):
        monkeypatch.setattr(simulation, "NORMALS", normals)
        np.testing.assert_array_equal(run(), whole)


def test_seed_decides() -> None:
    first, again, other = (made(White(N=1.0), 100, seed=s) for s in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_generator_gives_a_seed_that_the_record_states() -> None:
    generator = np.random.default_rng(6)
    model = NoiseModel.of(White(N=1.0))
    first, second = (al.simulate(model, rate=1.0, duration=100.0, seed=generator) for _ in range(2))
    assert not np.array_equal(first.values("gyro"), second.values("gyro"))
    for record in (first, second):
        again = al.simulate(model, rate=1.0, duration=100.0, seed=record.history[0]["seed"])
        np.testing.assert_array_equal(again.values("gyro"), record.values("gyro"))
    repeated = al.simulate(model, rate=1.0, duration=100.0, seed=np.random.default_rng(6))
    np.testing.assert_array_equal(repeated.values("gyro"), first.values("gyro"))


@pytest.mark.parametrize("seed", [-1, 1.5, True, "1", None])
def test_what_is_no_seed_is_refused(seed: Any) -> None:
    with pytest.raises(al.InputError, match="Generator"):
        al.simulate(NoiseModel.of(White(N=1.0)), rate=1.0, duration=10.0, seed=seed)


def test_channels_are_independent() -> None:
    n = 40_000
    model = NoiseModel.of(White(N=1.0), GaussMarkov(q=1.0, T=1.0))
    record = al.simulate({"x": model, "y": model}, rate=1.0, duration=n, seed=8)
    correlation = np.corrcoef(record.values("x"), record.values("y"))[0, 1]
    assert abs(correlation) < 4 * 1.5 / math.sqrt(n)  # 1.5: the samples of a channel are correlated
    alone = al.simulate({"x": model}, rate=1.0, duration=n, seed=8)
    np.testing.assert_array_equal(alone.values("x"), record.values("x"))


@pytest.mark.long
def test_gauss_markov_starts_stationary() -> None:
    runs, model = 600, NoiseModel.of(GaussMarkov.from_sigma(1.0, 1000.0))
    for sampling in ("mean", "point"):
        first = [
            al.simulate(model, rate=1.0, duration=1, seed=i, sampling=sampling).values("gyro")[0]
            for i in range(runs)
        ]
        assert np.mean(np.square(first)) == pytest.approx(1.0, rel=4 * math.sqrt(2 / runs))


def test_random_walk_starts_at_zero() -> None:
    assert made(RandomWalk(K=1.0), 5, sampling="point")[0] == 0.0


# -- the recording ----------------------------------------------------------------------------------------


def test_defaults_and_history() -> None:
    model = NoiseModel.of(White(N=1e-4))
    record = al.simulate(model, rate=32.0, duration=10.0, seed=1)
    channel = record["gyro"]
    assert (record.n_samples, record.rate, channel.unit, channel.sampling, record.start) == (
        320,
        32.0,
        "rad/s",
        "mean",
        None,
    )
    assert record.history == (
        {"step": "simulate", "seed": 1, "sampling": "mean", "models": {"gyro": model.to_json()}},
    )


@pytest.mark.parametrize(
    ("kind", "unit", "name"),
    [("acceleration", "m/s²", "accelerometer"), ("voltage", "V", "voltage"), ("counts", "LSB", "counts")],
)
def test_kind_of_the_model_gives_unit_and_name(kind: str, unit: str, name: str) -> None:
    record = al.simulate(NoiseModel.of(White(N=1.0), kind=kind), rate=1.0, duration=5, seed=1)
    assert (record.names, record[name].unit, record[name].kind) == ((name,), unit, kind)


def test_samples_are_written_in_the_unit_asked_for() -> None:
    model = NoiseModel.of(White(N=1e-3), RandomWalk(K=1e-4), Ramp(R=1e-5))
    si = al.simulate(model, rate=10.0, duration=10.0, seed=2)
    degrees = al.simulate(model, rate=10.0, duration=10.0, seed=2, unit="deg/s", name="z")
    np.testing.assert_allclose(degrees.values("z") * degrees["z"].scale, si.values("gyro"), rtol=1e-12)
    assert degrees["z"].scale == pytest.approx(math.pi / 180)
    several = al.simulate({"w": model, "a": model}, rate=10.0, duration=1.0, seed=2, unit={"a": "g"}, start=7)
    assert (several["w"].unit, several["a"].unit, several.start) == ("rad/s", "g", 7)


def fitted(kind: str) -> NoiseModel:
    known = Estimate(symbol="N", value=1e-3, lower=0.9e-3, upper=1.1e-3, supported=True)
    return NoiseModel(terms=(White(N=1e-3),), estimates=(known,), kind=kind)


@pytest.mark.parametrize(
    ("model", "unit"),
    [
        (NoiseModel.of(White(N=1e-3)), "V"),
        (NoiseModel.of(White(N=1e-3), kind="acceleration"), "deg/s"),
        (NoiseModel.of(White(N=1e-3), kind="voltage"), "rad/s"),
        (NoiseModel.of(White(N=1e-3), kind="counts"), "V"),
        (fitted("rate"), "mV"),
        (fitted("rate"), "g"),
        (fitted("rate"), "LSB"),
        (fitted("angle"), "m/s²"),
        (fitted("acceleration"), "rad/s"),
    ],
)
def test_b11_coefficients_are_not_written_in_a_unit_of_another_kind(model: NoiseModel, unit: str) -> None:
    with pytest.raises(InputError, match=f"'x': the noise model is one of {model.kind}, '{unit}'"):
        al.simulate(model, rate=1.0, duration=5.0, seed=1, unit=unit, name="x")


@pytest.mark.parametrize(
    ("model", "unit", "kind"),
    [
        (NoiseModel.of(White(N=1e-3)), "g", "acceleration"),
        (NoiseModel.of(White(N=1e-3)), "LSB", "counts"),
        (NoiseModel.of(White(N=1e-3), kind="voltage"), "mV", "voltage"),
        (NoiseModel.of(White(N=1e-3), kind="unknown"), "deg/s", "rate"),
        (fitted("rate"), "deg/h", "rate"),
        (fitted("rate"), "", "unknown"),
        (fitted("angle"), "rad/s", "rate"),
        (fitted("velocity"), "m/s²", "acceleration"),
        (fitted("counts"), "LSB", "counts"),
        (fitted("unknown"), "V", "voltage"),
    ],
)
def test_units_of_the_kind_and_of_no_kind_are_written(model: NoiseModel, unit: str, kind: str) -> None:
    record = al.simulate(model, rate=1.0, duration=5.0, seed=1, unit=unit, name="x")
    plain = al.simulate(NoiseModel.of(White(N=1e-3)), rate=1.0, duration=5.0, seed=1, name="x")
    assert record["x"].kind == kind
    np.testing.assert_allclose(record.values("x") * record["x"].scale, plain.values("x"), rtol=1e-12)


def test_progress_ends_at_one() -> None:
    seen: list[float] = []
    model = NoiseModel.of(White(N=1.0))
    al.simulate({"x": model, "y": model}, rate=1.0, duration=300_000, seed=1, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate": 0.0}, "rate must be"),
        ({"duration": 0.0}, "at least one sample"),
        ({"duration": math.inf}, "at least one sample"),
        ({"duration": "1 h"}, "number of seconds"),
        ({"seed": -1}, "seed must be"),
        ({"seed": 1.5}, "seed must be"),
        ({"unit": "deg"}, "integrate it"),
        ({"unit": "degC"}, "noise model describes"),
        ({"sampling": "instant"}, "'mean'"),
        ({"model": White(N=1.0)}, "NoiseModel.of"),
    ],
)
def test_b11_nonsense_is_refused(change: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {
        "model": NoiseModel.of(White(N=1.0)),
        "rate": 1.0,
        "duration": 10.0,
        "seed": 1,
        **change,
    }
    simulate: Callable[..., Any] = al.simulate
    with pytest.raises(InputError, match=message):
        simulate(given.pop("model"), **given)
