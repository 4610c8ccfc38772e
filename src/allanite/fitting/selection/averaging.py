# SPDX-License-Identifier: BSD-3-Clause
"""Parameters with what is open about the set of terms.

An interval that takes the chosen set for granted covers too little: the choice was made with the same record. Here a
parameter has, in each candidate, a normal law of its logarithm at the maximum, with the covariance of the expected
information; where a candidate does without it, it is zero; and the candidates are mixed by their weights [1]. The ends
of the interval are quantiles of that mixture. A lower end of zero makes it an upper limit.

References
----------
.. [1] S. T. Buckland, K. P. Burnham, N. H. Augustin, "Model selection: an integral part of inference", Biometrics 53
   (1997) 603.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.fitting.estimates import equivalent_flicker
from allanite.fitting.likelihood import Maximum
from allanite.noise import Estimate
from allanite.quantities.distributions import normal_quantile

__all__ = ["averaged"]

_WIDEST = 25.0  # in ln: beyond it an end is open
#: Of a correlation time and of lines a candidate without them says nothing, rather than zero.
_NOTHING_WITHOUT = ("T", "T_2")
_NOTE = "averaged over the sets of terms by their weight"


def averaged(
    maxima: Sequence[Maximum], weights: Sequence[float], confidence: float = 0.95
) -> tuple[Estimate, ...]:
    """The parameters of the first set, with intervals over all of them.

    Parameters
    ----------
    maxima : sequence of Maximum
        The best set first.
    weights : sequence of float
        Their sum is the weight that is known of.
    """
    estimates = [_estimate(symbol, maxima, weights, confidence) for symbol in _symbols(maxima[0])]
    return tuple(
        e
        for one in estimates
        for e in ((one, equivalent_flicker(one)) if one.symbol.startswith("sigma") else (one,))
    )


def _symbols(best: Maximum) -> list[str]:
    return [s for s in best.parameters if not s.startswith(("amplitude", "frequency"))]


def _estimate(
    symbol: str, maxima: Sequence[Maximum], weights: Sequence[float], confidence: float
) -> Estimate:
    laws = [(*_law(m, symbol), w) for m, w in zip(maxima, weights, strict=True)]
    if symbol in _NOTHING_WITHOUT:
        laws = [law for law in laws if law[0] > 0]
    total = sum(w for *_, w in laws)
    tail = (1 - confidence) / 2
    value = maxima[0].parameters[symbol]
    low, high = (_quantile(laws, total, q) for q in (tail, 1 - tail))
    if value > 0 and low > 0 and (symbol not in _NOTHING_WITHOUT or math.isfinite(high)):
        return Estimate(symbol=symbol, value=value, lower=low, upper=high, supported=True, note=_NOTE)
    note = "upper limit" if symbol not in _NOTHING_WITHOUT else "not identified"
    return Estimate(
        symbol=symbol, value=None, lower=0.0, upper=high, supported=False, note=f"{note}; {_NOTE}"
    )


def _law(maximum: Maximum, symbol: str) -> tuple[float, float]:
    """Value and standard deviation of its logarithm; (0, 0) where the candidate does without it."""
    value = maximum.parameters.get(symbol, 0.0)
    symbols = maximum.covariance.get("symbols", [])
    if not value > 0 or symbol not in symbols:
        return 0.0, 0.0
    i = symbols.index(symbol)
    return value, math.sqrt(max(maximum.covariance["matrix"][i][i], 0.0))


def _quantile(laws: Sequence[tuple[float, float, float]], total: float, q: float) -> float:
    """Quantile of the mixture; 0 where the sets without the parameter have more weight than q."""
    present = [(math.log(v), max(sd, 1e-12), w / total) for v, sd, w in laws if v > 0]
    absent = sum(w for v, _, w in laws if not v > 0) / total if total > 0 else 1.0
    if absent >= q or not present:
        return 0.0
    low, high = (
        f(m + s * normal_quantile(p) for m, sd, _ in present for s in (sd,) for p in (1e-12, 1 - 1e-12))
        for f in (min, max)
    )
    for _ in range(100):
        middle = (low + high) / 2
        below = absent + sum(w * 0.5 * math.erfc((m - middle) / sd / math.sqrt(2)) for m, sd, w in present)
        low, high = (middle, high) if below < q else (low, middle)
    return math.exp(high) if high < max(m for m, *_ in present) + _WIDEST else math.inf
