# SPDX-License-Identifier: BSD-3-Clause
"""Checks of residuals: fail at their probability, widen by Birge's ratio, or take the result away."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from allanite.quantities import distributions as laws
from allanite.quantities.residual_tests import (
    ResidualTest,
    alarm,
    grave,
    inflation_of,
    scatter_check,
    size_check,
)
from allanite.views.wording.rates import check_wordings


def test_laws_are_those_of_the_textbooks() -> None:
    for dof in (1, 3, 50, 5000):
        assert laws.chi_square_tail(1.2 * dof, dof) == pytest.approx(stats.chi2.sf(1.2 * dof, dof), rel=1e-9)
        assert laws.chi_square_quantile(0.95, dof) == pytest.approx(stats.chi2.ppf(0.95, dof), rel=1e-9)
        assert laws.student_quantile(0.975, dof) == pytest.approx(stats.t.ppf(0.975, dof), rel=1e-6)
    assert laws.normal_quantile(0.975) == pytest.approx(1.959963984540054, rel=1e-12)


def test_a_failed_size_widens_up_to_a_factor_of_two() -> None:
    n = 1000
    fine, loud, foreign, quiet = (size_check(n * ratio**2, n) for ratio in (1.0, 1.5, 2.5, 0.5))
    assert fine.passed and not loud.passed and not quiet.passed
    assert inflation_of([fine, loud]) == pytest.approx(1.5)
    assert inflation_of([quiet]) == 1  # too little noise narrows nothing
    assert (grave([fine, loud, quiet]), grave([foreign])) == ([], [foreign])
    assert "is it the model" in foreign.says and "wider than necessary" in quiet.says


def test_size_is_two_sided_and_true_to_its_probability() -> None:
    """p of chi-square noise is uniform."""
    draws = stats.chi2.rvs(50, size=2000, random_state=np.random.default_rng(1))
    assert stats.kstest([size_check(x, 50).p for x in draws], "uniform").pvalue > 1e-4


def test_many_looks_are_paid_for() -> None:
    one, many = alarm("x", 12.0, 1, "why"), alarm("x", 12.0, 1, "why", looks=10)
    assert many.p == pytest.approx(10 * one.p)
    assert (one.passed, many.passed) == (False, True)
    assert grave([one, many]) == [one]


@pytest.mark.parametrize("looks", [1, 2, 12])
def test_the_line_of_a_check_says_what_was_done_to_its_p(looks: int) -> None:
    """Chi-square and p of one line belong together, or the factor between them is said."""
    for statistic, dof in ((3.0, 1), (9.5, 2), (25.0, 10)):
        check = alarm("x", statistic, dof, "why", looks=looks)
        single = float(stats.chi2.sf(statistic, dof))
        assert check.p == pytest.approx(min(single * check.tries, 1.0), rel=1e-9)
        (line,) = check_wordings([check])
        assert ("multiplied by" in line.chance) == (looks > 1)
        assert looks == 1 or f"multiplied by {looks} tries" in line.chance
    (line,) = check_wordings([size_check(60.0, 50)])
    assert line.chance.endswith("two-sided")


def test_scatter_says_how_much() -> None:
    check = scatter_check("dwells", 90.0, 10, "reasons")
    assert isinstance(check, ResidualTest) and check.widens and check.ratio == pytest.approx(3.0)
    assert "3.00 times" in check.says and check.says.endswith("reasons")
    assert grave([check]) == [check]
    assert scatter_check("dwells", 0.0, 0, "").passed
