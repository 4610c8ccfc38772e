# SPDX-License-Identifier: BSD-3-Clause
"""Units in which the response to a rate table is shown: outputs as they were read, scale factors per deg/s."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.errors import InputError
from allanite.quantities.display_units import display_unit
from allanite.views.wording.rates import DEG

if TYPE_CHECKING:
    from allanite.experiments.rate_table import RateTableEstimate

__all__ = ["PPM", "output_unit", "scale_unit"]

PPM = 1e-6


def scale_unit(result: RateTableEstimate) -> tuple[str, float]:
    """Unit of the scale factor, and the value of one of it in SI of the channel per rad/s; "" for a ratio."""
    unit, size = result.unit, result.channel_scale / DEG
    if result.kind == "rate" and _is_rate(unit):
        return "", 1.0
    if unit == "V" and abs(result["scale factor"].value) / size < 0.5:
        return "mV/(deg/s)", size / 1e3
    return f"{unit or 'units'}/(deg/s)", size


def output_unit(result: RateTableEstimate) -> tuple[str, float]:
    """Unit of the output and its value in SI of the channel; rates in deg/s."""
    return ("deg/s", DEG) if result.kind == "rate" else display_unit(result.kind, "mean", result.unit)


def _is_rate(unit: str) -> bool:
    from allanite.quantities.units import QuantityKind, parse_unit

    try:
        return parse_unit(unit).quantity is QuantityKind.ANGLE_RATE
    except InputError:
        return False
