# SPDX-License-Identifier: BSD-3-Clause
"""How well a population explains the logs of a fleet.

The logarithm x of a coefficient in log r of unit u from lot j is

    x_r = z_r' beta + l_j + b_u + e_r,   l_j ~ N(0, tau_lot^2),  e_r ~ N(0, tau_repeat^2),
    b_u ~ (1 - s) N(0, tau_unit^2) + s N(0, (w tau_unit)^2),  w = 5,                                         (1)

and the log says exp(-S_r(x_r)^2 / 2) of it, an upper limit included. Straight roots are normal densities. A bent one is
replaced by the normal factor that gives x_r the same mass, mean and variance beside what all other logs say of it [1],
apart for each of the two parts; for a unit with one log that is exact. Repeats and units are then integrated in closed
form; beta and the lots by the method of Laplace, so that the evidence is that of the scales alone (restricted
likelihood).

A factor is kept in its natural form, exp(k + h x - t x^2 / 2), in arrays with a row for each part. With the repeats
integrated,

    t' = t / (1 + t tau^2),  h' = h / (1 + t tau^2),
    k' = k + (tau^2 h^2 / (1 + t tau^2) - ln(1 + t tau^2)) / 2,                                              (2)

and a unit whose logs lie at o_r = z_r' beta + l_j adds, with W = sum t', B = sum h' - t' o and
g_i = tau_i^2 / (1 + W tau_i^2) for its parts i,

    ln sum_i s_i exp(sum_r (k' + h' o - t' o^2 / 2) + g_i B^2 / 2) / sqrt(1 + W tau_i^2).                    (3)

References
----------
.. [1] T. Minka, "Expectation propagation for approximate Bayesian inference", UAI 17 (2001) 362.
"""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.stability.fleet.profile_table import ProfileTable

__all__ = ["Design", "Factors", "ScaleEvidence", "Scales", "evidence"]

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: A unit of the wide part spreads so many times as much as the others.
WIDE = 5.0
_ROUNDS, _SETTLED = 18, 1e-2
_NEWTON, _FEW, _STEP, _GAIN, _LONGEST = 30, 2, 1e-4, 1e-7, 1.0
_GROWTH, _MOST = (
    0.9,
    0.95,
)  # of one factor and of all of a unit, relative to the fall of what they stand beside


@dataclass(frozen=True, slots=True)
class Scales:
    """Standard deviations of x between lots, units and repeats, and the share of units in the wide part.

    Attributes
    ----------
    lot, unit, repeat : float
        0 for a level that the fleet does not have.
    wide : float
        s of eq. (1).
    """

    lot: float
    unit: float
    repeat: float
    wide: float


