# SPDX-License-Identifier: BSD-3-Clause
"""Covariances of many small linear systems at any times, exact: x' = F x + w, all at once.

Notes
-----
Over a step h so short that h |F| <= 1/4 both the transition and the covariance of the drive are their Taylor series,

    Phi = sum (h F)^k/k!,    Q = sum h^(k+1)/(k+1)! L^k(W),    L(X) = F X + X F',

to the last digit. Twice the step is Phi Phi and Q + Phi Q Phi', in which nothing cancels however fast a state decays:
the usual exponential of a matrix of twice the size would overflow there [1]. A chain of doublings passes through every
time that is the longest one times a power of two, so the times of one chain cost nothing besides.

References
----------
.. [1] C. F. Van Loan, "Computing integrals involving the matrix exponential", IEEE Trans. Automat. Contr. 23
   (1978) 395.
"""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

__all__ = ["covariances"]

Array = NDArray[np.float64]

_SHORT = 0.25
_TERMS = 16


def covariances(dynamics: Array, drive: Array, start: Array, times: Array) -> Array:
    """Covariance of each system at each time.

    Parameters
    ----------
    dynamics, drive, start : ndarray, shape (k, n, n)
        F, the density of w, and the covariance at time 0.
    times : ndarray, shape (m,) [s]
        Not negative.

    Returns
    -------
    ndarray, shape (m, k, n, n)
        Not finite where an unstable system has outgrown the range of numbers.
    """
    out = np.empty((len(times), *start.shape))
    size = float(np.abs(dynamics).sum(axis=-1).max(initial=1e-300))
    chains: dict[float, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))
    for i, t in enumerate(times):
        mantissa, power = math.frexp(t)
        chains[mantissa][power].append(i)
    for mantissa, wanted in chains.items():
        if mantissa == 0.0:
            out[wanted[0]] = start
            continue
        first = min(min(wanted), math.floor(math.log2(_SHORT / (size * mantissa))))
        transition, driven = _short(dynamics, drive, math.ldexp(mantissa, first))
        for power in range(first, max(wanted) + 1):
            if power in wanted:
                out[wanted[power]] = _carried(transition, start) + driven
            driven = driven + _carried(transition, driven)
            transition = transition @ transition
    return out


def _carried(transition: Array, covariance: Array) -> Array:
    return np.asarray(transition @ covariance @ transition.swapaxes(-1, -2))


def _short(dynamics: Array, drive: Array, h: float) -> tuple[Array, Array]:
    """Transition and driven covariance over a short step."""
    power, term = np.broadcast_to(np.eye(dynamics.shape[-1]), dynamics.shape), h * drive
    transition, driven = power.copy(), term.copy()
    turned = dynamics.swapaxes(-1, -2)
    for k in range(1, _TERMS + 1):
        power = h / k * (dynamics @ power)
        term = h / (k + 1) * (dynamics @ term + term @ turned)
        transition, driven = transition + power, driven + term
    return transition, driven
