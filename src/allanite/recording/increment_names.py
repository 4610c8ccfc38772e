# SPDX-License-Identifier: BSD-3-Clause
"""Names and units of increments: delta_theta_x, dvx, X_DELTANG, VelInc; deg/sample."""

from __future__ import annotations

import re

__all__ = ["increment_unit", "names_increments", "unit_per_sample"]

_QUANTITY = r"(?:ang(?:le|ular)?|th(?:eta)?|phi|rot(?:ation)?|v(?:el(?:ocity)?)?|gyro?|acc(?:el)?)"
_INCREMENT = re.compile(
    rf"delta|in[ck]rem|(?:^|_)incr(?:_|$)|(?:^|_){_QUANTITY}_?incr?(?:_|$)"
    rf"|^del_|(?:^|_)(?:d|del|delt)_?{_QUANTITY}_?[xyz\d]*(?:_|$)"
)
_OF_VELOCITY = re.compile(r"(?:^|_)(?:d|del|delt|delta|inc)?v(?:el(?:ocity)?)?(?:inc)?[xyz\d]?(?:_|$)|acc")
_OF_ANGLE = re.compile(r"ang|gyr|rot|th")
_PER_SAMPLE = re.compile(r"\s*(.*\S)\s*(?:/|\bper\b)\s*(?:samples?|sa|rows?)\s*", re.IGNORECASE)


def names_increments(name: str) -> bool:
    """True for the name of a column that holds the change over each interval."""
    return _INCREMENT.search(_plain(name)) is not None


def increment_unit(name: str) -> str:
    """A unit that increments of this name may be in: m/s of a velocity, rad of an angle.

    >>> increment_unit("delta_velocity[0]"), increment_unit("dAngX")
    ('m/s', 'rad')
    """
    plain = _plain(name)
    return "m/s" if _OF_VELOCITY.search(plain) and not _OF_ANGLE.search(plain) else "rad"


def _plain(name: str) -> str:
    split = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", re.sub("[Δ∆]", "delta_", name))
    return re.sub(r"[^0-9a-z]+", "_", split.lower()).strip("_")


def unit_per_sample(unit: str) -> str | None:
    """The unit of what a sample gains: deg of deg/sample; None for a unit that is not per sample."""
    match = _PER_SAMPLE.fullmatch(unit)
    return match[1] if match else None
