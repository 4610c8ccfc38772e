# SPDX-License-Identifier: BSD-3-Clause
"""The walk of a bias in a consumer that has no slot for bias instability.

``k-only``
    The random walk K alone. Flicker is ignored: the bias drifts more than the filter believes.
``upper-bound``
    sqrt(K^2 + q_c^2). Flicker has no driving density, so q_c is that of the walk which reaches the flicker floor where
    white noise meets it, at tau = N^2/(0.4413 B^2): above it wherever flicker exceeds white noise,
    q_c = sqrt(3) 0.4413 B^2/N. For a Gauss-Markov term q_c is its driving density, a walk that drifts at least as much
    at every averaging time; but no more than that of the flicker with the same peak, which is above it wherever it
    exceeds white noise. A term of short T may nowhere exceed white noise: its q_c falls to zero (`_markov_bound`). With
    a correlation time T given, flicker is the Gauss-Markov term of that time with the same peak.
``horizon=<seconds>``
    The walk whose Allan variance at that time is the model's, white noise aside.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from allanite.errors import InputError
from allanite.exporters.imu.axes import (
    GIVE_BIAS,
    AxisNumbers,
    HeaderNote,
    Number,
    parameter,
    refuse_no_noise,
    without_slot,
)
from allanite.lazy_dataclasses import dataclass
from allanite.noise import FLICKER_FLOOR, SIGMA_PER_B, GaussMarkov

__all__ = [
    "GAUSS_MARKOV",
    "WalkChoice",
    "Walking",
    "Words",
    "bias_left_out",
    "refuse_time",
    "walk_choice",
    "walking",
]

Json = Mapping[str, Any]
#: Name of the channel, its model, its N -> the walk, and its parts.
Rule = Callable[[str, Json, float], tuple[float, list[Number]]]
#: Symbols of what the models hold -> comment lines.
Words = Callable[[frozenset[str]], list[str]]

GAUSS_MARKOV = "Gauss-Markov"
#: Least share of the Allan variance of white noise and flicker that white noise and the bounding walk have: 0.828.
_COVERED = 2 * (math.sqrt(2) - 1)


@dataclass(frozen=True, slots=True)
class WalkChoice:
    """How the walk is made, and what the file says about it."""

    words: Words
    rule: Rule


@dataclass(frozen=True, slots=True, kw_only=True)
class Walking(AxisNumbers):
    """A channel whose bias is a walk, in SI."""

    walk: float


@dataclass(frozen=True, slots=True)
class _Bias:
    """The bias instability of a model: its Allan variance, the density of the walk that bounds it, its parameters."""

    avar: Callable[[float], float]
    density: float
    numbers: tuple[Number, ...]


def walk_choice(walk: str, correlation_time: float | None, file: str) -> WalkChoice:
    """The rule of a label.

    Raises
    ------
    InputError
        Another label, or a correlation time that is none.
    """
    refuse_time(correlation_time)
    time = correlation_time
    if walk == "k-only":
        return WalkChoice(_k_only_words, lambda name, model, noise: _k_only(name, model, noise, file))
    if walk == "upper-bound":
        return WalkChoice(
            lambda held: _upper_bound_words(held, time),
            lambda name, model, noise: _upper_bound(name, model, noise, time, file),
        )
    match = re.fullmatch(r"horizon=([0-9.eE+-]+)", walk)
    tau = _number(match.group(1)) if match else math.nan
    if not (math.isfinite(tau) and tau > 0):
        raise InputError(f"walk must be 'upper-bound', 'k-only' or 'horizon=<seconds>', not {walk!r}")
    return WalkChoice(
        lambda held: _horizon_words(held, tau),
        lambda name, model, noise: _horizon(name, model, noise, time, tau, file),
    )


def walking(channel: Json, choice: WalkChoice, consumer: str, file: str) -> Walking:
    """Noise and walk of a channel, by a choice.

    Raises
    ------
    InputError
        A parameter without value and limit, or noise or a walk of zero.
    """
    name = channel["name"]
    read, walks, notes = [], [], []
    for model in channel["models"]:
        noise = parameter(name, model, "N", file)
        walk, parts = choice.rule(name, model, noise.value)
        read.append((noise, *parts))
        walks.append(walk)
        whole = Number("walk", walk, f"{walk:.4e}")
        notes.append(HeaderNote((noise, *parts, whole, *without_slot(model, channel["kind"]))))
    refuse_no_noise(name, [noise for noise, *_ in read], consumer)
    if max(walks) <= 0:
        why = _no_walk([part for _, *parts in read for part in parts])
        raise InputError(f"channel {name!r}: {consumer} must have a bias walk above zero, and {why}")
    return Walking(
        name=name, noise=max(noise.value for noise, *_ in read), walk=max(walks), notes=tuple(notes)
    )


def _no_walk(parts: Sequence[Number]) -> str:
    """Why the walk of a model is zero, and what to do."""
    biases = [n for n in parts if n.symbol in (GAUSS_MARKOV, "B") and n.value > 0]
    if not biases:
        return f"the model has neither a random walk nor a bias instability: {GIVE_BIAS}"
    if any(n.is_out for n in biases):
        return "the model has no random walk: walk='upper-bound' writes its bias instability as one"
    return (
        "the model has no random walk, and its white noise hides its bias instability at all averaging times: "
        "walk='horizon=<seconds>' writes the drift at one time"
    )


def is_positive(value: Any) -> bool:
    """A finite number above zero, and no text that looks like one."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        return False
    return bool(math.isfinite(value) and value > 0)


def refuse_time(correlation_time: float | None) -> None:
    """Raise if a correlation time is not a positive number of seconds."""
    if correlation_time is not None and not is_positive(correlation_time):
        raise InputError(f"correlation_time must be a positive number of seconds, not {correlation_time!r}")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


