# SPDX-License-Identifier: BSD-3-Clause
"""What the environment does to a sensor, and what the record cannot tell of it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel
from allanite.quantities.result import Result
from allanite.recording.records import Recording
from allanite.stability.environment.climate import Thermometer
from allanite.stability.environment.correction import Correction
from allanite.stability.environment.effect import Effect

__all__ = [
    "Coefficient",
    "Environment",
    "EnvironmentEstimate",
    "EnvironmentFacts",
    "EnvironmentSeries",
    "Hysteresis",
    "Lag",
    "WarmUp",
    "WarmUpTerm",
]

Array = NDArray[np.float64]
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
        None where the record cannot tell it at all.
    lower, upper : float or None
        Ends of the interval.
    p : float or None
        Two-sided probability of an estimate so far from zero if the coefficient is zero.
    status : str
        "resolved", "not resolved" or "not separable": the interval excludes zero; holds it; or the column is a
        combination of others, so that nothing is known.
    limit : float or None
        The largest size that the interval holds, where it is not resolved.
    note : str
        What a reader must know besides.
    """

    name: str
    value: float | None
    sd: float | None
    lower: float | None
    upper: float | None
    p: float | None
    status: str
    limit: float | None = None
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lag(Result):
    """How far the thermometer follows behind the sensor [s]; negative: before it.

    Attributes
    ----------
    status : str
        "resolved", "no lag seen" or "not resolved".
    value, lower, upper : float or None [s]
        Interval by Fieller's theorem.
    says : str
        What was found, in words.
    """

    status: str
    value: float | None
    lower: float | None
    upper: float | None
    says: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Hysteresis(Result):
    """The branch of warming against that of cooling.

    Attributes
    ----------
    status : str
        "found", "not found" or "not tested".
    gap, lower, upper : float or None [SI]
        Signal when warming less signal when cooling, at one temperature.
    p : float or None
        Of a gap so far from zero where there is none.
    says : str
        What was found, in words.
    """

    status: str
    gap: float | None
    lower: float | None
    upper: float | None
    p: float | None
    says: str


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUpTerm(Result):
    """One exponential.

    Attributes
    ----------
    amplitude, amplitude_sd : float [SI]
        At the first sample, with its standard deviation.
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
        That number.
    terms : tuple of WarmUpTerm
        Its exponentials.
    action : str
        "modelled", "cut", "left in", "none found" or "not looked for".
    cut : float or None [s]
        From where the record was used.
    says : str
        What was found, in words.
    """

    found: bool
    p: float | None
    terms: tuple[WarmUpTerm, ...]
    action: Action
    cut: float | None
    says: str
    tries: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentSeries(Result):
    """The picture: some 800 instants of the record.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Since the first sample.
    signal, residual : ndarray, shape (n,) [SI]
        Before and after; NaN where samples are missing.
    settling : ndarray, shape (n,) [SI]
        The part of what was removed that is a warm-up.
    temperature : ndarray, shape (n,) [unit of the thermometer]
        Empty without one.
    branch : ndarray, shape (n,)
        From -1 (cooling) to +1 (warming); empty without a temperature.
    """

    time: Array
    signal: Array
    residual: Array
    settling: Array
    temperature: Array
    branch: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentFacts(Result):
    """Temperature and warm-up in one channel, as a document holds them.

    Attributes
    ----------
    channel, kind, unit : str
        Name, kind and unit of the channel.
    verdict, reason : str
        What was found of the temperature, or of the warm-up where there is no thermometer.
    advice : tuple of str
        What to do about it.
    confidence : float
        Of the intervals.
    thermometer : Thermometer or None
        None where only a warm-up was looked for.
    reference : float or None [unit of the thermometer]
        Temperature that the coefficients belong to.
    coefficients : tuple of Coefficient
        Of the bias by the temperature, its square and its rate.
    attenuation : float or None
        Share by which noise of the thermometer makes the coefficient of temperature too small.
    lag : Lag or None
        None without a thermometer.
    hysteresis : Hysteresis or None
        None without a thermometer.
    warm_up : WarmUp
        Found or not, and what was done about it.
    model : NoiseModel
        Of the regression, fitted to the block means or given; not the model that `characterize` gives.
    model_given : bool
        It was given.
    taken_off : tuple of str
        Columns that the residual is free of.
    correction : Correction or None
        Of the Allan curve of the residual; None where nothing was removed.
    series : EnvironmentSeries
        For the picture.
    """

    channel: str
    kind: str
    unit: str
    verdict: str
    reason: str
    advice: tuple[str, ...]
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
class Environment:
    """Temperature and warm-up in several channels of a recording.

    Attributes
    ----------
    residual : Recording
        Free of what was removed, in every channel.
    estimates : tuple of EnvironmentEstimate
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

    def to_json(self) -> dict[str, object]:
        """Plain data, from which a report is made."""
        return {
            "format": "allanite-environment",
            "version": 1,
            "channels": [e.to_json() for e in self.estimates],
            "duration": self.residual.duration,
        }
