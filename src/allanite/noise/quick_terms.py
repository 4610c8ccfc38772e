# SPDX-License-Identifier: BSD-3-Clause
"""Gauss-Markov terms of a few samples, as averaging times well above them see them: as white noise.

A term of drive q and correlation time T has the density (q T)^2 well below the frequency 1/(2 pi T). A consumer that
has no state for it needs N of all that is white there, which is what the Allan deviation reads as angle random walk.
"""

from __future__ import annotations

import math
from dataclasses import replace

from allanite.noise.model import Estimate, NoiseModel
from allanite.noise.terms import GaussMarkov, TermType, White

__all__ = ["QUICK", "is_quick", "with_quick_terms_white"]

#: Correlation time [samples] below which a Gauss-Markov term is the sensor's bandwidth rather than its bias.
QUICK = 16.0
_OF_MARKOV = ("sigma", "B_equiv", "T")


def is_quick(T: float) -> bool:
    """True for a correlation time [samples] of the sensor's bandwidth."""
    return T < QUICK * (1 - 1e-9)


def with_quick_terms_white(model: NoiseModel, dt: float) -> NoiseModel:
    """A fitted model whose supported Gauss-Markov terms of a few samples are part of its white noise.

    Parameters
    ----------
    dt : float [s]
        Sample interval.

    Returns
    -------
    NoiseModel
        Itself where it has no such term. The ends of N are those of its parts, all low or all high at once: a little
        wide.
    """
    quick = [tag for tag in ("", "_2") if _is_quick_term(model, tag, dt)]
    if not quick:
        return model
    estimates = model.estimates
    for tag in quick:
        estimates = _joined(estimates, tag)
    if quick == [""]:  # the slower of two is the only one left
        estimates = tuple(replace(e, symbol=e.symbol.removesuffix("_2")) for e in estimates)
    density, rest = 0.0, list[TermType]()
    for term in model.terms:
        if isinstance(term, White):
            density += term.N**2
        elif isinstance(term, GaussMarkov) and is_quick(term.T / dt):
            density += (term.q * term.T) ** 2
        else:
            rest.append(term)
    return replace(model, terms=(White(N=math.sqrt(density)), *rest), estimates=estimates, covariance={})


def _is_quick_term(model: NoiseModel, tag: str, dt: float) -> bool:
    sigma, T = model.estimate(f"sigma{tag}"), model.estimate(f"T{tag}")
    if sigma is None or T is None or not sigma.supported or sigma.value is None or T.value is None:
        return False
    return is_quick(T.value / dt) and math.isfinite(T.upper)


def _joined(estimates: tuple[Estimate, ...], tag: str) -> tuple[Estimate, ...]:
    """N with the density of a term, and no estimate of that."""
    sigma, T = (next(e for e in estimates if e.symbol == f"{s}{tag}") for s in ("sigma", "T"))
    parts = [s * math.sqrt(2 * t) for s, t in zip(_numbers(sigma), _numbers(T), strict=True)]
    note = f"with Gauss-Markov noise of T {T.value:.3g} s, which is white for averaging times well above it"

    def joined(N: Estimate) -> Estimate:
        value, lower, upper = (math.hypot(n, p) for n, p in zip(_numbers(N), parts, strict=True))
        return Estimate(symbol="N", value=value, lower=lower, upper=upper, supported=True, note=note)

    gone = {f"{s}{tag}" for s in _OF_MARKOV}
    return tuple(joined(e) if e.symbol == "N" else e for e in estimates if e.symbol not in gone)


def _numbers(e: Estimate) -> tuple[float, float, float]:
    return e.value or 0.0, e.lower, e.upper
