# SPDX-License-Identifier: BSD-3-Clause
"""Sets of terms, what a term costs, and the best set by steps.

Every set is a candidate: quantisation or not, white noise, flicker, one or two Gauss-Markov terms, both or none of
them, a random walk, a ramp. It scores

    score = 2 ln L - sum of the prices of its terms,                                                       (1)

L being the likelihood of the record at its maximum. The price of a term is what its absence lets the likelihood gain in
one record out of a hundred: 5.41 for a variance that cannot be negative (half of chi-square(1) at 2 %). A Gauss-Markov
term is a random walk that forgets itself, at a rate that cannot be negative either: what the walk costs and 5.41 more,
so that it is taken for a walk in one record out of a hundred. Where no slow term is present it would cost 8.5, because
its correlation time means nothing there, and the gain is a maximum over all times [1], [2]. The slope of a ramp would
cost 6.63; but slow noise too weak to be told from none has a slope in any one record: at 9.5 a ramp takes its place in
3 % of them. So an absent term is called present in a few percent of records at most, whatever their length: a price
that grows with the logarithm of their number, as in BIC, would give the power away.

References
----------
.. [1] S. Self, K.-Y. Liang, "Asymptotic properties of maximum likelihood estimators and likelihood ratio tests under
   nonstandard conditions", JASA 82 (1987) 605, case 5.
.. [2] R. B. Davies, "Hypothesis testing when a nuisance parameter is present only under the alternative",
   Biometrika 74 (1987) 33.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field

from allanite.fitting.likelihood import LikelihoodProblem, Maximum
from allanite.lazy_dataclasses import dataclass

__all__ = [
    "MOST_MARKOV",
    "ORDER",
    "PRICE",
    "Letters",
    "TermSearch",
    "all_sets",
    "named",
    "neighbours",
    "ordered",
]

Letters = tuple[str, ...]
Progress = Callable[[float, str], None]

#: What a term must gain in 2 ln L.
PRICE = {"Q": 5.41, "N": 5.41, "B": 5.41, "K": 5.41, "R": 9.5, "G": 10.82}
ORDER = "QNBGKR"
MOST_MARKOV = 2
#: Terms that stand in for each other: exchanged as one step of the search.
_SLOW = ("B", "G", "K", "R")
_START: Letters = ("N", "B", "K")
_NAMES = {
    "Q": "quantization", "N": "white noise", "B": "flicker", "K": "random walk", "R": "ramp",
    "G": "Gauss-Markov", "GG": "two Gauss-Markov terms",
}  # fmt: skip


def ordered(letters: Letters) -> Letters:
    """A set of terms as it is written: from the fastest term to the slowest."""
    return tuple(sorted(letters, key=ORDER.index))


def named(letters: Letters) -> str:
    """A set of terms in words.

    >>> named(("N", "G", "G", "K"))
    'white noise, two Gauss-Markov terms and random walk'
    """
    words = [_NAMES["GG" if s == "G" and letters.count("G") > 1 else s] for s in ORDER if s in letters]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def all_sets() -> list[Letters]:
    """Every candidate; a ramp alone is no noise."""
    sets: list[Letters] = [()]
    for s in ORDER:
        most = MOST_MARKOV if s == "G" else 1
        sets = [(*k, *(s,) * count) for k in sets for count in range(most + 1)]
    return [k for k in sets if set(k) - {"R"}]


def neighbours(letters: Letters) -> list[Letters]:
    """Sets with one term more, one less, or one slow term for another."""

    def room(s: str, among: Letters) -> bool:
        return among.count(s) < (MOST_MARKOV if s == "G" else 1)

    sets = {ordered((*letters, s)) for s in ORDER if room(s, letters)}
    for i, s in enumerate(letters):
        rest = letters[:i] + letters[i + 1 :]
        sets.add(rest)
        if s in _SLOW:
            sets |= {ordered((*rest, t)) for t in _SLOW if t != s and room(t, rest)}
    return sorted(k for k in sets if set(k) - {"R"})


def _holds(letters: Letters, fewer: Letters) -> bool:
    """Whether a set is another one with one term more."""
    return len(letters) == len(fewer) + 1 and all(letters.count(s) >= fewer.count(s) for s in fewer)


@dataclass(slots=True)
class TermSearch:
    """Sets whose likelihood is known, and the way to the best.

    Attributes
    ----------
    problem : LikelihoodProblem
    progress : callable or None
        Told the share done and what is being tried.
    maxima : dict of tuple of str to Maximum
    """

    problem: LikelihoodProblem
    progress: Progress | None = None
    maxima: dict[Letters, Maximum] = field(default_factory=dict)

    def score(self, letters: Letters) -> float:
        """Equation (1)."""
        if letters not in self.maxima:
            if self.progress is not None:  # nobody knows how many steps there are: ever slower towards 1
                self.progress(1 - 1 / (1 + len(self.maxima) / 10), f"trying {named(letters)}")
            below = [m.peak for k, m in self.maxima.items() if _holds(letters, k)]
            self.maxima[letters] = self.problem.maximum(letters, nested=below)
        return 2 * self.maxima[letters].log_likelihood - sum(PRICE[s] for s in letters)

    def best(self) -> Letters:
        """From set to set, always to the best of those one step away, until there is none better.

        All sets one step from the best are known in the end: the runners-up are among them.
        """
        best = _START
        while True:
            nearest = max(neighbours(best), key=self.score)
            if self.score(nearest) <= self.score(best):
                return best
            best = nearest
