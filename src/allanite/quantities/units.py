# SPDX-License-Identifier: BSD-3-Clause
"""SI inside; outside units are read here, at the edge, and the results are scaled, never the samples.

A unit text becomes a factor and a class of quantity. The class keeps the root: ``deg/√h`` is an angle random
walk and can never pass for the rate ``deg/h``. ``g``, ``mg`` and ``µg`` are multiples of standard gravity,
never grams. Densities are roots of *two-sided* power spectral densities, so ``N² = S(f)`` of the white part.

>>> parse_unit("deg/√h").quantity is QuantityKind.GYRO_N
True
>>> math.isclose(parse_scale_factor("131 LSB/(deg/s)").factor * 131, parse_unit("deg/s").factor)
True
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from enum import StrEnum
from functools import lru_cache

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.uncertain_number import parse_leading_number

__all__ = [
    "STANDARD_GRAVITY",
    "QuantityKind",
    "ScaleFactor",
    "Unit",
    "parse_scale_factor",
    "parse_unit",
]

#: Standard gravity [m/s²], exact by definition (CGPM 1901). Local gravity is another number.
STANDARD_GRAVITY = 9.80665

_LONGEST_TEXT = 80


class QuantityKind(StrEnum):
    """Classes of quantity; two units may be compared only inside one class."""

    ANGLE_RATE = "angle rate"
    ANGLE = "angle"
    ACCELERATION = "acceleration"
    VELOCITY = "velocity"
    VOLTAGE = "voltage"
    COUNTS = "counts"
    TIME = "time"
    FREQUENCY = "frequency"
    TEMPERATURE = "temperature"
    RATIO = "ratio"
    LENGTH = "length"
    MAGNETIC = "magnetic flux density"
    PRESSURE = "pressure"
    GYRO_N = "angle random walk N (root density of angle rate)"
    GYRO_K = "rate random walk K"
    GYRO_R = "rate ramp R"
    ACCEL_N = "velocity random walk N (root density of acceleration)"
    ACCEL_K = "acceleration random walk K"
    ACCEL_R = "acceleration ramp R"
    VOLTAGE_N = "root density of voltage"
    VOLTAGE_K = "random walk of voltage"
    VOLTAGE_R = "ramp of voltage"
    VOLTAGE_Q = "quantization of voltage"
    COUNTS_N = "root density of counts"
    COUNTS_K = "random walk of counts"
    COUNTS_R = "ramp of counts"
    COUNTS_Q = "quantization of counts"
    GYRO_PSD = "power spectral density of angle rate"
    ACCEL_PSD = "power spectral density of acceleration"
    VOLTAGE_PSD = "power spectral density of voltage"
    GYRO_G = "gravity sensitivity of angle rate"
    SCALE_FACTOR = "scale factor"


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit that was understood.

    Attributes
    ----------
    text : str
        As it was written.
    factor : float
        SI value of one unit.
    quantity : QuantityKind
    offset : float
        SI value of zero units (273.15 for °C); 0.0 for all but temperatures.
    """

    text: str
    factor: float
    quantity: QuantityKind
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class ScaleFactor:
    """How a sensor's output follows its input: physical SI value = factor * sample SI value.

    Attributes
    ----------
    text : str
        As it was written.
    factor : float
        Physical SI units per SI unit of the sample (per V, or per count).
    sample, physical : QuantityKind
        Class of the samples (voltage or counts) and of what they mean.
    uncertainty : float or None
        Standard uncertainty, relative; None where none is stated.
    """

    text: str
    factor: float
    sample: QuantityKind
    physical: QuantityKind
    uncertainty: float | None = None


# -- the table --------------------------------------------------------------------------------------------
# A dimension is the tuple of twice the exponents of (rad, m, s, V, count, K, T, Pa): twice, because a root
# density has half powers. The angle counts as a dimension of its own, or rad/s would be a frequency.

_Dimension = tuple[int, ...]
_NONE: _Dimension = (0, 0, 0, 0, 0, 0, 0, 0)


