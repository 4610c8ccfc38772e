# SPDX-License-Identifier: BSD-3-Clause
"""Whether what a file says about a curve can be one: text that parses may still hold no curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.noise.allan.statistics import STATISTICS

if TYPE_CHECKING:
    from allanite.noise.allan.curve import AllanCurve

__all__ = ["check_sound"]

_MOST_SAMPLES = 1 << 53
_SAME_TIME = 1e-6


def check_sound(curve: AllanCurve) -> None:
    """Raise if the parts of a curve cannot belong to one record.

    Raises
    ------
    ValueError
        Says which part, and what it must be.
    """
    n, m = curve.n_samples, curve.lags
    if not 0 < curve.confidence < 1:
        raise ValueError(f"confidence must lie between 0 and 1, not {curve.confidence!r}")
    if not 3 <= n <= _MOST_SAMPLES:
        raise ValueError(f"N must be a number of samples from 3 on, not {n}")
    if not 1e-12 <= curve.dt <= 1e9:
        raise ValueError(f"Ts must be seconds from 1e-12 to 1e9, not {curve.dt!r}")
    if curve.statistic not in STATISTICS:
        raise ValueError(f"unknown statistic {curve.statistic!r}")
    if not curve.channels or len(set(curve.names)) != len(curve.names):
        raise ValueError(f"channels must have names that differ, not {list(curve.names)}")
    if len(curve.missing) != len(curve.channels):
        raise ValueError(f"{len(curve.missing)} lists of missing runs for {len(curve.channels)} channels")
    for runs in curve.missing:
        ends = runs.ravel()
        if len(ends) and (
            ends[0] < 0 or ends[-1] > n or np.any(np.diff(ends) < 0) or np.any(runs[:, 0] >= runs[:, 1])
        ):
            raise ValueError(f"missing runs must be start, stop in order within {n} samples")
    if not len(m) or m[0] < 1 or np.any(np.diff(m) <= 0) or m[-1] > n:
        raise ValueError(f"lags m must rise from 1 on, up to {n} samples")
    expected = STATISTICS[curve.statistic].averaging(m, n) * curve.dt
    if not np.all(np.abs(curve.tau - expected) <= _SAME_TIME * expected):
        raise ValueError("tau must be the lag m times Ts")
    _check_values(curve)


def _check_values(curve: AllanCurve) -> None:
    for name in ("deviation", "lower", "upper", "edf"):
        values = getattr(curve, name)
        if np.any(values < 0) or (name != "upper" and np.any(np.isinf(values))):
            raise ValueError(f"{name} must be finite and not negative")
    if np.any(curve.lower > curve.upper) or np.any(curve.edf == 0):
        raise ValueError("the ends of an interval must be in order, and edf above zero")
    if np.any(curve.count < 0) or np.any(curve.count > curve.n_samples):
        raise ValueError(f"count must lie between 0 and {curve.n_samples}")
