# SPDX-License-Identifier: BSD-3-Clause
"""Maximum and rms time interval error of a clock's phase: what a window of a given length saw at most, and on average.

They are facts about one record, without degrees of freedom: no interval belongs to them. Nothing is removed from the
phase, so that an offset of frequency counts.

References
----------
.. [1] W. Riley, NIST SP 1065 (2008), sections 5.2.12 (TIE rms) and 5.2.13 (MTIE); ITU-T G.810.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.lags import choose_lags
from allanite.plain_files.counted import plural
from allanite.recording.records import Kind, Recording

__all__ = ["INTERVAL_ERRORS", "IntervalError", "interval_error"]

Array = NDArray[np.float64]

#: MTIE: greatest peak-to-peak of x in a window of m intervals. TIErms: root mean square of x(t + tau) - x(t).
INTERVAL_ERRORS = ("mtie", "tierms")


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalError:
    """Time interval error of one channel.

    Attributes
    ----------
    statistic : str
        mtie or tierms.
    name : str
        Of the channel.
    lags : ndarray of int64, shape (n_lags,)
    tau : ndarray, shape (n_lags,) [s]
    error : ndarray, shape (n_lags,) [s]
        NaN where no window is complete.
    count : ndarray of int64, shape (n_lags,)
        Complete windows.
    """

    statistic: str
    name: str
    lags: NDArray[np.int64]
    tau: Array
    error: Array
    count: NDArray[np.int64]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "statistic": self.statistic,
            "lags": self.lags.tolist(),
            "tau": self.tau.tolist(),
            "error": [v if np.isfinite(v) else None for v in self.error.tolist()],
            "count": self.count.tolist(),
        }


def interval_error(
    recording: Recording, *, statistic: str, taus: str | int | ArrayLike = "octave"
) -> tuple[IntervalError, ...]:
    """Time interval error of every clock channel of a recording, with gaps left out.

    Parameters
    ----------
    recording : Recording
        Record of phase or of fractional frequency.
    statistic : "mtie" or "tierms"
        Statistic to compute.
    taus : "octave", "decade", "all", int or array_like [s]
        Averaging times.

    Raises
    ------
    InputError
        Another statistic, channels that are no clock's, or lags that the record does not support.
    DataQualityError
        Fewer than three samples.
    """
    if statistic not in INTERVAL_ERRORS:
        raise InputError(f"statistic must be one of {', '.join(INTERVAL_ERRORS)}, not {statistic!r}")
    names = [c.name for c in recording.channels if c.kind in (Kind.PHASE, Kind.FREQUENCY)]
    if not names:
        raise InputError(
            f"{statistic} is that of a clock: read the log with --kind phase or --kind frequency (kind=)"
        )
    errors = []
    for name in names:
        x = _time_error(recording, name)
        if len(x) < 3:
            raise DataQualityError(
                f"channel {name!r} has {plural(len(x), 'sample')} of phase; at least 3 are needed"
            )
        lags = choose_lags(taus, len(x) - 1, recording.dt, len(x) - 1)
        both = [(_greatest if statistic == "mtie" else _rms)(x, int(m)) for m in lags]
        errors.append(
            IntervalError(
                statistic=statistic,
                name=name,
                lags=lags,
                tau=lags.astype(np.float64) * recording.dt,
                error=np.array([value for value, _ in both]),
                count=np.array([count for _, count in both], dtype=np.int64),
            )
        )
    return tuple(errors)


def _time_error(recording: Recording, name: str) -> Array:
    """x(t) [s], less its first value; of frequencies their running sum, NaN from the first gap on."""
    channel, values = recording[name], recording.values(name)
    if channel.kind is Kind.PHASE:
        return np.asarray((values - values[np.isfinite(values)][:1].sum()) * channel.scale)
    return np.asarray(np.concatenate(([0.0], np.cumsum(values))) * (channel.scale * recording.dt))


def _rms(x: Array, m: int) -> tuple[float, int]:
    steps = x[m:] - x[:-m]
    steps = steps[np.isfinite(steps)]
    return (float(np.sqrt(np.mean(steps**2))), len(steps)) if len(steps) else (float("nan"), 0)


def _greatest(x: Array, m: int) -> tuple[float, int]:
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    gap = ~np.isfinite(x)
    sums = np.concatenate(([0], np.cumsum(gap)))
    whole = sums[m + 1 :] == sums[: -m - 1]
    if not whole.any():
        return float("nan"), 0
    part = slice((m + 1) // 2, (m + 1) // 2 + len(x) - m)
    high = maximum_filter1d(np.where(gap, -np.inf, x), m + 1)[part]
    low = minimum_filter1d(np.where(gap, np.inf, x), m + 1)[part]
    return float((high - low)[whole].max()), int(whole.sum())
