# SPDX-License-Identifier: BSD-3-Clause
"""A Kalman filter as one C++ header for a microcontroller: arithmetic, constants, gain and filter.

The filter estimates the bias of one axis while the sensor is at rest, and predicts it while it moves:

    y = h s + v,  s' = F s + w,  bias = r s.

Its states are those of the noise model, exactly discretised. Flicker is a sum of Gauss-Markov states, correlation
times a factor 10 apart, over the band from one sample to the horizon; or one state of a given correlation time
("single"). What starts unknown and what walks cannot be told apart, so the random walk (that of K and the slow end of
flicker in one) carries the turn-on bias too: one state less, and no constant whose share cancels against the walk's.
A model without a walk has the bias as a constant state.

The bias starts unknown, exactly: the first sample sets the state to ``start_gain * y`` with ``start_covariance``. Both
are what a prior variance without limit tends to, so there is no large number to choose.

The filter itself, ``bias_filter.hpp`` in this folder, is written behind the constants, and the headers of the kernels
that it needs before them, each once: no other file is needed. Every axis may have its own header, in its own namespace;
include guards keep the arithmetic of several apart from each other and from an ``allanite/`` on the include path.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import allanite
from allanite import __version__
from allanite.errors import InputError, StorageError
from allanite.exporters.aliased import aliasing_comments
from allanite.exporters.bounds import bound_comments, motion_comments, refuse_terms
from allanite.exporters.renewed import renewed_lines
from allanite.exporters.triads import plain_line
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, StateSpace
from allanite.quantities.display_units import si_unit

if TYPE_CHECKING:
    from allanite.filtering.kalman import SteadyState

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "include_path", "write"]

NAME = "cpp"
FILE_NAME = "model.hpp"
SUMMARY = "One C++17 header that needs no other file: a bias filter with its constants, for firmware"
TAKES = "study"

Json = Mapping[str, Any]
Array = NDArray[np.float64]

#: Over which flicker is held where nothing says how long the record was [s].
_HORIZON = 3600.0
_UNITS = {"rate": "rad/s", "angle": "rad/s", "acceleration": "m/s^2", "velocity": "m/s^2", "voltage": "V"}
_DIGITS = {"float": 9, "double": 17}
#: Type of a term -> symbols of the estimates that are about it.
_LETTERS = {
    "quantisation": ("Q",),
    "white": ("N",),
    "flicker": ("B", "B_equiv"),
    "gauss_markov": ("B", "B_equiv"),
    "random_walk": ("K",),
    "ramp": ("R",),
    "sinusoid": (),
}
_OWN_INCLUDE = re.compile(r'#include "([a-z_]+\.hpp)"')
#: Words of C++17, and namespaces that the header uses.
_TAKEN = """
alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t class compl
const const_cast constexpr continue decltype default delete do double dynamic_cast else enum explicit export
extern false float for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr
operator or or_eq private protected public register reinterpret_cast return short signed sizeof static
static_assert static_cast struct switch template this thread_local throw true try typedef typeid typename
union unsigned using virtual void volatile wchar_t while xor xor_eq allanite std main
"""


def write(
    document: Json,
    *,
    channel: str | None = None,
    filter_rate: float | None = None,
    flicker: str = "sum",
    correlation_time: float | None = None,
    horizon: float | None = None,
    family: str | None = None,
    sampling: str | None = None,
    scalar: str = "float",
    namespace: str = "sensor",
) -> str:
    """The text of model.hpp.

    Parameters
    ----------
    document : dict
        A study document.
    channel : str, optional
        By default the only one, or the worst axis among the gyros (without one: the accelerometers, the others): that
        with the largest Allan deviation on average over octaves up to the horizon.
    filter_rate : float, optional [Hz]
        Samples per second that the filter is fed with; that of the study by default. A slower filter is to be fed with
        means over its interval.
    flicker : "sum" or "single"
    correlation_time : float, optional [s]
        Of the single state.
    horizon : float, optional [s]
        Over which flicker must hold: the length of the study's record by default.
    family : str, optional
        Which model, where the record could not decide: "flicker" or "gauss-markov"; by default the one that drifts more
        over half of the horizon.
    sampling : "mean" or "point", optional
        What a sample is; that of the study's channel by default, and "mean" for a slower filter.
    scalar : "float" or "double"
    namespace : str
        Of the constants, in C++.

    Raises
    ------
    InputError
        No channel with a model, no such channel or family, no white noise, an option that makes no sense, or one that
        would make less of a bound.
    """
    if scalar not in _DIGITS:
        raise InputError(f"scalar must be 'float' or 'double', not {scalar!r}")
    if (
        not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", namespace)
        or namespace in _TAKEN.split()
        or "__" in namespace
    ):
        raise InputError(f"{namespace!r} is not a valid C++ namespace; use for example 'gyro_x'")
    recording = document["recording"]
    rate = _positive(recording["rate"] if filter_rate is None else filter_rate, "filter_rate")
    span = _positive(recording.get("duration", _HORIZON) if horizon is None else horizon, "horizon")
    axis = _axis(document, channel, 1 / rate, span)
    if flicker == "single":
        refuse_terms(axis["name"], axis["models"], ("Q", "N", "K", "R"))
    model = _with_flicker(_model(axis, family, span, flicker), flicker, correlation_time)
    kind = _sampling(document, axis["name"], sampling, rate)
    made = _discrete(model, 1 / rate, kind, span)
    choices = [_why(document, axis, channel), *_choices(document, axis, model, made, rate, span, kind)]
    head = [f"// {line}" for line in choices]
    return "\n".join([*head, *_constants(made, scalar, namespace, rate, _unit(axis))]) + "\n"


# -- what is exported ------------------------------------------------------------------------------------------


def _positive(value: Any, name: str) -> float:
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float))
        or not (math.isfinite(value) and value > 0)
    ):
        raise InputError(f"{name} must be a positive number, not {value!r}")
    return float(value)


def _axis(document: Json, wanted: str | None, dt: float, span: float) -> Json:
    """The channel that is meant."""
    able = [c for c in document["channels"] if c["models"]]
    if wanted is not None:
        for c in able:
            if c["name"] == wanted:
                return c  # type: ignore[no-any-return]
        names = ", ".join(c["name"] for c in able) or "none"
        raise InputError(f"no channel {wanted!r} with a noise model; there are: {names}")
    groups = (("rate", "angle"), ("acceleration", "velocity"))
    kinds = next((g for g in groups if any(c["kind"] in g for c in able)), None)
    among = [c for c in able if kinds is None or c["kind"] in kinds]
    if not among:
        raise InputError("the study has no noise model: record longer, or check its findings")
    taus = dt * 2.0 ** np.arange(max(1, math.floor(math.log2(max(span / dt, 2.0)))))

    def size(c: Json) -> float:
        with np.errstate(divide="ignore"):
            return float(np.log(NoiseModel.from_json(c["models"][0]).avar(taus)).mean())

    return max(among, key=size)


def _model(axis: Json, family: str | None, span: float, flicker: Any) -> NoiseModel:
    """The family that was asked for, else the one that drifts more over half of the time that the filter runs."""
    models = [NoiseModel.from_json(m) for m in axis["models"]]
    if family is None:
        return _worst(axis, span) if flicker == "sum" else models[0]
    for model in models:
        if model.family == family:
            return model
    there = ", ".join(m.family or "one without a family" for m in models)
    raise InputError(f"channel {axis['name']!r} has no model of the family {family!r}; there are: {there}")


def _worst(axis: Json, span: float) -> NoiseModel:
    return max(map(NoiseModel.from_json, axis["models"]), key=lambda m: float(m.adev(span / 2)))


def _with_flicker(model: NoiseModel, flicker: Any, time: float | None) -> NoiseModel:
    from allanite.filtering.kalman.channel import with_flicker

    if flicker == "single" and model.term("flicker") is None:
        raise InputError("flicker='single' makes one state of flicker, but the model has no flicker")
    if flicker == "sum" and time is not None:
        raise InputError("correlation_time= is that of the single state: give flicker='single' with it")
    if flicker == "single":
        if time is None:
            raise InputError("flicker='single' needs correlation_time=, that of its one state in seconds")
        _positive(time, "correlation_time")
    return with_flicker(model, flicker, time)


def _sampling(document: Json, name: str, wanted: str | None, rate: float) -> str:
    if wanted is not None:
        if wanted not in ("mean", "point"):
            raise InputError(f"sampling must be 'mean' or 'point', not {wanted!r}")
        return wanted
    channels = document["recording"].get("channels", ())
    stated = next(
        (c["sampling"] for c in channels if c["name"] == name and c["kind"] not in ("angle", "velocity")),
        "mean",
    )
    return "mean" if rate < document["recording"]["rate"] * (1 - 1e-9) else str(stated)


def _unit(axis: Json) -> str:
    return _UNITS.get(axis["kind"], _plain(axis["unit"]) or "the channel's own unit")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Filter:
    """A model that is ready to start: its states, and the unknown bias as one direction of them."""

    space: StateSpace
    start_gain: Array
    start_covariance: Array
    steady: SteadyState | None


def _discrete(model: NoiseModel, dt: float, sampling: str, span: float) -> _Filter:
    from allanite.filtering.kalman import merged, steady_state

    noise = merged(model.state_space(dt, sampling=sampling, record=span))
    if not noise.noise > 0:
        raise InputError(
            "the noise model has no white noise: a filter of single samples needs N, or a term like it"
        )
    walk = next((i for i in range(noise.size) if _walks(noise, i)), None)
    space = noise if walk is not None else noise.with_constant("bias")
    unknown = np.eye(space.size)[space.size - 1 if walk is None else walk]
    unknown = (
        space.transition @ unknown
    )  # what a constant in the walk is at a sample: in the mean over it too
    h = space.output
    gain = unknown / (h @ unknown)
    left = np.eye(space.size) - np.outer(gain, h)
    start = left @ space.initial @ left.T + space.noise * np.outer(gain, gain)
    steady = steady_state(space) if walk is not None else None
    return _Filter(
        space=space,
        start_gain=gain,
        start_covariance=start,
        steady=steady,
    )


def _walks(space: StateSpace, i: int) -> bool:
    others = np.arange(space.size) != i
    return bool(
        space.transition[i, i] == 1 and not space.transition[i, others].any() and space.process[i, i] > 0
    )


# -- text ------------------------------------------------------------------------------------------------------


def _why(document: Json, axis: Json, wanted: str | None) -> str:
    """First line: whose filter it is, and why of that channel."""
    text, count = f"Bias filter of channel {_plain(axis['name'])}", len(document["channels"])
    if count == 1:
        return f"{text}, the only one"
    if wanted is not None:
        return f"{text}, one of {count}"
    alike = sum(c["kind"] == axis["kind"] for c in document["channels"])
    if alike == 1:
        return f"{text}, the only one of its kind"
    which = "" if alike == count else " of its kind"
    return f"{text}, the worst axis of {alike} channels{which}: the largest Allan deviation, averaged over octaves"


def _choices(
    document: Json, axis: Json, model: NoiseModel, made: _Filter, rate: float, span: float, sampling: str
) -> list[str]:
    """The comment at the head: where the numbers come from, and every choice."""
    provenance, recording = document.get("provenance") or {}, document["recording"]
    source = provenance.get("source") or "samples or models in memory"
    digest = f", SHA-256 {provenance['sha256']}" if provenance.get("sha256") else ""
    lines = [
        f"written by allanite {__version__} from {_plain(source)}{digest}",
        f"discrete at {rate:.9g} Hz; a sample is "
        + ("the mean over its interval" if sampling == "mean" else "the value at an instant"),
    ]
    if rate < recording["rate"] * (1 - 1e-9):
        lines.append(
            f"the study has {recording['rate']:.9g} Hz: FEED MEANS of its samples over 1/{rate:.9g} s"
        )
    if rate > recording["rate"] * (1 + 1e-9):
        lines.append(f"the study has {recording['rate']:.9g} Hz: above that the noise is EXTRAPOLATED")
    lines += renewed_lines([axis])
    lines += [f"noise: {text}" for text in _terms(axis, model)]
    bound = bound_comments(_plain(axis["name"]), axis["models"])
    if bound and model.term("flicker") is not None:
        bound.append("the states of its flicker hold that within 1 % of its Allan deviation")
    lines += [*bound, *motion_comments(_plain(axis["name"]), axis["models"]), *aliasing_comments(axis)]
    if len(axis["models"]) > 1:
        drifts = (
            f", which drifts more over {span / 2:.6g} s" if model.family == _worst(axis, span).family else ""
        )
        lines.append(
            f"the record cannot decide between {len(axis['models'])} models; this is the one of the family "
            f"{model.family or 'given'}{drifts}"
        )
    if model.term("flicker") is not None:
        lines.append(
            f"flicker: a sum of Gauss-Markov states from one sample to {span:.6g} s, a factor 10 apart"
        )
    slowest = made.space.transition.diagonal()
    if (slowest[slowest < 1] > 1 - 1e-6).any():
        lines.append(
            "the slowest states hardly decay in one step: in float, feed means at a lower rate (filter_rate)"
        )
    lines.append("C++17 with <math.h>, <stddef.h> and <stdint.h>; no other file, no heap, no exceptions")
    return lines


def _terms(axis: Json, model: NoiseModel) -> list[str]:
    """Each term with its coefficients in SI, and the limits of what the record does not resolve."""
    estimates = {e.symbol: e for e in model.estimates}
    lines = []
    for term in model.terms:
        parts = []
        for symbol in term.symbols:
            unit = _si(axis, symbol)
            text, known = f"{symbol} = {getattr(term, symbol):.6e} {unit}", estimates.get(symbol)
            if known is not None and known.supported:
                text += f" [{known.lower:.3e}, {known.upper:.3e}]"
            parts.append(text)
        lines.append(f"{term.type.replace('_', ' ')} {', '.join(parts)}")
    held = {letter for term in model.terms for letter in _LETTERS[term.type]}
    for e in estimates.values():
        if not e.supported and math.isfinite(e.upper) and e.symbol in ("Q", "B", "K", "R", "B_equiv"):
            limit = f"{e.symbol} < {e.upper:.6e} {_si(axis, e.symbol)} (95 % upper limit): not resolved"
            lines.append(
                f"{limit}, in this filter as above: the record needs slow noise and cannot tell which"
                if e.symbol in held
                else f"{limit}, NOT in this filter"
            )
    return lines


def _si(axis: Json, symbol: str) -> str:
    """The SI unit of a coefficient, in ASCII."""
    if symbol in ("amplitude", "frequency"):
        return "Hz" if symbol == "frequency" else _unit(axis)
    text = si_unit(axis["kind"], symbol, axis.get("unit") or "")
    for sign, plain in (("√Hz", "sqrt(Hz)"), ("√s", "sqrt(s)"), ("²", "^2"), ("³", "^3"), ("·", "*")):
        text = text.replace(sign, plain)
    return _plain(text)


def _constants(made: _Filter, scalar: str, namespace: str, rate: float, unit: str) -> list[str]:
    space, n = made.space, made.space.size
    guard = f"ALLANITE_{namespace.upper()}_MODEL_HPP"

    def array(name: str, values: Array, comment: str) -> list[str]:
        rows = np.atleast_2d(values)
        text = ",\n".join("    " + ", ".join(_literal(x, scalar) for x in row) for row in rows)
        size = "n_states * n_states" if values.ndim == 2 else "n_states"
        return ["", f"/// {comment}", f"constexpr Scalar {name}[{size}] = {{", text + "};"]

    def number(name: str, value: float, comment: str) -> str:
        return f"constexpr Scalar {name} = {_literal(value, scalar)};  ///< {comment}"

    steady = [
        "",
        "// No steady gain: the bias is a constant here, and the filter's gain falls for ever.",
    ]
    if made.steady is not None:
        comment = "Gain of the filter once it has settled: s += steady_gain * (y - output s), then s = transition s."
        sd = math.sqrt(float(space.rate @ made.steady.predicted @ space.rate))
        innovation_sd = math.sqrt(made.steady.innovation_variance)
        steady = [
            *array("steady_gain", made.steady.gain, comment),
            number(
                "steady_sd", sd, f"[{unit}] of bias(), the prediction for the next sample, with it, at rest"
            ),
            number("steady_innovation_sd", innovation_sd, f"[{unit}] of y less its prediction"),
        ]
    return [
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        *_arithmetic("kalman.hpp", "square_root.hpp"),
        f"namespace {namespace} {{",
        "",
        f"using Scalar = {scalar};",
        "",
        f"constexpr int n_states = {n};",
        *(f"//   {i}: {text}" for i, text in enumerate(_labels(space, 1 / rate))),
        "",
        number("rate", rate, "[Hz] samples per second that the filter is fed with"),
        number("noise", space.noise, f"[({unit})^2] variance of v"),
        *array("transition", space.transition, "F, row by row, over one sample interval."),
        *array("process", space.process, f"Covariance of w [({unit})^2], row by row."),
        *array("output", space.output, "h: what a sample holds of the states."),
        *array("bias_of_states", space.rate, f"r: the bias [{unit}] is r . s, at the end of the sample."),
        *array("start_gain", made.start_gain, "State after the first sample y: start_gain * y."),
        *array("start_covariance", made.start_covariance, f"Its covariance [({unit})^2]."),
        *steady,
        "",
        *_filter(with_gain=made.steady is not None),
        "",
        f"}}  // namespace {namespace}",
        "",
        "#endif",
    ]


def include_path() -> Path:
    """The folder with the headers of the kernels, for the include path of a compiler: allanite/kalman.hpp is below it.

    The header of `write` needs none of them.

    Raises
    ------
    StorageError
        The installed package lacks it.
    """
    for place in allanite.__path__:
        if (folder := Path(place) / "include" / "allanite").is_dir():
            return folder.parent
    raise StorageError(
        f"the folder include/allanite is missing from the installed package ({allanite.__path__[0]}): install allanite "
        "again"
    )


def _arithmetic(*names: str) -> list[str]:
    """The lines of headers of the kernels, and before each those of what it includes, each header once."""
    folder = include_path() / "allanite"
    lines: list[str] = []
    written: set[str] = set()

    def add(name: str) -> None:
        if name in written:
            return
        written.add(name)
        text = (folder / name).read_text(encoding="utf-8").splitlines()
        for line in text:
            if included := _OWN_INCLUDE.match(line):
                add(included[1])
        lines.extend([f"// -- allanite/{name} ---", *(x for x in text if not _OWN_INCLUDE.match(x)), ""])

    for name in names:
        add(name)
    return lines


def _filter(*, with_gain: bool) -> list[str]:
    """The lines of bias_filter.hpp, those of the fixed gain only where there is one."""
    text = Path(__file__).with_name("bias_filter.hpp").read_text(encoding="utf-8")
    _, full, fixed = re.split(r"^(?=// -- )", text, flags=re.M)
    return (full + fixed if with_gain else full).rstrip().splitlines()


def _labels(space: StateSpace, dt: float) -> list[str]:
    texts = []
    for i, label in enumerate(space.labels):
        phi = float(space.transition[i, i])
        if label == "mean":
            texts.append("mean over the sample of the states above")
        elif label == "bias":
            texts.append("the turn-on bias: a constant of which nothing is known")
        elif _walks(space, i):
            parts = ["the random walk of K"] * (label == "random_walk")
            parts += ["the slow end of flicker"] * ("flicker" in space.labels)
            texts.append(f"{' and '.join(parts)}, and the turn-on bias, of which nothing is known")
        elif 0 < phi < 1:
            texts.append(f"{label.replace('_', ' ')}, correlation time {-dt / math.log(phi):.4g} s")
        else:
            texts.append(label.replace("_", " ") + (", faster than a sample" if phi == 0 else ""))
    return texts


def _literal(value: float, scalar: str) -> str:
    text = f"{value:.{_DIGITS[scalar]}g}"
    if not re.search(r"[.e]", text):
        text += ".0"
    return text + ("F" if scalar == "float" else "")


def _plain(text: str) -> str:
    """Text of a user on one line of ASCII that ends no comment and continues none."""
    return plain_line(text).replace("\\", "/")
