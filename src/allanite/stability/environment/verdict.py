# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on the environment of a channel, with its reason and advice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.stability.environment.correction import LEAST

if TYPE_CHECKING:
    from allanite.stability.environment.results import Coefficient, EnvironmentEstimate

__all__ = ["judge"]

#: An attenuation from here on is told.
NOTABLE = 0.02


def judge(estimate: EnvironmentEstimate) -> dict[str, Any]:
    """Verdict, reason and advice of an estimate."""
    if estimate.thermometer is None:
        warm = estimate.warm_up
        verdict = "warm-up found" if warm.found else "no warm-up"
        return {"verdict": verdict, "reason": warm.says, "advice": tuple(_advice(estimate))}
    first = estimate.coefficients[0]
    return {
        "verdict": first.status,
        "reason": _reason(first),
        "advice": tuple(_advice(estimate)),
    }


def _reason(first: Coefficient) -> str:
    if first.value is None or first.sd is None:
        return first.note
    size = f"the coefficient of the temperature is {abs(first.value) / first.sd:.1f} standard deviations from zero"
    if first.status == "not separable":
        return f"{size} beside a drift of the sensor itself; {first.note}"
    return size


def _advice(estimate: EnvironmentEstimate) -> list[str]:
    advice = []
    first = estimate.coefficients[0] if estimate.coefficients else None
    if first is not None and first.status == "not separable":
        advice.append("let the temperature come back: up and down again tells it from a drift")
    elif first is not None and first.status == "not resolved":
        advice.append(
            "nothing was removed for the temperature; a larger or repeated change of it would show more"
        )
    if estimate.attenuation is not None and estimate.attenuation > NOTABLE:
        advice.append(
            f"noise of the thermometer makes the coefficient of the temperature about {estimate.attenuation:.0%} too "
            "small"
        )
    if estimate.thermometer is not None and estimate.thermometer.missing > 0:
        advice.append(
            f"the temperature is missing in {estimate.thermometer.missing:.1%} of the record and was interpolated there"
        )
    if estimate.hysteresis is not None and estimate.hysteresis.status == "found":
        advice.append(f"{estimate.hysteresis.says}: it was not removed, and the residual holds it")
    warm = estimate.warm_up
    if warm.found and warm.action == "left in":
        advice.append(
            f"a warm-up is in the record, and was left there: {warm.says}; model it or cut it "
            "(--warm-up model, --warm-up cut)"
        )
    if estimate.correction is not None and estimate.correction.longest < estimate.correction.tau[-1]:
        advice.append(
            f"from an averaging time of {estimate.correction.longest:.3g} s on, what was removed holds more than "
            f"{1 - LEAST:.0%} of the noise: these lags do not enter the noise model"
        )
    return advice
