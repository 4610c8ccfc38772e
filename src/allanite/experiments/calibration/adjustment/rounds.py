# SPDX-License-Identifier: BSD-3-Clause
"""Rounds: fit, add the scatter that is there, hold the Earth to its rate where it is seen, fit again."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.calibration.adjustment.design import SENSITIVITY, Observed, State, linearise
from allanite.experiments.calibration.adjustment.headings import headed_by_earth, with_unknown_headings
from allanite.experiments.calibration.adjustment.scatter import (
    Contrasts,
    ScatterGroup,
    Sizes,
    group_of,
    parameter_dof,
    satterthwaite,
    shift,
    sizes_of,
    upper_variance,
    weighing_covariance,
)
from allanite.experiments.calibration.adjustment.solution import CalibrationSolution, Earth, solve
from allanite.experiments.calibration.adjustment.turning import TurningSamples
from allanite.experiments.calibration.adjustment.weights import DRIFT, GROUPS, TURNS, Weights, groups_of
from allanite.experiments.calibration.results import EarthSeen
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import SCATTER_ALARM
from allanite.recording.calibration import ACCELEROMETER, GYRO

__all__ = [
    "OPEN",
    "RESOLVED",
    "Adjustment",
    "adjust",
    "earth_prior",
    "nominal_of",
    "plausible_of",
    "unknowns_of",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Plausible sizes: of a scale factor (relative), a misalignment [rad], a bias of an accelerometer [m/s^2] and of a
#: gyro [rad/s], a quadratic term [s^2/m], how the bias of a gyro follows the specific force [rad s/m], slopes with
#: temperature [m/s^2/K], [rad/s/K].
PLAUSIBLE = {
    "scale": {ACCELEROMETER: 0.1, GYRO: 0.1},
    "misalignment": {ACCELEROMETER: 0.1, GYRO: 0.1},
    "bias": {ACCELEROMETER: 1.0, GYRO: math.radians(10)},
    "quadratic": {ACCELEROMETER: 1e-3, GYRO: 0.0},
    "gravity_sensitivity": {ACCELEROMETER: 0.0, GYRO: 2e-3},
    "bias_temperature": {ACCELEROMETER: 0.01, GYRO: math.radians(0.1)},
}
#: Standard deviations from which on the Earth's rotation is seen, and below which it is so long as it should be.
RESOLVED, AGREES = 5.0, 4.0
#: Gyros at rest that are left with more than this part of what is not known of the Earth do not see it.
SEEN = 1.0
#: A parameter of which more than this part lies in open directions is assumed.
OPEN = 0.1
#: Biases that follow gravity explain the scatter of the gyros when they leave less than this part of it and nine
#: unknowns without meaning would do so with this probability at most; they are looked for from so many degrees of
#: freedom on.
EXPLAINED, CHANCE, LEAST_DOF = 0.7, 1e-3, 20.0
#: Fewest degrees of freedom of a scatter that tells the noise.
LEAST_TOLD = 0.9
#: What a hand adds to means and turns, to begin with [m/s^2], [rad/s], [rad]: least squares whose residuals are a
#: hundred times as large as their noise do not settle.
HAND = {ACCELEROMETER: 0.01, GYRO: 5e-3, TURNS: 5e-3}
#: Turns of a unit in the hand are widened where chance would make them scatter so in at most this share of cases. Half
#: of all sets of turns scatter a little more than their noise; widened for that, intervals of 95 % hold in 97 %. With
#: this test they hold in 94.5 to 96 %, however large the scatter (`tests/experiments/test_weighing.py`).
HINTED = 0.2
#: Rounds of scatter and fit.
ROUNDS = 4


def _kind(name: str) -> tuple[str, str]:
    sensor, _, rest = name.partition(".")
    return sensor, rest.rpartition("_")[0]


def plausible_of(names: tuple[str, ...]) -> Array:
    """Sizes of parameters beyond which one would not believe them."""
    return np.array([PLAUSIBLE[_kind(n)[1]][_kind(n)[0]] for n in names])


def nominal_of(names: tuple[str, ...]) -> Array:
    """Values of a perfect unit."""
    return np.array([1.0 if _kind(n)[1] == "scale" else 0.0 for n in names])


def earth_prior(levelled: bool, latitude: float | None) -> Earth:
    """What is known of the Earth's rotation before the gyros are asked: its length, and its vertical part by latitude.

    A direction that is unknown gives each component the same variance, which adds up to the square of the length.
    """
    if levelled and latitude is not None:
        down = np.array([0.0, 0.0, -EARTH_RATE * math.sin(latitude)])
        level = EARTH_RATE * math.cos(latitude)
        return Earth(free=np.eye(3)[:, :2], center=down, sd=level / math.sqrt(2))
    return Earth(free=np.eye(3), center=np.zeros(3), sd=EARTH_RATE / math.sqrt(3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Adjustment:
    """The last fit and what led to it.

    Attributes
    ----------
    observed : Observed
        With the specific force among the causes of the gyros' biases where that was needed.
    solution : CalibrationSolution
    weights : Weights
    rows : dict of str to ndarray of int64
    pure : dict of str to ScatterGroup
        Chi-square of each kind of observation under the noise and the scatter of the other kinds.
    kinds : dict of str to (float, int)
        The `shift` of each kind of observation under the noise and all that is beyond it.
    shapes : dict of str to ndarray, shape (r, r)
        Covariance of everything that may be beyond the noise, of unit size.
    sizes : Sizes
        Of what is.
    contrasts : Contrasts or None
        What the sizes were found from; None where nothing was looked for.
    dof : ndarray, shape (p,)
        Of the law of each parameter.
    earth : EarthSeen or None
    """

    observed: Observed
    solution: CalibrationSolution
    weights: Weights
    rows: dict[str, Index]
    pure: dict[str, ScatterGroup]
    kinds: dict[str, tuple[float, int]]
    shapes: dict[str, Array]
    sizes: Sizes
    contrasts: Contrasts | None
    dof: Array
    earth: EarthSeen | None

    @property
    def beyond(self) -> dict[str, float]:
        """Sizes of what is beyond the noise, by name."""
        return self.sizes.values

    @property
    def covariance(self) -> Array:
        """Of the parameters, the errors of the weights included, shape (p, p)."""
        return self.solution.covariance + weighing_covariance(self.solution, self.shapes, self.sizes)

    def upper_variance(self, confidence: float) -> Array:
        """Upper limits of the variance of each parameter over the variance that is stated, shape (p,)."""
        if self.contrasts is None:
            return np.ones(len(self.observed.names))
        return upper_variance(self.solution, self.shapes, self.sizes, self.contrasts, confidence)

    def scatter_dof(self, what: str) -> float:
        """Degrees of freedom of the variance of a usual row of one kind; infinite with nothing beyond the noise."""
        rows = self.rows[what]
        parts = [v**2 * np.diag(self.shapes[n])[rows].mean() for n, v in self.beyond.items()]
        total = np.array([np.diag(self.solution.noise)[rows].mean()])
        return float(satterthwaite(total, np.array(parts).reshape(-1, 1), self.sizes.spread)[0])


def adjust(
    observed: Observed,
    weights: Weights,
    start: State,
    latitude: float | None,
    *,
    sure: bool,
    drift: bool = True,
    in_hand: bool = False,
    noise_known: bool = True,
) -> Adjustment:
    """Fit, widen, fit again; with biases that follow gravity where the gyros at rest show them.

    Parameters
    ----------
    observed, weights, start
    latitude : float or None [rad]
    sure : bool
        The noise models are given. Otherwise a random walk of the biases, which no span shows by itself, is looked for
        even where the residuals do not ask for it.
    drift : bool
        Such a walk may be looked for at all.
    in_hand : bool
        The unit was held: the spans scatter, whatever the noise, and a walk of the biases does not show beside it.
    noise_known : bool
        The noise is known beforehand. Otherwise it is what the spans scatter by.

    Raises
    ------
    DataQualityError
        The noise is not known, and the fit leaves nothing to find it from.
    """
    earth = None
    if observed.triad(GYRO) is not None:
        earth = earth_prior(observed.triads[0].sensor == ACCELEROMETER, latitude)
    walks = {DRIFT[t.sensor] for t in observed.triads}
    drift = drift and not in_hand
    always, never = set() if sure or not drift else walks, set() if drift else walks
    if in_hand:
        weights = weights.with_beyond({name: HAND[name] for name in groups_of(observed)})
        always = set(weights.beyond)
        if (
            earth is not None
        ):  # a hand turns a hundred times as fast: what is not known of the Earth is scatter
            start, earth = replace(start, earth=earth.center), None
        if _affords_gravity(observed):
            state = _fit(observed, weights, start, earth).state
            return _finished(_widened(*_with_gravity(observed, weights, state), earth, always, never), earth)
    if not noise_known:
        weights = weights.with_beyond({name: HAND[name] for name in groups_of(observed)})
        always = always | set(weights.beyond)
        _refuse_untold(observed, _fit(observed, weights, start, None))
    if earth is not None and observed.m == 0 and observed.n > 1:
        return _unheaded(observed, weights, start, earth, always, never)
    plain = _widened(observed, weights, start, earth, always, never)
    asks = plain.pure[GYRO].p < SCATTER_ALARM if GYRO in plain.pure else False
    if not asks or ACCELEROMETER not in plain.rows or plain.pure[GYRO].dof < LEAST_DOF:
        return _finished(plain, earth)
    following = _with_gravity(observed, weights, plain.solution.state)
    extended = _widened(*following, earth, always, never)
    helps = _excess(extended) < EXPLAINED**2 * _excess(plain) and _by_chance(plain, extended) < CHANCE
    return _finished(extended if helps else plain, earth)


def _unheaded(
    observed: Observed, weights: Weights, start: State, earth: Earth, always: set[str], never: set[str]
) -> Adjustment:
    """Positions that no turn links have unknown headings: told by the Earth where it is seen, else in the noise."""
    blind = _widened(
        observed,
        with_unknown_headings(observed, weights, earth, start.attitudes),
        replace(start, earth=earth.center),
        None,
        always,
        never,
    )
    left = blind.solution.residual[blind.rows[GYRO]]
    if float(np.sqrt(np.mean(left**2))) < SEEN * earth.sd:
        adjustment = _finished(_widened(observed, weights, start, earth, always, never), earth)
        if adjustment.solution.converged and adjustment.earth is not None and adjustment.earth.resolved:
            return adjustment
    return _finished(blind, None)


def _refuse_untold(observed: Observed, solution: CalibrationSolution) -> None:
    lacking = [
        name for name, rows in groups_of(observed).items() if group_of(solution, rows).dof < LEAST_TOLD
    ]
    if lacking:
        raise DataQualityError(
            f"the noise of the {' and the '.join(lacking)} is unknown: {plural(observed.n, 'position', 'determine')} "
            "parameters and attitudes, with no degrees of freedom left. Give the noise (--model with --averaging), "
            "columns of standard deviations, or more positions: each adds one degree of freedom of the accelerometers"
        )


def _affords_gravity(observed: Observed) -> bool:
    """Whether gyros at rest and turns outnumber what they determine, sensitivities to gravity included, well enough."""
    unknown = len(observed.gyro.names) + len(SENSITIVITY) + observed.n
    levelled = observed.triads[0].sensor == ACCELEROMETER
    return levelled and len(observed.triads) == 2 and 3 * (observed.n + observed.m) - unknown >= LEAST_DOF


def _with_gravity(observed: Observed, weights: Weights, state: State) -> tuple[Observed, Weights, State]:
    """The same with gyros whose biases follow gravity, from nothing."""
    start = replace(state, values=np.append(state.values, np.zeros(len(SENSITIVITY))))
    return _following_gravity(observed, state), weights, start


def _by_chance(plain: Adjustment, extended: Adjustment) -> float:
    """Probability that unknowns without meaning take so much off the chi-square of the gyros at rest: Fisher's law."""
    from scipy.special import fdtrc

    before, after = plain.pure[GYRO], extended.pure[GYRO]
    spent = before.dof - after.dof
    if not (spent > 0 and after.dof > 0 and after.chi2 > 0):
        return 1.0
    return float(fdtrc(spent, after.dof, (before.chi2 - after.chi2) / spent / (after.chi2 / after.dof)))


