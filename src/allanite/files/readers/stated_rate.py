# SPDX-License-Identifier: BSD-3-Clause
"""The sample rate that a file states: which of several statements counts, and which must be asked about.

A statement is a rate or an interval: a line before a table, an attribute, a scalar beside the samples. A name that can
mean nothing else (``sample_rate``, ``dt``) outranks a bare ``rate`` or ``period``. An interval of 1 or more without a
unit is judged as a column of intervals is (`stamp_units`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import Final

from allanite.files.readers.stamp_units import FACTORS, StampSteps, candidates
from allanite.lazy_dataclasses import dataclass

__all__ = [
    "BARE", "DUBIOUS", "EXPLICIT", "FASTEST_SENSOR", "WORDED", "RateDoubt", "StatedRate", "Statement",
    "chosen_rate", "interval_statement", "keyed_statement", "rate_statement",
]  # fmt: skip

#: How much a statement counts: it names the sample rate; it does with a word that is unknown; it names a rate;
#: it may name something else.
EXPLICIT, WORDED, BARE, DUBIOUS = range(4)
FASTEST_SENSOR: Final = 2e4  # [Hz]
_SLOWEST_SENSOR: Final = 0.9  # [Hz]
_SAME = 0.01  # relative distance of statements that agree: they are rounded
_SECOND = 1.0  # shorter intervals without a unit are in s
_UNITS: Final = ("s", "ms", "us", "ns")
_RATE_KEYS: Final = {
    "fs": EXPLICIT, "odr": EXPLICIT, "sample_rate": EXPLICIT, "sampling_rate": EXPLICIT, "samplerate": EXPLICIT,
    "sampling_frequency": EXPLICIT, "sample_frequency": EXPLICIT, "sfreq": EXPLICIT, "rate": BARE, "frequency": BARE,
    "freq": BARE,
}  # fmt: skip
_INTERVAL_KEYS: Final = {
    "dt": EXPLICIT, "ts": EXPLICIT, "sample_interval": EXPLICIT, "sampling_interval": EXPLICIT,
    "sampling_period": EXPLICIT, "period": BARE,
}  # fmt: skip
#: sample_rate_hz, fs[kHz], dt (ms).
_UNIT_AT_END: Final = re.compile(r"(.+?)[\s_]*[\s_(\[](k?hz|s|ms|us|ns)[)\]]?")
_HERTZ: Final = {"hz": 1.0, "khz": 1e3}


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """What one place of a file says of the rate.

    Attributes
    ----------
    where : str
        The place, for messages and notes.
    readings : tuple of float [Hz]
        What it may mean, the likeliest first.
    rank : int
        EXPLICIT, WORDED, BARE or DUBIOUS.
    interval : float or None
        Of an interval whose unit is open.
    doubt : str
        Why one of the readings is not taken without asking; "" if it is.
    remark : str
        What was guessed.
    """

    where: str
    readings: tuple[float, ...]
    rank: int
    interval: float | None = None
    doubt: str = ""
    remark: str = ""

    @property
    def clear(self) -> bool:
        return not self.doubt and self.interval is None

    def agrees(self, rate: float) -> bool:
        """Whether one of the readings is this rate [Hz]."""
        return any(abs(reading / rate - 1.0) <= _SAME for reading in self.readings)


@dataclass(frozen=True, slots=True, kw_only=True)
class RateDoubt:
    """A stated rate that is not taken as it stands.

    Attributes
    ----------
    where, question : str
        The place; what is asked, "" for an interval whose unit may follow from the kind of the log.
    interval : float or None
    """

    where: str
    question: str = ""
    interval: float | None = None

    def settled(self, *, inertial: bool, clock: bool) -> tuple[float, str] | None:
        """The rate [Hz] that the interval means and what was guessed; None where several units fit, or nothing."""
        units = self._units(inertial=inertial, clock=clock)
        if self.interval is None or len(units) != 1:
            return None
        rate = 1.0 / (self.interval * FACTORS[units[0]])
        return rate, f"{_named(self.where)}: no unit given, read as {units[0]} ({rate:.6g} Hz)"

    def asked(self, *, inertial: bool) -> str:
        """What is asked of the caller."""
        if self.interval is None:
            return self.question
        rates = {u: 1.0 / (self.interval * FACTORS[u]) for u in self._units(inertial=inertial, clock=False)}
        return (
            f"{_named(self.where)} states an interval without a unit, and {' and '.join(rates)} fit. "
            f"{_choice(list(rates.values()))}"
        )

    def _units(self, *, inertial: bool, clock: bool) -> list[str]:
        if self.interval is None:
            return []
        if clock:
            return ["s"]
        steps = StampSteps(self.interval, self.interval == round(self.interval))
        fitting = [unit for unit in candidates(steps, 0.0, inertial) if unit in _UNITS]
        return fitting or list(_UNITS)


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedRate:
    """What a file states of the rate in all.

    Attributes
    ----------
    rate : float or None [Hz]
    where : str
        The place that states it; "" if none does.
    doubt : RateDoubt or None
        What is to be settled, where nothing clear is stated.
    guesses : tuple of str
    """

    rate: float | None = None
    where: str = ""
    doubt: RateDoubt | None = None
    guesses: tuple[str, ...] = ()


def rate_statement(where: str, rate: float, rank: int) -> Statement | None:
    """The statement of a rate [Hz]; None for a number that is none."""
    return Statement(where=where, readings=(rate,), rank=rank) if 0 < rate < math.inf else None


def interval_statement(where: str, interval: float, rank: int) -> Statement | None:
    """The statement of an interval without a unit; None for a number that is none, or fits none."""
    if not (0 < interval < math.inf and 1.0 / interval < math.inf):
        return None
    if interval < _SECOND:
        return Statement(where=where, readings=(1.0 / interval,), rank=rank)
    fitting = candidates(StampSteps(interval, interval == round(interval)), 0.0, inertial=False)
    if not any(unit in _UNITS for unit in fitting):
        return None
    readings = tuple(1.0 / (interval * FACTORS[unit]) for unit in _UNITS)
    return Statement(where=where, readings=readings, rank=rank, interval=interval)


def keyed_statement(key: str, value: float, what: str) -> Statement | None:
    """The statement of a number under a key, of an array, an attribute or metadata (`what`); None for another key."""
    where, plain = f"{what} {key!r}", key.lower()
    named = _UNIT_AT_END.fullmatch(plain)
    if named is not None and (named[1] in _RATE_KEYS) == (named[2] in _HERTZ):
        plain, unit = named.groups()
        if plain in _INTERVAL_KEYS:
            return (
                rate_statement(where, 1.0 / (value * FACTORS[unit]), _INTERVAL_KEYS[plain]) if value else None
            )
        value *= _HERTZ.get(unit, 1.0)
    if plain in _INTERVAL_KEYS:
        return interval_statement(where, value, _INTERVAL_KEYS[plain])
    if plain not in _RATE_KEYS or not math.isfinite(value):
        return None
    if "freq" in plain and _RATE_KEYS[plain] == BARE and value > FASTEST_SENSOR:
        return None  # that of a clock
    return rate_statement(where, value, _RATE_KEYS[plain])


def chosen_rate(statements: Iterable[Statement | None]) -> StatedRate:
    """The rate by the statements of the highest rank; where these contradict each other, what is asked."""
    ordered = sorted((one for one in statements if one is not None), key=lambda one: one.rank)
    if not ordered:
        return StatedRate()
    top = [one for one in ordered if one.rank == ordered[0].rank]
    clear = next((one for one in top if one.clear), None)
    if clear is None:
        first = top[0]
        question = f"{_named(first.where)} {first.doubt}. {_choice(first.readings)}" if first.doubt else ""
        doubt = RateDoubt(where=first.where, question=question, interval=first.interval)
        return StatedRate(doubt=doubt, guesses=_remarks(first))
    rate = clear.readings[0]
    against = [one for one in top if not one.agrees(rate)]
    if against:
        return StatedRate(doubt=RateDoubt(where=clear.where, question=_contradiction(clear, against)))
    others = [one for one in ordered if one.clear and abs(one.readings[0] / rate - 1.0) > 1e-9]
    several = (f"several rates are stated: {_named(clear.where)} is used",) if others else ()
    return StatedRate(rate=rate, where=clear.where, guesses=(*_remarks(clear), *several))


def _remarks(one: Statement) -> tuple[str, ...]:
    return (one.remark,) if one.remark else ()


def _contradiction(one: Statement, against: Sequence[Statement]) -> str:
    rates = [(s, [r for r in s.readings if _SLOWEST_SENSOR <= r <= FASTEST_SENSOR]) for s in (one, *against)]
    listing = ", ".join(
        f"{_named(s.where)} ({' or '.join(f'{rate:.6g} Hz' for rate in likely or s.readings[:1])})"
        for s, likely in rates
    )
    options = [rate for s, likely in rates for rate in likely or s.readings[:1]]
    return f"the file states several sample rates: {listing}. {_choice(options)}"


def _named(where: str) -> str:
    """A place in a message: the line in quotes."""
    _, sign, line = where.partition(": ")
    return f"the line {line!r}" if sign else where


def _choice(rates: Sequence[float]) -> str:
    if len(rates) == 1:
        return "Give the rate of the samples, --rate RATE (rate=RATE in Python)"
    listed = [f"{rate:.9g}" for rate in dict.fromkeys(rates)]
    ways = " or ".join(f"--rate {rate}" for rate in listed)
    return f"State the rate of the samples: {ways} (rate={listed[0]} in Python)"
