# SPDX-License-Identifier: BSD-3-Clause
"""What a column heading says: its name without the unit, its unit, and what kind of column it is.

Names come before positions: columns may stand in any order, and a unit may follow the name in brackets
(``Gyroscope X (deg/s)``), after an underscore (``gyro_x_dps``), or not at all.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Final, Literal

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.printable import printable
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = [
    "FITTING",
    "GROUPS",
    "Group",
    "Heading",
    "canonical_group",
    "counted_unit",
    "is_second_part",
    "is_unit",
    "may_be_time",
    "measures",
    "read_heading",
    "shared_unit",
    "unbracketed",
]

Group = Literal["gyro", "acc", "temperature", "other", "time", "counter", "identity", ""]

#: Groups whose columns are companions of the sensor, never unknown sensor output.
#: What the columns of a sensor may hold.
FITTING: Final = {
    "gyro": {QuantityKind.ANGLE_RATE, QuantityKind.ANGLE, QuantityKind.VOLTAGE, QuantityKind.COUNTS},
    "acc": {QuantityKind.ACCELERATION, QuantityKind.VELOCITY, QuantityKind.VOLTAGE, QuantityKind.COUNTS},
}
GROUPS: Final = ("gyro", "acc", "temperature", "other", "time", "counter", "identity")


@dataclass(frozen=True, slots=True)
class Heading:
    """A column heading that was understood.

    Attributes
    ----------
    name : str
        Cleaned, without the unit; "" where the column has no heading.
    unit : str
        As written; "" where the heading holds none.
    group : str
        gyro, acc, temperature, time, counter, identity, other, or "" where the name says nothing.
    standard : bool
        The unit follows from the name of a message field (ROS, PX4), not from a unit text.
    """

    name: str
    unit: str
    group: Group
    standard: bool = False


_TIME_WORDS = (
    r"(?:secs?|seconds?|msecs?|millis|milli_?sec(?:ond)?s?|usecs?|micros|micro_?sec(?:ond)?s?"
    r"|nsecs?|nanos|nano_?sec(?:ond)?s?)"
)
_TIME_UNIT = rf"(?:{_TIME_WORDS}|ms|[uµ]s|ns)"
#: Words for a clock, or for what it shows.
_CLOCK_WORD = (
    r"(?:t|ts|tm|times?|timestamps?|time_?stamps?|t?stamp|zeit|temps|tempo|tiempo|tijd|czas|clock|clk|now|elapsed|uptime"
    r"|epoch|unix|posix|utc|gps|i?tow|sow|sod|tod|datetime)"
)

#: Days of the Julian calendar: MJD, jd_utc, time_mjd, Julian Date.
_JULIAN = (
    r"(?:^|_)(?:modified_?)?(?:[mbhrt]?jd|julian_?(?:date|day)s?)(?:_?(?:utc|tt|tdb|tai|gps|ut1|number))?$"
)

#: What lies between whole seconds: Fractional Seconds, frac_sec, subsec.
_FRACTION = r"^(?:frac(?:tion(?:al)?)?|sub)_?(?:of_(?:a_)?)?sec(?:ond)?s?$"

# First match wins. Names are compared in lower case, with every run of other signs as one underscore.
_GROUP_PATTERNS: tuple[tuple[Group, str], ...] = (
    (
        "other",
        r"""(^|_)(cov|covariance\d*|std|stdev|var|variance|ecc|err|error|status|flags?|valid|clip\w*|crc|range)(_|\d|$)
        |(^|_)(quat|quaternion|orientation|(roll|pitch|yaw)(?!_?(rate|vel|speed))|heading|azimuth|euler|attitude)|^q_?[0-3wxyz]$
        |(^|_)(mag|magn|magnet\w*|compass|baro\w*|pres|press|pressure|humidity|battery|vbat)(_|$)|^m_?[xyz]$|^mag
        |(^|_)(lat|latitude|lon|longitude|alt|altitude)(_|$)|integral_dt
        |\w+_(device|dev)_id$|timestamp_relative$|(^|_)calibration_count$
        |(^|_)(delta_\w+|gyro|acc(el(erometer)?)?|imu)_d_?t(_?[munµ]?s)?$
        |^d_?t(_|$)|(^|_)d(elta)?_?time|(^|_)delta_?t(_|$)|^time_?(diff|delta|step|offset|zone|out|err\w*)(_|$)
        |^timezone$""",
    ),
    ("temperature", r"(^|_|gyro?|acc|imu)(temp|tmp|temperature)\d*(_|$)|temperatur"),
    (
        "gyro",
        r"""gyr|omega|ang(ular)?_?(vel|rate)|dreh|turn_?rate|^[wg]_?[xyz]$|^rate(_?[xyz])?$|^[xyz]_?rate$
        |(roll|pitch|yaw)_?(rate|vel|speed)""",
    ),
    ("acc", r"acc|specific_force|beschleunigung|^[af]_?[xyz]$"),
    (
        "time",
        rf"""^{_CLOCK_WORD}(_?{_TIME_UNIT}|_s)?$|^{_TIME_UNIT}_?{_CLOCK_WORD}$|^({_TIME_WORDS}|[mu]s)$
        |^(date|datum|fecha|uhrzeit|heure|hora|week|utc_?date|datenum)$|{_JULIAN}
        |^(?:(?:utc|gps|local)_?)?(?:hh_?mm_?ss(?:_?s*)?|(?:yy)?yy_?mm_?dd|dd_?mm_?yy(?:yy)?|mm_?dd_?yy(?:yy)?)$|^t_?(utc|gps|tow|rel|abs)$
        |^sample_?time_?fine$|{_FRACTION}|^(utc|gps|unix|posix|sys|host)_time_{_TIME_WORDS}$
        |timestamp|time_?stamp|(^|_)(date_?time|stamp|time|i?tow|elapsed|uptime)$|^time_|(^|_)since_
        |(^|_){_TIME_UNIT}_(elapsed|since|of_(the_)?(day|week))|^elapsed_|^(sys|host|unix|posix|gps|utc)_?{_TIME_WORDS}$
        |^(sys|host|local|rel|abs|unix|posix|gps|utc|run|cpu|mcu|real|pc|ros|sample|log|tick|arrival)time
        |(^|_)(sys_?tick|ticks?|timer)(_?count\w*)?$
        |(^|_)(secs|nsecs?|nanosec|gps_?(week|sec\w*|time|i?tow|sow))$""",
    ),
    (
        "counter",
        r"""^(index|index_level_0|idx|counter|count|cnt|seq|sequence|frame|packet\w*|nr?|no|row|line|header_seq)$
        |^sample(_?(no|nr|number|index|count\w*))?$""",
    ),
    (
        "identity",
        r"""^(id|sensor(_?id)?|device(_?id)?|instance|i|imu(_?id)?|mac|serial(_?(no|number))?|sn|source|node)$
        |^(type|msg|message|record|topic)$""",
    ),
)
_GROUP_REGEX = tuple((group, re.compile(pattern, re.VERBOSE)) for group, pattern in _GROUP_PATTERNS)

#: Names of fields whose unit their message definition fixes (sensor_msgs/Imu; PX4 sensor_combined).
_STANDARD_UNITS = (
    (re.compile(r"(^|_)angular_velocity_[xyz]$"), "rad/s"),
    (re.compile(r"(^|_)linear_acceleration_[xyz]$"), "m/s²"),
    (re.compile(r"^gyro_rad(_?\d)?$"), "rad/s"),
    (re.compile(r"^accelerometer_m_s2(_?\d)?$"), "m/s²"),
)
_BRACKETS = {"[": "]", "(": ")", "{": "}", "<": ">"}
#: The same words as programs of any kind spell them, in units of their own.
_CAMEL_CASE = re.compile(r"(?<![A-Za-z])(?:angularV|linearA)")

#: GyroXRadPerSec, AccelYMps2: a unit that begins with a capital behind the name.
_JOINED_UNIT = re.compile(r"([a-z0-9XYZ])(RadPerSec|DegPerSec|RadPerS|DegPerS|Mps2|MPerS2)$")

# suffix of a name -> unit, for any group
_SUFFIX_UNITS = {
    "rad_s": "rad/s",
    "rads": "rad/s",
    "radps": "rad/s",
    "rad_per_s": "rad/s",
    "rad_per_sec": "rad/s",
    "radpers": "rad/s",
    "radpersec": "rad/s",
    "deg_s": "deg/s",
    "degs": "deg/s",
    "degps": "deg/s",
    "deg_per_s": "deg/s",
    "deg_per_sec": "deg/s",
    "degpers": "deg/s",
    "degpersec": "deg/s",
    "deg_h": "deg/h",
    "deg_hr": "deg/h",
    "deg_per_h": "deg/h",
    "dps": "deg/s",
    "mdps": "mdps",
    "dph": "deg/h",
    "m_s2": "m/s²",
    "m_s_2": "m/s²",
    "mps2": "m/s²",
    "ms2": "m/s²",
    "m_per_s2": "m/s²",
    "mpers2": "m/s²",
    "mg": "mg",
    "ug": "µg",
    "lsb": "LSB",
    "counts": "LSB",
    "mv": "mV",
    "uv": "µV",
    "volt": "V",
    "volts": "V",
    "degc": "°C",
    "celsius": "°C",
}
# suffixes of one or two letters mean a unit only where the group agrees
_SUFFIX_BY_GROUP = {
    "acc": {"g": "g"},
    "temperature": {"c": "°C"},
    "time": {"s": "s", "sec": "s", "secs": "s", "seconds": "s", "ms": "ms", "us": "µs", "ns": "ns", "nsec": "ns",
             "nsecs": "ns", "nanosec": "ns", "millis": "ms", "micros": "µs"},
}  # fmt: skip
_WORDS = re.compile(r"[_\s.]+")
_PREFIX_SIGNS: Final = {"nano": "n", "micro": "µ", "milli": "m", "centi": "c", "kilo": "k", "mega": "M"}
#: In front of a unit: gyro_x_milli | dps, GyroXMilli | RadPerSec.
_PREFIX_WORD = re.compile(rf"({'|'.join(_PREFIX_SIGNS)})$", re.IGNORECASE)
#: Words in front of a unit that scale it, or make another one of it: x1000 | dps, lsb_per | dps, m | dps, x_10 | mg.
#: One digit, or two after a 0, number the sensor: gyro_2 | dps, gyro_01 | dps.
_SCALE = re.compile(
    r"[x×*]?(?:[1-9]\d[\d,]*|\d+[,^]\d+|0\d\d+)x?|[x×*]?\d*(?:e|\^|\*\*|p)[-+]?\d+|\d+x|[muµμkc×*]"
    r"|deci|deca|hecto|giga|pico|femto|tera|half|tens?|tenths?|hundred(?:th)?s?|thousand(?:th)?s?|million(?:th)?s?"
    r"|per|by|div|over|times|sq|sqrt|root|rt|squared?|log|log10|ln|db|inv|inverse|pct|percent|ppm|v|g",
    re.IGNORECASE,
)
_BRACKETED = re.compile(r"\s*[,:]?\s*[\[({<]\s*([^\[\](){}<>]*(?:\([^()]*\)[^\[\](){}<>]*)?)\s*[\])}>]\s*$")
_INDEXED = re.compile(r"\[(\d+)\]$")
#: "time [samples]" numbers the samples, whatever it is called.
_NUMBERED = re.compile(r"[\[({<]\s*(?:samples?|counts?|index|#)\s*[\])}>]\s*$", re.IGNORECASE)
#: t_a beside a; else a temperature, or anything.
_MAY_BE_TIME = re.compile(
    r"(?:t|ts|tm|time|stamp)(?:_\w+|(?:acc|gyr|imu|mag|gps|ins|baro|sens)\w*)", re.IGNORECASE
)
#: "milliseconds since 2026-11-28 00:00:00".
_SINCE = re.compile(r"\s*([^\W\d]+)\s+since\s", re.IGNORECASE)
#: "Acceleration X in m/s^2", "Drehrate in °/s".
_IN_UNIT = re.compile(r"(.*\S)\s+in\s+(\S+)", re.IGNORECASE)
#: What a column of samples may hold, of the units behind a slash: "U/mV", "T/°C", "ω/(°/s)" (ISO 80000-1, 7.1.4).
_SAMPLED = frozenset(
    {
        QuantityKind.ANGLE_RATE,
        QuantityKind.ANGLE,
        QuantityKind.ACCELERATION,
        QuantityKind.VELOCITY,
        QuantityKind.VOLTAGE,
        QuantityKind.TEMPERATURE,
        QuantityKind.MAGNETIC,
        QuantityKind.PRESSURE,
    }
)
#: A temperature, and no tesla, in front of the slash.
_TEMPERATURE_SYMBOL = "T"
#: What may be divided by a unit of one letter, and is no path of fields (imu/T, nav/V): U, a_x, Ausgangsspannung.
_SYMBOL = re.compile(r"[^\W\d](?:\d*|_\w+)|.*(?:volt|spannung|tension).*", re.IGNORECASE)
#: Voltages, and neither micro nor "volts per": U_mV, V_mV.
_VOLTAGE_SYMBOLS = ("U", "V")
#: Where the name of a clock holds its unit: t_us, ustime, millis, seconds_elapsed.
_UNIT_IN_TIME = tuple(
    re.compile(pattern)
    for pattern in (
        rf"(?:^|_){_CLOCK_WORD}_?({_TIME_UNIT})$",
        rf"^({_TIME_UNIT})_?{_CLOCK_WORD}$",
        rf"_({_TIME_UNIT}|s)$",
        rf"^({_TIME_WORDS}|[mu]s)$",
        rf"(?:^|_)({_TIME_UNIT})_(?:elapsed|since|of)",
        rf"^(?:sys|host|unix|posix|gps|utc)({_TIME_WORDS})$",
    )
)


def read_heading(text: str) -> Heading:
    """Read one heading.

    Parameters
    ----------
    text : str
        E.g. "Gyroscope X (deg/s)", "timestamp_us", "angular_velocity.x", "" .
    """
    text = text.strip().strip("\"'").strip().lstrip("#%").strip()
    if not text:
        return Heading("", "", "")
    indexed = _JOINED_UNIT.sub(r"\1_\2", _INDEXED.sub(r"_\1", text))
    plain = _plain(indexed)
    for pattern, unit in () if _CAMEL_CASE.search(indexed) else _STANDARD_UNITS:
        if pattern.search(plain):
            return Heading(_clean(indexed), unit, _group(plain), standard=True)
    name, unit = _bracketed(indexed)
    group = _group(_plain(name))
    if not unit:
        name, unit = _suffixed(name, group)
        group = group or _group(_plain(name))
    if group == "acc" and unit in ("G", "mG"):  # gauss or gravity: the name decides
        unit = unit.replace("G", "g")
    if group == "identity" and unit:  # "sensor [rad/s]" holds samples, not names of sensors
        group = ""
    if group == "time" and not unit and _NUMBERED.search(name):
        group = "counter"
    return with_unit(Heading(_clean(name), "", group), unit)


def with_unit(heading: Heading, unit: str) -> Heading:
    """The heading with a unit; T in °C is a temperature, and no time."""
    unit = counted_unit(unit)
    warm = heading.group == "time" and unit != "" and measures(unit) is QuantityKind.TEMPERATURE
    return replace(heading, unit=unit, group="temperature" if warm else heading.group)


def counted_unit(unit: str) -> str:
    """The unit of a count since a moment: "milliseconds since 2026-11-28" (CF conventions) is in milliseconds."""
    match = _SINCE.match(unit)
    return match[1] if match else unit


def measures(unit: str) -> QuantityKind | None:
    """What a unit measures, with or without brackets ("G" counts); None where it is none."""
    try:
        return parse_unit(unbracketed(unit), tuple(QuantityKind)).quantity
    except InputError:
        return None


def shared_unit(unit: str, headings: Sequence[str], guesses: list[str]) -> tuple[str, ...]:
    """The unit of each column where a file states one for all: none where the name of a column speaks against it."""
    quantity = parse_unit(unit, tuple(QuantityKind)).quantity
    read = [read_heading(heading) for heading in headings]
    against = [h.name for h in read if h.group in FITTING and quantity not in FITTING[h.group]]
    if against:
        guesses.append(
            f"the unit {unit} of the file contradicts the names of {', '.join(against)}: their unit is unknown"
        )
    return tuple(unit if h.group in ("", "gyro", "acc") and h.name not in against else "" for h in read)


def unbracketed(text: str) -> str:
    """A unit without the brackets around it: [deg/s], (V); m/(s^2) keeps its own."""
    text = text.strip()
    while len(text) > 1 and _BRACKETS.get(text[0]) == text[-1]:
        depth = accumulate((c == text[0]) - (c == text[-1]) for c in text)
        if 0 in list(depth)[:-1]:  # (rad)/(s)
            return text
        text = text[1:-1].strip()
    return text


def is_unit(text: str) -> bool:
    """True if a cell of a units row is a unit."""
    return measures(text) is not None


def may_be_time(name: str) -> bool:
    """True for names that mean time where the column only grows: time, but also t_a beside a."""
    return read_heading(name).group == "time" or _MAY_BE_TIME.fullmatch(name) is not None


def is_second_part(name: str) -> bool:
    """True for names of what lies between whole seconds, in seconds."""
    return re.search(_FRACTION, _plain(name)) is not None


def canonical_group(word: str) -> Group:
    """The group that a user's word for it means: "gyr", "w", "accelerometer", ...; "" if none."""
    word = word.strip().lower()
    if word in ("gyro", "gyr", "gyroscope", "gyros", "g", "w", "omega", "rate"):
        return "gyro"
    if word in ("acc", "accel", "accelerometer", "accelerometers", "a", "f", "acceleration"):
        return "acc"
    return "temperature" if word in ("temp", "temperature") else ""


