# SPDX-License-Identifier: BSD-3-Clause
"""The filters of the two autopilots: standard deviations of one period, in parameters that are lower bounds here.

Both predict the covariance in periods dt, and both add (dt noise)^2 to each delta angle. To the bias PX4 adds
(dt b_noise)^2; ArduPilot adds (dt^2 b_noise)^2 to the bias of a delta angle, dt times the bias, which is the same. So
noise = N/sqrt(dt) and b_noise = walk/sqrt(dt).

They are written as comments: a value of the sensor alone makes a filter overconfident in flight.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol, Unpack

from allanite.errors import InputError
from allanite.exporters.imu.options import NoiseOptions
from allanite.exporters.imu.preamble import Consumer
from allanite.exporters.imu.usage import Usage
from allanite.exporters.imu.white_and_walk import white_and_walk

__all__ = ["LOWER_BOUNDS", "AutopilotWrite", "autopilot_writer"]

Json = Mapping[str, Any]

LOWER_BOUNDS = (
    "LOWER BOUNDS: the sensor at rest, without the vibration of an airframe. The lines are comments: use one only if "
    "it raises the value that is set"
)


class AutopilotWrite(Protocol):
    """`write` of the format of an autopilot."""

    def __call__(self, document: Json, *, filter_rate: float = ..., **options: Unpack[NoiseOptions]) -> str:
        """The text of the file."""
        ...


def autopilot_writer(
    *, name: str, file: str, usage: Usage, line: str, rate: float, read: Sequence[str]
) -> AutopilotWrite:
    """A function that writes the parameters of an autopilot.

    Parameters
    ----------
    usage : Usage
        The parameters, of noise and walk.
    line : str
        Pattern of a parameter, with {key} and {value}.
    rate : float [Hz]
        Of the filter's predictions, by default.
    read : sequence of str
        Where the discretisation was read, and what the defaults stand for.
    """

    def write(document: Json, *, filter_rate: float = rate, **options: Unpack[NoiseOptions]) -> str:
        """The text of a parameter file, its parameters as comments.

        Parameters
        ----------
        document : dict
            A study document.
        filter_rate : float [Hz]
            Predictions per second.
        **options
            `NoiseOptions`.

        Raises
        ------
        InputError
            A rate that is none, or what `white_and_walk` refuses.
        """
        if not (math.isfinite(filter_rate) and filter_rate > 0):
            raise InputError(
                f"filter_rate must be a positive number of predictions per second, not {filter_rate!r}"
            )
        consumer = Consumer(name=name, file=file, usage=usage, convention=_convention(filter_rate, read))
        imu = white_and_walk(document, consumer, **options)
        parameters = imu.lines(usage.slots, f"# {line}", rate=filter_rate)
        return "\n".join([*imu.comment(), "", *parameters]) + "\n"

    return write


def _convention(rate: float, read: Sequence[str]) -> tuple[str, ...]:
    return (
        f"DISCRETE at the period of the filter, dt = {1000 / rate:.6g} ms",
        "noise = N/sqrt(dt), bias noise = walk/sqrt(dt)",
        *read,
    )
