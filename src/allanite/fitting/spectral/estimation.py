# SPDX-License-Identifier: BSD-3-Clause
"""Noise parameters from the whole record, frequency by frequency.

Notes
-----
The lowest 256 contrasts of 1024 block means reach 128 cycles in the record; above, Hann segments of a cascade of
decimated records serve, whose points are chi-square with known degrees of freedom. Every expected value is exact:
folding by sampling, the blocks, the window and gaps are in it, so that red noise may leak without doing harm. What
is given up is a few percent of the information of the highest frequencies (the overlap of Hann windows).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from allanite.errors import DataQualityError, InputError
from allanite.fitting.lines_left_in import unsteady, with_lines_left_in
from allanite.fitting.rivals import leaves_slow_noise_open, supported_families
from allanite.fitting.spectral.misfit import Explained, best_explained
from allanite.fitting.spectral.ordinates import Ordinates, ordinates_of
from allanite.fitting.spectral.profile import WhittleFit, fitted
from allanite.fitting.spectral.result import model_of, verdict_of
from allanite.fitting.spectral.whittle import WhittleProblem, WhittleSolution
from allanite.fitting.undecided import over_families, with_alternative
from allanite.noise import NoiseModel
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.results import Spectrum
from allanite.noise.spectrum.stability import sinusoids, without_stable_lines
from allanite.plain_files.counted import plural
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.records import Recording

__all__ = ["fit_spectral", "spectral_ordinates"]

FLICKER = ("Q", "N", "B", "K", "R")
GAUSS_MARKOV = ("Q", "N", "G", "K", "R")
_LETTERS = frozenset("QNBKRG")
#: Twice the logarithm of the likelihood ratio that rejects flicker: 1 in 100 records of white noise and a walk, which a
#: long correlation time imitates, exceed it.
_REJECTS_FLICKER = 10.0
_FEWEST = 8  # ordinates that are needed
#: Segments of the lowest frequencies of the spectrum: the ends of a record, which Hann windows lose, then count little.
_SEGMENTS = 16


def fit_spectral(
    recording: Recording,
    *,
    channel: str | None = None,
    terms: str | Sequence[str] | None = None,
    confidence: float = 0.95,
    progress: Callable[[float], None] | None = None,
) -> NoiseModel:
    """Noise model of one channel of a recording, by likelihood over frequency.

    Parameters
    ----------
    recording : Recording
    channel : str, optional
        Needed where there are several.
    terms : str or sequence of str, optional
        The sum to fit, by letters: Q, N, B, K, R, and G for each Gauss-Markov term, as in "NGK" or "NGG". By default
        the two families of the moment fit, Q N B K R and Q N G K R, and what the record supports of them.
    confidence : float
        Level of the sets.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    NoiseModel
        With `estimates`, `covariance`, `goodness`, and `alternative` where the two families cannot be told apart.
        Stable lines of the spectrum are taken out first, and are terms of the model.

    Raises
    ------
    InputError
        No such channel, a letter that is no term, a letter but G twice, or no density among the terms.
    DataQualityError
        The record is too short, or holds no noise.
    FitError
        No sum of terms explains the spectrum.
    """
    name = _only_channel(recording) if channel is None else recording[channel].name
    require_probabilities(confidence=confidence)
    wanted = None if terms is None else _letters(terms)
    data, spectrum = spectral_ordinates(recording, name, progress=progress)
    candidates = (FLICKER, GAUSS_MARKOV) if wanted is None else (wanted,)
    explained = best_explained(data, candidates)
    left_out = len(data.value) - len(explained[0][0].data.value)
    lines = sinusoids(spectrum)
    fits = (
        _families(explained, confidence) if wanted is None else [fitted(*explained[0], confidence, keep=True)]
    )
    models = over_families([model_of(fit, recording[name], confidence, left_out) for fit in fits])
    verdict = verdict_of(models)
    model = with_alternative([replace(m, terms=(*m.terms, *lines), verdict=verdict) for m in models])
    return with_lines_left_in(model, unsteady(spectrum.lines))


def spectral_ordinates(
    recording: Recording,
    name: str,
    *,
    spectrum: Spectrum | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Ordinates, Spectrum]:
    """What the fit looks at, and the log-binned spectrum with the lines of the record, stable ones taken out.

    Raises
    ------
    DataQualityError
        The record is too short, or holds no noise.
    """
    density = spectrum or power_spectrum(recording, name, progress=progress)
    alone = without_stable_lines(recording, density)
    clean = replace(power_spectrum(alone, name, least=_SEGMENTS), lines=_left(density))
    data = ordinates_of(alone, clean)
    if len(data.value) < _FEWEST:
        raise DataQualityError(
            f"the spectrum has {plural(len(data.value), 'point')} free of lines and gaps, a fit needs {_FEWEST}; "
            f"record longer (now {plural(recording.n_samples, 'sample')})"
        )
    if not (data.value > 0).any():
        raise DataQualityError("the density is zero everywhere: no noise is resolved (resolution limit)")
    return data, density


def _left(spectrum: Spectrum) -> tuple[SpectralLine, ...]:
    """Lines that stay in the record."""
    return tuple(line for line in spectrum.lines if not line.stable)


def _only_channel(recording: Recording) -> str:
    if len(recording.channels) != 1:
        raise InputError(f"several channels: name one of {', '.join(recording.names)} (channel=)")
    return recording.names[0]


def _letters(terms: str | Sequence[str]) -> tuple[str, ...]:
    try:
        letters = tuple(terms)
    except TypeError:
        raise InputError(f"terms must be letters, as in 'NBK' or ['N', 'G'], not {terms!r}") from None
    unknown = [s for s in letters if not isinstance(s, str) or s not in _LETTERS]
    if unknown:
        raise InputError(
            f"no noise term has the letter {unknown[0]!r}; there are Q, N, B, K, R, and G (Gauss-Markov)"
        )
    if any(letters.count(s) > 1 for s in _LETTERS - {"G"}) or not set(letters) - {"R"}:
        raise InputError(
            f"each of Q, N, B, K, R at most once, and one of them (but R) or G at least: not {terms!r}"
        )
    return letters


def _families(explained: Explained, confidence: float) -> list[WhittleFit]:
    """The family the record supports, or both, the better one first."""
    (flicker, best), (markov, other) = explained

    def judged(problem: WhittleProblem, at: WhittleSolution, name: str) -> tuple[WhittleFit, bool]:
        fit = fitted(problem, at, confidence)
        needed = [s for s, c in zip(problem.letters, fit.chosen.c, strict=True) if c > 0]
        supported = [problem.letters[i] for i in fit.supported]
        return fit, name in supported or (name == "B" and leaves_slow_noise_open(needed, supported))

    gain = best.value - other.value
    return supported_families(
        gain,
        -gain if other.c[markov.markov[0]] > 0 else math.inf,
        partial(judged, flicker, best, "B"),
        partial(judged, markov, other, "G"),
        rejects_flicker=_REJECTS_FLICKER,
    )
