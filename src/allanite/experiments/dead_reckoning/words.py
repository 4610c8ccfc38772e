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


def errors(seconds: float, at: Mapping[str, float], share: float, source: str) -> str:
    """What is wrong at the end, and which source has the largest share of the variance."""
    most = f", {100 * share:.0f} % of its variance from {source}" if share > 0 else ""
    return (
        f"after {_time(seconds)} unaided the horizontal position error is {_metres(at['position_horizontal'])}{most}; "
        f"velocity {at['velocity_horizontal']:.3g} m/s, tilt {math.degrees(at['tilt']):.3g} deg, heading "
        f"{math.degrees(at['heading']):.3g} deg (one standard deviation)"
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
    return (
        f"from {_time(seconds)} on, an attitude error exceeds 10 deg: the linear error model is extrapolated"
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


def _time(seconds: float) -> str:
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size or seconds == size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
