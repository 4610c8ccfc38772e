# SPDX-License-Identifier: BSD-3-Clause
"""Lags of an Allan curve that a spectral line or the sensor's filter bends, and lags near them that it does not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.results import TOLERANCE, Spectrum

__all__ = ["Exclusion", "lags_to_exclude", "quiet_lags", "without_spans"]

Array = NDArray[np.float64]

#: Times that differ by less than this share are the same: they were read off a picture.
_CLOSE = 1e-6


class Exclusion(NamedTuple):
    """Lags that are not the noise model's.

    Attributes
    ----------
    excluded : ndarray of bool, shape (n_lags,)
    reasons : tuple of str
        Per lag; "" where it is kept.
    """

    excluded: NDArray[np.bool_]
    reasons: tuple[str, ...]


def lags_to_exclude(
    spectrum: Spectrum,
    tau: ArrayLike,
    *,
    avar: ArrayLike | None = None,
    edf: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
) -> Exclusion:
    """Lags of an Allan curve that a line or the band limit moves noticeably.

    Parameters
    ----------
    spectrum : Spectrum
    tau : array_like, shape (n_lags,) [s]
        Whole multiples of the sample interval.
    avar, edf : array_like, shape (n_lags,), optional
        Allan variance [SI^2] and its equivalent degrees of freedom; by default what the spectrum and the length of
        the record give.
    tolerance : float
        A lag is excluded when its variance is moved by more than `tolerance` of its standard deviation.

    Notes
    -----
    A line of amplitude A adds A^2 [sin^2(pi f tau)/(m sin(pi f Ts))]^2, the worst case within its width.
    """
    m = np.rint(np.asarray(tau, dtype=np.float64) / spectrum.dt)
    noise = tolerance * spectrum.deviation_of_variance(m, avar, edf)
    reasons = [""] * len(m)
    for i in np.flatnonzero(spectrum.filter_bend(m) > noise):
        reasons[i] = f"bent by the low-pass at {spectrum.corner:.3g} Hz"
    if spectrum.lines:
        added = np.array([_line_avar(line, m, spectrum.dt) for line in spectrum.lines])
        for i in np.flatnonzero(added.sum(axis=0) > noise):
            line = spectrum.lines[int(np.argmax(added[:, i]))]
            reasons[i] = reasons[i] or f"bent by the spectral line at {line.frequency:.4g} Hz"
    return Exclusion(np.array([bool(r) for r in reasons], dtype=bool), tuple(reasons))


def without_spans(exclusion: Exclusion, tau: ArrayLike, spans: Sequence[tuple[float, float]]) -> Exclusion:
    """The exclusion with the lags that somebody leaves out besides.

    Parameters
    ----------
    tau : array_like, shape (n_lags,) [s]
        Of the lags.
    spans : sequence of (float, float) [s]
        Averaging times from and to, both ends included.

    Raises
    ------
    InputError
        A span whose end lies before its beginning, or that is no pair of numbers.
    """
    times = np.asarray(tau, dtype=np.float64)
    out = np.zeros(times.shape, dtype=bool)
    for span in spans:
        if len(span) != 2 or not 0 <= span[0] <= span[1]:
            raise InputError(
                f"exclude: {tuple(span)} is not a span of averaging times: write (from, to) in seconds"
            )
        out |= (times >= span[0] * (1 - _CLOSE)) & (times <= span[1] * (1 + _CLOSE))
    reasons = [r or ("left out by hand" if o else "") for r, o in zip(exclusion.reasons, out, strict=True)]
    return Exclusion(exclusion.excluded | out, tuple(reasons))


def quiet_lags(spectrum: Spectrum, lags: ArrayLike, *, reach: float = 1.2) -> NDArray[np.int64]:
    """Lags near the given ones that the lines disturb least.

    A line has no part in averages over whole periods of it: a curve read there goes on through the line. Lags that
    no line reaches stay as they are.

    Parameters
    ----------
    spectrum : Spectrum
    lags : array_like of int, shape (n_lags,)
        Samples.
    reach : float
        A lag may be moved up or down by this factor.

    Returns
    -------
    ndarray of int64
        Ascending, without duplicates.
    """
    chosen = set()
    for lag in np.asarray(lags, dtype=np.int64).tolist():
        near = np.unique(np.rint(np.linspace(lag / reach, lag * reach, 401)).astype(np.int64))
        near = np.concatenate([[lag], near[near >= 1]])
        added = sum(
            (_line_avar(line, near.astype(np.float64), spectrum.dt) for line in spectrum.lines),
            np.zeros(len(near)),
        )
        moved = added / spectrum.deviation_of_variance(near)
        chosen.add(lag if moved[0] <= TOLERANCE else int(near[np.argmin(moved)]))
    return np.array(sorted(chosen), dtype=np.int64)


def _line_avar(line: SpectralLine, m: Array, dt: float) -> Array:
    cycles = line.frequency * m * dt
    off = np.abs(cycles % 1.0 - 0.5)  # from the frequency at which sin^2 is 1
    sine = np.cos(np.pi * np.maximum(off - line.width / 2 * m * dt, 0.0))
    return np.asarray(line.amplitude**2 * (sine**2 / (m * math.sin(math.pi * line.frequency * dt))) ** 2)
