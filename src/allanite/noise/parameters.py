# SPDX-License-Identifier: BSD-3-Clause
"""The parameters of a sum of terms by the symbols that fits give them.

An amplitude has the letter of its term; a Gauss-Markov term has sigma and T, of two terms the slower has sigma_2 and
T_2, in whatever order they stand; a sinusoid has amplitude and frequency, further ones amplitude_2, frequency_2, ...
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from allanite.noise.model import Estimate, NoiseModel
from allanite.noise.terms import GaussMarkov, TermType

__all__ = ["amplitude_symbols", "estimate_of", "holder_of", "with_factor"]

_SIZES, _TIME, _LINE = ("sigma", "q"), "T", ("amplitude", "frequency")


def amplitude_symbols(terms: Sequence[TermType]) -> list[str]:
    """Symbol of the amplitude of each term; a further term of a kind has its number."""
    symbols = []
    for term in terms:
        alike = [t for t in terms if type(t) is type(term)]
        if isinstance(term, GaussMarkov):
            alike = _by_time(alike)
        place = next(i for i, t in enumerate(alike, start=1) if t is term)
        name = _SIZES[0] if isinstance(term, GaussMarkov) else term.symbols[0]
        symbols.append(name if place == 1 else f"{name}_{place}")
    return symbols


def holder_of(symbol: str, terms: Sequence[TermType]) -> TermType | None:
    """The term that a parameter belongs to; None without one.

    Of two Gauss-Markov terms a model may have the slower one alone, with sigma_2 and T_2.
    """
    name, _, number = symbol.partition("_")
    if number and not number.isdigit():
        return None
    place = int(number or 1) - 1
    if name == _TIME or name in _SIZES:
        markov = _by_time([t for t in terms if isinstance(t, GaussMarkov)])
        return markov[min(place, len(markov) - 1)] if markov else None
    alike = [t for t in terms if t.symbols == (_LINE if name in _LINE else (name,))]
    return alike[place] if place < len(alike) else None


def estimate_of(term: TermType, model: NoiseModel) -> Estimate | None:
    """The estimate of the amplitude of a term of a model, one that is supported before one that is not."""
    of_term = [e for e in model.estimates if _is_amplitude(e) and holder_of(e.symbol, model.terms) is term]
    return max(of_term, key=lambda e: e.supported, default=None)


def _is_amplitude(estimate: Estimate) -> bool:
    return estimate.symbol.partition("_")[0] not in (_TIME, _LINE[1])


def with_factor(terms: Sequence[TermType], symbol: str, factor: float) -> tuple[TermType, ...]:
    """The terms with one parameter times a factor; with another T a Gauss-Markov term keeps its sigma."""
    holder = holder_of(symbol, terms)
    return tuple(_scaled(t, symbol.partition("_")[0], factor) if t is holder else t for t in terms)


def _scaled(term: TermType, name: str, factor: float) -> TermType:
    if isinstance(term, GaussMarkov):
        size, time = (1.0, factor) if name == _TIME else (factor, 1.0)
        return GaussMarkov.from_sigma(term.sigma * size, term.T * time)
    return replace(term, **{name: getattr(term, name) * factor})


def _by_time(markov: Sequence[TermType]) -> list[TermType]:
    return sorted(markov, key=lambda t: t.T if isinstance(t, GaussMarkov) else 0.0)