def _dim(
    angle: float = 0, length: float = 0, time: float = 0, volt: float = 0, count: float = 0
) -> _Dimension:
    return (int(2 * angle), int(2 * length), int(2 * time), int(2 * volt), int(2 * count), 0, 0, 0)


_KELVIN: _Dimension = (0, 0, 0, 0, 0, 2, 0, 0)
_TESLA: _Dimension = (0, 0, 0, 0, 0, 0, 2, 0)
_PASCAL: _Dimension = (0, 0, 0, 0, 0, 0, 0, 2)

_CLASSES: dict[_Dimension, QuantityKind] = {
    _NONE: QuantityKind.RATIO,
    _dim(angle=1): QuantityKind.ANGLE,
    _dim(angle=1, time=-1): QuantityKind.ANGLE_RATE,
    _dim(angle=1, time=-0.5): QuantityKind.GYRO_N,
    _dim(angle=1, time=-1.5): QuantityKind.GYRO_K,
    _dim(angle=1, time=-2): QuantityKind.GYRO_R,
    _dim(angle=2, time=-1): QuantityKind.GYRO_PSD,
    _dim(angle=1, time=1, length=-1): QuantityKind.GYRO_G,
    _dim(length=1): QuantityKind.LENGTH,
    _dim(length=1, time=-1): QuantityKind.VELOCITY,
    _dim(length=1, time=-2): QuantityKind.ACCELERATION,
    _dim(length=1, time=-1.5): QuantityKind.ACCEL_N,
    _dim(length=1, time=-2.5): QuantityKind.ACCEL_K,
    _dim(length=1, time=-3): QuantityKind.ACCEL_R,
    _dim(length=2, time=-3): QuantityKind.ACCEL_PSD,
    _dim(volt=1): QuantityKind.VOLTAGE,
    _dim(volt=1, time=0.5): QuantityKind.VOLTAGE_N,
    _dim(volt=1, time=-0.5): QuantityKind.VOLTAGE_K,
    _dim(volt=1, time=-1): QuantityKind.VOLTAGE_R,
    _dim(volt=1, time=1): QuantityKind.VOLTAGE_Q,
    _dim(volt=2, time=1): QuantityKind.VOLTAGE_PSD,
    _dim(count=1): QuantityKind.COUNTS,
    _dim(count=1, time=0.5): QuantityKind.COUNTS_N,
    _dim(count=1, time=-0.5): QuantityKind.COUNTS_K,
    _dim(count=1, time=-1): QuantityKind.COUNTS_R,
    _dim(count=1, time=1): QuantityKind.COUNTS_Q,
    _dim(time=1): QuantityKind.TIME,
    _dim(time=-1): QuantityKind.FREQUENCY,
    _KELVIN: QuantityKind.TEMPERATURE,
    _TESLA: QuantityKind.MAGNETIC,
    _PASCAL: QuantityKind.PRESSURE,
}

#: What a scale factor may turn volts or counts into.
_PHYSICAL = (
    QuantityKind.ANGLE_RATE,
    QuantityKind.ANGLE,
    QuantityKind.ACCELERATION,
    QuantityKind.VELOCITY,
    QuantityKind.VOLTAGE,
    QuantityKind.TEMPERATURE,
)

_DEG = math.pi / 180.0
_RATE, _ACCELERATION = _dim(angle=1, time=-1), _dim(length=1, time=-2)
_PREFIX = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "h": 1e2, "k": 1e3, "M": 1e6}

