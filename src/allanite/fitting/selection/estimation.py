# SPDX-License-Identifier: BSD-3-Clause
"""Selection of a noise model: lines that pay, sets of terms with their weights.

The weight of a set is exp(score/2) over the sum of all: at equal prices, the likelihood ratios in another form [1]. A
term that gains nothing keeps 7 % of the weight so, because one too weak to be seen can never be excluded; a weight of
0.7 to 0.8 is therefore as clear as a set gets. The weight of a term, that of all sets which hold it, is what to read.
How often terms and sets of a weight are right is measured by `python -m verification selection`.

References
----------
.. [1] K. P. Burnham, D. R. Anderson, "Model selection and multimodel inference", 2nd ed., Springer 2002, eq. 2.9.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from allanite.errors import FitError, InputError
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.coarser import EXPLAINED, explained_part
from allanite.fitting.likelihood.lines import checked_lines, line_price
from allanite.fitting.likelihood.proposed_lines import AskedLines, is_automatic, proposed_lines
from allanite.fitting.likelihood.slow import ShownSum, slow_facts
from allanite.fitting.lines_left_in import LineLeftIn
from allanite.fitting.selection.lines import gains_of
from allanite.fitting.selection.results import Candidate, ChosenLine, Selection
from allanite.fitting.selection.search import Letters, Progress, TermSearch
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.records import Recording, checked_recording

__all__ = ["select"]

#: Candidates with less weight are not listed.
_LISTED = 1e-3
#: Rich sets, the quick ones first: what none of them explains, no set does.
_RICHEST: tuple[Letters, ...] = (
    ("Q", "N", "B", "K", "R"),
    ("Q", "N", "G", "K", "R"),
    ("Q", "N", "B", "G", "G", "K", "R"),
)


def select(
    recording: Recording | LikelihoodProblem,
    *,
    channel: str | None = None,
    lines: AskedLines = "auto",
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> Selection:
    """Find the sets of terms that a record at rest supports, with their weights.

    Parameters
    ----------
    recording : Recording or LikelihoodProblem
        Recording; or a problem, which has its channel and has its lines removed already.
    channel : str, optional
        Channel of a recording; may be omitted if there is only one.
    lines : sequence of float [Hz], or "auto"
        Spectral lines that may be terms: near these frequencies, or the steady lines of the spectrum. A line is a term
        if its gain in likelihood pays its price (`line_price`). A problem has its lines.
    confidence : float
        Level of the intervals of the model.
    progress : callable, optional
        Called with the share done and the current step.

    Returns
    -------
    Selection

    Raises
    ------
    InputError
        A channel that is not there or not named, channel or lines besides a problem, a frequency outside ]0, rate/2[
        or with fewer than four periods in the record.
    DataQualityError
        Too few samples, or no noise in them.
    FitError
        No sum of terms describes the record.

    Notes
    -----
    Where no sum of terms explains what happens within some samples (the sensor's filter), means over 4, 16, 64 or 256
    of them are used.
    """
    require_probabilities(confidence=confidence)
    if isinstance(recording, LikelihoodProblem):
        if channel is not None or (not is_automatic(lines) and checked_lines(lines)):
            raise InputError(
                "the problem has its channel and its lines already: leave out channel= and lines="
            )
        return _selected(TermSearch(recording, progress), (), (), confidence)
    problem = LikelihoodProblem.of(checked_recording(recording, "select"), channel)
    if progress is not None and is_automatic(lines):
        progress(0.0, "looking for lines")
    proposed = proposed_lines(problem, lines)
    if proposed.frequencies:
        problem = problem.with_lines(proposed.frequencies, proposed.widths)
    search = explained_part(problem, partial(_searched, progress=progress))
    search, tried = _paying(search, line_price(proposed.widths))
    return _selected(search, tried, proposed.left_in, confidence)


def _searched(problem: LikelihoodProblem, progress: Progress | None) -> tuple[TermSearch, float]:
    """A search in which the rich sets are known, up to one that explains the record, and how well it does.

    Correlation times go down to one sample where nothing else explains it.

    Raises
    ------
    FitError
        None of them can describe the record at all.
    """
    search, best = _rich(problem, progress)
    if 0 <= best < EXPLAINED:
        quicker = _rich(replace(problem, shortest=1.0), progress)
        search, best = quicker if quicker[1] >= EXPLAINED else (search, best)
    if best < 0:
        raise FitError(
            "no sum of noise terms describes the record; look at the findings and at the time series"
        )
    return search, best


def _rich(problem: LikelihoodProblem, progress: Progress | None) -> tuple[TermSearch, float]:
    """The rich sets, up to one that explains the record, and the largest p value."""
    search, best = TermSearch(problem, progress), -1.0
    for letters in _RICHEST:
        if math.isfinite(search.score(letters)):
            best = max(best, search.maxima[letters].p)
        if best >= EXPLAINED:
            break
    return search, best


def _paying(search: TermSearch, price: float) -> tuple[TermSearch, tuple[ChosenLine, ...]]:
    """Leave the weakest line out until all that are left pay; every line that was tried, those kept first."""
    left_out: list[ChosenLine] = []
    while search.problem.lines:
        letters, problem = search.best(), search.problem
        terms = problem.sinusoids()
        frequencies = [term.frequency for term in terms]
        gains = gains_of(problem, letters)
        if min(gains) > price:
            kept = zip(terms, gains, strict=True)
            lines = [
                ChosenLine(frequency=t.frequency, amplitude=t.amplitude, gain=g, price=price) for t, g in kept
            ]
            return search, (*lines, *left_out)
        weakest = gains.index(min(gains))
        left_out.insert(
            0,
            ChosenLine(frequency=frequencies[weakest], amplitude=math.nan, gain=min(gains), price=price),
        )
        rest = [f for i, f in enumerate(frequencies) if i != weakest]
        search = TermSearch(problem.with_lines(rest, problem.widths), search.progress)
    return search, tuple(left_out)


def _disguised(search: TermSearch, letters: Letters) -> bool:
    """A Gauss-Markov term with the longest time that is tried is a random walk under another name."""
    parameters, longest = (
        search.maxima[letters].parameters,
        search.problem.search.times[1] * search.problem.dt,
    )
    times = [(parameters[s.replace("T", "sigma")], parameters[s]) for s in parameters if s.startswith("T")]
    return letters != search.best() and any(size > 0 and T > 0.99 * longest for size, T in times)


def _selected(
    search: TermSearch, lines: tuple[ChosenLine, ...], left_in: tuple[LineLeftIn, ...], confidence: float
) -> Selection:
    """All sets that were tried, by their scores."""
    problem = search.problem
    top = search.score(search.best())
    scores = {k: search.score(k) - top for k in search.maxima if not _disguised(search, k)}
    total = sum(math.exp(s / 2) for s in scores.values())
    candidates = [
        Candidate(letters=k, score=s, weight=math.exp(s / 2) / total, maximum=search.maxima[k])
        for k, s in sorted(scores.items(), key=lambda item: -item[1])
    ]
    channel = problem.channel
    best = candidates[0]
    random = tuple(s for s in best.letters if s != "R")
    ramp = len(random) < len(best.letters)
    sums = [ShownSum(letters=random, shown=frozenset(random), peak=best.maximum.peak, ramp=ramp)]
    return Selection(
        channel=channel.name,
        candidates=tuple(c for c in candidates if c.weight > _LISTED),
        n_tried=len(candidates),
        lines=lines,
        left_in=left_in,
        kind=channel.kind.value,
        unit="" if channel.kind.has_si else channel.unit,
        shortest=problem.block * problem.dt,
        confidence=confidence,
        slow=slow_facts(problem, sums),
        recording=problem.recording.select(channel.name),
    )
