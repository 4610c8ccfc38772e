# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood fit of a recording: both families, the verdict, and a noise model with an interval for everything."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from allanite.allan.degrees import chi_square_factors
from allanite.errors import FitError, InputError
from allanite.fitting.likelihood.exact import sharpened, shifted
from allanite.fitting.likelihood.family import FLICKER, GAUSS_MARKOV, FamilyFit, fit_family
from allanite.fitting.likelihood.maximum import Peak
from allanite.fitting.likelihood.problem import LikelihoodProblem
from allanite.fitting.verdict import supported_words
from allanite.noise import SIGMA_PER_B, Estimate, NoiseModel
from allanite.recording import Recording

__all__ = ["fit_likelihood", "fit_problem"]

Peaks = tuple[Peak, Peak]  # of flicker and of Gauss-Markov

#: Twice the advantage in log-likelihood of the rival that rejects a family. A flicker record gives the first to a
#: Gauss-Markov term, which has one parameter more, in about one of a hundred.
_REJECTS_FLICKER, _REJECTS_GAUSS_MARKOV = 8.0, 5.0
#: Undecided: Gauss-Markov stands first from here on.
_PREFERS_GAUSS_MARKOV = 4.0
#: Goodness below which the shortest means are left out, that which is enough then, and the means tried [samples].
_NOT_EXPLAINED, _EXPLAINED = 1e-4, 1e-2
_COARSER = (4, 16, 64, 256)
_FEWEST_ROWS = 1000


def fit_likelihood(
    recording: Recording,
    *,
    channel: str | None = None,
    lines: Sequence[float] = (),
    engine: str = "auto",
    confidence: float = 0.95,
    block: int | None = None,
) -> NoiseModel:
    """Noise model of a channel by maximum likelihood.

    Parameters
    ----------
    recording : Recording
        At rest; NaN are gaps.
    channel : str, optional
    lines : sequence of float [Hz]
        Spectral lines to be fitted with the noise.
    engine : "auto", "composite" or "exact"
        "auto" is the composite, see `LikelihoodProblem.of`.
    confidence : float
    block : int, optional
        Leave out what happens within so many samples. By default nothing is left out, unless no sum of terms
        explains it.

    Raises
    ------
    InputError
        Another engine, a channel that is not there, a confidence outside ]0, 1[.
    DataQualityError
        Too few samples or no noise.
    FitError
        No maximum was found.
    LimitError
        Too many samples for the exact engine.
    """
    import numpy as np

    chi_square_factors(np.array([1.0]), confidence)
    if engine not in ("auto", "composite", "exact"):
        raise InputError(f"engine must be 'auto', 'composite' or 'exact', not {engine!r}")
    kind = "exact" if engine == "exact" else "composite"
    problem = _read(recording, channel, lines, kind, block or 1)
    peaks = _peaks(problem)
    if block is None and kind == "composite" and _goodness(problem, peaks) < _NOT_EXPLAINED:
        problem, peaks = _explained_part(recording, channel, lines, (problem, peaks))
    return _judged(problem, peaks, confidence)


def fit_problem(problem: LikelihoodProblem, confidence: float = 0.95) -> NoiseModel:
    """Noise model of a channel whose likelihood is known, nothing left out."""
    return _judged(problem, _peaks(problem), confidence)


def _judged(problem: LikelihoodProblem, peaks: Peaks, confidence: float) -> NoiseModel:
    models = [_model(problem, f, confidence) for f in _families(problem, peaks, confidence)]
    verdict = _verdict(models)
    primary = replace(models[0], verdict=verdict)
    return primary if len(models) == 1 else replace(primary, alternative=replace(models[1], verdict=verdict))


# -- reading, and what can be explained -------------------------------------------------------------------


def _read(
    recording: Recording, channel: str | None, lines: Sequence[float], engine: str, block: int
) -> LikelihoodProblem:
    problem = LikelihoodProblem.of(recording, channel, block=block, engine=engine)
    return problem.with_lines(lines) if len(lines) else problem


def _peaks(problem: LikelihoodProblem) -> Peaks:
    """The best fit of both families, each with a ramp."""
    peaks = problem.peak(FLICKER, slope=None), problem.peak(GAUSS_MARKOV, slope=None)
    if not all(math.isfinite(p.log_likelihood) for p in peaks):
        raise FitError(
            "no sum of noise terms describes the record; look at the findings and at the time series"
        )
    return peaks


def _goodness(problem: LikelihoodProblem, peaks: Peaks) -> float:
    return max(
        problem.described(peak, letters).p
        for peak, letters in zip(peaks, (FLICKER, GAUSS_MARKOV), strict=True)
    )


def _explained_part(
    recording: Recording, channel: str | None, lines: Sequence[float], whole: tuple[LikelihoodProblem, Peaks]
) -> tuple[LikelihoodProblem, Peaks]:
    """Longer and longer means, until a sum of terms explains the rest; the whole record where none does."""
    for block in _COARSER:
        if recording.n_samples // block < _FEWEST_ROWS:
            break
        problem = _read(recording, channel, lines, "composite", block)
        peaks = _peaks(problem)
        if _goodness(problem, peaks) >= _EXPLAINED:
            return problem, peaks
    return whole


# -- families ---------------------------------------------------------------------------------------------


