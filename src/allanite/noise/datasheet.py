# SPDX-License-Identifier: BSD-3-Clause
"""Noise models from what data sheets say, every convention named: what could be read in two ways is refused.

=========================  =================================================================================
entry                      what it is, and what must stand beside it
=========================  =================================================================================
angle_random_walk          N in deg/√h; of an accelerometer velocity_random_walk in m/s/√h
noise_density              deg/s/√Hz, µg/√Hz, with density_is: one-sided (N = density/√2) or two-sided (N)
rms_noise                  deg/s, mg: root mean square over `bandwidth`, N = rms/√(2 b), with bandwidth_is:
                           noise-equivalent (b is it), or the -3 dB corner of a first-order (b = 1.571 of it) or
                           second-order (Butterworth, b = 1.111 of it) low-pass
bias_instability           deg/h, µg, with bias_instability_is: minimum (of the Allan deviation) or coefficient (B, of
                           which the floor is 0.664); bias_instability_tau is where the minimum is
bias_stability             standard deviation (1 sigma) of the bias in a run, with its correlation_time
correlation_time           of the bias: a Gauss-Markov process in place of flicker
rate_random_walk           K in deg/h/√h; of an accelerometer acceleration_random_walk in µg/√h
rate_ramp                  R in deg/h/h; of an accelerometer acceleration_ramp in µg/h
quantisation               Q in arcsec, of the angle; of an accelerometer in m/s, of the velocity
=========================  =================================================================================

With white noise and random walk the deviation is N^2/tau + f^2 B^2 + K^2 tau/3, f = 0.664, whose minimum

    F^2 = f^2 B^2 + 2 N K/sqrt(3)   stands at   tau = sqrt(3) N/K.

So a stated minimum gives B^2 = (F^2 - 2 N K/sqrt(3))/f^2, and its place a K where none is stated. Without both the
curve falls to the minimum and stays there, B = F/f.

References
----------
.. [1] IEEE Std 952-1997, annex C. IEEE Std 1293-1998 (accelerometers).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TypedDict

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.terms import (
    FLICKER_FLOOR,
    SIGMA_PER_B,
    Flicker,
    GaussMarkov,
    Quantisation,
    Ramp,
    RandomWalk,
    TermType,
    White,
)
from allanite.quantities.result import Result
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["ENTRIES", "DatasheetEntries", "SensorSheet", "SheetEntry", "sensor_sheet"]


class DatasheetEntries(TypedDict, total=False):
    """What `NoiseModel.from_datasheet` takes: a number with its unit, or the word for a convention."""

    angle_random_walk: str
    velocity_random_walk: str
    noise_density: str
    density_is: str
    rms_noise: str
    bandwidth: str
    bandwidth_is: str
    bias_instability: str
    bias_instability_is: str
    bias_instability_tau: str
    bias_stability: str
    correlation_time: str
    rate_random_walk: str
    acceleration_random_walk: str
    rate_ramp: str
    acceleration_ramp: str
    quantisation: str


#: Entries with a value -> what its unit may be: that of a gyro, that of an accelerometer.
_QUANTITIES: dict[str, tuple[QuantityKind, ...]] = {
    "angle_random_walk": (QuantityKind.GYRO_N,),
    "velocity_random_walk": (QuantityKind.ACCEL_N,),
    "noise_density": (QuantityKind.GYRO_N, QuantityKind.ACCEL_N),
    "rms_noise": (QuantityKind.ANGLE_RATE, QuantityKind.ACCELERATION),
    "bandwidth": (QuantityKind.FREQUENCY,),
    "bias_instability": (QuantityKind.ANGLE_RATE, QuantityKind.ACCELERATION),
    "bias_instability_tau": (QuantityKind.TIME,),
    "bias_stability": (QuantityKind.ANGLE_RATE, QuantityKind.ACCELERATION),
    "correlation_time": (QuantityKind.TIME,),
    "rate_random_walk": (QuantityKind.GYRO_K,),
    "acceleration_random_walk": (QuantityKind.ACCEL_K,),
    "rate_ramp": (QuantityKind.GYRO_R,),
    "acceleration_ramp": (QuantityKind.ACCEL_R,),
    "quantisation": (QuantityKind.ANGLE, QuantityKind.VELOCITY),
}
_OF_GYROS = frozenset(
    {
        QuantityKind.GYRO_N,
        QuantityKind.ANGLE_RATE,
        QuantityKind.GYRO_K,
        QuantityKind.GYRO_R,
        QuantityKind.ANGLE,
    }
)
#: Noise-equivalent bandwidth over the -3 dB corner.
_BANDWIDTHS = {"noise-equivalent": 1.0, "first-order": math.pi / 2, "second-order": math.pi / math.sqrt(8)}
_WORDS = {
    "density_is": ("one-sided", "two-sided"),
    "bandwidth_is": tuple(_BANDWIDTHS),
    "bias_instability_is": ("minimum", "coefficient"),
}
ENTRIES = (*_QUANTITIES, *_WORDS)
_VALUE = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d.].*?)\s*")
#: No value of a sensor is beyond these in SI; within them no square is too large or too small for a number.
_LEAST, _MOST = 1e-100, 1e100
#: Where the sheet states both the place of the minimum and K, they may differ by this factor.
_AGREES = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetEntry(Result):
    """One statement of a data sheet.

    Attributes
    ----------
    name : str
        Of the entry.
    text : str
        As it was written.
    symbol : str
        What it states: Q, N, B, K, R, sigma, T, or "minimum" of the Allan deviation.
    value : float
        Of that, in SI.
    reading : str
        The convention by which it was read.
    """

    name: str
    text: str
    symbol: str
    value: float
    reading: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSheet:
    """What a data sheet says of the noise of one kind of sensor.

    Attributes
    ----------
    entries : tuple of SheetEntry
    terms : tuple of terms
        What they make: their sum is the model.
    kind : str
        "rate" or "acceleration", by the units.
    verdict : str
        How they were read.
    """

    entries: tuple[SheetEntry, ...]
    terms: tuple[TermType, ...]
    kind: str
    verdict: str


def sensor_sheet(entries: Mapping[str, object]) -> SensorSheet:
    """The statements of a data sheet and the terms that they make.

    Raises
    ------
    InputError
        An unknown entry, a value without unit or in a unit of something else, a convention that is missing or not
        known, two entries for the same thing, entries of gyros and of accelerometers, or values that contradict one
        another: the message says what to state.
    """
    unknown = [name for name in entries if name not in ENTRIES]
    if unknown:
        raise InputError(f"a data sheet has no entry {unknown[0]!r}; there are: {', '.join(ENTRIES)}")
    read = _Read.of({name: value for name, value in entries.items() if value is not None})
    white = _white(read)
    walk = _one(read, "K", "rate_random_walk", "acceleration_random_walk")
    bias, implied = _bias(read, white, walk)
    ramp = _one(read, "R", "rate_ramp", "acceleration_ramp")
    grain = _one(read, "Q", "quantisation")
    time = _correlation_time(read)
    stated = tuple(e for e in (grain, white, bias, time, walk, ramp) if e is not None)
    if not {e.symbol for e in stated} - {"T"}:
        raise InputError("this data sheet states no noise: give angle_random_walk, bias_instability, ...")
    terms = _terms(stated, implied)
    statements = "; ".join(f"{e.name} {e.text}{': ' * bool(e.reading)}{e.reading}" for e in stated)
    return SensorSheet(
        entries=stated,
        terms=tuple(terms),
        kind=read.kind,
        verdict=f"From a data sheet: {statements}.",
    )


# -- reading ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """Values in SI, words, and the kind of sensor that the units speak of."""

    texts: Mapping[str, str]
    values: Mapping[str, float]
    kind: str

    @classmethod
    def of(cls, entries: Mapping[str, object]) -> _Read:
        texts: dict[str, str] = {}
        values: dict[str, float] = {}
        kinds: dict[str, str] = {}
        for name, given in entries.items():
            if not isinstance(given, str):
                raise InputError(f"{name}: write the number with its unit as text, not {given!r}")
            texts[name] = " ".join(given.split())
            if name in _WORDS:
                texts[name] = _word(name, given)
                continue
            values[name], quantity = _value(name, given)
            if quantity not in (QuantityKind.TIME, QuantityKind.FREQUENCY):
                kinds[name] = "rate" if quantity in _OF_GYROS else "acceleration"
        if len(set(kinds.values())) > 1:
            named = ", ".join(f"{name} ({kind})" for name, kind in kinds.items())
            raise InputError(f"these entries are of different sensors: {named}; one sheet for each")
        return cls(texts=texts, values=values, kind=next(iter(kinds.values()), "rate"))

    def word(self, name: str, of: str, meanings: Mapping[str, str]) -> str:
        """The convention of an entry, without which that can be read in several ways."""
        if name not in self.texts:
            ways = "; or ".join(f"{name}={word!r}: {meaning}" for word, meaning in meanings.items())
            raise InputError(f"{of} {self.texts[of]} can be read in more than one way: state {ways}")
        return self.texts[name]


def _word(name: str, given: str) -> str:
    word = "-".join(given.strip().lower().replace("_", " ").split())
    if word not in _WORDS[name]:
        raise InputError(f"{name} must be {' or '.join(repr(w) for w in _WORDS[name])}, not {given!r}")
    return word


def _value(name: str, given: str) -> tuple[float, QuantityKind]:
    match = _VALUE.fullmatch(given)
    if match is None:
        raise InputError(f"{name}: {given!r} is not a number with its unit, like '0.3 deg/√h'")
    number, unit = float(match[1]), match[2]
    try:
        parsed = parse_unit(unit, _QUANTITIES[name])
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    per_hertz = "hz" in unit.lower()
    if name in ("angle_random_walk", "velocity_random_walk") and per_hertz:
        raise InputError(
            f"{name} in {unit} is a density: give it as noise_density, with density_is one-sided or two-sided"
        )
    if name == "noise_density" and not per_hertz:
        raise InputError(
            f"noise_density in {unit} is a random walk: give it as angle_random_walk or velocity_random_walk"
        )
    if not (number > 0 and _LEAST < number * parsed.factor < _MOST):
        raise InputError(
            f"{name} must be positive and that of a sensor, not {given[:40]!r}; leave out what the sheet does not state"
        )
    return number * parsed.factor, parsed.quantity


# -- terms ------------------------------------------------------------------------------------------------------


def _one(read: _Read, symbol: str, *names: str) -> SheetEntry | None:
    """The entry for a symbol, out of several names for it."""
    there = [name for name in names if name in read.values]
    if len(there) > 1:
        raise InputError(f"{' and '.join(there)} both state {symbol}: give one of them")
    if not there:
        return None
    name = there[0]
    return SheetEntry(name=name, text=read.texts[name], symbol=symbol, value=read.values[name])


def _white(read: _Read) -> SheetEntry | None:
    entry = _one(read, "N", "angle_random_walk", "velocity_random_walk", "noise_density", "rms_noise")
    for word, owner in (
        ("density_is", "noise_density"),
        ("bandwidth_is", "rms_noise"),
        ("bandwidth", "rms_noise"),
    ):
        if word in read.texts and owner not in read.values:
            raise InputError(f"{word} stands without {owner}, which it is about")
    if entry is None or entry.name.endswith("random_walk"):
        return entry
    if entry.name == "noise_density":
        meanings = {
            "one-sided": "as a spectrum analyzer shows it, N is the density over √2",
            "two-sided": "N itself, as in IEEE Std 952, and 60 times it in deg/√h is the angle random walk",
        }
        word = read.word("density_is", "noise_density", meanings)
        factor = math.sqrt(0.5) if word == "one-sided" else 1.0
        return _reading(entry, entry.value * factor, f"{word} density")
    if "bandwidth" not in read.values:
        raise InputError(f"rms_noise {entry.text} is over a bandwidth: state bandwidth, like '100 Hz'")
    meanings = {
        "noise-equivalent": "of the noise (half the output rate, where samples are means)",
        "first-order": "the -3 dB corner of a first-order low-pass",
        "second-order": "that of a second-order one",
    }
    word = read.word("bandwidth_is", "bandwidth", meanings)
    width = read.values["bandwidth"] * _BANDWIDTHS[word]
    return _reading(entry, entry.value / math.sqrt(2 * width), f"rms over {read.texts['bandwidth']}, {word}")


def _reading(entry: SheetEntry, value: float, reading: str, symbol: str | None = None) -> SheetEntry:
    return SheetEntry(
        name=entry.name, text=entry.text, symbol=symbol or entry.symbol, value=value, reading=reading
    )


def _correlation_time(read: _Read) -> SheetEntry | None:
    entry = _one(read, "T", "correlation_time")
    if entry is not None and not {"bias_instability", "bias_stability"} & set(read.values):
        raise InputError(
            "correlation_time is that of a bias: state bias_stability (1 sigma) or bias_instability"
        )
    return entry


def _bias(
    read: _Read, white: SheetEntry | None, walk: SheetEntry | None
) -> tuple[SheetEntry | None, tuple[TermType, ...]]:
    """The statement about the bias, and the terms that it makes."""
    entry = _one(read, "the bias", "bias_instability", "bias_stability")
    for word in ("bias_instability_is", "bias_instability_tau"):
        if word in read.texts and "bias_instability" not in read.values:
            raise InputError(f"{word} stands without bias_instability, which it is about")
    if entry is None:
        return None, ()
    time = read.values.get("correlation_time")
    if entry.name == "bias_stability":
        if time is None:
            raise InputError(
                f"bias_stability {entry.text} is a standard deviation (1 sigma): state its correlation_time; where the "
                "sheet means the minimum of the Allan deviation, it is bias_instability with "
                "bias_instability_is='minimum'"
            )
        made = GaussMarkov.from_sigma(entry.value, time)
        return _reading(entry, entry.value, "standard deviation, 1 sigma", "sigma"), (made,)
    meanings = {
        "minimum": "the lowest value of the Allan deviation, as most data sheets print it",
        "coefficient": "B of IEEE Std 952, 1.505 times the flat part of the curve",
    }
    if read.word("bias_instability_is", "bias_instability", meanings) == "coefficient":
        return _reading(entry, entry.value, "coefficient B", "B"), (_slow(entry.value, time),)
    stated = _reading(entry, entry.value, _where(read), "minimum")
    if time is not None:
        return stated, (_slow(entry.value / FLICKER_FLOOR, time),)
    return stated, _below_minimum(read, entry.value, white, walk)


def _where(read: _Read) -> str:
    place = read.texts.get("bias_instability_tau")
    return "minimum of the Allan deviation" + (f" at {place}" if place else "")


def _slow(B: float, time: float | None) -> TermType:
    """Flicker, or the Gauss-Markov term whose peak is its floor."""
    return Flicker(B=B) if time is None else GaussMarkov.from_sigma(SIGMA_PER_B * B, time)


def _below_minimum(
    read: _Read, minimum: float, white: SheetEntry | None, walk: SheetEntry | None
) -> tuple[TermType, ...]:
    """Flicker, and a random walk where the place of the minimum implies one."""
    place = read.values.get("bias_instability_tau")
    N, K = (0.0 if e is None else e.value for e in (white, walk))
    implied: tuple[TermType, ...] = ()
    if place is not None and K > 0:
        tau = math.sqrt(3) * N / K
        if not 1 / _AGREES <= tau / place <= _AGREES:
            raise InputError(
                f"bias_instability_tau {read.texts['bias_instability_tau']} and the random walk contradict one "
                f"another: N and K put the minimum at {tau:.3g} s; leave out one of them"
            )
    elif place is not None and N > 0:
        K = math.sqrt(3) * N / place
        implied = (RandomWalk(K=K),)
    left = minimum**2 - 2 * N * K / math.sqrt(3)
    if left < 0:
        times = math.sqrt(2 * N * K / math.sqrt(3)) / minimum
        raise InputError(
            f"bias_instability {read.texts['bias_instability']} as a minimum contradicts the white noise and the "
            f"random walk, whose own minimum is {times:.3g} times as high: are they typical and it the best, or is it "
            "of another averaging time?"
        )
    return (Flicker(B=math.sqrt(left) / FLICKER_FLOOR), *implied) if left > 0 else implied


def _terms(stated: tuple[SheetEntry, ...], slow: tuple[TermType, ...]) -> tuple[TermType, ...]:
    values = {e.symbol: e.value for e in stated}
    made: list[TermType] = []
    if "Q" in values:
        made.append(Quantisation(Q=values["Q"]))
    if "N" in values:
        made.append(White(N=values["N"]))
    made += slow
    if "K" in values:
        made.append(RandomWalk(K=values["K"]))
    if "R" in values:
        made.append(Ramp(R=values["R"]))
    return tuple(made)
