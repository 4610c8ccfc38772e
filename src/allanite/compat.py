# SPDX-License-Identifier: BSD-3-Clause
"""The functions of allantools: the same names, arguments and four values, with intervals, and without its silences.

    import allanite.compat as allantools

    taus, devs, errors, ns = allantools.oadev(y, rate=100.0, data_type="freq", taus="decade")

Deviations and counts are those of allantools to rounding (tested). What differs is said where it differs:

* ``data_type`` must be given. Rates taken for phase, its default, give numbers that mean nothing.
* NaN is refused, unless ``gaps=True`` says that it marks missing samples, which then cost only the terms they touch.
* Averaging times that are empty, not positive, not whole samples, given twice, or longer than the record are refused;
  allantools drops or moves them.
* ``errors`` are standard deviations of the estimates, from their equivalent degrees of freedom, in place of
  ``devs/sqrt(ns)``, which is too small by 2 to 34 times. The result has `lower` and `upper` besides, the ends of 95 %
  intervals, and `interval` for another confidence.

There are adev, oadev, mdev, tdev, hdev, ohdev, totdev and theo1. The others (mtotdev, ttotdev, htotdev, mtie, tierms,
pdev, gradev) are not here. `gradev` of a record with gaps is ``oadev(..., gaps=True)``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, InputError, LimitError
from allanite.noise.allan.curve import AllanCurve, allan_curve
from allanite.noise.allan.degrees import chi_square_factors
from allanite.noise.allan.statistics import STATISTICS, longest_lag
from allanite.noise.allan.theo import SHORTEST
from allanite.plain_files.counted import plural
from allanite.recording.checked_samples import checked_rate, checked_samples
from allanite.recording.records import OVERLOAD, Recording

__all__ = ["Deviations", "adev", "hdev", "mdev", "oadev", "ohdev", "tdev", "theo1", "totdev"]

Array = NDArray[np.float64]

_MOST_LAGS = 100_000
_CONFIDENCE = 0.95
_MANY = 30.0  # degrees of freedom from which on a series is better than logarithms that cancel


class _Four(NamedTuple):
    taus: Array
    devs: Array
    errors: Array
    ns: NDArray[np.int64]


class Deviations(_Four):
    """Four arrays to unpack, as from allantools, and what belongs to them.

    Attributes
    ----------
    taus : ndarray, shape (n_taus,) [s]
    devs : ndarray, shape (n_taus,)
        In the unit of the rates (tdev: of the phase).
    errors : ndarray, shape (n_taus,)
        Standard deviation of each estimate.
    ns : ndarray of int64, shape (n_taus,)
        Terms in each sum.
    curve : AllanCurve
        The same with everything else that is known.
    """

    curve: AllanCurve

    @classmethod
    def of(cls, curve: AllanCurve) -> Deviations:
        """The lags of a curve with at least two terms."""
        kept = np.flatnonzero(curve.count[:, 0] > 1)
        devs, edf = np.asarray(curve.deviation[kept, 0]), np.asarray(curve.edf[kept, 0])
        taus, ns = np.asarray(curve.tau[kept]), np.asarray(curve.count[kept, 0])
        if curve.statistic == "theo1":  # by the window, and counted by its inner differences
            taus = np.asarray(curve.lags[kept] * curve.dt, dtype=np.float64)
            ns = ns * (curve.lags[kept] // 2)
        made = cls(taus, devs, devs * _relative_sd(edf), ns)
        made.curve = curve
        return made

    @property
    def edf(self) -> Array:
        """Equivalent degrees of freedom, shape (n_taus,)."""
        return np.asarray(self.curve.edf[self.curve.count[:, 0] > 1, 0])

    @property
    def lower(self) -> Array:
        """Lower ends of the 95 % intervals, shape (n_taus,)."""
        return self.interval()[0]

    @property
    def upper(self) -> Array:
        """Upper ends of the 95 % intervals, shape (n_taus,)."""
        return self.interval()[1]

    def interval(self, confidence: float = _CONFIDENCE) -> tuple[Array, Array]:
        """Ends of the chi-square intervals at a confidence.

        Raises
        ------
        InputError
            A confidence outside (0, 1).
        """
        low, high = chi_square_factors(self.edf, confidence)
        return self.devs * low, self.devs * high


def _relative_sd(edf: Array) -> Array:
    """Standard deviation of the root of a chi-square variable over its degrees of freedom, over its mean.

    The mean is sqrt(2/n) G((n + 1)/2)/G(n/2). For large n the two logarithms would cancel; there it is their series,
    ln mean = -1/(4 n) + 1/(24 n^3) - 1/(20 n^5) + 17/(112 n^7) - ... [NIST DLMF 5.11.8].
    """
    from scipy.special import gammaln

    n = np.asarray(edf, dtype=np.float64)
    few, x = np.minimum(n, _MANY), 1 / np.maximum(n, _MANY)
    exact = np.log(2 / few) / 2 + gammaln((few + 1) / 2) - gammaln(few / 2)
    series = -x * (1 / 4 - x**2 * (1 / 24 - x**2 * (1 / 20 - x**2 * 17 / 112)))
    return np.asarray(np.sqrt(np.expm1(-2 * np.where(n < _MANY, exact, series))))


def adev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Allan deviation, from windows side by side; see `oadev` for the arguments."""
    return _deviations("adev", data, rate, data_type, taus, gaps)


