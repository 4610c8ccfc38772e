# SPDX-License-Identifier: BSD-3-Clause
"""Values of a sensor with a clock of its own, out of a log that repeats them: each value once, at its place.

A fresh row holds the value of the place next to it on the sensor's clock (`allanite.recording.health.renewal`). A place
without a fresh row takes a row that is sure to hold its value (the value may equal the one before); where no row is,
the value was never logged and is missing. The rows after a gap hold the value before the next fresh row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.recording.cleaning.step import noted
from allanite.recording.health.finding import percent
from allanite.recording.health.renewal import Renewal, fresh_rows
from allanite.recording.records import BLOCK, Recording
from allanite.recording.sample_columns import Spliced, View
from allanite.recording.sample_hold import HeldSamples

__all__ = ["Picked", "held_samples", "renewed", "without_jitter"]

Samples = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Picked(View):
    """The samples of a column at these positions, in ascending order."""

    rows: Index

    def __len__(self) -> int:
        return len(self.rows)

    def read(self, start: int, stop: int) -> Samples:
        rows = self.rows[start:stop]
        if len(rows) == 0:
            return np.zeros(0)
        part: Samples = self.of.read(int(rows[0]), int(rows[-1]) + 1)[rows - rows[0]]
        return part


def renewed(recording: Recording, renewal: Renewal) -> Recording:
    """The recording with each value of the sensor once, at the sensor's rate; places never logged are gaps."""
    rows, places = _events(recording, renewal)
    rows, places = _filled(recording, renewal, rows, places)
    places = places - places[0]
    starts = np.flatnonzero(np.diff(places, prepend=-2) != 1)
    source, grid = np.append(starts, len(rows)), places[starts]
    length = int(places[-1]) + 1
    rate, sd = recording.rate * renewal.ratio, recording.rate * renewal.sd
    out = replace(
        recording,
        columns=tuple(Spliced(Picked(c, rows), source, grid, length) for c in recording.columns),
        rate=rate,
        start=None
        if recording.start is None
        else recording.start + round(int(rows[0]) * 1e9 / recording.rate),
    )
    names = [c.name for c in recording.channels]
    missing = length - len(rows)
    share = percent(1.0 - renewal.fresh / max(renewal.rows, 1))
    why = (
        f"{share} of the rows repeated the previous one: the sensor updates at {rate:.9g} Hz "
        f"(standard uncertainty {sd:.2g} Hz), the log ran at {recording.rate:.9g} Hz"
        + (f"; {missing} of {length} values were never logged, or are missing" if missing else "")
    )
    dropped = dict.fromkeys(names, recording.n_samples - len(rows))
    return noted(without_jitter(out), "drop_repeats", why, dropped, rate_before=recording.rate, rate_sd=sd)


def _events(recording: Recording, renewal: Renewal) -> tuple[Index, Index]:
    """Rows with which a value begins, and its place on the sensor's clock; both ascend."""
    fresh, first = [], []
    for start, flags, there in _rows(recording, renewal):
        fresh.append(start + np.flatnonzero(flags))
        first.append(start + np.flatnonzero(there))
    begun = np.concatenate(fresh)
    steps = np.arange(len(begun))
    places = np.rint(renewal.cycles(begun.astype(np.float64))).astype(np.int64)
    places = np.maximum.accumulate(places - steps) + steps  # no two values at one place
    after = np.concatenate(first)  # rows whose row before is missing: what they hold began there, or earlier
    following = np.searchsorted(begun, after)
    broken = np.append(after[1:], recording.n_samples)
    known = following < len(begun)
    known &= begun[np.minimum(following, len(begun) - 1)] < broken
    after, following = after[known], following[known]
    before = places[following] - 1
    new = (following == 0) | (before > places[np.maximum(following - 1, 0)])
    rows, at = np.concatenate([begun, after[new]]), np.concatenate([places, before[new]])
    order = np.argsort(rows, kind="stable")
    return rows[order], at[order]


def _rows(recording: Recording, renewal: Renewal) -> list[tuple[int, NDArray[np.bool_], NDArray[np.bool_]]]:
    """Block by block: fresh rows, and rows with a value in every channel that follow one without."""
    out = []
    last = False
    for start, fresh, _ in fresh_rows(recording, renewal.channels):
        present = _present(recording, renewal, start, start + len(fresh))
        out.append((start, fresh, present & ~np.concatenate(([last], present[:-1]))))
        last = bool(present[-1])
    return out


def _present(recording: Recording, renewal: Renewal, start: int, stop: int) -> NDArray[np.bool_]:
    present = np.ones(stop - start, dtype=np.bool_)
    for name in renewal.channels:
        present &= np.isfinite(recording.raw(name, start, stop))
    return present


def _filled(recording: Recording, renewal: Renewal, rows: Index, places: Index) -> tuple[Index, Index]:
    """The same with the places that no row begins, where a row is sure to hold their value."""
    every = np.arange(places[0], places[-1] + 1)
    empty = np.setdiff1d(every, places, assume_unique=True)
    if len(empty) == 0:
        return rows, places
    target = empty + 0.5 * (renewal.earliest + renewal.latest + 1.0)
    near = target / renewal.line
    for _ in range(4):
        near = (target + np.interp(near, renewal.at, renewal.phase)) / renewal.line
    row = np.clip(np.rint(near), 0, recording.n_samples - 1)
    inside = renewal.cycles(row) - empty
    sure = (inside > renewal.latest) & (inside < 1.0 + renewal.earliest)
    row, empty = row[sure].astype(np.int64), empty[sure]
    there = np.zeros(recording.n_samples, dtype=np.bool_)
    for start in range(0, recording.n_samples, BLOCK):
        stop = min(start + BLOCK, recording.n_samples)
        there[start:stop] = _present(recording, renewal, start, stop)
    row, empty = row[there[row]], empty[there[row]]
    joined = np.concatenate([places, empty])
    order = np.argsort(joined, kind="stable")
    merged = np.concatenate([rows, row])[order]
    rising = np.diff(merged, prepend=-1) > 0
    return merged[rising], joined[order][rising]


def without_jitter(recording: Recording) -> Recording:
    """The notes without facts of the stamps that the new rate has outdated."""
    base = recording.notes.get("timebase")
    if not isinstance(base, dict):
        return recording
    kept = {
        k: v
        for k, v in base.items()
        if k not in ("median_rate", "jitter_rms_s", "resolution_s", "rate_nominal")
    }
    return replace(recording, notes={**recording.notes, "timebase": kept})


def held_samples(recording: Recording) -> HeldSamples | None:
    """The rate of the sensor, of a recording in which each value stands once; None for others."""
    steps = [s for s in recording.history if s.get("step") == "repair" and s.get("repair") == "drop_repeats"]
    if not steps or "rate_before" not in steps[-1]:
        return None
    return HeldSamples(
        rate=recording.rate,
        rate_sd=steps[-1].get("rate_sd"),
        log_rate=steps[-1]["rate_before"],
        values=recording.n_samples,
    )
