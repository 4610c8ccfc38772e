# SPDX-License-Identifier: BSD-3-Clause
"""Whether what a file says about a curve can be one: text that parses may still hold no curve.

Every check raises ValueError, which says which part is wrong, and what it must be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.noise.allan.statistics import STATISTICS

__all__ = ["check_channels", "check_lags", "check_record", "check_values"]

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

_MOST_SAMPLES = 1 << 53
_SAME_TIME = 1e-6


def check_record(statistic: str, confidence: float, n: int, dt: float) -> None:
    """Raise if no record of n samples has a curve of such a kind."""
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must lie between 0 and 1, not {confidence!r}")
    if not 3 <= n <= _MOST_SAMPLES:
        raise ValueError(f"N must be a number of samples from 3 on, not {n}")
    if not 1e-12 <= dt <= 1e9:
        raise ValueError(f"Ts must be seconds from 1e-12 to 1e9, not {dt!r}")
    if statistic not in STATISTICS:
        raise ValueError(f"unknown statistic {statistic!r}")


def check_channels(names: Sequence[str], missing: Sequence[Whole], n: int) -> None:
    """Raise if channels cannot be told apart, or lack other samples than a record of n has."""
    if not names or len(set(names)) != len(names):
        raise ValueError(f"channels must have names that differ, not {list(names)}")
    if len(missing) != len(names):
        raise ValueError(f"{len(missing)} lists of missing runs for {len(names)} channels")
    for runs in missing:
        ends = runs.ravel()
        if len(ends) and (
            ends[0] < 0 or ends[-1] > n or np.any(np.diff(ends) < 0) or np.any(runs[:, 0] >= runs[:, 1])
        ):
            raise ValueError(f"missing runs must be start, stop in order within {n} samples")


def check_lags(statistic: str, m: Whole, tau: Array, n: int, dt: float) -> None:
    """Raise if a record of n samples has no such lags, or averaging times that are not theirs."""
    if not len(m) or m[0] < 1 or np.any(np.diff(m) <= 0) or m[-1] > n:
        raise ValueError(f"lags m must rise from 1 on, up to {n} samples")
    expected = STATISTICS[statistic].averaging(m, n) * dt
    if not np.all(np.abs(tau - expected) <= _SAME_TIME * expected):
        raise ValueError("tau must be the lag m times Ts")


def check_values(columns: Mapping[str, Array], count: Whole, n: int) -> None:
    """Raise if deviation, lower, upper and edf, or the terms behind them, are not those of a curve."""
    for name, values in columns.items():
        if np.any(values < 0) or (name != "upper" and np.any(np.isinf(values))):
            raise ValueError(f"{name} must be finite and not negative")
    if np.any(columns["lower"] > columns["upper"]) or np.any(columns["edf"] == 0):
        raise ValueError("the ends of an interval must be in order, and edf above zero")
    if np.any(count < 0) or np.any(count > n):
        raise ValueError(f"count must lie between 0 and {n}")
