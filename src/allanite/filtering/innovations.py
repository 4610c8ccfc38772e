# SPDX-License-Identifier: BSD-3-Clause
"""Innovations of any filter: are they as large as it states, and which of its numbers is wrong?

Notes
-----
A filter whitens what it measures by its own model. So in the steady state the density of the standardized innovations
z = e/sqrt(S) is that of the measurement over that which the filter assumes, at every frequency:

    S_z(f) rate = S_true(f)/S_filter(f),                                                                        (1)

and 1 for a filter that is right. For a bias that walks by K^2 per second, measured with white noise N^2,

    S_z(f) rate = (K_true^2 + N_true^2 w^2)/(K^2 + N^2 w^2),    w = 2 rate sin(pi f/rate).                      (2)

At the highest frequencies this is the ratio of the noises, at the lowest that of the walks: the root of the first is
the factor of N, that of the second the factor of K. A low frequency that is not low enough shows a part of it only: the
factors are fitted to all frequencies (`allanite.filtering.wrong_factors`).

References
----------
.. [1] R. K. Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE Trans. Autom. Control 15
   (1970) 175.
.. [2] Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001,
   section 5.4.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.filtering.kalman.consistency import Consistency, consistency
from allanite.filtering.wrong_factors import wrong_factors
from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.bands import PER_DECADE, MeanDensity, band_edges, band_of, level, widths
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.results import Spectrum
from allanite.plain_files.counted import plural
from allanite.quantities.distributions import chi_square_quantiles, chi_square_tails
from allanite.quantities.number_words import number
from allanite.quantities.probabilities import require_probabilities
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict, WordedCode
from allanite.recording.records import Recording

__all__ = ["InnovationAxis", "Innovations", "InnovationsVerdict", "WrongNumber", "examine_innovations"]

Array = NDArray[np.float64]

#: Innovations of fewer than this do not show even a factor of two in their variance.
_FEWEST = 30
#: One right filter in a thousand is called wrong by each test.
SMALL = 1e-3
#: Degrees of freedom of the lowest frequencies together, at least.
ENOUGH = 24.0
#: Departure of one end, in the logarithm of the density, that a wrong number of the other end may leave there.
LEAK = 0.2
#: Windows of the series at most, and innovations of each at least.
WINDOWS, FEWEST = 100, 10


class InnovationsVerdict(Verdict):
    """Does the filter state the size of its innovations?"""

    FAILS = "fails", "the filter's noise does not hold", Tone.WARNING
    UNTESTED = "not tested", "not tested", Tone.WARNING
    HOLDS = "consistent", "consistent", Tone.GOOD


class WrongNumber(WordedCode):
    """Which number of a filter is wrong."""

    NOISE_SMALL = "noise too small", "the measurement noise (N) is too small"
    NOISE_LARGE = "noise too large", "the measurement noise (N) is too large"
    DRIFT_SMALL = "drift too small", "the drift (K, the walk of the bias) is too small"
    DRIFT_LARGE = "drift too large", "the drift (K, the walk of the bias) is too large"


@dataclass(frozen=True, slots=True, kw_only=True)
class InnovationBand(Result):
    """One band of frequency.

    Attributes
    ----------
    lower, upper : float [Hz]
        Ends of the band.
    ratio : Quantity
        Size of the innovations in the band over that stated: 1 for a filter whose numbers are right.
    """

    lower: float
    upper: float
    ratio: Quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class NisSeries(Result):
    """Mean of e'S^-1 e over its dimension in windows of time.

    Attributes
    ----------
    start, stop : ndarray, shape (n_windows,) [s]
        Ends of each window since the first innovation.
    nis : ndarray, shape (n_windows,)
        Mean in each window; NaN where it has no innovation.
    lower, upper : ndarray, shape (n_windows,)
        Where `nis` lies with the probability of the intervals if the filter is right: chi-square.
    """

    start: Array = field(repr=False)
    stop: Array = field(repr=False)
    nis: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)

    @property
    def outside(self) -> int:
        """Windows whose `nis` lies outside."""
        return int(np.sum((self.nis < self.lower) | (self.nis > self.upper)))


@dataclass(frozen=True, slots=True, kw_only=True)
class InnovationAxis(Result):
    """One axis of the innovations.

    Attributes
    ----------
    name : str
        Name of the column.
    consistency : Consistency
        Size and whiteness.
    fast, slow : Quantity
        Size over that stated at the highest and at the lowest frequencies; not resolved of a short log.
    fast_above, slow_below : float [Hz]
        Where the highest frequencies begin, and the lowest end.
    noise_factor, drift_factor : Quantity
        By what N and K of the filter are to be multiplied, fitted to all frequencies; an end is NaN where the
        innovations set no limit.
    misfits : tuple of WrongNumber
        Numbers of the filter that are wrong.
    bands : tuple of InnovationBand
        From low to high frequencies.
    """

    STATED: ClassVar[tuple[str, ...]] = ("verdict", "reason")

    name: str
    consistency: Consistency
    fast: Quantity
    fast_above: float
    slow: Quantity
    slow_below: float
    noise_factor: Quantity
    drift_factor: Quantity
    misfits: tuple[WrongNumber, ...]
    bands: tuple[InnovationBand, ...] = field(repr=False)

    @property
    def verdict(self) -> InnovationsVerdict:
        """Whether any number of the filter is wrong."""
        if self.consistency.count and (self.misfits or not self.consistency.consistent):
            return InnovationsVerdict.FAILS
        return InnovationsVerdict.HOLDS if self.consistency.count >= _FEWEST else InnovationsVerdict.UNTESTED

    @property
    def reason(self) -> str:
        """Which number is wrong and by how much, or what was tested."""
        if self.consistency.count and self.verdict is InnovationsVerdict.UNTESTED:
            return f"{self.name}: {plural(self.consistency.count, 'innovation')} of the {_FEWEST} that a test needs"
        if not self.misfits:
            return f"{self.name}: {self.consistency.reason}"
        return _misfit_sentence(self.name, self.misfits, self.noise_factor, self.drift_factor)


@dataclass(frozen=True, slots=True, kw_only=True)
class Innovations(Result):
    """Innovations of a filter over those that it states.

    Attributes
    ----------
    verdict : InnovationsVerdict
        The worst of the axes.
    axes : tuple of InnovationAxis
        Axis by axis; of a full covariance the standardized innovations in the order of their columns.
    series : NisSeries
        Size of all axes together over time.
    rate : float [Hz]
        Innovations per second.
    duration : float [s]
        From the first innovation to the end of the last.
    confidence : float
        Level of the intervals.
    source : str
        Of the log.
    """

    FORMAT: ClassVar[str] = "allanite-innovations"
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    axes: tuple[InnovationAxis, ...]
    series: NisSeries
    rate: float
    duration: float
    confidence: float
    source: str = ""

    @property
    def verdict(self) -> InnovationsVerdict:
        """The worst of the axes."""
        verdicts = {axis.verdict for axis in self.axes}
        return next(v for v in InnovationsVerdict if v in verdicts)

    @property
    def reason(self) -> str:
        """What the verdict rests on, axis by axis."""
        return "; ".join(axis.reason for axis in self.axes if axis.verdict is self.verdict)


_OF_NOISE = (WrongNumber.NOISE_SMALL, WrongNumber.NOISE_LARGE)


def _misfit_sentence(name: str, misfits: Sequence[WrongNumber], noise: Quantity, drift: Quantity) -> str:
    """Numbers that are wrong, each by its factor."""
    parts = [f"{m.words}: {_factor(noise if m in _OF_NOISE else drift)}" for m in misfits]
    return f"{name}: {'; '.join(parts)}"


def _factor(factor: Quantity) -> str:
    """What the number is to be multiplied by; a limit where the innovations set no more."""
    if factor.resolved:
        return f"times {number(factor.value)} [{number(factor.lower)}, {number(factor.upper)}]"
    if math.isfinite(factor.lower):
        return f"times at least {number(factor.lower)}"
    if math.isfinite(factor.upper):
        return f"times at most {number(factor.upper)}"
    return "by a factor that needs a longer log"


def examine_innovations(
    innovations: ArrayLike,
    variances: ArrayLike,
    *,
    rate: float,
    names: Sequence[str] | None = None,
    confidence: float = 0.95,
    source: str = "",
) -> Innovations:
    """Does a filter state the size of its innovations, and if not, which of its numbers is wrong?

    Parameters
    ----------
    innovations : array_like, shape (n,) or (n, n_axes)
        Measured less predicted, at even times; NaN where there is none.
    variances : array_like, shape (n,), (n, n_axes) or (n, n_axes, n_axes)
        Variances, or covariances, that the filter stated for them.
    rate : float [Hz]
        Innovations per second.
    names : sequence of str, optional
        Names of the axes.
    confidence : float
        Level of the intervals.
    source : str
        Name of the log.

    Raises
    ------
    InputError
        Arrays that do not belong together, a covariance that is none, or numbers that make no sense.
    """
    e, s = np.asarray(innovations, dtype=np.float64), np.asarray(variances, dtype=np.float64)
    e = e[:, None] if e.ndim == 1 else e
    s = s[:, None] if s.ndim == 1 else s
    _refuse(e, s, rate, confidence)
    z = _standardized(e, s)
    labels = [*names] if names is not None else [f"axis {i + 1}" for i in range(z.shape[1])]
    if len(labels) != z.shape[1]:
        raise InputError(f"{len(labels)} names for {z.shape[1]} axes")
    axes = tuple(_axis(name, z[:, i], rate, confidence) for i, name in enumerate(labels))
    return Innovations(
        axes=axes,
        series=_series(z, rate, confidence),
        rate=rate,
        duration=len(z) / rate,
        confidence=confidence,
        source=source,
    )


def _refuse(e: Array, s: Array, rate: float, confidence: float) -> None:
    if e.ndim != 2 or s.shape not in (e.shape, (*e.shape, e.shape[1])):
        raise InputError(
            f"innovations of shape {e.shape} need variances of the same shape, or covariances of shape (rows, axes, "
            f"axes), not {s.shape}"
        )
    if isinstance(rate, bool) or not (isinstance(rate, (int, float)) and math.isfinite(rate) and rate > 0):
        raise InputError(f"rate must be a positive number of innovations per second, not {rate!r}")
    require_probabilities(confidence=confidence)


def _standardized(e: Array, s: Array) -> Array:
    """Innovations of covariance 1 for a filter that is right; NaN where one is missing."""
    present = np.isfinite(e).all(axis=1) & np.isfinite(s).reshape(len(s), -1).all(axis=1)
    z = np.full_like(e, np.nan)
    if s.ndim == 2:
        if (wrong := present & (s <= 0).any(axis=1)).any():
            raise InputError(f"the variance of row {int(np.argmax(wrong))} is not positive")
        z[present] = e[present] / np.sqrt(s[present])
        return z
    try:
        root = np.linalg.cholesky(s[present])
    except np.linalg.LinAlgError:
        raise InputError("a covariance of the innovations is not positive definite") from None
    z[present] = np.linalg.solve(root, e[present][:, :, None])[:, :, 0]
    return z


def _axis(name: str, z: Array, rate: float, confidence: float) -> InnovationAxis:
    tests = consistency(z, np.where(np.isfinite(z), 1.0, np.nan), confidence=confidence)
    recording = Recording.from_rate(z, rate=rate, unit="unknown", names=[name], sampling="point")
    spectrum = power_spectrum(recording, name)
    fast, slow = _ends(spectrum)
    factors = wrong_factors(z, confidence)
    return InnovationAxis(
        name=name,
        consistency=tests,
        fast=_ratio(fast.density, confidence),
        fast_above=fast.frequency,
        slow=_ratio(slow.density, confidence),
        slow_below=slow.frequency,
        noise_factor=factors.noise,
        drift_factor=factors.drift,
        misfits=tuple(_misfits(fast.density, slow.density)),
        bands=tuple(_bands(spectrum, confidence)),
    )


@dataclass(frozen=True, slots=True)
class _End:
    """The density at one end of a spectrum, and the frequency [Hz] at which that end begins."""

    density: MeanDensity | None = None
    frequency: float = math.nan


def _level(spectrum: Spectrum, points: NDArray[np.bool_]) -> MeanDensity | None:
    """Mean of (1) over some points."""
    return level(spectrum, points, np.full(len(points), spectrum.dt), widths(spectrum))


def _ends(spectrum: Spectrum) -> tuple[_End, _End]:
    """The highest third of a decade, and as many of the lowest points as `ENOUGH` takes; none of a short log."""
    frequency, split = spectrum.frequency, 0.5 / spectrum.dt / 10 ** (1 / PER_DECADE)
    if not len(frequency):
        return _End(), _End()
    fast = _End(_level(spectrum, frequency > split), split)
    for count in range(1, int((frequency < split).sum()) + 1):
        slow = _level(spectrum, np.arange(len(frequency)) < count)
        if slow is not None and slow.dof >= ENOUGH:
            return fast, _End(slow, float(spectrum.bins[count - 1, 1] * spectrum.resolution[count - 1]))
    return fast, _End()


def _ratio(density: MeanDensity | None, confidence: float) -> Quantity:
    if density is None:
        return Quantity.of(math.nan, (0.0, math.inf), "1")
    lower, upper = density.interval(confidence)
    return Quantity.of(math.sqrt(density.value), (math.sqrt(lower), math.sqrt(upper)), "1")


def _misfits(fast: MeanDensity | None, slow: MeanDensity | None) -> Iterator[WrongNumber]:
    """Numbers that are wrong: each end of the spectrum speaks of its own, where it is not a `LEAK` of the other."""
    of_ends = (
        (fast, slow, WrongNumber.NOISE_SMALL, WrongNumber.NOISE_LARGE),
        (slow, fast, WrongNumber.DRIFT_SMALL, WrongNumber.DRIFT_LARGE),
    )
    for density, other, small, large in of_ends:
        if density is None or (other is not None and _leaks(other, density)):
            continue
        less, more = chi_square_tails(density.value * density.dof, density.dof)
        if 2 * min(less, more) < SMALL:
            yield small if more < less else large


def _leaks(other: MeanDensity, density: MeanDensity) -> bool:
    """Whether the departure of the other end explains a small one of the same sign: between them (1) is monotone."""
    ratio = math.log(max(density.value, 1e-300)) / (math.log(max(other.value, 1e-300)) or math.inf)
    return 0 < ratio < LEAK


def _bands(spectrum: Spectrum, confidence: float) -> Iterator[InnovationBand]:
    band = band_of(spectrum.frequency)
    for i in sorted(set(band.tolist())):
        lower, upper = band_edges(i)
        yield InnovationBand(
            lower=lower,
            upper=min(upper, 0.5 / spectrum.dt),
            ratio=_ratio(_level(spectrum, band == i), confidence),
        )


def _series(z: Array, rate: float, confidence: float) -> NisSeries:
    """Windows of equal length."""
    count = max(min(WINDOWS, len(z) // FEWEST), 1)
    ends = np.linspace(0, len(z), count + 1).astype(int)
    squares = np.add.reduceat(np.nan_to_num(z**2).sum(axis=1), ends[:-1])
    dof = np.add.reduceat(np.isfinite(z).sum(axis=1), ends[:-1]).astype(np.float64)
    tail = (1 - confidence) / 2
    with np.errstate(invalid="ignore", divide="ignore"):
        return NisSeries(
            start=ends[:-1] / rate,
            stop=ends[1:] / rate,
            nis=squares / dof,
            lower=chi_square_quantiles(tail, np.maximum(dof, 1.0)) / dof,
            upper=chi_square_quantiles(tail, np.maximum(dof, 1.0), upper=True) / dof,
        )
