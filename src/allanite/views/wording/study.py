# SPDX-License-Identifier: BSD-3-Clause
"""A study in people's words: coefficients in the units people use, and sentences about them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

from allanite.lazy_dataclasses import dataclass
from allanite.noise import Estimate, NoiseModel
from allanite.plain_files.counted import listed
from allanite.quantities.display_units import display_unit, si_unit
from allanite.quantities.number_words import interval, number, probability, upper_limit

if TYPE_CHECKING:
    from allanite.study.results import ChannelModels, SlopeReading

__all__ = [
    "COLUMNS",
    "EQUIVALENT",
    "GUARANTEE",
    "ChannelGroup",
    "CoefficientWording",
    "KeyNumber",
    "cautions",
    "column_of",
    "groups",
    "headings",
    "is_poor",
    "key_numbers",
    "limit_words",
    "reading",
    "readings",
    "shown_symbol",
    "slope_reading",
]

C = TypeVar("C", bound="ChannelModels")

COLUMNS = ("N", "B", "T", "K", "R", "Q")
"""Columns of every parameter table, in the order in which a curve shows them. B stands for B_equiv too."""

GUARANTEE = (
    "95 % intervals for this record alone; '<' is a 95 % upper limit. Sessions, units and temperatures often differ by "
    "more: allanite compare."
)
EQUIVALENT = "* the B whose floor equals the peak of the Gauss-Markov term with this T_b."

_FAMILIES = {
    "rate": "gyroscope",
    "angle": "gyroscope",
    "acceleration": "accelerometer",
    "velocity": "accelerometer",
    "voltage": "voltage",
    "counts": "counts",
    "phase": "clock",
    "frequency": "clock",
}
_IN_SI = {"gyroscope", "accelerometer", "voltage"}
_NAMES = {
    "gyroscope": {
        "N": "angle random walk",
        "K": "rate random walk",
        "R": "rate ramp",
        "Q": "angle quantization",
    },
    "accelerometer": {
        "N": "velocity random walk",
        "K": "acceleration random walk",
        "R": "acceleration ramp",
        "Q": "velocity quantization",
    },
    "clock": {
        "N": "white frequency noise",
        "K": "random walk of frequency",
        "R": "frequency drift",
        "Q": "white phase noise",
    },
}
_PLAIN_NAMES = {"N": "white noise", "K": "random walk", "R": "ramp", "Q": "quantisation"}
_SHARED_NAMES = {
    "B": "bias instability",
    "T": "correlation time",
    "amplitude": "spectral line",
    "frequency": "of the line",
}
#: What time and frequency metrology calls the terms (IEEE Std 1139).
_CLOCK_NAMES = {"N": "WFM", "B": "FFM", "K": "RWFM", "R": "drift", "Q": "WPM"}
_SHOWN = {"T": "T_b", "amplitude": "line", "frequency": "f"}
#: Columns that belong together, in the order of a table; a second term of a kind follows the first one.
_KINDS = (("N",), ("B", "T"), ("K",), ("R",), ("Q",), ("amplitude", "frequency"))
_TABULATED = tuple(symbol for kind in _KINDS for symbol in kind)
_ONLY_RESOLVED = ("T", "frequency")
_COUNTS = {3: "three", 4: "four", 5: "five", 6: "six"}


# -- units and names --------------------------------------------------------------------------------------


def _split(column: str) -> tuple[str, int]:
    """The symbol of a column, and which of several terms of its kind it is."""
    match = re.fullmatch(r"(.*)_(\d+)", column)
    return (match[1], int(match[2])) if match else (column, 1)


def column_of(symbol: str) -> str:
    """The column in which an estimate stands: B_equiv of a Gauss-Markov term is a B."""
    return symbol.replace("B_equiv", "B")


def shown_symbol(column: str) -> str:
    """A column's heading: T_b, of a second term T_b2."""
    symbol, which = _split(column)
    shown = _SHOWN.get(symbol, symbol)
    return shown if which == 1 else f"{shown}{'' if '_' in shown else '_'}{which}"


