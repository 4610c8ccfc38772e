# SPDX-License-Identifier: BSD-3-Clause
"""One position left out: what all others predict of it, with the scatter that all others show.

A position that is wrong is the scatter where there are few, and hides in it. So the scatter is estimated anew from the
others; under it the misfit of the position is its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment.design import linearise
from allanite.experiments.calibration.adjustment.rounds import Adjustment, unknowns_of
from allanite.experiments.calibration.adjustment.scatter import Contrasts, Deletion, f_tail, sizes_of, spanned

__all__ = ["left_out"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def left_out(fit: Adjustment, rows: Index, kind: Index) -> Deletion:
    """The misfit of some rows of the observations under the scatter of all others: Fisher's law.

    Parameters
    ----------
    fit : Adjustment
        With scatter beyond the noise.
    rows : ndarray of int64
    kind : ndarray of int64
        All rows of their kind: the degrees of freedom of the others are those of the scatter.
    """
    observed, state = fit.observed, fit.solution.state
    noise = fit.weights.with_beyond({}).covariance(observed, state, linearise(observed, state))
    unknowns = unknowns_of(observed, fit.solution, None)
    others = np.setdiff1d(np.arange(len(noise)), rows)
    place = np.ix_(others, others)
    contrasts = Contrasts.of(noise[place], fit.solution.residual[others], unknowns[others])
    shapes = {name: fit.shapes[name][place] for name in fit.beyond}
    sizes = sizes_of(contrasts, shapes, fit.beyond).values
    total = noise + sum((v**2 * fit.shapes[n] for n, v in sizes.items()), np.zeros_like(noise))
    chi2, count = _misfit(total, unknowns, fit.solution.residual, rows, others)
    if count == 0:
        return Deletion(chi2=0.0, dof=0, p=1.0)
    beyond = sum((v**2 * shapes[n] for n, v in sizes.items()), np.zeros((len(others),) * 2))
    same = contrasts.group(np.flatnonzero(np.isin(others, kind)), beyond)
    known = max(same.dof, 1.0)
    chi2 /= max(same.ratio**2, 1.0)
    return Deletion(chi2=chi2, dof=count, p=f_tail(chi2 / count, count, known))


def _independent(table: Array) -> Array:
    """An orthonormal basis of the columns."""
    left, rank = spanned(table)
    return left[:, :rank]


def _misfit(total: Array, unknowns: Array, residual: Array, rows: Index, others: Index) -> tuple[float, int]:
    """Chi-square of what the others leave of the rows, and how many combinations of them they predict."""
    whole = np.linalg.inv(np.linalg.cholesky(total))
    every = _left(whole @ _independent(unknowns), whole @ residual)
    part = np.linalg.inv(np.linalg.cholesky(total[np.ix_(others, others)]))
    rest = _left(part @ _independent(unknowns[others]), part @ residual[others])
    return max(every[0] - rest[0], 0.0), every[1] - rest[1]


def _left(table: Array, observations: Array) -> tuple[float, int]:
    """Sum of squares that a least squares leaves, and its degrees of freedom."""
    basis = _independent(table)
    out = observations - basis @ (basis.T @ observations)
    return float(out @ out), len(observations) - basis.shape[1]
