# SPDX-License-Identifier: BSD-3-Clause
"""One record in other units, at another level, of the other sign, at another rate, or as a running sum: the same noise.

Every number of a result must be the same, or its own power of the factor as large. A tolerance that is absolute, a unit
that is taken for granted or a level that is not removed fails here, whichever estimator holds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.noise.allan.statistics import STATISTICS
from allanite.recording.sample_columns import ArrayColumn

RATE = 50.0
MODEL = al.NoiseModel.of(al.White(N=1e-4), al.Flicker(B=5e-5), al.RandomWalk(K=3e-6))
#: Numbers that are no amount of noise: a density has the unit of the samples in its logarithm.
EXEMPT = ("log_likelihood", "phase", "findings")
SCALES = [1e-9, 1e9]

Estimator = Callable[[al.Recording], Any]
ESTIMATORS: dict[str, Estimator] = {
    **{s: lambda r, s=s: al.allan_curve(r, statistic=s)["x"].to_json() for s in STATISTICS},  # type: ignore[misc]
    "spectrum": lambda r: al.power_spectrum(r, "x").to_json(),
}
FITS: dict[str, Estimator] = {
    "curve": lambda r: al.fit(al.allan_curve(r), screen=False).to_json(),
    "likelihood": lambda r: al.fit(r, screen=False).to_json(),
    "spectral": lambda r: al.fit(r, method="spectral", screen=False).to_json(),
    "select": lambda r: al.select(r).model.to_json(),
    "variation": lambda r: al.examine_variation(r).to_json(),
    "overbound": lambda r: al.overbound(c := al.allan_curve(r), al.fit(c, screen=False)).to_json(),
}
SLOW = [pytest.param(f, id=n, marks=pytest.mark.long) for n, f in FITS.items()]
EVERY = [*(pytest.param(f, id=n) for n, f in ESTIMATORS.items()), *SLOW]


def samples(n: int = 4096, *, gaps: bool = False) -> NDArray[np.float64]:
    y = al.simulate(MODEL, rate=RATE, duration=n / RATE, seed=5).values("gyro").copy()
    if gaps:
        y[:3] = y[700:760] = y[-2:] = np.nan
    return y


def record(y: NDArray[Any], *, unit: str = "rad/s", rate: float = RATE) -> al.Recording:
    channel = al.Channel.of("x", unit, sampling="mean")
    return al.Recording(channels=(channel,), columns=(ArrayColumn(y),), rate=rate)


def numbers(result: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a document with its place; words may name numbers and are left out."""
    if isinstance(result, dict):
        for key, part in result.items():
            if key not in EXEMPT:
                yield from numbers(part, f"{path}.{key}")
    elif isinstance(result, (list, tuple)):
        for i, part in enumerate(result):
            yield from numbers(part, f"{path}[{i}]")
    elif isinstance(result, (int, float)) and not isinstance(result, bool):
        yield path, float(result)


def assert_powers(was: Any, now: Any, factor: float, *, steps: float = 1.0, rtol: float = 1e-6) -> None:
    """Each number is the same times the factor to some whole power (or a multiple of `steps`)."""
    before, after = dict(numbers(was)), dict(numbers(now))
    assert before.keys() == after.keys()
    for place, x in before.items():
        y = after[place]
        if x == y or (math.isnan(x) and math.isnan(y)):
            continue
        assert x * y > 0, (place, x, y)
        power = round(math.log(y / x) / math.log(factor) / steps) * steps if factor != 1 else 0.0
        assert y == pytest.approx(x * factor**power, rel=rtol), (place, x, y)


@pytest.mark.parametrize("estimate", [p for p in EVERY if p.id != "totdev"])
@pytest.mark.parametrize("factor", SCALES)
def test_samples_in_another_unit(estimate: Estimator, factor: float) -> None:
    y = samples(gaps=True)
    assert_powers(estimate(record(y)), estimate(record(y * factor)), factor)


