# SPDX-License-Identifier: BSD-3-Clause
"""Reference sets of the NIST for means and standard deviations in exact arithmetic: rows R5 and R6 of the battery.

LRE is the number of right digits, -log10 of the relative error. Of the nine univariate sets five follow from their
definition (NumAcc1 to 4, PiDigits); Lew, Lottery, Mavro and Michelso are measurements, in tests/published.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.filtering.regression import RANK, regress
from allanite.noise import NoiseModel, White
from allanite.recording.records import Recording


def lre(value: float, true: float) -> float:
    error = abs(value - true) / abs(true)
    return 17.0 if error == 0 else -math.log10(error)


# -- means and standard deviations -----------------------------------------------------------------------------


def pi_digits(count: int) -> list[str]:
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(count + 20):
        return list(str(mpmath.floor(mpmath.pi * mpmath.mpf(10) ** (count - 1)))[:count])


def measured() -> dict[str, tuple[tuple[float, ...], list[str]]]:
    """Certified mean, standard deviation and lag-1 autocorrelation, and the decimals, of the measured sets."""
    text = (Path(__file__).parents[1] / "published" / "nist_univariate.txt").read_text(encoding="utf-8")
    parts = [part.split() for part in text.split("> ")[1:]]
    return {name: (tuple(float(x) for x in words[:3]), words[3:]) for name, *words in parts}


MEASURED = measured()


def univariate(name: str) -> list[str]:
    """The set as the decimal numbers that it consists of."""
    if name in MEASURED:
        return MEASURED[name][1]
    if name == "NumAcc1":
        return ["10000001", "10000003", "10000002"]
    if name == "PiDigits":
        return pi_digits(5000)
    level = {"NumAcc2": "", "NumAcc3": "100000", "NumAcc4": "1000000"}[name]
    first, low, high = (f"{level}{'0' if level else '1'}.{tenth}" for tenth in (2, 1, 3))
    return [first, *([low, high] * 500)]


def exactly(numbers: Sequence[str]) -> tuple[float, float]:
    """Mean and standard deviation (n - 1) in rational arithmetic."""
    values = [Fraction(x) for x in numbers]
    mean = sum(values) / len(values)
    return float(mean), math.sqrt(sum((v - mean) ** 2 for v in values) / (len(values) - 1))


def stated(record: Recording) -> tuple[float, float]:
    """What a study says; the sets are no sensor's noise, so everything that the checks find is accepted."""
    accept = ("too_short", "clipping", "quantisation_limited")
    channel = al.characterize(record, accept=accept)["signal"]
    return channel.mean, channel.sd


#: Digits of mean and standard deviation that float64 leaves: the samples themselves are rounded decimals.
DIGITS = {
    "NumAcc1": (14, 14),
    "NumAcc2": (14, 14),
    "NumAcc3": (14, 9),
    "NumAcc4": (14, 8),
    "PiDigits": (14, 13),
    "Lew": (14, 13),
    "Lottery": (14, 13),
    "Mavro": (14, 13),
    "Michelso": (14, 13),
}


def test_r6_the_sets_are_those_of_the_nist() -> None:
    """Certified values that follow from how the sets are made."""
    assert exactly(univariate("NumAcc1")) == (10000002.0, 1.0)
    for name, mean in (("NumAcc2", 1.2), ("NumAcc3", 1000000.2), ("NumAcc4", 10000000.2)):
        assert exactly(univariate(name)) == (mean, 0.1)


@pytest.mark.parametrize("name", MEASURED)
def test_r6_the_measured_sets_give_their_certified_values(name: str) -> None:
    """To the fifteen digits that are certified, and the lag-1 autocorrelation: no number was copied wrong."""
    (mean, sd, lag), numbers = MEASURED[name]
    assert exactly(numbers) == pytest.approx((mean, sd), rel=3e-15)
    y = np.array([float(x) for x in numbers]) - mean
    assert y[1:] @ y[:-1] / (y @ y) == pytest.approx(lag, rel=1e-12)


@pytest.mark.parametrize("name", [name for name in DIGITS if name != "NumAcc1"])
def test_r5_r6_mean_and_standard_deviation_of_a_study(name: str) -> None:
    numbers = univariate(name)
    mean, sd = stated(Recording.from_rate([float(x) for x in numbers], rate=1.0, unit="V"))
    true = exactly(numbers)
    assert lre(mean, true[0]) >= DIGITS[name][0]
    assert lre(sd, true[1]) >= DIGITS[name][1]


def test_r6_from_the_decimals_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "numacc4.csv"
    path.write_text("signal [V]\n" + "\n".join(univariate("NumAcc4")) + "\n")
    mean, sd = stated(al.read(path, rate=1.0))
    assert lre(mean, 10000000.2) >= 14 and lre(sd, 0.1) >= 8


def test_r5_lag_one_of_numacc4_shows_in_the_deviation() -> None:
    """Its lag-1 autocorrelation -0.999 is AVAR(1) = sd^2 (1 - r), up to the ends of the record."""
    y = np.array([float(x) for x in univariate("NumAcc4")])
    curve = al.allan_curve(Recording.from_rate(y, rate=1.0, unit="V"), taus=[1.0])
    assert curve.variance[0, 0] == pytest.approx(0.01 * (1 + 0.999), rel=1e-3)


# -- regression ------------------------------------------------------------------------------------------------


def test_r7_a_refusal_names_the_condition_number() -> None:
    """Eleven powers that float64 cannot tell apart (the sets themselves: test_regression_reference.py)."""
    x = np.linspace(-8.8, -3.1, 82)
    columns = np.stack([x**k for k in range(11)], axis=1)
    names = [f"x^{k}" for k in range(11)]
    found = regress(columns.sum(axis=1), columns, NoiseModel.of(White(N=1.0)), dt=1.0, names=names)
    assert found.condition == pytest.approx(
        np.linalg.cond(columns / np.linalg.norm(columns, axis=0)), rel=1e-3
    )
    assert found.condition > 1 / RANK and len(found.unbounded) == 11
    assert np.isnan(found.coefficients).all() and np.isinf(found.sd).all()
    middle = np.stack([((x + 5.95) / 2.85) ** k for k in range(11)], axis=1)
    told = regress(middle.sum(axis=1), middle, NoiseModel.of(White(N=1.0)), dt=1.0, names=names)
    assert told.condition < 1e5 and not told.unbounded
    np.testing.assert_allclose(told.coefficients, 1.0, rtol=1e-9)
