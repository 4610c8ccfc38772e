# SPDX-License-Identifier: BSD-3-Clause
"""Repairs of rows: values logged more than once, rows written twice, two sensors in one column.

Such rows took no time of their own, or belong to another sensor. Left as gaps they would break the record up into
single samples; they give up their place instead, and the rate becomes that of the values. No value moves relative to
those beside it, and none is made.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.recording.cleaning.renewed import Picked, renewed, without_jitter
from allanite.recording.cleaning.step import noted, surveys
from allanite.recording.health.finding import percent, plural
from allanite.recording.health.held import Hold, holds
from allanite.recording.health.repeats import alternation
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.health.values import every
from allanite.recording.records import BLOCK, Channel, Recording
from allanite.recording.sample_columns import Column, Spliced, View

__all__ = ["at_own_rates", "drop_duplicate_rows", "drop_repeats", "split_interleaved"]

Samples = NDArray[np.float64]
Index = NDArray[np.int64]

#: Share of rows that may be equal to the one before by the step of the values, and be dropped for it.
BY_CHANCE = 1e-3
#: Of the changes of a value that is held k times, those that come every k rows.
STEADY = 0.98


@dataclass(frozen=True, slots=True)
class Thinned(View):
    """Every `step`-th sample of a column, from `first` on."""

    first: int
    step: int
    length: int

    def __len__(self) -> int:
        return self.length

    def read(self, start: int, stop: int) -> Samples:
        stop = min(stop, self.length)
        if stop <= start:
            return np.zeros(0)
        return self.of.read(self.first + start * self.step, self.first + (stop - 1) * self.step + 1)[
            :: self.step
        ]


# -- values that are held ---------------------------------------------------------------------------------


def drop_repeats(recording: Recording) -> Recording:
    """One row of each held value, at the rate of the values.

    Where every value stands k times, one row in k is kept. Where a sensor with a clock of its own is slower than the
    log, its values go to the places of that clock (`allanite.recording.cleaning.renewed`). Where repeats follow no
    clock, rows that equal the one before in every channel are dropped, and the values that are left stand evenly
    between gaps.

    Raises
    ------
    InputError
        Channels that are held differently: they have no common rate.
    DataQualityError
        Values so coarse that equal neighbors may be readings.
    """
    varying = [s for s in surveys(recording) if not s.constant and not s.channel.kind.integrated]
    held = holds(varying)
    ways = {(h.renewal.channels if h.renewal else h.factor) for h in held.values()}
    if len(ways) > 1 or 0 < len(held) < len(varying):
        words = ", ".join(f"{s.name} {_how(held.get(s.name))}" for s in varying)
        raise InputError(
            f"the channels repeat differently ({words}): they have no common rate; repair those of one "
            "rate at a time "
            "(channels=, --channels)"
        )
    one = next(iter(held.values()), None)
    if one is None or (one.renewal is None and one.factor == 1):
        return _drop_uneven(recording, varying)
    return _at_own_rate(recording, one)


def at_own_rates(recording: Recording) -> dict[str, Recording]:
    """Channels whose values are held at a steady rate, each alone, with every value once and at that rate, by name.

    Channels that are not held, or follow no rate, or change the place of their values, are not in it.
    """
    out = {}
    for name, hold in holds([s for s in surveys(recording) if not s.constant]).items():
        group = hold.renewal.channels if hold.renewal is not None else (name,)
        if hold.renewal is None and hold.factor == 1:
            continue
        with suppress(DataQualityError):
            out[name] = _at_own_rate(recording.select(*group), hold).select(name)
    return out


def _at_own_rate(recording: Recording, hold: Hold) -> Recording:
    """Each value of a hold that has a rate once."""
    steady = _every_kth(recording, hold.factor) if hold.factor > 1 else None
    if steady is not None:
        return steady
    if hold.renewal is None:
        raise DataQualityError(
            f"{hold.survey.name}: values stand {hold.factor} times, but change of place in the course of the record "
            "(rows were lost): split the record where they do (--from, --to)"
        )
    return renewed(recording, hold.renewal)


def _how(hold: Hold | None) -> str:
    if hold is None:
        return "not"
    if hold.factor > 1:
        return f"{hold.factor} times"
    return f"{1.0 / hold.ratio:.4g} times on average"


def _every_kth(recording: Recording, k: int) -> Recording | None:
    """One row in k; None where values change of place in the course of the record."""
    name = next(c.name for c in recording.channels if c.kind.noise_bearing)
    changes = np.zeros(k, dtype=np.int64)
    for start in range(0, recording.n_samples, BLOCK):
        values = recording.raw(name, max(start - 1, 0), start + BLOCK)
        at = np.flatnonzero(np.diff(values) != 0.0) + max(start - 1, 0) + 1
        changes += np.bincount(at % k, minlength=k)
    phase = int(np.argmax(changes))
    if changes[phase] < STEADY * changes.sum():
        return None
    length = (recording.n_samples - phase + k - 1) // k
    out = replace(
        recording,
        columns=tuple(Thinned(c, phase, k, length) for c in recording.columns),
        rate=recording.rate / k,
        start=None if recording.start is None else recording.start + round(phase * 1e9 / recording.rate),
    )
    dropped = dict.fromkeys((c.name for c in recording.channels), recording.n_samples - length)
    why = f"every value stood {k} times: {recording.rate:.9g} Hz became {out.rate:.9g} Hz"
    return noted(without_jitter(out), "drop_repeats", why, dropped, rate_before=recording.rate, first=phase)


def _drop_uneven(recording: Recording, varying: list[ChannelSurvey]) -> Recording:
    equal = _equal_rows(recording)
    count = int(equal.sum())
    if count == 0:
        return noted(recording, "drop_repeats", "no row repeats the previous one", {})
    _refuse_coarse("drop_repeats", varying, count / max(recording.n_samples, 1))
    missing = _missing_rows(recording)
    fresh = np.flatnonzero(~equal & ~missing)
    edges = np.flatnonzero(np.diff(np.cumsum(missing)[fresh]) > 0) + 1  # a gap lies before these
    stretches = np.split(fresh, edges)
    rows = sum(int(part[-1] - part[0]) for part in stretches)
    steps = sum(len(part) - 1 for part in stretches)
    if steps < 1 or rows < 1:
        raise DataQualityError("drop_repeats: no two adjacent values would remain")
    ratio = steps / rows  # values per row
    source = np.concatenate([[0], np.cumsum([len(part) for part in stretches])])
    grid, last = [], 0
    for part in stretches:
        at = max(round((int(part[0]) - int(fresh[0])) * ratio), last)
        grid.append(at)
        last = at + len(part) + 1  # at least one place is missing in a gap
    length = grid[-1] + len(stretches[-1])
    out = replace(
        recording,
        columns=tuple(
            Spliced(Picked(c, fresh), source.astype(np.int64), np.array(grid, dtype=np.int64), length)
            for c in recording.columns
        ),
        rate=recording.rate * ratio,
        start=None
        if recording.start is None
        else recording.start + round(int(fresh[0]) * 1e9 / recording.rate),
    )
    dropped = dict.fromkeys((c.name for c in recording.channels), count)
    why = (
        f"{plural(count, 'row')} repeated the previous one ({percent(count / recording.n_samples)}): "
        f"{recording.rate:.9g} Hz became {out.rate:.6g} Hz, known to {percent(2.0 / math.sqrt(3.0) / rows)}"
    )
    return noted(without_jitter(out), "drop_repeats", why, dropped, rate_before=recording.rate)


def _equal_rows(recording: Recording) -> NDArray[np.bool_]:
    """Rows whose values equal those of the row before in every channel that bears noise, shape (n_samples,)."""
    equal = np.zeros(recording.n_samples, dtype=np.bool_)
    equal[1:] = True
    for channel in recording.channels:
        if not channel.kind.noise_bearing:
            continue
        for start in range(0, recording.n_samples, BLOCK):
            values = recording.raw(channel.name, max(start - 1, 0), start + BLOCK)
            low = max(start, 1)
            equal[low : low + len(values) - 1] &= np.diff(values) == 0.0
    return equal


def _missing_rows(recording: Recording) -> NDArray[np.bool_]:
    """Rows without any value."""
    missing = np.ones(recording.n_samples, dtype=np.bool_)
    for channel in recording.channels:
        if channel.kind.noise_bearing:
            for start in range(0, recording.n_samples, BLOCK):
                values = recording.raw(channel.name, start, start + BLOCK)
                missing[start : start + len(values)] &= np.isnan(values)
    return missing


def _refuse_coarse(repair: str, varying: list[ChannelSurvey], share: float) -> None:
    """Equal neighbours are readings where the step of the values makes them often enough."""
    chance = 1.0
    for s in varying:  # of two Gaussian values on the same step
        chance *= min(s.lattice.step / (math.sqrt(4.0 * math.pi) * s.sigma), 1.0) if s.sigma > 0 else 1.0
    if chance > BY_CHANCE and chance > 0.02 * share:
        raise DataQualityError(
            f"{repair}: the values come in such coarse steps that {percent(chance)} of the rows equal the "
            f"previous one by chance, and {percent(share)} do: readings and repeats cannot be "
            "distinguished. Use all channels together, or keep the record unchanged"
        )


# -- rows that stand twice --------------------------------------------------------------------------------


def drop_duplicate_rows(recording: Recording) -> Recording:
    """Rows that were written twice, stamp and values, once; the rate stays that of the stamps.

    Raises
    ------
    DataQualityError
        Stamps that step back, or more equal rows than equal stamps: which rows stand twice cannot be told.
    """
    base = recording.notes.get("timebase")
    base = base if isinstance(base, dict) else {}
    doubles, backward = int(base.get("duplicates") or 0), int(base.get("backward") or 0)
    if backward:
        raise DataQualityError(
            f"drop_duplicate_rows: the stamps step back {plural(backward, 'time')}, so rows are out of order: sort the "
            "log by its stamps, or give its rate (--rate), which overrides them"
        )
    equal = _equal_rows(recording)
    count = int(equal.sum())
    if doubles == 0 or count == 0:
        return noted(recording, "drop_duplicate_rows", "no row stands twice", {})
    if count > doubles:
        raise DataQualityError(
            f"drop_duplicate_rows: {plural(count, 'row')} equal the previous one, but only "
            f"{plural(doubles, 'stamp')} "
            "do: which rows were written twice is undetermined; see held_samples"
        )
    varying = [s for s in surveys(recording) if not s.constant]
    _refuse_coarse("drop_duplicate_rows", varying, count / recording.n_samples)
    kept = np.flatnonzero(~equal)
    left = {**base, "duplicates": doubles - count}
    if doubles == count:
        left["duplicate_rows"] = []
    out = replace(
        recording,
        columns=tuple(Picked(c, kept) for c in recording.columns),
        notes={**recording.notes, "timebase": left},
    )
    dropped = dict.fromkeys((c.name for c in recording.channels), count)
    why = f"{plural(count, 'row')} were written twice, stamp and values"
    return noted(out, "drop_duplicate_rows", why, dropped)


# -- two sensors in one column ----------------------------------------------------------------------------


def split_interleaved(recording: Recording) -> Recording:
    """Sensors that share the rows of a log as channels of their own, at their own rate.

    Rows that alternate in level or noise with a period of 2 to 4 become so many channels NAME_1, NAME_2, ...; channels
    with a value in every k-th row only keep these rows.

    Raises
    ------
    InputError
        Channels that alternate differently.
    DataQualityError
        Nothing alternates.
    """
    facts = surveys(recording)
    sparse = {s.name: every(s) or 1 for s in facts}
    if len(set(sparse.values())) == 1 and max(sparse.values(), default=1) > 1:
        return _sparse(recording, next(iter(sparse.values())))
    periods = {s.name: (a.period if (a := alternation(s)) else 1) for s in facts}
    if set(periods.values()) <= {1} and max(sparse.values(), default=1) == 1:
        raise DataQualityError("split_interleaved: no channel alternates from row to row")
    spacings = {name: max(periods[name], sparse[name]) for name in periods}
    if len(set(spacings.values())) != 1:
        words = ", ".join(f"{name} every {k} rows" for name, k in spacings.items())
        raise InputError(
            f"split_interleaved: the channels alternate differently ({words}); split those of one kind at a time "
            "(channels=, --channels)"
        )
    return _alternating(recording, next(iter(spacings.values())))


def _alternating(recording: Recording, k: int) -> Recording:
    length = recording.n_samples // k
    channels: list[Channel] = []
    columns: list[Column] = []
    for channel, column in zip(recording.channels, recording.columns, strict=True):
        parts = range(k) if channel.kind.noise_bearing else range(1)
        for i in parts:
            name = f"{channel.name}_{i + 1}" if channel.kind.noise_bearing else channel.name
            channels.append(replace(channel, name=name))
            columns.append(Thinned(column, i, k, length))
    why = f"rows alternated with period {k}: {recording.rate:.9g} Hz became {recording.rate / k:.9g} Hz each"
    out = replace(recording, channels=tuple(channels), columns=tuple(columns), rate=recording.rate / k)
    return noted(without_jitter(out), "split_interleaved", why, {}, rate_before=recording.rate)


def _sparse(recording: Recording, k: int) -> Recording:
    length = recording.n_samples // k
    columns = []
    for channel, column in zip(recording.channels, recording.columns, strict=True):
        phase = 0
        if channel.kind.noise_bearing:
            there = np.flatnonzero(np.isfinite(column.read(0, min(BLOCK, len(column)))))
            phase = int(np.argmax(np.bincount(there % k, minlength=k)))
        columns.append(Thinned(column, phase, k, length))
    why = f"there was a value every {k} rows: {recording.rate:.9g} Hz became {recording.rate / k:.9g} Hz"
    out = replace(recording, columns=tuple(columns), rate=recording.rate / k)
    return noted(without_jitter(out), "split_interleaved", why, {}, rate_before=recording.rate)
