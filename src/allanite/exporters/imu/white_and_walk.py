# SPDX-License-Identifier: BSD-3-Clause
"""White noise and a random walk of the bias, of three gyroscopes and three accelerometers: what most filters know."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu.numbers import ImuNumbers
from allanite.exporters.imu.options import NoiseOptions, asked_of
from allanite.exporters.imu.preamble import Consumer
from allanite.exporters.imu.walks import walk_choice, walking
from allanite.lazy_dataclasses import dataclass

__all__ = ["WalkImu", "white_and_walk"]

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkImu(ImuNumbers):
    """The numbers of a file, combined and inflated as was asked.

    Attributes
    ----------
    walk : mapping of str to tuple of float
        Root density of the noise that is integrated into the bias, in SI: as `noise`.
    """

    walk: Mapping[str, tuple[float, ...]]


def white_and_walk(document: Json, consumer: Consumer, **options: Unpack[NoiseOptions]) -> WalkImu:
    """What a file says of a study.

    Raises
    ------
    InputError
        What `asked_of` refuses, a parameter without value and limit, or noise or a walk of zero.
    """
    asked = asked_of(document, consumer, **options)
    choice = asked.choice or walk_choice("upper-bound", asked.time, consumer.file)
    read = asked.read(lambda channel: walking(channel, choice, consumer.name, consumer.file))
    return WalkImu(
        rate=document["recording"]["rate"],
        comments=asked.head(document, consumer, choice.words, read),
        noise=asked.numbers(read, lambda axis: axis.noise),
        walk=asked.numbers(read, lambda axis: axis.walk),
        style=asked.style,
    )
