# SPDX-License-Identifier: BSD-3-Clause
"""Weights that are estimates: the covariance of least squares by them, against its scatter over simulated sets."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from allanite.experiments.calibration.adjustment.scatter import Contrasts, sizes_of, weighing_covariance

TRIALS = 800


@pytest.mark.parametrize(("rows", "unknowns", "worse"), [(15, 10, 1.0), (20, 10, 2.0)])
def test_the_covariance_holds_the_error_of_the_weights(rows: int, unknowns: int, worse: float) -> None:
    """Two kinds of observations whose scatters are estimated from what few unknowns leave."""
    rng = np.random.default_rng(rows)
    design = rng.normal(size=(2 * rows, unknowns))
    noise = 1e-4 * np.eye(2 * rows)
    first = np.repeat([1.0, 0.0], rows)
    shapes = {"first": np.diag(first), "second": np.diag(1 - first)}
    true = np.where(first > 0, 1.0, worse)
    squares, by_weights, whole = (np.zeros(unknowns) for _ in range(3))
    for _ in range(TRIALS):
        observed = rng.normal(size=2 * rows) * true
        sizes = sizes_of(Contrasts.of(noise, observed, design), shapes, {}, tuple(shapes))
        weight = np.linalg.inv(noise + sum(v**2 * shapes[n] for n, v in sizes.values.items()))
        covariance = np.linalg.inv(design.T @ weight @ design)
        gain = covariance @ design.T @ weight
        solution = SimpleNamespace(gain=gain, projector=weight - weight @ design @ gain)
        squares += (gain @ observed) ** 2 / TRIALS
        by_weights += np.diag(covariance) / TRIALS
        whole += np.diag(covariance + weighing_covariance(solution, shapes, sizes)) / TRIALS  # type: ignore[arg-type]
    band = 3.3 * math.sqrt(2 / TRIALS / unknowns)  # of the mean of independent squares; 99.9 %
    assert abs(float(np.mean(whole / squares)) - 1) < band
    assert float(np.mean(by_weights / squares)) < 1 - band  # what it was before
