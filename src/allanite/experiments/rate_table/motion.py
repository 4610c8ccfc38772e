# SPDX-License-Identifier: BSD-3-Clause
"""How a rate table turned: commanded steps, what its encoder saw, or sinusoids; and the clock it was written by.

Every kind answers one question, the mean rate over any stretches of time, exactly where that has a closed form.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.json_values import plain

__all__ = ["RateSteps", "RateTable", "Sampled", "Sinusoids", "TableClock"]

Array = NDArray[np.float64]

#: A step in the samples of a table so many times their usual interval is a gap.
GAP = 5.0
#: A sampled table is one of steps where this part of all change takes less than that part of the time. It is looked at
#: in so many cells; a step has at least so many of them, and changes by less than this part of full scale in each.
MOVED, MOVING = 0.9, 0.15
CELLS, LEAST, STILL = 4000, 5, 1e-3
#: Angles within this much more than one turn are those of an encoder that wraps, as a part of a turn.
TURN = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class TableClock:
    """Time of the record = offset + (1 + drift) time of the table.

    Attributes
    ----------
    offset : float [s]
    drift : float
        Relative.
    """

    offset: float = 0.0
    drift: float = 0.0

    def table_time(self, t: Array) -> Array:
        """Of times of the record [s]."""
        return np.asarray((t - self.offset) / (1 + self.drift))

    def record_time(self, t: Array) -> Array:
        """Of times of the table [s]."""
        return np.asarray(self.offset + (1 + self.drift) * t)


@dataclass(frozen=True, slots=True, kw_only=True)
class RateSteps:
    """Stretches of constant rate. Between them the table does something unknown.

    Attributes
    ----------
    start, stop : ndarray, shape (n,) [s]
        In order of time.
    rate : ndarray, shape (n,) [rad/s]
    changed : ndarray, shape (n - 1,) [s], or None
        When each rate gave way to the next, were the change sudden; None where nobody saw it.
    blur : float [s]
        Standard deviation of these times: a table that is read now and then changes between two readings.
    """

    kind: ClassVar[Literal["steps"]] = "steps"
    start: Array
    stop: Array
    rate: Array
    changed: Array | None = None
    blur: float = 0.0

    def __post_init__(self) -> None:
        _settle(self, "step")
        _refuse_disorder(self.start, self.stop, "step")

    @property
    def spans(self) -> Array:
        """Stretches in which the rate is known, shape (n, 2) [s]."""
        return np.column_stack([self.start, self.stop])

    @property
    def changes(self) -> Array:
        """When each rate gives way to the next [s]; where nobody saw it, the middle between the two."""
        return (self.start[1:] + self.stop[:-1]) / 2 if self.changed is None else self.changed

    @property
    def full_scale(self) -> float:
        """Largest rate, without its sign [rad/s]."""
        return float(np.abs(self.rate).max())

    @property
    def direction(self) -> Array:
        """How the rate came about: +1 from below, -1 from above; the first from rest."""
        return np.asarray(np.sign(np.diff(self.rate, prepend=0.0)))

    def means(self, t: Array, dt: float) -> Array:
        """Mean rate over [t, t + dt] [rad/s]; between two steps the mean of the two, outside the nearest."""
        middle = t + dt / 2
        i = np.clip(np.searchsorted(self.start, middle, side="right") - 1, 0, len(self.rate) - 1)
        after = np.minimum(i + 1, len(self.rate) - 1)
        return np.where(middle > self.stop[i], (self.rate[i] + self.rate[after]) / 2, self.rate[i])

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"kind": self.kind, **{name: plain(getattr(self, name)) for name in ("start", "stop", "rate")}}


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampled:
    """What an encoder or a tachometer wrote: angles, or rates between which the rate goes straight.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Growing; need not be even.
    angle : ndarray, shape (n,) [rad]
        The running sum; an encoder that wraps at a whole turn is unwrapped by `of_angles`.
    rate : ndarray, shape (n,) [rad/s], or None
        None: the rate is the slope of the angle.
    """

    kind: ClassVar[Literal["samples"]] = "samples"
    time: Array
    angle: Array
    rate: Array | None = None

    def __post_init__(self) -> None:
        for name in ("time", "angle", "rate"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _final(getattr(self, name)))
        if len(self.time) < 3 or not (np.diff(self.time) > 0).all():
            raise InputError("a sampled table needs at least three samples, in the order of time")

    @classmethod
    def of_rates(cls, time: ArrayLike, rate: ArrayLike) -> Sampled:
        """From rates [rad/s] at times [s]."""
        t, r = np.asarray(time, dtype=np.float64), np.asarray(rate, dtype=np.float64)
        angle = np.concatenate([[0.0], np.cumsum(np.diff(t) * (r[1:] + r[:-1]) / 2)])
        return cls(time=t, angle=angle, rate=r)

    @classmethod
    def of_angles(cls, time: ArrayLike, angle: ArrayLike) -> Sampled:
        """From the angles of an encoder [rad]. Of angles within one turn, jumps by more than half a turn are taken for
        their wrapping; an encoder that counts on is believed.
        """
        t, angles = np.asarray(time, dtype=np.float64), np.asarray(angle, dtype=np.float64)
        return cls(time=t, angle=np.unwrap(angles) if np.ptp(angles) <= 2 * math.pi * (1 + TURN) else angles)

    @property
    def slope(self) -> Array:
        """Slope of the angle at each sample [rad/s]."""
        return np.asarray(np.gradient(self.angle, self.time))

    @property
    def interval(self) -> float:
        """Usual time between two samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def spans(self) -> Array:
        """Stretches without a gap, shape (n, 2) [s]."""
        gaps = np.flatnonzero(np.diff(self.time) > GAP * self.interval)
        return np.column_stack([self.time[np.r_[0, gaps + 1]], self.time[np.r_[gaps, len(self.time) - 1]]])

    @property
    def full_scale(self) -> float:
        """Largest rate, without its sign [rad/s]; of angles over 30 samples, for they are rounded."""
        if self.rate is not None:
            return float(np.abs(self.rate).max())
        step = min(30, len(self.time) - 1)
        slope = (self.angle[step:] - self.angle[:-step]) / (self.time[step:] - self.time[:-step])
        return float(np.abs(slope).max())

    def means(self, t: Array, dt: float) -> Array:
        """Mean rate over [t, t + dt] [rad/s]; values at t where dt is 0."""
        span = dt or self.interval
        first = t if dt else t - span / 2
        return (self._angle(first + span) - self._angle(first)) / span

    def _angle(self, t: Array) -> Array:
        """The running sum at any time: of rates exactly, of angles by cubics through their values and slopes."""
        i = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.time) - 2)
        whole = self.time[i + 1] - self.time[i]
        since = np.clip(t - self.time[i], 0.0, whole)
        if self.rate is not None:
            slope = (self.rate[i + 1] - self.rate[i]) / whole
            return np.asarray(self.angle[i] + since * (self.rate[i] + since * slope / 2))
        p, slopes = since / whole, self.slope
        rise, before, after = self.angle[i + 1] - self.angle[i], whole * slopes[i], whole * slopes[i + 1]
        bend = (before - rise) * (1 - p) - (after - rise) * p
        return np.asarray(self.angle[i] + p * (rise + (1 - p) * bend))

    def plateaus(self) -> RateSteps | None:
        """The same as steps, where nearly all of the change takes place in a small part of the time; None elsewhere."""
        width = max((self.time[-1] - self.time[0]) / CELLS, 4 * self.interval)
        edges = np.arange(self.time[0], self.time[-1], width)
        rate = self.means(edges[:-1], width)
        change = np.abs(np.diff(rate))
        order = np.sort(change)[::-1]
        total = np.cumsum(order)
        if not total.size or total[-1] == 0:
            return None
        moving = int(np.searchsorted(total, MOVED * total[-1])) + 1
        if moving > MOVING * len(change):
            return None
        still = np.concatenate([[False], change < min(STILL * self.full_scale, order[moving - 1]), [False]])
        runs = np.flatnonzero(np.diff(still.astype(np.int8))).reshape(-1, 2)
        runs = runs[runs[:, 1] - runs[:, 0] >= LEAST]
        if len(runs) < 2:
            return None
        # Cells at the ends may hold some of a change.
        start, stop = edges[runs[:, 0]] + width, edges[runs[:, 1]] - width
        steady = (self._angle(stop) - self._angle(start)) / (stop - start)
        blur = 0.0 if self.rate is None else self.interval / math.sqrt(12)
        return RateSteps(
            start=start, stop=stop, rate=steady, changed=self._changed(start, stop, steady), blur=blur
        )

    def _changed(self, start: Array, stop: Array, rate: Array) -> Array:
        """When each rate gave way to the next: by the angle that the table turned between the two."""
        gone = self._angle(start[1:]) - self._angle(stop[:-1])
        middle, jump = (start[1:] + stop[:-1]) / 2, np.diff(rate)
        with np.errstate(invalid="ignore", divide="ignore"):
            at = (rate[1:] * start[1:] - rate[:-1] * stop[:-1] - gone) / jump
        at = np.where(np.abs(jump) > STILL * self.full_scale, at, middle)
        return np.asarray(np.clip(at, stop[:-1], start[1:]))

    def to_json(self) -> dict[str, Any]:
        """Plain data: how it was sampled, not the samples."""
        return {
            "kind": self.kind,
            "quantity": "angle" if self.rate is None else "rate",
            "samples": len(self.time),
            "start": float(self.time[0]),
            "stop": float(self.time[-1]),
            "interval": self.interval,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Sinusoids:
    """Stretches in which rate = amplitude sin(2 pi frequency (t - start) + phase).

    Attributes
    ----------
    start, stop : ndarray, shape (n,) [s]
        In order of time.
    amplitude : ndarray, shape (n,) [rad/s]
    frequency : ndarray, shape (n,) [Hz]
    phase : ndarray, shape (n,) [rad]
    """

    kind: ClassVar[Literal["sinusoids"]] = "sinusoids"
    start: Array
    stop: Array
    amplitude: Array
    frequency: Array
    phase: Array

    def __post_init__(self) -> None:
        _settle(self, "sinusoid")
        _refuse_disorder(self.start, self.stop, "sinusoid")
        if not ((self.amplitude > 0) & (self.frequency > 0)).all():
            raise InputError("a sinusoid has a positive amplitude and frequency")

    @property
    def spans(self) -> Array:
        """Stretches in which the rate is known, shape (n, 2) [s]."""
        return np.column_stack([self.start, self.stop])

    @property
    def full_scale(self) -> float:
        """Largest rate, without its sign [rad/s]."""
        return float(self.amplitude.max())

    def row(self, t: Array) -> NDArray[np.int64]:
        """Which sinusoid goes on at times of the table."""
        return np.clip(np.searchsorted(self.start, t, side="right") - 1, 0, len(self.start) - 1)

    def waves(self, t: Array, dt: float) -> tuple[Array, Array]:
        """Means of the sine and of the cosine of the running row over [t, t + dt]."""
        middle = t + dt / 2
        i = self.row(middle)
        argument = 2 * math.pi * self.frequency[i] * (middle - self.start[i]) + self.phase[i]
        size = np.sinc(self.frequency[i] * dt)
        return size * np.sin(argument), size * np.cos(argument)

    def means(self, t: Array, dt: float) -> Array:
        """Mean rate over [t, t + dt] [rad/s]; values at t where dt is 0."""
        return np.asarray(self.amplitude[self.row(t + dt / 2)] * self.waves(t, dt)[0])

    def of(self, chosen: NDArray[np.bool_]) -> Sinusoids:
        """Some of the rows."""
        return Sinusoids(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"kind": self.kind, **{f.name: plain(getattr(self, f.name)) for f in fields(self)}}


RateTable = RateSteps | Sampled | Sinusoids
"""How a rate table turned."""


def _settle(table: RateSteps | Sinusoids, what: str) -> None:
    """Columns as read-only arrays of one length, that of the changes one less."""
    lengths = set()
    for f in fields(table):
        if getattr(table, f.name) is None or f.name == "blur":
            continue
        column = _final(getattr(table, f.name))
        object.__setattr__(table, f.name, column)
        lengths.add(len(column) + (f.name == "changed"))
        if not np.isfinite(column).all():
            raise InputError(
                f"{f.name} of {what} {int(np.argmin(np.isfinite(column))) + 1} is not a finite number"
            )
    if len(lengths) != 1 or 0 in lengths:
        raise InputError(f"a table needs at least one {what}, and columns of one length")


def _refuse_disorder(start: Array, stop: Array, what: str) -> None:
    empty = np.flatnonzero(stop <= start)
    if len(empty):
        i = int(empty[0])
        raise InputError(f"{what} {i + 1}: stop {stop[i]:g} s does not come after start {start[i]:g} s")
    early = np.flatnonzero(start[1:] < stop[:-1] - 1e-9 * np.maximum(np.abs(stop[:-1]), 1.0))
    if len(early):
        i = int(early[0]) + 1
        raise InputError(
            f"{what} {i + 1} starts at {start[i]:g} s, before the one above stops ({stop[i - 1]:g} s): put one row "
            "after another in time"
        )


def _final(values: ArrayLike) -> Array:
    out = np.array(values, dtype=np.float64, ndmin=1)
    out.flags.writeable = False
    return out
