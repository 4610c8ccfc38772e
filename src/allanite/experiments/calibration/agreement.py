# SPDX-License-Identifier: BSD-3-Clause
"""Do the accelerometers alone say the same of themselves as together with the gyros?

Alone they know gravity by its length; together with the gyros also by its direction, which the turns carry from one
rest to the next. Rests that are not rests, a wrong axis, or clocks that differ set the two apart. Both solutions have
the same noise and scatter of the accelerometers, so what the second knows more is independent of the first, and the
covariance of their difference is that of the first less that of the second [1]. Both are linear about the second: few
rests determine some combinations of parameters so loosely that the accelerometers alone would end far from it, where
they determine other combinations, and the difference of the covariances has no meaning.

References
----------
.. [1] J. A. Hausman, "Specification tests in econometrics", Econometrica 46 (1978) 1251, section 2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment import Adjustment, plausible_of
from allanite.experiments.calibration.adjustment.design import Observed, State
from allanite.experiments.calibration.adjustment.solution import CalibrationSolution, covariance_at
from allanite.experiments.calibration.adjustment.turning import constant_rate_turns
from allanite.experiments.calibration.adjustment.weights import DRIFT, Weights
from allanite.experiments.calibration.checks import CalibrationCheck
from allanite.experiments.calibration.verdict import CalibrationCheckKind
from allanite.recording.calibration import ACCELEROMETER

__all__ = ["alone_and_together"]

Array = NDArray[np.float64]

#: Sound records that are called contradictory.
ALARM = 1e-3
#: Of a combination of parameters the gyros take away this part of the variance at least: less is rounding, and makes
#: the check milder. It counts where the accelerometers alone know it better than to this part of its plausible size.
TOLD, KNOWN = 0.05, 0.1
#: Variances below this part of the largest are rounding, as of a table whose rows repeat without any scatter.
ROUNDING = 1e-14


def alone_and_together(fit: Adjustment) -> CalibrationCheck | None:
    """The check; None where the accelerometers alone determine nothing, or there are no gyros."""
    if len(fit.observed.triads) < 2 or ACCELEROMETER not in fit.rows:
        return None
    alone = _alone(fit)
    place = fit.observed.place(ACCELEROMETER)
    plausible = plausible_of(fit.observed.names)[place]
    first = alone.covariance / np.outer(plausible, plausible)
    second = fit.solution.covariance[place, place] / np.outer(plausible, plausible)
    apart = alone.gain @ alone.residual / plausible
    values, vectors = np.linalg.eigh(first)
    known = (values < KNOWN**2) & (values > ROUNDING * values[-1])
    if not known.any():
        return None
    white = vectors[:, known] / np.sqrt(values[known])
    gained, turned = np.linalg.eigh(np.eye(int(known.sum())) - white.T @ second @ white)
    z = (turned.T @ (white.T @ apart)) / np.sqrt(np.maximum(gained, TOLD))
    chi2, dof = float(z @ z), len(z)
    p = _tail(chi2, dof, fit.scatter_dof(ACCELEROMETER))
    sds = np.abs(apart) / np.sqrt(np.maximum(np.diag(first), 1e-300))
    return CalibrationCheck(
        kind=CalibrationCheckKind.ALONE,
        statistic=_same_chance(p, dof),
        dof=dof,
        p=p,
        passed=p >= ALARM,
        parameter=fit.observed.names[place][int(np.argmax(sds))].partition(".")[2],
    )


def _alone(fit: Adjustment) -> CalibrationSolution:
    """The accelerometers without the gyros about the same state, with the noise and scatter that they have together."""
    observed, weights, state = fit.observed, fit.weights, fit.solution.state
    none = np.zeros(0, dtype=np.int64)
    force = Observed(
        triads=observed.triads[:1],
        means={ACCELEROMETER: observed.means[ACCELEROMETER]},
        warmer=observed.warmer,
        before=none,
        after=none,
        seconds=np.zeros(0),
        turning=constant_rate_turns(np.zeros((0, 3)), np.zeros(0)),
        gravity=observed.gravity,
    )
    beyond = {n: v for n, v in weights.beyond.items() if n in (ACCELEROMETER, DRIFT[ACCELEROMETER])}
    accelerometer_weights = Weights(
        at_rest={ACCELEROMETER: weights.at_rest[ACCELEROMETER]},
        slow=np.zeros((3, 0, 0)),
        density=np.zeros(3),
        angle=np.zeros((0, 3)),
        walk={ACCELEROMETER: weights.walk[ACCELEROMETER]},
        beyond=beyond,
        relative=weights.relative,
    )
    same = State(
        values=state.values[observed.place(ACCELEROMETER)], attitudes=state.attitudes, earth=np.zeros(3)
    )
    return covariance_at(force, accelerometer_weights, same, plausible=plausible_of(force.names), earth=None)


def _same_chance(p: float, dof: int) -> float:
    """The chi-square that comes with this probability: p is of an F law where the scatter is an estimate."""
    from scipy.special import chdtri

    return float(chdtri(dof, max(p, 1e-300)))


def _tail(chi2: float, dof: int, scatter_dof: float) -> float:
    from scipy.special import chdtrc, fdtrc

    if math.isinf(scatter_dof):
        return float(chdtrc(dof, chi2))
    return float(fdtrc(dof, scatter_dof, chi2 / dof))
