# SPDX-License-Identifier: BSD-3-Clause
"""A self-calibration in people's words: parameters in their units, positions, turns, and what the positions leave open.

Everything here reads the plain document of a `CalibrationEstimate`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from allanite.quantities.number_words import duration, interval, number
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.views.wording.rates import DEG, DEG_H, angle

__all__ = [
    "CalibrationLine",
    "DisplayUnit",
    "ParameterGroup",
    "calibrated_words",
    "calibration_facts",
    "calibration_name",
    "earth_seen_words",
    "parameter_groups",
    "position_lines",
    "rest_unit",
    "scatter_lines",
    "sensor_words",
    "still_open",
    "turn_lines",
]

Json = Mapping[str, Any]

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
    "estimated": "",
    "assumed": "not observable, assumed",
    "not resolved": "not resolved",
    "held": "held as given",
}
_SCATTERED = {"m/s²": ("mg", _MG), "rad/s": ("deg/h", DEG_H), "rad": ("mrad", 1e-3)}


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
    advice : str
    """

    name: str
    value: str
    range: str
    x: float
    low: float
    high: float
    estimated: bool
    status: str
    advice: str


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
        return _kind(self.kind)


# -- parameters -------------------------------------------------------------------------------------------


def calibration_name(name: str) -> str:
    """A parameter for people.

    >>> calibration_name("gyro.bias_temperature_x"), calibration_name("accelerometer.misalignment_xy")
    ('gyro bias per kelvin x', 'accelerometer misalignment xy')
    """
    sensor, _, rest = name.partition(".")
    kind, _, axis = rest.rpartition("_")
    return f"{sensor} {_kind(kind).lower()} {axis}"


def _kind(kind: str) -> str:
    return _KINDS.get(kind, kind.replace("_", " ").capitalize())


def sensor_words(sensor: str) -> str:
    """Heading of a triad."""
    return _SENSORS[sensor]


def parameter_groups(document: Json) -> list[ParameterGroup]:
    """The parameters by triad and kind, each kind in the unit in which it has the fewest zeros."""
    kinds: dict[tuple[str, str], list[Json]] = {}
    for row in document["parameters"]:
        sensor, _, rest = row["name"].partition(".")
        kinds.setdefault((sensor, rest.rpartition("_")[0]), []).append(row)
    return [_group(sensor, kind, rows) for (sensor, kind), rows in kinds.items()]


def _group(sensor: str, kind: str, rows: Sequence[Json]) -> ParameterGroup:
    unit = _unit(kind, rows)
    lines = tuple(_line(row, unit) for row in rows)
    return ParameterGroup(sensor=sensor, kind=kind, unit=unit.text, lines=lines)


def _line(row: Json, unit: DisplayUnit) -> CalibrationLine:
    x, low, high = (unit.shown(v) for v in (row["value"], *row["interval"]))
    value, lower, upper = interval(x, low, high)
    return CalibrationLine(
        name=row["name"].rpartition("_")[2],
        value="–" if row["status"] == "not resolved" else value,
        range=f"[{lower}, {upper}]",
        x=x,
        low=low,
        high=high,
        estimated=row["status"] == "estimated",
        status=_STATUS.get(row["status"], str(row["status"])),
        advice="; ".join(row["advice"]),
    )


def _unit(kind: str, rows: Sequence[Json]) -> DisplayUnit:
    """The unit of a kind; where there are two, the one in which its largest number has a digit before the point."""
    unit = rows[0]["unit"]
    nominal = 1.0 if kind == "scale" and unit == "1" else 0.0
    known = [row for row in rows if row["status"] == "estimated"] or rows
    size = max(abs(end - nominal) for row in known for end in row["interval"])
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


