# SPDX-License-Identifier: BSD-3-Clause
"""What a self-calibration comes to, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from allanite.experiments.calibration.verdict import CalibrationRemark
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H
from allanite.recording.channel_names import for_shell

__all__ = [
    "REMARKS",
    "add",
    "all_determined",
    "alone",
    "astray",
    "contradict",
    "do_not_go",
    "earth_seen",
    "follows_gravity",
    "hardly_told",
    "none_determined",
    "not_used",
    "scatter_tells",
    "scattered",
    "some_determined",
    "standard_gravity",
    "temperature_went",
    "uncovered",
]

REMARKS = {
    CalibrationRemark.IN_HAND: (
        "the unit was held by hand: turns connect the mean attitudes of successive rests, and the intervals include "
        "the motion of the hand"
    ),
    CalibrationRemark.NO_LATITUDE: (
        "without a latitude the direction of the Earth's rotation is unknown: it adds an uncertainty of up to 15 deg/h "
        "to the gyro biases"
    ),
    CalibrationRemark.NO_HEADINGS: (
        "the headings of the positions are unknown: no turn connects them, and the gyros do not resolve the Earth's "
        "rotation. The intervals of the gyro biases include that rotation"
    ),
}

# -- the reason ---------------------------------------------------------------------------------------------


def astray(miss: float, order: Sequence[str] | None, turned: Sequence[str]) -> str:
    """That the gyros do not go with the accelerometers, and what would make them; see `GyrosAstray`."""
    text = (
        f"the turns measured by the gyros differ from those of gravity by {math.degrees(miss):.0f} deg: the gyro axes "
        "do not match those of the accelerometers, or the unit of the gyros is wrong"
    )
    if order is None:
        return text
    text += "; they match"
    if order:
        text += f" with --gyro {for_shell(','.join(order))}"
    if turned:
        text += (
            f" when the sign of {', '.join(turned)} is reversed; if the accelerometer axes are left-handed, reverse "
            "one of these instead"
        )
    return text


def do_not_go(outliers: Sequence[str]) -> str:
    """That positions or turns contradict the others."""
    one = len(outliers) == 1
    phrase = "disagrees with all others" if one else "disagree with the others"
    return f"{', '.join(outliers)} {phrase}"


def none_determined(used: int) -> str:
    """That nothing was determined."""
    return f"{plural(used, 'position', 'determine')} no parameter"


def all_determined(used: int, count: int, *, widened: bool) -> str:
    """That everything was determined."""
    but = " with intervals widened by scatter beyond the noise" if widened else ""
    return f"{plural(used, 'position', 'determine')} all {count} parameters{but}"


def some_determined(used: int, estimated: int, count: int) -> str:
    """How much was determined."""
    return f"{plural(used, 'position', 'determine')} {estimated} of {count} parameters"


def hardly_told(used: int, estimated: int, count: int) -> str:
    """That the positions are too few for some intervals."""
    return f"{some_determined(used, estimated, count)}, with little left to estimate their scatter"


def uncovered(half_axes: Sequence[str], determined: str) -> str:
    """Which accelerometers were not set up and down, before how much was `determined`."""
    axes = list(dict.fromkeys(words[0] for words in half_axes))
    which = f"accelerometer{'s' * (len(axes) > 1)} {', '.join(axes)}"
    return (
        f"no position has {' or '.join(half_axes)} within 60 deg: bias and scale factor of {which} are not resolved; "
        f"{determined}"
    )


# -- checks -------------------------------------------------------------------------------------------------


def scattered(what: str, ratio: float, reasons: str) -> str:
    """That observations scatter more than the noise."""
    return f"the {what} scatter {ratio:.3g} times as much as the noise predicts, which widens the intervals: {reasons}"


def earth_seen(length: float, expected: float) -> str:
    """That the gyros see another rotation than that of the Earth."""
    return (
        f"the gyros at rest measure a rotation of {length / DEG_H:.4g} deg/h, the Earth's is {expected / DEG_H:.4g}: "
        "wrong latitude, biases that follow gravity, or a unit that turned"
    )


def alone(parameter: str) -> str:
    """That accelerometers alone say something else; most of all of one parameter: "bias_z"."""
    return (
        f"the accelerometers alone give a different {parameter.replace('_', ' ')} than accelerometers and gyros "
        "together: the unit moved during a rest, the axes do not match, or the clocks differ"
    )


# -- advice -------------------------------------------------------------------------------------------------


def contradict(outliers: Sequence[str], numbers: Iterable[str]) -> str:
    """What to do about positions and turns that contradict the rest; `numbers` as --without takes them."""
    one = len(outliers) == 1
    verb, which = ("contradicts", "it") if one else ("contradict", "them")
    return (
        f"{', '.join(outliers)} {verb} the rest: check the pictures and, if something happened there, calibrate "
        f"without {which} (--without {','.join(numbers)})"
    )


def temperature_went(low: float, high: float) -> str:
    """That the temperature may explain a scatter."""
    return (
        f"the temperature ranged from {low:.3g} to {high:.3g} °C: biases that change with it may explain the scatter "
        f"(--reference-temperature {(low + high) / 2:.0f})"
    )


def add(positions: Sequence[str]) -> str:
    """Which positions to add."""
    return f"to determine the other parameters, add: {'; '.join(positions)}"


# -- remarks ------------------------------------------------------------------------------------------------


def standard_gravity(gravity: float) -> str:
    """That gravity was taken for granted."""
    return (
        f"gravity is assumed to be {gravity:g} m/s²: it varies by up to 0.3 % over the ground, and the accelerometer "
        "scale factors with it; give the latitude and the height, or gravity itself"
    )


def follows_gravity(largest: float) -> str:
    """That the biases of the gyros follow gravity, by so much [rad/s] for 1 g."""
    return (
        f"the gyro biases follow gravity, by up to {math.degrees(largest):.3g} deg/s per g; the calibration includes "
        "this dependence"
    )


def not_used(what: str, why: str) -> str:
    """That turns or positions were left out."""
    return f"{what}: not used, {why}"


def scatter_tells(dofs: Iterable[tuple[str, float]]) -> str:
    """That the noise is that of the scatter: kinds of observations with their degrees of freedom."""
    of = ", ".join(f"{what}: {dof:.3g} degrees of freedom" for what, dof in dofs)
    return f"the noise is estimated from the scatter of the positions alone ({of}); intervals use Student's t"
