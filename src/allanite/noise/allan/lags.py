# SPDX-License-Identifier: BSD-3-Clause
"""Which lags a curve is computed at. A lag is a whole number of samples: it is returned exactly, or refused."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError, LimitError

__all__ = ["choose_lags", "octave_lags"]

Lags = NDArray[np.int64]

_ALL_AT_MOST = 100_000


def octave_lags(n_samples: int, window: int = 3) -> Lags:
    """m = 1, 2, 4, ... up to n_samples/window."""
    top = max(n_samples // window, 1)
    return np.array([1 << i for i in range(top.bit_length())], dtype=np.int64)


def choose_lags(
    taus: str | int | ArrayLike, n_samples: int, dt: float, longest: int, *, named_to: int | None = None
) -> Lags:
    """Lags in samples, ascending.

    Parameters
    ----------
    taus : "octave", "decade", "all", int or array_like [s]
        "decade" is 1, 2, 4 in every decade; an int is a count of lags per decade; an array holds the lags in seconds.
        The named grids end at a third of the record; an array may go up to `longest`.
    n_samples : int
    dt : float [s]
    longest : int
        The longest lag that leaves one term, in samples.
    named_to : int, optional
        Where the named grids end instead of a third of the record, in samples.

    Raises
    ------
    InputError
        An unknown grid, or lags that are not positive, not whole samples, doubled, or longer than the record supports.
    LimitError
        "all" for more than 300 000 samples.
    """
    top = min(max(n_samples // 3 if named_to is None else named_to, 1), longest)
    if isinstance(taus, str):
        return _named(taus, top)
    if isinstance(taus, (int, np.integer)) and not isinstance(taus, bool):
        return _per_decade(int(taus), top)
    return _given(taus, dt, longest)


def _named(name: str, top: int) -> Lags:
    if name == "octave":
        return octave_lags(top, window=1)
    if name == "decade":
        steps = np.array([k * 10**d for d in range(19) for k in (1, 2, 4)], dtype=np.int64)
        return steps[steps <= top]
    if name == "all":
        if top > _ALL_AT_MOST:
            raise LimitError(f"taus='all' would be {top} lags; use a count per decade, e.g. taus=50")
        return np.arange(1, top + 1, dtype=np.int64)
    raise InputError(
        f"taus must be 'octave', 'decade', 'all', a count per decade or an array of seconds, not {name!r}"
    )


def _per_decade(count: int, top: int) -> Lags:
    if not 1 <= count <= 10_000:
        raise InputError(f"a count of lags per decade must lie between 1 and 10000, not {count}")
    steps = int(np.floor(np.log10(top) * count + 1e-9))
    return np.unique(np.round(10 ** (np.arange(steps + 1) / count)).astype(np.int64))


def _given(taus: ArrayLike, dt: float, longest: int) -> Lags:
    try:
        tau = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(
            f"taus must be a grid name, a count per decade or numbers of seconds, not {taus!r}"
        ) from None
    if tau.ndim != 1 or tau.size == 0 or not np.all(np.isfinite(tau)) or np.any(tau <= 0):
        raise InputError(f"lags must be finite, positive seconds in one dimension; got {taus!r}")
    m = tau / dt
    whole = np.round(m)
    off = np.abs(m - whole) > np.minimum(1e-6 * np.maximum(whole, 1), 1e-3)
    if off.any() or np.any(whole < 1):
        bad = tau[off | (whole < 1)][0]
        near = max(round(bad / dt), 1) * dt
        raise InputError(
            f"lag {bad:.12g} s is not a whole number of samples (dt = {dt:g} s); the nearest is {near:.9g} s"
        )
    if np.any(whole > longest):
        raise InputError(
            f"lag {tau[whole > longest][0]:g} s is longer than the record supports; the longest is {longest * dt:.9g} s"
        )
    lags = np.sort(whole.astype(np.int64))
    if np.any(np.diff(lags) == 0):
        raise InputError(f"lag {lags[:-1][np.diff(lags) == 0][0] * dt:g} s is given twice")
    return lags
