# SPDX-License-Identifier: BSD-3-Clause
"""The parameters of a sum of terms by the symbols that fits give them.

Of two Gauss-Markov terms the slower has sigma_2 and T_2, in whatever order they stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from allanite.noise.model import Estimate, NoiseModel
from allanite.noise.terms import GaussMarkov, TermType

__all__ = ["amplitude_of", "amplitude_symbols", "estimate_of", "holder_of", "louder", "with_factor"]

_SIZES, _TIME, _LINE = ("sigma", "q"), "T", ("amplitude", "frequency")


def amplitude_of(term: TermType) -> float:
    """The size of a term; that of a Gauss-Markov term is its sigma."""
    return term.sigma if isinstance(term, GaussMarkov) else float(getattr(term, term.symbols[0]))


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
    """The term that a parameter belongs to; None without one. The slower Gauss-Markov term may stand alone."""
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
    sizes = [e for e in model.estimates if e.symbol.partition("_")[0] not in (_TIME, _LINE[1])]
    return max(
        (e for e in sizes if holder_of(e.symbol, model.terms) is term),
        key=lambda e: e.supported,
        default=None,
    )


def with_factor(terms: Sequence[TermType], symbol: str, factor: float) -> tuple[TermType, ...]:
    """The terms with one parameter times a factor; with another T a Gauss-Markov term keeps its sigma."""
    holder = holder_of(symbol, terms)
    return tuple(_changed(t, symbol.partition("_")[0], factor) if t is holder else t for t in terms)


def louder(term: TermType, factor: float) -> TermType:
    """The term with so many times its amplitude."""
    symbol = term.symbols[0]
    return replace(term, **{symbol: getattr(term, symbol) * factor})


def _changed(term: TermType, name: str, factor: float) -> TermType:
    if isinstance(term, GaussMarkov) and name == _TIME:
        return GaussMarkov.from_sigma(term.sigma, term.T * factor)
    if name == _LINE[1]:
        return replace(term, **{name: getattr(term, name) * factor})
    return louder(term, factor)


def _by_time(markov: Sequence[TermType]) -> list[TermType]:
    return sorted(markov, key=lambda t: t.T if isinstance(t, GaussMarkov) else 0.0)
