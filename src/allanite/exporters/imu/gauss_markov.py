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
from typing import Any, Unpack

from allanite.errors import InputError
from allanite.exporters.imu.axes import SENSORS, UNITS, AxisNumbers, combined, parameter
from allanite.exporters.imu.numbers import ImuNumbers
from allanite.exporters.imu.options import NoiseOptions, asked_of
from allanite.exporters.imu.preamble import Consumer, table
from allanite.exporters.imu.walks import WalkChoice, walking
from allanite.noise import SIGMA_PER_B, GaussMarkov

__all__ = ["WALK_TIME", "MarkovImu", "gauss_markov_imu"]

Json = Mapping[str, Any]

#: Correlation time of a Gauss-Markov term that stands for a walk [s].
WALK_TIME = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class _Axis(AxisNumbers):
    sigma: float
    time: float
    K: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkovImu(ImuNumbers):
    """The numbers of a file, combined and inflated as was asked; by sensor, one number or three.

    Attributes
    ----------
    sigma : mapping of str to tuple of float
        Stationary standard deviation of the bias in SI.
    time : mapping of str to tuple of float [s]
    K : mapping of str to tuple of float
        The random walk in SI, where the bias is Gauss-Markov; zero where it is a walk and holds it.
    walks : bool
        The bias is a walk.
    """

    sigma: Mapping[str, tuple[float, ...]]
    time: Mapping[str, tuple[float, ...]]
    K: Mapping[str, tuple[float, ...]]
    walks: bool

    def density(self, sensor: str) -> tuple[float, ...]:
        """Driving root density of the bias, sigma sqrt(2/T)."""
        pairs = zip(self.sigma[sensor], self.time[sensor], strict=True)
        return tuple(s * math.sqrt(2 / t) for s, t in pairs)

    def common_time(self, file: str, sensors: Sequence[str] = SENSORS) -> float:
        """The one correlation time [s] of a file that has room for one.

        Raises
        ------
        InputError
            The axes have different ones.
        """
        times = sorted({t for s in sensors for t in self.time.get(s, ())})
        if len(times) > 1 and times[-1] > times[0] * (1 + 1e-9):
            listed = ", ".join(f"{t:.4g}" for t in times)
            raise InputError(
                f"{file} has one correlation time, and the models have {listed} s: give correlation_time= for all of "
                "them"
            )
        return times[0]


def gauss_markov_imu(document: Json, consumer: Consumer, **options: Unpack[NoiseOptions]) -> MarkovImu:
    """What a file says of a study.

    Raises
    ------
    InputError
        As `white_and_walk`; flicker without a correlation time, two Gauss-Markov terms, no bias at all.
    """
    asked = asked_of(document, consumer, **options)
    choice, time = asked.choice, asked.time
    models = [m for channels in asked.channels.values() for c in channels for m in c["models"]]
    if choice is None and not consumer.holds_K and any(m.get("overbound") for m in models):
        raise InputError(
            f"a bound would lose its random walk in {consumer.file}: give walk='k-only', which writes it as the bias"
        )
    if choice is None:
        read, words = asked.read(lambda c: _markov(c, consumer, time)), _bias_words(time, consumer.holds_K)
    else:
        read, words = asked.read(lambda c: _walk_as_markov(c, choice, consumer)), _walk_words(choice)
    columns = {
        sensor: f"N in {noise}, B and sigma in {noise.replace('/sqrt(Hz)', '')}, K and walk in {walk}"
        for sensor, (noise, walk) in UNITS.items()
    }
    return MarkovImu(
        rate=document["recording"]["rate"],
        comments=asked.head(document, consumer, words, table(read, columns, consumer, "numbers")),
        noise=asked.numbers(read, lambda axis: axis.noise),
        sigma=asked.numbers(read, lambda axis: axis.sigma),
        time={sensor: _times(own, asked.axes, sensor) for sensor, own in read.items() if own},
        K=asked.numbers(read, lambda axis: axis.K),
        walks=choice is not None,
        style=asked.style,
    )


def _times(axes_of: Sequence[_Axis], axes: str, sensor: str) -> tuple[float, ...]:
    """Of the axis with the largest sigma for the worst one; the geometric mean for the root mean square."""
    times = [a.time for a in axes_of]
    if axes == "each":
        return combined(times, axes, sensor)
    if axes == "worst":
        return (max(axes_of, key=lambda a: a.sigma).time,)
    return (math.exp(sum(math.log(t) for t in times) / len(times)),)


# -- one axis -------------------------------------------------------------------------------------------------


def _markov(channel: Json, consumer: Consumer, time: float | None) -> _Axis:
    name, file = channel["name"], consumer.file
    models = channel["models"]
    noises = [parameter(name, m, "N", file) for m in models]
    own = [_term(name, m, consumer) for m in models]
    fitted = next((t.T for t in own if t is not None), None)
    used = time if time is not None else fitted
    sigmas, walks, notes = [], [], []
    for model, noise, term in zip(models, noises, own, strict=True):
        text, k = f"N {noise.text}", _walk_of(name, model, file, consumer.holds_K)
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
    if used is None and not consumer.holds_flicker:
        raise InputError(
            f"channel {name!r}: {file} needs the correlation time of a Gauss-Markov bias, and the model has flicker, "
            "which has none: give correlation_time= (seconds), or walk='upper-bound' for a walk in its place"
        )
    if min(v.value for v in noises) <= 0 or (max(sigmas) <= 0 and not (consumer.holds_K and max(walks) > 0)):
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


def _walk_as_markov(channel: Json, choice: WalkChoice, consumer: Consumer) -> _Axis:
    own = walking(channel, choice, consumer.name, consumer.file)
    sigma = own.walk * math.sqrt(WALK_TIME / 2)
    return _Axis(name=own.name, noise=own.noise, sigma=sigma, time=WALK_TIME, K=0.0, notes=own.notes)


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