def _plain(text: str) -> str:
    text = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", "_", text)  # GyroX stays, AngularVelocity is split
    return re.sub(r"[^0-9a-zµ°]+", "_", text.lower()).strip("_")


def _clean(text: str) -> str:
    """A name without blanks, and without signs that command a terminal or turn the direction of the text."""
    return printable(re.sub(r"\s+", "_", text.strip(" \t.,:;_"))) or "unnamed"


def _group(plain: str) -> Group:
    for group, pattern in _GROUP_REGEX:
        if pattern.search(plain):
            return group
    return ""


def _bracketed(text: str) -> tuple[str, str]:
    match = _BRACKETED.search(text)
    if match and match.start() > 0:
        inside = match[1].strip()
        if inside and (is_unit(inside) or "/" in inside):
            return text[: match.start()].rstrip().removesuffix("/"), inside
        if inside.lower() in ("raw", "-", ""):
            return text[: match.start()], ""
    head, comma, tail = text.rpartition(",")
    if comma and head and is_unit(tail):
        return head, tail.strip()
    if (match := _IN_UNIT.fullmatch(text)) and is_unit(match[2]):
        return match[1], match[2]
    return _divided(text) or (text, "")


def _divided(text: str) -> tuple[str, str] | None:
    """Name and unit where a quantity is divided by its unit; V/g and ppm/K are units of something else."""
    head, _, tail = (part.strip() for part in text.partition("/"))
    if not head or measures(text) is not None or (is_unit(head) and head != _TEMPERATURE_SYMBOL):
        return None
    if len(tail) == 1 and not (
        _SYMBOL.fullmatch(head) or _group(_plain(head)) in ("acc", "temperature", "time")
    ):
        return None
    clock = measures(tail) is QuantityKind.TIME and _group(_plain(head)) == "time"
    return (head, tail) if clock or measures(tail) in _SAMPLED else None


