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

NOT_CORRELATED = "no pair correlates significantly at any lag"
OPPOSITE = "where one reads more the other reads less: name the one that is mounted in reverse (--opposite)"
SHARED_UNSEEN = "pairs correlate, but the common part is not resolved at any lag"
FROM_OUTSIDE = (
    "the common part may be the Earth, a vibration, the temperature or a supply: the data cannot tell which"
)
TWO_SENSORS = "with two sensors, a scale error of one appears as its own noise; a third sensor would show it"


def shared_sentence(resolved: int, lags: int, tau: float, share: float) -> str:
    """At how many lags the common part is seen, and where it is most of the variance."""
    return (
        f"the common part is resolved at {resolved} of {lags} lags; its share is largest at {tau:.3g} s: "
        f"{100 * share:.0f} % of the variance"
    )


def unlike_sentence(names: Sequence[str], p: float) -> str:
    """What it means that pairs share different parts."""
    return (
        f"the pairs of {listed(names)} do not share the same part ({probability(p)}): noise that only two of them "
        "share counts as their own, and may make that of the third too small"
    )


def delay_sentence(late: str, early: str, delay: float) -> str:
    """What a delay does to the parts."""
    return (
        f"{late} receives the common part about {delay:.3g} s later than {early}: at lags up to that length the common "
        "part is too small and the own parts are too large"
    )
