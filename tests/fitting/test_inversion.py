# SPDX-License-Identifier: BSD-3-Clause
"""The engine of test inversion: an end lies where the loss is critical, or there is none."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from allanite.fitting.inversion import cone_point, crossing, end_of_set, end_of_time
from allanite.quantities.distributions import chi_square_quantile

CRITICAL = chi_square_quantile(0.95, 1)


def counted(loss: Callable[[float], float]) -> tuple[Callable[[float], float], list[float]]:
    asked: list[float] = []

    def counting(x: float) -> float:
        asked.append(x)
        return loss(x)

    return counting, asked


@pytest.mark.long
@settings(max_examples=300, deadline=None)
@given(
    place=st.floats(-12, 12),
    power=st.floats(0.4, 4.0),
    bend=st.floats(0.0, 3.0),
    guess=st.floats(-3.0, 3.0),
    critical=st.floats(2.0, 40.0),
)
def test_the_loss_at_an_end_is_critical(
    place: float, power: float, bend: float, guess: float, critical: float
) -> None:
    """Any loss that rises, with the first step a thousandth to a thousand times what it should be."""
    unit = 10.0**place
    loss, asked = counted(lambda x: critical * ((x / unit) ** power * (1 + bend * math.log1p(x / unit))) ** 2)
    end = crossing(loss, critical, unit * 10.0**guess)
    assert abs(math.sqrt(loss(end)) - math.sqrt(critical)) < 4e-3 * math.sqrt(critical)
    assert len(asked) < 40


def test_a_straight_root_takes_two_looks() -> None:
    loss, asked = counted(lambda x: x**2)
    assert crossing(loss, CRITICAL, 5.0) == pytest.approx(math.sqrt(CRITICAL), rel=1e-12)
    assert len(asked) == 2


def test_a_loss_that_levels_off_has_no_end() -> None:
    low = lambda v: 0.9 * CRITICAL * (1 - 1 / (1 + math.log(v) ** 2))  # noqa: E731
    assert end_of_set(low, CRITICAL, 1.0, +1, 0.3) == math.inf
    assert end_of_set(low, CRITICAL, 1.0, -1, 0.3) == 0.0
    assert [end_of_time(low, CRITICAL, 20.0, 0.3, limit) for limit in (2.0, 20.0, 9000.0)] == [
        2.0,
        20.0,
        9000.0,
    ]


def test_a_value_that_no_model_allows_ends_the_set() -> None:
    wall = lambda v: 0.0 if v < 3.0 else math.inf  # noqa: E731
    assert end_of_set(wall, CRITICAL, 1.0, +1, 0.3) == pytest.approx(3.0, rel=1e-6)


def test_the_point_of_one_free_parameter_is_that_of_chi_square() -> None:
    """By 8000 draws: the standard error of their 95 % point is 0.1; others free change nothing."""
    e = np.eye(3)
    assert cone_point((), (), 0.95) == pytest.approx(CRITICAL)
    assert cone_point([e[0], e[1], e[2]], ("free",) * 3, 0.95) == pytest.approx(CRITICAL, abs=0.35)


@pytest.mark.parametrize("along", [0.3, -0.5, 0.9])
def test_the_point_beside_a_one_sided_parameter_is_that_of_its_own_draws(along: float) -> None:
    """In two dimensions the best of either model is a projection that can be written down."""
    tested, other = np.array([1.0, 0.0]), np.array([along, math.sqrt(1 - along**2)])
    y = np.random.default_rng(1987).standard_normal((400_000, 2))
    whole = np.where(y[:, 1] >= 0, (y**2).sum(axis=1), y[:, 0] ** 2)
    wanted = max(float(np.quantile(whole - np.maximum(y @ other, 0.0) ** 2, 0.95)), CRITICAL)
    assert cone_point([tested, other], ("free", "one-sided"), 0.95) == pytest.approx(wanted, abs=0.35)