def oadev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Overlapping Allan deviation: the one to use unless there is a reason.

    Parameters
    ----------
    data : array_like, shape (n_samples,)
        Rates (fractional frequency), or phase.
    rate : float [Hz]
        Samples per second.
    data_type : "freq" or "phase"
        What the samples are. It must be given.
    taus : array_like [s], or "octave", "decade", "log10", "all"
        Averaging times; octaves by default. The named grids end where two terms are left.
    gaps : bool
        NaN (and what is masked) marks missing samples. By default it is refused.

    Returns
    -------
    Deviations
        ``taus, devs, errors, ns``, with `lower`, `upper`, `edf` and `interval`.

    Raises
    ------
    InputError
        No data_type, or another word; data with several columns, complex or not numbers; averaging times that the
        record does not have.
    DataQualityError
        NaN without `gaps`, infinite samples, too few of them.
    LimitError
        "all" of more than 100 000 lags.

    Examples
    --------
    >>> y = [892, 809, 823, 798, 671, 644, 883, 903, 677]
    >>> found = oadev(y, data_type="freq", taus=[1, 2])
    >>> found.devs.round(4).tolist(), found.ns.tolist()
    ([91.2294, 85.9529], [8, 6])
    """
    return _deviations("oadev", data, rate, data_type, taus, gaps)


def mdev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Modified Allan deviation; see `oadev` for the arguments."""
    return _deviations("mdev", data, rate, data_type, taus, gaps)


def tdev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Time deviation: tau/sqrt(3) times `mdev`; see `oadev` for the arguments."""
    return _deviations("tdev", data, rate, data_type, taus, gaps)


def hdev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Hadamard deviation, from windows side by side; see `oadev` for the arguments."""
    return _deviations("hdev", data, rate, data_type, taus, gaps)


def ohdev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Overlapping Hadamard deviation; see `oadev` for the arguments."""
    return _deviations("ohdev", data, rate, data_type, taus, gaps)


def totdev(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Total deviation, which takes no gaps: it reflects the whole record; see `oadev` for the arguments."""
    return _deviations("totdev", data, rate, data_type, taus, gaps)


def theo1(
    data: ArrayLike, rate: float = 1.0, data_type: str | None = None, taus: str | ArrayLike | None = None,
    *, gaps: bool = False,
) -> Deviations:  # fmt: skip
    """Theo1, without the factor for its bias; see `oadev` for the arguments.

    As in allantools `taus` are the windows, an even number of samples; the averaging time is 0.75 of that
    (``curve.tau`` has it). The shortest window is that of the published definition, ten samples; the named grids leave
    out the one that is as long as the record, where one term is left.
    """
    return _deviations("theo1", data, rate, data_type, taus, gaps)


def _deviations(
    statistic: str,
    data: ArrayLike,
    rate: float,
    data_type: str | None,
    taus: str | ArrayLike | None,
    gaps: bool,
) -> Deviations:
    samples = _samples(data, gaps)
    recording = _recording(samples, checked_rate(rate), data_type)
    lags = _windows(recording, taus) if statistic == "theo1" else _averaging_times(statistic, recording, taus)
    return Deviations.of(allan_curve(recording, statistic=statistic, taus=lags, confidence=_CONFIDENCE))


