# SPDX-License-Identifier: BSD-3-Clause
"""Random models in every format: comments name the coefficients that the file holds or leaves out, and no other; the
numbers come back in the consumer's own step to 1e-9; what cannot be written is refused with words."""

from __future__ import annotations

import io
import json
import math
import re
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

import consumers
from allanite import exporters
from allanite.errors import InputError
from allanite.exporters.imu.gauss_markov import WALK_TIME
from allanite.noise import (
    FLICKER_FLOOR,
    SIGMA_PER_B,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    White,
)
from consumers import ACCEL, GYRO, MARKOVS, OPTIONS, RATE, WALKERS, WHITES, mat

ALL = (*WALKERS, *MARKOVS, *WHITES, "matlab")
CASES = 15  # each kind of walk with each time, and with each fit
TIME = 80.0
KINDS = {GYRO: "rate", ACCEL: "acceleration"}
#: What a comment calls a coefficient. The defaults of PX4 that one line states are those of nobody's model.
NAMES = {"B": r"\bB\b|flicker", "K": r"\bK\b", "Q": r"\bQ\b", "R": r"\bR\b", "q_c": r"\bq_c\b"}


class Case:
    """A model of each sensor as a study has it; about half of what it lacks is bounded by a limit."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.walk = [None, None, "k-only", "upper-bound", "horizon=50"][seed % 5]
        self.time = TIME if seed % 3 else None
        self.truth: dict[str, dict[str, float]] = {}
        self.document = {"provenance": {}, "recording": {"rate": RATE}, "channels": []}
        self.fitted = bool(seed % 2)
        there = {s: bool(rng.integers(2)) for s in ("flicker", "markov", "K", "Q", "R")}
        there["markov"] = there["markov"] and not there["flicker"]
        for sensor, kind in KINDS.items():
            v = {s: float(10 ** rng.uniform(-5, -3)) for s in "NB"} | {"K": float(10 ** rng.uniform(-7, -5))}
            term = GaussMarkov.from_sigma(SIGMA_PER_B * v["B"], 50.0)
            terms = [White(N=v["N"])]
            terms += [Flicker(B=v["B"])] * there["flicker"] + [term] * there["markov"]
            terms += [RandomWalk(K=v["K"])] * there["K"]
            terms += [Quantisation(Q=1e-6)] * there["Q"] + [Ramp(R=1e-9)] * there["R"]
            model = NoiseModel.of(*terms, kind=kind).to_json()
            held = {"N": True, "B": there["flicker"], "K": there["K"]}
            if self.fitted:
                bounded = {s: bool(rng.integers(2)) for s in "BK"}
                model["estimates"] = [
                    self._estimate(s, v[s], held[s])
                    for s in "NBK"
                    if held[s] or (bounded[s] and not (s == "B" and there["markov"]))
                ]
                held = {s: held[s] or any(e["symbol"] == s for e in model["estimates"]) for s in "NBK"}
            self.truth[sensor] = {s: v[s] * held[s] for s in "NBK"} | {"q": term.q * there["markov"]}
            self.document["channels"].append({"name": kind, "kind": kind, "unit": "", "models": [model]})
        self.there = there

    @staticmethod
    def _estimate(symbol: str, value: float, supported: bool) -> dict[str, Any]:
        known = {"lower": value / 1.1, "upper": value * 1.1} if supported else {"lower": 0.0, "upper": value}
        return {"symbol": symbol, "value": value if supported else None, "supported": supported, **known}

    def expected_walk(self, sensor: str) -> float:
        """The walk by its definition."""
        v = self.truth[sensor]
        floor = (FLICKER_FLOOR * v["B"]) ** 2
        matched = GaussMarkov.from_sigma(SIGMA_PER_B * v["B"], TIME) if v["B"] else None
        own = GaussMarkov(q=v["q"], T=50.0) if v["q"] else None
        if self.walk == "k-only":
            return v["K"]
        if self.walk == "horizon=50":
            of_flicker = (float(matched.avar(50.0)) if self.time else floor) if matched else 0.0
            drift = of_flicker + (float(own.avar(50.0)) if own else 0.0)
            return math.sqrt(v["K"] ** 2 + 3 * drift / 50)
        q = (matched.q if self.time else math.sqrt(3) * floor / v["N"]) if matched else 0.0
        return math.sqrt(v["K"] ** 2 + q**2 + v["q"] ** 2)


def written(name: str, case: Case) -> tuple[Any, str]:
    """The content of the file, or why there is none."""
    given: dict[str, Any] = {"digits": 15, **OPTIONS.get(name, {})}
    if name not in WHITES:
        given |= {"walk": case.walk} if case.walk else {}
        given |= {"correlation_time": case.time} if case.time else {}
    try:
        return exporters.exporter(name).write(case.document, **given), ""
    except InputError as refusal:
        return None, str(refusal)


def comments_of(name: str, content: Any) -> str:
    in_json = {"matlab": "allanite", "airsim": "Imu"}
    if name in (*in_json, "basalt"):
        held = json.loads(content["imu_sensor.json"] if name == "matlab" else content)
        return "\n".join(x for x in held.get(in_json.get(name), held)["Comments"])
    lines = re.findall(r"^(?:[#%;].*)$", content, re.M)
    if content.startswith("<!--"):
        lines = [content.partition("-->")[0]]
    return "\n".join(x for x in lines if "its defaults" not in x and "NSE" not in x and "EKF2" not in x)


@pytest.mark.parametrize("name", ALL)
def test_comments_are_of_this_model_and_numbers_come_back(name: str) -> None:
    refused = 0
    for seed in range(CASES):
        case = Case(seed)
        content, refusal = written(name, case)
        if refusal:
            assert re.search(r"channel '\w+': .*(must have|needs|neither a value nor|has .* and)", refusal), (
                refusal
            )
            refused += 1
            continue
        said, where = comments_of(name, content), (name, seed, case.walk)
        held = {s for v in case.truth.values() for s in "BK" if v[s]}
        held |= {s for s in "QR" if case.there[s]}
        bounded = case.walk != "k-only" and name not in WHITES and ("B" in held or case.there["markov"])
        allowed = held | ({"q_c"} if bounded else set())
        for symbol, pattern in NAMES.items():
            unknown = f"{symbol} unknown LEFT OUT" in said  # neither a value nor a limit in the study
            named = re.search(pattern, said) is not None
            assert unknown or not named or symbol in allowed, (where, symbol, said)
            assert named or symbol not in held, (where, symbol, said)
        out = case.there["Q"] or case.there["R"] or "LEFT OUT\n" in said or "LEFT OUT;" in said
        assert ("LEFT OUT: not in" in said) == bool(out), (where, said)
        assert ("95 % interval" in said) == case.fitted, where
        assert ("Tau = inf" in said) == (name == "psins" and case.walk is not None)
        if name == "matlab":
            coefficients = "BiasInstabilityCoefficients" in mat(content["imu_sensor.mat"])["Gyroscope"]
            assert ("is in imu_sensor.mat" in said) == coefficients, where
        numbers_come_back(name, case, content)
    assert refused < CASES * 0.8, "most models can be written"


def numbers_come_back(name: str, case: Case, content: Any) -> None:
    if name == "matlab":
        matlab_comes_back(case, content)
        return
    steps = {**WALKERS, **MARKOVS, **WHITES}[name](content)
    for sensor, own in steps.items():
        v, dt = case.truth[sensor], own.dt
        assert own.covariance[0, 0] == pytest.approx(v["N"] ** 2 * dt, rel=1e-9), (name, case.walk)
        phi, driven = own.transition[1, 1], own.covariance[1, 1]
        if name in WHITES:
            assert driven == 0.0
            continue
        if name in WALKERS or case.walk is not None:
            walk = case.expected_walk(sensor)
            assert driven == pytest.approx(walk**2 * dt, rel=2 * dt / WALK_TIME + 1e-8)
            continue
        sigma = SIGMA_PER_B * v["B"] if v["B"] else GaussMarkov(q=v["q"], T=50.0).sigma
        time = case.time if case.time is not None else 50.0
        if not v["B"] and not exporters.exporter(name).CONSUMER.simulator:
            sigma *= math.sqrt(
                max(time / 50.0, 50.0 / time)
            )  # of a filter: above the term whose time is replaced
        tolerance = 1e-9 if name in consumers.EXACT else 2 * dt / time
        assert driven == pytest.approx(-(sigma**2) * math.expm1(-2 * dt / time), rel=tolerance)
        assert phi == pytest.approx(math.exp(-dt / time), rel=tolerance)


def matlab_comes_back(case: Case, content: Any) -> None:
    part = json.loads(content["imu_sensor.json"])["allanite"]
    exact = loadmat(io.BytesIO(content["imu_sensor.mat"]))["imu"]
    assert exact["SampleRate"].item() == RATE
    for sensor, key in ((GYRO, "Gyroscope"), (ACCEL, "Accelerometer")):
        v = case.truth[sensor]
        k = v["K"] if case.walk is None else case.expected_walk(sensor)
        bias = (
            0.0
            if case.walk
            else v["B"] or GaussMarkov(q=v["q"], T=50.0).sigma / SIGMA_PER_B
            if v["q"] or v["B"]
            else 0
        )
        for own, band in ((part[key], RATE / 2), (mat(content["imu_sensor.mat"])[key], RATE)):
            white, step = consumers.matlab_samples(own, band)
            assert (white, step) == pytest.approx((v["N"] * math.sqrt(RATE), k / math.sqrt(RATE)), rel=1e-9)
            assert float(np.ravel(own["BiasInstability"])[0]) == pytest.approx(bias, rel=1e-9)


def test_a_model_of_two_slow_terms_loses_neither() -> None:
    """The walk of a Gauss-Markov term alone was written where the model holds flicker beside it."""
    model = NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), GaussMarkov(q=1e-6, T=500.0), RandomWalk(K=1e-7))
    floor = (FLICKER_FLOOR * 3e-5) ** 2
    bounds = 1e-14 + 1e-12 + 3 * (floor / 1e-4) ** 2
    text = exporters.export("kalibr", {"g": model}, rate=RATE, digits=15)
    found = consumers.yaml_1_1(text)["gyroscope_random_walk"]
    assert found == pytest.approx(math.sqrt(bounds), rel=1e-9)
    assert "B 3.0000e-05" in text and "Gauss-Markov sigma" in text
    for name in MARKOVS:
        with pytest.raises(InputError, match=r"a Gauss-Markov term and flicker.*walk='upper-bound'"):
            exporters.export(name, {"g": model}, rate=RATE, correlation_time=9.0)


@pytest.mark.parametrize("name", [*ALL, "cpp"])
def test_a_sensor_slower_than_its_log_has_both_rates_in_every_file(name: str) -> None:
    """And no file of a sensor that is not held speaks of repeats."""
    for rates in ({}, {"rate": 47.0001, "log_rate": RATE}):
        case = Case(1)
        for channel in case.document["channels"]:
            channel["held"] = {**rates, "rate_sd": 7e-4, "values": 9, "why": ""} if rates else None
        content, refusal = (
            written(name, case) if name != "cpp" else (exporters.export(name, case.document), "")
        )
        assert not refusal
        said = content if name == "cpp" else comments_of(name, content)
        assert (
            ("47.0001 Hz if each value comes once" in said)
            == bool(rates)
            == ("200 Hz with the repeats" in said)
        )
