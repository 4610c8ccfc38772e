# SPDX-License-Identifier: BSD-3-Clause
"""What a variation found, in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from allanite.plain_files.counted import plural
from allanite.quantities.number_words import duration, number
from allanite.quantities.quantity import Quantity
from allanite.stability.variation.shapes import EVERYTHING

__all__ = [
    "all_constant",
    "change_sentence",
    "constant_sentence",
    "part_name",
    "scatter_sentence",
    "silence_sentence",
    "visible_steps",
]

_NAMES = {EVERYTHING: "the noise as a whole", "sigma": "the Gauss-Markov term"}
#: A step that must be larger than this factor to be seen is no good news.
_SMALL = 3.0


def part_name(symbol: str) -> str:
    """What changes.

    >>> part_name("N"), part_name("all")
    ('N', 'the noise as a whole')
    """
    return _NAMES.get(symbol, symbol)


def change_sentence(symbol: str, time: Quantity | None, ratio: Quantity) -> str:
    """What changed, when, and by how much: "N grew by 30 % (20 to 41) at 5.2 h"."""
    who = part_name(symbol)
    when = "steadily from the first to the last sample" if time is None else f"at {duration(time.value)}"
    verb = "grew" if ratio.value >= 1 else "fell"
    if not ratio.resolved:
        return f"{who} {verb} {when}, by an amount that the windows do not resolve"
    ends = (ratio.lower, ratio.upper)
    if ratio.value >= _SMALL:
        first, *others = (f"{v:.3g}" if v < 1000 else f"{v:.0f}" for v in (ratio.value, *ends))
        return f"{who} grew {first} times ({others[0]} to {others[1]}) {when}"
    low, high = sorted(abs(e - 1) if (e >= 1) == (ratio.value >= 1) else -abs(e - 1) for e in ends)
    digits = max(0, 1 - math.floor(math.log10(max(100 * (high - low) / 2, 1e-9))))
    first, *others = (f"{100 * v:.{min(digits, 4)}f}" for v in (abs(ratio.value - 1), low, high))
    return f"{who} {verb} by {first} % ({others[0]} to {others[1]}) {when}"


def silence_sentence(silent: Sequence[tuple[float, float]]) -> str:
    """Windows of one and the same value: what they hide, and what to do."""
    start, stop = silent[0]
    return (
        f"{plural(len(silent), 'window', 'repeat')} one value throughout, the first from {duration(start)} to "
        f"{duration(stop)}: next to them, steps of the noise cannot be detected; remove them (gaps), or record with a "
        "finer resolution"
    )


def scatter_sentence(p: float, tau: float, start: float, stop: float, ratio: float) -> str:
    """That no change explains the windows, and the clearest of them."""
    return (
        f"no step or drift of a term explains the windows (p = {p:.1g}); the clearest is at "
        f"{tau:.3g} s from {duration(start)} to {duration(stop)}: {ratio:.3g} "
        "times the deviation of the whole record"
    )


def constant_sentence(p: float, visible: Mapping[str, float]) -> str:
    """That chance explains the windows, and what would have shown."""
    steps = visible_steps(visible)
    shown = f"; a step halfway through would be detected if it changed {steps}" if steps else ""
    return f"no window differs significantly from the others (p = {p:.2g}, doubled for two tests){shown}"


def all_constant(count: int) -> str:
    """That chance explains the windows of several channels."""
    return f"no window of {count} channels differs significantly from the others"


def visible_steps(visible: Mapping[str, float]) -> str:
    """How large a step of each term would have shown; of the terms in which a small one would."""
    return ", ".join(
        f"{part_name(s)} by {number(100 * (f - 1), 2)} %"
        for s, f in visible.items()
        if s != EVERYTHING and f < _SMALL
    )
