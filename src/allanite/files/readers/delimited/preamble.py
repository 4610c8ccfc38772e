# SPDX-License-Identifier: BSD-3-Clause
"""What the lines before a table say: sample rate, unit, serial number, sensor."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Final

from allanite.errors import InputError
from allanite.files.readers.delimited.preamble_numbers import NUMBER, NumberReadings, number_readings
from allanite.files.readers.stated_rate import (
    BARE,
    DUBIOUS,
    EXPLICIT,
    FASTEST_SENSOR,
    WORDED,
    StatedRate,
    Statement,
    chosen_rate,
    interval_statement,
)
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["facts_in", "rate_in", "units_in"]

_SIGN = r"[\"'\s]*[:=][\"'\s]*[,;\t]?[\"'\s]*|[\"'\s]*[,;][\"'\s]*"
_GAP = r"(?P<gap>" + _SIGN + r"|\s+(?:is\s+|of\s+)?)"
_BRACKET = r"\s*(?:[\[(](?P<before>[^\])]{0,60})[\])])?"
_HERTZ = r"(?:\s*(?P<unit>[kM]?hz|sps|samples/s|1/s|s\^-1)(?![\w/])|(?!\s*[\w/°.]))"
_SECONDS = r"\s*(?P<unit>[a-zµμ]+)?"
_SAMPLING = r"sample|sampling|abtast|mess|output|data|update"
_RATE = re.compile(
    rf"(?<![^\W_])(?P<name>fs|f_s|odr|(?:{_SAMPLING})?(?:rate|frequency|frequenz|freq))\b"
    + _BRACKET + _GAP + NUMBER + _HERTZ,
    re.IGNORECASE,
)  # fmt: skip
_INTERVAL = re.compile(
    r"(?<![^\W_])(?P<name>dt|ts|tau0|(?:(?:sample|sampling|data)[ _-]?)?(?:interval|period|time))\b"
    + _BRACKET + _GAP + NUMBER + _SECONDS,
    re.IGNORECASE,
)  # fmt: skip
#: Words before "rate" that make it that of the samples.
_OF_SAMPLES: Final = frozenset({
    "abtast", "acquisition", "data", "log", "logger", "logging", "measurement", "measuring", "mess", "message",
    "output", "packet", "poll", "polling", "publish", "reading", "readout", "record", "recording", "report",
    "reporting", "sample", "samples", "sampling", "scan", "streaming", "update",
})  # fmt: skip
#: Words that leave open what a rate is of, or name an inertial sensor.
_PLAIN: Final = frozenset({
    "a", "acc", "accel", "accelerometer", "accelerometers", "accels", "actual", "ahrs", "an", "and", "are",
    "at", "chip", "comment", "configured", "current", "dataset", "device", "effective", "file", "for", "gyro",
    "gyros", "gyroscope", "gyroscopes", "header", "imu", "in", "inertial", "info", "ins", "instrument", "is",
    "its", "module", "nominal", "of", "selected", "sensor", "sensors", "set", "the", "this", "true", "unit",
    "with",
})  # fmt: skip
#: Other sensors: what is stated of them is not stated of the samples.
_OTHER_SENSORS: Final = frozenset({
    "baro", "barometer", "camera", "compass", "encoder", "gnss", "gps", "lidar", "mag", "magnetometer",
    "magnetometers", "mags", "odometer", "pressure", "radar", "temperature", "video", "wheel",
})  # fmt: skip
#: Words of limits, filters, lines and clocks; what they stand before is not the rate of the samples.
_NOT_OF_SAMPLES: Final = frozenset({
    "angular", "averaging", "bandwidth", "baud", "bit", "byte", "calibration", "carrier", "clock", "corner",
    "crystal", "cut", "cutoff", "display", "dither", "earth", "error", "filter", "frame", "full", "fullscale",
    "highpass", "i2c", "line", "loss", "lowpass", "mains", "max", "maximal", "maximum", "min", "minimal",
    "minimum", "modulation", "notch", "nyquist", "oscillator", "pwm", "range", "refresh", "resonance",
    "rotation", "scale", "screen", "spi", "turn", "turning",
})  # fmt: skip
_SENSORS: Final = frozenset({
    "acc", "accel", "accelerometer", "gyro", "gyroscope", "imu",
})  # fmt: skip
_LONGEST_TIME = 1.0  # [s]: a longer "sampling time" may be how long was sampled
_LOOK_BACK = 80  # characters before a name
_LONGEST_LINE = 1000  # characters of a line that are searched: the time goes with their square
_UNIT = re.compile(r"\bunits?\b(?:" + _GAP + r"(?P<unit>[^\s,;\"']+)|[ \t]*[:=,;][\s,;]*$)", re.IGNORECASE)
_SERIAL = re.compile(
    r"\b(?:s/?n|serial(?:[ _]?(?:no|number|nr))?\.?)" + _GAP + r"(?P<text>[\w-]+)", re.IGNORECASE
)
_SENSOR = re.compile(r"\b(?:sensor|device|model|instrument|imu)\s*[:=,;]\s*(?P<text>[^,;\"]+)", re.IGNORECASE)


def rate_in(preamble: Sequence[str], decimal: str | None = None) -> StatedRate:
    """The sample rate that the preamble states.

    Parameters
    ----------
    preamble : sequence of str
    decimal : str, optional
        Decimal sign of the table, where its numbers show it.
    """
    return chosen_rate(one for line in preamble for one in _statements(line, decimal))


def _statements(line: str, decimal: str | None) -> Iterator[Statement | None]:
    line = line[:_LONGEST_LINE]
    where = f"preamble: {line.strip()}"
    for match in _RATE.finditer(line):
        rank = _rank_of_rate(line, match)
        factor = _factor((match["unit"] or match["before"] or "Hz").strip(), QuantityKind.FREQUENCY)
        if rank is not None and factor:
            yield _stated(where, number_readings(match, decimal), factor, rank, inverse=False)
    for match in _INTERVAL.finditer(line):
        rank = _rank_of_interval(line, match)
        if rank is not None:
            yield _interval(where, match, rank, decimal)


def _stated(
    where: str, numbers: NumberReadings, factor: float, rank: int, *, inverse: bool
) -> Statement | None:
    """The statement of a number with its unit."""
    values = [value * factor for value in numbers.values]
    if not values or not all(0 < value < math.inf and 1.0 / value < math.inf for value in values):
        return None
    rates = tuple(1.0 / value if inverse else value for value in values)
    doubt = "leaves open whether its sign is a decimal sign" if len(rates) > 1 else ""
    if len(rates) == 1 and rank == BARE and rates[0] > FASTEST_SENSOR:
        doubt = "may be the frequency of something else"
    return Statement(where=where, readings=rates, rank=rank, doubt=doubt, remark=numbers.remark)


def _interval(where: str, match: re.Match[str], rank: int, decimal: str | None) -> Statement | None:
    numbers = number_readings(match, decimal)
    unit = (match["unit"] or match["before"] or "").strip()
    if not unit and match["name"].lower() == "tau0":
        unit = "s"
    of_time = match["name"].lower().endswith("time")
    if not unit and len(numbers.values) == 1:
        value = numbers.values[0]
        return interval_statement(where, value, DUBIOUS if of_time and value >= _LONGEST_TIME else rank)
    factor = _factor(unit or "s", QuantityKind.TIME)
    stated = _stated(where, numbers, factor, rank, inverse=True) if factor else None
    if stated is None or not of_time or stated.readings[0] >= 1.0 / _LONGEST_TIME:
        return stated
    return Statement(
        where=where, readings=stated.readings, rank=DUBIOUS, doubt="may be the length of the record"
    )


# -- what a rate is of -------------------------------------------------------------------------------------


def _rank_of_rate(line: str, match: re.Match[str]) -> int | None:
    """How much a rate counts by the words before it; None for that of something else."""
    name = match["name"].lower()
    clause, close = _words_before(line, match)
    if name == "fs" and match["name"].isupper() and not match["unit"] and _SENSORS.intersection(clause):
        return None  # full scale
    if _is_of_another(clause, close, match):
        return None
    odd = [word for word in close if word not in _PLAIN and word not in _OF_SAMPLES]
    if name not in ("rate", "frequency", "frequenz", "freq") or (close and close[-1] in _OF_SAMPLES):
        return WORDED if odd else EXPLICIT
    return None if odd or not re.search(r"[:=,;]", match["gap"]) else BARE


def _rank_of_interval(line: str, match: re.Match[str]) -> int | None:
    """How much an interval counts by the words before it; None for that of something else."""
    name = match["name"].lower()
    clause, close = _words_before(line, match)
    if _is_of_another(clause, close, match):
        return None
    odd = [word for word in close if word not in _PLAIN and word not in _OF_SAMPLES]
    if name in ("interval", "period", "time"):
        return BARE if name == "period" and not odd else None
    return WORDED if odd else EXPLICIT


def _words_before(line: str, match: re.Match[str]) -> tuple[list[str], list[str]]:
    """The words before a name in its clause, and those behind its last colon or bracket."""
    before = line[max(match.start() - _LOOK_BACK, 0) : match.start()]
    clause = re.split(r"[,;|\t]|(?<!\w)[\d.]+(?!\w)", before)[-1]
    close = re.split(r"[:=()\[\]{}\"'#%/>!*]", clause)[-1]
    return _words(clause), _words(close)


def _words(text: str) -> list[str]:
    """Words in lower case, taken apart at a change of case, without the digits of a model or a number of a sensor."""
    parts = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    words = [(part, re.sub(r"\d+", "", part).lower()) for part in re.findall(r"[^\W_]+", parts)]
    return [word for part, word in words if word and (word == part.lower() or word in _OTHER_SENSORS)]


def _is_of_another(clause: list[str], close: list[str], match: re.Match[str]) -> bool:
    inside = _words(match["before"] or "")
    return not (
        _OTHER_SENSORS.isdisjoint((*clause, *inside)) and _NOT_OF_SAMPLES.isdisjoint((*close, *inside))
    )


def _factor(unit: str, kind: QuantityKind) -> float | None:
    if unit.lower() in ("sps", "samples/s"):
        unit = "Hz"
    try:
        return parse_unit(unit, kind).factor
    except InputError:
        return None


# -- the rest ----------------------------------------------------------------------------------------------


def units_in(preamble: Sequence[str]) -> list[str]:
    """The units that the preamble states, as they stand there; "" for one that is left open."""
    return [match["unit"] or "" for match in map(_UNIT.search, preamble) if match]


def facts_in(preamble: Sequence[str]) -> dict[str, str]:
    """Serial number and sensor, where the preamble names them."""
    facts = {"serial": _first(_SERIAL, preamble, "text"), "sensor": _first(_SENSOR, preamble, "text")}
    return {k: v for k, v in facts.items() if v}


def _first(pattern: re.Pattern[str], lines: Sequence[str], group: str) -> str | None:
    return next((m[group].strip() for m in map(pattern.search, lines) if m), None)
