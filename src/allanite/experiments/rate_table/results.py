# SPDX-License-Identifier: BSD-3-Clause
"""What a run on a rate table says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain
from allanite.quantities.residual_tests import ResidualTest

__all__ = [
    "Aided",
    "FrequencyPoint",
    "RateTableEstimate",
    "ResponseParameter",
    "ResponsePoint",
    "StepResult",
    "TableUncertainty",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseAtRate:
    """The noise between neighbouring blocks at one rate, without its sign.

    Attributes
    ----------
    rate : float [rad/s]
    ratio : float
        Over that of the model.
    chi2, dof : float, int
    p : float
        Of so much noise or more, for the number of rates that were looked at.
    """

    rate: float
    ratio: float
    chi2: float
    dof: int
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TableUncertainty:
    """Standard uncertainties that no record shows: what the user knows of the table.

    Attributes
    ----------
    scale : float
        Of the table's rate, relative.
    misalignment : float [rad]
        Of the sensitive axis from the table's axis.
    """

    scale: float = 0.0
    misalignment: float = 0.0

    def __post_init__(self) -> None:
        for name in ("scale", "misalignment"):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value >= 0):
                raise InputError(
                    f"the stated uncertainty of {name} must be finite and not negative, not {value!r}"
                )

    def budget(self) -> dict[str, float]:
        """What each contributes to the scale factor, relative to it. A misalignment is of second order, theta^2/2."""
        return {"table rate": self.scale, "misalignment": math.sqrt(3) / 2 * self.misalignment**2}


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseParameter:
    """One number of the response.

    Attributes
    ----------
    name : str
    value : float
        NaN where the record cannot tell it from others.
    sd : float
        By the noise, widened.
    total_sd : float
        With what is stated, too.
    interval : (float, float)
    unit : str
        In SI; "1" for ratios.
    resolved : bool
        Three standard deviations from zero or more.
    limit : float or None
        Where it is not resolved, it is no larger than this, at the confidence of the interval.
    """

    name: str
    value: float
    sd: float
    total_sd: float
    interval: tuple[float, float]
    unit: str
    resolved: bool
    limit: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResult:
    """One step of the table.

    Attributes
    ----------
    start, stop : float [s]
        Used part, by the record's clock; of a step that is not used the whole of it.
    rate : float [rad/s]
    mean, residual, sd : float [SI of the channel]
        Mean, what the fit leaves of it, and the standard deviation of that by the noise model.
    corrected : float [SI of the channel]
        What is left after the slow noise was removed against the table; NaN where that was not done.
    used : bool
    why : str
        Why it is not used.
    """

    start: float
    stop: float
    rate: float
    mean: float
    residual: float
    sd: float
    corrected: float
    used: bool
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponsePoint:
    """The response at one rate, less its best straight line, over full scale.

    Attributes
    ----------
    rate : float [rad/s]
    deviation, sd : float
        Relative to the scale factor times the largest rate.
    direction : int
        +1 where the rate came from below, -1 from above, 0 of both.
    """

    rate: float
    deviation: float
    sd: float
    direction: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FrequencyPoint:
    """The response to one sinusoid.

    Attributes
    ----------
    frequency : float [Hz]
    amplitude : float [rad/s]
        Of the table.
    gain, gain_sd : float [SI of the channel per rad/s]
    phase, phase_sd : float [rad]
        Of the output before the table; a clock that is late by d adds -2 pi f d.
    """

    frequency: float
    amplitude: float
    gain: float
    gain_sd: float
    phase: float
    phase_sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Aided:
    """The reference-aided filter of the seed paper, told the fitted response: noise removal, no measurement.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
    drift : ndarray, shape (n,) [SI of the channel]
        The slow noise that it took off.
    raw, corrected : float [SI of the channel]
        Root mean square of what the fit leaves of the steps, before and after; NaN without steps.
    scale : float [SI of the channel per rad/s]
        Slope of the corrected samples by plain least squares. It was told the fitted one, and agrees with it.
    scale_raw : float
        The same of the samples as they are: told nothing.
    statement : str
    """

    time: Array = field(repr=False)
    drift: Array = field(repr=False)
    raw: float
    corrected: float
    scale: float
    scale_raw: float
    statement: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RateTableEstimate:
    """The response of one channel to a rate table, with what speaks for and against it.

    Attributes
    ----------
    channel, source : str
    kind, unit : str
        Of the channel; `unit` is the one in which its samples are written.
    channel_scale : float
        SI value of one of them.
    verdict : str
        "resolved", "not resolved", "inconsistent" or "not separable".
    reason : str
    advice : tuple of str
        What to do.
    notes : tuple of str
        What was found on the way: steps that clip, clocks that differ, the Earth in the bias.
    parameters : tuple of ResponseParameter
        "scale factor", "bias" and the rest, by name in `__getitem__`.
    confidence : float
        Of the intervals.
    inflation : float
        1, or the factor by which excess scatter widens the intervals.
    budget : dict of str to float
        Standard uncertainties of the scale factor by source, relative to it.
    nonlinearity : int or str
        Degree of the polynomial, or "sign".
    nominal : float or None
        Scale factor that the channel's unit says it has [1], where it says one.
    full_scale, span : float [rad/s]
        Largest rate, and largest less smallest.
    checks : tuple of ResidualTest
    steps : tuple of StepResult
        Empty for a rate that changes all the time.
    points : tuple of ResponsePoint
    fitted : ndarray, shape (n, 3)
        Rate over full scale, fitted deviation from the straight line, and its standard deviation.
    frequencies : tuple of FrequencyPoint
    noise_by_rate : tuple of NoiseAtRate
    aided : Aided or None
    table : dict
        How the table turned.
    clock : str
        "found", "given" or "not seen".
    dead_time, guard : float [s]
        Left out after a step begins, and before it ends.
    axis : str
        Of the table: "vertical", "up", "down", "horizontal" or "unknown".
    earth : float or None [rad/s]
        Part of the Earth's rotation that a sensor on this axis sees all the time; None where it is not known.
    model : NoiseModel
    model_source : str
        "given", or "this record".
    duration, block : float [s]
    """

    channel: str
    source: str
    kind: str
    unit: str
    channel_scale: float
    verdict: str
    reason: str
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    parameters: tuple[ResponseParameter, ...]
    confidence: float
    inflation: float
    budget: dict[str, float]
    nonlinearity: int | str
    nominal: float | None
    full_scale: float
    span: float
    checks: tuple[ResidualTest, ...] = ()
    steps: tuple[StepResult, ...] = field(default=(), repr=False)
    points: tuple[ResponsePoint, ...] = field(default=(), repr=False)
    fitted: Array = field(repr=False)
    frequencies: tuple[FrequencyPoint, ...] = ()
    noise_by_rate: tuple[NoiseAtRate, ...] = ()
    aided: Aided | None = None
    table: dict[str, Any] = field(repr=False)
    clock: str
    dead_time: float
    guard: float
    axis: str
    earth: float | None
    model: NoiseModel = field(repr=False)
    model_source: str
    duration: float
    block: float

    def __getitem__(self, name: str) -> ResponseParameter:
        """One of the parameters.

        Raises
        ------
        InputError
            No such parameter; the message lists those there are.
        """
        parameter = next((p for p in self.parameters if p.name == name), None)
        if parameter is None:
            raise InputError(
                f"no parameter {name!r}; there are: {', '.join(p.name for p in self.parameters)}"
            )
        return parameter

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def resolved(self) -> bool:
        """True when the scale factor is one of this sensor."""
        return self.verdict == "resolved"

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; numbers that do not exist are null."""
        return {
            "format": "allanite-rate-table",
            "version": 1,
            **{
                name: plain(getattr(self, name))
                for name in (
                    "source", "channel", "kind", "unit", "channel_scale", "verdict", "reason", "advice", "notes",
                    "parameters", "confidence", "inflation", "budget", "nonlinearity", "nominal", "full_scale", "span",
                    "checks", "steps", "points", "fitted", "frequencies", "noise_by_rate", "aided", "table", "clock",
                    "dead_time", "guard", "axis", "earth", "model_source", "duration", "block",
                )
            },
            "model": self.model.to_json(),
        }  # fmt: skip
