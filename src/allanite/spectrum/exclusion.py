# SPDX-License-Identifier: BSD-3-Clause
"""Lags of an Allan curve that a spectral line or the sensor's filter bends, and lags near them that it does not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.spectrum.band_limit import short_lag_bend
from allanite.spectrum.lines import SpectralLine
from allanite.spectrum.results import Spectrum

__all__ = ["TOLERANCE", "Exclusion", "lags_to_exclude", "quiet_lags", "shortest_trusted_tau", "without_spans"]

Array = NDArray[np.float64]

#: A lag is bent when a line or the band limit moves its AVAR by this share of its own standard deviation.
TOLERANCE = 0.3
#: Times that differ by less than this share are the same: they were read off a picture.
_CLOSE = 1e-6


def shortest_trusted_tau(spectrum: Spectrum) -> float:
    """Averaging time [s] from which on the sensor's filter leaves the Allan variance alone; 0 without a filter."""
    if spectrum.band_limit is None:
        return 0.0
    m = np.unique(np.geomspace(1, max(spectrum.n_samples // 8, 2), 200).astype(int))
    bent = _filter_bend(spectrum, m) > TOLERANCE * _deviation(spectrum, m)
    last = int(np.flatnonzero(bent)[-1]) if bent.any() else -1
    return float(m[min(last + 1, len(m) - 1)] * spectrum.dt)


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
    noise = tolerance * _deviation(spectrum, m, avar, edf)
    reasons = [""] * len(m)
    for i in np.flatnonzero(_filter_bend(spectrum, m) > noise):
        reasons[i] = f"bent by the low-pass at {spectrum.corner:.3g} Hz"
    if spectrum.lines:
        added = np.array([_line_avar(line, m, spectrum.dt) for line in spectrum.lines])
        for i in np.flatnonzero(added.sum(axis=0) > noise):
            line = spectrum.lines[int(np.argmax(added[:, i]))]
            reasons[i] = reasons[i] or f"bent by the spectral line at {line.frequency:.4g} Hz"
    return Exclusion(np.array([bool(r) for r in reasons], dtype=bool), tuple(reasons))


def without_spans(found: Exclusion, tau: ArrayLike, spans: Sequence[tuple[float, float]]) -> Exclusion:
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
                f"exclude: {tuple(span)} is no span of averaging times: give (from, to) in seconds"
            )
        out |= (times >= span[0] * (1 - _CLOSE)) & (times <= span[1] * (1 + _CLOSE))
    reasons = [r or ("left out by hand" if o else "") for r, o in zip(found.reasons, out, strict=True)]
    return Exclusion(found.excluded | out, tuple(reasons))


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
        moved = added / _deviation(spectrum, near)
        chosen.add(lag if moved[0] <= TOLERANCE else int(near[np.argmin(moved)]))
    return np.array(sorted(chosen), dtype=np.int64)


def _line_avar(line: SpectralLine, m: Array, dt: float) -> Array:
    cycles = line.frequency * m * dt
    off = np.abs(cycles % 1.0 - 0.5)  # from the frequency at which sin^2 is 1
    sine = np.cos(np.pi * np.maximum(off - line.width / 2 * m * dt, 0.0))
    return np.asarray(line.amplitude**2 * (sine**2 / (m * math.sin(math.pi * line.frequency * dt))) ** 2)


def _filter_bend(spectrum: Spectrum, m: ArrayLike) -> Array:
    m = np.asarray(m, dtype=np.float64)
    if spectrum.band_limit is None:
        return np.zeros_like(m)
    return np.abs(
        short_lag_bend(spectrum.band_limit, spectrum.frequency, spectrum.background, m, spectrum.dt)
    )


def _deviation(
    spectrum: Spectrum, m: ArrayLike, avar: ArrayLike | None = None, edf: ArrayLike | None = None
) -> Array:
    """Standard deviation of the Allan variance at m samples."""
    m = np.asarray(m, dtype=np.float64)
    variance = _avar(spectrum, m) if avar is None else np.asarray(avar, dtype=np.float64)
    dof = np.maximum(np.minimum(0.67, 1.2 / m) * spectrum.n_samples, 1.0) if edf is None else np.asarray(edf)
    return np.asarray(variance * np.sqrt(2 / dof))


def _avar(spectrum: Spectrum, m: Array) -> Array:
    """Allan variance of the background: 4 * integral of S(f) [sin^2(pi f m Ts)/(m sin(pi f Ts))]^2 df over its bins."""
    f = spectrum.frequency
    if len(f) < 2:
        return np.zeros_like(m)
    edges = np.concatenate([[0.0], np.sqrt(f[1:] * f[:-1]), [0.5 / spectrum.dt]])
    width, turns = np.diff(edges), np.outer(m, f * spectrum.dt)
    blur = np.outer(m, np.diff(edges) * spectrum.dt)  # sin^4 averaged over each bin
    fourth = (
        3 / 8
        - np.cos(2 * np.pi * turns) * np.sinc(blur) / 2
        + np.cos(4 * np.pi * turns) * np.sinc(2 * blur) / 8
    )
    shape = fourth / (m[:, None] * np.sin(np.pi * f * spectrum.dt)) ** 2
    return np.asarray(4 * shape @ (spectrum.background * width))
