# SPDX-License-Identifier: BSD-3-Clause
"""Heavy tails of the white noise in the interval of N, and N without contaminated samples.

Independent samples of excess kurtosis g add g/n to the relative variance of N^2 and touch no other parameter
(`allanite.recording.health.tails`). In the logarithm, with z the quantile of the normal law, an end of the interval of
N moves from ln l to ln v - sqrt((ln v - ln l)^2 + g z^2/(4 n)), and the upper end likewise.

N without the contaminated samples is the deviation of the others times the square root of the sample interval, with the
error that it has in the fit of the mixture.
"""

from __future__ import annotations

import math
from dataclasses import replace

from allanite.fitting.contamination import Contamination
from allanite.noise import Estimate, NoiseModel
from allanite.quantities.display_units import si_unit
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.quantity import Quantity
from allanite.recording.health.tails import TailLaw, Tails

__all__ = ["contamination_of", "with_tails"]


def with_tails(model: NoiseModel, tails: Tails, n_samples: int) -> NoiseModel:
    """A fitted model whose interval of N holds the excess kurtosis of the white noise.

    Parameters
    ----------
    model : NoiseModel
        Fitted as if the noise were Gaussian.
    tails : Tails
    n_samples : int
        Samples that took part in the fit.

    Returns
    -------
    NoiseModel
        The same where the tails are those of a normal law, or not known, and where N is not resolved.
    """
    if (
        tails.law not in (TailLaw.CONTAMINATED, TailLaw.HEAVY)
        or tails.kurtosis <= 0.0
        or model.family == "slopes"
    ):
        return model
    other = None if model.alternative is None else with_tails(model.alternative, tails, n_samples)
    shift = _quantile(model) * 0.5 * math.sqrt(tails.kurtosis / n_samples)
    estimates = tuple(_widened(e, shift) if e.symbol == "N" else e for e in model.estimates)
    return replace(model, estimates=estimates, alternative=other)


def contamination_of(model: NoiseModel, tails: Tails, scale: float, dt: float) -> Contamination | None:
    """N with and without the contaminated samples; None where the noise is not contaminated.

    Parameters
    ----------
    model : NoiseModel
        After `with_tails`.
    scale : float
        SI value of one unit of the samples.
    dt : float [s]
        Sample interval.
    """
    n = next((e for e in model.estimates if e.symbol == "N" and e.supported and e.value), None)
    if tails.law is not TailLaw.CONTAMINATED or n is None or n.value is None:
        return None
    unit = si_unit(model.kind, "N", model.unit)
    without = tails.core * abs(scale) * math.sqrt(dt)
    spread = math.exp(_quantile(model) * tails.core_sd)
    return Contamination(
        share=tails.share,
        share_sd=tails.share_sd,
        ratio=tails.ratio,
        ratio_sd=tails.ratio_sd,
        excess_kurtosis=tails.kurtosis,
        N=Quantity.of(n.value, (n.lower, n.upper), unit),
        N_without=Quantity.of(without, (without / spread, without * spread), unit),
        confidence=model.confidence,
    )


def _quantile(model: NoiseModel) -> float:
    return normal_quantile(0.5 + model.confidence / 2)


def _widened(estimate: Estimate, shift: float) -> Estimate:
    value, lower, upper = estimate.value, estimate.lower, estimate.upper
    if not estimate.supported or value is None or value <= 0:
        return replace(estimate, upper=upper * math.exp(shift))

    def far(low: float, high: float) -> float:
        return (
            math.exp(math.hypot(max(math.log(high / low), 0.0), shift))
            if 0 < low and high < math.inf
            else math.inf
        )

    return replace(estimate, lower=value / far(lower, value), upper=value * far(value, upper))
