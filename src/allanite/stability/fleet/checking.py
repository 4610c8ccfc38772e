# SPDX-License-Identifier: BSD-3-Clause
"""Does a unit keep its limits? Pass, fail, or cannot tell, of each coefficient and in all.

The signed root S of the profile of a coefficient, at its limit L, says how far the log excludes L. With r the root of
the loss that a true value exceeds in 5 % of logs (1.960 for a normal estimate, more where other terms may be zero),

    pass:  S(ln L) >= r        the whole 95 % interval lies below the limit,
    fail:  S(ln L) <= -r_m     it lies above,

and anything between cannot be told. All coefficients must pass (an intersection of unions keeps the 5 %). One that
fails is enough, so that r_m is that of 5 % shared by the m coefficients (Bonferroni). A unit at a limit therefore
passes in at most 5 % of logs, and a unit that keeps all of them fails in at most 5 %: in 2.5 % where the errors of the
estimate are symmetric. They are not where a term at zero can only take from the coefficient, so that one side of the
interval may have all of the 5 %. A ramp that the log does not show is none of these terms: see `log_profiles`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import ClassVar, TypedDict

import numpy as np

from allanite.errors import DataQualityError, FitError
from allanite.fitting.advice import predicted_sd, record_length
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, NoiseModel, Quantisation, Ramp, RandomWalk, White
from allanite.noise.allan import AllanCurve
from allanite.noise.terms import TermType
from allanite.quantities.display_units import si_unit
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict
from allanite.stability.fleet.check_words import check_sentence
from allanite.stability.fleet.log_profiles import profiles_of
from allanite.stability.record_comparison.profiles import Profile
from allanite.stability.record_comparison.series import FittedChannel, record_of

__all__ = [
    "AcceptanceLimit",
    "CheckVerdict",
    "CoefficientCheck",
    "FleetCheck",
    "LimitSource",
    "check_unit",
    "judged",
]

_CONFIDENCE = 0.95  # of the interval
#: Standard deviations that decide in four of five logs.
_DECIDES = 1.960 + 0.842
_NORMAL = 3.841458820694124  # loss that a normal parameter exceeds in 5 %


class CheckVerdict(Verdict):
    """Does the unit keep its limits?"""

    FAIL = "fail", "fail", Tone.FATAL
    OPEN = "cannot tell", "cannot tell", Tone.WARNING
    PASS = "pass", "pass", Tone.GOOD


class LimitSource(StrEnum):
    """Where an acceptance limit comes from."""

    POPULATION = "population"
    DATASHEET = "data sheet"
    GIVEN = "given"


@dataclass(frozen=True, slots=True, kw_only=True)
class AcceptanceLimit(Result):
    """What a coefficient must not exceed.

    Attributes
    ----------
    channel, symbol : str
        The coefficient.
    value : float [SI]
        Greatest value that is accepted.
    source : LimitSource
        "population": the tolerance bound of a fleet; "data sheet"; or "given".
    """

    channel: str
    symbol: str
    value: float
    source: LimitSource


@dataclass(frozen=True, slots=True, kw_only=True)
class CoefficientCheck(Result):
    """A coefficient beside its limit.

    Attributes
    ----------
    kind : str
        What the channel measures.
    limit : AcceptanceLimit
        What it is held against.
    measured : Quantity
        With its 95 % interval.
    root : float
        S(ln L): standard deviations by which the limit lies above the coefficient.
    verdict : CheckVerdict
        "pass", "fail" or "cannot tell".
    duration : float or None [s]
        Length of record that decides in four of five logs, if the coefficient is what it is estimated to be (half the
        limit where there is no estimate). None where it is decided; infinite (null in a document) where none would.
    """

    kind: str
    limit: AcceptanceLimit
    measured: Quantity
    root: float
    verdict: CheckVerdict
    duration: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetCheck(Result):
    """A unit beside its limits.

    Attributes
    ----------
    coefficients : tuple of CoefficientCheck
        In the order of the limits.
    unfitted : tuple of str
        Channels with limits whose curve no sum of noise terms explains.
    unlimited : tuple of str
        Channels of the log without a limit: not checked.
    length : float [s]
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-fleet-check"
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    coefficients: tuple[CoefficientCheck, ...]
    unfitted: tuple[str, ...]
    unlimited: tuple[str, ...]
    length: float

    @property
    def verdict(self) -> CheckVerdict:
        """The worst of the coefficients; a channel without a fit leaves the whole open."""
        there = {c.verdict for c in self.coefficients} | ({CheckVerdict.OPEN} if self.unfitted else set())
        return next(v for v in CheckVerdict if v in there)

    @property
    def deciding(self) -> tuple[CoefficientCheck, ...]:
        """The coefficients with the verdict of the whole."""
        return tuple(c for c in self.coefficients if c.verdict is self.verdict)

    @property
    def duration(self) -> float | None:
        """Length of record that decides what is open [s]; None where nothing is."""
        open_ones = [c.duration for c in self.coefficients if c.duration is not None]
        return max(open_ones) if open_ones and self.verdict is CheckVerdict.OPEN else None

    @property
    def reason(self) -> str:
        """In a sentence."""
        names = [f"{c.limit.symbol} of {c.limit.channel}" for c in self.deciding]
        return check_sentence(self.verdict.value, names, len(self.coefficients), self.unfitted, self.duration)


