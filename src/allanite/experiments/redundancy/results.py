# SPDX-License-Identifier: BSD-3-Clause
"""Combination: the combined estimate of redundant sensors, what it gains, and which sensor contradicts the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain
from allanite.recording.records import Recording

__all__ = ["Combination", "SensorFault", "SharedNoise"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedNoise:
    """Noise that two sensors have in common.

    Attributes
    ----------
    first, second : str
    tau : float [s]
        Averaging time.
    correlation, lower, upper : float
        Of their means over tau, with its interval.
    seen : bool
        It cannot be chance: among all pairs, independent sensors are called correlated once in a hundred records.
    """

    first: str
    second: str
    tau: float
    correlation: float
    lower: float
    upper: float
    seen: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFault:
    """A contradiction between the sensors, and the fault that explains it best.

    Attributes
    ----------
    kind : "step", "drift", "spike", "noise", "stuck" or "other"
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
    says : str
    """

    kind: str
    sensor: str | None
    candidates: tuple[str, ...]
    start: float
    stop: float
    since: float
    size: float
    size_sd: float
    statistic: float
    says: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """All sensors of one kind as one.

    Attributes
    ----------
    channels : tuple of str, length n
    axes : tuple of str, length m
        Names of the channels of the combined recording.
    kind : "rate" or "acceleration"
    directions : ndarray, shape (n, m)
    weights : ndarray, shape (m, n)
        Of the sensors for each axis; constant in time, chosen for `averaging`.
    averaging : float [s]
    differences : ndarray, shape (n,) [SI]
        Constant part by which each sensor contradicts the others; removed before the sensors are weighed.
    shared : tuple of SharedNoise
        Every pair of sensors; empty for a record that was not at rest.
    correlation : ndarray, shape (n, n)
        What the weights take of it.
    models : tuple of NoiseModel, length m
        Of the combined axes.
    tau : ndarray, shape (k,) [s]
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
    loss : ndarray, shape (k, m)
        Deviation of the combined axis over that of weights made for each tau: what constant weights cost. 1: nothing.
    faults : tuple of SensorFault
    isolation : str
        What the geometry lets the parity tell.
    parity : dict
        "windows": for each length [s] of window the "time" [s] of their middles and their "statistic", the chi-square
        of the parity, whose expectation is "dof"; above "threshold" it is an alarm.
    false_alarm : float
        Probability of any fault in a record without one.
    noise_ratio : float
        Noise of the parity over that of the models; above 1 the tests allow for it.
    confidence : float
    remarks : tuple of str
    rate : float [Hz]
    duration : float [s]
    source : str
    """

    channels: tuple[str, ...]
    axes: tuple[str, ...]
    kind: str
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
    isolation: str
    parity: Mapping[str, Any] = field(repr=False)
    false_alarm: float
    noise_ratio: float
    confidence: float
    remarks: tuple[str, ...] = ()
    rate: float
    duration: float
    source: str = ""
    combined: Recording = field(repr=False)

    def recording(self) -> Recording:
        """The combined recording: rad/s or m/s², read block by block from the samples of all sensors.

        A sensor named by a fault does not take part in its span. A sample of which too few sensors are there is
        missing.
        """
        return self.combined

    @property
    def verdict(self) -> str:
        """ "sensors agree", or what kind of contradiction there is."""
        if not self.faults:
            return "sensors agree"
        named = {f.sensor for f in self.faults}
        return "a sensor is at fault" if None not in named else "sensors contradict each other"

    @property
    def reason(self) -> str:
        """The faults in words; without one what was looked for."""
        if not self.faults:
            return f"no window of their parity contradicts the noise models ({100 * self.false_alarm:g} % false alarms)"
        return "; ".join(dict.fromkeys(f.says for f in self.faults))

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what does not exist."""
        names = (
            "source", "verdict", "reason", "kind", "rate", "duration", "channels", "axes", "directions", "weights",
            "averaging", "differences", "shared", "correlation", "tau", "predicted", "measured", "lower", "upper",
            "single", "gain", "gain_lower", "gain_upper", "gain_predicted", "loss", "faults", "isolation", "parity",
            "false_alarm", "noise_ratio", "confidence", "remarks",
        )  # fmt: skip
        return {
            "format": "allanite-combination",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in names},
            "models": [m.to_json() for m in self.models],
        }