@dataclass(frozen=True, slots=True)
class Design:
    """Which log belongs to what.

    Attributes
    ----------
    profiles : ProfileTable
        Of n logs, sorted by lot and unit.
    covariates : ndarray, shape (n, p)
        z, a column of ones first.
    unit : ndarray of int, shape (n,)
        Not decreasing.
    lot : ndarray of int, shape (n_units,)
        Not decreasing; all 0 where there are no lots.
    """

    profiles: ProfileTable
    covariates: Array
    unit: Index
    lot: Index
    first_log: Index = field(init=False)
    first_unit: Index = field(init=False)

    def __post_init__(self) -> None:
        starts = (np.flatnonzero(np.diff(labels, prepend=-1)) for labels in (self.unit, self.lot))
        for name, start in zip(("first_log", "first_unit"), starts, strict=True):
            object.__setattr__(self, name, start)

    @property
    def units(self) -> int:
        """Number of units."""
        return len(self.first_log)

    @property
    def lots(self) -> int:
        """Number of lots."""
        return len(self.first_unit)

    @property
    def repeats(self) -> bool:
        """Some unit has more than one log."""
        return self.units < len(self.unit)

    @property
    def logs_of_unit(self) -> Array:
        """How many logs the unit of each log has, shape (n,)."""
        return self.per_unit(np.ones(len(self.unit)))[self.unit]

    def thinned(self, most: int) -> Design:
        """Every so many units, so that about as many logs are left."""
        step = -(-len(self.unit) // most)
        kept = np.arange(0, self.units, step)
        logs = np.flatnonzero(np.isin(self.unit, kept))
        unit, lot = (
            np.unique(labels, return_inverse=True)[1] for labels in (self.unit[logs], self.lot[kept])
        )
        return Design(
            self.profiles.of_rows(logs), self.covariates[logs], unit.astype(np.intp), lot.astype(np.intp)
        )

    def per_unit(self, values: Array, axis: int = -1) -> Array:
        """Sums over the logs of each unit; `axis` is that of the logs."""
        return np.asarray(np.add.reduceat(values, self.first_log, axis=axis)) if self.repeats else values

    def per_lot(self, values: Array) -> Array:
        """Sums over the units of each lot."""
        if self.lots == 1:
            return np.asarray(values.sum(axis=0, keepdims=True))
        return np.asarray(np.add.reduceat(values, self.first_unit, axis=0))


@dataclass(frozen=True, slots=True)
class Factors:
    """The normal factors of n logs, exp(k + h x - t x^2 / 2), each of shape (parts, n)."""

    k: Array
    h: Array
    t: Array

    @classmethod
    def near(cls, profiles: ProfileTable) -> Factors:
        """Of the best values: exact for straight roots, a start for others."""
        mean, precision = profiles.normal
        return cls(-0.5 * precision[None] * mean**2, (precision * mean)[None], precision[None])

    def halfway(self, other: Factors) -> Factors:
        """Between these and others."""
        return Factors(
            *(
                0.5 * (a + b)
                for a, b in zip((self.k, self.h, self.t), (other.k, other.h, other.t), strict=True)
            )
        )

    def bounded(self, variance: Array, logs: Array) -> Factors:
        """None that grows faster than an expectation of this variance falls, shape (parts, 1)."""
        return Factors(self.k, self.h, np.maximum(self.t, -_GROWTH / (variance * logs)))

    def beside(self, parts: int) -> Factors:
        """With a row for each part."""
        rows = np.minimum(np.arange(parts), len(self.t) - 1)
        return Factors(self.k[rows], self.h[rows], self.t[rows])


@dataclass(frozen=True, slots=True)
class ScaleEvidence:
    """What one choice of scales comes to.

    Attributes
    ----------
    value : float
        Logarithm of the restricted likelihood.
    location : ndarray, shape (p,)
        beta.
    covariance : ndarray, shape (p, p)
        Of beta.
    lots, lot_variance : ndarray, shape (n_lots,)
        l, with its variance for a given beta.
    lot_lean : ndarray, shape (n_lots, p)
        By how much l falls where beta rises.
    factors : Factors
        With which it was reached.
    informed : dict of str to float
        Mean square of the part of each scale's variance in that of what its groups say: the reference prior's root.
    """

    value: float
    location: Array
    covariance: Array
    lots: Array
    lot_variance: Array
    lot_lean: Array
    factors: Factors
    informed: dict[str, float]


def evidence(design: Design, scales: Scales, start: ScaleEvidence | None = None) -> ScaleEvidence:
    """The restricted likelihood of these scales; `start` is that of scales nearby.

    Parameters
    ----------
    design : Design
    scales : Scales
    start : ScaleEvidence, optional
        Where to begin.
    """
    factors = (start.factors if start else Factors.near(design.profiles)).beside(2 if scales.wide else 1)
    factors = factors.bounded(_parts(scales)[1] + scales.repeat**2, design.logs_of_unit)
    location = start.location if start else _first_location(design, factors)
    lots = start.lots if start else np.zeros(design.lots)
    bent = np.flatnonzero(~design.profiles.straight)
    for i in range(_ROUNDS if len(bent) else 0):
        matched, change = _matched(design, scales, factors, location, lots, bent)
        # logs of one unit answer each other: where that does not settle, half a step each time
        factors = matched if i < _ROUNDS // 3 or change < _SETTLED else factors.halfway(matched)
        # factors hold nearby: a few steps, and they are matched again
        solution = _solved(design, scales, factors, location, lots, _FEW, _LONGEST)
        location, lots = solution.location, solution.lots
        if change < _SETTLED:
            return solution
    if len(bent):  # unsettled: the value where the last step ended, not what factors of elsewhere make of it
        factors, _ = _matched(design, scales, factors, location, lots, bent)
    return _solved(design, scales, factors, location, lots, 0 if len(bent) else _NEWTON)


def _first_location(design: Design, factors: Factors) -> Array:
    """By weighted least squares, as if all logs were equal but for what they say."""
    t, h = factors.t[0], factors.h[0]
    weight = t / (1.0 + t * 0.25)
    z = design.covariates
    normal = z.T @ (weight[:, None] * z)
    target = np.where(t > 0, h / np.maximum(t, 1e-300), 0.0)
    return np.asarray(np.linalg.lstsq(normal, z.T @ (weight * target), rcond=None)[0])


# -- location, for given factors --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Marginal:
    """Factors with the repeats integrated, eq. (2), shape (parts, n); `per_unit` is W, shape (parts, n_units)."""

    k: Array
    h: Array
    t: Array
    per_unit: Array

    @classmethod
    def of(cls, design: Design, factors: Factors, repeat: float) -> _Marginal:
        shrink = 1.0 + factors.t * repeat**2
        k = factors.k + 0.5 * (repeat**2 * factors.h**2 / shrink - np.log(shrink))
        t = factors.t / shrink
        return cls(k, factors.h / shrink, t, design.per_unit(t))


@dataclass(frozen=True, slots=True)
class _Units:
    """Eq. (3) and its derivatives.

    Attributes
    ----------
    value : float
        Of all units together.
    slope : ndarray, shape (n,)
        By o of each log.
    weight : ndarray, shape (parts, n_units)
        Share of each part in each unit.
    spread : ndarray, shape (parts, n_units)
        Variance of b within each part.
    pull : ndarray, shape (parts, n)
        Slope of each part.
    """

    value: float
    slope: Array
    weight: Array
    spread: Array
    pull: Array


def _parts(scales: Scales) -> tuple[Array, Array]:
    """Logarithms of the shares of the parts and their variances, shape (parts, 1): the narrow one, and the wide one."""
    if not scales.wide:
        return np.zeros((1, 1)), np.array([[scales.unit**2]])
    shares = np.log(np.array([[1.0 - scales.wide], [scales.wide]]))
    return shares, np.array([[1.0], [WIDE**2]]) * scales.unit**2


def _units(design: Design, scales: Scales, m: _Marginal, offset: Array) -> _Units:
    shares, variance = _parts(scales)
    toward = m.h - m.t * offset
    B = design.per_unit(toward)
    grown = np.maximum(1.0 + m.per_unit * variance, 1.0 - _MOST)
    spread = variance / grown
    each = shares - 0.5 * np.log(grown) + 0.5 * spread * B**2
    each = each + design.per_unit(m.k + m.h * offset - 0.5 * m.t * offset**2)
    total = np.logaddexp.reduce(each, axis=0)
    weight = np.exp(each - total)
    pull = toward - m.t * (spread * B)[:, design.unit]
    slope = (weight[:, design.unit] * pull).sum(axis=0)
    return _Units(float(total.sum()), slope, weight, spread, pull)


def _solved(
    design: Design, scales: Scales, factors: Factors, location: Array, lots: Array, steps: int,
    far: float | None = None,
) -> ScaleEvidence:  # fmt: skip
    """Newton's method for beta and the lots (in units of tau_lot), then Laplace; no step moves a log beyond `far`."""
    m = _Marginal.of(design, factors, scales.repeat)
    z, lot_of_log = design.covariates, design.lot[design.unit]
    tau = scales.lot
    beta = location
    u = lots / tau if tau > 0 else np.zeros(design.lots)

    def value_at(beta: Array, u: Array) -> tuple[float, _Units]:
        units = _units(design, scales, m, z @ beta + tau * u[lot_of_log])
        return units.value - 0.5 * float(u @ u), units

    value, units = value_at(beta, u)
    curve = _Curvature.of(design, m, units, tau)
    for _ in range(steps):
        step_beta, step_u = curve.solve(
            z.T @ units.slope, tau * design.per_lot(design.per_unit(units.slope)) - u
        )
        size = 1.0 if far is None else min(1.0, far / _longest(design, step_beta, tau * step_u))
        ahead = value_at(beta + size * step_beta, u + size * step_u)
        while ahead[0] < value - 1e-9 * abs(value) and size > _STEP:
            size *= 0.3
            ahead = value_at(beta + size * step_beta, u + size * step_u)
        if ahead[0] < value - 1e-9 * abs(value):
            break
        gain, value, units = ahead[0] - value, *ahead
        beta, u = beta + size * step_beta, u + size * step_u
        curve = _Curvature.of(design, m, units, tau)
        if gain < _GAIN:
            break
    return ScaleEvidence(
        value=value - 0.5 * curve.log_determinant + 0.5 * len(beta) * math.log(2 * math.pi),
        location=beta,
        covariance=np.asarray(np.linalg.inv(curve.schur)),
        lots=tau * u,
        lot_variance=tau**2 / curve.D,
        lot_lean=tau * curve.C / curve.D[:, None],
        factors=factors,
        informed=_informed(design, scales, factors, m, curve),
    )


def _longest(design: Design, step_beta: Array, step_lots: Array) -> float:
    """By how much such a step moves the log that it moves most."""
    return max(
        float(np.abs(design.covariates @ step_beta + step_lots[design.lot[design.unit]]).max()), 1e-300
    )


@dataclass(frozen=True, slots=True)
class _Curvature:
    """Minus the second derivatives by beta and the lots: blocks A (p, p), C (n_lots, p), D (n_lots,).

    `schur` is what is left of A once the lots are free.
    """

    C: Array
    D: Array
    plain_lot: Array
    schur: Array

    @classmethod
    def of(cls, design: Design, m: _Marginal, units: _Units, tau: float) -> _Curvature:
        z = np.column_stack((design.covariates, np.ones(len(design.unit))))  # the last stands for the lot
        slope = np.zeros((design.units, z.shape[1]))
        whole, of_lot = np.zeros((z.shape[1], z.shape[1])), np.zeros((design.units, z.shape[1]))
        for i in range(len(units.weight)):
            weight, t = units.weight[i][:, None], m.t[i][:, None]
            sums, pull = (design.per_unit(part[i][:, None] * z, 0) for part in (m.t, units.pull))
            loss = weight * units.spread[i][:, None] * sums
            whole += (
                z.T @ (units.weight[i][design.unit][:, None] * t * z)
                - loss.T @ sums
                - (weight * pull).T @ pull
            )
            of_lot += weight * sums - loss * sums[:, -1:] - weight * pull * pull[:, -1:]
            slope += weight * pull
        whole += slope.T @ slope
        rows = design.per_lot(of_lot + slope * slope[:, -1:])
        plain = np.maximum(rows[:, -1], 0.0)
        C, D = tau * rows[:, :-1], 1.0 + tau**2 * plain
        return cls(C, D, plain, _uphill(whole[:-1, :-1] - C.T @ (C / D[:, None])))

    def solve(self, of_beta: Array, of_lots: Array) -> tuple[Array, Array]:
        """The step for these slopes."""
        beta = np.linalg.solve(self.schur, of_beta - self.C.T @ (of_lots / self.D))
        return np.asarray(beta), np.asarray((of_lots - self.C @ beta) / self.D)

    @property
    def log_determinant(self) -> float:
        """Of the whole."""
        return float(np.linalg.slogdet(self.schur)[1] + np.log(self.D).sum())


def _uphill(bends: Array) -> Array:
    """The matrix with its negative bends turned, so that a step goes uphill."""
    values, vectors = np.linalg.eigh(bends)
    size = np.abs(values)
    return np.asarray((vectors * np.maximum(size, 1e-6 * max(float(size.max()), 1e-6))) @ vectors.T)


def _informed(
    design: Design, scales: Scales, factors: Factors, m: _Marginal, curve: _Curvature
) -> dict[str, float]:
    """Root mean square of tau^2 / (tau^2 + v) over the groups of each level, v the variance of what they say."""

    def mean_square(precision: Array, tau: float, weight: Array | float = 1.0) -> float:
        precision = np.maximum(precision, 0.0)
        part = precision * tau**2 / (1.0 + precision * tau**2)
        return float(np.sqrt(np.mean(weight * part**2)))

    informed = {"unit": mean_square(m.per_unit[0], scales.unit)}
    if design.lots > 1:
        informed["lot"] = mean_square(curve.plain_lot, scales.lot)
    if design.repeats:
        informed["repeat"] = mean_square(factors.t[0], scales.repeat, 1.0 - 1.0 / design.logs_of_unit)
    return informed


# -- factors, for a given location ------------------------------------------------------------------------


def _matched(
    design: Design, scales: Scales, factors: Factors, location: Array, lots: Array, bent: Index
) -> tuple[Factors, float]:
    """Factors of the bent profiles that match mass, mean and variance beside what the others say, and their change."""
    m = _Marginal.of(design, factors, scales.repeat)
    every = design.covariates @ location + lots[design.lot[design.unit]]
    offset = every[bent]
    unit, profiles = design.unit[bent], design.profiles.of_rows(bent)
    toward = m.h[:, bent] - m.t[:, bent] * offset
    all_toward = design.per_unit(m.h - m.t * every)
    logs = design.logs_of_unit[bent]
    shares, variances = _parts(scales)
    made, change = [part.copy() for part in (factors.k, factors.h, factors.t)], 0.0
    for i in range(len(factors.t)):
        W = m.per_unit[i][unit] - m.t[i, bent]
        B = all_toward[i][unit] - toward[i]
        spread = variances[i, 0] / np.maximum(1.0 + W * variances[i, 0], 1.0 - _MOST)
        mean, variance = offset + spread * B, np.maximum(spread + scales.repeat**2, 1e-12)
        tilted = profiles.tilted(mean, variance)
        # a limit far below leaves more variance than was expected: a factor that grows, kept from growing without end
        t = np.maximum(1 / tilted.variance - 1 / variance, -_GROWTH / (variance * logs))
        h = tilted.mean * (t + 1 / variance) - mean / variance
        # the same mass: of exp(h x - t x^2 / 2) beside N(mean, variance)
        grown = 1.0 + t * variance
        mass = (h * mean - 0.5 * t * mean**2 + 0.5 * variance * h**2) / grown - 0.5 * np.log(grown)
        moved = np.abs(t - factors.t[i, bent]) / (t + 1 / variance)
        moved += np.abs(h - factors.h[i, bent] - (t - factors.t[i, bent]) * mean) * np.sqrt(variance) / grown
        change = max(change, float(np.exp(shares[i, 0])) * float(moved.max()))
        for part, values in zip(made, (tilted.log_mass - mass, h, t), strict=True):
            part[i, bent] = values
    return Factors(*made), change