def _samples(data: ArrayLike, gaps: bool) -> Array:
    """One column of finite samples, or NaN where that was announced."""
    array = checked_samples(data)
    if array.shape[1] != 1:
        raise InputError(f"data has {array.shape[1]} columns: give one at a time, data[:, 0]")
    samples = np.asarray(array[:, 0], dtype=np.float64)
    missing = np.isnan(samples)
    if missing.any() and not gaps:
        raise DataQualityError(
            f"{int(missing.sum())} of {len(samples)} samples are NaN, the first is number {int(missing.argmax())}: "
            "where they mark missing samples, say gaps=True"
        )
    large = np.abs(np.where(missing, 0.0, samples)) >= OVERLOAD
    if large.any():
        raise DataQualityError(
            f"sample number {int(large.argmax())} is {samples[large.argmax()]}: an overload or a division by zero; "
            "make it NaN and say gaps=True if it is to be left out"
        )
    return samples


def _recording(samples: Array, rate: float, data_type: str | None) -> Recording:
    """The samples as rates or angles; the unit is a stand-in whose factor is one."""
    if data_type == "freq":
        return Recording.from_rate(samples, rate=rate, unit="rad/s", names="data")
    if data_type == "phase":
        return Recording.from_angle(samples, rate=rate, unit="rad", names="data")
    if data_type is None:
        raise InputError(
            "say what the samples are: data_type='freq' for rates (a gyro, fractional frequency), data_type='phase' "
            "for their running integral (angle, clock phase). allantools takes rates for phase without a word"
        )
    raise InputError(f"data_type must be 'freq' or 'phase', not {data_type!r}")


def _averaging_times(statistic: str, recording: Recording, taus: str | ArrayLike | None) -> Array:
    """Lags of a named grid [s] that leave two terms; what was given as an array, as it is."""
    if taus is not None and not isinstance(taus, str):
        return _seconds(taus)
    n = recording.n_samples - int(recording.channels[0].kind.integrated)
    if n < 3:
        raise DataQualityError(
            f"{plural(recording.n_samples, 'sample')}: an Allan variance needs at least 3 rates"
        )
    chosen = STATISTICS[statistic]
    top = longest_lag(chosen, n)
    if (
        chosen.overlapping and not chosen.total
    ):  # the longest lag may have one term; the next shorter one has two
        top = max(n // 3 if chosen.modified else (n - 1) // chosen.order, 1)
    return _grid(taus or "octave", top, n + 1) * recording.dt


def _windows(recording: Recording, taus: str | ArrayLike | None) -> Array:
    """Averaging times of Theo1 [s] from its windows; those of a named grid that are even and long enough."""
    if taus is None or isinstance(taus, str):
        n = recording.n_samples - int(recording.channels[0].kind.integrated)
        m = _grid(taus or "octave", n - 1, n + 1)
        m = m[(m % 2 == 0) & (m >= SHORTEST)]
    else:
        m = _seconds(taus) * recording.rate
        if not np.all(np.abs(m / 2 - np.round(m / 2)) < 1e-6) or np.any(m < SHORTEST):
            raise InputError(
                f"a window of Theo1 is an even number of samples, {SHORTEST} at least: multiples of "
                f"{2 * recording.dt:.9g} s from {SHORTEST * recording.dt:.9g} s"
            )
    return np.asarray(0.75 * m * recording.dt)


def _seconds(taus: ArrayLike) -> Array:
    """Averaging times that were given as an array."""
    array = np.asarray(taus)
    if array.dtype.kind not in "iuf":
        raise InputError(f"taus must be the name of a grid or numbers of seconds, not {taus!r}")
    return np.asarray(array, dtype=np.float64)


def _grid(name: str, top: int, points: int) -> Array:
    """Lags 1 to `top` of a grid [samples] for a phase of so many points."""
    if name == "octave":
        lags = 2.0 ** np.arange(top.bit_length())
    elif name == "decade":
        lags = np.array([k * 10.0**d for d in range(len(str(top))) for k in (1, 2, 4)])
    elif name == "log10":
        lags = np.unique(np.round(np.geomspace(1, points, int(10 * np.log10(points)))))
    elif name == "all":
        if top > _MOST_LAGS:
            raise LimitError(f"taus='all' would be {top} lags; taus='log10' gives ten per decade")
        lags = np.arange(1.0, top + 1)
    else:
        raise InputError(f"taus must be 'octave', 'decade', 'log10', 'all' or seconds, not {name!r}")
    return np.asarray(lags[lags <= top])
