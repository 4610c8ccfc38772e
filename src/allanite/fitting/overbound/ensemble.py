# SPDX-License-Identifier: BSD-3-Clause
"""Draws from a density of several parameters by an ensemble of walkers, all of them moved at once.

Each walker is moved along the line to another one; the ensemble takes the scale of every parameter and their
correlations from itself, so that there is nothing to tune [1].

References
----------
.. [1] J. Goodman, J. Weare, "Ensemble samplers with affine invariance", Comm. App. Math. Comp. Sci. 5 (2010) 65.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["walk"]

Array = NDArray[np.float64]

#: Greatest stretch of a move [1, eq. 9].
_STRETCH = 2.0


def walk(
    log_density: Callable[[Array], Array],
    start: Array,
    *,
    steps: int,
    settle: int,
    every: int = 1,
    rng: np.random.Generator,
) -> Array:
    """Positions of all walkers after every so many steps, the first `settle` of them left out.

    Parameters
    ----------
    log_density : callable
        Of positions, shape (n, n_parameters), their log density up to a constant, shape (n,); -inf where there is none.
    start : ndarray, shape (n_walkers, n_parameters)
        Different from one another; n_walkers is even.

    Returns
    -------
    ndarray, shape ((steps - settle)/every * n_walkers, n_parameters)
    """
    halves = np.array_split(np.array(start, dtype=np.float64), 2)
    levels = [log_density(half) for half in halves]
    kept = []
    for step in range(steps):
        for here, others in ((0, 1), (1, 0)):
            halves[here], levels[here] = _moved(log_density, halves[here], levels[here], halves[others], rng)
        if step >= settle and (step - settle) % every == 0:
            kept.append(np.concatenate(halves))
    return np.concatenate(kept)


def _moved(
    log_density: Callable[[Array], Array], x: Array, level: Array, others: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """One half of the ensemble, each stretched towards or away from one of the other half [1, eqs 7-9]."""
    n, size = x.shape
    z: Array = np.asarray((1 + (_STRETCH - 1) * rng.random(n)) ** 2 / _STRETCH)
    partner = others[rng.integers(0, len(others), n)]
    trial = partner + z[:, None] * (x - partner)
    density = log_density(trial)
    with np.errstate(invalid="ignore"):
        taken = np.log(rng.random(n)) < (size - 1) * np.log(z) + density - level
    return np.where(taken[:, None], trial, x), np.where(taken, density, level)
