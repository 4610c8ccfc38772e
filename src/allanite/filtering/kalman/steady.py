# SPDX-License-Identifier: BSD-3-Clause
"""The gain that a filter settles at: what firmware needs that cannot afford a covariance.

Notes
-----
The Riccati recursion from a covariance of zero, taken over 2^k samples at step k (structure-preserving doubling [1]):

    A' = A W A,  G' = G + A W G A^T,  H' = H + A^T H W A,   W = (I + G H)^-1,
    A = F^T,     G = h^T h/R,         H = Q                                                               at first.

H is the predicted covariance after 2^k samples, so thirty steps serve the slowest states there are. A constant
without process noise keeps a gain of zero: in the end it is known, and what is left of it is drift.

References
----------
.. [1] E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang, "Structure-preserving algorithms for periodic discrete-time
   algebraic Riccati equations", Int. J. Control 77 (2004) 767.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FitError, InputError
from allanite.filtering.kalman.checks import checked_space
from allanite.lazy_dataclasses import dataclass
from allanite.noise import StateSpace

__all__ = ["SteadyState", "merged", "steady_state"]

Array = NDArray[np.float64]

_STEPS = 64
_ENDLESS = (
    "the covariance does not settle: a state that drifts without end is not seen by the samples. Join random walks "
    "with allanite.filtering.kalman.merged, or filter with the covariance instead of a steady gain"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyState:
    """A filter that has settled: update s += gain e, then predict s = F s.

    Attributes
    ----------
    gain : ndarray, shape (n,)
        Of the update.
    covariance : ndarray, shape (n, n)
        Of the state after the update.
    predicted : ndarray, shape (n, n)
        Of the state before it.
    innovation_variance : float
    """

    gain: Array
    covariance: Array
    predicted: Array
    innovation_variance: float

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "gain": self.gain.tolist(),
            "covariance": self.covariance.tolist(),
            "predicted": self.predicted.tolist(),
            "innovation_variance": self.innovation_variance,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class RiccatiStep:
    """A, G and H of 2^k samples: the covariance P of a prediction becomes H + A' P (I + G P)^-1 A."""

    transfer: Array
    information: Array
    settling: Array


def steady_state(space: StateSpace) -> SteadyState:
    """The gain and the covariance that the filter of a model settles at.

    Parameters
    ----------
    space : StateSpace
        Its `noise` must be above zero.

    Raises
    ------
    InputError
        No white noise.
    FitError
        The covariance grows without end: a drifting state that no sample sees, or two random walks (the slow end of
        flicker is one) whose difference no sample sees: `merged` joins them.
    """
    space = checked_space(space)
    if not space.noise > 0:
        raise InputError("a steady gain needs white noise above zero in the samples; this model has none")
    if merged(space) is not space:
        raise FitError(_ENDLESS)
    driven = _driven(space)
    within = np.ix_(driven, driven)
    size = np.sqrt(np.diag(space.process))[driven]
    size = np.where(size > 0, size, math.sqrt(space.noise))  # states of order one
    predicted = np.zeros((space.size, space.size))
    predicted[within] = _doubled(
        space.transition[within] * size / size[:, None],
        space.process[within] / np.outer(size, size),
        space.output[driven] * size,
        space.noise,
    ) * np.outer(size, size)
    cross = predicted @ space.output
    variance = float(space.output @ cross) + space.noise
    gain = cross / variance
    keep = np.eye(space.size) - np.outer(gain, space.output)
    covariance = keep @ predicted @ keep.T + space.noise * np.outer(gain, gain)
    for array in (gain, covariance, predicted):
        array.flags.writeable = False
    return SteadyState(gain=gain, covariance=covariance, predicted=predicted, innovation_variance=variance)


def doublings(transition: Array, process: Array, output: Array, noise: float) -> Iterator[RiccatiStep]:
    """The Riccati recursion over 1, 2, 4, ... samples, without end."""
    a, g, h = transition.T.copy(), np.outer(output, output) / noise, process.copy()
    one = np.eye(len(a))
    with np.errstate(over="ignore", invalid="ignore"):
        while True:
            yield RiccatiStep(transfer=a, information=g, settling=h)
            w = np.linalg.solve(one + g @ h, a)  # W A
            step = a.T @ h @ w
            g = g + a @ np.linalg.solve(one + g @ h, g) @ a.T
            a = a @ w
            h = h + (step + step.T) / 2
            g = (g + g.T) / 2


def riccati_steps(space: StateSpace, count: int) -> tuple[Array, Array, Array]:
    """A, G and H of 1, 2, 4, ... samples, each of shape (steps, n, n): so many, or as many as are finite."""
    steps: list[RiccatiStep] = []
    try:
        for step in islice(doublings(space.transition, space.process, space.output, space.noise), count):
            if not all(np.isfinite(x).all() for x in (step.transfer, step.information, step.settling)):
                break
            steps.append(step)
    except np.linalg.LinAlgError:  # rounding has made I + G H singular
        pass
    shape = (len(steps), space.size, space.size)
    parts = ([getattr(s, name) for s in steps] for name in ("transfer", "information", "settling"))
    a, g, h = (np.array(part, dtype=np.float64).reshape(shape) for part in parts)
    return a, g, h


def merged(space: StateSpace) -> StateSpace:
    """The same model of the samples with fewer states: those whose dynamics are equal become their sum.

    Random walks are such states: that of K, and the one that stands for the slow end of flicker. No sample tells
    them apart. The sum carries the label of its last part.
    """
    for j in range(space.size - 1, 0, -1):
        twins = [i for i in range(j) if _alike(space, i, j)]
        if twins:
            return merged(_joined(space, twins[0], j))
    return space


def _alike(space: StateSpace, i: int, j: int) -> bool:
    """Both states feed the samples, and the other states, in the same way, and are fed by none."""
    f, others = space.transition, np.ones(space.size, dtype=np.bool_)
    others[[i, j]] = False
    plain = not any(f[k, others].any() for k in (i, j)) and f[i, j] == f[j, i] == 0
    return bool(
        plain
        and f[i, i] == f[j, j]
        and (f[others, i] == f[others, j]).all()
        and space.output[i] == space.output[j]
        and space.rate[i] == space.rate[j]
        and not (space.diffuse[i] or space.diffuse[j])
    )


def _joined(space: StateSpace, i: int, j: int) -> StateSpace:
    """State j becomes the sum of states i and j; state i goes."""
    keep = [k for k in range(space.size) if k != i]
    onto = np.eye(space.size)
    onto[j, i] = 1.0
    take = onto[keep]
    return replace(
        space,
        transition=space.transition[np.ix_(keep, keep)],
        process=take @ space.process @ take.T,
        output=space.output[keep],
        initial=take @ space.initial @ take.T,
        rate=space.rate[keep],
        labels=tuple(space.labels[k] for k in keep),
        diffuse=space.diffuse[keep],
    )


def _driven(space: StateSpace) -> NDArray[np.bool_]:
    """States that process noise reaches, if only through others; what it does not reach keeps no gain."""
    driven = np.diag(space.process) > 0
    for _ in range(space.size):
        driven = driven | (space.transition[:, driven] != 0).any(axis=1)
    return driven


def _doubled(transition: Array, process: Array, output: Array, noise: float) -> Array:
    for before, step in pairwise(islice(doublings(transition, process, output, noise), _STEPS)):
        h = step.settling
        if not np.isfinite(h).all():
            break
        if np.all(np.abs(h - before.settling) <= 1e-15 * np.sqrt(np.outer(np.diag(h), np.diag(h)))):
            return h
    raise FitError(_ENDLESS)
