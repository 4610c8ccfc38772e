# SPDX-License-Identifier: BSD-3-Clause
"""Contaminated white noise, as `allanite.fitting.tails` describes it."""

from __future__ import annotations

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result

__all__ = ["Contamination"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contamination(Result):
    """White noise of which some samples scatter more than the others.

    Attributes
    ----------
    share, share_sd : float
        Share of such samples, with its standard error.
    ratio, ratio_sd : float
        Ratio of their spread to that of the others, with its standard error.
    excess_kurtosis : float
        Excess kurtosis of the white noise.
    N, N_without : Quantity
        N of all samples, and without the contaminated ones.
    confidence : float
        Confidence level of the intervals.
    """

    share: float
    share_sd: float
    ratio: float
    ratio_sd: float
    excess_kurtosis: float
    N: Quantity
    N_without: Quantity
    confidence: float
