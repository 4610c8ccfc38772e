# SPDX-License-Identifier: BSD-3-Clause
"""What a variation found, in sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.plain_files.counted import plural
from allanite.quantities.number_words import duration, number
from allanite.stability.variation.shapes import EVERYTHING
from allanite.stability.variation.verdict import ModelSource, VariationVerdict

if TYPE_CHECKING:
    from allanite.stability.variation.results import Change, ChannelVariation, Variation

__all__ = ["change_sentence", "channel_reason", "part_name", "reason", "remarks", "visible_steps"]

_NAMES = {EVERYTHING: "the noise as a whole", "sigma": "the Gauss-Markov term"}
#: A step that must be larger than this factor to be seen is no good news.
_SMALL = 3.0


def part_name(symbol: str) -> str:
    """What changes.

    >>> part_name("N"), part_name("all")
    ('N', 'the noise as a whole')
    """
    return _NAMES.get(symbol, symbol)


def reason(variation: Variation) -> str:
    """What was found, channel by channel; the constant ones are not listed beside others."""
    channels = variation.channels
    if len(channels) == 1:
        return channel_reason(channels[0])
    if variation.verdict is VariationVerdict.CONSTANT:
        return f"no window of {len(channels)} channels differs from the others by more than chance"
    listed = [c for c in channels if c.verdict is not VariationVerdict.CONSTANT]
    return "; ".join(f"{c.name}: {channel_reason(c)}" for c in listed)


def channel_reason(channel: ChannelVariation) -> str:
    """What was found of one channel."""
    if channel.silent:
        return _silence(channel)
    match channel.verdict:
        case VariationVerdict.CHANGES:
            return "; ".join(map(change_sentence, channel.changes))
        case VariationVerdict.FLUCTUATES:
            return _scatter(channel)
        case VariationVerdict.CONSTANT:
            return _constancy(channel)


def change_sentence(change: Change) -> str:
    """What changed, when, and by how much: "N grew by 30 % (20 to 41) at 5.2 h"."""
    who, ratio = part_name(change.symbol), change.ratio
    when = (
        "steadily from the first to the last sample"
        if change.time is None
        else f"at {duration(change.time.value)}"
    )
    verb = "grew" if ratio.value >= 1 else "fell"
    if not ratio.resolved:
        return f"{who} {verb} {when}, by how much the windows do not tell"
    ends = (ratio.lower, ratio.upper)
    if ratio.value >= _SMALL:
        first, *others = (f"{v:.3g}" if v < 1000 else f"{v:.0f}" for v in (ratio.value, *ends))
        return f"{who} grew {first} times ({others[0]} to {others[1]}) {when}"
    low, high = sorted(abs(e - 1) if (e >= 1) == (ratio.value >= 1) else -abs(e - 1) for e in ends)
    digits = max(0, 1 - math.floor(math.log10(max(100 * (high - low) / 2, 1e-9))))
    first, *others = (f"{100 * v:.{min(digits, 4)}f}" for v in (abs(ratio.value - 1), low, high))
    return f"{who} {verb} by {first} % ({others[0]} to {others[1]}) {when}"


def _silence(channel: ChannelVariation) -> str:
    start, stop = channel.silent[0]
    return (
        f"{plural(len(channel.silent), 'window', 'hold')} one and the same value throughout, the first from "
        f"{duration(start)} to {duration(stop)}: steps of the noise cannot be told beside them; take them out "
        "(gaps), or record with a finer resolution"
    )


def _scatter(channel: ChannelVariation) -> str:
    worst = min(channel.lags, key=lambda lag: lag.p)
    at = worst.clearest
    return (
        f"no step or drift of a term explains the windows (p = {channel.p:.1g}); the clearest is at "
        f"{worst.tau:.3g} s from {duration(worst.start[at])} to {duration(worst.stop[at])}: {worst.ratio[at]:.3g} "
        "times the deviation of the whole record"
    )


def _constancy(channel: ChannelVariation) -> str:
    steps = visible_steps(channel)
    visible = f"; a step in the middle would show of {steps}" if steps else ""
    chance = min(2 * min(channel.p, channel.p_change), 1.0)
    return f"no window differs from the others by more than chance (p = {chance:.2g}, doubled for two tests){visible}"


def visible_steps(channel: ChannelVariation) -> str:
    """How large a step of each term would have shown; of the terms in which a small one would."""
    return ", ".join(
        f"{part_name(s)} by {number(100 * (f - 1), 2)} %"
        for s, f in channel.visible.items()
        if s != EVERYTHING and f < _SMALL
    )


def remarks(channel: ChannelVariation, false_alarm: float) -> list[str]:
    """What a reader of the verdict must know besides."""
    conditions = {
        "no sum of noise terms explains the whole record: the scatter of the windows rests on a rough one": (
            channel.model_source is ModelSource.ROUGH
        ),
        f"the white noise has excess kurtosis {channel.kurtosis:.2g}: the intervals allow for it": (
            channel.kurtosis > 0
        ),
        "the search ended at a change whose size the windows do not tell: there may be others": any(
            not change.ratio.resolved for change in channel.changes
        ),
        "steps and drifts do not explain all of it: look at the picture": (
            channel.changes and channel.p_left < false_alarm / 2
        ),
    }
    return [words for words, holds in conditions.items() if holds]
