# SPDX-License-Identifier: BSD-3-Clause
"""From sets of variance coefficients to a noise model with estimates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from allanite.fitting.estimates import amplitude_estimate, equivalent_flicker, time_estimate
from allanite.fitting.spectral.misfit import chance
from allanite.fitting.spectral.profile import WhittleFit, covariance
from allanite.fitting.verdict import supported_words
from allanite.noise import Estimate, GaussMarkov, NoiseModel, TermType, term_of
from allanite.recording.records import Channel

__all__ = ["model_of", "verdict_of"]


def model_of(fit: WhittleFit, channel: Channel, confidence: float, left_out: int) -> NoiseModel:
    """The model of a fit, its estimates in the order of the letters."""
    problem, at = fit.problem, fit.chosen
    estimates: list[Estimate] = []
    for i, letter in enumerate(problem.letters):
        if letter == "G":
            estimates += _markov_estimates(fit, i)
        else:
            estimates.append(_estimate(fit, i, letter))
    n = len(problem.data.value)
    used = sum(c > 0 for c in at.c) + sum(at.c[g] > 0 for g in problem.markov)
    return NoiseModel(
        terms=_terms(fit),
        family="gauss-markov" if "G" in problem.letters else "flicker",
        estimates=tuple(estimates),
        confidence=confidence,
        covariance=_covariance(fit),
        goodness={
            "chi2": problem.chi2(at),
            "dof": max(n - int(used), 1),
            "p": chance(problem, at),
            "discrepancy": problem.data.discrepancy,
            "shortest_tau": 0.5 / float(problem.data.frequency.max()),
            "left_out": left_out,
            "log_likelihood": -at.value / 2,
        },
        kind=channel.kind.value,
        unit="" if channel.kind.has_si else channel.unit,
    )


def _suffix(fit: WhittleFit, i: int) -> str:
    """Nothing for the first Gauss-Markov term, a number for the others."""
    rank = fit.problem.markov.index(i)
    return "" if rank == 0 else f"_{rank + 1}"


def _time(fit: WhittleFit, i: int) -> float:
    at = fit.chosen if fit.chosen.c[i] > 0 else fit.full
    return at.times[fit.problem.markov.index(i)]


def _terms(fit: WhittleFit) -> tuple[TermType, ...]:
    present: list[TermType] = []
    for i, letter in enumerate(fit.problem.letters):
        if letter == "R":
            if i in fit.supported:
                present.append(term_of("R", abs(fit.chosen.ramp), dt=fit.problem.data.dt))
        elif fit.chosen.c[i] > 0:
            size = math.sqrt(fit.chosen.c[i])
            markov = letter == "G"
            present.append(
                GaussMarkov.from_sigma(size, _time(fit, i))
                if markov
                else term_of(letter, size, dt=fit.problem.data.dt)
            )
    return tuple(present)


def _coefficient(fit: WhittleFit, i: int, of_full: bool = False) -> float:
    at = fit.full if of_full else fit.chosen
    return at.ramp**2 if fit.problem.letters[i] == "R" else float(at.c[i])


def _estimate(fit: WhittleFit, i: int, symbol: str) -> Estimate:
    low, high = (math.sqrt(v) for v in fit.sets[i])
    return amplitude_estimate(
        symbol,
        (low, high),
        math.sqrt(_coefficient(fit, i)),
        lambda: math.sqrt(_coefficient(fit, i, of_full=True)),
        supported=i in fit.supported,
        measured="spectrum",
    )


def _markov_estimates(fit: WhittleFit, i: int) -> list[Estimate]:
    end = _suffix(fit, i)
    sigma, ends = _estimate(fit, i, "sigma" + end), fit.sets.get(i + len(fit.problem.letters))
    return [
        sigma,
        equivalent_flicker(sigma),
        time_estimate("T" + end, ends, fit.problem.data.times, _time(fit, i)),
    ]


def _covariance(fit: WhittleFit) -> dict[str, Any]:
    """Covariance of the natural logarithms of the amplitudes in the model (and of T)."""
    matrix, places = covariance(fit.problem, fit.chosen)
    if not places:
        return {}
    n = len(fit.problem.letters)
    half = np.array([0.5 if p < n else 1.0 for p in places])
    return {
        "symbols": [_symbol(fit, p) for p in places],
        "of": "natural logarithms",
        "matrix": (matrix * np.outer(half, half)).tolist(),
    }


def _symbol(fit: WhittleFit, place: int) -> str:
    n = len(fit.problem.letters)
    letter = fit.problem.letters[place % n]
    if letter != "G":
        return letter
    return ("sigma" if place < n else "T") + _suffix(fit, place % n)


def verdict_of(models: list[NoiseModel]) -> str:
    """What the record supports, in one or a few sentences."""
    words = supported_words(models)
    text = words[0].upper() + words[1:]
    facts = models[0].goodness
    if facts["left_out"]:
        top = 0.5 / facts["shortest_tau"]
        text += f" Frequencies above {top:.3g} Hz fit no sum of terms (the sensor's filter, vibration)"
        text += " and are left out."
    if facts["discrepancy"]:
        error = f"{facts['discrepancy']:.1%}"
        text += f" No sum of terms explains the spectrum better than to {error}; the intervals include that."
    elif facts["p"] < 0.01:
        text += (
            f" The model does not explain the spectrum well (p = {facts['p']:.1g}): the record contains "
            "something else."
        )
    return text
