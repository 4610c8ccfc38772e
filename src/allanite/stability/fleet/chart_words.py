# SPDX-License-Identifier: BSD-3-Clause
"""What a control chart comes to, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.stability.fleet.words import counted

__all__ = ["chart_sentence"]


def chart_sentence(
    symbol: str, channel: str, points: int, first: int, signalled: int, rules: Sequence[str]
) -> str:
    """How many points signal, and by which rules.

    >>> chart_sentence("N", "gyro_x", 40, 30, 2, ["one point beyond 3 sd"])
    'N of gyro_x: 2 of 40 points signal (one point beyond 3 sd); the first 30 set the limits'
    >>> chart_sentence("N", "gyro_x", 40, 40, 0, [])
    'N of gyro_x: no rule signals in 40 points, which set the limits'
    """
    limits = "which set the limits" if first == points else f"the first {first} set the limits"
    if not signalled:
        joint = ", " if first == points else "; "
        return f"{symbol} of {channel}: no rule signals in {counted(points, 'point')}{joint}{limits}"
    joint = "; all of them set the limits" if first == points else f"; {limits}"
    return (
        f"{symbol} of {channel}: {signalled} of {counted(points, 'point')} signal ({'; '.join(rules)}){joint}"
    )
