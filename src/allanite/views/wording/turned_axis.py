# SPDX-License-Identifier: BSD-3-Clause
"""Words for an axis that was turned: between north and south, or between up and down."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.experiments.reversals import Reversals
from allanite.experiments.reversals.sides import is_vertical, sides_of, triple_of
from allanite.plain_files.counted import plural
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import interval, number
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.views.wording.rates import EarthRateWording, estimate_of, known_rate

if TYPE_CHECKING:
    from allanite.experiments.earth_rate import EarthRateEstimate
    from allanite.experiments.earth_rate.results import AxisComponent, RateReading

__all__ = ["axis_facts", "earth_rate_lines", "function_of_latitude", "turn_words", "unstated_words"]

_SOURCES = {
    "detected": "found in the signal",
    "file": "from a file",
    "period": "by the clock",
    "none": "none found",
}


def function_of_latitude(first: str) -> str:
    """What takes the latitude to the part of the Earth's rotation along the axis: "sine" or "cosine"."""
    return "sine" if is_vertical(first) else "cosine"


def turn_words(reversals: Reversals) -> str:
    """How many turns and dwells, where they come from, and what is left out."""
    turns, dwells = len(reversals.turns), len(reversals.dwells)
    unknown = sum(d.sign == 0 for d in reversals.dwells)
    if not turns:
        return "no turns"
    unused = f" ({unknown} of unknown direction, not used)" if unknown else ""
    return (
        f"{plural(turns, 'turn')} {_SOURCES[reversals.source]}, {plural(dwells, 'dwell')}{unused}, "
        f"{reversals.dead_time:g} s left out after each turn"
    )


# -- estimates --------------------------------------------------------------------------------------------


def earth_rate_lines(estimate: EarthRateEstimate) -> list[EarthRateWording]:
    """The regression, the simple estimators beside it with the same confidence, and the known rate."""
    note = f"{100 * estimate.confidence:g} % interval, everything in the budget included"
    main = estimate_of(estimate.rate, *estimate.interval, name="regression", note=note, kept=True)
    simple = [_reading_line(estimate, reading) for reading in estimate.readings]
    return [main, *simple, known_rate(estimate.earth_rate)]


def _reading_line(estimate: EarthRateEstimate, reading: RateReading) -> EarthRateWording:
    quantile = normal_quantile((1 + estimate.confidence) / 2)
    name, note = _reading_words(estimate.first, reading.name)
    if reading.scatter is not None:
        alone = f"±{number(quantile * reading.scatter / DEG_H, 2)} ({100 * estimate.confidence:g} %)"
        note += f"; from the scatter of its {reading.count} values alone {alone}"
    half = quantile * reading.sd
    return estimate_of(reading.rate, reading.rate - half, reading.rate + half, name=name, note=note)


def _reading_words(first: str, name: str) -> tuple[str, str]:
    """Name and note of a simple estimator."""
    plus, minus = sides_of(first)
    function = "sin" if is_vertical(first) else "cos"
    notes = {
        "pairs": f"the seed paper's estimator: ({plus} − {minus}) / (2 {function} latitude)",
        triple_of(first): "three dwells at a time; cancels a linear drift",
    }
    return "pairs of dwells" if name == "pairs" else name, notes.get(name, "")


# -- the axis itself --------------------------------------------------------------------------------------


def axis_facts(estimate: EarthRateEstimate) -> list[tuple[str, str]]:
    """What the axis saw beside what is expected of it, and the g-sensitivity of a vertical axis; each with its name."""
    component, gravity = estimate.component, estimate.g_sensitivity
    if math.isnan(component.value):
        return []
    plus, minus = sides_of(estimate.first)
    expected = component.expected / DEG_H
    sd = abs(expected) * estimate.budget.get("latitude", 0.0) / estimate.earth_rate
    by = f" (standard deviation {number(sd, 2)} by the latitude)" if sd else ""
    of_latitude = f"the known rate times the {function_of_latitude(estimate.first)} of the latitude"
    facts = [
        ("Component", f"{_with_ends(component, DEG_H, 'deg/h')} {plus}"),
        ("Expected", f"{expected:.3f} deg/h {plus}, {-expected:.3f} deg/h {minus}{by}: {of_latitude}"),
    ]
    if gravity is not None:
        words = _with_ends(gravity, DEG_H / STANDARD_GRAVITY, "deg/h/g")
        facts.append(("G-sensitivity", f"{words} if the Earth turns at its known rate"))
    return facts


def unstated_words(first: str) -> str:
    """That nothing is stated beside the noise."""
    last = "g-sensitivity" if is_vertical(first) else "heading"
    return (
        "The interval includes only the noise: no uncertainty of scale factor, latitude, tilt or "
        f"{last} is stated."
    )


def _with_ends(component: AxisComponent, factor: float, unit: str) -> str:
    if not math.isfinite(component.lower + component.upper):
        return f"{number(component.value / factor, 5)} {unit}"
    value, lower, upper = interval(*(v / factor for v in (component.value, *component.interval)))
    return f"{value} {unit} [{lower}, {upper}]"