def still_open(document: Json) -> list[tuple[str, str]]:
    """What the positions leave open, with what to do: parameters that need the same stand together."""
    rows: dict[tuple[str, ...], list[str]] = {}
    for row in document["parameters"]:
        if row["status"] in ("assumed", "not resolved"):
            rows.setdefault(tuple(row["advice"]), []).append(calibration_name(row["name"]))
    return [(_listed(names), _to_do(advice, document["add"])) for advice, names in rows.items()]


def _to_do(advice: Sequence[str], add: Sequence[str]) -> str:
    """Positions are added; anything else speaks for itself."""
    words = "; ".join(advice)
    return f"add: {words}" if words and set(advice) <= set(add) else words


def _listed(names: Sequence[str]) -> str:
    """Names of one sensor and kind are written once: "gyro scale factor x, y, z"."""
    stems: dict[str, list[str]] = {}
    for name in names:
        stem, _, axis = name.rpartition(" ")
        stems.setdefault(stem, []).append(axis)
    return "; ".join(f"{stem} {', '.join(axes)}" for stem, axes in stems.items())


# -- positions and turns ----------------------------------------------------------------------------------


def rest_unit(document: Json) -> tuple[str, float]:
    """Unit for what an accelerometer reads at rest less gravity, and its size [m/s²]."""
    sizes = [abs(p[k] or 0.0) for p in document["positions"] for k in ("excess", "excess_sd")]
    return ("mg", _MG) if max(sizes, default=0.0) >= 0.1 * _MG else ("µg", _UG)


def position_lines(document: Json) -> list[tuple[str, ...]]:
    """Number, which way was up, from and to [s], length, excess of |f| over g, rate left, misfit, and what of it."""
    _, size = rest_unit(document)
    return [
        (
            str(p["number"]),
            p["words"] or "–",
            "–" if p["start"] is None else f"{p['start']:.1f} to {p['stop']:.1f} s",
            _with_sd(p["excess"], p["excess_sd"], size),
            _longest(p["rate"], p["rate_sd"]),
            number(p["misfit"], 2),
            "outlier" if p["outlier"] else "" if p["used"] else p["why"],
        )
        for p in document["positions"]
    ]


def turn_lines(document: Json) -> list[tuple[str, ...]]:
    """From, to, angle, what the integrated rates leave of it, misfit, and what of it."""
    return [
        (
            f"{t['before']} to {t['after']}",
            angle(t["angle"], 4),
            _rotation(t["residual"]),
            number(t["misfit"], 2),
            "outlier" if t["outlier"] else "" if t["used"] else f"not used: {t['why']}" if t["why"] else "not used",
        )
        for t in document["turns"]
    ]  # fmt: skip


def _with_sd(value: float | None, sd: float | None, factor: float) -> str:
    if value is None or sd is None:
        return "–"
    middle, _, _ = interval(value / factor, (value - sd) / factor, (value + sd) / factor)
    return f"{middle} ± {number(sd / factor, 2)}"


def _longest(rate: Sequence[float | None] | None, sd: Sequence[float | None] | None) -> str:
    """Of three axes the one that lies farthest from zero, in deg/h."""
    if rate is None or sd is None:
        return "–"
    known = [(r, s, a) for r, s, a in zip(rate, sd, "xyz", strict=True) if r is not None and s]
    if not known:
        return "–"
    r, s, axis = max(known, key=lambda part: abs(part[0] / part[1]))
    return f"{_with_sd(r, s, DEG_H)} ({axis})"


def _rotation(residual: Sequence[float | None] | None) -> str:
    if residual is None or any(r is None for r in residual):
        return "–"
    return f"{number(math.hypot(*(r for r in residual if r is not None)) * 1e3, 3)} mrad"


# -- the rest ---------------------------------------------------------------------------------------------


def scatter_lines(document: Json) -> list[tuple[str, str, str]]:
    """What was observed, its scatter over that of the noise, and what was added to the noise for it."""
    return [(s["what"], number(s["ratio"], 3), _added(s, document["duration"])) for s in document["scatter"]]


