# SPDX-License-Identifier: BSD-3-Clause
"""Each consumer runs its own step on the exported file, and N and the bias of the model are found again in its samples.

The step is that of `consumers`; its samples are judged by chi-square. The formulas are those of the documents, of each
module's `USAGE`: the number that a formula gives stands in the file, and a file that holds the plain coefficient in its
place (N where N sqrt(f) is wanted, or the reverse where N is) is found out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

import allanite as al
import consumers
from allanite import exporters
from allanite.exporters.imu import Slot
from allanite.noise import SIGMA_PER_B, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.units import parse_unit
from consumers import ACCEL, GYRO, MARKOVS, OPTIONS, RATE, WALKERS, WHITES, Step

DEG, MICRO_G = math.radians(1), 9.80665e-6
#: Samples of a step, and the probability that those of a sound one are rejected.
SAMPLES, LEVEL = 20_000, 1e-6
RATES = {"ardupilot": 80.0, "px4": 100.0}
READERS = {**WALKERS, **MARKOVS, **WHITES}


@dataclass(frozen=True)
class Truth:
    """Coefficients of a sensor: N, K, and a Gauss-Markov bias of sigma and T."""

    N: float
    K: float
    sigma: float
    T: float

    def model(self, name: str, kind: str) -> NoiseModel:
        """With the bias that the consumer knows."""
        bias = RandomWalk(K=self.K) if name in WALKERS else GaussMarkov.from_sigma(self.sigma, self.T)
        return NoiseModel.of(White(N=self.N), *([] if name in WHITES else [bias]), kind=kind)

    def number(self, slot: Slot) -> float:
        """What the formula of a slot starts from."""
        of = slot.formula.of
        if of == "density":
            return self.sigma * math.sqrt(2 / self.T)
        if of == "B":
            return self.sigma / SIGMA_PER_B
        return {"noise": self.N, "walk": self.K, "K": 0.0, "sigma": self.sigma, "time": self.T}[of]


TRUTHS = {
    GYRO: Truth(N=0.3 * DEG / 60, K=5 * DEG / 3600 / 60, sigma=5 * DEG / 3600, T=7.0),
    ACCEL: Truth(N=0.03 / 60, K=5 * MICRO_G / 60, sigma=20 * MICRO_G, T=7.0),
}
KINDS = {GYRO: "rate", ACCEL: "acceleration"}


def exported(name: str) -> Any:
    """The file with sixteen digits, so that a number is found in it by its text."""
    models = {sensor: truth.model(name, KINDS[sensor]) for sensor, truth in TRUTHS.items()}
    given = {"walk": "k-only"} if name in WALKERS else {}
    return al.export(name, models, rate=RATE, axes="worst", digits=12, **given, **OPTIONS.get(name, {}))


def sampled(step: Step, rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Increments of the angle over a step by white noise alone, and the bias."""
    white = math.sqrt(step.covariance[0, 0]) * rng.standard_normal(SAMPLES)
    driven = math.sqrt(step.covariance[1, 1]) * rng.standard_normal(SAMPLES)
    return white, lfilter([1.0], [1.0, -step.transition[1, 1]], driven)


def agrees(squares: NDArray[np.float64], variance: float) -> bool:
    """Whether independent normal numbers have this variance, by chi-square."""
    lower, upper = chi2.interval(1 - LEVEL, len(squares))
    return bool(lower < float((squares**2).sum()) / variance < upper)


def recovers(step: Step, truth: Truth, name: str, rng: np.random.Generator) -> dict[str, bool]:
    """Whether samples of the consumer's step have N of the model, and its bias."""
    white, bias = sampled(step, rng)
    found = {"noise": agrees(white, truth.N**2 * step.dt)}
    if name in WALKERS:
        found["bias"] = agrees(np.diff(bias), truth.K**2 * step.dt)
    elif name in WHITES:
        found["bias"] = not bias.any()
    else:
        phi = math.exp(-step.dt / truth.T)
        settled = bias[1:] - phi * bias[:-1]
        found["bias"] = agrees(settled, -(truth.sigma**2) * math.expm1(-2 * step.dt / truth.T))
    return found


