# SPDX-License-Identifier: BSD-3-Clause
"""The parameters of a self-calibration in people's words: names, units and the digits that their intervals allow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from allanite.experiments.calibration.results import CalibrationEstimate, CalibrationParameter
from allanite.experiments.calibration.verdict import ParameterStatus
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.number_words import interval
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.views.wording.rates import DEG, DEG_H

__all__ = [
    "CalibrationLine",
    "DisplayUnit",
    "ParameterGroup",
    "calibration_name",
    "parameter_groups",
    "rest_unit",
    "sensor_words",
]

_MG, _UG = 1e-3 * STANDARD_GRAVITY, 1e-6 * STANDARD_GRAVITY
_ARCSEC = DEG / 3600
_KINDS = {
    "bias": "Bias",
    "scale": "Scale factor",
    "misalignment": "Misalignment",
    "quadratic": "Quadratic term",
    "bias_temperature": "Bias per kelvin",
    "gravity_sensitivity": "Gravity sensitivity",
}
_SENSORS = {"accelerometer": "Accelerometers", "gyro": "Gyros"}
_STATUS = {
    ParameterStatus.ESTIMATED: "",
    ParameterStatus.ASSUMED: "not observable, assumed",
    ParameterStatus.NOT_RESOLVED: "not resolved",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplayUnit:
    """How people read a number: the unit, its size in that of the document, and what is removed before."""

    text: str
    factor: float = 1.0
    nominal: float = 0.0

    def shown(self, value: float) -> float:
        """The number that people read."""
        return (value - self.nominal) / self.factor


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationLine:
    """A parameter.

    Attributes
    ----------
    name : str
        Its axis, or its two axes: "x", "xy".
    value, range : str
        In the unit of its group.
    x, low, high : float
        The same as numbers.
    estimated : bool
    status : str
        Nothing where it was estimated.
    """

    name: str
    value: str
    range: str
    x: float
    low: float
    high: float
    estimated: bool
    status: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterGroup:
    """Parameters of one kind of one triad, in one unit."""

    sensor: str
    kind: str
    unit: str
    lines: tuple[CalibrationLine, ...]

    @property
    def name(self) -> str:
        """The kind in words."""
        return _KINDS[self.kind]


def calibration_name(name: str) -> str:
    """A parameter for people.

    >>> calibration_name("gyro.bias_temperature_x"), calibration_name("accelerometer.misalignment_xy")
    ('gyro bias per kelvin x', 'accelerometer misalignment xy')
    """
    sensor, _, rest = name.partition(".")
    kind, _, axis = rest.rpartition("_")
    return f"{sensor} {_KINDS[kind].lower()} {axis}"


def sensor_words(sensor: str) -> str:
    """Heading of a triad."""
    return _SENSORS[sensor]


def parameter_groups(parameters: Iterable[CalibrationParameter]) -> list[ParameterGroup]:
    """The parameters by triad and kind, each kind in the unit in which it has the fewest zeros."""
    kinds: dict[tuple[str, str], list[CalibrationParameter]] = {}
    for p in parameters:
        sensor, _, rest = p.name.partition(".")
        kinds.setdefault((sensor, rest.rpartition("_")[0]), []).append(p)
    return [_group(sensor, kind, of_kind) for (sensor, kind), of_kind in kinds.items()]


def _group(sensor: str, kind: str, parameters: Sequence[CalibrationParameter]) -> ParameterGroup:
    unit = _unit(kind, parameters)
    lines = tuple(_line(p, unit) for p in parameters)
    return ParameterGroup(sensor=sensor, kind=kind, unit=unit.text, lines=lines)


def _line(p: CalibrationParameter, unit: DisplayUnit) -> CalibrationLine:
    x, low, high = (unit.shown(v) for v in (p.value, *p.interval))
    value, lower, upper = interval(x, low, high)
    return CalibrationLine(
        name=p.name.rpartition("_")[2],
        value="–" if p.status is ParameterStatus.NOT_RESOLVED else value,
        range=f"[{lower}, {upper}]",
        x=x,
        low=low,
        high=high,
        estimated=p.status is ParameterStatus.ESTIMATED,
        status=_STATUS[p.status],
    )


def _unit(kind: str, parameters: Sequence[CalibrationParameter]) -> DisplayUnit:
    """The unit of a kind; where there are two, the one in which its largest number has a digit before the point."""
    unit = parameters[0].unit
    nominal = 1.0 if kind == "scale" and unit == "1" else 0.0
    known = [p for p in parameters if p.status is ParameterStatus.ESTIMATED] or parameters
    size = max(abs(end - nominal) for p in known for end in p.interval)
    for text, factor in _CHOICES.get((kind, unit), ()):
        if size >= factor:
            return DisplayUnit(text=text, factor=factor, nominal=nominal)
    smallest = _CHOICES.get((kind, unit), ((unit, 1.0),))[-1]
    return DisplayUnit(text=smallest[0], factor=smallest[1], nominal=nominal)


#: Units by kind and the unit of the document, the largest first.
_CHOICES: Mapping[tuple[str, str], tuple[tuple[str, float], ...]] = {
    ("bias", "m/s²"): (("mg", _MG), ("µg", _UG)),
    ("bias", "rad/s"): (("deg/s", DEG), ("deg/h", DEG_H)),
    ("scale", "1"): (("%", 1e-2), ("ppm", 1e-6)),
    ("misalignment", "rad"): (("mrad", 1e-3), ("arcsec", _ARCSEC)),
    ("quadratic", "1/(m/s²)"): (("µg/g²", 1e-6 / STANDARD_GRAVITY),),
    ("quadratic", "1/(rad/s)"): (("ppm/(deg/s)", 1e-6 / DEG),),
    ("bias_temperature", "m/s²/K"): (("mg/K", _MG), ("µg/K", _UG)),
    ("bias_temperature", "rad/s/K"): (("deg/h/K", DEG_H),),
    ("gravity_sensitivity", "rad/s/(m/s²)"): (
        ("deg/s/g", DEG / STANDARD_GRAVITY),
        ("deg/h/g", DEG_H / STANDARD_GRAVITY),
    ),
}


def rest_unit(result: CalibrationEstimate) -> tuple[str, float]:
    """Unit for what an accelerometer reads at rest less gravity, and its size [m/s²]."""
    sizes = [abs(value or 0.0) for p in result.positions for value in (p.excess, p.excess_sd)]
    return ("mg", _MG) if max(sizes, default=0.0) >= 0.1 * _MG else ("µg", _UG)
