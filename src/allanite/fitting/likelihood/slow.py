# SPDX-License-Identifier: BSD-3-Clause
"""What could stand in for the slow noise that samples are said to show?

Correlation times by the likelihood itself; power laws, which its blocks do not know, by the Allan curve of the record.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from allanite.fitting.likelihood.maximum import Peak
from allanite.fitting.likelihood.problem import LikelihoodProblem
from allanite.fitting.likelihood.profile import time_end
from allanite.fitting.moments import curve_slopes
from allanite.fitting.stand_ins import INTERVAL
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan import allan_curve

__all__ = ["ShownSum", "slow_facts"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownSum:
    """A sum of terms that explains a record.

    Attributes
    ----------
    letters : tuple of str
        Random terms.
    shown : frozenset of str
        Those that the record supports.
    peak : Peak
        The best fit of all of them.
    ramp : bool
        The record supports a ramp beside them.
    """

    letters: tuple[str, ...]
    shown: frozenset[str]
    peak: Peak
    ramp: bool


def slow_facts(problem: LikelihoodProblem, sums: Sequence[ShownSum]) -> dict[str, float]:
    """Facts for `goodness`: "drift_span" [s], "slow_time" [s], and the slopes that the curve does not exclude."""
    shown = frozenset[str]().union(*(one.shown for one in sums))
    facts = {"drift_span": problem.recording.duration} if any(one.ramp for one in sums) else {}
    if not shown & {"B", "G", "K"}:
        return facts
    walk = all("K" in one.shown for one in sums)
    times = [T for one in sums if walk and (T := _shortest_time(problem, one)) is not None]
    facts |= {"slow_time": min(times) * problem.block * problem.dt} if times else {}
    return facts | _slopes(problem, shown)


def _shortest_time(problem: LikelihoodProblem, one: ShownSum) -> float | None:
    """Correlation time above which a Gauss-Markov term does as well as the random walk; None: none that is shown."""
    letters = tuple("G" if s == "K" else s for s in one.letters)
    at = one.peak.at
    other = problem.peak(letters, slope=at.slope, averaged=at.averaged)
    allowed = INTERVAL + 2 * (other.log_likelihood - one.peak.log_likelihood)
    times = [k.T or 0.0 for k in other.at.components]
    slowest = int(np.argmax(times))
    if allowed <= 0 or not times[slowest]:
        return None
    second = sorted([0.0, *times])[-2]  # below its time the two would change places
    return time_end(problem.search, other, slowest, allowed, max(second, problem.search.times[0]))


def _slopes(problem: LikelihoodProblem, supported: frozenset[str]) -> dict[str, float]:
    """By the curve of the record without its lines."""
    return curve_slopes(allan_curve(problem.without_lines)[problem.channel.name], supported)
