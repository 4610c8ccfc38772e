# SPDX-License-Identifier: BSD-3-Clause
"""In which unit people read what a noise adds up to."""

from __future__ import annotations

import math

__all__ = ["drift_unit"]


def drift_unit(kind: str, unit: str = "") -> tuple[str, float]:
    """The unit in which people read what a noise adds up to, and its size in SI.

    >>> drift_unit("rate")[0], drift_unit("acceleration")[0], drift_unit("counts", "LSB")[0]
    ('deg', 'm/s', 'LSB·s')
    """
    if kind in ("rate", "angle"):
        return "deg", math.radians(1)
    if kind in ("acceleration", "velocity"):
        return "m/s", 1.0
    return f"{unit or 'units'}·s", 1.0
