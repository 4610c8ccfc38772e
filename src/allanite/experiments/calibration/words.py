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
        "the unit was held in the hand: turns go from the mean attitude of one rest to the next, and what the hand "
        "does to the means is in the intervals"
    ),
    CalibrationRemark.NO_LATITUDE: (
        "without a latitude the direction of the Earth's rotation is open, and the biases of the gyros contain it as "
        "an uncertainty of up to 15 deg/h"
    ),
    CalibrationRemark.NO_HEADINGS: (
        "no turn tells how the positions were headed, and the gyros do not see the Earth's rotation well enough to "
        "tell it: what is not known of that rotation is in the intervals of their biases"
    ),
}

# -- the reason ---------------------------------------------------------------------------------------------


def astray(miss: float, order: Sequence[str] | None, turned: Sequence[str]) -> str:
    """That the gyros do not go with the accelerometers, and what would make them; see `GyrosAstray`."""
    text = (
        f"the turns by the gyros miss those of gravity by {math.degrees(miss):.0f} deg: the axes of the gyros do not "
        "go with those of the accelerometers, or their unit is wrong"
    )
    if order is None:
        return text
    text += "; they go together"
    if order:
        text += f" with --gyro {for_shell(','.join(order))}"
    if turned:
        text += (
            f" when the sign of {', '.join(turned)} is turned; if the axes of the accelerometers are left-handed, turn "
            "one of these instead"
        )
    return text


def do_not_go(outliers: Sequence[str]) -> str:
    """That positions or turns contradict the others."""
    one = len(outliers) == 1
    phrase = "does not go with what all others say" if one else "do not go with what the others say"
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
    return f"{some_determined(used, estimated, count)} and hardly tell how far they scatter"


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
    return f"the {what} scatter {ratio:.3g} times as much as the noise says, which widens the intervals: {reasons}"


def earth_seen(length: float, expected: float) -> str:
    """That the gyros see another rotation than that of the Earth."""
    return (
        f"the gyros at rest see a rotation of {length / DEG_H:.4g} deg/h where the Earth has {expected / DEG_H:.4g}: "
        "wrong latitude, biases that follow gravity, or a unit that turned"
    )


def alone(parameter: str) -> str:
    """That accelerometers alone say something else; most of all of one parameter: "bias_z"."""
    return (
        "the accelerometers alone give other parameters than accelerometers and gyros together, most of all their "
        f"{parameter.replace('_', ' ')}: a rest that was none, axes that do not belong together, or clocks that differ"
    )


# -- advice -------------------------------------------------------------------------------------------------


def contradict(outliers: Sequence[str], numbers: Iterable[str]) -> str:
    """What to do about positions and turns that contradict the rest; `numbers` as --without takes them."""
    one = len(outliers) == 1
    phrases = ("it contradicts", "look at it") if one else ("they contradict", "look at them")
    return (
        f"{', '.join(outliers)}: {phrases[0]} the rest; {phrases[1]} in the pictures and, if something happened there, "
        f"calibrate without (--without {','.join(numbers)})"
    )


def temperature_went(low: float, high: float) -> str:
    """That the temperature may explain a scatter."""
    return (
        f"the temperature went from {low:.3g} to {high:.3g}: slopes of the biases with it may explain the scatter "
        f"(--reference-temperature {(low + high) / 2:.0f})"
    )


def add(positions: Sequence[str]) -> str:
    """Which positions to add."""
    return f"to estimate what is left open, add: {'; '.join(positions)}"


# -- remarks ------------------------------------------------------------------------------------------------


def standard_gravity(gravity: float) -> str:
    """That gravity was taken for granted."""
    return (
        f"gravity was taken as {gravity:g} m/s²: on the ground it differs by up to 0.3 % from place to place, and the "
        "scale factors of the accelerometers with it; give the latitude and the height, or gravity itself"
    )


def follows_gravity(largest: float) -> str:
    """That the biases of the gyros follow gravity, by so much [rad/s] for 1 g."""
    return (
        f"the biases of the gyros follow gravity, by up to {math.degrees(largest):.3g} deg/s for 1 g; this was fitted "
        "too, and is part of the calibration"
    )


def not_used(what: str, why: str) -> str:
    """That turns or positions were left out."""
    return f"{what}: not used, {why}"


def scatter_tells(dofs: Iterable[tuple[str, float]]) -> str:
    """That the noise is that of the scatter: kinds of observations with their degrees of freedom."""
    of = ", ".join(f"{what}: {dof:.3g} degrees of freedom" for what, dof in dofs)
    return (
        f"nothing but the scatter of the positions tells their noise ({of}); intervals are by Student's law"
    )
