# SPDX-License-Identifier: BSD-3-Clause
"""From the coefficients of the fit to the numbers that a data sheet has, each with its interval."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.record.fit import TableSolution
from allanite.experiments.rate_table.record.rows import ABSOLUTE, RATE, TEMPERATURE, WARM_RATE, power
from allanite.experiments.rate_table.results import ResponseParameter
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile, normal_quantile, student_quantile
from allanite.quantities.quantity import QuantityStatus
from allanite.quantities.residual_tests import SEEN

__all__ = ["ORDINALS", "Wide", "curve", "parameters_of"]

Array = NDArray[np.float64]

ORDINALS = {2: "quadratic", 3: "cubic", 4: "quartic", 5: "quintic"}
"""Names of the powers."""
#: Points at which the deviation from the straight line is taken.
POINTS = 201


@dataclass(frozen=True, slots=True, kw_only=True)
class Wide:
    """How standard deviations become intervals.

    Attributes
    ----------
    confidence : float
    inflation : float
    dof : float
        Infinite where the noise was known before.
    """

    confidence: float
    inflation: float
    dof: float

    def quantile(self, p: float) -> float:
        """Of the normal law, or of Student's."""
        return normal_quantile(p) if math.isinf(self.dof) else student_quantile(p, self.dof)

    def parameter(
        self, name: str, estimate: tuple[float, float], unit: str, *, stated: float = 0.0, zero: float = 0.0
    ) -> ResponseParameter:
        """A number with its interval; `stated` is an uncertainty of its own, `zero` what it is measured from."""
        value, sd = estimate[0], estimate[1] * self.inflation
        total = math.hypot(sd, stated)
        half = self.quantile((1 + self.confidence) / 2) * total
        low, high = value - half, value + half
        threshold = self.quantile(_THREE) * total
        resolved = math.isfinite(total) and abs(value - zero) >= threshold * (1 - 1e-12)
        return ResponseParameter(
            name=name,
            value=value,
            sd=sd,
            total_sd=total,
            lower=low,
            upper=high,
            unit=unit,
            status=_status(resolved=resolved, bounded=math.isfinite(total)),
        )


def _status(*, resolved: bool, bounded: bool) -> QuantityStatus:
    if resolved:
        return QuantityStatus.RESOLVED
    return QuantityStatus.UPPER_LIMIT if bounded else QuantityStatus.NOT_RESOLVED


#: Probability of being less than three standard deviations above, in the normal law.
_THREE = 0.99865


def parameters_of(
    solution: TableSolution,
    wide: Wide,
    *,
    unit: str,
    budget: Mapping[str, float],
    nominal: float | None,
    bias_stated: float,
) -> list[ResponseParameter]:
    """Scale factor, its error, bias, the deviation from the straight line, and what temperature does.

    Parameters
    ----------
    unit : str
        SI unit of the channel.
    budget : mapping of str to float
        Uncertainties of the scale factor that the noise does not hold, relative to it.
    nominal : float or None
        What the scale factor should be.
    bias_stated : float [SI of the channel]
    """
    k, sd = solution.scale
    relative = math.sqrt(sum(v**2 for v in budget.values()))
    out = [wide.parameter("scale factor", (k, sd), f"{unit}/(rad/s)", stated=relative * abs(k))]
    if nominal is not None:
        error = (k / nominal - 1, abs(sd / nominal))
        out.append(wide.parameter("scale-factor error", error, "1", stated=relative * abs(k / nominal)))
    out.append(wide.parameter("bias", solution.bias, unit, stated=bias_stated))
    shape = solution.shape if out[0].resolved else ()  # what follows is relative to the scale factor
    for name in shape:
        if name == ABSOLUTE:
            value, coefficient_sd = solution.of_scale(name)
            out.append(wide.parameter("asymmetry", (2 * value, 2 * coefficient_sd), "1"))
        else:
            degree = int(name.rpartition("^")[2])
            out.append(wide.parameter(ORDINALS.get(degree, power(degree)), solution.of_scale(name), "1"))
    if shape:
        out.append(nonlinearity(solution, wide))
    if TEMPERATURE in solution.fit.names:
        out.append(wide.parameter("scale factor over temperature", solution.of_scale(WARM_RATE), "1/K"))
        out.append(wide.parameter("bias over temperature", solution.fit[TEMPERATURE], f"{unit}/K"))
    return out


def nonlinearity(solution: TableSolution, wide: Wide) -> ResponseParameter:
    """Largest deviation from the best straight line, over full scale, with a band that holds for all rates at once.

    The band is Scheffe's: with c coefficients the root of the chi-square quantile of c degrees of freedom takes the
    place of the normal quantile. So the interval of the maximum holds the truth at least as often as it says.
    """
    u = _grid(solution)
    value, sd = solution.deviation(u)
    sd = sd * wide.inflation
    count = len(solution.shape)
    reach = math.sqrt(chi_square_quantile(wide.confidence, count))
    if not math.isinf(wide.dof):
        reach *= wide.quantile((1 + wide.confidence) / 2) / normal_quantile((1 + wide.confidence) / 2)
    at = int(np.argmax(np.abs(value)))
    high = float((np.abs(value) + reach * sd).max())
    low = max(float((np.abs(value) - reach * sd).max()), 0.0)
    return ResponseParameter(
        name="nonlinearity",
        value=float(np.abs(value[at])),
        sd=float(sd[at]),
        total_sd=float(sd[at]),
        lower=low,
        upper=high,
        unit="1",
        status=_status(resolved=_joint(solution, wide), bounded=True),
    )


def _joint(solution: TableSolution, wide: Wide) -> bool:
    """All coefficients of the shape together, against the chance of three standard deviations."""
    at = [solution.fit.names.index(n) for n in solution.shape]
    c, covariance = solution.fit.coefficients[at], solution.fit.covariance[np.ix_(at, at)] * wide.inflation**2
    if not (np.isfinite(c).all() and np.isfinite(covariance).all()):
        return False
    size = np.sqrt(np.diag(covariance))
    whitened = np.linalg.solve(covariance / np.outer(size, size), c / size)
    statistic = float((c / size) @ whitened)
    factor = (wide.quantile(_THREE) / SEEN) ** 2
    return statistic >= chi_square_quantile(2 * _THREE - 1, len(at)) * max(factor, 1.0)


def _grid(solution: TableSolution) -> Array:
    """Rates over full scale from the smallest that was used to the largest."""
    rates = solution.rows.column(RATE)[solution.rows.used]
    return np.linspace(float(rates.min()), float(rates.max()), POINTS)


def curve(solution: TableSolution, wide: Wide) -> Array:
    """Rate over full scale, deviation from the straight line, and its standard deviation; shape (n, 3)."""
    u = _grid(solution)[::4]
    value, sd = solution.deviation(u) if solution.shape else (np.zeros_like(u), np.zeros_like(u))
    return np.column_stack([u, value, sd * wide.inflation])
