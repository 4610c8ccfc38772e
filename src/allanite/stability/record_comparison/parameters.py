# SPDX-License-Identifier: BSD-3-Clause
"""One parameter in all records: values, equality, the common value, the population, and who stands out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

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
    RecordParameter,
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
    values = tuple(_value(p, _exp) if p is not None else _unknown() for p in every)
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
        common=_common(profiles, centre, _exp),
        detectable=None if shift is None else math.expm1(min(shift, _LARGEST)),
        population=_scatter(profiles, confidence, _exp),
        worst=worst,
        worst_p=worst_p,
        outlier=None if law is None else _outlier(records, profiles, law),
    )


def bias_comparison(
    records: Sequence[str], profiles: Sequence[Profile], confidence: float
) -> ParameterComparison:
    """The means of the records; their p is not adjusted yet."""
    centre, q = least(profiles)
    law = ScaledChiSquare(dof=len(profiles) - 1.0)
    return ParameterComparison(
        symbol="mean",
        records=tuple(_value(p, float) for p in profiles),
        equality=Equality(statistic=q, dof=law.dof, p=law.tail(q), p_adjusted=law.tail(q)),
        common=_common(profiles, centre, float),
        detectable=detectable(profiles),
        population=_scatter(profiles, confidence, float),
        worst=None,
        worst_p=None,
        outlier=_outlier(records, profiles, law),
    )


Scale = Callable[[float], float]


def _exp(x: float) -> float:
    return math.exp(x) if x < _LARGEST else math.inf


def _unknown() -> RecordParameter:
    return RecordParameter(value=None, lower=0.0, upper=math.inf, supported=False)


def _value(profile: Profile, scale: Scale) -> RecordParameter:
    low, high = profile.interval
    value = scale(profile.best) if profile.supported else None
    return RecordParameter(value=value, lower=scale(low), upper=scale(high), supported=profile.supported)


def _common(profiles: Sequence[Profile], centre: float, scale: Scale) -> RecordParameter:
    low, high = level_set(profiles, max(p.critical for p in profiles))
    bounded = math.isfinite(low) and math.isfinite(high)
    return RecordParameter(
        value=scale(centre) if bounded else None, lower=scale(low), upper=scale(high), supported=bounded
    )


def _scatter(profiles: Sequence[Profile], confidence: float, scale: Scale) -> SensorSpread | None:
    population = population_of(profiles, confidence)
    if population is None:
        return None
    ahead = [None if x is None else scale(x) for x in (population.next_lower, population.next_upper)]
    return SensorSpread(
        resolved=population.resolved,
        mean=scale(population.middle),
        lower=scale(population.lower),
        upper=scale(population.upper),
        spread=population.spread,
        spread_lower=population.spread_lower,
        spread_upper=population.spread_upper,
        next_lower=ahead[0],
        next_upper=ahead[1],
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
