# SPDX-License-Identifier: BSD-3-Clause
"""Findings about rows that are no samples: a table with the means of several positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from allanite.recording.health.finding import Finding, Severity, finding
from allanite.recording.position_rows import MOST, are_positions
from allanite.recording.records import Recording

__all__ = ["rows_of_means"]

#: Rows that come faster by their own stamps are samples [Hz].
FASTEST = 0.2


def rows_of_means(recording: Recording) -> Iterator[Finding]:
    """Accelerometers that stand in another attitude in every few rows, and show gravity in each."""
    base = recording.notes.get("timebase")
    own_time = not isinstance(base, Mapping) or base.get("source") != "rate argument"
    if recording.n_samples > MOST or (own_time and recording.rate > FASTEST):
        return
    sensors = [c.name for c in recording.channels if c.kind.noise_bearing]
    if are_positions([recording.values(name) for name in sensors]):
        yield finding(
            "rows_of_means",
            f"{recording.n_samples} rows in which three channels have the same magnitude in many "
            "directions, like gravity in a table of positions: these are not samples of a log",
            severity=Severity.FATAL,
            count=recording.n_samples,
        )
