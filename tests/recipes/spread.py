# SPDX-License-Identifier: BSD-3-Clause
"""A toy analysis: do the samples of all channels scatter alike?"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict
from allanite.recording.records import Recording

__all__ = ["ChannelSpread", "Spread", "SpreadVerdict", "measure_spread"]


class SpreadVerdict(Verdict):
    """What the scatter of the channels comes to."""

    UNEVEN = "uneven", "Some channels scatter more than others", Tone.WARNING
    EVEN = "even", "All channels scatter alike", Tone.GOOD


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSpread(Result):
    """The scatter of one channel.

    Attributes
    ----------
    name : str
        Of the channel.
    sd : Quantity [SI unit of the channel]
        Standard deviation of its samples.
    """

    name: str
    sd: Quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread(Result):
    """The scatter of the samples of each channel.

    Attributes
    ----------
    verdict : SpreadVerdict
        Do all channels scatter alike?
    channels : tuple of ChannelSpread
        In their order.
    """

    FORMAT = "allanite-spread"
    verdict: SpreadVerdict
    channels: tuple[ChannelSpread, ...]


def measure_spread(
    recording: Recording,
    *,
    factor: float = 2.0,
    trim: float = 0.0,
    progress: Callable[[float, str], None] | None = None,
) -> Spread:
    """Measure the scatter of every channel; intervals at 95 % for white noise."""
    channels = []
    for channel in recording.channels:
        samples = recording.values(channel.name)
        samples = np.sort(samples[np.isfinite(samples)])
        cut = round(trim * samples.size)
        samples = samples[cut : samples.size - cut]
        sd = float(samples.std(ddof=1))
        half = 1.96 * sd / math.sqrt(2 * (samples.size - 1))
        quantity = Quantity.of(sd, (sd - half, sd + half), channel.unit)
        channels.append(ChannelSpread(name=channel.name, sd=quantity))
    values = [c.sd.value for c in channels]
    verdict = SpreadVerdict.UNEVEN if max(values) > factor * min(values) else SpreadVerdict.EVEN
    return Spread(verdict=verdict, channels=tuple(channels))
