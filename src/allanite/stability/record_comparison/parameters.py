# SPDX-License-Identifier: BSD-3-Clause
"""One parameter in all records: values, equality, the common value, the population, and who stands out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from allanite.quantities.display_units import si_unit
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.stability.record_comparison.equality import (
    detectable,
    least,
    level_set,
    parameter_law,
    without_each,
)
from allanite.stability.record_comparison.evidence import Evidence
from allanite.stability.record_comparison.null_law import ScaledChiSquare
from allanite.stability.record_comparison.population import population_of
from allanite.stability.record_comparison.profiles import Profile
from allanite.stability.record_comparison.results import (
    Equality,
    Outlier,
    ParameterComparison,
    SensorSpread,
)

__all__ = ["bias_comparison", "parameter_comparison"]

#: Neither long nor short is worse.
_NO_WORST = ("T", "mean")
_LARGEST = 700.0  # exponent of the largest double


def parameter_comparison(evidence: Sequence[Evidence], symbol: str, confidence: float) -> ParameterComparison:
    """A parameter that cannot be negative, by its logarithm; its p is not adjusted yet."""
    every = [e.profiles.get(symbol) for e in evidence]
    records = [e.series.record for e, p in zip(evidence, every, strict=True) if p is not None]
    profiles = [p for p in every if p is not None]
    first = evidence[0].series
    unit = si_unit(first.kind.value, symbol, first.unit)
    values = tuple(
        _bounded(math.nan, 0.0, math.inf, unit, known=False) if p is None else _value(p, _exp, unit)
        for p in every
    )
    centre, q = least(profiles)
    equality = law = None
    if len(profiles) > 1 and any(math.isfinite(p.best) for p in profiles):
        law = parameter_law([e for e in evidence if symbol in e.profiles], symbol)
        equality = Equality(statistic=q, dof=law.dof, p=law.tail(q), p_adjusted=law.tail(q))
    shift = detectable(profiles)
    worst, worst_p = (None, None) if symbol in _NO_WORST else _worst(records, profiles)
    return ParameterComparison(
        symbol=symbol,
        records=values,
        equality=equality,
        common=_common(profiles, centre, _exp, unit),
        detectable=None if shift is None else math.expm1(min(shift, _LARGEST)),
        population=_scatter(profiles, confidence, _exp, unit, "1"),
        worst=worst,
        worst_p=worst_p,
        outlier=None if law is None else _outlier(records, profiles, law),
    )


def bias_comparison(
    records: Sequence[str], profiles: Sequence[Profile], confidence: float, unit: str
) -> ParameterComparison:
    """The means of the records; their p is not adjusted yet."""
    centre, q = least(profiles)
    law = ScaledChiSquare(dof=len(profiles) - 1.0)
    return ParameterComparison(
        symbol="mean",
        records=tuple(_value(p, float, unit) for p in profiles),
        equality=Equality(statistic=q, dof=law.dof, p=law.tail(q), p_adjusted=law.tail(q)),
        common=_common(profiles, centre, float, unit),
        detectable=detectable(profiles),
        population=_scatter(profiles, confidence, float, unit, unit),
        worst=None,
        worst_p=None,
        outlier=_outlier(records, profiles, law),
    )


Scale = Callable[[float], float]


def _exp(x: float) -> float:
    return math.exp(x) if x < _LARGEST else math.inf


def _value(profile: Profile, scale: Scale, unit: str) -> Quantity:
    low, high = profile.interval
    return _bounded(scale(profile.best), scale(low), scale(high), unit, known=profile.supported)


def _bounded(value: float, lower: float, upper: float, unit: str, *, known: bool) -> Quantity:
    """A value with its interval, or the limit that is all that is known."""
    if known:
        return Quantity.of(value, (lower, upper), unit)
    if math.isinf(upper):
        return Quantity(
            value=math.nan, lower=math.nan, upper=math.nan, unit=unit, status=QuantityStatus.NOT_RESOLVED
        )
    return Quantity(value=math.nan, lower=lower, upper=upper, unit=unit, status=QuantityStatus.UPPER_LIMIT)


def _common(profiles: Sequence[Profile], centre: float, scale: Scale, unit: str) -> Quantity:
    low, high = level_set(profiles, max(p.critical for p in profiles))
    bounded = math.isfinite(low) and math.isfinite(high)
    return _bounded(scale(centre), scale(low), scale(high), unit, known=bounded)


def _scatter(
    profiles: Sequence[Profile], confidence: float, scale: Scale, unit: str, unit_of_spread: str
) -> SensorSpread | None:
    population = population_of(profiles, confidence)
    if population is None:
        return None
    ahead = population.next_lower, population.next_upper
    spread = Quantity.of(
        population.spread, (population.spread_lower, population.spread_upper), unit_of_spread
    )
    return SensorSpread(
        resolved=population.resolved,
        middle=Quantity.of(
            scale(population.middle), (scale(population.lower), scale(population.upper)), unit
        ),
        spread=(
            replace(spread, status=QuantityStatus.UPPER_LIMIT)
            if spread.resolved and spread.lower <= 0
            else spread
        ),
        next_sensor=None if ahead[0] is None or ahead[1] is None else (scale(ahead[0]), scale(ahead[1])),
    )


def _worst(records: Sequence[str], profiles: Sequence[Profile]) -> tuple[str | None, float | None]:
    """The record with the largest value, and the probability of its lead over the one that may come nearest."""
    resolved = [i for i, p in enumerate(profiles) if p.supported]
    if len(resolved) < 2:
        return None, None
    i = max(resolved, key=lambda j: profiles[j].best)
    others = [j for j in range(len(profiles)) if j != i]
    leads = [ScaledChiSquare(dof=1.0).tail(least([profiles[i], profiles[j]])[1]) for j in others]
    return records[i], min(max(leads) * len(others), 1.0)


def _outlier(records: Sequence[str], profiles: Sequence[Profile], law: ScaledChiSquare) -> Outlier | None:
    k = len(profiles)
    if k < 3 or law.dof <= 0:
        return None
    falls = without_each(profiles)
    i = int(np.argmax(falls))
    rest = [p for j, p in enumerate(profiles) if j != i]
    one = ScaledChiSquare(dof=1.0, scale=law.scale)
    others = ScaledChiSquare(dof=k - 2.0, scale=law.scale)
    return Outlier(
        record=records[i],
        p=min(one.tail(float(falls[i])) * k, 1.0),
        looked_at=k,
        rest_p=others.tail(least(rest)[1]),
    )
