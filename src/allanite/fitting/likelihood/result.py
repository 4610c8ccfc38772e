# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood fit of a recording: both families, or given terms, and a model with an interval for everything."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from allanite.errors import FitError, InputError
from allanite.fitting.estimates import amplitude_estimate, equivalent_flicker, limit_estimate, time_estimate
from allanite.fitting.likelihood.coarser import EXPLAINED, explained_part
from allanite.fitting.likelihood.exact import sharpened, shifted
from allanite.fitting.likelihood.family import (
    FLICKER,
    GAUSS_MARKOV,
    TWO_GAUSS_MARKOV,
    LikelihoodFamilyFit,
    fit_family,
    flicker_limit,
)
from allanite.fitting.likelihood.lines import line_price
from allanite.fitting.likelihood.maximum import Peak
from allanite.fitting.likelihood.problem import LikelihoodProblem, Maximum, checked_letters
from allanite.fitting.likelihood.proposed_lines import AskedLines, ProposedLines, proposed_lines
from allanite.fitting.likelihood.slow import ShownSum, slow_facts
from allanite.fitting.lines_left_in import with_lines_left_in
from allanite.fitting.rivals import (
    DOUBTFUL,
    PAYS_FOR_TIME,
    PAYS_FOR_TWO,
    REJECTS_FLICKER,
    leaves_slow_noise_open,
    supported_families,
)
from allanite.fitting.undecided import over_families, with_alternative
from allanite.fitting.verdict import (
    CONTRADICTED,
    quick_words,
    stand_in_words,
    supported_words,
    with_slow_notes,
)
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Estimate, NoiseModel
from allanite.noise.quick_terms import is_quick
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.records import Recording

__all__ = ["fit_likelihood", "fit_problem"]


