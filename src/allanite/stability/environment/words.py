# SPDX-License-Identifier: BSD-3-Clause
"""What a record says of the environment of a sensor, in sentences."""

from __future__ import annotations

from allanite.stability.environment.verdict import LagStatus

__all__ = [
    "COME_BACK",
    "NOTHING_REMOVED",
    "attenuation_sentence",
    "interpolation_sentence",
    "lag_sentence",
    "left_in_sentence",
    "longest_sentence",
    "settling_sentence",
    "size_words",
]

COME_BACK = "let the temperature return: a rise and a fall separate its effect from a drift"
NOTHING_REMOVED = (
    "no temperature effect was removed; a larger or repeated change of temperature would show more"
)


def size_words(value: float, sd: float) -> str:
    """How far the coefficient of the temperature is from zero."""
    return f"the temperature coefficient is {abs(value) / sd:.1f} standard deviations from zero"


def lag_sentence(status: LagStatus, value: float | None) -> str:
    """Who follows whom, or why that is not known."""
    if status is not LagStatus.RESOLVED or value is None:
        return status.words
    late, early = ("thermometer", "sensor") if value > 0 else ("sensor", "thermometer")
    return f"the {late} lags behind the {early}; {status.words}"


def settling_sentence(action: str, settled: float | None) -> str:
    """Whether there is a warm-up."""
    if action == "not looked for":
        return "warm-up was not tested"
    if settled is None:
        return "no warm-up: any exponential settling is within the noise"
    return f"the bias settles as after power-on, for about {settled:.3g} s"


def left_in_sentence(settling: str) -> str:
    """What to do about a warm-up that is in the record."""
    return f"the record contains a warm-up: {settling}. Model it or cut it (--warm-up model, --warm-up cut)"


def attenuation_sentence(share: float) -> str:
    """What noise of the thermometer does."""
    return f"thermometer noise makes the temperature coefficient about {share:.0%} too small"


def interpolation_sentence(missing: float) -> str:
    """Where the temperature is missing."""
    return f"the temperature is missing in {missing:.1%} of the record and was interpolated there"


def longest_sentence(longest: float, share: float) -> str:
    """Lags that do not enter a noise model."""
    return (
        f"from an averaging time of {longest:.3g} s on, the removed effects exceed {share:.0%} of the noise: the noise "
        "model does not use these lags"
    )