def _excess(fit: Adjustment) -> float:
    """Variance of the gyros at rest beyond the noise."""
    rows = fit.rows[GYRO]
    return sum(v**2 * float(np.diag(fit.shapes[n])[rows].mean()) for n, v in fit.beyond.items())


def _following_gravity(observed: Observed, state: State) -> Observed:
    """With gyros that follow gravity; during the turns it is that of the calibrated accelerometers."""
    turning = observed.turning
    if isinstance(turning, TurningSamples) and turning.force is not None:
        errors = observed.triads[0].errors(state.values[observed.place(ACCELEROMETER)])
        turning = replace(turning, force=errors.true(turning.force))
    return replace(observed, triads=(observed.triads[0], observed.gyro.following_gravity), turning=turning)


def _widened(
    observed: Observed, weights: Weights, start: State, earth: Earth | None, always: set[str], never: set[str]
) -> Adjustment:
    """The fit with what its residuals ask for beyond the noise."""
    sought = always & set(HAND)
    certain = sought - {TURNS}  # a hand moves what is meant; a turn is what the gyros see of it
    rows = groups_of(observed)
    solution = _fit(observed, weights, start, earth)
    headed = None if earth is None else headed_by_earth(observed, solution)
    if headed is not None:
        solution = _fit(observed, weights, headed, earth)
    pure = {name: group_of(solution, rows[name]) for name in GROUPS if name in rows}
    sizes, contrasts = Sizes(), None
    shapes = _shapes(observed, weights, solution, rows)
    wanted = (_wanted(pure) | always) - never
    for _ in range(ROUNDS):
        if not wanted:
            break
        before = dict(weights.beyond)
        noise = weights.with_beyond({}).covariance(
            observed, solution.state, linearise(observed, solution.state)
        )
        contrasts = Contrasts.of(noise, solution.residual, unknowns_of(observed, solution, earth))
        sizes = sizes_of(contrasts, {n: s for n, s in shapes.items() if n in wanted}, before, certain)
        beyond = sizes.values
        pure = {n: contrasts.group(rows[n], _sum(shapes, beyond, but=n)) for n in pure}
        unasked = {TURNS} if TURNS in always and pure[TURNS].p >= HINTED else set()
        settled = set(beyond) == set(before) and all(abs(v - before[n]) < 0.05 * v for n, v in beyond.items())
        if settled and not unasked & set(beyond):
            break
        weights = weights.with_beyond(beyond)
        solution = _fit(observed, weights, solution.state, earth)
        shapes = _shapes(observed, weights, solution, rows)
        wanted = (set(beyond) | sought | (_wanted(pure) - wanted - never)) - unasked
    return Adjustment(
        observed=observed,
        solution=solution,
        weights=weights,
        rows=rows,
        pure=pure,
        kinds={},
        shapes=shapes,
        sizes=replace(sizes, values={n: weights.beyond[n] for n in sizes.values}),
        contrasts=contrasts,
        dof=np.zeros(0),
        earth=None,
    )


