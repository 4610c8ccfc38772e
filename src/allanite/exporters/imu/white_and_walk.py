# SPDX-License-Identifier: BSD-3-Clause
"""White noise and a random walk of the bias, of three gyroscopes and three accelerometers: what most filters know."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

from allanite.errors import InputError
from allanite.exporters.imu.axes import (
    SENSORS,
    UNITS,
    axes_rule,
    channels_of,
    combined,
    parameter,
    refuse_nothing,
)
from allanite.exporters.imu.preamble import Consumer, bound_lines, number_format, preamble
from allanite.exporters.imu.walks import WalkChoice, walk_choice
from allanite.exporters.triads import plain_line

__all__ = ["NoiseOptions", "WalkImu", "white_and_walk"]

Json = Mapping[str, Any]


class NoiseOptions(TypedDict, total=False):
    """Options of every consumer of white noise and a walk.

    ``walk``: "upper-bound" (default), "k-only" or "horizon=<seconds>", what becomes of the bias instability
    (`allanite.exporters.imu.walks`). ``axes``: "worst" (default of filters), "rms" (default of simulators), and "each"
    where the file has a number for each axis. ``inflate``: factor on noise and walk, written into the file.
    ``correlation_time``: T of the Gauss-Markov term that stands for flicker [s]. ``digits``: after the point.
    ``gyroscope``, ``accelerometer``: names of the channels of each triad.
    """

    walk: str
    axes: str | None
    inflate: float
    correlation_time: float | None
    digits: int
    gyroscope: Sequence[str] | None
    accelerometer: Sequence[str] | None


@dataclass(frozen=True, slots=True)
class _Axis:
    name: str
    noise: float
    walk: float
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkImu:
    """The numbers of a file, combined and inflated as was asked.

    Attributes
    ----------
    rate : float [Hz]
        Of the record.
    comments : tuple of str
        The head of the file, without a comment sign.
    noise : mapping of str to tuple of float
        N of each sensor in SI: one number, or three; no entry where the study holds none.
    walk : mapping of str to tuple of float
        Likewise, in SI.
    style : str
        Format of a number.
    """

    rate: float
    comments: tuple[str, ...]
    noise: Mapping[str, tuple[float, ...]]
    walk: Mapping[str, tuple[float, ...]]
    style: str

    def text(self, value: float) -> str:
        """A number as the file has it."""
        return format(value, self.style)

    def comment(self, sign: str = "#") -> list[str]:
        """The head as comment lines."""
        return [f"{sign} {line}".rstrip() for line in self.comments]


def white_and_walk(
    document: Json,
    consumer: Consumer,
    *,
    walk: str = "upper-bound",
    axes: str | None = None,
    inflate: float = 1.0,
    correlation_time: float | None = None,
    digits: int = 6,
    gyroscope: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> WalkImu:
    """What a file says of a study; options are those of `NoiseOptions`.

    Raises
    ------
    InputError
        No channel in known units of rate or acceleration, more than one triad of a kind, an axis without a model, a
        parameter without value and limit, or an option that makes no sense.
    """
    choice = walk_choice(walk, correlation_time, consumer.file)
    axes = axes or ("rms" if consumer.simulator else "worst")
    rule, style = axes_rule(axes, per_axis=consumer.per_axis), number_format(digits)
    if not (math.isfinite(inflate) and inflate > 0):
        raise InputError(f"inflate must be a positive factor, not {inflate!r}")
    wanted = dict(zip(SENSORS, (gyroscope, accelerometer), strict=True))
    chosen = {sensor: channels_of(document, sensor, wanted[sensor]) for sensor in SENSORS}
    refuse_nothing(document, chosen, consumer.file)
    read = {sensor: [_axis(c, choice, consumer) for c in channels] for sensor, channels in chosen.items()}
    lines = preamble(document, consumer, bias=choice.comment, axes=rule, inflate=inflate)
    lines += bound_lines([c for channels in chosen.values() for c in channels], consumer, axes)
    for sensor, found in read.items():
        lines += _table(sensor, found, consumer)

    def numbers(values: Mapping[str, list[float]]) -> dict[str, tuple[float, ...]]:
        return {
            sensor: tuple(inflate * v for v in combined(own, axes, sensor))
            for sensor, own in values.items()
            if own
        }

    return WalkImu(
        rate=document["recording"]["rate"],
        comments=tuple(lines),
        noise=numbers({sensor: [a.noise for a in found] for sensor, found in read.items()}),
        walk=numbers({sensor: [a.walk for a in found] for sensor, found in read.items()}),
        style=style,
    )


def _axis(channel: Json, choice: WalkChoice, consumer: Consumer) -> _Axis:
    name = channel["name"]
    noises, walks, notes = [], [], []
    for model in channel["models"]:
        noise = parameter(name, model, "N", consumer.file)
        walk, parts = choice.rule(name, model, noise.value)
        noises.append(noise.value)
        walks.append(walk)
        notes.append("; ".join([f"N {noise.text}", *parts, f"walk {walk:.4e}"]))
    if min(noises) <= 0 or max(walks) <= 0:
        raise InputError(
            f"channel {name!r}: {consumer.name} needs noise and walk above zero, and N or the walk is zero here"
        )
    return _Axis(name, max(noises), max(walks), tuple(notes))


def _table(sensor: str, axes: Sequence[_Axis], consumer: Consumer) -> list[str]:
    if not axes:
        return [
            "",
            f"{sensor}: the log holds none in known units. {consumer.name} needs its two lines: fill them in below",
        ]
    noise, walk = UNITS[sensor]
    lines = ["", f"{sensor}, N in {noise}, K and walk in {walk}:"]
    for axis in axes:
        lines += [f"  {plain_line(axis.name)}: {note}" for note in axis.notes]
        if len(axis.notes) > 1:
            lines.append(
                f"  {plain_line(axis.name)}: the record cannot decide between these two; the larger numbers are used"
            )
    return lines
