# SPDX-License-Identifier: BSD-3-Clause
"""White noise and a first-order Gauss-Markov bias (sigma, T): what simulators and GNSS/INS filters know.

A Gauss-Markov term goes in as it is. Flicker goes in as the term whose Allan deviation peaks at its floor, sigma =
1.0760 B, and needs the correlation time that it is to have. Where one term is written for several of unlike time (the
worst of three axes, or a time given for a fitted term), a filter gets the least term that is above each of them at all
averaging times (`_above`). The random walk K has no slot beside it: it is left out, and the file says so. With `walk`
given the bias is a walk instead: a Gauss-Markov term of 1e6 s, driven by the walk of that label
(`allanite.exporters.imu.walks`), whose drift over t seconds is that of the walk within a part t/1e6 s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Unpack

from allanite.errors import InputError
from allanite.exporters.imu.axes import (
    GIVE_BIAS,
    SENSORS,
    AxisNumbers,
    HeaderNote,
    Number,
    combined,
    left_out,
    parameter,
    refuse_no_noise,
    without_slot,
)
from allanite.exporters.imu.numbers import ImuNumbers
from allanite.exporters.imu.options import NoiseOptions, asked_of
from allanite.exporters.imu.preamble import Consumer
from allanite.exporters.imu.walks import GAUSS_MARKOV, WalkChoice, Words, walking
from allanite.lazy_dataclasses import dataclass
from allanite.noise import SIGMA_PER_B, GaussMarkov

__all__ = ["WALK_TIME", "MarkovImu", "gauss_markov_imu"]

Json = Mapping[str, Any]

#: Correlation time of a Gauss-Markov term that stands for a walk [s].
WALK_TIME = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class _MarkovAxis(AxisNumbers):
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

    @property
    def density(self) -> Mapping[str, tuple[float, ...]]:
        """Driving root density of the bias, sigma sqrt(2/T)."""
        return {
            sensor: tuple(s * math.sqrt(2 / t) for s, t in zip(sigma, self.time[sensor], strict=True))
            for sensor, sigma in self.sigma.items()
        }

    @property
    def B(self) -> Mapping[str, tuple[float, ...]]:
        """Of the flicker with the same peak of the Allan deviation."""
        return {sensor: tuple(s / SIGMA_PER_B for s in sigma) for sensor, sigma in self.sigma.items()}

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
        read = asked.read(lambda c: _markov(c, consumer, time))
        words = _bias_words(consumer, time, asked.axes == "worst" and any(map(_unlike, read.values())))
    else:
        read, words = (
            asked.read(lambda c: _walk_as_markov(c, choice, consumer)),
            _walk_words(choice, consumer),
        )
    biases = {sensor: _biases(axes, asked.axes, sensor) for sensor, axes in read.items() if axes}
    return MarkovImu(
        rate=document["recording"]["rate"],
        comments=asked.head(document, consumer, words, read),
        noise=asked.numbers(read, lambda axis: axis.noise),
        sigma={sensor: tuple(asked.inflate * sigma for sigma, _ in bias) for sensor, bias in biases.items()},
        time={sensor: tuple(time for _, time in bias) for sensor, bias in biases.items()},
        K=asked.numbers(read, lambda axis: axis.K),
        walks=choice is not None,
        style=asked.style,
    )


def _biases(axes_of: Sequence[_MarkovAxis], axes: str, sensor: str) -> list[tuple[float, float]]:
    """Sigma and time of the bias: of each axis, of the worst one, or the root mean square and the geometric mean."""
    if axes == "worst" and (unlike := _unlike(axes_of)):
        worst = _above(unlike)
        return [(worst.sigma, worst.T)]
    sigmas, times = [a.sigma for a in axes_of], [a.time for a in axes_of]
    if axes == "each":
        return list(zip(combined(sigmas, axes, sensor), times, strict=True))
    if axes == "worst":
        return [max(zip(sigmas, times, strict=True), key=lambda bias: bias[0])]
    return [(combined(sigmas, axes, sensor)[0], math.exp(sum(map(math.log, times)) / len(times)))]


def _unlike(axes_of: Sequence[_MarkovAxis]) -> list[GaussMarkov]:
    """The Gauss-Markov terms of axes whose times differ; none where they are alike, or a bias has no time."""
    moving = [a for a in axes_of if a.sigma > 0]
    if len({a.time for a in moving}) < 2 or any(math.isnan(a.time) for a in moving):
        return []
    return [GaussMarkov.from_sigma(a.sigma, a.time) for a in moving]


def _above(terms: Sequence[GaussMarkov], T: float | None = None) -> GaussMarkov:
    """The least Gauss-Markov term that is above each of some, of the time T if one is given.

    A density q^2 / (1/T^2 + w^2) is above another at every frequency if it is at both ends, where q and q T are; so is
    then its Allan deviation at every averaging time.
    """
    fast, slow = max(t.q for t in terms), max(t.q * t.T for t in terms)
    if T is None:
        return GaussMarkov(q=fast, T=slow / fast)
    return GaussMarkov(q=max(fast, slow / T), T=T)


# -- one axis -------------------------------------------------------------------------------------------------


def _markov(channel: Json, consumer: Consumer, time: float | None) -> _MarkovAxis:
    name, file = channel["name"], consumer.file
    models = channel["models"]
    noises = [parameter(name, m, "N", file) for m in models]
    terms = [_term(name, m, consumer) for m in models]
    fitted = next((t.T for t in terms if t is not None), None)
    used = time if time is not None else fitted
    sigmas, walks, notes, has_walk = [], [], [], False
    for model, noise, term in zip(models, noises, terms, strict=True):
        k = (parameter if consumer.holds_K else left_out)(name, model, "K", file)
        has_walk |= k.value > 0
        sigma, bias = _bias_of(name, model, term, used, consumer)
        sigmas.append(sigma)
        walks.append(0.0 if k.is_out else k.value)
        notes.append(HeaderNote((noise, *bias, k, *without_slot(model, channel["kind"]))))
    refuse_no_noise(name, noises, consumer.name)
    if max(sigmas) <= 0 and not (consumer.holds_K and max(walks) > 0):
        way = (
            ": walk='k-only' writes its random walk as the bias" if has_walk else f" and no walk: {GIVE_BIAS}"
        )
        raise InputError(
            f"channel {name!r}: {consumer.name} must have a bias above zero, and the model has no bias instability{way}"
        )
    if used is None and not consumer.holds_flicker:
        raise InputError(
            f"channel {name!r}: {file} needs the correlation time of a Gauss-Markov bias, and the model has flicker, "
            "which has none: give correlation_time= (seconds), or walk='upper-bound' for a walk in its place"
        )
    return _MarkovAxis(
        name=name,
        noise=max(v.value for v in noises),
        sigma=max(sigmas),
        time=math.nan if used is None else used,
        K=max(walks),
        notes=tuple(notes),
    )


def _bias_of(
    name: str, model: Json, term: GaussMarkov | None, used: float | None, consumer: Consumer
) -> tuple[float, list[Number]]:
    """Sigma of the bias of a model that is to have the time `used`, and what the file says of it."""
    with_time = f", with T {used:.4g} s" if used is not None and (term is None or term.T != used) else ""
    if term is not None:
        of_sigma, of_time = _span(model, "sigma", ".4e"), _span(model, "T", ".4g")
        sigma = term.sigma
        if with_time and (not consumer.simulator or model.get("overbound")):
            sigma = _above([term], used).sigma
            with_time += f" and sigma {sigma:.4e}, above the term at all averaging times"
        text = f"sigma {term.sigma:.4e}{of_sigma}, T {term.T:.4g} s{of_time}{with_time}"
        return sigma, [Number(GAUSS_MARKOV, term.sigma, text, has_interval=bool(of_sigma or of_time))]
    b = parameter(name, model, "B", consumer.file)
    sigma = SIGMA_PER_B * b.value
    if consumer.holds_flicker:
        return sigma, [replace(b, text=b.text + with_time)]
    return sigma, [b, Number("sigma", sigma, f"= 1.0760 B = {sigma:.4e}{with_time}")]


def _term(name: str, model: Json, consumer: Consumer) -> GaussMarkov | None:
    """The Gauss-Markov term of a model."""
    terms = [t for t in model["terms"] if t["type"] == "gauss_markov"]
    flicker = any(t["type"] == "flicker" for t in model["terms"])
    if len(terms) > 1 or (terms and flicker):
        what = "a Gauss-Markov term and flicker" if flicker else f"{len(terms)} Gauss-Markov terms"
        raise InputError(
            f"channel {name!r}: the model has {what} and {consumer.file} has room for one: "
            "give walk='upper-bound' for a walk above all of them"
        )
    return GaussMarkov(q=terms[0]["q"], T=terms[0]["T"]) if terms else None


def _span(model: Json, symbol: str, style: str) -> str:
    """The interval of a parameter of the term, where the record gave one."""
    names = ("sigma", "B_equiv") if symbol == "sigma" else (symbol,)
    estimate = next((e for name in names for e in model.get("estimates") or () if e["symbol"] == name), None)
    if estimate is None:
        return ""
    factor = SIGMA_PER_B if estimate["symbol"] == "B_equiv" else 1.0
    upper = "?" if estimate["upper"] is None else format(factor * estimate["upper"], style)
    return f" [{factor * estimate['lower']:{style}}, {upper}]"


def _walk_as_markov(channel: Json, choice: WalkChoice, consumer: Consumer) -> _MarkovAxis:
    walk = walking(channel, choice, consumer.name, consumer.file)
    sigma = walk.walk * math.sqrt(WALK_TIME / 2)
    return _MarkovAxis(name=walk.name, noise=walk.noise, sigma=sigma, time=WALK_TIME, K=0.0, notes=walk.notes)


# -- words ----------------------------------------------------------------------------------------------------


def _bias_words(consumer: Consumer, time: float | None, unlike: bool) -> Words:
    def words(held: frozenset[str]) -> list[str]:
        lines = []
        if held & {GAUSS_MARKOV, "sigma"}:
            lines.append(
                "bias = first-order Gauss-Markov process: sigma its stationary standard deviation, T its time"
            )
        if unlike:
            lines.append(
                "axes of unlike T: sigma and T are of the least process above each axis at all averaging times"
            )
        if "sigma" in held:
            of = "of flicker: sigma = 1.0760 B, the process with the same peak of the Allan deviation"
            lines.append(of if time is None else f"{of}, with T = {time:g} s as given")
        if "K" in held and not consumer.holds_K:
            lines.append("the random walk K has no slot beside it: over long times the bias drifts more")
        return lines

    return words


def _walk_words(choice: WalkChoice, consumer: Consumer) -> Words:
    if consumer.holds_walk:
        return choice.words
    time = f"T = {WALK_TIME:g} s"
    as_process = f"as a Gauss-Markov process of {time}, sigma = walk sqrt(T/2): over t the walk within t/T"
    return lambda held: [*choice.words(held), as_process]
