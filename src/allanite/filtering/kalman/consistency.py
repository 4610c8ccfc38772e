# SPDX-License-Identifier: BSD-3-Clause
"""Do the innovations of a filter have the size and the whiteness that its model says?

Notes
-----
Of a model that is right, the innovations e_k are independent with the variances S_k that the filter states. Two tests
follow, and both leave out missing samples:

    n NIS = sum of e_k^2/S_k is chi-square with n degrees of freedom [1, section 5.4]                          (1)
    Q = (n + 2)/n  sum over lags j of n_j r_j^2,  r_j = (sum of z_i z_{i+j})/n_j / (sum of z_i^2/n),
        z = e/sqrt(S), is chi-square with as many degrees of freedom as there are lags                         (2)

n_j is the number of pairs at lag j of which both samples are present. Without gaps (2) is the statistic of Ljung and
Box [2] about a mean of zero.

References
----------
.. [1] Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001.
.. [2] G. M. Ljung, G. E. P. Box, "On a measure of lack of fit in time series models", Biometrika 65 (1978) 297.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile, chi_square_tail
from allanite.quantities.probabilities import require_probabilities
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict, WordedCode

__all__ = ["LAGS", "Consistency", "ConsistencySums", "FilterVerdict", "WhitenessCause", "consistency"]

Array = NDArray[np.float64]

#: Lags of the test of whiteness.
LAGS = 20
#: A test speaks below this probability: one right model in a thousand is called wrong.
SMALL = 1e-3


class FilterVerdict(Verdict):
    """Does the noise model hold?"""

    FAILS = "the model does not hold", "the model does not hold", Tone.FATAL
    UNTESTED = "not tested", "not tested", Tone.WARNING
    HOLDS = "consistent", "consistent", Tone.GOOD


class WhitenessCause(WordedCode):
    """What correlations of innovations come from."""

    DRIFT = "drift", "the sensor drifts more than the model"
    SHARED = "shared noise", "samples share noise: the sensor's own filter, or a spectral line"
    COMPENSATION = (
        "compensation",
        "samples compensate one another: quantization, a spectral line, or too much drift in the model",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Consistency(Result):
    """What the innovations say of the model.

    Attributes
    ----------
    verdict : FilterVerdict
        "consistent", "not tested", or "the model does not hold": a probability is below 0.001.
    count : int
        Innovations tested.
    nis : float
        Time average of e^2/S; 1 for a model that is right.
    nis_lower, nis_upper : float
        Where `nis` lies with probability `confidence` if the model is right: chi-square with `count` degrees of
        freedom.
    nis_p : float
        Two-sided probability of a `nis` at least as far out.
    correlations : tuple of float
        Of the standardized innovations at lags 1, 2, ... samples; NaN where no pair is present.
    whiteness, whiteness_p : float
        Ljung-Box statistic over these lags and its probability; NaN below two innovations for each lag.
    confidence : float
        Of the interval of `nis`.
    lag : int or None [samples]
        At which the innovations correlate most; None where they are white, or nobody could tell.
    cause : WhitenessCause or None
        Where that comes from.
    """

    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    count: int
    nis: float
    nis_lower: float
    nis_upper: float
    nis_p: float
    correlations: tuple[float, ...]
    whiteness: float
    whiteness_p: float
    confidence: float
    lag: int | None = None
    cause: WhitenessCause | None = None

    @property
    def verdict(self) -> FilterVerdict:
        """One right model in a thousand is called wrong by each test."""
        if self.count == 0:
            return FilterVerdict.UNTESTED
        return FilterVerdict.FAILS if self.nis_p < SMALL or self.lag is not None else FilterVerdict.HOLDS

    @property
    def consistent(self) -> bool:
        """The model holds."""
        return self.verdict is FilterVerdict.HOLDS

    @property
    def reason(self) -> str:
        """What is wrong and by how much, or what was tested."""
        if self.count == 0:
            return "there is no innovation"
        faults = [self._size()] if self.nis_p < SMALL else []
        if self.lag is not None and self.cause is not None:
            chance = f"p = {self.whiteness_p:.1g}" if self.whiteness_p > 0 else "p below 1e-300"
            largest = f"correlation {self.correlations[self.lag - 1]:+.2g} at lag {self.lag} ({chance})"
            faults.append(f"the innovations are not white: {largest}; {self.cause.words}")
        if faults:
            return "; ".join(faults)
        if math.isnan(self.whiteness_p):
            return "in size; too few samples for a test of whiteness"
        return "the innovations have the size and the whiteness that the noise model predicts"

    def _size(self) -> str:
        larger = "larger" if self.nis > 1 else "smaller"
        return f"the noise is {larger} than the model predicts by {_ratio(math.sqrt(self.nis))}"

    def __repr__(self) -> str:
        return f"<Consistency of {self.count} innovations: {self.verdict}: {self.reason}>"


def consistency(innovations: ArrayLike, variances: ArrayLike, *, confidence: float = 0.95) -> Consistency:
    """Test innovations against the variances that the filter stated for them.

    Parameters
    ----------
    innovations, variances : array_like, shape (rows,)
        As `run_filter` gives them; rows without an innovation are NaN in either.
    confidence : float
        Of the interval of the time-average NIS.

    Raises
    ------
    InputError
        Arrays of different shapes, or a confidence that is not between 0 and 1.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> consistency(2 * rng.standard_normal(10_000), np.ones(10_000)).reason
    'the noise is larger than the model predicts by a factor 2 (standard deviation)'
    """
    e, s = (np.asarray(x, dtype=np.float64) for x in (innovations, variances))
    if e.ndim != 1 or e.shape != s.shape:
        raise InputError(
            f"innovations and variances must be rows of equal length, not {e.shape} and {s.shape}"
        )
    sums = ConsistencySums()
    sums.feed(e, s)
    return sums.result(confidence)


class ConsistencySums:
    """The sums of both tests, block by block: any chunking of a record gives the same result."""

    def __init__(self, lags: int = LAGS) -> None:
        self._last = np.zeros(0)
        self._products, self._pairs = np.zeros(lags), np.zeros(lags, dtype=np.int64)
        self._squares, self._count = 0.0, 0

    def feed(self, innovations: Array, variances: Array) -> None:
        """Take in the next rows; NaN where there is no innovation."""
        with np.errstate(invalid="ignore", divide="ignore"):
            z = innovations / np.sqrt(variances)
        self.feed_standardized(z, whole=bool(np.isfinite(z).all()))

    def feed_standardized(self, z: Array, *, whole: bool) -> None:
        """Take in e/sqrt(S) of the next rows; `whole`: none is missing."""
        joined, new, lags = np.concatenate([self._last, z]), len(self._last), len(self._products)
        whole = whole and bool(np.isfinite(self._last).all())
        present = np.ones(0, dtype=np.bool_) if whole else np.isfinite(joined)
        sums = np.empty(lags + 1)
        _kernels.lagged_products(joined if whole else np.where(present, joined, 0.0), new, sums)
        self._squares += float(sums[0])
        self._products += sums[1:]
        self._count += len(z) if whole else int(np.count_nonzero(present[new:]))
        for j in range(1, lags + 1):
            first = max(new, j)  # the later sample of a pair is new
            later, earlier = slice(first, None), slice(first - j, max(len(joined) - j, 0))
            pairs = len(joined) - first if whole else np.count_nonzero(present[later] & present[earlier])
            self._pairs[j - 1] += max(pairs, 0)
        self._last = joined[-lags:].copy()

    def result(self, confidence: float = 0.95) -> Consistency:
        """What the rows so far say.

        Raises
        ------
        InputError
            A confidence that is not between 0 and 1.
        """
        require_probabilities(confidence=confidence)
        n = self._count
        if n == 0:
            return _untested(confidence, len(self._products))
        nis = self._squares / n
        lower, upper = (chi_square_quantile((1 + sign * confidence) / 2, n) / n for sign in (-1, 1))
        above = chi_square_tail(self._squares, n)
        tail = min(1 - above, above)
        with np.errstate(invalid="ignore", divide="ignore"):
            r = self._products / self._pairs / nis
        statistic, p = math.nan, math.nan
        if n >= 2 * len(r) and np.isfinite(r).all():
            statistic = (n + 2) / n * float((self._pairs * r**2).sum())
            p = chi_square_tail(statistic, len(r))
        lag, cause = _correlated(r, self._pairs) if p < SMALL else (None, None)
        return Consistency(
            count=n,
            nis=nis,
            nis_lower=lower,
            nis_upper=upper,
            nis_p=min(2 * tail, 1.0),
            correlations=tuple(float(x) for x in r),
            whiteness=statistic,
            whiteness_p=p,
            confidence=confidence,
            lag=lag,
            cause=cause,
        )


def _untested(confidence: float, lags: int) -> Consistency:
    none = math.nan
    return Consistency(
        count=0,
        nis=none,
        nis_lower=none,
        nis_upper=none,
        nis_p=none,
        correlations=(none,) * lags,
        whiteness=none,
        whiteness_p=none,
        confidence=confidence,
    )


def _correlated(r: Array, pairs: NDArray[np.int64]) -> tuple[int, WhitenessCause]:
    """The lag of the largest correlation, and its cause: drift that is missing is at all lags, a filter at a few."""
    worst = int(np.argmax(np.abs(r) * np.sqrt(pairs)))
    far = slice(len(r) // 4, None)
    if float((r * pairs)[far].sum()) > 3 * math.sqrt(float(pairs[far].sum())):
        return worst + 1, WhitenessCause.DRIFT
    return worst + 1, WhitenessCause.SHARED if r[worst] > 0 else WhitenessCause.COMPENSATION


def _ratio(factor: float) -> str:
    if factor == 0:
        return "everything: all innovations are zero"
    ratio = max(factor, 1 / factor)
    if ratio >= 1.5:
        return f"a factor {ratio:.2g} (standard deviation)"
    return f"{100 * abs(factor - 1):.2g} % (standard deviation)"
