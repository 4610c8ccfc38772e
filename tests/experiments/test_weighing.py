# SPDX-License-Identifier: BSD-3-Clause
"""Weights that are estimates: the covariance of least squares by them, against its scatter over simulated sets."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2
from scipy.stats import t as student

from allanite.experiments.calibration.adjustment.rounds import HINTED
from allanite.experiments.calibration.adjustment.scatter import (
    Contrasts,
    Sizes,
    parameter_dof,
    sizes_of,
    weighing_covariance,
)

TRIALS = 800


@pytest.mark.long
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
        solution: Any = SimpleNamespace(gain=gain, projector=weight - weight @ design @ gain)
        squares += (gain @ observed) ** 2 / TRIALS
        by_weights += np.diag(covariance) / TRIALS
        whole += np.diag(covariance + weighing_covariance(solution, shapes, sizes)) / TRIALS
    band = 3.3 * math.sqrt(2 / TRIALS / unknowns)  # of the mean of independent squares; 99.9 %
    assert abs(float(np.mean(whole / squares)) - 1) < band
    assert float(np.mean(by_weights / squares)) < 1 - band  # what it was before


@pytest.mark.long
@pytest.mark.parametrize("scatter", [0.0, 0.6, 2.0])
def test_intervals_hold_whether_scatter_is_hinted_at_or_not(scatter: float) -> None:
    """Observations of known noise and some scatter: widened where chance hardly makes them scatter so."""
    rows, unknowns = 24, 12
    rng = np.random.default_rng([7, round(10 * scatter)])
    design = rng.normal(size=(rows, unknowns))
    noise, shapes = np.eye(rows), {"turns": np.eye(rows)}
    held = 0
    for _ in range(TRIALS):
        observed = rng.normal(size=rows) * math.hypot(1.0, scatter)
        contrasts = Contrasts.of(noise, observed, design)
        hinted = chi2.sf(float(contrasts.values @ contrasts.values), rows - unknowns) < HINTED
        sizes = sizes_of(contrasts, shapes, {}) if hinted else Sizes()
        weight = noise / (1 + sizes.values.get("turns", 0.0) ** 2)
        covariance = np.linalg.inv(design.T @ weight @ design)
        gain = covariance @ design.T @ weight
        solution: Any = SimpleNamespace(
            gain=gain, covariance=covariance, projector=weight - weight @ design @ gain
        )
        sd = np.sqrt(np.diag(covariance + weighing_covariance(solution, shapes, sizes)))
        quantile = student.ppf(0.975, np.minimum(parameter_dof(solution, shapes, sizes), 1e9))
        held += int((np.abs(gain @ observed) < quantile * sd).sum())
    # 99.9 % about 94.5 to 96 %; the errors of one set share one scatter, so half of them count
    band = 3.3 * math.sqrt(0.05 * 0.95 / (TRIALS * unknowns / 2))
    assert 0.945 - band < held / TRIALS / unknowns < 0.96 + band
