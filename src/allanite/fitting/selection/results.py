# SPDX-License-Identifier: BSD-3-Clause
"""What a selection finds: the sets of terms with their weights, and the lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from allanite.fitting.likelihood import Maximum
from allanite.fitting.selection.averaging import averaged
from allanite.fitting.selection.search import MOST_MARKOV, ORDER, Letters, named
from allanite.fitting.verdict import stand_in_words, with_slow_notes
from allanite.noise import Estimate, NoiseModel

if TYPE_CHECKING:
    from allanite.noise.allan import AllanCurve
    from allanite.recording.records import Recording

__all__ = ["Candidate", "ChosenLine", "Selection", "document_of"]

#: From this weight on a term is called sure, and from that one on one besides the best set is told.
_SURE, _OPEN = 0.95, 0.2
_UNEXPLAINED = 0.01
_RIVAL = 0.05  # weight of a rival that the verdict names beside the first
_TOLD = 2  # rivals in the verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A set of terms.

    Attributes
    ----------
    letters : tuple of str
        Q, N, B, K, R, and G once or twice.
    score : float
        2 ln L less the prices of the terms, less that of the best set.
    weight : float
        exp(score/2) over the sum of all sets.
    maximum : Maximum
        Parameters at the maximum of its likelihood, with their covariance.
    """

    letters: Letters
    score: float
    weight: float
    maximum: Maximum = field(repr=False)

    @property
    def words(self) -> str:
        """The terms by name."""
        return named(self.letters)

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units."""
        best = self.maximum
        return {
            "letters": list(self.letters),
            "words": self.words,
            "score": self.score,
            "weight": self.weight,
            "log_likelihood": best.log_likelihood,
            "n_parameters": best.n_parameters,
            "parameters": best.parameters,
            "covariance": best.covariance,
            "chi2": best.chi2,
            "dof": best.dof,
            "p": best.p,
            "terms": NoiseModel(terms=best.terms).to_json()["terms"],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenLine:
    """A spectral line that was tried as a term.

    Attributes
    ----------
    frequency : float [Hz]
    amplitude : float
        In SI; NaN where the line was not kept.
    gain, price : float
        In 2 ln L: what the line gains, and what it must.
    """

    frequency: float
    amplitude: float
    gain: float
    price: float

    @property
    def kept(self) -> bool:
        """Whether the line is a term of the model."""
        return self.gain > self.price

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "frequency": self.frequency,
            "amplitude": self.amplitude if self.kept else None,
            "gain": self.gain,
            "price": self.price,
            "kept": self.kept,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """The sets of terms that a record may have, best first.

    Attributes
    ----------
    channel : str
    candidates : tuple of Candidate
        With a weight above 0.001.
    n_tried : int
        Sets whose likelihood was maximised.
    lines : tuple of ChosenLine
        Those that were tried: all candidates have the ones that were kept.
    remarks : tuple of str
        What a reader must know besides.
    kind, unit : str
        Of the channel.
    shortest : float [s]
        What happens within less was left out, because no sum of terms explains it; the sample interval: nothing was.
    confidence : float
        Level of the intervals of `model`.
    slow : mapping of str to float
        What else explains the slow noise of the best set, as `goodness` of a fit holds it: "slow_time" [s],
        "drift_span" [s], "slope_lower", "slope_upper", "slope_better".
    recording : Recording
        Of that channel.
    """

    channel: str
    candidates: tuple[Candidate, ...]
    n_tried: int
    lines: tuple[ChosenLine, ...] = ()
    remarks: tuple[str, ...] = ()
    kind: str
    unit: str
    shortest: float
    confidence: float = 0.95
    slow: Mapping[str, float] = field(default_factory=dict)
    recording: Recording = field(repr=False)

    @property
    def best(self) -> Candidate:
        """The set with the highest score."""
        return self.candidates[0]

    @property
    def sure(self) -> bool:
        """Every term of the best set stands in sets with at least 95 % of the weight."""
        present = self.presence()
        wanted = {*self.best.letters, *(["GG"] if self.best.letters.count("G") == MOST_MARKOV else [])}
        return all(present[s] >= _SURE for s in wanted)

    @property
    def model(self) -> NoiseModel:
        """The noise of the best set, with intervals that hold what is open about the set.

        They are mixed over the candidates (`averaging`); those of `allanite.fit` come from tests in one family, and say
        besides how large a term may be that is not in the set.
        """
        best = self.best.maximum
        return NoiseModel(
            terms=best.terms,
            estimates=tuple(with_slow_notes(self._averaged(), self.slow)),
            confidence=self.confidence,
            covariance=best.covariance,
            goodness={
                "chi2": best.chi2,
                "dof": best.dof,
                "p": best.p,
                "shortest_tau": self.shortest,
                "log_likelihood": best.log_likelihood,
                **self.slow,
            },
            verdict=self.verdict,
            kind=self.kind,
            unit=self.unit,
        )

    def _averaged(self) -> tuple[Estimate, ...]:
        maxima, weights = [c.maximum for c in self.candidates], [c.weight for c in self.candidates]
        return averaged(maxima, weights, self.confidence)

    @property
    def rivals(self) -> tuple[Candidate, ...]:
        """Sets that do without one of the terms of the best: not it with something besides."""
        wanted = Counter(self.best.letters)
        return tuple(c for c in self.candidates if wanted - Counter(c.letters))

    def presence(self) -> dict[str, float]:
        """Weight of all sets that hold a term, by its letter; "GG" for two Gauss-Markov terms."""
        weights = {s: sum(c.weight for c in self.candidates if s in c.letters) for s in ORDER}
        weights["GG"] = sum(c.weight for c in self.candidates if c.letters.count("G") == MOST_MARKOV)
        return weights

    @property
    def explained(self) -> bool:
        """The best set explains the power in every octave."""
        return self.best.maximum.p >= _UNEXPLAINED

    @property
    def verdict(self) -> str:
        """Some sentences."""
        best, rivals = self.best, self.rivals
        open_terms = [
            f"{named(tuple(s))} ({share:.0%})"
            for s, share in self.presence().items()
            if share >= _OPEN and Counter(s) - Counter(best.letters) and (s != "GG" or "G" in best.letters)
        ]
        if self.sure or not rivals:
            text = f"The record has {best.words}"
            text += (
                f"; it may have {', '.join(open_terms)} besides."
                if open_terms
                else ", and needs no other term."
            )
        else:
            mentioned = [rivals[0], *(c for c in rivals[1:_TOLD] if c.weight >= _RIVAL)]
            listed = ", or ".join(f"{c.words} ({c.weight:.0%})" for c in mentioned)
            text = f"The likeliest set is {best.words} ({best.weight:.0%} of the weight), but it may be {listed}."
        if not self.explained:
            text += f" No set explains it well (p = {best.maximum.p:.1g}): something else is in the record."
        if {"B", "G"} <= set(best.letters):  # the search has two Gauss-Markov terms at the most
            text += " Its flicker may be the sum of further Gauss-Markov terms; a record cannot exclude that."
        return text + stand_in_words(self.slow, "its Allan curve")

    def curve(self) -> AllanCurve:
        """The Allan deviation of the record."""
        from allanite.noise.allan import allan_curve

        return allan_curve(self.recording)[self.channel]

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units: a document with this channel alone."""
        return document_of([self])

    def entry(self) -> dict[str, Any]:
        """The channel in a document."""
        curve = self.curve()
        return {
            "name": self.channel,
            "kind": self.kind,
            "unit": self.unit,
            "duration": self.recording.duration,
            "samples": self.best.maximum.n_samples,
            "shortest": self.shortest,
            "verdict": self.verdict,
            "sure": self.sure,
            "explained": self.explained,
            "tried": self.n_tried,
            "presence": self.presence(),
            "candidates": [c.to_json() for c in self.candidates],
            "lines": [line.to_json() for line in self.lines],
            "remarks": list(self.remarks),
            "slow": dict(self.slow),
            "model": self.model.to_json(),
            "curve": curve.to_json(),
        }


def document_of(selections: Sequence[Selection]) -> dict[str, Any]:
    """The plain document of the selections of some channels."""
    verdict = "the terms are clear"
    if not all(one.sure for one in selections):
        verdict = "more than one set of terms is possible"
    if not all(one.explained for one in selections):
        verdict = "no set of terms explains the record"
    reason = "; ".join(f"{one.channel}: {one.best.words}" for one in selections)
    if len(selections) == 1:
        reason = selections[0].verdict[0].lower() + selections[0].verdict[1:]
    return {
        "format": "allanite-selection",
        "version": 1,
        "verdict": verdict,
        "reason": reason,
        "confidence": selections[0].confidence,
        "channels": [one.entry() for one in selections],
    }
