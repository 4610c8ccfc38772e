# SPDX-License-Identifier: BSD-3-Clause
"""Variation: the Allan deviation over time and lag, whether it is constant, and when and how it changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.recording.channel_names import channel_called
from allanite.stability.variation.verdict import ModelSource, VariationVerdict
from allanite.stability.variation.words import (
    all_constant,
    change_sentence,
    constant_sentence,
    scatter_sentence,
    silence_sentence,
)

__all__ = ["Change", "ChannelVariation", "LagTest", "Variation"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LagTest(Result):
    """The windows of one lag.

    Attributes
    ----------
    tau : float [s]
        Averaging time.
    window : float [s]
        Length of the windows.
    start, stop : ndarray, shape (n_windows,) [s]
        Since the first sample.
    deviation, lower, upper : ndarray, shape (n_windows,) [SI unit of the rate or acceleration]
        With the interval of each window.
    edf : ndarray, shape (n_windows,)
        Degrees of freedom.
    ratio : ndarray, shape (n_windows,)
        Deviation over that of the whole record.
    significant : ndarray of bool, shape (n_windows,)
        The window differs from the others by more than chance makes any of all windows and lags.
    whole : float [SI unit of the rate or acceleration]
        Deviation of the whole record.
    chi2, p : float
        Constancy of the windows of this lag alone; NaN for a single window.
    dof : int
        Of `chi2`.
    """

    tau: float
    window: float
    start: Array = field(repr=False)
    stop: Array = field(repr=False)
    deviation: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    edf: Array = field(repr=False)
    ratio: Array = field(repr=False)
    significant: NDArray[np.bool_] = field(repr=False)
    whole: float
    chi2: float
    dof: int
    p: float

    @property
    def clearest(self) -> int:
        """The window that differs from the whole record by the most standard deviations."""
        return int(np.argmax(np.abs(np.log(self.ratio)) * np.sqrt(self.edf)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Change(Result):
    """One change of the noise.

    Attributes
    ----------
    symbol : str
        Term that changed: Q, N, B, sigma, K; "all" for the noise as a whole.
    time : Quantity or None
        Of a step, since the first sample; None for a drift, steadily from the first to the last sample.
    ratio : Quantity
        Amplitude after over before, of a drift at the end over at the beginning; not resolved where the windows do not
        tell it.
    p : float
        Chance of one as clear where the noise is constant.
    """

    symbol: str
    time: Quantity | None
    ratio: Quantity
    p: float

    def __str__(self) -> str:
        return change_sentence(self.symbol, self.time, self.ratio)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelVariation(Result):
    """One channel.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    verdict : VariationVerdict
        "changes" (with `changes`), "constant", or "fluctuates": no step or drift explains it.
    lags : tuple of LagTest
        From the shortest.
    changes : tuple of Change
        In the order of time; drifts first.
    silent : tuple of (float, float) [s]
        Start and stop of windows of the shortest lag that hold one and the same value throughout: steps cannot be
        told beside them.
    chi2, dof, p : float
        All windows of all lags together; lags that see the same noise count as fewer degrees of freedom.
    p_change : float
        Chance of the clearest change where the noise is constant.
    p_left : float
        All windows again after the changes are taken into account.
    visible : mapping of str to float
        Factor on the amplitude of each term at which a step in the middle of the record would just be called one.
    kurtosis : float
        Excess of the white noise, which widens the intervals; 0 where it may be Gaussian.
    model : NoiseModel
        Whose covariance the intervals and tests rest on.
    model_source : ModelSource
        "given", "fitted" to the whole record, or "rough": no sum of terms explains the whole record.
    """

    name: str
    kind: str
    unit: str
    verdict: VariationVerdict
    lags: tuple[LagTest, ...] = field(repr=False)
    changes: tuple[Change, ...]
    silent: tuple[tuple[float, float], ...] = field(repr=False)
    chi2: float
    dof: float
    p: float
    p_change: float
    p_left: float
    visible: Mapping[str, float]
    kurtosis: float
    model: NoiseModel = field(repr=False)
    model_source: ModelSource

    @property
    def reason(self) -> str:
        """What was found, in a sentence."""
        if self.silent:
            return silence_sentence(self.silent)
        match self.verdict:
            case VariationVerdict.CHANGES:
                return "; ".join(map(str, self.changes))
            case VariationVerdict.FLUCTUATES:
                worst = min(self.lags, key=lambda lag: lag.p)
                at = worst.clearest
                return scatter_sentence(self.p, worst.tau, worst.start[at], worst.stop[at], worst.ratio[at])
            case VariationVerdict.CONSTANT:
                return constant_sentence(min(2 * min(self.p, self.p_change), 1.0), self.visible)


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation(Result):
    """All channels of a record.

    Attributes
    ----------
    verdict : VariationVerdict
        That of the worst channel.
    channels : tuple of ChannelVariation
        Those that bear noise.
    rate : float [Hz]
        Samples per second.
    duration : float [s]
        Of the record.
    confidence : float
        Of the intervals.
    false_alarm : float
        Probability that a channel with constant noise is reported to change.
    source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-variation"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    channels: tuple[ChannelVariation, ...]
    rate: float
    duration: float
    confidence: float
    false_alarm: float
    source: str = ""

    def __getitem__(self, name: str) -> ChannelVariation:
        """One channel.

        Raises
        ------
        InputError
            No such channel.
        """
        return channel_called(name, self.channels)

    @property
    def verdict(self) -> VariationVerdict:
        """That of the worst channel."""
        return min((c.verdict for c in self.channels), key=list(VariationVerdict).index)

    @property
    def reason(self) -> str:
        """What was found, channel by channel; the constant ones are not listed beside others."""
        if len(self.channels) == 1:
            return self.channels[0].reason
        if self.verdict is VariationVerdict.CONSTANT:
            return all_constant(len(self.channels))
        listed = [c for c in self.channels if c.verdict is not VariationVerdict.CONSTANT]
        return "; ".join(f"{c.name}: {c.reason}" for c in listed)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.stability.variation.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
