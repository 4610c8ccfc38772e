# SPDX-License-Identifier: BSD-3-Clause
"""What noise in motion comes to, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.plain_files.counted import listed
from allanite.quantities.number_words import number
from allanite.quantities.quantity import Quantity

__all__ = [
    "MAY_BE_ALIAS",
    "UPPER_LIMIT",
    "comb_sentence",
    "inflated_sentence",
    "lower_sentence",
    "moving_sentence",
    "unchanged_sentence",
    "unsteady_sentence",
]

UPPER_LIMIT = (
    "a log in motion cannot tell vibration of the body from noise of the sensor: N in motion is an upper limit of "
    "the sensor's noise, for a filter that does not model the vibration"
)
MAY_BE_ALIAS = (
    "a line may be an alias of one above half the sample rate: log at another rate, and see which lines move"
)


def unchanged_sentence(name: str, inflation: Quantity) -> str:
    """That chance explains the difference."""
    return f"{name}: N in motion is {inflation} times that at rest, which chance explains"


def lower_sentence(name: str, inflation: Quantity) -> str:
    """That the log at rest is the noisier one."""
    return (
        f"{name}: N in motion is {inflation} times that at rest: check that the sensor was at rest in the first log, "
        "with the same range and filter"
    )


def inflated_sentence(name: str, inflation: Quantity, most: Quantity, band: tuple[float, float]) -> str:
    """By how much, and in which band the most."""
    low, high = (number(f) for f in band)
    return (
        f"{name}: N in motion is {inflation} times that at rest; the density grew most from {low} to {high} Hz, "
        f"{most} times"
    )


def comb_sentence(fundamental: float, orders: Sequence[int]) -> str:
    """Lines at multiples of one frequency.

    >>> comb_sentence(87.5, (1, 2, 4))
    'lines at 1, 2 and 4 times 87.50 Hz: a rotor or shaft at 5250 rpm, or an alias of one'
    """
    return (
        f"lines at {listed([str(order) for order in orders])} times {number(fundamental, 4)} Hz: a rotor or shaft at "
        f"{number(60 * fundamental, 4)} rpm, or an alias of one"
    )


def moving_sentence(above: float) -> str:
    """Why slow changes are not told as noise."""
    return (
        f"below {number(above)} Hz the log may show movement of the body, which a filter follows: B and K stay those "
        "at rest; if the body was held still, pass --fixed"
    )


def unsteady_sentence(names: Sequence[str]) -> str:
    """That the level changes during a log."""
    return (
        f"the level changes during the log ({listed(names)}): the interval is that of the scatter between parts of the "
        "log; compare a steady part"
    )
