# SPDX-License-Identifier: BSD-3-Clause
"""Discrete linear models of noise: what a filter needs. Models add."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["StateSpace", "stateless", "states"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSpace:
    """Discrete linear model of point samples: s' = F s + w, y = h s + v.

    Attributes
    ----------
    transition : ndarray, shape (n, n)
        F over one sample interval.
    process : ndarray, shape (n, n)
        Covariance of w.
    output : ndarray, shape (n,)
        h.
    noise : float
        Variance of v.
    initial : ndarray, shape (n, n)
        Covariance of the first state; zero where the state starts at zero.
    """

    transition: Array
    process: Array
    output: Array
    noise: float
    initial: Array

    def __add__(self, other: StateSpace) -> StateSpace:
        return StateSpace(
            transition=_block_diagonal(self.transition, other.transition),
            process=_block_diagonal(self.process, other.process),
            output=np.concatenate([self.output, other.output]),
            noise=self.noise + other.noise,
            initial=_block_diagonal(self.initial, other.initial),
        )


def _block_diagonal(a: Array, b: Array) -> Array:
    out = np.zeros((len(a) + len(b),) * 2)
    out[: len(a), : len(a)] = a
    out[len(a) :, len(a) :] = b
    return out


def states(transition: ArrayLike, process: ArrayLike, output: ArrayLike, initial: ArrayLike) -> StateSpace:
    square = [np.atleast_2d(np.asarray(x, dtype=np.float64)) for x in (transition, process, initial)]
    return StateSpace(
        transition=square[0],
        process=square[1],
        output=np.atleast_1d(np.asarray(output, dtype=np.float64)),
        noise=0.0,
        initial=square[2],
    )


def stateless(noise: float) -> StateSpace:
    none = np.zeros((0, 0))
    return StateSpace(transition=none, process=none, output=np.zeros(0), noise=noise, initial=none)
