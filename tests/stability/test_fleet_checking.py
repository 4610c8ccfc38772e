# SPDX-License-Identifier: BSD-3-Clause
"""A unit beside its limits: the verdict of profiles of known shape, and how often it is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from allanite.filtering.simulation import simulate
from allanite.noise import NoiseModel, RandomWalk, White
from allanite.noise.allan import allan_curve
from allanite.stability.fleet.checking import (
    AcceptanceLimit,
    CheckVerdict,
    LimitSource,
    check_unit,
    judged,
)
from allanite.stability.record_comparison.profiles import normal_profile

CRITICAL = 3.841458820694124
N = 1e-4


def _limit(symbol: str, value: float) -> AcceptanceLimit:
    return AcceptanceLimit(channel="gyro", symbol=symbol, value=value, source=LimitSource.GIVEN)


def _curve(seed: int, samples: int = 4000, model: NoiseModel | None = None) -> object:
    made = model or NoiseModel.of(White(N=N))
    return allan_curve(simulate(made, rate=10.0, duration=samples / 10.0, seed=seed, unit="rad/s"))


@pytest.mark.parametrize(
    ("above", "tests", "verdict"),
    [
        (1.97, 1, CheckVerdict.PASS),
        (1.95, 1, CheckVerdict.OPEN),
        (-1.95, 1, CheckVerdict.OPEN),
        (-1.97, 1, CheckVerdict.FAIL),
        (-2.23, 2, CheckVerdict.OPEN),  # 2.5 % shared by two: 2.241
        (-2.25, 2, CheckVerdict.FAIL),
        (1.97, 18, CheckVerdict.PASS),  # all must pass: none shares
    ],
)
def test_a_normal_estimate_is_judged_by_its_95_percent_interval(
    above: float, tests: int, verdict: CheckVerdict
) -> None:
    profile = normal_profile(math.log(N), 0.1, CRITICAL)
    decided, root = judged(profile, N * math.exp(0.1 * above), tests)
    assert decided is verdict
    assert root == pytest.approx(above, abs=1e-9)


@pytest.mark.long
def test_at_the_limit_at_most_5_percent_pass_and_5_percent_fail() -> None:
    """The exact law of the estimate, and records whose true N is the limit."""
    rng = np.random.default_rng(3)
    verdicts = [
        judged(normal_profile(math.log(N) + 0.1 * z, 0.1, CRITICAL), N, 1)[0]
        for z in rng.standard_normal(20_000)
    ]
    least, most = binom.ppf([0.0005, 0.9995], len(verdicts), 0.025)
    for wrong in (CheckVerdict.PASS, CheckVerdict.FAIL):
        assert least <= verdicts.count(wrong) <= most
    of_records = [check_unit(_curve(seed), [_limit("N", N)]).verdict for seed in range(40)]
    for wrong in (CheckVerdict.PASS, CheckVerdict.FAIL):
        assert of_records.count(wrong) <= binom.ppf(0.999, len(of_records), 0.05)


def test_an_upper_limit_passes_above_it_and_cannot_tell_below() -> None:
    curve = _curve(1)
    passing = check_unit(curve, [_limit("K", 1e-3)])
    assert passing.verdict is CheckVerdict.PASS
    assert math.isnan(passing.coefficients[0].measured.value)
    near = passing.coefficients[0].measured.upper / 3
    result = check_unit(curve, [_limit("K", near), _limit("N", 2 * N)])
    assert [c.verdict for c in result.coefficients] == [CheckVerdict.OPEN, CheckVerdict.PASS]
    assert result.verdict is CheckVerdict.OPEN and result.duration > 2 * result.length
    assert result.reason.startswith("the limit of K of gyro lies inside its interval; a record of about ")


@pytest.mark.long
def test_the_length_that_it_asks_for_decides() -> None:
    """True N 5 % above the limit: most records of that length fail."""
    limit = _limit("N", N / 1.05)
    asked = sorted(
        d
        for seed in range(12)
        if (d := check_unit(_curve(100 + seed, 500), [limit]).coefficients[0].duration) is not None
    )
    assert asked[0] >= 2 * 50.0
    assert sum(map(math.isfinite, asked)) >= 6
    exact = _length(500)
    verdicts = [check_unit(_curve(200 + s, round(exact * 10)), [limit]).verdict for s in range(12)]
    assert verdicts.count(CheckVerdict.FAIL) >= binom.ppf(0.001, len(verdicts), 0.8)


def _length(samples: int) -> float:
    """What is asked for where the estimate happens to be the truth."""
    lengths = []
    for seed in range(300, 312):
        curve = _curve(seed, samples)
        measured = check_unit(curve, [_limit("N", 1.0)]).coefficients[0].measured.value
        checked = check_unit(curve, [_limit("N", measured / 1.05)]).coefficients[0]
        if checked.duration is not None:
            lengths.append(checked.duration)
    return float(np.median(lengths))


def test_one_failure_fails_the_unit_and_the_worst_decides() -> None:
    model = NoiseModel.of(White(N=N), RandomWalk(K=2e-5))
    result = check_unit(_curve(4, 40_000, model), [_limit("N", 2 * N), _limit("K", 5e-6), _limit("R", 1e-3)])
    assert result.verdict is CheckVerdict.FAIL
    assert result.reason == "K of gyro lies above its limit"
    assert result.unlimited == () and result.unfitted == ()
    again = type(result).from_json(result.to_json())
    assert again.to_json() == result.to_json()
