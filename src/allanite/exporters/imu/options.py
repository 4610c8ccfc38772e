# SPDX-License-Identifier: BSD-3-Clause
"""What is asked of a file of noise: its options, checked, and the channels of a study that they choose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypedDict, TypeVar

from allanite.errors import InputError
from allanite.exporters.imu.axes import (
    SENSORS,
    AxisNumbers,
    axes_rule,
    channels_of,
    combined,
    refuse_nothing,
)
from allanite.exporters.imu.preamble import Consumer, bound_lines, number_format, preamble, table
from allanite.exporters.imu.walks import WalkChoice, Words, is_positive, refuse_time, walk_choice
from allanite.lazy_dataclasses import dataclass

__all__ = ["Asked", "NoiseOptions", "WhiteOptions", "asked_of"]

Json = Mapping[str, Any]
Axis = TypeVar("Axis")


class NoiseOptions(TypedDict, total=False):
    """Options of every consumer of noise.

    ``walk``: "upper-bound", "k-only" or "horizon=<seconds>", what becomes of the bias instability
    (`allanite.exporters.imu.walks`). By default "upper-bound" of a consumer of white noise and a walk; the bias of a
    consumer of a Gauss-Markov process stays one by default, and with ``walk`` it is a walk.
    ``axes``: "worst" (default of filters), "rms" (default of simulators), and "each" where the file has a number for
    each axis. ``inflate``: factor on noise and bias, written into the file. ``correlation_time``: T of the Gauss-Markov
    term that stands for flicker, and in place of a fitted T where the file has one [s]. ``digits``: after the point.
    ``gyroscope``, ``accelerometer``: names of the channels of each triad.
    """

    walk: str | None
    axes: str | None
    inflate: float
    correlation_time: float | None
    digits: int
    gyroscope: Sequence[str] | None
    accelerometer: Sequence[str] | None


class WhiteOptions(TypedDict, total=False):
    """Those of `NoiseOptions` that a file of white noise alone has."""

    axes: str | None
    inflate: float
    digits: int
    gyroscope: Sequence[str] | None
    accelerometer: Sequence[str] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """Options that make sense, in the form in which they are used.

    Attributes
    ----------
    choice : WalkChoice or None
        How the walk is made; None where none was asked for.
    time : float or None [s]
        The correlation time that was given.
    axes, rule : str
        The rule for three axes: its label, and in words.
    inflate : float
    style : str
        Format of a number.
    channels : mapping of str to list of dict
        Of each sensor.
    """

    choice: WalkChoice | None
    time: float | None
    axes: str
    rule: str
    inflate: float
    style: str
    channels: Mapping[str, list[Json]]

    def read(self, axis: Callable[[Json], Axis]) -> dict[str, list[Axis]]:
        """What is read of each channel, by sensor."""
        return {sensor: [axis(channel) for channel in channels] for sensor, channels in self.channels.items()}

    def head(
        self,
        document: Json,
        consumer: Consumer,
        bias: Words,
        read: Mapping[str, Sequence[AxisNumbers]],
    ) -> tuple[str, ...]:
        """The comment at the head of the file, without a comment sign; see `preamble` and `table`."""
        channels = [channel for of_sensor in self.channels.values() for channel in of_sensor]
        return (
            *preamble(document, consumer, read, bias=bias, axes=self.rule, inflate=self.inflate),
            *bound_lines(channels, consumer, self.axes),
            *table(read),
        )

    def numbers(
        self, read: Mapping[str, Sequence[Axis]], value: Callable[[Axis], float]
    ) -> dict[str, tuple[float, ...]]:
        """A value of each sensor, one number or three, inflated; no entry where the study holds no channel."""
        return {
            sensor: tuple(
                self.inflate * v for v in combined([value(axis) for axis in axes], self.axes, sensor)
            )
            for sensor, axes in read.items()
            if axes
        }


def asked_of(
    document: Json,
    consumer: Consumer,
    *,
    walk: str | None = None,
    axes: str | None = None,
    inflate: float = 1.0,
    correlation_time: float | None = None,
    digits: int = 6,
    gyroscope: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> Asked:
    """The options of `NoiseOptions`, checked against a consumer and a study.

    Raises
    ------
    InputError
        No channel in known units of rate or acceleration, more than one triad of a kind, a channel without a model, or
        an option that makes no sense.
    """
    refuse_time(correlation_time)
    choice = None if walk is None else walk_choice(walk, correlation_time, consumer.file)
    axes = axes or ("rms" if consumer.simulator else "worst")
    rule, style = axes_rule(axes, per_axis=consumer.per_axis), number_format(digits)
    if not is_positive(inflate):
        raise InputError(f"inflate must be a positive factor, not {inflate!r}")
    wanted = dict(zip(SENSORS, (gyroscope, accelerometer), strict=True))
    channels = {sensor: channels_of(document, sensor, wanted[sensor]) for sensor in SENSORS}
    refuse_nothing(document, channels, consumer.file)
    return Asked(
        choice=choice,
        time=correlation_time,
        axes=axes,
        rule=rule,
        inflate=inflate,
        style=style,
        channels=channels,
    )