@pytest.mark.parametrize("name", READERS)
def test_samples_of_the_consumer_are_those_of_the_model(name: str, rng: np.random.Generator) -> None:
    for sensor, step in READERS[name](exported(name)).items():
        assert recovers(step, TRUTHS[sensor], name, rng) == {"noise": True, "bias": True}, sensor


def slots_of(*of: str) -> list[tuple[str, int]]:
    """Every slot of a number, by the name of its file."""
    return [
        (name, i)
        for name in READERS
        for i, slot in enumerate(exporters.exporter(name).USAGE.slots)
        if slot.formula.of in of
    ]


def number_of(name: str, slot: Slot) -> float:
    """What the file should hold, by its formula."""
    unit = 1.0 if slot.formula.power == 2 else parse_unit(slot.unit).factor
    return slot.formula(TRUTHS[slot.sensor].number(slot), RATES.get(name, RATE)) / unit


def plain(name: str, slot: Slot) -> float:
    """The number by the mistake: the coefficient itself; that of a sample, where the coefficient is right; the
    deviation of the bias, where what drives it is right, and the reverse."""
    unit = 1.0 if slot.formula.power == 2 else parse_unit(slot.unit).factor
    coefficient = TRUTHS[slot.sensor].number(slot)
    if slot.formula.of == "density":
        return TRUTHS[slot.sensor].sigma / unit
    if slot.formula.of == "sigma":
        return TRUTHS[slot.sensor].number(replace(slot, formula=replace(slot.formula, of="density"))) / unit
    identity = slot.formula.power == 1 and slot.formula.rate_power == 0 and slot.formula.factor == 1
    return (slot.formula.of_a_sample(coefficient, RATE) if identity else coefficient) / unit


@pytest.mark.parametrize(("name", "i"), slots_of("noise", "walk", "sigma", "density"))
def test_a_plain_coefficient_in_the_place_of_its_formula_is_found_out(
    name: str, i: int, rng: np.random.Generator
) -> None:
    """The number of the formula stands in the file; with the mistake in its place the samples are not the model's."""
    text, slot = exported(name), exporters.exporter(name).USAGE.slots[i]
    right, wrong = (f"{value:.12e}" for value in (number_of(name, slot), plain(name, slot)))
    assert right in text, f"{slot.key} = {slot.formula} does not stand in the file"
    assert right != wrong
    if name == "navego" and slot.key in ("gb_dyn", "ab_dyn"):
        return  # not what drives its filter: that is gb_psd
    found = recovers(READERS[name](text.replace(right, wrong))[slot.sensor], TRUTHS[slot.sensor], name, rng)
    changed = "noise" if slot.formula.of == "noise" else "bias"
    assert found == {"noise": changed != "noise", "bias": changed != "bias"}


def test_the_json_of_matlab_with_plain_densities_is_found_out() -> None:
    models = {sensor: truth.model("matlab", KINDS[sensor]) for sensor, truth in TRUTHS.items()}
    document = exporters.document_of(models, RATE)
    files = exporters.exporter("matlab").write(document, axes="worst", digits=12)
    text, content = files["imu_sensor.json"], consumers.mat(files["imu_sensor.mat"])
    consumers.matlab(text, content)
    for truth in TRUTHS.values():
        right = f"{math.sqrt(2) * truth.N:.12e}"
        assert right in text
        with pytest.raises(AssertionError):
            consumers.matlab(text.replace(right, f"{truth.N:.12e}"), content)


def test_chi_square_tells_a_deviation_that_is_off_by_a_twentieth(rng: np.random.Generator) -> None:
    """The power of the test above: every mistake there is many times that."""
    noise = rng.standard_normal(SAMPLES)
    assert agrees(noise, 1.0)
    assert not agrees(1.05 * noise, 1.0)
    assert not agrees(noise / 1.05, 1.0)
