# SPDX-License-Identifier: BSD-3-Clause
"""Samples and a rate as callers give them, checked: arrays of real numbers, and a number that may be a rate."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError

__all__ = ["checked_rate", "checked_samples"]

#: Rates that a recording may have [Hz]: from one sample in 30 years to a hundred times the fastest converters. Beyond
#: them a rate is a slip, and its powers leave the range of numbers.
RATES = (1e-9, 1e12)


def checked_rate(rate: object) -> float:
    """A sample rate as float [Hz].

    Raises
    ------
    InputError
        Not a number, not finite, or not positive; or outside of `RATES`, as that of no sensor.
    """
    if isinstance(rate, (bool, str, bytes)) or not isinstance(rate, (int, float, np.integer, np.floating)):
        raise InputError(f"rate must be a number of samples per second, not {rate!r}")
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"rate must be finite and positive [Hz], not {rate!r}")
    if not RATES[0] <= rate <= RATES[1]:
        raise InputError(
            f"rate must lie between {RATES[0]:g} and {RATES[1]:g} Hz, not {rate!r}: give it in samples per second"
        )
    return float(rate)


def checked_samples(samples: ArrayLike) -> NDArray[Any]:
    """Samples as a real array of shape (n_samples, n_channels); memory maps and integers stay as they are.

    Raises
    ------
    InputError
        Boolean, complex, object or text samples; no or more than two axes; more channels than samples.
    """
    if isinstance(samples, np.ma.MaskedArray):
        samples = np.ma.filled(samples.astype(np.float64), np.nan)
    array = samples if isinstance(samples, np.ndarray) else _from_sequence(samples)
    if array.dtype.kind not in "iuf":
        raise InputError(f"samples must be real numbers; got dtype {array.dtype} with shape {array.shape}")
    if array.ndim not in (1, 2):
        raise InputError(
            f"samples must have shape (n_samples,) or (n_samples, n_channels); got {array.shape}"
        )
    array = array[:, None] if array.ndim == 1 else array
    if array.shape[1] == 0 or array.shape[1] > max(array.shape[0], 1):
        raise InputError(
            f"samples of shape {array.shape}: time runs along the first axis, so this is {array.shape[1]} channels of "
            f"{array.shape[0]} samples; transpose it if this is unintended"
        )
    return array


def _from_sequence(samples: ArrayLike) -> NDArray[Any]:
    try:
        return np.asarray(samples)
    except (ValueError, OverflowError, TypeError) as error:
        raise InputError(f"samples cannot be read as an array of numbers: {error}") from None
