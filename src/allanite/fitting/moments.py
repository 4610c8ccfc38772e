# SPDX-License-Identifier: BSD-3-Clause
"""The moment fit: noise parameters from an Allan curve with its full covariance.

Both families are tried, each with all its terms; sets come from test inversion, point estimates from the terms
that are supported.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, FitError, InputError
from allanite.fitting.design import SHORTEST_TIME, TIME_OF, TIME_POWER
from allanite.fitting.estimates import amplitude_estimate, equivalent_flicker, limit_estimate, time_estimate
from allanite.fitting.families import CurveFamilyFit, Family, fit_family, flicker_limit
from allanite.fitting.instrument import of_floor
from allanite.fitting.instrument_floor import SAME_RATE
from allanite.fitting.misfit import Floor, LagChoice, best_explained
from allanite.fitting.objective import CurveSolution, advantage, sensitivity
from allanite.fitting.rivals import leaves_slow_noise_open, supported_families
from allanite.fitting.sets import fisher_sd
from allanite.fitting.stand_ins import PowerLaws, power_laws, shortest_time
from allanite.fitting.undecided import over_families, with_alternative
from allanite.fitting.verdict import (
    CONTRADICTED,
    quick_words,
    stand_in_words,
    supported_words,
    with_slow_notes,
)
from allanite.noise import Estimate, GaussMarkov, NoiseModel, TermType, term_of
from allanite.noise.allan.curve import AllanCurve
from allanite.noise.quick_terms import is_quick
from allanite.plain_files.counted import plural
from allanite.quantities.distributions import chi_square_tail, normal_quantile
from allanite.quantities.probabilities import require_probabilities

__all__ = ["curve_slopes", "fit_moments", "lags_used"]

Array = NDArray[np.float64]

#: Gauss-Markov terms as estimates.
_NAMES = {"G": "sigma", "G2": "sigma_2"}
#: Neighbouring lags nearer than this carry the same information (correlation 0.9998) and make C singular.
_SPACING = 1.6


def lags_used(curve: AllanCurve, exclude: ArrayLike | None = None) -> NDArray[np.bool_]:
    """Which lags of a one-channel curve enter a fit: an octave-like grid with enough windows, less `exclude`.

    Parameters
    ----------
    exclude : array_like of bool, shape (n_lags,), optional
        Lags bent by a spectral line or by the sensor's own filter.
    """
    ok = (curve.count[:, 0] >= np.maximum(curve.lags, 1)) & np.isfinite(curve.deviation[:, 0])
    ok &= (curve.deviation[:, 0] > 0) & ~curve.excluded[:, 0]
    if exclude is not None:
        ok &= ~one_per_lag(exclude, len(curve.lags))
    used = np.zeros(len(curve.lags), dtype=bool)
    last = 0.0
    for i in np.flatnonzero(ok):
        if curve.lags[i] >= _SPACING * last:
            used[i] = True
            last = float(curve.lags[i])
    return used


def one_per_lag(exclude: ArrayLike, n_lags: int) -> NDArray[np.bool_]:
    mask = np.asarray(exclude, dtype=bool)
    if mask.shape != (n_lags,):
        raise InputError(
            f"exclude must hold one value for each of the {n_lags} lags; its shape is {mask.shape}"
        )
    return mask


def fit_moments(
    curve: AllanCurve,
    *,
    exclude: ArrayLike | None = None,
    confidence: float = 0.95,
    floor: AllanCurve | None = None,
) -> NoiseModel:
    """Noise model of a one-channel OADEV curve.

    Parameters
    ----------
    curve : AllanCurve
        One channel, oadev.
    exclude : array_like of bool, shape (n_lags,), optional
    confidence : float
    floor : AllanCurve, optional
        Of the instrument alone, in the unit and on the interval of `curve`: the model is then that of the sensor
        without it (`allanite.fitting.instrument`).

    Returns
    -------
    NoiseModel
        `estimates` holds every parameter of the family; `alternative` the other family where the record cannot decide.

    Raises
    ------
    InputError
        Several channels, or another statistic.
    DataQualityError
        No noise in the record, or fewer than three usable lags.
    FitError
        No minimum was found.
    """
    if curve.statistic != "oadev":
        raise InputError(
            f"the moment fit takes the oadev curve, not {curve.statistic}: the covariance between its "
            "lags is unknown. Compute the oadev curve from the log: allan_curve(recording), with "
            "disturbed samples marked as "
            "missing"
        )
    if len(curve.channels) != 1:
        raise InputError("the moment fit takes the oadev curve of one channel: fit(curve['x'])")
    require_probabilities(confidence=confidence)
    below = None if floor is None else _floor(curve, floor)
    used = lags_used(curve, exclude)
    if np.any(curve.deviation[:, 0] == 0) and not used.any():
        raise DataQualityError("the deviation is zero at every lag: no noise is resolved (resolution limit)")
    if used.sum() < 3:
        raise DataQualityError(
            f"{plural(int(used.sum()), 'lag')} can be fitted, at least 3 are needed; record longer "
            f"(now {plural(curve.n_samples, 'sample')})"
        )
    chosen = best_explained(curve, used, below)
    shortest = float(curve.tau[chosen.used][0])
    facts = {
        "discrepancy": chosen.data.discrepancy,
        "shortest_tau": shortest,
        "left_out": int(used.sum() - chosen.used.sum()),
    }
    fits = _families(chosen, confidence)
    if any("R" in f.supported for f in fits):
        facts["drift_span"] = curve.n_samples * curve.dt
    laws = _power_laws(fits)
    if laws is not None:
        facts |= _slow_time(fits, curve) | laws.facts(frozenset().union(*(f.supported for f in fits)))
    white = None if laws is None else laws.white
    sets = None if white is None else {"N": _ends("N", white, chosen.scale, curve.dt)}
    models = over_families([_model(f, chosen.scale, curve, confidence, facts) for f in fits], sets, facts)
    verdict = _verdict(models, curve.dt) + (
        " The noise of the instrument is removed." if floor is not None else ""
    )
    return with_alternative([replace(m, verdict=verdict) for m in models])


def _floor(curve: AllanCurve, floor: AllanCurve) -> Floor:
    """The floor of a curve, if it is one."""
    if len(floor.channels) != 1 or floor.statistic != "oadev":
        raise InputError("the floor is the oadev curve of one channel: fit(curve['x'], floor=floor['x'])")
    mine, other = curve.channels[0], floor.channels[0]
    if abs(floor.dt / curve.dt - 1) > SAME_RATE or other.sampling != mine.sampling:
        raise InputError(
            f"the floor has an interval of {floor.dt:.6g} s ({other.sampling}), the curve of {curve.dt:.6g} s "
            f"({mine.sampling}): the noise of an instrument depends on its settings; record both with the "
            "same settings"
        )
    if other.kind is not mine.kind:
        raise InputError(
            f"the floor is of {other.kind.value}, the curve of {mine.kind.value}: apply the scale factor "
            "to the floor first (allanite.fitting.instrument_floor.floor_of)"
        )
    used = lags_used(floor)
    if used.sum() < 3:
        raise DataQualityError(
            f"{plural(int(used.sum()), 'lag')} of the floor can be used, at least 3 are needed; record it longer "
            f"(now {plural(floor.n_samples, 'sample')})"
        )
    return Floor(floor, used)


def _families(chosen: LagChoice, confidence: float) -> list[CurveFamilyFit]:
    """The family the record supports, or both, the better one first; each is judged with its own weights."""
    data, best, other = chosen.data, chosen.flicker, chosen.markov
    if not math.isfinite(best.value):
        raise FitError("no sum of noise terms explains the curve; check the findings and the curve")

    def fitted(
        symbols: tuple[str, ...], solution: CurveSolution, name: str, shortest: float = SHORTEST_TIME
    ) -> tuple[CurveFamilyFit, bool]:
        fit = fit_family(Family(data, symbols, shortest), solution, confidence)
        if not math.isfinite(fit.selected.value):
            raise FitError(
                "the curve is that of a ramp, and no other noise is resolved; remove the trend, or check "
                "the findings and the curve"
            )
        needed = [s for s in symbols if fit.selected.coefficient(s) > 0]
        return fit, name in fit.supported or (name == "B" and leaves_slow_noise_open(needed, fit.supported))

    if chosen.other is not None:
        return [fitted(chosen.other.symbols, chosen.other, "G", 1.0)[0]]
    return supported_families(
        advantage(data, other, best),
        advantage(data, best, other) if other.coefficient("G") > 0 else math.inf,
        partial(fitted, best.symbols, best, "B"),
        partial(fitted, other.symbols, other, "G"),
    )


def curve_slopes(curve: AllanCurve, supported: Collection[str]) -> dict[str, float]:
    """Power laws that a one-channel curve does not exclude, for a model that another fit supports; see `PowerLaws`."""
    used = lags_used(curve)
    if used.sum() < 3:
        return {}
    try:
        chosen = best_explained(curve, used)
    except FitError:
        return {}
    listed = sorted(chosen.solutions, key=lambda s: s.value)
    return power_laws(chosen.data, listed).facts(supported)


def _power_laws(fits: Sequence[CurveFamilyFit]) -> PowerLaws | None:
    """What the curve allows in the place of the slow terms that it supports.

    Not asked beside the floor of an instrument, whose own slow terms move with them.
    """
    slow = any(f.supported & {"B", "G", "G2", "K"} for f in fits)
    if not slow or fits[0].family.sensor != fits[0].family.symbols:
        return None
    return power_laws(fits[0].family.curve, [f.best for f in fits])


def _slow_time(fits: Sequence[CurveFamilyFit], curve: AllanCurve) -> dict[str, float]:
    T = shortest_time(fits)
    return {} if T is None else {"slow_time": T * curve.dt}


def _verdict(models: list[NoiseModel], dt: float) -> str:
    words = supported_words(models)
    text = words[0].upper() + words[1:]
    facts = models[0].goodness
    if facts["left_out"]:
        text += (
            f" Lags below {facts['shortest_tau']:.3g} s fit no sum of terms (the sensor's filter, "
            "vibration) and are left out."
        )
    if facts["discrepancy"]:
        text += (
            f" No sum of terms explains the curve better than to {facts['discrepancy']:.1%} in variance; "
            "the intervals include that."
        )
    elif facts["p"] < CONTRADICTED:
        text += f" The model does not explain the curve well (p = {facts['p']:.1g})"
        text += ": the record contains something else."
    return text + quick_words(models[0], dt) + stand_in_words(facts)


# -- from sample units to a model --------------------------------------------------------------------------------


def _model(
    fit: CurveFamilyFit, scale: float, curve: AllanCurve, confidence: float, facts: dict[str, float]
) -> NoiseModel:
    dt, channel = curve.dt, curve.channels[0]
    chosen = fit.selected
    free = int((chosen.c > 0).sum()) + len(fit.supported & {*fit.family.markov})
    dof = max(len(fit.family.curve.variance) - free, 1)
    sensor = fit.family.sensor
    estimates = with_slow_notes([_estimate(fit, s, scale, dt) for s in sensor], facts)
    quick = [
        s for s, T in zip(chosen.markov, chosen.times, strict=True) if is_quick(T) and s in fit.supported
    ]
    for s in fit.family.markov:
        sigma = next(e for e in estimates if e.symbol == _NAMES.get(s))
        estimates += [*([] if s in quick else [equivalent_flicker(sigma)]), _time_estimate(fit, s, dt)]
    if len(quick) == len(fit.family.markov) > 0:
        limit = _amplitude("B", flicker_limit(fit, confidence), scale, dt)
        estimates.append(limit_estimate("B", limit))
    return NoiseModel(
        terms=tuple(_term(s, chosen, scale, dt) for s in sensor if chosen.coefficient(s) > 0),
        family="gauss-markov" if fit.family.markov else "flicker",
        estimates=tuple(estimates),
        confidence=confidence,
        covariance=_covariance(fit, confidence),
        goodness={"chi2": chosen.chi2, "dof": dof, "p": chi_square_tail(chosen.chi2, dof), **facts},
        kind=channel.kind.value,
        unit="" if channel.kind.has_si else channel.unit,
    )


def _amplitude(symbol: str, coefficient: float, scale: float, dt: float) -> float:
    """SI amplitude of a variance coefficient in sample units."""
    return (
        math.sqrt(coefficient * scale) * dt ** TIME_POWER[symbol] if math.isfinite(coefficient) else math.inf
    )


def _ends(symbol: str, ends: tuple[float, float], scale: float, dt: float) -> tuple[float, float]:
    return _amplitude(symbol, ends[0], scale, dt), _amplitude(symbol, ends[1], scale, dt)


def _estimate(fit: CurveFamilyFit, symbol: str, scale: float, dt: float) -> Estimate:
    return amplitude_estimate(
        _NAMES.get(symbol, symbol),
        _ends(symbol, fit.sets[symbol], scale, dt),
        _amplitude(symbol, fit.selected.coefficient(symbol), scale, dt),
        lambda: _amplitude(symbol, fit.best.coefficient(symbol), scale, dt),
        supported=symbol in fit.supported,
        measured="curve",
    )


def _time_estimate(fit: CurveFamilyFit, symbol: str, dt: float) -> Estimate:
    shortest, longest = fit.family.times
    ends, at = (
        fit.sets.get(TIME_OF[symbol]),
        fit.selected if fit.selected.coefficient(symbol) > 0 else fit.best,
    )
    return time_estimate(
        TIME_OF[symbol],
        None if ends is None else (ends[0] * dt, ends[1] * dt),
        (shortest * dt, longest * dt),
        at.times[fit.family.markov.index(symbol)] * dt,
    )


def _term(symbol: str, at: CurveSolution, scale: float, dt: float) -> TermType:
    value = _amplitude(symbol, at.coefficient(symbol), scale, dt)
    if symbol in at.markov:
        return GaussMarkov.from_sigma(value, at.times[at.markov.index(symbol)] * dt)
    return term_of(symbol, value, dt=dt)


def _covariance(fit: CurveFamilyFit, confidence: float) -> dict[str, Any]:
    """Covariance of the natural logarithms of the supported amplitudes (and of T).

    Correlations are those of the expected information, standard deviations those of the sets: these know that a term
    which the record does not support may be there all the same, of which the information of the chosen terms is silent.
    """
    at = fit.selected
    sd = fisher_sd(fit.family.curve, at)
    if not sd:
        return {}
    J = sensitivity(fit.family.curve, at)
    names = [*at.symbols, *(TIME_OF[s] for s in at.markov)]
    index = [names.index(n) for n in sd]
    half = np.array([1.0 if n in TIME_OF.values() else 0.5 for n in sd])
    matrix = np.linalg.pinv(J[:, index].T @ J[:, index])
    scale = np.array([_width(fit.sets.get(n), confidence, float(sd[n])) / sd[n] for n in sd]) * half
    matrix *= np.outer(scale, scale)
    of_sensor = [i for i, n in enumerate(sd) if not of_floor(n)]
    if not of_sensor:
        return {}
    return {
        "symbols": [_NAMES.get(n, n) for n in sd if not of_floor(n)],
        "of": "natural logarithms",
        "matrix": matrix[np.ix_(of_sensor, of_sensor)].tolist(),
    }


def _width(ends: tuple[float, float] | None, confidence: float, otherwise: float) -> float:
    """Standard deviation of the logarithm that makes a normal set as long; where it is open, `otherwise`."""
    if ends is None or not 0 < ends[0] < ends[1] < math.inf:
        return otherwise
    return math.log(ends[1] / ends[0]) / 2 / float(normal_quantile(0.5 + confidence / 2))
