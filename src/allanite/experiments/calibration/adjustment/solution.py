# SPDX-License-Identifier: BSD-3-Clause
"""Nonlinear least squares of all unknowns together, with the directions that the observations leave open.

Attitudes and the Earth are projected out of the whitened design, and what is left of the columns of the parameters,
each times its plausible size, is decomposed by singular values. A direction that the observations determine no better
than to its plausible size is open: it stays at the nominal value, its plausible variance enters the covariance, and
because singular directions are independent it disturbs nothing that is determined.
"""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment.design import Observed, Predicted, State, linearise
from allanite.experiments.calibration.adjustment.weights import Weights
from allanite.lazy_dataclasses import dataclass
from allanite.recording.calibration import ACCELEROMETER

__all__ = ["CalibrationSolution", "Earth", "covariance_at", "decompose", "solve"]

Array = NDArray[np.float64]

#: Steps of Gauss and Newton at most; halvings of a step that makes matters worse, in the second half of them.
STEPS, HALVINGS = 40, 8
#: From this step on the number of directions that are determined stays.
SETTLED = 6
#: Converged when no parameter moves by more than this of its standard deviation, or of its plausible size.
CLOSE, EXACT = 1e-3, 1e-13
#: After `PATIENT` steps, where a heading that next to nothing determines creeps along a flat valley: converged also
#: when no parameter moves by more than this of its standard deviation and chi-square falls by less than this.
NEAR, FLAT, PATIENT = 1e-2, 1e-3, 8
#: Longest step: of a parameter in plausible sizes, of an attitude [rad].
LONGEST, TURN = 5.0, 0.5
#: Singular values below this part of the largest are rounding.
RANK = 1e-11
#: Attitudes are known to this before anything is measured [rad]; it steadies headings that nothing determines.
ATTITUDE = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Earth:
    """What is known of the Earth's rotation in the level frame.

    Attributes
    ----------
    free : ndarray, shape (3, k)
        Orthonormal directions in which it may change.
    center : ndarray, shape (3,) [rad/s]
    sd : float [rad/s]
        Of each free direction about the centre.
    length : float or None [rad/s]
        Of the part in the free directions, where it is held to the known one.
    """

    free: Array
    center: Array
    sd: float
    length: float | None = None

    def directions(self, earth: Array) -> Array:
        """In which it may change at this value, shape (3, k)."""
        if self.length is None:
            return self.free
        part = self.free.T @ earth
        full = np.linalg.svd(part[None] / np.linalg.norm(part))[2]
        return np.asarray(self.free @ full[1:].T)

    def held(self, earth: Array) -> Array:
        """The nearest value that is allowed."""
        part = self.free.T @ (earth - self.center)
        size = 1.0 if self.length is None else self.length / float(np.linalg.norm(part))
        return np.asarray(self.center + self.free @ (part * size))

    def rows(self, earth: Array) -> tuple[Array, Array]:
        """Prior as further observations of steps in `directions`: design (k, k) and residual (k,)."""
        k = self.directions(earth).shape[1]
        if self.length is not None:
            return np.eye(k) / (ATTITUDE * self.length), np.zeros(k)
        return np.eye(k) / self.sd, self.free.T @ (self.center - earth) / self.sd


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationSolution:
    """A state with the smallest sum of squares, and the linear algebra there.

    Attributes
    ----------
    state : State
    covariance : ndarray, shape (p, p)
        Of the values; plausible variance in the open directions.
    open : ndarray, shape (p, q)
        Orthonormal open directions, in plausible sizes.
    residual : ndarray, shape (r,)
        Of the observations.
    gain : ndarray, shape (p, r)
        Derivatives of the values by the observations.
    projector : ndarray, shape (r, r)
        P with P residual = V^-1 residual, and P = V^-1 less what the unknowns take up.
    noise : ndarray, shape (r, r)
        V.
    earth_covariance : ndarray, shape (3, 3)
    heading_sd : ndarray, shape (n,) [rad]
    iterations : int
    converged : bool
    """

    state: State
    covariance: Array
    open: Array
    residual: Array = field(repr=False)
    gain: Array = field(repr=False)
    projector: Array = field(repr=False)
    noise: Array = field(repr=False)
    earth_covariance: Array
    heading_sd: Array
    iterations: int
    converged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Decomposed:
    """The whitened design in parts."""

    q: Array
    r: Array
    mixed: Array
    left: Array
    values: Array
    right: Array
    determined: NDArray[np.bool_]


