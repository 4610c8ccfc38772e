# SPDX-License-Identifier: BSD-3-Clause
"""Which errors of dead reckoning people ask for, and in which units."""

from __future__ import annotations

from collections.abc import Mapping

from allanite.views.wording.rates import DEG

__all__ = ["BUDGET_QUANTITIES", "quantity_words"]

#: What people ask for -> its name and its unit.
BUDGET_QUANTITIES: Mapping[str, tuple[str, str, float]] = {
    "position_horizontal": ("Horizontal position", "m", 1.0),
    "position_down": ("Height", "m", 1.0),
    "velocity_horizontal": ("Horizontal velocity", "m/s", 1.0),
    "tilt": ("Tilt", "deg", DEG),
    "heading": ("Heading", "deg", DEG),
}


def quantity_words(quantity: str) -> str:
    """Name of a quantity with its unit in brackets."""
    name, unit, _ = BUDGET_QUANTITIES[quantity]
    return f"{name} [{unit}]"
