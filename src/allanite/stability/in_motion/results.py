# SPDX-License-Identifier: BSD-3-Clause
"""Noise in motion over noise at rest: by band, of the terms that a filter is told, with its lines."""

from __future__ import annotations

from dataclasses import field
from typing import ClassVar

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict
from allanite.stability.in_motion import words
from allanite.stability.in_motion.lines import Comb, MotionLine

__all__ = ["BandInflation", "ChannelInMotion", "InMotion", "MotionLog", "MotionVerdict"]


class MotionVerdict(Verdict):
    """Is there more noise in motion?"""

    INFLATED = "inflated", "more noise in motion", Tone.WARNING
    LOWER = "lower", "less noise in motion than at rest", Tone.WARNING
    UNCHANGED = "unchanged", "no more noise in motion", Tone.GOOD


@dataclass(frozen=True, slots=True, kw_only=True)
class BandInflation(Result):
    """One band of frequency.

    Attributes
    ----------
    lower, upper : float [Hz]
        Ends of the band.
    inflation : Quantity
        Root density in motion over that at rest, lines left out.
    steady : bool
        The parts of the log in motion agree within chance.
    """

    lower: float
    upper: float
    inflation: Quantity
    steady: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelInMotion(Result):
    """One channel of one log in motion beside the log at rest.

    Attributes
    ----------
    name : str
        Name of the channel at rest, to which the model belongs.
    moving : str
        Name of the channel in motion.
    log : str
        Name of the log in motion.
    kind, unit : str
        Of the channel.
    verdict : MotionVerdict
        "inflated", "lower" or "unchanged".
    p : float
        Chance of a white noise as different where motion adds nothing.
    noise : Quantity
        N of the white noise that leaves the same error after integration as the signal in motion between `above` and
        `below`, lines left out: an upper limit of the sensor's noise.
    inflation : Quantity
        Factor of `noise` over the same at rest.
    with_lines : Quantity
        `noise` with the lines of the log in motion counted as noise.
    slow : Quantity
        Factor of the slow terms (B, K) in the band where they prevail at rest; not resolved where there is none.
    steady : bool
        The parts of the log in motion agree in `noise` within chance; else the interval is that of their scatter.
    bands : tuple of BandInflation
        From low to high frequencies.
    lines : tuple of MotionLine
        Lines in motion.
    combs : tuple of Comb
        Lines at multiples of one frequency.
    model : NoiseModel
        Model to tell a filter.
    at_rest, in_motion : Spectrum
        The two spectra.
    """

    STATED: ClassVar[tuple[str, ...]] = ("reason",)

    name: str
    moving: str
    log: str
    kind: str
    unit: str
    verdict: MotionVerdict
    p: float
    noise: Quantity
    inflation: Quantity
    with_lines: Quantity
    slow: Quantity
    steady: bool
    bands: tuple[BandInflation, ...] = field(repr=False)
    lines: tuple[MotionLine, ...] = field(repr=False)
    combs: tuple[Comb, ...] = field(repr=False)
    model: NoiseModel = field(repr=False)
    at_rest: Spectrum = field(repr=False)
    in_motion: Spectrum = field(repr=False)

    @property
    def reason(self) -> str:
        """What the verdict rests on, in a sentence."""
        if self.verdict is MotionVerdict.UNCHANGED:
            return words.unchanged_sentence(self.name, self.inflation)
        if self.verdict is MotionVerdict.LOWER:
            return words.lower_sentence(self.name, self.inflation)
        # by its lower end: the value of a band with few degrees of freedom is large by chance
        most = max(self.bands, key=lambda band: band.inflation.lower)
        return words.inflated_sentence(self.name, self.inflation, most.inflation, (most.lower, most.upper))

    @property
    def told(self) -> float:
        """Factor of N that the filter is told."""
        return 1.0 if self.model.in_motion is None else self.model.in_motion.noise


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLog(Result):
    """A log that was compared.

    Attributes
    ----------
    name : str
        Name of the log.
    rate : float [Hz]
        Samples per second.
    duration : float [s]
        From the first sample to the end of the last.
    faults : tuple of str
        What the examination of the log found, and that lowers the worth of the comparison.
    """

    name: str
    rate: float
    duration: float
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class InMotion(Result):
    """Noise of a sensor in motion, over that at rest.

    Attributes
    ----------
    verdict : MotionVerdict
        The worst of the channels.
    rest : MotionLog
        The log at rest.
    logs : tuple of MotionLog
        Logs in motion.
    channels : tuple of ChannelInMotion
        Channels of each log.
    above, below : float [Hz]
        Frequencies that count as noise.
    fixed : bool
        The body was held still in the logs in motion.
    confidence : float
        Level of the intervals.
    """

    FORMAT: ClassVar[str] = "allanite-in-motion"
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    rest: MotionLog
    logs: tuple[MotionLog, ...]
    channels: tuple[ChannelInMotion, ...]
    above: float
    below: float
    fixed: bool
    confidence: float

    @property
    def verdict(self) -> MotionVerdict:
        """The worst of the channels."""
        verdicts = {c.verdict for c in self.channels}
        return next(v for v in MotionVerdict if v in verdicts)

    @property
    def reason(self) -> str:
        """What the verdict rests on, in a sentence."""
        of_verdict = [c for c in self.channels if c.verdict is self.verdict]
        clearest = max(of_verdict, key=lambda c: abs(c.inflation.value - 1))
        return clearest.reason

    @property
    def models(self) -> dict[str, NoiseModel]:
        """Model to tell a filter, by channel: that of the log with the most noise."""
        noisiest: dict[str, ChannelInMotion] = {}
        for channel in self.channels:
            if channel.name not in noisiest or channel.told > noisiest[channel.name].told:
                noisiest[channel.name] = channel
        return {name: channel.model for name, channel in noisiest.items()}

    @property
    def rate(self) -> float:
        """Sample rate [Hz] of the first log in motion, at which the filter runs."""
        return self.logs[0].rate
