# SPDX-License-Identifier: BSD-3-Clause
"""Theo1 and its forms without bias: deviations up to three quarters of the record.

In a window of m samples (m even, 10 at least) with d = 1..m/2, the difference of the sums of its last d and of its
first d samples is

    z_d(i) = (x[i+m] - x[i+m-d]) - (x[i+d] - x[i]),

    Theo1(m)  = sum over the M = n - m + 1 windows and d of z_d(i)^2/d / (0.75 m^2 M),   tau = 0.75 m Ts,       (1)
    TheoBR(m) = Theo1(m) * mean over j = 0..J of AVAR(9 + 3 j)/Theo1(12 + 4 j),   J = (n + 1)/30 - 3,            (2)
    ThêoH     = AVAR up to a fifth of the record, TheoBR beyond.                                                (3)

Theo1 equals AVAR for white noise alone; (2) takes the ratio of the two from the record itself, where the
Allan variance is still sharp, and supposes that the noise does not change its kind beyond. `theo_covariance.theo1_bias`
has the exact ratio of a model.

A window costs m/2 terms. Long windows are therefore summed over every s-th start and every s-th d, s a 256th of the
window: Theo1 of block means. Its mean is the same for white noise, 0.2 % higher for flicker and random walk (a tenth
lower for white angle noise, which nobody looks for at such lags); its degrees of freedom differ by 0.3 %
(`engine="decimated"`). The memory is that of the phase.

References
----------
.. [1] D. Howe, T. Peppler, "Very long-term frequency stability: estimation using a special-purpose statistic", 2003.
.. [2] W. Riley, NIST SP 1065 (2008), sections 5.2.15 to 5.2.17.
.. [3] J. Taylor, D. Howe, "Fast TheoBR: a method for long data set stability analysis", IEEE Trans. UFFC 57, 2010.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.errors import DataQualityError, InputError
from allanite.noise.allan.lags import choose_lags
from allanite.noise.allan.statistics import (
    STATISTICS,
    Phase,
    Statistic,
    in_threads,
    processors,
    sums_of_squares,
    total_length,
)
from allanite.plain_files.counted import plural

__all__ = ["SHORTEST", "hybrid_lags", "ratio_lags", "sums_of_inner_squares", "theo_lags", "thinning"]

Array = NDArray[np.float64]
Lags = NDArray[np.int64]
Spans = NDArray[np.int64]

#: The shortest window of the published definition [samples].
SHORTEST = 10
_DEPTH = 128  # inner differences that a thinned window keeps at least
_WORK = 2_000_000_000  # terms of the exact sums above which "auto" thins: about half a second
_RATIOS = 200  # terms of (2) that are taken at most, evenly spread: they are strongly correlated


# -- lags ---------------------------------------------------------------------------------------------------------


def theo_lags(taus: str | int | ArrayLike, n_samples: int, dt: float) -> Lags:
    """Windows m [samples], even. Averaging times given in seconds are 0.75 m dt; a named grid ends with the record.

    Raises
    ------
    DataQualityError
        The record is shorter than the shortest window.
    InputError
        As `choose_lags`; a lag below 7.5 samples.
    """
    half = n_samples // 2
    if n_samples < SHORTEST:
        raise DataQualityError(
            f"the record has {plural(n_samples, 'sample')}; Theo1 needs at least {SHORTEST}"
        )
    if not isinstance(taus, (str, int, np.integer)):
        _check_steps(taus, half, dt)
        return 2 * choose_lags(taus, half, 1.5 * dt, half)
    lags = 2 * choose_lags(taus, half, 1.5 * dt, half, named_to=half)
    lags = lags[lags >= SHORTEST]
    return lags if len(lags) and lags[-1] > 1.6 * half else np.append(lags, 2 * half)


def _check_steps(taus: ArrayLike, half: int, dt: float) -> None:
    """Refuse averaging times that no even window has."""
    tau, step = np.atleast_1d(np.asarray(taus, dtype=np.float64)), 1.5 * dt
    whole = np.clip(np.rint(tau / step), SHORTEST // 2, half)
    off = np.isfinite(tau) & (np.abs(tau / step - whole) > 1e-3)
    if off.any():
        raise InputError(
            f"lag {tau[off][0]:.9g} s: Theo1 averages over 0.75 m samples, m even, here multiples of {step:.9g} s from "
            f"{SHORTEST // 2 * step:.9g} s to {half * step:.9g} s; the nearest is {whole[off][0] * step:.9g} s"
        )


def hybrid_lags(taus: str | int | ArrayLike, n_samples: int, dt: float) -> Lags:
    """Lags of ThêoH: m of the Allan variance up to a fifth of the record, windows of TheoBR beyond."""
    fifth = n_samples // 5
    if isinstance(taus, (str, int, np.integer)):
        short = choose_lags(taus, n_samples, dt, fifth, named_to=fifth)
        windows = theo_lags(taus, n_samples, dt)
        return np.concatenate((short, windows[(0.75 * windows > short[-1]) & (windows > fifth)]))
    seconds = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    near = seconds <= (fifth + 1e-3) * dt
    parts = [choose_lags(seconds[near], n_samples, dt, fifth)] if near.any() else []
    if not near.all():
        parts.append(theo_lags(seconds[~near], n_samples, dt))
    return np.concatenate(parts)


def ratio_lags(n_samples: int) -> Lags:
    """The j of (2), all or 200 of them.

    Raises
    ------
    DataQualityError
        Fewer than 89 samples: the sum is empty.
    """
    last = (n_samples + 1) // 30 - 3
    if last < 0:
        raise DataQualityError(
            f"the record has {n_samples} samples; the bias of Theo1 is known from 89 samples: use theo1 or oadev"
        )
    return np.unique(np.round(np.linspace(0, last, min(last + 1, _RATIOS))).astype(np.int64))


# -- sums ---------------------------------------------------------------------------------------------------------


def thinning(m: int) -> int:
    """Step s of the starts and of d in a window of m samples under the decimated engine."""
    return max(1, m // 2 // _DEPTH)


def is_heavy(lags: Lags, n_samples: int) -> bool:
    """Would the exact sums take long?"""
    return float(np.sum((n_samples - lags + 1.0) * lags / 2)) > _WORK


def sums_of_inner_squares(
    phase: Phase,
    statistic: Statistic,
    lags: Lags,
    threads: int | None = None,
    *,
    thinned: bool = False,
    progress: Callable[[float], None] | None = None,
) -> tuple[Array, Lags]:
    """Variance of Theo1, TheoBR or ThêoH at each lag, in the channel's own unit squared, and the number of windows.

    Parameters
    ----------
    lags : ndarray of int64, shape (n_lags,)
    threads : int, optional
        The digits do not depend on it.
    thinned : bool
        Long windows by every s-th start (decimated engine).

    Returns
    -------
    variance : ndarray, shape (n_lags,)
        NaN where no window is complete.
    count : ndarray of int64, shape (n_lags,)
    """
    variance, count = np.empty(len(lags)), np.empty(len(lags), dtype=np.int64)
    inner = np.array([statistic.at(int(m), phase.n_samples).theo for m in lags], dtype=bool)
    if not inner.all():
        plain = sums_of_squares(phase, STATISTICS["oadev"], lags[~inner], threads)
        variance[~inner], count[~inner] = plain
    if inner.any():
        part = _theo1(phase, lags[inner], threads, thinned, progress)
        factor = _ratio(phase, threads, thinned) if statistic.unbiased else 1.0
        variance[inner], count[inner] = part[0] * factor, part[1]
    return variance, count


def _theo1(
    phase: Phase,
    lags: Lags,
    threads: int | None,
    thinned: bool,
    progress: Callable[[float], None] | None = None,
) -> tuple[Array, Lags]:
    """Equation (1)."""
    variance, count = np.empty(len(lags)), np.empty(len(lags), dtype=np.int64)
    done = 0

    def task(i: int) -> None:
        nonlocal done
        m = int(lags[i])
        runs = phase.starts(STATISTICS["theo1"], m)
        variance[i] = _one_window(phase.x, m, runs, thinning(m) if thinned else 1)
        count[i] = total_length(runs)
        done += 1
        if progress is not None:
            progress(done / len(lags))

    in_threads(task, range(len(lags)), processors(threads))
    return variance, count


def _one_window(x: Array, m: int, runs: Spans, step: int) -> float:
    """Equation (1) over every step-th start and d; the weight of the missing d is given to the others."""
    depth = m // 2 // step
    runs = -(-runs // step)
    runs = np.ascontiguousarray(runs[runs[:, 1] > runs[:, 0]])
    windows = total_length(runs)
    if windows == 0:
        return float("nan")
    head, tail = np.ascontiguousarray(x[::step]), np.ascontiguousarray(x[m - step * depth :: step])
    sum_ = _kernels.theo_squares(head, tail, depth, runs)
    return sum_ * (m / 2 / (depth * step)) / (0.75 * m**2 * windows)


def _ratio(phase: Phase, threads: int | None, thinned: bool) -> float:
    """The mean ratio of (2), over the lags at which both have a complete window."""
    j = ratio_lags(phase.n_samples)
    allan, _ = sums_of_squares(phase, STATISTICS["oadev"], 9 + 3 * j, threads)
    theo, _ = _theo1(phase, 12 + 4 * j, threads, thinned or is_heavy(12 + 4 * j, phase.n_samples))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = allan / theo
    ratio = ratio[np.isfinite(ratio)]
    return float(ratio.mean()) if len(ratio) else float("nan")
