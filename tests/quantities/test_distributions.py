# SPDX-License-Identifier: BSD-3-Clause
"""Quantiles and tails against the tables that every book prints, closed forms, SciPy and high precision."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from scipy import special

from allanite.quantities.distributions import (
    chi_square_quantile,
    chi_square_quantiles,
    chi_square_tail,
    chi_square_tails,
    normal_quantile,
    normal_quantiles,
    student_quantile,
)

TAILS = np.array([1e-300, 1e-30, 1e-9, 1e-4, 0.025, 0.16, 0.5, 0.84, 0.975, 0.9999])


@pytest.mark.parametrize("dof, table", [(1, 12.706), (4, 2.776), (10, 2.228), (30, 2.042), (1e9, 1.960)])
def test_student_two_sided_95_percent(dof: float, table: float) -> None:
    assert student_quantile(0.975, dof) == pytest.approx(table, abs=6e-4)
    assert student_quantile(0.025, dof) == pytest.approx(-table, abs=6e-4)


@pytest.mark.parametrize(
    "dof, upper, lower", [(1, 3.841, 0.003932), (5, 11.070, 1.145), (20, 31.410, 10.851)]
)
def test_chi_square_upper_and_lower_5_percent(dof: float, upper: float, lower: float) -> None:
    assert chi_square_quantile(0.95, dof) == pytest.approx(upper, rel=1e-3)
    assert chi_square_quantile(0.05, dof) == pytest.approx(lower, rel=1e-3)
    assert chi_square_tail(upper, dof) == pytest.approx(0.05, rel=1e-3)


def test_normal() -> None:
    assert [normal_quantile(p) for p in (0.5, 0.8413447, 0.975, 0.01)] == pytest.approx(
        [0.0, 1.0, 1.959964, -2.326348], abs=1e-6
    )


def test_normal_against_scipy() -> None:
    p = np.concatenate([TAILS, np.linspace(0.01, 0.99, 99)])
    np.testing.assert_allclose(normal_quantiles(p), special.ndtri(p), rtol=1e-13, atol=2e-16)
    np.testing.assert_array_equal(normal_quantiles(p), [normal_quantile(x) for x in p])
    np.testing.assert_array_equal(normal_quantiles([0.0, 1.0, math.nan]), [-math.inf, math.inf, math.nan])


@pytest.mark.parametrize("dof", [2, 6, 48, 50, 52, 120])
def test_tails_of_even_degrees_are_poisson_sums(dof: int) -> None:
    """Q = exp(-x/2) sum over k < dof/2 of (x/2)^k/k!, in exact arithmetic but for the exponential."""
    for x in (1, 7, 40, 60, 130, 400):
        half, term, total = Fraction(x, 2), Fraction(1), Fraction(0)
        for k in range(dof // 2):
            total += term
            term *= half / (k + 1)
        upper = mpmath.mpf(total.numerator) / total.denominator * mpmath.exp(-mpmath.mpf(x) / 2)
        assert chi_square_tail(x, dof) == pytest.approx(float(upper), rel=1e-12)


def exact_tails(shape: float, x: float) -> tuple[float, float]:
    """P and Q of the gamma law as integrals over the logarithm, in 30 digits."""
    with mpmath.workdps(30):
        a, start, width = mpmath.mpf(shape), mpmath.log(mpmath.mpf(x) / shape), 1 / mpmath.sqrt(shape)
        norm = mpmath.exp(a * mpmath.log(a) - a - mpmath.loggamma(a))

        def weight(u: mpmath.mpf) -> mpmath.mpf:
            return norm * mpmath.exp(-a * (mpmath.expm1(u) - u))

        steps = [k * width for k in range(17)]
        lower = mpmath.quad(weight, [start - s for s in reversed(steps)])
        return float(lower), float(mpmath.quad(weight, [start + s for s in steps]))


@pytest.mark.long
@pytest.mark.parametrize("shape", [24.9, 25.1, 200.0, 3.3e6, 1e9])
@pytest.mark.parametrize("deviation", [-6.0, -0.3, 1.0, 5.0])
def test_tails_against_30_digits(shape: float, deviation: float) -> None:
    """SciPy's are wrong in the third to the last digit, or altogether, beyond 4.5 deviations of large shapes."""
    x = shape * (1 - 1 / (9 * shape) + deviation / (3 * math.sqrt(shape))) ** 3
    lower, upper = chi_square_tails(2 * x, 2 * shape)
    exact = exact_tails(shape, x)
    smaller = exact.index(min(exact))
    assert (lower, upper)[smaller] == pytest.approx(exact[smaller], rel=1e-12)
    assert lower + upper == pytest.approx(1.0, rel=1e-15)