@pytest.mark.parametrize("estimate", EVERY)
def test_samples_at_another_level_and_of_the_other_sign(estimate: Estimator) -> None:
    y = samples()
    was = estimate(record(y))
    assert_powers(was, estimate(record(y + 0.03)), 1.0)
    assert_powers(was, estimate(record(-y)), 1.0)


@pytest.mark.parametrize("estimate", [p for p in EVERY if p.id not in ("spectrum", "spectral")])
def test_the_same_samples_at_another_rate(estimate: Estimator) -> None:
    """Amplitudes go with half powers of the rate. A spectrum has its points at round frequencies, and is left out."""
    y = samples()
    assert_powers(estimate(record(y)), estimate(record(y, rate=1024 * RATE)), 1024.0, steps=0.5)


@pytest.mark.parametrize("estimate", [p for p in EVERY if p.id in STATISTICS or p.id == "curve"])
def test_the_running_sum_of_the_samples(estimate: Estimator) -> None:
    y = samples()
    angle = np.concatenate([[0.0], np.cumsum(y)]) / RATE
    assert_powers(estimate(record(y)), estimate(record(angle, unit="rad")), 1.0)


@pytest.mark.parametrize("statistic", [s for s in STATISTICS if STATISTICS[s].overlapping])
def test_the_record_from_its_end(statistic: str) -> None:
    """Differences of second and third order are the same read backwards, but for their sign."""
    y = samples(gaps=statistic != "totdev")
    forward, backward = (al.allan_curve(record(z), statistic=statistic) for z in (y, y[::-1]))
    np.testing.assert_allclose(backward.deviation, forward.deviation, rtol=1e-9)
    np.testing.assert_array_equal(backward.count, forward.count)


@pytest.mark.parametrize("make", [
    lambda y: y.astype(">f4"),
    lambda y: np.repeat(y.astype(np.float32), 2)[::2],
    lambda y: np.stack([y, y]).astype(np.float32).T[:, 1],
], ids=["big-endian", "every second", "a column of a table"])  # fmt: skip
def test_samples_in_another_layout_of_memory(make: Callable[[Any], Any]) -> None:
    y = samples(gaps=True).astype(np.float32)
    made = make(y)
    made.flags.writeable = False
    assert_powers(
        ESTIMATORS["oadev"](record(y.astype(np.float64))), ESTIMATORS["oadev"](record(made)), 1.0, rtol=0.0
    )


@pytest.mark.parametrize("factor", SCALES)
@pytest.mark.parametrize("form", ["covariance", "square root"])
def test_filter_in_another_unit(form: Any, factor: float) -> None:
    y = samples(2048, gaps=True)
    louder = replace(MODEL, terms=(al.White(N=1e-4 * factor), al.RandomWalk(K=3e-6 * factor)))
    quiet = replace(MODEL, terms=(al.White(N=1e-4), al.RandomWalk(K=3e-6)))
    was = al.filter_recording(record(y), quiet, form=form)
    now = al.filter_recording(record(y * factor), louder, form=form)
    assert_powers(was.to_json(), now.to_json(), factor)


@pytest.mark.parametrize("unit", ["rad", "m/s", "rad/s", "m/s^2"])
def test_a_model_of_a_running_sum_is_that_of_what_is_summed(unit: str) -> None:
    """It filters its own record, and goes with records and models of rates."""
    y = samples(512)
    summed = unit in ("rad", "m/s")
    log = record(np.cumsum(y) / RATE if summed else y, unit=unit)
    model = al.NoiseModel.from_json(
        al.fit(al.allan_curve(log), screen=False).to_json() | {"kind": log["x"].kind.value}
    )
    assert model.kind == log["x"].kind.rate
    assert al.filter_recording(log, model).consistency.count > 500
    assert al.model_difference({"a": model}, {"b": replace(model, estimates=())}).channels
