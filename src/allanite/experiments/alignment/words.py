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
    "mirrored",
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
    "scale factors and misalignments are assumed nominal, and accelerometer biases zero: the intervals do not include "
    "their errors"
)
NO_BIAS = (
    "the gyro biases are unknown, and one attitude cannot show them: across the heading they are assumed no larger "
    "than the length and the vertical part of the measured rotation indicate"
)
REMARKS = {
    AlignmentRemark.TURN: (
        "turn the unit by 180 deg about the vertical, or through several positions, to separate the biases from the "
        "Earth's rotation"
    ),
    AlignmentRemark.CALIBRATE: (
        "or calibrate the gyro biases (allanite calibrate) and state how well they repeat"
    ),
    AlignmentRemark.ROTATING: "if the unit turned throughout, state it (rotation=True, --rotating)",
    AlignmentRemark.WARM_UP: ("rest longer in each position and let the unit warm up, or use better gyros"),
    AlignmentRemark.LONGER: "record longer, or use gyros with less noise",
    AlignmentRemark.FASTER: "turn faster and rest longer between the turns",
    AlignmentRemark.DOUBT: (
        "check the latitude and the gyros: their axes may not sense the Earth's rotation"
    ),
    AlignmentRemark.STATE_BIAS: "state how well the biases are known (bias_repeatability, --gyro-bias)",
}
HEADINGS = {
    False: (
        "the turn angle between the files is unknown, so only the last one is aligned: give the heading of each from a "
        "common mark, first.csv=0 turned.csv=180, or let one log run through the turns"
    ),
    True: (
        "the turn angle between the rows is unknown, so only the last one is aligned: add a column heading, from a "
        "common mark"
    ),
}
"""That headings are missing, of files and of rows of means."""

_SOURCES = {
    "gyro noise": ("gyro noise leaves", (AlignmentRemark.LONGER,)),
    "gyro bias": ("gyro biases leave", (AlignmentRemark.TURN, AlignmentRemark.CALIBRATE)),
    "turns": ("the azimuth of the turns leaves", (AlignmentRemark.FASTER,)),
}


def of_source(source: str) -> tuple[str, tuple[AlignmentRemark, ...]]:
    """What the largest entry of the budget does, and what to do about it."""
    return _SOURCES.get(source, (f"the {source} leaves", ()))


# -- the reason ---------------------------------------------------------------------------------------------


def inseparable(apparent: float, *, one_attitude: bool) -> str:
    """Why the biases are not told from the Earth; `apparent` is what the gyros show in one attitude."""
    if not one_attitude:
        return "these attitudes do not separate the gyro biases from the Earth's rotation"
    excess = abs(apparent / DEG_H - _EARTH)
    unknown = "one attitude and unknown gyro biases"
    if not excess > 0.1 * _EARTH:
        return f"{unknown}: any heading is possible"
    return (
        f"{unknown}: the gyros read {apparent / DEG_H:.4g} deg/h, which includes biases of {excess:.3g} deg/h or more; "
        f"the Earth's rate is {_EARTH:.4g} deg/h"
    )


def biases_hide(bias: float, expected: float) -> str:
    """Why one attitude tells nothing: the biases are as large as the Earth."""
    return (
        "the gyro biases are larger than stated: length and vertical part of the measured rotation are off by "
        f"{bias / DEG_H:.3g} deg/h, and the Earth's horizontal rate is {expected / DEG_H:.4g} deg/h"
    )


def _rate(low: float, high: float, expected: float) -> str:
    return (
        f"the horizontal rate, {low / DEG_H:.4g} to {high / DEG_H:.4g} deg/h, excludes the {expected / DEG_H:.4g} "
        "deg/h expected at this latitude"
    )


def something_hides(low: float, high: float, expected: float) -> str:
    """Why several attitudes tell nothing."""
    return (
        f"{_rate(low, high, expected)}: an error that changes with attitude or time is larger than the Earth's "
        "rotation"
    )


def not_earth(low: float, high: float, expected: float) -> str:
    """Why the horizontal rate is not that of the Earth."""
    return (
        f"{_rate(low, high, expected)}: check the stated biases, scale factor, latitude and leveling, and that the "
        "unit was at rest"
    )


def leaves(sd: float, expected: float) -> str:
    """How uncertain the horizontal rate is left."""
    return (
        f"{sd / DEG_H:.3g} deg/h (1 sd) in the horizontal rate; the Earth's is {expected / DEG_H:.4g} deg/h, and "
        f"{SEEN:g} standard deviations are required"
    )


def unseen(signal_to_noise: float, expected: float) -> str:
    """Why sensors that could see the Earth tell nothing; both in standard deviations."""
    return (
        f"the horizontal rate is {signal_to_noise:.3g} standard deviations from zero; the Earth's would be "
        f"{expected:.3g}"
    )


def if_small(heading: float, bias: float) -> str:
    """What the heading rests on where nothing is known of the biases."""
    return (
        f"{math.degrees(heading):.2f} deg if the biases are small: length and vertical part of the rotation agree with "
        f"the Earth within {bias / DEG_H:.2g} deg/h, but a bias across the heading cannot be seen"
    )


def resolved(signal_to_noise: float) -> str:
    """Why the heading is a measurement."""
    return f"{signal_to_noise:.4g} standard deviations from zero, and the horizontal rate agrees with the Earth's"


# -- remarks ------------------------------------------------------------------------------------------------


def other_channels(calibrated: tuple[str, ...], taken: tuple[str, ...]) -> str:
    """That the calibration is of channels by other names."""
    return (
        f"the calibration names {', '.join(calibrated)}, not the channels used: it is applied to {', '.join(taken)}, "
        "in this order"
    )


def lost(count: int) -> str:
    """That stretches at the beginning are left out."""
    one = count == 1
    return (
        f"{'one stretch' if one else f'{count} stretches'} at rest at the beginning {'was' if one else 'were'} left "
        "out: samples are missing from a turn, so no azimuth connects the record before it with the record after it"
    )


def naive_is_wrong(duration: float, heading: float, says: str) -> str:
    """That the plain mean of the beginning is not to be used."""
    return (
        f"do not use the plain mean of the first {duration:.0f} s, a heading of {math.degrees(heading):.1f} deg: "
        f"{says}"
    )


def naive_moved(moving: float, duration: float) -> str:
    """That the unit was not at rest in it."""
    return f"the unit moved for {moving:.0f} of these {duration:.0f} s"


def naive_points_elsewhere(heading: float, away: float) -> str:
    """That it contradicts the stretches at rest."""
    return (
        f"its heading of {math.degrees(heading):.1f} deg is {math.degrees(away):.1f} deg from that of the stretches at "
        "rest, outside their interval"
    )


def upside_down(axes: str) -> str:
    """That the axes of the sensor may be other ones."""
    return f"the unit is upside down throughout: do its axes x, y, z point {axes} (--axes)?"


def mirrored(name: str, bias: float, doubled: float) -> str:
    """That a wrong sign, of the latitude or of the axis, may be the bias of a vertical gyro; it gives `doubled`."""
    return (
        f"the bias of {name}, {bias / DEG_H:.4g} deg/h, is close to {doubled / DEG_H:.4g} deg/h, minus twice the "
        "Earth's vertical rate on this axis: an inverted gyro axis, or a latitude of the wrong sign, looks the same. "
        "Check both; attitudes that tilt the axis tell them apart"
    )
