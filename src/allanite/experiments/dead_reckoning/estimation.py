# SPDX-License-Identifier: BSD-3-Clause
"""dead_reckon(models, latitude): attitude, velocity and position errors over time, by source, with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.dead_reckoning.intervals import VariancePart, interval
from allanite.experiments.dead_reckoning.results import (
    QUANTITIES,
    DeadReckoning,
    InitialErrors,
    Source,
    is_linear,
)
from allanite.experiments.dead_reckoning.sources import AxisProcess, StartingPoint, initial_processes
from allanite.experiments.dead_reckoning.terms import SENSORS, AxisTerm, ReckoningSetting, entries, told
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.earth import checked_latitude

__all__ = ["LONGEST", "TIMES", "dead_reckon"]

Array = NDArray[np.float64]

#: Of the tables, as far as they fit in [s].
TIMES = (
    *(1.0, 3.0, 10.0, 30.0, 60.0, 180.0, 600.0, 1800.0, 3600.0, 7200.0, 21600.0, 86400.0),
    *(3 * 86400.0, 10 * 86400.0),
)
#: Longest duration [s].
LONGEST = 30 * 86400.0
#: Times between those of the tables, for curves: six to a doubling, twelve doublings.
_PER_OCTAVE, _OCTAVES = 6, 12
#: An attitude that is wrong by more is beyond the linear model: cos x is off by 1.5 % [rad].
_LINEAR = math.radians(10.0)


def dead_reckon(
    models: Mapping[str, NoiseModel] | NoiseModel,
    *,
    latitude: float,
    duration: float = 3600.0,
    times: Sequence[float] | None = None,
    initial: InitialErrors | None = None,
    rest: float | None = None,
    vertical: bool = False,
    heading: float = 0.0,
    held: bool = False,
    rate: float = 100.0,
) -> DeadReckoning:
    """What the noise of a unit costs a navigator: one-sigma errors of unaided dead reckoning, by source, over time.

    The unit is level, its axes forward, right and down, and stands still on the Earth; a navigator that does not know
    that integrates its gyros and accelerometers.

    Parameters
    ----------
    models : NoiseModel, or mapping of str to NoiseModel
        "gyro" and "accelerometer", for three equal and independent axes; or three channels of a kind, x, y, z in this
        order. If one kind is missing, its errors are not included, and the result reports it.
    latitude : float [rad]
        Latitude of the unit.
    duration : float [s]
        Time unaided.
    times : sequence of float, optional [s]
        Times of the tables; by default 1 s, 3 s, 10 s, ... and the duration.
    initial : InitialErrors, optional
        Standard deviations of the initial errors; none by default.
    rest : float, optional [s]
        Time at rest before the start, during which the accelerometers level the unit and the gyro means, less the
        Earth's rotation, are removed. None: the unit starts with its turn-on biases as stated by `initial`.
    vertical : bool
        At rest the mean of the vertical accelerometer, less normal gravity, is removed as its bias. Otherwise that
        bias stays in the height: b t^2/2.
    heading : float [rad]
        Heading of the x axis, clockwise from north; it matters if the axes differ.
    held : bool
        The height is aided, as by a barometer: unaided it diverges within minutes.
    rate : float [Hz]
        Samples per second, from which on flicker is held.

    Returns
    -------
    DeadReckoning

    Raises
    ------
    InputError
        No model of gyros or accelerometers, two of one kind, times that are not positive, a pole.

    Notes
    -----
    The covariance of the exact linear error model (`allanite.experiments.dead_reckoning.dynamics`), driven by the exact
    processes of the terms (`allanite.experiments.dead_reckoning.sources`). For t far below the period of Schuler (84
    min) the position by N, by a constant b and by K is N sqrt(t^3/3), b t^2/2 and K sqrt(t^5/20) of an accelerometer,
    and g N sqrt(t^5/20), g b t^3/6 and g K sqrt(t^7/252) of a gyro.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, White
    >>> gyro = NoiseModel.of(White(N=1e-4))
    >>> found = dead_reckon(gyro, latitude=0.8, duration=60.0, times=[60.0])
    >>> round(float(found["position_north"][-1]), 3), round(9.81 * 1e-4 * (60**5 / 20) ** 0.5, 3)
    (6.113, 6.117)
    """
    given = {"": models} if isinstance(models, NoiseModel) else dict(models)
    checked_latitude(latitude)
    begun = InitialErrors() if initial is None else initial
    _check(duration, rest, vertical, heading, rate)
    shown = _shown(times, duration)

    def found(noise_models: Mapping[str, NoiseModel]) -> DeadReckoning:
        setting = ReckoningSetting(
            place=StartingPoint(latitude=float(latitude), rest=rest, held=held, vertical=vertical),
            times=_grid(shown, duration),
            axes=_axes(heading),
            dt=1 / rate,
            span=duration + (rest or 0.0),
        )
        by_sensor = _by_sensor(noise_models)
        terms = [
            entry
            for sensor, names in by_sensor.items()
            for entry in entries(sensor, names, noise_models, setting)
        ]
        at_start = list(initial_processes(begun, setting.axes, setting.place, list(by_sensor)))
        return _result(terms, at_start, setting, noise_models, begun, heading, shown, duration)

    # after days an unaided height outgrows the range of numbers
    with np.errstate(over="ignore", invalid="ignore"):
        first = found({name: replace(model, alternative=None) for name, model in given.items()})
        if all(model.alternative is None for model in given.values()):
            return first
        other = found({name: model.alternative or model for name, model in given.items()})
    end = min(first.last, other.last)
    return replace(first, other_family=float(other["position_horizontal"][end]), models=given)


# -- what is asked for ------------------------------------------------------------------------------------------


def _check(duration: float, rest: float | None, vertical: bool, heading: float, rate: float) -> None:
    for name, value in (("duration", duration), ("rest", rest), ("rate", rate)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} must be positive, not {value!r}")
    if vertical and rest is None:
        raise InputError(
            "only a rest shows the bias of the vertical accelerometer: give rest (--rest) as well"
        )
    if duration > LONGEST:
        raise InputError(
            f"duration {duration:g} s: at most 30 days, since dead reckoning ends with the first fix"
        )
    if not math.isfinite(heading):
        raise InputError(f"heading must be a finite angle [rad], not {heading!r}")


def _shown(times: Sequence[float] | None, duration: float) -> tuple[float, ...]:
    if times is None:
        return (*(t for t in TIMES if t < 0.99 * duration), float(duration))
    shown_times = np.unique(np.atleast_1d(np.asarray(times, dtype=np.float64)))
    if (
        not len(shown_times)
        or not (np.isfinite(shown_times) & (shown_times > 0) & (shown_times <= duration)).all()
    ):
        raise InputError(f"times must lie between 0 and the duration, {duration:g} s; not {times!r}")
    return tuple(float(t) for t in shown_times)


def _grid(shown: tuple[float, ...], duration: float) -> Array:
    """Those of the tables, and those of smooth curves."""
    heads = duration * 2.0 ** (-np.arange(_PER_OCTAVE) / _PER_OCTAVE)
    dense = np.ldexp(heads[:, None], -np.arange(_OCTAVES)[None, :]).ravel()
    return np.unique(np.concatenate([shown, dense]))


def _axes(heading: float) -> Array:
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _by_sensor(given: Mapping[str, NoiseModel]) -> dict[str, list[str]]:
    """Names of the models of each kind of sensor: one for three axes alike, or one for each."""
    names_by_sensor = {}
    for sensor, kind in SENSORS.items():
        names = [name for name, model in given.items() if model.kind == kind]
        if len(names) not in (0, 1, 3):
            raise InputError(
                f"{len(names)} noise models of a {sensor}: {', '.join(names)}. Give one for three axes alike, or "
                "three: x, y, z"
            )
        if names:
            names_by_sensor[sensor] = names
    if not names_by_sensor:
        there = ", ".join(sorted({m.kind for m in given.values()})) or "nothing"
        raise InputError(f"dead reckoning needs noise models of gyros or accelerometers, not of {there}")
    return names_by_sensor


# -- the result ---------------------------------------------------------------------------------------------------


def _result(
    terms: Sequence[AxisTerm],
    initial: Sequence[tuple[str, str, list[AxisProcess]]],
    setting: ReckoningSetting,
    given: Mapping[str, NoiseModel],
    begun: InitialErrors,
    heading: float,
    shown: tuple[float, ...],
    duration: float,
) -> DeadReckoning:
    held = [told(entry, setting) for entry in terms]
    initial_variances = setting.variances([made for _, _, made in initial])
    rows: dict[str, _Row] = {}
    for entry, (value, parts) in zip(terms, held, strict=True):
        row = rows.setdefault(entry.name, _Row(sensor=entry.sensor, symbol=entry.symbol))
        row.add(value, parts, limit=entry.term is None)
    for (name, sensor, _), value in zip(initial, initial_variances, strict=True):
        rows.setdefault(name, _Row(sensor=sensor, symbol="")).add(value, [], limit=False)
    if not rows:
        raise InputError(
            "the noise models have no terms, and no initial errors are stated: there is no error to compute"
        )
    sources = [_source(name, row, given) for name, row in rows.items()]
    total, parts, stated = _all(list(rows.values()))
    lower, upper = interval(total, parts, given) if stated else (np.full_like(total, np.nan),) * 2
    sd = np.sqrt(total)
    end = np.count_nonzero(np.logical_and.accumulate(is_linear(sd))) - 1
    if end < 0:
        raise InputError(
            f"after {setting.times[0]:.3g} s the errors are beyond the linear error model: state smaller initial "
            "errors, or check the noise models"
        )
    sources.sort(key=lambda s: -float(s.sd[end, 0] or 1e-9 * np.nan_to_num(s.upper[end, 0], posinf=1.0)))
    return DeadReckoning(
        times=setting.times,
        shown=shown,
        quantities=tuple(QUANTITIES),
        sources=tuple(sources),
        sd=sd,
        lower=np.sqrt(lower),
        upper=np.sqrt(upper),
        confidence=min((m.confidence for m in given.values() if m.estimates), default=0.95),
        duration=float(duration),
        latitude=setting.place.latitude,
        heading=float(heading),
        rest=setting.place.rest,
        held=setting.place.held,
        vertical=setting.place.vertical,
        rate=1 / setting.dt,
        initial=begun,
        sinking=_sinking(setting, sd),
        linear_until=_linear_until(setting.times, sd),
        models=given,
    )


@dataclass(slots=True, kw_only=True)
class _Row:
    """A source while it is put together from its axes."""

    sensor: str
    symbol: str
    value: Array | None = None
    parts: list[VariancePart] = field(default_factory=list)
    stated: bool = True
    limits: list[bool] = field(default_factory=list)

    def add(self, value: Array, parts: list[VariancePart] | None, *, limit: bool) -> None:
        self.value = value if self.value is None else self.value + value
        self.stated = self.stated and parts is not None
        self.parts += parts or []
        self.limits.append(limit)


def _all(rows: Sequence[_Row]) -> tuple[Array, list[VariancePart], bool]:
    total = sum((row.value for row in rows if row.value is not None), start=np.zeros(1))
    return total, [part for row in rows for part in row.parts], all(row.stated for row in rows)


def _source(name: str, row: _Row, given: Mapping[str, NoiseModel]) -> Source:
    total, parts, stated = _all([row])
    lower, upper = interval(total, parts, given) if stated else (np.full_like(total, np.nan),) * 2
    return Source(
        name=name,
        sensor=row.sensor,
        symbol=row.symbol,
        is_limit=all(row.limits),
        sd=np.sqrt(total),
        lower=np.sqrt(lower),
        upper=np.sqrt(upper),
    )


def _sinking(setting: ReckoningSetting, sd: Array) -> Array:
    """Twice the integral of g tilt^2/2 over time."""
    if setting.place.held:
        return np.zeros(len(setting.times))
    t = np.concatenate([[0.0], setting.times])
    column = list(QUANTITIES).index("tilt")
    sinking = setting.place.gravity / 2 * np.concatenate([sd[:1, column], sd[:, column]]) ** 2
    for _ in range(2):
        sinking = np.concatenate([[0.0], np.cumsum(0.5 * (sinking[1:] + sinking[:-1]) * np.diff(t))])
    return np.asarray(sinking[1:])


def _linear_until(times: Array, sd: Array) -> float | None:
    names = list(QUANTITIES)
    far = sd[:, [names.index("tilt"), names.index("heading")]].max(axis=1) > _LINEAR
    return float(times[np.argmax(far)]) if far.any() else None