# names (blank-separated), SI factor, dimension, metric prefixes it may carry
_TABLE: tuple[tuple[str, float, _Dimension, str], ...] = (
    ("rad radian radians", 1.0, _dim(angle=1), "nµm"),
    ("deg degs degree degrees °", _DEG, _dim(angle=1), "µm"),
    ("arcmin ′ '", _DEG / 60.0, _dim(angle=1), ""),
    ('arcsec arcsecs arcsecond arcseconds asec ″ "', _DEG / 3600.0, _dim(angle=1), "m"),
    ("rev revs revolution revolutions turn turns cycle cycles cyc", 2.0 * math.pi, _dim(angle=1), "nµm"),
    ("gon gons gradian gradians", math.pi / 200.0, _dim(angle=1), "m"),
    ("dps", _DEG, _RATE, "µm"),
    ("dph", _DEG / 3600.0, _RATE, ""),
    ("rpm", 2.0 * math.pi / 60.0, _RATE, ""),
    ("eru", 7.292115e-5, _RATE, "m"),  # Earth rate unit; meru = 1/1000 of it
    ("m meter meters metre metres", 1.0, _dim(length=1), "nµmck"),
    ("ft foot feet", 0.3048, _dim(length=1), ""),
    ("g g0 gee", STANDARD_GRAVITY, _ACCELERATION, "nµm"),
    ("Gal", 1e-2, _ACCELERATION, "nµm"),
    ("s sec secs second seconds", 1.0, _dim(time=1), "fpnµm"),
    ("millisecond milliseconds", 1e-3, _dim(time=1), ""),
    ("microsecond microseconds", 1e-6, _dim(time=1), ""),
    ("nanosecond nanoseconds", 1e-9, _dim(time=1), ""),
    ("min mins minute minutes", 60.0, _dim(time=1), ""),
    ("h hr Hr HR hrs hour hours", 3600.0, _dim(time=1), ""),
    ("d day days", 86400.0, _dim(time=1), ""),
    ("Hz hz", 1.0, _dim(time=-1), "mkM"),
    ("V volt volts", 1.0, _dim(volt=1), "nµmk"),
    ("Vdc VDC", 1.0, _dim(volt=1), "µm"),
    ("LSB LSBs count counts cnt cnts ct cts digit digits", 1.0, _dim(count=1), ""),
    ("K kelvin °C degC celsius ℃ C", 1.0, _KELVIN, ""),
    ("°F degF fahrenheit", 5.0 / 9.0, _KELVIN, ""),
    ("T tesla", 1.0, _TESLA, "nµm"),
    ("gauss", 1e-4, _TESLA, "µm"),
    ("Pa pascal", 1.0, _PASCAL, "hk"),
    ("bar", 1e5, _PASCAL, "m"),
    ("ppm", 1e-6, _NONE, ""),
    ("% percent", 1e-2, _NONE, ""),
)
_OFFSETS = dict.fromkeys(("°C", "degC", "celsius", "℃", "C"), 273.15) | dict.fromkeys(
    ("°F", "degF", "fahrenheit"), 459.67 * 5.0 / 9.0
)


def _names() -> Iterator[tuple[str, tuple[float, _Dimension]]]:
    for names, factor, dimension, prefixes in _TABLE:
        for name in names.split():
            yield name, (factor, dimension)
            for prefix in prefixes:
                yield prefix + name, (_PREFIX[prefix] * factor, dimension)


_UNITS = dict(_names())
#: Names of three letters and more are also read in other cases: "Deg", "LSB", "HZ" no, "KHZ" yes.
_FOLDED = {name.casefold(): value for name, value in reversed(_UNITS.items()) if len(name) > 2}
_GAUSS_OR_G = {"G": 1.0, "mG": 1e-3, "µG": 1e-6}


# -- the parser -------------------------------------------------------------------------------------------

