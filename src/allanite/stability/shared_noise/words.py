# SPDX-License-Identifier: BSD-3-Clause
"""What sensors share, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.plain_files.counted import listed
from allanite.quantities.number_words import probability

__all__ = [
    "FROM_OUTSIDE",
    "NOT_CORRELATED",
    "OPPOSITE",
    "SHARED_UNSEEN",
    "TWO_SENSORS",
    "delay_sentence",
    "shared_sentence",
    "unlike_sentence",
]

NOT_CORRELATED = "no pair is correlated at any lag by more than chance"
OPPOSITE = (
    "where one reads more the other reads less: name the one that is mounted the other way round (--opposite)"
)
SHARED_UNSEEN = "pairs are correlated, but the common part has no lag of its own at which it is seen"
FROM_OUTSIDE = (
    "what is common may be the Earth, a vibration, the temperature or a supply: the data cannot tell which"
)
TWO_SENSORS = "of two sensors a scale error of one is seen as own noise; a third sensor would tell"


def shared_sentence(resolved: int, lags: int, tau: float, share: float) -> str:
    """At how many lags the common part is seen, and where it is most of the variance."""
    return (
        f"the common part is seen at {resolved} of {lags} lags, most at {tau:.3g} s: "
        f"{100 * share:.0f} % of the variance there"
    )


def unlike_sentence(names: Sequence[str], p: float) -> str:
    """What it means that pairs share different parts."""
    return (
        f"the pairs of {listed(names)} do not share the same part ({probability(p)}): what two of them share "
        "counts to their own noise, and may make that of the third too small"
    )


def delay_sentence(late: str, early: str, delay: float) -> str:
    """What a delay does to the parts."""
    return (
        f"{late} feels the common part about {delay:.3g} s later than {early}: at lags of that length and below, the "
        "common part comes out too small and the own parts too large"
    )
