# SPDX-License-Identifier: BSD-3-Clause
"""Discrete linear models of noise: what a filter needs. Models add."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["StateSpace", "stateless", "states"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSpace:
    """Discrete linear model of samples: y = h s + v, then s' = F s + w.

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
        Covariance of the state at the first sample; zero where the state is known to be zero.
    rate : ndarray, shape (n,)
        What each state adds to the signal at the instant of the state: the end of the sample where samples are
        interval means. 0 for a state that stands for something faster than a sample, and for the mean itself.
    labels : tuple of str
        Type of the term that each state belongs to; "mean" for the mean over the interval, "level" for the constant.
    diffuse : ndarray of bool, shape (n,)
        States about which nothing is known at first; their `initial` is zero.
    """

    transition: Array
    process: Array
    output: Array
    noise: float
    initial: Array
    rate: Array
    labels: tuple[str, ...]
    diffuse: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.output)

    def __add__(self, other: StateSpace) -> StateSpace:
        return StateSpace(
            transition=_block_diagonal(self.transition, other.transition),
            process=_block_diagonal(self.process, other.process),
            output=np.concatenate([self.output, other.output]),
            noise=self.noise + other.noise,
            initial=_block_diagonal(self.initial, other.initial),
            rate=np.concatenate([self.rate, other.rate]),
            labels=self.labels + other.labels,
            diffuse=np.concatenate([self.diffuse, other.diffuse]),
        )

    def with_constant(self, label: str = "level") -> StateSpace:
        """The same model and a constant of which nothing is known: the mean rate of the record, bias included."""
        constant = states(1.0, 0.0, 1.0, 0.0, label=label, diffuse=True)
        return self + constant


def _block_diagonal(a: Array, b: Array) -> Array:
    out = np.zeros((len(a) + len(b),) * 2)
    out[: len(a), : len(a)] = a
    out[len(a) :, len(a) :] = b
    return out


def states(
    transition: ArrayLike,
    process: ArrayLike,
    output: ArrayLike,
    initial: ArrayLike,
    *,
    label: str,
    diffuse: bool = False,
) -> StateSpace:
    """A model without white noise, whose states add to the signal what they add to a sample."""
    square = [np.atleast_2d(np.asarray(x, dtype=np.float64)) for x in (transition, process, initial)]
    row = np.atleast_1d(np.asarray(output, dtype=np.float64))
    return StateSpace(
        transition=square[0],
        process=square[1],
        output=row,
        noise=0.0,
        initial=square[2],
        rate=row,
        labels=(label,) * len(row),
        diffuse=np.full(len(row), diffuse),
    )


def stateless(noise: float) -> StateSpace:
    """White noise alone."""
    none, empty = np.zeros((0, 0)), np.zeros(0)
    return StateSpace(
        transition=none,
        process=none,
        output=empty,
        noise=noise,
        initial=none,
        rate=empty,
        labels=(),
        diffuse=np.zeros(0, dtype=np.bool_),
    )