def _added(scatter: Json, seconds: float | None) -> str:
    """Scatter of each span or turn, and a drift that the spans by themselves do not show."""
    unit, size = _SCATTERED.get(scatter["unit"], (scatter["unit"], 1.0))
    drift = scatter["walk"] * math.sqrt(seconds or 0.0)  # of a random walk, over the record
    parts = [f"{number(scatter['sd'] / size, 2)} {unit}"] if scatter["sd"] else []
    parts += [f"a drift of {number(drift / size, 2)} {unit} over the record"] if drift else []
    return " and ".join(parts) or "nothing"


def earth_seen_words(document: Json) -> str:
    """The rotation of the Earth as the gyros saw it; nothing without gyros."""
    earth = document["earth"]
    if earth is None:
        return ""
    known = f"{number(earth['expected'] / DEG_H, 4)} deg/h"
    if earth["length"] is None or earth["length_sd"] is None:
        return f"not seen; expected {known}"
    measured = _with_sd(earth["length"], earth["length_sd"], DEG_H)
    use = "used for the scale factors" if earth["resolved"] else "seen too weakly to be used"
    return f"{measured} deg/h (1 sd), expected {known}: {use}"


def calibrated_words(document: Json) -> str:
    """How much was used.

    >>> position = {"used": True, "start": 0.0, "stop": 30.0}
    >>> calibrated_words({"positions": [position, {**position, "used": False}], "turns": [], "spans_source": "found"})
    '1 of 2 positions (found in the signal), 30 s at rest'
    """
    used = [p for p in document["positions"] if p["used"]]
    count = (
        f"{len(used)} of {len(document['positions'])}"
        if len(used) < len(document["positions"])
        else f"{len(used)}"
    )
    sources = {"found": "found in the signal", "rows of means": "rows of means"}
    turns = sum(t["used"] for t in document["turns"])
    words = f"{count} position{'s' * (count != '1')} ({sources.get(document['spans_source'], 'as given')})"
    if all(p["start"] is not None for p in used):
        words += f", {duration(sum(p['stop'] - p['start'] for p in used))} at rest"
    return f"{words}; {turns} turn{'s' * (turns != 1)} between them" if document["turns"] else words


def calibration_facts(document: Json) -> list[tuple[str, str]]:
    """Gravity, latitude, temperature, noise: what the result rests on."""
    source = {
        "given": "as given",
        "latitude": "by latitude and height",
        "standard": "standard gravity, nothing given",
    }
    gravity = f"{document['gravity']:.5f} m/s² ({source.get(document['gravity_source'], document['gravity_source'])}"
    known = document["stated"].get("gravity")
    gravity += f", ± {known:g} stated)" if known else ")"
    span, reference = document["temperature_span"], document["calibration"]["temperature"]
    warm = "" if span is None else f"{number(span[0], 3)} to {number(span[1], 3)}{_degrees(document)}"
    warm += "" if reference is None else f"; the biases are those at {reference:g}{_degrees(document)}"
    sources = {"this record": "of this record", "given": document.get("model_name") or "given"}
    noise = sources.get(document["model_source"], document["model_source"])
    frame = document["calibration"]["frame"]
    rows = [
        ("used", calibrated_words(document)),
        ("gravity", gravity),
        ("latitude", "" if document["latitude"] is None else angle(document["latitude"])),
        ("Earth", earth_seen_words(document)),
        ("temperature", warm),
        ("body", f"{frame} axis of the {'accelerometers' if _has_force(document) else 'gyros'}"),
        ("noise", noise),
    ]
    return [(name, words) for name, words in rows if words]


def _degrees(document: Json) -> str:
    """Unit of the channel of temperature, where the document knows it."""
    channels = (document.get("recording") or {}).get("channels", ())
    return next((f" {c['unit']}" for c in channels if c["kind"] == "temperature"), "")


def _has_force(document: Json) -> bool:
    return any(row["name"].startswith("accelerometer.") for row in document["parameters"])
