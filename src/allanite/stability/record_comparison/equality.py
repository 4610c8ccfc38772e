# SPDX-License-Identifier: BSD-3-Clause
"""Are parameters the same in all records? One parameter after the other, and all of a channel at once.

For one parameter every record keeps its other parameters, and

    Q = min over x of  sum_r D_r(x),                                                                       (1)

D_r being the profiles: for normal estimates this is Cochran's chi-square with k - 1 degrees of freedom [1]; a record
with an upper limit adds what its limit contradicts. For all parameters at once the model is one for all records,

    Q = min over p of  sum_r |z_r - U_r p|^2  -  sum_r min over p_r of |z_r - U_r p_r|^2,                    (2)

where z_r is the whitened residual of record r under the pooled model, U_r its derivative with respect to the
parameters, and no coefficient falls below zero. The model is linearized on purpose: where a few uncertain long lags
decide, the loss of the full model exceeds its linear law, for three parameters by 4 % in the mean, and 7 % of
comparisons of equal records fell beyond the 95 % point. The laws are those of `null_law`.

References
----------
.. [1] W. Cochran, "The combination of estimates from different experiments", Biometrics 10 (1954) 101.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import TIME_POWER
from allanite.fitting.inversion import crossing
from allanite.fitting.objective import CurveSolution, linearized
from allanite.lazy_dataclasses import dataclass
from allanite.stability.record_comparison.evidence import Evidence
from allanite.stability.record_comparison.null_law import Directions, EqualityLoss, ScaledChiSquare
from allanite.stability.record_comparison.pooled import JointDesign, seen_by
from allanite.stability.record_comparison.profiles import Chords, Profile

__all__ = [
    "detectable",
    "joint_equality",
    "least",
    "level_set",
    "parameter_law",
    "summed_loss",
    "without_each",
]

Array = NDArray[np.float64]

_GRID = 201
_ROUNDS = 4
_PER_WIDTH = 4.0  # places that are looked at in the width of the narrowest profile
#: Standard deviations beyond which no end of a set is looked for.
_FARTHEST = 1e4
#: Probability with which a difference is seen that is called detectable.
_POWER = 0.8
_TEST = 0.05


def least(profiles: Sequence[Profile], tau: float = 0.0, chords: Chords | None = None) -> tuple[float, float]:
    """Where the sum of the profiles is least, and how large it is there; `chords`: theirs, if the caller has them."""
    if all(p.normal for p in profiles):
        return _weighted(profiles, tau)
    if tau <= 0:
        return _SummedProfiles.of(profiles).least()
    chords = chords or Chords.of(profiles)
    low, high = _range(profiles, tau)
    x = np.unique(np.concatenate([np.linspace(low, high, _GRID), _known(profiles, low, high, tau)]))
    for _ in range(_ROUNDS):
        total = chords.total(x, tau)
        i = int(np.argmin(total))
        if x[-1] - x[0] < 1e-12 * max(abs(x[i]), 1.0):
            break
        x = np.linspace(x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)], 61)
    total = chords.total(x, tau)
    i = int(np.argmin(total))
    return float(x[i]), float(total[i])


def _weighted(profiles: Sequence[Profile], tau: float) -> tuple[float, float]:
    """The same for normal estimates: their weighted mean and chi-square."""
    x = np.array([p.best for p in profiles])
    weight = 1 / (np.array([p.sd for p in profiles]) ** 2 + tau**2)
    middle = float(np.average(x, weights=weight))
    return middle, float(weight @ (x - middle) ** 2)


def summed_loss(profiles: Sequence[Profile], x: Array) -> Array:
    """Sum of the losses D(x) of all profiles, shape of x."""
    return np.asarray(sum((p.loss(x) for p in profiles), np.zeros_like(x)))


def _known(profiles: Sequence[Profile], low: float, high: float, tau: float) -> Array:
    """Places near which the least may be, however narrow the profiles are, less those that are next to another."""
    best, sd = np.array([p.best for p in profiles]), np.array([p.sd for p in profiles])
    places, sharp = best[np.isfinite(best)], np.isfinite(best) & np.isfinite(sd)
    if sharp.any():
        middle = np.average(best[sharp], weights=1 / np.maximum(sd[sharp], 1e-300) ** 2)
        places = np.append(places, middle)
    near = math.hypot(float(np.min(sd, where=np.isfinite(sd), initial=1e300)), tau) / _PER_WIDTH
    kept = np.sort(np.clip(places, low, high))
    if not 0 < near < high - low:
        return np.asarray(kept)
    return np.asarray(kept[np.unique(np.floor((kept - low) / near), return_index=True)[1]])


def _range(profiles: Sequence[Profile], tau: float) -> tuple[float, float]:
    low = min(float(p.knots[0]) for p in profiles)
    high = max(float(p.knots[-1]) for p in profiles)
    return low - 3 * tau, high + 3 * tau


def level_set(profiles: Sequence[Profile], level: float) -> tuple[float, float]:
    """Ends of the set of x whose summed loss is within `level` of the least; infinite where there is no end."""
    centre, value = least(profiles)
    widths = [w for w in (p.sd for p in profiles) if 0 < w < math.inf] or [1.0]
    first = math.sqrt(level / sum(w**-2 for w in widths))  # where normal profiles end
    first = max(first, math.ulp(centre))

    def end(direction: float) -> float:
        def loss(x: float) -> float:
            return float(summed_loss(profiles, np.array([centre + direction * x]))[0]) - value

        return centre + direction * crossing(loss, level, first, _FARTHEST * max(widths))

    return end(-1.0), end(1.0)


def without_each(profiles: Sequence[Profile]) -> Array:
    """By how much Q falls when one record is left out, shape (n_records,)."""
    whole = least(profiles)[1]
    if all(p.normal for p in profiles):
        rest = [least([p for j, p in enumerate(profiles) if j != i])[1] for i in range(len(profiles))]
    else:
        rest = _SummedProfiles.of(profiles).least_without_each()
    return np.maximum(whole - np.array(rest), 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class _SummedProfiles:
    """Profiles between neighbours among all their knots, where each root is one straight line: the sum of the losses is
    a parabola there, and its least value is known in closed form.

    Attributes
    ----------
    edges : ndarray, shape (n + 1,)
    parts : ndarray, shape (n_profiles, 3, n)
        Coefficients of 1, u and u^2 of the loss of each profile, u the distance from the lower edge.
    """

    edges: Array
    parts: Array

    @classmethod
    def of(cls, profiles: Sequence[Profile]) -> _SummedProfiles:
        knots = np.unique(np.concatenate([p.knots for p in profiles]))
        edges = np.append(knots, knots[-1] + 1.0)  # where all losses rise, or are constant
        roots = np.array([p.root(edges) for p in profiles])
        start, slope = roots[:, :-1], np.diff(roots, axis=1) / np.diff(edges)
        return cls(edges=edges, parts=np.stack([start**2, 2 * start * slope, slope**2], axis=1))

    def least(self, total: Array | None = None) -> tuple[float, float]:
        """Where the sum of all profiles, or a total of parts, is least, and how large it is there."""
        constant, slope, bend = self.parts.sum(axis=0) if total is None else total
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.nan_to_num(np.clip(-slope / (2 * bend), 0.0, np.diff(self.edges)))
        values = constant + (slope + bend * u) * u
        i = int(np.argmin(values))
        return float(self.edges[i] + u[i]), max(float(values[i]), 0.0)

    def least_without_each(self) -> list[float]:
        """The least value without one profile after the other; sums of the others, no differences."""
        behind = np.cumsum(self.parts[::-1], axis=0)[::-1]
        before, rest = np.zeros_like(self.parts[0]), []
        for i, part in enumerate(self.parts):
            after = behind[i + 1] if i + 1 < len(behind) else 0.0
            rest.append(self.least(before + after)[1])
            before = before + part
        return rest


def detectable(profiles: Sequence[Profile]) -> float | None:
    """Shift of ln(parameter) of one record of middling precision that the test would see in four of five cases."""
    from scipy.special import chndtrinc

    sd = np.sort([p.sd for p in profiles if p.supported])
    if len(sd) < 2:
        return None
    law = ScaledChiSquare(dof=float(len(sd) - 1))
    noncentral = float(chndtrinc(law.quantile(1 - _TEST), law.dof, 1 - _POWER))
    i = len(sd) // 2
    others = np.delete(sd, i)
    return math.sqrt(noncentral * (float(sd[i]) ** 2 + 1 / float((1 / others**2).sum())))


# -- laws and the joint test ---------------------------------------------------------------------------------------


def parameter_law(evidence: Sequence[Evidence], symbol: str) -> ScaledChiSquare:
    """The law of Q of one parameter (SI name).

    Other coefficients that a record does not show are taken to stand at zero, the least favourable case, as in the sets
    of one record. The tested one may move either way: with few degrees of freedom a curve that holds a term never
    looks as if it were not there, however wide its interval is, and a border would make the law too small.
    """
    inner = {"B_equiv": "G", "q": "G"}.get(symbol, symbol)
    records = []
    for e in evidence:
        if inner not in e.columns:
            continue
        others = {s: c for s, c in e.columns.items() if s != inner}
        n = len(e.columns[inner])
        records.append(
            Directions(
                shared=(e.columns[inner] * _unit_of(e, inner, evidence[0]))[:, None],
                alone=_table(list(others.values()), n),
                floor=np.array([math.inf if s in e.present or s == "T" else 0.0 for s in others]),
            )
        )
    if len(records) < 2:
        return ScaledChiSquare(dof=0.0)
    law = EqualityLoss.of(records, [math.inf]).law()
    plain = ScaledChiSquare(dof=len(records) - 1.0)
    return ScaledChiSquare(dof=plain.dof, scale=max(law.quantile(1 - _TEST) / plain.quantile(1 - _TEST), 1.0))


def _unit_of(e: Evidence, inner: str, first: Evidence) -> float:
    """Coefficient of this record over that of the first for the same noise."""
    if inner == "T":
        return 1.0
    a, b = first.series, e.series
    return float(a.fit.scale / b.fit.scale * (a.curve.dt / b.curve.dt) ** (2 * TIME_POWER[inner]))


def _table(columns: Sequence[Array], n: int) -> Array:
    return np.stack(columns, axis=1) if columns else np.zeros((n, 0))


def joint_equality(design: JointDesign, pooled: CurveSolution) -> tuple[float, ScaledChiSquare]:
    """Loss of one model for all records (eq. 2), and its law."""
    timed = len(pooled.times)
    records, residuals = [], []
    for i, series in enumerate(design.series):
        data, null = series.fit.data, seen_by(design, i, pooled)
        change, z = linearized(data, null)
        factors = [design.factor(i, s) for s in pooled.symbols] + [1.0] * timed
        records.append(Directions.of_shared(change * np.array(factors)))
        residuals.append(z)
    made = EqualityLoss.of(records, [*pooled.c.tolist(), *[math.inf] * timed])
    return made.loss(residuals), made.law()
