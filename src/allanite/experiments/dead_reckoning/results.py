# SPDX-License-Identifier: BSD-3-Clause
"""DeadReckoning: standard deviations of attitude, velocity and position over time, by source."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, field, replace
from enum import StrEnum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.dead_reckoning import words
from allanite.experiments.dead_reckoning.version_1 import upgraded
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.earth import SEMI_MAJOR
from allanite.quantities.result import Result
from allanite.quantities.tabular import Columns

__all__ = ["LINEAR", "QUANTITIES", "DeadReckoning", "InitialErrors", "ReckoningRemark", "Source", "is_linear"]

Array = NDArray[np.float64]

_SENSORS = ("gyro", "accelerometer")
#: So much of the height's standard deviation may come besides from the second order of the tilt.
_SECOND_ORDER = 0.1

#: What is told -> the states whose variances make it. "horizontal" and "tilt" are roots of the sum of two variances.
QUANTITIES: Mapping[str, tuple[int, ...]] = {
    "position_horizontal": (0, 1),
    "position_north": (0,),
    "position_east": (1,),
    "position_down": (2,),
    "velocity_horizontal": (3, 4),
    "velocity_north": (3,),
    "velocity_east": (4,),
    "velocity_down": (5,),
    "tilt": (6, 7),
    "tilt_north": (6,),
    "tilt_east": (7,),
    "heading": (8,),
}
#: Largest errors [m], [rad] of the linear error model. Over a tenth of the Earth's radius gravity falls by 17 %, in the
#: model by 20 %; in a Schuler oscillation of a quarter of it, v^2 over the radius is 6 % of gravity; sin x is 16 %
#: below x at 1 rad.
LINEAR: Mapping[str, float] = {
    "position_horizontal": SEMI_MAJOR / 4,
    "position_down": SEMI_MAJOR / 10,
    "tilt": 1.0,
    "heading": 1.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialErrors(Result):
    """Standard deviations of the errors at the start of dead reckoning; all in SI, 0 if not stated.

    Attributes
    ----------
    position : float [m]
        Standard deviation of each of north, east, down.
    velocity : float [m/s]
        Likewise.
    tilt : float [rad]
        About each of north and east.
    heading : float [rad]
        About the vertical.
    gyro_bias : float [rad/s]
        Constant from one switching-on to the next (turn-on), of each axis.
    accelerometer_bias : float [m/s^2]
        Likewise.
    gyro_scale, accelerometer_scale : float
        Relative error of the scale factor of each axis: of the Earth's rotation, and of gravity.
    gyro_misalignment, accelerometer_misalignment : float [rad]
        Misalignment of each axis toward each of the other two.
    """

    position: float = 0.0
    velocity: float = 0.0
    tilt: float = 0.0
    heading: float = 0.0
    gyro_bias: float = 0.0
    accelerometer_bias: float = 0.0
    gyro_scale: float = 0.0
    accelerometer_scale: float = 0.0
    gyro_misalignment: float = 0.0
    accelerometer_misalignment: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            number = isinstance(value, (int, float, np.floating, np.integer)) and not isinstance(value, bool)
            if not (number and math.isfinite(value) and value >= 0):
                raise InputError(
                    f"the initial standard deviation of {name} must be finite and not negative, not {value!r}"
                )
            object.__setattr__(self, name, float(value))


class ReckoningRemark(StrEnum):
    """What is to be known of a budget."""

    NO_MODEL = "no model of a sensor"
    NOTHING_STATED = "nothing wrong at the start"
    VERTICAL_KEPT = "vertical bias kept"
    VERTICAL_REMOVED = "vertical bias removed"
    SECOND_ORDER = "second order of the tilt"
    LIMITS = "not resolved"
    NO_INTERVALS = "no intervals"
    NOT_LINEAR = "beyond the linear model"
    ENDS = "not resolved beyond a time"
    INFLATED = "inflated"
    UNDECIDED = "noise not decided"
    EXTRAPOLATED = "beyond the record"


@dataclass(frozen=True, slots=True, kw_only=True)
class Source(Result):
    """One source of error.

    Attributes
    ----------
    name : str
        "gyro N", "accelerometer turn-on bias", "initial heading"; all axes together.
    sensor : str
        "gyro", "accelerometer", or "" for an initial error of the navigation.
    symbol : str
        Letter of the noise term, "GM" for a Gauss-Markov term; "" for what is not noise.
    is_limit : bool
        The record does not resolve the term: `sd` is what the model holds of it, mostly nothing, and `upper` what it
        may be.
    sd, lower, upper : ndarray, shape (n_times, n_quantities)
        One standard deviation, and the ends of its interval; NaN where the model states none, infinite where its end
        is open.
    """

    name: str
    sensor: str
    symbol: str
    is_limit: bool
    sd: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeadReckoning(Result):
    """Errors of dead reckoning over time.

    Attributes
    ----------
    remarks : tuple of ReckoningRemark
        Codes of what is to be known of it.
    times : ndarray, shape (n_times,) [s]
        Since the beginning.
    shown : tuple of float [s]
        Those of the tables.
    quantities : tuple of str
        Columns of all arrays; position in m, velocity in m/s, tilt and heading in rad. `position_horizontal`,
        `velocity_horizontal` and `tilt` are root sums of squares of north and east: √2 of one axis where both are
        alike.
    sources : tuple of Source
        The largest of the horizontal position at the end first.
    sd, lower, upper : ndarray, shape (n_times, n_quantities)
        Total of all sources and its interval at `confidence`. The ends are NaN where a model states none. All are NaN
        beyond the linear error model (`LINEAR`).
    confidence : float
        Level of the intervals.
    duration : float [s]
        Without aiding.
    latitude : float [rad]
        Where the unit stands.
    heading : float [rad]
        Of the x axis, clockwise from north.
    rest : float or None [s]
        At rest before the start, to level the unit and to take the biases of the gyros off.
    vertical : bool
        The mean of the vertical accelerometer at rest, less normal gravity, is removed as well.
    held : bool
        Something else holds the height.
    rate : float [Hz]
        Samples per second.
    initial : InitialErrors
        Standard deviations of what is wrong at the start.
    sinking : ndarray, shape (n_times,) [m]
        How much lower the unit believes to be on average by the second order of the tilt, g tilt^2/2, which a linear
        model leaves out; it is in no standard deviation. 0 where the height is held.
    linear_until : float or None [s]
        From then on an attitude is wrong by more than the linear model allows; None: it never is.
    other_family : float or None [m]
        Horizontal position at the end with the other family of noise; None where the record decides between them.
    record : float or None [s]
        Length of the shortest record that a model was fitted to; None where none states it.
    models : mapping of str to NoiseModel
        Of each channel.
    """

    FORMAT: ClassVar[str] = "allanite-dead-reckoning"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks",)

    times: Array
    shown: tuple[float, ...]
    quantities: tuple[str, ...]
    sources: tuple[Source, ...]
    sd: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    confidence: float
    duration: float
    latitude: float
    heading: float
    rest: float | None
    held: bool
    vertical: bool
    rate: float
    initial: InitialErrors
    sinking: Array = field(repr=False)
    linear_until: float | None
    other_family: float | None = None
    record: float | None = None
    models: Mapping[str, NoiseModel] = field(repr=False)

    def __post_init__(self) -> None:
        """Remove what is beyond the linear model; documents of earlier versions hold it."""
        linear = np.logical_and.accumulate(is_linear(self.sd))
        sd, lower, upper = _within(self, linear)
        sources: list[Source] = []
        for source in self.sources:
            source_sd, low, high = _within(source, linear)
            sources.append(replace(source, sd=source_sd, lower=low, upper=high))
        sinking = np.where(linear, self.sinking, np.nan)
        parts = {"sd": sd, "lower": lower, "upper": upper, "sources": tuple(sources), "sinking": sinking}
        for name, value in parts.items():
            object.__setattr__(self, name, value)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        return upgraded(data) if data.get("version") == 1 else data

    def __getitem__(self, quantity: str) -> Array:
        """Standard deviation of one quantity over `times`.

        Raises
        ------
        InputError
            No such quantity.
        """
        return self.sd[:, self.column(quantity)]

    def by_source(self, quantity: str) -> dict[str, Array]:
        """Standard deviation of one quantity over `times`, by name of the source.

        Raises
        ------
        InputError
            No such quantity.
        """
        column = self.column(quantity)
        return {s.name: s.sd[:, column] for s in self.sources}

    def column(self, quantity: str) -> int:
        """Of a quantity in all arrays.

        Raises
        ------
        InputError
            No such quantity.
        """
        if quantity not in self.quantities:
            raise InputError(f"no quantity {quantity!r}; there are: {', '.join(self.quantities)}")
        return self.quantities.index(quantity)

    @property
    def last(self) -> int:
        """Index of the last time at which the errors are resolved."""
        return max(int(np.count_nonzero(np.isfinite(self.sd[:, 0]))) - 1, 0)

    @property
    def resolved_until(self) -> float | None:
        """Time at which the linear error model ends [s]; None if it covers the whole duration."""
        return None if self.last == len(self.times) - 1 else float(self.times[self.last])

    @property
    def rows(self) -> list[int]:
        """Where the shown times stand in all arrays."""
        return [int(np.argmin(np.abs(self.times - time))) for time in self.shown]

    def to_columns(self) -> Columns:
        """Those of `table`."""
        rows = [*self.table()]
        return {key: [row[key] for row in rows] for key in rows[0]}

    def table(self) -> Iterator[dict[str, object]]:
        """One row for each shown time, source and "all", and quantity: sd, lower, upper in SI."""
        for time, at in zip(self.shown, self.rows, strict=True):
            for name, part in [("all", self), *((s.name, s) for s in self.sources)]:
                for i, quantity in enumerate(self.quantities):
                    ends = {end: float(getattr(part, end)[at, i]) for end in ("sd", "lower", "upper")}
                    yield {"time_s": time, "source": name, "quantity": quantity, **ends}

    def largest(self, quantity: str, most: int) -> Sequence[Source]:
        """The sources that matter most at any shown time, in their order."""
        column, rows = self.column(quantity), self.rows
        whole = np.where(self.sd[rows, column] > 0, self.sd[rows, column], np.inf)
        weights = {s.name: float(np.nanmax(s.sd[rows, column] / whole, initial=0.0)) for s in self.sources}
        kept = sorted(weights, key=weights.__getitem__, reverse=True)[:most]
        return [s for s in self.sources if s.name in kept and weights[s.name] > 0.01]

    # -- words ------------------------------------------------------------------------------------------------

    @property
    def says(self) -> str:
        """The errors at the end in a sentence; where they are not resolved there, those at the last time that is."""
        at = {name: float(self.sd[self.last, i]) for i, name in enumerate(self.quantities)}
        first, whole = self.sources[0], at["position_horizontal"]
        share = float(first.sd[self.last, self.column("position_horizontal")]) / whole if whole > 0 else 0.0
        last, ends = float(self.times[self.last]), self.resolved_until is not None
        return words.errors(last, at, share**2, first.name, ends=ends)

    @property
    def remarks(self) -> tuple[ReckoningRemark, ...]:
        """Codes of what is to be known of it."""
        return tuple(code for code, _ in self._remarks())

    @property
    def notes(self) -> tuple[str, ...]:
        """The remarks in sentences."""
        return tuple(sentence for _, sentence in self._remarks())

    def _remarks(self) -> Iterator[tuple[ReckoningRemark, str]]:
        if self.resolved_until is not None:
            yield ReckoningRemark.ENDS, words.ends(self.resolved_until, self._nearest_limit())
        kinds = {s.sensor for s in self.sources}
        for sensor in _SENSORS:
            if sensor not in kinds:
                yield ReckoningRemark.NO_MODEL, words.no_model(sensor)
        if self.initial == InitialErrors():
            yield ReckoningRemark.NOTHING_STATED, words.NOTHING_STATED
        if self.rest is not None and not self.held and "accelerometer" in kinds:
            if self.vertical:
                yield ReckoningRemark.VERTICAL_REMOVED, words.VERTICAL_REMOVED
            else:
                yield ReckoningRemark.VERTICAL_KEPT, words.VERTICAL_KEPT
        sinking = float(self.sinking[self.last])
        if sinking > _SECOND_ORDER * self.sd[self.last, self.column("position_down")]:
            yield ReckoningRemark.SECOND_ORDER, words.second_order(sinking)
        if limits := [s.name for s in self.sources if s.is_limit]:
            yield ReckoningRemark.LIMITS, words.not_resolved(limits)
        if not np.isfinite(self.lower).any():
            yield ReckoningRemark.NO_INTERVALS, words.NO_INTERVALS
        yield from self._limits_of_models()

    def _nearest_limit(self) -> str:
        """The error that is nearest to the end of the linear model."""
        return max(LINEAR, key=lambda name: float(self[name][self.last]) / LINEAR[name])

    def _limits_of_models(self) -> Iterator[tuple[ReckoningRemark, str]]:
        """Where the linear model and those of the noise end."""
        if self.linear_until is not None and self.linear_until <= self.times[self.last]:
            yield ReckoningRemark.NOT_LINEAR, words.not_linear(self.linear_until)
        for name, model in self.models.items():
            if model.overbound is not None:
                yield ReckoningRemark.INFLATED, words.inflated(name)
        if self.other_family is not None:
            yield ReckoningRemark.UNDECIDED, words.undecided(self.other_family)
        if self.record is not None and self.record < self.duration:
            yield ReckoningRemark.EXTRAPOLATED, words.extrapolated(self.record)


def is_linear(errors: Array) -> NDArray[np.bool_]:
    """At which times errors of the quantities are inside of the linear model; not where they are no numbers."""
    columns = [list(QUANTITIES).index(name) for name in LINEAR]
    return np.asarray((errors[:, columns] <= np.array([*LINEAR.values()])).all(axis=1))


def _within(part: DeadReckoning | Source, linear: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Its arrays without numbers beyond the linear model; an upper end that is beyond it is open."""
    sd, lower, upper = (np.where(linear[:, None], a, np.nan) for a in (part.sd, part.lower, part.upper))
    open_ = np.isfinite(upper).all(axis=1) & ~is_linear(upper)
    return sd, lower, np.where(open_[:, None], np.inf, upper)