_SPELLINGS = str.maketrans("º˚μ−–·⋅×’\u00a0\u202f[]{}", "°°µ--***'  ()()")
_SUPERSCRIPT = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_REWRITES = (
    (re.compile(r"[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+"), lambda m: "^" + m.group().translate(_SUPERSCRIPT)),
    (re.compile(r"\*\*"), lambda _: "^"),
    (re.compile(r"½"), lambda _: "0.5"),
    (re.compile(r"(?:°|\bdeg(?:rees?)?)\s*([CF])\b"), lambda m: "°" + m.group(1)),
    (re.compile(r"\bper\b", re.IGNORECASE), lambda _: "/"),
    (re.compile(r"(?<![A-Za-z])(?:sqrt|root|rt)(?=[-\s(A-Zhms])[-\s]?", re.IGNORECASE), lambda _: "√"),
    (re.compile(r"(?<=[A-Za-z0-9])_(?=[A-Za-z])"), lambda _: "/"),  # rad_s, m_s2: how column names write it
    (re.compile(r"(?<![A-Za-z])u(?=[A-Za-z])"), lambda _: "µ"),
)
_TOKEN = re.compile(
    r"\s*(?:(?P<number>\d+(?:\.\d+)?|\.\d+)|(?P<name>°[CF]\b|[^\W\d_]+(?![^\W\d_])(?:0(?![.\d]))?|[°′″'\"%℃])"
    r"|(?P<sign>[/*^()√.+-]))"
)

_Value = tuple[float, _Dimension]


class _NotAUnit(Exception):
    """What is wrong with a unit text; turned into an InputError that shows the whole text."""


def _tokens(text: str) -> list[tuple[str, str]]:
    tokens: list[tuple[str, str]] = []
    at = 0
    text = text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise _NotAUnit(f"{text[at]!r} is not understood")
        kind = str(match.lastgroup)
        blank = match.start(kind) > at and bool(tokens) and tokens[-1][0] != "sign" and kind == "name"
        if blank:
            tokens.append(("sign", "*"))
        tokens.append((kind, match.group(kind)))
        at = match.end()
    return tokens


class _Parser:
    """Recursive descent over: product = factor ((/ | *) factor)*; factor = atom [power].

    Division associates to the left, so deg/h/√h is (deg/h)/√h.
    """

    def __init__(self, tokens: list[tuple[str, str]], acceleration: bool) -> None:
        self.tokens = tokens
        self.at = 0
        self.acceleration = acceleration

    def whole(self) -> _Value:
        value = self.product()
        if self.at < len(self.tokens):
            raise _NotAUnit(f"{self.tokens[self.at][1]!r} is not expected there")
        return value

    def peek(self) -> tuple[str, str]:
        return self.tokens[self.at] if self.at < len(self.tokens) else ("end", "")

    def take(self, sign: str) -> bool:
        if self.peek() == ("sign", sign):
            self.at += 1
            return True
        return False

    def product(self) -> _Value:
        value = self.factor()
        while True:
            if self.take("/"):
                value = _times(value, _power(self.factor(), -2))
            elif self.take("*") or self.take(".") or self.peek() in (("sign", "("), ("sign", "√")):
                value = _times(value, self.factor())
            else:
                return value

    def factor(self) -> _Value:
        if self.take("√"):
            return _power(self.factor(), 1)
        value = self.atom()
        kind, token = self.peek()
        if self.take("^"):
            return _power(value, self.exponent())
        if kind == "number" or (kind, token) == ("sign", "-"):  # m/s2, s-1
            return _power(value, self.exponent())
        return value

    def atom(self) -> _Value:
        kind, token = self.peek()
        self.at += 1
        if kind == "name":
            return self.named(token)
        if (kind, token) == ("number", "1"):
            return 1.0, _NONE
        if (kind, token) == ("sign", "("):
            value = self.product()
            if not self.take(")"):
                raise _NotAUnit("a bracket is not closed")
            return value
        if kind == "number":
            raise _NotAUnit(f"a unit contains no number, but {token} is in it")
        raise _NotAUnit(f"a unit name is missing {'before ' + repr(token) if token else 'at the end'}")

    def named(self, name: str) -> _Value:
        if name in _UNITS:
            return _UNITS[name]
        if name in _GAUSS_OR_G:
            if self.acceleration:
                return _GAUSS_OR_G[name] * STANDARD_GRAVITY, _ACCELERATION
            raise _NotAUnit(f"{name!r} may be gauss or standard gravity: write 'gauss' or 'g'")
        if len(name) > 2 and name.casefold() in _FOLDED:
            return _FOLDED[name.casefold()]
        raise _NotAUnit(f"{name!r} is not a known unit{_nearest(name)}")

    def exponent(self) -> int:
        """Twice the exponent: 0.5, (1/2), -1, 1.5."""
        bracket = self.take("(")
        sign = -1 if self.take("-") else 1
        value = self.number()
        if bracket and self.take("/"):
            value /= self.number() or math.nan
        if bracket and not self.take(")"):
            raise _NotAUnit("a bracket is not closed")
        twice = 2.0 * sign * value
        if twice not in range(-16, 17):
            raise _NotAUnit(f"the power {sign * value:g} is not a whole or half number between -8 and 8")
        return int(twice)

    def number(self) -> float:
        kind, token = self.peek()
        if kind != "number":
            raise _NotAUnit("a power without a number")
        self.at += 1
        return float(token)


