# SPDX-License-Identifier: BSD-3-Clause
"""The parts of a study: what it says of the record, and of each channel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.contamination import Contamination
from allanite.fitting.record_lengths import Advice
from allanite.fitting.sensor_curves import OverFloor
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan import AllanCurve
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.result import Result
from allanite.recording.health.finding import Finding
from allanite.recording.records import Recording
from allanite.recording.sample_hold import HeldSamples
from allanite.stability.environment.results import EnvironmentFacts
from allanite.study.result_document import RecordFacts

__all__ = [
    "Aliasing",
    "BlockExtremes",
    "ChannelFloor",
    "ChannelModels",
    "ChannelStudy",
    "FloorRecord",
    "MissingSamples",
    "SensorCurve",
    "SlopeReading",
    "StudiedRecord",
    "models_by_channel",
]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]


# -- the record --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class MissingSamples(Result):
    """What a recorded run lacks for one reason.

    Attributes
    ----------
    reason : str
        Reason as the recorder noted it.
    gaps : int or None
        Number of gaps; None for samples that are present without a value.
    samples : int
        Missing samples in all gaps.
    first, longest : int or None [samples]
        Start of the first gap, and length of the longest.
    """

    reason: str
    gaps: int | None
    samples: int
    first: int | None
    longest: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StudiedRecord(RecordFacts):
    """The record of a study.

    Attributes
    ----------
    start : str or None
        Time of the first sample, UTC (ISO 8601).
    missing : int
        Samples that are missing.
    gaps : tuple of (int, int) [samples]
        Their runs, half-open, at most 100.
    missing_because : tuple of MissingSamples
        Missing samples of a recorded run, one entry for each reason.
    """

    start: str | None
    missing: int
    gaps: tuple[tuple[int, int], ...]
    missing_because: tuple[MissingSamples, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorRecord(RecordFacts):
    """The record of the shorted input.

    Attributes
    ----------
    source : str
        Origin of the record of the instrument.
    findings : tuple of Finding
        Findings about the record of the instrument.
    """

    source: str
    findings: tuple[Finding, ...]

    @classmethod
    def seen(cls, floor: Recording, findings: Sequence[Finding]) -> FloorRecord:
        """That of a recording."""
        facts = RecordFacts.of(floor)
        return cls(
            rate=facts.rate,
            samples=facts.samples,
            duration=facts.duration,
            channels=facts.channels,
            history=facts.history,
            source=floor.source,
            findings=tuple(findings),
        )


# -- a channel ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockExtremes(Result):
    """The samples of a channel in at most 1500 blocks.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
        Middle of each block, since the first sample.
    low, high : ndarray, shape (n,) [SI unit of the channel]
        Lowest and highest sample of each block; NaN where it has none.
    """

    t: Array
    low: Array
    high: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class SlopeReading(Result):
    """A coefficient read off the curve where it has the slope of its term.

    Attributes
    ----------
    symbol : str
        Q, N, B, T, K or R.
    value : float [SI]
        Value of the reading; NaN if the curve has no such slope.
    note : str
        Place of the reading on the curve.
    """

    symbol: str
    value: float
    note: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorCurve(Result):
    """The sensor without its instrument: the difference of two Allan variances.

    Attributes
    ----------
    tau : ndarray, shape (n,) [s]
        Averaging time.
    deviation, lower, upper : ndarray, shape (n,) [SI unit of the rate or acceleration]
        NaN where it is not resolved; then `upper` is a limit, and NaN where the floor is not known.
    """

    tau: Array
    deviation: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelFloor(Result):
    """The instrument's own noise in one channel, which is removed.

    Attributes
    ----------
    curve : ChannelCurve
        Curve of the instrument.
    share : ndarray, shape (n,)
        Part of the measured variance that it makes, at each lag of `sensor`.
    sensor : SensorCurve
        Curve of the sensor alone, without the instrument.
    """

    curve: ChannelCurve
    share: Array
    sensor: SensorCurve

    @classmethod
    def of(cls, above: OverFloor, name: str, below: AllanCurve | None = None) -> ChannelFloor:
        """That of one channel; `below` is the curve of the floor as it was fitted."""
        i = above.names.index(name)
        columns = (above.deviation[:, i], above.lower[:, i], above.upper[:, i])
        deviation, lower, upper = (np.where(np.isfinite(column), column, np.nan) for column in columns)
        return cls(
            curve=ChannelCurve.of(above.floor[name] if below is None else below),
            share=above.share()[:, i],
            sensor=SensorCurve(tau=above.tau, deviation=deviation, lower=lower, upper=upper),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Aliasing(Result):
    """White noise of a sensor far beyond the inverse of an aperture that is shorter than the interval.

    Attributes
    ----------
    aperture, interval : float [s]
        Averaging time within a sample, and sample interval.
    factor : float
        √(interval/aperture), by which N reads too large; no result is divided by it.
    """

    aperture: float
    interval: float
    factor: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelModels(Result):
    """A channel with its noise models.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    models : tuple of NoiseModel
        The preferred one first; two where the record cannot decide between the families, none where no fit was
        possible.
    """

    name: str
    kind: str
    unit: str
    models: tuple[NoiseModel, ...]

    @property
    def of_samples(self) -> bool:
        """The model is that of the samples, not of the curve."""
        return any(m.goodness.get("method") == "likelihood" for m in self.models)


def models_by_channel(channels: Iterable[ChannelModels]) -> dict[str, NoiseModel]:
    """The model of each channel that has one, with its `alternative` where the record cannot decide."""
    return {
        c.name: replace(c.models[0], alternative=c.models[1]) if len(c.models) > 1 else c.models[0]
        for c in channels
        if c.models
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelStudy(ChannelModels):
    """All that a study says of one channel.

    Attributes
    ----------
    mean, sd : float [SI unit of the channel]
        Mean and standard deviation of the samples.
    overview : BlockExtremes
        Extremes of blocks, for the figure of the record.
    curve : ChannelCurve
        Measured curve, and which lags were fitted.
    spectrum : Spectrum
        Spectrum with its lines.
    slopes : tuple of SlopeReading
        The reading by slopes of the seed paper, for comparison.
    no_slopes : str
        Why there is none, "" where there is one.
    advice : tuple of Advice
        Record lengths that would resolve more terms.
    environment : EnvironmentFacts or None
        Temperature and warm-up, if examined: `curve`, `models`, `spectrum` and `overview` are then those of the
        residual.
    aliasing : Aliasing or None
        Excess of N by aliasing, if an aperture is shorter than the interval.
    held : HeldSamples or None
        Repeated values, if the log holds each value for several samples and each was used once: the other results are
        those of the values.
    contamination : Contamination or None
        Contamination of the white noise, if there is any.
    floor : ChannelFloor or None
        Noise of the instrument, if it was removed: `models` are then those of the sensor without it.
    """

    mean: float
    sd: float
    overview: BlockExtremes = field(repr=False)
    curve: ChannelCurve = field(repr=False)
    spectrum: Spectrum = field(repr=False)
    slopes: tuple[SlopeReading, ...] = field(repr=False)
    no_slopes: str = ""
    advice: tuple[Advice, ...] = field(repr=False)
    environment: EnvironmentFacts | None = None
    aliasing: Aliasing | None = None
    held: HeldSamples | None = None
    contamination: Contamination | None = None
    floor: ChannelFloor | None = None
