# SPDX-License-Identifier: BSD-3-Clause
"""The Allan curve of one channel, as documents hold it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.curve import AllanCurve
from allanite.quantities.result import Result
from allanite.recording.records import Sampling

__all__ = ["ChannelCurve"]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelCurve(Result):
    """The Allan curve of one channel.

    Attributes
    ----------
    statistic : str
        adev, oadev, hdev, ...
    engine : str
        "exact", "decimated", or "elsewhere".
    confidence : float
        Confidence level of the intervals.
    dt : float [s]
        Sample interval.
    n_samples : int
        Samples of the record, missing ones included.
    sampling : str
        "mean" or "point".
    interval_basis : str
        Noise that the degrees of freedom assume.
    lags : ndarray of int64, shape (n,) [samples]
        Lag.
    tau : ndarray, shape (n,) [s]
        Averaging time.
    deviation, lower, upper : ndarray, shape (n,) [SI unit of the rate or acceleration]
        Deviation with its interval; NaN where no term is complete.
    edf : ndarray, shape (n,)
        Equivalent degrees of freedom of the variance.
    count : ndarray of int64, shape (n,)
        Terms in the sum.
    missing : ndarray of int64, shape (n_runs, 2) [samples]
        Runs of missing samples, half-open.
    used : ndarray of bool, shape (n,)
        True for a lag that entered the fit; empty if nothing was fitted.
    excluded : tuple of str
        Reason for each lag that did not enter the fit, "" for one that did; empty if nothing was fitted to this curve.
    """

    statistic: str
    engine: str
    confidence: float
    dt: float
    n_samples: int
    sampling: Sampling
    interval_basis: str = ""
    lags: NDArray[np.int64] = field(repr=False)
    tau: Array = field(repr=False)
    deviation: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    edf: Array = field(repr=False)
    count: NDArray[np.int64] = field(repr=False)
    missing: Spans = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64), repr=False)
    used: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool), repr=False)
    excluded: tuple[str, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if self.missing.size % 2:
            raise FormatError("runs of missing samples are pairs")
        object.__setattr__(self, "missing", self.missing.reshape(-1, 2))
        known = ("used",) if self.used.size else ()
        for name in ("tau", "deviation", "lower", "upper", "edf", "count", *known):
            if getattr(self, name).shape != self.lags.shape:
                raise FormatError(
                    f"{name} of a curve has {getattr(self, name).size} numbers for {self.lags.size} lags"
                )

    @classmethod
    def of(
        cls, curve: AllanCurve, used: NDArray[np.bool_] | None = None, excluded: Sequence[str] = ()
    ) -> ChannelCurve:
        """That of an `AllanCurve` of one channel."""
        facts = ("statistic", "engine", "confidence", "dt", "n_samples", "interval_basis", "lags", "tau")
        columns = ("deviation", "lower", "upper", "edf", "count")
        return cls(
            **{name: getattr(curve, name) for name in facts},
            **{name: getattr(curve, name)[:, 0] for name in columns},
            sampling=curve.channels[0].sampling,
            missing=curve.missing[0],
            used=np.zeros(0, dtype=bool) if used is None else used,
            excluded=tuple(excluded),
        )
