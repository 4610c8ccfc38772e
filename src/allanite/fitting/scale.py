# SPDX-License-Identifier: BSD-3-Clause
"""The uncertainty of a scale factor in the intervals of a fitted model: one relative error, common to all amplitudes.

A wrong scale factor multiplies every amplitude by the same number and no correlation time or frequency of a line by
any. In the logarithm it adds to the statistical error, and the two are independent. With u the standard uncertainty of
the scale factor, relative to it, and z the quantile of the normal law, an end of an interval moves from ln l to

    ln v - sqrt((ln v - ln l)^2 + (z u)^2)

and the upper end likewise. An upper limit has no estimate in its middle: it is multiplied by exp(z u), z one-sided,
which is the wider: sqrt(a^2 + b^2) <= a + b.
"""

from __future__ import annotations

import math
from dataclasses import replace

from allanite.noise import Estimate, NoiseModel
from allanite.quantities.distributions import normal_quantile

__all__ = ["with_scale_uncertainty"]


def with_scale_uncertainty(model: NoiseModel, relative: float | None) -> NoiseModel:
    """A fitted model whose intervals hold the uncertainty of the scale factor besides the statistical one.

    Parameters
    ----------
    model : NoiseModel
        With statistical intervals alone.
    relative : float or None
        Standard uncertainty of the scale factor, relative to it; None where none is stated.

    Returns
    -------
    NoiseModel
        Each estimate keeps its statistical ends; `covariance` is statistical still.
    """
    if relative is None or model.family == "slopes":
        return model
    other = None if model.alternative is None else with_scale_uncertainty(model.alternative, relative)
    estimates = tuple(_widened(e, relative, model.confidence) for e in model.estimates)
    return replace(model, estimates=estimates, alternative=other, scale_uncertainty=relative)


def _widened(estimate: Estimate, relative: float, confidence: float) -> Estimate:
    if estimate.symbol.startswith(("T", "frequency")):  # of time, which no scale factor touches
        return estimate
    lower, upper, value = estimate.lower, estimate.upper, estimate.value
    if not estimate.supported or value is None or value <= 0:
        upper *= math.exp(normal_quantile(confidence) * relative)
    else:
        shift = normal_quantile(0.5 + confidence / 2) * relative
        lower = value * math.exp(-math.hypot(_distance(lower, value), shift)) if lower > 0 else 0.0
        upper = value * math.exp(math.hypot(_distance(value, upper), shift))
    return replace(estimate, lower=lower, upper=upper, statistical=(estimate.lower, estimate.upper))


def _distance(low: float, high: float) -> float:
    """Of two numbers in the logarithm; none where they are the other way round."""
    return max(math.log(high / low), 0.0) if math.isfinite(high) else math.inf
