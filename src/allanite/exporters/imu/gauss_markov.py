# SPDX-License-Identifier: BSD-3-Clause
"""White noise and a first-order Gauss-Markov bias (sigma, T): what simulators and GNSS/INS filters know.

A Gauss-Markov term goes in as it is. Flicker goes in as the term whose Allan deviation peaks at its floor, sigma =
1.0760 B, and needs the correlation time that it is to have. The random walk K has no slot beside it: it is left out,
and the file says so. With `walk` given the bias is a walk instead: a Gauss-Markov term of 1e6 s, driven by the walk of
that label (`allanite.exporters.imu.walks`), whose drift over t seconds is that of the walk within a part t/1e6 s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

from allanite.errors import InputError
from allanite.exporters.imu.axes import (
    SENSORS,
    UNITS,
    axes_rule,
    channels_of,
    combined,
    parameter,
    refuse_nothing,
)
from allanite.exporters.imu.preamble import Consumer, bound_lines, number_format, preamble
from allanite.exporters.imu.walks import WalkChoice, refuse_time, walk_choice
from allanite.exporters.triads import plain_line
from allanite.noise import SIGMA_PER_B, GaussMarkov

__all__ = ["WALK_TIME", "MarkovImu", "MarkovOptions", "common_time", "gauss_markov_imu"]

Json = Mapping[str, Any]

#: Correlation time of a Gauss-Markov term that stands for a walk [s].
WALK_TIME = 1e6


class MarkovOptions(TypedDict, total=False):
    """Options of every consumer of white noise and a Gauss-Markov bias.

    ``walk``: None (default, the bias is Gauss-Markov), or "upper-bound", "k-only" or "horizon=<seconds>": it is a walk.
    ``correlation_time``: T of the term that stands for flicker, and in place of a fitted T [s]. ``axes``: "worst",
    "rms", and "each" where the file has a number for each axis. ``inflate``: factor on N and sigma, written into the
    file. ``digits``: after the point. ``gyroscope``, ``accelerometer``: names of the channels of each triad.
    """

    walk: str | None
    axes: str | None
    inflate: float
    correlation_time: float | None
    digits: int
    gyroscope: Sequence[str] | None
    accelerometer: Sequence[str] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Axis:
    name: str
    noise: float
    sigma: float
    time: float
    K: float
    B: float
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkovImu:
    """The numbers of a file, combined and inflated as was asked; by sensor, one number or three.

    Attributes
    ----------
    rate : float [Hz]
    comments : tuple of str
        The head of the file, without a comment sign.
    noise : mapping of str to tuple of float
        N in SI.
    sigma : mapping of str to tuple of float
        Stationary standard deviation of the bias in SI.
    time : mapping of str to tuple of float [s]
    K : mapping of str to tuple of float
        The random walk in SI, where the bias is Gauss-Markov; zero where it is a walk and holds it.
    walks : bool
        The bias is a walk.
    style : str
    """

    rate: float
    comments: tuple[str, ...]
    noise: Mapping[str, tuple[float, ...]]
    sigma: Mapping[str, tuple[float, ...]]
    time: Mapping[str, tuple[float, ...]]
    K: Mapping[str, tuple[float, ...]]
    walks: bool
    style: str

    def density(self, sensor: str) -> tuple[float, ...]:
        """Driving root density of the bias, sigma sqrt(2/T)."""
        pairs = zip(self.sigma[sensor], self.time[sensor], strict=True)
        return tuple(s * math.sqrt(2 / t) for s, t in pairs)

    def text(self, value: float) -> str:
        """A number as the file has it."""
        return format(value, self.style)

    def row(self, values: Sequence[float], count: int = 3) -> str:
        """Numbers for each axis, the one of all repeated, between brackets."""
        given = tuple(values) * (count if len(values) == 1 else 1)
        return "[" + ", ".join(self.text(v) for v in given) + "]"

    def comment(self, sign: str = "#") -> list[str]:
        """The head as comment lines."""
        return [f"{sign} {line}".rstrip() for line in self.comments]


def gauss_markov_imu(
    document: Json,
    consumer: Consumer,
    *,
    walk: str | None = None,
    axes: str | None = None,
    inflate: float = 1.0,
    correlation_time: float | None = None,
    digits: int = 6,
    gyroscope: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    holds_K: bool = False,
    holds_flicker: bool = False,
) -> MarkovImu:
    """What a file says of a study; options are those of `MarkovOptions`.

    Parameters
    ----------
    holds_K : bool
        The consumer has a slot for the random walk beside the bias.
    holds_flicker : bool
        It has one for B: a model of flicker needs no correlation time, and its T is nan without one.

    Raises
    ------
    InputError
        As `white_and_walk`; flicker without a correlation time, two Gauss-Markov terms, no bias at all.
    """
    refuse_time(correlation_time)
    axes = axes or ("rms" if consumer.simulator else "worst")
    rule, style = axes_rule(axes, per_axis=consumer.per_axis), number_format(digits)
    if not (math.isfinite(inflate) and inflate > 0):
        raise InputError(f"inflate must be a positive factor, not {inflate!r}")
    choice = None if walk is None else walk_choice(walk, correlation_time, consumer.file)
    wanted = dict(zip(SENSORS, (gyroscope, accelerometer), strict=True))
    chosen = {sensor: channels_of(document, sensor, wanted[sensor]) for sensor in SENSORS}
    refuse_nothing(document, chosen, consumer.file)

    models = [m for channels in chosen.values() for c in channels for m in c["models"]]
    if choice is None and not holds_K and any(m.get("overbound") for m in models):
        raise InputError(
            f"a bound would lose its random walk in {consumer.file}: give walk='k-only', which writes it as the bias"
        )

    def read(channel: Json) -> _Axis:
        if choice is not None:
            return _walking(channel, choice, consumer)
        return _markov(channel, consumer, correlation_time, holds_K, holds_flicker)

    found = {sensor: [read(c) for c in channels] for sensor, channels in chosen.items()}
    words = _bias_words(correlation_time, holds_K) if choice is None else _walk_words(choice)
    lines = preamble(document, consumer, bias=words, axes=rule, inflate=inflate)
    lines += bound_lines([c for channels in chosen.values() for c in channels], consumer, axes)
    for sensor, own in found.items():
        lines += _table(sensor, own, consumer)
    there = {sensor: own for sensor, own in found.items() if own}

    def numbers(values: Mapping[str, list[float]], factor: float) -> dict[str, tuple[float, ...]]:
        return {s: tuple(factor * v for v in combined(own, axes, s)) for s, own in values.items()}

    return MarkovImu(
        rate=document["recording"]["rate"],
        comments=tuple(lines),
        noise=numbers({s: [a.noise for a in own] for s, own in there.items()}, inflate),
        sigma=numbers({s: [a.sigma for a in own] for s, own in there.items()}, inflate),
        time={s: _times(own, axes, s) for s, own in there.items()},
        K=numbers({s: [a.K for a in own] for s, own in there.items()}, inflate),
        walks=choice is not None,
        style=style,
    )


def common_time(imu: MarkovImu, file: str, sensors: Sequence[str]) -> float:
    """The one correlation time [s] of a file that has room for one.

    Raises
    ------
    InputError
        The axes have different ones.
    """
    times = sorted({t for s in sensors for t in imu.time.get(s, ())})
    if len(times) > 1 and times[-1] > times[0] * (1 + 1e-9):
        listed = ", ".join(f"{t:.4g}" for t in times)
        raise InputError(
            f"{file} has one correlation time, and the models have {listed} s: give correlation_time= for all of them"
        )
    return times[0]


def _times(axes_of: Sequence[_Axis], axes: str, sensor: str) -> tuple[float, ...]:
    """Of the axis with the largest sigma for the worst one; the geometric mean for the root mean square."""
    times = [a.time for a in axes_of]
    if axes == "each":
        return combined(times, axes, sensor)
    if axes == "worst":
        return (max(axes_of, key=lambda a: a.sigma).time,)
    return (math.exp(sum(math.log(t) for t in times) / len(times)),)


# -- one axis -------------------------------------------------------------------------------------------------


def _markov(
    channel: Json, consumer: Consumer, time: float | None, holds_K: bool, holds_flicker: bool
) -> _Axis:
    name, file = channel["name"], consumer.file
    models = channel["models"]
    noises = [parameter(name, m, "N", file) for m in models]
    own = [_term(name, m, consumer) for m in models]
    fitted = next((t.T for t in own if t is not None), None)
    used = time if time is not None else fitted
    sigmas, walks, notes = [], [], []
    for model, noise, term in zip(models, noises, own, strict=True):
        text, k = f"N {noise.text}", _walk_of(name, model, file, holds_K)
        if term is not None:
            sigmas.append(term.sigma)
            text += f"; Gauss-Markov sigma {term.sigma:.4e}{_span(model, 'sigma', '.4e')}"
            text += f", T {term.T:.4g} s{_span(model, 'T', '.4g')}"
        else:
            b = parameter(name, model, "B", file)
            sigmas.append(SIGMA_PER_B * b.value)
            text += f"; B {b.text}; sigma = 1.0760 B = {sigmas[-1]:.4e}"
        if used is not None and (term is None or term.T != used):
            text += f", with T {used:.4g} s"
        walks.append(k[0])
        notes.append(f"{text}; {k[1]}")
    if used is None and not holds_flicker:
        raise InputError(
            f"channel {name!r}: {file} needs the correlation time of a Gauss-Markov bias, and the model has flicker, "
            "which has none: give correlation_time= (seconds), or walk='upper-bound' for a walk in its place"
        )
    if min(v.value for v in noises) <= 0 or (max(sigmas) <= 0 and not (holds_K and max(walks) > 0)):
        raise InputError(
            f"channel {name!r}: {consumer.name} needs noise and bias above zero, and N or the bias instability is "
            "zero here; walk='k-only' writes the random walk as the bias"
        )
    return _Axis(
        name=name,
        noise=max(v.value for v in noises),
        sigma=max(sigmas),
        time=math.nan if used is None else used,
        K=max(walks),
        B=max(sigmas) / SIGMA_PER_B,
        notes=tuple(notes),
    )


def _term(name: str, model: Json, consumer: Consumer) -> GaussMarkov | None:
    """The Gauss-Markov term of a model."""
    terms = [t for t in model["terms"] if t["type"] == "gauss_markov"]
    if len(terms) > 1:
        raise InputError(
            f"channel {name!r}: the model has {len(terms)} Gauss-Markov terms and {consumer.file} has room for one: "
            "give walk='upper-bound' for a walk above all of them"
        )
    return GaussMarkov(q=terms[0]["q"], T=terms[0]["T"]) if terms else None


def _span(model: Json, symbol: str, style: str) -> str:
    """The interval of a parameter of the term, where the record gave one."""
    names = ("sigma", "B_equiv") if symbol == "sigma" else (symbol,)
    found = next((e for name in names for e in model.get("estimates") or () if e["symbol"] == name), None)
    if found is None:
        return ""
    factor = SIGMA_PER_B if found["symbol"] == "B_equiv" else 1.0
    upper = "?" if found["upper"] is None else format(factor * found["upper"], style)
    return f" [{factor * found['lower']:{style}}, {upper}]"


def _walk_of(name: str, model: Json, file: str, holds: bool) -> tuple[float, str]:
    """K where the file has a slot for it; else what is left out."""
    if holds:
        k = parameter(name, model, "K", file)
        return k.value, f"K {k.text}"
    try:
        k = parameter(name, model, "K", file)
    except InputError:  # nothing is known of what is left out anyway
        return 0.0, "K unknown, LEFT OUT"
    if k.value == 0:
        return 0.0, "no K"
    return 0.0, f"K {k.text.replace(', used', '')} LEFT OUT"


def _walking(channel: Json, choice: WalkChoice, consumer: Consumer) -> _Axis:
    name = channel["name"]
    noises, walks, notes = [], [], []
    for model in channel["models"]:
        noise = parameter(name, model, "N", consumer.file)
        walk, parts = choice.rule(name, model, noise.value)
        noises.append(noise.value)
        walks.append(walk)
        notes.append("; ".join([f"N {noise.text}", *parts, f"walk {walk:.4e}"]))
    if min(noises) <= 0 or max(walks) <= 0:
        raise InputError(
            f"channel {name!r}: {consumer.name} needs noise and walk above zero, and N or the walk is zero here"
        )
    sigma = max(walks) * math.sqrt(WALK_TIME / 2)
    return _Axis(
        name=name,
        noise=max(noises),
        sigma=sigma,
        time=WALK_TIME,
        K=0.0,
        B=sigma / SIGMA_PER_B,
        notes=tuple(notes),
    )


# -- words ----------------------------------------------------------------------------------------------------


def _bias_words(time: float | None, holds_K: bool) -> list[str]:
    lines = ["bias = first-order Gauss-Markov process: sigma its stationary standard deviation, T its time"]
    of = "of flicker: sigma = 1.0760 B, the process with the same peak of the Allan deviation"
    lines.append(of if time is None else f"{of}, with T = {time:g} s as given")
    if not holds_K:
        lines.append(
            "the random walk K has no slot beside it: LEFT OUT, over long times the bias drifts more"
        )
    return lines


def _walk_words(choice: WalkChoice) -> list[str]:
    time = f"T = {WALK_TIME:g} s"
    return [
        *choice.comment,
        f"as a Gauss-Markov process of {time}, sigma = walk sqrt(T/2): over t the walk within t/T",
    ]


def _table(sensor: str, axes: Sequence[_Axis], consumer: Consumer) -> list[str]:
    if not axes:
        return [
            "",
            f"{sensor}: the log holds none in known units. {consumer.name} needs its numbers: fill them in below",
        ]
    noise, walk = UNITS[sensor]
    bias = noise.replace("/sqrt(Hz)", "")
    lines = ["", f"{sensor}, N in {noise}, B and sigma in {bias}, K and walk in {walk}:"]
    for axis in axes:
        lines += [f"  {plain_line(axis.name)}: {note}" for note in axis.notes]
        if len(axis.notes) > 1:
            lines.append(
                f"  {plain_line(axis.name)}: the record cannot decide between these two; the larger numbers are used"
            )
    return lines