def _place(column: str) -> tuple[int, int, int]:
    """Sort key of columns: a second Gauss-Markov term follows the first one, a second line the first line."""
    symbol, which = _split(column)
    kind = next(i for i, kind in enumerate(_KINDS) if symbol in kind)
    return kind, which, _KINDS[kind].index(symbol)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelGroup(Generic[C]):
    """Channels of a study that share their units: the axes of one triad.

    Attributes
    ----------
    title : str
        "Gyroscope", "Accelerometer", ...
    kind, unit : str
        What `display_unit` needs.
    channels : tuple of ChannelModels
        Of a study, or of a fit.
    """

    title: str
    kind: str
    unit: str
    channels: tuple[C, ...]

    @property
    def has_si(self) -> bool:
        """False where results stay in the channel's own unit, or are in SI as they are: volts."""
        return self.title.lower() in ("gyroscope", "accelerometer")

    def name_of(self, symbol: str) -> str:
        """What the coefficient is called for this kind of sensor: "angle random walk"."""
        symbol, which = _split(symbol)
        if which > 1:
            return f"{self.name_of(symbol)}, number {which}"
        names = _NAMES.get(self.title.lower(), _PLAIN_NAMES)
        return _SHARED_NAMES.get(symbol) or names.get(symbol, symbol)


def groups(channels: Iterable[C]) -> tuple[ChannelGroup[C], ...]:
    """Channels sorted into groups of equal units, in the order of their first appearance.

    Channels without a known unit are grouped by their names: gx, gy, gz apart from ax, ay, az.
    """
    alike: dict[tuple[str, str, str], list[C]] = {}
    for channel in channels:
        family = _FAMILIES.get(channel.kind, "unknown")
        known = family in _IN_SI or family == "clock"
        key = (family, "", "") if known else (family, channel.unit, _stem(channel.name))
        alike.setdefault(key, []).append(channel)
    return tuple(
        ChannelGroup(
            title=_title(family, unit, members), kind=members[0].kind, unit=unit, channels=tuple(members)
        )
        for (family, unit, _), members in alike.items()
    )


def _stem(name: str) -> str:
    """A channel's name without its axis: gx and gyro_x are axes, temperature is not."""
    return re.sub(r"[ _.\[]*(?:[xyzXYZ]|\d+)\]?$", "", name)


def _title(family: str, unit: str, members: Sequence[ChannelModels]) -> str:
    if family in _IN_SI or family == "clock":
        return family.capitalize()
    names = ", ".join(c.name for c in members[:6])
    return f"{names} ({unit or 'unknown unit'})"


def headings(group: ChannelGroup[C]) -> dict[str, tuple[str, str]]:
    """Columns that at least one channel of the group has something to say about: symbol -> (head, people's unit)."""
    present = {symbol for channel in group.channels for symbol in readings(channel)}
    heads = {s: shown_symbol(s) for s in sorted(present, key=_place)}
    if group.title == "Clock":
        heads = {s: f"{head}, {_CLOCK_NAMES[s]}" if s in _CLOCK_NAMES else head for s, head in heads.items()}
    return {s: (head, display_unit(group.kind, s, group.unit)[0]) for s, head in heads.items()}


# -- coefficients -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class CoefficientWording:
    """One coefficient as people read it.

    Attributes
    ----------
    symbol, unit, si_unit : str
    supported : bool
        False: `value` is the text of an upper limit, or "not bounded".
    value, range : str
        In people's unit; `range` is empty for a limit.
    si, si_range : str
        The same in SI.
    note : str
    amount : float or None
        Value, or upper limit, in people's unit.
    """

    symbol: str
    unit: str
    si_unit: str
    supported: bool
    value: str
    range: str
    si: str
    si_range: str
    note: str
    amount: float | None

    @property
    def equivalent(self) -> bool:
        """True for the B that stands for a Gauss-Markov term."""
        return self.symbol.startswith("B_equiv")

    @property
    def text(self) -> str:
        """Value, interval and unit in one line."""
        return " ".join(part for part in (self.value, self.range, self.unit) if part)


