# SPDX-License-Identifier: BSD-3-Clause
"""Whole numbers without a unit: the counts of a converter, and the scale factor that turns them into rates.

What range a gyro was set to, its counts at rest do not tell: the usual ones are named. An accelerometer shows gravity,
and its length in counts is the scale factor, within its bias and scale error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from allanite.recording.channel_names import sensor_called, unit_option
from allanite.recording.health.disturbance import moved
from allanite.recording.health.finding import Finding, Severity, finding
from allanite.recording.health.meaning import triads
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.records import Kind

__all__ = ["SENSITIVITIES", "gravity_scale", "gyro_scales", "looks_raw", "names_taken", "raw_counts"]

_WORDS = (16, 20, 24, 32)  # bits; a narrower converter's counts look like those of 16 bits at rest
_RANGES = (250.0, 500.0, 1000.0, 2000.0)  # deg/s, of most MEMS gyros
#: Counts for each g, and the range: data sheets of InvenSense, Bosch and ST (16 bits), ADXL345 and ADXL355.
SENSITIVITIES = (
    (16384.0, "±2 g at 16 bits"), (8192.0, "±4 g at 16 bits"), (4096.0, "±8 g at 16 bits"),
    (2048.0, "±16 g at 16 bits"), (1024.0, "±32 g at 16 bits or ±2 g at 12 bits"), (512.0, "±4 g at 12 bits"),
    (256.0, "±8 g at 12 bits, or an ADXL345"), (128.0, "±16 g at 12 bits"),
    (256_000.0, "±2 g of an ADXL355"), (128_000.0, "±4 g of an ADXL355"), (64_000.0, "±8 g of an ADXL355"),
)  # fmt: skip
_AGREES = 0.05  # biases and scale errors of MEMS accelerometers reach some 50 mg


def looks_raw(survey: ChannelSurvey) -> bool:
    """True for whole numbers of several values that nobody gave a unit, or counts without a scale factor."""
    step, ends = survey.lattice.step, _ends(survey)
    whole = (
        step > 0.9
        and abs(step - round(step)) < 1e-3
        and all(math.isfinite(e) and e == round(e) for e in ends)
    )
    return (
        survey.channel.kind in (Kind.UNKNOWN, Kind.COUNTS)
        and survey.present > 0
        and whole
        and survey.lattice.codes >= 3
        and _bits(survey) <= _WORDS[-1]
    )


def _ends(survey: ChannelSurvey) -> tuple[float, float]:
    """Smallest and largest value, as they stand in the file; NaN where there is none."""
    if len(survey.low.values) == 0:
        return math.nan, math.nan
    return survey.origin + float(survey.low.values[0]), survey.origin + float(survey.high.values[0])


def raw_counts(surveys: Sequence[ChannelSurvey]) -> Iterator[Finding]:
    """Channels that hold raw counts, with the option that scales them; a hint alone where they are called counts."""
    for kind in (Kind.UNKNOWN, Kind.COUNTS):
        raw = [s for s in surveys if s.channel.kind is kind and looks_raw(s)]
        for sensor, advise in (("gyro", _gyro), ("accelerometer", _accelerometer)):
            group = [s for s in raw if sensor_called(s.name) == sensor]
            if group:
                yield _found(group, *advise(group))
        for sensor, advise in (("temperature", _thermometer), ("", _unnamed)):
            group = [s for s in raw if sensor_called(s.name) == sensor]
            if group and kind is Kind.UNKNOWN:
                yield _found(group, *advise(group))


def _found(group: Sequence[ChannelSurvey], more: str, advice: str) -> Finding:
    low, high = min(_ends(s)[0] for s in group), max(_ends(s)[1] for s in group)
    unknown = group[0].channel.kind is Kind.UNKNOWN
    names, asked = ", ".join(s.name for s in group), " without a unit: raw counts?" if unknown else "."
    return finding(
        "raw_counts",
        f"{names}: integers from {low:.0f} to {high:.0f}{asked}{more}",
        severity=Severity.WARNING if unknown else Severity.INFO,
        count=max(s.present for s in group),
        advice=advice,
    )


def gyro_scales(group: Sequence[ChannelSurvey]) -> list[tuple[str, float]]:
    """Counts for each deg/s in the usual ranges [deg/s] of a gyro with words of this length."""
    full = 2.0 ** (_bits_of(group) - 1)
    return [(_digits(full / reach), reach) for reach in _RANGES]


def gravity_scale(triad: Sequence[ChannelSurvey]) -> tuple[float, float, str] | None:
    """Length of the mean in counts, the usual counts for each g that agree with it, and their range, if there are."""
    norm = math.sqrt(sum(s.mean**2 for s in triad))
    match = next((pair for pair in SENSITIVITIES if abs(norm / pair[0] - 1.0) < _AGREES), None)
    return None if match is None or any(moved(s) for s in triad) else (norm, *match)


def _gyro(group: Sequence[ChannelSurvey]) -> tuple[str, str]:
    scales = gyro_scales(group)
    listed = ", ".join(f"{scale} for ±{reach:g} deg/s" for scale, reach in scales)
    return "", (
        f"if so, --scale-factor '{_key(group)}={scales[0][0]} LSB/(deg/s)', with the value for the "
        f"configured range at {_bits_of(group)} bits: {listed}"
    )


def _accelerometer(group: Sequence[ChannelSurvey]) -> tuple[str, str]:
    key = _key(group)
    for triad in triads(group):
        if match := gravity_scale(triad):
            norm, scale, words = match
            return (
                f" The mean is {norm:.5g} counts; gravity is {scale:.0f} for {words}",
                f"if so, --scale-factor '{key}={scale:.0f} LSB/g'",
            )
    return (
        "",
        f"if so, --scale-factor '{key}=16384 LSB/g' with the value of the data sheet (16384 is ±2 g at 16 bits)",
    )


def _thermometer(group: Sequence[ChannelSurvey]) -> tuple[str, str]:
    return (
        "",
        f"if so, {unit_option((s.name for s in group), 'LSB')}: a temperature needs no scale factor here",
    )


def _unnamed(group: Sequence[ChannelSurvey]) -> tuple[str, str]:
    name = group[0].name
    return "", (
        f"if so, {unit_option([name], 'LSB')}, and --scale-factor '{name}=131 LSB/(deg/s)' with the value "
        "of the data sheet"
    )


def _bits_of(group: Sequence[ChannelSurvey]) -> int:
    return max(_bits(s) for s in group)


def _bits(survey: ChannelSurvey) -> int:
    """The word that holds all values, with their sign."""
    low, high = _ends(survey)
    largest = max(-low, high + 1.0, 1.0)
    needed = math.ceil(math.log2(largest)) + 1
    return next((bits for bits in _WORDS if bits >= needed), 64)


def _key(group: Sequence[ChannelSurvey]) -> str:
    """What `--scale-factor` calls a group, or its first channel."""
    return names_taken([s.name for s in group], group[0].recording.names)[0]


def names_taken(group: Sequence[str], among: Sequence[str]) -> list[str]:
    """What an option by channel calls a group: what its names begin with, where that names no other; else each name."""
    first = group[0]
    stem = first[
        : next((k for k in range(len(first)) if len({name[: k + 1] for name in group}) > 1), len(first))
    ]
    unique = all((name in group) == name.casefold().startswith(stem.casefold()) for name in among)
    return [stem.rstrip("_")] if stem.rstrip("_") and unique else [*group]


def _digits(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"