def _wanted(pure: dict[str, ScatterGroup]) -> set[str]:
    """What the residuals ask for."""
    alarmed = {n for n, g in pure.items() if g.p < SCATTER_ALARM}
    return alarmed | {DRIFT[n] for n in alarmed if n in DRIFT}


def _shapes(
    observed: Observed, weights: Weights, solution: CalibrationSolution, rows: dict[str, Index]
) -> dict[str, Array]:
    """Covariance of everything that may be beyond the noise, of unit size."""
    predicted = linearise(observed, solution.state)
    names = [*rows, *(DRIFT[t.sensor] for t in observed.triads if observed.n > 2)]
    return {name: weights.shape(name, observed, predicted) for name in names}


def _sum(shapes: dict[str, Array], beyond: dict[str, float], but: str = "") -> Array:
    """Covariance of all that is beyond the noise, but for what is of one kind of observation.

    The drift of the gyros is of the turns as much as of the means.
    """
    out = np.zeros_like(next(iter(shapes.values())))
    for name, size in beyond.items():
        if not but or name not in (but, DRIFT.get(GYRO if but == TURNS else but, "")):
            out += size**2 * shapes[name]
    return out


def _fit(observed: Observed, weights: Weights, start: State, earth: Earth | None) -> CalibrationSolution:
    names = observed.names
    return solve(
        observed, weights, start, plausible=plausible_of(names), nominal=nominal_of(names), earth=earth
    )


