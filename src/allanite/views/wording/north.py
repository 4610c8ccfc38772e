# SPDX-License-Identifier: BSD-3-Clause
"""Directions in people's words, with the digits of their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from allanite.views.wording.rates import DEG

if TYPE_CHECKING:
    from allanite.experiments.alignment import LevelledAttitude
    from allanite.experiments.north import Arc

__all__ = ["arcs_words", "degrees_of", "direction_words"]


def degrees_of(direction: float, width: float) -> str:
    """A direction [rad] to the second digit of a width [rad] in degrees; to hundredths where there is none.

    >>> degrees_of(1.5707963, 0.052), degrees_of(6.28, 0.0)
    ('90.0°', '359.82°')
    """
    decimals = min(max(1 - math.floor(math.log10(width / DEG)), 0), 6) if width > 0 else 2
    return f"{round(direction / DEG, decimals) % 360:.{decimals}f}°"


def arcs_words(arcs: Iterable[Arc]) -> str:
    """An interval of directions; it may wrap, be the whole circle, or two arcs.

    >>> from allanite.experiments.north import Arc
    >>> arcs_words([Arc(6.2657, 0.0523)])
    '359.0° to 2.0°'
    """
    parts = list(arcs)
    if any(arc.full for arc in parts):
        return "the whole circle"
    ends = (f"{degrees_of(arc.start, arc.width)} to {degrees_of(arc.stop, arc.width)}" for arc in parts)
    return " and ".join(ends) or "no direction at all"


def direction_words(attitude: LevelledAttitude) -> str:
    """A heading with the digits of its interval; a dash where there is none."""
    return "–" if math.isnan(attitude.heading) else degrees_of(attitude.heading, attitude.interval.width)
