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
    "ends",
    "errors",
    "extrapolated",
    "inflated",
    "no_model",
    "not_linear",
    "not_resolved",
    "second_order",
    "time_words",
    "undecided",
]

NOTHING_STATED = "no initial errors are stated: turn-on biases and alignment are not included"
VERTICAL_KEPT = (
    "the bias of the vertical accelerometer stays in the height; --remove-vertical (vertical=True) removes it at "
    "rest"
)
VERTICAL_REMOVED = (
    "the bias of the vertical accelerometer is removed at rest, with normal gravity as the reference: a local anomaly "
    "of 10 mGal adds 1e-4 m/s² t²/2 to the height, which is not included"
)
NO_INTERVALS = "a model states no intervals (a data sheet, words), so the totals have none"

_ENDS = {
    "position_horizontal": ("horizontal position error", "a quarter of the Earth's radius"),
    "position_down": ("unaided height error", "a tenth of the Earth's radius"),
}


def errors(seconds: float, at: Mapping[str, float], share: float, source: str, *, ends: bool) -> str:
    """The errors after a time, and which source has the largest share; whether the linear model `ends` there."""
    later = "; later errors are not resolved" if ends else ""
    most = f", {100 * share:.0f} % of its variance from {source}" if share > 0 else ""
    return (
        f"after {time_words(seconds)} unaided the horizontal position error is "
        f"{_metres(at['position_horizontal'])}{most}; velocity {at['velocity_horizontal']:.3g} m/s, tilt "
        f"{math.degrees(at['tilt']):.3g} deg, heading {math.degrees(at['heading']):.3g} deg (one standard "
        f"deviation; position, velocity and tilt: root sum of squares of north and east){later}"
    )


def no_model(sensor: str) -> str:
    """One kind of sensor has none."""
    return f"no noise model of the {sensor}s: their errors are not included"


def second_order(sinking: float) -> str:
    """What a linear model leaves out of the height."""
    return (
        f"the tilt shifts the height by {_metres(sinking)} at the end, on average: the linear model omits this "
        "second-order effect, and so does the standard deviation of the height"
    )


def not_resolved(names: Sequence[str]) -> str:
    """Sources that have an upper limit alone."""
    return (
        f"not resolved by the record: {', '.join(names)}; the standard deviations exclude them, and the upper ends of "
        "the intervals include their upper limits"
    )


def not_linear(seconds: float) -> str:
    """From when an attitude is beyond the linear model."""
    return f"from {time_words(seconds)} on, an attitude error exceeds 10 deg: the linear error model is extrapolated"


def ends(seconds: float, quantity: str) -> str:
    """From when nothing is resolved, and the error that leaves the linear model there."""
    what, limit = _ENDS.get(quantity, (f"{quantity} error", "1 rad"))
    aided = "; an aided height extends it (--height held, held=True)" if quantity == "position_down" else ""
    return (
        f"not resolved beyond {time_words(seconds)}: the linear error model ends where the {what} reaches "
        f"{limit}{aided}"
    )


def inflated(name: str) -> str:
    """A model is a bound."""
    return f"{name}: the model is an upper bound of the noise"


def undecided(position: float) -> str:
    """What the other family of noise would make of the position."""
    return (
        "the record cannot decide between flicker and a Gauss-Markov term; with the other family the horizontal "
        f"position error is {_metres(position)} at the end"
    )


def extrapolated(record: float) -> str:
    """The record is shorter than the budget."""
    return f"the record is {duration(record)} long: the noise models are extrapolated beyond that"


def _metres(value: float) -> str:
    return f"{value / 1000:.3g} km" if value >= 2000 else f"{value:.3g} m"


def time_words(seconds: float) -> str:
    """A time, in a larger unit from two of it on, or where it is one."""
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size or seconds == size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
