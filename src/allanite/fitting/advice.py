# SPDX-License-Identifier: BSD-3-Clause
"""How long must one record? Predicted from the fitted model and the covariance of the curve, before recording."""

from __future__ import annotations

import math

import numpy as np

from allanite.errors import InputError
from allanite.fitting.design import MARKOV, TIME_OF, TIME_POWER, Times, design_of
from allanite.fitting.objective import CurveData, solve
from allanite.fitting.record_lengths import Advice
from allanite.fitting.sets import fisher_sd
from allanite.noise import Estimate, Flicker, GaussMarkov, NoiseModel, RandomWalk, Sinusoid
from allanite.noise.allan.lags import octave_lags

__all__ = [
    "advise",
    "predicted_sd",
    "record_length",
]

_GOAL = 0.10  # relative standard deviation worth recording for
_SEEN = 1 / 6  # relative standard deviation of an amplitude that stands three sigma from zero
_LONGEST = 4096  # times the present record: beyond that nobody records
_STEP = 4  # from one tried length to the next
_SYMBOLS = {
    "quantisation": "Q",
    "white": "N",
    "flicker": "B",
    "random_walk": "K",
    "ramp": "R",
    "gauss_markov": "G",
}
#: Amplitudes of Gauss-Markov terms, the quicker one first.
_NAMES = {"G": "sigma", "G2": "sigma_2"}


def predicted_sd(model: NoiseModel, *, n_samples: int, dt: float, sampling: str = "mean") -> dict[str, float]:
    """Relative standard deviation of each amplitude (and of T) that a record of this length gives.

    Parameters
    ----------
    model : NoiseModel
        Of Q, N, B, K, R and up to two Gauss-Markov terms; sinusoids are passed over.

    Raises
    ------
    InputError
        A model with another term, two of one kind, or three Gauss-Markov terms.
    """
    symbols, c, times = _coefficients(model, dt)
    design = design_of(octave_lags(n_samples), n_samples, sampling)
    curve = CurveData(design.columns(symbols, times) @ c, design)
    at = solve(curve, symbols, times=times, fixed=dict(zip(symbols, c, strict=True)))
    relative = fisher_sd(curve, at)
    return {_NAMES.get(s, s): v if s in TIME_OF.values() else v / 2 for s, v in relative.items()}


def _coefficients(model: NoiseModel, dt: float) -> tuple[tuple[str, ...], np.ndarray, Times]:
    values: dict[str, float] = {}
    times: list[float] = []
    for term in sorted(model.terms, key=lambda t: t.T if isinstance(t, GaussMarkov) else 0.0):
        if isinstance(term, Sinusoid):  # a line of known frequency takes next to nothing from the other terms
            continue
        symbol = _SYMBOLS.get(term.type)
        if isinstance(term, GaussMarkov) and len(times) < len(MARKOV):
            symbol = MARKOV[len(times)]
            times.append(term.T / dt)
        if symbol is None or symbol in values:
            raise InputError(
                f"prediction takes one term each of {', '.join(_SYMBOLS)}, and a second gauss_markov; got {model}"
            )
        amplitude = term.sigma if isinstance(term, GaussMarkov) else getattr(term, symbol)
        values[symbol] = (amplitude / dt ** TIME_POWER[symbol]) ** 2
    symbols = tuple(values)
    scale = max(values.values(), default=1.0)
    return symbols, np.array([values[s] for s in symbols]) / scale, tuple(times)


def advise(model: NoiseModel, *, n_samples: int, dt: float, sampling: str = "mean") -> tuple[Advice, ...]:
    """Advice for every parameter of a fitted model that is worth a longer record."""
    out = []
    for e in model.estimates:
        if e.symbol in ("B", "K", "T", "sigma") and (e.supported or e.symbol in ("B", "K")):
            out.append(_one(model, e, n_samples, dt, sampling))
    return tuple(a for a in out if a is not None)


def _one(model: NoiseModel, e: Estimate, n_samples: int, dt: float, sampling: str) -> Advice | None:
    supposed = model if e.supported else _with_half_limit(model, e)
    if supposed is None:
        return None
    target = _GOAL if e.supported else _SEEN
    duration = record_length(supposed, e.symbol, target, n_samples=n_samples, dt=dt, sampling=sampling)
    reached = duration <= n_samples * dt
    return Advice(symbol=e.symbol, target=target, duration=duration, reached=reached, resolved=e.supported)


def _with_half_limit(model: NoiseModel, e: Estimate) -> NoiseModel | None:
    if not (math.isfinite(e.upper) and e.upper > 0) or (e.symbol == "B" and model.family != "flicker"):
        return None
    term = Flicker(B=e.upper / 2) if e.symbol == "B" else RandomWalk(K=e.upper / 2)
    return NoiseModel(terms=(*(t for t in model.terms if t.type != term.type), term), kind=model.kind)


def record_length(
    model: NoiseModel, symbol: str, target: float, *, n_samples: int, dt: float, sampling: str = "mean"
) -> float:
    """Length of record [s] that gives an amplitude this relative standard deviation; infinite where none does.

    Longer by factors of four from `n_samples` on until the target is met, then interpolated in the logarithm: the
    deviation falls at least as the root of the length.

    Parameters
    ----------
    model : NoiseModel
        As for `predicted_sd`.
    symbol : str
        Of its amplitudes.
    target : float
        Relative standard deviation.
    """
    factor, previous = 1, math.inf
    while factor <= _LONGEST:
        sd = predicted_sd(model, n_samples=n_samples * factor, dt=dt, sampling=sampling).get(symbol, math.inf)
        if sd <= target:
            if factor == 1 or not math.isfinite(previous):
                return n_samples * dt * factor * min(1.0, max((sd / target) ** 2, 1e-3))
            slope = math.log(previous / sd) / math.log(_STEP)
            return float(n_samples * dt * factor * (sd / target) ** (1 / max(slope, 0.5)))
        previous = sd
        factor *= _STEP
    return math.inf