def test_tails_against_scipy() -> None:
    dof = np.geomspace(0.02, 2e3, 60)[:, None]
    x = dof * np.geomspace(1e-3, 30.0, 80)
    lower, upper = special.chdtr(dof, x), special.chdtrc(dof, x)
    ours = chi_square_tails(x, dof)
    inside = np.minimum(lower, upper) > 1e-280
    np.testing.assert_allclose(ours[0][inside & (lower < 0.5)], lower[inside & (lower < 0.5)], rtol=2e-12)
    np.testing.assert_allclose(ours[1][inside & (upper < 0.5)], upper[inside & (upper < 0.5)], rtol=2e-12)


@pytest.mark.parametrize("upper", [False, True])
def test_quantiles_against_scipy(upper: bool) -> None:
    dof = np.concatenate([np.geomspace(0.02, 2e3, 60), [49.999, 50.001]])[:, None]
    scipy = (special.gammainccinv if upper else special.gammaincinv)(dof / 2, TAILS)
    ours = chi_square_quantiles(TAILS, dof, upper=upper)
    normal = scipy > 1e-300
    np.testing.assert_allclose(ours[normal], 2 * scipy[normal], rtol=2e-12)
    assert ours[~normal].max(initial=0.0) < 1e-290


@pytest.mark.parametrize("dof", [1e5, 4e7, 2e10])
def test_quantiles_give_their_tails_back(dof: float) -> None:
    tails = TAILS[3:]
    for upper in (False, True):
        x = chi_square_quantiles(tails, dof, upper=upper)
        np.testing.assert_allclose(chi_square_tails(x, dof)[int(upper)], tails, rtol=1e-9)
    assert chi_square_quantile(0.3, dof) == chi_square_quantiles(0.3, dof)
    assert chi_square_quantile(0.7, dof) == pytest.approx(float(chi_square_quantiles(0.7, dof)), rel=1e-14)


@pytest.mark.parametrize("kind", [int, np.int64, np.float64])
def test_numbers_of_any_type(kind: type) -> None:
    assert chi_square_quantile(kind(1), kind(3)) == math.inf
    assert normal_quantile(kind(0)) == -math.inf
    assert chi_square_tail(kind(3), kind(2)) == pytest.approx(math.exp(-1.5), rel=1e-15)


def test_ends_and_what_has_no_value() -> None:
    np.testing.assert_array_equal(chi_square_quantiles([0.0, 1.0], 3.0), [0.0, math.inf])
    np.testing.assert_array_equal(chi_square_quantiles([0.0, 1.0], 3.0, upper=True), [math.inf, 0.0])
    assert np.isnan(chi_square_quantiles([-0.1, 1.1, math.nan], 3.0)).all()
    assert np.isnan(chi_square_quantiles(0.5, [0.0, -1.0, math.nan, math.inf])).all()
    np.testing.assert_array_equal(chi_square_tails([-1.0, 0.0, math.inf], 4.0), [[0, 0, 1], [1, 1, 0]])
    np.testing.assert_array_equal(chi_square_tails(2.0, [0.0, math.inf]), [[1, 0], [0, 1]])
    assert np.isnan(chi_square_tails([math.nan, 0.0, 1.0], [1.0, 0.0, -1.0])).all()
