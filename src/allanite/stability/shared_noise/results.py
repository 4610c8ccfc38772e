# SPDX-License-Identifier: BSD-3-Clause
"""Separation: the own noise of two or three sensors, and the part that they share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.result import Result
from allanite.stability.shared_noise.verdict import SeparationVerdict
from allanite.stability.shared_noise.words import (
    FROM_OUTSIDE,
    NOT_CORRELATED,
    OPPOSITE,
    SHARED_UNSEEN,
    TWO_SENSORS,
    delay_sentence,
    shared_sentence,
    unlike_sentence,
)

__all__ = ["COMMON", "NoisePart", "PairAgreement", "SensorDelay", "Separation"]

Array = NDArray[np.float64]

#: Name of the part that the sensors share.
COMMON = "common"
#: Probability below which three sensors do not share the same part.
_UNLIKE = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class NoisePart(Result):
    """Own noise of one sensor, or the common part.

    Attributes
    ----------
    name : str
        Of the channel, or "common".
    variance : ndarray, shape (n_lags,) [SI^2]
        Estimate of the Allan variance, which may be negative: that is no fault, but chance around a small value.
    variance_lower, variance_upper : ndarray, shape (n_lags,) [SI^2]
        Its interval.
    deviation : ndarray, shape (n_lags,) [SI]
        NaN where the interval of the variance reaches zero: there `upper` is an upper limit.
    lower, upper : ndarray, shape (n_lags,) [SI]
        Ends of the interval; lower is zero for an upper limit.
    edf : ndarray, shape (n_lags,)
        Degrees of freedom.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class PairAgreement(Result):
    """A test that every pair of three sensors shares the same part.

    Attributes
    ----------
    chi2, dof : float
        Chi-square, and its expectation if they do.
    p : float
        Probability of a larger one, if they do.
    """

    chi2: float
    dof: float
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorDelay(Result):
    """A sensor that feels the common part later than another.

    Attributes
    ----------
    late, early : str
        Channels.
    delay : float [s]
        Between them.
    """

    late: str
    early: str
    delay: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation(Result):
    """Noise of two or three sensors, taken apart.

    Attributes
    ----------
    channels : tuple of str
        Two or three.
    opposite : tuple of str
        Channels whose sign was turned around, because they are mounted the other way.
    kind, unit : str
        Of the channels.
    verdict : SeparationVerdict
        "shared", "not shared" or "opposite sign".
    tau : ndarray, shape (n_lags,) [s]
        Averaging time.
    total, total_lower, total_upper : ndarray, shape (n_lags, n) [SI]
        Deviation of each channel as it is, with its interval.
    own : tuple of NoisePart
        Of each sensor.
    common : NoisePart
        What the sensors share.
    correlation : ndarray, shape (n_lags, n_pairs)
        Of every pair, in the order of `pairs`.
    pairs : tuple of (str, str)
        Channels, two by two.
    agreement : PairAgreement or None
        None for two sensors.
    delays : tuple of SensorDelay
        Sensors that feel the common part later than another.
    missing : int
        Samples at which any channel is missing.
    confidence : float
        Of the intervals.
    rate : float [Hz]
        Samples per second.
    duration : float [s]
        Of the record.
    source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-separation"
    VERSION: ClassVar[int] = 2

    channels: tuple[str, ...]
    opposite: tuple[str, ...]
    kind: str
    unit: str
    verdict: SeparationVerdict
    tau: Array = field(repr=False)
    total: Array = field(repr=False)
    total_lower: Array = field(repr=False)
    total_upper: Array = field(repr=False)
    own: tuple[NoisePart, ...]
    common: NoisePart
    correlation: Array = field(repr=False)
    pairs: tuple[tuple[str, str], ...]
    agreement: PairAgreement | None
    delays: tuple[SensorDelay, ...] = ()
    missing: int
    confidence: float
    rate: float
    duration: float
    source: str = ""

    @property
    def reason(self) -> str:
        """What the verdict rests on, in a sentence."""
        match self.verdict:
            case SeparationVerdict.NOT_SHARED:
                return NOT_CORRELATED
            case SeparationVerdict.OPPOSITE:
                return OPPOSITE
            case SeparationVerdict.SHARED:
                return self._share()

    def _share(self) -> str:
        resolved, common = self.common.resolved, self.common.variance
        if not resolved.any():
            return SHARED_UNSEEN
        alone = np.mean([part.variance for part in self.own], axis=0)
        share = np.where(resolved, common / np.maximum(alone + common, 1e-300), 0.0)
        at = int(np.argmax(share))
        return shared_sentence(int(resolved.sum()), len(self.tau), float(self.tau[at]), float(share[at]))

    @property
    def remarks(self) -> list[str]:
        """What a reader must know besides."""
        unlike = self.agreement is not None and self.agreement.p < _UNLIKE
        return [
            *([FROM_OUTSIDE] if self.verdict is SeparationVerdict.SHARED else []),
            *([unlike_sentence(self.channels, self.agreement.p)] if self.agreement and unlike else []),
            *([TWO_SENSORS] if len(self.channels) == 2 else []),
            *(delay_sentence(d.late, d.early, d.delay) for d in self.delays),
        ]

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

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.stability.shared_noise.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
