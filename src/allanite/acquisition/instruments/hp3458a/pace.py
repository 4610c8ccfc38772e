# SPDX-License-Identifier: BSD-3-Clause
"""Where a reading belongs on the time grid, for a meter that numbers none of them.

Readings that follow one another are counted. The clock of the host is asked only where counting cannot tell: after an
interruption, when a line came twice, when one vanished without a trace. How late a reading comes varies with the host,
but never below the true delay, so the smallest lateness seen lately is the one to compare with. The two clocks drift
apart meanwhile (`Drift`): what is missing in a pause is counted from the last readings before it, at the meter's rate.
"""

from __future__ import annotations

import math
from dataclasses import field

from allanite.acquisition.instruments.hp3458a.drift import Drift
from allanite.lazy_dataclasses import dataclass

__all__ = ["Pace", "PaceJudgement"]

#: Readings, and at most blocks, after which the smallest lateness is taken anew: before its rate is known, the clock of
#: a meter that is off by a hundredth of a percent drifts by a fifth of a period in the first.
WINDOW, WINDOW_BLOCKS = 2000, 64
#: Blocks that must have come before a surplus is believed, and late ones in a row before a loss is.
SETTLED, LATE_RUN = 8, 8
#: Below this period [s of the host] its own delays are as long as the period, and the clock decides nothing.
SHORTEST = 5e-3
#: A meter that was silent for so long [s of the host] beyond three periods may have been switched off and on.
STALL = 2.0
#: A host that works is not late by more than this in each of several blocks [s].
LONG_DELAY = 0.02
#: Part of a period by which a block comes too early for a host that only ever delays.
EARLY = 0.3
FAR = float("inf")
#: Blocks over which the scatter of their lateness is averaged.
MEMORY = 64
#: A new arming begins anywhere in a period of the old one: the variance of that, in periods.
PHASE = 1 / 12


@dataclass(frozen=True, slots=True, kw_only=True)
class PaceJudgement:
    """What the clock says of a block.

    Attributes
    ----------
    surplus, missing : int
        Readings too many in it; readings missing before its end.
    uncertainty : float or None
        Standard uncertainty of `missing` where the clock has told it [readings]; None where it was counted.
    stalled : bool
        The meter was silent for long and speaks again.
    """

    surplus: int = 0
    missing: int = 0
    uncertainty: float | None = None
    stalled: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Earliest:
    """The reading of a window that came earliest for its number."""

    late: float = FAR  # [ns]
    number: int = 0


