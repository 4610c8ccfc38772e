# SPDX-License-Identifier: BSD-3-Clause
"""Flicker or Gauss-Markov, or both: one rule for all fits.

The thresholds are by simulation of the moment fit: flicker records of any length exceed `REJECTS_FLICKER`, which a
Gauss-Markov term has one parameter more to reach, in at most 2.5 %; Gauss-Markov records exceed
`REJECTS_GAUSS_MARKOV` in less than 1 %. `python -m verification fits` counts both for each fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

__all__ = [
    "DOUBTFUL",
    "PAYS_FOR_TIME",
    "PAYS_FOR_TWO",
    "REJECTS_FLICKER",
    "leaves_slow_noise_open",
    "supported_families",
]

Fit = TypeVar("Fit")

_SLOW = frozenset("BK")

#: Twice the advantage in log-likelihood of the rival that rejects a family.
REJECTS_FLICKER, REJECTS_GAUSS_MARKOV = 8.0, 5.0
#: Undecided: Gauss-Markov stands first from here on.
PREFERS_GAUSS_MARKOV = 4.0
#: Goodness of both families below which shorter times and two Gauss-Markov terms are tried, and what these must gain in
#: twice the log-likelihood: far more than noise gains by two more parameters. A term that stands at the shortest time
#: has to gain only what excludes that time.
DOUBTFUL, PAYS_FOR_TWO, PAYS_FOR_TIME = 0.05, 15.0, 3.84


def leaves_slow_noise_open(needed: Iterable[str], supported: Iterable[str]) -> bool:
    """A sum without a Gauss-Markov term needs flicker or a random walk, and supports neither."""
    return not _SLOW.isdisjoint(needed) and _SLOW.isdisjoint(supported)


def supported_families(
    against_flicker: float,
    against_markov: float,
    flicker: Callable[[], tuple[Fit, bool]],
    markov: Callable[[], tuple[Fit, bool]],
    *,
    rejects_flicker: float = REJECTS_FLICKER,
) -> list[Fit]:
    """The family that a record supports, or both, the better one first.

    Parameters
    ----------
    against_flicker, against_markov : float
        Twice the advantage in log-likelihood of the rival.
    flicker, markov : callable
        The fit, and whether it supports the term that is the family's own. Flicker counts as supported where its
        family leaves slow noise open: the rival may say which it is. Called when needed.
    rejects_flicker : float
        Another threshold.
    """
    if against_flicker > rejects_flicker and against_markov < REJECTS_GAUSS_MARKOV:
        return [markov()[0]]
    first, supported = flicker()
    if against_markov > REJECTS_GAUSS_MARKOV or not supported:
        return [first]
    second, supported = markov()
    if not supported:
        return [first]
    return [first, second] if against_flicker < PREFERS_GAUSS_MARKOV else [second, first]