def _suffixed(text: str, group: Group) -> tuple[str, str]:
    parts = _WORDS.split(text)
    for count in (3, 2, 1):
        if len(parts) <= count:
            continue
        tail = "_".join(parts[-count:]).lower()
        head = text[: -len(tail)].rstrip("_ .")
        unit = _SUFFIX_UNITS.get(tail) or _SUFFIX_BY_GROUP.get(_group(_plain(head)), {}).get(tail)
        if unit:
            return _scaled(text, head, unit)
    if group == "time":
        return text, _unit_of_clock(_plain(text))
    whole = "_".join(parts).lower()  # "second,Volt": the unit is all that the heading says
    return text, _SUFFIX_UNITS.get(whole, "") if len(whole) > len("mg") and whole != "counts" else ""


def _scaled(text: str, head: str, unit: str) -> tuple[str, str]:
    """Name and unit where the name ends in a prefix of the unit; without a unit where it ends in another scale."""
    prefix = _PREFIX_WORD.search(head)
    if prefix:
        multiple = _PREFIX_SIGNS[prefix[1].lower()] + unit
        return (head[: prefix.start()].rstrip("_ .") or text, multiple) if is_unit(multiple) else (text, "")
    if head in _VOLTAGE_SYMBOLS and measures(unit) is QuantityKind.VOLTAGE:
        return head, unit
    words = _WORDS.split(head)
    decimal = len(words) > 2 and words[-2] == "0" and words[-1].isdecimal() and words[-3][-1:] in "xyzXYZ"
    if decimal or _SCALE.fullmatch(words[-1]) or words[-1].lower() in _SUFFIX_UNITS:
        return text, ""
    return head, unit


def _unit_of_clock(plain: str) -> str:
    """The unit in the name of a column that is time."""
    if re.search(_JULIAN, plain):
        return "d"
    for pattern in _UNIT_IN_TIME:
        if match := pattern.search(plain):
            word = match[1]
            size = "u" if word.startswith(("micro", "µ")) else word[0]
            return {"m": "ms", "u": "µs", "n": "ns"}.get(size, "s")
    return ""
