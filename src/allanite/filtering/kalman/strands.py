# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood of a long record in strands, stretches that are filtered side by side, joined without approximation.

Each row of a filter waits for the row before it, and most of a processor waits with it. Stretches of the record do not
wait for one another if each begins with a guess `a` of its first state, as if that were certain, and carries along what
an error `d` of the guess does [1]. With the sums over its innovations v and the effects E of the error on them,

    q = sum of v v/S,   s = sum of E v/S,   M = sum of E E'/S,

and the prediction N(m, P), P = L L', that the rows before the strand make for its first one,

    d ~ N(m - a, P),   W = I + L' M L,   g = s - M (m - a),   r = W^-1/2 L' g,

    -2 ln likelihood = sum of ln S + ln det W + q - (m - a)' (s + g) - r' r,

and given the samples of the strand d has the mean m - a + L W^-1/2 r and the covariance L W^-1 L', from which the
prediction for the row after the last follows. P need not be regular.

References
----------
.. [1] P. de Jong, "The diffuse Kalman filter", Annals of Statistics 19 (1991), 1073-1083.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.lazy_dataclasses import dataclass
from allanite.noise import StateSpace

__all__ = ["MOST_STATES", "Joined", "Rows", "Strand", "joined", "product", "run_strands"]

Array = NDArray[np.float64]
#: Samples, outputs (1 or rows, n) and noise (1 or rows,) from one row to another.
Rows = Callable[[int, int], tuple[Array, Array, Array]]

#: Models with more states are filtered row by row.
MOST_STATES = 4
#: Strands that one call of the kernel takes.
LANES = 4
#: However many processors there are: the digits of the result must not depend on that.
N_STRANDS = 16
#: Rows of each strand in one call.
BLOCK = 1 << 15
#: How many times larger than their sum terms may be, or digits are lost: of the squares (the guess was bad), and of W
#: (two states are as good as one for all that was seen before the strand, and not in it).
MOST_SQUARES, MOST_TERMS = 100.0, 1e4
#: The least pivot of W, as a part of its diagonal, for the same reason.
LEAST_PIVOT = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class Strand:
    """What one strand found out."""

    rows: int
    guess: Array  # (n,) of its first state
    state: Array  # (n,) prediction for the row after it, if the guess is right
    covariance: Array  # (n, n) of that, or its factors
    effects: Array  # (n, n) of an error of the guess on it
    squares: float  # q
    cross: Array  # (n,) s
    information: Array  # (n, n) M
    variances: tuple[float, int]  # mantissa and exponent of the product of S
    count: int  # innovations


@dataclass(frozen=True, slots=True, kw_only=True)
class Joined:
    """A strand, once the prediction for its first row is known."""

    state: Array  # (n,) prediction for the row after it
    covariance: Array  # (n, n) of that, or its factors
    squares: float  # sum of v v/S of the filter
    variances: tuple[float, int]  # mantissa and exponent of the product of S
    count: int


# -- side by side ----------------------------------------------------------------------------------------------


def run_strands(
    space: StateSpace,
    state: Array,
    rows: Rows,
    *,
    start: int,
    stop: int,
    square_root: bool,
    threads: int | None = None,
) -> list[Strand]:
    """Strands of equal length, one after the other from row `start` on, where `state` is predicted, until near `stop`.

    Fewer, if the next one has a row that only a filter that goes row by row can treat.
    """
    length = (stop - start) // N_STRANDS
    guesses = _guesses(space.transition, state, length) if length > 0 else None
    if guesses is None:
        return []

    def run(group: int) -> list[Strand]:
        """Four strands, from the one with this number on."""
        begin = start + length * group
        return _four_strands(space, guesses[group : group + LANES], rows, begin, length, square_root)

    strands: list[Strand] = []
    with ThreadPoolExecutor(threads or _processors()) as pool:
        for four in pool.map(run, range(0, N_STRANDS, LANES)):
            if not four:
                break
            strands += four
    return strands


def _processors() -> int:
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


def _guesses(transition: Array, state: Array, length: int) -> Array | None:
    """The state at the first row of each strand as it is predicted from what is known of the first."""
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.linalg.matrix_power(transition, length)
        guesses = [state]
        for _ in range(N_STRANDS - 1):
            guesses.append(step @ guesses[-1])
    stacked = np.array(guesses)
    return stacked if np.isfinite(stacked).all() else None


