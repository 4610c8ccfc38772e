# SPDX-License-Identifier: BSD-3-Clause
"""Means over spans of white noise, whose covariance every book has."""

from __future__ import annotations

import numpy as np
import pytest

from allanite.noise import NoiseModel, White
from allanite.noise.span_means import contrast_whitener, span_covariance


@pytest.mark.parametrize("whole", [(100, 300), (100, 150), (40, 7)])
def test_white_noise_counts_the_samples_that_are_there(whole: tuple[int, int]) -> None:
    start, stop, dt, n = np.array([0.0, 150.0]), np.array([100.0, 450.0]), 0.1, 3e-3
    found = span_covariance(NoiseModel.of(White(N=n)), start, stop, np.array(whole), dt=dt, sampling="mean")
    contrast = np.array([1.0, -1.0])  # a constant cancels
    assert contrast @ found @ contrast == pytest.approx(n**2 / dt * (1 / whole[0] + 1 / whole[1]), rel=1e-12)
    (row,) = contrast_whitener(found)
    assert row.sum() == pytest.approx(0.0, abs=1e-9 * abs(row[0])) and row @ found @ row == pytest.approx(1.0)
