# SPDX-License-Identifier: BSD-3-Clause
"""Headings of positions that no turn links to the first: by the Earth's rotation, where the gyros see it.

The least squares finds the nearest heading that fits, which may be the wrong one of several. So all are tried.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment.design import Observed, State
from allanite.experiments.calibration.adjustment.solution import CalibrationSolution, Earth
from allanite.experiments.calibration.adjustment.weights import Weights, groups_of
from allanite.quantities.attitude import rotation
from allanite.recording.calibration import GYRO

__all__ = ["headed_by_earth", "with_unknown_headings"]

Array = NDArray[np.float64]

#: Headings that are tried.
TRIED = 24
#: A heading is better if chi-square falls by more than this.
BETTER = 1.0


def with_unknown_headings(observed: Observed, weights: Weights, earth: Earth, attitudes: Array) -> Weights:
    """The part of the Earth's rotation that nobody knows, as noise of the gyros at rest in positions of any heading.

    Along an axis of the body it has the variance v. Headings may be anything: the same everywhere, which moves the
    mean, or another in each position, which scatters. Both are allowed for, each with v.
    """
    level, _, down = (earth.sd**2 * (earth.free**2).sum(axis=1)).tolist()
    size = np.sqrt(np.einsum("nia,i->an", attitudes**2, np.array([level, level, down])))
    unknown = size[:, :, None] * (size[:, None, :] + size[:, :, None] * np.eye(observed.n))
    return replace(weights, at_rest={**weights.at_rest, GYRO: weights.at_rest[GYRO] + unknown})


def headed_by_earth(observed: Observed, solution: CalibrationSolution) -> State | None:
    """The state with better headings of the chains that begin anew; None where there are none."""
    chains = _chains(observed)
    state = solution.state
    rows = groups_of(observed)[GYRO]
    sd = np.sqrt(np.diag(solution.noise)[rows]).reshape(-1, 3)
    errors = observed.gyro.errors(state.values[observed.place(GYRO)])
    level = observed.means[GYRO] - solution.residual[rows].reshape(-1, 3)  # all but the heading is in it
    force = observed.force(state.attitudes)  # whatever the heading
    level = level - errors.seen(np.swapaxes(state.attitudes, -1, -2) @ state.earth, observed.warmer, force)
    attitudes, is_better = state.attitudes.copy(), False
    for chain in chains:
        costs = []
        for k in range(TRIED):
            turned = rotation([0.0, 0.0, 2 * math.pi * k / TRIED]) @ state.attitudes[chain]
            earth = np.swapaxes(turned, -1, -2) @ state.earth
            predicted = errors.seen(earth, observed.warmer[chain], force[chain]) + level[chain]
            costs.append(float((((observed.means[GYRO][chain] - predicted) / sd[chain]) ** 2).sum()))
        best = int(np.argmin(costs))
        if costs[best] < costs[0] - BETTER:
            attitudes[chain] = rotation([0.0, 0.0, 2 * math.pi * best / TRIED]) @ state.attitudes[chain]
            is_better = True
    return replace(state, attitudes=attitudes) if is_better else None


def _chains(observed: Observed) -> list[NDArray[np.int64]]:
    """Positions linked to each other and not to the first."""
    owner = np.arange(observed.n)
    for i, j in zip(observed.before, observed.after, strict=True):
        owner[owner == owner[j]] = owner[i]
    return [np.flatnonzero(owner == first) for first in np.unique(owner) if first != owner[0]]
