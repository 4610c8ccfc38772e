# SPDX-License-Identifier: BSD-3-Clause
"""From the set of a parameter to its estimate: the rules, and the words, that all fits share."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from allanite.noise import SIGMA_PER_B, Estimate

__all__ = ["amplitude_estimate", "equivalent_flicker", "limit_estimate", "time_estimate"]

Ends = tuple[float, float]


def amplitude_estimate(
    symbol: str, ends: Ends, value: float, fallback: Callable[[], float], *, supported: bool, measured: str
) -> Estimate:
    """The estimate of an amplitude.

    Parameters
    ----------
    ends : (float, float)
        Of its set, which holds `value` unless that is 0.
    value : float
        In the model of the terms that are supported or needed; 0 where the model does without.
    fallback : callable
        In the full family: the estimate of a supported term that the model does without.
    measured : str
        What was fitted, for the note: "curve", "record", "spectrum".
    """
    low, high = ends
    if not supported:
        needed = f"; not resolved by itself, but the {measured} needs this term or one like it"
        return limit_estimate(symbol, high, needed if value > 0 else "")
    if value > 0:
        return Estimate(symbol=symbol, value=value, lower=low, upper=high, supported=True)
    note = "estimate of the full family"
    return Estimate(symbol=symbol, value=fallback(), lower=low, upper=high, supported=True, note=note)


def limit_estimate(symbol: str, upper: float, remark: str = "") -> Estimate:
    """An upper limit."""
    note = "upper limit" + remark
    return Estimate(symbol=symbol, value=None, lower=0.0, upper=upper, supported=False, note=note)


def equivalent_flicker(sigma: Estimate) -> Estimate:
    """B_equiv: the flicker coefficient with the same maximum of the Allan deviation as a Gauss-Markov term."""
    value = None if sigma.value is None else sigma.value / SIGMA_PER_B
    return replace(
        sigma,
        symbol=sigma.symbol.replace("sigma", "B_equiv"),
        value=value,
        lower=sigma.lower / SIGMA_PER_B,
        upper=sigma.upper / SIGMA_PER_B,
    )


def time_estimate(symbol: str, ends: Ends | None, limits: Ends, value: float) -> Estimate:
    """The estimate of a correlation time.

    Parameters
    ----------
    ends : (float, float), optional
        Of its set; none where no Gauss-Markov term is supported.
    limits : (float, float)
        Between which times were looked for: an end that reaches them is none.
    value : float
        Of the model, within the set.
    """
    if ends is None:
        note = "no Gauss-Markov term is supported"
        return Estimate(symbol=symbol, value=None, lower=0.0, upper=math.inf, supported=False, note=note)
    (low, high), (shortest, longest) = ends, limits
    starts, stops = low > shortest * 1.001, high < longest / 1.001
    missing = " and ".join(word for word, there in (("lower", starts), ("upper", stops)) if not there)
    return Estimate(
        symbol=symbol,
        value=value,
        lower=low if starts else 0.0,
        upper=high if stops else math.inf,
        supported=starts and stops,
        note=f"not identified: the record sets no {missing} end" if missing else "",
    )
