# SPDX-License-Identifier: BSD-3-Clause
"""What an alignment comes to, in sentences."""

from __future__ import annotations

import math

from allanite.experiments.alignment.verdict import AlignmentRemark
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN

__all__ = [
    "HEADINGS",
    "NOMINAL",
    "NO_BIAS",
    "REMARKS",
    "biases_hide",
    "if_small",
    "inseparable",
    "leaves",
    "lost",
    "naive_is_wrong",
    "naive_moved",
    "naive_points_elsewhere",
    "not_earth",
    "of_source",
    "other_channels",
    "resolved",
    "something_hides",
    "unseen",
    "upside_down",
]

_EARTH = EARTH_RATE / DEG_H

NOMINAL = (
    "scale factors and misalignments are taken as nominal, and the biases of the accelerometers as zero: their errors "
    "are not in the intervals"
)
NO_BIAS = (
    "nothing is known of the biases of the gyros, and one attitude cannot show them: across the heading they are taken "
    "to be no larger than the length and the vertical part of the rotation show them to be"
)
REMARKS = {
    AlignmentRemark.TURN: (
        "turn the unit by 180 deg about the vertical, or through several positions: that tells the biases from the "
        "Earth"
    ),
    AlignmentRemark.CALIBRATE: (
        "or calibrate the biases of the gyros (allanite calibrate) and say how well they repeat"
    ),
    AlignmentRemark.ROTATING: "if the unit turned all the time, say so (rotation=True, --rotating)",
    AlignmentRemark.WARM_UP: (
        "rest for longer in each position, and let the unit warm up; or take better gyros"
    ),
    AlignmentRemark.LONGER: "record for longer, or with gyros of less noise",
    AlignmentRemark.FASTER: "turn faster, and rest for longer between the turns",
    AlignmentRemark.DOUBT: (
        "is this the right latitude, and do the gyros work? their axes may not see the ground turn"
    ),
    AlignmentRemark.STATE_BIAS: "state how well the biases are known (bias_repeatability, --gyro-bias)",
}
HEADINGS = {
    False: (
        "nothing says by how much the unit was turned from file to file, so that the last one alone is aligned: give "
        "the heading of each from a common mark, first.csv=0 turned.csv=180, or let one log run on during the turns"
    ),
    True: (
        "nothing says by how much the unit was turned from row to row, so that the last one alone is aligned: give a "
        "column heading, from a common mark"
    ),
}
"""That headings are missing, of files and of rows of means."""

_SOURCES = {
    "gyro noise": ("the noise of the gyros leaves", (AlignmentRemark.LONGER,)),
    "gyro bias": ("the biases of the gyros leave", (AlignmentRemark.TURN, AlignmentRemark.CALIBRATE)),
    "turns": ("the azimuth of the turns leaves", (AlignmentRemark.FASTER,)),
}


def of_source(source: str) -> tuple[str, tuple[AlignmentRemark, ...]]:
    """What the largest entry of the budget does, and what to do about it."""
    return _SOURCES.get(source, (f"the {source} leaves", ()))


# -- the reason ---------------------------------------------------------------------------------------------


def inseparable(apparent: float, *, one_attitude: bool) -> str:
    """Why the biases are not told from the Earth; `apparent` is what the gyros show in one attitude."""
    if not one_attitude:
        return "the attitudes do not tell the biases of the gyros from the Earth's rotation"
    excess = abs(apparent / DEG_H - _EARTH)
    unknown = "one attitude, and nothing is known of the biases of the gyros"
    if not excess > 0.1 * _EARTH:
        return f"{unknown}: any heading is possible"
    return (
        f"{unknown}: what they show, {apparent / DEG_H:.4g} deg/h, holds biases of {excess:.3g} deg/h or more, and the "
        f"Earth is {_EARTH:.4g} deg/h"
    )