def _finished(fit: Adjustment, earth: Earth | None) -> Adjustment:
    """With the Earth held to its rate where it is seen, and the laws of the parameters."""
    solution, earth_estimate = fit.solution, None
    if earth is not None:
        earth_estimate = _seen(solution, earth)
        if (
            earth_estimate.resolved
            and abs(earth_estimate.length - earth_estimate.expected) < AGREES * earth_estimate.length_sd
        ):
            solution = _fit(
                fit.observed, fit.weights, solution.state, replace(earth, length=earth_estimate.expected)
            )
    return replace(
        fit,
        solution=solution,
        kinds={name: shift(solution, rows) for name, rows in fit.rows.items()},
        dof=parameter_dof(solution, fit.shapes, fit.sizes),
        earth=earth_estimate,
    )


def unknowns_of(observed: Observed, solution: CalibrationSolution, earth: Earth | None) -> Array:
    """Columns of the design that the observations determine."""
    predicted = linearise(observed, solution.state)
    plausible = plausible_of(observed.names)
    size = len(plausible)
    kept = np.linalg.svd(np.column_stack([solution.open, np.zeros((size, 1))]), full_matrices=True)[0]
    kept = kept[:, solution.open.shape[1] :] if solution.open.shape[1] else np.eye(size)
    free = np.zeros((3, 0)) if earth is None else earth.directions(solution.state.earth)
    table = np.column_stack(
        [predicted.by_value * plausible @ kept, predicted.by_earth @ free, predicted.by_attitude]
    )
    return np.asarray(table[:, np.abs(table).sum(axis=0) > 0])


def _seen(solution: CalibrationSolution, earth: Earth) -> EarthSeen:
    """The part of the Earth's rotation that was looked for, and whether it was found."""
    vector = solution.state.earth
    part = earth.free.T @ vector
    covariance = earth.free.T @ solution.earth_covariance @ earth.free
    length = float(np.linalg.norm(part))
    along = part / length if length > 0 else np.zeros(len(part))
    sd = math.sqrt(max(float(along @ covariance @ along), 0.0))
    widest = math.sqrt(float(np.linalg.eigvalsh(covariance)[-1]))
    expected = earth.sd * math.sqrt(earth.free.shape[1])
    return EarthSeen(
        vector=vector,
        sd=np.sqrt(np.maximum(np.diag(solution.earth_covariance), 0.0)),
        length=length,
        length_sd=sd if length > 0 else widest,
        expected=expected,
        resolved=length > RESOLVED * widest and expected > RESOLVED * widest,
    )
