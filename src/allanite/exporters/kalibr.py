# SPDX-License-Identifier: BSD-3-Clause
"""imu.yaml of Kalibr: https://github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model (continuous densities in SI).

Kalibr's model of a sensor is white noise and a random walk of the bias; it discretises both itself (noise * sqrt(rate),
walk / sqrt(rate)). A third term, the bias instability, has no slot and must be folded into the walk:

``k-only``
    The random walk K alone. Flicker is ignored: the bias drifts more than the filter believes.
``upper-bound`` (default)
    sqrt(K^2 + q_c^2). For a Gauss-Markov term q_c is its driving density: a walk that drifts at least as much at every
    averaging time. Flicker has no such density, so q_c is that of the walk which reaches the flicker floor where
    white noise meets it, at tau = N^2/(0.4413 B^2): above it wherever flicker exceeds white noise,
    q_c = sqrt(3) 0.4413 B^2/N. With a correlation time T given, q_c = 1.5217 B/sqrt(T).
``horizon=<seconds>``
    The walk whose Allan variance at that time is the model's, white noise aside.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from allanite import __version__
from allanite.errors import InputError
from allanite.exporters.bounds import bound_comments, refuse_terms
from allanite.noise import FLICKER_FLOOR, SIGMA_PER_B, GaussMarkov

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "write"]

NAME = "kalibr"
FILE_NAME = "imu.yaml"
SUMMARY = "Kalibr, and whoever reads its imu.yaml: white noise and bias random walk, continuous, SI"
TAKES = "study"
#: All that imu.yaml can say: a bound above the sensor is made of these.
TERMS = ("N", "K")

Json = Mapping[str, Any]

_TRIADS = {
    "gyroscope": (("rate", "angle"), "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"),
    "accelerometer": (("acceleration", "velocity"), "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"),
}
_TERM_OF = {"N": "white", "B": "flicker", "K": "random_walk"}


def write(
    document: Json,
    *,
    walk: str = "upper-bound",
    axes: str = "worst",
    inflate: float = 1.0,
    correlation_time: float | None = None,
    rostopic: str = "/imu0",
    gyroscope: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> str:
    """The text of imu.yaml.

    Parameters
    ----------
    document : dict
        A study document.
    walk : "upper-bound", "k-only" or "horizon=<seconds>"
        What becomes of the bias instability; see the module.
    axes : "worst" or "rms"
        One number for three axes: the largest of each parameter (for an estimator) or the root mean square (for a
        simulator).
    inflate : float
        Factor on all four numbers, written into the file. 1 writes what was measured.
    correlation_time : float, optional [s]
        T of the Gauss-Markov term that stands for flicker.
    rostopic : str
    gyroscope, accelerometer : sequence of str, optional
        Channels of each triad; by default all of that kind, three at most.

    Raises
    ------
    InputError
        No channel in known units of rate or acceleration, more than one triad of a kind, an axis without a model, or
        a parameter without value and limit.
    """
    choice = _walk_rule(walk, correlation_time)
    combine = _combination(axes)
    if not (math.isfinite(inflate) and inflate > 0):
        raise InputError(f"inflate must be a positive factor, not {inflate!r}")
    if not re.fullmatch(r"[/~A-Za-z][A-Za-z0-9_/]*", rostopic):
        raise InputError(f"{rostopic!r} is not the name of a ROS topic")
    chosen = {
        "gyroscope": _channels(document, "gyroscope", gyroscope),
        "accelerometer": _channels(document, "accelerometer", accelerometer),
    }
    if not any(chosen.values()):
        raise InputError(_nothing_to_export(document))
    read = {triad: [_axis(c, choice) for c in channels] for triad, channels in chosen.items()}
    lines = _header(document, choice.comment, axes, inflate)
    lines += _bound_lines([c for channels in chosen.values() for c in channels], axes)
    for triad, found in read.items():
        lines += _table(triad, found)
    lines += ["", f"rostopic: {rostopic}", f"update_rate: {_rate(document['recording']['rate'])}"]
    for triad in ("accelerometer", "gyroscope"):
        lines += _keys(triad, read[triad], combine, inflate)
    return "\n".join(lines) + "\n"


# -- channels ---------------------------------------------------------------------------------------------


def _channels(document: Json, triad: str, wanted: Sequence[str] | None) -> list[Json]:
    kinds = _TRIADS[triad][0]
    found = [c for c in document["channels"] if c["kind"] in kinds]
    if wanted is not None:
        by_name = {c["name"]: c for c in found}
        missing = [name for name in wanted if name not in by_name]
        if missing:
            raise InputError(f"no {triad} channel {missing[0]!r}; there are: {', '.join(by_name) or 'none'}")
        found = [by_name[name] for name in wanted]
    if len(found) > 3:
        names = ", ".join(c["name"] for c in found)
        raise InputError(
            f"{len(found)} {triad} channels ({names}): name the three of one triad with {triad}="
        )
    return found


def _nothing_to_export(document: Json) -> str:
    kinds = ", ".join(f"{c['name']} ({c['kind']})" for c in document["channels"])
    return (
        f"imu.yaml needs an angle rate or an acceleration in known units; the study holds {kinds or 'no channel'}. "
        "Characterise again with the units stated (--unit gyro=deg/s,acc=g)"
    )


@dataclass(frozen=True, slots=True)
class _Number:
    """A parameter as it is used: its value, or the 95 % upper limit where the record does not resolve it."""

    value: float
    text: str


@dataclass(frozen=True, slots=True)
class _Axis:
    name: str
    noise: float
    walk: float
    notes: tuple[str, ...]


def _axis(channel: Json, choice: _Choice) -> _Axis:
    name = channel["name"]
    if not channel["models"]:
        raise InputError(
            f"channel {name!r} has no noise model: leave it out by naming the others (gyroscope=, accelerometer=)"
        )
    noises, walks, notes = [], [], []
    for model in channel["models"]:
        noise = _parameter(name, model, "N")
        walk, parts = choice.rule(name, model, noise.value)
        noises.append(noise.value)
        walks.append(walk)
        notes.append("; ".join([f"N {noise.text}", *parts, f"walk {walk:.4e}"]))
    if min(noises) <= 0 or max(walks) <= 0:
        raise InputError(
            f"channel {name!r}: Kalibr needs noise and walk above zero, and N or the walk is zero here"
        )
    return _Axis(name, max(noises), max(walks), tuple(notes))


def _parameter(channel: str, model: Json, symbol: str) -> _Number:
    """A parameter of a fitted model, or of a bare sum of terms (where an absent term is zero)."""
    estimates = model.get("estimates") or ()
    names = ("B", "B_equiv") if symbol == "B" else (symbol,)
    found = next((e for e in estimates if e["symbol"] in names), None)
    if found is None and not estimates:
        values = [t[symbol] for t in model["terms"] if t["type"] == _TERM_OF[symbol]]
        value = math.sqrt(sum(v * v for v in values))
        return _Number(value, f"{value:.4e}")
    if found is not None and found["supported"] and found["value"] is not None:
        span = f" [{_text(found['lower'])}, {_text(found['upper'])}]"
        return _Number(found["value"], f"{found['value']:.4e}{span}")
    if found is None or found["upper"] is None or not math.isfinite(found["upper"]):
        raise InputError(
            f"channel {channel!r}: {symbol} has neither a value nor an upper limit for imu.yaml; record longer"
        )
    return _Number(found["upper"], f"< {found['upper']:.4e} (95 % upper limit, used)")


def _text(value: float | None) -> str:
    return "?" if value is None else f"{value:.4e}"


# -- the walk ---------------------------------------------------------------------------------------------

_Rule = Callable[[str, Json, float], tuple[float, list[str]]]


@dataclass(frozen=True, slots=True)
class _Choice:
    """How the walk is made, and what the file says about it."""

    comment: tuple[str, ...]
    rule: _Rule


@dataclass(frozen=True, slots=True)
class _Bias:
    """The bias instability of a model: its Allan variance, the density of the walk that bounds it, and its text."""

    avar: Callable[[float], float]
    density: float
    text: str


def _walk_rule(walk: str, correlation_time: float | None) -> _Choice:
    if correlation_time is not None and not (math.isfinite(correlation_time) and correlation_time > 0):
        raise InputError(f"correlation_time must be a positive number of seconds, not {correlation_time!r}")
    if walk == "k-only":
        alone = (
            "walk = K alone (k-only): bias instability is NOT in these numbers; the bias drifts more than they say",
        )
        return _Choice(alone, _k_only)
    if walk == "upper-bound":
        lines = (
            "walk = sqrt(K^2 + q_c^2) (upper-bound): random walk and bias instability together",
            "q_c of a Gauss-Markov term: its driving density",
            f"q_c of flicker: 1.5217 B/sqrt(T), T = {correlation_time:g} s as given"
            if correlation_time
            else "q_c of flicker: 0.7643 B^2/N, the walk that lies above flicker wherever flicker exceeds white noise",
        )
        return _Choice(lines, lambda name, model, noise: _upper_bound(name, model, noise, correlation_time))
    match = re.fullmatch(r"horizon=([0-9.eE+-]+)", walk)
    tau = _number(match.group(1)) if match else math.nan
    if not (math.isfinite(tau) and tau > 0):
        raise InputError(f"walk must be 'upper-bound', 'k-only' or 'horizon=<seconds>', not {walk!r}")
    at = (
        f"walk = drift of random walk and bias instability at {tau:g} s (horizon): too small before, too large after",
    )
    return _Choice(at, lambda name, model, noise: _horizon(name, model, noise, correlation_time, tau))


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _k_only(name: str, model: Json, _: float) -> tuple[float, list[str]]:
    k = _parameter(name, model, "K")
    return k.value, [f"K {k.text}"]


def _upper_bound(name: str, model: Json, noise: float, time: float | None) -> tuple[float, list[str]]:
    k, bias = _parameter(name, model, "K"), _bias(name, model, noise, time)
    return math.hypot(k.value, bias.density), [f"K {k.text}", bias.text, f"q_c {bias.density:.4e}"]


def _horizon(name: str, model: Json, noise: float, time: float | None, tau: float) -> tuple[float, list[str]]:
    k, bias = _parameter(name, model, "K"), _bias(name, model, noise, time)
    return math.sqrt(k.value**2 + 3 * bias.avar(tau) / tau), [f"K {k.text}", bias.text]


def _bias(name: str, model: Json, noise: float, time: float | None) -> _Bias:
    terms = [GaussMarkov(q=t["q"], T=t["T"]) for t in model["terms"] if t["type"] == "gauss_markov"]
    if terms:
        density = math.sqrt(sum(t.q**2 for t in terms))
        text = ", ".join(f"Gauss-Markov sigma {t.sigma:.4e}, T {t.T:.4g} s" for t in terms)
        return _Bias(lambda tau: sum(float(t.avar(tau)) for t in terms), density, text)
    b = _parameter(name, model, "B")
    if time is not None:
        matched = GaussMarkov.from_sigma(SIGMA_PER_B * b.value, time)
        return _Bias(lambda tau: float(matched.avar(tau)), matched.q, f"B {b.text}")
    floor = (FLICKER_FLOOR * b.value) ** 2
    density = math.sqrt(3) * floor / noise if noise > 0 else math.inf
    return _Bias(lambda _: floor, density, f"B {b.text}")


# -- text -------------------------------------------------------------------------------------------------


def _combination(axes: str) -> Callable[[list[float]], float]:
    if axes == "worst":
        return max
    if axes == "rms":
        return lambda values: math.sqrt(sum(v * v for v in values) / len(values))
    raise InputError(f"axes must be 'worst' or 'rms', not {axes!r}")


def _header(document: Json, walk: tuple[str, ...], axes: str, inflate: float) -> list[str]:
    provenance, recording = document.get("provenance") or {}, document["recording"]
    source = provenance.get("source") or "samples or models in memory"
    digest = f", SHA-256 {provenance['sha256']}" if provenance.get("sha256") else ""
    span = f", {recording['duration']:g} s at" if "duration" in recording else ", for"
    rule = "the worst axis of each parameter" if axes == "worst" else "the root mean square of the axes"
    inflated = "not inflated" if inflate == 1 else f"INFLATED by {inflate:g} (the table below is not)"
    return [
        f"# IMU noise for Kalibr, written by allanite {__version__}",
        f"# from {_plain(source)}{digest}{span} {_rate(recording['rate'])} Hz",
        "# continuous-time root densities in SI units, two-sided; Kalibr makes them discrete itself",
        *(f"# {line}" for line in walk),
        f"# one number for all axes: {rule}; {inflated}",
        "# B: IEEE Std 952 coefficient (floor of the Allan deviation / 0.664); [ ]: 95 % interval",
        "# quantisation and rate ramp have no slot here and are left out",
    ]


def _bound_lines(channels: list[Json], axes: str) -> list[str]:
    """Comments on models that are bounds, which this file must leave bounds."""
    lines = []
    for channel in channels:
        refuse_terms(channel["name"], channel["models"], TERMS)
        lines += [f"# {line}" for line in bound_comments(_plain(channel["name"]), channel["models"])]
    if lines and axes != "worst":
        raise InputError(f"a bound of all axes is that of the worst one: axes='worst', not {axes!r}")
    return lines


def _table(triad: str, axes: list[_Axis]) -> list[str]:
    if not axes:
        return [
            "#",
            f"# {triad}: the log holds none in known units. Kalibr needs its two lines: fill them in below",
        ]
    noise, walk = _TRIADS[triad][1:]
    lines = ["#", f"# {triad}, N in {noise}, K and walk in {walk}:"]
    for axis in axes:
        lines += [f"#   {_plain(axis.name)}: {note}" for note in axis.notes]
        if len(axis.notes) > 1:
            lines.append(
                f"#   {_plain(axis.name)}: the record cannot decide between these two; the larger numbers are used"
            )
    return lines


def _keys(
    triad: str, axes: list[_Axis], combine: Callable[[list[float]], float], inflate: float
) -> list[str]:
    noise, walk = _TRIADS[triad][1:]
    if not axes:
        return [f"# {triad}_noise_density:  # {noise}", f"# {triad}_random_walk:  # {walk}"]
    return [
        f"{triad}_noise_density: {inflate * combine([a.noise for a in axes]):.6e}  # {noise}",
        f"{triad}_random_walk: {inflate * combine([a.walk for a in axes]):.6e}  # {walk}",
    ]


def _rate(rate: float) -> str:
    """A rate that YAML 1.1 reads as a float: always a point, no bare exponent."""
    text = f"{rate:.6f}".rstrip("0")
    return (
        f"{rate:.6e}"
        if float(text) != rate and abs(float(text) / rate - 1) > 1e-6
        else text + "0" * text.endswith(".")
    )


def _plain(text: str) -> str:
    """Text of a user on one line of ASCII."""
    return " ".join(text.split()).encode("ascii", "backslashreplace").decode("ascii")
