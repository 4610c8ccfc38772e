# SPDX-License-Identifier: BSD-3-Clause
"""Least squares with coefficients that are not negative, beside those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from allanite.fitting.nonnegative import nonnegative


@pytest.mark.parametrize("columns", [1, 2, 5, 8])
def test_it_is_that_of_scipy(columns: int) -> None:
    rng = np.random.default_rng(columns)
    for _ in range(100):
        A = rng.standard_normal((12, columns)) + rng.choice([0.0, 1.0])
        A /= np.linalg.norm(A, axis=0)
        b = rng.standard_normal(12)
        np.testing.assert_allclose(nonnegative(A, b), nnls(A, b)[0], rtol=1e-9, atol=1e-12)


def test_columns_that_are_equal_share_one_fit() -> None:
    A = np.ones((3, 2)) / np.sqrt(3)
    x = nonnegative(A, np.array([1.0, 2.0, 3.0]))
    assert (x >= 0).all() and A @ x == pytest.approx(np.full(3, 2.0))


def test_nothing_positive_is_zero() -> None:
    np.testing.assert_array_equal(nonnegative(np.eye(2), np.array([-1.0, -2.0])), [0.0, 0.0])
