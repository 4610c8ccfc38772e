# SPDX-License-Identifier: BSD-3-Clause
"""The noise model that a filter is to be told for a sensor in motion.

Integration weights a density by 1/f^2: white noise of density N^2 from f_1 to f_2 leaves the same error of an angle (a
velocity) as the signal there if

    N^2 = integral of S/f^2 df / integral of 1/f^2 df,   a line of amplitude A adding A^2/(4 f^2) to the first.   (1)
"""

from __future__ import annotations

from dataclasses import replace

from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, Sinusoid, TermType, White
from allanite.noise.model import Estimate
from allanite.noise.motion import MotionInflation
from allanite.noise.parameters import louder

__all__ = ["is_slow", "told_model"]

#: Symbols of the amplitudes of a bias that changes, without what follows "_".
_SLOW = ("B", "K", "q", "sigma")


def is_slow(term: TermType) -> bool:
    """Whether a term is one of a bias that changes."""
    return isinstance(term, (Flicker, GaussMarkov, RandomWalk))


def told_model(rest: NoiseModel, facts: MotionInflation, noise: float) -> NoiseModel:
    """A model at rest, with white noise `noise` [SI/√Hz] and slow terms as many times as large as `facts` state."""
    if rest.alternative is not None:
        alone = told_model(replace(rest, alternative=None), facts, noise)
        return replace(alone, alternative=told_model(rest.alternative, facts, noise))
    changed = facts.noise != 1
    kept = [t for t in rest.terms if not (changed and isinstance(t, (White, Sinusoid)))]
    terms = [louder(term, facts.slow) if is_slow(term) else term for term in kept]
    estimates = [_times_estimate(e, facts.slow) for e in rest.estimates if not (changed and e.symbol == "N")]
    if changed:
        terms.append(White(N=noise))
        lower, upper = (noise * end / facts.noise for end in (facts.noise_lower, facts.noise_upper))
        if rest.estimates:
            estimates.append(Estimate(symbol="N", value=noise, lower=lower, upper=upper, supported=True))
    return replace(
        rest,
        terms=tuple(terms),
        estimates=tuple(estimates),
        covariance={},
        goodness={},
        verdict="; ".join(facts.reasons),
        in_motion=facts,
    )


def _times_estimate(estimate: Estimate, factor: float) -> Estimate:
    if estimate.symbol.partition("_")[0] not in _SLOW:
        return estimate
    value = None if estimate.value is None else factor * estimate.value
    return replace(
        estimate, value=value, lower=factor * estimate.lower, upper=factor * estimate.upper, statistical=None
    )