def _four_strands(
    space: StateSpace, guesses: Array, rows: Rows, start: int, length: int, square_root: bool
) -> list[Strand]:
    """Strands from row `start` on; none if one of them cannot go to its end."""
    n = space.size
    sizes = np.cumsum([n, n * n, n * n, (n + 1) ** 2, 1])
    numbers, counters = np.zeros((sizes[-1], LANES)), np.zeros(2 * LANES, dtype=np.int64)
    state, covariance, effects, moments, mantissa = np.split(numbers, sizes[:-1])
    state[:], effects[:: n + 1], mantissa[:] = guesses.T, 1.0, 1.0
    for begin in range(0, length, BLOCK):
        stop = min(begin + BLOCK, length)
        firsts = range(start, start + LANES * length, length)
        y, outputs, noise = zip(*(rows(first + begin, first + stop) for first in firsts), strict=True)
        if not _kernels.kalman_strands(
            space.transition, space.process, outputs, noise, y, numbers, counters, square_root
        ):
            return []
    sums = moments.reshape(n + 1, n + 1, LANES)
    return [
        Strand(
            rows=length,
            guess=guesses[k],
            state=state[:, k],
            covariance=covariance[:, k].reshape(n, n),
            effects=effects[:, k].reshape(n, n).T,
            squares=float(sums[0, 0, k]),
            cross=sums[0, 1:, k],
            information=np.triu(sums[1:, 1:, k]) + np.triu(sums[1:, 1:, k], 1).T,
            variances=(float(mantissa[0, k]), int(counters[k])),
            count=int(counters[LANES + k]),
        )
        for k in range(LANES)
    ]


# -- and one after the other -----------------------------------------------------------------------------------


def joined(strand: Strand, state: Array, covariance: Array, *, square_root: bool) -> Joined | None:
    """The strand after a prediction of its first state; None where too many digits would be lost.

    `covariance` is that of the prediction; for the square-root form its factors, and so it is in the result.
    """
    factors = covariance.copy()
    if not (square_root or _kernels.kalman_factor(factors)):
        return None
    root = _root(factors)
    error = state - strand.guess
    gradient = strand.cross - strand.information @ error
    weight = np.eye(len(root)) + root.T @ strand.information @ root
    terms = np.abs(root).T @ np.abs(strand.information) @ np.abs(root)
    if (np.diag(terms) > MOST_TERMS * np.diag(weight)).any():
        return None
    lower = _triangle(weight)
    if lower is None:
        return None
    spread = np.linalg.solve(lower, root.T)  # (L W^-1/2)'
    shift = spread @ gradient
    squares = strand.squares - float(error @ (strand.cross + gradient)) - float(shift @ shift)
    if not strand.squares <= MOST_SQUARES * max(strand.count, squares):
        return None
    effects = strand.effects @ spread.T
    pivots = np.diag(lower)
    return Joined(
        state=strand.state + strand.effects @ error + effects @ shift,
        covariance=_plus(strand.covariance, effects, square_root),
        squares=squares,
        variances=product(*strand.variances, *pivots, *pivots),
        count=strand.count,
    )


def _triangle(weight: Array) -> Array | None:
    """Lower triangular root of W; None where its digits would not hold."""
    if not np.isfinite(weight).all():
        return None
    try:
        lower = np.linalg.cholesky(weight)
    except np.linalg.LinAlgError:
        return None
    if (np.diag(lower) ** 2 < LEAST_PIVOT * np.diag(weight)).any():
        return None
    return np.asarray(lower, dtype=np.float64)


def product(mantissa: float, exponent: int, *factors: float) -> tuple[float, int]:
    """A product of positive numbers of any size as a mantissa from 0.5 to 1 and a power of two."""
    for factor in (1.0, *factors):
        part, digits = math.frexp(factor)
        mantissa, carry = math.frexp(mantissa * part)
        exponent += digits + carry
    return mantissa, exponent


def _root(factors: Array) -> Array:
    """U D^1/2 of the factors of U D U'."""
    unit = np.triu(factors, 1) + np.eye(len(factors))
    return np.asarray(unit * np.sqrt(np.diag(factors)))


def _plus(covariance: Array, effects: Array, square_root: bool) -> Array:
    """P + B B', both halves with the same digits; or the factors of it from those of P, which lose none."""
    if not square_root:
        more = effects @ effects.T
        return np.asarray(covariance + (more + more.T) / 2)
    rows, factors = np.hstack([_root(covariance), effects]), np.zeros_like(covariance)
    for j in range(len(rows) - 1, -1, -1):  # Gram-Schmidt, from below
        square = float(rows[j] @ rows[j])
        factors[j, j] = square
        if square > 0.0:
            factors[:j, j] = rows[:j] @ rows[j] / square
            rows[:j] -= factors[:j, j, None] * rows[j]
    return factors