def _times(a: _Value, b: _Value) -> _Value:
    return a[0] * b[0], tuple(x + y for x, y in zip(a[1], b[1], strict=True))


def _power(value: _Value, twice: int) -> _Value:
    factor, dimension = value
    if any(x * twice % 2 for x in dimension):
        raise _NotAUnit("a quarter power has no meaning")
    exact = {2: factor, -2: 1.0 / factor, 1: math.sqrt(factor)}.get(twice)
    result = factor ** (twice / 2) if exact is None else exact
    return result, tuple(x * twice // 2 for x in dimension)


@lru_cache(maxsize=1024)  # a reader asks of the same word in every line whether it is a unit
def _nearest(name: str) -> str:
    from difflib import get_close_matches

    near = get_close_matches(name, _UNITS, n=3, cutoff=0.5)
    near += [n for n in get_close_matches(name.casefold(), _UNITS, n=3, cutoff=0.5) if n not in near]
    return f" (nearest: {', '.join(near[:3])})" if near else ""


def _normalise(text: str) -> str:
    text = text.translate(_SPELLINGS)
    for pattern, replacement in _REWRITES:
        text = pattern.sub(replacement, text)
    return text


@lru_cache(maxsize=1024)  # reports ask for the same few units, thousands of times
def _evaluate(text: str, acceleration: bool = False) -> _Value:
    if len(text) > _LONGEST_TEXT:
        raise InputError(f"{text[:_LONGEST_TEXT]!r}... is too long for a unit")
    try:
        factor, dimension = _Parser(_tokens(_normalise(text)), acceleration).whole()
    except _NotAUnit as reason:
        words = str(reason) if "µ" in text.translate(_SPELLINGS) else str(reason).replace("'µ", "'u")
        raise InputError(f"unit {text!r}: {words}") from None
    if not 1e-300 < factor < 1e300:
        raise InputError(f"unit {text!r}: its factor {factor} is out of range")
    return factor, dimension


def parse_unit(text: str, expected: QuantityKind | Collection[QuantityKind] | None = None) -> Unit:
    """Read a unit as people write it.

    Parameters
    ----------
    text : str
        E.g. "deg/√h", "°/sqrt(hr)", "mdps/rtHz", "µg", "m s^-2", "[rad/s]", "m_s2".
    expected : QuantityKind or collection of QuantityKind, optional
        What the place in question needs; another class is refused. It also settles "G", which is gauss
        or gravity.

    Returns
    -------
    Unit

    Raises
    ------
    InputError
        An unknown unit (the message names the nearest), or one of the wrong class (the message names the
        class found and the unit that was probably meant).
    """
    if not isinstance(text, str):
        raise InputError(f"a unit is a text such as 'deg/s', not {text!r}")
    if not text.strip():
        raise InputError("no unit given; it is never assumed: write e.g. 'deg/s', 'g', 'V', or 'unknown'")
    wanted = _wanted(expected)
    factor, dimension = _evaluate(text.strip(), acceleration=QuantityKind.ACCELERATION in wanted)
    quantity = _CLASSES.get(dimension)
    if quantity is None and _scale_parts(factor, dimension) is not None:
        quantity = QuantityKind.SCALE_FACTOR
    if quantity is None:
        raise InputError(f"unit {text!r} does not fit a sensor log or a noise model")
    if wanted and quantity not in wanted:
        raise InputError(_wrong_class(text.strip(), quantity, wanted))
    offset = _OFFSETS.get(_normalise(text.strip()).strip("() "), 0.0)
    return Unit(text.strip(), factor, quantity, offset)


def _wanted(expected: QuantityKind | Collection[QuantityKind] | None) -> tuple[QuantityKind, ...]:
    if expected is None:
        return ()
    return (expected,) if isinstance(expected, QuantityKind) else tuple(expected)


# Data sheets drop the root or add one: what was probably meant, by (class found, class needed).
_MEANT = {
    (QuantityKind.ANGLE_RATE, QuantityKind.GYRO_N): "deg/√h or deg/s/√Hz (the root is often lost in print)",
    (QuantityKind.GYRO_K, QuantityKind.GYRO_N): "deg/√h (data sheets print deg/s/√h for it) or deg/s/√Hz",
    (QuantityKind.GYRO_N, QuantityKind.ANGLE_RATE): "deg/h or deg/s, without the root",
    (QuantityKind.GYRO_N, QuantityKind.GYRO_K): "deg/h/√h",
    (QuantityKind.ANGLE_RATE, QuantityKind.GYRO_K): "deg/h/√h",
    (
        QuantityKind.GYRO_PSD,
        QuantityKind.GYRO_N,
    ): "its root, e.g. deg/h/√Hz; state whether it is one- or two-sided",
    (QuantityKind.ANGLE, QuantityKind.ANGLE_RATE): "deg/s or deg/h",
    (QuantityKind.ANGLE_RATE, QuantityKind.GYRO_G): "deg/h/g or deg/s/g, a rate for each g",
    (QuantityKind.ACCELERATION, QuantityKind.ACCEL_N): "µg/√Hz or m/s/√h",
    (QuantityKind.ACCEL_K, QuantityKind.ACCEL_N): "m/s/√h or µg/√Hz (mg/√h is sometimes printed for it)",
    (QuantityKind.VELOCITY, QuantityKind.ACCEL_N): "m/s/√h",
    (QuantityKind.ACCEL_N, QuantityKind.ACCELERATION): "µg or m/s², without the root",
    (QuantityKind.ACCEL_N, QuantityKind.ACCEL_K): "µg/√h",
    (QuantityKind.VELOCITY, QuantityKind.ACCELERATION): "m/s²",
    (
        QuantityKind.ACCEL_PSD,
        QuantityKind.ACCEL_N,
    ): "its root, e.g. µg/√Hz; state whether it is one- or two-sided",
    (QuantityKind.VOLTAGE, QuantityKind.VOLTAGE_N): "V/√Hz",
    (QuantityKind.VOLTAGE_PSD, QuantityKind.VOLTAGE_N): "V/√Hz, its root",
    (QuantityKind.TEMPERATURE, QuantityKind.ANGLE): "deg (C alone is degree Celsius)",
    (QuantityKind.ANGLE, QuantityKind.TEMPERATURE): "°C (deg is an angle)",
}
_EXAMPLES = {
    QuantityKind.ANGLE_RATE: "deg/s",
    QuantityKind.ANGLE: "deg",
    QuantityKind.ACCELERATION: "m/s² or g",
    QuantityKind.VELOCITY: "m/s",
    QuantityKind.VOLTAGE: "V",
    QuantityKind.COUNTS: "LSB",
    QuantityKind.TIME: "s",
    QuantityKind.FREQUENCY: "Hz",
    QuantityKind.TEMPERATURE: "°C",
    QuantityKind.GYRO_N: "deg/√h",
    QuantityKind.GYRO_K: "deg/h/√h",
    QuantityKind.GYRO_R: "deg/h/h",
    QuantityKind.GYRO_G: "deg/h/g",
    QuantityKind.ACCEL_N: "m/s/√h",
    QuantityKind.ACCEL_K: "µg/√h",
    QuantityKind.ACCEL_R: "µg/h",
    QuantityKind.VOLTAGE_N: "V/√Hz",
    QuantityKind.SCALE_FACTOR: "mV/(deg/s)",
}


def _wrong_class(text: str, given: QuantityKind, wanted: tuple[QuantityKind, ...]) -> str:
    meant = [_MEANT.get((given, w), _EXAMPLES.get(w, w.value)) for w in wanted]
    needed = " or ".join(w.value for w in wanted)
    return f"unit {text!r} is of class '{given.value}', but '{needed}' is needed: did you mean {', or '.join(meant)}?"


# -- scale factors ----------------------------------------------------------------------------------------


def _scale_parts(factor: float, dimension: _Dimension) -> tuple[float, QuantityKind, QuantityKind] | None:
    """(physical SI per sample SI, sample, physical) of a unit such as V/(rad/s) or (rad/s)/count."""
    for axis, sample in ((4, QuantityKind.COUNTS), (3, QuantityKind.VOLTAGE)):
        twice = dimension[axis]
        if abs(twice) != 2:
            continue
        rest = list(dimension)
        rest[axis] = 0
        if twice == 2:
            rest = [-x for x in rest]
        physical = _CLASSES.get(tuple(rest))
        if physical in _PHYSICAL:
            return (1.0 / factor if twice == 2 else factor), sample, physical
    return None


def parse_scale_factor(text: str) -> ScaleFactor:
    """Read a sensor's scale factor.

    Parameters
    ----------
    text : str
        A number and its unit, sample per physical unit or the reverse: "24.0 mV/(deg/s)",
        "131 LSB/(deg/s)", "1 V/g", "0.01 (deg/s)/LSB". With its standard uncertainty: "24.0(2) mV/(deg/s)",
        "24.0 ± 0.2 mV/(deg/s)", "24.0 ± 0.8 % mV/(deg/s)".

    Returns
    -------
    ScaleFactor

    Raises
    ------
    InputError
        No number, a zero or infinite one, an uncertainty that is none, or a unit that is not volts or counts against a
        physical unit.
    """
    parsed = parse_leading_number(text) if isinstance(text, str) else None
    if parsed is None:
        raise InputError(f"scale factor {text!r} must be a number and a unit, e.g. '24.0 mV/(deg/s)'")
    (number, sd), unit = (parsed[0].value, parsed[0].sd), parsed[1]
    if not (math.isfinite(number) and number != 0.0):
        raise InputError(f"scale factor {text!r}: the number must be finite and not zero")
    if not unit:
        raise InputError(f"scale factor {text!r} has no unit; write e.g. '{number:g} mV/(deg/s)'")
    factor, dimension = _evaluate(unit)
    parts = _scale_parts(number * factor, dimension)
    if parts is None:
        raise InputError(
            f"scale factor {text!r}: the unit must be volts or counts per physical unit, or the reverse, such as "
            f"'mV/(deg/s)', 'LSB/g' or '(deg/s)/LSB'{_bracket_hint(unit)}"
        )
    return ScaleFactor(text, *parts, None if sd is None else sd / abs(number))


def _bracket_hint(unit: str) -> str:
    """mV/deg/s is (mV/deg)/s by the rules of division; data sheets that print it mean mV/(deg/s)."""
    head, *tail = unit.split("/")
    if len(tail) < 2 or "(" in unit:
        return ""
    meant = f"{head}/({'/'.join(tail)})"
    try:
        factor, dimension = _evaluate(meant)
    except InputError:
        return ""
    return f"; did you mean '{meant}'?" if _scale_parts(factor, dimension) else ""
