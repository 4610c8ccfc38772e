# SPDX-License-Identifier: BSD-3-Clause
"""The two ways in which a turned axis points, and what it sees of the Earth's rotation there.

A level axis is turned between north and south and sees Omega cos(latitude); a vertical one is turned over, between up
and down, and sees Omega sin(latitude). The sign +1 belongs to north and up, -1 to south and down.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

from allanite.errors import InputError

__all__ = [
    "First",
    "checked_first",
    "direction_of",
    "is_vertical",
    "part_seen",
    "sides_of",
    "sign_at_first",
    "triple_of",
]

First = Literal["north", "south", "up", "down", "unknown"]

_LEVEL, _VERTICAL = ("north", "south"), ("up", "down")


def checked_first(first: str | None) -> First:
    """The direction of the first dwell; None is "unknown".

    Raises
    ------
    InputError
        Anything but north, south, up, down, unknown or None.
    """
    for known in get_args(First):
        if first == known or (first is None and known == "unknown"):
            return known  # type: ignore[no-any-return]
    raise InputError(f"first must be 'north', 'south', 'up', 'down' or None (unknown), not {first!r}")


def is_vertical(first: str | None) -> bool:
    """True for an axis that is turned between up and down."""
    return first in _VERTICAL


def sides_of(first: str | None) -> tuple[str, str]:
    """Names of the two directions, that of the sign +1 first; an unknown one counts as level."""
    return _VERTICAL if is_vertical(first) else _LEVEL


def sign_at_first(first: str | None) -> int:
    """Sign of the first position; an unknown direction counts as north."""
    return -1 if first == sides_of(first)[1] else 1


def direction_of(first: str | None, sign: int, other: str = "unknown") -> str:
    """Name of a direction by its sign, or `other` where the sign is 0.

    >>> direction_of("north", -1), direction_of("down", 1), direction_of("up", 0)
    ('south', 'up', 'unknown')
    """
    plus, minus = sides_of(first)
    return {1: plus, -1: minus}.get(sign, other)


def triple_of(first: str | None) -> str:
    """Name of the estimator of three dwells, in which a drift cancels: "north-south-north" or "up-down-up"."""
    plus, minus = sides_of(first)
    return f"{plus}-{minus}-{plus}"


def part_seen(first: str | None, latitude: float) -> float:
    """Part of the Earth's rotation along the axis where it points north, or up."""
    return math.sin(latitude) if is_vertical(first) else math.cos(latitude)
