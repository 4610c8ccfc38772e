# SPDX-License-Identifier: BSD-3-Clause
"""What a self-calibration says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import ResidualTest
from allanite.recording.calibration import Calibration

__all__ = [
    "CalibrationEstimate",
    "CalibrationParameter",
    "CalibrationPosition",
    "CalibrationTurn",
    "EarthSeen",
    "ObservationScatter",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationParameter:
    """One parameter of the calibration.

    Attributes
    ----------
    name : str
        See `allanite.recording.calibration.parameter_names`.
    unit : str
        "m/s²", "rad/s", "rad", "1" (a scale factor in SI), "rad/s/(m/s²)", "LSB", "LSB/(m/s²)", ...
    value, sd : float
        With the stated uncertainties.
    interval : (float, float)
        At the confidence of the estimate.
    status : str
        "estimated"; "assumed" where the positions leave it open; "not resolved" where no position comes near one of
        the directions that it is the difference or the sum of: value and interval extrapolate; or where so few
        positions hardly tell how far they scatter, and the interval is as wide as what is known of any unit.
    open : float
        Part of it that lies in directions which the positions leave open, 0 to 1.
    dof : float
        Degrees of freedom of the law of the interval; infinite where no scatter had to be estimated. Where they are
        few, the interval is that of the largest scatter which the residuals do not exclude.
    advice : tuple of str
        What to add so that it can be estimated; empty where it was.
    """

    name: str
    unit: str
    value: float
    sd: float
    interval: tuple[float, float]
    status: str
    open: float
    dof: float
    advice: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationPosition:
    """One static span.

    Attributes
    ----------
    number : int
        From 1, in the order of time; what `without` takes.
    start, stop : float [s]
        Since the first sample.
    up : ndarray, shape (3,)
        The direction that points up, in the axes of the body.
    words : str
        The same for people: "z up", "between +x and +y up", ...
    attitude : ndarray, shape (3, 3)
        Body to a level frame (third axis down) in which the first used span has the heading zero.
    heading_known : bool
        Linked by turns to the first used span.
    temperature : float or None
        Mean, in the unit of the channel after its scale.
    excess : float or None [m/s²]
        Length of the calibrated specific force less gravity; None without accelerometers.
    excess_sd : float or None [m/s²]
        Its standard deviation by the noise and the scatter, if the calibration were perfect.
    rate : ndarray or None, shape (3,) [rad/s]
        Calibrated mean rate less the Earth's, along the axes of the body; None without gyros.
    rate_sd : ndarray or None, shape (3,) [rad/s]
    misfit : float
        Deletion residual: how far the span lies from what all others predict, in standard deviations (root of the
        chi-square over its degrees of freedom). NaN where no other span says anything about it.
    p : float
        Probability of such a misfit or a larger one, for this span alone.
    outlier : bool
        p is below the limit for the worst of all spans and turns.
    used : bool
    why : str
        Why it was not used: "left out" (on request), "samples missing" (of an axis, all of them); "" where it was.
    """

    number: int
    start: float
    stop: float
    up: Array
    words: str
    attitude: Array = field(repr=False)
    heading_known: bool
    temperature: float | None
    excess: float | None
    excess_sd: float | None
    rate: Array | None = field(repr=False)
    rate_sd: Array | None = field(repr=False)
    misfit: float
    p: float
    outlier: bool
    used: bool
    why: str = ""

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.stop - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationTurn:
    """The rotation from one used span to the next.

    Attributes
    ----------
    before, after : int
        Numbers of the spans.
    start, stop : float [s]
    angle : float [rad]
        Of the rotation from the one attitude to the other, 0 to pi.
    axis : ndarray, shape (3,)
        In the axes of the body.
    residual : ndarray, shape (3,) [rad]
        Rotation between the integrated rates and the attitudes; NaN where the turn was not used.
    misfit, p : float
        As of a `CalibrationPosition`.
    outlier : bool
    used : bool
    why : str
        Why it was not used: "samples missing", "clipped", "left out"; "" where it was.
    """

    before: int
    after: int
    start: float
    stop: float
    angle: float
    axis: Array
    residual: Array = field(repr=False)
    misfit: float
    p: float
    outlier: bool
    used: bool
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservationScatter:
    """How one kind of observation scatters, beyond the noise.

    Attributes
    ----------
    what : str
        "accelerometers at rest", "gyros at rest" or "turns".
    unit : str
        "m/s²", "rad/s" or "rad".
    ratio : float
        Scatter over what the noise says.
    chi2, dof : float
        Of the residuals under the noise alone.
    sd : float
        Standard deviation, for each axis of each span or turn, that was added to the noise; 0 where none was needed.
    sd_dof : float
        Degrees of freedom that it was estimated with.
    walk : float
        Random walk of the biases that was added besides, in the unit per root of a second; 0 where none was seen.
    walk_dof : float
    """

    what: str
    unit: str
    ratio: float
    chi2: float
    dof: float
    sd: float
    sd_dof: float
    walk: float = 0.0
    walk_dof: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthSeen:
    """The Earth's rotation as the gyros saw it, in the level frame of the positions.

    Attributes
    ----------
    vector : ndarray, shape (3,) [rad/s]
        Third axis down.
    sd : ndarray, shape (3,) [rad/s]
    length, length_sd : float [rad/s]
        Of the part that was looked for (the horizontal one where the latitude is known), without the constraint.
    expected : float [rad/s]
        The known rate of that part.
    resolved : bool
        The length is seen: it was then set to the known one, which calibrates the scale of the gyros.
    """

    vector: Array
    sd: Array
    length: float
    length_sd: float
    expected: float
    resolved: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationEstimate:
    """The calibration of a unit from its positions and turns.

    Attributes
    ----------
    calibration : Calibration
        Values, covariance, status: what other programs take. It holds how the biases of the gyros follow gravity where
        they scattered beyond their noise and this explains it.
    parameters : tuple of CalibrationParameter
        In the order of `calibration.names`.
    verdict : str
        "calibrated", "partly calibrated" (some parameters are assumed or not resolved), "inconsistent" (positions, or
        accelerometers and gyros, contradict each other, gravity or the Earth) or "not calibrated".
    reason : str
        One or two sentences.
    advice : tuple of str
        What to do: positions to add, spans to look at, checks that failed.
    add : tuple of str
        Positions to add, in this order, which together make every parameter observable that can be.
    remarks : tuple of str
        What a reader must know: gravity that was taken for granted, turns that were dropped, ...
    checks : tuple of ResidualTest
    scatter : tuple of ObservationScatter
    positions : tuple of CalibrationPosition
        All static spans, those left out included.
    turns : tuple of CalibrationTurn
    earth : EarthSeen or None
        None without gyros.
    gravity : float [m/s²]
    gravity_source : str
        "given", "latitude" or "standard".
    latitude : float or None [rad]
    stated : dict of str to float
        Uncertainties as given.
    temperature_span : (float, float) or None
        Lowest and highest mean temperature of the spans.
    models : dict of str to NoiseModel
        By channel, in the unit of the channel after its scale.
    model_source : str
        "given" or "this record"; of rows of means also "standard deviations of the table" or "scatter of the
        positions".
    spans_source : str
        "given", "found" or "rows of means".
    confidence : float
    rate, duration : float [Hz], [s]
        Of the recording.
    source : str
    """

    calibration: Calibration
    parameters: tuple[CalibrationParameter, ...] = field(repr=False)
    verdict: str
    reason: str
    advice: tuple[str, ...] = ()
    add: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    checks: tuple[ResidualTest, ...] = field(default=(), repr=False)
    scatter: tuple[ObservationScatter, ...] = field(repr=False)
    positions: tuple[CalibrationPosition, ...] = field(repr=False)
    turns: tuple[CalibrationTurn, ...] = field(repr=False)
    earth: EarthSeen | None = field(repr=False)
    gravity: float
    gravity_source: str
    latitude: float | None
    stated: Mapping[str, float] = field(default_factory=dict)
    temperature_span: tuple[float, float] | None = None
    models: Mapping[str, NoiseModel] = field(repr=False)
    model_source: str
    spans_source: str
    confidence: float
    rate: float
    duration: float
    source: str

    def __getitem__(self, name: str) -> CalibrationParameter:
        """One parameter by its name."""
        return self.parameters[self.calibration.names.index(name)]

    @property
    def sensors(self) -> tuple[str, ...]:
        """Triads that were calibrated."""
        return self.calibration.sensors

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the parameters that the positions leave open."""
        return tuple(p.name for p in self.parameters if p.status == "assumed")

    @property
    def outliers(self) -> tuple[str, ...]:
        """Positions and turns that contradict the rest, by name."""
        positions = tuple(f"position {p.number}" for p in self.positions if p.outlier)
        return positions + tuple(f"turn {t.before} to {t.after}" for t in self.turns if t.outlier)

    @property
    def inflated(self) -> bool:
        """True where scatter beyond the noise widens the intervals."""
        return any(s.sd > 0 or s.walk > 0 for s in self.scatter)

    def correlation(self) -> Array:
        """Of the parameters, shape (k, k); zero for one without variance."""
        sd = self.calibration.sd
        safe = np.where(sd > 0, sd, math.inf)
        return np.asarray(self.calibration.covariance / np.outer(safe, safe))

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units or those of the channels; numbers that do not exist are null."""
        return {
            "format": "allanite-calibration-estimate",
            "version": 1,
            "calibration": self.calibration.to_json(),
            **{
                name: plain(getattr(self, name))
                for name in (
                    "source", "verdict", "reason", "advice", "add", "remarks", "confidence", "parameters", "scatter",
                    "positions", "turns", "earth", "checks", "gravity", "gravity_source",
                    "latitude", "temperature_span", "model_source", "spans_source", "rate", "duration",
                )
            },
            "stated": dict(self.stated),
            "correlation": plain(self.correlation()),
            "models": {name: model.to_json() for name, model in self.models.items()},
            "earth_rate": EARTH_RATE,
        }  # fmt: skip
