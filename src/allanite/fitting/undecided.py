# SPDX-License-Identifier: BSD-3-Clause
"""Flicker or Gauss-Markov, and the record cannot tell: what both say of the terms that they share.

What one family takes for a random walk the other may explain without. While neither is excluded, a value is excluded
only where both exclude it: the set of a shared term is the union of its sets, and a term is supported where both
families support it. A power law that explains the record better than both has a say in N, too; one that explains it as
well, and is not that of flicker, leaves no flicker supported.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from allanite.fitting.estimates import limit_estimate
from allanite.fitting.verdict import power_law_words
from allanite.noise import Estimate, NoiseModel

__all__ = ["over_families", "with_alternative"]

_SHARED = ("Q", "N", "K", "R")


def over_families(
    models: Sequence[NoiseModel],
    others: Mapping[str, tuple[float, float]] | None = None,
    facts: Mapping[str, float] | None = None,
) -> list[NoiseModel]:
    """The models of one or both families, whose shared terms have the sets that hold under each.

    Point estimates and terms stay those of each family.

    Parameters
    ----------
    others : mapping of str to (float, float), optional
        Sets of terms under what explains the record better than these families, by symbol.
    facts : mapping, optional
        `goodness`, with the power laws that the record does not exclude.
    """
    sets = {
        symbol: [
            *((e.lower, e.upper) for m in models for e in m.estimates if e.symbol == symbol),
            *([others[symbol]] if others and symbol in others else []),
        ]
        for symbol in _SHARED
    }
    law = power_law_words(facts or {})
    other_law = bool(law) and facts is not None and not facts["slope_lower"] <= 1 <= facts["slope_upper"]

    def judged(e: Estimate) -> Estimate:
        if other_law and e.symbol == "B" and e.supported:
            return limit_estimate("B", e.upper, f"; the record needs a density of {law} or one like it")
        return _joint(e, sets.get(e.symbol, ()))

    return [replace(m, estimates=tuple(judged(e) for e in m.estimates)) for m in models]


def with_alternative(models: Sequence[NoiseModel]) -> NoiseModel:
    """The first of one or two models, with the other one as its alternative."""
    return models[0] if len(models) == 1 else replace(models[0], alternative=models[1])


def _joint(one: Estimate, sets: Sequence[tuple[float, float]]) -> Estimate:
    """An estimate of one family with the set that holds under each explanation."""
    if len(sets) < 2:
        return one
    lower, upper = min(low for low, _ in sets), max(high for _, high in sets)
    if one.supported and lower == 0:
        remark = "; some other explanation does without: the record needs this term or one like it"
        return limit_estimate(one.symbol, upper, remark)
    return replace(one, lower=lower, upper=upper)