def _families(problem: LikelihoodProblem, peaks: Peaks, confidence: float) -> list[FamilyFit]:
    """The family the record supports, or both, the better one first."""
    flicker, markov = peaks
    advantage = 2 * (markov.log_likelihood - flicker.log_likelihood)
    if advantage > _REJECTS_FLICKER:
        return [fit_family(problem, GAUSS_MARKOV, markov, confidence)]
    first = fit_family(problem, FLICKER, flicker, confidence)
    if -advantage > _REJECTS_GAUSS_MARKOV or markov.coefficient("G") == 0 or "B" not in first.supported:
        return [first]
    second = fit_family(problem, GAUSS_MARKOV, markov, confidence)
    if "G" not in second.supported:
        return [first]
    return [first, second] if advantage < _PREFERS_GAUSS_MARKOV else [second, first]


def _verdict(models: list[NoiseModel]) -> str:
    text = "By maximum likelihood, " + supported_words(models)
    facts = models[0].goodness
    if facts["left_out"]:
        text += (
            f" What happens within {facts['shortest_tau']:.3g} s follows no sum of terms (the sensor's filter, "
            "vibration) and is left out."
        )
    if facts["p"] < 0.01:
        text += (
            f" The model does not explain the record well (p = {facts['p']:.1g}): something else is in it, and the "
            "intervals do not hold that."
        )
    return text


# -- from sample units to a model -------------------------------------------------------------------------


def _model(problem: LikelihoodProblem, fit: FamilyFit, confidence: float) -> NoiseModel:
    if problem.engine == "exact":
        fit = _exact(problem, fit, confidence)
    ramp = ("R",) if fit.ramp else ()
    found = problem.described(fit.selected, (*fit.letters, *ramp))
    estimates = [_estimate(problem, fit, s) for s in fit.letters]
    estimates.append(_slope_estimate(problem, fit))
    if "G" in fit.letters:
        sigma = next(e for e in estimates if e.symbol == "sigma")
        estimates += [_times(sigma, "B_equiv", 1 / SIGMA_PER_B), _time_estimate(problem, fit)]
    channel = problem.channel
    return NoiseModel(
        terms=found.terms,
        family="gauss-markov" if "G" in fit.letters else "flicker",
        estimates=tuple(estimates),
        confidence=confidence,
        covariance=found.covariance,
        goodness={
            "chi2": found.chi2,
            "dof": found.dof,
            "p": found.p,
            "discrepancy": 0.0,
            "shortest_tau": problem.block * problem.dt,
            "left_out": int(problem.block > 1),
            "method": "likelihood",
            "engine": problem.engine,
            "log_likelihood": found.log_likelihood,
        },
        kind=channel.kind.value,
        unit="" if channel.kind.has_si else channel.unit,
    )


def _exact(problem: LikelihoodProblem, fit: FamilyFit, confidence: float) -> FamilyFit:
    """The same family with the exact maximum; its profiles are those of the composite with the exact gradient."""
    search, objective = problem.search, problem.objective
    best = sharpened(search, objective, fit.best, problem.samples, problem.channel.sampling)
    pull = -objective(best.at).gradient
    pull[[i for i in range(len(pull)) if i not in best.moving()]] = 0.0
    corrected = replace(problem, correction=(best, pull))
    again = Peak(best.at, shifted(objective, best, pull)(best.at))
    return fit_family(corrected, fit.letters, again, confidence)


def _estimate(problem: LikelihoodProblem, fit: FamilyFit, symbol: str) -> Estimate:
    low, high = (problem.amplitude(symbol, c) for c in fit.sets[symbol])
    name = "sigma" if symbol == "G" else symbol
    if symbol not in fit.supported:
        note = "upper limit"
        if fit.selected.coefficient(symbol) > 0:
            note += "; not resolved by itself, but the record needs this term or one like it"
        return Estimate(symbol=name, value=None, lower=0.0, upper=high, supported=False, note=note)
    value, note = problem.amplitude(symbol, fit.selected.coefficient(symbol)), ""
    if not low <= value <= high:
        value = problem.amplitude(symbol, fit.best.coefficient(symbol))
        note = "estimate of the full family"
    return Estimate(symbol=name, value=value, lower=low, upper=high, supported=True, note=note)


def _slope_estimate(problem: LikelihoodProblem, fit: FamilyFit) -> Estimate:
    ends = sorted(problem.slope(s) for s in fit.sets["R"])
    if not fit.ramp:
        return Estimate(symbol="R", value=None, lower=0.0, upper=ends[1], supported=False, note="upper limit")
    value = min(max(problem.slope(fit.selected.value.slope), ends[0]), ends[1])
    return Estimate(symbol="R", value=value, lower=ends[0], upper=ends[1], supported=True)


def _times(e: Estimate, symbol: str, factor: float) -> Estimate:
    value = None if e.value is None else e.value * factor
    return replace(e, symbol=symbol, value=value, lower=e.lower * factor, upper=e.upper * factor)


def _time_estimate(problem: LikelihoodProblem, fit: FamilyFit) -> Estimate:
    place = fit.selected.place("G")
    if "T" not in fit.sets or place < 0:
        return Estimate(
            symbol="T",
            value=None,
            lower=0.0,
            upper=math.inf,
            supported=False,
            note="no Gauss-Markov term is supported",
        )
    low, high = fit.sets["T"]
    shortest, longest = problem.search.times
    has_lower, has_upper = low > shortest * 1.001, high < longest / 1.001
    closed = has_lower and has_upper
    note = "" if closed else f"not identified: the record sets no {'upper' if has_lower else 'lower'} end"
    value = min(max(fit.selected.at.components[place].T or low, low), high)
    return Estimate(
        symbol="T",
        value=value * problem.dt,
        lower=low * problem.dt if has_lower else 0.0,
        upper=high * problem.dt if has_upper else math.inf,
        supported=closed,
        note=note,
    )
