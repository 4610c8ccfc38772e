# SPDX-License-Identifier: BSD-3-Clause
"""How a device misbehaves: what it sends instead of one frame after the other.

Each fault happens when the sample of number `at` is due.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments.serial_imu.encoding import Encoder
from allanite.lazy_dataclasses import dataclass

__all__ = ["ImuFault", "Source", "Vanish", "Wait", "noise", "wire"]

#: Values of samples [first, first + count), shape (count, n_channels), in the unit of each channel.
Source = Callable[[int, int], NDArray[np.float64]]

#: Samples made at once.
_BLOCK = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuFault:
    """Fault at one sample.

    Attributes
    ----------
    kind : str
        "garbage": bytes without meaning before the frame; "partial": the frame ends early; "flipped": a bit is wrong;
        "doubled": the frame comes twice; "replayed": frames before come once more; "lost": frames are not sent though
        the counter goes on; "restart": the counter begins anew; "overload": its values are overloads; "pause": nothing
        comes for a while, and the samples are lost; "vanish": the port disappears for a while.
    at : int
        Number of the sample.
    size : int
        Bytes of garbage, bytes that remain of the frame, number of the bit, frames that are replayed or lost.
    seconds : float [s]
        Length of a pause or of an absence.
    serial : str or None
        Serial number of the device that comes back after "vanish"; None: the same.
    """

    kind: Literal[
        "garbage",
        "partial",
        "flipped",
        "doubled",
        "replayed",
        "lost",
        "restart",
        "overload",
        "pause",
        "vanish",
    ]
    at: int
    size: int = 1
    seconds: float = 0.0
    serial: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Wait:
    """Nothing is sent for so long [s]; the samples of that time are never sent."""

    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Vanish:
    """The port is away for so long [s]."""

    seconds: float
    serial: str | None


def noise(n_channels: int, seed: int = 0, deviation: float = 1.0) -> Source:
    """White noise that can be asked for again: the same number gives the same sample."""

    def values(first: int, count: int) -> NDArray[np.float64]:
        blocks = range(first // _BLOCK, (first + count - 1) // _BLOCK + 1)
        drawn = [
            np.random.Generator(np.random.SFC64([seed, block])).standard_normal((_BLOCK, n_channels))
            for block in blocks
        ]
        offset = first - blocks[0] * _BLOCK
        return deviation * np.concatenate(drawn)[offset : offset + count]

    return values


def wire(
    encoder: Encoder,
    source: Source,
    faults: Sequence[ImuFault] = (),
    *,
    rate: float,
    total: int | None = None,
) -> Iterator[tuple[int, bytes | Wait | Vanish]]:
    """What goes over the line: pairs (number of the sample, bytes or an absence), one after the other.

    Parameters
    ----------
    rate : float [Hz]
        By which an absence takes samples away.
    total : int, optional
        Samples until the device falls silent; None: never.
    """
    by_number: dict[int, list[ImuFault]] = {}
    for fault in faults:
        by_number.setdefault(fault.at, []).append(fault)
    number, zero, last = 0, 0, [b""]
    values, begun = source(0, _BLOCK), 0
    while total is None or number < total:
        if not begun <= number < begun + len(values):
            begun, values = number, source(number, _BLOCK)
        now = by_number.get(number, ())
        if any(f.kind == "restart" for f in now):
            zero = number
        flags = 1 if any(f.kind == "overload" for f in now) else 0
        row = np.full(values.shape[1], np.nan) if flags else values[number - begun]
        frame = encoder.encode(number - zero, row.tolist(), flags)
        absent = 0
        for fault in now:
            if fault.kind in ("pause", "vanish"):
                gone = fault.seconds
                yield (
                    number,
                    (
                        Wait(seconds=gone)
                        if fault.kind == "pause"
                        else Vanish(seconds=gone, serial=fault.serial)
                    ),
                )
                absent = max(absent, round(gone * rate))
            elif fault.kind == "lost":
                absent = max(absent, fault.size)
        if absent:
            number += absent
            continue
        yield number, _spoilt(frame, now, last, number)
        last = [*last[-63:], frame]
        number += 1


def _spoilt(frame: bytes, faults: Sequence[ImuFault], before: Sequence[bytes], number: int) -> bytes:
    """The frame as these faults send it."""
    sent = frame
    for fault in faults:
        if fault.kind == "partial":
            sent = frame[: fault.size]
        elif fault.kind == "flipped":
            at = fault.size // 8 % len(frame)
            sent = frame[:at] + bytes([frame[at] ^ 1 << fault.size % 8]) + frame[at + 1 :]
        elif fault.kind == "doubled":
            sent = frame + frame
        elif fault.kind == "replayed":
            sent = b"".join(before[-fault.size :]) + frame
        elif fault.kind == "garbage":
            sent = np.random.Generator(np.random.SFC64([number])).bytes(fault.size) + sent
    return sent