def biases_hide(bias: float, expected: float) -> str:
    """Why one attitude tells nothing: the biases are as large as the Earth."""
    return (
        "the biases of the gyros are not what was said of them: length and vertical part of what they show are off by "
        f"{bias / DEG_H:.3g} deg/h, and the Earth's horizontal rate is {expected / DEG_H:.4g} deg/h"
    )


def _rate(low: float, high: float, expected: float) -> str:
    return (
        f"the horizontal rate, {low / DEG_H:.4g} to {high / DEG_H:.4g} deg/h, is not the {expected / DEG_H:.4g} deg/h "
        "that the latitude gives"
    )


def something_hides(low: float, high: float, expected: float) -> str:
    """Why several attitudes tell nothing."""
    return (
        f"{_rate(low, high, expected)}: something that changes with the attitude of the gyros, or with time, is larger "
        "than the Earth's rotation"
    )


def not_earth(low: float, high: float, expected: float) -> str:
    """Why the horizontal rate is not that of the Earth."""
    return (
        f"{_rate(low, high, expected)}: biases larger than was said, scale factor, latitude, leveling, or a unit that "
        "was not at rest"
    )


def leaves(sd: float, expected: float) -> str:
    """How uncertain the horizontal rate is left."""
    return (
        f"{sd / DEG_H:.3g} deg/h (1 sd) in the horizontal rate, of which the Earth is {expected / DEG_H:.4g} deg/h; "
        f"{SEEN:g} standard deviations are needed"
    )


def unseen(signal_to_noise: float, expected: float) -> str:
    """Why sensors that could see the Earth tell nothing; both in standard deviations."""
    return (
        f"the horizontal rate is {signal_to_noise:.3g} standard deviations from zero, where the Earth would be "
        f"{expected:.3g}"
    )


def if_small(heading: float, bias: float) -> str:
    """What the heading rests on where nothing is known of the biases."""
    return (
        f"{math.degrees(heading):.2f} deg if the biases are small: length and vertical part of the rotation agree with "
        f"the Earth to {bias / DEG_H:.2g} deg/h, but a bias across the heading is not seen"
    )


def resolved(signal_to_noise: float) -> str:
    """Why the heading is a measurement."""
    return (
        f"{signal_to_noise:.4g} standard deviations from zero, and the horizontal rate is that of the Earth"
    )


# -- remarks ------------------------------------------------------------------------------------------------


def other_channels(calibrated: tuple[str, ...], taken: tuple[str, ...]) -> str:
    """That the calibration is of channels by other names."""
    return (
        f"the calibration is of {', '.join(calibrated)}, not of the channels that were taken: it stands for "
        f"{', '.join(taken)}, in this order"
    )


def lost(count: int) -> str:
    """That stretches at the beginning are left out."""
    one = count == 1
    return (
        f"{'one stretch' if one else f'{count} stretches'} at rest at the beginning {'was' if one else 'were'} left "
        "out: samples are missing while the unit was turned, so that no azimuth connects what lies before to the rest"
    )


def naive_is_wrong(duration: float, heading: float, says: str) -> str:
    """That the plain mean of the beginning is not to be used."""
    return (
        f"the plain mean of the first {duration:.0f} s would have said {math.degrees(heading):.1f} deg: do not use it, "
        f"for {says}"
    )


def naive_moved(moving: float, duration: float) -> str:
    """That the unit was not at rest in it."""
    return f"the unit was not at rest for {moving:.0f} of these {duration:.0f} s"


def naive_points_elsewhere(heading: float, away: float) -> str:
    """That it contradicts the stretches at rest."""
    return (
        f"its heading of {math.degrees(heading):.1f} deg is {math.degrees(away):.1f} deg from what the stretches at "
        "rest say, outside of their interval"
    )


def upside_down(axes: str) -> str:
    """That the axes of the sensor may be other ones."""
    return f"the unit lies on its back all the time: do its axes x, y, z point {axes} (--axes)?"