def fit_likelihood(
    recording: Recording,
    *,
    channel: str | None = None,
    terms: str | Sequence[str] | None = None,
    lines: AskedLines = "auto",
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
    terms : str or sequence of str, optional
        The sum to fit, by letters: Q, N, B, K, R, and G once or twice for Gauss-Markov terms, as in "NGK" or "NGGK".
        By default flicker or a Gauss-Markov term, or both models, besides Q, N, K and R; and two Gauss-Markov terms
        where one does not explain the record and two do.
    lines : sequence of float [Hz], or "auto"
        Spectral lines that are fitted with the noise: near these frequencies, or the steady lines of the spectrum.
        Others that the spectrum shows stay in the record: "lines_left_in" of `goodness` [Hz], and the verdict.
    engine : "auto", "composite" or "exact"
        "auto" is the composite, see `LikelihoodProblem.of`.
    confidence : float
    block : int, optional
        Leave out what happens within so many samples. By default nothing is left out, unless no sum of terms
        explains it.

    Raises
    ------
    InputError
        Another engine, a channel that is not there, letters that are no terms, a confidence outside ]0, 1[, a block
        that is no number of samples, lines that are neither "auto" nor frequencies below rate/2 with at least
        four periods.
    DataQualityError
        Too few samples or no noise.
    FitError
        No maximum was found.
    LimitError
        Too many samples for the exact engine.
    """
    require_probabilities(confidence=confidence)
    if engine not in ("auto", "composite", "exact"):
        raise InputError(f"engine must be 'auto', 'composite' or 'exact', not {engine!r}")
    kind = "exact" if engine == "exact" else "composite"
    letters = None if terms is None else checked_letters(terms)
    problem = LikelihoodProblem.of(recording, channel, block=1 if block is None else block, engine=kind)

    def fitted(problem: LikelihoodProblem) -> NoiseModel:
        if letters is not None:
            return _given(problem, letters, confidence)
        if block is None and kind == "composite":
            return _judged(explained_part(problem, _looked_at), confidence)
        return fit_problem(problem, confidence)

    return _beside_lines(problem, proposed_lines(problem, lines), fitted)


def _beside_lines(
    problem: LikelihoodProblem, proposed: ProposedLines, fitted: Callable[[LikelihoodProblem], NoiseModel]
) -> NoiseModel:
    """The model with its lines; one that was found in the spectrum but is not supported stays in the record."""
    if not proposed.frequencies:
        return with_lines_left_in(fitted(problem), proposed.left_in)
    model = fitted(problem.with_lines(proposed.frequencies, proposed.widths))
    amplitudes = [e for e in model.estimates if e.symbol.startswith("amplitude")]
    weak = [f for f, e in zip(proposed.frequencies, amplitudes, strict=True) if not e.supported]
    if proposed.automatic and weak:
        return _beside_lines(problem, proposed.without(weak), fitted)
    return with_lines_left_in(model, proposed.left_in)


def fit_problem(problem: LikelihoodProblem, confidence: float = 0.95) -> NoiseModel:
    """Noise model of a channel whose likelihood is known, nothing left out."""
    return _judged(_looked_at(problem)[0], confidence)


def _given(problem: LikelihoodProblem, letters: tuple[str, ...], confidence: float) -> NoiseModel:
    """The model of just these terms."""
    random, ramp = tuple(s for s in letters if s != "R"), "R" in letters
    peak = problem.peak(random, slope=None if ramp else 0.0, averaged=ramp)
    _refuse_nothing(peak)
    fit = fit_family(problem, random, peak, confidence, ramp=ramp, keep=True)
    return _with_verdict([_model(problem, fit, confidence)], problem.dt)[0]


def _refuse_nothing(*peaks: Peak) -> None:
    if not all(math.isfinite(p.log_likelihood) for p in peaks):
        raise FitError("no sum of noise terms describes the record; check the findings and the time series")


# -- which families ---------------------------------------------------------------------------------------


Candidate = tuple[tuple[str, ...], Peak]  # letters and their best fit


@dataclass(frozen=True, slots=True)
class _Looks:
    """A problem and the best fits that are worth a model: both families, or two Gauss-Markov terms alone."""

    problem: LikelihoodProblem
    candidates: tuple[Candidate, ...]


def _looked_at(problem: LikelihoodProblem) -> tuple[_Looks, float]:
    """Both families, or one or two Gauss-Markov terms of any correlation time where these explain what is left."""
    both = tuple(
        (letters, problem.peak(letters, slope=None, averaged=True)) for letters in (FLICKER, GAUSS_MARKOV)
    )
    _refuse_nothing(*(peak for _, peak in both))
    p = max(problem.described(peak, letters).p for letters, peak in both)
    (_, flicker), (_, markov) = both
    gain = 2 * (markov.log_likelihood - flicker.log_likelihood)
    at_end = gain > REJECTS_FLICKER and _time(markov) <= 1.001 * problem.search.times[0]
    if p >= DOUBTFUL and not at_end:
        return _Looks(problem, both), p
    wide, below = replace(problem, shortest=1.0), markov
    for letters in (GAUSS_MARKOV, TWO_GAUSS_MARKOV):
        other = wide.peak(letters, slope=None, averaged=True, nested=[below])
        better = wide.described(other, letters).p
        gain = 2 * (other.log_likelihood - max(peak.log_likelihood for _, peak in both))
        price = PAYS_FOR_TIME if at_end and letters == GAUSS_MARKOV else PAYS_FOR_TWO
        if better >= EXPLAINED and gain > price:
            return _Looks(wide, ((letters, other),)), better
        below = other
    return _Looks(problem, both), p


def _time(peak: Peak) -> float:
    """Correlation time of the Gauss-Markov term of a peak [samples]."""
    return next(k.T for k in peak.at.components if k.T is not None)


def _judged(looks: _Looks, confidence: float) -> NoiseModel:
    fits = _families(looks, confidence)
    sums = [
        ShownSum(
            letters=f.letters, shown=frozenset(f.letters[i] for i in f.supported), peak=f.best, ramp=f.ramp
        )
        for f in fits
    ]
    facts = slow_facts(looks.problem, sums)
    models = over_families([_model(looks.problem, f, confidence, facts) for f in fits], facts=facts)
    return with_alternative(_with_verdict(models, looks.problem.dt))


def _families(looks: _Looks, confidence: float) -> list[LikelihoodFamilyFit]:
    """The family the record supports, or both, the better one first."""

    def fitted(candidate: Candidate, name: str) -> tuple[LikelihoodFamilyFit, bool]:
        fit = fit_family(looks.problem, *candidate, confidence)
        at = fit.selected.at
        needed = [k.symbol for k, c in zip(at.components, at.c, strict=True) if c > 0]
        supported = [fit.letters[i] for i in fit.supported]
        return fit, fit.supports(name) or (name == "B" and leaves_slow_noise_open(needed, supported))

    if len(looks.candidates) == 1:
        return [fitted(looks.candidates[0], "G")[0]]
    flicker, markov = looks.candidates
    gain = 2 * (markov[1].log_likelihood - flicker[1].log_likelihood)
    return supported_families(gain, -gain, partial(fitted, flicker, "B"), partial(fitted, markov, "G"))


def _with_verdict(models: list[NoiseModel], dt: float) -> list[NoiseModel]:
    text = "By maximum likelihood, " + supported_words(models)
    facts = models[0].goodness
    if facts["left_out"]:
        text += (
            f" The noise within {facts['shortest_tau']:.3g} s fits none of the tested sums of terms (the "
            "sensor's filter, vibration) and is left out."
        )
    if facts["p"] < CONTRADICTED:
        text += (
            f" The model does not explain the record well (p = {facts['p']:.1g}): it contains something "
            "else, which the intervals do not include."
        )
    text += quick_words(models[0], dt) + stand_in_words(facts, "its Allan curve")
    return [replace(m, verdict=text) for m in models]


# -- from sample units to a model -------------------------------------------------------------------------


def _model(
    problem: LikelihoodProblem,
    fit: LikelihoodFamilyFit,
    confidence: float,
    slow: Mapping[str, float] | None = None,
) -> NoiseModel:
    """With the facts of `slow_facts`, where they were asked for."""
    if problem.engine == "exact":
        fit = _exact(problem, fit, confidence)
    ramp = ("R",) if fit.ramp else ()
    described = problem.described(fit.selected, (*fit.letters, *ramp))
    channel = problem.channel
    return NoiseModel(
        terms=described.terms,
        family="gauss-markov" if "G" in fit.letters else "flicker",
        estimates=(
            *with_slow_notes(_estimates(problem, fit, confidence), slow or {}),
            *_line_estimates(described, problem.line_gains(fit.selected), problem.widths, confidence),
        ),
        confidence=confidence,
        covariance=described.covariance,
        goodness={
            "chi2": described.chi2,
            "dof": described.dof,
            "p": described.p,
            "discrepancy": 0.0,
            "shortest_tau": problem.block * problem.dt,
            "left_out": int(problem.block > 1),
            "method": "likelihood",
            "engine": problem.engine,
            "log_likelihood": described.log_likelihood,
            **(slow or {}),
        },
        kind=channel.kind.value,
        unit="" if channel.kind.has_si else channel.unit,
    )


def _exact(problem: LikelihoodProblem, fit: LikelihoodFamilyFit, confidence: float) -> LikelihoodFamilyFit:
    """The same terms with the exact maximum; its profiles are those of the composite with the exact gradient."""
    search, objective = problem.search, problem.objective
    best = sharpened(search, objective, fit.best, problem.samples, problem.channel.sampling)
    pull = -objective(best.at).gradient
    pull[[i for i in range(len(pull)) if i not in best.moving()]] = 0.0
    corrected = replace(problem, correction=(best, pull))
    again = Peak(best.at, shifted(objective, best, pull)(best.at))
    kept, ramp = fit.selected is fit.best, fit.slope is not None
    return fit_family(corrected, fit.letters, again, confidence, ramp=ramp, keep=kept)


def _estimates(problem: LikelihoodProblem, fit: LikelihoodFamilyFit, confidence: float) -> list[Estimate]:
    """Amplitudes in the order of the letters, the ramp, then what belongs to the Gauss-Markov terms."""
    names, n = problem.names(fit.best), len(fit.letters)
    values, full = _point_values(problem, fit), problem.parameters(fit.best, ramp=False)
    estimates = [
        amplitude_estimate(
            names[i],
            (problem.amplitude(letter, fit.sets[i][0]), problem.amplitude(letter, fit.sets[i][1])),
            values.get(names[i], 0.0),
            partial(full.__getitem__, names[i]),
            supported=i in fit.supported,
            measured="record",
        )
        for i, letter in enumerate(fit.letters)
    ]
    markov: list[Estimate] = []
    sigmas = [e for e in estimates if e.symbol.startswith("sigma")]
    quick = 0
    for place, sigma in zip(range(n, len(names)), sigmas, strict=True):
        time = _time_estimate(problem, fit, place, values if values.get(sigma.symbol, 0.0) > 0 else full)
        is_bandwidth = sigma.supported and time.value is not None and is_quick(time.value / problem.dt)
        quick += is_bandwidth
        markov += [*([] if is_bandwidth else [equivalent_flicker(sigma)]), time]
    if quick and quick == len(sigmas) and "B" not in fit.letters:
        markov.append(limit_estimate("B", problem.amplitude("B", flicker_limit(problem, fit, confidence))))
    return [*estimates, *_slope_estimates(problem, fit), *markov]


def _line_estimates(
    maximum: Maximum, gains: Sequence[float], widths: float, confidence: float
) -> Iterator[Estimate]:
    """Amplitude and frequency of each line: normal intervals by the density of the noise at the line.

    The largest wave within the widths over which it was looked for is never nothing: a line that noise alone would
    give in one of a hundred records is a limit.
    """
    symbols = maximum.covariance.get("symbols", [])
    lines = [i for i, s in enumerate(symbols) if s.startswith(("amplitude", "frequency"))]
    half = float(normal_quantile(0.5 + confidence / 2))
    of_each = [gain for gain in gains for _ in ("amplitude", "frequency")]
    for i, gain in zip(lines, of_each, strict=True):
        symbol, value = symbols[i], maximum.parameters[symbols[i]]
        ends = half * math.sqrt(maximum.covariance["matrix"][i][i]) * value
        if symbol.startswith("amplitude"):
            supported = bool(gain > line_price(widths))
        if symbol.startswith("amplitude") and not supported:
            yield limit_estimate(symbol, value + ends)
        else:
            note = "" if supported else "of a line that is not resolved"
            yield Estimate(
                symbol=symbol,
                value=value,
                lower=max(value - ends, 0.0),
                upper=value + ends,
                supported=supported,
                note=note,
            )


def _point_values(problem: LikelihoodProblem, fit: LikelihoodFamilyFit) -> dict[str, float]:
    """Point estimates by their names in the full sum."""
    values, names = problem.parameters(fit.selected, ramp=False), problem.names(fit.best)
    alone = [names[i] for i in fit.supported if fit.letters[i] == "G"]
    if alone == ["sigma_2"] and "sigma_2" not in values:  # of two, the slower one is left
        values |= {"sigma_2": values.pop("sigma"), "T_2": values.pop("T")}
    return values


def _time_estimate(
    problem: LikelihoodProblem, fit: LikelihoodFamilyFit, place: int, values: Mapping[str, float]
) -> Estimate:
    name, dt = problem.names(fit.best)[place], problem.dt
    shortest, longest = problem.search.times
    ends = fit.sets.get(place)
    return time_estimate(
        name,
        None if ends is None else (ends[0] * dt, ends[1] * dt),
        (shortest * dt, longest * dt),
        values[name],
    )


def _slope_estimates(problem: LikelihoodProblem, fit: LikelihoodFamilyFit) -> list[Estimate]:
    """That of the ramp, where there may be one."""
    if fit.slope is None:
        return []
    low, high = sorted(problem.slope(s) for s in fit.slope)
    if not fit.ramp:
        return [limit_estimate("R", high)]
    value = problem.slope(fit.selected.value.slope)
    return [Estimate(symbol="R", value=value, lower=min(low, value), upper=max(high, value), supported=True)]
