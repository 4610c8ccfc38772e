# SPDX-License-Identifier: BSD-3-Clause
"""What the environment does to a sensor, and what the record cannot tell of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.result import Result
from allanite.recording.records import Recording
from allanite.stability.environment.climate import Thermometer
from allanite.stability.environment.correction import LEAST, Correction
from allanite.stability.environment.effect import Effect
from allanite.stability.environment.verdict import (
    CoefficientCause,
    EnvironmentVerdict,
    HysteresisStatus,
    LagStatus,
)
from allanite.stability.environment.words import (
    COME_BACK,
    NOTHING_REMOVED,
    attenuation_sentence,
    interpolation_sentence,
    lag_sentence,
    left_in_sentence,
    longest_sentence,
    settling_sentence,
    size_words,
)

__all__ = [
    "Coefficient",
    "Environment",
    "EnvironmentEstimate",
    "EnvironmentFacts",
    "EnvironmentSeries",
    "FreedRecording",
    "Hysteresis",
    "Lag",
    "WarmUp",
    "WarmUpTerm",
]

Array = NDArray[np.float64]
#: An attenuation from here on is reported.
_NOTABLE = 0.02
Action = Literal["modelled", "cut", "left in", "none found", "not looked for"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient(Result):
    """One coefficient of the bias.

    Attributes
    ----------
    name : str
        "temperature" [SI/K], "temperature squared" [SI/K^2], "rate of temperature" [SI s/K]; of a column that is no
        temperature per `Thermometer.si` in place of the kelvin.
    value, sd : float or None
        Estimate and its standard deviation; None if the record does not determine it.
    lower, upper : float or None
        Ends of the interval.
    p : float or None
        Two-sided p value for a coefficient of zero.
    status : str
        "resolved", the interval excludes zero; "not resolved", the interval includes it; or "not separable", the column
        is a combination of others.
    limit : float or None
        Largest size within the interval, for a coefficient that is not resolved.
    cause : CoefficientCause or None
        Why it is not separable: "constant", "straight", "collinear" or "drift".
    """

    name: str
    value: float | None
    sd: float | None
    lower: float | None
    upper: float | None
    p: float | None
    status: Literal["resolved", "not resolved", "not separable"]
    limit: float | None = None
    cause: CoefficientCause | None = None

    @property
    def note(self) -> str:
        """What a reader must know besides."""
        return "" if self.cause is None else self.cause.words


@dataclass(frozen=True, slots=True, kw_only=True)
class Lag(Result):
    """How far the thermometer follows behind the sensor [s]; negative: before it.

    Attributes
    ----------
    status : LagStatus
        "resolved", "no lag seen"; "collinear": the rate of temperature change cannot be separated from the temperature;
        or "too small": the effect of the temperature is.
    value, lower, upper : float or None [s]
        Lag and its interval by Fieller's theorem.
    """

    status: LagStatus
    value: float | None
    lower: float | None
    upper: float | None

    @property
    def says(self) -> str:
        """The answer, in words."""
        return lag_sentence(self.status, self.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hysteresis(Result):
    """The branch of warming against that of cooling.

    Attributes
    ----------
    status : HysteresisStatus
        "found" or "not found"; not tested where the temperature went "one way", its branches have "little in common",
        or are "collinear" with it and its rate.
    gap, lower, upper : float or None [SI]
        Signal when warming less signal when cooling, at one temperature.
    p : float or None
        p value of the gap if there is no hysteresis.
    """

    status: HysteresisStatus
    gap: float | None
    lower: float | None
    upper: float | None
    p: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUpTerm(Result):
    """One exponential.

    Attributes
    ----------
    amplitude, amplitude_sd : float [SI]
        Amplitude at the first sample, with its standard deviation.
    T, T_sd : float [s]
        Time constant, with its standard deviation.
    """

    amplitude: float
    amplitude_sd: float
    T: float
    T_sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp(Result):
    """Whether the sensor warmed up, and what was done about it.

    Attributes
    ----------
    found : bool
        The sensor warmed up.
    p : float or None
        Probability of the best exponential under noise alone, multiplied by the number that was tried.
    tries : int
        Number of tries.
    terms : tuple of WarmUpTerm
        Exponentials of the warm-up.
    action : str
        "modelled", "cut", "left in", "none found" or "not looked for".
    cut : float or None [s]
        Time from which the record was used.
    settled : float or None [s]
        Time at which the rest of the warm-up is lost in the noise; None if there is no warm-up.
    """

    found: bool
    p: float | None
    terms: tuple[WarmUpTerm, ...]
    action: Action
    cut: float | None
    settled: float | None = None
    tries: int = 1

    @property
    def says(self) -> str:
        """Whether there is one, in words."""
        return settling_sentence(self.action, self.settled)


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentSeries(Result):
    """The picture: some 800 instants of the record.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Time since the first sample.
    signal, residual : ndarray, shape (n,) [SI]
        Signal before and after removal; NaN where samples are missing.
    settling : ndarray, shape (n,) [SI]
        The part of what was removed that is a warm-up.
    temperature : ndarray, shape (n,) [unit of the thermometer]
        Empty without one.
    branch : ndarray, shape (n,)
        Branch from -1 (cooling) to +1 (warming); empty without a temperature.
    """

    time: Array
    signal: Array
    residual: Array
    settling: Array
    temperature: Array
    branch: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentFacts(Result):
    """Temperature and warm-up of one channel, as in its document.

    Attributes
    ----------
    channel, kind, unit : str
        Name, kind and unit of the channel.
    verdict : EnvironmentVerdict
        "resolved", "not resolved" or "not separable" is the effect of the temperature; without a thermometer
        "warm-up found" or "no warm-up".
    confidence : float
        Confidence level of the intervals.
    thermometer : Thermometer or None
        Thermometer; None if only a warm-up was examined.
    reference : float or None [unit of the thermometer]
        Temperature at which the coefficients apply.
    coefficients : tuple of Coefficient
        Coefficients of the bias for the temperature, its square and its rate.
    attenuation : float or None
        Share by which noise of the thermometer makes the coefficient of temperature too small.
    lag : Lag or None
        Lag between thermometer and sensor; None without a thermometer.
    hysteresis : Hysteresis or None
        Difference of warming and cooling; None without a thermometer.
    warm_up : WarmUp
        Found or not, and what was done about it.
    model : NoiseModel
        Noise model of the regression, fitted to the block means or given; not the model that `characterize` gives.
    model_given : bool
        True if the model was given.
    taken_off : tuple of str
        Columns that the residual is free of.
    correction : Correction or None
        Correction of the Allan curve of the residual; None if nothing was removed.
    series : EnvironmentSeries
        Series for the figure.
    """

    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    channel: str
    kind: str
    unit: str
    confidence: float
    thermometer: Thermometer | None
    reference: float | None
    coefficients: tuple[Coefficient, ...]
    attenuation: float | None
    lag: Lag | None
    hysteresis: Hysteresis | None
    warm_up: WarmUp
    model: NoiseModel
    model_given: bool
    taken_off: tuple[str, ...]
    correction: Correction | None
    series: EnvironmentSeries = field(repr=False)

    @property
    def verdict(self) -> EnvironmentVerdict:
        """On the temperature, or on the warm-up where there is no thermometer."""
        if self.coefficients:
            return next(v for v in EnvironmentVerdict if v == self.coefficients[0].status)
        return EnvironmentVerdict.WARM_UP if self.warm_up.found else EnvironmentVerdict.NO_WARM_UP

    @property
    def reason(self) -> str:
        """What the verdict rests on, in a sentence."""
        if not self.coefficients:
            return self.warm_up.says
        first = self.coefficients[0]
        if first.value is None or first.sd is None:
            return first.note
        size = size_words(first.value, first.sd)
        apart = self.verdict is EnvironmentVerdict.NOT_SEPARABLE
        return f"{size} with a drift of the sensor in the fit; {first.note}" if apart else size

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice and remarks."""
        thermometer, correction, branches = self.thermometer, self.correction, self.hysteresis
        conditions = {
            COME_BACK: self.verdict is EnvironmentVerdict.NOT_SEPARABLE,
            NOTHING_REMOVED: self.verdict is EnvironmentVerdict.NOT_RESOLVED,
            attenuation_sentence(self.attenuation or 0.0): (self.attenuation or 0.0) > _NOTABLE,
            interpolation_sentence(thermometer.missing if thermometer else 0.0): (
                thermometer is not None and thermometer.missing > 0
            ),
            f"{HysteresisStatus.FOUND.words}: this was not removed and stays in the residual": (
                branches is not None and branches.status is HysteresisStatus.FOUND
            ),
            left_in_sentence(self.warm_up.says): self.warm_up.found and self.warm_up.action == "left in",
            longest_sentence(correction.longest if correction else 0.0, 1 - LEAST): (
                correction is not None and correction.longest < correction.tau[-1]
            ),
        }
        return tuple(words for words, holds in conditions.items() if holds)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.stability.environment.version_1 import upgraded_facts

        return upgraded_facts(data)

    def __getitem__(self, name: str) -> Coefficient:
        """A coefficient by its name.

        Raises
        ------
        KeyError
            None of that name.
        """
        return {c.name: c for c in self.coefficients}[name]


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentEstimate(EnvironmentFacts):
    """Temperature and warm-up in one channel, with the recording that is free of them.

    Attributes
    ----------
    effect : Effect or None
        What was removed, at any instant.
    residual : Recording
        The recording, this channel free of what was removed, with a step in its history.
    """

    effect: Effect | None = field(repr=False)
    residual: Recording = field(repr=False)

    @property
    def facts(self) -> EnvironmentFacts:
        """What a document holds of it."""
        return EnvironmentFacts(**{f.name: getattr(self, f.name) for f in fields(EnvironmentFacts)})

    def to_json(self) -> dict[str, object]:
        """Plain data, as it stands in a study and in the document of `environment`."""
        return self.facts.to_json()


