# SPDX-License-Identifier: BSD-3-Clause
"""Is there a common part, is it the same to all, and does every sensor feel it at the same time?"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.noise.allan.covariance import complete_starts
from allanite.noise.allan.statistics import inside
from allanite.quantities.distributions import chi_square_tail, normal_quantile
from allanite.stability.shared_noise.quadratic import covariance_of
from allanite.stability.shared_noise.results import PairAgreement

__all__ = ["delay_of", "same_to_all", "shared_sign"]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]

#: Probability that independent sensors are said to share noise, or to feel it at different times.
_FALSE = 0.01
#: Degrees of freedom from which an element of C is normal enough for a chi-square.
_NORMAL = 12.0
#: Positions in which a delay is looked for, shifts within a lag, and by how much Fisher's z must be larger.
_POSITIONS, _SHIFTS, _CLEARER = 1 << 19, 16, 4.0


def shared_sign(correlation: Array, edf: Array) -> int:
    """1 or -1 where any pair is correlated at any lag beyond chance, 0 where none is.

    Parameters
    ----------
    correlation : ndarray, shape (n_lags, n_pairs)
    edf : ndarray, shape (n_lags,)
        Fisher's z has the variance 1/(edf - 2).
    """
    usable = edf > 4.0
    if not usable.any():
        return 0
    z = np.arctanh(np.clip(correlation[usable], -1 + 1e-12, 1 - 1e-12)) * np.sqrt(edf[usable] - 2.0)[:, None]
    at = np.unravel_index(int(np.argmax(np.abs(z))), z.shape)
    bar = normal_quantile(1.0 - _FALSE / (2 * z.size))
    return int(np.sign(z[at])) if abs(z[at]) > bar else 0


def same_to_all(covariance: Array, products: Array, edf: Array) -> PairAgreement | None:
    """Chi-square of the three covariances of three sensors: they are equal where all share the same part."""
    use = np.flatnonzero(edf > _NORMAL)
    if covariance.shape[1] != 3 or len(use) == 0:
        return None
    pairs = ((0, 1), (0, 2), (1, 2))
    forms = []
    for first, second in ((pairs[0], pairs[1]), (pairs[0], pairs[2])):
        form = np.zeros((3, 3))
        for (i, j), sign in ((first, 0.5), (second, -0.5)):
            form[i, j] += sign
            form[j, i] += sign
        forms.append(form)
    difference = np.concatenate([np.einsum("ij,lij->l", form, covariance[use]) for form in forms])
    V = covariance_of(forms, products[:, :, use[:, None], use]).reshape(len(difference), -1)
    sd = np.sqrt(np.diag(V))
    rho = V / np.outer(sd, sd) + 1e-9 * np.eye(len(sd))
    z = difference / sd
    chi2 = float(z @ np.linalg.solve(rho, z))
    return PairAgreement(chi2=chi2, dof=float(len(z)), p=chi_square_tail(chi2, len(z)))


def delay_of(first: Array, second: Array, missing: Spans, lag: int, edf: float) -> int:
    """Samples by which the second channel follows the first; 0 where no shift raises their correlation clearly.

    Looked for at one lag, within two lags of either side, in steps of a sixteenth of the lag.

    Parameters
    ----------
    first, second : ndarray, shape (n_samples + 1,)
        Phases.
    lag : int [samples]
        The shortest at which the two are correlated: a delay shows best there.
    edf : float
        Of the variances at that lag.
    """
    n, reach = len(first) - 1, 2 * lag
    starts = complete_starts(missing, n, 2 * lag)
    step = max(lag // _SHIFTS, 1)
    shifts = np.arange(-reach, reach + 1, step) // step * step
    stride = max(n // _POSITIONS, 1)
    at = np.arange(reach, n - 2 * lag - reach, stride)
    correlations = np.zeros(len(shifts))
    for k, shift in enumerate(shifts):
        use = at[inside(at, starts) & inside(at + shift, starts)]
        if len(use) < 16:
            return 0
        one, two = _second_difference(first, use, lag), _second_difference(second, use + shift, lag)
        size = math.sqrt(float(one @ one) * float(two @ two))
        correlations[k] = float(one @ two) / size if size > 0 else 0.0
    z = np.arctanh(np.clip(correlations, -1 + 1e-9, 1 - 1e-9)) * math.sqrt(max(edf - 2.0, 1.0))
    zero = z[int(np.flatnonzero(shifts == 0)[0])]
    best = int(np.argmax(z))
    return int(shifts[best]) if z[best] - max(zero, 0.0) > _CLEARER else 0


def _second_difference(x: Array, at: NDArray[np.int64], lag: int) -> Array:
    return np.asarray(x[at + 2 * lag] - 2 * x[at + lag] + x[at])
