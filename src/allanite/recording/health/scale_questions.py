# SPDX-License-Identifier: BSD-3-Clause
"""What must be asked of channels without a unit, sensor by sensor, with the answers that their numbers allow."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, Literal

import numpy as np

from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import Sensor, sensor_called
from allanite.recording.health.meaning import triads
from allanite.recording.health.raw_counts import (
    SENSITIVITIES,
    gravity_scale,
    gyro_scales,
    looks_raw,
    names_taken,
)
from allanite.recording.health.survey import ChannelSurvey, survey
from allanite.recording.records import Channel, Kind, Recording

__all__ = ["Answer", "ScaleQuestion", "scale_questions"]

_ENOUGH = 1 << 17  # samples: what a unit is, the beginning of a record tells as well as all of it
_UNITS: Mapping[Sensor, tuple[str, ...]] = {
    "gyro": ("deg/s", "rad/s", "mdeg/s", "deg/h"),
    "accelerometer": ("m/s^2", "g", "mg"),
    "temperature": ("degC", "K"),
    "": ("deg/s", "rad/s", "m/s^2", "g", "V"),
}
#: Length of gravity in the units of an accelerometer.
_GRAVITY = (("m/s^2", 9.80665), ("g", 1.0), ("mg", 1000.0))
_AGREES = 0.05


@dataclass(frozen=True, slots=True)
class Answer:
    """One answer to a question.

    Parameters
    ----------
    value : str
        Unit or scale factor, as the option takes it.
    words : str
        When it is right.
    """

    value: str
    words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleQuestion:
    """What the channels of one sensor measure.

    Attributes
    ----------
    sensor : "gyro", "accelerometer", "temperature" or ""
        As the names tell.
    channels : tuple of str
    keys : tuple of str
        What the options call them.
    option : "unit" or "scale_factor"
        The option that the answers are for.
    low, high : float
        Smallest and largest value, as written.
    answers : tuple of Answer
    likely : str
        The answer that gravity tells; "" where nothing does.
    reason : str
        Why that one.
    """

    sensor: Sensor
    channels: tuple[str, ...]
    keys: tuple[str, ...]
    option: Literal["unit", "scale_factor"]
    low: float
    high: float
    answers: tuple[Answer, ...]
    likely: str
    reason: str

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def scale_questions(recording: Recording) -> tuple[ScaleQuestion, ...]:
    """Ask for the unit, or for the scale factor of raw counts, where a recording states neither.

    Channels of one sensor share a question. Only the first 131 072 samples are looked at.
    """
    unknown = [c for c in recording.channels if c.kind in (Kind.UNKNOWN, Kind.COUNTS)]
    with np.errstate(invalid="ignore", over="ignore"):
        surveys = [survey(_beginning(recording, c), c.name) for c in unknown]
    asked = [s for s in surveys if s.present and (s.channel.kind is Kind.UNKNOWN or looks_raw(s))]
    return tuple(_questions(asked, recording.names))


def _beginning(recording: Recording, channel: Channel) -> Recording:
    samples = recording.raw(channel.name, 0, _ENOUGH)
    return Recording.from_rate(
        samples, rate=recording.rate, unit=channel.unit or "unknown", names=[channel.name]
    )


def _questions(surveys: Sequence[ChannelSurvey], among: Sequence[str]) -> Iterator[ScaleQuestion]:
    for sensor in _UNITS:
        for raw in (True, False):
            group = [s for s in surveys if sensor_called(s.name) == sensor and looks_raw(s) is raw]
            if group:
                yield _question(sensor, group, names_taken([s.name for s in group], among), raw=raw)


def _question(
    sensor: Sensor, group: Sequence[ChannelSurvey], keys: Sequence[str], *, raw: bool
) -> ScaleQuestion:
    counts = raw and sensor != "temperature"
    answers = _scales(sensor, group) if counts else [Answer(unit, "") for unit in _UNITS[sensor]]
    likely, reason = _by_gravity(group, counts=counts) if sensor == "accelerometer" else ("", "")
    return ScaleQuestion(
        sensor=sensor,
        channels=tuple(s.name for s in group),
        keys=tuple(re.split("[,=]", key)[0] for key in keys),  # as `--unit` takes a name
        option="scale_factor" if counts else "unit",
        low=min(s.origin + float(s.low.values[0]) for s in group),
        high=max(s.origin + float(s.high.values[0]) for s in group),
        answers=tuple(answers),
        likely=likely,
        reason=reason,
    )


def _scales(sensor: Sensor, group: Sequence[ChannelSurvey]) -> list[Answer]:
    if sensor == "accelerometer":
        return [Answer(f"{scale:.0f} LSB/g", words) for scale, words in SENSITIVITIES]
    return [Answer(f"{scale} LSB/(deg/s)", f"±{reach:g} deg/s") for scale, reach in gyro_scales(group)]


def _by_gravity(group: Sequence[ChannelSurvey], *, counts: bool) -> tuple[str, str]:
    """The answer that the length of the mean gives, and why."""
    for triad in triads(group):
        if counts:
            if match := gravity_scale(triad):
                norm, scale, words = match
                return (
                    f"{scale:.0f} LSB/g",
                    f"the mean is {norm:.5g} counts; gravity is {scale:.0f} for {words}",
                )
            continue
        norm = math.sqrt(sum(s.mean**2 for s in triad))
        for unit, gravity in _GRAVITY:
            if abs(norm / gravity - 1.0) < _AGREES:
                return unit, f"the mean is {norm:.4g} in magnitude, which is gravity in {unit}"
    return "", ""
