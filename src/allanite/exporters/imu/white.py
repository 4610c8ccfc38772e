# SPDX-License-Identifier: BSD-3-Clause
"""White noise alone, of three gyroscopes and three accelerometers: what simulators without a moving bias know, and the
covariance of a sample. The random walk and the bias instability are left out, and the file says so."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu.axes import (
    AxisNumbers,
    HeaderNote,
    left_out,
    parameter,
    refuse_no_noise,
    without_slot,
)
from allanite.exporters.imu.numbers import ImuNumbers
from allanite.exporters.imu.options import WhiteOptions, asked_of
from allanite.exporters.imu.preamble import Consumer
from allanite.exporters.imu.walks import bias_left_out
from allanite.lazy_dataclasses import dataclass

__all__ = ["WhiteImu", "white_imu"]

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class WhiteImu(ImuNumbers):
    """The numbers of a file, combined and inflated as was asked."""


def white_imu(document: Json, consumer: Consumer, **options: Unpack[WhiteOptions]) -> WhiteImu:
    """What a file says of a study.

    Raises
    ------
    InputError
        What `asked_of` refuses, a parameter without value and limit, or noise of zero.
    """
    asked = asked_of(document, consumer, **options)
    read = asked.read(lambda channel: _axis(channel, consumer))
    return WhiteImu(
        rate=document["recording"]["rate"],
        comments=asked.head(document, consumer, lambda _: [], read),
        noise=asked.numbers(read, lambda axis: axis.noise),
        style=asked.style,
    )


def _axis(channel: Json, consumer: Consumer) -> AxisNumbers:
    name, file = channel["name"], consumer.file
    noises, notes = [], []
    for model in channel["models"]:
        noise = parameter(name, model, "N", file)
        lost = (left_out(name, model, "K", file), *bias_left_out(name, model, noise.value, file))
        noises.append(noise)
        notes.append(HeaderNote((noise, *lost, *without_slot(model, channel["kind"]))))
    refuse_no_noise(name, noises, consumer.name)
    return AxisNumbers(name=name, noise=max(noise.value for noise in noises), notes=tuple(notes))
