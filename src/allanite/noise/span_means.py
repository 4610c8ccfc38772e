# SPDX-License-Identifier: BSD-3-Clause
"""The covariance of means over spans of a record, in closed form: the second method beside the regression.

It comes from the phase, not from a filter: the mean of a span is the difference of the phase at its two ends over its
length, and every combination of spans in which a constant cancels has the variance

    sum over i, j of c_i c_j r(t_i - t_j),

r being the generalised covariance of the phase (`Term.phase_covariance`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel, White
from allanite.recording.records import Sampling

__all__ = ["contrast_whitener", "span_covariance"]

Array = NDArray[np.float64]


def span_covariance(
    model: NoiseModel, start: Array, stop: Array, whole: Array, *, dt: float, sampling: Sampling
) -> Array:
    """Covariance of means over spans; it holds for combinations in which a constant cancels.

    Parameters
    ----------
    model : NoiseModel
    start, stop : ndarray, shape (n,) [samples]
    whole : ndarray, shape (n,) [samples]
        Samples that were measured: where some are missing inside a span its white noise is larger.
    dt : float [s]
        Sample interval.
    sampling : "mean" or "point"
    """
    points = np.concatenate([start, stop])
    distance = points[:, None] - points[None, :]
    r = np.zeros_like(distance)
    for term in model.terms:
        r += np.asarray(term.phase_covariance(distance, dt, sampling))
    n, length = len(start), stop - start
    joined = (r[n:, n:] - r[n:, :n] - r[:n, n:] + r[:n, :n]) / np.outer(length, length)
    white = sum(t.N**2 for t in model.terms if isinstance(t, White)) / dt
    return np.asarray(joined + np.diag(white * np.maximum(1 / whole - 1 / length, 0.0)))


def contrast_whitener(covariance: Array) -> Array:
    """Turns means of this covariance into independent numbers of variance one, and a constant into zero.

    Returns
    -------
    ndarray, shape (n - 1, n)
    """
    n = len(covariance)
    contrast = np.linalg.qr(np.column_stack([np.ones(n), np.eye(n)[:, 1:]]))[0][:, 1:].T
    factor = np.linalg.cholesky(contrast @ covariance @ contrast.T)
    return np.asarray(np.linalg.solve(factor, contrast))