# -- one model ------------------------------------------------------------------------------------------------


def _k_only(name: str, model: Json, noise: float, file: str) -> tuple[float, list[Number]]:
    k = parameter(name, model, "K", file)
    return k.value, [k, *bias_left_out(name, model, noise, file)]


def bias_left_out(name: str, model: Json, noise: float, file: str) -> list[Number]:
    """The bias instability of a model in a file that has no place for it."""
    try:
        return [number.left_out() for number in _bias(name, model, noise, None, file).numbers]
    except InputError:  # nothing is known of what is left out anyway
        return [Number("B", math.nan, "unknown", is_out=True)]


def _upper_bound(
    name: str, model: Json, noise: float, time: float | None, file: str
) -> tuple[float, list[Number]]:
    k, bias = parameter(name, model, "K", file), _bias(name, model, noise, time, file)
    q = Number("q_c", bias.density, f"{bias.density:.4e}")
    return math.hypot(k.value, bias.density), [k, *bias.numbers, q]


def _horizon(
    name: str, model: Json, noise: float, time: float | None, tau: float, file: str
) -> tuple[float, list[Number]]:
    k, bias = parameter(name, model, "K", file), _bias(name, model, noise, time, file)
    return math.sqrt(k.value**2 + 3 * bias.avar(tau) / tau), [k, *bias.numbers]


def _bias(name: str, model: Json, noise: float, time: float | None, file: str) -> _Bias:
    """Of the Gauss-Markov terms, and of flicker: where the model has it, or could have it below a limit."""
    terms = [GaussMarkov(q=t["q"], T=t["T"]) for t in model["terms"] if t["type"] == "gauss_markov"]
    numbers = [Number(GAUSS_MARKOV, t.q, f"sigma {t.sigma:.4e}, T {t.T:.4g} s") for t in terms]
    densities = [_markov_bound(t, noise) for t in terms]
    avars: list[Callable[[float], Any]] = [t.avar for t in terms]
    if not terms or any(t["type"] == "flicker" for t in model["terms"]):
        b = parameter(name, model, "B", file)
        density, avar = _flicker(b.value, noise, time)
        numbers.append(b)
        densities.append(density)
        avars.append(avar)
    return _Bias(lambda tau: sum(float(avar(tau)) for avar in avars), math.hypot(*densities), tuple(numbers))


def _flicker(B: float, noise: float, time: float | None) -> tuple[float, Callable[[float], Any]]:
    """The density of the walk that bounds it, and its Allan variance."""
    if time is not None:
        matched = GaussMarkov.from_sigma(SIGMA_PER_B * B, time)
        return _markov_bound(matched, noise), matched.avar
    floor = (FLICKER_FLOOR * B) ** 2
    return _floor_bound(floor, noise), lambda _: floor


def _floor_bound(floor: float, noise: float) -> float:
    """The density of the walk that lies above a flicker floor [Allan variance] wherever that exceeds white noise.

    Beside the white noise it leaves the Allan variance nowhere below `_COVERED` of the model's.
    """
    return 0.0 if floor == 0 else math.sqrt(3) * floor / noise if noise > 0 else math.inf


def _markov_bound(term: GaussMarkov, noise: float) -> float:
    """The same of a Gauss-Markov term, whose Allan variance is below q^2 tau/3, its peak and (q T)^2/tau.

    The last is a white noise, beside which N covers the term where it is larger: from N^2 = 2.41 (q T)^2 on, the walk
    is that which `_COVERED` asks for at tau = (q T)^2/peak, and none from 4.83 (q T)^2 on.
    """
    peak, slow = (FLICKER_FLOOR * term.B_equiv) ** 2, term.q * term.T
    ratio = (noise / slow) ** 2 if slow > 0 else math.inf
    bound = _floor_bound(peak, noise)
    if ratio > 1 + math.sqrt(2):
        bound = math.sqrt(3 * max(_COVERED - (1 - _COVERED) * ratio, 0.0)) * (
            peak / slow if slow > 0 else 0.0
        )
    return min(term.q, bound)


# -- words ----------------------------------------------------------------------------------------------------


def _has_bias(held: frozenset[str]) -> bool:
    return bool(held & {GAUSS_MARKOV, "B"})


def _k_only_words(held: frozenset[str]) -> list[str]:
    if not _has_bias(held):
        return ["walk = K alone (k-only); the models hold no bias instability"]
    return [
        "walk = K alone (k-only): bias instability is NOT in these numbers; the bias drifts more than they say"
    ]


def _upper_bound_words(held: frozenset[str], time: float | None) -> list[str]:
    if not _has_bias(held):
        return ["walk = K (upper-bound); the models hold no bias instability"]
    lines = [
        "walk = sqrt(K^2 + q_c^2) (upper-bound): random walk and bias instability together"
        if "K" in held
        else "walk = q_c (upper-bound), that of the bias instability; the models hold no random walk"
    ]
    if GAUSS_MARKOV in held:
        lines.append(
            "q_c of a Gauss-Markov term: its driving density, or less where white noise hides the term"
        )
    if "B" in held:
        lines.append(
            f"q_c of flicker: 1.5217 B/sqrt(T), T = {time:g} s as given; at most 0.7643 B^2/N"
            if time
            else "q_c of flicker: 0.7643 B^2/N, the walk that lies above flicker wherever flicker exceeds white noise"
        )
    return lines


def _horizon_words(held: frozenset[str], tau: float) -> list[str]:
    if not _has_bias(held):
        return [f"walk = K (horizon, {tau:g} s); the models hold no bias instability"]
    what = "random walk and bias instability" if "K" in held else "bias instability"
    return [f"walk = drift of {what} at {tau:g} s (horizon): too small before, too large after"]
