# SPDX-License-Identifier: BSD-3-Clause
"""Channels of a study by sensor, a parameter of a channel with its interval or its upper limit, and one of three."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.quick_terms import with_quick_terms_white
from allanite.recording.channel_names import for_shell, ways_to_units

__all__ = [
    "ACCELEROMETER",
    "GIVE_BIAS",
    "GYROSCOPE",
    "SENSORS",
    "UNITS",
    "AxisNumbers",
    "HeaderNote",
    "Number",
    "axes_rule",
    "channels_of",
    "combined",
    "left_out",
    "parameter",
    "refuse_no_noise",
    "refuse_nothing",
    "without_slot",
]

Json = Mapping[str, Any]

GYROSCOPE, ACCELEROMETER = "gyroscope", "accelerometer"
SENSORS = (GYROSCOPE, ACCELEROMETER)
#: Units of N, and of K and walk, of each sensor.
UNITS = {
    GYROSCOPE: ("rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"),
    ACCELEROMETER: ("m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"),
}
_KINDS = {GYROSCOPE: ("rate", "angle"), ACCELEROMETER: ("acceleration", "velocity")}
#: What a user may do whose model says nothing of the bias.
GIVE_BIAS = "give a model with K or B, or a study, whose upper limit is used"
_TERM_OF = {"N": "white", "B": "flicker", "K": "random_walk"}
_RULES = {
    "worst": "one number for all axes, from the worst axis for each parameter",
    "rms": "one number for all axes, the root mean square of the axes",
    "each": "each axis has its own number, in the order x, y, z of the channels below",
}


def channels_of(document: Json, sensor: str, wanted: Sequence[str] | None) -> list[Json]:
    """The channels of one triad; by default all of the sensor.

    Raises
    ------
    InputError
        No such channel, or more than three.
    """
    of_kind = [c for c in document["channels"] if c["kind"] in _KINDS[sensor]]
    if wanted is not None:
        by_name = {c["name"]: c for c in of_kind}
        missing = [name for name in wanted if name not in by_name]
        if missing:
            raise InputError(f"no {sensor} channel {missing[0]!r}; there are: {', '.join(by_name) or 'none'}")
        of_kind = [by_name[name] for name in wanted]
    if len(of_kind) > 3:
        names = ", ".join(c["name"] for c in of_kind)
        raise InputError(
            f"{len(of_kind)} {sensor} channels ({names}): name the three of one triad, {_naming(sensor, '…', '…')}"
        )
    refused = [c["name"] for c in of_kind if not c["models"]]
    if refused:
        raise InputError(_without_model(document, sensor, of_kind, refused))
    dt = 1 / document["recording"]["rate"]
    return [{**c, "models": [_without_bandwidth(m, dt) for m in c["models"]]} for c in of_kind]


def _without_bandwidth(model: Json, dt: float) -> Json:
    """A model in whose N the Gauss-Markov terms of a few samples are: no consumer has a slot for them."""
    known = NoiseModel.from_json(model)
    white = with_quick_terms_white(known, dt)
    return model if white is known else white.to_json()


def _without_model(document: Json, sensor: str, kept: Sequence[Json], refused: Sequence[str]) -> str:
    """What is to be done where channels of a sensor have no noise model."""
    lacking = f"channel {refused[0]!r} has no noise model"
    if len(refused) > 1:
        lacking = f"the channels {', '.join(refused)} have no noise model"
    left = ",".join(c["name"] for c in kept if c["name"] not in refused)
    others = ",".join(c["name"] for c in document["channels"] if c["models"])
    if left:
        return (
            f"{lacking}: leave {'it' if len(refused) == 1 else 'them'} out, {_naming(sensor, left, others)}"
        )
    if others:
        return f"{lacking}: leave the {sensor} out, with --channels {for_shell(others)} of `allanite characterize`"
    return f"{lacking}, nor has any other: see the findings of the study"


def _naming(sensor: str, names: str, all_names: str) -> str:
    """How channels are named where a file is made of a study, and where the study is made."""
    return (
        f"with --channels {for_shell(all_names)} of `allanite characterize`, or --{sensor} {for_shell(names)} of "
        f"`allanite export` ({sensor}= of export)"
    )


def refuse_nothing(document: Json, chosen: Mapping[str, Sequence[Json]], file: str) -> None:
    """Raise where no channel of any sensor is there."""
    if not any(chosen.values()):
        channels = document["channels"]
        kinds = ", ".join(f"{c['name']} ({c['kind']})" for c in channels)
        raise InputError(
            f"{file} needs an angular rate or an acceleration in known units; the study holds {kinds or 'no channel'}"
            f"{_way_out(channels)}"
        )


def _way_out(channels: Sequence[Json]) -> str:
    """What makes a rate or an acceleration of channels, if anything does."""
    way = ways_to_units([(c["name"], c["kind"]) for c in channels])
    return f". Characterize again: {way}" if way else ""


@dataclass(frozen=True, slots=True)
class Number:
    """A parameter as it is used: its value, or the 95 % upper limit where the record does not resolve it.

    Attributes
    ----------
    symbol : str
    value : float [SI]
    text : str
        With its interval, or that it is a limit.
    has_interval : bool
    is_out : bool
        The file has no slot for it.
    """

    symbol: str
    value: float
    text: str
    has_interval: bool = False
    is_out: bool = False

    def left_out(self) -> Number:
        """The same in a file without a slot for it."""
        return replace(self, text=self.text.replace(", used", ""), is_out=True)


@dataclass(frozen=True, slots=True)
class HeaderNote:
    """What the head of a file says of one model: the parameters that it holds or leaves out, and no other."""

    numbers: tuple[Number, ...]

    @property
    def there(self) -> tuple[Number, ...]:
        """Without those that are zero: the model has no such term."""
        return tuple(n for n in self.numbers if n.value != 0)

    def __str__(self) -> str:
        return "; ".join(f"{n.symbol} {n.text}{' LEFT OUT' * n.is_out}" for n in self.there)


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisNumbers:
    """What was read of one channel, the larger numbers where it has two models; its bias is that of the consumer.

    Attributes
    ----------
    name : str
    noise : float
        N in SI.
    notes : tuple of HeaderNote
        One of each model.
    """

    name: str
    noise: float
    notes: tuple[HeaderNote, ...]


#: Terms that no consumer of noise has a slot for: their symbols, and the unit of a gyroscope's and an accelerometer's.
_NOWHERE: Mapping[str, tuple[str, dict[str, str]]] = {
    "quantisation": ("Q", {GYROSCOPE: "rad", ACCELEROMETER: "m/s"}),
    "ramp": ("R", {GYROSCOPE: "rad/s^2", ACCELEROMETER: "m/s^3"}),
    "sinusoid": ("amplitude", {GYROSCOPE: "rad/s", ACCELEROMETER: "m/s^2"}),
}


def without_slot(model: Json, kind: str) -> list[Number]:
    """Terms of a model of a channel of this kind that are left out of every file."""
    sensor = next(sensor for sensor, kinds in _KINDS.items() if kind in kinds)
    return [
        Number(_NOWHERE[t["type"]][0], value, f"{value:.4e} {_NOWHERE[t['type']][1][sensor]}", is_out=True)
        for t in model["terms"]
        if t["type"] in _NOWHERE and (value := t[_NOWHERE[t["type"]][0]])
    ]


def parameter(channel: str, model: Json, symbol: str, file: str) -> Number:
    """A parameter of a fitted model, or of a bare sum of terms (where an absent term is zero).

    Parameters
    ----------
    symbol : "N", "B" or "K"
        B of a Gauss-Markov model is that of the flicker with the same peak.
    file : str
        That needs it, for the message.

    Raises
    ------
    InputError
        Neither a value nor a limit.
    """
    estimates = model.get("estimates") or ()
    names = ("B", "B_equiv") if symbol == "B" else (symbol,)
    estimate = next((e for e in estimates if e["symbol"] in names), None)
    if estimate is None and not estimates:
        values = [t[symbol] for t in model["terms"] if t["type"] == _TERM_OF[symbol]]
        value = math.sqrt(sum(v * v for v in values))
        return Number(symbol, value, f"{value:.4e}")
    if estimate is not None and estimate["supported"] and estimate["value"] is not None:
        span = f" [{_text(estimate['lower'])}, {_text(estimate['upper'])}]"
        with_term = (
            f" {estimate['note']}" if symbol == "N" and estimate.get("note", "").startswith("with ") else ""
        )
        return Number(
            symbol, estimate["value"], f"{estimate['value']:.4e}{span}{with_term}", has_interval=True
        )
    if estimate is None or estimate["upper"] is None or not math.isfinite(estimate["upper"]):
        raise InputError(
            f"channel {channel!r}: {symbol} has neither a value nor an upper limit for {file}; fit with {symbol} "
            "among the terms, or record longer"
        )
    return Number(symbol, estimate["upper"], f"< {estimate['upper']:.4e} (95 % upper limit, used)")


def refuse_no_noise(channel: str, noises: Sequence[Number], consumer: str) -> None:
    """Raise where a model of a channel has no white noise: no consumer takes a sensor without."""
    if min(noise.value for noise in noises) <= 0:
        raise InputError(
            f"channel {channel!r}: {consumer} must have white noise above zero, and the model has none: give one with N"
        )


def left_out(channel: str, model: Json, symbol: str, file: str) -> Number:
    """A parameter that a file has no place for, with its value, its limit, or neither."""
    try:
        return parameter(channel, model, symbol, file).left_out()
    except InputError:  # nothing is known of what is left out anyway
        return Number(symbol, math.nan, "unknown", is_out=True)


def _text(value: float | None) -> str:
    return "?" if value is None else f"{value:.4e}"


# -- three axes ---------------------------------------------------------------------------------------------


def axes_rule(axes: str, *, per_axis: bool) -> str:
    """The comment on a rule for three axes.

    Raises
    ------
    InputError
        Not "worst" or "rms", nor "each" where the consumer has a slot for each axis.
    """
    able = ("worst", "rms", "each") if per_axis else ("worst", "rms")
    if axes not in able:
        listed = " or ".join(repr(a) for a in able) if len(able) == 2 else "'worst', 'rms' or 'each'"
        alone = ": the file has one number for three axes; the comment lists each" if axes == "each" else ""
        raise InputError(f"axes must be {listed}, not {axes!r}{alone}")
    return _RULES[axes]


def combined(values: Sequence[float], axes: str, sensor: str) -> tuple[float, ...]:
    """The numbers of a triad: one, or three where each axis has its own.

    Raises
    ------
    InputError
        "each" of other than three axes.
    """
    if axes == "worst":
        return (max(values),)
    if axes == "rms":
        return (math.sqrt(sum(v * v for v in values) / len(values)),)
    if len(values) != 3:
        raise InputError(
            f"axes='each' needs three {sensor} channels, and there are {len(values)}: take 'worst' or 'rms'"
        )
    return tuple(values)