@dataclass(slots=True, kw_only=True)
class Pace:
    """Count of readings against the clock. Changes as readings come.

    Attributes
    ----------
    period_ns : float
        In the meter's time.
    speed : float or None
        Of the meter's time against the host's. None: there is no clock to compare with; everything is counted.
    count : int
        Number of the next reading.
    """

    period_ns: float
    speed: float | None = 1.0
    count: int = 0
    _origin: int | None = field(default=None, repr=False)
    _before: _Earliest = field(default_factory=lambda: _Earliest(), repr=False)
    _within: _Earliest = field(default_factory=lambda: _Earliest(), repr=False)
    _drift: Drift = field(default_factory=Drift, repr=False)
    _delay: float = field(default=0.0, repr=False)  # mean square of lateness beyond the usual [ns^2]
    _begun: int = field(default=0, repr=False)  # number of the first reading of the window
    _blocks: int = field(default=0, repr=False)
    _seen: int = field(default=0, repr=False)
    _late: int = field(default=0, repr=False)
    _least_late: float = field(default=FAR, repr=False)

    def place(
        self,
        n: int,
        now: int,
        *,
        rejected: int = 0,
        awaited: bool = True,
        silent: bool = False,
        twins: int = 0,
    ) -> PaceJudgement:
        """Judge `n` readings that end at `now` [ns of the meter's time]; `rejected` lines stood among them.

        `awaited`: the host waited for the last of them, so that its lateness is not that of a queue. `silent`: they
        are all that came since a silence, so that what is missing now will not come any more. `twins`: readings equal
        to the one before them.
        """
        if self._origin is None or not self._seen:
            # The first readings after a start or a pause set the scale of lateness.
            return self._anchor(n, now, rejected)
        if self.speed is None:
            return PaceJudgement(missing=rejected)
        late = self._lateness(n, now)
        usual = self._usual(n, late)
        if awaited and late - usual > STALL * 1e9 * self.speed + 3 * self.period_ns:
            return PaceJudgement(stalled=True)
        periods = (late - usual) / self.period_ns
        if rejected or silent:
            self._seen += 1
            if not (awaited and self.judges):
                return PaceJudgement(missing=rejected)
            missing = max(round(periods), 0)
            return PaceJudgement(missing=missing, uncertainty=self._unsure(missing) if missing else None)
        if periods < -EARLY and self._seen >= SETTLED and self.judges:
            # Too early for its number. With an equal pair in sight less of it is proof; else the next block decides.
            sure = periods < -1 + EARLY or twins == max(round(-periods), 1)
            return PaceJudgement(surplus=max(round(-periods), 1) if sure else 0)
        missing = self._lost(late, periods) if awaited else 0
        self._learn(late - missing * self.period_ns, n + missing)
        if awaited and not missing:
            self._delay += ((late - usual) ** 2 - self._delay) / MEMORY
        return PaceJudgement(missing=missing, uncertainty=self._unsure(missing) if missing else None)

    @property
    def judges(self) -> bool:
        """The period is long enough for the clock to tell a single reading."""
        return self.speed is not None and self.period_ns * 1e-9 / self.speed >= SHORTEST

    def advance(self, n: int, missing: int = 0) -> None:
        """Count `n` readings given and `missing` that will never come."""
        self.count += n + missing

    def pause(self) -> None:
        """What follows comes after an interruption of unknown length."""
        self._seen = 0

    def rebase(self) -> None:
        """The usual lateness was not what it seemed; learn it anew without moving the count."""
        self._drift.restart()
        self._before = self._within = _Earliest()
        self._blocks, self._seen, self._late = 0, 1, 0

    def set_period(self, period_ns: float) -> None:
        """Go on with another period: the place on the grid stays where it is."""
        if self._origin is not None:
            self._origin += round(self.count * (self.period_ns - period_ns))
        self.period_ns = period_ns

    def longest(self, readings: int) -> float:
        """Time [ns of the meter's time] after which so many readings have been made for certain."""
        rate = self._drift.error()
        return readings * self.period_ns * (1 + rate.value + 3 * rate.uncertainty)

    def _lateness(self, n: int, now: int) -> float:
        assert self._origin is not None  # noqa: S101
        return now - self._origin - (self.count + n) * self.period_ns

    def _anchor(self, n: int, now: int, rejected: int) -> PaceJudgement:
        missing, unsure = rejected, None
        if self._origin is None:
            self._origin = round(now - (self.count + n + missing) * self.period_ns)
        elif self.speed is not None:
            # At least the reading during which the pause fell is gone.
            missing = max(round(self._due_in_pause(n, now)), 1)
            unsure = math.sqrt(PHASE + self._unsure(missing) ** 2)
        else:
            missing += 1
        self.rebase()
        late = now - self._origin - (self.count + n + missing) * self.period_ns
        self._within = _Earliest(late=late, number=self.count + n + missing)
        return PaceJudgement(missing=missing, uncertainty=unsure)

    def _due_in_pause(self, n: int, now: int) -> float:
        """Readings that the meter would have made between the last one and `n` that end now."""
        late = self._lateness(n, now)
        return (late - self._usual(n, late)) / (self.period_ns * (1 + self._drift.error().value))

    def _usual(self, n: int, otherwise: float) -> float:
        """The smallest lateness seen lately, as the two clocks have drifted apart up to the last of `n` readings."""
        each = self._drift.error().value * self.period_ns  # by which a reading is later than the one before
        earliest = [e for e in (self._before, self._within) if e.late < FAR]
        return min((e.late + each * (self.count + n - e.number) for e in earliest), default=otherwise)

    def _unsure(self, missing: int) -> float:
        """Standard uncertainty of so many readings told by the clock: delays of the host, and the meter's rate."""
        return math.hypot(math.sqrt(self._delay) / self.period_ns, missing * self._drift.error().uncertainty)

    def _learn(self, late: float, n: int) -> None:
        self._seen += 1
        if late <= self._within.late:
            self._within = _Earliest(late=late, number=self.count + n)
        self._blocks += 1
        if self._blocks >= WINDOW_BLOCKS or self.count - self._begun >= WINDOW:
            self._begun = self.count
            self._drift.add(self._within.number, self._within.late, self.period_ns)
            self._before, self._within, self._blocks = self._within, _Earliest(), 0

    def _lost(self, late: float, periods: float) -> int:
        """Readings that vanished: so many blocks in a row were all late by them."""
        assert self.speed is not None  # noqa: S101
        if periods < max(0.75, LONG_DELAY * 1e9 * self.speed / self.period_ns * (not self.judges)):
            self._late, self._least_late = 0, FAR
            return 0
        self._late += 1
        self._least_late = min(self._least_late, periods)
        if self._late < LATE_RUN:
            return 0
        missing = round(self._least_late)
        self._late, self._least_late = 0, FAR
        return missing
