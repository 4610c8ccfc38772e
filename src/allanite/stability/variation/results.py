# SPDX-License-Identifier: BSD-3-Clause
"""Variation: the Allan deviation over time and lag, whether it is constant, and when and how it changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain

__all__ = ["CONSTANT", "Change", "ChannelVariation", "LagTest", "Variation"]

Array = NDArray[np.float64]

#: Verdict on a channel whose noise may be the same all the time.
CONSTANT = "constant within its intervals"
CHANGES = "the noise changes"
FLUCTUATES = "the noise fluctuates"


@dataclass(frozen=True, slots=True, kw_only=True)
class LagTest:
    """The windows of one lag.

    Attributes
    ----------
    tau : float [s]
    window : float [s]
        Length of the windows.
    start, stop : ndarray, shape (n_windows,) [s]
        Since the first sample.
    deviation, lower, upper : ndarray, shape (n_windows,) [SI unit of the rate or acceleration]
        With the interval of each window.
    edf : ndarray, shape (n_windows,)
    ratio : ndarray, shape (n_windows,)
        Deviation over that of the whole record.
    significant : ndarray of bool, shape (n_windows,)
        The window differs from the others by more than chance makes any of all windows and lags.
    whole : float
        Deviation of the whole record.
    chi2, p : float
    dof : int
        Constancy of the windows of this lag alone; NaN and 0 for a single window.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One change of the noise.

    Attributes
    ----------
    symbol : str
        Term that changed: Q, N, B, sigma, K; "all" for the noise as a whole.
    kind : "step" or "drift"
        At once, or steadily from the first to the last sample.
    time, time_lower, time_upper : float or None [s]
        Of a step, with its interval.
    ratio, lower, upper : float
        Amplitude after over before (at the end over at the beginning), with its interval.
    p : float
        Chance of one as clear where the noise is constant.
    says : str
    """

    symbol: str
    kind: str
    time: float | None
    time_lower: float | None
    time_upper: float | None
    ratio: float
    lower: float
    upper: float
    p: float
    says: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelVariation:
    """One channel.

    Attributes
    ----------
    name, kind, unit : str
    verdict : str
        "constant within its intervals", "the noise changes" (with `changes`) or "the noise fluctuates" (no step or
        drift explains it).
    reason : str
    lags : tuple of LagTest
    changes : tuple of Change
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
    remarks : tuple of str
    """

    name: str
    kind: str
    unit: str
    verdict: str
    reason: str
    lags: tuple[LagTest, ...] = field(repr=False)
    changes: tuple[Change, ...]
    chi2: float
    dof: float
    p: float
    p_change: float
    p_left: float
    visible: Mapping[str, float]
    kurtosis: float
    model: NoiseModel = field(repr=False)
    remarks: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what does not exist."""
        names = (
            "name", "kind", "unit", "verdict", "reason", "lags", "changes", "chi2", "dof", "p", "p_change", "p_left",
            "visible", "kurtosis", "remarks",
        )  # fmt: skip
        return {**{k: plain(getattr(self, k)) for k in names}, "model": self.model.to_json()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """All channels of a record.

    Attributes
    ----------
    channels : tuple of ChannelVariation
    rate : float [Hz]
    duration : float [s]
    confidence : float
        Of the intervals.
    false_alarm : float
        Probability that a channel with constant noise is said to change.
    source : str
    """

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
        from allanite.errors import InputError

        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InputError(f"no channel {name!r}; there are: {', '.join(c.name for c in self.channels)}")

    @property
    def verdict(self) -> str:
        """That of the worst channel."""
        order = (CHANGES, FLUCTUATES, CONSTANT)
        return min((c.verdict for c in self.channels), key=order.index)

    @property
    def reason(self) -> str:
        """What was found, channel by channel; the constant ones are not listed beside others."""
        told = [c for c in self.channels if c.verdict != CONSTANT] or list(self.channels)
        if len(self.channels) == 1:
            return told[0].reason
        if self.verdict == CONSTANT:
            return f"no window of {len(self.channels)} channels differs from the others by more than chance"
        return "; ".join(f"{c.name}: {c.reason}" for c in told)

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what does not exist."""
        names = ("source", "verdict", "reason", "rate", "duration", "confidence", "false_alarm")
        return {
            "format": "allanite-variation",
            "version": 1,
            **{k: plain(getattr(self, k)) for k in names},
            "channels": [c.to_json() for c in self.channels],
        }
