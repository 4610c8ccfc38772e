# SPDX-License-Identifier: BSD-3-Clause
"""The stretches in which a unit is at rest: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.json_values import plain

__all__ = ["WHY", "Level", "MovingSpan", "StaticSpan", "StaticSpans"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Why a stretch is not used as rest.
WHY = {
    "moving": "moves more than noise does",
    "beside": "next to a motion",
    "missing": "samples missing",
    "frozen": "the samples repeat one value: clipped, or frozen",
    "turning": "its mean rate differs from that of the other spans: a steady rotation",
    "held": "the accelerometers tilt as the gyros turn: held by hand, or on something that sways",
    "short": "too short",
    "smooth": "its noise falls in no axis over means of 0.05 to 0.8 s: slow motion",
    "unlisted": "outside the given spans",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticSpan:
    """A stretch at rest.

    Attributes
    ----------
    start, stop : int [samples]
        Half-open.
    label : str
        As given by the user; "" for one that was found.
    """

    start: int
    stop: int
    label: str = ""

    @property
    def n_samples(self) -> int:
        """Its length [samples]."""
        return self.stop - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingSpan:
    """A stretch that is not used as rest.

    Attributes
    ----------
    start, stop : int [samples]
        Half-open.
    why : str
        A key of `WHY`.
    """

    start: int
    stop: int
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """How much the unit moves over time, for a picture.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Middle of each block.
    ratio : ndarray, shape (n,)
        Largest root of energy over threshold of any axis and test in the block; above one it moves; NaN without
        samples.
    """

    time: Array = field(repr=False)
    ratio: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticSpans:
    """Where a unit is at rest, sorted and disjoint.

    Attributes
    ----------
    rate : float [Hz]
    n_samples : int
        Of the record.
    spans : tuple of StaticSpan
    moving : tuple of MovingSpan
        The rest of the record, and why each part of it is not used.
    gyro, accelerometer : tuple of str
        Channels x, y, z that were looked at; empty where there are none.
    source : str
        "detected", "file" or "given".
    noise : str
        What the thresholds rest on: "model", "record", "both", or "" where nothing was detected.
    alarm : float
        Share of clean static records that would be cut anywhere.
    shortest : float [s]
        Shorter spans were dropped.
    floor : dict of str to float
        White noise of each channel by the quiet parts, or by the model [SI / sqrt(Hz); counts / sqrt(Hz)].
    held : bool
        Held in the hand: no span is quite at rest, and `floor` is how much a triad may move in one.
    level : Level or None
    findings : tuple of str
        What a reader must know, in sentences.
    """

    rate: float
    n_samples: int
    spans: tuple[StaticSpan, ...] = field(repr=False)
    moving: tuple[MovingSpan, ...] = field(default=(), repr=False)
    gyro: tuple[str, ...] = ()
    accelerometer: tuple[str, ...] = ()
    source: str = "detected"
    noise: str = ""
    alarm: float = 0.0
    shortest: float = 0.0
    floor: Mapping[str, float] = field(default_factory=dict, repr=False)
    held: bool = False
    level: Level | None = field(default=None, repr=False)
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        edges = [edge for s in self.spans for edge in (s.start, s.stop)]
        if any(s.start >= s.stop for s in self.spans):
            raise InputError("a static span must end after it starts")
        if edges != sorted(edges):
            raise InputError("static spans must follow one another without overlapping")
        if edges and not 0 <= edges[0] <= edges[-1] <= self.n_samples:
            raise InputError(
                f"static spans from sample {edges[0]} to {edges[-1]} do not lie in a record of {self.n_samples}"
            )

    def __len__(self) -> int:
        return len(self.spans)

    @property
    def array(self) -> Index:
        """Starts and stops [samples], shape (n, 2)."""
        return np.array([(s.start, s.stop) for s in self.spans], dtype=np.int64).reshape(-1, 2)

    @property
    def times(self) -> Array:
        """Starts and stops since the first sample [s], shape (n, 2)."""
        return self.array / self.rate

    @property
    def durations(self) -> Array:
        """Lengths [s], shape (n,)."""
        return np.diff(self.times, axis=1)[:, 0]

    @property
    def duration(self) -> float:
        """Of the record [s]."""
        return self.n_samples / self.rate

    @property
    def share(self) -> float:
        """Part of the record at rest, 0 to 1."""
        return float(self.durations.sum()) / self.duration

    @property
    def channels(self) -> tuple[str, ...]:
        """All channels that were looked at, the gyros first."""
        return self.gyro + self.accelerometer

    def __repr__(self) -> str:
        lengths = self.durations
        ends = sorted({f"{x:.3g}" for x in (lengths.min(), lengths.max())}, key=float) if len(self) else []
        range_ = f" of {' to '.join(ends)} s" if ends else ""
        count = f"{len(self)} span{'s' * (len(self) != 1)}"
        return f"<StaticSpans {count}{range_}: {100 * self.share:.3g} % of {self.duration:g} s>"

    def to_json(self) -> dict[str, Any]:
        """Plain data; times in seconds stand beside the samples."""
        return {
            "format": "allanite-static-spans",
            "version": 1,
            "spans": [
                {**plain(s), "start_s": s.start / self.rate, "stop_s": s.stop / self.rate} for s in self.spans
            ],
            **{
                name: plain(getattr(self, name))
                for name in (
                    "rate", "n_samples", "duration", "share", "moving", "gyro", "accelerometer", "source", "noise",
                    "alarm", "shortest", "floor", "held", "level", "findings",
                )
            },
        }  # fmt: skip

    @classmethod
    def from_json(cls, data: Any) -> StaticSpans:
        """Inverse of `to_json`.

        Raises
        ------
        FormatError
            Not the data of static spans, or of a later version.
        """
        if not isinstance(data, Mapping) or data.get("format") != "allanite-static-spans":
            raise FormatError("these are no static spans: expected what StaticSpans.to_json gives")
        if data.get("version") != 1:
            raise FormatError(
                f"static spans of version {data.get('version')!r}; this program reads version 1"
            )
        try:
            level = data["level"]
            return cls(
                rate=float(data["rate"]),
                n_samples=int(data["n_samples"]),
                spans=tuple(
                    StaticSpan(start=int(s["start"]), stop=int(s["stop"]), label=str(s["label"]))
                    for s in data["spans"]
                ),
                moving=tuple(MovingSpan(**m) for m in data["moving"]),
                floor={str(k): math.nan if v is None else float(v) for k, v in data["floor"].items()},
                level=None
                if level is None
                else Level(**{k: np.array(v, dtype=np.float64) for k, v in level.items()}),
                gyro=tuple(data["gyro"]),
                accelerometer=tuple(data["accelerometer"]),
                findings=tuple(data["findings"]),
                source=str(data["source"]),
                noise=str(data["noise"]),
                alarm=float(data["alarm"]),
                shortest=float(data["shortest"]),
                held=bool(data.get("held", False)),
            )
        except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
            raise FormatError(f"the static spans are damaged: {error}") from None
