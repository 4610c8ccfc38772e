# SPDX-License-Identifier: BSD-3-Clause
"""What a selection finds: the sets of terms with their weights, and the lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, ClassVar, Generic, Protocol, TypeVar

from allanite.errors import FormatError
from allanite.fitting.likelihood import Maximum
from allanite.fitting.lines_left_in import LineLeftIn
from allanite.fitting.scale import with_scale_uncertainty
from allanite.fitting.selection.averaging import averaged
from allanite.fitting.selection.search import MOST_MARKOV, ORDER, Letters, named
from allanite.fitting.selection.verdict import SelectionVerdict
from allanite.fitting.verdict import stand_in_words, with_slow_notes
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Estimate, NoiseModel
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.quantities.result import Result
from allanite.recording.channel_names import channel_called

if TYPE_CHECKING:
    from allanite.noise.allan import AllanCurve
    from allanite.recording.records import Recording

__all__ = [
    "Candidate",
    "ChannelSelection",
    "ChosenLine",
    "RankedSet",
    "Selection",
    "TermSelection",
]

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

    @property
    def p(self) -> float:
        """Does the set explain the power in every octave? Small: it does not."""
        return self.maximum.p

    @property
    def facts(self) -> RankedSet:
        """What a document holds of it."""
        best = self.maximum
        return RankedSet(
            letters=self.letters,
            score=self.score,
            weight=self.weight,
            log_likelihood=best.log_likelihood,
            n_parameters=best.n_parameters,
            parameters=best.parameters,
            covariance=best.covariance,
            chi2=best.chi2,
            dof=best.dof,
            p=best.p,
            terms=tuple(NoiseModel(terms=best.terms).to_json()["terms"]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RankedSet(Result):
    """A set of terms, at the maximum of its likelihood.

    Attributes
    ----------
    letters : tuple of str
        Q, N, B, K, R, and G once or twice.
    score : float
        2 ln L less the prices of the terms, less that of the best set.
    weight : float
        exp(score/2) over the sum of all sets.
    log_likelihood : float
        At the maximum; differences between sets count.
    n_parameters : int
        That were free.
    parameters : mapping of str to float [SI]
        By symbol; 0 for a term that the record would rather do without.
    covariance : mapping
        "symbols", "of" and "matrix": of the natural logarithms of the parameters above zero.
    chi2, p : float
        Does the set explain the power in every octave? Small p: it does not.
    dof : int
        Of `chi2`.
    terms : tuple of mapping
        Those above zero, as a noise model holds them.
    """

    letters: Letters
    score: float
    weight: float
    log_likelihood: float
    n_parameters: int
    parameters: Mapping[str, float]
    covariance: Mapping[str, object] = field(repr=False)
    chi2: float
    dof: int
    p: float
    terms: tuple[Mapping[str, object], ...] = field(repr=False)

    @property
    def words(self) -> str:
        """The terms by name."""
        return named(self.letters)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenLine(Result):
    """A spectral line that was tried as a term.

    Attributes
    ----------
    kept : bool
        The line is a term of the model.
    frequency : float [Hz]
        Of the line.
    amplitude : float [SI]
        NaN where the line was not kept.
    gain, price : float
        In 2 ln L: what the line gains, and what it must.
    """

    STATED: ClassVar[tuple[str, ...]] = ("kept",)

    frequency: float
    amplitude: float
    gain: float
    price: float

    @property
    def kept(self) -> bool:
        """Whether the line is a term of the model."""
        return self.gain > self.price


# -- what weights say --------------------------------------------------------------------------------------


class _Weighed(Protocol):
    """A set of terms with its weight."""

    @property
    def letters(self) -> Letters: ...

    @property
    def weight(self) -> float: ...

    @property
    def words(self) -> str: ...

    @property
    def p(self) -> float: ...


W = TypeVar("W", bound=_Weighed, covariant=True)


class WeighedSets(Generic[W]):
    """Base of what holds sets of terms, the best first, and what else explains their slow noise."""

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def candidates(self) -> Sequence[W]: ...

        @property
        def slow(self) -> Mapping[str, float]: ...

    @property
    def best(self) -> W:
        """The set with the highest score."""
        return self.candidates[0]

    @property
    def sure(self) -> bool:
        """Every term of the best set stands in sets with at least 95 % of the weight."""
        present = self.presence()
        wanted = {*self.best.letters, *(["GG"] if self.best.letters.count("G") == MOST_MARKOV else [])}
        return all(present[s] >= _SURE for s in wanted)

    @property
    def rivals(self) -> tuple[W, ...]:
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
        return self.best.p >= _UNEXPLAINED

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
                f"; it may also have {', '.join(open_terms)}." if open_terms else ", and needs no other term."
            )
        else:
            mentioned = [rivals[0], *(c for c in rivals[1:_TOLD] if c.weight >= _RIVAL)]
            listed = ", or ".join(f"{c.words} ({c.weight:.0%})" for c in mentioned)
            text = f"The likeliest set is {best.words} ({best.weight:.0%} of the weight), but it may be {listed}."
        if not self.explained:
            text += f" No set explains it well (p = {best.p:.1g}): something else is in the record."
        if {"B", "G"} <= set(best.letters):  # the search has two Gauss-Markov terms at the most
            text += " Its flicker may be the sum of further Gauss-Markov terms; a record cannot exclude that."
        return text + stand_in_words(self.slow, "its Allan curve")


# -- one channel, and all of a record -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection(WeighedSets[Candidate]):
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
    left_in : tuple of LineLeftIn
        Lines of the spectrum that cannot be terms.
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
    left_in: tuple[LineLeftIn, ...] = ()
    kind: str
    unit: str
    shortest: float
    confidence: float = 0.95
    slow: Mapping[str, float] = field(default_factory=dict)
    recording: Recording = field(repr=False)

    @property
    def model(self) -> NoiseModel:
        """The noise of the best set, with intervals that hold what is open about the set.

        They are mixed over the candidates (`averaging`); those of `allanite.fit` come from tests in one family, and say
        besides how large a term may be that is not in the set. Where the channel states how uncertain its scale factor
        is, they hold that too.
        """
        best = self.best.maximum
        statistical = NoiseModel(
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
        return with_scale_uncertainty(statistical, self.recording[self.channel].scale_uncertainty)

    def _averaged(self) -> tuple[Estimate, ...]:
        maxima, weights = [c.maximum for c in self.candidates], [c.weight for c in self.candidates]
        return averaged(maxima, weights, self.confidence)

    def curve(self) -> AllanCurve:
        """The Allan deviation of the record."""
        from allanite.noise.allan import allan_curve

        return allan_curve(self.recording)[self.channel]

    @property
    def entry(self) -> ChannelSelection:
        """What a document holds of it."""
        return ChannelSelection(
            name=self.channel,
            kind=self.kind,
            unit=self.unit,
            duration=self.recording.duration,
            samples=self.best.maximum.n_samples,
            shortest=self.shortest,
            tried=self.n_tried,
            candidates=tuple(c.facts for c in self.candidates),
            lines=self.lines,
            left_in=self.left_in,
            slow=self.slow,
            model=self.model,
            curve=ChannelCurve.of(self.curve()),
        )

    @property
    def result(self) -> TermSelection:
        """What its document holds, with this channel alone."""
        return TermSelection(confidence=self.confidence, channels=(self.entry,))

    def to_json(self) -> dict[str, object]:
        """Plain data, SI units: a document with this channel alone."""
        return self.result.to_json()


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSelection(Result, WeighedSets[RankedSet]):
    """The sets of terms that one channel may have.

    Attributes
    ----------
    sure : bool
        Every term of the best set is in sets with at least 95 % of the weight.
    explained : bool
        The best set explains the power in every octave.
    term_weights : mapping of str to float
        Weight of all sets that hold a term, by its letter; "GG" for two Gauss-Markov terms.
    name, kind, unit : str
        Of the channel.
    duration : float [s]
        Of the record.
    samples : int
        Those present.
    shortest : float [s]
        What happens within less was left out, because no sum of terms explains it; the sample interval: nothing was.
    tried : int
        Sets whose likelihood was maximized.
    candidates : tuple of RankedSet
        The best first; those with a weight above 0.001.
    lines : tuple of ChosenLine
        Spectral lines that were tried as terms.
    left_in : tuple of LineLeftIn
        Lines of the spectrum that cannot be terms.
    slow : mapping of str to float
        What else explains the slow noise of the best set, as `goodness` of a fit holds it.
    model : NoiseModel
        The best set, with intervals that hold what is open about the set.
    curve : ChannelCurve
        Of the record.
    """

    STATED: ClassVar[tuple[str, ...]] = ("sure", "explained", "term_weights")

    name: str
    kind: str
    unit: str
    duration: float
    samples: int
    shortest: float
    tried: int
    candidates: tuple[RankedSet, ...]
    lines: tuple[ChosenLine, ...]
    left_in: tuple[LineLeftIn, ...]
    slow: Mapping[str, float]
    model: NoiseModel = field(repr=False)
    curve: ChannelCurve = field(repr=False)

    def __post_init__(self) -> None:
        if not self.candidates:
            raise FormatError(f"{self.name} has no set of terms")

    @property
    def term_weights(self) -> Mapping[str, float]:
        """Weight of all sets that hold a term."""
        return self.presence()


@dataclass(frozen=True, slots=True, kw_only=True)
class TermSelection(Result):
    """The sets of terms that the channels of a record may have.

    Attributes
    ----------
    verdict : SelectionVerdict
        "clear", "open": a rival does without a term of the best set; or "unexplained": no set explains the record.
    confidence : float
        Of the intervals of the models.
    channels : tuple of ChannelSelection
        Those that bear noise.
    """

    FORMAT: ClassVar[str] = "allanite-selection"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    confidence: float
    channels: tuple[ChannelSelection, ...]

    def __getitem__(self, name: str) -> ChannelSelection:
        """One channel.

        Raises
        ------
        InputError
            No such channel.
        """
        return channel_called(name, self.channels)

    @property
    def verdict(self) -> SelectionVerdict:
        """That of the worst channel."""
        if not all(c.explained for c in self.channels):
            return SelectionVerdict.UNEXPLAINED
        return SelectionVerdict.CLEAR if all(c.sure for c in self.channels) else SelectionVerdict.OPEN

    @property
    def reason(self) -> str:
        """The terms of each channel; of a single one what is open about them."""
        if len(self.channels) > 1:
            return "; ".join(f"{c.name}: {c.best.words}" for c in self.channels)
        words = self.channels[0].verdict
        return words[0].lower() + words[1:]

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.fitting.selection.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