def check_unit(curve: AllanCurve, limits: Sequence[AcceptanceLimit]) -> FleetCheck:
    """Hold the curve of a log against limits.

    Parameters
    ----------
    curve : AllanCurve
        Of all channels; oadev.
    limits : sequence of AcceptanceLimit
        Of channels of the curve; Q, N, B, K or R.

    Returns
    -------
    FleetCheck
    """
    record = record_of(curve, "log")
    made: dict[str, _FittedProfiles] = {}
    unfitted = []
    for channel in dict.fromkeys(limit.channel for limit in limits):
        try:
            series = record.series(channel)
            made[channel] = _FittedProfiles(series, profiles_of(series, _CONFIDENCE))
        except (DataQualityError, FitError):
            unfitted.append(channel)
    fitted = [limit for limit in limits if limit.channel in made]
    return FleetCheck(
        coefficients=tuple(_checked(made[limit.channel], limit, len(fitted)) for limit in fitted),
        unfitted=tuple(unfitted),
        unlimited=tuple(c for c in curve.names if c not in {limit.channel for limit in limits}),
        length=curve.n_samples * curve.dt,
    )


def judged(profile: Profile, limit: float, tests: int) -> tuple[CheckVerdict, float]:
    """Verdict and S(ln L) of a coefficient.

    Parameters
    ----------
    profile : Profile
        Its `critical` is for 95 %.
    limit : float
        L [SI].
    tests : int
        Coefficients that share the 5 % of a false failure.
    """
    from scipy.special import ndtri

    root = float(profile.root(np.array([math.log(limit)]))[0])
    edge = math.sqrt(max(profile.critical, _NORMAL))
    if root >= edge:
        return CheckVerdict.PASS, root
    tail = (1 - _CONFIDENCE) / 2
    shared = edge * float(ndtri(tail / tests) / ndtri(tail))
    return (CheckVerdict.FAIL if root <= -shared else CheckVerdict.OPEN), root


@dataclass(frozen=True, slots=True)
class _FittedProfiles:
    """A channel, and what it says of each coefficient."""

    series: FittedChannel
    profiles: Mapping[str, Profile]


def _checked(fitted: _FittedProfiles, limit: AcceptanceLimit, tests: int) -> CoefficientCheck:
    series, profile = fitted.series, fitted.profiles[limit.symbol]
    verdict, root = judged(profile, limit.value, tests)
    return CoefficientCheck(
        kind=series.kind.value,
        limit=limit,
        measured=_measured(profile, si_unit(series.kind.value, limit.symbol, series.unit)),
        root=root,
        verdict=verdict,
        duration=_duration(fitted, limit) if verdict is CheckVerdict.OPEN else None,
    )


def _measured(profile: Profile, unit: str) -> Quantity:
    low, high = (math.exp(end) for end in profile.interval)
    if low > 0:
        return Quantity.of(math.exp(profile.best), (low, high), unit)
    status = QuantityStatus.UPPER_LIMIT if math.isfinite(high) else QuantityStatus.NOT_RESOLVED
    return Quantity(value=math.nan, lower=0.0, upper=high, unit=unit, status=status)


_TERMS: Mapping[str, type[TermType]] = {
    "Q": Quantisation,
    "N": White,
    "B": Flicker,
    "K": RandomWalk,
    "R": Ramp,
}


def _duration(fitted: _FittedProfiles, limit: AcceptanceLimit) -> float:
    """Length of record [s] whose standard deviation tells the coefficient from its limit."""
    curve, profile = fitted.series.curve, fitted.profiles[limit.symbol]
    supposed = {s: math.exp(p.best) for s, p in fitted.profiles.items() if math.isfinite(p.best)}
    supposed.setdefault(limit.symbol, limit.value / 2)
    target = abs(math.log(limit.value / supposed[limit.symbol])) / _DECIDES
    if target <= 0:
        return math.inf
    model = NoiseModel.of(*(_TERMS[s](**{s: c}) for s, c in supposed.items()))
    design: _RecordShape = {
        "n_samples": curve.n_samples,
        "dt": curve.dt,
        "sampling": fitted.series.sampling,
    }
    if profile.supported:
        # Terms at zero may still grow, which the prediction does not know: wider now is wider then.
        predicted = predicted_sd(model, **design).get(limit.symbol, math.inf)
        target *= min(1.0, predicted / profile.sd)
    # This record does not decide it, whatever was expected.
    return max(record_length(model, limit.symbol, target, **design), 2 * curve.n_samples * curve.dt)


class _RecordShape(TypedDict):
    n_samples: int
    dt: float
    sampling: str
