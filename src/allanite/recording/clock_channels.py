# SPDX-License-Identifier: BSD-3-Clause
"""Channels of clocks and counters: time error x(t) in seconds, and fractional frequency y(t) = dx/dt.

A phase in cycles of a carrier f0 is x = phase/(2 pi f0); a frequency f in hertz is y = (f - f0)/f0 [1].

References
----------
.. [1] W. Riley, NIST SP 1065 (2008), section 3; IEEE Std 1139.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.checked_samples import checked_samples
from allanite.recording.records import ArrayColumn, Channel, Kind, Recording
from allanite.recording.sample_columns import Column

__all__ = [
    "CLOCK_KINDS",
    "ClockUnit",
    "Shifted",
    "clock_channel",
    "clock_kind",
    "clock_recording",
    "clock_unit",
    "without_noise",
]

#: Words for the kinds of a clock's samples.
CLOCK_KINDS: Final = ("phase", "frequency")

_CYCLES: Final = frozenset({"cycle", "cycles", "cyc", "period", "periods", "turn", "turns", "rev", "revs"})
_PARTS: Final = {"ppb": 1e-9, "ppt": 1e-12}
_POWER_OF_TEN: Final = re.compile(r"(?:1(?:\.0*)?[eE]|10\^|10\*\*|10e)([-+]?\d{1,3})")


@dataclass(frozen=True, slots=True)
class ClockUnit:
    """One unit of the samples: what it is in seconds, or in fractional frequency, and what is removed first.

    Attributes
    ----------
    scale : float
    offset : float
        In the unit of the samples: the carrier, of frequencies in hertz.
    """

    scale: float
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Shifted:
    """A column less a constant."""

    of: Column
    offset: float

    @property
    def origin(self) -> float:
        return 0.0

    @property
    def dtype(self) -> np.dtype[np.float64]:
        return np.dtype(np.float64)

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        return self.of.read(start, stop) + (self.of.origin - self.offset)


def clock_kind(word: str) -> Kind:
    """Kind.PHASE or Kind.FREQUENCY.

    Raises
    ------
    InputError
        Another word.
    """
    if word not in CLOCK_KINDS:
        raise InputError(
            f"kind must be {' or '.join(CLOCK_KINDS)}, not {word!r}; other kinds follow from the unit"
        )
    return Kind(word)


def _checked_carrier(carrier: float | None) -> float | None:
    """A carrier frequency [Hz], if there is one.

    Raises
    ------
    InputError
        Not positive and finite.
    """
    if carrier is None:
        return None
    if isinstance(carrier, bool) or not isinstance(carrier, (int, float)) or not 0 < carrier < 1e18:
        raise InputError(f"the carrier is a frequency in Hz above zero, not {carrier!r}")
    return float(carrier)


def clock_unit(unit: str, kind: Kind, carrier: float | None = None) -> ClockUnit:
    """What one unit of the samples is.

    Parameters
    ----------
    unit : str
        Of a phase s, ns, ps, or cycles, rad, deg of a carrier; of a frequency 1, ppm, ppb, 1e-12, or Hz of a carrier.
    kind : Kind
        PHASE or FREQUENCY.
    carrier : float, optional [Hz]

    Raises
    ------
    InputError
        Another unit, or one that needs the carrier.
    """
    f0 = _checked_carrier(carrier)
    text = unit.strip()
    if kind is Kind.PHASE:
        if text.lower() in _CYCLES:
            return ClockUnit(1.0 / _needed(f0, text))
        parsed = parse_unit(text)
        if parsed.quantity is QuantityKind.TIME:
            return ClockUnit(parsed.factor)
        if parsed.quantity is QuantityKind.ANGLE:
            return ClockUnit(parsed.factor / (2.0 * math.pi) / _needed(f0, text))
        raise InputError(f"a phase is in s, ns, ps, or in cycles, rad or deg of a carrier, not in {unit!r}")
    power = _POWER_OF_TEN.fullmatch(text)
    if power or text.lower() in _PARTS:
        return ClockUnit(10.0 ** int(power[1]) if power else _PARTS[text.lower()])
    parsed = parse_unit(text)
    if parsed.quantity is QuantityKind.RATIO:
        return ClockUnit(parsed.factor)
    if parsed.quantity is QuantityKind.FREQUENCY:
        f0 = _needed(f0, text)
        return ClockUnit(parsed.factor / f0, f0 / parsed.factor)
    raise InputError(
        f"a fractional frequency is in 1, ppm, ppb, 1e-12, or in Hz of a carrier, not in {unit!r}"
    )


def _needed(carrier: float | None, unit: str) -> float:
    if carrier is None:
        raise InputError(
            f"samples in {unit} need the frequency of the carrier: pass --carrier 10e6 (carrier=) [Hz]"
        )
    return carrier


def clock_channel(name: str, unit: str, kind: Kind, carrier: float | None = None) -> tuple[Channel, float]:
    """A channel of a clock, and the offset [unit of the samples] to take off its samples.

    Raises
    ------
    InputError
        See `clock_unit`.
    """
    one = clock_unit(unit, kind, carrier)
    return Channel(name=name, kind=kind, unit=unit, scale=one.scale, sampling="mean"), one.offset


def clock_recording(
    samples: ArrayLike,
    *,
    rate: float,
    kind: str,
    unit: str,
    carrier: float | None = None,
    names: Sequence[str] | None = None,
    start: int | None = None,
) -> Recording:
    """A recording of a clock whose samples are in memory.

    Parameters
    ----------
    samples : array_like, shape (n_samples,) or (n_samples, n_channels)
        Of a phase one value more than there are frequencies between them. NaN are gaps.
    rate : float [Hz]
        Sample rate.
    kind : "phase" or "frequency"
        Kind of the samples.
    unit : str
        Unit of the samples, see `clock_unit`.
    carrier : float, optional [Hz]
        Frequency of the carrier.
    names : sequence of str, optional
        Names of the channels.
    start : int, optional [ns]
        UTC of the first sample.

    Raises
    ------
    InputError
        Samples that are no table of numbers, or see `clock_unit`.
    """
    array, what = checked_samples(samples), clock_kind(kind)
    count = array.shape[1]
    labels = names or ([kind] if count == 1 else [f"{kind}_{i + 1}" for i in range(count)])
    if len(labels) != count:
        raise InputError(f"{len(labels)} names for {count} channels (samples have shape {array.shape})")
    made = [clock_channel(name, unit, what, carrier) for name in labels]
    columns = [ArrayColumn(array[:, i]) for i in range(count)]
    return Recording(
        channels=tuple(channel for channel, _ in made),
        columns=tuple(
            Shifted(c, offset) if offset else c for c, (_, offset) in zip(columns, made, strict=True)
        ),
        rate=rate,
        start=start,
    )


#: How readings of a clock are given, by the end of their unit.
_ENDS_OF_UNITS = (("Hz", "frequency"), ("s", "phase"))


def without_noise(recording: Recording) -> InputError:
    """What is said of a recording of which no channel carries sensor noise."""
    listed = ", ".join(f"{c.name} ({c.unit or c.kind.value})" for c in recording.channels)
    words = f"no channel of the recording carries sensor noise; it has {listed or 'no channel'}"
    for channel in recording.channels:
        for end, kind in _ENDS_OF_UNITS:
            if channel.kind is Kind.OTHER and channel.unit[-len(end) :] == end and "/" not in channel.unit:
                return InputError(f"{words}. If {channel.name} is the {kind} of a clock, pass --kind {kind}")
    return InputError(words)
