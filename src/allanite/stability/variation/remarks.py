# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of a variation must know besides its verdict."""

from __future__ import annotations

from allanite.stability.variation.results import ChannelVariation
from allanite.stability.variation.verdict import ModelSource

__all__ = ["remarks"]


def remarks(channel: ChannelVariation, false_alarm: float) -> list[str]:
    """Of one channel, whose noise is said to change with probability `false_alarm` where it is constant."""
    conditions = {
        "no sum of noise terms explains the whole record: the expected scatter of the windows is approximate": (
            channel.model_source is ModelSource.ROUGH
        ),
        f"the white noise has excess kurtosis {channel.kurtosis:.2g}: the intervals allow for it": (
            channel.kurtosis > 0
        ),
        "the search ended at a change whose size the windows do not resolve: there may be others": any(
            not change.ratio.resolved for change in channel.changes
        ),
        "steps and drifts do not explain all changes: see the picture": (
            channel.changes and channel.p_left < false_alarm / 2
        ),
    }
    return [words for words, holds in conditions.items() if holds]
