# SPDX-License-Identifier: BSD-3-Clause
"""Separation: the own noise of two or three sensors, and the part that they share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain

__all__ = ["COMMON", "NoisePart", "Separation"]

Array = NDArray[np.float64]

#: Name of the part that the sensors share.
COMMON = "common"


@dataclass(frozen=True, slots=True, kw_only=True)
class NoisePart:
    """Own noise of one sensor, or the common part.

    Attributes
    ----------
    name : str
        Of the channel; "common".
    variance : ndarray, shape (n_lags,) [SI^2]
        Estimate of the Allan variance, which may be negative: that is no fault, but chance around a small value.
    variance_lower, variance_upper : ndarray, shape (n_lags,) [SI^2]
        Its interval.
    deviation : ndarray, shape (n_lags,) [SI]
        NaN where the interval of the variance reaches zero: there `upper` is an upper limit.
    lower, upper : ndarray, shape (n_lags,) [SI]
        Ends of the interval; lower is zero for an upper limit.
    edf : ndarray, shape (n_lags,)
    model : NoiseModel
        Terms with their intervals; what reaches zero is an upper limit.
    """

    name: str
    variance: Array = field(repr=False)
    variance_lower: Array = field(repr=False)
    variance_upper: Array = field(repr=False)
    deviation: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    edf: Array = field(repr=False)
    model: NoiseModel

    @property
    def resolved(self) -> NDArray[np.bool_]:
        """Lags at which the part is seen, shape (n_lags,)."""
        return np.asarray(self.lower > 0)

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what does not exist."""
        names = ("name", "variance", "variance_lower", "variance_upper", "deviation", "lower", "upper", "edf")
        return {**{k: plain(getattr(self, k)) for k in names}, "model": self.model.to_json()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation:
    """Noise of two or three sensors, taken apart.

    Attributes
    ----------
    channels : tuple of str
    opposite : tuple of str
        Channels whose sign was turned around, because they are mounted the other way.
    kind, unit : str
    tau : ndarray, shape (n_lags,) [s]
    total, total_lower, total_upper : ndarray, shape (n_lags, n) [SI]
        Deviation of each channel as it is, with its interval.
    own : tuple of NoisePart
    common : NoisePart
    correlation : ndarray, shape (n_lags, n_pairs)
        Of every pair, in the order of `pairs`.
    pairs : tuple of (str, str)
    verdict : str
        "noise is shared", "no shared noise is seen" or "the sensors share noise of opposite sign".
    reason : str
    agreement : dict or None
        Of three sensors: chi-square "chi2", "dof" and "p" that every pair shares the same.
    remarks : tuple of str
    missing : int
        Samples at which any channel is missing.
    confidence : float
    rate : float [Hz]
    duration : float [s]
    source : str
    """

    channels: tuple[str, ...]
    opposite: tuple[str, ...]
    kind: str
    unit: str
    tau: Array = field(repr=False)
    total: Array = field(repr=False)
    total_lower: Array = field(repr=False)
    total_upper: Array = field(repr=False)
    own: tuple[NoisePart, ...]
    common: NoisePart
    correlation: Array = field(repr=False)
    pairs: tuple[tuple[str, str], ...]
    verdict: str
    reason: str
    agreement: dict[str, float] | None
    remarks: tuple[str, ...] = ()
    missing: int
    confidence: float
    rate: float
    duration: float
    source: str = ""

    @property
    def parts(self) -> tuple[NoisePart, ...]:
        """The own noise of every sensor, then the common part."""
        return (*self.own, self.common)

    def __getitem__(self, name: str) -> NoisePart:
        """One part by the name of its channel, or "common".

        Raises
        ------
        InputError
            No such part.
        """
        from allanite.errors import InputError

        for part in self.parts:
            if part.name == name:
                return part
        raise InputError(f"no part {name!r}; there are: {', '.join(p.name for p in self.parts)}")

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what does not exist."""
        names = (
            "source", "verdict", "reason", "channels", "opposite", "kind", "unit", "rate", "duration", "missing",
            "confidence", "tau", "total", "total_lower", "total_upper", "correlation", "pairs", "agreement", "remarks",
        )  # fmt: skip
        return {
            "format": "allanite-separation",
            "version": 1,
            **{k: plain(getattr(self, k)) for k in names},
            "own": [part.to_json() for part in self.own],
            "common": self.common.to_json(),
        }