@dataclass(frozen=True, slots=True, kw_only=True)
class Environment(Result):
    """Temperature and warm-up in several channels of a recording.

    Attributes
    ----------
    channels : tuple of EnvironmentFacts
        One by one.
    duration : float [s]
        Of the record, without what was cut.
    confidence : float
        Of the intervals.
    """

    FORMAT: ClassVar[str] = "allanite-environment"
    VERSION: ClassVar[int] = 2

    channels: tuple[EnvironmentFacts, ...]
    duration: float
    confidence: float

    def __getitem__(self, channel: str) -> EnvironmentFacts:
        """What is known of a channel.

        Raises
        ------
        KeyError
            None of that name.
        """
        return {c.channel: c for c in self.channels}[channel]

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.stability.environment.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data


@dataclass(frozen=True, slots=True, kw_only=True)
class FreedRecording:
    """Several channels of a recording without the effects of their environment.

    Attributes
    ----------
    residual : Recording
        Free of what was removed, in every channel.
    estimates : tuple of EnvironmentEstimate
        What was removed, and what the record says of it.
    """

    residual: Recording
    estimates: tuple[EnvironmentEstimate, ...]

    def __getitem__(self, channel: str) -> EnvironmentEstimate:
        """The estimate of a channel.

        Raises
        ------
        KeyError
            None of that name.
        """
        return {e.channel: e for e in self.estimates}[channel]

    @property
    def result(self) -> Environment:
        """What a document holds of it."""
        return Environment(
            channels=tuple(e.facts for e in self.estimates),
            duration=self.residual.duration,
            confidence=self.estimates[0].confidence,
        )
