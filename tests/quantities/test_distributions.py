# SPDX-License-Identifier: BSD-3-Clause
"""Quantiles and tails against the tables that every book prints."""

from __future__ import annotations

import pytest

from allanite.quantities.distributions import (
    chi_square_quantile,
    chi_square_tail,
    normal_quantile,
    student_quantile,
)


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
