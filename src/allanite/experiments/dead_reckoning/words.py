# SPDX-License-Identifier: BSD-3-Clause
"""Sentences of a budget of dead reckoning, of the values in them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from allanite.quantities.number_words import duration

__all__ = [
    "NOTHING_STATED",
    "NO_INTERVALS",
    "VERTICAL_KEPT",
    "VERTICAL_REMOVED",
    "errors",
    "extrapolated",
    "inflated",
    "no_model",
    "not_linear",
    "not_resolved",
    "second_order",
    "undecided",
]

NOTHING_STATED = (
    "nothing is stated to be wrong at the start: turn-on biases and alignment are not in the sums"
)
VERTICAL_KEPT = (
    "the bias of the vertical accelerometer stays in the height; a rest removes it only with --remove-vertical "
    "(vertical=True)"
)
VERTICAL_REMOVED = (
    "the bias of the vertical accelerometer is removed by the mean at rest, against normal gravity: a local gravity "
    "anomaly of 10 mGal adds 1e-4 m/s² t²/2 to the height, which is not in the sums"
)
NO_INTERVALS = "a model states no intervals (a data sheet, words): there are none of the sums"


def errors(seconds: float, at: Mapping[str, float], share: float, source: str) -> str:
    """What is wrong at the end, and which source has the largest share of the variance."""
    most = f", {100 * share:.0f} % of its variance by {source}" if share > 0 else ""
    return (
        f"after {_time(seconds)} without aiding the horizontal position is wrong by "
        f"{_metres(at['position_horizontal'])}{most}; velocity by {at['velocity_horizontal']:.3g} m/s, tilt by "
        f"{math.degrees(at['tilt']):.3g} deg, heading by {math.degrees(at['heading']):.3g} deg (one standard deviation)"
    )


def no_model(sensor: str) -> str:
    """One kind of sensor has none."""
    return f"no noise model of the {sensor}s: their part is not in the sums"


def second_order(sinking: float) -> str:
    """What a linear model leaves out of the height."""
    return (
        f"the second order of the tilt alone makes the height wrong by {_metres(sinking)} at the end, on average: the "
        "linear model, and with it the standard deviation of the height, leaves it out"
    )


def not_resolved(names: Sequence[str]) -> str:
    """Sources that have an upper limit alone."""
    return (
        f"not resolved by the record: {', '.join(names)}; they are not in the standard deviations, but their upper "
        "limits are in the upper ends"
    )


def not_linear(seconds: float) -> str:
    """From when an attitude is beyond the linear model."""
    return (
        f"from {_time(seconds)} on an attitude is wrong by more than 10 deg: beyond that the linear error model is an "
        "extrapolation"
    )


def inflated(name: str) -> str:
    """A model is a bound."""
    return f"{name}: the model is inflated to lie above the sensor"


def undecided(position: float) -> str:
    """What the other family of noise would make of the position."""
    return (
        "the record cannot decide between flicker and a Gauss-Markov term; with the other family the horizontal "
        f"position is wrong by {_metres(position)} at the end"
    )


def extrapolated(record: float) -> str:
    """The record is shorter than the budget."""
    return f"the record is {duration(record)} long: beyond that the noise models are an extrapolation"


def _metres(value: float) -> str:
    return f"{value / 1000:.3g} km" if value >= 2000 else f"{value:.3g} m"


def _time(seconds: float) -> str:
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size or seconds == size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
