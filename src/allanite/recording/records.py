# SPDX-License-Identifier: BSD-3-Clause
"""A Recording: evenly spaced samples of one or several channels, and everything needed to read them.

Samples stay as they were written (integers, float32, a memory map of a file larger than memory). They are
turned into float64 block by block; units scale the *results*. Missing samples are NaN and keep their place
on the time grid: nothing is spliced and nothing is filled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from importlib import import_module
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.tabular import Columns, Tabular
from allanite.quantities.units import QuantityKind, parse_scale_factor, parse_unit
from allanite.recording.checked_samples import checked_rate, checked_samples
from allanite.recording.sample_columns import (
    ArrayColumn,
    Column,
    Masked,
    Samples,
    Slice,
    Spliced,
    merge_spans,
)

__all__ = [
    "BLOCK",
    "OVERLOAD",
    "RATE_OF",
    "ArrayColumn",
    "Channel",
    "Column",
    "Kind",
    "Recording",
    "Sampling",
    "Spliced",
    "checked_recording",
    "merge_spans",
    "scaled_samples",
]

Sampling = Literal["mean", "point"]

#: Samples per block when a recording is streamed (2 MiB of float64: stays in the second-level cache).
BLOCK = 1 << 18
#: SCPI writes infinity as +-9.9E37 and "not a number" as 9.91E37; some meters write 1E38. No sensor does.
OVERLOAD = 9.9e37


class Kind(StrEnum):
    """What the samples of a channel are. Kind is a type, never a string argument with a default."""

    RATE = "rate"
    ANGLE = "angle"
    ACCELERATION = "acceleration"
    VELOCITY = "velocity"
    VOLTAGE = "voltage"
    PHASE = "phase"
    FREQUENCY = "frequency"
    COUNTS = "counts"
    UNKNOWN = "unknown"
    TEMPERATURE = "temperature"
    OTHER = "other"

    @property
    def integrated(self) -> bool:
        """True for angle, velocity and phase: the samples are already the running sum."""
        return self in (Kind.ANGLE, Kind.VELOCITY, Kind.PHASE)

    @property
    def rate(self) -> Kind:
        """Kind of the differences of integrated samples over their interval; of all others the kind itself."""
        return RATE_OF.get(self, self)

    @property
    def noise_bearing(self) -> bool:
        """True when a noise model of the channel makes sense (temperature and such are companions)."""
        return self not in (Kind.TEMPERATURE, Kind.OTHER)

    @property
    def has_si(self) -> bool:
        """False for counts and unknown units: results stay in the channel's own unit."""
        return self not in (Kind.COUNTS, Kind.UNKNOWN, Kind.OTHER)


