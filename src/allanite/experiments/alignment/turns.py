# SPDX-License-Identifier: BSD-3-Clause
"""The rotation between two stretches at rest, by integrating the calibrated gyros, and how it depends on them.

An error dw(t) of the calibrated rate adds the rotation vector, in the axes of the sensor before the turn,

    integral of P(t) dw(t) dt,    P(t) from the sensor at t to the sensor before the turn.

With another matrix M' and bias b' in place of M and b the rate is M'^-1 (M w + b - b'), so two sums over the turn hold
all first derivatives: that of P, and that of P (x) w; of gyros that follow gravity also that of P (x) f, f being the
specific force.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.span_means import span_covariance
from allanite.quantities.attitude import accumulated, rotation, with_coning
from allanite.recording.calibration import TriadErrors
from allanite.recording.records import Recording, Sampling

__all__ = ["Force", "StandTurn", "calibrated", "turn_noise", "turn_of", "turns_between"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]
#: The true specific force in the axes of the body, of samples from one to another, shape (n, 3).
Force = Callable[[int, int], Array]

#: Missing samples that last no longer are bridged by a straight line [s].
HOLE = 0.05
#: A turn that lost samples was none if the known ones stay below this [rad/s].
STILL = math.radians(0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class StandTurn:
    """From one stretch at rest to the next.

    Attributes
    ----------
    duration : float [s]
    matrix : ndarray, shape (3, 3)
        From the sensor after it to the sensor before it, both in inertial space.
    sweep : ndarray, shape (3, 3) [s]
        Integral of P.
    moment : ndarray, shape (3, 3, 3) [rad]
        Integral of P_il w_m.
    shares : ndarray, shape (3, 3, 3)
        Of each axis of the sensor, the mean of P_ai P_bi: how it lay during the turn.
    size : float [rad]
        Angle of the turn.
    known : bool
        False where samples are missing in it.
    still : bool
        Nothing turned as far as the samples tell.
    force : ndarray, shape (3, 3, 3) [m/s]
        Integral of P_il f_m; zero where the gyros do not follow gravity.
    stated : float [rad]
        By how much the heading changed, as the caller says of a turn that no gyro saw; NaN of any other.
    stated_sd : float [rad]
        Standard uncertainty of either heading.
    """

    duration: float
    matrix: Array = field(repr=False)
    sweep: Array = field(repr=False)
    moment: Array = field(repr=False)
    shares: Array = field(repr=False)
    size: float
    known: bool = True
    still: bool = False
    force: Array = field(default_factory=lambda: np.zeros((3, 3, 3)), repr=False)
    stated: float = math.nan
    stated_sd: float = 0.0

    def under(self, change: Array, shift: Array) -> Array:
        """The matrix with the rate w replaced by w + change w + shift."""
        vector = np.einsum("ilm,lm->i", self.moment, change) + self.sweep @ shift
        return np.asarray(rotation(vector) @ self.matrix)


def calibrated(
    recording: Recording,
    channels: Sequence[str],
    errors: TriadErrors,
    start: int,
    stop: int,
    warmer: tuple[str, float, Array] | None = None,
    force: Force | None = None,
) -> Array:
    """Samples as true vectors in the axes of the body, shape (n, 3), NaN where missing; `force` for gyros."""
    readings = np.stack([recording.scaled(name, start, stop) for name in channels], axis=1)
    if warmer is not None:
        name, reference, slope = warmer
        readings = readings - (recording.scaled(name, start, stop)[:, None] - reference) * slope
    needed = force is not None and errors.gravity_sensitivity.any()
    return errors.true(readings, force=force(start, stop) if needed else None)  # type: ignore[misc]


def turns_between(
    recording: Recording,
    channels: Sequence[str],
    errors: TriadErrors,
    spans: Index,
    warmer: tuple[str, float, Array] | None = None,
    force: Force | None = None,
) -> tuple[StandTurn, ...]:
    """The turns between stretches at rest, one less than these."""
    followed = force if errors.gravity_sensitivity.any() else None

    def turn(a: int, b: int) -> StandTurn:
        rate = calibrated(recording, channels, errors, a, b, warmer, followed)
        return turn_of(rate, 1 / recording.rate, None if followed is None else followed(a, b))

    return tuple(turn(a, b) for a, b in zip(spans[:-1, 1].tolist(), spans[1:, 0].tolist(), strict=True))


def turn_of(rate: Array, dt: float, force: Array | None = None) -> StandTurn:
    """The turn of samples of the calibrated rate, shape (n, 3), at interval dt [s]."""
    duration = len(rate) * dt
    missing = np.asarray(np.isnan(rate).any(axis=1))
    if missing.any():
        known = rate[~missing]
        still = bool(len(known) == 0 or np.abs(known).max() < STILL)
        if still or _longest(missing) * dt > HOLE:
            return standing(duration, still=still)
        rate = _bridged(rate, missing)
    steps = rate * dt
    path = accumulated(with_coning(steps))
    middle = path[:-1] @ rotation(0.5 * steps)
    matrix = path[-1]
    return StandTurn(
        duration=duration,
        matrix=matrix,
        sweep=middle.sum(axis=0) * dt,
        moment=np.einsum("kil,km->ilm", middle, rate) * dt,
        force=np.zeros((3, 3, 3))
        if force is None
        else np.einsum("kil,km->ilm", middle, np.nan_to_num(force)) * dt,
        shares=np.einsum("kai,kbi->iab", middle, middle) / max(len(middle), 1),
        size=math.acos(min(max((float(np.trace(matrix)) - 1) / 2, -1.0), 1.0)),
    )


def standing(duration: float, *, still: bool) -> StandTurn:
    """A turn of which the gyros say nothing."""
    return StandTurn(
        duration=duration, matrix=np.eye(3), sweep=np.zeros((3, 3)), moment=np.zeros((3, 3, 3)),
        shares=np.zeros((3, 3, 3)), size=math.nan, known=False, still=still,
    )  # fmt: skip


def _longest(mask: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0])))).reshape(-1, 2)
    return int(np.diff(edges, axis=1).max(initial=0))


def _bridged(rate: Array, missing: NDArray[np.bool_]) -> Array:
    at = np.arange(len(rate))
    return np.stack([np.interp(at, at[~missing], column[~missing]) for column in rate.T], axis=1)


def turn_noise(
    turn: StandTurn,
    up: Array,
    before: Index,
    after: Index,
    models: Sequence[NoiseModel],
    dt: float,
    sampling: Sampling,
) -> float:
    """Variance of the azimuth of a turn by the noise of the gyros [rad^2].

    The turn is measured against the rest on both sides of it, where the biases come from.

    Parameters
    ----------
    up : ndarray, shape (3,)
        Upwards, in the axes of the sensor before the turn.
    before, after : ndarray of int64, shape (2,) [samples]
        The stretches at rest.
    """
    if not turn.duration > 0:
        return 0.0
    start = np.array([before[1], before[0], after[0]], dtype=np.float64)
    stop = np.array([after[0], before[1], after[1]], dtype=np.float64)
    contrast = np.array([1.0, -0.5, -0.5])
    share = np.einsum("iab,a,b->i", turn.shares, up, up)  # how the vertical lay
    total = 0.0
    for model, part in zip(models, share, strict=True):
        covariance = span_covariance(model, start, stop, stop - start, dt=dt, sampling=sampling)
        total += part * float(contrast @ covariance @ contrast)
    return total * turn.duration**2
