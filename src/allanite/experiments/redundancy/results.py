# SPDX-License-Identifier: BSD-3-Clause
"""Combination: the combined estimate of redundant sensors, what it gains, and which sensor contradicts the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, fields
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.redundancy import words
from allanite.experiments.redundancy.verdict import CombinationRemark, CombinationVerdict, FaultKind
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.recording.records import Recording

__all__ = [
    "Combination",
    "CombinedSensors",
    "ParitySeries",
    "SensorFault",
    "SharedNoise",
    "WindowSeries",
    "verdict_of",
]

Array = NDArray[np.float64]

#: Pairs of sensors that remarks name.
_NAMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedNoise(Result):
    """Noise that two sensors have in common.

    Attributes
    ----------
    first, second : str
        Channels.
    tau : float [s]
        Averaging time.
    correlation : Quantity [1]
        Of their means over tau.
    seen : bool
        It cannot be chance: among all pairs, independent sensors are called correlated once in a hundred records.
    """

    first: str
    second: str
    tau: float
    correlation: Quantity
    seen: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFault(Result):
    """A contradiction between the sensors, and the fault that explains it best.

    Attributes
    ----------
    kind : FaultKind
        "step", "drift", "spike", "noise", "stuck" or "other".
    sensor : str or None
        None where the parity cannot tell which of the `candidates` it is.
    candidates : tuple of str
        Sensors whose fault would explain it nearly as well.
    start, stop : float [s]
        Since the first sample.
    since : float [s]
        The earliest beginning that the record does not contradict.
    size, size_sd : float
        Step or spike [SI], drift [SI per s], noise: factor on the standard deviation; of the first candidate. NaN
        for a stuck sensor.
    statistic : float
        Twice the gain in log-likelihood by the fault.
    parities : int
        Combinations of the sensors that no motion changes; one alone cannot tell whose fault it is.
    """

    kind: FaultKind
    sensor: str | None
    candidates: tuple[str, ...]
    start: float
    stop: float
    since: float
    size: float
    size_sd: float
    statistic: float
    parities: int

    @property
    def who(self) -> str:
        """The sensor, or which it may be."""
        return self.sensor or f"one of {', '.join(self.candidates)}"

    @property
    def says(self) -> str:
        """What happened, in words."""
        return words.fault_sentence(self.kind, self.sensor, self.who, self.stop - self.start, self.parities)


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowSeries(Result):
    """The parity in windows of one length.

    Attributes
    ----------
    length : float [s]
        Of each window.
    time : ndarray, shape (windows,) [s]
        Of their middles, since the first sample.
    statistic : ndarray, shape (windows,)
        Chi-square of the parity.
    """

    length: float
    time: Array
    statistic: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class ParitySeries(Result):
    """The parity of the sensors over time.

    Attributes
    ----------
    windows : tuple of WindowSeries
        For each length of window.
    threshold : float
        Above it a chi-square is an alarm.
    dof : int
        Its expectation: combinations of the sensors that no motion changes.
    """

    windows: tuple[WindowSeries, ...]
    threshold: float
    dof: int


def verdict_of(faults: Sequence[SensorFault]) -> CombinationVerdict:
    """Whether sensors contradict each other, and whether it is known which are wrong."""
    if not faults:
        return CombinationVerdict.AGREE
    unknown = any(f.sensor is None for f in faults)
    return CombinationVerdict.CONTRADICTION if unknown else CombinationVerdict.FAULT


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination(Result):
    """All sensors of one kind as one.

    Attributes
    ----------
    remarks : tuple of CombinationRemark
        What is to be known beside the faults: "noise is shared" (see `shared`), "motion looks like shared noise",
        "noise unlike the models" (`noise_ratio`), "record not at rest", "faults in every window", "sensors left
        out" (`faults`), "a fault stays in".
    verdict : CombinationVerdict
        "sensors agree", "a sensor is at fault" or, where it is not known which, "sensors contradict each other".
    channels : tuple of str, length n
        Of the sensors.
    axes : tuple of str, length m
        Names of the channels of the combined recording.
    kind : "rate" or "acceleration"
        What the sensors measure.
    directions : ndarray, shape (n, m)
        Unit vectors along the sensing axes.
    weights : ndarray, shape (m, n)
        Of the sensors for each axis; constant in time, chosen for `averaging`.
    averaging : float [s]
        Averaging time for which the weights are the best.
    differences : ndarray, shape (n,) [SI]
        Constant part by which each sensor contradicts the others; removed before the sensors are weighed.
    shared : tuple of SharedNoise
        Every pair of sensors; empty for a record that was not at rest.
    correlation : ndarray, shape (n, n)
        What the weights take of it.
    models : tuple of NoiseModel, length m
        Of the combined axes.
    tau : ndarray, shape (k,) [s]
        Averaging time.
    predicted : ndarray, shape (k, m) [SI]
        Allan deviation of the combined axes by the models.
    measured, lower, upper : ndarray, shape (k, m) [SI]
        The same measured at rest on the combined recording, spans of faults included, with its interval; NaN where
        nothing was measured.
    single : ndarray, shape (k,) [SI]
        Allan deviation of the best sensor by the models.
    gain, gain_lower, gain_upper : ndarray, shape (k, m)
        Measured deviation of that best sensor, without the windows of faults, over that of the combined axis, with
        its interval.
    gain_predicted : ndarray, shape (k, m)
        The same by the models.
    loss : ndarray, shape (k, m)
        Deviation of the combined axis over that of weights made for each tau: what constant weights cost. 1: nothing.
    faults : tuple of SensorFault
        Contradictions between the sensors, in the order of time.
    alike : tuple of tuple of str
        Sensors whose faults the parity cannot tell apart, group by group.
    parity : ParitySeries
        What the alarms are raised by.
    false_alarm : float
        Probability of any fault in a record without one.
    noise_ratio : float
        Noise of the parity over that of the models; above 1 the tests allow for it.
    unusual : bool
        That ratio is not chance.
    at_rest : bool
        The record was: shared noise and gain are measured.
    faults_everywhere : bool
        Every window lies in the span of a fault.
    confidence : float
        Of the intervals.
    rate : float [Hz]
        Samples per second.
    duration : float [s]
        Of the record.
    source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-combination"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks",)

    verdict: CombinationVerdict

    channels: tuple[str, ...]
    axes: tuple[str, ...]
    kind: Literal["rate", "acceleration"]
    directions: Array = field(repr=False)
    weights: Array
    averaging: float
    differences: Array = field(repr=False)
    shared: tuple[SharedNoise, ...] = field(repr=False)
    correlation: Array = field(repr=False)
    models: tuple[NoiseModel, ...] = field(repr=False)
    tau: Array = field(repr=False)
    predicted: Array = field(repr=False)
    measured: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    single: Array = field(repr=False)
    gain: Array = field(repr=False)
    gain_lower: Array = field(repr=False)
    gain_upper: Array = field(repr=False)
    gain_predicted: Array = field(repr=False)
    loss: Array = field(repr=False)
    faults: tuple[SensorFault, ...]
    alike: tuple[tuple[str, ...], ...]
    parity: ParitySeries = field(repr=False)
    false_alarm: float
    noise_ratio: float
    unusual: bool
    at_rest: bool
    faults_everywhere: bool
    confidence: float
    rate: float
    duration: float
    source: str = ""

    @property
    def reason(self) -> str:
        """The faults in words; without one what was looked for."""
        says = dict.fromkeys(f.says for f in self.faults)
        return "; ".join(says) if says else words.no_contradiction(self.false_alarm)

    @property
    def isolation(self) -> str:
        """What the geometry lets the parity tell."""
        return words.isolation_sentence(len(self.channels), self.parity.dof, self.alike)

    @property
    def sharing(self) -> list[SharedNoise]:
        """Pairs of sensors that share noise, the closest first."""
        return sorted((p for p in self.shared if p.seen), key=lambda p: -abs(p.correlation.value))

    @property
    def remarks(self) -> tuple[CombinationRemark, ...]:
        """Codes of what is to be known."""
        return tuple(dict.fromkeys(code for code, _ in self._remarked()))

    @property
    def advice(self) -> tuple[str, ...]:
        """What is to be known, in sentences."""
        return tuple(says for _, says in self._remarked())

    def _remarked(self) -> Iterator[tuple[CombinationRemark, str]]:
        """The sentences, each with its code."""
        sharing = self.sharing
        for p in sharing[:_NAMED]:
            says = words.shared_sentence(p.first, p.second, p.tau, p.correlation)
            yield CombinationRemark.SHARED, says
        if len(sharing) > _NAMED:
            yield CombinationRemark.SHARED, words.more_pairs(len(sharing) - _NAMED)
        if sharing:
            yield CombinationRemark.MOTION, words.MOTION
        if self.unusual:
            yield CombinationRemark.UNUSUAL, words.unusual(self.noise_ratio)
        if not self.at_rest:
            yield CombinationRemark.MOVED, words.MOVED
        if self.faults_everywhere:
            yield CombinationRemark.EVERYWHERE, words.EVERYWHERE
        if named := sorted({f.sensor for f in self.faults if f.sensor is not None}):
            yield CombinationRemark.LEFT_OUT, words.left_out(named, at_rest=self.at_rest)
        if any(f.sensor is None for f in self.faults):
            yield CombinationRemark.STAYS, words.STAYS

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.redundancy.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data


@dataclass(frozen=True, slots=True, kw_only=True)
class CombinedSensors(Combination):
    """A combination with the recording that it makes of the samples.

    Attributes
    ----------
    combined : Recording
        Read block by block; no document holds it.
    """

    combined: Recording = field(repr=False)

    @property
    def result(self) -> Combination:
        """What a document holds."""
        return Combination(**{f.name: getattr(self, f.name) for f in fields(Combination)})

    def recording(self) -> Recording:
        """The combined recording: rad/s or m/s², read block by block from the samples of all sensors.

        A sensor named by a fault does not take part in its span. A sample of which too few sensors are there is
        missing.
        """
        return self.combined

    def to_json(self) -> dict[str, object]:
        """Plain data, SI units; null for what does not exist."""
        return self.result.to_json()