#: Of samples that are a running sum, the kind of what is summed.
RATE_OF: Mapping[str, Kind] = {
    Kind.ANGLE: Kind.RATE,
    Kind.VELOCITY: Kind.ACCELERATION,
    Kind.PHASE: Kind.FREQUENCY,
}
_KIND_OF = {
    QuantityKind.ANGLE_RATE: Kind.RATE,
    QuantityKind.ANGLE: Kind.ANGLE,
    QuantityKind.ACCELERATION: Kind.ACCELERATION,
    QuantityKind.VELOCITY: Kind.VELOCITY,
    QuantityKind.VOLTAGE: Kind.VOLTAGE,
    QuantityKind.COUNTS: Kind.COUNTS,
    QuantityKind.TEMPERATURE: Kind.TEMPERATURE,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One channel's identity.

    Attributes
    ----------
    name : str
        Unique in its recording.
    kind : Kind
        Kind of the samples after scaling.
    unit : str
        Unit the samples are written in; "" when unknown.
    scale : float
        SI value = scale * sample (1 for counts and unknown units).
    sampling : "mean" or "point"
        "mean": each sample is the mean over its interval (integrating converter, increments, most digital
        sensors behind their own decimation filter). "point": the state at an instant.
    aperture : float or None [s]
        Time over which a sample is averaged when that is shorter than the interval.
    scale_uncertainty : float or None
        Relative standard uncertainty of the scale; None if not stated.
    """

    name: str
    kind: Kind
    unit: str
    scale: float
    sampling: Sampling
    aperture: float | None = None
    scale_uncertainty: float | None = None

    def __post_init__(self) -> None:
        if self.sampling not in ("mean", "point"):
            raise InputError(
                f"channel {self.name!r}: sampling must be 'mean' (each sample is an average over its interval) "
                f"or 'point' (an instantaneous value), not {self.sampling!r}"
            )
        if not (math.isfinite(self.scale) and self.scale != 0.0):
            raise InputError(f"channel {self.name!r}: scale must be finite and not zero, not {self.scale!r}")
        if self.aperture is not None and not (math.isfinite(self.aperture) and self.aperture > 0):
            raise InputError(
                f"channel {self.name!r}: aperture must be positive seconds, not {self.aperture!r}"
            )
        if self.scale_uncertainty is not None and not 0 < self.scale_uncertainty < 1:
            raise InputError(
                f"channel {self.name!r}: the standard uncertainty of the scale is relative, above 0 and below 1, not "
                f"{self.scale_uncertainty!r}"
            )

    @classmethod
    def of(
        cls,
        name: str,
        unit: str,
        *,
        sampling: Sampling = "mean",
        aperture: float | None = None,
        scale_factor: str | None = None,
    ) -> Channel:
        """A channel whose kind and scale follow from its unit.

        Parameters
        ----------
        unit : str
            Any unit of the reference page; "" or "unknown" for an unknown unit.
        scale_factor : str, optional
            Scale factor of a sensor read through a converter, e.g. ``"24.0 mV/(deg/s)"`` with unit ``"V"``; with its
            standard uncertainty ``"24.0(2) mV/(deg/s)"``.

        Raises
        ------
        InputError
            The unit is not known, or the scale factor does not fit it.
        """
        if unit in ("", "unknown"):
            return cls(name=name, kind=Kind.UNKNOWN, unit="", scale=1.0, sampling=sampling, aperture=aperture)
        parsed = parse_unit(unit)
        kind, scale, uncertainty = _KIND_OF.get(parsed.quantity, Kind.OTHER), parsed.factor, None
        if scale_factor is not None:
            through = parse_scale_factor(scale_factor)
            if through.sample != parsed.quantity:
                raise InputError(
                    f"channel {name!r}: the scale factor {scale_factor!r} takes {through.sample.value}, but the "
                    f"samples are in {unit!r} ({parsed.quantity.value}); "
                    "write the factor as 'sample unit per physical unit'"
                )
            kind, scale = _KIND_OF[through.physical], parsed.factor * through.factor
            uncertainty = through.uncertainty
        elif kind is Kind.COUNTS:
            scale = 1.0
        return cls(
            name=name,
            kind=kind,
            unit=unit,
            scale=scale,
            sampling=sampling,
            aperture=aperture,
            scale_uncertainty=uncertainty,
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data for a study or a curve file."""
        stated = {} if self.scale_uncertainty is None else {"scale_uncertainty": self.scale_uncertainty}
        return {
            "name": self.name,
            "kind": self.kind.value,
            "unit": self.unit,
            "scale": self.scale,
            "sampling": self.sampling,
            "aperture": self.aperture,
            **stated,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Channel:
        """Inverse of `to_json`.

        Raises
        ------
        KeyError, TypeError, ValueError
            The data are not those of a channel.
        """
        for text in (data["name"], data["unit"]):
            if not isinstance(text, str):
                raise TypeError(f"name and unit of a channel are texts, not a {type(text).__name__}")
            text.encode()
        for key in ("scale", "aperture", "scale_uncertainty"):
            number = data.get(key)
            if isinstance(number, bool) or not isinstance(number, (int, float, type(None))):
                raise TypeError(f"{key} of a channel is a number, not a {type(number).__name__}")
        if data["scale"] is None:
            raise TypeError("scale of a channel is a number, not null")
        return cls(**{**data, "kind": Kind(data["kind"])})


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording(Tabular):
    """Evenly spaced samples of one or several channels.

    Attributes
    ----------
    channels : tuple of Channel
        Channels of the recording.
    columns : tuple of Column
        Samples of each channel, all of length `n_samples`.
    rate : float [Hz]
        Samples per second, 1e-9 to 1e12; span and length follow from it, so they can never disagree.
    start : int or None [ns]
        UTC of the first sample, int64 nanoseconds since 1970.
    history : tuple of dict
        Steps done to the samples since they were written; each step appends itself after success.
    source : str
        Name of the file, without its folder; "" for samples made in memory.
    notes : dict
        What the reader recognized and assumed; `allanite.recording.health` turns it into findings.
    """

    channels: tuple[Channel, ...]
    columns: tuple[Column, ...] = field(repr=False)
    rate: float
    start: int | None = None
    history: tuple[Mapping[str, Any], ...] = field(default=(), repr=False)
    source: str = ""
    notes: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", checked_rate(self.rate))
        if len(self.channels) != len(self.columns) or not self.channels:
            raise InputError(f"{len(self.channels)} channels but {len(self.columns)} columns of samples")
        names = [c.name for c in self.channels]
        if len(set(names)) != len(names):
            raise InputError(f"channel names must differ: {names}")
        lengths = {len(c) for c in self.columns}
        if len(lengths) != 1:
            raise InputError(f"channels of one recording must be equally long; lengths are {sorted(lengths)}")

    # -- making one ---------------------------------------------------------------------------------------

    @classmethod
    def from_rate(
        cls,
        samples: ArrayLike,
        *,
        rate: float,
        unit: str,
        names: str | Sequence[str] | None = None,
        sampling: Sampling = "mean",
        aperture: float | None = None,
        scale_factor: str | None = None,
        start: int | None = None,
    ) -> Recording:
        """A recording of rates, accelerations, voltages or counts (one value per interval).

        Parameters
        ----------
        samples : array_like, shape (n_samples,) or (n_samples, n_channels)
            Any real type; integers and memory maps are kept as they are. Masked entries and NaN are gaps.
        rate : float [Hz]
            Sample rate.
        unit : str
            Unit of the samples, e.g. "deg/s", "g", "V", "LSB"; "unknown" for an unknown one.
        names : str or sequence of str, optional
            Names of the channels.
        sampling : "mean" or "point"
            Whether a sample is a mean or a point value, see `Channel`.
        aperture : float, optional [s]
            Averaging time within a sample.
        scale_factor : str, optional
            E.g. ``"24.0 mV/(deg/s)"`` for a gyro read by a voltmeter; see `Channel.of`.
        start : int, optional [ns]
            UTC of the first sample.

        Raises
        ------
        InputError
            Wrong type or shape, unknown unit, or a unit of angle or velocity (see `from_angle`).
        """
        return cls._from_array(samples, rate, unit, names, sampling, aperture, scale_factor, start, False)

    @classmethod
    def from_angle(
        cls,
        samples: ArrayLike,
        *,
        rate: float,
        unit: str,
        names: str | Sequence[str] | None = None,
        start: int | None = None,
    ) -> Recording:
        """A recording of angles or velocities: the running integral, one value per sample instant.

        Parameters are those of `from_rate`. A missing angle removes only the terms that touch it.

        Raises
        ------
        InputError
            Wrong type or shape, or a unit that is not an angle or a velocity.
        """
        return cls._from_array(samples, rate, unit, names, "mean", None, None, start, True)

    @classmethod
    def from_samples(
        cls,
        data: object,
        *,
        time: str | ArrayLike | None = None,
        time_unit: str | None = None,
        unit: str | Mapping[str, str] | None = None,
        rate: float | None = None,
        names: str | Sequence[str] | None = None,
        channels: Sequence[str] | None = None,
        sampling: Sampling = "mean",
        scale_factor: str | Mapping[str, str] | None = None,
        start: float | None = None,
        stop: float | None = None,
        kind: str | None = None,
        carrier: float | None = None,
    ) -> Recording:
        """A recording of samples with their time stamps, as a file of them would be read.

        Gaps and jitter of the stamps are found, missing samples keep their place, and the findings are those of a file.

        Parameters
        ----------
        data : array_like, mapping, or table
            Array of shape (n_samples,) or (n_samples, n_channels), also masked or structured; mapping of names to
            columns; DataFrame or Series of pandas or polars; Dataset or DataArray of xarray; table of Arrow, or
            anything else with `__arrow_c_stream__`. Columns of text are left out.
        time : str or array_like of shape (n_samples,), optional
            Name of the column of time, with its unit where it has none ("t:ms"), as for `allanite.read`; or the stamps
            themselves: seconds, moments (datetime64, datetime, a DatetimeIndex) or durations (timedelta64). By default
            a column or an index that is time is found, as in a file.
        time_unit : {"s", "ms", "us", "ns"}, optional
            Unit of stamps that are numbers; floats are seconds if it is absent, and whole numbers need it.
        unit : str or mapping, optional
            Unit of the samples where names, attributes or metadata do not hold it; one for all, or by channel or group.
        rate : float, optional [Hz]
            Samples per second where there is no time. It sets time stamps aside if there are any.
        names : str or sequence of str, optional
            Names of the columns of an array.
        channels, sampling, scale_factor, start, stop, kind, carrier
            As for `allanite.read`.

        Raises
        ------
        InputError
            Something is missing or does not fit: no rate, a wrong unit, stamps of another length.
        DataQualityError
            No samples, or time stamps from which no even grid can be built.

        Examples
        --------
        >>> import numpy as np
        >>> t = np.delete(np.arange(1000) / 100.0, slice(200, 250))
        >>> Recording.from_samples({"gyro_x": np.sin(t)}, time=t, unit="deg/s")
        <Recording gyro_x: 1000 samples at 100 Hz, 10 s>
        """
        # The way from columns to a grid belongs to the room of files, which knows this one.
        recording: Recording = import_module("allanite.files.samples").recording_of(
            data,
            time=time,
            time_unit=time_unit,
            names=[names] if isinstance(names, str) else names,
            unit=unit,
            rate=rate,
            channels=channels,
            sampling=sampling,
            scale_factor=scale_factor,
            start=start,
            stop=stop,
            kind=kind,
            carrier=carrier,
        )
        return recording

    @classmethod
    def _from_array(
        cls,
        samples: ArrayLike,
        rate: float,
        unit: str,
        names: str | Sequence[str] | None,
        sampling: Sampling,
        aperture: float | None,
        scale_factor: str | None,
        start: int | None,
        integrated: bool,
    ) -> Recording:
        array = checked_samples(samples)
        count = array.shape[1]
        if names is None:
            names = ["x", "y", "z"][:count] if 1 < count <= 3 else [f"ch{i}" for i in range(count)]
            names = ["signal"] if count == 1 else names
        names = [names] if isinstance(names, str) else list(names)
        if len(names) != count:
            raise InputError(f"{len(names)} names for {count} channels (samples have shape {array.shape})")
        channels = tuple(
            Channel.of(n, unit, sampling=sampling, aperture=aperture, scale_factor=scale_factor)
            for n in names
        )
        if channels[0].kind.integrated is not integrated:
            other = "not an angle or a velocity: use Recording.from_rate"
            if not integrated:
                other = "an integrated quantity: use Recording.from_angle"
            raise InputError(f"unit {unit!r} is {other}")
        columns = tuple(ArrayColumn(array[:, i]) for i in range(count))
        return cls(channels=channels, columns=columns, rate=rate, start=start)

    # -- facts --------------------------------------------------------------------------------------------

    @property
    def n_samples(self) -> int:
        """Positions on the time grid, missing ones included."""
        return len(self.columns[0])

    @property
    def dt(self) -> float:
        """Sample interval Ts [s]."""
        return 1.0 / self.rate

    @property
    def duration(self) -> float:
        """Span of the record [s]: n_samples * dt."""
        return self.n_samples / self.rate

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(c.name for c in self.channels)

    def index(self, name: str) -> int:
        """Position of a channel.

        Raises
        ------
        InputError
            No such channel; the message lists those there are.
        """
        try:
            return self.names.index(name)
        except ValueError:
            raise InputError(f"no channel {name!r}; there are: {', '.join(self.names)}") from None

    def __getitem__(self, name: str) -> Channel:
        return self.channels[self.index(name)]

    def __repr__(self) -> str:
        return f"<Recording {', '.join(self.names)}: {self.n_samples} samples at {self.rate:g} Hz, {self.duration:g} s>"

    def to_columns(self) -> Columns:
        """Time (UTC where the start is known, else seconds since the first sample) and the samples of each channel.

        In the channels' own units, NaN where missing; all samples are in memory then.
        """
        seconds = np.arange(self.n_samples) / self.rate
        moments = np.round(seconds * 1e9).astype("timedelta64[ns]")
        time = {"t_s": seconds} if self.start is None else {"time": np.datetime64(self.start, "ns") + moments}
        return {**time, **{name: self.values(name) + self.origin(name) for name in self.names}}

    def _units(self) -> Mapping[str, str]:
        return {c.name: c.unit for c in self.channels if c.unit}

    # -- samples ------------------------------------------------------------------------------------------

    def raw(self, name: str, start: int = 0, stop: int | None = None) -> Samples:
        """Samples [start, stop) as written (overload words included), read-only, in the channel's own unit."""
        column = self.columns[self.index(name)]
        return _read_only(column.read(start, len(column) if stop is None else min(stop, len(column))))

    def blocks(self, name: str, size: int = BLOCK) -> Iterator[tuple[int, Samples]]:
        """Stream a channel: pairs (position of the first sample, float64 block with NaN where missing).

        Overload words (``|v| >= 9.9E37``) and infinities are missing. Values are in the channel's own unit, less
        `origin(name)`.
        """
        column = self.columns[self.index(name)]
        for start in range(0, len(column), size):
            yield start, _read_only(_without_overload(column.read(start, min(start + size, len(column)))))

    def values(self, name: str) -> Samples:
        """The whole channel as float64 with NaN where missing, read-only, in the channel's own unit."""
        column = self.columns[self.index(name)]
        return _read_only(_without_overload(column.read(0, len(column))))

    def origin(self, name: str) -> float:
        """Value subtracted from 64-bit integer samples far from zero; 0.0 for all others."""
        return self.columns[self.index(name)].origin

    def scaled(self, name: str, start: int = 0, stop: int | None = None) -> Samples:
        """Samples [start, stop) in SI (in their own unit without one), NaN where missing: for sums over channels."""
        i = self.index(name)
        column = self.columns[i]
        return scaled_samples(column, self.channels[i].scale, start, len(column) if stop is None else stop)

    # -- derived recordings -------------------------------------------------------------------------------

    def select(self, *names: str) -> Recording:
        """The same record with these channels only."""
        order = [self.index(n) for n in names]
        return replace(
            self,
            channels=tuple(self.channels[i] for i in order),
            columns=tuple(self.columns[i] for i in order),
        )

    def window(self, start: float | None = None, stop: float | None = None) -> Recording:
        """The record from `start` to `stop`, seconds since its first sample.

        Raises
        ------
        InputError
            An empty window, or one outside the record.
        """
        span = f"from {'the start' if start is None else f'{start} s'} to {'the end' if stop is None else f'{stop} s'}"
        if not all(math.isfinite(t) for t in (start, stop) if t is not None):
            raise InputError(f"window {span}: both ends must be finite")
        a = 0 if start is None else round(start * self.rate)
        b = self.n_samples if stop is None else round(stop * self.rate)
        if not 0 <= a < b <= self.n_samples:
            raise InputError(
                f"window {span} does not lie inside the record of {self.duration:g} s, or is empty"
            )
        return replace(
            self,
            columns=tuple(Slice(c, a, b) for c in self.columns),
            start=None if self.start is None else self.start + round(a * 1e9 / self.rate),
            history=(*self.history, {"step": "window", "start_s": a / self.rate, "stop_s": b / self.rate}),
        )

    def excluding(self, spans: Mapping[str, ArrayLike], reason: str) -> Recording:
        """The record with sample spans [start, stop) of the named channels read as missing, for a stated reason.

        Parameters
        ----------
        spans : mapping of channel name to array_like, shape (n_spans, 2)
            Spans of samples to mark as missing, by channel.
        reason : str
            Goes into the history.
        """
        columns = list(self.columns)
        counts: dict[str, int] = {}
        for name, given in spans.items():
            i = self.index(name)
            merged = merge_spans(np.asarray(given, dtype=np.int64).reshape(-1, 2))
            if len(merged):
                columns[i] = Masked(columns[i], merged)
                counts[name] = int(np.diff(merged, axis=1).sum())
        step = {"step": "exclude", "reason": reason, "samples": counts}
        return replace(self, columns=tuple(columns), history=(*self.history, step))

    def with_channels(self, change: Callable[[Channel], Channel], step: Mapping[str, Any]) -> Recording:
        """The same samples with other channel facts (a unit missing from the file); `step` is added to the history."""
        return replace(
            self, channels=tuple(change(c) for c in self.channels), history=(*self.history, dict(step))
        )


def scaled_samples(column: Column, scale: float, start: int, stop: int) -> Samples:
    """Samples [start, stop) of a column times its scale, NaN where missing."""
    return (_without_overload(column.read(start, min(stop, len(column)))) + column.origin) * scale


def _read_only(samples: Samples) -> Samples:
    """Samples may be those that a column keeps: who writes into them would change the record."""
    view = samples.view()
    view.flags.writeable = False
    return view


def _without_overload(block: Samples) -> Samples:
    if block.size == 0 or max(float(block.max()), -float(block.min())) < OVERLOAD:  # False for NaN
        return block
    bad = np.abs(block) >= OVERLOAD
    if bad.any():
        block = np.where(bad, np.nan, block)
    return block


def checked_recording(recording: object, who: str, needed: str = "a Recording") -> Recording:
    """A recording, as the function `who` needs it.

    Raises
    ------
    InputError
        Something else: bare samples, which have neither rate nor unit, or the name of a file.
    """
    if not isinstance(recording, Recording):
        raise InputError(f"{who} needs {needed}, not {_said(recording)}: {_MADE_BY}")
    return recording


_MADE_BY = "al.Recording.from_rate(y, rate=100.0, unit='deg/s') makes a recording, al.read(path) reads one"


def _said(thing: object) -> str:
    kind = type(thing)
    return repr(thing) if isinstance(thing, (str, int, float)) else f"{kind.__module__}.{kind.__qualname__}"