def reading(kind: str, unit: str, estimate: Estimate, *, read_off: bool = False) -> CoefficientWording:
    """An estimate as people read it; `read_off`: by slopes, a value without an interval."""
    symbol, supported = estimate.symbol, estimate.supported
    text, factor = display_unit(kind, symbol, unit)
    shown, si = (_scaled(estimate, f, read_off) for f in (factor, 1.0))
    amount = _known(estimate.value if supported or read_off else estimate.upper)
    return CoefficientWording(
        symbol=symbol,
        unit=text,
        si_unit=si_unit(kind, column_of(symbol), unit),
        supported=supported,
        value=shown[0],
        range=shown[1],
        si=si[0],
        si_range=si[1],
        note="; ".join(part for part in (_note(estimate), _statistical(estimate, factor)) if part),
        amount=None if amount is None else amount / factor,
    )


def _known(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _statistical(estimate: Estimate, factor: float) -> str:
    """The interval without the error of the scale factor, where it holds that."""
    ends, value = estimate.statistical, estimate.value
    if ends is None or _known(ends[1]) is None:
        return ""
    if not estimate.supported or value is None:
        return f"by statistics alone {upper_limit(ends[1] / factor)}"
    _, low, high = interval(value / factor, ends[0] / factor, ends[1] / factor)
    return f"by statistics alone [{low}, {high}]"


def _note(estimate: Estimate) -> str:
    if estimate.note == "upper limit":  # the "<" says so
        return ""
    if estimate.symbol.startswith("B_equiv") and not estimate.note:
        return "from the Gauss-Markov term: the B with the same peak"
    return estimate.note


def _scaled(estimate: Estimate, factor: float, read_off: bool) -> tuple[str, str]:
    value, lower, upper = (
        None if v is None else v / factor for v in (estimate.value, estimate.lower, estimate.upper)
    )
    if estimate.supported and value is not None:
        middle, low, high = interval(value, lower, upper)
        return middle, f"[{low}, {high}]"
    if read_off:
        return number(value), ""
    limit = _known(upper)
    return ("not bounded" if limit is None else upper_limit(limit)), ""


def readings(channel: ChannelModels, model: NoiseModel | None = None) -> dict[str, CoefficientWording]:
    """Coefficients of a channel's first model (or of the one given), keyed by their columns.

    Columns are those of `COLUMNS`, numbered from the second term of a kind on (B_2, T_2), and amplitude and frequency
    of lines. B_equiv of a Gauss-Markov model stands in column B. T appears where it is supported, or read off, only:
    elsewhere it is not a limit that anybody can use.
    """
    shown = model or next(iter(channel.models), NoiseModel(terms=()))
    read_off = shown.family == "slopes"
    by_column: dict[str, CoefficientWording] = {}
    for estimate in shown.estimates:
        column = column_of(estimate.symbol)
        symbol = _split(column)[0]
        if symbol in _TABULATED and (symbol not in _ONLY_RESOLVED or estimate.supported or read_off):
            by_column[column] = reading(channel.kind, channel.unit, estimate, read_off=read_off)
    return {column: by_column[column] for column in sorted(by_column, key=_place)}


def slope_reading(channel: ChannelModels, read: SlopeReading) -> str:
    """The seed's reading of a coefficient off the curve, as text."""
    if math.isnan(read.value):
        return "the curve has no such slope"
    unit, factor = display_unit(channel.kind, read.symbol, channel.unit)
    return f"{number(read.value / factor)} {unit}" + (f", {read.note}" if read.note else "")


# -- sentences --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyNumber:
    """A number that answers the question of a report, as texts: what it is, value and unit, and what to know of it."""

    name: str
    value: str
    unit: str
    beside: str


def key_numbers(group: ChannelGroup[C]) -> list[KeyNumber]:
    """The terms that the record resolves: of several channels the smallest to the largest value."""
    return [n for term in _terms(group) if (n := _key_number(group, term)) is not None]


def limit_words(group: ChannelGroup[C]) -> str:
    """The terms that no channel resolves, each with the largest of its limits; "" where there are none."""
    absent = [a for term in _terms(group) if (a := _absent(term))]
    return f"Not resolved: {', '.join(absent)}." if absent else ""


def cautions(channels: Iterable[ChannelModels]) -> list[str]:
    """Where a record cannot decide, where the model does not explain it, and where there is none."""
    sentences, poor, bare = [], [], []
    for channel in channels:
        for other in channel.models[1:]:
            words = "; ".join(f"{shown_symbol(s)} {r.text}" for s, r in readings(channel, other).items())
            family = other.family.title() if other.family == "gauss-markov" else other.family
            open_ = f"{channel.name}: the record cannot decide between two models"
            sentences.append(f"{open_}. The {family} family gives {words}")
        if not channel.models:
            bare.append(channel.name)
        elif is_poor(channel.models[0]):
            poor.append(f"{channel.name} ({probability(channel.models[0].goodness['p'])})")
    if poor:
        sentences.append(
            f"The model does not explain the curve of {listed(poor)}: take these numbers with caution."
        )
    if bare:
        sentences.append(f"No model was fitted to {listed(bare)}; the findings say why.")
    return sentences


def is_poor(model: NoiseModel) -> bool:
    """The model does not explain what it was fitted to."""
    p = model.goodness.get("p")
    return p is not None and p < 0.01


@dataclass(frozen=True, slots=True)
class _Term:
    """One term in the channels that know anything of it, by their names."""

    symbol: str
    known: Mapping[str, CoefficientWording]

    @property
    def resolved(self) -> dict[str, CoefficientWording]:
        return {name: r for name, r in self.known.items() if r.supported}

    @property
    def limits(self) -> dict[str, CoefficientWording]:
        return {name: r for name, r in self.known.items() if not r.supported}


def _terms(group: ChannelGroup[C]) -> list[_Term]:
    read = [(c.name, readings(c)) for c in group.channels]
    return [
        _Term(symbol, {name: r for name, rs in read if (r := rs.get(symbol)) and r.amount is not None})
        for symbol in COLUMNS
    ]


def _key_number(group: ChannelGroup[C], term: _Term) -> KeyNumber | None:
    """Where a term is resolved, and where it is only bounded; None where no channel resolves it."""
    symbol, resolved, limits = term.symbol, term.resolved, term.limits
    if not resolved:
        return None
    some = sorted(resolved.values(), key=lambda r: r.amount or 0.0)
    low, high = some[0], some[-1]
    ends = [low.value] if len(some) == 1 else list(dict.fromkeys(number(r.amount) for r in (low, high)))
    beside = f"95 % interval {low.range}" if len(group.channels) == 1 else _where(resolved, group)
    return KeyNumber(
        name=f"{group.name_of(symbol).capitalize()} {_SHOWN.get(symbol, symbol)}",
        value=" to ".join(ends),
        unit=low.unit,
        beside=beside + (f"; {_where(limits, group)} {_largest(limits.values())}" if limits else ""),
    )


def _absent(term: _Term) -> str:
    """A term that no channel resolves, with the largest of its limits."""
    if term.resolved or not term.limits:
        return ""
    return f"{_SHOWN.get(term.symbol, term.symbol)} {_largest(term.limits.values())}"


def _where(some: Mapping[str, CoefficientWording], group: ChannelGroup[C]) -> str:
    count = len(group.channels)
    if len(some) == count:
        return "both channels" if count == 2 else f"all {_COUNTS.get(count, count)} channels"
    return listed(list(some))


def _largest(coefficients: Iterable[CoefficientWording]) -> str:
    """The largest of some limits, which holds for all."""
    largest = max(coefficients, key=lambda r: r.amount or 0.0)
    return f"below {largest.value.removeprefix('< ')} {largest.unit}"
