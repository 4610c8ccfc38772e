# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to residuals: does the noise model describe this record, and is there something that it does not know?

A check that fails either widens the interval, by Birge's ratio, or takes the result away (`grave`). Widening is for
errors that come out anew each time, like the pointing of each dwell: their size shows in the scatter.

References
----------
.. [1] R. T. Birge, "The calculation of errors by the method of least squares", Phys. Rev. 40 (1932) 207.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol, Self, TypeVar

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.result import Result

__all__ = [
    "SEEN",
    "CheckResult",
    "ResidualTest",
    "Tested",
    "alarm",
    "grave",
    "inflation_of",
    "scatter_check",
    "scatter_words",
    "size_check",
    "size_words",
]

#: Something is seen from so many standard deviations on.
SEEN = 3.0
#: Below this probability a check did not pass. Eight checks: a good record is blamed in less than one of a hundred.
ALARM = 1e-3
#: Below this one the scatter widens the interval.
SCATTER_ALARM = 1e-2
#: Scatter or noise beyond so many times the model's: the model is not that of this record. Too little noise takes
#: nothing away from a result, whose interval is too wide then; but it is said.
FOREIGN = 2.0


class Tested(Protocol):
    """A question that was put to residuals, whatever it is called."""

    @property
    def passed(self) -> bool: ...

    @property
    def widens(self) -> bool: ...

    @property
    def ratio(self) -> float: ...


T = TypeVar("T", bound=Tested)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckResult(Result):
    """The numbers of a question put to residuals; each analysis says what it asked.

    Attributes
    ----------
    statistic, dof : float
        Chi-square and its expectation if the model holds.
    p : float
        Probability of one at least as unlikely if the model holds.
    passed : bool
        The residuals agree with the model.
    widens : bool
        Where it fails by no more than a factor of two, it widens the interval and leaves the result standing.
    tries : int
        The statistic is the largest of so many; p is its own probability times that number [Bonferroni].
    two_sided : bool
        p is twice that of the nearer tail: too small is as telling as too large.
    """

    statistic: float
    dof: float
    p: float
    passed: bool
    widens: bool = False
    tries: int = 1
    two_sided: bool = False

    @classmethod
    def of(cls, kind: object, test: CheckResult, **asked: object) -> Self:
        """The numbers of another with what was asked: its kind, and what else the class has."""
        numbers = {name: getattr(test, name) for name in CheckResult.__dataclass_fields__}
        return cls(kind=kind, **numbers, **asked)  # type: ignore[arg-type, call-arg]  # of a class with a kind

    @property
    def ratio(self) -> float:
        """Size of the residuals over what the model says."""
        return math.sqrt(self.statistic / self.dof) if self.dof > 0 else 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualTest(CheckResult):
    """One question put to the residuals.

    Attributes
    ----------
    name : str
        What was asked.
    says : str
        What it means and what to do, when it did not pass.
    """

    name: str
    says: str


def alarm(name: str, statistic: float, dof: float, says: str = "", *, looks: int = 1) -> ResidualTest:
    """A check that takes the result away; the best of several `looks` is charged for all of them."""
    tries = max(looks, 1)
    p = min(chi_square_tail(statistic, dof) * tries, 1.0)
    return ResidualTest(
        name=name, statistic=statistic, dof=dof, p=p, passed=p >= ALARM, says=says, tries=tries
    )


def size_check(chi2: float, dof: int) -> ResidualTest:
    """Is the noise of the record that of the model? Too little of it is as telling as too much."""
    above = chi_square_tail(chi2, dof) if dof > 0 else 0.5
    p = min(2 * min(above, 1 - above), 1.0)
    return ResidualTest(
        name="size of the noise",
        statistic=chi2,
        dof=dof,
        p=p,
        passed=p >= ALARM,
        says=size_words(math.sqrt(chi2 / dof) if dof > 0 else 1.0),
        widens=True,
        two_sided=True,
    )


def size_words(ratio: float) -> str:
    """What a noise of so many times that of the model means."""
    narrower = ", and the interval is wider than necessary" if ratio < 1 else ""
    foreign = "" if 1 / FOREIGN <= ratio <= FOREIGN else ": is it the model of this sensor, in this unit?"
    return f"the noise of this record is {ratio:.3g} times that of the model{narrower}{foreign}"


def scatter_check(what: str, chi2: float, dof: int, reasons: str = "") -> ResidualTest:
    """Do the means of the `what` scatter as the model says?"""
    p = chi_square_tail(chi2, dof) if dof > 0 else 1.0
    return ResidualTest(
        name=f"scatter of the {what}",
        statistic=chi2,
        dof=dof,
        p=p,
        passed=p >= SCATTER_ALARM,
        says=scatter_words(what, math.sqrt(chi2 / max(dof, 1)), reasons),
        widens=True,
    )


def scatter_words(what: str, ratio: float, reasons: str) -> str:
    """What means that scatter more than the model says are a sign of."""
    return f"the {what} scatter {ratio:.2f} times as much as the noise model predicts: {reasons}"


def inflation_of(checks: Sequence[Tested]) -> float:
    """Birge's ratio [1], of the check that asks for more; 1 where none does."""
    return max([1.0, *(c.ratio for c in checks if c.widens and not c.passed)])


def grave(checks: Sequence[T]) -> list[T]:
    """Checks that take the result away, not just its precision."""
    failed = [c for c in checks if not c.passed]
    return [c for c in failed if not c.widens or c.ratio > FOREIGN]