def decompose(by_value: Array, nuisance: Array, count: int | None = None) -> Decomposed:
    """Parts of a whitened design: nuisance projected out, singular values of the parameters in plausible sizes.

    `count` of the directions are determined; without it, those seen to better than their plausible size.
    """
    q, r = np.linalg.qr(nuisance)
    mixed = q.T @ by_value
    rest = by_value - q @ mixed
    left, values, right = np.linalg.svd(rest, full_matrices=False)
    if len(values) < by_value.shape[1]:  # fewer observations than parameters
        right = np.linalg.svd(rest, full_matrices=True)[2]
        missing = by_value.shape[1] - len(values)
        left, values = np.pad(left, ((0, 0), (0, missing))), np.pad(values, (0, missing))
    largest = np.linalg.norm(by_value, axis=0).max() if by_value.size else 0.0
    return Decomposed(
        q=q,
        r=r,
        mixed=mixed,
        left=left,
        values=values,
        right=right,
        determined=values > max(1.0, RANK * largest) if count is None else np.arange(len(values)) < count,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _WhitenedProblem:
    """The whitened linear problem at a state."""

    parts: Decomposed
    residual: Array
    half: Array
    earth: Array
    free: NDArray[np.bool_]
    rows: int

    @property
    def cost(self) -> float:
        return float(self.residual @ self.residual)


def _system(
    observed: Observed,
    state: State,
    predicted: Predicted,
    whitener: Array,
    plausible: Array,
    earth: Earth | None,
    fixed: NDArray[np.bool_],
    count: int | None = None,
) -> _WhitenedProblem:
    rows = len(predicted.residual)
    directions = np.zeros((3, 0)) if earth is None else earth.directions(state.earth)
    attitudes = predicted.by_attitude[:, ~fixed]
    table = np.column_stack(
        [predicted.by_value * plausible, predicted.by_earth @ directions, attitudes, predicted.residual]
    )
    white = whitener @ table
    p, k, a = len(plausible), directions.shape[1], attitudes.shape[1]
    prior = np.zeros((k + a, p + k + a + 1))
    if earth is not None:
        design, short = earth.rows(state.earth)
        prior[:k, p : p + k], prior[:k, -1] = design, short
    prior[k:, p + k : -1] = np.eye(a) / ATTITUDE
    full = np.vstack([white, prior])
    parts = decompose(full[:, :p], full[:, p:-1], count)
    return _WhitenedProblem(
        parts=parts, residual=full[:, -1], half=plausible, earth=directions, free=~fixed, rows=rows
    )


def _step(system: _WhitenedProblem, offset: Array) -> tuple[Array, Array, Array]:
    """Change of the values, of the Earth and of the attitudes (n, 3). `offset` is values less nominal."""
    d, p = system.parts, system.half
    safe = np.where(d.determined, d.values, 1.0)
    inside = np.where(d.determined, d.left.T @ system.residual / safe, -(d.right @ (offset / p)))
    values = d.right.T @ inside
    rest = d.q.T @ system.residual - d.mixed @ values
    nuisance = np.linalg.solve(d.r, rest)
    k = system.earth.shape[1]
    turns = np.zeros(len(system.free))
    turns[system.free] = nuisance[k:]
    return values * p, system.earth @ nuisance[:k], turns.reshape(-1, 3)


def solve(
    observed: Observed,
    weights: Weights,
    start: State,
    *,
    plausible: Array,
    nominal: Array,
    earth: Earth | None,
) -> CalibrationSolution:
    """The unknowns that fit best.

    Parameters
    ----------
    observed : Observed
    weights : Weights
    start : State
    plausible, nominal : ndarray, shape (p,)
        Sizes of the parameters, and the values of those that stay open.
    earth : Earth or None
        None without gyros.
    """
    fixed = _fixed(observed)
    state = start if earth is None else replace(start, earth=earth.held(start.earth))
    predicted = linearise(observed, state)
    whitener = _whitener(weights, observed, state, predicted)
    system = _system(observed, state, predicted, whitener, plausible, earth, fixed)
    converged, count = False, 0
    directions: int | None = None
    while not converged and count < STEPS:
        count += 1
        change = _step(system, state.values - nominal)
        length = _length(change, plausible)
        small = _small(change[0], system, plausible)
        for _ in range(HALVINGS):
            moved = _held(state.moved(*(length * c for c in change)), earth)
            predicted = linearise(observed, moved)
            trial = _system(observed, moved, predicted, whitener, plausible, earth, fixed, directions)
            # the valley of what is hardly determined is bent: a whole step leaves it, and the next one comes back
            # deeper; only where that fails are steps held to its floor
            if count <= STEPS // 2 or small or trial.cost <= system.cost * (1 + 1e-9):
                break
            length /= 2
        if count > PATIENT and abs(trial.cost - system.cost) < FLAT:
            small = _small(change[0], system, plausible, NEAR)
        state, system, converged = moved, trial, small and length == 1
        if count in (2, 4):  # white noise of a turn, in the axes that the calibration makes of it
            whitener = _whitener(weights, observed, state, predicted)
            system = _system(observed, state, predicted, whitener, plausible, earth, fixed)
        if count == SETTLED:  # a direction on the border must not change sides for ever
            directions = int(system.parts.determined.sum())
    return _told(state, system, whitener, predicted, count, converged)


def covariance_at(
    observed: Observed, weights: Weights, state: State, *, plausible: Array, earth: Earth | None
) -> CalibrationSolution:
    """What `solve` would know if it ended in this state, without a step."""
    predicted = linearise(observed, state)
    whitener = _whitener(weights, observed, state, predicted)
    system = _system(observed, state, predicted, whitener, plausible, earth, _fixed(observed))
    return _told(state, system, whitener, predicted, 0, True)


def _whitener(weights: Weights, observed: Observed, state: State, predicted: Predicted) -> Array:
    """Inverse of the Cholesky factor of the noise."""
    factor = np.linalg.cholesky(weights.covariance(observed, state, predicted))
    return np.asarray(np.linalg.inv(factor))


def _fixed(observed: Observed) -> NDArray[np.bool_]:
    """Attitudes that are so by definition."""
    fixed = np.zeros(3 * observed.n, dtype=np.bool_)
    levelled = observed.triads[0].sensor == ACCELEROMETER
    fixed[slice(2, 3) if levelled else slice(0, 3)] = True
    return fixed


def _held(state: State, earth: Earth | None) -> State:
    return state if earth is None else replace(state, earth=earth.held(state.earth))


def _length(change: tuple[Array, Array, Array], plausible: Array) -> float:
    longest = max(float(np.abs(change[0] / plausible).max()) / LONGEST, float(np.abs(change[2]).max()) / TURN)
    return 1.0 if longest <= 1 else 1 / longest


def _small(values: Array, system: _WhitenedProblem, plausible: Array, close: float = CLOSE) -> bool:
    d = system.parts
    along = np.abs(d.right @ (values / plausible))
    return bool(np.all((along * d.values < close) | (along < EXACT)))


def _told(
    state: State, system: _WhitenedProblem, inverse: Array, predicted: Predicted, count: int, converged: bool
) -> CalibrationSolution:
    d, p, rows = system.parts, system.half, system.rows
    kept = d.right[d.determined] * p
    half = kept.T / d.values[d.determined]
    open_ = d.right[~d.determined].T
    taken = np.column_stack([d.q, d.left[:, d.determined]])[:rows]
    back = inverse.T @ taken
    nuisance = np.linalg.inv(d.r)
    through = nuisance @ d.mixed
    spread = nuisance @ nuisance.T + through @ _inner(d) @ through.T
    factor = np.linalg.inv(inverse)
    k = system.earth.shape[1]
    headings = np.zeros(len(system.free))
    headings[system.free] = np.sqrt(np.diag(spread)[k:])
    return CalibrationSolution(
        state=state,
        covariance=half @ half.T + (open_ * p[:, None]) @ (open_ * p[:, None]).T,
        open=open_,
        residual=predicted.residual,
        gain=half @ (d.left[:rows, d.determined].T @ inverse),
        projector=inverse.T @ inverse - back @ back.T,
        noise=factor @ factor.T,
        earth_covariance=system.earth @ spread[:k, :k] @ system.earth.T,
        heading_sd=headings[2::3],
        iterations=count,
        converged=converged,
    )


def _inner(d: Decomposed) -> Array:
    """Covariance of the values in plausible sizes."""
    variance = np.where(d.determined, 1 / np.where(d.determined, d.values, 1.0) ** 2, 1.0)
    return np.asarray((d.right.T * variance) @ d.right)
