# SPDX-License-Identifier: BSD-3-Clause
"""Which samples of a record belong to which rate: the clocks compared, settling and clipping left out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from allanite.experiments.rate_table.motion import RateSteps, Sinusoids, TableClock
from allanite.experiments.rate_table.record.bandwidth import dead_time as swing_dead_time
from allanite.experiments.rate_table.record.clipping import Clipped
from allanite.experiments.rate_table.record.fit import TableChannel, fit_clock
from allanite.experiments.rate_table.record.rows import SampleSelection
from allanite.experiments.rate_table.record.timing import find_edges, settling
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile, student_quantile
from allanite.quantities.residual_tests import ALARM

__all__ = ["ClockComparison", "Timing"]

#: Dead time where no change of the rate can be seen, as a part of a step, and at most [s].
BLIND, LONGEST_BLIND = 0.25, 2.0
#: Samples at the ends of a stretch whose rate changes all the time: the derivative there is not known.
ENDS = 2
#: Level at which a drift of the clocks is seen.
SURE = 0.9999


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """What is known of the clocks and of settling.

    Attributes
    ----------
    window : SampleSelection
    source : str
        "found", "given" or "not seen".
    lags : tuple of str
        Columns of the regression that carry the uncertainty of the clock, of a rate that changes all the time.
    observed_offset : float [s]
        Offset that the record shows.
    offset_sd, drift_sd : float [s], relative
        Of the edges of steps.
    between : float [s]
        Standard deviation of the offset by what the table did between its steps.
    settles : bool
        Steps settle.
    """

    window: SampleSelection
    source: str
    lags: tuple[str, ...] = ()
    observed_offset: float = math.nan
    offset_sd: float = 0.0
    drift_sd: float = math.inf
    between: float = 0.0
    settles: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockComparison:
    """How the clocks are to be compared, and what to leave out.

    Attributes
    ----------
    start : float [s]
        Offset to begin with.
    offset, dead_time : float [s] or None
        As given by the user.
    """

    start: float
    offset: float | None
    dead_time: float | None

    def timing(self, follower: TableChannel) -> Timing:
        """Of the whole record."""
        return self._timing(follower, SampleSelection(clock=TableClock(offset=self.start)))

    def without(self, clipped: Clipped, follower: TableChannel, timing: Timing) -> Timing:
        """The same without what clips, whose changes say nothing of the clock either."""
        window = SampleSelection(
            clock=timing.window.clock,
            chosen=~clipped.steps if clipped.steps.any() else None,
            below=clipped.below,
            above=clipped.above,
        )
        return self._timing(follower, window)

    def _timing(self, follower: TableChannel, window: SampleSelection) -> Timing:
        if isinstance(follower.table, RateSteps):
            return self._of_steps(follower, follower.table, window)
        return self._of_motion(follower, window)

    def _of_motion(self, follower: TableChannel, window: SampleSelection) -> Timing:
        """Of a rate that changes all the time."""
        dead_time = self.dead_time
        if dead_time is None:
            dead_time = swing_dead_time(follower.table, 0) if isinstance(follower.table, Sinusoids) else 0.0
        guard = ENDS * follower.recording.dt
        window = replace(window, dead_time=max(dead_time, guard), guard=guard)
        clock_fit = fit_clock(follower, window, chi_square_quantile(1 - ALARM, 1))
        return Timing(
            window=clock_fit.window,
            source="found" if self.offset is None else "given",
            lags=clock_fit.lags,
            observed_offset=clock_fit.window.clock.offset,
        )

    def _of_steps(self, follower: TableChannel, table: RateSteps, window: SampleSelection) -> Timing:
        recording, channel = follower.recording, follower.channel
        edges = find_edges(recording, channel, table, window.clock.offset, window.chosen)
        if edges is None:
            return self._unseen(table, window)
        edge_clock, sd, drift_sd = edges.clock(student_quantile(SURE, max(len(edges.observed) - 2, 1)))
        clock = edge_clock if self.offset is None else TableClock(offset=self.offset)
        settled = settling(recording, channel, table, edges, clock)
        guard = settled.guard if self.dead_time is None else min(settled.guard, self.dead_time)
        blur = table.blur
        if table.changed is None:
            blur = float(np.median(table.start[1:] - table.stop[:-1])) / math.sqrt(12)
        return Timing(
            window=replace(
                window,
                clock=clock,
                dead_time=settled.dead_time if self.dead_time is None else self.dead_time,
                guard=guard,
            ),
            source="found" if self.offset is None else "given",
            observed_offset=edge_clock.offset,
            offset_sd=sd,
            drift_sd=drift_sd,
            between=blur,
            settles=settled.settles,
        )

    def _unseen(self, table: RateSteps, window: SampleSelection) -> Timing:
        """No change of the rate can be seen."""
        dwell = float(np.quantile(table.stop - table.start, 0.2))
        blind = min(BLIND * dwell, LONGEST_BLIND) if self.dead_time is None else self.dead_time
        return Timing(
            window=replace(window, clock=TableClock(offset=self.offset or 0.0), dead_time=blind),
            source="not seen" if self.offset is None else "given",
        )
